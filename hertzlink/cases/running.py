"""Running a case: one run, a sweep, or a search for the critical distance; each gives a Dataset."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.numerical_error import numerical_error
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import findings_of
from coupling.results.measures import sensor_force
from coupling.sweeps.critical_search import critical_distance_search
from coupling.sweeps.sweep import sweep
from hertzlink.cases.axes import Axis, axes_of, path_of
from hertzlink.cases.budget import budget_of
from hertzlink.cases.case import Case, of_run, run_once
from hertzlink.cases.entry_paths import Path, written
from hertzlink.cases.faults import Fault

FEWEST_DISTANCES = 3


@dataclass(frozen=True)
class Build:
    """The builder of a sweep: takes the values of the axes by name. It can be sent to other processes."""

    case: Case
    axes: tuple[Axis, ...]

    def __call__(self, **values: Any) -> CoSimulation:
        return self.case.changed({axis.path: values[axis.name] for axis in self.axes}).simulation()


@dataclass(frozen=True)
class Measure:
    """The measure that is kept of each run of a sweep."""

    sensors: tuple[int, ...]
    traces: bool = False
    chain: int = 0

    def __call__(self, run: xr.Dataset) -> xr.Dataset:
        run = of_chain(run, self.chain)
        measures: dict[str, Any] = {}
        for prefix, wave in (("", "primary"), ("secondary_", "secondary")):
            for read in (amplitude_ratio, time_of_flight):
                each = [read(run, sensor, wave) for sensor in self.sensors]
                values, attrs = np.array([float(value) for value in each]), each[0].attrs
                measures[prefix + read.__name__] = ("sensor", values, attrs)
        data = xr.Dataset(measures, {"sensor": list(self.sensors)}, run.attrs)
        if self.traces:
            forces = [sensor_force(run, sensor) for sensor in self.sensors]
            data = data.assign_coords(time=run.time)
            data["sensor_force"] = (("sensor", "time"), np.stack([force.values for force in forces]), forces[0].attrs)
        return data


def points(axes: Sequence[Axis], data: xr.Dataset) -> Iterator[tuple[xr.Dataset, list[Any], list[str]]]:
    """Yield the results at each combination of the values of some axes, with these, in SI and as texts."""
    for places in product(*(range(len(axis.values)) for axis in axes)):
        each = list(zip(axes, places, strict=True))
        values = [axis.values[i] for axis, i in each]
        texts = [axis.shown(axis.values[i]) for axis, i in each]
        yield data.isel({axis.name: i for axis, i in each}), values, texts


def of_chain(run: xr.Dataset, chain: int) -> xr.Dataset:
    """Return the part of a run that belongs to one of its chains."""
    return run.isel(chain=chain) if "chain" in run.dims else run


@dataclass(frozen=True)
class Task:
    """The task of a case, checked before anything runs: its axes, its sensors, the axis of a critical distance."""

    case: Case
    axes: tuple[Axis, ...]
    sensors: tuple[int, ...]
    along: Axis | None

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
        if self.along is not None:
            return "critical distance"
        return "sweep" if self.axes else "run"


def task_of(case: Case) -> Task:
    """Return the task of a case; a Fault for what does not fit together."""
    axes = tuple(axes_of(case))
    along = _along(case, axes)
    task = Task(case, axes, (), along)
    if along is not None:
        case.model.only_chain("a critical distance")
    if case.model.measure.numerical_error:
        case.model.only_chain("a numerical error")
        if axes:
            raise Fault(("measure", "numerical_error"), "is that of one run; leave out [sweep], or this entry")
    budget_of(case)
    if axes and case.model.run.save_every is not None:
        raise Fault(("run", "save_every"), "is chosen by a sweep; leave it out")
    return Task(case, axes, sensors_of(case, task.first), along)


def sensors_of(case: Case, first: Case) -> tuple[int, ...]:
    """Return the sensors, by default the bead in the middle; a Fault for a bead that is not there."""
    count = first.model.measured.count
    measure = case.model.measure
    if measure.sensor is not None and measure.sensors is not None:
        raise Fault(("measure", "sensors"), "give sensor or sensors alone")
    if measure.sensors is None:
        places: list[Path] = [("measure", "sensor")]
        sensors = [measure.sensor if measure.sensor is not None else (count + 1) // 2]
    else:
        sensors = measure.sensors
        places = [("measure", "sensors", i) for i in range(len(sensors))]
    for place, sensor in zip(places, sensors, strict=True):
        if sensor > count:
            raise Fault(place, f"{sensor} is no bead of a chain of {count}; beads are counted from the struck end")
    if len(set(sensors)) < len(sensors):
        raise Fault(("measure", "sensors"), "names a bead twice")
    return tuple(sensors)


def _along(case: Case, axes: tuple[Axis, ...]) -> Axis | None:
    critical = case.model.measure.critical_distance
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
    if case.model.measure.sensors is not None and len(case.model.measure.sensors) != 1:
        raise Fault(("measure", "sensors"), "must be one for a critical distance; give sensor")
    return matching[0]


def run_task(task: Task, jobs: int | None = None) -> xr.Dataset:
    """Run it."""
    case = task.case
    if task.kind == "run":
        data = run_once(case, case.simulation())
        for sensor in task.sensors if case.model.measure.numerical_error else ():
            with of_run():
                data = numerical_error(case.simulation, case.until, sensor).noted_in(data)
        if budget := budget_of(case):
            for sensor in task.sensors:
                data = budget.of_sensor(sensor, findings_of(data)).noted_in(data, sensor)
    elif task.along is None:
        build = Build(case, task.axes)
        measure = Measure(task.sensors, case.model.measure.traces, case.model.measure.chain)
        axes: dict[str, Any] = {axis.name: axis.values for axis in task.axes}
        with of_run():
            data = sweep(build, case.until, jobs=jobs, measure=measure, **axes)
    else:
        data = _critical(task, jobs)
    for axis in task.axes:
        name = "distance" if axis is task.along else axis.name
        words = {"path": written(axis.path), "long_name": axis.words}
        data[name].attrs.update(words | ({"units": axis.si} if axis.si else {}))
    return data.assign_attrs(case=case.to_toml())


def _critical(task: Task, jobs: int | None) -> xr.Dataset:
    """Return the critical distance along an axis, for all values of the others."""
    along, wanted = task.along, task.case.model.measure.critical_distance
    assert along is not None
    assert wanted is not None
    build = _OfDistance(Build(task.case, task.axes), along.name)
    axes: dict[str, Any] = {axis.name: axis.values for axis in task.others}
    return critical_distance_search(
        build, task.case.until, task.sensors[0], along.values, wanted.tolerance, wanted.bracket, wanted.relative,
        jobs=jobs, **axes,
    )  # fmt: skip


@dataclass(frozen=True)
class _OfDistance:
    """A builder whose argument `distance` is the axis of the critical distance."""

    build: Build
    name: str

    def __call__(self, distance: float, **others: Any) -> CoSimulation:
        return self.build(**{self.name: distance}, **others)
