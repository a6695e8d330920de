"""The plates of a case."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, Tag

from hertzlink.cases import materials as _materials  # noqa: F401  for its forms
from hertzlink.cases.bodies import Built
from hertzlink.cases.declared import SPECIAL, Data, Declared, described_by, table_of
from hertzlink.cases.entry_paths import Path
from hertzlink.cases.faults import Fault
from hertzlink.cases.parts import Length, Part, World, either, file_of, forms, made
from plates.additions import PointMass
from plates.builders import kirchhoff_plate, mindlin_panel, mindlin_plate
from plates.half_plane import infinite_plate
from plates.laminate import Laminate
from plates.plate import Plate
from plates.section import Section
from plates.shapes.outline import Outline, circle
from structures.structure import Structure

Place = Annotated[list[Length], Field(min_length=2, max_length=2)]
Places = Annotated[
    Annotated[Place, Tag("one")] | Annotated[list[Place], Field(min_length=1), Tag("many")],
    forms(lambda value: "many" if isinstance(value, list) and value and isinstance(value[0], list) else "one", ""),
]
Face = Literal["front", "back"]
Faces: Any = either(one=(object, Face), many=(list, list[Face]))


class MassPart(Declared):
    """A point mass."""

    without = ("x", "y")
    at: Place

    def arguments(self, world: World) -> Data:
        return super().arguments(world) | {"x": self.at[0], "y": self.at[1]}


SPECIAL[PointMass] = MassPart

ONE_MATERIAL = {"thickness": 'a length, such as "2.29 mm"', "material": 'a material, such as "aluminium 6061"'}

WALLS = {"plies": described_by(Laminate), "bending": described_by(Section)}
"""Walls with a thickness of their own, by an entry that each alone has."""


def _wall(given: Any) -> str | None:
    entries = type(given).model_fields if isinstance(given, Part) else given
    return WALLS["bending" if "bending" in entries else "plies"].kind if isinstance(entries, dict) else None


# A tag that is also the name of an entry would stand in the paths of messages.
Wall: Any = Annotated[
    Annotated[table_of(WALLS["plies"]), Tag(WALLS["plies"].kind)]
    | Annotated[table_of(WALLS["bending"]), Tag(WALLS["bending"].kind)],
    forms(_wall, "must be a table with plies, or with bending, shear, mass, rotary_inertia, thickness and struck"),
]


class Walled(Built):
    """A plate of one material, or of a wall with a thickness of its own."""

    optional = dict.fromkeys(ONE_MATERIAL, "")
    thickness: float | None = None
    material: Any = None
    wall: Wall | None = Field(  # type: ignore[valid-type]
        None, description="a laminate or a section, in place of thickness and material"
    )

    def arguments(self, world: World) -> Data:
        for name, what in ONE_MATERIAL.items():
            if self.wall is None and name not in self.given():
                raise Fault((name,), f"is missing; give {what}, or a wall")
            if self.wall is not None and name in self.given():
                raise Fault((name,), "belongs to a wall of one material; leave it out, or leave out wall")
        wall = {} if self.wall is None else {"thickness": None, "material": made(self.wall, world, ("wall",))}
        return super().arguments(world) | wall


class PlateBody(Walled):
    """What all meshed plates have in common."""

    at: Places = Field(description='the point that is struck, such as ["60 mm", "457 mm"], or a list of points')
    face: Faces = "front"

    named: ClassVar[Mapping[str, Path]] = {
        "x": ("at", 0),
        "y": ("at", 1),
        "x, y": ("at",),
    }

    if TYPE_CHECKING:
        additions: list[Any]

    def plate(self, world: World) -> Plate:
        """Return the plate, not yet struck."""
        plate: Plate = self.of.target(**self.arguments(world))
        return plate

    def make(self, world: World) -> Structure:
        plate = self.plate(world)
        if isinstance(self.at[0], list):
            x, y = zip(*self.at, strict=True)
            return plate.at(list(x), list(y), self.face)
        return plate.at(self.at[0], self.at[1], self.face)

    @property
    def contacts(self) -> int:
        """The number of points that may be struck."""
        return len(self.at) if isinstance(self.at[0], list) else 1

    @property
    def place(self) -> tuple[float, float]:
        """The only point that is struck, m."""
        x, y = (coordinate for coordinate in self.at if isinstance(coordinate, float))
        return x, y


class RectanglePlate(PlateBody):
    """A rectangular plate."""

    if TYPE_CHECKING:
        length: float
        width: float
        supports: Any
        cells: list[int] | None


class KirchhoffPlate(RectanglePlate):
    """A thin rectangular plate."""


class Panel(PlateBody):
    """A plate of any outline."""

    circle: Length | None = Field(None, description="the radius of a round plate, whose centre is the origin")
    corners: Annotated[list[Place], Field(min_length=3)] | None = None
    holes: list[Annotated[list[Place], Field(min_length=3)]] = Field(default_factory=list)
    edges: str | list[str] | None = Field(None, description="a name for each side, or one for all")
    mesh: str | None = Field(None, description='the file of a mesh, such as "panel.msh"')
    without = ("shape",)

    def arguments(self, world: World) -> Data:
        shapes = [name for name in ("circle", "corners", "mesh") if getattr(self, name) is not None]
        if len(shapes) != 1:
            what = "is missing; give corners, circle or mesh" if not shapes else f"give {' or '.join(shapes)} alone"
            raise Fault((shapes[-1] if shapes else "corners",), what)
        shape = file_of(self.mesh, world) if self.mesh is not None else self._outline()
        return super().arguments(world) | {"shape": shape}

    def _outline(self) -> Outline:
        corners = circle(self.circle) if self.circle is not None else [(x, y) for x, y in self.corners or []]
        holes = tuple(tuple((x, y) for x, y in hole) for hole in self.holes)
        edges: Any = self.edges if isinstance(self.edges, str) else tuple(self.edges or ())
        return Outline(tuple(corners), holes, edges)


SPECIAL.update({
    kirchhoff_plate: KirchhoffPlate, mindlin_plate: RectanglePlate, mindlin_panel: Panel,
    infinite_plate: Walled,
})  # fmt: skip
