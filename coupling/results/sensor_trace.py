"""The trace of a sensor, in SI units: its noise, resolution, quiet lead, clipped samples, and pulses."""

from math import pi, sqrt
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from structures.checks import count_of
from structures.structure import Vector
from structures.units import factor

FEWEST_SAMPLES = 16  # A trace with fewer samples holds no pulse that could be measured.
# A trace is first smoothed until its noise is this part of its range, so that it crosses half heights only once.
ROUGH_NOISE = 0.02
# Standard deviation of the Gaussian for the search of waves, in widths of the narrowest large pulse.
SMOOTHING = 1.0 / 8.0
# A large pulse rises by at least this part of the range of a trace: ten standard deviations of the rough noise. The
# greatest rise in 10 000 samples of noise, from valley to peak, is 7.8.
LARGE = 0.2
WIDE = 64.0  # Standard deviation of a Gaussian, in samples, beyond which Fourier transforms are faster than sums.
REVERSED = 2.0  # Pulses are negative if the deepest valley is this many times the highest peak.
# A level is clipped if more than this part of the samples near it are exactly on it, and at least so many. On a
# parabola a third of them are.
FLAT, FEWEST_CLIPPED = 0.5, 3


def checked_trace(name: str, values: ArrayLike, unit: str, count: int = 0) -> Vector:
    """Return `values` as an array of at least 16 finite numbers in an SI unit, `count` of them if given; raise a
    ValueError for others. They may come from a DataArray, a Series or a pint quantity, with their units, or be dates.
    """
    given: Any = values
    stated = ""
    if hasattr(given, "attrs") and hasattr(given, "values"):  # a DataArray, or a Series of pandas
        inner = getattr(given, "data", None)
        stated = str(given.attrs.get("units", ""))
        given = inner if hasattr(inner, "magnitude") else given.values
    if hasattr(given, "magnitude") and hasattr(given, "units"):  # a quantity of pint
        given, stated = given.magnitude, f"{given.units}"
    kind = getattr(given, "dtype", np.dtype(float)).kind
    try:
        # Times in no unit stay as they are, and are refused. NaT and masked numbers become NaN.
        if unit == "s" and kind in "mM" and np.datetime_data(given.dtype)[0] != "generic":
            given = (given - given.flat[0] if kind == "M" and given.size else given) / np.timedelta64(1, "s")
        plain = np.asarray(given)
        if plain.dtype.kind not in "iufO":
            raise TypeError(f"it holds {plain.dtype}")
        array = plain.astype(float) * (float(factor(stated, unit)) if stated else 1.0)
    except (TypeError, OverflowError, ValueError) as error:
        raise ValueError(f"{name}: must be an array of real numbers, in {unit} ({error})") from None
    if np.ma.is_masked(given):
        array[np.ma.getmaskarray(given)] = np.nan
    if array.ndim != 1 or array.size < FEWEST_SAMPLES:
        raise ValueError(f"{name}: has shape {array.shape}, must be one row of at least {FEWEST_SAMPLES} numbers")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise ValueError(f"{name}[{bad[0]}] = {array[bad[0]]}: must be a finite number")
    if count and array.size != count:
        raise ValueError(f"{name}: holds {count_of(array.size, 'number')}, must be as many as time, {count}")
    return array


def interpolated_over_gaps(values: Vector) -> Vector:
    """Return a trace with straight lines across samples that are NaN, which must not be all."""
    finite = np.isfinite(values)
    if finite.all():
        return values
    places = np.arange(values.size)
    return np.asarray(np.interp(places, places[finite], values[finite]))


def is_inverted(values: Vector) -> bool:
    """Return whether the pulses of a trace are negative."""
    quiet = float(np.median(values))
    return quiet - float(values.min()) > REVERSED * (float(values.max()) - quiet)


def noise_level(values: Vector) -> float:
    """Return the standard deviation of the white noise on a trace, at least that of the digitiser's rounding. It
    follows from the median of third differences: smooth waves hardly change them, and single spikes do not change the
    median. The median of |x| of a Gaussian is 0.6745 deviations; third differences have 1 + 9 + 9 + 1 variances."""
    white = float(np.median(np.abs(np.diff(values, 3)))) / (0.6745 * sqrt(20.0))
    return max(white, resolution(values) / sqrt(12.0))  # rounding errors are uniform over one step


def resolution(values: Vector) -> float:
    """Return the smallest step between two values of a trace, which is the step of a digitiser."""
    steps = np.diff(np.unique(values))
    return float(steps.min()) if steps.size else 0.0


