"""The channels of files: each is brought to even times and SI units, and several channels to one time."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupling.results.sensor_trace import FEWEST_SAMPLES
from coupling.signals.heads import FORCE, TIME, WHAT, Unit, read_unit
from structures.checks import count_of
from structures.structure import Vector
from structures.units import readable

NEAR = 0.25  # Time stamps are whole intervals apart, up to this part of an interval.
ROUNDED = 0.8  # Stamps with too few digits may differ from even times by this part of their last digit.
FEW, FEW_SHARE = 20, 0.01  # This many samples, or this part of all, may be lost.
MENTIONED = 0.02  # Part of an interval by which times may differ from even ones without a note.
SEGMENTS = "; write one file for each segment or tap"


class Sampling(NamedTuple):
    """The arguments of `read_signal` that describe a file. None: the file itself decides."""

    time_column: int | None = None
    time_unit: str | None = None
    unit: str | None = None
    interval: float | None = None
    start: float | None = None
    skip: int = 0


class Channel(NamedTuple):
    """A column of a text, or a channel of another file."""

    name: str
    values: Vector  # the samples, NaN for missing ones
    unit: Unit
    time: Vector | None  # of the samples; None if the file holds no times
    time_unit: Unit = Unit()
    lines: Any = None  # the line of each sample in a text
    words: tuple[str, ...] = ()  # the words in a text in place of missing samples


class Recording(NamedTuple):
    """The content of a file."""

    kind: str  # of file, in words
    channels: dict[int, Channel]  # by number
    notes: list[str]  # what was left out or assumed


def even(
    path: Path, recording: Recording, number: int, asked: Sampling, name: str
) -> tuple[Vector, Vector, str, list[str]]:
    """Return the even times of a channel, s; its values, NaN for missing samples; their SI unit; and notes. name: the
    name of the sensor in messages. A ValueError names the line."""
    if number not in recording.channels:
        held = ", ".join(f"{k} ({one.name})" for k, one in [*recording.channels.items()][:3])
        raise ValueError(f"{path}: has channels {held} …, counted from 1, and no channel {number}")
    channel, said = recording.channels[number], list[str]()
    present = np.isfinite(channel.values)
    words = ", ".join(map(repr, channel.words[:3]))

    def in_unit(stated: Unit, kind: tuple[str, ...], given: str | None, what: str, argument: str) -> Unit:
        """Return the unit that the user gives, or else the file, or else the SI unit."""
        if given is not None:
            unit = read_unit(given, kind)
            if stated.text and stated[1:] != unit[1:]:
                said.append(f"the file gives {stated.text!r} for {what}; {given!r} is used")
            return unit
        if stated.text and not stated.si:
            raise ValueError(
                f"{path}: gives {stated.text!r} for {what}, which is not a unit of {WHAT[kind]}; give {argument}="
            )
        return stated if stated.text else Unit(kind[0], kind[0])

    def place(row: int) -> str:
        return f"sample {row + 1}" if channel.lines is None else f"line {channel.lines[row]}"

    unit = in_unit(channel.unit, FORCE, asked.unit, f"column {number}", "unit")
    if (count := int(present.sum())) < max(FEWEST_SAMPLES, 0.5 * present.size):
        such = words and f", but text such as {channel.words[0]!r}"
        raise ValueError(f"{path}: {name}: only {count} of {present.size} samples are within the scope's range{such}")
    if unit.si == "V" and unit.size == 1.0 and (channel.values[present] % 1.0 == 0.0).all():
        doubt = "are they a digitiser's counts? Then calibration is N per count"
        said.append(f"{name}: all values are whole numbers of V; {doubt}")

    if asked.interval is not None:
        rows = np.arange(present.size)
        time = (asked.start or 0.0) + asked.interval * rows.astype(float)
    elif channel.time is None:
        raise ValueError(f"{path}: holds no times of its samples; give interval=, s, such as 5e-7")
    elif not asked.time_unit and not channel.time_unit.text and (np.diff(channel.time) == 1.0).all():
        raise ValueError(
            f"{path}: the times count the samples, or their unit is missing; give time_unit=, the time_column of the "
            "time, or interval=, s"
        )
    else:
        seconds = in_unit(channel.time_unit, TIME, asked.time_unit, f"the times of column {number}", "time_unit")
        stamps = seconds.size * channel.time
        time, rows, notes = even_sampling(stamps, lambda row: f"{path}, {place(row)}")
        time = time + (0.0 if asked.start is None else asked.start - time[0])
        said += notes

    # Missing samples at the ends are left out later, if all sensors lack them.
    values = np.where(rows >= 0, unit.size * channel.values[rows], np.nan)
    first, last = np.flatnonzero(np.isfinite(values))[[0, -1]]
    gaps = first + np.flatnonzero(~np.isfinite(values[first:last]))
    if gaps.size:
        missing = count_of(gaps.size, "sample is", "samples are") + " lost or beyond the scope's range, and NaN"
        after = place(int(rows[gaps[0] - 1]))
        said.append(f"{name}: {missing}{words and f': {words}'}, the first after {after}")
    return time, values, unit.si, said


def even_sampling(time: Vector, place: Callable[[int], str]) -> tuple[Vector, NDArray[np.int64], list[str]]:
    """Return the even times through time stamps, s; the row of the sample at each, -1 for a lost one; and notes.
    place: gives the place of a row in the file, for the ValueError if stamps do not fit one sampling rate."""

    def wrong(row: int, reason: str) -> ValueError:
        before, after = (readable(float(time[k]), "s", 9) for k in (row, row + 1))
        return ValueError(f"{place(row + 1)}: time {after} after {before}{reason}")

    steps = np.diff(time)
    if (steps < 0.0).any() or not steps.any():
        raise wrong(int((steps <= 0.0).argmax()), f", must increase{SEGMENTS}")
    if time.size % 2 == 0 and (time[::2] == time[1::2]).all():
        raise wrong(0, ": each time appears twice; export the trace without peak detection, or with more digits")
    usual = float(np.median(steps)) or float(steps.mean())
    counts = np.round(steps / usual).astype(np.int64)
    odd = (np.abs(steps - counts * usual) > NEAR * usual) | (counts < 1)
    are_few = counts.sum() - counts.size <= max(FEW, FEW_SHARE * time.size)

    # If many steps are odd, the stamps may be rounded even times; otherwise samples may be lost between them.
    is_rounded = odd.mean() >= MENTIONED or not are_few
    places = np.arange(time.size) if is_rounded else np.concatenate([[0], np.cumsum(counts)])
    even = np.linspace(time[0], time[-1], places[-1] + 1)
    if is_rounded or np.abs(even[places] - time).max() > MENTIONED * usual:
        even = np.polyval(np.polyfit(places, time, 1), np.arange(even.size))
    off = np.abs(even[places] - time)
    most = ROUNDED * max(float(steps[steps > 0.0].min()), float(steps.mean()))
    if off.max() > most or (odd.any() and not is_rounded):
        if not are_few:
            raise wrong(int(counts.argmax()), f": a gap; the usual step is {readable(usual, 's', 4)}{SEGMENTS}")
        at = int((odd if odd.any() else off[1:]).argmax())
        evenly = ": times must be evenly spaced, as one sampling rate gives them"
        raise wrong(at, ", must increase" if steps[at] == 0.0 else evenly)
    rows = np.full(even.size, -1)
    rows[places] = np.arange(time.size)
    apart, far = (readable(float(span), "s", 4) for span in (even[1] - even[0], off.max()))
    note = f"times differ by up to {far} from even sampling, a sample every {apart}, which is used"
    return even, rows, [note] if off.max() > MENTIONED * usual else []


def on_one_time(what: str, pieces: Mapping[int, tuple[Vector, Vector]]) -> tuple[Vector, dict[int, Vector], list[str]]:
    """Return the times that all records of sensors share, their samples at these, and notes. pieces: times, s, and
    samples of each sensor. what: the file or files, for messages."""
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

    # Records that are shifted by whole samples are copied, others are interpolated linearly.
    values = dict[int, Vector]()
    for sensor, (other, samples) in pieces.items():
        places = np.interp(time, other, np.arange(other.size))
        whole = np.round(places)
        is_whole = np.abs(places - whole).max() < MENTIONED
        values[sensor] = np.interp(whole if is_whole else places, np.arange(other.size), samples)
    apart, shared = (readable(float(span), "s", 4) for span in (max(starts) - min(starts), time[-1] - time[0]))
    note = f"sensors have times of their own, which begin up to {apart} apart; the {shared} that all hold are read"
    return time, values, [note]
