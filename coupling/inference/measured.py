"""A signal as identification takes it: samples of the sensors that are compared, and their noise."""

from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr

from coupling.inference.disturbances import Disturbance, disturbance_of, outlying
from coupling.inference.misfit import Measured
from coupling.inference.prediction import NUMERICAL
from coupling.results.measures import sensor_force
from coupling.results.schema import kind_of
from coupling.results.sensor_trace import FEWEST_SAMPLES
from structures.checks import count_of, instance, listed, positive, whole
from structures.structure import Vector

LEAD = 0.05
"""The quiet lead ends where the force first exceeds this part of its peak, less a margin of twice the time from there
to half the peak: a wave begins slowly, at any rate of sampling."""

FEWEST_OF_LEAD = 50
"""Samples of a lead that its standard deviation is taken of: 10 % exact."""

CLIPPED, OF_CLIPPED = 3.0, 0.9733369
"""Values beyond CLIPPED standard deviations are left out, and the variance of the others, of a Gaussian."""

COLOURED = 3.0
"""Noise is not white if the lead's exceeds that of differences by this many of its standard errors, 1/√n."""


def measured_signal(
    signal: xr.Dataset,
    sensors: Iterable[int] | None,
    noise: float | Mapping[int, float] | None,
    has_offset: bool = False,
) -> Measured:
    """Return the signal, or raise a ValueError that says what is wrong with it; has_offset: whether a fit has it."""
    data = instance("signal", signal, xr.Dataset, "a signal of read_signal or as_signal, or a run")
    kind = kind_of(data)
    if kind not in ("signal", "run"):
        raise ValueError(f"signal: is a {kind or 'Dataset of another kind'}; must be one signal, or one run")
    if sensors is None:
        if kind == "run":
            raise ValueError("sensors = None: must name the beads of a run that are compared, such as [7, 13]")
        sensors = data.sensor.values.tolist()
    numbers = sorted({whole("sensors", n) for n in listed("sensors", sensors, object, "one bead number or more")})
    time = np.asarray(data.time.values, dtype=float)
    force = np.stack([np.asarray(sensor_force(data, n).values, dtype=float) for n in numbers])
    for number, row in zip(numbers, force, strict=True):
        finite = row[np.isfinite(row)]
        if finite.size < FEWEST_SAMPLES:
            raise ValueError(
                f"signal: sensor {number} has {count_of(finite.size, 'sample')} with a number; needs {FEWEST_SAMPLES}"
            )
        if np.ptp(finite) == 0.0:
            raise ValueError(f"signal: sensor {number} is constant, {finite[0]:g} N; must hold a wave")
    noises, has_noise = _noises(data, numbers, force, noise), noise is not None or "noise" in data
    leads, disturbances = [lead_of(row) for row in force], list[Disturbance | None]()
    for k, (row, lead) in enumerate(zip(force, leads, strict=True)):
        white = _rough(row[np.isfinite(row)])
        believed = white > NUMERICAL * np.nanmax(abs(row))
        shown = disturbance_of(time, row, lead, noises[k], has_offset) if believed else None
        disturbances.append(shown)
        if shown is not None and not has_noise and not shown.memory.size:
            noises[k] = white
    return Measured(time, force, numbers, noises, has_noise, leads, disturbances)


def _noises(data: xr.Dataset, sensors: list[int], force: Vector, noise: float | Mapping[int, float] | None) -> Vector:
    """Return the noise of each sensor, N, never below what runs are exact to."""
    noises = []
    for number, row in zip(sensors, force, strict=True):
        peak = float(np.nanmax(abs(row)))
        if isinstance(noise, Mapping):
            if number not in noise:
                raise ValueError(f"noise = {dict(noise)!r}: must hold sensor {number}, a number of N")
            level = positive(f"noise[{number}]", noise[number], "N")
        elif noise is not None:
            level = positive("noise", noise, "N")
        elif "noise" in data and "sensor" in data.noise.dims:
            level = float(data.noise.sel(sensor=number))
        else:
            level = estimated(row)
        noises.append(float(np.hypot(level, NUMERICAL * peak)))
    return np.array(noises)


def estimated(force: Vector) -> float:
    """Return the standard deviation of a sample, N: from third differences, or of the quiet lead where that is larger.

    Differences leave white noise and remove what is smooth; the median of their sizes leaves out the waves. Noise of
    low frequency shows in the lead alone.
    """
    white, lead = _rough(force[np.isfinite(force)]), force[: lead_of(force)]
    lead = lead[np.isfinite(lead) & ~outlying(lead, white)]
    slow = float(lead.std(ddof=1)) if lead.size else 0.0
    return slow if lead.size and slow > white * (1.0 + COLOURED / np.sqrt(lead.size)) else white


def lead_of(force: Vector) -> int:
    """Return how many samples at the beginning show no wave; 0 where they are too few."""
    there = np.flatnonzero(np.isfinite(force))
    finite = force[there]
    peak = float(abs(finite).max())
    white, rise = _rough(finite), abs(finite - np.median(finite[:FEWEST_OF_LEAD]))
    # A spike is no wave.
    rise = np.where(outlying(finite, white), 0.0, rise)
    first = int(np.argmax(rise > LEAD * peak + 5.0 * white))
    margin = max(FEWEST_OF_LEAD // 2, 2 * (int(np.argmax(rise > 0.5 * peak)) - first))
    return int(there[first - margin]) if first >= margin + 3 * FEWEST_OF_LEAD // 2 else 0


def _rough(force: Vector) -> float:
    """Return the noise by third differences, whose variance is 20 times its own; waves are the few large ones."""
    rough = np.diff(force, 3) / np.sqrt(20.0)
    size = float(np.median(abs(rough))) / 0.6744898
    usual = rough[abs(rough) <= CLIPPED * size]
    return float(np.sqrt((usual**2).mean() / OF_CLIPPED)) if size > 0.0 else 0.0
