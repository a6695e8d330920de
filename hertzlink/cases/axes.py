"""The axes of a sweep: paths of entries, their values in SI units, and the names and units of tables."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise
from math import floor, prod
from typing import Any

from pydantic import BaseModel

from coupling.plots.canvas import in_words
from coupling.results.schema import OF_RUNS
from hertzlink.cases.case import Case
from hertzlink.cases.checking import checked, value_at
from hertzlink.cases.entry_paths import Path, parsed, put, written
from hertzlink.cases.faults import Fault
from hertzlink.cases.model import Steps
from hertzlink.cases.parts import notes_of
from hertzlink.cases.plates import RectanglePlate
from hertzlink.cases.units import Unit, shown
from structures.units import NUMBER, factor

MOST_POINTS = 100_000
"""Points of a sweep; a case of more is a mistake."""

OWN_NAMES = OF_RUNS | {"sensor", "distance", "within", "end", "error"}
"""Names that results use themselves."""

PLACES = {0: "distance from the left edge", 1: "distance from the bottom edge"}
"""The two numbers of the place `at` of a contact on a rectangular plate."""

SECTIONS = ("chain", "structure", "behind", "materials")
"""What can be varied. The section [run] holds for all runs."""


@dataclass(frozen=True)
class Axis:
    """An entry that varies: its path, its name in results, its values (SI), the unit of tables and its size in SI.

    words: what it is, for figures.
    """

    path: Path
    name: str
    values: list[Any]
    unit: str = ""
    size: float = 1.0
    si: str = ""
    words: str = ""

    @property
    def is_number(self) -> bool:
        """True if the values are numbers."""
        return all(isinstance(one, int | float) for one in self.values)

    def shown(self, value: Any) -> str:
        """Return a value in the unit of tables."""
        if not isinstance(value, int | float):
            return str(value)
        return f"{value / self.size:.6g}" if self.unit else f"{value:.6g}"

    @property
    def head(self) -> str:
        """Name and unit, for the head of a table."""
        label = _label(self.path)
        return f"{label}, {self.unit}" if self.unit else label


def axes_of(case: Case) -> list[Axis]:
    """Return the axes of the section [sweep], those of the structure first: runs that share it share a process."""
    given = case.model.sweep or {}
    axes: list[Axis] = []
    for key, entry in given.items():
        path = path_of(key, ("sweep", key))
        if any(axis.path == path for axis in axes):
            raise Fault(("sweep", key), "is given twice")
        values = _steps(case, path, key, entry) if isinstance(entry, Steps) else _values(case, path, key, entry)
        texts = [*(case.data["sweep"][key] if isinstance(entry, list) else case.data["sweep"][key].values())]
        unit, size, si = unit_at(case, path, values[0], texts)
        axes.append(Axis(path, _name(path, axes), values, unit, size, si, words_of(case, path)))
    if (count := prod(len(one.values) for one in axes)) > MOST_POINTS:
        raise Fault(("sweep",), f"has {count} points; at most {MOST_POINTS}")
    return sorted(axes, key=lambda one: one.path[0] == "chain")


def path_of(key: str, place: Path) -> Path:
    """Return the path that a key names; a Fault at its place."""
    try:
        path = parsed(key)
    except ValueError as error:
        raise Fault(place, str(error)) from None
    if path[0] not in SECTIONS or len(path) < 2:
        raise Fault(place, f'"{key}" cannot be varied; take an entry of [chain] or [structure]')
    return path


def si_value(case: Case, path: Path, given: Any, place: Path) -> Any:
    """Return the value (SI) that an entry gets from a number or a text; a Fault at its place where it is refused."""
    if not isinstance(given, int | float | str) or isinstance(given, bool):
        raise Fault(place, f"{shown(given)} must be a number or a text")
    changed = case.changed({})
    try:
        put(changed.data, path, given)
        found = value_at(checked(changed.data), path)
    except Fault as fault:
        reason = fault.reason if fault.path == path else f"makes {written(fault.path)}: {fault.reason}"
        raise Fault(place, reason) from None
    except ValueError as error:
        raise Fault(place, str(error)) from None
    return found if isinstance(found, int | float | str) else given


def unit_at(case: Case, path: Path, value: Any, texts: Iterable[Any]) -> tuple[str, float, str]:
    """Return the unit that a user wrote, or that of the entry; its size in SI units; and the SI unit."""
    changed = case.changed({})
    put(changed.data, path, value)
    at: Any = checked(changed.data)
    notes: list[Any] = []
    for part in path:
        if isinstance(at, BaseModel):
            notes = notes_of(type(at).model_fields[str(part)])
        at = value_at(at, (part,))
    own = [one.unit for one in notes if isinstance(one, Unit)]
    if not own or not own[0]:
        return "", 1.0, ""
    for text in texts:
        found = NUMBER.fullmatch(text) if isinstance(text, str) else None
        if found and found[2]:
            return found[2], float(factor(found[2], own[0])), own[0]
    return own[0], 1.0, own[0]


def _values(case: Case, path: Path, key: str, given: list[Any]) -> list[Any]:
    values = [si_value(case, path, one, ("sweep", key, i)) for i, one in enumerate(given)]
    for i, one in enumerate(values):
        if one in values[:i]:
            raise Fault(("sweep", key, i), f"{shown(given[i])} is given twice")
    return values


def _steps(case: Case, path: Path, key: str, given: Steps) -> list[Any]:
    """Return evenly spaced values; decimal, so that three steps of 10 mm are 30 mm to the last digit."""
    if (given.step is None) == (given.count is None):
        raise Fault(("sweep", key), 'needs a step, such as step = "10 mm", or else a count')
    ends = {name: si_value(case, path, one, ("sweep", key, name)) for name, one in
            (("from", given.start), ("to", given.end))}  # fmt: skip
    whole = all(isinstance(one, int) for one in ends.values())
    for name, one in ends.items():
        if not isinstance(one, int | float):
            raise Fault(("sweep", key, name), f"{shown(one)} must be a number; list the values instead")
    start, end = (Decimal(repr(one)) for one in ends.values())
    if end <= start:
        raise Fault(("sweep", key, "to"), f"{shown(given.end)} must be above the first value")
    if given.count is not None:
        values = [start + (end - start) * i / (given.count - 1) for i in range(given.count)]
    else:
        step = si_value(case, path, given.step, ("sweep", key, "step"))
        if not isinstance(step, int | float) or step <= 0:
            raise Fault(("sweep", key, "step"), f"{shown(given.step)} must be positive")
        count = floor((end - start) / Decimal(repr(step)) * Decimal("1.000000001"))
        if count >= MOST_POINTS:
            raise Fault(("sweep", key, "step"), f"{shown(given.step)} makes {count + 1} values; at most {MOST_POINTS}")
        values = [start + i * Decimal(repr(step)) for i in range(count + 1)]
    if whole and all(one == int(one) for one in values):
        return [int(one) for one in values]
    return [float(one) for one in values]


def words_of(case: Case, path: Path) -> str:
    """Return the entry at a path in words, such as "layer 2 Young's modulus"."""
    rectangle = "at" in path and isinstance(value_at(case.model, path[: path.index("at")]), RectanglePlate)
    words = [] if path[0] in ("chain", "structure", "measure") else [str(path[0])]
    for before, part in pairwise(path):
        if isinstance(part, int) and before == "at" and part in PLACES:
            words[-1:] = [PLACES[part] if rectangle else "xy"[part]]
        elif isinstance(part, int):
            words[-1:] = [f"{str(before).removesuffix('s')} {part + 1}"]
        elif part != "material" or part == path[-1]:
            words.append(in_words(part))
    return " ".join(words)


def _label(path: Path) -> str:
    """Return the last part of a path, as a word."""
    last = path[-1]
    if path[-2:-1] == ("at",) and last in (0, 1):
        return "xy"[int(last)]
    return re.sub(r"\W", "_", str(last) if isinstance(last, str) else f"{path[-2]}_{last}")


def _name(path: Path, earlier: Iterable[Axis]) -> str:
    """Return a short name for an axis, which no other has."""
    name = _label(path)
    if name in OWN_NAMES or name in {one.name for one in earlier}:
        return re.sub(r"\W+", "_", written(path)).strip("_")
    return name
