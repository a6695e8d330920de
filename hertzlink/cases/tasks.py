"""The task of a case: one run, a sweep over axes, or a search for the critical distance; and its results as tables.

What belongs to sweeps alone is loaded from `sweeps` where a case has one.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.numerical_error import numerical_error
from coupling.results.ar_and_tof import NUMERICAL_ERROR, UNCERTAINTY, amplitude_ratio, reflections, time_of_flight
from coupling.results.findings import findings_of, with_warnings
from coupling.results.measures import energy_error, sensor_force
from coupling.results.waves import ABOVE_ONE, NoWaveError
from coupling.sweeps.critical_search import critical_distance_search
from coupling.sweeps.sweep import sweep
from coupling.yield_check import is_of_yield
from hertzlink.cases import Fault, Path, entry, written
from hertzlink.cases.case import YIELDING, Case
from structures.caution import caution, collected

if TYPE_CHECKING:
    from hertzlink.cases.sweeps import Axis

FEWEST_DISTANCES = 3
WIDTH = 80

MOST_ROWS = 40
"""Rows of a table on the terminal; the file has all."""

HEADS = {
    "sensor": "bead", "force (N)": "peak, N", "arrival (s)": "arrival, µs", "amplitude ratio": "AR",
    "time of flight (s)": "TOF, µs", "secondary amplitude ratio": "AR, 2nd", "secondary time of flight (s)": "TOF, µs",
}  # fmt: skip
"""Columns of files, and their heads on the terminal."""


@dataclass(frozen=True)
class Task:
    """A task of a case, checked before anything runs: its axes, its sensors, the axis of a critical distance."""

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
    def ranges(self) -> dict[str, Any]:
        """The first and the last value of each axis (SI) by its name."""
        return {axis.name: (float(axis.values[0]), float(axis.values[-1])) for axis in self.axes}

    @property
    def units(self) -> dict[str, str]:
        """The SI unit of each axis by its name, for messages and budgets."""
        return {axis.name: axis.si for axis in self.axes}

    @property
    def kind(self) -> str:
        """One run, a sweep, or a critical distance."""
        return "critical distance" if self.along is not None else "sweep" if self.axes else "run"

    def __call__(self, **values: Any) -> CoSimulation:
        """Return the co-simulation at values of the axes. What is refused of one is a Fault where it is asked for."""
        point = [(axis, values[axis.name]) for axis in self.axes]
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
            listed = isinstance(entry(self.case.data, axis.place), list) and value in axis.values
            raise Fault((*axis.place, axis.values.index(value)) if listed else axis.place, reason) from None


def task_of(case: Case) -> Task:
    """Return the task of a case; a Fault for what does not fit together."""
    measure, task = case.measure, Task(case, ())
    if case.tree.entries.get("sweep") or "sensitivities" in case.tree.entries:
        from hertzlink.cases.sweeps import axes_of, budget_of

        task = Task(case, axes_of(case))
        if "sensitivities" in case.tree.entries:
            budget_of(case)
    if measure.chain >= (count := len(case.all("chain"))):
        raise Fault(("measure", "chain"), f"{measure.chain} is not a chain of {count}, counted from 0")
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
        raise Fault(place, f'"{wanted}" is not an axis of [sweep]; {cure}')
    if not along.is_number or len(along.values) < FEWEST_DISTANCES:
        raise Fault(place, f'"{wanted}" has too few distances in [sweep]; give {FEWEST_DISTANCES} or more')
    if len(task.sensors) != 1:
        raise Fault(("measure", "sensors"), "must be one for a critical distance; give sensor")
    distance = replace(along, name="distance")  # as results call it
    return replace(task, axes=tuple(distance if axis is along else axis for axis in task.axes), along=distance)


def sensors_of(case: Case, first: Case) -> tuple[int, ...]:
    """Return the sensors, by default the bead in the middle; a Fault for a bead that is not there."""
    measure, count = case.measure, count_of_beads(first, case.measure.chain)
    if measure.sensor is not None and measure.sensors is not None:
        raise Fault(("measure", "sensors"), "give sensor or sensors alone")
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
    build: Callable[..., CoSimulation] = task
    axes: dict[str, Any] = {axis.name: axis.values for axis in task.others}
    if task.axes:
        from hertzlink.cases.sweeps import builder_of

        build = builder_of(task)
    if task.along is not None and measure.critical_distance is not None:
        wanted = measure.critical_distance
        data = critical_distance_search(
            build, case.until, task.sensors[0], task.along.values, wanted.tolerance, wanted.bracket,
            jobs=jobs, **axes,
        )  # fmt: skip
    elif task.axes:
        kept = partial(kept_of_run, sensors=task.sensors, traces=measure.traces, chain=measure.chain)
        with case.located():
            data = sweep(build, case.until, jobs=jobs, measure=kept, **axes)
    else:
        data = case.run()
        for sensor in task.sensors:
            if measure.numerical_error:
                with case.located():
                    data = numerical_error(case.simulation, case.until, sensor).noted_in(data)
            if "sensitivities" in case.tree.entries:
                from hertzlink.cases.sweeps import with_budget

                data = with_budget(case, data, sensor)
    for axis in task.axes:
        words = {"path": written(axis.path), "long_name": axis.words}
        data[axis.name].attrs.update(words | ({"units": axis.si} if axis.si else {}))
    return data.assign_attrs(case=case.to_toml())


def run_both(task: Task, jobs: int | None = None) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Run a task, and where contacts yield once more with Jackson and Green's law. A sweep is not repeated."""
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
                cure = f'{finding.split("; ")[0]}; "fresh spot" in the table contains it, by Jackson and Green\'s law'
                return cure if is_of_yield(finding) else finding

            said = list(map(computed, said))
            data = with_warnings(data, list(map(computed, findings)))
    for message in dict.fromkeys(said):
        caution(message)
    return data, yielded


