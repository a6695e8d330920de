"""Geometry of flat meshes, and the place where a plate is struck: its checks, the disc of the force, mirror images."""

from collections.abc import Mapping, Sequence
from math import pi
from typing import Any, NamedTuple

import numpy as np

from plates.shapes.shape import PlateMesh
from plates.support import ElasticEdge, Support
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

NEAREST = 1e-6
"""A contact nearer to an edge than this part of the plate's size lies on it: rounding of coordinates."""

RINGS, SPOKES = 10, 40
"""Points on a disc over which the contact is averaged, along its radius and around: the mean is good to 1e-6."""


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


class Mirror(NamedTuple):
    """A line through the struck place, beyond which the plate is its mirror image; the unit vector inward."""

    inward: Vector


def mirrors(mesh: PlateMesh, supports: Mapping[Tag, Support], place: Vector) -> list[Mirror]:
    """Return the lines of symmetry through a place, m; raise a ValueError where two of them are not at right angles."""
    planes: list[Mirror] = []
    for name, support in supports.items():
        facets = mesh.edges[name] if support == "symmetry" else np.zeros(0, dtype=np.int64)
        for facet in facets[_away(mesh, facets, place) < _near(mesh)]:
            across = (tangents(mesh.mesh, np.array([facet])) @ QUARTER_TURN)[0]
            inside = mesh.mesh.p[:, mesh.mesh.t[:, mesh.mesh.f2t[0, facet]]].mean(axis=1) - place
            if all(abs(across @ other.inward) < 1.0 - NEAREST for other in planes):
                planes.append(Mirror(across * np.sign(across @ inside)))
    if len(planes) > 2 or (len(planes) == 2 and abs(planes[0].inward @ planes[1].inward) > NEAREST):
        raise ValueError(
            f"x, y = {_text(place)}: lies on edges of symmetry that are not at right angles; strike inside"
        )
    return planes


def check_place(mesh: PlateMesh, supports: Mapping[Tag, Support], place: Vector, radius: float) -> None:
    """Raise a ValueError where a place, m, lies outside, on a fixed edge, or within a radius, m, of an edge."""
    try:
        find_cells(mesh.mesh, place[None])
    except ValueError:
        raise ValueError(f"x, y = {_text(place)}: lies outside of the plate, or in a hole; strike the plate") from None
    for name, support in supports.items():
        if isinstance(support, ElasticEdge) or support in ("free", "symmetry"):
            continue
        if mesh.edges[name].size and _away(mesh, mesh.edges[name], place).min() < _near(mesh):
            raise ValueError(f"x, y = {_text(place)}: lies on a {support} edge, which cannot move; strike inside")
    if radius == 0.0:
        return
    boundary = mesh.mesh.boundary_facets()
    for mirror in mirrors(mesh, supports, place):
        corners = mesh.mesh.p[:, mesh.mesh.facets[:, boundary]]
        aside = np.einsum("jkf,j->kf", corners - place[:, None, None], mirror.inward)
        boundary = boundary[np.abs(aside).max(axis=0) > _near(mesh)]
    reach = _away(mesh, boundary, place).min() if boundary.size else np.inf
    if reach < radius * (1.0 - NEAREST):
        raise ValueError(
            f"patch_radius = {radius:.4g}: the patch at ({_text(place)}) m reaches beyond an edge {reach:.3g} m "
            "away; strike further inside, or take a smaller patch"
        )


def cell_size(mesh: PlateMesh, place: Vector) -> float:
    """Return the longest side of the cell at a place, m."""
    corners = mesh.mesh.p[:, mesh.mesh.t[:, find_cells(mesh.mesh, place[None])[0]]]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=0).max())


def disc(place: Vector, radius: float, across: Sequence[Mirror]) -> tuple[Vector, Vector]:
    """Return points, p × 2, m, and their weights, of the mean over a disc; those beyond mirrors are brought back."""
    part, weights = np.polynomial.legendre.leggauss(RINGS)
    reach, angle = radius * np.sqrt((part + 1.0) / 2.0), 2.0 * pi * (np.arange(SPOKES) + 0.5) / SPOKES
    away = (reach[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)).reshape(-1, 2)
    for mirror in across:
        away = away - 2.0 * np.minimum(away @ mirror.inward, 0.0)[:, None] * mirror.inward
    return place + away, np.repeat(weights / (2.0 * SPOKES), SPOKES)


def _away(mesh: PlateMesh, facets: Numbers, place: Vector) -> Vector:
    """Return the distances from a place to facets, m."""
    corners = mesh.mesh.p[:, mesh.mesh.facets[:, facets]].transpose(1, 2, 0)
    return distances(corners[0], corners[1], place)


def _near(mesh: PlateMesh) -> float:
    return NEAREST * float(np.ptp(mesh.mesh.p, axis=1).max())


def _text(place: Vector) -> str:
    return f"{place[0]:.6g}, {place[1]:.6g}"
