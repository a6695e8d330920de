"""Channels of files, evenly sampled and in SI units, with what was left out or assumed on the way."""

from collections.abc import Collection
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from coupling.results.sensor_trace import FEWEST_SAMPLES
from coupling.signals import recordings
from coupling.signals.heads import FORCE, TIME, WHAT, Unit, read_unit
from coupling.signals.recordings import Channel, Recording, Sampling
from coupling.signals.sampling import Rows, even_sampling, segments
from coupling.signals.text import read_text
from structures.checks import count_of
from structures.structure import Vector

MOST_CHANNELS = 256
MOST_BYTES = 50_000_000  # of a text

# Kinds of files: with what the content begins, and at which byte.
KINDS: tuple[tuple[int, bytes, str, Any], ...] = (
    (0, b"TDSm", "a TDMS file of LabVIEW", recordings.tdms),
    (0, b"MATLAB 5.0", "a file of MATLAB (.mat)", recordings.matlab),
    (0, b"\x89HDF", "an HDF5 file", recordings.hdf5),
    (512, b"\x89HDF", "an HDF5 file", recordings.hdf5),
)


def opened(path: Path, columns: Collection[int] | None, sampling: Sampling) -> Recording:
    """Return the columns of a text, all where `columns` is None, or the channels of a recorder's file, from 1 on."""
    with open(path, "rb") as file:
        head = file.read(2048)
    kind, reader = next(
        ((kind, reader) for at, start, kind, reader in KINDS if head[at:].startswith(start)), ("", None)
    )
    if head.startswith(b"PK\x03\x04"):
        names = recordings.tried(path, "a zip archive", lambda path: ZipFile(path).namelist())
        kind = "a zip archive"
        if any(name.endswith(".npy") for name in names):
            kind, reader = "arrays of numpy (.npz)", recordings.numpy_arrays
        elif any(name.startswith("xl/") for name in names):
            kind, reader = "an Excel workbook", recordings.workbook
    # Text has few control characters; in UTF-16, which begins with a mark, each second byte may be zero.
    is_utf_16 = head[:2] in (b"\xff\xfe", b"\xfe\xff")
    controls = sum(byte < 32 and byte not in b"\t\n\r\f\x1a" for byte in head)
    if not kind and controls <= (0.6 if is_utf_16 else 0.02) * len(head):
        if path.stat().st_size > MOST_BYTES:
            raise ValueError(f"{path}: is a text of more than {MOST_BYTES:.2g} bytes; cut it, or save arrays (.npz)")
        kind, reader = "a text", Path.read_bytes
    if reader is None:
        raise ValueError(
            f"{path}: is {kind or 'a binary file'}, not a text of samples; export the trace as CSV, or read it as "
            "docs/signals.md says and give time (s) and force (N) to hertzlink.as_signal"
        )

    content: bytes | list[Channel] = recordings.tried(path, kind, reader)
    if isinstance(content, bytes):
        return read_text(path, content, columns, sampling)
    if sampling.time_column is not None:
        raise ValueError(
            f"time_column = {sampling.time_column}: is for text; {path} states its times, or give interval="
        )
    if not content:
        raise ValueError(f"{path}: is {kind} without arrays of {FEWEST_SAMPLES} or more numbers")
    return Recording(kind, dict(enumerate(content[:MOST_CHANNELS], 1)), [])


