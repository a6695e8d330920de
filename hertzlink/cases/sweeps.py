"""Entries of a case that vary: the axes of [sweep], tables of their results, and entries that are uncertain."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import partial
from itertools import pairwise, product
from math import floor, inf, isnan, prod
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.plates import modes_of
from coupling.inference.uncertainty import uncertainty
from coupling.plots.canvas import in_words
from coupling.results.findings import findings_of
from coupling.results.schema import OF_RUNS
from hertzlink.cases import Fault, Path, entry, parsed, shown, written
from hertzlink.cases.case import Case
from hertzlink.cases.forms import allowed
from hertzlink.cases.reader import Call, number
from hertzlink.cases.tasks import WIDTH, Table, Task, above_one, shown_of
from structures.caution import caution, collected
from structures.checks import count_of
from structures.described import Parameter
from structures.quantities import Quantity
from structures.units import NUMBER, PARTS, factor, spread_of

MOST_POINTS = 100_000
"""Points of a sweep; a case of more is a mistake."""

VARIED = ("chain", "structure", "materials")
"""Sections whose entries can vary. The section [run] holds for all runs."""

OWN_NAMES, OF_CRITICAL = OF_RUNS | {"sensor", "error"}, {"distance", "within", "end"}
"""Names that results use themselves, and those of a critical distance."""

FEWEST_ON_MODES = 4
"""Plates of a sweep from which on their modes, once, take less time than a mesh of each."""

EDGES = ("distance from the left edge", "distance from the bottom edge")
"""The two numbers of the place `at` of a contact on a rectangular plate."""


@dataclass(frozen=True)
class Axis:
    """An entry that varies, and its values (SI)."""

    path: Path
    place: Path  # where it is asked for
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

    def typed(self, value: Any) -> Any:
        """Return a value as a user would write it."""
        return f"{self.shown(value, 10)} {self.unit}" if self.unit else value

    @property
    def head(self) -> str:
        """Name and unit, for the head of a table."""
        return f"{self.label}, {self.unit}" if self.unit else self.label

    @property
    def column(self) -> str:
        """Name and SI unit, for the head of a column in a file."""
        return f"{self.label} ({self.si})" if self.si else self.label


def axes_of(case: Case) -> tuple[Axis, ...]:
    """Return the axes of the section [sweep], those of the structure first: runs that share it share a process."""
    axes: list[Axis] = []
    reserved = OWN_NAMES | (OF_CRITICAL if case.measure.critical_distance else set())
    for key, given in case.tree.entries.get("sweep", {}).items():
        place: Path = ("sweep", key)
        axis = axis_of(case, key, place, given)
        if any(axis.path == other.path for other in axes):
            raise Fault(place, "is given twice")
        for i, value in enumerate(given if isinstance(given, list) else ()):
            if axis.values[i] in axis.values[:i]:
                raise Fault((*place, i), f"{shown(value)} is given twice")
        last = written(axis.path[-2:] if isinstance(axis.path[-1], int) else axis.path[-1:])
        last = {"at[0]": "x", "at[1]": "y"}.get(last, last)
        label = axis.name if last in [other.label for other in axes] else last
        name = re.sub(r"\W+", "_", axis.name if label in reserved else label).strip("_")
        axes.append(replace(axis, label=label, name=name))
    if (count := prod(len(axis.values) for axis in axes)) > MOST_POINTS:
        raise Fault(("sweep",), f"has {count} points; at most {MOST_POINTS}")
    return tuple(sorted(axes, key=lambda axis: axis.path[0] == "chain"))


def axis_of(case: Case, key: str, place: Path, given: Any = ()) -> Axis:
    """Return the axis of an entry: it is named by its path. given: its values as typed, or what makes them."""
    path = path_of(key, place)
    if isinstance(given, Call):
        values, texts = _steps(case, path, place, given), [*given.entries.values()]
    else:
        values, texts = [si_value(case, path, value, (*place, i)) for i, value in enumerate(given)], given
    name = written(path)
    return Axis(path, place, name, name, values, *unit_at(case, path, texts), words_of(case, path))


def _steps(case: Case, path: Path, place: Path, given: Call) -> list[Any]:
    """Return evenly spaced values; decimal, so that three steps of 10 mm are 30 mm to the last digit."""
    typed = given.entries
    if ("step" in typed) == ("count" in typed):
        raise Fault(place, 'needs a step, such as step = "10 mm", or else a count')
    ends = [si_value(case, path, typed[name], (*place, name)) for name in ("from", "to")]
    for name, end in zip(("from", "to"), ends, strict=True):
        if not isinstance(end, int | float):
            raise Fault((*place, name), f"{shown(end)} must be a number; list the values instead")
    start, end = (Decimal(repr(value)) for value in ends)
    if end <= start:
        raise Fault((*place, "to"), f"{shown(typed['to'])} must be above the first value")

    if "count" in typed:
        last = typed["count"] - 1
        values = [start + (end - start) * i / last for i in range(last + 1)]
    else:
        step = number(typed["step"], size_of(case, path), (*place, "step"))
        count = floor((end - start) / Decimal(repr(step)) * Decimal("1.000000001"))
        if count >= MOST_POINTS:
            raise Fault((*place, "step"), f"{shown(typed['step'])} makes {count + 1} values; at most {MOST_POINTS}")
        values = [start + i * Decimal(repr(step)) for i in range(count + 1)]
    whole = all(isinstance(value, int) for value in ends) and all(value == int(value) for value in values)
    return [int(value) if whole else float(value) for value in values]


def builder_of(task: Task) -> Callable[..., CoSimulation]:
    """Return what builds the points of a task: on the modes of a rectangular plate that it strikes at many places."""
    plates = prod(len(axis.values) for axis in task.axes if axis.path[0] == "structure")
    if plates < FEWEST_ON_MODES and task.along is None:
        return task
    start, changes = {axis.name: axis.values[0] for axis in task.axes}, list[dict[str, Any]]()
    for axis in task.axes:
        ends = {min(axis.values), max(axis.values)} if axis.is_number else axis.values
        changes += [{axis.name: value} for value in ends]
    on_modes = modes_of([partial(task, **(start | change)) for change in [{}, *changes]], task.case.until)
    return task if on_modes is None else partial(on_modes, task)


def path_of(key: str, place: Path) -> Path:
    """Return the path of an entry that can vary; a Fault at its place."""
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
        raise Fault(place, fault.reason if fault.path == path else f"makes {fault}") from None
    except ValueError as error:
        raise Fault(place, str(error)) from None
    return si if isinstance(si, int | float | str) else value


def unit_at(case: Case, path: Path, texts: Iterable[Any]) -> tuple[str, float, str]:
    """Return the unit that a user wrote, or that of the entry; its size in SI units; and the SI unit."""
    quantity = quantity_of(case.parameter(path))
    si = quantity.unit_in_files if quantity else ""
    for text in texts:
        match = NUMBER.fullmatch(text) if isinstance(text, str) and si else None
        if match and match[2]:
            return match[2], float(factor(match[2], si)), si
    return si, 1.0, si


def quantity_of(parameter: Parameter | None) -> Quantity | None:
    """Return the quantity of a number, also of those in a list."""
    if parameter is None or parameter.quantity is not None:
        return None if parameter is None else parameter.quantity
    return next((found for row in allowed(parameter).lists if (found := quantity_of(row.item))), None)


def size_of(case: Case, path: Path) -> Quantity:
    """Return the quantity of a step or an uncertainty of an entry, which may lie outside of the range of its values."""
    return replace(quantity_of(case.parameter(path)) or Quantity(), low=0.0, high=inf, or_zero=False)


def words_of(case: Case, path: Path) -> str:
    """Return the entry at a path in words, such as "layer 2 Young's modulus"."""
    struck = case.value(path[: path.index("at")]) if "at" in path else None
    rectangle = isinstance(struck, Call) and struck.form.kind in ("kirchhoff_plate", "mindlin_plate")
    words = [] if path[0] in ("chain", "structure", "measure") else [str(path[0])]
    for before, part in pairwise(path):
        if isinstance(part, int) and before == "at" and part < len(EDGES):
            words[-1:] = [EDGES[part] if rectangle else "xy"[part]]
        elif isinstance(part, int):
            words[-1:] = [f"{str(before).removesuffix('s')} {part + 1}"]
        elif part != "material" or part == path[-1]:
            words.append(in_words(part))
    return " ".join(words)


def sweep_tables(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the points of a sweep, and its traces: a column for each run and sensor."""
    names = ["amplitude_ratio", "time_of_flight", "secondary_amplitude_ratio", "secondary_time_of_flight"]
    order = [*(axis.name for axis in task.axes), "sensor"]
    frame = data[names].to_dataframe(order).reset_index()[[*order, *names]]
    measures = ["amplitude ratio", "time of flight (s)", "secondary amplitude ratio", "secondary time of flight (s)"]
    frame.columns = pd.Index([*(axis.column for axis in task.axes), "bead", *measures])
    shown = shown_of(frame, task)
    if frame[measures[2]].isna().all():  # no second wave
        shown = shown.iloc[:, :-2]
    tables = [Table("points.csv", frame, shown)]
    if "sensor_force" in data:
        forces = data.sensor_force.transpose("time", *order).values.reshape(data.time.size, -1)
        heads = []
        for *texts, sensor in shown.values[:, : len(order)].tolist():
            where = "".join(f", {axis.head} {text}" for axis, text in zip(task.axes, texts, strict=True))
            heads.append(f"force at bead {sensor}{where} (N)")
        traces = pd.DataFrame(np.column_stack([data.time.values, forces]), columns=["time (s)", *heads])
        tables.append(Table("traces.csv", traces))
    return tables, above_one(frame)


