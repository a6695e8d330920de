"""The mesh of a solid body: checks of its cells and facets, and the scikit-fem mesh with tags."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from skfem import ElementHex2, ElementTetP2, FacetBasis, MeshHex1, MeshHex2, MeshTet1, MeshTet2

from structures.caution import caution
from structures.checks import instance
from structures.material import Material
from structures.meshes import mesh_reading as reading
from structures.meshes.mesh_files import read_mesh
from structures.meshes.mesh_reading import FLAT_CORNERS, Numbers, Tag, Tags, names, near
from structures.meshes.mesh_topology import HEXAHEDRON, TETRAHEDRON, check_joined, edge_lengths, without_duplicates
from structures.structure import Vector

FLAT_JACOBIAN = 1e-9  # A cell is flat if its Jacobian at a corner is below this fraction of the cube of its size

NO_VOLUME = ("vertex", "line", "line3", *FLAT_CORNERS)

# For each of meshio's cell types: scikit-fem's mesh and element, the number of corners, the order of integration
CELL_TYPES: dict[str, tuple[Any, Any, int, int]] = {
    "tetra": (MeshTet1, ElementTetP2, 4, 4),
    "tetra10": (MeshTet2, ElementTetP2, 4, 5),
    "hexahedron": (MeshHex1, ElementHex2, 8, 5),
    "hexahedron20": (MeshHex1, ElementHex2, 8, 5),
    "hexahedron27": (MeshHex2, ElementHex2, 8, 5),
}

# Corners of a cell in meshio's order, each with its three neighbours in right-handed order
CORNER_NEIGHBOURS = {
    4: ((0, 1, 2, 3),),
    8: ((0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7), (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)),
}


class BodyMesh:
    """The scikit-fem mesh of a body, in m, with one type of cells. The arguments are those of `solid`.

    `cells` and `facets` map each tag to the numbers of its cells and of its boundary facets. A mesh that cannot be a
    body raises a ValueError; a doubtful one causes a warning.
    """

    def __init__(self, source: Any, scale: float | None = None, tags: str | None = None) -> None:
        self.scale = 1.0 if scale is None else scale
        read = read_mesh(source)
        blocks = [i for i, block in enumerate(read.cells) if block.type not in NO_VOLUME and len(block.data)]
        kinds = sorted({read.cells[i].type for i in blocks})
        if len(kinds) != 1 or kinds[0] not in CELL_TYPES:
            has = f"cells of type {names(kinds)}" if kinds else "no solid cells (mesh the volume, save it as a group)"
            raise ValueError(f"mesh: has {has}; must have one type of {names(CELL_TYPES)}")
        (kind,) = kinds
        make, self.element, corners, self.order = CELL_TYPES[kind]
        sides = TETRAHEDRON if corners == 4 else HEXAHEDRON
        points = self.scale * reading.points_of(read)
        cells, renumbered = without_duplicates(np.concatenate([reading.cells_of(read, i) for i in blocks]), corners)
        if kind == "hexahedron20":
            caution("mesh: midpoints of hexahedron20 are dropped, so edges become straight; hexahedron27 keeps them")
            cells = cells[:, :corners]
        points, cells, number = reading.used(points, cells, corners)
        edges = edge_lengths(points, cells[:, :corners], sides)
        # 20 mm is a quarter of the wavelength of shear waves of 40 kHz in steel.
        reading.check_scale(points, bool(edges.min() > 0.02), f"its shortest edge {edges.min():.3g} m", scale)
        _check_shapes(points, cells[:, :corners])
        check_joined(points, cells[:, :corners], sides, float(edges.min()))
        self.longest_edge, self.shortest_side = float(edges.max()), float(np.ptp(points, axis=0).min())
        if corners == 8:
            from skfem.io.meshio import INV_HEX_MAPPING  # loads meshio

            cells = cells[:, INV_HEX_MAPPING[: cells.shape[1]]]
        self.mesh = make(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
        if kind in ("tetra10", "hexahedron27"):
            _check_curves(self.mesh)
        groups = {tag: np.unique(renumbered[members]) for tag, members in reading.tagged(read, blocks, 3, tags).items()}
        self.cells = Tags(groups, reading.hint_of(read, tags))
        self.facets = reading.tagged_facets(read, self.mesh, number, FLAT_CORNERS, tags)

    def materials(self, material: Material | Mapping[Tag, Material]) -> tuple[list[Material], Numbers]:
        """Return the materials, and the index of the material of each cell."""
        count = self.mesh.nelements
        if isinstance(material, Material):
            return [material], np.zeros(count, dtype=np.int64)
        instance("material", material, Mapping, "a Material, or a dictionary from tags of cells to Materials")
        owner, tags = np.full(count, -1), list(material)
        for i, tag in enumerate(tags):
            instance(f"material[{tag!r}]", material[tag], Material, "a Material; MATERIALS[name] gives one by name")
            cells = self.cells.of("material", tag)
            if np.any(owner[cells] >= 0):
                other = tags[int(owner[cells].max())]
                raise ValueError(f"material: {other!r} and {tag!r} share cells; each cell must have one material")
            owner[cells] = i
        bare = np.flatnonzero(owner < 0)
        if bare.size:
            missing = [tag for tag, cells in self.cells.groups.items() if np.isin(cells, bare).any()]
            raise ValueError(f"material: {bare.size} of {count} cells have no material; their tags: {names(missing)}")
        return list(material.values()), owner

    def area(self, facets: Numbers) -> float:
        """Return the area of facets, m²."""
        return float(FacetBasis(self.mesh, self.element(), facets=facets, intorder=self.order).dx.sum())


def _check_shapes(points: Vector, corners: Numbers) -> None:
    """Raise a ValueError if cells are flat, folded or inverted; only warn if all cells are inverted."""
    at = points[corners]
    frames = [
        np.stack([at[:, i] - at[:, start] for i in others], 1) for start, *others in CORNER_NEIGHBOURS[corners.shape[1]]
    ]
    volumes, least = np.linalg.det(frames), FLAT_JACOBIAN * np.ptp(at, axis=1).max(axis=1) ** 3
    upright, inverted = (volumes > least).all(axis=0), (volumes < -least).all(axis=0)
    for bad, what in (
        (~upright & ~inverted, "flat or folded"),
        (inverted & upright.any(), "inverted (negative Jacobian)"),
    ):
        if bad.any():
            first = near(at[np.flatnonzero(bad)[0]])
            raise ValueError(f"mesh: {bad.sum()} of {len(at)} cells are {what}, the first near {first}")
    if inverted.all():
        caution("mesh: all cells are inverted (negative Jacobian); they are read with the reversed numbering")


def _check_curves(mesh: Any) -> None:
    """Raise a ValueError if the midpoints of a curved cell turn part of the cell inside out."""
    mapping, suspects = mesh.mapping(), np.arange(mesh.nelements)
    for steps in (2, 12):  # points along an edge: few in all cells, then more in those that may fold
        line = np.linspace(0.0, 1.0, steps + 1)
        inside = np.array(np.meshgrid(line, line, line, indexing="ij")).reshape(3, -1)
        if mesh.t.shape[0] == 4:
            inside = inside[:, inside.sum(axis=0) <= 1.0 + 1e-9]
        jacobian = np.asarray(mapping.detDF(inside, suspects))
        least, largest = jacobian.min(axis=1), jacobian.max(axis=1)
        size = np.maximum(np.abs(least), np.abs(largest))
        bad = (least <= FLAT_JACOBIAN * size) & (largest >= -FLAT_JACOBIAN * size)
        if bad.any():
            first = int(suspects[bad][0])
            at = mapping.F(inside[:, jacobian[bad][0].argsort()[:1]], np.array([first]))
            raise ValueError(f"mesh: midpoints fold {bad.sum()} cells, the first near {near(at[:, 0].T)}")
        suspects = suspects[np.minimum(np.abs(least), np.abs(largest)) < 0.3 * size]
