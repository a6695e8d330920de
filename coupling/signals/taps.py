"""Several taps of one chain, aligned by their incident waves and averaged."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from coupling.results.reading import Reading
from coupling.results.sensor_trace import interpolated_over_gaps, resolution
from coupling.results.signal_waves import SignalWaves
from coupling.signals.conditioning import checked_signal, with_noise
from coupling.signals.signals import as_signal
from structures.caution import caution
from structures.checks import count_of, listed, whole
from structures.structure import Vector

# A warning appears if incident peaks scatter by more than this: waves of different heights differ in speed.
SCATTER = 0.05


def average_taps(signals: Sequence[xr.Dataset], sensor: int | None = None) -> xr.Dataset:
    """Return the average of repeated taps, aligned by the incident wave, with the scatter between them as noise.

    Parameters
    ----------
    signals : sequence of Dataset
        One signal for each tap, with the same sampling.
    sensor : int, optional
        The sensor whose incident wave aligns the taps; by default the first one.

    Returns
    -------
    Dataset
        The averaged signal, with time zero at the incident peak; NaN where a tap is clipped. The variable ``noise``
        over sensor is the standard deviation of a sample of the average, N: that between taps, over √taps. The
        attribute ``taps`` is the number of taps.

    Warns
    -----
    HertzlinkWarning
        If the incident peaks scatter by more than 5 %.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(4000) * 1e-7
    >>> random = np.random.default_rng(1)
    >>> tap = lambda at: 50.0 * np.exp(-(((time - at) / 1e-5) ** 2)) + random.normal(0.0, 0.3, time.size)
    >>> mean = hl.average_taps([hl.as_signal(time, {7: tap(2e-4 + late)}) for late in random.uniform(0, 1e-6, 9)])
    >>> print(f"{float(mean.noise.sel(sensor=7)):.1f} N")
    0.1 N
    """
    taps = [checked_signal("signals", tap) for tap in listed("signals", signals, xr.Dataset, "a signal for each tap")]
    if len(taps) < 2:
        raise ValueError(f"signals: hold {count_of(len(taps), 'tap')}, must hold 2 or more")
    numbers, peaks = taps[0].sensor.values.tolist(), list[tuple[float, float]]()
    chosen = numbers[0] if sensor is None else whole("sensor", sensor)
    step = float(taps[0].time[1] - taps[0].time[0])
    for k, tap in enumerate(taps):
        own, sensors = float(tap.time[1] - tap.time[0]), tap.sensor.values.tolist()
        if sensors != numbers or abs(own - step) > 1e-3 * step:
            has = f"has sensors {sensors} with a sample every {own:.4g} s"
            raise ValueError(f"signals[{k}]: {has}, must have sensors {numbers} with one every {step:.4g} s")
        waves = SignalWaves(tap.time.values, np.asarray(Reading(tap).measured(chosen).values), 0.5).peaks
        if not waves:
            raise ValueError(f"signals[{k}]: sensor {chosen} recorded no wave; leave this tap out")
        peaks.append(waves[0])
    heights, arrivals = np.array(peaks).T

    # Whole steps that lie inside all taps, despite rounding.
    times = [tap.time.values - at for tap, at in zip(taps, arrivals, strict=True)]
    first, last = max(float(time[0]) for time in times), min(float(time[-1]) for time in times)
    time = step * np.arange(np.ceil(first / step + 1e-6), np.floor(last / step - 1e-6) + 1)
    means, noises = dict[int, Vector](), list[float]()
    for number in numbers:
        samples = [np.asarray(tap.sensor_force.sel(sensor=number).values) for tap in taps]
        # Interpolation gives NaN next to samples that are NaN.
        rows = np.stack([np.interp(time, own, force) for own, force in zip(times, samples, strict=True)])
        means[number] = rows.mean(axis=0)
        complete = rows[:, np.isfinite(means[number])]
        if not complete.size:
            raise ValueError(f"signals: sensor {number} has no samples that are not clipped in any tap")
        scatter = float(np.sqrt(complete.var(axis=0, ddof=1).mean()))
        # Averaging does not reduce rounding errors if the noise is smaller than a step of the digitiser.
        digit = resolution(samples[0][np.isfinite(samples[0])])
        least = digit / np.sqrt(12.0) if scatter < 0.5 * digit else 0.0
        noises.append(float(max(scatter / np.sqrt(len(taps)), least)))
    spread = 100.0 * float(np.std(heights, ddof=1) / np.mean(heights))
    if spread > 100.0 * SCATTER:
        caution(f"average_taps: incident peaks scatter by {spread:.2g} %; leave out taps that differ")
    places = dict(zip(numbers, taps[0].centre.values.tolist(), strict=True)) if "centre" in taps[0].coords else None
    mean = as_signal(time, {number: interpolated_over_gaps(row) for number, row in means.items()}, places)
    averaged = with_noise(mean, means, noises, "standard deviation of a sample of the average")
    text = f"{len(taps)} taps were averaged; their incident peaks scatter by {spread:.2g} %."
    return averaged.assign_attrs(taps=len(taps), conditioning=text)
