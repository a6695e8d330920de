"""Topology of a mesh: sides of cells, duplicate cells, overlaps, and parts that are not joined."""

from collections.abc import Sequence

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from structures.caution import caution
from structures.checks import count_of
from structures.meshes.mesh_reading import Numbers, near
from structures.structure import Vector

COINCIDENT = 1e-6  # Points that are closer than this fraction of the shortest edge coincide

Sides = Sequence[Sequence[int]]
# Corners of the sides of a cell in meshio's order, in the same sense if seen from outside
TRIANGLE: Sides = ((0, 1), (1, 2), (2, 0))
QUADRILATERAL: Sides = ((0, 1), (1, 2), (2, 3), (3, 0))
TETRAHEDRON: Sides = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
HEXAHEDRON: Sides = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def edge_lengths(points: Vector, corners: Numbers, sides: Sides) -> Vector:
    """Return the lengths of the edges of cells, m."""
    pairs = {tuple(sorted((side[i - 1], side[i]))) for side in sides for i in range(len(side))}
    first_ends, last_ends = np.array(sorted(pairs)).T
    return np.asarray(np.linalg.norm(points[corners[:, first_ends]] - points[corners[:, last_ends]], axis=2))


def without_duplicates(cells: Numbers, corners: int) -> tuple[Numbers, Numbers]:
    """Return the cells without duplicates, and the new number of each cell."""
    _, first, number = np.unique(np.sort(cells[:, :corners], axis=1), axis=0, return_index=True, return_inverse=True)
    counted = np.sort(first)
    if counted.size < len(cells):
        caution(f"mesh: {len(cells) - counted.size} of {len(cells)} cells are duplicates and are dropped")
    return cells[counted], np.searchsorted(counted, first[number.ravel()])


def check_joined(points: Vector, corners: Numbers, sides: Sides, shortest: float) -> None:
    """Raise a ValueError for cells that overlap and for parts that share no side; warn of open seams.

    corners: of each cell, all numbered in the same sense. shortest: the shortest edge, m.
    """
    place = np.array(sides)
    width = place.shape[1]
    facets = corners[:, place].reshape(-1, width)
    owner = np.repeat(np.arange(len(corners)), len(place))
    _, first, same = np.unique(np.sort(facets, axis=1), axis=0, return_index=True, return_inverse=True)
    order, times = np.argsort(same.ravel(), kind="stable"), np.bincount(same.ravel())
    if times.max() > 2:
        raise ValueError(f"mesh: {times.max()} cells share a side near {near(points[facets[first[times.argmax()]]])}")
    ends = np.cumsum(times)[times == 2]
    left, right = order[ends - 2], order[ends - 1]

    # Two cells on opposite sides of a facet list its corners in opposite senses. The sense is whether the larger
    # neighbour of the least corner follows or precedes it.
    rows, least = np.arange(len(facets)), facets.argmin(axis=1)
    sense = facets[rows, (least + 1) % width] > facets[rows, least - 1] if width > 2 else least == 0
    folded = np.flatnonzero(sense[left] == sense[right])
    if folded.size:
        raise ValueError(f"mesh: cells lie on the same side of a facet near {near(points[facets[left[folded[0]]]])}")

    # Boundary points that coincide form a seam.
    boundary = np.unique(facets[first[times == 1]])
    close = cKDTree(points[boundary]).query(points[boundary], k=2)[0][:, 1] < COINCIDENT * shortest
    seam, join = "none of their points coincide", "mesh them as one body"
    if close.any():
        coincide = count_of(int(close.sum()), "point coincides", "points coincide")
        seam = f"{coincide} with others, the first at {near(points[boundary[close]][:1])}"
        join = "remove duplicate nodes, as gmsh does"
    neighbours = sparse.coo_array((np.ones(left.size), (owner[left], owner[right])), shape=(len(corners), len(corners)))
    parts, part = connected_components(neighbours, directed=False)
    if parts > 1:
        small = np.bincount(part).argmin()
        common = np.intersect1d(corners[part == small], corners[part != small])
        how = f"meet only at points or lines, near {near(points[common])}" if common.size else "have no common point"
        raise ValueError(f"mesh: {parts} parts of the body share no side of a cell and {how}; {seam}: {join}")
    if close.any():
        caution(f"mesh: {seam}, but are not joined: a crack, or parts that touch; {join}")
