"""The place where a plate is struck: its checks, the disc that a force is spread over, and mirror images of both."""

from collections.abc import Mapping, Sequence
from math import pi
from typing import NamedTuple

import numpy as np

from plates.shapes.mesh_geometry import QUARTER_TURN, distances, find_cells, tangents
from plates.shapes.shape import PlateMesh
from plates.support import ElasticEdge, Support
from structures.meshes.mesh_reading import Numbers, Tag
from structures.structure import Vector

NEAREST = 1e-6
"""A contact nearer to an edge than this part of the plate's size lies on it: rounding of coordinates."""

RINGS, SPOKES = 10, 40
"""Points on a disc over which the contact is averaged, along its radius and around: the mean is good to 1e-6."""


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
