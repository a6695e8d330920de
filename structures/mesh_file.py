"""Meshes of solid bodies from files: what meshio reads, checked, with its tags, for scikit-fem."""

import logging
from collections.abc import Collection, Mapping
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from skfem import ElementHex2, ElementTetP2, MeshHex1, MeshHex2, MeshTet1, MeshTet2

from structures.checks import instance, one_of, positive
from structures.material import Material
from structures.structure import Vector

log = logging.getLogger("hertzlink.solid")

Numbers: TypeAlias = NDArray[np.int64]
Tag: TypeAlias = str | int
Groups: TypeAlias = dict[Tag, Numbers]

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
        read = _read(source)
        self.kind, blocks = _volumes(read)
        make, self.element, corners, self.order = CELLS[self.kind]
        points, cells, self._number = _used(self.scale * _points(read), _joined(read, blocks, self.kind), corners)
        edges = _edges(points, cells[:, :corners])
        _check_scale(points, edges, scale)
        _check_shapes(points, cells[:, :corners])
        _check_whole(cells)
        self.longest_edge, self.shortest_side = float(edges.max()), float(np.ptp(points, axis=0).min())
        order = _hexahedron_order(cells.shape[1]) if corners == 8 else np.arange(cells.shape[1])
        self.mesh = make(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T[order]))
        self._check_curves()
        self.cells = _tagged(read, blocks, dimension=3)
        self.facets = self._tagged_facets(read)

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
            raise ValueError(f"material: {bare.size} of {count} cells have none; their tags are {_list(missing)}")
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
            place = _near(self.mesh.p[:, self.mesh.t[:, bad[0]]].T)
            raise ValueError(
                f"mesh: the midpoints of {bad.size} of {self.mesh.nelements} cells fold them, the first near {place}"
            )

    def _tagged_facets(self, source: Any) -> Groups:
        """By tag: the facets that the file lists as cells, and those all of whose corners a set of points holds."""
        boundary = self.mesh.boundary_facets()
        corners = np.sort(self.mesh.facets[:, boundary], axis=0).T
        place = {tuple(key): facet for key, facet in zip(corners.tolist(), boundary.tolist(), strict=True)}
        blocks = [i for i, block in enumerate(source.cells) if block.type in FACETS]
        listed = [np.sort(self._number[source.cells[i].data[:, : FACETS[source.cells[i].type]]]) for i in blocks]
        found = np.array([place.get(tuple(key), -1) for block in listed for key in block.tolist()], dtype=np.int64)
        groups = {tag: found[members] for tag, members in _tagged(source, blocks, dimension=2).items()}
        for tag, members in source.point_sets.items():
            inside = np.zeros(len(self._number) + 1, dtype=bool)
            inside[self._number[np.asarray(members, dtype=np.int64)]] = True
            groups.setdefault(tag, boundary[inside[corners].all(axis=1)])
        return {tag: np.unique(facets[facets >= 0]) for tag, facets in groups.items()}


def known(name: str, tag: Tag, groups: Collection[Tag]) -> Tag:
    """`tag`, or a ValueError that lists the tags there are and the nearest one; name: of the argument."""
    if isinstance(tag, str | int) and tag in groups:
        return tag
    if not groups:
        raise ValueError(f"{name} = {tag!r}: the mesh has no tags for it")
    if isinstance(tag, str):
        one_of(name, tag, [str(one) for one in groups])
    raise ValueError(f"{name} = {tag!r}: must be one of {_list(groups)}")


def _read(source: Any) -> Any:
    """The meshio.Mesh of a file; meshio itself prints, and ends the process, where it cannot read one."""
    import meshio  # type: ignore[import-untyped]

    if isinstance(source, meshio.Mesh):
        return source
    if not isinstance(source, str | Path):
        raise ValueError(f"mesh = {source!r}: must be the path of a file, or a meshio.Mesh")
    if not Path(source).is_file():
        raise ValueError(f"mesh = {str(source)!r}: there is no such file")
    said, reason = StringIO(), ""
    try:
        with redirect_stdout(said), redirect_stderr(said):
            return meshio.read(source)
    except (meshio.ReadError, SystemExit) as error:
        reason = said.getvalue() or str(error)
    except (ArithmeticError, AssertionError, AttributeError, EOFError, ImportError, LookupError, OSError) as error:
        reason = repr(error)
    except (RuntimeError, SyntaxError, TypeError, ValueError) as error:
        reason = repr(error)
    raise ValueError(
        f"mesh = {str(source)!r}: meshio cannot read it ({' '.join(reason.split())}); "
        "gmsh's .msh, .vtu and Abaqus' .inp are known to work"
    )


