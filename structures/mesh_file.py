"""Meshes of solid bodies from files: what meshio reads, checked, with its tags, for scikit-fem."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from skfem import ElementHex2, ElementTetP2, MeshHex1, MeshHex2, MeshTet1, MeshTet2

from structures.caution import caution
from structures.checks import instance, positive
from structures.material import Material
from structures.mesh_source import (
    Numbers,
    Tag,
    check_whole,
    joined,
    known,
    names,
    near,
    points_of,
    read_mesh,
    tagged,
    tagged_facets,
    used,
)
from structures.structure import Vector

LONGEST_SIDE, SHORTEST_EDGE = 10.0, 0.02
"""m. A body larger than the first, or whose cells' edges are all longer than the second (a quarter of a shear wave of
40 kHz in steel), is taken for one in millimetres."""

FLAT = 1e-9
"""Cells whose Jacobian at a corner is below this part of their size's cube are flat."""

CELLS: dict[str, tuple[Any, Any, int, int]] = {
    "tetra": (MeshTet1, ElementTetP2, 4, 4),
    "tetra10": (MeshTet2, ElementTetP2, 4, 5),
    "hexahedron": (MeshHex1, ElementHex2, 8, 5),
    "hexahedron20": (MeshHex1, ElementHex2, 8, 5),
    "hexahedron27": (MeshHex2, ElementHex2, 8, 5),
}
"""meshio's types of cells: scikit-fem's mesh and element, the number of corners, the order of integration."""

FACETS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}
"""meshio's types of facets, and their numbers of corners."""

IGNORED = {"vertex", "line", "line3", *FACETS}

FRAMES = {
    4: ((0, 1, 2, 3),),
    8: ((0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7), (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)),
}
"""Corners of a cell in meshio's order, each with its three neighbours, by the right-hand rule."""


class BodyMesh:
    """A body of one type of cells, as a scikit-fem mesh in m.

    cells, facets: by tag, the numbers of the cells, and of the facets on the boundary, that have it.
    source: a file, or a meshio.Mesh. scale: m per unit of the mesh; None is 1, for bodies whose size can be one in m.
    Raises ValueError, or logs a warning, where a mesh cannot be a body.
    """

    def __init__(self, source: Any, scale: float | None = None) -> None:
        self.scale = 1.0 if scale is None else positive("scale", scale, "m per unit of the mesh")
        read = read_mesh(source)
        self.kind, blocks = _volumes(read)
        make, self.element, corners, self.order = CELLS[self.kind]
        points, cells, self._number = used(self.scale * points_of(read), joined(read, blocks, self.kind), corners)
        edges = _edges(points, cells[:, :corners])
        _check_scale(points, edges, scale)
        _check_shapes(points, cells[:, :corners])
        check_whole(cells)
        self.longest_edge, self.shortest_side = float(edges.max()), float(np.ptp(points, axis=0).min())
        order = _hexahedron_order(cells.shape[1]) if corners == 8 else np.arange(cells.shape[1])
        self.mesh = make(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T[order]))
        self._check_curves()
        self.cells = tagged(read, blocks, dimension=3)
        self.facets = tagged_facets(read, self.mesh, self._number, FACETS)

    def materials(self, given: Material | Mapping[Tag, Material]) -> tuple[list[Material], Numbers]:
        """The materials, and for each cell which one it is made of."""
        count = self.mesh.nelements
        if isinstance(given, Material):
            return [given], np.zeros(count, dtype=np.int64)
        instance("material", given, Mapping, "a Material, or a dictionary of them by tag of cells")
        owner, tags = np.full(count, -1), list(given)
        for i, tag in enumerate(tags):
            instance(f"material[{tag!r}]", given[tag], Material, "a Material; MATERIALS[name] gives one by name")
            cells = self.cells[known("material", tag, self.cells)]
            if np.any(owner[cells] >= 0):
                other = tags[int(owner[cells].max())]
                raise ValueError(f"material: {other!r} and {tag!r} share cells, and a cell has one material")
            owner[cells] = i
        bare = np.flatnonzero(owner < 0)
        if bare.size:
            missing = [tag for tag, cells in self.cells.items() if np.isin(cells, bare).any()]
            raise ValueError(f"material: {bare.size} of {count} cells have none; their tags are {names(missing)}")
        return list(given.values()), owner

    def boundary(self, name: str, tag: Tag) -> Numbers:
        """The facets on the boundary that have the tag; name: of the argument that asks for it."""
        facets = self.facets[known(name, tag, self.facets)]
        if not facets.size:
            raise ValueError(f"{name} = {tag!r}: holds no whole facet of the boundary")
        return facets

    def _check_curves(self) -> None:
        """A ValueError where the midpoints of a curved cell turn it inside out."""
        if self.kind not in ("tetra10", "hexahedron27"):
            return
        from skfem import Basis

        basis = Basis(self.mesh, self.element(), intorder=self.order)
        jacobian = self.mesh.mapping().detDF(basis.X)
        bad = np.flatnonzero((jacobian.min(axis=1) <= 0.0) & (jacobian.max(axis=1) >= 0.0))
        if bad.size:
            place = near(self.mesh.p[:, self.mesh.t[:, bad[0]]].T)
            raise ValueError(
                f"mesh: the midpoints of {bad.size} of {self.mesh.nelements} cells fold them, the first near {place}"
            )


