"""A folder that keeps each finished point of a sweep: files are written completely or not at all, and checked when
read.
"""

import dataclasses
import inspect
import json
import os
import re
import reprlib
from collections.abc import Callable, Mapping
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from h5netcdf import CompatibilityError

from coupling.files.locks import Lock
from coupling.files.writing import PART, read_regular, remove_if_old, write_whole
from coupling.paths import path_of
from coupling.results.provenance import versions
from structures.checks import short
from structures.hdf5 import check_hdf5

Point = Mapping[str, Any]

FORMAT, VERSION = "hertzlink sweep", 1

MANIFEST = "sweep.json"
"""Describes what the points of a folder have in common."""

OWN_FILES = re.compile(r"[0-9a-f]{32}\.(nc|json)|sweep\.json|\..*")
"""Files of a store: a finished point, a failed point, the manifest; hidden files belong to the system or are
incomplete.
"""

DIGEST_LENGTH = 32
"""Number of bytes after the netCDF content of a point's file: its SHA-256. Programs that read netCDF ignore them."""

POINT_ATTRIBUTE = "sweep_point"
"""Attribute of a point's file that describes the point."""

ERROR_VARIABLE = "error"
"""Variable of a sweep that reports which points failed."""


@dataclasses.dataclass(frozen=True)
class Failure:
    """A point that could not be run: the type and the text of the error."""

    kind: str
    message: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.message}"


@dataclasses.dataclass(frozen=True)
class Store:
    """Finished points, found by their own description: if axes grow, earlier points are still found.

    Several sweeps may share a store, also at the same time: a file appears in one step, and who runs a point claims it.
    """

    folder: Path

    def holds(self, point: Point) -> bool:
        """Whether the point has been run, or failed."""
        return self._path(point, ".nc").exists() or self._path(point, ".json").exists()

    def claim(self, point: Point, wait: bool = False) -> Lock | None:
        """The right to run a point, to be released; None if another process has it. wait: until it is free.

        A claim ends with its process. After it was taken, the point may have been run: `holds` says so.
        """
        lock = Lock(self._path(point, ".lock", hidden=True))
        return lock if lock.take(wait) else None

    def load(self, point: Point) -> xr.Dataset | Failure | None:
        """The outcome of a point, None if it has not been run; raises ValueError for a damaged or foreign file."""
        path = self._path(point, ".nc")
        if path.exists():
            content = _checked(path)
            check_hdf5(BytesIO(content), f"store: {path}")
            run = _read_netcdf(content)
            if run.attrs.pop(POINT_ATTRIBUTE, None) != describe_point(point):
                raise ValueError(
                    f"store: {path} holds a different point than its name says; delete it to run the point again"
                )
            return run
        return self.failure(point)

    def failure(self, point: Point) -> Failure | None:
        """Why a point failed; None if it did not fail or has not been run; raises ValueError as `load`."""
        path = self._path(point, ".json")
        if self._path(point, ".nc").exists() or not path.exists():
            return None
        return _read_failure(path, describe_point(point))

    def keep(self, point: Point, outcome: xr.Dataset | Failure) -> None:
        """Write the outcome of a point; raises ValueError for a Dataset that would not read back unchanged."""
        if isinstance(outcome, Failure):
            record = {"point": describe_point(point), **dataclasses.asdict(outcome)}
            _write_json(self._path(point, ".json"), {**record, "sha256": _digest(record)})
            return
        if ERROR_VARIABLE in outcome.variables or ERROR_VARIABLE in outcome.dims:
            raise ValueError(
                f"measure: must not return {ERROR_VARIABLE!r}, the variable in which a sweep reports failed points"
            )
        run = outcome.assign_attrs({POINT_ATTRIBUTE: describe_point(point)})
        content = _as_netcdf(run)
        if not _read_netcdf(content).identical(run):
            raise ValueError("measure: its result does not survive netCDF; return numbers and text only")
        write_whole(self._path(point, ".nc"), content + sha256(content).digest())

    def forget(self, point: Point) -> None:
        """Delete the record of a failed point."""
        self._path(point, ".json").unlink(missing_ok=True)

    def _path(self, point: Point, suffix: str, hidden: bool = False) -> Path:
        return self.folder / ("." * hidden + sha256(describe_point(point).encode()).hexdigest()[:32] + suffix)


def open_store(
    path: str | os.PathLike[str], build: Callable[..., Any], until: float, measure: Callable[..., Any] | None
) -> Store:
    """The store in a folder. The folder is created if necessary, in a parent folder that exists.

    Its manifest holds what fixes the numbers, except the point: the names of build and measure, until (s), and the
    version of hertzlink. Raises ValueError if these differ, for a folder that holds anything else or cannot be written,
    and for functions without a name of their own.
    """
    folder = path_of("store", path, "path of a folder")
    manifest = {
        "format": FORMAT,
        "version": VERSION,
        "build": _named("build", build),
        "until": until,
        "measure": None if measure is None else _named("measure", measure),
        "hertzlink": versions()["hertzlink"],
    }
    try:
        if not folder.parent.is_dir():
            raise ValueError(f"store = {str(path)!r}: must be a writable folder; {folder.parent} is not a folder")
        folder.mkdir(exist_ok=True)
        names = sorted(os.listdir(folder))
        for name in names:
            if not OWN_FILES.fullmatch(name):
                raise ValueError(
                    f"store: {folder / name} does not belong to a sweep; use a separate folder for the store"
                )
        if MANIFEST not in names:
            if any(not name.startswith(".") for name in names):
                raise ValueError(
                    f"store: {folder / MANIFEST} is missing, although there are points; use another folder"
                )
            _write_json(folder / MANIFEST, manifest)
    except OSError as error:
        raise ValueError(f"store = {str(path)!r}: must be a writable folder; {error.strerror}") from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ValueError(f"store = {str(path)!r}: must be a writable folder; it is perhaps read-only")
    _compare(folder / MANIFEST, manifest)
    _sweep_up(folder)
    return Store(folder)


