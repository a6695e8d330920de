"""Paths of entries in a case, such as structure.layers[1].material, and the entries there."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from structures.checks import count_of

Path = tuple[str | int, ...]

PART = re.compile(r"""(?:^|\.)(?:([A-Za-z0-9_-]+)|"([^"]*)")|\[(\d+)\]""")


def parsed(text: str) -> Path:
    """Return the path that a text names; raise a ValueError for a text that is none."""
    entries: list[str | int] = []
    at = 0
    while at < len(text):
        part = PART.match(text, at)
        if part is None or (not entries and part[3] is not None):
            raise ValueError(f'"{text}" is no path of an entry; write it as structure.layers[1].material')
        entries.append(int(part[3]) if part[3] is not None else (part[2] if part[1] is None else part[1]))
        at = part.end()
    if not entries:
        raise ValueError("an empty path names nothing; write it as structure.thickness")
    return tuple(entries)


def written(path: Sequence[str | int]) -> str:
    """Return the path as text."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
            continue
        key = part if re.fullmatch(r"[A-Za-z0-9_-]+", part) else f'"{part}"'
        text += f".{key}" if text else key
    return text


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
