"""Files of recorders that are no text: libraries of their formats read them."""

import re
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupling.results.text_header import INTERVALS, RATES, STARTS, key_of

EXTRA = "hertzlink[recorders]"

MOST_SAMPLES = 50_000_000
MOST_CHANNELS = 256
FEWEST_SAMPLES = 16

TIMES = {"t", "time", "times", "timestamp", "zeit", "x", "xvalue", "seconds", "second"}
"""Names of arrays of times, as `key_of` gives them."""

CLOCKS = "mM"
"""The kinds of numpy's dates and durations."""

SCOPES = (
    "Keysight .bin, LeCroy .trc, Rigol .wfm and .bin, Rohde & Schwarz RTP .bin, Siglent .bin, Tektronix .wfm and .isf "
    "and Yokogawa .wfm"
)

UNITS_OF_RIGOLWFM = {"v": "V", "a": "A", "w": "W"}

Array = NDArray[Any]


class Channel(NamedTuple):
    """A channel: its name, unit and samples; its times, None where the file states none, and what their name says; and
    whether the name may state a unit, as a head of a column does."""

    name: str
    unit: str
    values: Array
    time: Array | None = None
    name_of_time: str = "time (s)"
    is_head: bool = True


class Recording(NamedTuple):
    """Channels of one segment, the number of segments, what is to be said; or the lines of a sheet as text."""

    channels: list[Channel]
    segments: int = 1
    notes: tuple[str, ...] = ()
    text: bytes = b""


def read_recording(path: Path, kind: str, reader: str, segment: int = 1) -> Recording:
    """Return what a file of a recorder holds. A ValueError that names the file and the way out.

    kind: what the file is, in words; reader: a name of READERS.
    """
    try:
        return _read(path, reader, segment)
    except ImportError as error:
        raise ValueError(
            f"{path}: is {kind}, which {error.name} reads; install it with pip install '{EXTRA}'"
        ) from error
    except Exception as error:
        reason = " ".join(f"{error}".split())[:200]
        if type(error) is not ValueError:  # in the words of a library
            other = f"is none of {SCOPES}" if kind.startswith("a binary file") else "only begins as one"
            reason = f"it is damaged, cut off, or {other}"
        raise ValueError(
            f"{path}: is {kind} that cannot be read ({reason}); export the trace as CSV in the recorder's software"
        ) from error


def _scope(path: str, segment: int) -> Recording:
    """Read a waveform of Tektronix, LeCroy, Keysight, Rigol, Siglent, Rohde & Schwarz or Yokogawa."""
    from RigolWFM import Wfm, detect_model

    waveform = Wfm.from_file(path, frame=segment - 1 if detect_model(path) == "Tek" else 0)
    channels = [
        Channel(channel.name, _unit_of_rigolwfm(channel), np.asarray(channel.volts), np.asarray(channel.times))
        for channel in waveform.channels
        if channel.volts is not None and channel.times is not None
    ]
    segments = int(getattr(waveform, "frame_count", 1))
    content = Path(path).read_bytes()
    if waveform.parser_name == "lecroy_trc" and b"LECROY_2_" in content:
        # RigolWFM reads neither the unit nor the segments; their places are those of LeCroy's template.
        head = content[content.index(b"WAVEDESC") :]
        order = "<" if head[34] else ">"
        stated, segments = (int(np.frombuffer(head, f"{order}i4", 1, place)[0]) for place in (116, 144))
        unit = head[196:244].split(b"\0")[0].decode("latin-1").strip()
        return _parts(channels, unit, max(segments, 1), segment, stated)
    if waveform.parser_name == "tek_isf":
        stated_unit, count = (_entry(content, name) for name in (rb'YUN(?:IT)?\s+"([^"]*)"', rb"NR_P(?:T)?\s+(\d+)"))
        return _parts(channels, stated_unit, 1, 1, int(count or 0))
    return Recording(channels, segments)


def _unit_of_rigolwfm(channel: Any) -> str:
    return UNITS_OF_RIGOLWFM.get(getattr(channel.unit, "name", "v"), "")


