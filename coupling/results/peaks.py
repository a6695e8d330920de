"""Waves in forces: those of a run, whose two contacts give a direction, and those of a measured signal with noise.

Waves are given as (amplitude, arrival) in N and s, the incident one first, then those that came back.
A wave that came back is followed from the sensor towards the structure, contact by contact: beads that rattle make
small peaks too, but none that runs. The incident wave is the clock: what follows it takes about as long from contact to
contact, the weaker the longer. The loops over samples are compiled, in `wave_kernels`.
"""

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.polynomial import Polynomial

from coupling.results import wave_kernels
from coupling.results.sensor_trace import noise_level, resolution, smoothed
from coupling.results.wave_kernels import FIRST_WAVE, plain
from structures.structure import Vector

ORDER = 4
"""The top of a pulse is fitted by a polynomial of this order."""

CLEAR = 8.0
"""A wave in a signal rises by this many standard deviations of the noise that smoothing leaves, and by more than one
step of the digitiser: from valley to peak, the greatest of a thousand noises reaches 6.5."""

REACH, NARROWEST, WIDEST = 2.0, 0.02, 0.7
"""It is fitted over ± REACH (noise² / samples)^(1/12) of its width at half height, within these limits: `_reach`. At
the least two samples on either side: a cubic spline through a run's samples reads no more."""

Peak = tuple[float, float]


class Passage(NamedTuple):
    """A wave over a bead, in samples: its first and last contact peak, and the peak of the mean."""

    start: int
    end: int
    peak: int


def incident_passage(above: Vector, below: Vector, velocity: Vector) -> Passage | None:
    """Return the first wave that goes on over a bead, from the dynamic forces of its two contacts.

    A wave is a peak in each contact force, each the other's nearest; the contact that it passes first gives its
    direction. Between beads that have drifted apart a weak wave is two collisions, and still one wave. Where a bead
    moves as one with a neighbour, as in a dimer, both contacts peak together; then its velocity gives the direction.
    """
    top = (0.5 * (above + below)).max(initial=0.0)
    if top <= 0.0:
        return None
    most = above.size // 2 + 1
    passages, peaks = np.empty((most, 4), np.int64), np.empty((2, most), np.int64)
    count = wave_kernels.passages(plain(above), plain(below), plain(velocity), FIRST_WAVE * top, passages, peaks)
    forward = passages[:count][passages[:count, 3] > 0]
    return Passage(*map(int, forward[0, :3])) if len(forward) else None


def hops(time: Vector, force: Vector) -> Vector:
    """Return the time of the incident wave from each contact to the next, s; force: contacts × time.

    A soft structure delays it at the last contact, and beads that move as one pass it on at once. Neither is the time
    of another wave; the median limits both.
    """
    taken, ordered = np.empty((2, len(force) - 1))
    wave_kernels.hops(plain(time), plain(force), taken, ordered)
    return taken


def traced(
    peaks: list[Vector], hops: Vector, row: int, now: float, left: float, pace: float, first: int = 0
) -> list[float]:
    """Return the peaks (s) that a wave left in the rows after `row`, the latest first, where it came that way.

    peaks: of each row, s; now: that of `row`; left: when it left the row `first`; pace: its time from row to row, in
    units of `hops`.
    """
    begins, (path, ordered) = np.cumsum([0] + [len(times) for times in peaks]), np.empty((2, len(peaks)))
    times = np.concatenate(peaks)
    count = wave_kernels.trace_back(times, begins, plain(hops), row, now, left, pace, first, path, ordered)
    return [float(index) for index in path[:count]]


def waves_of_signal(time: Vector, force: Vector, smallest: float) -> list[Peak]:
    """Return the first wave of a signal, and all later ones, whichever way they go.

    Waves are looked for in the signal smoothed over an eighth of a pulse, must rise clear of the noise that this leaves
    and of one step of the digitiser, and are then placed by a least-squares polynomial through the samples as they are.
    """
    smooth, noise, _ = smoothed(force)
    floor = CLEAR * noise + resolution(force)
    least = max(FIRST_WAVE * smooth.max(initial=0.0), floor)
    first = scipy.signal.find_peaks(smooth, height=least, prominence=least)[0]
    if not (least > 0.0 and first.size):
        return []
    level = noise_level(force)
    least = max(smallest * _fitted(time, force, smooth, level, *_valleys(smooth, first)[0])[0], floor)
    later = scipy.signal.find_peaks(smooth, height=least, prominence=least)[0]
    peaks = np.append(first[0], later[later > first[0]])
    return [_fitted(time, force, smooth, level, *place) for place in _valleys(smooth, peaks)]


