"""The structures of a case that are no plates, and how structures are damped."""

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from hertzlink.cases.declared import SPECIAL, Data, Declared, fields_of, quantity_of, refused, tables_of
from hertzlink.cases.parts import (
    Duration,
    Force,
    Length,
    Number,
    Part,
    World,
    forms,
    made,
)
from hertzlink.cases.units import Unit
from plates.plate import Plate
from structures import damping, quantities
from structures.closing import Closing, check_gap
from structures.cylinder import layered_cylinder
from structures.described import of_family
from structures.elasticity import Foundation
from structures.rod import rod
from structures.solid import solid
from structures.stepping import CentralDifference, GeneralisedAlpha, Newmark
from structures.structure import Structure

OF_ALL = ("damping", "reduce", "stepper")
"""Entries that all structures have, and no builder takes."""


class Damping(Part):
    """A damping of the structure."""

    early: ClassVar[bool] = False
    """Whether it acts on the structure before that is reduced."""

    @property
    def is_early(self) -> bool:
        """True if it acts on the structure before that is reduced."""
        return self.early

    def damped(self, structure: Structure) -> Structure:
        """Return the structure with this damping."""
        raise NotImplementedError


class Rayleigh(Damping):
    """α M + β K."""

    early = True
    kind: Literal["rayleigh"]
    mass_rate: Annotated[float, Unit.noted(quantities.Rate)] = 0.0
    stiffness_time: Duration = 0.0

    def damped(self, structure: Structure) -> Structure:
        return damping.damped(structure, damping.Rayleigh(self.mass_rate, self.stiffness_time))


class Modal(Damping):
    """A damping ratio for all modes of the reduced structure, or one for each."""

    kind: Literal["modal"]
    ratio: Annotated[
        Annotated[Number, Tag("one")] | Annotated[list[Number], Tag("many")],
        forms(lambda given: "many" if isinstance(given, list) else "one", "must be a number, or a list of numbers"),
    ]

    def damped(self, structure: Structure) -> Structure:
        return damping.damped(structure, damping.Modal(self.ratio))


class LossFactor(Damping):
    """A structural loss factor."""

    kind: Literal["loss_factor"]
    factor: Number

    def damped(self, structure: Structure) -> Structure:
        if not 0.0 <= self.factor <= 1.0:
            raise ValueError(f"factor = {self.factor!r}: must lie between 0 and 1; it is η = 2ζ, not a percentage")
        return damping.damped(structure, damping.Modal(self.factor / 2.0))


class LinearSolid(Damping):
    """Zener's standard linear solid, of the whole structure or of one layer."""

    kind: Literal["standard_linear_solid"]
    share: Number
    time: Duration
    modulus: Literal["relaxed", "instantaneous"] = "relaxed"
    layer: Annotated[int, Field(ge=0)] | None = Field(None, description="the layer, or material, counted from 0")

    @property
    def is_early(self) -> bool:
        """That of a layer: a reduced structure has none."""
        return self.layer is not None

    def damped(self, structure: Structure) -> Structure:
        solid = damping.StandardLinearSolid(self.share, self.time, self.modulus)
        part = None if self.layer is None else damping.part_of_layer(structure, self.layer)
        return damping.damped(structure, solid, part)


OneDamping = Annotated[Rayleigh | Modal | LossFactor | LinearSolid, Discriminator("kind")]


class Stepping(Part):
    """How a structure is moved in time. Such a structure is not reduced."""

    makes: ClassVar[Any]

    def make(self, world: World) -> Any:
        """Return the name of a stepper, or a function of a structure and a window."""
        given = self.given("kind")
        return partial(self.makes, **given) if given else str(getattr(self, "kind")).replace("_", "-")  # noqa: B009


class NewmarkPart(Stepping):
    """Newmark's method."""

    makes = Newmark
    kind: Literal["newmark"]
    beta: Annotated[Number, Field(ge=0.0)] | None = None
    gamma: Annotated[Number, Field(ge=0.5)] | None = None


class GeneralisedAlphaPart(Stepping):
    """The generalised-α method."""

    makes = GeneralisedAlpha
    kind: Literal["generalised_alpha"]
    spectral_radius: Annotated[Number, Field(ge=0.0, le=1.0)] | None = None


class CentralDifferencePart(Stepping):
    """Explicit central differences with a lumped mass."""

    makes = CentralDifference
    kind: Literal["central_difference"]


OneStepper = Annotated[NewmarkPart | GeneralisedAlphaPart | CentralDifferencePart, Discriminator("kind")]


