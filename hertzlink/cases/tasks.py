"""The task of a case: one run, a sweep over axes, or a search for the critical distance; and uncertainties."""

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import partial
from itertools import pairwise, product
from math import floor, isnan, prod
from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.numerical_error import numerical_error
from coupling.inference.uncertainty import Uncertainty, uncertainty
from coupling.plots.canvas import in_words
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import findings_of
from coupling.results.measures import sensor_force
from coupling.results.schema import OF_RUNS
from coupling.sweeps.critical_search import critical_distance_search
from coupling.sweeps.sweep import sweep
from hertzlink.cases.case import Build, Case
from hertzlink.cases.forms import alternatives, is_list, items_of
from hertzlink.cases.reader import Call, number
from hertzlink.cases.source import Fault, Path, entry, parsed, shown, written
from structures.caution import caution, collected
from structures.described import Parameter
from structures.quantities import Quantity
from structures.units import NUMBER, PARTS, factor, spread_of

MOST_POINTS = 100_000
"""Points of a sweep; a case of more is a mistake."""

VARIED = ("chain", "structure", "materials")
"""Sections whose entries can vary. The section [run] holds for all runs."""

OWN_NAMES = OF_RUNS | {"sensor", "distance", "within", "end", "error"}
"""Names that results use themselves."""

PLACES = ("distance from the left edge", "distance from the bottom edge")
"""The two numbers of the place `at` of a contact on a rectangular plate."""

FEWEST_DISTANCES = 3

SENSITIVITIES = "sensitivities"


@dataclass(frozen=True)
class Axis:
    """An entry that varies: its path, its name in results, its values (SI), the unit of tables and its size in SI.

    label: its name in tables. words: what it is, for figures.
    """

    path: Path
    label: str
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
        return f"{self.label}, {self.unit}" if self.unit else self.label


@dataclass(frozen=True)
class Task:
    """The task of a case, checked before anything runs: its axes, its sensors, the axis of a critical distance."""

    case: Case
    axes: tuple[Axis, ...]
    sensors: tuple[int, ...] = ()
    along: Axis | None = None

    @property
    def first(self) -> Case:
        """The case at the first point."""
        return self.case.changed({axis.path: axis.values[0] for axis in self.axes})

    @property
    def others(self) -> tuple[Axis, ...]:
        """All axes but that of the critical distance."""
        return tuple(axis for axis in self.axes if axis is not self.along)

    @property
    def kind(self) -> str:
        """One run, a sweep, or a critical distance."""
        return "critical distance" if self.along is not None else "sweep" if self.axes else "run"

    @property
    def build(self) -> Build:
        """What builds the case at values of the axes; `distance` is that of the critical distance."""
        paths = {"distance" if axis is self.along else axis.name: axis.path for axis in self.axes}
        return Build(self.case, paths)

    def points(self, axes: Sequence[Axis], data: xr.Dataset) -> Iterator[tuple[xr.Dataset, list[Any], list[str]]]:
        """Yield the results at each combination of the values of some axes, with these, in SI and as texts."""
        for places in product(*(range(len(axis.values)) for axis in axes)):
            each = list(zip(axes, places, strict=True))
            values = [axis.values[i] for axis, i in each]
            texts = [axis.shown(axis.values[i]) for axis, i in each]
            yield data.isel({axis.name: i for axis, i in each}), values, texts


def task_of(case: Case) -> Task:
    """Return the task of a case; a Fault for what does not fit together."""
    axes, measure = tuple(axes_of(case)), case.measure
    if measure.chain >= (count := len(case.all("chain"))):
        raise Fault(("measure", "chain"), f"{measure.chain} is no chain of {count}, counted from 0")
    if measure.numerical_error:
        case.only_chain("a numerical error")
        if axes:
            raise Fault(("measure", "numerical_error"), "is that of one run; leave out [sweep], or this entry")
    budget_of(case)
    if axes and "save_every" in case.tree.entries["run"].entries:
        raise Fault(("run", "save_every"), "is chosen by a sweep; leave it out")
    task = Task(case, axes)
    task = replace(task, sensors=sensors_of(case, task.first))
    critical = measure.critical_distance
    if critical is None:
        return task

    case.only_chain("a critical distance")
    place: Path = ("measure", "critical_distance", "along")
    path = path_of(critical.along, place)
    along = next((axis for axis in axes if axis.path == path), None)
    if along is None:
        names = ", ".join(written(axis.path) for axis in axes)
        cure = f"take one of them: {names}" if axes else f'give [sweep] "{critical.along}" = {{ from =, to =, step = }}'
        raise Fault(place, f'"{critical.along}" is no axis of [sweep]; {cure}')
    if not along.is_number or len(along.values) < FEWEST_DISTANCES:
        raise Fault(place, f'"{critical.along}" has too few distances in [sweep]; give {FEWEST_DISTANCES} or more')
    if len(task.sensors) != 1:
        raise Fault(("measure", "sensors"), "must be one for a critical distance; give sensor")
    return replace(task, along=along)