@dataclass(frozen=True)
class Table:
    """A table: the file with its numbers in SI units, and what is shown of it, if anything, in the user's units."""

    file: str
    data: pd.DataFrame
    shown: pd.DataFrame = field(default_factory=pd.DataFrame)

    def csv(self) -> str:
        """Return a CSV file; numbers have all their digits, and what is unknown is empty."""

        def cell(value: Any) -> Any:
            # An apostrophe keeps spreadsheets from taking the text of a user for a formula.
            return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t")) else value

        text: str = self.data.map(cell).to_csv(index=False, header=[*map(cell, self.data.columns)], lineterminator="\n")
        return text

    def lines(self) -> list[str]:
        """Return the lines of the table. If it is too wide its heads have two lines, or else each row is a sentence."""
        head, rows = [*self.shown.columns], self.shown.values.tolist()[:MOST_ROWS]
        left_out = len(self.shown) - MOST_ROWS
        more = [f"... and {left_out} more in {self.file}"] if left_out > 0 else []
        halves = [(words.rpartition(" ")[::2] if " " in words else ("", words)) for words in head]
        for heads in ([head], list(zip(*halves, strict=True))):
            widths = [max(map(len, column)) for column in zip(*heads, *rows, strict=True)]
            lines = [
                "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in (*heads, *rows)
            ]
            if len(lines[0]) <= WIDTH:
                return [*lines[: len(heads)], "-" * len(lines[0]), *lines[len(heads) :], *more]
        texts = ["; ".join(f"{name}: {cell}" for name, cell in zip(head, row, strict=True)) for row in rows]
        return [*(fill(text, WIDTH, subsequent_indent="  ") for text in texts), *more]


@dataclass(frozen=True)
class Answer:
    """What a command on a case gives."""

    data: xr.Dataset
    tables: list[Table]
    below: list[str] = field(default_factory=list)  # lines below the first table
    title: str = ""
    yielded: xr.Dataset | None = None  # the result with a law of yielding
    sketched: CoSimulation | None = None  # where the result does not hold what is sketched
    others: dict[str, str] = field(default_factory=dict)  # files that are no tables
    code: int = 0

    @property
    def text(self) -> str:
        """The text for the terminal."""
        title = [fill(self.title, WIDTH), ""] if self.title else []
        return "\n".join([*title, *self.tables[0].lines(), *self.below])

    @property
    def files(self) -> dict[str, str]:
        """The files by name."""
        return {table.file: table.csv() for table in self.tables} | self.others


