"""Measured traces, made without hertzlink: a chain of spheres on a plate near its edge, or on a rod.

The spheres are points with Hertz's contacts (particles of the discrete-particle model); the wall is exact in its own
theory (`walls`). Classical Runge-Kutta steps of a fixed length move the spheres; the echo of the wall enters as a
convolution of the contact force, whose error is of second order in the step. Numpy and scipy alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from independent.walls import STEEL, Material, Numbers, Wall, second_integral

STEP = 0.4e-6
"""s. At half of it, no force differs by more than 5e-5 of the peak (tests/coupling/test_independent_traces.py)."""


@dataclass(frozen=True)
class Case:
    """A number of equal spheres of a radius, m, struck by another one, the last of them on the wall; for `until` s."""

    wall: Wall
    beads: int = 20
    radius: float = 4.765e-3
    material: Material = STEEL
    until: float = 1.2e-3


def trace(
    case: Case, sensors: Sequence[int] = (7,), speed: float = 0.3, gain: float = 1.0, time_zero: float = 0.0,
    noise: float = 0.0, seed: int = 0, sample_every: float = 1e-6,
) -> tuple[Numbers, dict[int, Numbers]]:  # fmt: skip
    """Times, s, from zero on, and for each sensor the mean of the two forces on that bead times the gain.

    The striker, bead 0, is `speed` m/s fast and touches bead 1 at time_zero, before which nothing moves. noise: the
    standard deviation of white noise as a fraction of each sensor's peak. The record ends `case.until` after time_zero.
    """
    moments, forces = contact_forces(case, speed)
    mean = CubicSpline(moments, (forces[:, 1:] + forces[:, :-1]) / 2.0)
    time = sample_every * np.arange(int((time_zero + case.until) / sample_every + 1e-9) + 1)
    clean = np.where((time < time_zero)[:, None], 0.0, mean(np.clip(time - time_zero, 0.0, moments[-1])))
    drawn = np.random.default_rng(seed)
    found = {}
    for sensor in sensors:
        force = clean[:, sensor - 1]
        found[sensor] = gain * (force + noise * force.max() * drawn.standard_normal(time.size))
    return time, found


def contact_forces(case: Case, speed: float, step: float = STEP) -> tuple[Numbers, Numbers]:
    """Times, s, from the striker's contact, and the forces, N, in all contacts: column i is in front of bead i + 1."""
    count = int(np.ceil(case.until / step)) + 1
    return step * np.arange(count), _march(case, speed, step, count)


def _march(case: Case, speed: float, step: float, count: int) -> Numbers:
    mass = case.material.density * 4.0 / 3.0 * np.pi * case.radius**3
    law = _hertz(case)
    # The impulse on the wall is one more unknown; its "mass" is the impedance.
    place, rate = np.zeros(case.beads + 2), np.zeros(case.beads + 1)
    rate[0] = speed
    forces = np.zeros((count, case.beads + 1))
    weights = _echo_weights(case.wall, step, count)
    before = now = 0.0
    for n in range(count - 1):
        forces[n] = _forces(law, place, now)
        # The first weight is that of a wave which returns within a step: the force of its end may be extrapolated.
        history = float(weights[1 : n + 2] @ forces[n::-1, -1])
        after = history + weights[0] * (2.0 * forces[n, -1] - forces[n - 1, -1] if n else 0.0)
        half = (6.0 * now + 3.0 * after - before) / 8.0
        place, rate = _runge_kutta(law, mass, case.wall.impedance, place, rate, step, (now, half, after))
        before, now = now, history + weights[0] * _forces(law, place, after)[-1]
    forces[-1] = _forces(law, place, now)
    return forces


def _hertz(case: Case) -> Numbers:
    """4/3 E* √R* of each contact, N/m^1.5; the wall is flat."""
    own, other = case.material.plane_strain, case.wall.material.plane_strain
    between = 4.0 / 3.0 * (own / 2.0) * np.sqrt(case.radius / 2.0)
    last = 4.0 / 3.0 / (1.0 / own + 1.0 / other) * np.sqrt(case.radius)
    return np.append(np.full(case.beads, between), last)


def _echo_weights(wall: Wall, step: float, count: int) -> Numbers:
    """Weights, m/N, of the forces now, one step ago, two, ... in the echo's part of the wall's displacement."""
    twice = second_integral(wall, step, count + 1)
    # An echo begins at zero; what precedes the first wave is the error of its inversion.
    twice[0] = 0.0
    inner = twice[2:] - 2.0 * twice[1:-1] + twice[:-2]
    return np.append(twice[1], inner) / (step * wall.impedance)


def _forces(law: Numbers, place: Numbers, echo: float) -> Numbers:
    """place: displacements of all spheres and of the wall without its echo."""
    approach = place[:-1] - place[1:]
    approach[-1] -= echo
    approach = np.maximum(approach, 0.0)
    return law * approach * np.sqrt(approach)


def _runge_kutta(
    law: Numbers, mass: float, impedance: float, place: Numbers, rate: Numbers, step: float,
    echoes: tuple[float, float, float],
) -> tuple[Numbers, Numbers]:  # fmt: skip
    """One classical step; the echo at its start, its middle and its end is given."""

    def slope(at: Numbers, speeds: Numbers, echo: float) -> tuple[Numbers, Numbers]:
        forces = _forces(law, at, echo)
        pushes = -forces
        pushes[1:] += forces[:-1]
        return np.append(speeds, forces[-1] / impedance), pushes / mass

    start, middle, end = echoes
    a, da = slope(place, rate, start)
    b, db = slope(place + step / 2.0 * a, rate + step / 2.0 * da, middle)
    c, dc = slope(place + step / 2.0 * b, rate + step / 2.0 * db, middle)
    d, dd = slope(place + step * c, rate + step * dc, end)
    return place + step / 6.0 * (a + 2.0 * b + 2.0 * c + d), rate + step / 6.0 * (da + 2.0 * db + 2.0 * dc + dd)
