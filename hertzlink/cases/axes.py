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
from hertzlink.cases.building import world_of
from hertzlink.cases.case import Case
from hertzlink.cases.checking import SECTIONS, perhaps_at, value_at
from hertzlink.cases.entry_paths import Path, parsed, written
from hertzlink.cases.faults import Fault
from hertzlink.cases.materials import Isotropic, material_named
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
    sweep_of_case = case.model.sweep or {}
    axes: list[Axis] = []
    for key, entry in sweep_of_case.items():
        path = path_of(key, ("sweep", key))
        if any(axis.path == path for axis in axes):
            raise Fault(("sweep", key), "is given twice")
        values = _steps(case, path, key, entry) if isinstance(entry, Steps) else _values(case, path, key, entry)
        texts = [*(case.data["sweep"][key] if isinstance(entry, list) else case.data["sweep"][key].values())]
        unit, size, si = unit_at(case, path, values[0], texts)
        axes.append(
            Axis(path, name_of(path, [axis.name for axis in axes]), values, unit, size, si, words_of(case, path))
        )
    if (count := prod(len(axis.values) for axis in axes)) > MOST_POINTS:
        raise Fault(("sweep",), f"has {count} points; at most {MOST_POINTS}")
    return sorted(axes, key=lambda axis: axis.path[0] == "chain")


def path_of(key: str, place: Path) -> Path:
    """Return the path that a key names; a Fault at its place."""
    try:
        path = parsed(key)
    except ValueError as error:
        raise Fault(place, str(error)) from None
    if path[0] not in SECTIONS or len(path) < 2:
        raise Fault(place, f'"{key}" cannot be varied; take an entry of [chain] or [structure]')
    return path


def si_value(case: Case, path: Path, value: Any, place: Path) -> Any:
    """Return the value (SI) that an entry gets from a number or a text; a Fault at its place where it is refused."""
    if not isinstance(value, int | float | str) or isinstance(value, bool):
        raise Fault(place, f"{shown(value)} must be a number or a text")
    try:
        si = value_at(case.changed({path: value}).model, path)
    except Fault as fault:
        reason = fault.reason if fault.path == path else f"makes {written(fault.path)}: {fault.reason}"
        raise Fault(place, reason) from None
    except ValueError as error:
        raise Fault(place, str(error)) from None
    return si if isinstance(si, int | float | str) else value


def named_property(case: Case, path: Path) -> Any:
    """Return the property (SI) that an entry of a case has by the name of its material; None where it has none."""
    material = perhaps_at(case.model, path[:-1])
    name = material.like if isinstance(material, Isotropic) else material
    named = material_named(name, world_of(case.model, case.folder).materials) if isinstance(name, str) else None
    return getattr(named, str(path[-1]), None)


def unit_at(case: Case, path: Path, value: Any, texts: Iterable[Any]) -> tuple[str, float, str]:
    """Return the unit that a user wrote, or that of the entry; its size in SI units; and the SI unit."""
    at: Any = case.changed({path: value}).model
    notes: list[Any] = []
    for part in path:
        if isinstance(at, BaseModel):
            notes = notes_of(type(at).model_fields[str(part)])
        at = value_at(at, (part,))
    units = [note.unit for note in notes if isinstance(note, Unit)]
    if not units or not units[0]:
        return "", 1.0, ""
    for text in texts:
        match = NUMBER.fullmatch(text) if isinstance(text, str) else None
        if match and match[2]:
            return match[2], float(factor(match[2], units[0])), units[0]
    return units[0], 1.0, units[0]


def _values(case: Case, path: Path, key: str, listed_values: list[Any]) -> list[Any]:
    values = [si_value(case, path, entry, ("sweep", key, i)) for i, entry in enumerate(listed_values)]
    for i, value in enumerate(values):
        if value in values[:i]:
            raise Fault(("sweep", key, i), f"{shown(listed_values[i])} is given twice")
    return values


def _steps(case: Case, path: Path, key: str, steps_given: Steps) -> list[Any]:
    """Return evenly spaced values; decimal, so that three steps of 10 mm are 30 mm to the last digit."""
    if (steps_given.step is None) == (steps_given.count is None):
        raise Fault(("sweep", key), 'needs a step, such as step = "10 mm", or else a count')
    ends = {name: si_value(case, path, end, ("sweep", key, name)) for name, end in
            (("from", steps_given.start), ("to", steps_given.end))}  # fmt: skip
    integral = all(isinstance(end, int) for end in ends.values())
    for name, bound in ends.items():
        if not isinstance(bound, int | float):
            raise Fault(("sweep", key, name), f"{shown(bound)} must be a number; list the values instead")
    start, end = (Decimal(repr(end)) for end in ends.values())
    if end <= start:
        raise Fault(("sweep", key, "to"), f"{shown(steps_given.end)} must be above the first value")
    if steps_given.count is not None:
        values = [start + (end - start) * i / (steps_given.count - 1) for i in range(steps_given.count)]
    else:
        step = si_value(case, path, steps_given.step, ("sweep", key, "step"))
        if not isinstance(step, int | float) or step <= 0:
            raise Fault(("sweep", key, "step"), f"{shown(steps_given.step)} must be positive")
        count = floor((end - start) / Decimal(repr(step)) * Decimal("1.000000001"))
        if count >= MOST_POINTS:
            raise Fault(
                ("sweep", key, "step"), f"{shown(steps_given.step)} makes {count + 1} values; at most {MOST_POINTS}"
            )
        values = [start + i * Decimal(repr(step)) for i in range(count + 1)]
    if integral and all(value == int(value) for value in values):
        return [int(value) for value in values]
    return [float(value) for value in values]


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


def name_of(path: Path, earlier: Iterable[str]) -> str:
    """Return a short name for an entry, which no other has."""
    name = _label(path)
    if name in OWN_NAMES or name in earlier:
        return re.sub(r"\W+", "_", written(path)).strip("_")
    return name
