"""Waves in forces: those of a run, whose two contacts give a direction, and those of a measured signal with noise.

Waves are given as (amplitude, arrival) in N and s, the incident one first, then those that came back.
A wave that came back is followed from the sensor towards the structure, contact by contact: beads that rattle make
small peaks too, but none that runs. The incident wave is the clock: what follows it takes about as long from contact to
contact, the weaker the longer.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.polynomial import Polynomial

from coupling.results.sensor import noise_level, resolution, smoothed
from structures.structure import Vector

FIRST_WAVE = 0.05
"""The incident wave rises by at least this part of the greatest force: waves of a heavy striker pile up later."""

TOGETHER = 0.2
"""Contact peaks nearer than this part of their width give no direction."""

ORDER = 4
"""The top of a pulse is fitted by a polynomial of this order."""

CLEAR = 8.0
"""A wave in a signal rises by this many standard deviations of the noise that smoothing leaves, and by more than one
step of the digitiser: from valley to peak, the greatest of a thousand noises reaches 6.5."""

REACH, NARROWEST, WIDEST = 2.0, 0.02, 0.7
"""It is fitted over ± REACH (noise² / samples)^(1/12) of its width at half height, within these limits: `_reach`. At
the least two samples on either side: a cubic spline through a run's samples reads no more."""

FEWEST_CONTACTS = 4
"""A wave passes at least so many contacts; fewer are beads that rattle."""

NEAR_END = 3
"""A wave whose first or last peak is within so many contacts of an end begins or ends there."""

EARLY, LATE, SLACK = 0.55, 1.8, 0.3
"""A wave's next peak comes after this part of the expected time, give or take SLACK of the chain's median one."""

STRONG = 0.05
"""A wave above this part of the incident one is no rattle, however near to the sensor it left another."""

FAINT = 0.5
"""On its way a wave may be lower than the smallest one that is reported by this factor."""

Peak = tuple[float, float]


class Passage(NamedTuple):
    """A wave over a bead, in samples: its first and last contact peak, the peak of the mean, and whether it goes on."""

    start: int
    end: int
    peak: int
    goes_on: bool


def incident_passage(above: Vector, below: Vector, velocity: Vector) -> Passage | None:
    """The first wave that goes on over a bead, from the dynamic forces of its two contacts."""
    top = (0.5 * (above + below)).max(initial=0.0)
    forward = [p for p in _passages(above, below, velocity, FIRST_WAVE * top) if p.goes_on] if top > 0.0 else []
    return forward[0] if forward else None


def waves_of_run(time: Vector, force: Vector, velocity: Vector, smallest: float) -> tuple[list[Peak], list[str]]:
    """The incident wave over a bead and those that come back, and where each of these begins.

    force, contacts × time: the dynamic forces of the bead's two contacts, and of those beyond them as far as they are
    known, the structure's last. A wave begins at the "structure", or in the "chain" where waves have met.
    """
    first = incident_passage(force[0], force[1], velocity)
    if first is None:
        return [], []
    incident = _arrival(time, force, first)
    later = [p for p in _passages(force[0], force[1], velocity, smallest * incident[0]) if p.start > first.end]
    path, waves, origins = _WayBack(time, force, FAINT * smallest * incident[0]), [incident], []
    for passage in later:
        if passage.goes_on:
            continue
        wave = _arrival(time, force, passage)
        contacts, begins = path.follow(passage, (incident[0] / wave[0]) ** (1.0 / 6.0))
        if begins == "structure" or contacts >= FEWEST_CONTACTS or wave[0] >= STRONG * incident[0]:
            waves.append(wave)
            origins.append(begins)
    return waves, origins


def hops(time: Vector, force: Vector) -> Vector:
    """The time of the incident wave from each contact to the next, s; force: contacts × time.

    A soft structure delays it at the last contact, and beads that move as one pass it on at once. Neither is the time
    of another wave; the median limits both.
    """
    arrivals = np.full(len(force), np.nan)
    for row, series in enumerate(force):
        least = FIRST_WAVE * series.max(initial=0.0)
        peaks = scipy.signal.find_peaks(series, height=least, prominence=least)[0] if least > 0.0 else []
        if len(peaks):
            arrivals[row] = time[peaks[0]]
    taken = np.diff(arrivals)
    usual = np.nanmedian(taken) if np.isfinite(taken).any() else np.nan
    taken = np.where(np.isfinite(taken), taken, usual)
    taken[-1] = min(taken[-1], usual)
    return np.maximum(taken, SLACK * usual)


