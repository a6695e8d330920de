"""Plain data as bytes, and back: trees of numbers, text and arrays as a line of JSON and the arrays in numpy's format.

Nothing in the bytes names code. Named tuples and dataclasses are rebuilt only if the reader gives their types, without
a call of their constructors.
"""

import dataclasses
import json
import math
from collections.abc import Iterable, Mapping
from functools import cached_property
from io import BytesIO
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from structures.checks import short

Types = Mapping[str, type]

LARGEST_INTEGER = 2**63
"""Integers from here on are written in hexadecimal: Python limits the digits of a decimal one."""

BUILT_IN = (list, dict, set, frozenset, str, bytes, int, float, complex, np.ndarray)
"""Types that hold something in addition to the fields of a dataclass."""

NO_DATA = (
    *(ArithmeticError, AttributeError, LookupError, MemoryError, RecursionError, SyntaxError, TokenError, TypeError),
    ValueError,
)
"""What readers of JSON and of arrays raise for other bytes."""


class NotPlain(ValueError):
    """Something that is no plain data."""


class Unreadable(ValueError):
    """Bytes that are no plain data of the known types."""


def to_bytes(tree: Any, types: Types) -> bytes:
    """Return a tree as bytes. Raises NotPlain for what is neither plain nor one of the types."""
    writer = _Writer(types)
    try:
        text = json.dumps({"tree": writer.node(tree, ""), "arrays": len(writer.arrays)}, allow_nan=False)
    except RecursionError:
        raise NotPlain("is nested too deeply, or contains itself") from None
    file = BytesIO()
    file.write(text.encode("ascii") + b"\n")
    for array in writer.arrays:
        np.lib.format.write_array(file, array, allow_pickle=False)
    return file.getvalue()


def from_bytes(data: bytes, types: Types) -> Any:
    """Return the tree in bytes. Raises Unreadable."""
    file = BytesIO(data)
    try:
        record = json.loads(file.readline())
        arrays = [np.lib.format.read_array(file, allow_pickle=False) for _ in range(record["arrays"])]
        if file.tell() != len(data):
            raise Unreadable(f"holds {len(data)} bytes instead of {file.tell()}")
        return _Reader(types, arrays).value(record["tree"])
    except Unreadable:
        raise
    except NO_DATA as error:
        raise Unreadable(f"is no plain data ({type(error).__name__}: {error})") from None


def own_types(*types: type) -> dict[str, type]:
    """Return the types of hertzlink under the names by which the bytes refer to them; these stay when modules move."""
    return {kind.__name__: kind for kind in types}


class _Writer:
    def __init__(self, types: Types) -> None:
        self.names = {kind: name for name, kind in types.items()}
        self.arrays: list[NDArray[Any]] = []
        self.places: dict[int, int] = {}

    def node(self, value: Any, where: str) -> Any:
        """Return the JSON of a value; `where` it stands in the tree, for messages."""
        kind = type(value)
        if value is None or kind is bool or kind is str:
            return value
        if kind is int:
            return value if abs(value) < LARGEST_INTEGER else {"integer": hex(value)}
        if kind is float:
            return value if math.isfinite(value) else {"float": str(value)}
        if kind is list:
            return self._items(value, where)
        if kind in (tuple, set, frozenset):
            return {kind.__name__: self._items(value, where)}
        if kind is dict:
            pairs = [(self.node(k, where), self.node(v, f"{where}[{k!r}]")) for k, v in value.items()]
            return {"dict": pairs}
        return self._other(value, kind, where)

    def _other(self, value: Any, kind: type, where: str) -> Any:
        if kind is complex:
            return {"complex": [self.node(value.real, where), self.node(value.imag, where)]}
        if kind is bytes:
            return {"bytes": self._array(np.frombuffer(value, np.uint8))}
        if kind is np.ndarray and not value.dtype.hasobject:
            return {"array": self._array(value)}
        if isinstance(value, np.generic) and not value.dtype.hasobject:
            return {"number": self._array(np.array(value))}
        fields = _fields(kind)
        if fields is not None and kind in self.names and _holds_only(value, fields):
            parts = [self.node(getattr(value, name), f"{where}.{name}") for name in fields]
            return {"type": self.names[kind], "fields": parts}
        there = f" at {where}" if where else ""
        raise NotPlain(f"holds{there} {short(value)} ({kind.__qualname__}), which is no plain data")

    def _items(self, values: Iterable[Any], where: str) -> list[Any]:
        return [self.node(item, f"{where}[{i}]") for i, item in enumerate(values)]

    def _array(self, array: NDArray[Any]) -> int:
        """Return the number of an array, which is written once even if the tree holds it several times."""
        if id(array) not in self.places:
            self.places[id(array)] = len(self.arrays)
            self.arrays.append(array)
        return self.places[id(array)]


class _Reader:
    def __init__(self, types: Types, arrays: list[NDArray[Any]]) -> None:
        self.types, self.arrays = types, arrays

    def value(self, node: Any) -> Any:
        if isinstance(node, list):
            return [self.value(item) for item in node]
        if not isinstance(node, dict):
            return node
        if "type" in node:
            return _made(self.types[node["type"]], [self.value(field) for field in node["fields"]])
        ((kind, inner),) = node.items()
        if kind == "dict":
            return {self.value(key): self.value(item) for key, item in inner}
        return _MAKERS[kind](self, inner)

    def _numbered(self, number: Any) -> NDArray[Any]:
        if type(number) is not int or number < 0:
            raise Unreadable("refers to an array that is not there")
        return self.arrays[number]


_MAKERS: dict[str, Any] = {
    "integer": lambda reader, inner: int(inner, 16),
    "float": lambda reader, inner: float(inner),
    "complex": lambda reader, inner: complex(*map(reader.value, inner)),
    "tuple": lambda reader, inner: tuple(map(reader.value, inner)),
    "set": lambda reader, inner: set(map(reader.value, inner)),
    "frozenset": lambda reader, inner: frozenset(map(reader.value, inner)),
    "bytes": lambda reader, inner: reader._numbered(inner).tobytes(),
    "array": lambda reader, inner: reader._numbered(inner),
    "number": lambda reader, inner: reader._numbered(inner)[()],
}


def _fields(kind: type) -> tuple[str, ...] | None:
    """Return the fields of a named tuple or of a dataclass that is derived from nothing else; None for other types."""
    if issubclass(kind, tuple):
        return getattr(kind, "_fields", None)
    if not dataclasses.is_dataclass(kind) or issubclass(kind, BUILT_IN):
        return None
    return tuple(field.name for field in dataclasses.fields(kind))


def _holds_only(value: Any, names: tuple[str, ...]) -> bool:
    """Return whether an object has all of its fields, and nothing else except what it computes from them."""
    others = set(getattr(value, "__dict__", ())) - set(names)
    computed = all(isinstance(getattr(type(value), name, None), cached_property) for name in others)
    return computed and all(hasattr(value, name) for name in names)


def _made(kind: type, values: list[Any]) -> Any:
    """Return an object with these fields, without a call of its own code."""
    names = _fields(kind) or ()
    if len(names) != len(values):
        raise Unreadable(f"holds a {kind.__qualname__} of {len(values)} fields instead of {len(names)}")
    if issubclass(kind, tuple):
        return tuple.__new__(kind, values)
    result = object.__new__(kind)
    for name, value in zip(names, values, strict=True):
        object.__setattr__(result, name, value)
    return result
