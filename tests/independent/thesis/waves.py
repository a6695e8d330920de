"""Reads peaks, arrivals, speeds and widths from forces that are functions of time."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.signal import find_peaks

from .line import Flight

STEP = 0.25e-6
"""s, between samples in which peaks are found; each is then refined."""


@dataclass(frozen=True)
class Peak:
    """The time, s, and the height, N, of a peak."""

    time: float
    height: float


def peaks(signal: Callable[[Any], Any], until: float, prominence: float = 0.02, since: float = 0.0) -> list[Peak]:
    """The local maxima that rise above what surrounds them by `prominence` of the highest."""
    times = np.arange(since, until, STEP)
    sampled = np.asarray(signal(times))
    found, _ = find_peaks(sampled, prominence=prominence * sampled.max())
    return [refined(signal, times[at]) for at in found]


def refined(signal: Callable[[Any], Any], time: float, span: float = STEP) -> Peak:
    """The maximum within a span of a time."""
    best = minimize_scalar(lambda t: -float(signal(t)), bounds=(time - span, time + span), method="bounded",
                           options={"xatol": 1e-13})  # fmt: skip
    return Peak(float(best.x), -float(best.fun))


def incident(flight: Flight, bead: int) -> Peak:
    """The first wave at a sensor."""
    return peaks(flight.sensor(bead), flight.until)[0]


def speed(flight: Flight, beads: tuple[int, int], size: float) -> float:
    """Distance of two sensors over the time between their incident peaks, m/s (section 2.3)."""
    first, second = (incident(flight, one) for one in beads)
    return size * (beads[1] - beads[0]) / (second.time - first.time)


def crossings(signal: Callable[[Any], Any], level: float, until: float, step: float = STEP) -> list[float]:
    """Every time at which the signal passes the level, s."""
    times = np.arange(0.0, until, step)
    sampled = np.asarray(signal(times)) - level
    where = np.flatnonzero(np.signbit(sampled[:-1]) != np.signbit(sampled[1:]))
    return [brentq(lambda t: float(signal(t)) - level, times[i], times[i + 1], xtol=1e-14) for i in where]


def width(flight: Flight, bead: int, share: float, wave_speed: float, size: float) -> float:
    """The first wave's length at a sensor, in sizes of a bead, above this share of its peak."""
    signal, top = flight.sensor(bead), incident(flight, bead)
    inside = crossings(signal, share * top.height, flight.until)
    rise = max(t for t in inside if t < top.time)
    fall = min(t for t in inside if t > top.time)
    return wave_speed * (fall - rise) / size
