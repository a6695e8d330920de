"""Topology of a mesh: cells listed twice, points that coincide, cells that overlap, and parts that are not joined."""

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
    pairs = cKDTree(points[used]).query_pairs(distance, output_type="ndarray")
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
    """Raise a ValueError for cells that overlap and for parts that no whole side joins; warn of open seams.

    corners: of each cell, all numbered in the same sense. shortest: the shortest edge, m.
    """
    place = np.array(sides)
    width = place.shape[1]
    facets = corners[:, place].reshape(-1, width)
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

    # Two cells on either side of a facet see its corners in opposite senses: from the least one on, the larger of its
    # neighbours comes first or last.
    rows, least = np.arange(len(facets)), facets.argmin(axis=1)
    sense = facets[rows, (least + 1) % width] > facets[rows, least - 1] if width > 2 else least == 0
    folded = np.flatnonzero(sense[left] == sense[right])
    if folded.size:
        raise ValueError(
            f"mesh: both cells of a side lie on the same side of it near {near(points[facets[left[folded[0]]]])}; "
            f"{count_of(folded.size, 'cell overlaps', 'cells overlap')} others"
        )

    # Points of the boundary that coincide are a seam.
    boundary = np.unique(facets[first[times == 1]])
    distance = COINCIDENT * shortest
    close = cKDTree(points[boundary]).query(points[boundary], k=2)[0][:, 1] < distance
    seam, join = "none of their points coincide", "mesh them as one body"
    if close.any():
        coincide = count_of(int(close.sum()), "point coincides", "points coincide")
        seam = f"{coincide} with others, the first at {near(points[boundary[close]][:1])}"
        join = f"merge={distance:.1g} joins them"
    parts, part = _pieces(len(corners), owner[left], owner[right])
    if parts > 1:
        small = np.bincount(part).argmin()
        common = np.intersect1d(corners[part == small], corners[part != small])
        how = f"meet only at points or lines, near {near(points[common])}" if common.size else "have no common point"
        raise ValueError(f"mesh: {parts} parts of the body share no side of a cell and {how}; {seam}: {join}")
    if close.any():
        caution(f"mesh: {seam}, and are not joined: a crack, or parts that touch; {join}")


def _kinds(rows: Numbers) -> tuple[Numbers, Numbers]:
    """Return the first row of each kind, and each row's kind."""
    _, first, kind = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, kind.ravel()


def _pieces(size: int, left: Numbers, right: Numbers) -> tuple[int, Numbers]:
    """Return how many connected pieces a graph has, and the piece of each of its points."""
    graph = sparse.coo_array((np.ones(left.size, dtype=bool), (left, right)), shape=(size, size))
    count, label = connected_components(graph, directed=False)
    return int(count), label
