"""Families of runs: numbers with a value for each run, and the piece of a single run."""

from typing import Any

from numba.extending import overload

from structures.kernels.duals import Lane, Lanes, as_duals
from structures.kernels.pieces import OPTIONS, Function


def of_run(family: Any, run: int) -> Any:
    """Return the piece of one run: Lanes, however deep they lie in a piece, become its dual numbers."""
    if isinstance(family, tuple):
        parts = [of_run(part, run) for part in family]
        return type(family)(*parts) if hasattr(family, "_fields") else tuple(parts)
    return family


def _text(kind: Any, place: str, pieces: dict[str, Any]) -> str:
    """Return how the source of a function builds the piece of one run from the family's part at a place."""
    piece = getattr(kind, "instance_class", None)
    if piece in (Lanes, Lane):
        return f"as_duals({place}.values, run, {place}.width){'[0]' if piece is Lane else ''}"
    if not hasattr(kind, "types"):
        return place
    parts = ", ".join(_text(part, f"{place}[{i}]", pieces) for i, part in enumerate(kind.types))
    name = f"piece_{len(pieces)}"
    pieces[name] = piece
    return f"{name if piece else ''}({parts}{',' if parts else ''})"


def _choose(family: Any, run: Any) -> Function:
    """Return the compiled form of `of_run` for a type.

    Numba builds a tuple of several types only where the source writes each of its parts; and a function that counts no
    references returns arrays within a tuple only.
    """
    pieces: dict[str, Any] = {"as_duals": as_duals}
    exec(f"def build(family, run):\n    return {_text(family, 'family', pieces)}", pieces)
    build: Function = pieces["build"]
    return build


# Not strict: what is written here has no annotations.
overload(of_run, OPTIONS | {"forceinline": True}, strict=False, target="generic")(_choose)
