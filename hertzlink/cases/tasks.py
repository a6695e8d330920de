"""The task of a case: one run, a sweep over axes, or a search for the critical distance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import isnan, prod
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.numerical_error import numerical_error
from coupling.inference.plates import modes_of
from coupling.inference.uncertainty import uncertainty
from coupling.results.ar_and_tof import amplitude_ratio, reflections, time_of_flight
from coupling.results.findings import findings_of, with_warnings
from coupling.results.measures import sensor_force
from coupling.results.waves import NoWave
from coupling.sweeps.critical_search import critical_distance_search
from coupling.sweeps.sweep import sweep
from coupling.yield_check import is_of_yield
from hertzlink.cases import Fault, Path, entry, shown, written
from hertzlink.cases.axes import Axis, axes_of, axis_of, si_value, size_of
from hertzlink.cases.case import Case
from hertzlink.cases.reader import number
from structures.caution import caution, collected
from structures.units import NUMBER, PARTS, spread_of

FEWEST_DISTANCES = 3
FEWEST_ON_MODES = 4  # plates of a sweep: from this number on, one set of modes takes less time than a mesh for each


@dataclass(frozen=True)
class Task:
    """A task of a case, checked before anything runs: its axes, its sensors, the axis of a critical distance."""

    case: Case
    axes: tuple[Axis, ...]
    sensors: tuple[int, ...] = ()
    along: Axis | None = None

    @property
    def first(self) -> Case:
        """The case at the first point."""
        return self.case.changed({axis.path: axis.values[0] for axis in self.axes})

    @property
    def ranges(self) -> dict[str, Any]:
        """The first and the last value of each axis (SI) by its name."""
        return {axis.name: (float(axis.values[0]), float(axis.values[-1])) for axis in self.axes}

    @property
    def start(self) -> dict[str, Any]:
        """The first value of each axis by its name."""
        return {axis.name: axis.values[0] for axis in self.axes}

    @property
    def ends(self) -> list[dict[str, Any]]:
        """The points at which one axis is at its least or greatest value, and the others are at their first."""
        points = list[dict[str, Any]]()
        for axis in self.axes:
            ends = {min(axis.values), max(axis.values)} if axis.is_number else axis.values
            points += [self.start | {axis.name: value} for value in ends if value != axis.values[0]]
        return points

    @property
    def units(self) -> dict[str, str]:
        """The SI unit of each axis by its name, for messages and budgets."""
        return {axis.name: axis.si for axis in self.axes}

    @property
    def kind(self) -> str:
        """One run, a sweep, or a critical distance."""
        return "critical distance" if self.along is not None else "sweep" if self.axes else "run"

    def __call__(self, **values: Any) -> CoSimulation:
        """Return the co-simulation at values of the axes. A refused value raises a Fault at its place in the case."""
        try:
            return self.case.changed({axis.path: values[axis.name] for axis in self.axes}).simulation()
        except Fault as fault:
            for axis in self.axes:
                if fault.path[: len(axis.path)] == axis.path:
                    place, value = axis.place, values[axis.name]
                    if isinstance(entry(self.case.data, place), list) and value in axis.values:
                        place = (*place, axis.values.index(value))
                    raise Fault(place, fault.reason) from None
            raise


def task_of(case: Case) -> Task:
    """Return the task of a case; raise a Fault for entries that do not fit together."""
    measure, task = case.measure, Task(case, axes_of(case))
    if "sensitivities" in case.tree.entries:
        budget_of(case)
    if measure.chain >= (count := len(case.all("chain"))):
        raise Fault(("measure", "chain"), f"{measure.chain} is not a chain of {count}, counted from 0")
    if measure.numerical_error:
        case.only_chain("a numerical error")
        if task.axes:
            raise Fault(("measure", "numerical_error"), "is for a single run; leave out [sweep], or this entry")
    if task.axes and "save_every" in case.tree.entries["run"].entries:
        raise Fault(("run", "save_every"), "is chosen by a sweep; leave it out")
    task = replace(task, sensors=sensors_of(case, task.first))
    if measure.critical_distance is None:
        return task

    case.only_chain("a critical distance")
    wanted, place = measure.critical_distance.along, ("measure", "critical_distance", "along")
    paths = {written(axis.path): axis for axis in task.axes}
    along = paths.get(wanted)
    if along is None:
        cure = f"take one of them: {', '.join(paths)}" if paths else "add it there"
        raise Fault(place, f'"{wanted}" is not an axis of [sweep]; {cure}')
    if not along.is_number or len(along.values) < FEWEST_DISTANCES:
        raise Fault(place, f'"{wanted}" has too few distances in [sweep]; give {FEWEST_DISTANCES} or more')
    if len(task.sensors) != 1:
        raise Fault(("measure", "sensors"), "must be a single bead for a critical distance; give sensor")
    distance = replace(along, name="distance")  # as results call it
    return replace(task, axes=tuple(distance if axis is along else axis for axis in task.axes), along=distance)


def sensors_of(case: Case, first: Case) -> tuple[int, ...]:
    """Return the sensors, by default the bead in the middle; raise a Fault for a bead that does not exist."""
    measure, count = case.measure, count_of_beads(first, case.measure.chain)
    if measure.sensor is not None and measure.sensors is not None:
        raise Fault(("measure", "sensors"), "give sensor or sensors, not both")
    sensors = measure.sensors or [measure.sensor or (count + 1) // 2]
    for i, sensor in enumerate(sensors):
        if sensor > count:
            place: Path = ("measure", "sensors", i) if measure.sensors else ("measure", "sensor")
            raise Fault(place, f"{sensor} is not a bead of a chain of {count}; beads are counted from the struck end")
    if len(set(sensors)) < len(sensors):
        raise Fault(("measure", "sensors"), "names a bead twice")
    return tuple(sensors)


def count_of_beads(case: Case, chain: int) -> int:
    """Return the number of beads of a chain."""
    entries = case.all("chain")[chain].entries
    beads = entries["beads"]
    count: int = beads if isinstance(beads, int) else sum(bead.entries.get("count", 1) for bead in beads)
    return count * int(entries.get("repeat", 1))


def budget_of(case: Case) -> tuple[Task, dict[str, tuple[float, float]]]:
    """Return the task of [sensitivities], whose axes are its entries, and their values and standard uncertainties."""
    case.only_chain("an uncertainty budget")
    if case.tree.entries.get("sweep"):
        raise Fault(("sensitivities",), "is for a single run; leave out [sweep], or this section")
    axes, inputs = list[Axis](), dict[str, tuple[float, float]]()
    for key, text in case.tree.entries["sensitivities"].items():
        place = ("sensitivities", key)
        axis = axis_of(case, key, place)
        stated = entry(case.data, axis.path)
        stated = case.value(axis.path) if stated is None else stated
        value = si_value(case, axis.path, 1.0 if stated is None else stated, place)  # also refuses a wrong path
        if stated is None:
            raise Fault(place, "is not written in the case; give its value there first")
        if not isinstance(value, float) or value == 0.0:
            raise Fault(place, f"{shown(value)} must be a number other than zero, and not a count")
        match = NUMBER.fullmatch(str(text))
        part = match and match[2] in PARTS
        spread = spread_of(str(text), value) if part else number(text, size_of(case, axis.path), place)
        if isnan(spread):
            raise Fault(place, f'{shown(text)} must be a standard uncertainty, such as "0.02 mm" or "2 %"')
        axes.append(replace(axis, name=key))
        inputs[key] = value, spread
    return Task(case, tuple(axes)), inputs


def builder_of(task: Task) -> Callable[..., CoSimulation]:
    """Return the builder of a task's points: on modes, if a rectangular plate is struck at many places."""
    plates = prod(len(axis.values) for axis in task.axes if axis.path[0] == "structure")
    few = plates < FEWEST_ON_MODES and task.along is None
    points = [partial(task, **point) for point in (task.start, *task.ends)]
    on_modes = None if few else modes_of(points, task.case.until)
    build: Callable[..., CoSimulation] = task if on_modes is None else on_modes.builder(task)
    with collected():  # a refused point raises a Fault before processes start; the runs repeat warnings
        for point in task.ends:
            build(**point)
    return build