def _points(source: Any) -> Vector:
    points = np.asarray(source.points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError(f"mesh: has points of shape {points.shape}; must be finite, with three coordinates each")
    return points


def _volumes(source: Any) -> tuple[str, list[int]]:
    """The type of the cells that fill the body, and their blocks."""
    kinds = {block.type for block in source.cells if block.type not in IGNORED and len(block.data)}
    if not kinds:
        raise ValueError("mesh: has no tetrahedra nor hexahedra; mesh the volume, and save it (in gmsh as a group)")
    if not kinds <= set(CELLS):
        raise ValueError(f"mesh: has cells of type {_list(sorted(kinds - set(CELLS)))}; must be one of {_list(CELLS)}")
    if len(kinds) > 1:
        raise ValueError(f"mesh: mixes cells of type {_list(sorted(kinds))}; must have one type")
    kind = kinds.pop()
    return kind, [i for i, block in enumerate(source.cells) if block.type == kind]


def _joined(source: Any, blocks: list[int], kind: str) -> Numbers:
    """All cells, a row of points each."""
    cells = np.concatenate([np.asarray(source.cells[i].data, dtype=np.int64) for i in blocks])
    if cells.min() < 0 or cells.max() >= len(source.points):
        raise ValueError(f"mesh: has a cell with point {cells.max()}, but only {len(source.points)} points")
    if kind == "hexahedron20":
        log.warning("mesh: midpoints of hexahedron20 are dropped, so edges become straight; hexahedron27 keeps them")
        cells = cells[:, :8]
    return cells


def _used(points: Vector, cells: Numbers, corners: int) -> tuple[Vector, Numbers, Numbers]:
    """Points and cells without unused points, corners first; and the new number of each point, or −1."""
    first = np.unique(cells[:, :corners])
    kept = np.concatenate([first, np.setdiff1d(cells, first)])
    if kept.size < len(points):
        log.warning("mesh: %d of %d points belong to no cell; dropped", len(points) - kept.size, len(points))
    number = np.full(len(points), -1)
    number[kept] = np.arange(kept.size)
    return points[kept], number[cells], number


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
            first = _near(at[np.flatnonzero(bad)[0]])
            raise ValueError(f"mesh: {bad.sum()} of {len(at)} cells are {what}, the first near {first}")
    if inverted.all():
        log.warning("mesh: all cells are inverted (negative Jacobian): read as numbered the other way round")


def _check_whole(cells: Numbers) -> None:
    """A ValueError where the body falls to pieces, as assemblies do whose parts share no points."""
    first, others = np.repeat(cells[:, :1], cells.shape[1] - 1, axis=1).ravel(), cells[:, 1:].ravel()
    size = int(cells.max()) + 1
    pieces = connected_components(sparse.coo_array((np.ones(first.size), (first, others)), shape=(size, size)))[0]
    if pieces > 1:
        raise ValueError(f"mesh: falls into {pieces} pieces that share no points; merge coincident points")


def _tagged(source: Any, blocks: list[int], dimension: int) -> Groups:
    """By name and by number: the members of the blocks, counted through all of them."""
    starts = np.cumsum([0] + [len(source.cells[i].data) for i in blocks])
    groups: Groups = {}
    for name, parts in source.cell_sets.items():
        here = [(start, i) for start, i in zip(starts[:-1], blocks, strict=True) if i < len(parts)]
        members = [start + np.asarray(parts[i], dtype=np.int64) for start, i in here if parts[i] is not None]
        if not name.startswith("gmsh:") and members:
            groups[name] = np.concatenate(members)
    numbers = _numbers(source, blocks)
    groups.update({int(tag): np.flatnonzero(numbers == tag) for tag in np.unique(numbers)})
    for name, (tag, its_dimension) in source.field_data.items():
        if its_dimension == dimension and int(tag) in groups:
            groups.setdefault(name, groups[int(tag)])
    return {tag: members for tag, members in groups.items() if members.size}


def _numbers(source: Any, blocks: list[int]) -> Numbers:
    """The number of each cell of the blocks: gmsh's physical group, or else the file's only whole numbers."""
    whole = [
        name
        for name, parts in source.cell_data.items()
        if all(np.asarray(part).dtype.kind in "iu" and np.ndim(part) == 1 for part in parts)
    ]
    chosen = "gmsh:physical" if "gmsh:physical" in whole else whole[0] if len(whole) == 1 else None
    if chosen is None or not blocks:
        return np.zeros(0, dtype=np.int64)
    return np.concatenate([np.asarray(source.cell_data[chosen][i], dtype=np.int64) for i in blocks])


def _hexahedron_order(points: int) -> Numbers:
    """scikit-fem's order of a hexahedron's points, in meshio's."""
    from skfem.io.meshio import INV_HEX_MAPPING

    return np.array(INV_HEX_MAPPING[:points])


def _near(corners: Vector) -> str:
    return f"({', '.join(f'{x:.4g}' for x in corners.mean(axis=0))}) m"


def _list(items: Collection[Tag]) -> str:
    return ", ".join(map(repr, items))
