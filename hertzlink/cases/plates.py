"""The plates of a case."""

from collections.abc import Mapping
from math import prod
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from hertzlink.cases.bodies import OF_ALL, Body, file_of
from hertzlink.cases.faults import Fault
from hertzlink.cases.parts import (
    AnyMaterial,
    Force,
    Frequency,
    Length,
    Mass,
    Number,
    OwnMaterial,
    Part,
    World,
    forms,
    made,
    material_of,
)
from hertzlink.cases.paths import Path
from hertzlink.cases.units import Unit
from hertzlink.cases.walls import Wall, wall_of
from plates.additions import Delamination, PointMass, Stiffener, Weakened
from plates.builders import kirchhoff_panel, kirchhoff_plate, mindlin_panel, mindlin_plate
from plates.half_plane import half_plane
from plates.infinite import infinite_plate
from plates.plate import Plate
from plates.prestress import Prestress
from plates.shapes.outline import Outline, circle
from plates.support import ElasticEdge, Supports
from structures.closing import Closing, check_gap
from structures.structure import Structure

Held = Literal["clamped", "simple", "soft simple", "free", "symmetry"]
Place = Annotated[list[Length], Field(min_length=2, max_length=2)]
Places = Annotated[
    Annotated[Place, Tag("one")] | Annotated[list[Place], Field(min_length=1), Tag("many")],
    forms(lambda given: "many" if isinstance(given, list) and given and isinstance(given[0], list) else "one", ""),
]
Face = Literal["front", "back"]
Faces = Annotated[
    Annotated[Face, Tag("one")] | Annotated[list[Face], Tag("many")],
    forms(lambda given: "many" if isinstance(given, list) else "one", ""),
]
Rectangle4 = Annotated[list[Length], Field(min_length=4, max_length=4)]
Two = Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=2, max_length=2)]


class Springs(Part):
    """An edge on springs."""

    translation: Annotated[float, Unit("N/m^2", "a stiffness of an edge", "1e7 N/m^2")] = 0.0
    rotation: Force = 0.0

    def make(self, world: World) -> ElasticEdge:
        return ElasticEdge(self.translation, self.rotation)


def _held(given: Any) -> str | None:
    if isinstance(given, str):
        return "word"
    return "springs" if isinstance(given, dict | Springs) else None


Edge = Annotated[
    Annotated[Held, Tag("word")] | Annotated[Springs, Tag("springs")],
    forms(_held, 'must be "clamped", "simple", "free", "symmetry", or { translation = "1e7 N/m^2" }'),
]


def edge_of(given: Any, world: World, *path: str | int) -> str | ElasticEdge:
    """How an edge is held."""
    held: str | ElasticEdge = given if isinstance(given, str) else made(given, world, path)
    return held


class SupportsPart(Part):
    """How the four edges of a rectangle are held."""

    left: Edge = "free"
    right: Edge = "free"
    bottom: Edge = "free"
    top: Edge = "free"

    def make(self, world: World) -> Supports:
        return Supports(**{name: edge_of(getattr(self, name), world, name) for name in type(self).model_fields})


class MassPart(Part):
    """A point mass."""

    kind: Literal["point_mass"]
    at: Place
    mass: Mass

    def make(self, world: World) -> PointMass:
        return PointMass(self.at[0], self.at[1], self.mass)


class StiffenerPart(Part):
    """A beam on the plate."""

    kind: Literal["stiffener"]
    start: Place
    end: Place
    bending_stiffness: Annotated[float, Unit("N m^2", "a stiffness", "20 N m^2")]
    torsion_stiffness: Annotated[float, Unit("N m^2", "a stiffness", "20 N m^2")] = 0.0
    mass_per_length: Annotated[float, Unit("kg/m", "a mass per length", "0.2 kg/m")] = 0.0

    def make(self, world: World) -> Stiffener:
        own = self.given("kind", "start", "end")
        return Stiffener((self.start[0], self.start[1]), (self.end[0], self.end[1]), **own)


class WeakenedPart(Part):
    """A weak rectangle."""

    kind: Literal["weakened"]
    region: Rectangle4 = Field(description="left, right, bottom and top of the region")
    factor: Number

    def make(self, world: World) -> Weakened:
        left, right, bottom, top = self.region
        return Weakened((left, right, bottom, top), self.factor)


