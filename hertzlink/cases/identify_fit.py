"""The question of the section [identify], checked, and the fit that answers it."""

from dataclasses import dataclass
from typing import Any

import xarray as xr
from pydantic import BaseModel

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import Identification
from coupling.inference.identify import identify
from coupling.inference.misfit import OF_SENSORS
from hertzlink.cases.axes import named_property, path_of, si_value, unit_at
from hertzlink.cases.case import Case
from hertzlink.cases.checking import perhaps_at, value_at
from hertzlink.cases.entry_paths import Path, written
from hertzlink.cases.faults import Fault
from hertzlink.cases.model import IdentifyPart
from hertzlink.cases.running import sensors_of

WIDE = 2.0
"""The range of a nuisance without one: from its value over this factor to its value times it."""

OF_MATERIALS = ("youngs_modulus", "poisson_ratio", "density")
"""Numbers of a material that a case names."""

MOST_NAMES = 20
"""Paths that a message lists."""


@dataclass(frozen=True)
class Question:
    """A question: the unknowns by path, their ranges (SI), units of tables and sizes; nuisances; sensors."""

    case: Case
    part: IdentifyPart
    ranges: dict[str, tuple[float, float]]
    paths: dict[str, Path]
    units: dict[str, tuple[str, float]]
    nuisances: list[str]
    columns: dict[int, int]

    @property
    def of_structure(self) -> set[tuple[Any, ...]]:
        """The paths within the structure."""
        return {path[1:] for path in self.paths.values() if path[0] == "structure"}

    def build(self, **values: float) -> CoSimulation:
        """Return the case with values at the paths of the unknowns, for `identify`."""
        return self.case.changed({name: float(value) for name, value in values.items()}).simulation()

    @property
    def middle(self) -> dict[str, float]:
        """The middle of each range."""
        return {name: 0.5 * sum(ends) for name, ends in self.ranges.items()}


def question_of(case: Case) -> Question:
    """Return the section [identify], checked; a Fault for what does not fit."""
    part = case.model.identify
    if part is None:
        raise Fault(("identify",), "is missing; add a section [identify] with sensors and unknowns")
    case.model.only_chain("an identification")
    columns = {}
    for name, column in part.sensors.items():
        if not name.isdigit():
            raise Fault(("identify", "sensors", name), f'"{name}" is no bead; write {{ 7 = 1 }} for bead 7 in column 1')
        columns[int(name)] = column
    if not columns:
        raise Fault(("identify", "sensors"), "is empty; write { 7 = 1 } for bead 7 in column 1")
    try:
        sensors_of(case.changed({"measure": {"sensors": list(columns)}}), case)
    except Fault as fault:
        at = fault.path[-1]
        bead = list(part.sensors)[at] if isinstance(at, int) else ""
        raise Fault(("identify", "sensors", bead), fault.reason) from None
    ranges: dict[str, tuple[float, float]] = {}
    paths: dict[str, Path] = {}
    units: dict[str, tuple[str, float]] = {}

    def note(key: str, place: Path, ends: tuple[float, float], texts: list[Any]) -> str:
        path = path_of(key, place)
        name = written(path)
        if name in paths:
            raise Fault(place, f'"{key}" is given twice')
        ranges[name], paths[name] = ends, path
        units[name] = unit_at(case, path, ends[0], texts)[:2]
        return name

    for key, range_given in part.unknowns.items():
        place = ("identify", "unknowns", key)
        low, high = (_number(case, key, end, (*place, i), place) for i, end in enumerate(range_given))
        if not low < high:
            raise Fault(place, "the lowest value comes first, and the highest must be above it")
        note(key, place, (low, high), range_given)
    if not ranges:
        raise Fault(("identify", "unknowns"), 'is empty; write { "structure.thickness" = ["1 mm", "6 mm"] }')
    nuisances = []
    for i, key in enumerate(part.nuisances):
        where: Path = ("identify", "nuisances", i)
        if key in OF_SENSORS:
            nuisances.append(key)
            continue
        if "." not in key:
            choices = ", ".join(OF_SENSORS)
            raise Fault(where, f'"{key}" is none; take {choices}, or a path such as chain.impact_speed')
        name = written(path_of(key, where))
        if name not in paths:
            value = _value(case, key, where)
            note(key, where, (value / WIDE, value * WIDE), [])
        nuisances.append(name)
    return Question(case, part, ranges, paths, units, nuisances, columns)


def _number(case: Case, key: str, value: Any, at: Path, place: Path) -> float:
    path = path_of(key, place)
    try:
        number = si_value(case, path, value, at)
    except Fault:
        names = [written(p) for p in numbers_of(case, str(path[0]))]
        if is_entry(case, path) or written(path) in names:
            raise
        more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
        words = f"[{path[0]}] has {', '.join(names[:MOST_NAMES]) or 'none'}{more}"
        raise Fault(place, f'"{key}" is no number of this case; {words}') from None
    if not isinstance(number, int | float):
        raise Fault(at, f"{number!r} is no number; only numbers can be unknown")
    return float(number)


def is_entry(case: Case, path: Path) -> bool:
    """Return whether a case may have a number at a path."""
    try:
        value = value_at(case.model, path)
    except (AttributeError, KeyError, IndexError, TypeError):
        return False
    return value is None or isinstance(value, int | float | str)


def numbers_of(case: Case, section: str) -> list[Path]:
    """Return the paths of the numbers, other than counts, that a section of the case holds."""
    paths: list[Path] = []

    def walk(value: Any, path: Path) -> None:
        if isinstance(value, float):
            paths.append(path)
        elif path[-1] == "material" and isinstance(value, str):
            paths.extend((*path, name) for name in OF_MATERIALS)
        elif isinstance(value, BaseModel):
            for name, field in type(value).model_fields.items():
                walk(getattr(value, name), (*path, field.alias or name))
        elif isinstance(value, list | tuple | dict):
            for part, inner in value.items() if isinstance(value, dict) else enumerate(value):
                walk(inner, (*path, part))

    walk(getattr(case.model, section), (section,))
    return paths


def _value(case: Case, key: str, place: Path) -> float:
    """Return the value of a nuisance in the case, from which its range follows."""
    path = path_of(key, place)
    value = perhaps_at(case.model, path) or named_property(case, path)
    if not isinstance(value, int | float) or not value > 0.0:
        raise Fault(place, f'"{key}" has no value in the case; give it a range in identify.unknowns')
    return float(value)


def identified(question: Question, signal: xr.Dataset, until: float) -> Identification:
    """Return what `identify` says of a signal, with runs of a length, s."""
    part = question.part
    settings: dict[str, Any] = dict(question.ranges)
    return identify(
        signal, question.build, question.nuisances, until=until, noise=part.noise, starts=part.starts,
        seed=part.seed, discrepancy=part.discrepancy, compare=part.compare, **settings,
    )  # fmt: skip
