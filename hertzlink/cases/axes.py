"""Entries of a case that vary: the axes of [sweep], and others by their paths, with their units and words."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from decimal import Decimal
from itertools import pairwise
from math import floor, inf, prod
from typing import Any

from coupling.plots.canvas import in_words
from coupling.results.schema import OF_RUNS
from hertzlink.cases import Fault, Path, parsed, shown, written
from hertzlink.cases.case import Case
from hertzlink.cases.reader import Call, number
from structures.quantities import Quantity
from structures.units import NUMBER, factor

MOST_POINTS = 100_000  # of a sweep; more are a mistake
VARIED = ("chain", "structure", "materials")  # sections whose entries can vary; [run] holds for all runs
EDGES = ("distance from the left edge", "distance from the bottom edge")  # the place `at` on a rectangular plate


@dataclass(frozen=True)
class Axis:
    """An entry that varies, and its values (SI)."""

    path: Path
    place: Path  # where the case asks for it
    label: str  # in tables
    name: str  # in results
    values: list[Any]
    unit: str = ""  # of tables, with its size in SI units
    size: float = 1.0
    si: str = ""
    words: str = ""  # for figures

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
        return f"{self.label}, {self.unit}" if self.unit else self.label

    @property
    def column(self) -> str:
        """Name and SI unit, for the head of a column in a file."""
        return f"{self.label} ({self.si})" if self.si else self.label


def axes_of(case: Case) -> tuple[Axis, ...]:
    """Return the axes of the section [sweep], the structure's first: runs with equal structures share a process."""
    axes: list[Axis] = []
    reserved = OF_RUNS | {"sensor", "error"}
    if case.measure.critical_distance:
        reserved |= {"distance", "within", "end"}
    for key, given in (case.tree.entries.get("sweep") or {}).items():
        axis = axis_of(case, key, ("sweep", key), given)
        for i, value in enumerate(given if isinstance(given, list) else ()):
            if axis.values[i] in axis.values[:i]:
                raise Fault((*axis.place, i), f"{shown(value)} is given twice")

        # The last part of the path names the axis in tables, and in results where no other variable has this name.
        last = written(axis.path[-2:] if isinstance(axis.path[-1], int) else axis.path[-1:])
        last = {"at[0]": "x", "at[1]": "y"}.get(last, last)
        label = axis.name if last in [other.label for other in axes] else last
        name = re.sub(r"\W+", "_", axis.name if label in reserved else label).strip("_")
        axes.append(replace(axis, label=label, name=name))
    if (count := prod(len(axis.values) for axis in axes)) > MOST_POINTS:
        raise Fault(("sweep",), f"has {count} points; must have at most {MOST_POINTS}")
    return tuple(sorted(axes, key=lambda axis: axis.path[0] == "chain"))


def axis_of(case: Case, key: str, place: Path, given: Any = ()) -> Axis:
    """Return the axis of an entry, which its path names. given: its values as typed, or the table that makes them."""
    path = path_of(key, place)
    name, words = written(path), words_of(case, path)
    if not isinstance(given, Call):
        values = [si_value(case, path, value, (*place, i)) for i, value in enumerate(given)]
        return Axis(path, place, name, name, values, *unit_at(case, path, given), words)

    # Evenly spaced values; decimal, so that three steps of 10 mm are 30 mm to the last digit.
    typed = given.entries
    if ("step" in typed) == ("count" in typed):
        raise Fault(place, 'needs a step, such as step = "10 mm", or else a count')
    ends = [si_value(case, path, typed[name], (*place, name)) for name in ("from", "to")]
    if not all(isinstance(end, int | float) for end in ends):
        raise Fault((*place, "from"), f"{shown(ends[0])} must be a number; list the values instead")
    start, end = (Decimal(repr(value)) for value in ends)
    if end <= start:
        raise Fault((*place, "to"), f"{shown(typed['to'])} must be above the first value")
    if "count" in typed:
        last = typed["count"] - 1
        steps = [start + (end - start) * i / last for i in range(last + 1)]
    else:
        step = Decimal(repr(number(typed["step"], size_of(case, path), (*place, "step"))))
        count = floor((end - start) / step * Decimal("1.000000001"))
        if count >= MOST_POINTS:
            raise Fault((*place, "step"), f"{shown(typed['step'])} makes {count + 1} values, more than {MOST_POINTS}")
        steps = [start + i * step for i in range(count + 1)]
    whole = all(isinstance(value, int) for value in ends) and all(value == int(value) for value in steps)
    values = [int(value) if whole else float(value) for value in steps]
    return Axis(path, place, name, name, values, *unit_at(case, path, typed.values()), words)


def path_of(key: str, place: Path) -> Path:
    """Return the path of an entry; raise a Fault at its place if the entry cannot vary."""
    try:
        path = parsed(key)
    except ValueError as error:
        raise Fault(place, str(error)) from None
    if path[0] not in VARIED or len(path) < 2:
        raise Fault(place, f'"{key}" cannot be varied; take an entry of [chain] or [structure]')
    return path


def si_value(case: Case, path: Path, value: Any, place: Path) -> Any:
    """Return the value (SI) that an entry gets from a number or a text; raise a Fault at its place if it is refused."""
    if not isinstance(value, int | float | str) or isinstance(value, bool):
        raise Fault(place, f"{shown(value)} must be a number or a text")
    try:
        si = case.changed({path: value}).value(path)
    except Fault as fault:
        of_key = fault.reason.startswith("is not an entry")  # the key is at fault, not a value
        raise Fault(place[:2] if of_key else place, fault.reason if fault.path == path else f"makes {fault}") from None
    except ValueError as error:
        raise Fault(place, str(error)) from None
    return si if isinstance(si, int | float | str) else value


def unit_at(case: Case, path: Path, texts: Iterable[Any]) -> tuple[str, float, str]:
    """Return the unit that a user wrote, or that of the entry; its size in SI units; and the SI unit."""
    quantity = case.look(path)[1]
    si = quantity.unit_in_files if quantity else ""
    for text in texts:
        match = NUMBER.fullmatch(text) if isinstance(text, str) and si else None
        if match and match[2]:
            return match[2], float(factor(match[2], si)), si
    return si, 1.0, si


def size_of(case: Case, path: Path) -> Quantity:
    """Return the quantity of a step or an uncertainty of an entry, which may lie outside of the range of its values."""
    return replace(case.look(path)[1] or Quantity(), low=0.0, high=inf, or_zero=False)


def words_of(case: Case, path: Path) -> str:
    """Return the entry at a path in words, such as "layer 2 Young's modulus"."""
    struck = case.value(path[: path.index("at")]) if "at" in path else None
    rectangle = isinstance(struck, Call) and struck.form.kind in ("kirchhoff_plate", "mindlin_plate")
    words = [] if path[0] in ("chain", "structure") else [str(path[0])]
    for before, part in pairwise(path):
        if isinstance(part, int) and before == "at" and part < len(EDGES):
            words[-1:] = [EDGES[part] if rectangle else "xy"[part]]
        elif isinstance(part, int):
            words[-1:] = [f"{str(before).removesuffix('s')} {part + 1}"]
        elif part != "material" or part == path[-1]:
            words.append(in_words(part))
    return " ".join(words)