class DelaminationPart(Part):
    """A rectangle in which the plate consists of two parts that separate and close."""

    kind: Literal["delamination"]
    region: Rectangle4 = Field(description="left, right, bottom and top of the region")
    depth: Number = Field(description="thickness of the front part in units of the plate's")
    points: Two | None = Field(None, description="columns and rows of points at which the gap closes")
    opening: Length = 0.0
    preload: Force = 0.0

    def make(self, world: World) -> Delamination:
        check_gap(self.opening, self.preload)
        left, right, bottom, top = self.region
        return Delamination((left, right, bottom, top), self.depth, **self.given("kind", "region", "depth", *GAP))


GAP = ("opening", "preload")
"""What closes a gap; the addition does not know it."""

PerLength = Annotated[float, Unit("N/m", "a force per length", "20 kN/m")]


class PrestressPart(Part):
    """Forces in the plane of the plate; tension is positive."""

    kind: Literal["prestress"]
    xx: PerLength = 0.0
    yy: PerLength = 0.0
    xy: PerLength = 0.0

    def make(self, world: World) -> Prestress:
        return Prestress(self.xx, self.yy, self.xy)


OneAddition = Annotated[
    MassPart | StiffenerPart | WeakenedPart | DelaminationPart | PrestressPart, Discriminator("kind")
]


class PlateBody(Body):
    """What all meshed plates have in common."""

    thickness: Length | None = None
    material: AnyMaterial | None = None
    wall: Wall | None = Field(None, description="a laminate or a section, in place of thickness and material")
    highest_frequency: Frequency | None = None
    additions: list[OneAddition] = Field(default_factory=list)
    at: Places = Field(description='the point that is struck, such as ["60 mm", "457 mm"], or a list of points')
    face: Faces = "front"

    named: ClassVar[Mapping[str, Path]] = {
        "x": ("at", 0),
        "y": ("at", 1),
        "x, y": ("at",),
    }

    def plate(self, world: World) -> Plate:
        """The plate, not yet struck."""
        raise NotImplementedError

    def make(self, world: World) -> Structure:
        plate = self.plate(world)
        if isinstance(self.at[0], list):
            x, y = zip(*self.at, strict=True)
            return plate.at(list(x), list(y), self.face)
        return plate.at(self.at[0], self.at[1], self.face)

    def in_time(self, structure: Structure) -> Any:
        split = [one for one in self.additions if isinstance(one, DelaminationPart)]
        if not split:
            return structure
        counts = [prod(one.points or Delamination.points) for one in split]
        opening, preload = (
            [getattr(one, name) for one, n in zip(split, counts, strict=True) for _ in range(n)] for name in GAP
        )
        return Closing(structure, opening, preload)

    @property
    def contacts(self) -> int:
        """The number of points that may be struck."""
        return len(self.at) if isinstance(self.at[0], list) else 1

    @property
    def is_plain(self) -> bool:
        """Whether the wall is of one material and one point is struck; the next three need that."""
        return self.wall is None and self.thickness is not None and self.material is not None and self.contacts == 1

    @property
    def place(self) -> tuple[float, float]:
        """The only point that is struck, m."""
        x, y = (one for one in self.at if isinstance(one, float))
        return x, y

    @property
    def depth(self) -> float:
        """The thickness, m."""
        assert self.thickness is not None
        return self.thickness

    @property
    def substance(self) -> str | OwnMaterial:
        """The material."""
        assert self.material is not None
        return self.material

    def settings(self, world: World, *names: str) -> dict[str, Any]:
        """Arguments of the builder: material, additions, and the entries of these names that are given."""
        own = {name: getattr(self, name) for name in ("highest_frequency", *names) if getattr(self, name) is not None}
        if self.additions:
            own["additions"] = [made(one, world, ("additions", i)) for i, one in enumerate(self.additions)]
        return wall_of(self.thickness, self.material, self.wall, world) | own


