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

Rows = NDArray[np.int64]


def even_sampling(time: Vector, place: Callable[[int], str]) -> tuple[Vector, Rows, list[str]]:
    """Return the even times through stamps, s; the row of the sample at each, -1 for one that is lost; and what is to
    be said. place: where a row stands in the file, for the ValueError of times that no sampling rate gives."""

    def wrong(row: int, reason: str) -> ValueError:
        before, after = (readable(float(time[k]), "s", 9) for k in (row, row + 1))
        return ValueError(f"{place(row + 1)}: time {after} after {before}{reason}")

    steps = np.diff(time)
    if (steps < 0.0).any() or not steps.any():
        raise wrong(int((steps <= 0.0).argmax()), ", must increase")
    if time.size % 2 == 0 and (time[::2] == time[1::2]).all():
        raise wrong(0, ": each time stands twice; export the trace without peak detection, or with more digits")
    usual = float(np.median(steps)) or float(steps.mean())
    counts = np.round(steps / usual).astype(np.int64)
    odd = (np.abs(steps - counts * usual) > NEAR * usual) | (counts < 1)
    are_few = counts.sum() - counts.size <= max(FEW, FEW_SHARE * time.size)

    # Where many steps are odd, the stamps may be even times that were rounded; else samples may be lost between them.
    is_rounded = odd.mean() >= MENTIONED or not are_few
    places: Rows = np.arange(time.size) if is_rounded else np.concatenate([[0], np.cumsum(counts)])
    even = np.linspace(time[0], time[-1], places[-1] + 1)
    if is_rounded or np.abs(even[places] - time).max() > MENTIONED * usual:
        even = np.polyval(np.polyfit(places, time, 1), np.arange(even.size))
    off = np.abs(even[places] - time)
    most = ROUNDED * max(float(steps[steps > 0.0].min()), float(steps.mean()))
    if off.max() > most or (odd.any() and not is_rounded):
        if not are_few:
            raise wrong(int(counts.argmax()), f": a gap; the usual step is {readable(usual, 's', 4)}")
        at = int((odd if odd.any() else off[1:]).argmax())
        evenly = ": times must be evenly spaced, as one sampling rate gives them"
        raise wrong(at, ", must increase" if steps[at] == 0.0 else evenly)
    rows = np.full(even.size, -1)
    rows[places] = np.arange(time.size)
    apart, far = (readable(float(span), "s", 4) for span in (even[1] - even[0], off.max()))
    note = f"times lie up to {far} off even sampling, a sample every {apart}, which is taken"
    return even, rows, [note] if off.max() > MENTIONED * usual else []


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

    # Whole samples later, or between samples by straight lines.
    values, between = dict[int, Vector](), list[str]()
    for sensor, (other, samples) in pieces.items():
        places = np.interp(time, other, np.arange(other.size))
        if np.abs(places - np.round(places)).max() < MENTIONED:
            places = np.round(places)
        else:
            between.append(str(sensor))
        values[sensor] = np.interp(places, np.arange(other.size), samples)
    apart, shared = (readable(float(span), "s", 4) for span in (max(starts) - min(starts), time[-1] - time[0]))
    note = f"sensors have times of their own, which begin up to {apart} apart; the {shared} that all hold are read"
    return time, values, [note + f", of sensor {', '.join(between)} by straight lines between samples" * bool(between)]
