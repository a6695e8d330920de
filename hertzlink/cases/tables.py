"""The results of a case as a user reads them: tables of 80 columns, and CSV files."""

import csv
import io
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from textwrap import fill, wrap
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import NUMERICAL_ERROR, UNCERTAINTY, reflections
from coupling.results.measures import energy_error, sensor_force
from coupling.results.waves import ABOVE_ONE, NoWaveError
from hertzlink.cases.axes import Axis
from hertzlink.cases.paths import YIELDING
from hertzlink.cases.tasks import Task, count_of_beads, of_chain
from structures.caution import collected
from structures.checks import count_of

WIDTH = 80

MOST_ROWS = 40
"""Rows of a table on the terminal; the file has all."""

ON_A_FRESH_SPOT = f"fresh spot: there the metal yields; computed with {YIELDING}"
"""Below a table of both contact laws."""

Row = Sequence[Any]


@dataclass(frozen=True)
class Table:
    """A table: the file with its numbers in SI units, and what is shown of it.

    columns, rows: those of the file. head, cells: in the units of the user; rows of texts. Without a head the table is
    a file alone.
    """

    file: str
    columns: list[str]
    rows: list[list[Any]]
    head: list[str] = field(default_factory=list)
    cells: list[list[str]] = field(default_factory=list)

    def csv(self) -> str:
        """Return a CSV file; numbers have all their digits, and what is unknown is empty."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        for row in self.rows:
            writer.writerow(["" if isinstance(cell, float) and np.isnan(cell) else cell for cell in row])
        return text.getvalue()

    def lines(self) -> list[str]:
        """Return the lines of the table, numbers to the right; what is left out is said to be in the file.

        Of a table that is too wide the heads have two lines; if that does not help, the widest column stands on a line
        above each row, or each row is a sentence.
        """
        head, rows = self.head, self.cells[:MOST_ROWS]
        left_out = len(self.cells) - MOST_ROWS
        more = [f"... and {left_out} more in {self.file}"] if left_out > 0 else []
        first, *lines = _aligned(head, *rows)
        if len(first) <= WIDTH:
            return [first, "-" * len(first), *lines, *more]
        halves = [(words.rpartition(" ")[::2] if " " in words else ("", words)) for words in head]
        top, first, *lines = _aligned(*zip(*halves, strict=True), *rows)
        if len(first) <= WIDTH:
            return [top, first, "-" * len(first), *lines, *more]
        sizes = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
        widest = sizes.index(max(sizes))
        first, *lines = _aligned(*([*row[:widest], *row[widest + 1 :]] for row in (head, *rows)))
        if len(first) + 2 <= WIDTH:
            pairs = zip(rows, lines, strict=True)
            shown = [line for row, rest in pairs for line in (*wrap(row[widest], WIDTH), f"  {rest}")]
            return [head[widest], f"  {first}", "-" * (len(first) + 2), *shown, *more]
        texts = ["; ".join(f"{name}: {cell}" for name, cell in zip(head, row, strict=True)) for row in rows]
        return [*(fill(text, WIDTH, subsequent_indent="  ") for text in texts), *more]

    def with_yielding(self, yielded: "Table") -> "Table":
        """Return the table of both contact laws: a last column says which one a row is of."""
        laws = ("elastic", "Jackson-Green"), (self.rows, yielded.rows)
        rows = [[*row, law] for law, some in zip(*laws, strict=True) for row in some]
        cells = []
        for elastic, fresh in zip(self.cells, yielded.cells, strict=True):
            cells += [[*elastic, "elastic"], *([[*fresh, "fresh spot"]] if fresh != elastic else [])]
        head = [*self.head, "contacts"] if self.head else []
        return Table(self.file, [*self.columns, "contact law"], rows, head, cells)


def _aligned(*rows: Sequence[str]) -> list[str]:
    """Return the rows of cells as lines of the same length."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]


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
        both = []
        for elastic, fresh in zip(tables, others, strict=True):
            if elastic.file == "traces.csv":  # The times differ.
                both += [elastic, Table("traces_yielding.csv", fresh.columns, fresh.rows)]
            else:
                both.append(elastic.with_yielding(fresh))
        tables, below = both, [fill(ON_A_FRESH_SPOT, WIDTH), *below]
    return Answer(data, tables, below, task.case.title, yielded)