def smoothed(values: Vector) -> tuple[Vector, float, float]:
    """Return a trace smooth enough to look for waves, the noise left on it, and the width of its pulses in samples. The
    width is that of the narrowest large pulse, or of the greatest one if none is large, at half its rise, so that
    overlapping pulses remain separate. A trace without a peak is returned unchanged, with the width 0."""
    noise, span = noise_level(values), float(np.ptp(values))
    # The squares of a Gaussian's weights sum to 1/(2 √π sigma): this part of the variance of white noise is left.
    target = ROUGH_NOISE * span
    sigma = 0.0 if noise <= target else min((noise / target) ** 2 / (2.0 * sqrt(pi)), values.size / 100.0)
    rough = _blurred(values, sigma)
    peaks = scipy.signal.find_peaks(rough)[0]
    if not peaks.size:
        return values, noise, 0.0
    rises = scipy.signal.peak_prominences(rough, peaks)[0]
    large = rises >= min(LARGE * span, rises.max())
    width = float(scipy.signal.peak_widths(rough, peaks[large], rel_height=0.5)[0].min())
    # The same for this Gaussian; the 1 is for one so narrow that it changes nothing.
    left = noise / sqrt(1.0 + 2.0 * sqrt(pi) * SMOOTHING * width)
    return _blurred(values, SMOOTHING * width), left, width


def quiet_lead(values: Vector) -> int:
    """Return the number of samples at the beginning of a trace that are certainly quiet: half of those before it leaves
    its first level; 0 if these are fewer than half a pulse, because the trace may begin within a wave."""
    upright = -values if is_inverted(values) else values
    smooth, _, width = smoothed(upright)
    first = np.median(smooth[: max(4, values.size // 100)])
    # A tenth of the range is above the noise that smoothing leaves, and a pulse exceeds it early.
    lead = int((np.abs(smooth - first) > 0.1 * float(np.ptp(smooth))).argmax())
    # The median of fewer than four samples, half of eight, is not a baseline.
    return 0 if lead < max(8.0, 0.5 * width) else lead // 2


class Measures(NamedTuple):
    """Measures of a record."""

    filled: Vector  # the samples, with straight lines over gaps
    step: float  # of the digitiser
    noise: float  # standard deviation of white noise
    lead: int  # number of samples in the quiet lead, 0 for none
    level: float  # median of the lead
    clipped: Vector  # whether a sample is clipped or NaN
    said: list[str]  # sentences on clipped samples


def measures(time: Vector, values: Vector, mains: float | None = None) -> Measures:
    """Return the measures of a record, in which missing samples are NaN, before its waves are looked for. mains:
    frequency of a hum in the lead, Hz; the lead then ends where the record leaves half its range."""
    filled = interpolated_over_gaps(values)
    step, noise = resolution(values[np.isfinite(values)]), noise_level(filled)
    if mains is None:
        lead = quiet_lead(filled)
    else:
        off = np.abs(filled - np.median(filled))
        lead = int((off > 0.5 * off.max()).argmax()) // 2
    quiet = float(np.median(filled[:lead] if lead else filled))

    clipped, said = ~np.isfinite(values), list[str]()
    if clipped.any():
        missing = count_of(int(clipped.sum()), "sample is", "samples are")
        said.append(f"{missing} missing or beyond the scope's range, and NaN")
    unclipped, depth = np.where(clipped, quiet, values), max(8.0 * step, 4.0 * noise)
    for level in (float(unclipped.max()), float(unclipped.min())):
        if abs(level - quiet) <= 0.1 * np.ptp(unclipped):
            continue
        on, near = unclipped == level, np.abs(unclipped - level) <= depth
        here = np.zeros(unclipped.size, dtype=bool)
        for (piece,) in scipy.ndimage.find_objects(scipy.ndimage.label(near)[0]):
            if on[piece].sum() >= FEWEST_CLIPPED and on[piece].mean() > FLAT:
                here[piece] = on[piece]
        if here.any():
            span = time[here]
            said.append(
                f"{count_of(int(here.sum()), 'sample is', 'samples are')} clipped at {level - quiet:.4g} N, from "
                f"{1e6 * span[0]:.4g} to {1e6 * span[-1]:.4g} µs; it is NaN there, and the peak's height is unknown"
            )
            clipped = clipped | here
    return Measures(filled, step, noise, lead, quiet, clipped, said)


def _blurred(values: Vector, sigma: float) -> Vector:
    if sigma <= WIDE:
        # Below a quarter of a sample the weight of the neighbours is exp(−8) = 0.0003, which changes nothing.
        return np.asarray(scipy.ndimage.gaussian_filter1d(values, sigma)) if sigma > 0.25 else values
    reach = min(int(4.0 * sigma + 0.5), values.size)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    padded = np.pad(values, reach, mode="symmetric")
    return np.asarray(scipy.signal.fftconvolve(padded, weights / weights.sum(), mode="valid"))
