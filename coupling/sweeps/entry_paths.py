"""Paths of entries, such as structure.layers[1].material."""

import re
from collections.abc import Sequence

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