def _run(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    rows: list[list[Any]] = []
    chains = range(len(task.case.chains))
    read = [(c, sensor) for c in chains for sensor in task.sensors if sensor <= count_of_beads(task.case, c)]
    for chain, sensor in read:
        try:
            waves: Any = reflections(of_chain(data, chain), sensor)
        except NoWaveError:  # as in a chain that nothing strikes
            waves = None
        for name in ("incident", "primary", "secondary"):
            wave = getattr(waves, name, None)
            measures = [float("nan")] * 4
            if wave:
                incident = name == "incident"
                ratio, flight = (1.0, 0.0) if incident else (wave.amplitude_ratio, wave.time_of_flight)
                measures = [wave.amplitude, wave.arrival, ratio, flight]
            rows.append([chain, sensor, name, *measures])
    columns = ["chain", "sensor", "wave", "force (N)", "arrival (s)", "amplitude ratio", "time of flight (s)"]
    head = ["chain", "bead", "wave", "peak, N", "arrival, µs", "AR", "TOF, µs"]
    cells = [[str(row[0]), str(row[1]), row[2], *map(_cell, row[3:], ("", "µs", "", "µs"))] for row in rows]
    first = int(len(chains) == 1)
    waves_table = Table(
        "waves.csv", columns[first:], [row[first:] for row in rows], head[first:], [c[first:] for c in cells]
    )

    names = [f"force at bead {sensor}{f' of chain {c}' * (len(chains) > 1)} (N)" for c, sensor in read]
    forces = [sensor_force(of_chain(data, c), sensor).values for c, sensor in read]
    traces = Table("traces.csv", ["time (s)", *names], np.column_stack([data.time.values, *forces]).tolist())

    below = [
        *_above_one(row[-2] for row in rows),
        f"energy created or lost: {float(energy_error(data)):.1e} of the impact's",
    ]
    below += ["\n" + error["text"] for error in json.loads(data.attrs.get(NUMERICAL_ERROR, "{}")).values()]
    for sensor, budget in json.loads(data.attrs.get(UNCERTAINTY, "{}")).items():
        below += [f"\nuncertainty at bead {sensor}, with the share of each entry", budget["text"]]
    return [waves_table, traces], below


def _above_one(ratios: Iterable[float]) -> list[str]:
    """Return a remark where an AR exceeds 1."""
    return [fill(f"AR {ABOVE_ONE}", WIDTH)] if any(ratio > 1.0 for ratio in ratios) else []


def _cell(value: float, unit: str) -> str:
    if np.isnan(value):
        return "-"
    return f"{1e6 * value:.2f}" if unit == "µs" else f"{value:.4g}"


def _columns(axes: Iterable[Axis]) -> list[str]:
    return [f"{axis.name} ({axis.si})" if axis.si else axis.name for axis in axes]


def _sweep(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    names = "amplitude_ratio", "time_of_flight", "secondary_amplitude_ratio", "secondary_time_of_flight"
    rows, cells = [], []
    for at, values, texts in task.points(task.axes, data):
        for sensor in task.sensors:
            measures = [float(at[name].sel(sensor=sensor)) for name in names]
            rows.append([*values, sensor, *measures])
            cells.append([*texts, str(sensor), *map(_cell, measures, ("", "µs", "", "µs"))])
    wide = ["amplitude ratio", "time of flight (s)", "secondary amplitude ratio", "secondary time of flight (s)"]
    head = [*(axis.head for axis in task.axes), "bead", "AR", "TOF, µs", "AR, 2nd", "TOF, µs"]
    if all(row[-2] == "-" for row in cells):  # no second wave
        head, cells = head[:-2], [row[:-2] for row in cells]
    points = Table("points.csv", [*_columns(task.axes), "bead", *wide], rows, head, cells)
    tables = [points]
    if "sensor_force" in data:
        tables.append(_swept_traces(task, data))
    return tables, _above_one(ratio for row in rows for ratio in (row[-4], row[-2]))


def _swept_traces(task: Task, data: xr.Dataset) -> Table:
    """Return the forces of a sweep over time: a column for each run and sensor."""
    columns, traces = ["time (s)"], [data.time.values]
    for at, _, texts in task.points(task.axes, data):
        where = [f"{axis.head} {text}" for axis, text in zip(task.axes, texts, strict=True)]
        for sensor in task.sensors:
            columns.append(f"force at bead {sensor}, {', '.join(where)} (N)")
            traces.append(at.sensor_force.sel(sensor=sensor).values)
    return Table("traces.csv", columns, np.column_stack(traces).tolist())


def _critical(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    along, wanted = task.along, task.case.measure.critical_distance
    assert along is not None
    assert wanted is not None
    shown = partial(along.shown, digits=4)
    rows, cells, samples, remarks = [], [], [], set()
    for at, values, texts in task.points(task.others, data):
        low, high = (float(end) for end in at.bracket)
        critical, far = float(at.critical_distance), float(at.far_value)
        rows.append([*values, critical, low, high, far, wanted.tolerance])
        if bool(at.lower_bound):
            remarks.add("> : AR does not settle within the distances or the record; the true one is larger")
        if low == 0.0:
            remarks.add("< : AR is within the tolerance at all distances; give smaller ones")
        best = f"> {along.shown(low)}" if np.isnan(critical) else f"{'< ' * (low == 0.0)}{shown(critical)}"
        between = f"{shown(low)} to {shown(high)}" if np.isfinite(high) else "-"
        cells.append([*texts, best, between, f"{far:.4f}"])
        for i in np.flatnonzero(at.sampled.values.astype(bool)):
            sample = at.isel(distance=int(i))
            measured = (sample.distance, sample.amplitude_ratio, sample.time_of_flight)
            samples.append([*values, *map(float, measured)])
    unit = f", {along.unit}" if along.unit else ""
    head = [*(axis.head for axis in task.others), f"critical distance{unit}", f"between{unit}", "AR far away"]
    others, distance = _columns(task.others), f"distance ({along.si})"
    within = f"tolerance of AR{', as a part of AR far away' * wanted.relative}"
    columns = [*others, f"critical {distance}", "low (m)", "high (m)", "AR far away", within]
    curve = [*others, distance, "amplitude ratio", "time of flight (s)"]
    tables = [Table("critical_distance.csv", columns, rows, head, cells), Table("points.csv", curve, samples)]
    share = f"{100.0 * wanted.tolerance:g} %" if wanted.relative else f"± {wanted.tolerance:g}"
    below = [fill(remark, WIDTH) for remark in sorted(remarks)]
    below.append(f"beyond the critical distance AR stays within {share} of AR far away")
    below.append(f"AR at bead {task.sensors[0]} in {count_of(len(samples), 'run')}: points.csv")
    return tables, below
