"""Files of recorders as channels: TDMS, MATLAB, HDF5 and arrays of numpy by their libraries; text is in `text`."""

import zipfile
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupling.results.hdf5 import check_hdf5
from coupling.results.sensor_trace import FEWEST_SAMPLES
from coupling.signals.heads import FORCE, TIME, Unit, read_unit
from structures.structure import Vector

Array = NDArray[Any]

# What arrays of times are called, and numbers that state the interval between samples and the first time, s.
TIMES = {"t", "time", "times", "timestamp", "zeit", "x"}
INTERVALS, STARTS = {"tinterval", "interval", "dt", "increment"}, {"tstart", "start", "t0"}

# What libraries raise for damaged files.
NOT_TO_READ = (
    *(ArithmeticError, AttributeError, LookupError, MemoryError, OSError, RuntimeError, SystemError, TypeError),
    *(ValueError, zipfile.BadZipFile, zlib.error),
)


class Channel(NamedTuple):
    """A column of a file: its samples, NaN where one is missing; their times, None where the file states none; of a
    text, the line of each sample, and the words in the place of missing ones."""

    name: str
    values: Vector
    unit: Unit
    time: Vector | None
    time_unit: Unit = Unit()
    lines: Any = None
    words: tuple[str, ...] = ()

    def place(self, row: int) -> str:
        """Return where a sample stands in the file."""
        return f"sample {row + 1}" if self.lines is None else f"line {self.lines[row]}"


class Sampling(NamedTuple):
    """What a user says of a file, as the arguments of `read_signal`; None: as the file says."""

    time_column: int | None = None
    time_unit: str | None = None
    unit: str | None = None
    interval: float | None = None
    start: float | None = None
    segment: int | None = None
    skip: int = 0


class Recording(NamedTuple):
    """What a file is, its channels by their numbers, and what is to be said."""

    kind: str
    channels: dict[int, Channel]
    notes: list[str]


def tried(path: Path, kind: str, reader: Callable[[Path], Any]) -> Any:
    """Return what a library reads, or raise a ValueError where it is missing or the file is damaged."""
    try:
        return reader(path)
    except ImportError as error:
        raise ValueError(f"{path}: is {kind}; install what reads it: pip install 'hertzlink[recorders]'") from error
    except NOT_TO_READ as error:
        reason = " ".join(str(error).split())[:200]
        raise ValueError(f"{path}: is {kind} that cannot be read ({reason}); export the trace as CSV") from error


def workbook(path: Path) -> bytes:
    """Return the first sheet of an Excel workbook that holds samples as text with tabs."""
    import pandas as pd  # type: ignore[import-untyped]

    sheets = pd.read_excel(path, sheet_name=None, header=None, dtype=object, engine="openpyxl")
    table = next((sheet for sheet in sheets.values() if len(sheet) >= FEWEST_SAMPLES), None)
    if table is None:
        raise ValueError(f"no sheet has {FEWEST_SAMPLES} or more lines")
    return bytes(table.to_csv(sep="\t", header=False, index=False).encode())


def tdms(path: Path) -> list[Channel]:
    """Return the channels of LabVIEW, each from its own start on, and arrays without a sampling rate."""
    from nptdms import TdmsFile

    channels, arrays, units = list[Channel](), dict[str, Array](), dict[str, str]()
    every = [channel for group in TdmsFile.read(path).groups() for channel in group.channels()]
    starts = [channel.properties["wf_start_time"] for channel in every if "wf_start_time" in channel.properties]
    for channel in every:
        values, stated = np.asarray(channel[:]), channel.properties
        unit = str(stated.get("unit_string", stated.get("NI_UnitDescription", "")))
        interval = float(stated.get("wf_increment", 0.0))
        if interval > 0.0 and values.dtype.kind in "iuf":
            # Channels may have begun at different times.
            began = stated.get("wf_start_time", min(starts, default=None))
            late = 0.0 if began is None else float((began - min(starts)) / np.timedelta64(1, "s"))
            time = late + float(stated.get("wf_start_offset", 0.0)) + interval * np.arange(values.size, dtype=float)
            channels.append(Channel(channel.name, values.astype(float), read_unit(unit, FORCE), time))
        else:
            name = f"{channel.group_name}/{channel.name}"
            arrays[name], units[name] = values, unit
    return channels + of_arrays(arrays, units)


def matlab(path: Path) -> list[Channel]:
    """Return the arrays of a file of MATLAB up to version 7.2."""
    import scipy.io

    return of_arrays(scipy.io.loadmat(path))


def numpy_arrays(path: Path) -> list[Channel]:
    """Return the arrays of `numpy.savez`."""
    with np.load(path, allow_pickle=False) as arrays:
        return of_arrays(dict(arrays))


def hdf5(path: Path) -> list[Channel]:
    """Return the numbers of an HDF5 file, which is that of MATLAB 7.3, too."""
    import h5py  # type: ignore[import-untyped]

    check_hdf5(path, str(path))
    arrays, units = dict[str, Array](), dict[str, str]()

    def keep(name: str, item: Any) -> None:
        is_text = getattr(item, "attrs", {}).get("MATLAB_class", b"double") in (b"char", b"cell", b"struct")
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "iuf" and not is_text:
            arrays[name] = np.asarray(item[()])
            unit = item.attrs.get("units", item.attrs.get("unit", ""))
            units[name] = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else str(unit)

    with h5py.File(path, "r") as file:
        file.visititems(keep)
    return of_arrays(arrays, units)


def of_arrays(arrays: Mapping[str, Array], units: Mapping[str, str] | None = None) -> list[Channel]:
    """Return channels of vectors, and of the columns of matrices, by name. Arrays of one folder share a time: the array
    with a name of TIMES, or numbers with names of INTERVALS and STARTS, of their own folder or of one above."""
    vectors, numbers, stated = dict[str, Vector](), dict[str, float](), units or {}
    for name, array in arrays.items():
        values = np.atleast_2d(np.squeeze(np.asarray(array)))
        if values.dtype.kind not in "iuf" or values.ndim > 2:
            continue
        if values.size == 1:
            numbers[name] = float(values[0, 0])
        elif max(values.shape) >= FEWEST_SAMPLES:
            columns = (values if values.shape[0] < values.shape[1] else values.T).astype(float)
            vectors |= {name: columns[0]} if len(columns) == 1 else {f"{name}[{k}]": c for k, c in enumerate(columns)}

    def key(name: str) -> str:
        return name.rpartition("/")[2].lower().replace("_", "")

    def near(found: Mapping[str, Any], names: set[str], folder: str) -> str | None:
        """Return which of some names there is, in a folder or above it."""
        fitting = [name for name in found if key(name) in names and f"{folder}/".startswith(name.rpartition("/")[0])]
        return max(fitting, key=lambda name: len(name.rpartition("/")[0]), default=None)

    channels = list[Channel]()
    for name, values in vectors.items():
        folder = name.rpartition("/")[0]
        if key(name) in TIMES:
            continue
        time, unit = None, Unit()
        if (named := near(vectors, TIMES, folder)) and vectors[named].size == values.size:
            time, unit = vectors[named], read_unit(stated.get(named, ""), TIME)
        elif interval := near(numbers, INTERVALS, folder):
            start = near(numbers, STARTS, folder)
            time = (numbers[start] if start else 0.0) + numbers[interval] * np.arange(values.size, dtype=float)
        channels.append(Channel(name, values, read_unit(stated.get(name, ""), FORCE), time, unit))
    return channels
