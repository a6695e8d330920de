"""The results of a case as a user reads them: tables of 80 columns, and CSV files."""

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import NUMERICAL_ERROR, UNCERTAINTY, reflections
from coupling.results.findings import findings_of, with_warnings
from coupling.results.measures import energy_error, sensor_force
from coupling.results.waves import ABOVE_ONE, NoWaveError
from coupling.yield_check import is_of_yield
from hertzlink.cases.case import YIELDING
from hertzlink.cases.tasks import SENSITIVITIES, Axis, Task, count_of_beads, of_chain, run_task, task_of
from structures.caution import caution, collected
from structures.checks import count_of

WIDTH = 80

MOST_ROWS = 40
"""Rows of a table on the terminal; the file has all."""


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

        def cell(value: Any) -> Any:
            # An apostrophe keeps spreadsheets from taking the text of a user for a formula.
            if isinstance(value, str):
                return f"'{value}" if value.startswith(("=", "+", "-", "@", "\t")) else value
            return "" if isinstance(value, float) and np.isnan(value) else value

        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([map(cell, row) for row in (self.columns, *self.rows)])
        return text.getvalue()

    def lines(self) -> list[str]:
        """Return the lines of the table, numbers to the right; what is left out is said to be in the file.

        Of a table that is too wide the heads have two lines, or else each row is a sentence.
        """
        head, rows = self.head, self.cells[:MOST_ROWS]
        left_out = len(self.cells) - MOST_ROWS
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

    def with_yielding(self, yielded: "Table") -> list["Table"]:
        """Return the table of both contact laws: a last column says which one a row is of. Traces, whose times differ,
        are two tables."""
        if self.file == "traces.csv":
            return [self, Table("traces_yielding.csv", yielded.columns, yielded.rows)]
        rows = [[*row, "elastic"] for row in self.rows] + [[*row, "Jackson-Green"] for row in yielded.rows]
        cells = []
        for elastic, fresh in zip(self.cells, yielded.cells, strict=True):
            cells += [[*elastic, "elastic"], *([[*fresh, "fresh spot"]] if fresh != elastic else [])]
        head = [*self.head, "contacts"] if self.head else []
        return [Table(self.file, [*self.columns, "contact law"], rows, head, cells)]


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


def run_both(task: Task, jobs: int | None = None) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Run a task; where contacts are beyond yield, once more with Jackson and Green's law, as the findings say then.

    The second result is that with the law, where there is one. A sweep is not repeated.
    """
    yielded = None
    with collected() as said:
        data = run_task(task, jobs)
    findings = findings_of(data)
    if task.kind != "sweep" and any(map(is_of_yield, (*findings, *said))):
        single = not isinstance(task.case.data["chain"], list)
        laws = ["chain.law"] if single else [f"chain[{i}].law" for i in range(len(task.case.data["chain"]))]
        others = {"measure.numerical_error": False, SENSITIVITIES: None}
        changed = task.case.changed({path: {"kind": "jackson_green"} for path in laws} | others)
        try:
            with collected():  # the user was warned of the same in the first run
                yielded = run_task(task_of(changed), jobs)
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


def report(task: Task, data: xr.Dataset, yielded: xr.Dataset | None = None) -> Answer:
    """Return the tables of a task's result. yielded: the result with a law of yielding."""
    tables_of = {"run": _run, "sweep": _sweep, "critical distance": _critical}[task.kind]
    tables, below = tables_of(task, data)
    if yielded is not None:
        with collected():  # The warnings of a run are those of its elastic contacts.
            others, _ = tables_of(task, yielded)
        both = [elastic.with_yielding(fresh) for elastic, fresh in zip(tables, others, strict=True)]
        tables = [table for pair in both for table in pair]
        below.insert(0, fill(f"fresh spot: there the metal yields; computed with {YIELDING}", WIDTH))
    return Answer(data, tables, below, task.case.title, yielded)


