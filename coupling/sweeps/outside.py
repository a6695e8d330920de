"""Inputs of a function besides its arguments: globals, closures and defaults, as text to compare; and its code."""

import ast
import inspect
import json
import sys
import sysconfig
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from types import CellType, CodeType, FunctionType, MemberDescriptorType, ModuleType
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy import sparse

from structures.caution import OWN_CODE

LONGEST_TEXT = 200
"""Characters of a value's JSON that are kept as they are; a longer one is kept as its SHA-256."""

CHANGING = {
    "add", "append", "appendleft", "clear", "extend", "insert", "pop", "popitem", "remove", "setdefault", "update",
}  # fmt: skip
"""Methods that change the list, dictionary or set that they belong to."""


class Outside(NamedTuple):
    """The JSON of each value that functions use from outside, by its name, and the SHA-256 of their code.

    Functions and classes that they name count too, unless they are installed. A value that the code itself changes,
    such as a cache, is left out. The code is None where the source of one is missing.
    """

    data: dict[str, str]
    code: str | None


def outside_of(functions: Iterable[Callable[..., Any]]) -> Outside:
    """Return what these functions use."""
    search = _Search()
    for function in functions:
        search.visit(function)
    data = {label: _text(value) for label, (names, value) in search.values.items() if not names & search.changed}
    code = "\n".join(sorted(map(str, search.sources)))
    return Outside(data, None if None in search.sources else sha256(code.encode()).hexdigest())


class _Search:
    """Goes from functions to all that they name."""

    def __init__(self) -> None:
        self.seen: set[int] = set()
        self.values: dict[str, tuple[set[str], Any]] = {}
        self.sources: list[str | None] = []
        self.changed: set[str] = set()

    def visit(self, function: Any) -> None:
        """Visit a user's function; of one that keeps results, such as functools.cache makes, the function within."""
        function = inspect.unwrap(function)
        if not isinstance(function, FunctionType) or id(function) in self.seen or not _is_users(function.__module__):
            return
        self.seen.add(id(function))
        names, values = set(_names(function.__code__)), dict(_defaults(function))
        values |= {name: function.__globals__[name] for name in names if name in function.__globals__}
        cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
        values |= {name: cell.cell_contents for name, cell in cells if _is_full(cell)}
        tree = _tree(function)
        self.sources.append(None if tree is None else ast.unparse(tree))
        # Without its source, nobody knows whether it changes them. A constructor only sets what it makes.
        changeable = (name for name, value in values.items() if isinstance(value, list | dict | set))
        if function.__name__ != "__init__":
            self.changed.update(changeable if tree is None else _changed(tree))
        for name, value in sorted(values.items()):
            self._take(f"{name} of {function.__name__}", {name}, value, names)

    def _take(self, label: str, path: set[str], value: Any, names: set[str]) -> None:
        """Take a value that code with these names reaches by a path of names."""
        if isinstance(value, ModuleType):
            self._parts(value, label, path, names if _is_users(value.__name__) else set())
        elif isinstance(value, type):
            self._of_class(value)
        elif callable(value) and isinstance(inspect.unwrap(value), FunctionType):
            self.visit(value)
        else:
            self.values[label] = path, value
            for inner in (
                value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
            ):
                self.visit(inner)
            if not is_dataclass(value):
                of_user = _is_users(type(value).__module__)
                self._parts(value, label, path, _attributes(value).keys() if of_user else names)
            self._of_class(type(value))

    def _parts(self, value: Any, label: str, path: set[str], names: Iterable[str]) -> None:
        """Take the attributes of a module or an object that have one of the names."""
        attributes = _attributes(value)
        for name in sorted(set(names) & attributes.keys()):
            inner = attributes[name]
            if id(inner) not in self.seen and not isinstance(inner, ModuleType):
                self._take(f"{label.partition(' of ')[0]}.{name}", {*path, name}, inner, set())

    def _of_class(self, kind: type) -> None:
        """Take the constants and methods of a class."""
        if id(kind) in self.seen or not _is_users(kind.__module__):
            return
        self.seen.add(id(kind))
        for name, value in vars(kind).items():
            method = getattr(value, "fget", None) or getattr(value, "__func__", value)
            if isinstance(method, FunctionType):
                self.visit(method)
            elif _is_data(name, value):
                self.values[f"{kind.__name__}.{name}"] = {name}, value


