"""A signal as identification takes it: its samples, and what its sensors read besides waves.

The quiet lead alone says what that is: white noise, noise that remembers its last samples, hum or drift. What a model
lacks shows only where there are waves, and no disturbance may explain it.
"""

from collections.abc import Iterable, Mapping
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy.ndimage import label, median_filter

from coupling.inference.prediction import NUMERICAL
from coupling.inference.settings import SETTINGS
from coupling.results.measures import sensor_force
from coupling.results.schema import kind_of
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
    def size_known(self) -> bool:
        """True if the noise was given, and is white."""
        return self.given and not any(sensor.memory.size for sensor in self.sensors)

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
        peak = float(abs(there).max())
        sensor = Sensor(bead, force, float(np.hypot(size, NUMERICAL * peak)), lead_of(force))
        rows.append(_disturbed(sensor, given) if sensor.lead and white_noise(there) > NUMERICAL * peak else sensor)
    return Measured(np.asarray(data.time.values, dtype=float), rows, given)


def _disturbed(sensor: Sensor, given: bool) -> Sensor:
    """Return a sensor with the disturbances that its lead shows.

    They are the autoregression and the polynomial of the lead with the least of Bayes's information criterion, if that
    is lower by 6 than of white noise alone: strong evidence (Kass and Raftery, 1995).
    """
    orders, degrees = SETTINGS.orders_of_memory, SETTINGS.degrees_of_drift
    quiet = sensor.force[: sensor.lead] / sensor.noise
    quiet = np.where(outlying(quiet, 1.0), np.nan, quiet)
    before = np.stack([np.append(np.full(k, np.nan), quiet[:-k]) for k in range(1, orders + 1)], axis=1)
    rows = np.isfinite(quiet) & np.isfinite(before).all(axis=1)
    if rows.sum() < SETTINGS.fewest_of_lead // 2:
        return sensor
    values, shapes = quiet[rows], legvander(np.linspace(-1.0, 1.0, quiet.size), degrees)[rows]
    fits = list[tuple[float, int, int, Vector, float]]()
    for order, terms in product(range(orders + 1), range(1, degrees + 2)):
        columns = np.hstack([before[rows, :order], shapes[:, :terms]])
        found = np.linalg.lstsq(columns, values, rcond=None)[0]
        variance = float(((values - columns @ found) ** 2).mean())
        fits.append((values.size * np.log(variance) + found.size * np.log(values.size), order, terms, found, variance))
    least, order, terms, found, variance = min(fits, key=lambda fit: fit[0])
    if least > fits[0][0] - SETTINGS.strong_evidence:
        return sensor
    step = sensor.noise * variance**0.5
    if not order:
        return sensor._replace(drifts=True, noise=sensor.noise if given else white_noise(sensor.force))
    return sensor._replace(memory=found[:order], step=step, drifts=terms > 1)


def remembered(sensor: Sensor, left: Vector) -> Sensor:
    """Return a sensor with the memory of its noise in what a fit leaves of the record, N, NaN where nothing is known.

    A lead of some hundred samples shows that there is one, but knows it too badly: intervals were too short.
    """
    left, order = left[np.isfinite(left)], sensor.memory.size
    before = np.stack([left[order - k : left.size - k] for k in range(1, order + 1)], axis=1)
    memory = np.asarray(np.linalg.lstsq(before, left[order:], rcond=None)[0], dtype=np.float64)
    step = float((left[order:] - before @ memory).std())
    return sensor._replace(memory=memory, step=step, noise=float(left.std()))


def estimated(force: Vector) -> float:
    """Return the standard deviation of a sample, N: from third differences, or of the quiet lead where that is larger.

    Differences leave white noise and remove what is smooth. Noise of low frequency shows in the lead alone.
    """
    white, lead = white_noise(force), force[: lead_of(force)]
    lead = lead[np.isfinite(lead) & ~outlying(lead, white)]
    slow = float(lead.std(ddof=1)) if lead.size else 0.0
    # By three standard errors of the lead's.
    return slow if lead.size and slow > white * (1.0 + 3.0 / np.sqrt(lead.size)) else white


def lead_of(force: Vector) -> int:
    """Return how many samples at the beginning show no wave; 0 where they are too few.

    The lead ends where the force first exceeds 5 % of its peak, less twice the time from there to half the peak: a wave
    begins slowly, at any rate of sampling.
    """
    there = np.flatnonzero(np.isfinite(force))
    finite = force[there]
    peak = float(abs(finite).max())
    white, rise = white_noise(finite), abs(finite - np.median(finite[: SETTINGS.fewest_of_lead]))
    rise = np.where(outlying(finite, white), 0.0, rise)
    first = int(np.argmax(rise > 0.05 * peak + 5.0 * white))
    margin = max(SETTINGS.fewest_of_lead // 2, 2 * (int(np.argmax(rise > 0.5 * peak)) - first))
    return int(there[first - margin]) if first >= margin + 3 * SETTINGS.fewest_of_lead // 2 else 0


def white_noise(force: Vector) -> float:
    """Return the noise by third differences, whose variance is 20 times its own; waves are the few large ones."""
    rough = np.diff(force[np.isfinite(force)], 3) / np.sqrt(20.0)
    size = float(np.median(abs(rough))) / 0.6744898
    usual = rough[abs(rough) <= 3.0 * size]
    # Within three standard deviations a Gaussian has the part 0.973 of its variance.
    return float(np.sqrt((usual**2).mean() / 0.9733369)) if size > 0.0 else 0.0


def outlying(values: Vector, noise: float) -> NDArray[np.bool_]:
    """Return which samples lie five standard deviations off the median of their neighbours, alone or in pairs."""
    filled = np.where(np.isfinite(values), values, 0.0)
    far = (np.abs(filled - median_filter(filled, 7)) > 5.0 * noise) & np.isfinite(values)
    groups, count = label(far)
    return np.asarray(far & (np.bincount(groups.ravel(), minlength=count + 1) <= 2)[groups])
