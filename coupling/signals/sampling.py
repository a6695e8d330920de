"""Even sampling: times through the stamps of a file, lost samples, segments, and channels with times of their own."""

from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from coupling.results.sensor_trace import FEWEST_SAMPLES
from structures.structure import Vector
from structures.units import readable

NEAR = 0.25  # Stamps of samples are whole intervals apart, up to this part of one.
ROUNDED = 0.8  # Stamps with too few digits lie off even times by this part of their last digit.
FEW, FEW_SHARE = 20, 0.01  # So many samples, or this part of all, may be lost.
MENTIONED = 0.02  # Part of an interval by which times may lie off even ones without a word.

UNEVEN = ": times must be evenly spaced, as one sampling rate gives them"

Rows = NDArray[np.int64]


def even_sampling(time: Vector, place: Callable[[int], str]) -> tuple[Vector, Rows, list[str]]:
    """Return the even times through stamps, s; the row of the sample at each, -1 for one that is lost; and what is to
    be said. place: where a row stands in the file, for the ValueError of times that no sampling rate gives."""

    def wrong(row: int, reason: str) -> ValueError:
        before, after = (readable(float(time[k]), "s", 9) for k in (row, row + 1))
        return ValueError(f"{place(row + 1)}: time {after} after {before}{reason}")

    def line(places: Rows) -> Vector:
        """Return the times of all places, on the straight line of least squares through the stamps."""
        middle = places.mean()
        rise = float(((places - middle) @ (time - time.mean())) / ((places - middle) @ (places - middle)))
        return np.asarray(time.mean() + rise * (np.arange(places[-1] + 1) - middle))

    steps = np.diff(time)
    if (steps < 0.0).any() or not steps.any():
        raise wrong(int((steps <= 0.0).argmax()), ", must increase")
    if time.size % 2 == 0 and (time[::2] == time[1::2]).all():
        raise wrong(0, ": each time stands twice; export the trace without peak detection, or with more digits")
    usual = float(np.median(steps)) or float(steps.mean())
    counts = np.round(steps / usual).astype(np.int64)
    odd = (np.abs(steps - counts * usual) > NEAR * usual) | (counts < 1)
    are_few = counts.sum() - counts.size <= max(FEW, FEW_SHARE * time.size)

    # Too few digits: the stamps may be even times that were rounded.
    if odd.any() or not are_few:
        distinct = np.unique(np.round(steps, 15))
        digit = float(min(distinct[distinct > 0.0].min(), np.diff(distinct).min(initial=np.inf)))
        rows: Rows = np.arange(time.size)
        even = line(rows)
        is_rounded = np.abs(even - time).max() <= ROUNDED * max(digit, float(steps.mean()))
        if is_rounded and not (are_few and odd.mean() < MENTIONED):
            apart, digits = readable(float(even[1] - even[0]), "s", 4), readable(digit, "s", 4)
            return (
                even,
                rows,
                [f"stamps of time resolve {digits}, and samples are {apart} apart: even sampling is taken"],
            )
        if not are_few:
            raise wrong(int(counts.argmax()), f": a gap; the usual step is {readable(usual, 's', 4)}")
        at = int(odd.argmax())
        raise wrong(at, ", must increase" if steps[at] == 0.0 else UNEVEN)

    # Whole intervals apart: between samples some may be lost.
    places = np.concatenate([[0], np.cumsum(counts)])
    even = np.linspace(time[0], time[-1], places[-1] + 1)
    if np.abs(even[places] - time).max() > MENTIONED * usual:
        even = line(places)
    off = np.abs(even[places] - time)
    if off.max() > usual:
        raise wrong(int(off.argmax()) - 1, UNEVEN)
    rows = np.full(even.size, -1)
    rows[places] = np.arange(time.size)
    little = f"times lie up to {readable(off.max(), 's', 4)} off even sampling, which is taken"
    return even, rows, [little] if off.max() > MENTIONED * usual else []


def segments(time: Vector) -> list[slice]:
    """Return the rows of each segment of a sequence, where times begin anew; one slice for a usual record."""
    ends = [0, *(1 + np.flatnonzero(np.diff(time) < -0.5 * np.ptp(time))).tolist(), time.size]
    is_sequence = min(np.diff(ends)) >= max(FEWEST_SAMPLES, 0.5 * max(np.diff(ends)))
    return [slice(*pair) for pair in pairwise(ends)] if is_sequence else [slice(0, time.size)]


def on_one_time(what: str, pieces: Mapping[int, tuple[Vector, Vector]]) -> tuple[Vector, dict[int, Vector], list[str]]:
    """Return the period that all records of sensors share, their samples in it, and what is to be said.

    pieces: of each sensor its times, s, and its samples. what: the file or files, for messages.
    """
    times = [time for time, _ in pieces.values()]
    time, step = times[0], float(times[0][1] - times[0][0])
    if all(np.array_equal(time, other) for other in times[1:]):
        return time, {sensor: values for sensor, (_, values) in pieces.items()}, []
    if any(abs(float(other[1] - other[0]) - step) > 1e-3 * step for other in times):
        raise ValueError(f"{what}: hold times of different intervals; read their sensors separately")
    starts, ends = ([float(other[end]) for other in times] for end in (0, -1))
    time = time[(time >= max(starts) - 1e-3 * step) & (time <= min(ends) + 1e-3 * step)]
    if time.size < FEWEST_SAMPLES:
        raise ValueError(f"{what}: hold times that do not overlap; read their sensors separately")
    values, between = dict[int, Vector](), list[str]()
    for sensor, (other, samples) in pieces.items():
        # Whole samples later, or between samples by straight lines.
        shifts = (time[[0, -1]] - other[0]) / float(other[1] - other[0])
        first = round(float(shifts[0]))
        if (np.abs(shifts - np.round(shifts)) < MENTIONED).all() and first + time.size <= samples.size:
            values[sensor] = samples[first : first + time.size]
        else:
            values[sensor] = np.interp(time, other, samples)
            between.append(str(sensor))
    apart, shared = (readable(float(span), "s", 4) for span in (max(starts) - min(starts), time[-1] - time[0]))
    note = f"sensors have times of their own, which begin up to {apart} apart; the {shared} that all hold are read"
    return time, values, [note + f", of sensor {', '.join(between)} by straight lines between samples" * bool(between)]
