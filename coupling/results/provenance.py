"""The provenance of a result: its input and the versions of what made it, as text in the attributes of a Dataset."""

import json
import platform
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import groupby
from typing import Any

from structures.checks import count_of, short

PACKAGES = ("hertzlink", "numpy", "scipy", "numba", "scikit-fem", "xarray")

MOST_BEADS = 1_000_000  # Of a chain in a file.
DIGEST = re.compile("(SHA-256 )?[0-9a-f]{64}")  # What stands for long lists of numbers.

ADDRESS = re.compile(" at 0x[0-9a-fA-F]+")


def provenance(inputs: Mapping[str, Any]) -> dict[str, str]:
    """Return the input and versions as text, for the attributes of a Dataset."""
    return {"input": as_text(inputs), "versions": json.dumps(versions())}


def as_text(inputs: Mapping[str, Any]) -> str:
    """Return the input as JSON, the same in every process: what is no plain data by its repr, without addresses; see
    `folded`."""
    text = json.dumps(folded(inputs), default=lambda value: ADDRESS.sub("", repr(value)), ensure_ascii=False)
    if "NaN" not in text and "Infinity" not in text:
        return text
    # JSON knows neither: they become text.
    return json.dumps(json.loads(text, parse_constant=str), ensure_ascii=False, allow_nan=False)


def folded(data: Any) -> Any:
    """Return the plain data in which equal neighbours among the beads of a chain stand once, with their count."""

    def rows(beads: list[Any]) -> list[Any]:
        # By their text: numbers that are equal may differ in sign or type.
        texts = {number: repr(bead) for number, bead in {id(bead): bead for bead in beads}.items()}
        groups = [list(many) for _, many in groupby(beads, lambda bead: texts[id(bead)])]
        return [group[0] if len(group) == 1 else {"count": len(group), "bead": group[0]} for group in groups]

    return _with_beads(data, rows)


def stored(text: object) -> dict[str, Any]:
    """Return input or versions from the text that a Dataset holds, each bead by itself; empty where it is nothing that
    `as_text` wrote."""

    def beads(rows: list[Any]) -> list[Any]:
        counts = [row["count"] if isinstance(row, Mapping) and row.keys() == {"count", "bead"} else 1 for row in rows]
        if not all(isinstance(count, int) for count in counts) or sum(counts) > MOST_BEADS:
            raise ValueError(f"beads: must be at most {MOST_BEADS}")
        return [bead for row, n in zip(rows, counts, strict=True) for bead in ([row["bead"]] * n if n > 1 else [row])]

    try:
        data = _with_beads(text if isinstance(text, Mapping) else json.loads(text), beads)  # type: ignore[arg-type]
    except (TypeError, ValueError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


def _with_beads(data: Any, change: Callable[[list[Any]], list[Any]]) -> Any:
    """Return plain data in which each list of beads is changed."""
    if isinstance(data, Mapping):
        return {
            name: change(value) if name == "beads" and isinstance(value, list) else _with_beads(value, change)
            for name, value in data.items()
        }
    return [_with_beads(value, change) for value in data] if isinstance(data, list | tuple) else data


def differences(first: Any, second: Any, name: str = "") -> Iterator[str]:
    """Yield the differences of two pieces of plain data, in words."""
    if isinstance(first, dict) and isinstance(second, dict):
        for key in dict.fromkeys([*first, *second]):
            yield from differences(first.get(key), second.get(key), f"{name}.{key}" if name else key)
    elif isinstance(first, list) and isinstance(second, list) and len(first) == len(second):
        for number, pair in enumerate(zip(first, second, strict=True)):
            yield from differences(*pair, f"{name}[{number}]")
    elif isinstance(first, list) and isinstance(second, list):
        yield f"{name} has {count_of(len(first), 'entry')} there and {len(second)} here"
    elif first != second and DIGEST.fullmatch(str(first)):
        yield f"{name} not the same, of which only a checksum is stored"
    elif first != second:
        yield f"{name} = {short(first)} there and {short(second)} here"


def version_of(package: str) -> str:
    """Return the version of an installed package, or "not installed"."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


@cache
def versions() -> dict[str, str]:
    """Return the versions of Python, hertzlink and what its numbers depend on."""
    return {"python": platform.python_version(), **{package: version_of(package) for package in PACKAGES}}
