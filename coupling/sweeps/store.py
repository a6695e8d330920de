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
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from coupling.files import plain
from coupling.files.loading import path_of
from coupling.files.locks import Lock, NoLocks
from coupling.files.writing import PART, read_regular, remove_if_old, write_whole
from coupling.results.provenance import differences, versions
from coupling.sweeps.outside import outside_of
from structures.checks import short

Point = Mapping[str, Any]

FORMAT, VERSION = "hertzlink sweep", 2

MANIFEST = "sweep.json"
"""Describes what the points of a folder have in common."""

OWN_FILES = re.compile(r"[0-9a-f]{32}\.point|sweep\.json|\..*")
"""Files of a store: a point, the manifest; hidden files belong to the system or are incomplete."""

HEAD = b"hertzlink point 1\n"
"""First line of a point's file. The SHA-256 of all that follows stands in the second; then comes plain data."""

SUM = 65
"""Length of the line with the sum, bytes."""

ERROR_VARIABLE = "error"
"""Variable of a sweep that reports which points failed."""


@dataclasses.dataclass(frozen=True)
class Failure:
    """A point that could not be run: the type and the text of the error."""

    kind: str
    message: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.message}"


TYPES = plain.own_types(Failure)


@dataclasses.dataclass(frozen=True)
class Store:
    """Finished points, found by their own description: if axes grow, earlier points are still found.

    Several sweeps may share a store, also at the same time: a file appears in one step, and who runs a point claims it.
    findings: what the user should know of the points that are there.
    """

    folder: Path
    findings: tuple[str, ...] = ()

    def holds(self, point: Point) -> bool:
        """Return whether the point has been run, or failed."""
        return self._path(point, ".point").exists()

    def claim(self, point: Point, wait: bool = False) -> Lock | None:
        """Return the right to run a point, to be released; None if another process has it. wait: until it is free.

        A claim ends with its process. After it was taken, the point may have been run: `holds` says so.
        """
        lock = Lock(self._path(point, ".lock", hidden=True))
        try:
            return lock if lock.take(wait) else None
        except NoLocks as error:
            raise ValueError(
                f"store: {self.folder}: {error.strerror}, so two sweeps would run the same points; give another "
                "folder, such as one on a local disk"
            ) from error
        except OSError as error:
            raise ValueError(f"store: {self.folder} cannot be written; {error.strerror}") from error

    def load(self, point: Point) -> xr.Dataset | Failure | None:
        """Return the outcome of a point, None if it has not been run; raise a ValueError for a damaged or foreign
        file."""
        path = self._path(point, ".point")
        if not path.exists():
            return None
        described, outcome = _read(path)
        if described != describe_point(point):
            raise ValueError(
                f"store: {path} holds a different point than its name says; delete it to run the point again"
            )
        return outcome

    def failure(self, point: Point) -> Failure | None:
        """Return why a point failed; None if it did not fail or has not been run; raises ValueError as `load`."""
        outcome = self.load(point)
        return outcome if isinstance(outcome, Failure) else None

    def keep(self, point: Point, outcome: xr.Dataset | Failure) -> None:
        """Write the outcome of a point; raises ValueError for a Dataset that is no plain data."""
        if not isinstance(outcome, Failure) and (ERROR_VARIABLE in outcome.variables or ERROR_VARIABLE in outcome.dims):
            raise ValueError(
                f"measure: must not return {ERROR_VARIABLE!r}, the variable in which a sweep reports failed points"
            )
        record = describe_point(point), outcome if isinstance(outcome, Failure) else _as_record(outcome)
        try:
            content = plain.to_bytes(record, TYPES)
        except plain.NotPlain as error:
            raise ValueError(f"measure: its result {error}; return numbers and text only") from None
        write_whole(self._path(point, ".point"), HEAD + sha256(content).hexdigest().encode() + b"\n" + content)

    def forget(self, point: Point) -> None:
        """Delete the record of a failed point."""
        self._path(point, ".point").unlink(missing_ok=True)

    def _path(self, point: Point, suffix: str, hidden: bool = False) -> Path:
        return self.folder / ("." * hidden + sha256(describe_point(point).encode()).hexdigest()[:32] + suffix)