def _is_data(name: str, value: Any) -> bool:
    return not name.startswith("_") and not callable(value) and not hasattr(value, "__get__")


def _attributes(value: Any) -> dict[str, Any]:
    """Return the names of a module, or the data of an object: in its dictionary, in slots, and what its class holds for
    it."""
    attributes: dict[str, Any] = dict(getattr(value, "__dict__", {}))
    for kind in type(value).__mro__ if _is_users(type(value).__module__) else ():
        for name, content in vars(kind).items():
            if (isinstance(content, MemberDescriptorType) or _is_data(name, content)) and hasattr(value, name):
                attributes.setdefault(name, getattr(value, name))
    return attributes


@cache
def _is_users(module: str) -> bool:
    """Return whether a module is neither Python's nor hertzlink's, nor installed."""
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None:
        return module == "__main__"
    installed = any(Path(file).is_relative_to(folder) for folder in {*sysconfig.get_paths().values()})
    return not installed and not file.startswith(OWN_CODE)


def _names(code: CodeType) -> Iterator[str]:
    """Yield the global names and the attributes that code uses, inner functions included."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _defaults(function: FunctionType) -> Iterator[tuple[str, Any]]:
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.default is not parameter.empty:
            yield f"default {name}", parameter.default


def _is_full(cell: CellType) -> bool:
    """Return whether a variable of an outer function has a value yet."""
    try:
        return cell.cell_contents is not cell
    except ValueError:
        return False


def _tree(function: FunctionType) -> ast.Module | None:
    """Return the code without docstrings and comments, None where its source is missing or cannot stand alone."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except (OSError, SyntaxError, TypeError):
        return None
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and len(body) > 1 and ast.unparse(body[0])[:1] in ("'", '"'):
            del body[0]
    return tree


def _changed(tree: ast.Module) -> Iterator[str]:
    """Yield the names of what code assigns to from inside, or changes in place."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Global | ast.Nonlocal):
            yield from node.names
        elif isinstance(node, ast.Subscript | ast.Attribute) and not isinstance(node.ctx, ast.Load):
            yield from _ends_of(node)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in CHANGING:
            yield from _ends_of(node.func.value)


def _ends_of(node: ast.AST) -> Iterator[str]:
    """Yield the names in `name[…]`, `name.attribute` and mixtures of both."""
    while isinstance(node, ast.Subscript | ast.Attribute):
        if isinstance(node, ast.Attribute):
            yield node.attr
        node = node.value
    if isinstance(node, ast.Name):
        yield node.id


def _text(value: Any) -> str:
    text = json.dumps(_plain(value), sort_keys=True, ensure_ascii=False)
    return text if len(text) <= LONGEST_TEXT else json.dumps(f"SHA-256 {sha256(text.encode()).hexdigest()}")


def _plain(value: Any) -> Any:
    """Return a value as plain data, the same in every process; of what cannot be described, its type."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic | list | tuple):
        return _plain(value.item()) if isinstance(value, np.generic) else [_plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, set | frozenset):
        return sorted(json.dumps(_plain(item), sort_keys=True) for item in value)
    kind = f"{type(value).__module__}.{type(value).__qualname__}"
    if isinstance(value, np.ndarray):
        if value.dtype == object:
            return [kind, _plain(value.tolist())]
        return [value.dtype.str, value.shape, sha256(np.ascontiguousarray(value).tobytes()).hexdigest()]
    if sparse.issparse(value):
        rows = sparse.csr_array(value)
        return [kind, rows.shape, *map(_plain, (rows.data, rows.indices, rows.indptr))]
    if isinstance(value, xr.Dataset):
        return [kind, {str(name): _plain(variable.values) for name, variable in value.variables.items()}]
    if hasattr(value, "__array__") and not isinstance(value, type):
        return [kind, _plain(np.asarray(value))]
    if is_dataclass(value) and not isinstance(value, type):
        return [kind, {field.name: _plain(getattr(value, field.name)) for field in fields(value) if field.init}]
    return kind
