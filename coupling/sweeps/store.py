"""A folder that keeps each finished point of a sweep: written whole or not at all, and checked when it is read."""

import dataclasses
import inspect
import json
import os
import re
import reprlib
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
import xarray as xr
from h5netcdf import CompatibilityError

from coupling.paths import path_of
from coupling.results.provenance import versions
from structures.checks import short

Point = Mapping[str, Any]

FORMAT, VERSION = "hertzlink sweep", 1

MANIFEST = "sweep.json"
"""Tells what the points of a folder have in common."""

OURS = re.compile(r"[0-9a-f]{32}\.(nc|json)|sweep\.json|\..*")
"""A point that was run, one that failed, the manifest; hidden files belong to the system, or are half written."""

LEFT_OVER = 3600.0
"""Seconds after which a half-written file is that of a sweep that was killed."""

DIGEST = 32
"""Bytes that follow the netCDF file in a point's file: their SHA-256. Programs that read netCDF do not look there."""

DESCRIBED = "sweep_point"
"""Attribute by which a point's file tells its own point."""

ERROR = "error"
"""Variable of a sweep that tells which points failed."""


@dataclasses.dataclass(frozen=True)
class Failure:
    """A point that could not be run: the error's type and what it says."""

    kind: str
    message: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.message}"


@dataclasses.dataclass(frozen=True)
class Store:
    """Finished points by their own description: where axes grow, what was run before is still found.

    Sweeps may share a store, at once too: a point's file appears in one step, and that of the same point is the same.
    """

    folder: Path

    def holds(self, point: Point) -> bool:
        """Whether the point has been run, or failed."""
        return self._path(point, ".nc").exists() or self._path(point, ".json").exists()

    def load(self, point: Point) -> xr.Dataset | Failure | None:
        """What became of a point, None where it has not been run; raises ValueError for a damaged or foreign file."""
        path = self._path(point, ".nc")
        if path.exists():
            run = _read_netcdf(_checked(path), path)
            if run.attrs.pop(DESCRIBED, None) != describe_point(point):
                raise ValueError(f"store: {path} holds another point than its name tells; take it away to run it again")
            return run
        return self.failure(point)

    def failure(self, point: Point) -> Failure | None:
        """Why a point failed, None where it did not, or has not been run; raises ValueError as `load`."""
        path = self._path(point, ".json")
        if self._path(point, ".nc").exists() or not path.exists():
            return None
        return _read_failure(path, describe_point(point))

    def keep(self, point: Point, outcome: xr.Dataset | Failure) -> None:
        """Write what became of a point; raises ValueError for a Dataset that would not read back the same."""
        if isinstance(outcome, Failure):
            record = {"point": describe_point(point), **dataclasses.asdict(outcome)}
            _write_json(self._path(point, ".json"), {**record, "sha256": _digest(record)})
            return
        if ERROR in outcome.variables or ERROR in outcome.dims:
            raise ValueError(f"measure: must not return {ERROR!r}, by which a sweep tells the points that failed")
        run = outcome.assign_attrs({DESCRIBED: describe_point(point)})
        with _beside(self._path(point, ".nc")) as part:
            content = _write_netcdf(run, part)
            if not _read_netcdf(content, part).identical(run):
                raise ValueError("measure: what it returns does not survive netCDF; keep numbers and texts")
            with part.open("ab") as file:
                file.write(sha256(content).digest())

    def forget(self, point: Point) -> None:
        """Take away the record of a point that failed."""
        self._path(point, ".json").unlink(missing_ok=True)

    def _path(self, point: Point, suffix: str) -> Path:
        return self.folder / (sha256(describe_point(point).encode()).hexdigest()[:32] + suffix)