class _WayBack:
    """The contacts between a bead and the structure, with the peaks that waves left in them."""

    def __init__(self, time: Vector, force: Vector, least: float) -> None:
        self.time, self.force, self.least = time, force, least
        self.hops = hops(time, force)
        self.peaks: dict[int, Vector] = {}

    def follow(self, passage: Passage, pace: float) -> tuple[int, str]:
        """The contacts that the wave of a passage came through, and where it begins.

        pace: its time from contact to contact, in units of that of the incident wave.
        """
        last, left = len(self.force) - 1, self.time[passage.end]
        pace = float(np.clip((left - self.time[passage.start]) / self.hops[0], EARLY * pace, LATE * pace))
        path = traced([self._peaks(row) for row in range(last + 1)], self.hops, 1, self.time[passage.start], left, pace)
        reached = 1 + len(path)
        return reached + 1, "structure" if reached > last - NEAR_END else "chain"

    def _peaks(self, row: int) -> Vector:
        if row not in self.peaks:
            self.peaks[row] = self.time[
                scipy.signal.find_peaks(self.force[row], height=self.least, prominence=self.least)[0]
            ]
        return self.peaks[row]


def traced(
    peaks: list[Vector], hops: Vector, row: int, now: float, left: float, pace: float, first: int = 0
) -> list[float]:
    """The peaks (s) that a wave left in the rows after `row`, the latest first, where it came that way.

    peaks: of each row, s; now: that of `row`; left: when it left the row `first`; pace: its time from row to row, in
    units of `hops`.
    """
    path, slack = [], SLACK * float(np.median(hops))
    while row + 1 < len(peaks):
        before = next_peak(peaks[row + 1], now, -pace * hops[row], slack)
        if before is None:
            break
        path.append(before)
        now, row = before, row + 1
        pace = max((left - now) / float(hops[first:row].sum()), EARLY * pace)
    return path


def next_peak(peaks: Vector, time: float, wait: float, slack: float) -> float | None:
    """Of the peaks (s) the one that comes most nearly `wait` after `time`, before it where that is negative."""
    late = (peaks - time) * np.sign(wait)
    fitting = (late > EARLY * abs(wait) - slack) & (late < LATE * abs(wait) + slack)
    near = np.abs(late - abs(wait))
    return float(peaks[fitting][near[fitting].argmin()]) if fitting.any() else None


def _arrival(time: Vector, force: Vector, passage: Passage) -> Peak:
    """Amplitude and time of the peak of the force at a bead's centre, the mean of its two contacts' (rows 0 and 1)."""
    return interpolated(time, 0.5 * (force[0] + force[1]), passage.peak)


def waves_of_signal(time: Vector, force: Vector, smallest: float) -> list[Peak]:
    """The first wave of a signal, and all later ones, whichever way they go.

    Waves are looked for in the signal smoothed over an eighth of a pulse, must rise clear of the noise that this leaves
    and of one step of the digitiser, and are then placed by a least-squares polynomial through the samples as they are.
    """
    smooth, noise, _ = smoothed(force)
    floor = CLEAR * noise + resolution(force)
    least = max(FIRST_WAVE * smooth.max(initial=0.0), floor)
    first = scipy.signal.find_peaks(smooth, height=least, prominence=least)[0]
    if not (least > 0.0 and first.size):
        return []
    least = max(smallest * _fitted(time, force, smooth, *_valleys(smooth, first)[0])[0], floor)
    later = scipy.signal.find_peaks(smooth, height=least, prominence=least)[0]
    peaks = np.append(first[0], later[later > first[0]])
    return [_fitted(time, force, smooth, *place) for place in _valleys(smooth, peaks)]


