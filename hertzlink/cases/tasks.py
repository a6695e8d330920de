"""The task of a case: one run, a sweep, or a search for the critical distance; with a law of yielding where it is
needed, and with the uncertainties of the section [sensitivities]."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice, product
from math import isnan
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.numerical_error import numerical_error
from coupling.inference.uncertainty import Uncertainty, propagated
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import findings_of, with_warnings
from coupling.results.measures import sensor_force
from coupling.sweeps.critical_search import critical_distance_search
from coupling.sweeps.sweep import sweep
from coupling.yield_check import is_of_yield
from hertzlink.cases.axes import Axis, axes_of, path_of, si_value, unit_at
from hertzlink.cases.case import Case, of_run, run_once
from hertzlink.cases.paths import YIELDING, Fault, Path, entry, shown, written
from structures.caution import caution, collected
from structures.units import NUMBER, PARTS, factor, spread_of

FEWEST_DISTANCES = 3

WITH_YIELDING = "with_yielding"
"""The attribute of a result that says what yielding changes, for its table and its report."""

SENSITIVITIES = "sensitivities"


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

    def build(self, **values: Any) -> CoSimulation:
        """Return the case at values of the axes, by their names; `distance` is that of the critical distance."""
        names = {"distance" if axis is self.along else axis.name: axis.path for axis in self.axes}
        return self.case.changed({names[name]: value for name, value in values.items()}).simulation()

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
    if measure.chain >= len(case.chains):
        reason = f"{measure.chain} is no chain of {len(case.chains)}, counted from 0"
        raise Fault(("measure", "chain"), reason)
    if measure.critical_distance is not None:
        case.only_chain("a critical distance")
    if measure.numerical_error:
        case.only_chain("a numerical error")
        if axes:
            raise Fault(("measure", "numerical_error"), "is that of one run; leave out [sweep], or this entry")
    budget_of(case)
    save_every = case.tree.entries["run"].entries.get("save_every")
    if axes and save_every is not None:
        raise Fault(("run", "save_every"), "is chosen by a sweep; leave it out")
    task = Task(case, axes, along=_along(case, axes))
    return replace(task, sensors=sensors_of(case, task.first))


def sensors_of(case: Case, first: Case) -> tuple[int, ...]:
    """Return the sensors, by default the bead in the middle; a Fault for a bead that is not there."""
    measure = case.measure
    count = count_of_beads(first, measure.chain)
    if measure.sensor is not None and measure.sensors is not None:
        raise Fault(("measure", "sensors"), "give sensor or sensors alone")
    places: list[Path] = [("measure", "sensor")]
    sensors = [measure.sensor or (count + 1) // 2]
    if measure.sensors is not None:
        sensors = [*measure.sensors]
        places = [("measure", "sensors", i) for i in range(len(sensors))]
    for place, sensor in zip(places, sensors, strict=True):
        if sensor > count:
            raise Fault(place, f"{sensor} is no bead of a chain of {count}; beads are counted from the struck end")
    if len(set(sensors)) < len(sensors):
        raise Fault(("measure", "sensors"), "names a bead twice")
    return tuple(sensors)


def count_of_beads(case: Case, chain: int) -> int:
    """Return the number of beads of a chain."""
    entries = case.chains[chain].entries
    beads = entries["beads"]
    count: int = beads if isinstance(beads, int) else sum(bead.entries.get("count", 1) for bead in beads)
    return count * int(entries.get("repeat", 1))


def _along(case: Case, axes: tuple[Axis, ...]) -> Axis | None:
    """Return the axis of the critical distance."""
    critical = case.measure.critical_distance
    if critical is None:
        return None
    place = ("measure", "critical_distance", "along")
    path = path_of(critical.along, place)
    matching = [axis for axis in axes if axis.path == path]
    if not matching:
        names = ", ".join(written(axis.path) for axis in axes)
        cure = f"take one of them: {names}" if axes else f'give [sweep] "{critical.along}" = {{ from =, to =, step = }}'
        raise Fault(place, f'"{critical.along}" is no axis of [sweep]; {cure}')
    if not matching[0].is_number or len(matching[0].values) < FEWEST_DISTANCES:
        raise Fault(place, f'"{critical.along}" has too few distances in [sweep]; give {FEWEST_DISTANCES} or more')
    if case.measure.sensors is not None and len(case.measure.sensors) != 1:
        raise Fault(("measure", "sensors"), "must be one for a critical distance; give sensor")
    return matching[0]


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
            values, attrs = np.array([float(value) for value in each]), each[0].attrs
            measures[prefix + read.__name__] = ("sensor", values, attrs)
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
    if task.along is not None:
        wanted = measure.critical_distance
        assert wanted is not None
        data = critical_distance_search(
            task.build, case.until, task.sensors[0], task.along.values, wanted.tolerance, wanted.bracket,
            wanted.relative, jobs=jobs, **axes,
        )  # fmt: skip
    elif task.axes:
        kept = partial(kept_of_run, sensors=task.sensors, traces=measure.traces, chain=measure.chain)
        with of_run(case):
            data = sweep(task.build, case.until, jobs=jobs, measure=kept, **axes)
    else:
        data = run_once(case, case.simulation())
        for sensor in task.sensors if measure.numerical_error else ():
            with of_run(case):
                data = numerical_error(case.simulation, case.until, sensor).noted_in(data)
        if budget := budget_of(case):
            for sensor in task.sensors:
                data = budget.of_sensor(sensor, findings_of(data)).noted_in(data, sensor)
    for axis in task.axes:
        words = {"path": written(axis.path), "long_name": axis.words}
        name = "distance" if axis is task.along else axis.name
        data[name].attrs.update(words | ({"units": axis.si} if axis.si else {}))
    return data.assign_attrs(case=case.to_toml())


def run_both(task: Task, jobs: int | None = None) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Run a task; where contacts are beyond yield, once more with Jackson and Green's law, and the findings say what
    changes.

    The second result is that with the law, where there is one. A sweep is not repeated: its findings hold estimates.
    """
    yielded, words = None, ""
    with collected() as said:
        data = run_task(task, jobs)
        if task.kind != "sweep" and any(map(is_of_yield, (*findings_of(data), *said))):
            many = range(len(task.case.chains))
            single = not isinstance(task.case.data["chain"], list)
            laws = ["chain.law"] if single else [f"chain[{i}].law" for i in many]
            changes = {path: {"kind": "jackson_green"} for path in laws}
            # The user was warned of the same in the first run.
            with collected():
                try:
                    others = {"measure.numerical_error": False, SENSITIVITIES: None}
                    yielded = run_task(task_of(task.case.changed({**changes, **others})), jobs)
                    words = f"with {YIELDING}, {', '.join(_changes(task, data, yielded))}"
                except ValueError:
                    yielded = None  # A case that cannot run with the law keeps the estimate.
            said[:] = dict.fromkeys(_computed(said, words))
            told = words and f"These are of elastic contacts. On a fresh spot the metal yields: {words}."
            data = with_warnings(data, _computed(findings_of(data), words)).assign_attrs({WITH_YIELDING: told})
    for message in said:
        caution(message)
    return data, yielded


