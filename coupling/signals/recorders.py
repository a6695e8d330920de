"""The channels of files of oscilloscopes and recorders: TDMS, MATLAB, HDF5, numpy and Excel, by their libraries."""

import zipfile
import zlib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from coupling.results.hdf5 import check_hdf5
from coupling.results.sensor_trace import FEWEST_SAMPLES
from coupling.signals.channels import Channel, Recording, Sampling
from coupling.signals.heads import FORCE, TIME, Unit, read_unit
from coupling.signals.text import read_text
from structures.structure import Vector

MOST_CHANNELS = 256
MOST_BYTES = 50_000_000  # of a text

# Names of arrays of times; names of numbers for the interval between samples, s, and for the first time, s.
TIMES = {"t", "time", "times", "timestamp", "zeit", "x"}
INTERVALS, STARTS = {"tinterval", "interval", "dt", "increment"}, {"tstart", "start", "t0"}

# The errors of libraries for damaged files.
NOT_TO_READ = (
    *(ArithmeticError, AttributeError, LookupError, MemoryError, OSError, RuntimeError, SystemError, TypeError),
    *(ValueError, zipfile.BadZipFile, zlib.error),
)


def opened(path: Path, columns: Collection[int] | None, asked: Sampling) -> Recording:
    """Return the columns of a text (None: all), or all channels of a recorder's file, counted from 1."""
    with open(path, "rb") as file:
        head = file.read(2048)
    kinds = ((kind, reader) for at, start, kind, reader in KINDS if head[at:].startswith(start))
    kind, reader = next(kinds, ("a binary file", None))
    # Text has few control characters; in UTF-16, which begins with a mark, each second byte may be zero.
    controls = sum(byte < 32 and byte not in b"\t\n\r\f\x1a" for byte in head)
    is_utf_16 = head[:2] in (b"\xff\xfe", b"\xfe\xff")
    if reader is None and controls <= (0.6 if is_utf_16 else 0.02) * len(head):
        kind, reader = "a text", Path.read_bytes
        if path.stat().st_size > MOST_BYTES:
            raise ValueError(f"{path}: is a text of more than {MOST_BYTES:.2g} bytes; cut it, or save arrays (.npz)")
    if reader is None:
        raise ValueError(
            f"{path}: is {kind}, not a text of samples; export the trace as CSV, or read it as docs/signals.md says "
            "and give time (s) and force (N) to hertzlink.as_signal"
        )

    try:
        content: bytes | list[Channel] = reader(path)
    except ImportError as error:
        raise ValueError(f"{path}: is {kind}; install what reads it: pip install 'hertzlink[recorders]'") from error
    except NOT_TO_READ as error:
        reason = " ".join(str(error).split())[:200]
        raise ValueError(f"{path}: is {kind} that cannot be read ({reason}); export the trace as CSV") from error
    if isinstance(content, bytes):
        return read_text(path, content, columns, asked)
    if asked.time_column is not None:
        raise ValueError(f"time_column = {asked.time_column}: is for text; {path} has its own times, or give interval=")
    if not content:
        raise ValueError(f"{path}: is {kind} without arrays of {FEWEST_SAMPLES} or more numbers")
    return Recording(kind, dict(enumerate(content[:MOST_CHANNELS], 1)), [])


def archive(path: Path) -> bytes | list[Channel]:
    """Return the arrays of `numpy.savez`; or the first sheet of Excel that holds samples, as a text with tabs."""
    import pandas as pd  # type: ignore[import-untyped]

    with zipfile.ZipFile(path) as file:
        names = file.namelist()
    if any(name.endswith(".npy") for name in names):
        with np.load(path, allow_pickle=False) as arrays:
            return of_arrays(dict(arrays))
    sheets = pd.read_excel(path, sheet_name=None, header=None, dtype=object, engine="openpyxl").values()
    tables = [sheet.to_csv(sep="\t", header=False, index=False) for sheet in sheets if len(sheet) >= FEWEST_SAMPLES]
    return bytes(tables[0].encode()) if tables else []


