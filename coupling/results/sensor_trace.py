"""A sensor bead: what calibrates it, and what noise, baseline and pulses its trace holds (thesis, section 2.2)."""

from math import pi, sqrt

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from structures.checks import count_of, one_of, positive
from structures.structure import Vector
from structures.user_arrays import in_si_units

FEWEST_SAMPLES = 16
"""A trace with fewer samples holds no pulse that could be measured."""

SHARE_OF_MOMENTUM = {"immobile": 1.0, "free": 0.5}
"""The impulse up to the greatest force, in units of the striker's momentum."""

ROUGH_NOISE = 0.02
"""A trace is first smoothed until its noise is this part of its range: then half heights are crossed once."""

SMOOTHING = 1.0 / 8.0
"""Standard deviation of the Gaussian that waves are looked for with, in widths of the narrowest large pulse."""

LARGE = 0.2
"""A large pulse rises by at least this part of the range of a trace: ten standard deviations of the rough noise, where
the greatest of 10 000 noises rises by 7.8 from valley to peak."""

WIDE = 64.0
"""Standard deviation of a Gaussian, in samples, beyond which Fourier transforms are faster than sums."""

REVERSED = 2.0
"""Pulses are negative if the deepest valley is this many times the highest peak."""

FOOT = 0.01
"""An impact begins where the trace last exceeds this part of its greatest value."""


def calibration_factor(
    time: ArrayLike, voltage: ArrayLike, mass: float, impact_speed: float, backing: str = "immobile"
) -> float:
    """Return the calibration factor κ of a sensor bead, from the impact of a striker of known momentum.

    Parameters
    ----------
    time : array_like
        Times of one impact, s.
    voltage : array_like
        Voltage of the sensor, V. Its quiet lead, the samples before the impact, gives the baseline, their median.
    mass : float
        Mass of the striker, kg.
    impact_speed : float
        Speed of the striker, m/s; `drop_speed(height)` gives √(2gh).
    backing : {"immobile", "free"}
        "immobile": the sensor lies on a massive block, and the force at its centre is the contact force. "free": the
        sensor is a free bead equal to the striker.

    Returns
    -------
    float
        κ, the contact force per volt, N/V. The force at the centre of a free bead is half the contact force: halve κ
        for it.

    Raises
    ------
    ValueError
        If there is no pulse, or it is negative.

    Notes
    -----
    κ = m √(2gh) / ∫ V dt, from the beginning of the impact to the greatest voltage, where the striker rests. Against a
    free bead both move together at the greatest force, and the impulse up to it is half the momentum.

    References
    ----------
    Thesis, equation 2.1 and section 2.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> import numpy as np
    >>> time = np.linspace(-1e-4, 1e-4, 2001)
    >>> voltage = np.where(abs(time) < 2e-5, np.cos(np.pi * time / 4e-5), 0.0)
    >>> print(f"{hl.calibration_factor(time, voltage, mass=3.5e-3, impact_speed=0.44):.0f} N/V")
    121 N/V
    """
    share = SHARE_OF_MOMENTUM[one_of("backing", backing, SHARE_OF_MOMENTUM)]
    momentum = share * positive("mass", mass, "kg") * positive("impact_speed", impact_speed, "m/s")
    t = checked_trace("time", time, "s")
    v = checked_trace("voltage", voltage, "V", t.size)
    if not (np.diff(t) > 0.0).all():
        raise ValueError("time: must increase from sample to sample")
    v = v - np.median(v[: quiet_lead("voltage", v)])
    smooth, _, width = smoothed(v)
    peak = int(smooth.argmax())
    if not smooth[peak] > -smooth.min():
        raise ValueError(
            f"voltage: its greatest deflection is negative, {smooth.min():.3g} V: must be a positive pulse"
        )
    if not 0 < peak < v.size - 1:
        raise ValueError("voltage: must hold the whole compression, from a quiet lead to beyond its greatest value")
    reach = max(1, round(width / 4.0))
    near = slice(max(0, peak - reach), peak + reach + 1)
    vertex = np.polynomial.Polynomial.fit(t[near], v[near], 2).deriv().roots()[0]
    end = float(np.clip(vertex, t[near][0], t[near][-1]))
    below = np.flatnonzero(smooth[:peak] < FOOT * smooth[peak])
    start = int(below[-1]) if below.size else 0
    inside = t[start:] < end
    until = np.append(t[start:][inside], end)
    return momentum / float(scipy.integrate.trapezoid(np.interp(until, t, v), until))


