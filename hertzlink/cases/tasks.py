"""The task of a case: one run, a sweep over axes, or a search for the critical distance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.numerical_error import numerical_error
from coupling.inference.uncertainty import uncertainty
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import findings_of, with_warnings
from coupling.results.measures import sensor_force
from coupling.sweeps.critical_search import critical_distance_search
from coupling.sweeps.sweep import sweep
from coupling.yield_check import is_of_yield
from hertzlink.cases.case import YIELDING, Case
from hertzlink.cases.source import Fault, Path, entry, written
from structures.caution import caution, collected

if TYPE_CHECKING:
    from hertzlink.cases.axes import Axis

FEWEST_DISTANCES = 3


@dataclass(frozen=True)
class Task:
    """The task of a case, checked before anything runs: its axes, its sensors, the axis of a critical distance."""

    case: Case
    axes: tuple["Axis", ...]
    sensors: tuple[int, ...] = ()
    along: "Axis | None" = None

    @property
    def first(self) -> Case:
        """The case at the first point."""
        return self.case.changed({axis.path: axis.values[0] for axis in self.axes})

    @property
    def others(self) -> tuple["Axis", ...]:
        """All axes but that of the critical distance."""
        return tuple(axis for axis in self.axes if axis is not self.along)

    @property
    def kind(self) -> str:
        """One run, a sweep, or a critical distance."""
        return "critical distance" if self.along is not None else "sweep" if self.axes else "run"

    def build(self, **values: Any) -> CoSimulation:
        """Return the co-simulation at values of the axes; `distance` is that of the critical distance.

        What is refused of an axis is a Fault of [sweep], in the unit of the user.
        """
        point = [(axis, values["distance" if axis is self.along else axis.name]) for axis in self.axes]
        changes: dict[Path, Any] = {axis.path: value for axis, value in point}
        try:
            return self.case.changed(changes).simulation()
        except Fault as fault:
            axis, value = next((one for one in point if fault.path[: len(one[0].path)] == one[0].path), (None, 0.0))
            if axis is None:
                raise
            reason = fault.reason
            try:
                self.case.changed(changes | {axis.path: axis.typed(value)}).simulation()
            except Fault as typed:
                reason = typed.reason
            listed = isinstance(entry(self.case.data, axis.place), list)
            raise Fault((*axis.place, axis.values.index(value)) if listed else axis.place, reason) from None


def task_of(case: Case) -> Task:
    """Return the task of a case; a Fault for what does not fit together."""
    measure, task = case.measure, Task(case, ())
    if case.tree.entries.get("sweep") or "sensitivities" in case.tree.entries:
        from hertzlink.cases.axes import axes_of, budget_of

        task = Task(case, axes_of(case))
        if "sensitivities" in case.tree.entries:
            budget_of(case)
    if measure.chain >= (count := len(case.all("chain"))):
        raise Fault(("measure", "chain"), f"{measure.chain} is no chain of {count}, counted from 0")
    if measure.numerical_error:
        case.only_chain("a numerical error")
        if task.axes:
            raise Fault(("measure", "numerical_error"), "is that of one run; leave out [sweep], or this entry")
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
        give = f'give [sweep] "{wanted}" = {{ from =, to =, step = }}'
        cure = f"take one of them: {', '.join(paths)}" if paths else give
        raise Fault(place, f'"{wanted}" is no axis of [sweep]; {cure}')
    if not along.is_number or len(along.values) < FEWEST_DISTANCES:
        raise Fault(place, f'"{wanted}" has too few distances in [sweep]; give {FEWEST_DISTANCES} or more')
    if len(task.sensors) != 1:
        raise Fault(("measure", "sensors"), "must be one for a critical distance; give sensor")
    return replace(task, along=along)


def sensors_of(case: Case, first: Case) -> tuple[int, ...]:
    """Return the sensors, by default the bead in the middle; a Fault for a bead that is not there."""
    measure, count = case.measure, count_of_beads(first, case.measure.chain)
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
    data = xr.Dataset(coords={"sensor": list(sensors)}, attrs=run.attrs)
    for prefix, wave in (("", "primary"), ("secondary_", "secondary")):
        for read in (amplitude_ratio, time_of_flight):
            each = [read(run, sensor, wave) for sensor in sensors]
            data[prefix + read.__name__] = "sensor", np.array([float(value) for value in each]), each[0].attrs
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
            jobs=jobs, **axes,
        )  # fmt: skip
    elif task.axes:
        kept = partial(kept_of_run, sensors=task.sensors, traces=measure.traces, chain=measure.chain)
        with case.located():
            data = sweep(task.build, case.until, jobs=jobs, measure=kept, **axes)
    else:
        data = case.run()
        for sensor in task.sensors:
            if measure.numerical_error:
                with case.located():
                    data = numerical_error(case.simulation, case.until, sensor).noted_in(data)
            if "sensitivities" in case.tree.entries:
                data = _with_budget(case, data, sensor)
    for axis in task.axes:
        words = {"path": written(axis.path), "long_name": axis.words}
        name = "distance" if axis is task.along else axis.name
        data[name].attrs.update(words | ({"units": axis.si} if axis.si else {}))
    return data.assign_attrs(case=case.to_toml())


def _with_budget(case: Case, data: xr.Dataset, sensor: int) -> xr.Dataset:
    """Return a run with the budget of AR and TOF at a sensor, without the findings that the run has already."""
    from hertzlink.cases.axes import budget_of

    build, inputs = budget_of(case)
    findings, spreads = findings_of(data), dict[str, Any](inputs)
    with case.located(), collected() as said:
        try:
            budget = uncertainty(build, case.until, sensor, **spreads)
        except ValueError as error:
            key, _, reason = str(error).partition(": ")
            raise Fault(("sensitivities", key), reason) if key in inputs else error from error
    for message in said:
        if message not in findings:
            caution(message)
    new = [warning for warning in budget.warnings if warning not in findings]
    return replace(budget, warnings=new).noted_in(data, sensor)


def run_both(task: Task, jobs: int | None = None) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Run a task; where contacts are beyond yield, once more with Jackson and Green's law, as the findings say then.

    The second result is that with the law, where there is one. A sweep is not repeated.
    """
    yielded = None
    with collected() as said:
        data = run_task(task, jobs)
    findings = findings_of(data)
    if task.kind != "sweep" and any(map(is_of_yield, (*findings, *said))):
        law = {(*call.path, "law"): {"kind": "jackson_green"} for call in task.case.all("chain")}
        others = {"measure.numerical_error": False, "sensitivities": None}
        try:
            with collected():  # the user was warned of the same in the first run
                yielded = run_task(task_of(task.case.changed(law | others)), jobs)
        except ValueError:
            pass  # A case that cannot run with the law keeps its findings.
        else:

            def computed(finding: str) -> str:
                cure = f'{finding.split("; ")[0]}; "fresh spot" in the table is with {YIELDING}'
                return cure if is_of_yield(finding) else finding

            said = list(map(computed, said))
            data = with_warnings(data, list(map(computed, findings)))
    for message in dict.fromkeys(said):
        caution(message)
    return data, yielded
