"""Compiled loops that find the waves over a bead in the forces of its contacts: plain arrays in SI units, no Dataset.

Peaks are those of `scipy.signal.find_peaks(force, height=least, prominence=least)`, and splines those of
`scipy.interpolate.CubicSpline`, to the last digits. `peaks` says what the results mean.
"""

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from structures.kernels.kernel_cache import inner, njit
from structures.structure import Vector

FIRST_WAVE = 0.05
"""The incident wave rises by at least this part of the greatest force: waves of a heavy striker pile up later."""

TOGETHER = 0.2
"""Contact peaks nearer than this part of their width give no direction."""

FEWEST_CONTACTS = 4
"""A wave passes at least this many contacts; fewer are beads that rattle."""

NEAR_END = 3
"""A wave whose first or last peak is within this many contacts of an end begins or ends there."""

EARLY, LATE, SLACK = 0.55, 1.8, 0.3
"""A wave's next peak comes after this part of the expected time, give or take SLACK of the chain's median one."""

STRONG = 0.05
"""A wave above this part of the incident one is no rattle, however near to the sensor it left another."""

FAINT = 0.5
"""On its way a wave may be lower than the smallest one that is reported by this factor."""

NEAR = 4
"""Samples on either side of a peak through which a cubic spline places it."""

WIDTH = 2 * NEAR + 1
"""Samples through which it is laid."""

NOWHERE, STRUCTURE, CHAIN = 0, 1, 2
"""Where a reflected wave begins; NOWHERE for the incident wave, and where there is no wave."""


def plain(values: Vector) -> Vector:
    """Return an array of the type that all kernels take: for one that cannot be written, as the times of a run are, or
    of another layout, they would be compiled again."""
    if values.dtype == float and values.flags.c_contiguous and values.flags.writeable:
        return values
    return np.array(values, float, order="C")


def _for_python(kernel: Any) -> Any:
    """Return the same kernel for arguments from Python."""
    return njit(cache=True, error_model="numpy")(kernel.py_func)


@inner(error_model="numpy")
def _rises(force, peak, least):
    """Return whether a peak rises by `least` above the lowest force on either side, before a higher one."""
    top = force[peak]
    for step in (-1, 1):
        i = peak
        while 0 <= i < force.size and force[i] <= top and top - force[i] < least:
            i += step
        if not (0 <= i < force.size and force[i] <= top):
            return False
    return True


@inner(error_model="numpy")
def _next_peak(force, start, least):
    """Return the first peak from a sample on, −1 where there is none, and the sample to go on from."""
    last, i = force.size - 1, max(start, 1)
    while i < last:
        if force[i] >= least and force[i - 1] < force[i]:
            ahead = i + 1
            while ahead < last and force[ahead] == force[i]:
                ahead += 1
            if force[ahead] < force[i]:
                peak = (i + ahead - 1) // 2
                if _rises(force, peak, least):
                    return peak, ahead + 1
                i = ahead
        i += 1
    return -1, last


@inner(error_model="numpy")
def _peaks(force, least, out):
    """Put the samples of all peaks into `out`; how many they are."""
    count, goes_on = 0, 0
    while True:
        peak, goes_on = _next_peak(force, goes_on, least)
        if peak < 0:
            return count
        out[count] = peak
        count += 1


peaks_of = _for_python(_peaks)


@inner(error_model="numpy")
def _valley(force, peak, step):
    """Return the lowest force on one side of a peak, before a higher one, and its sample."""
    i, low, base = peak, force[peak], peak
    while 0 <= i < force.size and force[i] <= force[peak]:
        if force[i] < low:
            low, base = force[i], i
        i += step
    return low, base


@inner(error_model="numpy")
def _half_width(force, peak, base, level, step):
    """Return the samples from a peak to where the force falls to a level on one side, interpolated."""
    i = peak
    while i != base and level < force[i]:
        i += step
    part = (level - force[i]) / (force[i - step] - force[i]) if force[i] < level else 0.0
    return abs(i - peak) - part


@inner(error_model="numpy")
def _width(force, peak):
    """Return the width of a peak at half its prominence, in samples."""
    low, base = _valley(force, peak, -1)
    other, end = _valley(force, peak, 1)
    level = force[peak] - 0.5 * (force[peak] - max(low, other))
    return _half_width(force, peak, base, level, -1) + _half_width(force, peak, end, level, 1)