def kept_of_run(run: xr.Dataset, sensors: Sequence[int], traces: bool, chain: int) -> xr.Dataset:
    """Return what a sweep keeps of a run: AR and TOF of both waves at each sensor, and perhaps the forces."""
    run = run.isel(chain=chain) if "chain" in run.dims else run
    data = xr.Dataset(coords={"sensor": list(sensors)}, attrs=run.attrs)
    for prefix, wave in (("", "primary"), ("secondary_", "secondary")):
        for read in (amplitude_ratio, time_of_flight):
            each = [read(run, sensor, wave) for sensor in sensors]
            data[prefix + read.__name__] = "sensor", np.array([float(value) for value in each]), each[0].attrs
    for sensor in data.sensor.values[data.amplitude_ratio.isnull()].tolist():
        primary = reflections(run, sensor).primary
        # A warning about the record was given when AR was read.
        if isinstance(primary, NoWave) and not primary.reason.startswith("the record "):
            caution(f"waves at bead {sensor}: {primary.reason}")
    if traces:
        forces = [sensor_force(run, sensor) for sensor in sensors]
        data = data.assign_coords(time=run.time)
        data["sensor_force"] = (("sensor", "time"), np.stack([force.values for force in forces]), forces[0].attrs)
    return data


def run_task(task: Task, jobs: int | None = None) -> xr.Dataset:
    """Run the task."""
    case, measure, build = task.case, task.case.measure, builder_of(task)
    axes: dict[str, Any] = {axis.name: axis.values for axis in task.axes if axis is not task.along}
    with case.located():
        if task.along is not None and (wanted := measure.critical_distance):
            data = critical_distance_search(
                build, case.until, task.sensors[0], task.along.values, wanted.tolerance, wanted.bracket, jobs, **axes
            )
        elif task.axes:
            kept = partial(kept_of_run, sensors=task.sensors, traces=measure.traces, chain=measure.chain)
            data = sweep(build, case.until, jobs, kept, **axes)
        else:
            data = case.run()
            for sensor in task.sensors:
                if measure.numerical_error:
                    data = numerical_error(case.simulation, case.until, sensor).noted_in(data)
                if "sensitivities" in case.tree.entries:
                    data = with_budget(case, data, sensor)
    for axis in task.axes:
        words = {"path": written(axis.path), "long_name": axis.words}
        data[axis.name].attrs.update(words | ({"units": axis.si} if axis.si else {}))
    return data.assign_attrs(case=case.to_toml())