def _valleys(force: Vector, peaks: Vector) -> list[tuple[int, tuple[int, int]]]:
    """Each peak with the lowest samples before and after it, between it and its neighbours or the ends."""
    edges = [0, *map(int, peaks), force.size - 1]
    lowest = [one + int(force[one : other + 1].argmin()) for one, other in pairwise(edges)]
    return [(int(peak), valleys) for peak, valleys in zip(peaks, pairwise(lowest), strict=True)]


def interpolated(time: Vector, force: Vector, peak: int) -> Peak:
    """Amplitude and time of the peak of a cubic spline through the samples around a sampled peak."""
    from scipy.interpolate import CubicSpline

    near = slice(max(0, peak - 4), peak + 5)
    spline = CubicSpline(time[near], force[near])
    inside = [t for t in spline.derivative().roots(extrapolate=False) if abs(t - time[peak]) <= time[1] - time[0]]
    best = max(inside, key=spline, default=time[peak])
    return float(spline(best)), float(best)


def _fitted(time: Vector, force: Vector, smooth: Vector, peak: int, between: tuple[int, int]) -> Peak:
    """Amplitude and time of the top of a polynomial through the samples around a peak of the smoothed signal.

    The smoothed signal has its peak elsewhere where a pulse is lopsided or has two humps. So polynomials over the same
    reach first slide along the upper half of the pulse, between its two valleys; the one that is highest in its middle
    is taken.
    """
    width, step = float(scipy.signal.peak_widths(smooth, [peak], rel_height=0.5)[0][0]), time[1] - time[0]
    reach = _reach(width, noise_level(force) / smooth[peak])
    half = max(1, round(0.5 * width))
    first, last = max(between[0], peak - half), min(between[1], peak + half) + 1
    start, stop = max(0, first - reach), min(force.size, last + reach)
    if stop - start > 2 * reach:
        moving = scipy.signal.savgol_filter(force[start:stop], 2 * reach + 1, ORDER)
        peak = first + int(moving[first - start : last - start].argmax())
    near = slice(max(0, peak - reach), peak + reach + 1)
    fit = Polynomial.fit(time[near], force[near], min(ORDER, time[near].size - 1))
    tops = [t.real for t in fit.deriv().roots() if abs(t.imag) < step and abs(t - time[peak]) <= 0.5 * reach * step]
    best = max(tops, key=fit, default=time[peak])
    return float(fit(best)), float(best)


def _reach(width: float, noise: float) -> int:
    """Samples on either side of a peak through which a polynomial is fitted; width in samples.

    The error of a fourth-order fit grows with the sixth power of the reach, the variance of its noise falls with the
    reach: their sum is least where the reach grows with the twelfth root of noise² per sample (both in units of the
    pulse's own height and width). So clean signals are fitted narrowly, and noisy ones widely.
    """
    return max(2, round(width * float(np.clip(REACH * (noise**2 / width) ** (1.0 / 12.0), NARROWEST, WIDEST))))


def _passages(above: Vector, below: Vector, velocity: Vector, least: float) -> list[Passage]:
    """Waves over a bead in order of time.

    A wave is a peak in each contact force, each the other's nearest; the contact that it passes first gives its
    direction. Between beads that have drifted apart a weak wave is two collisions, and still one wave. Where a bead
    moves as one with a neighbour, as in a dimer, both contacts peak together; then its velocity gives the direction.
    """
    peaks = [scipy.signal.find_peaks(force, height=least, prominence=least)[0] for force in (above, below)]
    if not (peaks[0].size and peaks[1].size):
        return []
    apart = np.abs(peaks[0][:, None] - peaks[1][None, :])
    nearest_below, nearest_above = apart.argmin(axis=1), apart.argmin(axis=0)
    widths = scipy.signal.peak_widths(above, peaks[0])[0]
    force, found = above + below, []
    for i, first in enumerate(peaks[0]):
        other = int(peaks[1][nearest_below[i]])
        if nearest_above[nearest_below[i]] != i:
            continue
        start, end = sorted((int(first), other))
        begin = max(0, start - 3)
        peak = begin + int(force[begin : end + 4].argmax())
        together = end - start < TOGETHER * widths[i]
        goes_on = bool(velocity[peak] > 0.0) if together else bool(first < other)
        if 0.5 * force[peak] >= least:
            found.append(Passage(start, end, peak, goes_on))
    return found