class Reduction(Part):
    """How large structures are replaced by oscillators."""

    tolerance: Number | None = None
    pulse: Duration | None = None
    largest: Annotated[int, Field(ge=1)] | None = None
    until: Duration | None = None


def _reduced(given: Any) -> str | None:
    if isinstance(given, bool):
        return "yes or no"
    return "settings" if isinstance(given, dict | Reduction) else None


Reduce = Annotated[
    Annotated[bool, Tag("yes or no")] | Annotated[Reduction, Tag("settings")],
    forms(_reduced, "must be true, false, or a table such as { tolerance = 0.01 }"),
]


class Body(Part):
    """What a chain faces."""

    damping: list[OneDamping] = Field(default_factory=list)
    reduce: Reduce | None = Field(None, description="as in [run], for this structure alone")
    stepper: OneStepper | None = Field(None, description='how it is moved in time, such as { kind = "newmark" }')

    @property
    def contacts(self) -> int:
        """The number of points that chains face."""
        return 1

    def make(self, world: World) -> Structure | None:
        raise NotImplementedError

    def in_time(self, structure: Structure) -> Any:
        """Return what moves in a run: the structure, or the participant that its gaps or its stepper make of it."""
        return structure


class Nothing(Body):
    """Nothing: the last bead flies off."""

    kind: Literal["nothing"]

    def make(self, world: World) -> None:
        return None


class Built(Declared, Body):
    """What a described function builds."""

    @property
    def contacts(self) -> int:
        return 2 if getattr(self, "base", "") == "contact" else 1

    @classmethod
    def entries(cls, given: Mapping[str, Any]) -> Data:
        """Return the entries from the origin of a structure; raise a ValueError for what no case can hold."""
        if "opening" in given:
            raise refused("structure.opening", "gaps that are neither cracks of a rod nor delaminations of a plate")
        return fields_of(given, cls.of, "structure")


class Crack(Part):
    """A crack between two layers of a rod. It closes."""

    after: Annotated[int, Field(ge=0, description="the layer before the crack, counted from 0")]
    opening: Length = 0.0
    preload: Force = 0.0

    def make(self, world: World) -> int:
        check_gap(self.opening, self.preload)
        return self.after


class Rod(Built):
    """A rod, whose cracks close."""

    cracks: list[Crack] = Field(default_factory=list)

    if TYPE_CHECKING:
        elements: int | None

    def arguments(self, world: World) -> Data:
        return super().arguments(world) | {
            "cracks": [made(one, world, ("cracks", i)) for i, one in enumerate(self.cracks)]
        }

    def in_time(self, structure: Structure) -> Any:
        cracks = sorted(self.cracks, key=lambda one: one.after)
        if not cracks:
            return structure
        return Closing(structure, [one.opening for one in cracks], [one.preload for one in cracks])

    @classmethod
    def entries(cls, given: Mapping[str, Any]) -> Data:
        counts = set(given["elements"])
        rest = {name: given[name] for name in ("layers", "base")}
        data = super().entries(rest | ({"elements": counts.pop()} if len(counts) == 1 else {}))
        if "cracks" in given:
            if "opening" not in given:
                raise refused("structure.cracks", "cracks that nothing closes")
            gaps = zip(given["cracks"], given["opening"], given["preload"], strict=True)
            data["cracks"] = [{"after": i, "opening": opening, "preload": load} for i, opening, load in gaps]
        elif "opening" in given:
            super().entries(given)
        return data


class LayeredCylinder(Built):
    """A cylinder, whose base may be given by the stiffness of its ground."""

    foundation: Annotated[float, quantity_of(Foundation, "stiffness")] | None = Field(
        None, description="stiffness of elastic ground in place of a base"
    )

    def arguments(self, world: World) -> Data:
        ground = {} if self.foundation is None else {"base": Foundation(self.foundation)}
        return super().arguments(world) | ground


class Solid(Built):
    """A body from a mesh file, of one material."""

    @classmethod
    def entries(cls, given: Mapping[str, Any]) -> Data:
        if given["mesh"] == "meshio.Mesh" or len(given["materials"]) != 1:
            raise refused("structure.mesh", "a mesh in memory, or of several materials")
        return super().entries({**given, "material": given["materials"][0]})


SPECIAL.update({rod: Rod, layered_cylinder: LayeredCylinder, solid: Solid})


def structure_tables() -> list[type[Built]]:
    """Return the tables of all structures that are described."""
    # A function that changes a structure builds none.
    made = [*of_family(Structure), *of_family(Plate)]
    built = [one for one in made if all(of.type is not Structure for of in one.parameters.values())]
    return tables_of(built, "kind", Built)  # type: ignore[return-value]