def report(task: Task, data: xr.Dataset, yielded: xr.Dataset | None = None) -> Answer:
    """Return the tables of a task's result. yielded: the result with a law of yielding."""
    tables_of = _run
    if task.axes:
        from hertzlink.cases.sweeps import critical_tables, sweep_tables

        tables_of = sweep_tables if task.along is None else critical_tables
    tables, below = tables_of(task, data)
    if yielded is not None:
        with collected():  # The warnings of a run are those of its elastic contacts.
            others, _ = tables_of(task, yielded)
        tables = [table for pair in zip(tables, others, strict=True) for table in _of_both_laws(*pair)]
        below.insert(0, fill(f"fresh spot: there the metal yields; computed with {YIELDING}", WIDTH))
    return Answer(data, tables, below, task.case.title, yielded)


def _of_both_laws(elastic: Table, yielding: Table) -> list[Table]:
    """Return the table of both contact laws: a last column says which one a row is of."""
    if elastic.file == "traces.csv":  # their times differ
        return [elastic, Table("traces_yielding.csv", yielding.data)]
    laws = {"elastic": elastic.data, "Jackson-Green": yielding.data}
    data = pd.concat([one.assign(**{"contact law": law}) for law, one in laws.items()])
    shown = pd.DataFrame()
    if len(elastic.shown):
        differs = (elastic.shown != yielding.shown).any(axis=1)
        rows = elastic.shown.assign(contacts="elastic"), yielding.shown[differs].assign(contacts="fresh spot")
        shown = pd.concat(rows).sort_index(kind="stable")
    return [Table(elastic.file, data, shown)]


def _run(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the waves and the traces of a run."""
    chains = range(len(task.case.all("chain")))
    traces, rows = {"time (s)": data.time.values}, []
    for chain, sensor in product(chains, task.sensors):
        if sensor > count_of_beads(task.case, chain):
            continue
        run = of_chain(data, chain)
        of = f" of chain {chain}" if len(chains) > 1 else ""
        traces[f"force at bead {sensor}{of} (N)"] = sensor_force(run, sensor).values
        try:
            waves: Any = reflections(run, sensor)
        except NoWaveError:  # as in a chain that nothing strikes
            waves = None
        for name in ("incident", "primary", "secondary"):
            wave = getattr(waves, name, None)
            measures = [np.nan] * 4
            if wave:
                of_incident = (1.0, 0.0) if name == "incident" else (wave.amplitude_ratio, wave.time_of_flight)
                measures = [wave.amplitude, wave.arrival, *of_incident]
            rows.append([chain, sensor, name, *measures])
    columns = ["chain", "sensor", "wave", "force (N)", "arrival (s)", "amplitude ratio", "time of flight (s)"]
    frame = pd.DataFrame(rows, columns=columns)
    if len(chains) == 1:
        frame = frame.drop(columns="chain")

    below = [*above_one(frame), f"energy created or lost: {float(energy_error(data)):.1e} of the impact's"]
    below += ["\n" + error["text"] for error in json.loads(data.attrs.get(NUMERICAL_ERROR, "{}")).values()]
    for sensor, budget in json.loads(data.attrs.get(UNCERTAINTY, "{}")).items():
        below += [f"\nuncertainty at bead {sensor}, with the share of each entry", budget["text"]]
    return [Table("waves.csv", frame, shown_of(frame)), Table("traces.csv", pd.DataFrame(traces))], below


def above_one(frame: pd.DataFrame) -> list[str]:
    """Return a remark where an AR exceeds 1."""
    return [fill(f"AR {ABOVE_ONE}", WIDTH)] if (frame.filter(like="amplitude ratio") > 1.0).any(axis=None) else []


def shown_of(frame: pd.DataFrame, task: Task | None = None) -> pd.DataFrame:
    """Return the columns of a file as texts: times in µs, and the axes of a task, which come first, in their units."""
    axes = [] if task is None else task.axes
    texts = [frame.iloc[:, i].map(axis.shown) for i, axis in enumerate(axes)]
    for name in frame.columns[len(axes) :]:
        micro = name.endswith("(s)")
        number = (lambda value: f"{1e6 * value:.2f}") if micro else (lambda value: f"{value:.4g}")
        measured = frame[name].dtype == float
        texts.append(frame[name].map(number).replace("nan", "-") if measured else frame[name].astype(str))
    heads = [axis.head for axis in axes] + [HEADS.get(name, name) for name in frame.columns[len(axes) :]]
    return pd.concat(texts, axis=1).set_axis(heads, axis=1)