def _volumes(source: Any) -> tuple[str, list[int]]:
    """The type of the cells that fill the body, and their blocks."""
    kinds = {block.type for block in source.cells if block.type not in IGNORED and len(block.data)}
    if not kinds:
        raise ValueError("mesh: has no tetrahedra nor hexahedra; mesh the volume, and save it (in gmsh as a group)")
    if not kinds <= set(CELLS):
        raise ValueError(f"mesh: has cells of type {names(sorted(kinds - set(CELLS)))}; must be one of {names(CELLS)}")
    if len(kinds) > 1:
        raise ValueError(f"mesh: mixes cells of type {names(sorted(kinds))}; must have one type")
    kind = kinds.pop()
    return kind, [i for i, block in enumerate(source.cells) if block.type == kind]


def _edges(points: Vector, corners: Numbers) -> Vector:
    """Lengths of the edges of each cell, m; those of a tetrahedron at its first corner, and of the face beyond."""
    frames = FRAMES[8] if corners.shape[1] == 8 else ((0, 1, 2, 3), (1, 2, 3), (2, 3))
    pairs = np.array([(start, other) for start, *others in frames for other in others])
    lengths: Vector = np.linalg.norm(points[corners[:, pairs[:, 0]]] - points[corners[:, pairs[:, 1]]], axis=2)
    return lengths


def _check_scale(points: Vector, edges: Vector, scale: float | None) -> None:
    sides = np.ptp(points, axis=0)
    if scale is None and (sides.max() > LONGEST_SIDE or edges.min() > SHORTEST_EDGE):
        raise ValueError(
            f"mesh: its box is {' × '.join(f'{side:.3g}' for side in sides)} m, its shortest edge {edges.min():.3g} m: "
            "in millimetres? Give scale=1e-3, or scale=1.0 if it is in m"
        )


def _check_shapes(points: Vector, corners: Numbers) -> None:
    """A ValueError where cells are flat, folded or inverted; where all are inverted, that is only their numbering."""
    at = points[corners]
    frames = [np.stack([at[:, i] - at[:, start] for i in others], 1) for start, *others in FRAMES[corners.shape[1]]]
    volumes, least = np.linalg.det(np.array(frames)), FLAT * np.ptp(at, axis=1).max(axis=1) ** 3
    upright, inverted = (volumes > least).all(axis=0), (volumes < -least).all(axis=0)
    for bad, what in (
        (~upright & ~inverted, "flat or folded"),
        (inverted & upright.any(), "inverted (negative Jacobian)"),
    ):
        if bad.any():
            first = near(at[np.flatnonzero(bad)[0]])
            raise ValueError(f"mesh: {bad.sum()} of {len(at)} cells are {what}, the first near {first}")
    if inverted.all():
        caution("mesh: all cells are inverted (negative Jacobian); they are read as numbered the other way round")


def _hexahedron_order(points: int) -> Numbers:
    """scikit-fem's order of a hexahedron's points, in meshio's."""
    from skfem.io.meshio import INV_HEX_MAPPING

    return np.array(INV_HEX_MAPPING[:points])
