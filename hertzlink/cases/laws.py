"""The contact laws of a chain of a case, which hold between its beads."""

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field

from hertzlink.cases.faults import Fault, fault_of
from hertzlink.cases.parts import Force, Length, Modulus, Number, Part, World
from particles.laws.choose import computed_law
from particles.laws.computed import ComputedLaw
from particles.laws.law import ContactLaw, PowerLaw, TabulatedLaw
from particles.laws.yielding import JacksonGreen, Thornton, YieldingLaw


class OwnPowerLaw(Part):
    """F = k δⁿ for all contacts between beads."""

    kind: Literal["power_law"]
    stiffness: Number
    exponent: Number = 1.5
    largest: Length | None = None
    name: str | None = None
    caution: str | None = Field(None, description="a text that each run repeats as a warning")

    def make(self, world: World) -> PowerLaw:
        return PowerLaw(**self.given("kind"))


class OwnTable(Part):
    """A table of forces over approaches, for all contacts between beads."""

    kind: Literal["tabulated_law"]
    approaches: list[Length]
    forces: list[Force]
    name: str | None = None
    caution: str | None = Field(None, description="a text that each run repeats as a warning")

    def make(self, world: World) -> TabulatedLaw:
        own = self.given("kind", "approaches", "forces")
        return TabulatedLaw(tuple(self.approaches), tuple(self.forces), **own)


class StoredLaw(Part):
    """The points of a law that was computed, as results hold them."""

    kind: Literal["computed_law"]
    approaches: list[Length]
    forces: list[Force]
    name: str | None = None
    caution: str | None = None
    largest: Length | None = None
    smallest: Length | None = None
    error: Number | None = None
    order: Number | None = None
    formula: Force | None = None

    def make(self, world: World) -> ComputedLaw:
        own = self.given("kind", "approaches", "forces")
        return ComputedLaw(tuple(self.approaches), tuple(self.forces), **own)


class NumericalLaw(Part):
    """A law that is computed for two of the chain's beads, by finite or boundary elements."""

    kind: Literal["numerical"]
    max_force: Force | None = None
    max_approach: Length | None = None
    method: Literal["axisymmetric", "half-spaces", "plane strain", "plane stress", "three-dimensional"] | None = None

    def of_beads(self, beads: Sequence[Any]) -> ContactLaw:
        """The law of equal beads; a Fault for beads that differ."""
        if any(one != beads[0] for one in beads):
            raise Fault(("law", "kind"), "computes one law, so all beads and the striker must be equal")
        try:
            return computed_law(beads[0], beads[0], **self.given("kind"))
        except ValueError as error:
            raise fault_of(str(error), self.names(), ("law",)) from error


class YieldingPart(Part):
    """How all contacts yield; without a yield strength, that of the softer material of each."""

    makes: ClassVar[type[YieldingLaw]]
    yield_strength: Modulus | None = None

    def make(self, world: World) -> YieldingLaw:
        return self.makes(self.yield_strength)


class ThorntonPart(YieldingPart):
    """Thornton's law."""

    makes = Thornton
    kind: Literal["thornton"]


class JacksonGreenPart(YieldingPart):
    """Jackson and Green's fits."""

    makes = JacksonGreen
    kind: Literal["jackson_green"]


OneLaw = Annotated[
    OwnPowerLaw | OwnTable | StoredLaw | NumericalLaw | ThorntonPart | JacksonGreenPart, Discriminator("kind")
]
