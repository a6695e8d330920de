"""Conditioning of measured signals: offset, mains hum, clipped samples and noise, each step recorded in a sentence."""

from collections.abc import Mapping
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr

from coupling.results.schema import SIGNAL, kind_of
from coupling.results.sensor_trace import FEWEST_SAMPLES, interpolated_over_gaps, noise_level, quiet_lead, resolution
from structures.caution import caution
from structures.checks import count_of, instance, positive
from structures.structure import Vector

HARMONICS = 5
"""Mains hum is fitted with this many harmonics, the fundamental included."""

TOP_STEPS = 8.0
"""The top of a trace is compared with what lies within this many steps of the digitiser below it."""

TOP_NOISES = 4.0
"""And within this many standard deviations of the noise."""

FLAT = 0.5
"""A level is clipped if more than this part of the samples near it are exactly on it: of a parabola it is a third."""

FEWEST_CLIPPED = 3

CLEAR_OF_ZERO = 0.1
"""A clipped level is at least this part of the range away from the quiet level."""


ERROR_OF_MEDIAN = 2.0 * sqrt(0.5 * pi)
"""Two standard errors of a median, in those of one sample over the root of their number: less is no offset."""

EXACT = 1e-9
"""Part of the peak that is rounding."""


class Conditioned(NamedTuple):
    """A trace with NaN where it was clipped, its noise, what was done, and what may mislead."""

    force: Vector
    noise: float
    done: list[str]
    cautions: list[str]


def clean_signal(signal: xr.Dataset, mains: float | None = None) -> xr.Dataset:
    """Return a measured signal without offset and hum, with clipped samples marked, and with the noise of each sensor.

    Parameters
    ----------
    signal : Dataset
        A measured signal of `read_signal` or `as_signal`.
    mains : float, optional
        Frequency of the mains, Hz, 50 or 60: its hum and harmonics are fitted to the quiet lead and removed. Where the
        lead is too short for that, nothing is removed. By default hum is left alone.

    Returns
    -------
    Dataset
        The signal; clipped samples are NaN. The variable ``noise`` over sensor is the standard deviation of a sample,
        N. The attribute ``conditioning`` describes each step, one sentence a line.

    Raises
    ------
    ValueError
        If the Dataset is not one measured signal, or a sensor has fewer than 16 samples that are not clipped.

    Warns
    -----
    HertzlinkWarning
        If samples are clipped, there is no quiet lead, or hum could not be removed.

    Notes
    -----
    The quiet lead is the first half of the samples before the first wave. The page on signals has the criteria of each
    step.

    Examples
    --------
    >>> import hertzlink as hl
    >>> import numpy as np
    >>> time = np.arange(4000) * 1e-7
    >>> volts = 50.0 * np.exp(-(((time - 2e-4) / 1e-5) ** 2)) + np.random.default_rng(1).normal(1.0, 0.2, time.size)
    >>> signal = hl.clean_signal(hl.as_signal(time, {7: volts}))
    >>> print(f"{float(signal.noise.sel(sensor=7)):.1f} N")
    0.2 N
    >>> print(signal.conditioning)
    Sensor 7: the offset, 0.994 N, was removed (median of the quiet lead, 92.1 µs).
    Sensor 7: the noise is 0.198 N (standard deviation of the lead).
    """
    checked_signal("signal", signal)
    frequency = positive("mains", mains, "Hz") if mains is not None else None
    time = np.asarray(signal.time.values, dtype=float)
    conditioned = {}
    for sensor in signal.sensor.values.tolist():
        force = np.asarray(signal.sensor_force.sel(sensor=sensor).values, dtype=float)
        if (count := int(np.isfinite(force).sum())) < FEWEST_SAMPLES:
            raise ValueError(
                f"signal: sensor {sensor} has {count_of(count, 'sample')} without clipping, must have {FEWEST_SAMPLES}"
            )
        conditioned[sensor] = _conditioned(time, force, frequency)
    sentences = []
    for sensor, channel in conditioned.items():
        sentences += [f"Sensor {sensor}: {text}." for text in [*channel.done, *channel.cautions]]
        for text in channel.cautions:
            caution(f"condition: sensor {sensor}: {text}")
    forces = {sensor: channel.force for sensor, channel in conditioned.items()}
    noises = [channel.noise for channel in conditioned.values()]
    result = with_noise(signal, forces, noises, "standard deviation of a sample")
    return result.assign_attrs(conditioning="\n".join(sentences))


def checked_signal(name: str, signal: xr.Dataset) -> xr.Dataset:
    """Return `signal`, or raise a ValueError where it is not one measured signal."""
    instance(name, signal, xr.Dataset, "a signal of read_signal or as_signal")
    if kind_of(signal) != SIGNAL or set(signal.sensor_force.dims) != {"time", "sensor"}:
        raise ValueError(f"{name}: must be one measured signal, with sensor_force over time and sensor")
    return signal


def with_noise(signal: xr.Dataset, forces: Mapping[int, Vector], noises: list[float], label: str) -> xr.Dataset:
    """Return the signal with other forces at its sensors, N, and the variable noise, N, over sensor."""
    rows = signal.sensor_force.transpose("time", "sensor").copy(data=np.stack([*forces.values()], axis=1))
    return signal.assign(sensor_force=rows, noise=("sensor", noises, {"units": "N", "long_name": label}))


