"""Triangles for outlines, by gmsh: an optional dependency, `pip install hertzlink[mesh]`."""

from collections.abc import Sequence
from functools import reduce
from types import ModuleType
from typing import NamedTuple, TypeAlias

import numpy as np
from skfem import MeshTri

from plates.shapes.shape import Cells, PlateMesh
from structures.meshes.mesh_files import gmsh_model
from structures.meshes.mesh_reading import Numbers, Tag

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


class Ring(NamedTuple):
    """A closed polygon: its corners (x, y), m, and the name of the edge to which each side belongs."""

    corners: tuple[Place, ...]
    edges: tuple[str, ...]


def triangles(rings: Sequence[Ring], fine: Sequence[Place], corners: Sequence[Place], cells: Cells) -> PlateMesh:
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
