"""Outlines of plates: polygons with holes, whose sides have names; meshed with triangles, fine at the contact."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import cos, hypot, pi, sin, sqrt
from types import ModuleType
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from skfem import MeshTri

from plates.shapes.grading import SAME
from plates.shapes.mesh_geometry import distances
from plates.shapes.shape import Cells, PlateMesh
from structures.checks import count_of, finite, instance, positive, several, short, whole
from structures.meshes.mesh_files import gmsh_model
from structures.meshes.mesh_reading import Numbers, Tag
from structures.quantities import Likely
from structures.structure import Vector

Place: TypeAlias = tuple[float, float]

OPTIONS = {
    "Mesh.Algorithm": 5.0,
    "Mesh.MeshSizeExtendFromBoundary": 1.0,
    "Mesh.MeshSizeFromPoints": 0.0,
    "Mesh.MeshSizeFromCurvature": 0.0,
    "Mesh.ElementOrder": 1.0,
    "Mesh.RecombineAll": 0.0,
}
"""Options of gmsh. Algorithm 5, Delaunay's, follows varying sizes best; sizes of short sides extend into the plate."""

NAMED = 6
"""Names of edges that the text of an outline shows."""

COINCIDE = 1e-9
"""Corners nearer to each other than this part of the outline's size coincide: rounding."""

MOST_CORNERS = 2000
"""Corners of an outline and its holes: each pair of sides is compared, which takes a few seconds and 1 GB."""

ROUND = 96
"""Corners of a circle by default: its frequencies are within 0.1 % of the circle's."""

ON_EDGE = 0.3
"""A contact nearer to an edge than this part of the finest size is no corner: triangles would degenerate."""


class Ring(NamedTuple):
    """A closed polygon: its corners (x, y), m, and the name of the edge to which each side belongs."""

    corners: tuple[Place, ...]
    edges: tuple[str, ...]