def checked_trace(name: str, values: ArrayLike, unit: str, count: int = 0) -> Vector:
    """Return `values` as an array of at least 16 finite numbers in an SI unit, `count` of them if given, or
    raise a ValueError."""
    array = in_si_units(name, values, unit)
    if array.ndim != 1 or array.size < FEWEST_SAMPLES:
        raise ValueError(f"{name}: has shape {array.shape}, must be one row of at least {FEWEST_SAMPLES} numbers")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise ValueError(f"{name}[{bad[0]}] = {array[bad[0]]}: must be a finite number")
    if count and array.size != count:
        raise ValueError(f"{name}: holds {count_of(array.size, 'number')}, must be as many as time, {count}")
    return array


def interpolated_over_gaps(values: Vector) -> Vector:
    """Return a trace with straight lines across samples that are NaN, because they were clipped; never all of them."""
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
    """Return the standard deviation of the white noise on a trace, at least that of the digitiser's rounding.

    From third differences, which smooth waves hardly touch, by their median: it does not see single spikes. The median
    of |x| is 0.6745 standard deviations of a Gaussian, and third differences have 1 + 9 + 9 + 1 times its variance.
    """
    white = float(np.median(np.abs(np.diff(values, 3)))) / (0.6745 * sqrt(20.0))
    return max(white, resolution(values) / sqrt(12.0))  # rounding errors are even over one step


def resolution(values: Vector) -> float:
    """Return the smallest step between two values of a trace: the digitiser's, where one was at work."""
    steps = np.diff(np.unique(values))
    return float(steps.min()) if steps.size else 0.0


def smoothed(values: Vector) -> tuple[Vector, float, float]:
    """Return a trace smooth enough to look for waves, the noise left on it, and the width of its pulses in samples.

    The width is the narrowest large pulse's, or the greatest's where none is large, at half its rise: pulses that pile
    up stay apart. A trace without a peak comes back as it is, with the width 0.
    """
    noise, span = noise_level(values), float(np.ptp(values))
    rough = _blurred(values, _sigma(noise, ROUGH_NOISE * span, values.size))
    peaks, rises = _peaks_above(float(rough.min()) + 0.999 * LARGE * span, rough)  # no large pulse has a lower top
    if not (rises >= LARGE * span).any():
        peaks, rises = _peaks_above(-np.inf, rough)
    if not peaks.size:
        return values, noise, 0.0
    large = rises >= min(LARGE * span, rises.max())
    width = float(scipy.signal.peak_widths(rough, peaks[large], rel_height=0.5)[0].min())
    # As in `_sigma`; the 1 holds where the Gaussian is so narrow that it changes nothing.
    left = noise / sqrt(1.0 + 2.0 * sqrt(pi) * SMOOTHING * width)
    return _blurred(values, SMOOTHING * width), left, width


def quiet_lead(name: str, values: Vector) -> int:
    """Return how many samples at the beginning of a trace are surely quiet: half of those before it leaves its first
    level.

    Raises ValueError where they are fewer than half a pulse: the trace may begin within a wave.
    """
    smooth, _, width = smoothed(values)
    first = np.median(smooth[: max(4, values.size // 100)])
    # A tenth of the range is clear of the noise that smoothing leaves, and a pulse passes it early, on its foot.
    lead = int((np.abs(smooth - first) > 0.1 * float(np.ptp(smooth))).argmax())
    if lead < max(8.0, 0.5 * width):
        # Of fewer than four samples, half of eight, the median is no baseline.
        raise ValueError(f"{name}: has no quiet lead to take the baseline from, must begin before the first wave")
    return lead // 2


def _peaks_above(level: float, values: Vector) -> tuple[NDArray[np.intp], Vector]:
    """Return the peaks of a trace above a level, and by how much each rises from its valleys.

    Of samples below the level that follow each other only the least counts: noise has too many to look at each.
    """
    peaks = scipy.signal.find_peaks(values, height=level)[0]
    high = values >= level
    begins = np.flatnonzero(np.append(True, high[1:] | high[:-1]))
    least = np.minimum.reduceat(values, begins)
    return peaks, scipy.signal.peak_prominences(least, np.searchsorted(begins, peaks))[0]


def _sigma(noise: float, target: float, samples: int) -> float:
    """Return the standard deviation of the Gaussian that reduces white noise to a target, in samples.

    The squares of its weights sum to 1 / (2 √π sigma), the part of the variance that is left.
    """
    return 0.0 if noise <= target else min((noise / target) ** 2 / (2.0 * sqrt(pi)), samples / 100.0)


def _blurred(values: Vector, sigma: float) -> Vector:
    from scipy.ndimage import gaussian_filter1d

    if sigma <= WIDE:
        # Below a quarter of a sample the neighbours weigh exp(−8) = 0.0003: nothing changes.
        return np.asarray(gaussian_filter1d(values, sigma)) if sigma > 0.25 else values
    reach = min(int(4.0 * sigma + 0.5), values.size)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    padded = np.pad(values, reach, mode="symmetric")
    return np.asarray(scipy.signal.fftconvolve(padded, weights / weights.sum(), mode="valid"))
