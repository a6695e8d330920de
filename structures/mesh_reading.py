"""Reading mesh files by meshio: points, cells and tags become checked arrays, for solid bodies and for plates."""

import re
from collections.abc import Collection, Mapping
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from structures.caution import caution
from structures.checks import one_of
from structures.hdf5 import check_hdf5
from structures.structure import Vector

HDF5 = b"\x89HDF\r\n\x1a\n"
"""The first bytes of every HDF5 file."""

DATA_ITEM = re.compile(r"""<DataItem(?=[^>]*Format\s*=\s*["'](?:HDF|Binary))[^>]*>([^<:]+)""")

NAMES_A_FILE = {
    ".inp": re.compile(r"^[ \t]*\*(?=[ \t]*INCLUDE\b|[^*\n]*\bINPUT[ \t]*=).*=(.*)$", re.IGNORECASE | re.MULTILINE),
    ".xdmf": DATA_ITEM,
    ".xmf": DATA_ITEM,
}
"""How a mesh that is a text names other files."""

Numbers: TypeAlias = NDArray[np.int64]
Tag: TypeAlias = str | int
Groups: TypeAlias = dict[Tag, Numbers]


def known(name: str, tag: Tag, groups: Collection[Tag]) -> Tag:
    """`tag`; otherwise a ValueError that lists the existing tags and the nearest one; name: of the argument."""
    if isinstance(tag, str | int) and tag in groups:
        return tag
    if not groups:
        raise ValueError(f"{name} = {tag!r}: the mesh has no tags for it")
    if isinstance(tag, str):
        one_of(name, tag, [str(one) for one in groups])
    raise ValueError(f"{name} = {tag!r}: must be one of {names(groups)}")


def source_of(mesh: Any) -> str:
    """What a structure's origin says of its mesh: the file, wherever it is read again from, or "meshio.Mesh"."""
    return str(Path(mesh).absolute()) if isinstance(mesh, str | Path) else "meshio.Mesh"


def read_mesh(source: Any) -> Any:
    """The meshio.Mesh of a file. meshio itself prints a message and ends the process if it cannot read a file."""
    import meshio  # type: ignore[import-untyped]

    if isinstance(source, meshio.Mesh):
        return source
    if not isinstance(source, str | Path):
        raise ValueError(f"mesh = {source!r}: must be the path of a file, or a meshio.Mesh")
    if not Path(source).is_file():
        raise ValueError(f"mesh = {str(source)!r}: there is no such file")
    _check_inside(Path(source), str(source), set())
    said, reason = StringIO(), ""
    try:
        with redirect_stdout(said), redirect_stderr(said):
            return meshio.read(source)
    except (meshio.ReadError, SystemExit) as error:
        reason = said.getvalue() or str(error)
    except (ArithmeticError, AssertionError, AttributeError, EOFError, ImportError, LookupError, OSError) as error:
        reason = repr(error)
    except (MemoryError, RuntimeError, SyntaxError, TypeError, ValueError) as error:
        reason = repr(error)
    raise ValueError(
        f"mesh = {str(source)!r}: meshio cannot read it ({' '.join(reason.split())}); "
        "gmsh's .msh, .vtu and Abaqus' .inp are known to work"
    )


def _check_inside(path: Path, named: str, seen: set[Path]) -> None:
    """A ValueError for a mesh that would read files outside its folder: by a link of HDF5, of XDMF or of Abaqus."""
    if path.resolve() in seen:
        return
    seen.add(path.resolve())
    with path.open("rb") as file:
        start = file.read(len(HDF5))
    if start == HDF5:
        check_hdf5(path, f"mesh = {named!r}")
        return
    finder = NAMES_A_FILE.get(path.suffix.lower())
    for found in finder.findall(path.read_text(encoding="utf-8", errors="replace")) if finder else ():
        other, folder = Path(found.strip()), path.resolve().parent
        # meshio takes some names from the current folder, if there is such a file.
        places = [folder / other, *([other.resolve()] if other.exists() else [])]
        if any(not place.resolve().is_relative_to(folder) for place in places):
            raise ValueError(
                f"mesh = {named!r}: names {found.strip()!r}, which lies outside its folder; it was not read"
            )
        if (folder / other).is_file():
            _check_inside(folder / other, named, seen)