def open_store(
    path: str | os.PathLike[str], build: Callable[..., Any], until: float, measure: Callable[..., Any] | None
) -> Store:
    """Return the store in a folder. The folder is created if necessary, in a parent folder that exists.

    Its manifest holds what fixes the numbers, except the point: the names of build and measure, what they use from
    outside, until (s), and the version of hertzlink. Raises ValueError if these differ, for a folder that holds
    anything else or cannot be written, and for functions without a name of their own. If the code of build or measure
    differs, that is a finding of the store.
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
    manifest |= outside_of([build] if measure is None else [build, measure])._asdict()
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
            text = json.dumps({**manifest, "sha256": _digest(manifest)}, indent=1, ensure_ascii=False)
            write_whole(folder / MANIFEST, (text + "\n").encode())
    except OSError as error:
        raise ValueError(f"store = {str(path)!r}: must be a writable folder; {error.strerror}") from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ValueError(f"store = {str(path)!r}: must be a writable folder; it is perhaps read-only")
    findings = _compare(folder / MANIFEST, manifest)
    # Of a killed sweep; younger ones may belong to another sweep that is running.
    for part in folder.glob(f".*{PART}"):
        remove_if_old(part)
    return Store(folder, findings)


def describe_point(point: Point) -> str:
    """Return a point as a unique text, the same in every process; raises ValueError as `describe`."""
    plain = {name: describe(name, value) for name, value in point.items()}
    return json.dumps(plain, sort_keys=True, ensure_ascii=False)


def describe(name: str, value: object) -> Any:
    """Return a value as plain data that identifies it; for an object its class and the arguments that build it.

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
    qualified = getattr(function, "__qualname__", "<lambda>")
    if "<lambda>" in qualified or inspect.ismethod(function):
        raise ValueError(f"{name} = {reprlib.repr(function)}: must have a name (def) if a store is used")
    return f"{function.__module__}.{qualified}"


def _compare(path: Path, manifest: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the findings where only the code has changed; raise a ValueError for all else that has."""
    stored = _read_json(path)
    if stored.get("format") == FORMAT:
        _same(path, "version", stored.get("version"), VERSION)
    if stored.pop("sha256", None) != _digest(stored) or stored.keys() != manifest.keys():
        raise ValueError(f"store: {path} is not of a sweep, or damaged; give another folder")
    for name in [name for name in manifest if name not in ("data", "code")]:
        _same(path, name, stored[name], manifest[name])
    for name in sorted(stored["data"].keys() & manifest["data"].keys()):
        before, now = stored["data"][name], manifest["data"][name]
        change = None if before == now else next(differences(json.loads(before), json.loads(now), name), None)
        if change is not None:
            raise ValueError(f"store: {path} was made with other data: {change}; use another folder")
    if None in (stored["code"], manifest["code"]) or stored["code"] == manifest["code"]:
        return ()
    return (
        f"store: the code of build or measure is not that with which {path.parent} was begun, and its points stay as "
        "they are; use another folder if the change matters to them",
    )


def _same(path: Path, name: str, stored: Any, now: Any) -> None:
    if stored != now:
        raise ValueError(f"store: {path} has {name} = {short(stored)}, now it is {short(now)}; use another folder")


def _read_json(path: Path) -> dict[str, Any]:
    try:
        record = json.loads(read_regular(path).decode())
        if isinstance(record, dict):
            return record
    except (OSError, RecursionError, ValueError):
        pass
    raise ValueError(f"store: {path} is not of a sweep, or damaged; take it away, or give another folder")


def _digest(record: Mapping[str, Any]) -> str:
    return sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def _as_record(run: xr.Dataset) -> dict[str, Any]:
    """Return a Dataset as plain data."""
    variables = {name: _as_parts(variable) for name, variable in run.variables.items()}
    return {"variables": variables, "coordinates": list(run.coords), "attrs": dict(run.attrs)}


def _as_parts(variable: xr.Variable) -> tuple[Any, ...]:
    """Return the dimensions, numbers and attributes; text of any length as a list."""
    values = np.asarray(variable.values)
    is_text = values.dtype == object and all(isinstance(text, str) for text in values.flat)
    content = (values.shape, list(values.flat)) if is_text else values
    return tuple(variable.dims), content, dict(variable.attrs)


def _as_dataset(record: Any) -> xr.Dataset:
    def parts(name: Any) -> tuple[Any, ...]:
        dimensions, content, attrs = record["variables"][name]
        if isinstance(content, tuple):
            content = np.array(content[1], object).reshape(content[0])
        return dimensions, content, attrs

    coordinates = set(record["coordinates"])
    data = {name: parts(name) for name in record["variables"] if name not in coordinates}
    return xr.Dataset(data, {name: parts(name) for name in record["coordinates"]}, record["attrs"])


def _read(path: Path) -> tuple[str, xr.Dataset | Failure]:
    """Return the description of a point and its outcome."""
    try:
        data = read_regular(path)
    except OSError as error:
        raise ValueError(f"store: {path} cannot be read; {error.strerror}") from error
    content = data[len(HEAD) + SUM :]
    if data != HEAD + sha256(content).hexdigest().encode() + b"\n" + content:
        raise ValueError(f"store: {path} is not of a sweep, or damaged; take it away, and its point is run again")
    try:
        described, outcome = plain.from_bytes(content, TYPES)
        return described, outcome if isinstance(outcome, Failure) else _as_dataset(outcome)
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f"store: {path} {error}; take it away, and its point is run again") from None