def critical_tables(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the critical distances, and AR at all distances that were run."""
    along, wanted = task.along, task.case.measure.critical_distance
    assert along is not None
    assert wanted is not None
    rows, cells, remarks = [], [], set()
    for places in product(*(range(len(axis.values)) for axis in task.others)):
        at = data.isel({axis.name: i for axis, i in zip(task.others, places, strict=True)})
        values = [axis.values[i] for axis, i in zip(task.others, places, strict=True)]
        low, high = (float(end) for end in at.bracket)
        critical, far = float(at.critical_distance), float(at.far_value)
        rows.append([*values, critical, low, high, far, wanted.tolerance])
        if bool(at.lower_bound):
            remarks.add("> : AR does not settle within the distances or the record; the true one is larger")
        if low == 0.0:
            remarks.add("< : AR is within the tolerance at all distances; give smaller ones")
        best, *ends = (along.shown(number, 4) for number in (critical, low, high))
        best = f"> {along.shown(low)}" if np.isnan(critical) else f"{'< ' * (low == 0.0)}{best}"
        texts = [axis.shown(value) for axis, value in zip(task.others, values, strict=True)]
        cells.append([*texts, best, " to ".join(ends) if np.isfinite(high) else "-", f"{far:.4f}"])

    names = [axis.name for axis in task.others]
    every = data[["sampled", "amplitude_ratio", "time_of_flight"]].to_dataframe([*names, "distance"]).reset_index()
    samples = every[every.sampled.astype(bool)][[*names, "distance", "amplitude_ratio", "time_of_flight"]]
    unit = f", {along.unit}" if along.unit else ""
    head = [*(axis.head for axis in task.others), f"critical distance{unit}", f"between{unit}", "AR far away"]
    others, distance = [axis.column for axis in task.others], f"distance ({along.si})"
    columns = [*others, f"critical {distance}", "low (m)", "high (m)", "AR far away", "tolerance of AR"]
    samples.columns = pd.Index([*others, distance, "amplitude ratio", "time of flight (s)"])
    tables = [
        Table("critical_distance.csv", pd.DataFrame(rows, columns=columns), pd.DataFrame(cells, columns=head)),
        Table("points.csv", samples),
    ]
    below = [fill(remark, WIDTH) for remark in sorted(remarks)]
    below.append(f"beyond the critical distance AR stays within ± {wanted.tolerance:g} of AR far away")
    below.append(f"AR at bead {task.sensors[0]} in {count_of(len(samples), 'run')}: points.csv")
    return tables, below


def budget_of(case: Case) -> tuple[Task, dict[str, tuple[float, float]]]:
    """Return the task of [sensitivities], whose axes are its entries, and their values and standard uncertainties."""
    case.only_chain("an uncertainty budget")
    if case.tree.entries.get("sweep"):
        raise Fault(("sensitivities",), "is that of one run; leave out [sweep], or this section")
    axes, inputs = list[Axis](), dict[str, tuple[float, float]]()
    for key, text in case.tree.entries["sensitivities"].items():
        place = ("sensitivities", key)
        axis = axis_of(case, key, place)
        stated = entry(case.data, axis.path)
        stated = case.value(axis.path) if stated is None else stated
        value = si_value(case, axis.path, 1.0 if stated is None else stated, place)
        if stated is None:
            raise Fault(place, "is not written in the case; give its value there first")
        if not isinstance(value, float) or value == 0.0:
            raise Fault(place, f"{shown(value)} must be a number other than zero, and no count")

        match = NUMBER.fullmatch(str(text))
        part = match and match[2] in PARTS
        spread = spread_of(str(text), value) if part else number(text, size_of(case, axis.path), place)
        if isnan(spread):
            raise Fault(place, f'{shown(text)} must be a standard uncertainty, such as "0.02 mm" or "2 %"')
        axes.append(replace(axis, name=key))
        inputs[key] = value, spread
    return Task(case, tuple(axes)), inputs


def with_budget(case: Case, data: xr.Dataset, sensor: int) -> xr.Dataset:
    """Return a run with the budget of AR and TOF at a sensor, without the findings that the run has already."""
    task, inputs = budget_of(case)
    findings, spreads = findings_of(data), dict[str, Any](inputs)
    with case.located(), collected() as said:
        try:
            budget = uncertainty(task, case.until, sensor, **spreads)
        except ValueError as error:
            key, _, reason = str(error).partition(": ")
            raise Fault(("sensitivities", key), reason) if key in inputs else error from error
    for message in said:
        if message not in findings:
            caution(message)
    new = [warning for warning in budget.warnings if warning not in findings]
    return replace(budget, warnings=new).noted_in(data, sensor)
