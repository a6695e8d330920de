"""Points, cells and tags of a meshio.Mesh as checked arrays, for solids and plates."""

from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from structures.caution import caution
from structures.checks import one_of
from structures.structure import Vector

Numbers: TypeAlias = NDArray[np.int64]
Tag: TypeAlias = str | int
Groups: TypeAlias = dict[Tag, Numbers]

LONGEST_SIDE = 10.0  # m. A longer body or plate is probably in millimetres.

# The number of corners of each of meshio's types of flat cells
FLAT_CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}

FARTHEST, LARGEST_TAG = 1e12, 2.0**53  # The limits of coordinates, in any unit of length, and of tags

# meshio's name of the numbers of gmsh's groups: 0 for cells without a group, negative for cells turned over
GMSH = "gmsh:physical"

NO_GROUPS = "; gmsh wrote no physical groups: in files of version 2.2, save without Mesh.SaveAll = 1"


class Tags(NamedTuple):
    """Groups of cells or of facets by tag.

    hint: other data of the mesh that could be tags. left: for some tags, which facets or points are left out, in words.
    """

    groups: Groups
    hint: str = ""
    left: Mapping[Tag, str] = MappingProxyType({})

    def of(self, name: str, tag: Tag) -> Numbers:
        """Return the members of a tag; name: the argument that got the tag."""
        hint = self.hint if self.groups else f"; the mesh has no tags of this kind{self.hint}"
        members = self.groups[one_of(name, tag, self.groups, hint)]
        if not members.size:
            raise ValueError(f"{name} = {tag!r}: must hold a whole facet of the boundary")
        if tag in self.left:
            caution(f"{name} = {tag!r}: {self.left[tag]}")
        return members


def points_of(source: Any, flat: bool = False) -> Vector:
    """Return the points, p × 3; raise a ValueError if they are not finite. A flat mesh may have two coordinates."""
    points = np.asarray(source.points, dtype=float)
    if flat and points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    if points.ndim != 2 or points.shape[1] != 3 or not (np.abs(points) < FARTHEST).all():
        raise ValueError(f"mesh: points have shape {points.shape}; must be finite, with three coordinates each")
    return points


def cells_of(source: Any, block: int) -> Numbers:
    """Return the cells of a block, a row of points each; raise a ValueError if a point does not exist."""
    cells = np.asarray(source.cells[block].data, dtype=np.int64)
    if cells.size and (cells.min() < 0 or cells.max() >= len(source.points)):
        raise ValueError(f"mesh: has a cell with point {cells.max()}, but only {len(source.points)} points")
    return cells


def used(points: Vector, cells: Numbers, corners: int) -> tuple[Vector, Numbers, Numbers]:
    """Return points and cells without unused points, corners first, and the new number of each point, or −1."""
    first = np.unique(cells[:, :corners])
    cell_order = np.concatenate([first, np.setdiff1d(cells, first)])
    number = np.full(len(points), -1)
    number[cell_order] = np.arange(cell_order.size)
    if (number < 0).any():
        caution(f"mesh: {(number < 0).sum()} of {len(points)} points belong to no cell and are dropped")
    return points[cell_order], number[cells], number


def check_scale(points: Vector, unlikely: bool, what: str, scale: float | None) -> None:
    """Raise a ValueError for a mesh that is probably in millimetres. what: a reason besides its size."""
    if scale is None and (np.ptp(points, axis=0).max() > LONGEST_SIDE or unlikely):
        raise ValueError(f"mesh: its box is {box_of(points)} m, {what}: in millimetres? Give scale=1e-3, or scale=1.0")


def tagged(source: Any, blocks: list[int], dimension: int, field: str | None) -> Groups:
    """Return the members of each tag, by name and by number. Members are numbered consecutively through the blocks.

    field: the cell data with the tags; None means gmsh's groups, or the only such data in the file.
    """
    sizes = [len(source.cells[i].data) for i in blocks]
    groups: Groups = {}
    for name, parts in source.cell_sets.items():
        if str(name).startswith("gmsh:"):
            continue
        if len(parts) != len(source.cells):
            raise ValueError(f"mesh: the set {name!r} must fit the cells; give the path of the file")
        groups[name] = np.zeros(0, dtype=np.int64)
        for i, size, start in zip(blocks, sizes, np.cumsum([0, *sizes]), strict=False):
            members = _members(name, [] if parts[i] is None else parts[i], size)
            groups[name] = np.append(groups[name], start + members)

    fields = tag_fields(source)
    if field is not None:
        one_of("tags", field, fields)
    chosen = field or (GMSH if GMSH in fields else fields[0] if len(fields) == 1 else None)
    if chosen is not None and blocks:
        numbers = np.concatenate([np.asarray(source.cell_data[chosen][i]).ravel() for i in blocks]).astype(np.int64)
        by_gmsh = chosen == GMSH
        numbers = np.abs(numbers) if by_gmsh else numbers
        groups |= {int(tag): np.flatnonzero(numbers == tag) for tag in np.unique(numbers) if tag or not by_gmsh}
    # field_data of gmsh: a number and a dimension for each name. In VTK files field_data have other meanings.
    for name, pair in source.field_data.items() if GMSH in source.cell_data else ():
        tag, its_dimension = pair.tolist()
        if its_dimension == dimension and tag in groups:  # meshio's sets lack cells that are turned over
            groups[name] = np.union1d(groups.get(name, groups[tag]), groups[tag])
    return {tag: members for tag, members in groups.items() if members.size}


