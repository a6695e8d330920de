"""The chain of a case: beads, what strikes them, losses and contact laws."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, Tag, create_model

from hertzlink.cases.declared import (
    MOST_BEADS,
    SPECIAL,
    Counted,
    Declared,
    described_by,
    members,
    table_of,
    tables_of,
    union,
    union_of,
)
from hertzlink.cases.entry_paths import Path
from hertzlink.cases.faults import Fault, fault_of
from hertzlink.cases.parts import Length, Part, World, either, forms, made
from particles.bead import Bead, drop_speed
from particles.chain import Chain
from particles.deformable.deformable_chain import DeformableChain
from particles.excitation import Excitation, SpringLoaded
from particles.laws.axisymmetric import computed_law
from particles.laws.law import ContactLaw
from particles.laws.yielding import YieldingLaw

CHAIN = described_by(DeformableChain)

BEAD = 'a bead, such as { shape = "sphere", diameter = "4.76 mm", material = "steel 440C" }'


class Spring(Declared):
    """A spring that throws a striker, by default a bead like the chain's."""

    optional: ClassVar[Mapping[str, str]] = {"striker": f"{BEAD}; by default the chain's"}

    def make(self, world: World) -> SpringLoaded:
        return SpringLoaded(**{"striker": world.bead, **self.arguments(world)})


SPECIAL[SpringLoaded] = Spring


class NumericalLaw(Declared):
    """A law that is computed for two of the chain's beads, by finite elements."""

    named_so = "NumericalLaw"
    without = ("first", "second")
    kind: Literal["numerical"]

    def of_beads(self, beads: Sequence[Any]) -> ContactLaw:
        """Return the law of equal beads; a Fault for beads that differ."""
        if any(bead != beads[0] for bead in beads):
            raise Fault(("law", "kind"), "computes one law, so all beads and the striker must be equal")
        try:
            return computed_law(beads[0], beads[0], **self.given("kind"))
        except ValueError as error:
            raise fault_of(str(error), self.names(), ("law",)) from error


def chain_table() -> type["ChainPart"]:
    """Return the table of a chain with all parts that are described."""
    bead: Any = union_of(Bead)
    numerical = table_of(described_by(computed_law), base=NumericalLaw)
    laws = union([*tables_of([*members(ContactLaw), *members(YieldingLaw)]), numerical])
    beads = either(
        "must be a whole number of beads, such as 20, or a list of beads",
        count=(int, Annotated[int, Field(ge=1, le=MOST_BEADS)]),
        list=(list, Annotated[list[bead], Field(min_length=1)]),
    )  # fmt: skip
    model_fields = ChainPart.model_fields
    base: type[ChainPart] = create_model(
        "ChainPart",
        __base__=ChainPart,
        __doc__=ChainPart.__doc__,
        beads=(beads, model_fields["beads"]),
        bead=(bead | None, model_fields["bead"]),
        striker=(_striker(bead, union_of(Excitation)), "bead"),
        law=(laws | None, None),
    )
    # A chain of beads that deform has what any chain has, and more.
    return table_of(CHAIN, base=base)  # type: ignore[return-value]


def _what_strikes(value: Any) -> str | None:
    if isinstance(value, str):
        return "word"
    if isinstance(value, dict | Part):
        has_kind = "kind" in value if isinstance(value, dict) else hasattr(value, "kind")
        return "moved" if has_kind else "body"
    return None


def _striker(bead: Any, moved: Any) -> Any:
    return Annotated[
        Annotated[Literal["bead", "none"], Tag("word")] | Annotated[bead, Tag("body")] | Annotated[moved, Tag("moved")],
        forms(_what_strikes, f'must be "bead", "none", {BEAD}, or a table with a kind, such as "spring_loaded"'),
    ]


class Seat(Part):
    """A contact point: of which structure, and which of its points; both are counted from 0."""

    structure: Annotated[int, Field(ge=0)] = 0
    point: Annotated[int, Field(ge=0)] = 0


