"""Curved edges that a mesh approximates by straight facets: distance and direction of the curve at each facet.

A polygon with w = 0 on its sides does not converge to a curved edge with w = 0. However many sides it has, a thin
plate's slope vanishes at its corners, as if the edge were clamped (Babuška's paradox). Therefore sides that meet at a
small angle are regarded as chords of one curve through their ends, and w = 0 holds on the curve.
"""

from typing import Any, NamedTuple

import numpy as np

from plates.shapes.mesh_geometry import QUARTER_TURN, tangents
from structures.meshes.mesh_reading import Numbers
from structures.structure import Vector

SMOOTH = 30.0
"""Degrees. Sides of an edge that meet at a smaller angle form one curve: polygons of 12 sides and more do."""

STRAIGHT = 1e-6
"""Rad. Facets that meet at a smaller angle form one side: rounding of coordinates."""


class Curve(NamedTuple):
    """The curve at points of facets, facets × points: how far outside of the facet it lies, m, and unit vectors along
    it and outward, … × 2."""

    beyond: Vector
    along: Vector
    outward: Vector


def curve(mesh: Any, facets: Numbers, parts: Vector) -> Curve:
    """Return the curve of one edge at parts (0 … 1) of the way from the first to the second vertex of its facets.

    Between the ends of a side the curve is a cubic. At each end its direction is the mean of those of the two sides.
    """
    ends = mesh.facets[:, facets]
    inside = mesh.p[:, mesh.t[:, mesh.f2t[0, facets]]].mean(axis=1).T - mesh.p[:, ends[0]].T
    along = tangents(mesh, facets)
    turned = (along[:, 0] * inside[:, 1] - along[:, 1] * inside[:, 0]) < 0.0
    along = np.where(turned[:, None], -along, along)
    start, end = np.where(turned, ends[::-1], ends)
    lengths = np.linalg.norm(mesh.p[:, ends[1]] - mesh.p[:, ends[0]], axis=0)
    side, before, angle = _sides(start, end, along, lengths)
    total = np.bincount(side, lengths)[side]
    place = (before[:, None] + lengths[:, None] * np.where(turned[:, None], 1.0 - parts, parts)) / total[:, None]
    first, last = (ends[side][:, None] / 2.0 for ends in angle)
    beyond = total[:, None] * place * (1.0 - place) * (first * (1.0 - place) + last * place)
    slope = first * (1.0 - 4.0 * place + 3.0 * place**2) + last * (2.0 * place - 3.0 * place**2)
    outward = along @ QUARTER_TURN
    # Turned by the slope towards the outside.
    there = along[:, None] + slope[:, :, None] * outward[:, None]
    there /= np.linalg.norm(there, axis=2, keepdims=True)
    return Curve(beyond, there, there @ QUARTER_TURN)


def _sides(
    start: Numbers, end: Numbers, along: Vector, lengths: Vector
) -> tuple[Numbers, Vector, tuple[Vector, Vector]]:
    """Return for each facet its side, and how far from the side's start it begins; for each side the turns at its two
    ends.

    Left turns are positive. At corners, and where the edge ends, the turn is zero.
    """
    follows = {int(vertex): facet for facet, vertex in enumerate(start)}
    after = np.array([follows.get(int(vertex), -1) for vertex in end])
    next_along = along[after]
    turn = np.arctan2(along[:, 0] * next_along[:, 1] - along[:, 1] * next_along[:, 0], (along * next_along).sum(axis=1))
    joined = (after >= 0) & (np.abs(turn) < STRAIGHT)
    bent = np.where((after >= 0) & (np.abs(turn) < np.radians(SMOOTH)), turn, 0.0)
    heads = np.setdiff1d(np.arange(start.size), after[joined])
    side, before = np.zeros(start.size, dtype=np.int64), np.zeros(start.size)
    last = np.zeros(heads.size)
    for number, facet in enumerate(heads):
        passed = 0.0
        while True:
            side[facet], before[facet] = number, passed
            passed += lengths[facet]
            if not joined[facet]:
                break
            facet = after[facet]
        last[number] = bent[facet]
    first = np.zeros(heads.size)
    comes_before = {int(vertex): facet for facet, vertex in enumerate(end)}
    for number, facet in enumerate(heads):
        previous = comes_before.get(int(start[facet]), -1)
        first[number] = bent[previous] if previous >= 0 else 0.0
    return side, before, (first, last)
