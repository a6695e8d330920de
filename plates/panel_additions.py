"""What additions do to the matrices of a panel: point masses, stiffeners along straight lines, weakened regions."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from scipy import sparse

from plates.additions import Addition, PointMass, Stiffener, Weakened
from plates.elements.mindlin import Mindlin
from plates.elements.morley import Morley
from structures.structure import Vector

Theory: TypeAlias = Mindlin | Morley
Matrix: TypeAlias = sparse.csr_array

GAUSS = 5
"""Points on each part of a line that lies in one cell: exact for quartic functions."""


def known_additions(given: Any) -> tuple[Addition, ...]:
    """The additions, or a ValueError where one is none."""
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise ValueError(f"additions = {given!r}: must be a list of PointMass, Stiffener and Weakened")
    for i, one in enumerate(given):
        if not isinstance(one, Addition):
            raise ValueError(f"additions[{i}] = {one!r}: must be a PointMass, a Stiffener or a Weakened")
    return tuple(given)


def check_regions(mesh: Any, additions: Sequence[Addition]) -> None:
    """A ValueError where a weakened region does not lie within the panel's box."""
    (left, bottom), (right, top) = mesh.p.min(axis=1), mesh.p.max(axis=1)
    spare = 1e-6 * max(right - left, top - bottom)
    for i, one in enumerate(additions):
        if not isinstance(one, Weakened):
            continue
        inside = left - spare <= one.region[0] and one.region[1] <= right + spare
        if not (inside and bottom - spare <= one.region[2] and one.region[3] <= top + spare):
            raise ValueError(
                f"additions[{i}] = {one!r}: must lie on the panel, between x = {left:.4g} and {right:.4g}, "
                f"y = {bottom:.4g} and {top:.4g} m"
            )


def weakening(additions: Sequence[Addition]) -> Callable[[Vector], Vector] | None:
    """The factor of the bending stiffness at points 2 × …, m; None where there is no weakened region."""
    regions = [one for one in additions if isinstance(one, Weakened)]

    def factor(points: Vector) -> Vector:
        (x, y), found = points, np.ones(points.shape[1:])
        for one in regions:
            left, right, bottom, top = one.region
            found[(x > left) & (x < right) & (y > bottom) & (y < top)] *= one.factor
        return found

    return factor if regions else None


def weakest(additions: Sequence[Addition]) -> float:
    """The least factor of the bending stiffness anywhere."""
    return min([float(one.factor) for one in additions if isinstance(one, Weakened)], default=1.0)


def lines(additions: Sequence[Addition]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """x and y, m, where regions end, and where stiffeners run that are parallel to an axis."""
    across: list[float] = []
    along: list[float] = []
    for one in additions:
        if isinstance(one, Weakened):
            across += one.region[:2]
            along += one.region[2:]
        elif isinstance(one, Stiffener):
            across += [one.start[0]] if one.start[0] == one.end[0] else []
            along += [one.start[1]] if one.start[1] == one.end[1] else []
    return tuple(across), tuple(along)


def with_additions(
    theory: Theory, mass: Matrix, stiffness: Matrix, additions: Sequence[Addition]
) -> tuple[Matrix, Matrix]:
    """M and K with point masses and stiffeners; a ValueError names what does not lie on the plate."""
    for i, one in enumerate(additions):
        name = f"additions[{i}] = {one!r}"
        try:
            if isinstance(one, Stiffener):
                if not isinstance(theory, Mindlin):
                    raise ValueError("Morley's triangles are not continuous along lines; see mindlin_panel")
                more, stiffer = _beam(theory, one)
                mass, stiffness = mass + more, stiffness + stiffer
            elif isinstance(one, PointMass):
                reading = theory.deflection(np.array([[one.x, one.y]]))
                mass = mass + one.mass * (reading.T @ reading)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from error
    return sparse.csr_array(mass), sparse.csr_array(stiffness)


def _beam(theory: Mindlin, one: Stiffener) -> tuple[Matrix, Matrix]:
    """M and K of a beam that bends and twists with the plate: ½ ∫ EI (s·t)'² + GJ (s·n)'² + m ẇ² along it."""
    start, end = np.array(one.start, dtype=float), np.array(one.end, dtype=float)
    step = end - start
    length = float(np.hypot(*step))
    (x, y), stops = step / length, _crossings(theory.space.mesh, start, step)
    place, weights = np.polynomial.legendre.leggauss(GAUSS)
    size = np.diff(stops)[:, None]
    part = (stops[:-1, None] + 0.5 * (1.0 + place) * size).ravel()
    weight = sparse.diags_array((0.5 * weights * size * length).ravel())
    reading = theory.space.at(start + part[:, None] * step)
    slope = x * reading.slope_x + y * reading.slope_y
    bent, twisted = (sparse.kron(slope, np.array([[0.0, *into]])) for into in ((x, y), (-y, x)))
    value = sparse.kron(reading.value, np.array([[1.0, 0.0, 0.0]]))
    stiffness = one.bending_stiffness * (bent.T @ weight @ bent)
    stiffness = stiffness + one.torsion_stiffness * (twisted.T @ weight @ twisted)
    return sparse.csr_array(one.mass_per_length * (value.T @ weight @ value)), sparse.csr_array(stiffness)


def _crossings(mesh: Any, start: Vector, step: Vector) -> Vector:
    """The parts of the way from start, ascending from 0 to 1, at which it goes from cell to cell."""
    one, other = mesh.p[:, mesh.facets].transpose(1, 2, 0)
    side = other - one
    turn = step[0] * side[:, 1] - step[1] * side[:, 0]
    away = one - start
    with np.errstate(divide="ignore", invalid="ignore"):
        on_way = (away[:, 0] * side[:, 1] - away[:, 1] * side[:, 0]) / turn
        on_side = (away[:, 0] * step[1] - away[:, 1] * step[0]) / turn
    met = (on_way > 0.0) & (on_way < 1.0) & (on_side > -1e-9) & (on_side < 1.0 + 1e-9)
    found = np.unique(np.concatenate([[0.0, 1.0], on_way[met]]))
    kept: Vector = found[np.concatenate([[True], np.diff(found) > 1e-9])]
    kept[-1] = 1.0
    return kept