def _computed(findings: Iterable[str], words: str) -> list[str]:
    """Return the findings, with computed changes in the place of estimated ones."""
    return [f"{finding.split('; ')[0]}; {words}" if words and is_of_yield(finding) else finding for finding in findings]


def _changes(task: Task, data: xr.Dataset, yielded: xr.Dataset) -> Iterator[str]:
    """Yield what the law changes, in words: AR and TOF of a run, or the first critical distances."""

    def instead(values: Sequence[float], digits: str) -> str:
        new, old = ("none" if isnan(value) else f"{value:{digits}}" for value in values)
        return f"{new} instead of {old}"

    if task.along is None:
        for sensor in task.sensors:
            runs = [of_chain(result, task.case.measure.chain) for result in (yielded, data)]
            ratios, flights = ([float(read(run, sensor)) for run in runs] for read in (amplitude_ratio, time_of_flight))
            yield f"AR at bead {sensor} is {instead(ratios, '.3f')}"
            yield f"TOF {instead([1e6 * flight for flight in flights], '.1f')} µs"
        return
    both = zip(task.points(task.others, yielded), task.points(task.others, data), strict=True)
    most = 4
    for (new, _, texts), (old, *_) in islice(both, most):
        where = [f"{axis.head} {text}" for axis, text in zip(task.others, texts, strict=True)]
        distances = [float(result.critical_distance) / task.along.size for result in (new, old)]
        words = f"the critical distance is {instead(distances, '.4g')} {task.along.unit}".strip()
        yield f"{words} ({', '.join(where)})" if where else words
    if any(True for _ in both):
        yield "and so on"


@dataclass(frozen=True)
class Budget:
    """Entries of a case, each by its path as the user writes it: values with standard uncertainties."""

    case: Case
    paths: dict[str, Path]
    inputs: dict[str, tuple[float, float]]
    units: dict[str, str]

    def __call__(self, **values: float) -> CoSimulation:
        """Return the co-simulation with other values."""
        changed = self.case.changed({self.paths[key]: float(value) for key, value in values.items()})
        return changed.simulation()

    def of_sensor(self, sensor: int, findings: Collection[str] = ()) -> Uncertainty:
        """Return the budget of AR and TOF at a sensor, without the findings that the run has already."""
        with of_run(self.case), collected() as said:
            try:
                budget = propagated(self, self.case.until, sensor, self.inputs)
            except ValueError as error:
                key, _, reason = str(error).partition(": ")
                raise Fault((SENSITIVITIES, key), reason) if key in self.paths else error from error
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
    budget = Budget(case, {}, {}, {})
    for key, text in entries.items():
        place = (SENSITIVITIES, key)
        path = path_of(key, place)
        stated = entry(case.data, path)
        stated = case.value(path) if stated is None else stated
        if stated is None:
            si_value(case, path, 1.0, place)  # a Fault where it is misspelt
            raise Fault(place, "is not written in the case; give its value there first")
        value = si_value(case, path, stated, place)
        if not isinstance(value, float) or value == 0.0:
            raise Fault(place, f"{shown(value)} must be a number other than zero, and no count")

        unit = unit_at(case, path, value, ())[2]
        match = NUMBER.fullmatch(text) if isinstance(text, str) else None
        if match and match[2] and match[2] not in PARTS:
            try:
                factor(match[2], unit)
            except ValueError as error:
                raise Fault(place, f"{shown(text)}: {error}; the entry is in {unit or 'no unit'}") from None
        spread = spread_of(str(text), value)
        if isnan(spread):
            raise Fault(place, f'{shown(text)} must be a standard uncertainty, such as "0.02 mm" or "2 %"')
        budget.paths[key], budget.units[key], budget.inputs[key] = path, unit, (value, spread)
    return budget