def tdms(path: Path) -> list[Channel]:
    """Return the channels of a LabVIEW file, each with its own start."""
    from nptdms import TdmsFile

    arrays, units, times = dict[str, Any](), dict[str, str](), dict[str, Vector]()
    every = [channel for group in TdmsFile.read(path).groups() for channel in group.channels()]
    began = [channel.properties["wf_start_time"] for channel in every if "wf_start_time" in channel.properties]
    for channel in every:
        name, stated = f"{channel.group_name}/{channel.name}", channel.properties
        arrays[name], units[name] = channel[:], stated.get("unit_string", stated.get("NI_UnitDescription", ""))
        if (interval := float(stated.get("wf_increment", 0.0))) > 0.0:
            late = (stated["wf_start_time"] - min(began)) / np.timedelta64(1, "s") if "wf_start_time" in stated else 0.0
            start = float(late) + float(stated.get("wf_start_offset", 0.0))
            times[name] = start + interval * np.arange(len(arrays[name]), dtype=float)
    return of_arrays(arrays, units, times)


def hdf5(path: Path) -> list[Channel]:
    """Return the channels of an HDF5 file; MATLAB 7.3 also writes such files."""
    import h5py  # type: ignore[import-untyped]

    check_hdf5(path, str(path))
    items, arrays, units = dict[str, Any](), dict[str, Any](), dict[str, str]()
    with h5py.File(path, "r") as file:
        file.visititems(items.__setitem__)
        for name, item in items.items():
            is_text = item.attrs.get("MATLAB_class", b"double") in (b"char", b"cell", b"struct")
            if isinstance(item, h5py.Dataset) and not is_text:
                unit = item.attrs.get("units", item.attrs.get("unit", ""))
                units[name] = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else str(unit)
                arrays[name] = item[()]
    return of_arrays(arrays, units)


def of_arrays(
    arrays: Mapping[str, Any], units: Mapping[str, str] | None = None, times: Mapping[str, Vector] | None = None
) -> list[Channel]:
    """Return the channels of vectors and of columns of matrices. A channel's time is in `times`, or else in the nearest
    folder: an array with a name in TIMES, or numbers with names in INTERVALS and STARTS."""
    numbers: dict[str, NDArray[Any]] = {name: np.squeeze(np.asarray(array)) for name, array in arrays.items()}
    numbers = {name: array.astype(float) for name, array in numbers.items() if array.dtype.kind in "iuf"}
    stated, channels = units or {}, list[Channel]()
    keys = {name: name.rpartition("/")[2].lower().replace("_", "") for name in numbers}

    def near(name: str, wanted: set[str], size: int) -> str | None:
        """Return the array of this size with a wanted name, in the nearest folder of a channel or above it."""
        folder = name.rpartition("/")[0] + "/"
        found = (n for n in numbers if keys[n] in wanted and folder.startswith(n.rpartition("/")[0]))
        return max((n for n in found if numbers[n].size == size), key=lambda n: n.count("/"), default=None)

    for name, array in numbers.items():
        if array.ndim not in (1, 2) or max(array.shape) < FEWEST_SAMPLES or (array.ndim == 1 and keys[name] in TIMES):
            continue
        count, time, time_unit = max(array.shape), (times or {}).get(name), Unit()
        if time is None and (named := near(name, TIMES, count)):
            time, time_unit = numbers[named], read_unit(stated.get(named, ""), TIME)
        elif time is None and (interval := near(name, INTERVALS, 1)):
            start = near(name, STARTS, 1)
            time = (float(numbers[start]) if start else 0.0) + float(numbers[interval]) * np.arange(count, dtype=float)
        unit = read_unit(stated.get(name, ""), FORCE)
        rows = array[None] if array.ndim == 1 else array if array.shape[0] < count else array.T
        for k, row in enumerate(rows):
            channels.append(Channel(name if array.ndim == 1 else f"{name}[{k}]", row, unit, time, time_unit))
    return channels


# Kinds of files: the byte at which the mark of the kind stands, the mark, the kind in words, and the reader.
KINDS: tuple[tuple[int, bytes, str, Any], ...] = (
    (0, b"TDSm", "a TDMS file of LabVIEW", tdms),
    (0, b"MATLAB 5.0", "a file of MATLAB (.mat)", lambda path: of_arrays(scipy.io.loadmat(path))),
    (0, b"\x89HDF", "an HDF5 file", hdf5),
    (512, b"\x89HDF", "an HDF5 file", hdf5),
    (0, b"PK\x03\x04", "a zip archive (.npz or .xlsx)", archive),
)
