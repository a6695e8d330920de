"""Several taps of one chain, aligned by their incident waves and averaged."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from coupling.results.conditioning import checked_signal, with_noise
from coupling.results.reading import Reading
from coupling.results.sensor_trace import interpolated_over_gaps, resolution
from coupling.results.signals import as_signal
from coupling.results.wave_finder import waves_of_signal
from structures.caution import caution
from structures.checks import count_of, listed, positive, whole
from structures.structure import Vector

FEWEST_TAPS, MOST_TAPS = 2, 10_000

INCIDENT = 0.5
"""A tap begins where the force first reaches this part of the greatest: taps may differ by a factor of two."""

BEFORE = 0.2
"""A tap of a long record starts this part of its length before its incident wave."""

SCATTER = 0.05
"""Incident peaks that scatter by more than this get a warning: waves of different heights differ in speed."""


def average_taps(
    signals: xr.Dataset | Sequence[xr.Dataset], length: float | None = None, sensor: int | None = None
) -> xr.Dataset:
    """Return the average of repeated taps, aligned by the incident wave, with the scatter between them as noise.

    Parameters
    ----------
    signals : Dataset or sequence of Dataset
        One long signal that holds several taps, or one signal for each tap, with the same sampling.
    length : float, optional
        Time that each tap of a long signal takes, s: a fifth of it before the incident wave. Later taps are looked for
        after it. A long signal needs it.
    sensor : int, optional
        The sensor whose incident wave aligns the taps; by default the first one.

    Returns
    -------
    Dataset
        The averaged signal, with time zero at the incident peak; NaN where a tap is clipped. The variable ``noise``
        over sensor is the standard deviation of a sample of the average, N: that between taps over √taps. The attribute
        ``taps`` is their number.

    Raises
    ------
    ValueError
        For fewer than two taps, sensors or sampling that differ, and a tap without incident wave.

    Warns
    -----
    HertzlinkWarning
        If the incident peaks scatter by more than 5 %.

    Examples
    --------
    >>> import hertzlink as hl
    >>> import numpy as np
    >>> time = np.arange(4000) * 1e-7
    >>> random = np.random.default_rng(1)
    >>> tap = lambda at: 50.0 * np.exp(-(((time - at) / 1e-5) ** 2)) + random.normal(0.0, 0.3, time.size)
    >>> mean = hl.average_taps([hl.as_signal(time, {7: tap(2e-4 + late)}) for late in random.uniform(0, 1e-6, 9)])
    >>> print(f"{float(mean.noise.sel(sensor=7)):.1f} N")
    0.1 N
    """
    if isinstance(signals, xr.Dataset):
        taps = _cut(checked_signal("signals", signals), length, sensor)
    else:
        if length is not None:
            raise ValueError(f"length = {length!r}: is for one long signal; leave it out where each signal is one tap")
        listed_signals = listed("signals", signals, xr.Dataset, "two or more signals")
        if len(listed_signals) > MOST_TAPS:
            raise ValueError(f"signals: are {len(listed_signals)}, must be at most {MOST_TAPS}")
        taps = [checked_signal("signals", tap) for tap in listed_signals]
    if len(taps) < FEWEST_TAPS:
        raise ValueError(f"signals: hold {count_of(len(taps), 'whole tap')}, must hold at least {FEWEST_TAPS}")
    numbers = taps[0].sensor.values.tolist()
    chosen = numbers[0] if sensor is None else whole("sensor", sensor)
    step = _common_step(taps, numbers, chosen)
    peaks = [_incident(tap, chosen, k) for k, tap in enumerate(taps)]
    first = max(float(tap.time[0]) - at for tap, (_, at) in zip(taps, peaks, strict=True))
    last = min(float(tap.time[-1]) - at for tap, (_, at) in zip(taps, peaks, strict=True))
    # Whole steps inside all taps; rounding may not lead outside one.
    time = step * np.arange(np.ceil(first / step + 1e-6), np.floor(last / step - 1e-6) + 1)
    means, noises = {}, []
    for number in numbers:
        # NaN next to samples that are NaN.
        moved = zip(taps, peaks, strict=True)
        rows = np.stack([np.interp(time + at, tap.time.values, _row(tap, number)) for tap, (_, at) in moved])
        means[number] = rows.mean(axis=0)
        noises.append(_scatter(rows, taps, number))
    heights = np.array([height for height, _ in peaks])
    spread = float(heights.std(ddof=1) / heights.mean())
    if spread > SCATTER:
        caution(f"average_taps: incident peaks scatter by {100.0 * spread:.2g} %; leave out taps that differ")
    filled = {number: interpolated_over_gaps(mean) for number, mean in means.items()}
    places = taps[0].centre.values.tolist() if "centre" in taps[0].coords else None
    averaged_signal = as_signal(time, filled, None if places is None else dict(zip(numbers, places, strict=True)))
    averaged = with_noise(averaged_signal, means, noises, "standard deviation of a sample of the average")
    text = f"{len(taps)} taps were averaged; their incident peaks scatter by {100.0 * spread:.2g} %."
    return averaged.assign_attrs(taps=len(taps), conditioning=text)


def _cut(signal: xr.Dataset, length: float | None, sensor: int | None) -> list[xr.Dataset]:
    """Return the whole taps of a long record."""
    if length is None:
        raise ValueError("length = None: must be given for one long signal, s, such as 1e-3")
    seconds = positive("length", length, "s")
    time = np.asarray(signal.time.values)
    if seconds < 100.0 * (time[1] - time[0]):
        raise ValueError(f"length = {length!r}: must be at least 100 samples, {100.0 * (time[1] - time[0]):.3g} s")
    chosen = signal.sensor.values.tolist()[0] if sensor is None else whole("sensor", sensor)
    force = interpolated_over_gaps(_row(signal, chosen))
    high = time[np.abs(force - np.median(force)) > INCIDENT * np.abs(force - np.median(force)).max()]
    taps, free = [], float(time[0])
    while (later := high[high >= free]).size:
        begin = float(later[0]) - BEFORE * seconds
        if begin >= time[0] and begin + seconds <= time[-1]:
            taps.append(signal.sel(time=slice(begin, begin + seconds)))
        free = begin + seconds
    return taps


def _row(signal: xr.Dataset, sensor: int) -> Vector:
    force = np.asarray(Reading(signal).measured(sensor).values, dtype=float)
    if not np.isfinite(force).any():
        raise ValueError(f"signals: sensor {sensor} has no samples that are not clipped")
    return force


def _common_step(taps: Sequence[xr.Dataset], numbers: list[int], chosen: int) -> float:
    """Return the sampling interval of all taps, s, or raise a ValueError where they differ."""
    steps = [float(tap.time[1] - tap.time[0]) for tap in taps]
    for k, tap in enumerate(taps):
        if tap.sensor.values.tolist() != numbers:
            raise ValueError(f"signals[{k}]: has sensors {tap.sensor.values.tolist()}, must have {numbers}")
        if abs(steps[k] - steps[0]) > 1e-3 * steps[0]:
            raise ValueError(f"signals[{k}]: has a sample every {steps[k]:.4g} s, must be {steps[0]:.4g} s")
        _row(tap, chosen)
    return steps[0]


def _incident(tap: xr.Dataset, sensor: int, number: int) -> tuple[float, float]:
    """Return the height and time of a tap's first wave."""
    peaks = waves_of_signal(np.asarray(tap.time.values), interpolated_over_gaps(_row(tap, sensor)), 0.5)
    if not peaks:
        raise ValueError(f"signals[{number}]: sensor {sensor} recorded no wave; leave this tap out")
    return peaks[0]


def _scatter(rows: Vector, taps: Sequence[xr.Dataset], sensor: int) -> float:
    """Return standard deviation of a sample of the average, N; rounding that no noise dithers does not average away."""
    complete = rows[:, np.isfinite(rows).all(axis=0)]
    of_one = float(np.sqrt(complete.var(axis=0, ddof=1).mean())) if complete.size else float("nan")
    first = _row(taps[0], sensor)
    step = resolution(first[np.isfinite(first)])
    mean = of_one / np.sqrt(len(rows))
    return float(max(mean, step / np.sqrt(12.0))) if of_one < 0.5 * step else float(mean)