@dataclass(frozen=True)
class Outline:
    """A polygon with holes, the shape of a panel.

    Parameters
    ----------
    corners : sequence of (float, float)
        Corners (x, y) in order, m. Side i runs from corner i to the next, the last one back to the first. Approximate
        curved edges by many short sides; see `circle`.
    holes : sequence of sequences of (float, float)
        The corners of each hole, m.
    edges : str or sequence of str
        A name for each side, or one for all; by default "side 1", "side 2", ... Sides with the same name form one edge.
        The edges of the holes are "hole 1", "hole 2", ...

    Raises
    ------
    ValueError
        Where corners coincide, sides cross or touch, or holes lie outside or in each other.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.Outline([(0, 0), (0.3, 0), (0, 0.2)], edges=["base", "slope", "wall"])
    <Outline: polygon of 3 corners, 0.3 × 0.2 m; edges 'base', 'slope', 'wall'>
    """

    corners: tuple[Place, ...]
    holes: tuple[tuple[Place, ...], ...] = ()
    edges: tuple[str, ...] = ()

    kind, fixed = "panel", False

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners", _corners("corners", self.corners))
        single = isinstance(self.holes, str) or getattr(self.holes, "ndim", None) == 0
        many = isinstance(self.holes, Iterable) and not single
        holes = self.holes if many else (self.holes,)
        object.__setattr__(self, "holes", tuple(_corners(f"holes[{i}]", hole) for i, hole in enumerate(holes)))
        if (total := sum(map(len, (self.corners, *self.holes)))) > MOST_CORNERS:
            raise ValueError(f"corners, holes: have {total} corners in all, must have at most {MOST_CORNERS}")
        object.__setattr__(self, "edges", _names(self.edges, len(self.corners)))
        self._check_sides()
        Likely.SIDE.warn("Outline", "size", self.size)
        outer, rings = np.array(self.corners), [np.array(hole) for hole in self.holes]
        for i, ring in enumerate(rings):
            if not _within(outer, ring[0]):
                raise ValueError(f"holes[{i}]: lies outside of the corners' polygon")
            for j, other in enumerate(rings):
                if i != j and _within(other, ring[0]):
                    raise ValueError(f"holes[{i}]: lies in holes[{j}]")

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least and greatest x, least and greatest y, m."""
        (left, bottom), (right, top) = np.min(self.corners, axis=0), np.max(self.corners, axis=0)
        return float(left), float(right), float(bottom), float(top)

    @property
    def names(self) -> list[Tag]:
        """The names of the edges, in order."""
        holes = [f"hole {i + 1}" for i in range(len(self.holes))]
        return list(dict.fromkeys([*self.edges, *holes]))

    @property
    def size(self) -> float:
        """The longer side of the box around it, m."""
        return float(np.ptp(np.array(self.corners), axis=0).max())

    @property
    def area(self) -> float:
        """The area inside the corners, holes included, m²."""
        x, y = np.array(self.corners).T
        return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0)

    def contains(self, x: float, y: float) -> bool:
        """Return whether a point, m, lies inside, and in no hole; points on an edge may count as either."""
        point = np.array([x, y])
        return _within(np.array(self.corners), point) and not any(_within(np.array(hole), point) for hole in self.holes)

    def distance(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest edge, m."""
        rings = [ring for _, ring in self._rings()]
        return min(float(distances(ring, np.roll(ring, -1, axis=0), np.array([x, y])).min()) for ring in rings)

    def directions(self, name: Tag) -> Vector:
        """Return the angles of the sides of an edge from the x axis, rad."""
        found = []
        for ring in self._named_rings():
            x, y = (np.roll(ring.corners, -1, axis=0) - np.array(ring.corners)).T
            found.append(np.arctan2(y, x)[[edge == name for edge in ring.edges]])
        return np.concatenate(found)

    def mesh(self, x: ArrayLike, y: ArrayLike, cells: Cells) -> PlateMesh:
        """Return triangles, finest at the contacts (x, y), m, which are corners of them unless they lie near an edge.

        Raises ValueError for a contact outside or in a hole.
        """
        xs, ys = (np.atleast_1d(np.asarray(values, dtype=float)).tolist() for values in (x, y))
        places: list[Place] = []
        for at_x, at_y in zip(xs, ys, strict=True):
            if not self.contains(at_x, at_y) and self.distance(at_x, at_y) > COINCIDE * self.size:
                raise ValueError(
                    f"x, y = {at_x!r}, {at_y!r}: lies outside of the outline, or in a hole; strike the plate"
                )
            if all(hypot(at_x - x, at_y - y) > SAME * cells.finest for x, y in places):
                places.append((at_x, at_y))
        corners = [place for place in places if self.distance(*place) > ON_EDGE * cells.finest]
        # gmsh ends the process at sizes that it cannot read.
        cells = replace(cells, finest=min(cells.finest, self.size), coarsest=min(cells.coarsest, self.size))
        return _triangles(self._named_rings(), places, corners, cells)

    def described(self) -> dict[str, Any]:
        """Return the outline as plain data."""
        return {"corners": self.corners, "holes": self.holes, "edges": self.edges}

    def summary(self) -> str:
        """Return the size in a few words."""
        left, right, bottom, top = self.box
        holes = f", {count_of(len(self.holes), 'hole')}" if self.holes else ""
        return f"polygon of {len(self.corners)} corners{holes}, {right - left:.4g} × {top - bottom:.4g} m"

    def __repr__(self) -> str:
        named = ", ".join(map(repr, self.names[:NAMED])) + (", …" if len(self.names) > NAMED else "")
        return f"<Outline: {self.summary()}; edges {named}>"

    def _named_rings(self) -> list[Ring]:
        holes = [Ring(hole, (f"hole {i + 1}",) * len(hole)) for i, hole in enumerate(self.holes)]
        return [Ring(self.corners, self.edges), *holes]

    def _rings(self) -> list[tuple[str, Vector]]:
        holes = [(f"holes[{i}]", np.array(hole)) for i, hole in enumerate(self.holes)]
        return [("corners", np.array(self.corners)), *holes]

    def _check_sides(self) -> None:
        """Raise a ValueError where corners coincide, and where sides have more in common than a corner."""
        places = [(name, i, ring) for name, ring in self._rings() for i in range(len(ring))]
        starts = np.concatenate([ring for _, ring in self._rings()])
        ends = np.concatenate([np.roll(ring, -1, axis=0) for _, ring in self._rings()])
        near = COINCIDE * self.size
        apart = np.abs(starts[:, None] - starts[None]).max(axis=2) + np.tri(len(starts)) * 2.0 * near
        for first, second in np.argwhere(apart <= near):
            (one, i, _), (other, j, _) = places[first], places[second]
            at = "({:.4g}, {:.4g}) m".format(*starts[first])
            raise ValueError(f"{one}[{i}] and {other}[{j}] coincide at {at}; give each corner once")
        for first, second in np.argwhere(np.triu(_crossing(starts, ends, near), 1)):
            (one, i, ring), (other, j, _) = places[first], places[second]
            if one != other or (j - i) % len(ring) not in (1, len(ring) - 1):
                raise ValueError(f"{one}: the side from corner {i} meets that from {other} corner {j}; must not cross")
            if _folds_back(ring, i, j):
                raise ValueError(f"{one}: the side from corner {j} runs back over that from corner {i}")


