"""Drives as pieces: what moves body 0, or pushes the first bead."""

from typing import Any, NamedTuple

import numpy as np

from particles.kernels.losses import Approach, move_body, press
from structures.kernels.compiling import inner
from structures.kernels.pieces import by_type
from structures.structure import Vector

FREE, PUSHED, MOVED, STEADY = 0, 1, 2, 3
"""What body 0 is, and what history the chain is driven by. FREE: a striker, none; MOVED: it moves by a history; else it
moves on at its speed, PUSHED with a history of the force on bead 1, STEADY with none."""


@by_type
def drives(drive: Any) -> bool:
    """Return whether anything but contacts and gravity acts on body 0 or bead 1."""
    return False


@by_type
def moves(drive: Any) -> bool:
    """Return whether body 0 moves by a history."""
    return False


@by_type
def place_and_speed(drive: Any, t: float) -> tuple[float, float]:
    """Return position (m) and velocity of a body 0 that moves by a history."""
    return 0.0, 0.0


@by_type
def outer_forces(drive: Any, place: float, t: float) -> tuple[float, float, float]:
    """Return the outer forces on body 0 and on bead 1, without gravity, and the history's part of the latter, N."""
    return 0.0, 0.0, 0.0


@by_type
def move_first(drive: Any, law: Any, chain: Any, bodies: Any, t: float, pace: Any) -> tuple[float, float, float]:
    """Move body 0; return the force of the contact between it and bead 1, what pushes the latter beside it, and the
    force that does work, N."""
    return 0.0, 0.0, 0.0


@by_type
def replaces_contact(drive: Any) -> bool:
    """Return whether a history of forces has the place of contact 1."""
    return False


@by_type
def energy_of_loads(drive: Any, y: Vector) -> float:
    """Return the potential energy of the dead load and of the spring, J."""
    return 0.0


class Free(NamedTuple):
    """A striker that moves freely."""


class Driven(NamedTuple):
    """All other drives, and dead loads."""

    kind: int
    """FREE, PUSHED, MOVED or STEADY."""
    history: Vector
    """3 × n: times (s), values (N or m) and rates. Cubic between times, constant outside."""
    preload: float
    """A dead load on bead 1, N."""
    spring: float
    """N/m, a spring that pushes body 0 until it is at `spring_end` (m)."""
    spring_end: float
    alone: bool
    """Whether nothing touches the first bead from behind."""

    @staticmethod
    def drives(drive: Any) -> bool:
        return True

    @staticmethod
    def moves(drive: Any) -> bool:
        return bool(drive.kind == MOVED)

    @staticmethod
    def place_and_speed(drive: Any, t: float) -> tuple[float, float]:
        return value_and_rate(drive.history, t)

    @staticmethod
    def outer_forces(drive: Any, place: float, t: float) -> tuple[float, float, float]:
        push = value_and_rate(drive.history, t)[0] if drive.kind == PUSHED else 0.0
        return drive.spring * max(drive.spring_end - place, 0.0), push + drive.preload, push

    @staticmethod
    def move_first(drive: Any, law: Any, chain: Any, bodies: Any, t: float, pace: Any) -> tuple[float, float, float]:
        y, v, ahead = bodies.y, bodies.v, bodies.ahead
        approach = Approach(y[0] - y[1], ahead[0] - ahead[1])
        contact = press(chain.loss, law, 0, approach, chain.springs[0], bodies.lost, pace.kick)
        on_striker, on_bead, push = outer_forces(drive, y[0], t)
        if moves(drive):
            v[0], push = mean_rate(drive, t, pace.drift), contact
            y[0] += pace.drift * v[0]
            ahead[0] = place_and_speed(drive, t + pace.drift)[1]
        else:
            move_body(chain.loss, chain, bodies, 0, on_striker - contact, pace)
        return contact, on_bead, push

    @staticmethod
    def replaces_contact(drive: Any) -> bool:
        return bool(drive.kind == PUSHED and drive.alone)

    @staticmethod
    def energy_of_loads(drive: Any, y: Vector) -> float:
        return float(0.5 * drive.spring * max(drive.spring_end - y[0], 0.0) ** 2 - drive.preload * y[1])


@inner(forceinline=True)
def value_and_rate(history: Vector, t: float) -> tuple[float, float]:
    """Return value and rate of a history at a time; its last value holds on."""
    times, values, rates = history
    if t < times[0] or t >= times[-1]:
        return values[0 if t < times[0] else times.size - 1], 0.0
    i, after = np.int64(0), times.size
    while after - i > 1:  # np.searchsorted takes numba half a second to compile
        middle = (i + after) // 2
        if times[middle] > t:
            after = middle
        else:
            i = middle
    step = times[i + 1] - times[i]
    s = (t - times[i]) / step
    start_rate, end_rate = step * rates[i], step * rates[i + 1]
    rise = values[i + 1] - values[i]
    second, third = 3.0 * rise - 2.0 * start_rate - end_rate, start_rate + end_rate - 2.0 * rise
    value = values[i] + s * (start_rate + s * (second + s * third))
    return value, (start_rate + s * (2.0 * second + 3.0 * s * third)) / step


@inner(forceinline=True)
def mean_rate(drive: Any, t: float, step: float) -> float:
    """Return the rate of a history over a step; at its start where the step is zero."""
    value, rate = place_and_speed(drive, t)
    return (place_and_speed(drive, t + step)[0] - value) / step if step > 0.0 else rate
