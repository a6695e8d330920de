"""The axes of a sweep: paths of entries, their values in SI units, and the names and units of tables."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise
from math import floor, prod
from typing import Any

from coupling.plots.canvas import in_words
from coupling.results.schema import OF_RUNS
from hertzlink.cases.case import Case
from hertzlink.cases.forms import alternatives, is_list, items_of
from hertzlink.cases.paths import Fault, Path, parsed, shown, written
from hertzlink.cases.reader import Call, number
from structures.described import Parameter, noted
from structures.quantities import Quantity
from structures.units import NUMBER, factor

MOST_POINTS = 100_000
"""Points of a sweep; a case of more is a mistake."""

VARIED = ("chain", "structure", "behind", "materials")
"""Sections whose entries can vary. The section [run] holds for all runs."""

OWN_NAMES = OF_RUNS | {"sensor", "distance", "within", "end", "error"}
"""Names that results use themselves."""

PLACES = ("distance from the left edge", "distance from the bottom edge")
"""The two numbers of the place `at` of a contact on a rectangular plate."""


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
        return all(isinstance(value, int | float) for value in self.values)

    def shown(self, value: Any, digits: int = 6) -> str:
        """Return a value in the unit of tables."""
        return f"{value / self.size:.{digits}g}" if isinstance(value, int | float) else str(value)

    @property
    def head(self) -> str:
        """Name and unit, for the head of a table."""
        return f"{_label(self.path)}, {self.unit}" if self.unit else _label(self.path)


def axes_of(case: Case) -> list[Axis]:
    """Return the axes of the section [sweep], those of the structure first: runs that share it share a process."""
    axes: list[Axis] = []
    for key, given in case.tree.entries.get("sweep", {}).items():
        path = path_of(key, ("sweep", key))
        if any(axis.path == path for axis in axes):
            raise Fault(("sweep", key), "is given twice")
        if isinstance(given, Call):
            values, texts = _steps(case, path, key, given), [*given.entries.values()]
        else:
            values, texts = [si_value(case, path, value, ("sweep", key, i)) for i, value in enumerate(given)], given
            for i, value in enumerate(values):
                if value in values[:i]:
                    raise Fault(("sweep", key, i), f"{shown(given[i])} is given twice")
        unit, size, si = unit_at(case, path, values[0], texts)
        name = _label(path)
        if name in OWN_NAMES or name in [axis.name for axis in axes]:
            name = re.sub(r"\W+", "_", written(path)).strip("_")
        axes.append(Axis(path, name, values, unit, size, si, words_of(case, path)))
    if (count := prod(len(axis.values) for axis in axes)) > MOST_POINTS:
        raise Fault(("sweep",), f"has {count} points; at most {MOST_POINTS}")
    return sorted(axes, key=lambda axis: axis.path[0] == "chain")


def path_of(key: str, place: Path) -> Path:
    """Return the path that a key names; a Fault at its place."""
    try:
        path = parsed(key)
    except ValueError as error:
        raise Fault(place, str(error)) from None
    if path[0] not in VARIED or len(path) < 2:
        raise Fault(place, f'"{key}" cannot be varied; take an entry of [chain] or [structure]')
    return path


def si_value(case: Case, path: Path, value: Any, place: Path) -> Any:
    """Return the value (SI) that an entry gets from a number or a text; a Fault at its place where it is refused."""
    if not isinstance(value, int | float | str) or isinstance(value, bool):
        raise Fault(place, f"{shown(value)} must be a number or a text")
    try:
        si = case.changed({path: value}).value(path)
    except Fault as fault:
        reason = fault.reason if fault.path == path else f"makes {written(fault.path)}: {fault.reason}"
        raise Fault(place, reason) from None
    except ValueError as error:
        raise Fault(place, str(error)) from None
    return si if isinstance(si, int | float | str) else value


def unit_at(case: Case, path: Path, value: Any, texts: Iterable[Any]) -> tuple[str, float, str]:
    """Return the unit that a user wrote, or that of the entry; its size in SI units; and the SI unit."""
    quantity = quantity_of(case.changed({path: value}).parameter(path))
    si = quantity.unit_in_files if quantity else ""
    for text in texts:
        match = NUMBER.fullmatch(text) if isinstance(text, str) and si else None
        if match and match[2]:
            return match[2], float(factor(match[2], si)), si
    return si, 1.0, si


def quantity_of(parameter: Parameter | None) -> Quantity | None:
    """Return the quantity of a number, also of those in a list."""
    for kind, notes in alternatives(parameter.type, parameter.notes) if parameter else ():
        for note in notes:
            if isinstance(note, Quantity):
                return note
        if is_list(kind) and (inner := quantity_of(Parameter("", *noted(items_of(kind)[0]), None, False))):
            return inner
    return None


def _steps(case: Case, path: Path, key: str, given: Call) -> list[Any]:
    """Return evenly spaced values; decimal, so that three steps of 10 mm are 30 mm to the last digit."""

    def si(name: str) -> Any:
        value = si_value(case, path, given.entries[name], ("sweep", key, name))
        if not isinstance(value, int | float):
            raise Fault(("sweep", key, name), f"{shown(value)} must be a number; list the values instead")
        return value

    if ("step" in given.entries) == ("count" in given.entries):
        raise Fault(("sweep", key), 'needs a step, such as step = "10 mm", or else a count')
    ends = si("from"), si("to")
    start, end = (Decimal(repr(value)) for value in ends)
    if end <= start:
        raise Fault(("sweep", key, "to"), f"{shown(given.entries['to'])} must be above the first value")
    if "count" in given.entries:
        last = given.entries["count"] - 1
        values = [start + (end - start) * i / last for i in range(last + 1)]
    else:
        place, typed = ("sweep", key, "step"), shown(given.entries["step"])
        quantity = quantity_of(case.changed({path: ends[0]}).parameter(path))
        try:
            # A step may lie outside of the range of the values.
            step = number(given.entries["step"], quantity) if quantity else given.entries["step"]
        except ValueError as error:
            raise Fault(place, str(error)) from None
        if not isinstance(step, int | float) or step <= 0:
            raise Fault(place, f"{typed} must be positive")
        wide = Decimal(repr(step))
        count = floor((end - start) / wide * Decimal("1.000000001"))
        if count >= MOST_POINTS:
            raise Fault(place, f"{typed} makes {count + 1} values; at most {MOST_POINTS}")
        values = [start + i * wide for i in range(count + 1)]
    whole = all(isinstance(value, int) for value in ends) and all(value == int(value) for value in values)
    return [int(value) if whole else float(value) for value in values]


def words_of(case: Case, path: Path) -> str:
    """Return the entry at a path in words, such as "layer 2 Young's modulus"."""
    struck = case.value(path[: path.index("at")]) if "at" in path else None
    rectangle = isinstance(struck, Call) and struck.kind in ("kirchhoff_plate", "mindlin_plate")
    words = [] if path[0] in ("chain", "structure", "measure") else [str(path[0])]
    for before, part in pairwise(path):
        if isinstance(part, int) and before == "at" and part < len(PLACES):
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
