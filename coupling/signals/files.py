"""Channels of files, evenly sampled and in SI units, with what was left out or assumed on the way."""

from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

import numpy as np

from coupling.results.sensor_trace import FEWEST_SAMPLES
from coupling.signals.heads import FORCE, TIME, WHAT, NotUnderstood, Unit, unit_named
from coupling.signals.recordings import Recording, kind_of_file, read_recording, workbook_text
from coupling.signals.sampling import Even, Uneven, even_sampling, segments
from coupling.signals.text import read_text
from structures.checks import count_of
from structures.structure import Vector

MOST_BYTES = 2_000_000_000

WHOLE_VOLTS = "all values are whole numbers of V; are they a digitiser's counts? Then calibration is N per count"


class Sampling(NamedTuple):
    """What a user says of a file: the column of the times, the units of these and of the columns, the interval between
    samples and the time of the first one, s; the segment; and how many lines to skip. None: as the file says."""

    column: int | None = None
    time_unit: str | None = None
    unit: str | None = None
    interval: float | None = None
    start: float | None = None
    segment: int | None = None
    skip: int = 0


class Trace(NamedTuple):
    """A channel in SI units over even times, s; NaN where a sample is missing; and what is to be said."""

    time: Vector
    values: Vector
    unit: str
    notes: list[str]


def opened(path: Path, columns: Collection[int] | None, sampling: Sampling) -> Recording:
    """Return the columns of a file, or all channels where `columns` is None."""
    if path.stat().st_size > MOST_BYTES:
        raise ValueError(f"{path}: is larger than {MOST_BYTES:.2g} bytes; cut it")
    content = path.read_bytes()
    kind = kind_of_file(content)
    if kind is not None and kind[0] == "an Excel workbook":
        kind, content = None, workbook_text(path)
    if kind is None:
        return read_text(path, content, columns, sampling.column, sampling.interval is None, sampling.skip)
    if sampling.column is not None:
        raise ValueError(f"time_column = {sampling.column}: is for text; {path} states its times, or give interval=")
    return read_recording(path, *kind)


def sampled(path: Path, recording: Recording, number: int, sampling: Sampling, name: str) -> Trace:
    """Return a channel over even times. name: of the sensor, in messages. A ValueError names the line."""
    if number not in recording.channels:
        held = ", ".join(f"{k} ({channel.name})" for k, channel in [*recording.channels.items()][:3])
        raise ValueError(f"{path}: has channels {held} …, counted from 1, and no channel {number}")
    channel = recording.channels[number]
    unit, notes = _unit(path, channel.unit, FORCE, sampling.unit, f"column {number}")
    values = unit.size * channel.values
    if int(np.isfinite(values).sum()) < max(FEWEST_SAMPLES, 0.5 * values.size):
        such = f", but text such as {channel.words[0]!r}" if channel.words else ""
        count = int(np.isfinite(values).sum())
        raise ValueError(f"{path}: {name}: only {count} of {values.size} samples are within the scope's range{such}")
    even = _times(path, recording, number, sampling, notes)
    values = np.where(even.rows >= 0, values[np.maximum(even.rows, 0)], np.nan)
    if lost := int((even.rows < 0).sum()):
        at = int(even.rows[int((even.rows < 0).argmax()) - 1])
        place = f"sample {at + 1}" if channel.lines is None else f"line {channel.lines[at]}"
        notes.append(f"{count_of(lost, 'sample is', 'samples are')} lost and NaN, the first after {place}")
    ends = np.flatnonzero(np.isfinite(values))[[0, -1]]
    bad = ~np.isfinite(values[ends[0] : ends[1]]) & (even.rows[ends[0] : ends[1]] >= 0)
    if bad.any():
        row = even.rows[ends[0] + int(bad.argmax())]
        words = f": {', '.join(map(repr, channel.words[:3]))}" if channel.words else ""
        place = f"sample {row + 1}" if channel.lines is None else f"line {channel.lines[row]}"
        missing = count_of(int(bad.sum()), "sample is", "samples are")
        notes.append(f"{name}: {missing} beyond the scope's range or missing, and NaN{words} from {place} on")
    if unit.si == "V" and (channel.values == np.round(channel.values))[np.isfinite(channel.values)].all():
        notes.append(f"{name}: {WHOLE_VOLTS}")
    return Trace(even.time, values, unit.si, notes)


def _times(path: Path, recording: Recording, number: int, sampling: Sampling, notes: list[str]) -> Even:
    """Return the even times of a channel; what is to be said is added to the notes."""
    channel = recording.channels[number]
    count, start = channel.values.size, sampling.start
    if sampling.interval is not None:
        return Even((start or 0.0) + sampling.interval * np.arange(count, dtype=float), np.arange(count), [])
    if channel.time is None:
        says = f"; its head says {recording.on_sampling!r}" if recording.on_sampling else ""
        raise ValueError(f"{path}: holds no times of its samples{says}; give interval=, s, such as 5e-7")
    if sampling.time_unit is None and channel.time_unit is None and (np.diff(channel.time) == 1.0).all():
        raise ValueError(
            f"{path}: the times count the samples, or their unit is missing; give time_unit=, the time_column of the "
            "time, or interval=, s"
        )
    unit, said = _unit(path, channel.time_unit, TIME, sampling.time_unit, f"the times of column {number}")
    time = unit.size * channel.time
    parts = segments(time)
    if sampling.segment is None and len(parts) > 1:
        raise ValueError(
            f"{path}: holds {len(parts)} segments, whose times begin anew; read each with segment=1 to {len(parts)} "
            f"(hertzlink signal: --segment), such as average_taps([read_signal(…, segment=k) for k in range(1, "
            f"{len(parts) + 1})])"
        )
    if sampling.segment is not None and sampling.segment > len(parts):
        raise ValueError(f"{path}: segment = {sampling.segment}: must be at most {len(parts)}, the number of segments")
    part = parts[(sampling.segment or 1) - 1]
    try:
        even = even_sampling(time[part])
    except Uneven as error:
        row = part.start + error.row
        place = f"sample {row + 1}" if channel.lines is None else f"line {channel.lines[row]}"
        raise ValueError(f"{path}, {place}: {error}") from None
    notes += [*said, *even.notes]
    shift = 0.0 if start is None else start - float(even.time[0])
    return Even(even.time + shift, np.where(even.rows >= 0, even.rows + part.start, -1), [])


def _unit(
    path: Path, stated: Unit | NotUnderstood | None, kind: tuple[str, ...], given: str | None, what: str
) -> tuple[Unit, list[str]]:
    """Return the unit that the user gives, or else the file, or else the SI unit; and what is to be said."""
    if given is not None:
        unit = unit_named(given, kind)
        assert unit is not None
        differs = stated is not None and (isinstance(stated, NotUnderstood) or stated[1:] != unit[1:])
        return unit, [f"the file gives {stated.text!r} for {what}; {given!r} is taken"] if stated and differs else []
    if isinstance(stated, NotUnderstood):
        argument = "time_unit" if kind == TIME else "unit"
        raise ValueError(
            f"{path}: gives {stated.text!r} for {what}, which is no unit of {WHAT[kind]}; give {argument}="
        )
    return stated or Unit(kind[0], kind[0], 1.0), []
