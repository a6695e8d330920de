"""Drives: the motion of body 0 of each chain, and forces on body 0 and on the first bead."""

from typing import Any, NamedTuple

from structures.kernels.compiling import inner
from structures.structure import Vector

# Kinds of drives. FREE: body 0 is a striker. MOVED: body 0 moves by a history. PUSHED: bead 1 has a force history.
# STEADY: there is no history. In the last two, body 0 keeps its speed.
FREE, PUSHED, MOVED, STEADY = 0, 1, 2, 3


class Drives(NamedTuple):
    """The drives and dead loads of chains; arrays have an entry for each chain."""

    acts: Vector  # whether a force other than contacts and gravity acts on body 0 or bead 1
    kind: Vector  # FREE, PUSHED, MOVED or STEADY
    begin: Vector  # the start of each chain's part of the history, and the end
    history: Vector  # 3 × n: times (s), values (N or m) and rates; cubic between times, constant outside
    preload: Vector  # a dead load on bead 1, N
    spring: Vector  # a spring that pushes body 0 until it reaches `spring_end` (m), N/m
    spring_end: Vector


@inner(forceinline=True)
def outer_forces(drive: Any, c: int, place: float, t: float) -> tuple[float, float, float]:
    """Return the outer forces on body 0 and on bead 1, without gravity, and the force of the history, N."""
    push = history(drive, c, t)[0] if drive.kind[c] == PUSHED else 0.0
    return drive.spring[c] * max(drive.spring_end[c] - place, 0.0), push + drive.preload[c], push


@inner(forceinline=True)
def energy_of_loads(drive: Any, c: int, striker: float, bead: float) -> float:
    """Return the potential energy of the dead load and the spring, J, from the positions of body 0 and bead 1, m."""
    return float(0.5 * drive.spring[c] * max(drive.spring_end[c] - striker, 0.0) ** 2 - drive.preload[c] * bead)


@inner()
def history(drive: Any, c: int, t: float) -> tuple[float, float]:
    """Return the value and rate of the history of chain c; of a MOVED body 0, the position (m) and velocity."""
    first, end = drive.begin[c], drive.begin[c + 1]
    times, values, rates = drive.history
    if t < times[first] or t >= times[end - 1]:
        return values[first if t < times[first] else end - 1], 0.0
    i, after = first, end
    while after - i > 1:  # np.searchsorted takes Numba half a second to compile
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