def sampled(
    path: Path, recording: Recording, number: int, sampling: Sampling, name: str
) -> tuple[Vector, Vector, str, list[str]]:
    """Return the even times of a channel, s; its values, NaN where a sample is missing; their SI unit; and what is to
    be said. name: of the sensor, in messages. A ValueError names the line."""
    if number not in recording.channels:
        held = ", ".join(f"{k} ({channel.name})" for k, channel in [*recording.channels.items()][:3])
        raise ValueError(f"{path}: has channels {held} …, counted from 1, and no channel {number}")
    channel = recording.channels[number]
    unit, notes = _unit(path, channel.unit, FORCE, sampling.unit, f"column {number}")
    values, present = unit.size * channel.values, np.isfinite(channel.values)
    if (count := int(present.sum())) < max(FEWEST_SAMPLES, 0.5 * values.size):
        such = f", but text such as {channel.words[0]!r}" if channel.words else ""
        raise ValueError(f"{path}: {name}: only {count} of {values.size} samples are within the scope's range{such}")
    if unit.si == "V" and (channel.values[present] % 1.0 == 0.0).all():
        notes.append(
            f"{name}: all values are whole numbers of V; are they a digitiser's counts? Then calibration is N per count"
        )

    # Samples without values at the ends are left out later, where all sensors have none.
    time, rows, said = _times(path, channel, number, sampling)
    values = np.where(rows >= 0, values[rows], np.nan)
    first, last = np.flatnonzero(np.isfinite(values))[[0, -1]]
    gaps = first + np.flatnonzero(~np.isfinite(values[first:last]))
    if gaps.size:
        missing = count_of(gaps.size, "sample is", "samples are")
        words = f": {', '.join(map(repr, channel.words[:3]))}" if channel.words else ""
        begins = channel.place(int(rows[gaps[0] - 1]))
        said.append(f"{name}: {missing} lost or beyond the scope's range, and NaN{words}, the first after {begins}")
    return time, values, unit.si, notes + said


def _times(path: Path, channel: Channel, number: int, sampling: Sampling) -> tuple[Vector, Rows, list[str]]:
    """Return the even times of a channel, the row at each, -1 for none, and what is to be said."""
    if sampling.interval is not None:
        rows: Rows = np.arange(channel.values.size)
        return (sampling.start or 0.0) + sampling.interval * rows.astype(float), rows, []
    if channel.time is None:
        raise ValueError(f"{path}: holds no times of its samples; give interval=, s, such as 5e-7")
    if not sampling.time_unit and not channel.time_unit.text and (np.diff(channel.time) == 1.0).all():
        raise ValueError(
            f"{path}: the times count the samples, or their unit is missing; give time_unit=, the time_column of the "
            "time, or interval=, s"
        )
    unit, notes = _unit(path, channel.time_unit, TIME, sampling.time_unit, f"the times of column {number}")
    time = unit.size * channel.time
    parts, chosen = segments(time), sampling.segment
    if len(parts) > 1 and chosen is None:
        raise ValueError(
            f"{path}: holds {len(parts)} segments, whose times begin anew; read each with segment=1 to {len(parts)} "
            f"(hertzlink signal: --segment), such as average_taps([read_signal(…, segment=k) for k in range(1, "
            f"{len(parts) + 1})])"
        )
    if chosen is not None and chosen > len(parts):
        raise ValueError(f"{path}: segment = {chosen}: must be at most {len(parts)}, the number of segments")
    part = parts[(chosen or 1) - 1]
    even, rows, said = even_sampling(time[part], lambda row: f"{path}, {channel.place(part.start + row)}")
    shift = 0.0 if sampling.start is None else sampling.start - float(even[0])
    return even + shift, np.where(rows >= 0, rows + part.start, -1), notes + said


def _unit(path: Path, stated: Unit, kind: tuple[str, ...], given: str | None, what: str) -> tuple[Unit, list[str]]:
    """Return the unit that the user gives, or else the file, or else the SI unit; and what is to be said."""
    if given is not None:
        unit = read_unit(given, kind)
        differs = stated.text and stated[1:] != unit[1:]
        return unit, [f"the file gives {stated.text!r} for {what}; {given!r} is taken"] if differs else []
    if stated.text and not stated.si:
        argument = "time_unit" if kind == TIME else "unit"
        raise ValueError(
            f"{path}: gives {stated.text!r} for {what}, which is no unit of {WHAT[kind]}; give {argument}="
        )
    return stated if stated.text else Unit(kind[0], kind[0]), []