class RectanglePlate(PlateBody):
    """A rectangular plate."""

    length: Length
    width: Length
    supports: SupportsPart = Field(description='a table such as { left = "clamped" }')
    cells: Two | None = None

    def sides(self, world: World, *names: str) -> dict[str, Any]:
        """All arguments of the builder."""
        own = self.settings(world, *names) | {"length": self.length, "width": self.width}
        own["supports"] = made(self.supports, world, ("supports",))
        return own if self.cells is None else own | {"cells": (self.cells[0], self.cells[1])}


class KirchhoffPlate(RectanglePlate):
    """A thin rectangular plate."""

    kind: Literal["kirchhoff_plate"]

    def plate(self, world: World) -> Plate:
        return kirchhoff_plate(**self.sides(world))


class MindlinPlate(RectanglePlate):
    """A rectangular plate with shear."""

    kind: Literal["mindlin_plate"]
    shear_correction: Number | None = None
    patch_radius: Length | None = None

    def plate(self, world: World) -> Plate:
        return mindlin_plate(**self.sides(world, "shear_correction", "patch_radius"))


class Panel(PlateBody):
    """A plate of any outline."""

    circle: Length | None = Field(None, description="the radius of a round plate, whose centre is the origin")
    corners: Annotated[list[Place], Field(min_length=3)] | None = None
    holes: list[Annotated[list[Place], Field(min_length=3)]] = Field(default_factory=list)
    edges: str | list[str] | None = Field(None, description="a name for each side, or one for all")
    mesh: str | None = Field(None, description='the file of a mesh, such as "panel.msh"')
    scale: Number | None = None
    merge: Length | None = Field(None, description="points of the mesh that lie closer become one")
    tags: str | None = Field(None, description="the data of the mesh that number its sides")
    supports: dict[str, Edge] = Field(default_factory=dict)

    def shaped(self, world: World, *names: str) -> dict[str, Any]:
        """All arguments of the builder."""
        given = [name for name in ("circle", "corners", "mesh") if getattr(self, name) is not None]
        if len(given) != 1:
            what = "is missing; give corners, circle or mesh" if not given else f"give {' or '.join(given)} alone"
            raise Fault((given[-1] if given else "corners",), what)
        own = self.settings(world, "scale", "merge", "tags", *names)
        own["shape"] = file_of(self.mesh, world) if self.mesh is not None else self._outline()
        own["supports"] = {name: edge_of(one, world, "supports", name) for name, one in self.supports.items()}
        return own

    def _outline(self) -> Outline:
        corners = circle(self.circle) if self.circle is not None else [(x, y) for x, y in self.corners or []]
        holes = tuple(tuple((x, y) for x, y in hole) for hole in self.holes)
        edges: Any = self.edges if isinstance(self.edges, str) else tuple(self.edges or ())
        return Outline(tuple(corners), holes, edges)


class KirchhoffPanel(Panel):
    """A thin plate of any outline."""

    kind: Literal["kirchhoff_panel"]

    def plate(self, world: World) -> Plate:
        return kirchhoff_panel(**self.shaped(world))


class MindlinPanel(Panel):
    """A plate of any outline, with shear."""

    kind: Literal["mindlin_panel"]
    shear_correction: Number | None = None
    patch_radius: Length | None = None

    def plate(self, world: World) -> Plate:
        return mindlin_panel(**self.shaped(world, "shear_correction", "patch_radius"))


class HalfPlane(Body):
    """A thin plate with one straight edge."""

    kind: Literal["half_plane"]
    thickness: Length
    material: AnyMaterial
    edge: Literal["clamped", "simple", "free"]
    distance: Length
    until: Annotated[float, Unit("s", "a time", "1.5 ms")] | None = Field(
        None, description="the longest run; by default that of the case"
    )
    highest_frequency: Frequency | None = None

    def make(self, world: World) -> Structure:
        own = self.given("kind", "material", "until", *OF_ALL)
        until = world.until if self.until is None else self.until
        return half_plane(material=material_of(self.material, world, "material"), until=until, **own)


class InfinitePlate(Body):
    """A thin plate without edges."""

    kind: Literal["infinite_plate"]
    thickness: Length | None = None
    material: AnyMaterial | None = None
    wall: Wall | None = Field(None, description="a laminate or a section, in place of thickness and material")

    def make(self, world: World) -> Structure:
        return infinite_plate(**wall_of(self.thickness, self.material, self.wall, world))
