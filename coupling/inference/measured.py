"""A signal as identification takes it: its samples, and what its sensors read besides waves.

The quiet lead alone says what that is: white noise, noise that remembers its last samples, hum or drift. What a model
lacks shows only where there are waves, and no disturbance may explain it.
"""

from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.polynomial.legendre import legvander

from coupling.inference.prediction import NUMERICAL
from coupling.inference.settings import SETTINGS
from coupling.results.measures import sensor_force
from coupling.results.schema import kind_of
from coupling.results.sensor_trace import interpolated_over_gaps, noise_level, quiet_lead
from structures.checks import count_of, instance, listed, positive, whole
from structures.structure import Vector


class Sensor(NamedTuple):
    """One sensor: its bead, force (N; NaN where samples are left out), and the standard deviation of its noise, N.

    lead: how many samples at the beginning show no wave; 0 where they are too few. memory: coefficients of noise that
    remembers its last samples; step: the standard deviation of what is new in each, N. drifts: the lead shows hum or
    drift.
    """

    bead: int
    force: Vector
    noise: float
    lead: int = 0
    memory: Vector = np.zeros(0)
    step: float = 0.0
    drifts: bool = False

    @property
    def baseline(self) -> int:
        """The number of terms of the polynomial that is fitted beside the waves: a cubic is as good as hum.

        With a lead it has two at least, because the lead gives the zero of the force with an error.
        """
        return 4 if self.drifts else 2 if self.lead else 0


class Measured(NamedTuple):
    """A signal: times (s), sensors, and whether the size of the noise was given."""

    time: Vector
    sensors: list[Sensor]
    given: bool = False

    @property
    def step(self) -> float:
        """The time between samples, s."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)


def measured_signal(
    signal: xr.Dataset, sensors: Iterable[int] | None, noise: float | Mapping[int, float] | None
) -> Measured:
    """Return the signal; a ValueError says what is wrong with it."""
    data = instance("signal", signal, xr.Dataset, "a signal of read_signal or as_signal, or a run")
    kind = kind_of(data)
    if kind not in ("signal", "run"):
        raise ValueError(f"signal: is a {kind or 'Dataset of another kind'}; must be one signal, or one run")
    if sensors is None and kind == "run":
        raise ValueError("sensors = None: must name the beads of a run that are compared, such as [7, 13]")
    beads = data.sensor.values.tolist() if sensors is None else sensors
    rows, given = list[Sensor](), noise is not None or "noise" in data
    for bead in sorted({whole("sensors", n) for n in listed("sensors", beads, object, "one bead number or more")}):
        force = np.asarray(sensor_force(data, bead).values, dtype=float)
        there = force[np.isfinite(force)]
        if there.size < SETTINGS.fewest_samples:
            count = count_of(there.size, "sample")
            raise ValueError(f"signal: sensor {bead} has {count} with a number; needs {SETTINGS.fewest_samples}")
        if np.ptp(there) == 0.0:
            raise ValueError(f"signal: sensor {bead} is constant, {there[0]:g} N; must hold a wave")
        if isinstance(noise, Mapping):
            if bead not in noise:
                raise ValueError(f"noise = {dict(noise)!r}: must hold sensor {bead}, a number of N")
            size = positive(f"noise[{bead}]", noise[bead], "N")
        elif noise is not None:
            size = positive("noise", noise, "N")
        elif "noise" in data and "sensor" in data.noise.dims:
            size = float(data.noise.sel(sensor=bead))
        else:
            size = estimated(force)
        least = NUMERICAL * float(abs(there).max())
        sensor = Sensor(bead, force, float(np.hypot(size, least)), lead_of(force))
        rows.append(_disturbed(sensor, given) if sensor.lead and noise_level(there) > least else sensor)
    return Measured(np.asarray(data.time.values, dtype=float), rows, given)


def estimated(force: Vector) -> float:
    """Return the standard deviation of a sample, N: from third differences, or of the quiet lead where that is larger
    by three standard errors, as noise of low frequency shows in the lead alone."""
    filled = interpolated_over_gaps(force)
    white, lead = noise_level(filled), filled[: lead_of(force)]
    slow = float(lead.std(ddof=1)) if lead.size else 0.0
    return slow if lead.size and slow > white * (1.0 + 3.0 / np.sqrt(lead.size)) else white


def lead_of(force: Vector) -> int:
    """Return how many samples at the beginning are quiet, three quarters of those before the first wave; 0 where they
    are too few."""
    lead = 3 * quiet_lead(interpolated_over_gaps(force)) // 2
    return lead if lead >= SETTINGS.fewest_of_lead else 0


def _disturbed(sensor: Sensor, given: bool) -> Sensor:
    """Return a sensor with the disturbances that its lead shows.

    They are the autoregression and the polynomial of the lead with the least of Bayes's information criterion, if that
    is lower by 6 than of white noise alone: strong evidence (Kass and Raftery, 1995).
    """
    orders, degrees = SETTINGS.orders_of_memory, SETTINGS.degrees_of_drift
    quiet = interpolated_over_gaps(sensor.force)[: sensor.lead] / sensor.noise
    before = np.stack([quiet[orders - k : quiet.size - k] for k in range(1, orders + 1)], axis=1)
    values, shapes = quiet[orders:], legvander(np.linspace(-1.0, 1.0, quiet.size - orders), degrees)
    fits = list[tuple[float, int, int, Any, float]]()
    for order, terms in product(range(orders + 1), range(1, degrees + 2)):
        columns = np.hstack([before[:, :order], shapes[:, :terms]])
        found = np.linalg.lstsq(columns, values, rcond=None)[0]
        variance = float(((values - columns @ found) ** 2).mean())
        fits.append((values.size * np.log(variance) + found.size * np.log(values.size), order, terms, found, variance))
    least, order, terms, found, variance = min(fits, key=lambda fit: fit[0])
    if least > fits[0][0] - SETTINGS.strong_evidence:
        return sensor
    if not order:
        white = noise_level(interpolated_over_gaps(sensor.force))
        return sensor._replace(drifts=True, noise=sensor.noise if given else white)
    return sensor._replace(memory=found[:order], step=sensor.noise * variance**0.5, drifts=terms > 1)


def remembered(sensor: Sensor, left: Vector) -> Sensor:
    """Return a sensor with the memory of its noise in what a fit leaves of the record, N, NaN where nothing is known.

    A lead of some hundred samples shows that there is one, but knows it too badly: intervals were too short.
    """
    left, order = left[np.isfinite(left)], sensor.memory.size
    before = np.stack([left[order - k : left.size - k] for k in range(1, order + 1)], axis=1)
    memory = np.asarray(np.linalg.lstsq(before, left[order:], rcond=None)[0], dtype=np.float64)
    step = float((left[order:] - before @ memory).std())
    return sensor._replace(memory=memory, step=step, noise=float(left.std()))
