"""Pieces: a piece is a NamedTuple of arrays whose class holds compiled functions. The class selects the function.

A run compiles only the functions of its own pieces.
"""

from collections.abc import Callable, Sequence
from functools import wraps
from inspect import signature
from typing import Any

from numba import NumbaError, float64, int64, njit, typeof
from numba.extending import overload

from structures.kernels.compiling import OPTIONS

Function = Callable[..., Any]


def by_type(function: Function, small: bool = True, **options: Any) -> Function:
    """Return a function that the class of its first argument selects; use it as a decorator.

    In compiled code and in Python it calls the static method of the same name of that class. function: the default for
    classes without such a method; if it raises NotImplementedError, every class must have one. small: whether it is
    inlined in its callers. options: options of Numba's compiler.
    """
    name, parameters = function.__name__, signature(function)
    default = None if "NotImplementedError" in function.__code__.co_names else function

    def of(piece: type) -> Function:
        method: Function | None = getattr(piece, name, default)
        method = method if callable(method) else default  # a field may have the name
        if method is None:
            raise TypeError(f"{piece.__name__}: needs a static method {name}{parameters}")
        return method

    @wraps(function)
    def call(*arguments: Any) -> Any:
        return of(type(arguments[0]))(*arguments)

    def choose(*arguments: Any) -> Function:
        method = of(arguments[0].instance_class)
        return getattr(method, "py_func", method)

    choose.__signature__ = parameters  # type: ignore[attr-defined]
    # Not strict: a user's functions may have other annotations.
    overload(call, OPTIONS | {"forceinline": small, **options}, strict=False)(choose)
    return call


def check_compiled(piece: Any, names: Sequence[str], numbers: int) -> None:
    """Compile the functions of a piece and of the pieces in it; raise a ValueError that names the one that fails.

    numbers: how many floats follow the piece and the number of the contact in the arguments.
    """
    for field in piece:
        if hasattr(field, "_fields"):
            check_compiled(field, names, numbers)
    for name in names:
        function = getattr(getattr(piece, name, None), "py_func", getattr(piece, name, None))
        try:
            if function is not None:
                njit(function).compile((typeof(piece), int64, *[float64] * numbers))  # type: ignore[no-untyped-call]
        except NumbaError as error:
            reason = [line.strip() for line in str(error).splitlines() if line.strip()][1:2]
            raise ValueError(f"{type(piece).__name__}.{name}: Numba cannot compile it: {' '.join(reason)}") from None
