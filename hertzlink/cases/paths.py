"""Paths of entries in a case, such as structure.layers[1].material; faults at them; a case as TOML text."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from coupling.results.missing_waves import UNTIL
from structures.checks import count_of, short

Path = tuple[str | int, ...]

PART = re.compile(r"""(?:^|\.)(?:([A-Za-z0-9_-]+)|"([^"]*)")|\[(\d+)\]""")

YIELDING = 'law = { kind = "jackson_green" } for the chain'
"""What a case needs for contacts that yield."""

WIDTH = 110
"""Of a line of TOML."""


class Fault(ValueError):
    """A fault at a path of a case."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(path, reason)
        self.path, self.reason = path, " ".join(reason.split())

    def __str__(self) -> str:
        return f"{written(self.path)}: {self.reason}" if self.path else self.reason


class CaseError(ValueError):
    """A fault with its place: `case.toml:12: structure.thickness: must be ...`, complete as it stands."""


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
        text += f"[{part}]" if isinstance(part, int) else f".{_key(part)}"
    return text.removeprefix(".")


def entry(data: Any, path: Sequence[str | int]) -> Any:
    """Return the entry at a path; None where there is none."""
    for part in path:
        inside = isinstance(data, Mapping) and part in data
        if not inside and not (isinstance(data, list) and isinstance(part, int) and part < len(data)):
            return None
        data = data[part]
    return data


def put(data: dict[str, Any], path: Path, value: Any) -> None:
    """Set the entry at a path, in tables that are made where they are missing; a ValueError where that is impossible.

    The name of a material becomes a table like it, so that one of its properties can be set.
    """
    at: Any = data
    for i, part in enumerate(path):
        before = written(path[:i])
        if isinstance(part, int):
            if not isinstance(at, list):
                raise ValueError(f"{before} is no list, so it has no entry [{part}]")
            if part >= len(at):
                raise ValueError(f"{before} has {count_of(len(at), 'entry')}, counted from 0, so no entry [{part}]")
        elif not isinstance(at, dict):
            raise ValueError(f"{before} is no table, so it has no entry {part}")
        if i + 1 == len(path):
            at[part] = value
        elif isinstance(part, int):
            at = at[part]
        else:
            if part == "material" and isinstance(at.get(part), str):
                at[part] = {"like": at[part]}
            at = at.setdefault(part, {})


def shown(value: Any) -> str:
    """Return a value as TOML writes it, in short."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"' if len(value) < 60 else f'"{value[:60]}…"'
    return "a table" if isinstance(value, dict) else short(value)


def of_case(finding: str) -> str:
    """Return a finding of a run, with times and laws as a case has them: until = "0.61 ms", not until = 0.00061 (0.61
    ms)."""
    return UNTIL.sub(r'until = "\1"', finding).replace("law=hl.laws.JacksonGreen() in Chain", YIELDING)


def as_toml(data: Mapping[str, Any]) -> str:
    """Return the text of a case: one section for each table at the top, tables inside them in braces."""
    plain = {name: value for name, value in data.items() if not isinstance(value, Mapping)}
    lines = [f"{_key(name)} = {_value(value)}" for name, value in plain.items() if value is not None]
    for name, table in data.items():
        if not isinstance(table, Mapping):
            continue
        lines += ["", f"[{_key(name)}]"]
        for inner, value in table.items():
            text = _value(value)
            if len(text) > WIDTH and isinstance(value, list | tuple):
                text = "[\n" + "".join(f"    {_value(item)},\n" for item in value) + "]"
            lines += [f"{_key(inner)} = {text}"] if value is not None else []
    return "\n".join(lines).strip() + "\n"


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def _value(value: Any) -> str:
    """Return a value in one line. Numbers keep all their digits."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        # TOML has the escapes of JSON; DEL is the one letter that JSON leaves as it is and TOML refuses.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(name)} = {_value(item)}" for name, item in value.items() if item is not None)
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value if item is not None) + "]"
    return str(value)