def points_of(source: Any) -> Vector:
    """Points, p × 3; a ValueError if they are not finite."""
    points = np.asarray(source.points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise ValueError(f"mesh: has points of shape {points.shape}; must be finite, with three coordinates each")
    return points


def joined(source: Any, blocks: list[int], kind: str) -> Numbers:
    """All cells, one row of points each."""
    cells = np.concatenate([np.asarray(source.cells[i].data, dtype=np.int64) for i in blocks])
    if cells.min() < 0 or cells.max() >= len(source.points):
        raise ValueError(f"mesh: has a cell with point {cells.max()}, but only {len(source.points)} points")
    if kind == "hexahedron20":
        caution("mesh: midpoints of hexahedron20 are dropped, so edges become straight; hexahedron27 keeps them")
        cells = cells[:, :8]
    return cells


def used(points: Vector, cells: Numbers, corners: int) -> tuple[Vector, Numbers, Numbers]:
    """Points and cells without unused points, corners first; and the new number of each point, or −1."""
    first = np.unique(cells[:, :corners])
    kept = np.concatenate([first, np.setdiff1d(cells, first)])
    if kept.size < len(points):
        caution(f"mesh: {len(points) - kept.size} of {len(points)} points belong to no cell and are dropped")
    number = np.full(len(points), -1)
    number[kept] = np.arange(kept.size)
    return points[kept], number[cells], number


def check_whole(cells: Numbers) -> None:
    """Raise a ValueError if the body is not connected, as in assemblies whose parts share no points."""
    first, others = np.repeat(cells[:, :1], cells.shape[1] - 1, axis=1).ravel(), cells[:, 1:].ravel()
    size = int(cells.max()) + 1
    pieces = connected_components(sparse.coo_array((np.ones(first.size), (first, others)), shape=(size, size)))[0]
    if pieces > 1:
        raise ValueError(f"mesh: consists of {pieces} pieces that share no points; merge coincident points")


def tagged(source: Any, blocks: list[int], dimension: int) -> Groups:
    """By name and by number: the members of the blocks, numbered consecutively through all blocks."""
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
    """The number of each cell of the blocks: gmsh's physical group, or otherwise the only integers in the file."""
    whole = [
        name
        for name, parts in source.cell_data.items()
        if all(np.asarray(part).dtype.kind in "iu" and np.ndim(part) == 1 for part in parts)
    ]
    chosen = "gmsh:physical" if "gmsh:physical" in whole else whole[0] if len(whole) == 1 else None
    if chosen is None or not blocks:
        return np.zeros(0, dtype=np.int64)
    return np.concatenate([np.asarray(source.cell_data[chosen][i], dtype=np.int64) for i in blocks])


def near(corners: Vector) -> str:
    return f"({', '.join(f'{x:.4g}' for x in corners.mean(axis=0))}) m"


def names(items: Collection[Tag]) -> str:
    return ", ".join(map(repr, items))


def tagged_facets(source: Any, mesh: Any, number: Numbers, kinds: Mapping[str, int]) -> Groups:
    """By tag: boundary facets that the file lists as cells, and those whose corners all belong to a set of points.

    mesh: scikit-fem's. number: the mesh's number of each of the file's points, or −1. kinds: meshio's types of facets,
    and their numbers of corners.
    """
    boundary = mesh.boundary_facets()
    corners = np.sort(mesh.facets[:, boundary], axis=0).T
    place = {tuple(key): facet for key, facet in zip(corners.tolist(), boundary.tolist(), strict=True)}
    blocks = [i for i, block in enumerate(source.cells) if block.type in kinds]
    listed = [np.sort(number[source.cells[i].data[:, : kinds[source.cells[i].type]]]) for i in blocks]
    found = np.array([place.get(tuple(key), -1) for block in listed for key in block.tolist()], dtype=np.int64)
    groups = {tag: found[members] for tag, members in tagged(source, blocks, mesh.dim() - 1).items()}
    for tag, members in source.point_sets.items():
        inside = np.zeros(len(number) + 1, dtype=bool)
        inside[number[np.asarray(members, dtype=np.int64)]] = True
        groups.setdefault(tag, boundary[inside[corners].all(axis=1)])
    return {tag: np.unique(facets[facets >= 0]) for tag, facets in groups.items()}