def tag_fields(source: Any) -> list[str]:
    """Return the names of data with a whole number for each cell; only those stored as integers, if there are any."""
    whole, stored = list[str](), list[str]()
    for name, parts in source.cell_data.items():
        kinds, numbers = {np.asarray(part).dtype.kind for part in parts}, np.concatenate([*map(np.ravel, parts)])
        if kinds <= set("iuf") and numbers.size == sum(map(len, parts)) and (np.abs(numbers) < LARGEST_TAG).all():
            whole += [name] * bool((numbers == np.round(numbers)).all())
            stored += [name] * (kinds <= set("iu"))
    return stored or whole


def hint_of(source: Any, field: str | None) -> str:
    """Return a hint for an error if gmsh wrote no groups, or if several data could be tags and none was chosen."""
    fields = tag_fields(source)
    if GMSH in fields:
        return "" if any(np.any(part) for part in source.cell_data[GMSH]) else NO_GROUPS
    if field is not None or len(fields) < 2:
        return ""
    return f"; its cells are numbered by {names(fields)}: choose one by tags="


def tagged_facets(source: Any, mesh: Any, number: Numbers, kinds: Mapping[str, int], field: str | None) -> Tags:
    """Return by tag the boundary facets that the file lists as cells, or whose corners all belong to a set of points.

    mesh: the scikit-fem mesh. number: the number in it of each point of the file. kinds: the number of corners of each
    type of facet.
    """
    boundary = mesh.boundary_facets()
    corners = np.sort(mesh.facets[:, boundary], axis=0).T
    place = {tuple(key): facet for key, facet in zip(corners.tolist(), boundary.tolist(), strict=True)}
    blocks = [i for i, block in enumerate(source.cells) if block.type in kinds]
    found: list[int] = []
    for i in blocks:
        facets = number[cells_of(source, i)[:, : kinds[source.cells[i].type]]]
        found += [place.get(tuple(key), -1) for key in np.sort(facets).tolist()]
    groups, left = {}, {}
    for tag, members in tagged(source, blocks, mesh.dim() - 1, field).items():
        facets = np.array(found, dtype=np.int64)[members]
        groups[tag] = np.unique(facets[facets >= 0])
        inside = facets < 0
        if inside.any():
            left[tag] = f"{inside.sum()} of {inside.size} facets lie inside the mesh or on no cell and are left out"
    for tag, members in source.point_sets.items():
        if tag in groups:
            continue
        points = np.unique(number[_members(tag, members, len(number))])
        held = np.isin(corners, points[points >= 0]).all(axis=1)
        groups[tag] = boundary[held]
        # Midpoints of curved facets do not count.
        alone = np.intersect1d(np.setdiff1d(points, corners[held]), mesh.t)
        if alone.size:
            left[tag] = f"{alone.size} of {points.size} points are corners of no whole facet and are left out"
    return Tags(groups, hint_of(source, field), left)


def _members(name: Tag, members: Any, count: int) -> Numbers:
    """Return the members of a set; raise a ValueError if one is not below the count."""
    numbers = np.asarray(members)
    if numbers.size and (numbers.dtype.kind not in "iu" or numbers.min() < 0 or numbers.max() >= count):
        raise ValueError(f"mesh: the set {name!r} has a member that is not one of {count} cells or points")
    return numbers.astype(np.int64).ravel()


def box_of(points: Vector) -> str:
    """Return the sides of the box around points, in words."""
    return " × ".join(f"{side:.3g}" for side in np.ptp(points, axis=0))


def near(corners: Vector) -> str:
    """Return the mean of points, in words."""
    return f"({', '.join(f'{x:.4g}' for x in corners.mean(axis=0))}) m"


def names(items: Collection[Tag]) -> str:
    """Return tags as a list in words."""
    return ", ".join(map(repr, items))