def describe_point(point: Point) -> str:
    """A point as a unique text, the same in every process; raises ValueError as `describe`."""
    plain = {name: describe(name, value) for name, value in point.items()}
    return json.dumps(plain, sort_keys=True, ensure_ascii=False)


def describe(name: str, value: object) -> Any:
    """A value as plain data that identifies it; for an object its class and the arguments that build it.

    Raises ValueError for an object whose state cannot be described, such as a function or a Structure.
    """
    if value is None or isinstance(value, bool | np.bool_):
        return None if value is None else bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value)
    if isinstance(value, str):
        return str(value)
    if isinstance(value, list | tuple):
        return [describe(name, item) for item in value]
    if isinstance(value, np.ndarray):
        return describe(name, value.tolist())
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {str(key): describe(name, item) for key, item in value.items()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        built = {field.name: getattr(value, field.name) for field in dataclasses.fields(value) if field.init}
        plain = {key: describe(name, item) for key, item in built.items()}
        return {"class": f"{type(value).__module__}.{type(value).__qualname__}", **plain}
    raise ValueError(
        f"{name} = {reprlib.repr(value)}: must be a number, a text, a list or a dataclass of these (such as a "
        "Material) if a store is used; let build make it from such values"
    )


def _named(name: str, function: Callable[..., Any]) -> str:
    known = getattr(function, "__qualname__", "<lambda>")
    if "<lambda>" in known or inspect.ismethod(function):
        raise ValueError(f"{name} = {reprlib.repr(function)}: must have a name (def) if a store is used")
    return f"{function.__module__}.{known}"


def _compare(path: Path, manifest: Mapping[str, Any]) -> None:
    stored = _read_json(path)
    if stored.get("format") != FORMAT or (stored.get("version") == VERSION and stored.keys() != manifest.keys()):
        raise ValueError(f"store: {path} is not of a sweep, or damaged; give another folder")
    for key, value in manifest.items():
        if stored.get(key) != value:
            change = f"{key} = {short(stored.get(key))}, now it is {short(value)}"
            raise ValueError(f"store: {path} has {change}; use another folder")


def _sweep_up(folder: Path) -> None:
    """Delete incomplete files of a killed sweep; younger files may belong to another sweep that is running."""
    for part in folder.glob(f".*{PART}"):
        remove_if_old(part)


def _write_json(path: Path, record: Mapping[str, Any]) -> None:
    write_whole(path, (json.dumps(record, indent=1, ensure_ascii=False) + "\n").encode())


def _read_json(path: Path) -> dict[str, Any]:
    try:
        record = json.loads(read_regular(path).decode())
        if isinstance(record, dict):
            return record
    except (OSError, RecursionError, ValueError):
        pass
    raise ValueError(f"store: {path} is not of a sweep, or damaged; take it away, or give another folder")


def _read_failure(path: Path, described: str) -> Failure:
    record = _read_json(path)
    if record.pop("sha256", None) != _digest(record) or record.get("point") != described:
        raise ValueError(f"store: {path} is not of a sweep, or damaged; take it away, and its point is run again")
    return Failure(str(record.get("kind")), str(record.get("message")))


def _digest(record: Mapping[str, Any]) -> str:
    return sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def _as_netcdf(run: xr.Dataset) -> bytes:
    plain = {
        name: {"_FillValue": None} for name, variable in run.variables.items() if "_FillValue" not in variable.attrs
    }
    try:
        return bytes(run.to_netcdf(engine="h5netcdf", encoding=plain))
    except (AttributeError, TypeError, ValueError, CompatibilityError) as error:
        raise ValueError(
            f"measure: its result does not fit into netCDF ({error}); return numbers and text only"
        ) from error


def _checked(path: Path) -> bytes:
    """The netCDF content of a point's file."""
    try:
        data = read_regular(path)
    except OSError as error:
        raise ValueError(f"store: {path} cannot be read; {error.strerror}") from error
    if sha256(data[:-DIGEST_LENGTH]).digest() != data[-DIGEST_LENGTH:]:
        raise ValueError(f"store: {path} is not of a sweep, or damaged; take it away, and its point is run again")
    return data[:-DIGEST_LENGTH]


def _read_netcdf(content: bytes) -> xr.Dataset:
    """Numbers exactly as stored: nothing is decoded into dates or masked."""
    with xr.open_dataset(BytesIO(content), engine="h5netcdf", decode_times=False, mask_and_scale=False) as file:
        return file.load().drop_encoding()
