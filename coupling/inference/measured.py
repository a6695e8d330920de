"""The signal of an identification: its samples, and the disturbances of its sensors. Disturbances are determined from
the quiet lead alone: what the model lacks shows only where there are waves, and no disturbance may hide it."""

from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.polynomial.legendre import legvander
from scipy.signal import lfilter

from coupling.inference.prediction import NUMERICAL
from coupling.results.measures import sensor_force
from coupling.results.reading import Reading
from coupling.results.schema import kind_of
from coupling.results.sensor_trace import interpolated_over_gaps, noise_level, quiet_lead
from coupling.results.signal_waves import doubts_of_sensors
from structures.checks import count_of, instance, listed, positive, whole
from structures.structure import Vector

FEWEST, FEWEST_OF_LEAD = 16, 50
"""Least numbers of samples of a sensor, and of a quiet lead; such a lead gives the noise to 10 %."""


class Sensor(NamedTuple):
    """One sensor and its noise."""

    bead: int
    force: Vector  # N; NaN for samples that are left out
    noise: float  # standard deviation of a sample, N
    lead: int = 0  # samples before the first wave, 0 if they are too few
    memory: Vector = np.zeros(0)  # coefficients of an autoregression: the noise remembers its last samples
    step: float = 0.0  # standard deviation of the new part of each noise sample, N
    drifts: bool = False  # whether the lead shows hum or drift

    def baseline(self, time: Vector, offset: bool) -> Vector:
        """Return the shapes that are fitted besides the waves, times × polynomials: a cubic for hum and drift, a line
        for the error of the zero that the lead gives."""
        terms = max(4 if self.drifts else 2 if self.lead else 0, int(offset))
        return legvander(2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0, max(terms - 1, 0))[:, :terms]

    def whitened(self, values: Vector) -> Vector:
        """Return values filtered so that their noise is white with standard deviation 1."""
        if not self.memory.size:
            return values / self.noise
        white = lfilter(np.append(1.0, -self.memory), [1.0], values, axis=-1) / self.step
        white[..., : self.memory.size] *= self.step / self.noise
        return np.asarray(white)


class Measured(NamedTuple):
    """A measured signal."""

    time: Vector  # s
    sensors: list[Sensor]
    given: bool = False  # whether the size of the noise is known, not estimated
    doubts: Sequence[str] = ()  # why sensors may be swapped; drift may raise such a doubt, too

    @property
    def step(self) -> float:
        """The time between samples, s."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)


def measured_signal(signal: xr.Dataset, sensors: Iterable[int] | None, noise: float | None) -> Measured:
    """Return the signal of an identification, or raise a ValueError for one that cannot be used."""
    data = instance("signal", signal, xr.Dataset, "a signal of read_signal or as_signal, or a run")
    kind = kind_of(data)
    if kind not in ("signal", "run"):
        raise ValueError(f"signal: is a {kind or 'Dataset of another kind'}; must be one signal, or one run")
    beads = data.sensor.values.tolist() if sensors is None and kind == "signal" else sensors
    rows, given = list[Sensor](), noise is not None or "noise" in data
    for bead in sorted({whole("sensors", n) for n in listed("sensors", beads, object, "one bead number or more")}):
        force = np.asarray(sensor_force(data, bead).values, dtype=float)
        there = force[np.isfinite(force)]
        if there.size < FEWEST:
            count = count_of(there.size, "sample")
            raise ValueError(f"signal: sensor {bead} has {count} that are not NaN; must have {FEWEST}")
        if np.ptp(there) == 0.0:
            raise ValueError(f"signal: sensor {bead} is constant, {there[0]:g} N; must hold a wave")
        if noise is not None:
            size = positive("noise", noise, "N")
        elif "noise" in data and "sensor" in data.noise.dims:
            size = float(data.noise.sel(sensor=bead))
        else:
            size = estimated(force)
        least = NUMERICAL * float(abs(there).max())
        sensor = Sensor(bead, force, float(np.hypot(size, least)), lead_of(force))
        rows.append(_with_disturbances(sensor, given) if sensor.lead and noise_level(there) > least else sensor)
    doubts = doubts_of_sensors(Reading(data)) if kind == "signal" else []
    return Measured(np.asarray(data.time.values, dtype=float), rows, given, doubts)


def estimated(force: Vector) -> float:
    """Return the standard deviation of a sample, N: from third differences, or of the quiet lead if that is larger by
    three standard errors. Noise of low frequency shows in the lead alone."""
    filled = interpolated_over_gaps(force)
    white, lead = noise_level(filled), filled[: lead_of(force)]
    slow = float(lead.std(ddof=1)) if lead.size else 0.0
    return slow if lead.size and slow > white * (1.0 + 3.0 / np.sqrt(lead.size)) else white


def lead_of(force: Vector) -> int:
    """Return three quarters of the number of samples before the first wave; 0 if they are too few."""
    lead = 3 * quiet_lead(interpolated_over_gaps(force)) // 2
    return lead if lead >= FEWEST_OF_LEAD else 0


def _with_disturbances(sensor: Sensor, given: bool) -> Sensor:
    """Return a sensor with the disturbances of its lead: the autoregression and polynomial of the least Bayesian
    information criterion, if it is lower by 6 than that of white noise: strong evidence (Kass and Raftery, 1995)."""
    quiet = interpolated_over_gaps(sensor.force)[: sensor.lead] / sensor.noise
    before = np.stack([quiet[4 - k : quiet.size - k] for k in range(1, 5)], axis=1)
    values, shapes = quiet[4:], legvander(np.linspace(-1.0, 1.0, quiet.size - 4), 3)
    fits = list[tuple[float, int, int, Any, float]]()
    for order, terms in product(range(5), range(1, 5)):
        columns = np.hstack([before[:, :order], shapes[:, :terms]])
        found = np.linalg.lstsq(columns, values, rcond=None)[0]
        variance = float(((values - columns @ found) ** 2).mean())
        fits.append((values.size * np.log(variance) + found.size * np.log(values.size), order, terms, found, variance))
    least, order, terms, found, variance = min(fits, key=lambda fit: fit[0])
    if least > fits[0][0] - 6.0:
        return sensor
    if order:
        return sensor._replace(memory=found[:order], step=sensor.noise * variance**0.5, drifts=terms > 1)
    white = noise_level(interpolated_over_gaps(sensor.force))
    return sensor._replace(drifts=True, noise=sensor.noise if given else white)


def with_memory(sensor: Sensor, left: Vector) -> Sensor:
    """Return a sensor with the memory of its noise from the residual of a fit, N, NaN if unknown. A lead of a few
    hundred samples shows that there is a memory, but not exactly enough: intervals were too short."""
    left, order = left[np.isfinite(left)], sensor.memory.size
    before = np.stack([left[order - k : left.size - k] for k in range(1, order + 1)], axis=1)
    memory = np.asarray(np.linalg.lstsq(before, left[order:], rcond=None)[0], dtype=np.float64)
    step = float((left[order:] - before @ memory).std())
    return sensor._replace(memory=memory, step=step, noise=float(left.std()))
