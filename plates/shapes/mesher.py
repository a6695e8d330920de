"""Triangles for outlines, by gmsh: an optional dependency, `pip install hertzlink[mesh]`."""

from collections.abc import Sequence
from functools import reduce
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from skfem import MeshTri

from plates.shapes.mesh import PanelMesh, Sizes
from structures.mesh_source import Numbers, Tag

if TYPE_CHECKING:
    from plates.shapes.outline import Outline, Place

OPTIONS = {
    "General.Terminal": 0.0,
    "General.NumThreads": 1.0,
    "Mesh.Algorithm": 5.0,
    "Mesh.MeshSizeExtendFromBoundary": 1.0,
    "Mesh.MeshSizeFromPoints": 0.0,
    "Mesh.MeshSizeFromCurvature": 0.0,
    "Mesh.ElementOrder": 1.0,
    "Mesh.RecombineAll": 0.0,
}
"""Delaunay's algorithm follows sizes that vary best; those of short sides grow into the plate."""

ON_EDGE = 0.3
"""A contact nearer to an edge than this part of the finest size is no corner of the mesh."""


def triangles(outline: "Outline", places: "Sequence[Place]", size: Sizes) -> PanelMesh:
    """The outline's mesh, fine at places (x, y) m, and its edges by name."""
    gmsh = _gmsh()
    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    before = {name: gmsh.option.getNumber(name) for name in OPTIONS}
    shown = "" if ours else gmsh.model.getCurrent()
    try:
        for name, value in OPTIONS.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.add("hertzlink panel")
        lines = _drawn(gmsh, outline, places, size)
        gmsh.model.mesh.generate(2)
        return _read(gmsh, lines)
    finally:
        gmsh.model.remove()
        for name, value in before.items():
            gmsh.option.setNumber(name, value)
        if ours:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(shown)


def _gmsh() -> ModuleType:
    try:
        import gmsh
    except (ImportError, OSError) as error:  # OSError: a library that gmsh draws with, such as libGLU, is missing
        raise ImportError(
            f"meshing an Outline needs gmsh ({error}): pip install hertzlink[mesh]; a panel from a mesh file does not"
        ) from error
    return gmsh  # type: ignore[no-any-return]


def _drawn(gmsh: ModuleType, outline: "Outline", places: "Sequence[Place]", size: Sizes) -> dict[str, list[int]]:
    """Draws the outline in gmsh, and tells its lines by the names of edges."""
    rings = [(outline.corners, outline.edges)]
    rings += [(hole, (f"hole {i + 1}",) * len(hole)) for i, hole in enumerate(outline.holes)]
    lines: dict[str, list[int]] = {}
    loops = []
    for corners, names in rings:
        points = [gmsh.model.geo.addPoint(*corner, 0.0) for corner in corners]
        sides = [gmsh.model.geo.addLine(points[i], points[(i + 1) % len(points)]) for i in range(len(points))]
        loops.append(gmsh.model.geo.addCurveLoop(sides))
        for name, side in zip(names, sides, strict=True):
            lines.setdefault(name, []).append(side)
    surface = gmsh.model.geo.addPlaneSurface(loops)
    contacts = [gmsh.model.geo.addPoint(x, y, 0.0) for x, y in places]
    gmsh.model.geo.synchronize()
    for contact, place in zip(contacts, places, strict=True):
        if outline.distance(*place) > ON_EDGE * size.finest:
            gmsh.model.mesh.embed(0, [contact], 2, surface)
    field = gmsh.model.mesh.field.add("MathEval")
    distances = [f"Sqrt((x-({x!r}))^2+(y-({y!r}))^2)" for x, y in places]
    away = reduce(lambda nearer, other: f"Min({nearer},{other})", distances)
    gmsh.model.mesh.field.setString(field, "F", f"Min({size.coarsest!r},{size.finest!r}+{size.growth!r}*{away})")
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
    return lines


def _read(gmsh: ModuleType, lines: dict[str, list[int]]) -> PanelMesh:
    """gmsh's mesh, and the facets on its lines."""
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
    return PanelMesh(mesh, edges)