def circle(radius: float, centre: Place = (0.0, 0.0), corners: int = ROUND) -> tuple[Place, ...]:
    """Return the corners of a regular polygon with the area of a circle.

    Parameters
    ----------
    radius : float
        Radius of the circle, m.
    centre : (float, float)
        Its centre (x, y), m.
    corners : int
        The number of corners, 3 or more.

    Returns
    -------
    tuple of (float, float)
        Corners (x, y), m, anticlockwise.

    Raises
    ------
    ValueError
        Where a number is out of its range.

    Examples
    --------
    >>> import hertzlink as hl
    >>> disc = hl.Outline(hl.circle(0.2), edges="rim")
    >>> print(f"{disc.area:.5f} m²")
    0.12566 m²
    """
    radius, count = positive("radius", radius, "m"), whole("corners", corners, 3)
    if count > MOST_CORNERS:
        raise ValueError(f"corners = {corners!r}: must be at most {MOST_CORNERS}")
    x, y = _place("centre", centre)
    angle = 2.0 * pi / count
    reach = radius * sqrt(angle / sin(angle))
    return tuple((x + reach * cos(i * angle), y + reach * sin(i * angle)) for i in range(count))


def _corners(name: str, corners: Any) -> tuple[Place, ...]:
    if not several(corners) or len(corners) < 3:
        raise ValueError(f"{name} = {short(corners)}: must be three corners (x, y) in m, or more")
    if len(corners) > MOST_CORNERS:
        raise ValueError(f"{name}: {len(corners)} corners, must be at most {MOST_CORNERS}")
    return tuple(_place(f"{name}[{i}]", corner) for i, corner in enumerate(corners))


def _place(name: str, values: Any) -> Place:
    if not several(values) or len(values) != 2:
        raise ValueError(f"{name} = {short(values)}: must be (x, y) in m")
    return finite(f"{name}[0]", values[0], "m"), finite(f"{name}[1]", values[1], "m")


def _names(edges: Any, count: int) -> tuple[str, ...]:
    if isinstance(edges, str):
        return (edges,) * count
    names = tuple(edges) if isinstance(edges, Iterable) else (edges,)
    if not names:
        return tuple(f"side {i + 1}" for i in range(count))
    if len(names) != count:
        raise ValueError(f"edges = {edges!r}: must be one name, or {count}, as many as there are corners")
    for i, name in enumerate(names):
        instance(f"edges[{i}]", name, str, "a name")
    return names


def _within(ring: Vector, point: Vector) -> bool:
    """Return whether a ray from the point crosses the ring an odd number of times."""
    start, end = ring, np.roll(ring, -1, axis=0)
    passes = (start[:, 1] > point[1]) != (end[:, 1] > point[1])
    start, end = start[passes], end[passes]
    at = start[:, 0] + (point[1] - start[:, 1]) / (end[:, 1] - start[:, 1]) * (end[:, 0] - start[:, 0])
    return bool((at > point[0]).sum() % 2)


def _crossing(starts: Vector, ends: Vector, near: float) -> Any:
    """Return which pairs of sides have a point in common, sides × sides; neighbours do."""

    def side(a: Vector, b: Vector, c: Vector) -> Vector:
        """Return the side of the line from a to b on which c lies, 0 within `near` of it."""
        step = b - a
        away = (step[..., 0] * (c - a)[..., 1] - step[..., 1] * (c - a)[..., 0]) / np.hypot(step[..., 0], step[..., 1])
        return np.where(np.abs(away) <= near, 0.0, np.sign(away))

    a, b, c, d = starts[:, None], ends[:, None], starts[None], ends[None]
    low, high = np.minimum(starts, ends) - near, np.maximum(starts, ends) + near
    boxes = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    return boxes & (side(a, b, c) * side(a, b, d) <= 0.0) & (side(c, d, a) * side(c, d, b) <= 0.0)


