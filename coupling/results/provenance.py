"""The provenance of a result: its input and the versions of the software, as text in the attributes of a Dataset."""

import json
import platform
import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import groupby
from typing import Any

from structures.checks import count_of, short

PACKAGES = ("hertzlink", "numpy", "scipy", "numba", "scikit-fem", "xarray")

MOST_BEADS = 1_000_000  # Most beads of a chain in a file.
DIGEST = re.compile("(SHA-256 )?[0-9a-f]{64}")  # A checksum that stands for a long list of numbers.

ADDRESS = re.compile(" at 0x[0-9a-fA-F]+")


def provenance(inputs: Mapping[str, Any]) -> dict[str, str]:
    """Return the input and versions as text, for the attributes of a Dataset."""
    return {"input": as_text(inputs), "versions": json.dumps(versions())}


def as_text(inputs: Mapping[str, Any]) -> str:
    """Return the input, `folded`, as JSON, the same in every process: objects become their repr without addresses."""
    text = json.dumps(folded(inputs), default=lambda value: ADDRESS.sub("", repr(value)), ensure_ascii=False)
    if "NaN" not in text and "Infinity" not in text:
        return text
    # JSON has no NaN and no infinity: they become text.
    return json.dumps(json.loads(text, parse_constant=str), ensure_ascii=False, allow_nan=False)


def folded(data: Any) -> Any:
    """Return plain data in which equal neighbouring beads of a chain are written once, with their count."""
    if not isinstance(data, Mapping):
        return [folded(value) for value in data] if isinstance(data, list | tuple) else data
    table = {
        name: value if name == "beads" and isinstance(value, list) else folded(value) for name, value in data.items()
    }
    if isinstance(beads := table.get("beads"), list):
        # Beads are compared by their text, because equal numbers may differ in sign or type.
        texts = {number: repr(bead) for number, bead in {id(bead): bead for bead in beads}.items()}
        groups = [list(many) for _, many in groupby(beads, lambda bead: texts[id(bead)])]
        table["beads"] = [many[0] if len(many) == 1 else {"count": len(many), "bead": many[0]} for many in groups]
    return table


def stored(text: object) -> dict[str, Any]:
    """Return input or versions from the text of a Dataset, with each bead written out; empty without such a text."""

    def unfolded(table: dict[str, Any]) -> dict[str, Any]:
        if isinstance(beads := table.get("beads"), list):
            counted = [isinstance(one, dict) and one.keys() == {"count", "bead"} for one in beads]
            rows = [(one["bead"], one["count"]) if many else (one, 1) for one, many in zip(beads, counted, strict=True)]
            if sum(count for _, count in rows) > MOST_BEADS:
                raise ValueError(f"beads: must be at most {MOST_BEADS}")
            table["beads"] = [bead for bead, count in rows for _ in range(count)]
        return table

    try:
        data = text if isinstance(text, dict) else json.loads(text, object_hook=unfolded)  # type: ignore[arg-type]
    except (TypeError, ValueError, RecursionError):
        return {}
    return data if isinstance(data, dict) else {}


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
        yield f"{name} differs, of which only a checksum is stored"
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
    """Return the versions of Python, hertzlink and the packages that its numbers depend on."""
    return {"python": platform.python_version(), **{package: version_of(package) for package in PACKAGES}}
