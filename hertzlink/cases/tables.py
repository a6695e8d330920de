"""The results of a case as a user reads them: tables of 80 columns, and CSV files."""

import json
from dataclasses import dataclass, field
from itertools import product
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import NUMERICAL_ERROR, UNCERTAINTY, reflections
from coupling.results.measures import energy_error, sensor_force
from coupling.results.waves import ABOVE_ONE, NoWaveError
from hertzlink.cases.case import YIELDING
from hertzlink.cases.tasks import Task, count_of_beads, of_chain
from structures.caution import collected
from structures.checks import count_of

WIDTH = 80

MOST_ROWS = 40
"""Rows of a table on the terminal; the file has all."""

HEADS = {
    "sensor": "bead", "force (N)": "peak, N", "arrival (s)": "arrival, µs", "amplitude ratio": "AR",
    "time of flight (s)": "TOF, µs", "secondary amplitude ratio": "AR, 2nd", "secondary time of flight (s)": "TOF, µs",
}  # fmt: skip
"""Columns of files, and their heads on the terminal."""


@dataclass(frozen=True)
class Table:
    """A table: the file with its numbers in SI units, and what is shown of it: texts, in the units of the user.

    A table without `shown` is a file alone.
    """

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
        """Return the lines of the table, numbers to the right; what is left out is said to be in the file.

        Of a table that is too wide the heads have two lines, or else each row is a sentence.
        """
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
    """What a command on a case gives: its result, tables, and lines below the first one.

    yielded: the result with a law of yielding. sketched: what is drawn where the result does not hold it. others: files
    that are no tables, by name. code: the exit code.
    """

    data: xr.Dataset
    tables: list[Table]
    below: list[str] = field(default_factory=list)
    title: str = ""
    yielded: xr.Dataset | None = None
    sketched: CoSimulation | None = None
    others: dict[str, str] = field(default_factory=dict)
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
    tables_of = {"run": _run, "sweep": _sweep, "critical distance": _critical}[task.kind]
    tables, below = tables_of(task, data)
    if yielded is not None:
        with collected():  # The warnings of a run are those of its elastic contacts.
            others, _ = tables_of(task, yielded)
        tables = [table for pair in zip(tables, others, strict=True) for table in _of_both_laws(*pair)]
        below.insert(0, fill(f"fresh spot: there the metal yields; computed with {YIELDING}", WIDTH))
    return Answer(data, tables, below, task.case.title, yielded)


def _of_both_laws(elastic: Table, yielding: Table) -> list[Table]:
    """Return the table of both contact laws: a last column says which one a row is of. Traces, whose times differ, are
    two tables."""
    if elastic.file == "traces.csv":
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

    below = [*_above_one(frame), f"energy created or lost: {float(energy_error(data)):.1e} of the impact's"]
    below += ["\n" + error["text"] for error in json.loads(data.attrs.get(NUMERICAL_ERROR, "{}")).values()]
    for sensor, budget in json.loads(data.attrs.get(UNCERTAINTY, "{}")).items():
        below += [f"\nuncertainty at bead {sensor}, with the share of each entry", budget["text"]]
    return [Table("waves.csv", frame, _shown(frame)), Table("traces.csv", pd.DataFrame(traces))], below


def _sweep(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the points of a sweep, and its traces: a column for each run and sensor."""
    names = ["amplitude_ratio", "time_of_flight", "secondary_amplitude_ratio", "secondary_time_of_flight"]
    order = [*(axis.name for axis in task.axes), "sensor"]
    frame = data[names].to_dataframe(order).reset_index()[[*order, *names]]
    measures = ["amplitude ratio", "time of flight (s)", "secondary amplitude ratio", "secondary time of flight (s)"]
    frame.columns = pd.Index([*(axis.column for axis in task.axes), "bead", *measures])
    shown = _shown(frame, task)
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
    return tables, _above_one(frame)


def _critical(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the critical distances, and AR at all distances that were run."""
    along, wanted = task.along, task.case.measure.critical_distance
    assert along is not None
    assert wanted is not None
    rows, cells, samples, remarks = [], [], [], set()
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
        for i in np.flatnonzero(at.sampled.values.astype(bool)):
            sample = at.isel(distance=int(i))
            samples.append([*values, *map(float, (sample.distance, sample.amplitude_ratio, sample.time_of_flight))])

    unit = f", {along.unit}" if along.unit else ""
    head = [*(axis.head for axis in task.others), f"critical distance{unit}", f"between{unit}", "AR far away"]
    others, distance = [axis.column for axis in task.others], f"distance ({along.si})"
    columns = [*others, f"critical {distance}", "low (m)", "high (m)", "AR far away", "tolerance of AR"]
    curve = [*others, distance, "amplitude ratio", "time of flight (s)"]
    tables = [
        Table("critical_distance.csv", pd.DataFrame(rows, columns=columns), pd.DataFrame(cells, columns=head)),
        Table("points.csv", pd.DataFrame(samples, columns=curve)),
    ]
    below = [fill(remark, WIDTH) for remark in sorted(remarks)]
    below.append(f"beyond the critical distance AR stays within ± {wanted.tolerance:g} of AR far away")
    below.append(f"AR at bead {task.sensors[0]} in {count_of(len(samples), 'run')}: points.csv")
    return tables, below


def _above_one(frame: pd.DataFrame) -> list[str]:
    """Return a remark where an AR exceeds 1."""
    return [fill(f"AR {ABOVE_ONE}", WIDTH)] if (frame.filter(like="amplitude ratio") > 1.0).any(axis=None) else []


def _shown(frame: pd.DataFrame, task: Task | None = None) -> pd.DataFrame:
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
