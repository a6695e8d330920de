"""Conditioning of measured signals: offset, mains hum, clipped samples and noise, each step recorded in a sentence."""

from collections.abc import Mapping
from math import pi, sqrt
from typing import Annotated

import numpy as np
import xarray as xr

from coupling.results.schema import SIGNAL, kind_of
from coupling.results.sensor_trace import FEWEST_SAMPLES, Measures, measures
from structures.caution import caution
from structures.checks import count_of, instance, positive
from structures.quantities import Quantity
from structures.structure import Vector
from structures.units import readable

HARMONICS = 5  # Mains hum is fitted with this many harmonics, the fundamental included.
# Two standard errors of a median, in units of one sample's over the root of their number: a smaller value is zero.
ERROR_OF_MEDIAN = 2.0 * sqrt(0.5 * pi)


def clean_signal(
    signal: xr.Dataset, mains: Annotated[float, Quantity("Hz", "a frequency", "50 Hz")] | None = None
) -> xr.Dataset:
    """Return a measured signal without offset and hum, with clipped samples marked, and with the noise of each sensor.

    docs/signals.md has the criteria of each step.

    Parameters
    ----------
    signal : Dataset
        A measured signal of `read_signal` or `as_signal`.
    mains : float, optional
        Frequency of the mains, Hz. Its hum is fitted to the quiet lead and removed, if the lead is long enough.

    Returns
    -------
    Dataset
        The signal; clipped samples are NaN. The variable ``noise`` over sensor is the standard deviation of a sample,
        N. The attribute ``conditioning`` describes each step, one sentence a line.

    Warns
    -----
    HertzlinkWarning
        If samples are clipped, there is no quiet lead, or hum could not be removed.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(4000) * 1e-7
    >>> force = 50.0 * np.exp(-(((time - 2e-4) / 1e-5) ** 2)) + np.random.default_rng(1).normal(1.0, 0.2, time.size)
    >>> print(hl.clean_signal(hl.as_signal(time, {7: force})).conditioning)
    Sensor 7: the offset, 0.994 N, was removed (median of the quiet lead, 92.1 µs).
    Sensor 7: the noise is 0.198 N (standard deviation of the lead).
    """
    checked_signal("signal", signal)
    frequency = positive("mains", mains, "Hz") if mains is not None else None
    time = np.asarray(signal.time.values, dtype=float)
    forces, noises, sentences = dict[int, Vector](), list[float](), list[str]()
    for sensor in signal.sensor.values.tolist():
        force = np.asarray(signal.sensor_force.sel(sensor=sensor).values, dtype=float)
        if (count := int(np.isfinite(force).sum())) < FEWEST_SAMPLES:
            raise ValueError(
                f"signal: sensor {sensor} has {count_of(count, 'sample')} without clipping, must have {FEWEST_SAMPLES}"
            )
        record, done = measures(time, force, frequency), list[str]()
        filled, lead, cautions = record.filled, record.lead, record.said
        if not lead:
            cautions = ["there is no quiet lead, so the offset was left as it is", *cautions]

        # Offset and hum.
        rounding, zero = record.step / sqrt(12.0), 0.0
        scatter = max(record.noise, rounding, 1e-9 * float(np.abs(filled - record.level).max()))
        hum, text = (None, "") if frequency is None else mains_hum(time, record, frequency)
        if hum is not None:
            done.append(f"the offset and {text}")
        elif lead:
            zero = record.level
            if abs(zero) > ERROR_OF_MEDIAN * scatter / sqrt(lead):
                lasts = readable(float(time[lead] - time[0]), "s")
                done.append(f"the offset, {zero:.4g} N, was removed (median of the quiet lead, {lasts})")
        cautions += [text] if hum is None and text else []
        offset = zero if hum is None else hum
        forces[sensor] = np.where(record.clipped, np.nan, force - offset)

        # Noise.
        noise, source = record.noise, "third differences"
        if lead > FEWEST_SAMPLES:
            noise, source = float((filled - offset)[:lead].std(ddof=1)), "the lead"
        source = f"standard deviation of {source}" if noise > rounding else "one step of the digitiser over √12"
        noises.append(max(noise, rounding))
        done.append(f"the noise is {noises[-1]:.3g} N ({source})")
        sentences += [f"Sensor {sensor}: {text}." for text in (*done, *cautions)]
        for text in cautions:
            caution(f"condition: sensor {sensor}: {text}")
    result = with_noise(signal, forces, noises, "standard deviation of a sample")
    return result.assign_attrs(conditioning="\n".join(sentences))


def checked_signal(name: str, signal: xr.Dataset) -> xr.Dataset:
    """Return `signal`, or raise a ValueError if it is not one measured signal."""
    instance(name, signal, xr.Dataset, "a signal of read_signal or as_signal")
    if kind_of(signal) != SIGNAL or set(signal.sensor_force.dims) != {"time", "sensor"}:
        raise ValueError(f"{name}: must be one measured signal, with sensor_force over time and sensor")
    return signal


def with_noise(signal: xr.Dataset, forces: Mapping[int, Vector], noises: list[float], label: str) -> xr.Dataset:
    """Return the signal with new forces at its sensors, N, and the variable noise, N, over sensor."""
    rows = signal.sensor_force.transpose("time", "sensor").copy(data=np.stack([*forces.values()], axis=1))
    return signal.assign(sensor_force=rows, noise=("sensor", noises, {"units": "N", "long_name": label}))


def mains_hum(time: Vector, record: Measures, mains: float) -> tuple[Vector | None, str]:
    """Return the offset and hum over the whole record, N, or None if they cannot be removed, and a text on this."""
    force, lead, step = record.filled, record.lead, float(time[1] - time[0])
    seconds = float(time[lead] - time[0])
    name, lasts = f"mains hum of {mains:g} Hz", f"{1e3 * seconds:.3g} ms"
    if seconds * mains < 1.0:
        return None, f"{name} was not removed: that needs a quiet lead of one period, {1e3 / mains:.3g} ms, not {lasts}"
    orders = [k for k in range(1, HARMONICS + 1) if k * mains < 0.25 / step]
    phases = 2.0 * pi * mains * np.outer(time - time[0], orders)
    design = np.hstack([np.ones((time.size, 1)), np.cos(phases), np.sin(phases)])
    hum = design @ np.linalg.lstsq(design[:lead], force[:lead], rcond=None)[0]
    # The noise of the lead must not grow on the way to the end of the record.
    inverse = np.linalg.pinv(design[:lead].T @ design[:lead])
    if not orders or float(np.einsum("ij,jk,ik->i", design, inverse, design).max()) > 1.0:
        return None, f"{name} was not removed: the quiet lead, {lasts}, does not determine it"
    harmonics, left = count_of(len(orders), "harmonic"), float((force - hum)[:lead].std())
    fit = f"fit to the quiet lead, {lasts}; it leaves {left:.2g} N"
    return hum, f"{name} with {harmonics}, amplitude {np.ptp(hum) / 2.0:.3g} N, was removed ({fit})"