def _yokogawa(path: str, segment: int) -> Recording:
    """Read a header of Yokogawa (.hdr), whose samples lie beside it (.wvf): all groups, one block."""
    from RigolWFM.yokogawa_hdr import parse_hdr, wvf_byte_offset

    header, named = parse_hdr(path), Path(path)
    samples = [one for one in named.parent.iterdir() if one.stem == named.stem and one.suffix.lower() == ".wvf"]
    if not samples:
        raise ValueError("its samples, a .wvf of the same name, are not beside it")
    content, channels = samples[0].read_bytes(), list[Channel]()
    for number, group in enumerate(header.groups):
        for place, trace in enumerate(group.traces):
            kind, block = trace.v_data_type, min(segment, group.block_number) - 1
            if kind is None or kind.is_logic:
                continue
            offset = wvf_byte_offset(header, number, place, block)
            raw = np.frombuffer(content, header.byte_order + kind.numpy_dtype, trace.block_size, offset)
            low, high = (np.inf if end is None else abs(end) for end in (trace.v_minus_over, trace.v_plus_over))
            values = np.where((raw <= -low) | (raw >= high), np.nan, trace.v_resolution * raw + trace.v_offset)
            time = trace.h_offset + trace.h_resolution * np.arange(raw.size)
            channels.append(Channel(trace.name, trace.v_unit, values, time, f"time ({trace.h_unit})"))
    return Recording(channels, max((group.block_number for group in header.groups), default=1))


def _entry(content: bytes, pattern: bytes) -> str:
    """Return what an entry of a Tektronix preamble states, "" without any."""
    found = re.search(pattern, content[:2048], re.IGNORECASE)
    return found[1].decode("latin-1") if found else ""


def _parts(channels: list[Channel], unit: str, segments: int, segment: int, stated: int) -> Recording:
    """Return one segment of records that follow each other, and whether samples are missing."""
    size = channels[0].values.size if channels else 0
    short = f"the header states {stated} samples, and {size} are in the file: was it cut off?"
    notes = (short,) if stated > size else ()
    length = (stated if segments > 1 else size) // segments
    at = slice((min(segment, segments) - 1) * length, min(segment, segments) * length)
    parts = [
        channel._replace(unit=unit or channel.unit, values=channel.values[at], time=channel.time[:length])
        for channel in channels
        if channel.time is not None
    ]
    return Recording(parts, segments, notes)


def _tdms(path: str, _: int) -> Recording:
    """Read a file of LabVIEW, a channel after the other, group by group."""
    from nptdms import TdmsFile

    channels: list[Channel] = []
    for group in TdmsFile.read(path).groups():
        arrays, units = {}, {}
        for channel in group.channels():
            values = np.asarray(channel[:])
            if not _is_numeric(values) and values.dtype.kind not in CLOCKS:
                continue
            stated = channel.properties
            name, unit = channel.name, str(stated.get("unit_string", stated.get("NI_UnitDescription", "")))
            interval = float(stated.get("wf_increment", 0.0))
            if interval > 0.0:
                start = float(stated.get("wf_start_offset", 0.0))
                channels.append(Channel(name, unit, values, start + interval * np.arange(values.size)))
            else:
                arrays[name], units[name] = values, unit
        channels += _named(arrays, units, {}, needed=False)
    return Recording(channels)


def _matlab(path: str, _: int) -> Recording:
    """Read the arrays of a .mat file, such as those of PicoScope."""
    import scipy.io

    arrays = scipy.io.loadmat(path, mat_dtype=False, struct_as_record=True)
    structs = [name for name, value in arrays.items() if getattr(value, "dtype", np.dtype(float)).names]
    if structs and not [*_vectors({name: value for name, value in arrays.items() if name not in structs})]:
        raise ValueError(f"{structs[0]} is a struct; save its fields: save('a.mat', '-struct', '{structs[0]}')")
    named = _named({name: value for name, value in arrays.items() if name[:2] != "__"}, {}, {})
    return Recording([channel._replace(is_head=False) for channel in named])


def _hdf5(path: str, _: int) -> Recording:
    """Read the arrays of an HDF5 file, also of MATLAB 7.3 and netCDF 4; no data of other files that it names."""
    import h5py

    arrays: dict[str, Array] = {}
    units, attributes = dict[str, str](), dict[str, Any]()
    with h5py.File(path, "r") as file:
        sets: list[Any] = []
        file.visititems(lambda _, item: sets.append(item) if isinstance(item, h5py.Dataset) else None)
        for item in sets:
            is_text = item.attrs.get("MATLAB_class", b"double") in (b"char", b"cell", b"struct")
            if item.dtype.kind not in "iuf" or item.external or item.is_virtual or is_text:
                continue
            if item.size > MOST_SAMPLES:
                raise ValueError(f"{item.name} holds {item.size} numbers, must be at most {MOST_SAMPLES}")
            name = str(item.name).strip("/")
            arrays[name] = np.asarray(item[()])
            units[name] = next((_text(item.attrs[key]) for key in ("units", "unit") if key in item.attrs), "")
            for place in (item, item.parent):
                attributes |= {key: value for key, value in place.attrs.items() if np.size(value) == 1}
    return Recording([channel._replace(is_head=False) for channel in _named(arrays, units, attributes)])