def open_store(
    path: str | os.PathLike[str], build: Callable[..., Any], until: float, measure: Callable[..., Any] | None
) -> Store:
    """The store in a folder, which is made where there is none, in one that is there.

    Its manifest tells what decides the numbers beside the point: the names of build and measure, until (s), and
    hertzlink's version. Raises ValueError where these differ, for a folder that holds anything else or cannot be
    written, and for functions without a name of their own.
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
            raise ValueError(f"store = {str(path)!r}: must be a folder that can be written; {folder.parent} is none")
        folder.mkdir(exist_ok=True)
        names = sorted(os.listdir(folder))
        for name in names:
            if not OURS.fullmatch(name):
                raise ValueError(f"store: {folder / name} is no part of a sweep; give the store a folder of its own")
        if MANIFEST not in names:
            if any(not name.startswith(".") for name in names):
                raise ValueError(f"store: {folder / MANIFEST} is missing, but there are points; give another folder")
            _write_json(folder / MANIFEST, manifest)
    except OSError as error:
        raise ValueError(f"store = {str(path)!r}: must be a folder that can be written; {error.strerror}") from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ValueError(f"store = {str(path)!r}: must be a folder that can be written; it may be read only")
    _compare(folder / MANIFEST, manifest)
    _sweep_up(folder)
    return Store(folder)


def describe_point(point: Point) -> str:
    """A point as text that tells it from others, the same in every process; raises ValueError as `describe`."""
    plain = {name: describe(name, value) for name, value in point.items()}
    return json.dumps(plain, sort_keys=True, ensure_ascii=False)


def describe(name: str, value: object) -> Any:
    """A value as plain data that tells it from others; of an object its class and what builds it.

    Raises ValueError for an object whose state cannot be told, such as a function or a Structure.
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
        "Material) where a store is used; let build make it from such"
    )


def _named(name: str, function: Callable[..., Any]) -> str:
    known = getattr(function, "__qualname__", "<lambda>")
    if "<lambda>" in known or inspect.ismethod(function):
        raise ValueError(f"{name} = {reprlib.repr(function)}: must have a name (def) where a store is used")
    return f"{function.__module__}.{known}"


def _compare(path: Path, manifest: Mapping[str, Any]) -> None:
    stored = _read_json(path)
    if stored.get("format") != FORMAT or (stored.get("version") == VERSION and stored.keys() != manifest.keys()):
        raise ValueError(f"store: {path} is not of a sweep, or damaged; give another folder")
    for key, value in manifest.items():
        if stored.get(key) != value:
            told = f"{key} = {short(stored.get(key))}, now it is {short(value)}"
            raise ValueError(f"store: {path} has {told}; give another folder")


def _sweep_up(folder: Path) -> None:
    """Take away what a sweep that was killed had half written; another sweep may be writing what is younger."""
    for part in folder.glob(".*.part"):
        with suppress(FileNotFoundError):
            if time.time() - part.stat().st_mtime > LEFT_OVER:
                part.unlink()


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    """A file to fill that then takes the path's place, in one step."""
    part = path.with_name(f".{uuid4().hex}.part")
    try:
        yield part
        with part.open("rb+") as file:
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _write_json(path: Path, record: Mapping[str, Any]) -> None:
    with _beside(path) as part:
        part.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _read_json(path: Path) -> dict[str, Any]:
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        if isinstance(record, dict):
            return record
    except (OSError, ValueError):
        pass
    raise ValueError(f"store: {path} is not of a sweep, or damaged; take it away, or give another folder")


def _read_failure(path: Path, described: str) -> Failure:
    record = _read_json(path)
    if record.pop("sha256", None) != _digest(record) or record.get("point") != described:
        raise ValueError(f"store: {path} is not of a sweep, or damaged; take it away, and its point is run again")
    return Failure(record["kind"], record["message"])


def _digest(record: Mapping[str, Any]) -> str:
    return sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def _write_netcdf(run: xr.Dataset, path: Path) -> bytes:
    plain = {
        name: {"_FillValue": None} for name, variable in run.variables.items() if "_FillValue" not in variable.attrs
    }
    try:
        run.to_netcdf(path, engine="h5netcdf", encoding=plain)
    except (AttributeError, TypeError, ValueError, CompatibilityError) as error:
        raise ValueError(f"measure: returns what netCDF cannot hold ({error}); keep numbers and texts") from error
    return path.read_bytes()


def _checked(path: Path) -> bytes:
    """The netCDF file in a point's file."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"store: {path} cannot be read; {error.strerror}") from error
    if sha256(data[:-DIGEST]).digest() != data[-DIGEST:]:
        raise ValueError(f"store: {path} is not of a sweep, or damaged; take it away, and its point is run again")
    return data[:-DIGEST]


def _read_netcdf(content: bytes, path: Path) -> xr.Dataset:
    """Numbers as they were: nothing is decoded into dates or masked."""
    with xr.open_dataset(BytesIO(content), engine="h5netcdf", decode_times=False, mask_and_scale=False) as file:
        return file.load().drop_encoding()
