"""Geometry of flat meshes: the cell that holds a point, distances to sides, and the directions of sides."""

from typing import Any

import numpy as np

from structures.meshes.mesh_reading import Numbers, Tag
from structures.structure import Vector

QUARTER_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])
"""Turns row vectors to the right. An edge vector that has the plate on its left then points outward."""

STRAIGHT, CURVED = 1e-3, 0.5
"""Sines of the angle at which two sides meet. Below the first they form one line, above the second a corner; between
them they form a curve."""

OUTSIDE = 1e-9
"""A point may lie outside of the mesh by this part of the height of the nearest cell: rounding."""

PAIRS = 2_000_000
"""Pairs of points and cells that are compared at once; limits memory to some 100 MB."""


def check_straight(mesh: Any, facets: Numbers, name: Tag) -> None:
    """Raise a ValueError where the sides of an edge meet at small angles, as those of a curve do."""
    ends, ways = mesh.facets[:, facets], tangents(mesh, facets)
    both = np.concatenate([ends[0], ends[1]])
    order = np.argsort(both, kind="stable")
    met = np.flatnonzero(np.diff(both[order]) == 0)
    facet, following = order[met] % facets.size, order[met + 1] % facets.size
    turn = abs(ways[facet, 0] * ways[following, 1] - ways[facet, 1] * ways[following, 0])
    if ((turn > STRAIGHT) & (turn < CURVED)).any():
        raise ValueError(
            f"supports[{name!r}]: a curve of quadrilaterals cannot be simple, which would clamp it; mesh with triangles"
        )


def tangents(mesh: Any, facets: Numbers) -> Vector:
    """Return the unit vectors along facets, facets × 2."""
    ends = mesh.p[:, mesh.facets[:, facets]]
    step = (ends[:, 1] - ends[:, 0]).T
    return np.asarray(step / np.linalg.norm(step, axis=1, keepdims=True))


def distances(starts: Vector, ends: Vector, point: Vector) -> Vector:
    """Return the distances from a point to straight sides, whose ends are sides × 2, m."""
    step, offset = ends - starts, point - starts
    part = np.clip((offset * step).sum(axis=1) / (step**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - part[:, None] * step, axis=1))


def find_cells(mesh: Any, points: Vector) -> Numbers:
    """Return the cell of each point, p × 2; raise a ValueError where one lies outside of the mesh."""
    corners = mesh.p[:, mesh.t]
    near = np.ones(mesh.nelements, dtype=bool)
    for axis in (0, 1):
        margin = OUTSIDE * np.ptp(mesh.p[axis])
        near &= corners[axis].max(axis=0) >= points[:, axis].min() - margin
        near &= corners[axis].min(axis=0) <= points[:, axis].max() + margin
    candidates = np.flatnonzero(near)
    cells_found = np.full(len(points), -1)
    for part in np.array_split(np.arange(len(points)), 1 + candidates.size * len(points) // PAIRS):
        if candidates.size and part.size:
            depth = _depth(corners[:, :, candidates], points[part])
            best = depth.argmax(axis=1)
            cells_found[part] = np.where(depth[np.arange(part.size), best] >= -OUTSIDE, candidates[best], -1)
    if np.any(cells_found < 0):
        x, y = points[np.flatnonzero(cells_found < 0)[0]]
        raise ValueError(f"({x:.6g}, {y:.6g}) m lies outside of the plate")
    return cells_found


def _depth(corners: Vector, points: Vector) -> Vector:
    """Return how far inside of convex cells points lie, points × cells, in cell heights; negative outside."""
    count = corners.shape[1]
    depth = np.full((len(points), corners.shape[2]), np.inf)
    for i in range(count):
        start, end, other = corners[:, i], corners[:, (i + 1) % count], corners[:, (i + 2) % count]
        across = np.array([start[1] - end[1], end[0] - start[0]])
        height = ((other - start) * across).sum(axis=0)
        depth = np.minimum(depth, (points @ across - (start * across).sum(axis=0)) / height)
    return depth
