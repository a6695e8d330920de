"""The structures of a case that are no plates, and how structures are damped."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from hertzlink.cases.declared import (
    SPECIAL,
    Data,
    Declared,
    described_by,
    table_of,
    tables_of,
    union_of,
)
from hertzlink.cases.faults import Fault
from hertzlink.cases.parts import Part, World, either, file_of
from plates.plate import Plate
from structures.bodies.rod import rod
from structures.damping import Rayleigh, StandardLinearSolid, Viscous
from structures.damping import damped as with_damping
from structures.described import of_family
from structures.imported import from_matrices, from_modes
from structures.reduction import reduce
from structures.structure import Structure


class LinearSolid(Declared):
    """Zener's standard linear solid, in a structure of all of it or of one layer."""

    layer: Annotated[int, Field(ge=0)] | None = Field(
        None, description="the layer, or material, of a structure, counted from 0"
    )

    def make(self, world: World) -> StandardLinearSolid:
        if self.layer is not None:
            raise Fault(("layer",), "is for structures; a bead has no layers")
        solid: StandardLinearSolid = super().make(world)
        return solid


def is_early(part: Declared) -> bool:
    """Return whether a damping acts before the structure is reduced, on its matrices or on one of its layers."""
    return issubclass(part.of.makes, Rayleigh) or getattr(part, "layer", None) is not None


def damped(part: Declared, structure: Structure, world: World) -> Structure:
    """Return the structure with a damping."""
    return with_damping(structure, part.of.target(**part.arguments(world)), getattr(part, "layer", None))


class Reduction(Declared):
    """How large structures are replaced by oscillators."""

    named_so = "Reduction"
    optional = dict.fromkeys(("until",), "")
    without = ("structure", "keep_field")

    if TYPE_CHECKING:
        until: float | None


Reduce: Any = either(
    "must be true, false, or a table such as { tolerance = 0.01 }",
    word=(bool, bool), settings=(dict | Reduction, table_of(described_by(reduce), base=Reduction)),
)  # fmt: skip


class Body(Part):
    """What a chain faces."""

    @property
    def contacts(self) -> int:
        """The number of points that chains face."""
        return 1

    def make(self, world: World) -> Structure | None:
        raise NotImplementedError


class Nothing(Body):
    """Nothing: the last bead flies off."""

    kind: Literal["nothing"]

    def make(self, world: World) -> None:
        return None


class Built(Declared, Body):
    """What a described function builds."""

    damping: list[Any] = Field(default_factory=list)
    reduce: Reduce | None = Field(None, description="as in [run], for this structure alone")

    @classmethod
    def others(cls) -> Data:
        return {"damping": (list[union_of(Viscous)], Field(default_factory=list))}  # type: ignore[misc]

    @property
    def contacts(self) -> int:
        return 2 if getattr(self, "base", "") == "contact" else 1


class Rod(Built):
    """A rod."""

    if TYPE_CHECKING:
        elements: int | None


class Imported(Built):
    """A body from files of another program or of a test."""

    without = ("shapes",)


class FromMatrices(Imported):
    """A body from the matrices of another program."""

    apart = ("damping",)
    damping_matrix: str | None = Field(None, description='the file of a damping matrix, such as "plate.mtx"')

    def arguments(self, world: World) -> Data:
        if self.damping_matrix is None:
            return super().arguments(world)
        return super().arguments(world) | {"damping": file_of(self.damping_matrix, world, "damping_matrix")}


SPECIAL.update({
    from_matrices: FromMatrices, from_modes: Imported, rod: Rod,
    StandardLinearSolid: LinearSolid,
})  # fmt: skip


def structure_tables() -> list[type[Built]]:
    """Return the tables of all structures that are described."""
    built = [built_in for built_in in (*of_family(Structure), *of_family(Plate)) if built_in.builds]
    return tables_of(built, "kind", Built)  # type: ignore[return-value]
