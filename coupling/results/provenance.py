"""Where a result comes from: its input and the versions of what made it, as text in the attributes of a Dataset."""

import json
import platform
import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import zip_longest
from typing import Any

from structures.checks import LONGEST_VALUE_TEXT, count_of

PACKAGES = ("hertzlink", "numpy", "scipy", "numba", "scikit-fem", "xarray")

DIGEST = re.compile("(SHA-256 )?[0-9a-f]{64}")
"""What stands for long lists of numbers."""

BEFORE = 15
"""Letters that a message shows before the first difference of two long texts."""

ADDRESS = re.compile(" at 0x[0-9a-fA-F]+")


def provenance(given: Mapping[str, Any]) -> dict[str, str]:
    """Input and versions as text, for the attributes of a Dataset."""
    return {"input": as_text(given), "versions": _versions()}


def as_text(given: Mapping[str, Any]) -> str:
    """Input as JSON, the same in every process: what is no plain data by its repr, without addresses."""
    text = json.dumps(given, default=lambda value: ADDRESS.sub("", repr(value)), ensure_ascii=False)
    if "NaN" not in text and "Infinity" not in text:
        return text
    # JSON knows neither: they become text.
    return json.dumps(json.loads(text, parse_constant=str), ensure_ascii=False, allow_nan=False)


def stored(text: object) -> dict[str, Any]:
    """Input or versions from the text that a Dataset holds; empty where it is nothing that `as_text` wrote."""
    if isinstance(text, Mapping):
        return dict(text)
    try:
        found = json.loads(text)  # type: ignore[arg-type]
    except (TypeError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def differences(first: Any, second: Any, name: str = "") -> Iterator[str]:
    """The differences of two pieces of plain data, in words."""
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
        there, here = _apart(repr(first), repr(second))
        yield f"{name} = {there} there and {here} here"


def _apart(first: str, second: str) -> list[str]:
    """Two texts, of long ones the part where they begin to differ."""
    if len(first + second) <= LONGEST_VALUE_TEXT:
        return [first, second]
    apart = next(i for i, (one, other) in enumerate(zip_longest(first, second)) if one != other)
    start = max(0, apart - BEFORE)
    cut = LONGEST_VALUE_TEXT // 2
    return [f"{'…' * (start > 0)}{one[start : start + cut]}{'…' * (len(one) > start + cut)}" for one in (first, second)]


@cache
def _versions() -> str:
    """Read once: the packages' metadata takes longer than many a run."""
    return json.dumps(versions())


def version_of(package: str) -> str:
    """The version of an installed package, or "not installed"."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def versions() -> dict[str, str]:
    """Versions of Python, hertzlink and what its numbers depend on."""
    return {"python": platform.python_version(), **{package: version_of(package) for package in PACKAGES}}
