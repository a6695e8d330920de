"""Geometry of flat meshes, and checks and mirror images of the place where a plate is struck."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from plates.shapes.shape import PlateMesh
from plates.support import ElasticEdge, Support
from structures.meshes.mesh_reading import Numbers, Tag
from structures.structure import Vector

# A rotation of row vectors to the right. An edge vector with the plate on its left then points outward.
QUARTER_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])
# Limits of the sine of the angle between two sides. Below the first the sides form a line, above the second a corner,
# and between them a curve.
STRAIGHT, CURVED = 1e-3, 0.5
OUTSIDE = 1e-9  # A point may be outside the mesh by this fraction of the nearest cell's height, due to rounding
NEAREST = 1e-6  # A contact that is closer to an edge than this fraction of the plate's size lies on the edge


def check_straight(mesh: Any, facets: Numbers, name: Tag) -> None:
    """Raise a ValueError if sides of an edge meet at small angles, like those of a curve."""
    ends, ways = mesh.facets[:, facets], tangents(mesh, facets)
    both = np.concatenate([ends[0], ends[1]])
    order = np.argsort(both, kind="stable")
    met = np.flatnonzero(np.diff(both[order]) == 0)
    facet, following = order[met] % facets.size, order[met + 1] % facets.size
    turn = abs(ways[facet, 0] * ways[following, 1] - ways[facet, 1] * ways[following, 0])
    if ((turn > STRAIGHT) & (turn < CURVED)).any():
        raise ValueError(f"supports[{name!r}]: must be straight or of triangles if it is simple")


def tangents(mesh: Any, facets: Numbers) -> Vector:
    """Return the unit vectors along facets, facets × 2."""
    ends = mesh.p[:, mesh.facets[:, facets]]
    step = (ends[:, 1] - ends[:, 0]).T
    return np.asarray(step / np.linalg.norm(step, axis=1, keepdims=True))


def distances(starts: Vector, ends: Vector, point: Vector) -> Vector:
    """Return the distances from a point to straight sides, m. starts, ends: sides × 2."""
    step, offset = ends - starts, point - starts
    part = np.clip((offset * step).sum(axis=1) / (step**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - part[:, None] * step, axis=1))


def find_cells(mesh: Any, points: Vector) -> Numbers:
    """Return the cell of each point, p × 2; raise a ValueError if one lies outside the mesh."""
    corners = mesh.p[:, mesh.t]
    margin = OUTSIDE * np.ptp(mesh.p, axis=1)[:, None]
    reaches = corners.max(axis=1) >= points.min(axis=0)[:, None] - margin
    reaches &= corners.min(axis=1) <= points.max(axis=0)[:, None] + margin
    candidates = np.flatnonzero(reaches.all(axis=0))
    # The depth of a point inside a cell, in heights above its sides; negative outside.
    depth = np.full((len(points), candidates.size + 1), -np.inf)
    depth[:, :-1] = np.inf
    corners = corners[:, :, candidates]
    for i in range(corners.shape[1]):
        start, end, other = (corners[:, (i + step) % corners.shape[1]] for step in range(3))
        across = np.array([start[1] - end[1], end[0] - start[0]])
        height = ((other - start) * across).sum(axis=0)
        above = (points @ across - (start * across).sum(axis=0)) / height
        depth[:, :-1] = np.minimum(depth[:, :-1], above)
    best = depth.argmax(axis=1)
    outside = np.flatnonzero(depth[np.arange(len(points)), best] < -OUTSIDE)
    if outside.size:
        x, y = points[outside[0]]
        raise ValueError(f"x, y = {x:.6g}, {y:.6g}: must lie on the plate, not outside or in a hole")
    return np.asarray(candidates[best])


def mirrors(mesh: PlateMesh, supports: Mapping[Tag, Support], place: Vector, radius: float) -> list[Vector]:
    """Return the lines of symmetry through a place, m, as unit normals into the mesh.

    Raise a ValueError if the place cannot be struck: outside, on a fixed edge, within a radius, m, of any edge, or
    where two lines are not at right angles.
    """
    name = f"{place[0]:.6g}, {place[1]:.6g}"
    find_cells(mesh.mesh, place[None])
    near = NEAREST * float(np.ptp(mesh.mesh.p, axis=1).max())
    starts, ends = mesh.mesh.p[:, mesh.mesh.facets].transpose(1, 2, 0)
    away = distances(starts, ends, place)
    inward: list[Vector] = []
    for edge, support in supports.items():
        struck = mesh.edges[edge][away[mesh.edges[edge]] < near]
        if struck.size and not isinstance(support, ElasticEdge) and support != "symmetry":
            raise ValueError(f"x, y = {name}: must not lie on a {support} edge, which cannot move")
        for facet in struck if support == "symmetry" else ():
            across = (tangents(mesh.mesh, np.array([facet])) @ QUARTER_TURN)[0]
            inside = mesh.mesh.p[:, mesh.mesh.t[:, mesh.mesh.f2t[0, facet]]].mean(axis=1) - place
            if all(abs(across @ other) < 1.0 - NEAREST for other in inward):
                inward.append(across * np.sign(across @ inside))
    if len(inward) > 2 or (len(inward) == 2 and abs(inward[0] @ inward[1]) > NEAREST):
        raise ValueError(f"x, y = {name}: must not lie where edges of symmetry meet at other than right angles")

    # Facets on lines of symmetry through the place do not count as edges.
    boundary = mesh.mesh.boundary_facets()
    for across in inward:
        aside = np.abs([(starts[boundary] - place) @ across, (ends[boundary] - place) @ across])
        boundary = boundary[aside.max(axis=0) > near]
    reach = away[boundary].min(initial=np.inf)
    if radius > 0.0 and reach < radius * (1.0 - NEAREST):
        raise ValueError(f"patch_radius = {radius:.4g}: must be at most {reach:.3g} m at ({name})")
    return inward
