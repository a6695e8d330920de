"""A folder that keeps each finished point of a sweep in a netCDF file, so that a sweep can be stopped and continued.

The name of a file is a checksum of all that determines its numbers: the point, the length of the record, the source
code of the builder and of the functions that it calls, the data that these use from outside, and hertzlink's sources.
"""

import dis
import inspect
import json
import os
import sys
import sysconfig
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass
from functools import cache, partial
from hashlib import sha256
from importlib import import_module
from importlib.util import resolve_name
from pathlib import Path
from tempfile import TemporaryFile
from types import CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import joblib
import numpy as np
import xarray as xr

from structures.caution import HOME, OWN_CODE
from structures.checks import short

Point = Mapping[str, Any]

CODE = FunctionType, type, ModuleType
"""Objects that are followed only once. Data may be equal at several places and are followed at each."""

ERROR_VARIABLE = "error"
"""Variable of a sweep that reports which points failed."""


@dataclass(frozen=True)
class Failure:
    """A point that could not be run: the type and the text of the error."""

    kind: str
    message: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.message}"


class Store:
    """The finished points of the sweeps of one builder in a folder, which is made if its parent exists. Sweeps may
    share a folder, even at the same time, because a file appears complete or not at all. inputs: what determines the
    numbers besides the point: the builder, the length of the record and the measure."""

    def __init__(self, folder: str | os.PathLike[str], *inputs: Any) -> None:
        self.folder = Path(folder)
        try:
            self.folder.mkdir(exist_ok=True)
            TemporaryFile(dir=self.folder).close()
        except OSError as error:
            raise ValueError(f"store = {str(folder)!r}: must be a writable folder; {error.strerror}") from error
        self.inputs = [own_sources(), *map(identity, inputs)]

    def path(self, point: Point) -> Path:
        """Return the path of a point's file."""
        text = json.dumps([self.inputs, identity(dict(point))], sort_keys=True)
        return self.folder / f"{sha256(text.encode()).hexdigest()[:32]}.nc"

    def load(self, point: Point) -> xr.Dataset | Failure | None:
        """Return the outcome of a point, None if it has not been run; raise a ValueError for an unreadable file."""
        path = self.path(point)
        try:
            with path.open("rb"):
                data = xr.load_dataset(path, engine="h5netcdf")
        except FileNotFoundError:
            return None
        except (OSError, ValueError, LookupError) as error:
            # Errors of the system, not of the content, have this attribute.
            reason = getattr(error, "strerror", None)
            damaged = f"is damaged ({error}); delete it, so that its point runs again"
            raise ValueError(f"store: {path} {f'cannot be read ({reason})' if reason else damaged}") from error
        failure = data.attrs.pop("failure", None)
        return Failure(*failure) if failure is not None else data

    def keep(self, point: Point, outcome: xr.Dataset | Failure) -> None:
        """Write the outcome of a point; raise a ValueError if a netCDF file cannot hold it."""
        data: xr.Dataset | Failure = outcome
        if isinstance(data, Failure):
            data = xr.Dataset(attrs={"failure": [data.kind, data.message]})
        path = self.path(point)
        part = path.with_name(f".{path.stem}.{os.getpid()}.part")
        try:
            data.to_netcdf(part, engine="h5netcdf")
            os.replace(part, path)
        except TypeError as error:
            raise ValueError(f"measure: returned what a netCDF file cannot hold ({error})") from error
        finally:
            part.unlink(missing_ok=True)


@cache
def own_sources() -> str:
    """Return a checksum of hertzlink's sources: results of different sources must not mix, even on a cluster."""
    digest = sha256()
    for source in sorted(path for room in OWN_CODE for path in Path(room).rglob("*.py")):
        digest.update(f"{source.relative_to(HOME)}\n".encode() + source.read_bytes())
    return digest.hexdigest()