def ends_rising(force: Vector, incident: float, smallest: float) -> bool:
    """Return whether a signal ends within a wave, whose peak is not known: as `waves_of_signal` reads it."""
    smooth, noise, _ = smoothed(force)
    least = max(smallest * incident, CLEAR * noise + resolution(force))
    return rises(np.arange(smooth.size, dtype=float), smooth, least)[1]


def rises(time: Vector, force: Vector, least: float) -> tuple[Vector, bool]:
    """Return when each wave of a force has risen by `least`, s, also one that the end of the record cuts off; whether
    it does.

    A wave is a peak of that height that rises by as much on both sides.
    """
    # Compiled, because each run asks for it: scipy.signal takes half a second to import.
    samples = np.empty(force.size // 2 + 1, np.int64)
    peaks = samples[: wave_kernels.peaks_of(plain(force), least, samples)]
    edges, times = [0, *map(int, peaks)], list[float]()
    for start, stop in zip(edges, [*map(int, peaks), force.size - 1], strict=True):
        valley = start + int(force[start : stop + 1].argmin())
        above = np.flatnonzero(force[valley : stop + 1] >= max(force[valley] + least, least))
        if least > 0.0 and above.size:
            times.append(float(time[valley + int(above[0])]))
    return np.array(times), len(times) > len(peaks)


def _valleys(force: Vector, peaks: Vector) -> list[tuple[int, tuple[int, int]]]:
    """Return each peak with the lowest samples before and after it, between it and its neighbours or the ends."""
    edges = [0, *map(int, peaks), force.size - 1]
    lowest = [edge + int(force[edge : following + 1].argmin()) for edge, following in pairwise(edges)]
    return [(int(peak), valleys) for peak, valleys in zip(peaks, pairwise(lowest), strict=True)]


def interpolated(time: Vector, force: Vector, peak: int) -> Peak:
    """Return the amplitude and time of the peak of a cubic spline through the samples around a sampled peak."""
    begin = max(0, peak - wave_kernels.NEAR)
    near = slice(begin, peak + wave_kernels.NEAR + 1)
    work = np.empty((wave_kernels.SPLINE_ROWS, wave_kernels.WIDTH))
    amplitude, arrival = wave_kernels.spline_peak(
        plain(time[near]), plain(force[near]), peak - begin, time[1] - time[0], work
    )
    return float(amplitude), float(arrival)


def _fitted(time: Vector, force: Vector, smooth: Vector, noise: float, peak: int, between: tuple[int, int]) -> Peak:
    """Return amplitude and time of the top of a polynomial through the samples around a peak of the smoothed signal.

    The smoothed signal has its peak elsewhere where a pulse is lopsided or has two humps. So polynomials over the same
    reach first slide along the upper half of the pulse, between its two valleys; the one that is highest in its middle
    is taken. noise: in the signal, N.
    """
    width, step = float(scipy.signal.peak_widths(smooth, [peak], rel_height=0.5)[0][0]), time[1] - time[0]
    reach = _reach(width, noise / smooth[peak])
    half = max(1, round(0.5 * width))
    first, last = max(between[0], peak - half), min(between[1], peak + half) + 1
    start, stop = max(0, first - reach), min(force.size, last + reach)
    if stop - start == last - first + 2 * reach:
        peak = first + int(np.convolve(force[start:stop], _middle_of(reach), "valid").argmax())
    elif stop - start > 2 * reach:  # near an end of the record
        moving = scipy.signal.savgol_filter(force[start:stop], 2 * reach + 1, ORDER)
        peak = first + int(moving[first - start : last - start].argmax())
    near = slice(max(0, peak - reach), peak + reach + 1)
    fit = Polynomial.fit(time[near], force[near], min(ORDER, time[near].size - 1))
    tops = [t.real for t in fit.deriv().roots() if abs(t.imag) < step and abs(t - time[peak]) <= 0.5 * reach * step]
    best = max(tops, key=fit, default=time[peak])
    return float(fit(best)), float(best)


@lru_cache(maxsize=256)
def _middle_of(reach: int) -> Vector:
    """Return what multiplies samples in the value of their polynomial in its middle."""
    return np.asarray(scipy.signal.savgol_coeffs(2 * reach + 1, ORDER))


def _reach(width: float, noise: float) -> int:
    """Return the samples on either side of a peak through which a polynomial is fitted; width in samples.

    The error of a fourth-order fit grows with the sixth power of the reach, the variance of its noise falls with the
    reach: their sum is least where the reach grows with the twelfth root of noise² per sample (both in units of the
    pulse's own height and width). So clean signals are fitted narrowly, and noisy ones widely.
    """
    return max(2, round(width * float(np.clip(REACH * (noise**2 / width) ** (1.0 / 12.0), NARROWEST, WIDEST))))
