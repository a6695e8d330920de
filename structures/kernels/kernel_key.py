"""The key under which a compiled kernel is kept: its types, and all code of a user's own pieces among them.

Numba keeps kernels by their types. The type of a piece does not change where a user edits its functions, and the kernel
compiled before would run.
"""

import sys
from collections.abc import Iterator
from functools import reduce
from hashlib import sha256
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba import types

OURS = "structures", "particles", "coupling"
"""Packages whose folders `kernels` hold functions that call each other: a checksum of their sources is kept."""

LIBRARIES = "builtins", "math", "numba", "numpy"
"""What Numba compiles by its own code; its version is a part of that checksum."""


def key_of(signature: Any) -> str | None:
    """Return the types of a kernel's arguments as text, with a checksum of the code of a user's own pieces.

    Returns None where a piece cannot be found again by its name, as in a notebook: it is kept in no file.
    """
    texts = [str(signature)]
    for piece in dict.fromkeys(pieces_in(signature)):
        texts.append(f"{piece.__module__}.{piece.__qualname__}{piece._fields}")
        if piece.__module__.partition(".")[0] not in OURS:
            if not _is_importable(piece):
                return None
            texts.append(sha256("\n".join(_texts(piece, set())).encode()).hexdigest())
    return " ".join(texts)


def pieces_in(kind: Any) -> Iterator[Any]:
    """Return the classes of all pieces in a type, or in a tuple of types."""
    if isinstance(kind, types.BaseNamedTuple):
        yield kind.instance_class  # type: ignore[attr-defined]
    if isinstance(kind, tuple | types.BaseTuple):
        for part in kind:  # type: ignore[union-attr]
            yield from pieces_in(part)


def _is_importable(piece: Any) -> bool:
    """Return whether another process finds the class by its name."""
    module = sys.modules.get(piece.__module__)
    if piece.__module__ == "__main__" or not getattr(module, "__file__", None):
        return False
    try:
        return reduce(getattr, piece.__qualname__.split("."), module) is piece
    except AttributeError:
        return False


def _texts(thing: Any, seen: set[int]) -> Iterator[str]:
    """Yield all that compiled code takes from a class, a function, code or a constant, as text; nothing twice."""
    thing = getattr(thing, "py_func", thing)
    if isinstance(thing, np.ndarray):
        yield f"{thing.dtype}{thing.shape}{thing.tobytes().hex()}"
    elif isinstance(thing, tuple):
        for part in thing:
            yield from _texts(part, seen)
    elif not isinstance(thing, CodeType | FunctionType | type):
        yield repr(thing)
    elif id(thing) not in seen and not _is_known(thing):
        seen.add(id(thing))
        if isinstance(thing, type):
            yield from _of_class(thing, seen)
        elif isinstance(thing, FunctionType):
            yield from _of_function(thing, seen)
        else:
            yield f"{thing.co_code.hex()}{thing.co_names}"
            yield from _texts(thing.co_consts, seen)


def _is_known(thing: Any) -> bool:
    """Return whether the checksum of our sources, or the version of a library, stands for it."""
    name = thing.__name__ if isinstance(thing, ModuleType) else str(getattr(thing, "__module__", ""))
    return name.partition(".")[0] in (*OURS, *LIBRARIES)


def _of_class(piece: type, seen: set[int]) -> Iterator[str]:
    for base in piece.__mro__:
        for name, member in () if _is_known(base) else sorted(vars(base).items()):
            if isinstance(member, staticmethod) and not name.startswith("__"):
                yield name
                yield from _texts(member.__func__, seen)


def _of_function(function: FunctionType, seen: set[int]) -> Iterator[str]:
    yield from _texts((function.__code__, function.__defaults__ or ()), seen)
    for cell in function.__closure__ or ():
        yield from _texts(cell.cell_contents, seen)
    names = sorted(_names(function.__code__))
    for name in names:
        value = function.__globals__.get(name)
        if not isinstance(value, ModuleType):
            yield from () if value is None else _texts((name, value), seen)
        elif not _is_known(value):
            for member in names:
                yield from _texts((member, getattr(value, member, None)), seen)


def _names(code: CodeType) -> set[str]:
    """Return all names of a code and of what is defined in it."""
    return set(code.co_names).union(
        *(_names(constant) for constant in code.co_consts if isinstance(constant, CodeType))
    )