def identity(value: Any, seen: dict[int, Any] | None = None) -> Any:
    """Return plain data that changes with a value. For a function these are its source and the identity of all names.
    seen: the objects that are being followed, and all code that was followed. Raises ValueError for a function without
    source, and for an object that cannot be pickled."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    seen = {} if seen is None else seen
    if id(value) in seen:
        return "as before"
    seen[id(value)] = value
    try:
        return _followed(value, partial(identity, seen=seen))
    finally:
        if not isinstance(value, CODE):
            del seen[id(value)]


def _followed(value: Any, again: Callable[[Any], Any]) -> Any:
    """Return the identity of an object. again: the function for the objects that it holds."""
    if isinstance(value, list | tuple):
        return [again(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): again(item) for key, item in value.items()}
    if isinstance(value, partial):
        return again([value.func, value.args, value.keywords])
    if isinstance(value, MethodType):
        return again([value.__func__, value.__self__])
    if isinstance(value, ModuleType):
        if not _is_users(value.__name__):
            return value.__name__
        names = {*_imports(compile(_source(value), value.__name__, "exec"), value.__package__)} & sys.modules.keys()
        return [_source(value), again([sys.modules[name] for name in sorted(names) if _is_users(name)])]
    if isinstance(value, type):
        if not _is_users(value.__module__):
            return f"{value.__module__}.{value.__qualname__}"
        members = [inspect.unwrap(getattr(one, "fget", one)) for one in vars(value).values()]
        # Methods that a dataclass makes have no source of their own.
        own = [one for one in members if isinstance(one, FunctionType) and one.__code__.co_filename != "<string>"]
        return [_source(value), again([*value.__bases__, *own])]
    # A function that keeps results (functools.cache) or is compiled (numba.njit) wraps the user's function.
    function = inspect.unwrap(value) if callable(value) else None
    if isinstance(function, FunctionType):
        if not _is_users(function.__module__):
            return f"{function.__module__}.{function.__qualname__}"
        # Besides its arguments a function uses its defaults, outer variables, and the modules that it imports itself.
        outer = function.__globals__
        used = {name: outer[name] for name in _names(function.__code__) if name in outer}
        used |= inspect.getclosurevars(function).nonlocals
        for name in _imports(function.__code__, outer.get("__package__")):
            with suppress(ImportError):  # names in a module need not be modules
                used[f"import {name}"] = import_module(name)
        used["defaults"] = [function.__defaults__, function.__kwdefaults__]
        return [_source(function), {name: again(one) for name, one in sorted(used.items())}]
    if is_dataclass(value):
        return again([type(value), {field.name: getattr(value, field.name) for field in fields(value) if field.init}])
    if _is_users(type(value).__module__) and hasattr(value, "__dict__"):
        return again([type(value), vars(value)])
    try:
        return str(joblib.hash(value))
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"store: cannot tell whether {short(value)} changes ({error})") from error


def _names(code: CodeType) -> Iterator[str]:
    """Yield the global names that code loads, inner functions included."""
    yield from (one.argval for one in dis.get_instructions(code) if one.opname in ("LOAD_GLOBAL", "LOAD_NAME"))
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from _names(inner)


def _imports(code: CodeType, package: str | None) -> Iterator[str]:
    """Yield the modules that code imports, and all names from them, inner functions included."""
    steps = [step for step in dis.get_instructions(code) if step.opname != "EXTENDED_ARG"]
    for level, names, step in zip(steps, steps[1:], steps[2:], strict=False):
        if step.opname == "IMPORT_NAME":
            module = resolve_name("." * level.argval + step.argval, package)
            yield from (module, *(f"{module}.{name}" for name in names.argval or ()))
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from _imports(inner, package)


def _source(what: Any) -> str:
    text = ""
    # Python 3.13 shows the text of `python -c` as the source of whatever was made by eval.
    if not isinstance(what, FunctionType) or what.__code__.co_filename != "<string>":
        with suppress(OSError, TypeError):
            text = inspect.getsource(what)
    if not text:
        raise ValueError(
            f"store: the source of {short(what)} cannot be read, so a change would not be noticed; write it into a file"
        )
    return text


def _is_users(module: str) -> bool:
    """Return whether a module is the user's own: not one of Python, of hertzlink, or of an installed package."""
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None:
        return module == "__main__"
    installed = any(Path(file).is_relative_to(folder) for folder in {*sysconfig.get_paths().values()})
    return not installed and not file.startswith(OWN_CODE)
