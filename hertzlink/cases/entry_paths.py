"""Paths of entries in a case, such as structure.layers[1].material, and the entries there."""

from collections.abc import Mapping, Sequence
from typing import Any

from coupling.sweeps.entry_paths import Path, parsed, written
from structures.checks import count_of

__all__ = ["Path", "entry", "has", "parsed", "put", "written"]


def entry(data: Any, path: Sequence[str | int]) -> Any:
    """Return the entry at a path; raise a KeyError where there is none."""
    for part in path:
        inside = isinstance(data, Mapping) and part in data
        if not inside and not (isinstance(data, list) and isinstance(part, int) and part < len(data)):
            raise KeyError(written(path))
        data = data[part]
    return data


def has(data: Any, path: Sequence[str | int]) -> bool:
    """Return whether there is an entry at a path."""
    try:
        entry(data, path)
    except KeyError:
        return False
    return True


def put(data: dict[str, Any], path: Path, value: Any) -> None:
    """Set the entry at a path, in tables that are made where they are missing; a ValueError where that is impossible.

    The name of a material becomes a table like it, so that one of its properties can be set.
    """
    at: Any = data
    for i, part in enumerate(path):
        last = i + 1 == len(path)
        if isinstance(part, int):
            if not isinstance(at, list):
                raise ValueError(f"{written(path[:i])} is no list, so it has no entry [{part}]")
            if part >= len(at):
                raise ValueError(
                    f"{written(path[:i])} has {count_of(len(at), 'entry')}, counted from 0, so no entry [{part}]"
                )
        elif not isinstance(at, dict):
            raise ValueError(f"{written(path[:i])} is no table, so it has no entry {part}")
        if last:
            at[part] = value
        elif isinstance(part, int):
            at = at[part]
        else:
            if part == "material" and isinstance(at.get(part), str):
                at[part] = {"like": at[part]}
            at = at.setdefault(part, {})