def _run(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the waves and the traces of a run."""
    chains = range(len(task.case.all("chain")))
    read = [(chain, bead) for chain in chains for bead in task.sensors if bead <= count_of_beads(task.case, chain)]
    rows: list[list[Any]] = []
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
    cells = [[*map(str, row[:3]), *_cells(row[3:], ("", "µs", "", "µs"))] for row in rows]
    first = int(len(chains) == 1)
    shown = [[row[first:] for row in part] for part in ([columns], rows, [head], cells)]
    waves_table = Table("waves.csv", shown[0][0], shown[1], shown[2][0], shown[3])

    names = [f"force at bead {bead}{f' of chain {chain}' * (len(chains) > 1)} (N)" for chain, bead in read]
    forces = [sensor_force(of_chain(data, chain), bead).values for chain, bead in read]
    traces = Table("traces.csv", ["time (s)", *names], np.column_stack([data.time.values, *forces]).tolist())
    below = [
        *_above_one([row[-2] for row in rows]),
        f"energy created or lost: {float(energy_error(data)):.1e} of the impact's",
    ]
    below += ["\n" + error["text"] for error in json.loads(data.attrs.get(NUMERICAL_ERROR, "{}")).values()]
    for sensor, budget in json.loads(data.attrs.get(UNCERTAINTY, "{}")).items():
        below += [f"\nuncertainty at bead {sensor}, with the share of each entry", budget["text"]]
    return [waves_table, traces], below


def _sweep(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the points of a sweep, and its traces: a column for each run and sensor."""
    names = "amplitude_ratio", "time_of_flight", "secondary_amplitude_ratio", "secondary_time_of_flight"
    rows, cells, heads, traces = [], [], list[str](), list[Any]()
    for at, values, texts in task.points(task.axes, data):
        where = "".join(f", {axis.head} {text}" for axis, text in zip(task.axes, texts, strict=True))
        for sensor in task.sensors:
            of_sensor = at.sel(sensor=sensor)
            measures = [float(of_sensor[name]) for name in names]
            rows.append([*values, sensor, *measures])
            cells.append([*texts, str(sensor), *_cells(measures, ("", "µs", "", "µs"))])
            if "sensor_force" in data:
                heads.append(f"force at bead {sensor}{where} (N)")
                traces.append(of_sensor.sensor_force.values)
    wide = ["amplitude ratio", "time of flight (s)", "secondary amplitude ratio", "secondary time of flight (s)"]
    head = [*(axis.head for axis in task.axes), "bead", "AR", "TOF, µs", "AR, 2nd", "TOF, µs"]
    if all(row[-2] == "-" for row in cells):  # no second wave
        head, cells = head[:-2], [row[:-2] for row in cells]
    tables = [Table("points.csv", [*_columns(task.axes), "bead", *wide], rows, head, cells)]
    if traces:
        columns = np.column_stack([data.time.values, *traces])
        tables.append(Table("traces.csv", ["time (s)", *heads], columns.tolist()))
    return tables, _above_one([ratio for row in rows for ratio in (row[-4], row[-2])])


def _critical(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the critical distances, and AR at all distances that were run."""
    along, wanted = task.along, task.case.measure.critical_distance
    assert along is not None
    assert wanted is not None
    rows, cells, samples, remarks = [], [], [], set()
    for at, values, texts in task.points(task.others, data):
        low, high = (float(end) for end in at.bracket)
        critical, far = float(at.critical_distance), float(at.far_value)
        rows.append([*values, critical, low, high, far, wanted.tolerance])
        if bool(at.lower_bound):
            remarks.add("> : AR does not settle within the distances or the record; the true one is larger")
        if low == 0.0:
            remarks.add("< : AR is within the tolerance at all distances; give smaller ones")
        best, *ends = (along.shown(number, 4) for number in (critical, low, high))
        best = f"> {along.shown(low)}" if np.isnan(critical) else f"{'< ' * (low == 0.0)}{best}"
        cells.append([*texts, best, " to ".join(ends) if np.isfinite(high) else "-", f"{far:.4f}"])
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


def _above_one(ratios: Sequence[float]) -> list[str]:
    """Return a remark where an AR exceeds 1."""
    return [fill(f"AR {ABOVE_ONE}", WIDTH)] if max(ratios, default=0.0) > 1.0 else []


def _cells(values: Sequence[float], units: Sequence[str]) -> list[str]:
    """Return numbers as texts, those with the unit µs in it."""
    texts = [f"{1e6 * value:.2f}" if unit else f"{value:.4g}" for value, unit in zip(values, units, strict=True)]
    return ["-" if np.isnan(value) else text for value, text in zip(values, texts, strict=True)]


def _columns(axes: Sequence[Axis]) -> list[str]:
    return [f"{axis.label} ({axis.si})" if axis.si else axis.label for axis in axes]