def _folds_back(ring: Vector, i: int, j: int) -> bool:
    """Return whether two neighbouring sides lie on each other."""
    count = len(ring)
    first, second = (i, j) if (j - i) % count == 1 else (j, i)
    before, corner, after = ring[first], ring[second], ring[(second + 1) % count]
    back, ahead = before - corner, after - corner
    across = abs(back[0] * ahead[1] - back[1] * ahead[0])
    return bool(across <= COINCIDE * np.linalg.norm(back) * np.linalg.norm(ahead) and back @ ahead > 0.0)


def _triangles(rings: Sequence[Ring], fine: Sequence[Place], corners: Sequence[Place], cells: Cells) -> PlateMesh:
    """Return the mesh of the first ring less the others, and its edges by name.

    fine: places (x, y), m, at which cells are finest. corners: those of them that are corners of the mesh.
    """
    with gmsh_model(OPTIONS) as gmsh:
        lines = _drawn(gmsh, rings, corners)
        _set_size(gmsh, fine, cells)
        gmsh.model.mesh.generate(2)
        return _read(gmsh, lines)


def _drawn(gmsh: ModuleType, rings: Sequence[Ring], corners: Sequence[Place]) -> dict[str, list[int]]:
    """Draws the rings in gmsh and returns its lines by the names of edges."""
    lines: dict[str, list[int]] = {}
    loops = []
    for ring in rings:
        points = [gmsh.model.geo.addPoint(*corner, 0.0) for corner in ring.corners]
        sides = [gmsh.model.geo.addLine(points[i], points[(i + 1) % len(points)]) for i in range(len(points))]
        loops.append(gmsh.model.geo.addCurveLoop(sides))
        for name, side in zip(ring.edges, sides, strict=True):
            lines.setdefault(name, []).append(side)
    surface = gmsh.model.geo.addPlaneSurface(loops)
    contacts = [gmsh.model.geo.addPoint(x, y, 0.0) for x, y in corners]
    gmsh.model.geo.synchronize()
    for contact in contacts:
        gmsh.model.mesh.embed(0, [contact], 2, surface)
    return lines


def _set_size(gmsh: ModuleType, fine: Sequence[Place], cells: Cells) -> None:
    """Let sizes grow with the distance from the nearest of the fine places; they are the finest where there is none."""
    field = gmsh.model.mesh.field.add("MathEval")
    distances = [f"Sqrt((x-({x!r}))^2+(y-({y!r}))^2)" for x, y in fine]
    away = reduce(lambda nearer, other: f"Min({nearer},{other})", distances or ["0"])
    gmsh.model.mesh.field.setString(field, "F", f"Min({cells.coarsest!r},{cells.finest!r}+{cells.growth!r}*{away})")
    gmsh.model.mesh.field.setAsBackgroundMesh(field)


def _read(gmsh: ModuleType, lines: dict[str, list[int]]) -> PlateMesh:
    """Return the gmsh's mesh, and the facets on its lines."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    cells = gmsh.model.mesh.getElementsByType(2)[1].astype(np.int64).reshape(-1, 3)
    used = np.unique(cells)
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    number[used] = np.arange(used.size)
    place = np.zeros((number.size, 2))
    place[tags.astype(np.int64)] = coordinates.reshape(-1, 3)[:, :2]
    mesh = MeshTri(np.ascontiguousarray(place[used].T), np.ascontiguousarray(number[cells].T))
    facets = {tuple(ends): i for i, ends in enumerate(np.sort(mesh.facets, axis=0).T.tolist())}

    def on(line: int) -> list[int]:
        ends = np.sort(number[gmsh.model.mesh.getElementsByType(1, line)[1].astype(np.int64).reshape(-1, 2)], axis=1)
        return [facets[tuple(pair)] for pair in ends.tolist()]

    edges: dict[Tag, Numbers] = {
        name: np.unique([facet for side in sides for facet in on(side)]) for name, sides in lines.items()
    }
    return PlateMesh(mesh, edges)
