"""Topology of a mesh: cells listed twice, points that coincide, cells that overlap, and hinges."""

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from structures.caution import caution
from structures.checks import count_of, positive
from structures.meshes.mesh_reading import Numbers, near
from structures.meshes.split_cells import Sides
from structures.structure import Vector
from structures.units import readable

COINCIDENT = 1e-6
"""Points coincide that lie closer than this part of the shortest edge."""

LARGEST_MERGE = 0.5
"""`merge` is at most this part of the shortest edge, so that no cell loses an edge."""

MOST_PAIRS = 20
"""Pairs of points within `merge`, for each point of the mesh; more are no two parts that touch."""


def merged(points: Vector, used: Numbers, shortest: float, distance: float | None) -> Numbers:
    """Return for each point the point that stands for it, after those of cells were joined within a distance, m.

    shortest: the shortest edge, m.
    """
    alias = np.arange(len(points))
    if distance is None:
        return alias
    if positive("merge", distance, "m") > LARGEST_MERGE * shortest:
        raise ValueError(
            f"merge = {readable(distance, 'm')}: must be below {readable(LARGEST_MERGE * shortest, 'm')}, half the "
            "shortest edge of the mesh"
        )
    tree = cKDTree(points[used])
    if tree.count_neighbors(tree, distance) > MOST_PAIRS * used.size:
        raise ValueError(
            f"merge = {readable(distance, 'm')}: joins more than {MOST_PAIRS} points into each; are parts listed twice?"
        )
    pairs = tree.query_pairs(distance, output_type="ndarray")
    if not len(pairs):
        caution(f"merge = {readable(distance, 'm')}: no two points of the mesh lie so close, and none are joined")
    group = _pieces(used.size, *pairs.T)[1]
    first = np.unique(group, return_index=True)[1]
    alias[used] = used[first[group]]
    return alias


def once(cells: Numbers, corners: int) -> tuple[Numbers, Numbers]:
    """Return the cells without those that are listed again, and the new number of each cell."""
    first, number = _kinds(np.sort(cells[:, :corners], axis=1))
    counted = np.sort(first)
    if counted.size < len(cells):
        caution(
            f"mesh: {len(cells) - counted.size} of {len(cells)} cells are listed again with the same points; each "
            "counts once, with all its tags"
        )
    return cells[counted], np.searchsorted(counted, first[number])


def check_joined(points: Vector, corners: Numbers, sides: Sides, shortest: float) -> None:
    """Raise a ValueError for cells that overlap and for parts that are not joined; warn of hinges and open seams.

    corners: of each cell, all numbered in the same sense. shortest: the shortest edge, m.
    """
    place = np.array(sides)
    facets = corners[:, place].reshape(-1, place.shape[1])
    owner = np.repeat(np.arange(len(corners)), len(place))
    first, same = _kinds(np.sort(facets, axis=1))
    order, times = np.argsort(same, kind="stable"), np.bincount(same)
    if times.max() > 2:
        raise ValueError(
            f"mesh: {times.max()} cells share a side near {near(points[facets[first[times.argmax()]]])}; cells must "
            "not lie on each other"
        )
    ends = np.cumsum(times)[times == 2]
    left, right = order[ends - 2], order[ends - 1]
    folded = np.flatnonzero(_sense(facets[left]) == _sense(facets[right]))
    if folded.size:
        raise ValueError(
            f"mesh: both cells of a side lie on the same side of it near {near(points[facets[left[folded[0]]]])}; "
            f"{count_of(folded.size, 'cell overlaps', 'cells overlap')} others"
        )
    boundary = np.unique(facets[first[times == 1]])
    _check_parts(points, corners, owner[left], owner[right], boundary, shortest)
    _check_hinges(points, corners, np.tile(place, (len(corners), 1)), facets, owner, left, right)


def _kinds(rows: Numbers) -> tuple[Numbers, Numbers]:
    """Return the first row of each kind, and each row's kind."""
    _, first, kind = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, kind.ravel()


def _sense(facets: Numbers) -> Numbers:
    """Return whether the corners of a facet, begun at the least one, go on to the larger of its neighbours."""
    at = facets.argmin(axis=1)
    rows, width = np.arange(len(facets)), facets.shape[1]
    return np.asarray(facets[rows, (at + 1) % width] > facets[rows, at - 1] if width > 2 else at == 0)


def _pieces(size: int, left: Numbers, right: Numbers) -> tuple[int, Numbers]:
    graph = sparse.coo_array((np.ones(left.size, dtype=bool), (left, right)), shape=(size, size))
    count, label = connected_components(graph, directed=False)
    return int(count), label


def _check_parts(
    points: Vector, corners: Numbers, left: Numbers, right: Numbers, boundary: Numbers, shortest: float
) -> None:
    """Check that all cells are joined by whole sides, and that no points of the boundary coincide."""
    parts, part = _pieces(len(corners), left, right)
    distance = COINCIDENT * shortest
    close = cKDTree(points[boundary]).query(points[boundary], k=2)[0][:, 1] < distance
    seam = ""
    if close.any():
        coincide = count_of(int(close.sum()), "point coincides", "points coincide")
        seam = f"{coincide} with others, the first at {near(points[boundary[close]][:1])}"
    join = f"merge={distance:.1g} joins them" if seam else "mesh them as one body"
    if parts > 1:
        first, rest = np.repeat(corners[:, :1], corners.shape[1] - 1, axis=1).ravel(), corners[:, 1:].ravel()
        pieces = _pieces(len(points), first, rest)[0] - (len(points) - np.unique(corners).size)
        if pieces > 1:
            raise ValueError(
                f"mesh: consists of {pieces} pieces that share no points; {seam or 'none of their points coincide'}: "
                f"{join}"
            )
        sizes = np.bincount(part)
        small = np.unique(corners[part == sizes.argmin()])
        common = small[np.isin(small, corners[part != sizes.argmin()])]
        raise ValueError(
            f"mesh: {parts} parts of the body share no side of a cell and meet only at points or lines, near "
            f"{near(points[common])}, as at a hinge; {seam + ': ' if seam else ''}{join}"
        )
    if seam:
        caution(f"mesh: {seam}, and are not joined: a crack, or parts that touch; {join}")


def _check_hinges(
    points: Vector, corners: Numbers, local: Numbers, facets: Numbers, owner: Numbers, left: Numbers, right: Numbers
) -> None:
    """Warn where cells about a point do not hang together by sides that contain it."""
    corner = owner[:, None] * corners.shape[1] + local
    corner = np.take_along_axis(corner, np.argsort(facets, axis=1), axis=1)
    fans = _pieces(corners.size, corner[left].ravel(), corner[right].ravel())[1]
    about = np.unique(np.stack([corners.ravel(), fans], axis=1), axis=0)[:, 0]
    hinges = np.flatnonzero(np.bincount(about) > 1)
    if hinges.size:
        caution(
            f"mesh: at {count_of(hinges.size, 'point')} cells meet without a common side, the first at "
            f"{near(points[hinges[:1]])}; a body can turn there as at a hinge"
        )