def _sound(path: str, _: int) -> Recording:
    """Read the channels of a .wav file; samples are parts of the full scale."""
    from scipy.io import wavfile

    rate, samples = wavfile.read(path)
    columns = samples.reshape(samples.shape[0], -1)
    if columns.dtype.kind in "iu":
        least, span = float(np.iinfo(columns.dtype).min), 2.0 ** (8 * columns.dtype.itemsize)
        columns = 2.0 * (columns - least) / span - 1.0
    time = np.arange(columns.shape[0]) / float(rate)
    channels = [Channel(f"channel {k + 1}", "", column, time) for k, column in enumerate(columns.T)]
    return Recording(channels, notes=("samples are parts of the full scale; calibration is N for the full scale",))


def _universal(path: str, _: int) -> Recording:
    """Read the time responses of data sets 58 of a universal file."""
    import pyuff

    channels, left_out = [], 0
    sets = pyuff.UFF(path).read_sets()
    for entry in sets if isinstance(sets, list) else [sets]:
        if entry.get("type") != 58 or entry.get("func_type") != 1 or np.iscomplexobj(entry["data"]):
            left_out += entry.get("type") == 58
            continue
        unit = str(entry.get("ordinate_axis_units_lab", "")).strip()
        name = str(entry.get("id1", "")).strip() or f"node {entry.get('rsp_node')}"
        values = np.asarray(entry["data"])
        channels.append(Channel(name, "" if unit.upper() == "NONE" else unit, values, np.asarray(entry["x"])))
    notes = (f"data sets 58 that are no time responses were left out: {left_out}",) if left_out else ()
    return Recording(channels, notes=notes)


def _workbook(path: str, _: int) -> Recording:
    """Read the first sheet of a workbook that holds samples, as lines of text with tabs."""
    from openpyxl import load_workbook

    lines: list[str] = []
    with open(path, "rb") as file:
        for sheet in load_workbook(file, read_only=True, data_only=True).worksheets:
            lines = ["\t".join(map(_cell, row)) for row in sheet.iter_rows(values_only=True)]
            if len(lines) >= FEWEST_SAMPLES:
                break
    return Recording([], text="\n".join(lines).encode())


def _cell(value: Any) -> str:
    return "" if value is None else " ".join(str(value).split())


def _parquet(path: str, _: int) -> Recording:
    """Read the columns of a Parquet file."""
    import pyarrow.parquet

    file = pyarrow.parquet.ParquetFile(path)
    if file.metadata.num_rows * file.metadata.num_columns > MOST_SAMPLES:
        raise ValueError(f"holds {file.metadata.num_rows} rows, too many to read")
    table = file.read()
    columns = {
        name: (column.cast("double") if pyarrow.types.is_decimal(column.type) else column).to_numpy()
        for name, column in zip(table.column_names, table.columns, strict=True)
    }
    return Recording(_named(columns, {}, {}))