def _conditioned(time: Vector, force: Vector, mains: float | None) -> Conditioned:
    done: list[str] = []
    cautions: list[str] = []
    filled = interpolated_over_gaps(force)
    step = resolution(force[np.isfinite(force)])
    rough = noise_level(filled)
    lead = lead_of(filled, mains)
    if not lead:
        cautions.append("there is no quiet lead, so the offset was left as it is")
    quiet = float(np.median(filled[:lead])) if lead else 0.0
    clipped, texts = clipped_samples(time, force, quiet, step, rough)
    cautions += texts
    seconds = float(time[lead] - time[0])
    hum, text = mains_hum(time, filled, lead, mains) if mains is not None else (None, "")
    if hum is not None:
        force, filled = force - hum, filled - hum
        done.append(f"the offset and {text}")
    else:
        force, filled = force - quiet, filled - quiet
        scatter = max(rough, step / sqrt(12.0), EXACT * float(np.abs(filled).max()))
        if lead and abs(quiet) > ERROR_OF_MEDIAN * scatter / sqrt(lead):
            done.append(f"the offset, {quiet:.4g} N, was removed (median of the quiet lead, {1e6 * seconds:.3g} µs)")
        if mains is not None:
            cautions.append(text)
    spread, origin = (
        (float(filled[:lead].std(ddof=1)), "the lead") if lead > FEWEST_SAMPLES else (rough, "third differences")
    )
    noise = max(spread, step / sqrt(12.0))
    source = f"standard deviation of {origin}" if noise > step / sqrt(12.0) else "one step of the digitiser over √12"
    done.append(f"the noise is {noise:.3g} N ({source})")
    return Conditioned(np.where(clipped, np.nan, force), noise, done, cautions)


def lead_of(filled: Vector, mains: float | None) -> int:
    """Return how many samples at the beginning are quiet but for hum; 0 for none."""
    if mains is not None:
        off = np.abs(filled - np.median(filled))
        return int((off > 0.5 * off.max()).argmax()) // 2
    try:
        return quiet_lead("lead", filled)
    except ValueError:
        return 0


def clipped_samples(time: Vector, force: Vector, quiet: float, step: float, noise: float) -> tuple[Vector, list[str]]:
    """Return which samples are clipped or NaN already, and a sentence on each level."""
    clipped, texts = ~np.isfinite(force), []
    if clipped.any():
        texts.append(
            f"{count_of(int(clipped.sum()), 'sample is', 'samples are')} missing or beyond the scope's range, and NaN"
        )
    unclipped = np.where(clipped, quiet, force)
    for level in (float(unclipped.max()), float(unclipped.min())):
        if abs(level - quiet) < CLEAR_OF_ZERO * np.ptp(unclipped):
            continue
        depth = max(TOP_STEPS * step, TOP_NOISES * noise)
        on, near = unclipped == level, np.abs(unclipped - level) <= depth
        here = np.zeros(unclipped.size, dtype=bool)
        for (piece,) in scipy.ndimage.find_objects(scipy.ndimage.label(near)[0]):
            if on[piece].sum() >= FEWEST_CLIPPED and on[piece].mean() > FLAT:
                here[piece] = on[piece]
        if here.any():
            span = time[here]
            texts.append(
                f"{count_of(int(here.sum()), 'sample is', 'samples are')} clipped at {level - quiet:.4g} N, from "
                f"{1e6 * span[0]:.4g} to {1e6 * span[-1]:.4g} µs; it is NaN there, and the peak's height is unknown"
            )
            clipped = clipped | here
    return clipped, texts


def mains_hum(time: Vector, force: Vector, lead: int, mains: float) -> tuple[Vector | None, str]:
    """Return the offset and hum over the whole record, N, or None, and a text on it."""
    seconds, step = float(time[lead] - time[0]), float(time[1] - time[0])
    name = f"mains hum of {mains:g} Hz"
    if seconds * mains < 1.0:
        return None, (
            f"{name} was not removed: that needs a quiet lead of one period, {1e3 / mains:.3g} ms, and it is "
            f"{1e3 * seconds:.3g} ms"
        )
    orders = [k for k in range(1, HARMONICS + 1) if k * mains < 0.25 / step]
    phases = 2.0 * pi * mains * np.outer(time - time[0], orders)
    design = np.hstack([np.ones((time.size, 1)), np.cos(phases), np.sin(phases)])
    fitted = np.linalg.lstsq(design[:lead], force[:lead], rcond=None)[0]
    hum = design @ fitted
    left = force[:lead] - hum[:lead]
    inverse = np.linalg.pinv(design[:lead].T @ design[:lead])
    growth = sqrt(float(np.einsum("ij,jk,ik->i", design, inverse, design).max()))
    if not orders or growth > 1.0:
        return None, f"{name} was not removed: the quiet lead, {1e3 * seconds:.3g} ms, does not determine it"
    size = float(np.ptp(hum) / 2.0)
    harmonics = count_of(len(orders), "harmonic")
    text = f"{name} with {harmonics}, amplitude {size:.3g} N, was removed (fit to the quiet lead, "
    return hum, f"{text}{1e3 * seconds:.3g} ms; it leaves {left.std():.2g} N)"
