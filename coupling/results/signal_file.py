"""The trace of an oscilloscope's file: evenly sampled columns in SI units, and what was left out or assumed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupling.results.binary_files import Recording, read_recording
from coupling.results.binary_formats import Reader, format_of
from coupling.results.sampling import Even, Rows, Unsampled, at_interval, even_sampling, is_of_pairs, segments
from coupling.results.sensor_trace import FEWEST_SAMPLES, interpolated_over_gaps
from coupling.results.text_file import HUGE, LONGEST_LINE, Samples, ScopeFile, from_first
from coupling.results.text_header import FORCE, OTHER, TIME, Header, Unit, quantity_of
from structures.checks import count_of
from structures.structure import Vector
from structures.units import readable

NAMED = 3
"""Lines that a message names."""

SAME = 0.02
"""Intervals of the header and of the time column differ by less than this part."""

MOST_COLUMNS = 64
"""Columns of a text that are looked at, where none are named."""

FEWEST_SHARE = 0.5
"""A column holds at least this part of numbers."""

PREFIXES = {1e-3: "ms", 1e-6: "us", 1e-9: "ns"}
"""Units of time that scopes use without saying so."""


WHOLE_VOLTS = "all values are whole numbers of V; are they a digitiser's counts? Then calibration is N per count"


class Sampling(NamedTuple):
    """The times of samples: a column (None: the usual one), its unit, or the interval and the start, s; segment."""

    column: int | None = None
    unit: str | None = None
    interval: float | None = None
    start: float | None = None
    segment: int | None = None


class Trace(NamedTuple):
    """Times, s; by sensor the columns in SI units, NaN where a sample is missing, and their units; what is to be said;
    and what the file calls the columns."""

    time: Vector
    columns: dict[int, Vector]
    units: dict[int, str]
    notes: list[str]
    names: dict[int, str]


TEXT = "a text"

MOST_CHARACTERS = 100_000
"""The longest line of a text."""


class Opened(NamedTuple):
    """What a file is, its recording, or its text."""

    kind: str
    recording: Recording | None
    text: bytes


def open_trace(path: Path, segment: int | None = None) -> Opened:
    """Return what a file holds, one segment of it. A ValueError that names the file and the way out."""
    content = path.read_bytes()
    kind, reader = format_of(path, content) or (TEXT, "")
    if kind == TEXT and (long := [k for k, line in enumerate(content.splitlines(), 1) if len(line) > MOST_CHARACTERS]):
        raise ValueError(f"{path}, line {long[0]}: has more than {MOST_CHARACTERS} characters; write a sample on each")
    if not isinstance(reader, Reader):
        return Opened(kind, None, content)
    recording = read_recording(path, kind, reader, segment or 1)
    return Opened(kind, None if recording.text else recording, recording.text)


def columns_of(path: Path, opened: Opened) -> list[int]:
    """Return the numbers of the columns that may be sensors: channels, or the columns of a text that are no times."""
    if opened.recording is not None:
        return [*range(1, len(opened.recording.channels) + 1)]
    reason: ValueError | None = None
    for first in (1, 0, *range(2, MOST_COLUMNS)):
        try:
            file = ScopeFile(path, [first], opened.text)
        except ValueError as error:
            reason = reason or error
            continue
        return [column for column in range(min(file.width, MOST_COLUMNS)) if column not in file.increasing]
    assert reason is not None
    raise reason


def read_trace(
    path: Path, column_of: Mapping[int, int], sampling: Sampling, unit: str | None, opened: Opened | None = None
) -> Trace:
    """Return the columns of sensors of a file. A ValueError that names the file, the line and the way out."""
    _, recording, content = opened or open_trace(path, sampling.segment)
    if recording is not None:
        return _of_recording(path, recording, column_of, sampling, unit)
    columns = [*column_of.values()]
    explicit = [] if sampling.column is None else [sampling.column]
    file = ScopeFile(path, [*explicit, *columns], content)
    time_of = _time_columns(file, column_of, sampling)
    times = sorted({column for column in time_of.values() if column is not None})
    samples = file.samples([*times, *columns], times)
    unit_of = {sensor: _unit(path, samples.header, column, FORCE, unit) for sensor, column in column_of.items()}
    notes = [*_left_out(samples), *_counted(samples)]
    pieces = {}
    for column in dict.fromkeys(time_of.values()):
        in_column = {sensor: samples.columns[column_of[sensor]] for sensor, its in time_of.items() if its == column}
        if column is None:
            piece = _by_interval(path, samples, sampling)
        else:
            piece, in_column = _by_column(path, file, samples, column, sampling, in_column)
        notes += [note for note in piece.notes if note not in notes]
        pieces[column] = piece.time, {n: unit_of[n].size * _at_rows(row, piece.rows) for n, row in in_column.items()}
    time, values = on_one_time(f"{path}: columns {[*pieces]}", pieces, notes)
    for sensor, column in column_of.items():
        notes += _missing(file, samples, sensor, column, values[sensor])
    names = {sensor: samples.header.name(column) for sensor, column in column_of.items()}
    return _trimmed(Trace(time, values, {s: unit.si for s, unit in unit_of.items()}, notes, names))


def _at_rows(values: Vector, rows: Rows) -> Vector:
    """Return the values in some rows; NaN for a sample that is lost."""
    return np.where(rows >= 0, values[np.maximum(rows, 0)], np.nan)


def _trimmed(trace: Trace) -> Trace:
    """Return a trace without samples at its ends that no sensor has, and doubts about its unit."""
    notes, size = [*trace.notes], trace.time.size
    present: NDArray[np.bool_] = np.any(np.isfinite(np.stack([*trace.columns.values()])), axis=0)
    first, last = int(present.argmax()), size - int(present[::-1].argmax())
    if first or last < size:
        ends = {"first": first, "last": size - last}
        empty = " and ".join(f"the {end} {count}" for end, count in ends.items() if count)
        notes.append(f"samples without values, {empty}, were left out")
    columns = {sensor: column[first:last] for sensor, column in trace.columns.items()}
    for sensor, unit in trace.units.items():
        values = columns[sensor][np.isfinite(columns[sensor])]
        if unit == "V" and (values == np.round(values)).all():
            notes.append(f"sensor {sensor}: {WHOLE_VOLTS}")
    return trace._replace(time=trace.time[first:last], columns=columns, notes=notes)


def _of_recording(
    path: Path, recording: Recording, column_of: Mapping[int, int], sampling: Sampling, unit: str | None
) -> Trace:
    """Return the channels of sensors, counted from 1, of a file that is no text."""
    if sampling.column is not None:
        raise ValueError(f"time_column = {sampling.column}: is for text; {path} states its times, or give interval=")
    _check_segment(path, sampling.segment, recording.segments)
    notes, units = [*recording.notes], dict[int, str]()
    pieces: dict[int | None, tuple[Vector, dict[int, Vector]]] = {}
    for sensor, column in column_of.items():
        if not 1 <= column <= len(recording.channels):
            names = ", ".join(f"{k} ({c.name})" for k, c in enumerate(recording.channels[:NAMED], 1))
            more = f" … {len(recording.channels)}" if len(recording.channels) > NAMED else ""
            raise ValueError(f"{path}: has channels {names}{more}, counted from 1, and no channel {column}")
        channel = recording.channels[column - 1]
        values: Vector = np.where(np.abs(channel.values) < HUGE, channel.values, np.nan)
        count = int(np.isfinite(values).sum())
        if count < max(FEWEST_SAMPLES, FEWEST_SHARE * values.size):
            raise ValueError(f"{path}: sensor {sensor}: only {count} of {values.size} samples are numbers")
        name = channel.name if channel.is_head else "channel"
        header = Header([[channel.name_of_time, f"{name} ({channel.unit})" if channel.unit else name]], [], 2)
        its_unit = _unit(path, header, 1, FORCE, unit)
        units[sensor], even = its_unit.si, _times(path, channel.time, header, values.size, sampling)
        pieces[column] = even.time, {sensor: its_unit.size * _at_rows(values, even.rows)}
        notes += [note for note in even.notes if note not in notes]
        if lost := int((~np.isfinite(pieces[column][1][sensor])).sum()):
            notes.append(f"sensor {sensor}: {count_of(lost, 'sample is', 'samples are')} missing, and NaN")
    time, rows = on_one_time(f"{path}: columns {[*pieces]}", pieces, notes)
    names_of = {sensor: recording.channels[column - 1].name for sensor, column in column_of.items()}
    return _trimmed(Trace(time, rows, units, notes, names_of))


def _times(path: Path, time: Vector | None, header: Header, count: int, sampling: Sampling) -> Even:
    """Return the even times of a channel: those of the file, or from the interval that the user gives."""
    start = sampling.start
    if sampling.interval is not None:
        return at_interval(start or 0.0, sampling.interval, count)
    if time is None:
        raise ValueError(f"{path}: states no times and no interval; give interval=, s, such as 5e-7")
    unit = _unit(path, header, 0, TIME, sampling.unit)
    try:
        even = even_sampling(time, unit.size)
    except Unsampled as error:
        raise ValueError(f"{path}, sample {error.row + 1}: {error}") from None
    seconds = unit.size * even.time
    return even._replace(time=seconds if start is None else seconds + (start - seconds[0]))


def _check_segment(path: Path, segment: int | None, count: int) -> None:
    """Raise a ValueError where a file of several segments is read without one, or has no such segment."""
    if segment is None and count > 1:
        raise ValueError(
            f"{path}: holds {count} segments, whose times begin anew; read each with segment=1 to {count} (hertzlink "
            f"signal: --segment), such as average_taps([read_signal(…, segment=k) for k in range(1, {count + 1})])"
        )
    if segment is not None and segment > count:
        raise ValueError(f"{path}: segment = {segment!r}: must be at most {count}, the number of segments")


def _time_columns(file: ScopeFile, column_of: Mapping[int, int], sampling: Sampling) -> dict[int, int | None]:
    """Return the column of times of each sensor: the nearest one to its left that increases; None where there is
    none."""
    increasing = file.increasing
    swapped = [column for column in column_of.values() if column in increasing]
    if swapped:
        raise ValueError(
            f"{file.path}: column {swapped[0]} increases from line to line, as a time does: are the columns swapped? "
            "sensors = {bead: column}, counted from 0; the time is time_column"
        )
    if sampling.interval is not None or sampling.column is not None:
        return dict.fromkeys(column_of, None if sampling.interval is not None else sampling.column)
    time_column_of: dict[int, int | None] = {}
    for sensor, column in column_of.items():
        left = [c for c in increasing if c < column] or increasing[:1]
        time_column_of[sensor] = left[-1] if left else (None if 0 in column_of.values() or file.states_interval else 0)
    return time_column_of


def _by_interval(path: Path, samples: Samples, sampling: Sampling) -> Even:
    """Return the times from an interval, of the user or of the header."""
    interval, notes = sampling.interval, list[str]()
    if interval is None:
        interval, first, notes = _interval_and_start(path, samples.header)
    else:
        first, notes = 0.0, _differing(samples.header, interval, f"interval = {readable(interval, 's', 4)} is given")
    if interval is None:
        raise ValueError(
            f"{path}: holds no column of times, and no interval in its header; give interval=, s, such as 5e-7"
        )
    start = first if sampling.start is None else sampling.start
    return at_interval(start, interval, samples.lines.size)._replace(notes=notes)


def _interval_and_start(path: Path, header: Header) -> tuple[float | None, float, list[str]]:
    """Return the interval and the time of the first sample, s, that a header states, and what is to be said.

    A ValueError where entries of an interval are not understood, or differ. A start that is not understood only shifts
    the record.
    """
    intervals, starts = header.intervals(), header.starts()
    values = [entry.value for entry in intervals if entry.value is not None]
    unclear = [entry for entry in intervals if entry.value is None][:1]
    if unclear or any(abs(value / values[0] - 1.0) > SAME for value in values):
        texts = " and ".join(f"{entry.name} = {entry.text!r}" for entry in unclear or intervals)
        what = "is no interval that is understood" if unclear else "are different intervals between samples"
        raise ValueError(f"{path}: the header's {texts} {what}; give interval=, s, such as 5e-7")
    first = next((entry.value for entry in starts if entry.value is not None), 0.0)
    notes = [
        f"the header's {entry.name} = {entry.text!r} is not taken: the record begins at {readable(first, 's', 4)}"
        for entry in starts
        if entry.value != first and entry.text
    ]
    return values[0] if values else None, first, notes


def _differing(header: Header, interval: float, instead: str) -> list[str]:
    """Return what is to be said of each interval that the header states otherwise, or that is not understood."""
    return [
        f"the header's {entry.name} = {entry.text!r} is no interval that is understood"
        if entry.value is None
        else f"the header states an interval of {readable(entry.value, 's', 4)} ({entry.name}), but {instead}"
        for entry in header.intervals()
        if entry.text and (entry.value is None or abs(entry.value / interval - 1.0) > SAME)
    ]


def _by_column(
    path: Path, file: ScopeFile, samples: Samples, column: int, sampling: Sampling, values: dict[int, Vector]
) -> tuple[Even, dict[int, Vector]]:
    """Return the times from a column."""
    time, notes = samples.columns[column], []
    finite = np.isfinite(time)
    steps = np.diff(time[finite])
    if np.spacing(np.abs(time[finite]).max()) > 1e-3 * abs(float(np.median(steps))) > 0.0:
        time, first = from_first(file.plain(file.texts(column, samples.places)), finite)
        notes.append(f"times count from the first sample, {first.strip()}")
    header, stated = samples.header, samples.header.unit(column, TIME)
    rows = np.arange(time.size)
    parts = segments(time)
    _check_segment(path, sampling.segment, len(parts))
    if sampling.segment is not None:
        rows = rows[parts[sampling.segment - 1]]
    if is_of_pairs(time[rows], [row[rows] for row in values.values()]):
        values = {sensor: _means(row, rows) for sensor, row in values.items()}
        rows = rows[::2]
        notes.append("each time stands twice, with the least and the greatest value; their mean is taken")
    intervals = header.intervals()
    counts = bool(intervals) and stated is None and bool((np.diff(time[finite]) == 1.0).all())
    is_counter = counts or (stated is None and header.counts_samples(column))
    unit = _unit(path, header, column, TIME, sampling.unit)
    try:
        even = even_sampling(time[rows], None if is_counter else unit.size)
    except Unsampled as error:
        line = samples.lines[rows[error.row]]
        raise ValueError(f"{path}, line {line}: {error}") from None
    second = 1.0
    if counts:
        interval, start, more = _interval_and_start(path, header)
        assert interval is not None
        before = even.time[0] if header.starts() else 0.0
        even, notes = even._replace(time=start + interval * (even.time - before)), [*notes, *more]
    elif is_counter:
        raise ValueError(
            f"{path}: column {column} counts samples; give time_column, the column of the time, or interval=, s"
        )
    else:
        second, more = _checked_second(float(even.time[1] - even.time[0]), unit, header, stated or sampling.unit)
        notes += more
    misfits = [f"line {samples.lines[rows[row]]}" for row in even.left_out[:NAMED].tolist()]
    if misfits:
        notes.append(
            f"{count_of(even.left_out.size, 'time does', 'times do')} not fit the others, and their samples were left "
            f"out: {', '.join(misfits)}"
        )
    lost = int((even.rows < 0).sum())
    if lost:
        at = int((even.rows < 0).argmax())
        before = samples.lines[rows[even.rows[at - 1]]]
        notes.append(f"{count_of(lost, 'sample is', 'samples are')} lost and NaN, the first after line {before}")
    rows_of = np.where(even.rows >= 0, rows[np.maximum(even.rows, 0)], -1)
    time = second * even.time
    if sampling.start is not None:
        time = time + (sampling.start - time[0])
    return Even(time, rows_of, even.left_out, [*notes, *even.notes]), values


def _means(values: Vector, rows: Rows) -> Vector:
    """Return the column with the mean of each pair in the place of its first."""
    means = values.copy()
    means[rows[::2]] = 0.5 * (values[rows[::2]] + values[rows[1::2]])
    return means


def _checked_second(step: float, unit: Unit, header: Header, stated: object) -> tuple[float, list[str]]:
    """Return the size of the time column's unit, s, which the header's intervals confirm, and what is to be said."""
    size, notes = unit.size, list[str]()
    intervals = [entry.value for entry in header.intervals() if entry.value is not None]
    if stated is None and intervals and not any(abs(interval / (step * size) - 1.0) < SAME for interval in intervals):
        fitting = [prefix for prefix in PREFIXES if abs(intervals[0] / (step * prefix) - 1.0) < SAME]
        if fitting:
            size = fitting[0]
            notes = [
                f"the time is read in {PREFIXES[size]}, from the header's interval, {readable(intervals[0], 's', 4)}"
            ]
    return size, [*notes, *_differing(header, step * size, f"the times are {readable(step * size, 's', 4)} apart")]


def _unit(path: Path, header: Header, column: int, wanted: str, stated_unit: str | None) -> Unit:
    """Return the unit of a column, from the header or as stated; a ValueError where these differ or do not fit."""
    stated = header.unit(column, wanted)
    name = "time_unit" if wanted == TIME else "unit"
    unit = quantity_of(stated_unit, wanted) if stated_unit is not None else None
    if stated is None:
        default = quantity_of("s" if wanted == TIME else "V", wanted)
        assert default is not None
        return unit or default
    if stated.quantity == wanted:
        if unit is not None and unit.of_table != stated.of_table:
            raise ValueError(
                f"{path}: {name} = {stated_unit!r}, but the header gives {stated.text!r} for column {column}; leave "
                f"{name} out to use that, or correct the header"
            )
        return stated
    if unit is not None and stated.quantity not in (TIME, FORCE, OTHER):
        return unit
    kind = "a time" if wanted == TIME else "a voltage or a force"
    cure = (
        f"give {name}="
        if stated.quantity not in (TIME, FORCE, OTHER)
        else "convert the column, or correct the header if the scope was set wrongly"
    )
    raise ValueError(
        f"{path}: the header gives {stated.text!r} for column {column}, which is no unit of {kind}; {cure}"
    )


def _left_out(samples: Samples) -> list[str]:
    """Return the lines that are no samples, in words."""
    said = []
    if samples.blank:
        said.append(count_of(samples.blank, "blank line was left out", "blank lines were left out"))
    if samples.no_samples:
        shown = ", ".join(f"line {i} {text[:LONGEST_LINE]!r}" for i, text in samples.no_samples[:NAMED])
        more = len(samples.no_samples) - NAMED
        shown += f" and {more} more" if more > 0 else ""
        are = "line is no sample, and was left out", "lines are no samples, and were left out"
        said.append(f"{count_of(len(samples.no_samples), *are)}: {shown}")
    return said


def _counted(samples: Samples) -> list[str]:
    """Return a file that holds fewer or more samples than its header states."""
    stated = samples.header.count()
    held = samples.lines.size
    if stated is None or stated < FEWEST_SAMPLES or held % stated == 0 or abs(held - stated) <= 1:
        return []
    return [f"the header states {stated} samples, and {held} are in the file: was it cut off?"]


def _missing(file: ScopeFile, samples: Samples, sensor: int, column: int, values: Vector) -> list[str]:
    """Return the samples that are no numbers, in words; raise a ValueError where these are most."""
    where = f"{file.path}: sensor {sensor}"
    count = int(np.isfinite(values).sum())
    bad = np.flatnonzero(~np.isfinite(samples.columns[column]))
    words = [*dict.fromkeys(cell.strip() or "an empty cell" for cell in file.texts(column, samples.places[bad]))]
    if count < max(FEWEST_SAMPLES, FEWEST_SHARE * values.size):
        such = f", but text such as {words[0]!r}" if words else ""
        raise ValueError(f"{where}: only {count} of {values.size} samples are within the scope's range{such}")
    inside = np.isfinite(interpolated_over_gaps(values))
    ends = np.flatnonzero(np.isfinite(values))
    lost = int((~np.isfinite(values[ends[0] : ends[-1] + 1])).sum())
    if not lost or not words or not inside.any():
        return []
    samples_are = count_of(lost, "sample is", "samples are")
    return [
        f"sensor {sensor}: {samples_are} beyond the scope's range or missing, and NaN: "
        f"{', '.join(map(repr, words[:NAMED]))} from line {samples.lines[bad[0]]} on"
    ]


def on_one_time(
    what: str, pieces: Mapping[Any, tuple[Vector, dict[int, Vector]]], notes: list[str]
) -> tuple[Vector, dict[int, Vector]]:
    """Return the columns over one time: those with times of their own are taken where all overlap. what: in messages,
    the pieces."""
    every = [*pieces.values()]
    time = every[0][0]
    if len(every) == 1 or all(np.array_equal(time, other) for other, _ in every[1:]):
        return time, {sensor: row for _, rows in every for sensor, row in rows.items()}
    step = float(time[1] - time[0])
    if any(abs(float(other[1] - other[0]) - step) > 1e-3 * step for other, _ in every):
        raise ValueError(f"{what} hold times of different intervals; read their sensors separately")
    first = max(float(other[0]) for other, _ in every)
    last = min(float(other[-1]) for other, _ in every)
    inside = (time >= first - 1e-3 * step) & (time <= last + 1e-3 * step)
    if inside.sum() < FEWEST_SAMPLES:
        raise ValueError(f"{what} hold times that do not overlap; read their sensors separately")
    time = time[inside]
    between = [f"{sensor}" for other, rows in every if _is_between(time, other) for sensor in rows]
    notes.append(
        "sensors have times of their own, which begin up to "
        f"{readable(first - min(float(o[0]) for o, _ in every), 's', 4)} apart; "
        f"the {readable(float(time[-1] - time[0]), 's', 4)} that all hold are read"
        + (f", of sensor {', '.join(between)} by straight lines between samples" if between else "")
    )
    return time, {sensor: _at(time, other, row) for other, rows in every for sensor, row in rows.items()}


def _is_between(time: Vector, other: Vector) -> bool:
    """Return whether times lie between those of another column, or run off them."""
    shifts = (time[[0, -1]] - other[0]) / float(other[1] - other[0])
    return bool((np.abs(shifts - np.round(shifts)) >= SAME).any())


def _at(time: Vector, other: Vector, row: Vector) -> Vector:
    """Return a column at times of another column: whole samples later, or between samples by a straight line."""
    first = round(float(time[0] - other[0]) / float(other[1] - other[0]))
    if not _is_between(time, other) and first + time.size <= row.size:
        return row[first : first + time.size]
    return np.asarray(np.interp(time, other, row))