def _named(
    arrays: Mapping[str, Array], units: Mapping[str, str], stated: Mapping[str, Any], needed: bool = True
) -> list[Channel]:
    """Return channels from arrays by their names: vectors, columns of matrices, and numbers such as an interval.

    The time is a vector of that name, or of dates or durations, or the first that increases evenly.
    """
    clocks = [name for name, value in arrays.items() if np.asarray(value).dtype.kind in CLOCKS and value.size]
    arrays = {**arrays, **{name: _seconds(arrays[name]) for name in clocks}}
    units = {**units, **dict.fromkeys(clocks, "s")}
    numbers = {
        key_of(name): float(np.ravel(value)[0])
        for name, value in [*stated.items(), *arrays.items()]
        if _is_number(value)
    }
    vectors = dict(_vectors(arrays))
    if not vectors:
        if needed:
            raise ValueError(f"holds no array of {FEWEST_SAMPLES} or more numbers")
        return []
    intervals = [numbers[key] for key in numbers if key in INTERVALS]
    intervals += [1.0 / numbers[key] for key in numbers if key in RATES and numbers[key] > 0.0]
    named = [name for name in vectors if key_of(name.rpartition("/")[2]) in TIMES]
    time_name = next(iter([*named, *(name for name in clocks if name in vectors)]), None)
    rising = [name for name, vector in vectors.items() if name != time_name and _increases_evenly(vector)]
    if time_name is None and not intervals:  # steps of 1 count samples
        time_name = next((name for name in rising if not (np.diff(vectors[name]) == 1.0).all()), None)
    for name in rising:
        what = "and is taken as the time" if name == time_name else "as a time does, or a counter"
        warnings.warn(f"{name} increases evenly, {what}", stacklevel=2)
    usual = Counter(vector.size for vector in vectors.values()).most_common(1)[0][0]
    size = usual if time_name is None else vectors[time_name].size
    time, name_of_time = None, "time (s)"
    if time_name is not None:
        time, unit = vectors[time_name], units.get(time_name, "")
        name_of_time = f"time ({unit})" if unit else re.sub(r"\[\d+\]$", "", time_name.rpartition("/")[2])
    elif intervals:
        time = next((numbers[key] for key in numbers if key in STARTS), 0.0) + intervals[0] * np.arange(size)
    return [
        Channel(name, units.get(name, ""), vector, time, name_of_time)
        for name, vector in vectors.items()
        if name not in (time_name, *clocks) and vector.size == size
    ]


def _vectors(arrays: Mapping[str, Array]) -> Iterable[tuple[str, Array]]:
    """Yield each array of samples, and each column of a matrix; the longer side of it is the time."""
    for name, value in arrays.items():
        array = np.squeeze(np.asarray(value))
        if not _is_numeric(array) or array.ndim > 2 or max(array.shape, default=0) < FEWEST_SAMPLES:
            continue
        if array.ndim == 1:
            yield name, array
            continue
        columns = array if array.shape[0] < array.shape[1] else array.T
        for k, column in enumerate(columns[:MOST_CHANNELS]):
            yield f"{name}[{k}]", column


def _seconds(clock: Array) -> Array:
    """Return durations, s, or dates less the first one."""
    first = clock.flat[0] if clock.dtype.kind == "M" else np.timedelta64(0, "s")
    return np.asarray((clock - first) / np.timedelta64(1, "s"))


def _increases_evenly(values: Array) -> bool:
    """Return whether numbers increase as times do, perhaps rounded."""
    even = np.linspace(values[0], values[-1], values.size)
    steps, span = np.diff(values.astype(float)), float(even[-1] - even[0])
    return bool(steps.min() >= 0.0 and steps.max() < 0.1 * span and np.abs(values - even).max() <= 1.01 * steps.max())


def _is_numeric(value: Array) -> bool:
    return bool(value.dtype.kind in "iuf")


def _is_number(value: Any) -> bool:
    array = np.asarray(value)
    return array.size == 1 and _is_numeric(array)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


READERS: dict[str, Callable[[str, int], Recording]] = {
    function.__name__[1:]: function
    for function in (_scope, _yokogawa, _tdms, _matlab, _hdf5, _sound, _universal, _workbook, _parquet)
}
"""Functions that read a file, by the name that the table of formats has for them."""


def _read(path: Path, reader: str, segment: int) -> Recording:
    """Return a recording that is not too large, and what its library warned of as notes."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for technical in (DeprecationWarning, PendingDeprecationWarning, ResourceWarning):
            warnings.simplefilter("ignore", technical)
        recording = READERS[reader](str(path), segment)
    channels = [channel for channel in recording.channels if channel.values.size >= FEWEST_SAMPLES][:MOST_CHANNELS]
    if sum(channel.values.size for channel in channels) > MOST_SAMPLES:
        raise ValueError(f"holds more than {MOST_SAMPLES} samples")
    if not channels and not recording.text:
        raise ValueError("holds no channel of samples")
    notes = [*recording.notes, *dict.fromkeys(str(warning.message).split("\n")[0][:200] for warning in said)][:5]
    times = {id(channel.time): None if channel.time is None else np.array(channel.time, float) for channel in channels}
    channels = [
        channel._replace(values=np.array(channel.values, float), time=times[id(channel.time)]) for channel in channels
    ]
    return recording._replace(channels=channels, notes=tuple(notes))
