"""Stiffeners on Mindlin's plates: beams along any straight line of a mesh."""

from typing import Any, TypeAlias

import numpy as np
from scipy import sparse

from plates.additions import Stiffener
from plates.elements.shape_functions import Space
from structures.structure import Vector

Matrix: TypeAlias = sparse.csr_array

GAUSS = 5
"""Points on each part of a line that lies in one cell: exact for products of quartic functions."""

ROUNDING = 1e-9
"""Parts of a line, or of a side, that are below rounding."""


def beam_on_space(space: Space, stiffener: Stiffener, each: int) -> tuple[Matrix, Matrix]:
    """Return M and K of a beam that bends and twists with the plate: ½ ∫ EI (s·t)'² + GJ (s·n)'² + m ẇ² along it.

    Of the `each` degrees of freedom of a function, w is the first and s of the last wall are the last two.
    """
    start, end = np.array(stiffener.start, dtype=float), np.array(stiffener.end, dtype=float)
    step = end - start
    length = float(np.hypot(*step))
    (x, y), stops = step / length, _crossings(space.mesh, start, step)
    place, weights = np.polynomial.legendre.leggauss(GAUSS)
    size = np.diff(stops)[:, None]
    part = (stops[:-1, None] + 0.5 * (1.0 + place) * size).ravel()
    weight = sparse.diags_array((0.5 * weights * size * length).ravel())
    reading = space.at(start + part[:, None] * step)
    slope = x * reading.slope_x + y * reading.slope_y
    bent, twisted = (sparse.kron(slope, [[*(each - 2) * [0.0], *into]]) for into in ((x, y), (-y, x)))
    value = sparse.kron(reading.value, np.eye(1, each))
    stiffness = stiffener.bending_stiffness * (bent.T @ weight @ bent)
    stiffness = stiffness + stiffener.torsion_stiffness * (twisted.T @ weight @ twisted)
    return sparse.csr_array(stiffener.mass_per_length * (value.T @ weight @ value)), sparse.csr_array(stiffness)


def _crossings(mesh: Any, start: Vector, step: Vector) -> Vector:
    """The parts of the way from start, ascending from 0 to 1, at which it passes from cell to cell."""
    first_ends, last_ends = mesh.p[:, mesh.facets].transpose(1, 2, 0)
    side = last_ends - first_ends
    turn = step[0] * side[:, 1] - step[1] * side[:, 0]
    away = first_ends - start
    with np.errstate(divide="ignore", invalid="ignore"):
        on_way = (away[:, 0] * side[:, 1] - away[:, 1] * side[:, 0]) / turn
        on_side = (away[:, 0] * step[1] - away[:, 1] * step[0]) / turn
    met = (on_way > 0.0) & (on_way < 1.0) & (on_side > -ROUNDING) & (on_side < 1.0 + ROUNDING)
    crossings = np.unique(np.concatenate([[0.0, 1.0], on_way[met]]))
    distinct: Vector = crossings[np.concatenate([[True], np.diff(crossings) > ROUNDING])]
    distinct[-1] = 1.0
    return distinct