@inner(error_model="numpy")
def _nearest(places, count, to):
    """Return which of the places is nearest to another one."""
    best = 0
    for i in range(1, count):
        if abs(places[i] - to) < abs(places[best] - to):
            best = i
    return best


@inner(error_model="numpy")
def _median(values, ordered):
    """Return the median of the finite values, NaN if there are none; ordered: work space."""
    count = 0
    for value in values:
        if value - value == 0.0:
            i = count
            while i > 0 and ordered[i - 1] > value:
                ordered[i] = ordered[i - 1]
                i -= 1
            ordered[i] = value
            count += 1
    return 0.5 * (ordered[(count - 1) // 2] + ordered[count // 2]) if count else np.nan


@inner(error_model="numpy")
def passages_of(above, below, velocity, least, table, peaks):
    """Put the passages of waves over a bead (start, end, peak, goes_on) into `table`; how many they are.

    peaks: work space, 2 rows of as many integers as there can be peaks.
    """
    first, second = peaks[0], peaks[1]
    firsts, seconds, count = _peaks(above, least, first), _peaks(below, least, second), 0
    if firsts == 0 or seconds == 0:
        return 0
    for i in range(firsts):
        j = _nearest(second, seconds, first[i])
        if _nearest(first, firsts, second[j]) != i:
            continue
        start, end = min(first[i], second[j]), max(first[i], second[j])
        peak = max(0, start - 3)
        for k in range(peak, min(end + 4, above.size)):
            if above[k] + below[k] > above[peak] + below[peak]:
                peak = k
        if 0.5 * (above[peak] + below[peak]) >= least:
            together = end - start < TOGETHER * _width(above, first[i])
            goes_on = velocity[peak] > 0.0 if together else first[i] < second[j]
            table[count, 0], table[count, 1], table[count, 2], table[count, 3] = start, end, peak, goes_on
            count += 1
    return count


passages = _for_python(passages_of)


SPLINE_ROWS = 7
"""Rows of work space of a spline, each as long as its knots are many."""


@inner(error_model="numpy")
def _slopes(work, n):
    """Put the slopes of a spline at its n knots into row 2, from intervals and chords in rows 0 and 1.

    As CubicSpline: bc_type "not-a-knot", tridiagonal elimination without pivots; through three knots a parabola.
    """
    dx, chord, right, lower, diagonal, upper = work[0], work[1], work[2], work[3], work[4], work[5]
    if n == 3:
        bend = (chord[1] - chord[0]) / (dx[0] + dx[1])
        right[0], right[1] = chord[0] - bend * dx[0], chord[0] + bend * dx[0]
        right[2] = chord[1] + bend * dx[1]
        return
    first, last = dx[0] + dx[1], dx[n - 2] + dx[n - 3]
    lower[0], diagonal[0], upper[0] = 0.0, dx[1], first
    right[0] = ((dx[0] + 2.0 * first) * dx[1] * chord[0] + dx[0] * dx[0] * chord[1]) / first
    for i in range(1, n - 1):
        lower[i], diagonal[i], upper[i] = dx[i], 2.0 * (dx[i - 1] + dx[i]), dx[i - 1]
        right[i] = 3.0 * (dx[i] * chord[i - 1] + dx[i - 1] * chord[i])
    lower[n - 1], diagonal[n - 1], upper[n - 1] = last, dx[n - 3], 0.0
    right[n - 1] = dx[n - 2] * dx[n - 2] * chord[n - 3] + (2.0 * last + dx[n - 2]) * dx[n - 3] * chord[n - 2]
    right[n - 1] /= last
    for i in range(1, n):
        factor = lower[i] / diagonal[i - 1]
        diagonal[i] -= factor * upper[i - 1]
        right[i] -= factor * right[i - 1]
    right[n - 1] /= diagonal[n - 1]
    for i in range(n - 2, -1, -1):
        right[i] = (right[i] - upper[i] * right[i + 1]) / diagonal[i]


@inner(error_model="numpy")
def spline_peak_of(time, force, at, step, work):
    """Return the greatest value of a spline through a few samples, and its time, within a step of the sample `at`.

    work: SPLINE_ROWS rows of work space.
    """
    n = time.size
    dx, chord, slope = work[0], work[1], work[2]
    for i in range(n - 1):
        dx[i] = time[i + 1] - time[i]
        chord[i] = (force[i + 1] - force[i]) / dx[i]
    _slopes(work, n)
    best, where, is_set = force[at], time[at], False
    for i in range(n - 1):
        t = (slope[i] + slope[i + 1] - 2.0 * chord[i]) / dx[i]
        c, b = t / dx[i], (chord[i] - slope[i]) / dx[i] - t
        squared = 4.0 * b * b - 12.0 * c * slope[i]
        if squared < 0.0:
            continue
        # Of the two roots the one that does not cancel is found first.
        q = -b - 0.5 * sqrt(squared) if b >= 0.0 else -b + 0.5 * sqrt(squared)
        for which in range(2):
            root = slope[i] / q if which else q / (3.0 * c)
            x = time[i] + root
            if root >= 0.0 and x <= time[i + 1] and abs(x - time[at]) <= step:
                s = x - time[i]
                value = force[i] + slope[i] * s + b * (s * s) + c * (s * s * s)
                if not is_set or value > best:
                    best, where, is_set = value, x, True
    return best, where


spline_peak = _for_python(spline_peak_of)


@inner(error_model="numpy")
def _arrival(time, above, below, peak, work):
    """Return the amplitude and time of the peak of the force at a bead's centre, the mean of its two contacts'."""
    begin, end, mean = max(0, peak - NEAR), min(time.size, peak + NEAR + 1), work[SPLINE_ROWS - 1]
    for i in range(begin, end):
        mean[i - begin] = 0.5 * (above[i] + below[i])
    return spline_peak_of(time[begin:end], mean, peak - begin, time[1] - time[0], work)


@inner(error_model="numpy")
def incident(time, above, below, velocity, passages, peaks, work):
    """Return the incident wave over a bead: amplitude (N), arrival (s), and its last sample, −1 where there is none."""
    top = 0.0
    for i in range(time.size):
        top = max(top, 0.5 * (above[i] + below[i]))
    if top > 0.0:
        for i in range(passages_of(above, below, velocity, FIRST_WAVE * top, passages, peaks)):
            if passages[i, 3]:
                amplitude, arrival = _arrival(time, above, below, passages[i, 2], work)
                return amplitude, arrival, passages[i, 1]
    return 0.0, 0.0, -1


@inner(error_model="numpy")
def waves_over_bead(time, above, below, velocity, smallest, out, passages, peaks, work):
    """Return `waves` from the contacts of the bead alone, which do not say where a wave begins; with work space."""
    amplitude, arrival, end = incident(time, above, below, velocity, passages, peaks, work)
    if end < 0:
        return 0
    out[0, 0], out[0, 1], out[0, 2], count = amplitude, arrival, NOWHERE, 1
    for i in range(passages_of(above, below, velocity, smallest * amplitude, passages, peaks)):
        if passages[i, 0] > end and not passages[i, 3] and count < len(out):
            out[count, 0], out[count, 1] = _arrival(time, above, below, passages[i, 2], work)
            out[count, 2] = STRUCTURE
            count += 1
    return count


@inner(error_model="numpy")
def hops_of(time, force, taken, ordered):
    """Put the time of the incident wave from each contact to the next, s, into `taken`; see `peaks.hops`.

    ordered: work space of as many numbers; so it is of the others.
    """
    before = np.nan
    for row in range(len(force)):
        top, arrival = 0.0, np.nan
        for value in force[row]:
            if value > top:
                top = value
        if top > 0.0:
            peak, _ = _next_peak(force[row], 0, FIRST_WAVE * top)
            if peak >= 0:
                arrival = time[peak]
        if row > 0:
            taken[row - 1] = arrival - before
        before = arrival
    usual = _median(taken, ordered)
    for i in range(taken.size):
        hop = taken[i]
        if hop - hop != 0.0 or (i == taken.size - 1 and usual < hop):
            hop = usual
        taken[i] = SLACK * usual if hop < SLACK * usual else hop


hops = _for_python(hops_of)


@inner(error_model="numpy")
def trace_back_of(times, begins, taken, row, now, left, pace, first, path, ordered):
    """Put the peaks (s) that a wave left in the rows after `row` into `path`; how many. See `peaks.traced`.

    times: the peaks of all rows; those of row i are times[begins[i]:begins[i + 1]].
    """
    count, slack = 0, SLACK * _median(taken, ordered)
    while row + 2 < begins.size:
        wait, best, before = pace * taken[row], np.inf, np.nan
        for i in range(begins[row + 1], begins[row + 2]):
            early = now - times[i]
            if EARLY * wait - slack < early < LATE * wait + slack and abs(early - wait) < best:
                best, before = abs(early - wait), times[i]
        if best == np.inf:
            break
        path[count] = before
        count, now, row = count + 1, before, row + 1
        travel = 0.0
        for i in range(first, row):
            travel += taken[i]
        pace = max((left - now) / travel, EARLY * pace)
    return count


trace_back = _for_python(trace_back_of)


class Space(NamedTuple):
    """Work space of `waves`, for m peaks in each of n contacts."""

    found: Any
    """m × 4 integers, passages."""
    peaks: Any
    """2 × m integers."""
    spline: Any
    """SPLINE_ROWS × WIDTH."""
    times: Any
    """n m numbers, the peaks of all contacts, one after the other, s."""
    begins: Any
    """n + 1 integers: where those of each contact begin."""
    taken: Any
    """n."""
    path: Any
    """n."""
    ordered: Any
    """n."""


@inner(error_model="numpy")
def _peak_times(time, force, least, space):
    """Put the peaks of each row, s, one row after the other, and where each row begins, into the work space."""
    peaks = space.peaks[0]
    for row in range(len(force)):
        count, begin = _peaks(force[row], least, peaks), space.begins[row]
        space.begins[row + 1] = begin + count
        for i in range(count):
            space.times[begin + i] = time[peaks[i]]


@inner(error_model="numpy")
def waves(time, force, velocity, smallest, out, space):
    """Put the incident wave and those that come back into `out` (amplitude, N; arrival, s; where it begins); how many.

    force: contacts × time. It ends where `out` is full.
    """
    passages, peaks, work, rows = space.found, space.peaks, space.spline, len(force)
    above, below = force[0], force[1]
    if rows == 2:
        return waves_over_bead(time, above, below, velocity, smallest, out, passages, peaks, work)
    first, arrival, end = incident(time, above, below, velocity, passages, peaks, work)
    if end < 0:
        return 0
    out[0, 0], out[0, 1], out[0, 2] = first, arrival, NOWHERE
    many, count, last = passages_of(above, below, velocity, smallest * first, passages, peaks), 1, rows - 1
    taken, is_known = space.taken[: rows - 1], False
    for i in range(many):
        if passages[i, 0] <= end or passages[i, 3] or count == len(out):
            continue
        if not is_known:
            is_known = True
            hops_of(time, force, taken, space.ordered)
            _peak_times(time, force, FAINT * smallest * first, space)
        amplitude, arrival = _arrival(time, above, below, passages[i, 2], work)
        pace, left = (first / amplitude) ** (1.0 / 6.0), time[passages[i, 1]]
        now = time[passages[i, 0]]
        pace = min(max((left - now) / taken[0], EARLY * pace), LATE * pace)
        reached = 1 + trace_back_of(
            space.times, space.begins[: rows + 1], taken, 1, now, left, pace, 0, space.path, space.ordered
        )
        from_structure = reached > last - NEAR_END
        if from_structure or reached + 1 >= FEWEST_CONTACTS or amplitude >= STRONG * first:
            out[count, 0], out[count, 1] = amplitude, arrival
            out[count, 2] = STRUCTURE if from_structure else CHAIN
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def waves_of_many(time, force, static, velocity, smallest, out, counts):
    """Return `waves` of many runs; force: runs × time × contacts, static: runs × contacts, velocity: runs × time.

    Contacts that hold only NaN are left out; they pad a shorter chain, or a run that failed. out: runs × waves × 3.
    """
    n, most = force.shape[2], time.size // 2 + 1
    dynamic = np.empty((n, time.size))
    space = Space(
        np.empty((most, 4), np.int64), np.empty((2, most), np.int64), np.empty((SPLINE_ROWS, WIDTH)),
        np.empty(n * most), np.zeros(n + 1, np.int64), np.empty(n), np.empty(n), np.empty(n),
    )  # fmt: skip
    for run in range(len(force)):
        rows = 0
        for contact in range(force.shape[2]):
            there = False
            for i in range(time.size):
                dynamic[rows, i] = force[run, i, contact] - static[run, contact]
                there = there or dynamic[rows, i] == dynamic[rows, i]
            rows += there
        counts[run] = waves(time, dynamic[:rows], velocity[run], smallest, out[run], space) if rows > 1 else 0