class ChainPart(Declared):
    """The chain, from its struck end."""

    named_so = "ChainPart"
    without, apart = ("vibrations",), ("beads", "striker", "law")

    beads: int | list[Counted] = Field(description="a number of beads, such as 20, or a list of beads")
    bead: Counted | None = Field(None, description=BEAD)
    repeat: Annotated[int, Field(ge=1, le=MOST_BEADS)] = 1
    striker: str | Declared = "bead"
    drop_height: Length | None = None
    law: Part | None = None
    on: Seat | None = Field(None, description="what the last bead faces, such as { structure = 0, point = 1 }")
    behind: Seat | None = Field(None, description="what the first bead faces with its struck side, as on")

    if TYPE_CHECKING:
        impact_speed: float | None
        modes: int | None
        damping: Part | None

    named: ClassVar[Mapping[str, Path]] = {
        "height": ("drop_height",),
        "stiffness": ("striker", "stiffness"),
        "ratio": ("damping", "ratio"),
    }

    def make(self, world: World) -> Chain:
        bead = None if self.bead is None else made(self.bead, world, ("bead",))
        beads = self._row(world, bead)
        if self.damping is not None and self.modes is None:
            raise Fault(("damping",), "acts inside beads that deform; give modes as well, such as modes = 8")
        arguments = self.arguments(world)
        striker = self._striker(world, bead or beads[0])
        arguments |= {"impact_speed": self._speed(), "law": self._law(world, beads, striker)}
        return (Chain if self.modes is None else DeformableChain)(beads, striker, **arguments)

    @property
    def count(self) -> int:
        """The number of beads."""
        beads = self.beads if isinstance(self.beads, int) else sum(bead.count for bead in self.beads)
        return beads * self.repeat

    def _law(self, world: World, beads: list[Bead], striker: Bead | Excitation | None) -> Any:
        if self.law is None:
            return None
        if isinstance(self.law, NumericalLaw):
            body = getattr(striker, "striker", None) if isinstance(striker, Excitation) else striker
            return self.law.of_beads(beads if body is None else [body, *beads])
        law: ContactLaw | YieldingLaw = made(self.law, world, ("law",))
        return law

    def _row(self, world: World, bead: Bead | None) -> list[Bead]:
        if isinstance(self.beads, int):
            if bead is None:
                raise Fault(("bead",), f"is missing; give {BEAD}")
            row = [bead] * self.beads
        else:
            row = []
            beads_by_part: dict[Counted, Bead] = {}
            for i, part in enumerate(self.beads):
                alike = part.model_copy(update={"count": 1})
                if alike not in beads_by_part:
                    beads_by_part[alike] = bead if alike == self.bead and bead else made(part, world, ("beads", i))
                row += [beads_by_part[alike]] * part.count
        if len(row) * self.repeat > MOST_BEADS:
            raise Fault(("repeat",), f"{self.repeat} makes {len(row) * self.repeat} beads; at most {MOST_BEADS}")
        return row * self.repeat

    def _striker(self, world: World, bead: Bead) -> Bead | Excitation | None:
        if isinstance(self.striker, str):
            return bead if self.striker == "bead" else None
        striker: Bead | Excitation = made(self.striker, replace(world, bead=bead), ("striker",))
        return striker

    def _speed(self) -> float | None:
        if self.drop_height is not None:
            if self.impact_speed is not None:
                raise Fault(("drop_height",), "gives the impact speed; leave out impact_speed")
            return drop_speed(self.drop_height)
        # A chain that nothing strikes may start at rest.
        needs = self.striker != "none" and isinstance(self.striker, str | Counted)
        if self.impact_speed is None and needs:
            raise Fault(("impact_speed",), 'is missing; give a speed, such as "0.31 m/s", or a drop_height')
        return self.impact_speed
