"""Outlines of plates: polygons with holes and named sides, meshed with triangles that are fine at the contact."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import cos, hypot, pi, sin, sqrt
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.distance import cdist
from skfem import MeshTri

from plates.shapes.mesh_geometry import distances
from plates.shapes.shape import SAME, Cells, PlateMesh
from structures.checks import coordinates, count_of, listed, positive, several, short, whole
from structures.meshes.mesh_files import gmsh_model
from structures.meshes.mesh_reading import Tag
from structures.quantities import Likely
from structures.structure import Vector

Place: TypeAlias = tuple[float, float]
# Options of gmsh. Algorithm 5 (Delaunay) follows varying sizes best. Sizes of short sides extend into the plate.
OPTIONS = {
    "Mesh.Algorithm": 5.0,
    "Mesh.MeshSizeExtendFromBoundary": 1.0,
    "Mesh.MeshSizeFromPoints": 0.0,
    "Mesh.MeshSizeFromCurvature": 0.0,
    "Mesh.ElementOrder": 1.0,
    "Mesh.RecombineAll": 0.0,
}
NAMED = 6  # Number of edges in the repr() of an outline
COINCIDE = 1e-9  # Corners that are closer than this fraction of the outline's size coincide
# The most corners of an outline and its holes. Each pair of sides is compared, which takes a few seconds and 1 GB.
MOST_CORNERS = 2000
ROUND = 96  # Default number of corners of a circle; the error of frequencies is 0.1 %
ON_EDGE = 0.3  # A contact closer to an edge than this fraction of the finest size does not become a corner of the mesh


class Ring(NamedTuple):
    """A closed polygon: name of its argument, corners (x, y), m, and the name of the edge of each side."""

    argument: str
    corners: Vector
    edges: tuple[str, ...]

    @property
    def ends(self) -> Vector:
        """The corners at which the sides end."""
        return np.roll(self.corners, -1, axis=0)

    def contains(self, point: Vector) -> bool:
        """Return whether a ray from the point crosses the ring an odd number of times."""
        start, end = self.corners, self.ends
        passes = (start[:, 1] > point[1]) != (end[:, 1] > point[1])
        start, end = start[passes], end[passes]
        at = start[:, 0] + (point[1] - start[:, 1]) / (end[:, 1] - start[:, 1]) * (end[:, 0] - start[:, 0])
        return bool((at > point[0]).sum() % 2)


@dataclass(frozen=True)
class Outline:
    """A polygon with holes, the shape of a panel.

    Parameters
    ----------
    corners : sequence of (float, float)
        Corners (x, y) in order, m. Side i begins at corner i. A curved edge consists of many short sides; see `circle`.
    holes : sequence of sequences of (float, float)
        The corners of each hole, m.
    edges : str or sequence of str
        A name for each side, or one for all; by default "side 1", "side 2", ... Sides with the same name form an edge.
        The edges of holes are "hole 1", "hole 2", ...

    Examples
    --------
    >>> hl.Outline([(0, 0), (0.3, 0), (0, 0.2)], edges=["base", "slope", "wall"])
    <Outline: polygon of 3 corners, 0.3 × 0.2 m; edges 'base', 'slope', 'wall'>
    """

    corners: tuple[Place, ...]
    holes: tuple[tuple[Place, ...], ...] = ()
    edges: tuple[str, ...] = ()

    kind, fixed = "panel", False

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners", _corners("corners", self.corners))
        holes = self.holes if several(self.holes) else (self.holes,)
        object.__setattr__(self, "holes", tuple(_corners(f"holes[{i}]", hole) for i, hole in enumerate(holes)))
        if (total := sum(map(len, (self.corners, *self.holes)))) > MOST_CORNERS:
            raise ValueError(f"corners, holes: must have at most {MOST_CORNERS} corners in all, not {total}")

        # One name for all sides, or the usual names
        names: Any = self.edges
        if isinstance(names, str) or (several(names) and len(names) == 0):
            names = tuple(names or f"side {i + 1}" for i in range(len(self.corners)))
        names = tuple(listed("edges", names, str, "names, one for each corner"))
        if len(names) != len(self.corners):
            raise ValueError(f"edges = {self.edges!r}: must be one name, or {len(self.corners)}, one for each corner")
        object.__setattr__(self, "edges", names)

        self._check_sides()
        Likely.SIDE.warn("Outline", "size", self.size)
        rings = self._rings
        for ring in rings[1:]:
            around = [other.argument for other in rings if other is not ring and other.contains(ring.corners[0])]
            if around != ["corners"]:
                raise ValueError(f"{ring.argument}: must lie inside the corners, and not in another hole")

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least and greatest x, least and greatest y, m."""
        (left, bottom), (right, top) = np.min(self.corners, axis=0), np.max(self.corners, axis=0)
        return float(left), float(right), float(bottom), float(top)

    @property
    def names(self) -> list[Tag]:
        """The names of the edges, in order."""
        return list(dict.fromkeys(name for ring in self._rings for name in ring.edges))

    @property
    def size(self) -> float:
        """The longer side of the bounding box, m."""
        return float(np.ptp(np.array(self.corners), axis=0).max())

    @property
    def area(self) -> float:
        """The area inside the corners, including holes, m²."""
        x, y = np.array(self.corners).T
        return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0)

    def contains(self, x: float, y: float) -> bool:
        """Return whether a point, m, lies inside and not in a hole; on an edge the answer is arbitrary."""
        outer, *holes = self._rings
        point = np.array([x, y])
        return outer.contains(point) and not any(hole.contains(point) for hole in holes)

    def distance(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest edge, m."""
        return min(float(distances(ring.corners, ring.ends, np.array([x, y])).min()) for ring in self._rings)

    def directions(self, name: Tag) -> Vector:
        sides = np.concatenate(
            [(ring.ends - ring.corners)[[edge == name for edge in ring.edges]] for ring in self._rings]
        )
        return np.asarray(np.arctan2(sides[:, 1], sides[:, 0]))

    def mesh(self, x: ArrayLike, y: ArrayLike, cells: Cells) -> PlateMesh:
        """Return triangles, finest at the contacts (x, y), m. A contact is a corner unless it lies near an edge.

        Raise a ValueError for a contact outside or in a hole.
        """
        places: list[Place] = []
        for at_x, at_y in zip(np.atleast_1d(x).tolist(), np.atleast_1d(y).tolist(), strict=True):
            if not self.contains(at_x, at_y) and self.distance(at_x, at_y) > COINCIDE * self.size:
                raise ValueError(f"x, y = {at_x!r}, {at_y!r}: must lie inside the outline, and not in a hole")
            if all(hypot(at_x - other_x, at_y - other_y) > SAME * cells.finest for other_x, other_y in places):
                places.append((at_x, at_y))
        corners = [place for place in places if self.distance(*place) > ON_EDGE * cells.finest]
        # Sizes that gmsh cannot read crash the process.
        cells = replace(cells, finest=min(cells.finest, self.size), coarsest=min(cells.coarsest, self.size))
        return _triangles(self._rings, places, corners, cells)

    def described(self) -> dict[str, Any]:
        return {"corners": self.corners, "holes": self.holes, "edges": self.edges}

    def summary(self) -> str:
        left, right, bottom, top = self.box
        holes = f", {count_of(len(self.holes), 'hole')}" if self.holes else ""
        return f"polygon of {len(self.corners)} corners{holes}, {right - left:.4g} × {top - bottom:.4g} m"

    def __repr__(self) -> str:
        named = ", ".join(map(repr, self.names[:NAMED])) + (", …" if len(self.names) > NAMED else "")
        return f"<Outline: {self.summary()}; edges {named}>"

    @property
    def _rings(self) -> list[Ring]:
        holes = [
            Ring(f"holes[{i}]", np.array(hole), (f"hole {i + 1}",) * len(hole)) for i, hole in enumerate(self.holes)
        ]
        return [Ring("corners", np.array(self.corners), self.edges), *holes]

    def _check_sides(self) -> None:
        """Raise a ValueError if corners coincide, or if sides have more in common than a corner."""
        called = [f"{ring.argument}[{i}]" for ring in self._rings for i in range(len(ring.corners))]
        starts, ends = (np.concatenate([getattr(r, name) for r in self._rings]) for name in ("corners", "ends"))
        near = COINCIDE * self.size
        same = np.argwhere(np.triu(cdist(starts, starts) <= near, 1))
        for i, j in same:
            at = "({:.4g}, {:.4g}) m".format(*starts[i])
            raise ValueError(f"{called[i]}, {called[j]}: must not coincide; both are at {at}")
        for i, corner in enumerate(starts):
            others = (starts != corner).any(axis=1) & (ends != corner).any(axis=1)
            for j in np.flatnonzero(others & (distances(starts, ends, corner) <= near)):
                raise ValueError(f"{called[i]}: must not lie on the side from {called[j]}")

        # Two sides cross if the ends of each lie on both sides of the line through the other.
        along = (ends - starts)[:, None]
        first, last = (
            np.sign(along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0])
            for away in (starts - starts[:, None], ends - starts[:, None])
        )
        parted = first * last < 0.0
        for i, j in np.argwhere(parted & parted.T):
            raise ValueError(f"{called[i]}: the side from this corner must not cross that from {called[j]}")


def circle(radius: float, centre: Place = (0.0, 0.0), corners: int = ROUND) -> tuple[Place, ...]:
    """Return the corners of a regular polygon with the area of a circle.

    Parameters
    ----------
    radius, centre, corners : float, (float, float), int
        Radius, m; centre (x, y), m; the number of corners, 3 or more.

    Returns
    -------
    tuple of (float, float)
        Corners (x, y), m, anticlockwise.

    Examples
    --------
    >>> round(hl.Outline(hl.circle(0.2), edges="rim").area, 5)
    0.12566
    """
    radius, count = positive("radius", radius, "m"), whole("corners", corners, 3, MOST_CORNERS)
    x, y = coordinates("centre", centre)
    angle = 2.0 * pi / count
    reach = radius * sqrt(angle / sin(angle))
    return tuple((x + reach * cos(i * angle), y + reach * sin(i * angle)) for i in range(count))


def _corners(name: str, corners: Any) -> tuple[Place, ...]:
    if not several(corners) or len(corners) < 3:
        raise ValueError(f"{name} = {short(corners)}: must be three corners (x, y) in m, or more")
    return tuple(coordinates(f"{name}[{i}]", corner) for i, corner in enumerate(corners))  # type: ignore[misc]


def _triangles(rings: Sequence[Ring], fine: Sequence[Place], corners: Sequence[Place], cells: Cells) -> PlateMesh:
    """Return the mesh of the first ring without the others, with its edges by name.

    fine: places (x, y), m, at which cells are finest. corners: the places that are corners of the mesh.
    """
    with gmsh_model(OPTIONS) as gmsh:
        lines: dict[Tag, list[int]] = {}
        loops = []
        for ring in rings:
            points = [gmsh.model.geo.addPoint(*corner, 0.0) for corner in ring.corners.tolist()]
            sides = [gmsh.model.geo.addLine(*ends) for ends in zip(points, points[1:] + points[:1], strict=True)]
            loops.append(gmsh.model.geo.addCurveLoop(sides))
            for name, side in zip(ring.edges, sides, strict=True):
                lines.setdefault(name, []).append(side)
        surface = gmsh.model.geo.addPlaneSurface(loops)
        contacts = [gmsh.model.geo.addPoint(x, y, 0.0) for x, y in corners]
        gmsh.model.geo.synchronize()
        for contact in contacts:
            gmsh.model.mesh.embed(0, [contact], 2, surface)

        # Sizes grow with the distance from the nearest fine place; without such a place, all cells are the finest.
        field = gmsh.model.mesh.field.add("MathEval")
        away = [f"Sqrt((x-({x!r}))^2+(y-({y!r}))^2)" for x, y in fine]
        nearest = reduce(lambda nearer, other: f"Min({nearer},{other})", away or ["0"])
        size = f"Min({cells.coarsest!r},{cells.finest!r}+{cells.growth!r}*{nearest})"
        gmsh.model.mesh.field.setString(field, "F", size)
        gmsh.model.mesh.field.setAsBackgroundMesh(field)
        gmsh.model.mesh.generate(2)

        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        triangles = gmsh.model.mesh.getElementsByType(2)[1].astype(np.int64).reshape(-1, 3)
        ends = {
            name: [gmsh.model.mesh.getElementsByType(1, side)[1].astype(np.int64).reshape(-1, 2) for side in sides]
            for name, sides in lines.items()
        }

    # Points that do not belong to a triangle are left out.
    used = np.unique(triangles)
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    number[used] = np.arange(used.size)
    place = np.zeros((number.size, 2))
    place[tags.astype(np.int64)] = coordinates.reshape(-1, 3)[:, :2]
    mesh = MeshTri(np.ascontiguousarray(place[used].T), np.ascontiguousarray(number[triangles].T))
    facets = {tuple(pair): i for i, pair in enumerate(np.sort(mesh.facets, axis=0).T.tolist())}
    pairs = {name: np.sort(number[np.concatenate(sides)], axis=1).tolist() for name, sides in ends.items()}
    return PlateMesh(mesh, {name: np.unique([facets[tuple(p)] for p in own]) for name, own in pairs.items()})
