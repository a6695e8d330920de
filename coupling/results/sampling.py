"""Even sampling from the time stamps of a file: few digits, lost and doubled samples, segments, pairs of extremes."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupling.results.sensor_trace import FEWEST_SAMPLES
from structures.checks import count_of
from structures.structure import Vector
from structures.units import readable

NEAR = 0.25
"""Stamps of samples that follow each other differ by one interval, up to this part of it."""

UNEVEN = 1.0
"""Intervals that a time may lie off even ones."""

SAID = 0.02
"""Stamps that lie off even times by more intervals than this are mentioned."""

FEW, FEW_SHARE = 20, 0.01
"""So many samples, or this part of all, may be lost."""

FAR = 0.2
"""A time that lies off the others by this part of the record is damaged, such as 1e3 among 1e-3."""

Rows = NDArray[np.int64]


class Even(NamedTuple):
    """Even times, the row of each (-1 for a lost sample), rows that are no samples, and what is to be said."""

    time: Vector
    rows: Rows
    left_out: Rows
    notes: list[str]


class Unsampled(ValueError):
    """Times that no sampling rate gives; row: where."""

    def __init__(self, row: int, reason: str) -> None:
        super().__init__(reason)
        self.row = row


def at_interval(start: float, interval: float, count: int) -> Even:
    """Return the times of `count` samples from a start on, s."""
    rows = np.arange(count)
    return Even(start + interval * rows.astype(float), rows, rows[:0], [])


def even_sampling(time: Vector, second: float | None = 1.0) -> Even:
    """Return the even times from stamps, which may be NaN; raises Unsampled.

    second: the size of the stamps' unit, s, for messages; None for a counter.
    """
    rows = np.flatnonzero(np.isfinite(time))
    if rows.size < FEWEST_SAMPLES:
        raise Unsampled(0, f"holds {count_of(rows.size, 'time')}, must hold {FEWEST_SAMPLES} or more")
    if (coarse := _coarse(time, rows, second)) is not None:
        return coarse
    regular = _without_misfits(time, rows, second)
    steps = np.diff(time[regular])
    usual = float(np.median(steps))
    counts = np.maximum(np.round(steps / usual), 1.0).astype(np.int64)
    lost = counts - 1
    if lost.sum() > max(FEW, FEW_SHARE * regular.size):
        at = int(lost.argmax())
        gap = f"{_after(time, regular, at, second)}: a gap; the usual step is {_shown(usual, second)}"
        raise Unsampled(int(regular[at + 1]), gap)
    places = np.concatenate(([0], np.cumsum(counts)))
    even, off = _line(places, time[regular], int(places[-1]) + 1)
    if off.max() > UNEVEN * usual:
        raise Unsampled(int(regular[off.argmax()]), "times must be evenly spaced, as one sampling rate gives them")
    rows_of = np.full(even.size, -1)
    rows_of[places] = regular
    notes = []
    if off.max() > SAID * usual:
        notes.append(f"times lie up to {_shown(float(off.max()), second)} off even sampling, which is taken")
    return Even(even, rows_of, np.setdiff1d(rows, regular, assume_unique=True), notes)


def segments(time: Vector) -> list[slice]:
    """Return the rows of each segment of a sequence, where times begin anew; one slice for a usual record."""
    finite = np.flatnonzero(np.isfinite(time))
    if finite.size < 2 * FEWEST_SAMPLES:
        return [slice(0, time.size)]
    steps = np.diff(time[finite])
    back = finite[1:][steps < -0.5 * np.ptp(time[finite])]
    ends = [0, *back.tolist(), time.size]
    lengths = np.diff(ends)
    if lengths.min() < max(FEWEST_SAMPLES, 0.5 * lengths.max()):
        return [slice(0, time.size)]
    return [slice(first, end) for first, end in pairwise(ends)]


def is_of_pairs(time: Vector, columns: list[Vector]) -> bool:
    """Return whether each time stands twice, with the least and the greatest value."""
    if time.size % 2 or time.size < 2 * FEWEST_SAMPLES or not (time[::2] == time[1::2]).all():
        return False
    if not (np.diff(time[::2]) > 0.0).all():
        return False
    rises = [column[1::2] - column[::2] for column in columns]
    return all((rise[np.isfinite(rise)] >= 0.0).all() or (rise[np.isfinite(rise)] <= 0.0).all() for rise in rises)


def _coarse(time: Vector, rows: Rows, second: float | None) -> Even | None:
    """Return even times where several samples have the same stamp, because it has too few digits; None elsewhere."""
    steps = np.diff(time[rows])
    if not (steps == 0.0).sum() > max(FEW, FEW_SHARE * steps.size) or (steps < 0.0).any() or not (steps > 0.0).any():
        return None
    digit = float(np.median(steps[steps > 0.0]))
    even, off = _line(rows, time[rows], time.size, straight=True)
    step = float(even[1] - even[0])
    if not step > 0.0:
        return None
    if off.max() > 1.01 * max(digit, step):
        at = int(off.argmax())
        raise Unsampled(int(rows[at]), "times must be evenly spaced, as one sampling rate gives them")
    text = (
        f"stamps of time resolve {_shown(digit, second)}, and samples are {_shown(step, second)} apart: "
        "even sampling is taken"
    )
    return Even(even, np.arange(time.size), np.array([], dtype=np.int64), [text])


def _without_misfits(time: Vector, rows: Rows, second: float | None) -> Rows:
    """Return the rows whose times increase, without single ones far off; raises Unsampled where these are many."""
    steps = np.diff(time[rows])
    third = rows.size // 3
    usual = float(np.median(time[rows[-third:]]) - np.median(time[rows[:third]])) / (rows.size - third)
    if usual > 0.0:
        order = np.arange(rows.size)
        off = time[rows] - usual * order
        rows_kept = rows[np.abs(off - np.median(off)) <= usual * max(FEW, FAR * rows.size)]
        rows_kept = _without_spikes(time, rows_kept, usual)
    else:
        rows_kept = rows
    if rows_kept.size:
        highest = np.maximum.accumulate(time[rows_kept])
        rows_kept = rows_kept[np.concatenate(([True], time[rows_kept][1:] > highest[:-1]))]
    if rows.size - rows_kept.size > max(FEW, FEW_SHARE * rows.size) or rows_kept.size < FEWEST_SAMPLES:
        wrong = np.flatnonzero(steps <= 0.0)
        at = int(wrong[0]) if wrong.size else int(np.abs(steps - usual).argmax())
        reason = "must increase" if wrong.size else "must be evenly spaced, as one sampling rate gives them"
        raise Unsampled(int(rows[at + 1]), f"{_after(time, rows, at, second)}, {reason}")
    return rows_kept


def _without_spikes(time: Vector, rows: Rows, usual: float) -> Rows:
    """Return rows without single ones off an even step from both neighbours, which are two steps apart."""
    if rows.size < FEWEST_SAMPLES:
        return rows
    t = time[rows]
    normal = np.abs(np.diff(t) - usual) <= NEAR * usual
    across = np.abs(t[2:] - t[:-2] - 2.0 * usual) <= NEAR * usual
    inside = ~normal[:-1] & ~normal[1:] & across
    return rows[~np.concatenate(([False], inside, [False]))]


def _line(places: Rows, time: Vector, count: int, straight: bool = False) -> tuple[Vector, Vector]:
    """Return the even times through stamps, and how far off each stamp is."""
    even = np.linspace(time[0], time[0] + (time[-1] - time[0]) * (count - 1) / max(1, places[-1] - places[0]), count)
    off = np.abs(time - even[places])
    if straight or off.max() > SAID * (even[1] - even[0]):
        middle = places.mean()
        rise = float(((places - middle) @ (time - time.mean())) / ((places - middle) @ (places - middle)))
        even = time.mean() + rise * (np.arange(count) - middle)
        off = np.abs(time - even[places])
    return even, off


def _after(time: Vector, rows: Rows, at: int, second: float | None) -> str:
    before, after = (_shown(float(time[rows[i]]), second, 9) for i in (at, at + 1))
    return f"time {after} after {before}"


def _shown(stamp: float, second: float | None, digits: int = 4) -> str:
    return f"{stamp:.{digits}g}" if second is None else readable(second * stamp, "s", digits)