def with_budget(case: Case, data: xr.Dataset, sensor: int) -> xr.Dataset:
    """Return a run with the budget of AR and TOF at a sensor, without the findings that the run has already."""
    task, inputs = budget_of(case)
    findings, spreads = findings_of(data), dict[str, Any](inputs)
    with collected() as said:
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


def run_both(task: Task, jobs: int | None = None) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Run a task, and once more with Jackson and Green's law if contacts yield. A sweep is not repeated."""
    with collected() as said:
        data = run_task(task, jobs)
    findings, yielded = findings_of(data), None
    if task.kind != "sweep" and any(map(is_of_yield, (*findings, *said))):
        law = {(*call.path, "law"): {"kind": "jackson_green"} for call in task.case.all("chain")}
        others = {"measure.numerical_error": False, "sensitivities": None}
        try:
            with collected() as fresh:
                yielded = run_task(task_of(task.case.changed(law | others)), jobs)
        except ValueError:
            pass  # A case that cannot run with the law keeps its findings.
        else:
            cure = '; the rows "fresh spot" include it, by Jackson and Green\'s law'
            new = [one for one in fresh if one not in (*said, *findings) and not is_of_yield(one)]

            def cured(messages: list[str]) -> list[str]:
                return [one.split("; ")[0] + cure if is_of_yield(one) else one for one in messages]

            data = with_warnings(data, cured(findings))
            said = [*cured(said), *(f"fresh spot, {one}" for one in new)]
    for message in dict.fromkeys(said):
        caution(message)
    return data, yielded
