"""Quantities that chapter 5 of the thesis reads from a wave in a chain: speed, peak contact force and width."""

import numpy as np
import xarray as xr

from coupling.results.ar_and_tof import reflections, wave_speed
from coupling.results.measures import sensor_force
from particles.solitary import PARTICLE_TO_STRIKER_SPEED, width
from structures.structure import Vector

LEVELS = (0.01, 0.001)
"""Fractions of the peak between which a width is read. The thesis does not give its own; a wave has no sharp ends."""

ZERO_TO_ZERO = (
    "the thesis does not say where it reads; theory has 5 D from zero to zero, and 6 D for a sensor, which averages "
    "two contacts one bead apart"
)


def passage(run: xr.Dataset, first: int, second: int) -> xr.Dataset:
    """The incident wave between two sensors: its speed, its peak contact force above the preload, its width.

    The width, m, is the speed times the duration for which the force at the second sensor exceeds a level, a fraction
    of its peak. A sensor reads the mean of its two contacts, one bead apart: its signal is one bead longer than the
    wave of equation 5.13. NaN if the wave did not pass.
    """
    speed = wave_speed(run, first, second)
    incident = reflections(run, second).incident
    until = incident.arrival if incident else float(run.time[0])
    between = (run.contact_force - run.static_force).sel(contact=slice(first + 1, second), time=slice(None, until))
    force = sensor_force(run, second).values
    widths = [speed * duration(run.time.values, force, until, level) for level in LEVELS]
    return xr.Dataset(
        {
            "wave_speed": ((), speed, {"units": "m/s", "long_name": "wave speed between the sensors"}),
            "peak_force": ((), float(between.max()), {"units": "N", "long_name": "peak contact force between them"}),
            "width": ("level", widths, {"units": "m", "long_name": "width of the wave at the second sensor"}),
        },
        coords={"level": ("level", list(LEVELS), {"units": "1", "long_name": "part of the peak"})},
    )


def widths(wider: float, size: float) -> dict[str, float]:
    """Other readings of the width of a wave in a Hertzian chain, in sizes of the beads, by their names."""
    return {
        "read from 0.1 % to 0.1 % of the peak": wider,
        "equation 5.13, and one bead more at a sensor": width(size) / size + 1.0,
    }


def striker_speed(force: float, mass: float, stiffness: float, exponent: float = 1.5) -> float:
    """Speed, m/s, of a striker, equal to the beads, for about this peak contact force, N, by equations 6.12 and 6.16.

    These are for long waves: in a Hertzian chain the force is 0.886 of theirs (see
    `theory.solitary_force_from_particle_speed`).
    """
    overlap = (force / stiffness) ** (1.0 / exponent)
    square = 2.0 * force * overlap / ((exponent + 1.0) * mass)
    return float(np.sqrt(square)) / PARTICLE_TO_STRIKER_SPEED


def speed_at(curve: xr.Dataset, force: float) -> float:
    """Wave speed, m/s, at a peak contact force, N, interpolated as a power law; NaN outside the simulated forces."""
    order = np.argsort(curve.peak_force.values)
    known, speed = np.log(curve.peak_force.values[order]), np.log(curve.wave_speed.values[order])
    return float(np.exp(np.interp(np.log(force), known, speed, left=np.nan, right=np.nan)))


def exponent(curve: xr.Dataset) -> float:
    """Slope of ln V over ln F, by least squares: (n − 1)/(2n) for F = k δⁿ (thesis, equation 5.12)."""
    return float(np.polyfit(np.log(curve.peak_force.values), np.log(curve.wave_speed.values), 1)[0])


def duration(time: Vector, force: Vector, arrival: float, level: float) -> float:
    """Time, s, for which the pulse whose peak arrives at `arrival` exceeds a fraction of it; ends are interpolated."""
    peak = int(np.searchsorted(time, arrival))
    peak = max(0, peak - 1) + int(force[max(0, peak - 1) : peak + 1].argmax())
    least = level * force[peak]
    below = np.flatnonzero(force < least)
    before, after = below[below < peak], below[below > peak]
    if not (before.size and after.size):
        return float("nan")
    start, end = int(before[-1]), int(after[0])
    rise = np.interp(least, force[start : start + 2], time[start : start + 2])
    fall = np.interp(-least, -force[end - 1 : end + 1], time[end - 1 : end + 1])
    return float(fall - rise)
