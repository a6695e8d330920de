"""Where a panel is struck: checks of the place, the disc that a force is spread over, and mirror images of both."""

from collections.abc import Mapping, Sequence
from math import pi
from typing import NamedTuple

import numpy as np

from plates.shapes.mesh import QUARTER_TURN, PanelMesh, distances, find_cells, tangents
from plates.support import ElasticEdge, Support
from structures.mesh_source import Numbers, Tag
from structures.structure import Vector

NEAREST = 1e-6
"""A contact nearer to an edge than this part of the plate's size lies on it."""

RINGS, SPOKES = 10, 40
"""Points at which a disc is pushed, along its radius and around."""


class Mirror(NamedTuple):
    """A line through the struck place, beyond which the plate goes on as its mirror image; the unit vector inward."""

    inward: Vector


def mirrors(panel: PanelMesh, supports: Mapping[Tag, Support], place: Vector) -> list[Mirror]:
    """The lines of symmetry through a place, m; a ValueError where two of them are not at right angles."""
    found: list[Mirror] = []
    mesh = panel.mesh
    for name, support in supports.items():
        facets = panel.edges[name] if support == "symmetry" else np.zeros(0, dtype=np.int64)
        for facet in facets[_away(panel, facets, place) < _near(panel)]:
            across = (tangents(mesh, np.array([facet])) @ QUARTER_TURN)[0]
            inside = mesh.p[:, mesh.t[:, mesh.f2t[0, facet]]].mean(axis=1) - place
            if all(abs(across @ other.inward) < 1.0 - NEAREST for other in found):
                found.append(Mirror(across * np.sign(across @ inside)))
    if len(found) > 2 or (len(found) == 2 and abs(found[0].inward @ found[1].inward) > NEAREST):
        raise ValueError(
            f"x, y = {_text(place)}: lies on edges of symmetry that are not at right angles; strike inside"
        )
    return found


def check_place(panel: PanelMesh, supports: Mapping[Tag, Support], place: Vector, radius: float | None) -> None:
    """A ValueError where a place, m, lies outside, on an edge that cannot move, or too near to one."""
    try:
        find_cells(panel.mesh, place[None])
    except ValueError:
        raise ValueError(f"x, y = {_text(place)}: lies outside of the plate, or in a hole; strike the plate") from None
    for name, support in supports.items():
        if isinstance(support, ElasticEdge) or support in ("free", "symmetry"):
            continue
        if panel.edges[name].size and _away(panel, panel.edges[name], place).min() < _near(panel):
            raise ValueError(f"x, y = {_text(place)}: lies on a {support} edge, which cannot move; strike inside")
    if radius is None:
        return
    boundary = panel.mesh.boundary_facets()
    for mirror in mirrors(panel, supports, place):
        corners = panel.mesh.p[:, panel.mesh.facets[:, boundary]]
        aside = np.einsum("jkf,j->kf", corners - place[:, None, None], mirror.inward)
        boundary = boundary[np.abs(aside).max(axis=0) > _near(panel)]
    reach = _away(panel, boundary, place).min() if boundary.size else np.inf
    if reach < radius * (1.0 - NEAREST):
        raise ValueError(
            f"patch_radius = {radius:.4g}: the patch at ({_text(place)}) m reaches beyond an edge {reach:.3g} m "
            "away; strike further inside, or take a smaller patch"
        )


def cell_size(panel: PanelMesh, place: Vector) -> float:
    """The longest side of the cell at a place, m."""
    corners = panel.mesh.p[:, panel.mesh.t[:, find_cells(panel.mesh, place[None])[0]]]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=0).max())


def disc(place: Vector, radius: float, across: Sequence[Mirror]) -> tuple[Vector, Vector]:
    """Points, p × 2, m, and their weights, of the mean over a disc; those beyond mirrors are brought back."""
    part, weights = np.polynomial.legendre.leggauss(RINGS)
    reach, angle = radius * np.sqrt((part + 1.0) / 2.0), 2.0 * pi * (np.arange(SPOKES) + 0.5) / SPOKES
    away = (reach[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)).reshape(-1, 2)
    for mirror in across:
        away = away - 2.0 * np.minimum(away @ mirror.inward, 0.0)[:, None] * mirror.inward
    return place + away, np.repeat(weights / (2.0 * SPOKES), SPOKES)


def _away(panel: PanelMesh, facets: Numbers, place: Vector) -> Vector:
    """From a place to facets, m."""
    corners = panel.mesh.p[:, panel.mesh.facets[:, facets]].transpose(1, 2, 0)
    return distances(corners[0], corners[1], place)


def _near(panel: PanelMesh) -> float:
    return NEAREST * float(np.ptp(panel.mesh.p, axis=1).max())


def _text(place: Vector) -> str:
    return f"{place[0]:.6g}, {place[1]:.6g}"