def sensors_of(case: Case, first: Case) -> tuple[int, ...]:
    """Return the sensors, by default the bead in the middle; a Fault for a bead that is not there."""
    measure = case.measure
    count = count_of_beads(first, measure.chain)
    if measure.sensor is not None and measure.sensors is not None:
        raise Fault(("measure", "sensors"), "give sensor or sensors alone")
    sensors = measure.sensors or [measure.sensor or (count + 1) // 2]
    for i, sensor in enumerate(sensors):
        if sensor > count:
            place: Path = ("measure", "sensors", i) if measure.sensors else ("measure", "sensor")
            raise Fault(place, f"{sensor} is no bead of a chain of {count}; beads are counted from the struck end")
    if len(set(sensors)) < len(sensors):
        raise Fault(("measure", "sensors"), "names a bead twice")
    return tuple(sensors)


def count_of_beads(case: Case, chain: int) -> int:
    """Return the number of beads of a chain."""
    entries = case.all("chain")[chain].entries
    beads = entries["beads"]
    count: int = beads if isinstance(beads, int) else sum(bead.entries.get("count", 1) for bead in beads)
    return count * int(entries.get("repeat", 1))


def of_chain(run: xr.Dataset, chain: int) -> xr.Dataset:
    """Return the part of a run that belongs to one of its chains."""
    return run.isel(chain=chain) if "chain" in run.dims else run


def kept_of_run(run: xr.Dataset, sensors: Sequence[int], traces: bool, chain: int) -> xr.Dataset:
    """Return what a sweep keeps of a run: AR and TOF of both waves at each sensor, and perhaps the forces."""
    run = of_chain(run, chain)
    measures: dict[str, Any] = {}
    for prefix, wave in (("", "primary"), ("secondary_", "secondary")):
        for read in (amplitude_ratio, time_of_flight):
            each = [read(run, sensor, wave) for sensor in sensors]
            measures[prefix + read.__name__] = "sensor", np.array([float(value) for value in each]), each[0].attrs
    data = xr.Dataset(measures, {"sensor": list(sensors)}, run.attrs)
    if traces:
        forces = [sensor_force(run, sensor) for sensor in sensors]
        data = data.assign_coords(time=run.time)
        data["sensor_force"] = (("sensor", "time"), np.stack([force.values for force in forces]), forces[0].attrs)
    return data


def run_task(task: Task, jobs: int | None = None) -> xr.Dataset:
    """Run it."""
    case, measure = task.case, task.case.measure
    axes: dict[str, Any] = {axis.name: axis.values for axis in task.others}
    if task.along is not None and measure.critical_distance is not None:
        wanted = measure.critical_distance
        data = critical_distance_search(
            task.build, case.until, task.sensors[0], task.along.values, wanted.tolerance, wanted.bracket,
            wanted.relative, jobs=jobs, **axes,
        )  # fmt: skip
    elif task.axes:
        kept = partial(kept_of_run, sensors=task.sensors, traces=measure.traces, chain=measure.chain)
        with case.located():
            data = sweep(task.build, case.until, jobs=jobs, measure=kept, **axes)
    else:
        data = case.run()
        budget = budget_of(case)
        for sensor in task.sensors:
            if measure.numerical_error:
                with case.located():
                    data = numerical_error(case.simulation, case.until, sensor).noted_in(data)
            if budget is not None:
                data = budget.of_sensor(sensor, findings_of(data)).noted_in(data, sensor)
    for axis in task.axes:
        words = {"path": written(axis.path), "long_name": axis.words}
        name = "distance" if axis is task.along else axis.name
        data[name].attrs.update(words | ({"units": axis.si} if axis.si else {}))
    return data.assign_attrs(case=case.to_toml())


@dataclass(frozen=True)
class Budget:
    """Entries of a case, each by its path as the user writes it: values with standard uncertainties."""

    build: Build
    inputs: dict[str, tuple[float, float]]

    def of_sensor(self, sensor: int, findings: Collection[str] = ()) -> Uncertainty:
        """Return the budget of AR and TOF at a sensor, without the findings that the run has already."""
        case, spreads = self.build.case, dict[str, Any](self.inputs)
        with case.located(), collected() as said:
            try:
                budget = uncertainty(self.build, case.until, sensor, **spreads)
            except ValueError as error:
                key, _, reason = str(error).partition(": ")
                raise Fault((SENSITIVITIES, key), reason) if key in self.inputs else error from error
        for message in said:
            if message not in findings:
                caution(message)
        return replace(budget, warnings=[warning for warning in budget.warnings if warning not in findings])


def budget_of(case: Case) -> Budget | None:
    """Return what the section [sensitivities] asks for, if a case has it; a Fault for what does not fit."""
    entries = case.tree.entries.get(SENSITIVITIES)
    if entries is None:
        return None
    case.only_chain("an uncertainty budget")
    if case.tree.entries.get("sweep"):
        raise Fault((SENSITIVITIES,), "is that of one run; leave out [sweep], or this section")
    paths, units, inputs = dict[str, Path](), dict[str, str](), dict[str, tuple[float, float]]()
    for key, text in entries.items():
        place = (SENSITIVITIES, key)
        path = path_of(key, place)
        stated = entry(case.data, path)
        stated = case.value(path) if stated is None else stated
        value = si_value(case, path, 1.0 if stated is None else stated, place)
        if stated is None:
            raise Fault(place, "is not written in the case; give its value there first")
        if not isinstance(value, float) or value == 0.0:
            raise Fault(place, f"{shown(value)} must be a number other than zero, and no count")

        unit = unit_at(case, path, ())[2]
        match = NUMBER.fullmatch(text) if isinstance(text, str) else None
        if match and match[2] and match[2] not in PARTS:
            try:
                factor(match[2], unit)
            except ValueError as error:
                raise Fault(place, f"{shown(text)}: {error}; the entry is in {unit or 'no unit'}") from None
        spread = spread_of(str(text), value)
        if isnan(spread):
            raise Fault(place, f'{shown(text)} must be a standard uncertainty, such as "0.02 mm" or "2 %"')
        paths[key], units[key], inputs[key] = path, unit, (value, spread)
    return Budget(Build(case, paths, units), inputs)


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
        last = written(path[-2:] if isinstance(path[-1], int) else path[-1:])
        last = {"at[0]": "x", "at[1]": "y"}.get(last, last)
        label = written(path) if last in [axis.label for axis in axes] else last
        name = re.sub(r"\W+", "_", written(path) if label in OWN_NAMES else label).strip("_")
        axes.append(Axis(path, label, name, values, *unit_at(case, path, texts), words_of(case, path)))
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
    lists = [kind for kind, _ in alternatives(parameter) if is_list(kind)]
    return next((found for kind in lists if (found := quantity_of(items_of(kind)[0]))), None)


def _steps(case: Case, path: Path, key: str, given: Call) -> list[Any]:
    """Return evenly spaced values; decimal, so that three steps of 10 mm are 30 mm to the last digit."""
    place: Path = ("sweep", key)
    if ("step" in given.entries) == ("count" in given.entries):
        raise Fault(place, 'needs a step, such as step = "10 mm", or else a count')
    ends = [si_value(case, path, given.entries[name], (*place, name)) for name in ("from", "to")]
    for name, end in zip(("from", "to"), ends, strict=True):
        if not isinstance(end, int | float):
            raise Fault((*place, name), f"{shown(end)} must be a number; list the values instead")
    start, end = (Decimal(repr(value)) for value in ends)
    if end <= start:
        raise Fault((*place, "to"), f"{shown(given.entries['to'])} must be above the first value")
    if "count" in given.entries:
        last = given.entries["count"] - 1
        values = [start + (end - start) * i / last for i in range(last + 1)]
    else:
        # A step may lie outside of the range of the values.
        typed, quantity = given.entries["step"], quantity_of(case.parameter(path))
        step = number(typed, quantity, (*place, "step")) if quantity else typed
        if not isinstance(step, int | float) or step <= 0:
            raise Fault((*place, "step"), f"{shown(typed)} must be positive")
        wide = Decimal(repr(step))
        count = floor((end - start) / wide * Decimal("1.000000001"))
        if count >= MOST_POINTS:
            raise Fault((*place, "step"), f"{shown(typed)} makes {count + 1} values; at most {MOST_POINTS}")
        values = [start + i * wide for i in range(count + 1)]
    whole = all(isinstance(value, int) for value in ends) and all(value == int(value) for value in values)
    return [int(value) if whole else float(value) for value in values]


def words_of(case: Case, path: Path) -> str:
    """Return the entry at a path in words, such as "layer 2 Young's modulus"."""
    struck = case.value(path[: path.index("at")]) if "at" in path else None
    rectangle = isinstance(struck, Call) and struck.form.kind in ("kirchhoff_plate", "mindlin_plate")
    words = [] if path[0] in ("chain", "structure", "measure") else [str(path[0])]
    for before, part in pairwise(path):
        if isinstance(part, int) and before == "at" and part < len(PLACES):
            words[-1:] = [PLACES[part] if rectangle else "xy"[part]]
        elif isinstance(part, int):
            words[-1:] = [f"{str(before).removesuffix('s')} {part + 1}"]
        elif part != "material" or part == path[-1]:
            words.append(in_words(part))
    return " ".join(words)
