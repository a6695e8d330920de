"""Results of cases as tables: files with numbers in SI units, and texts for the terminal in the user's units."""

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
from coupling.results.critical_distance import SWALLOWED
from coupling.results.measures import energy_error, sensor_force
from coupling.results.waves import ABOVE_ONE, NoWaveError
from hertzlink.cases.case import YIELDING
from hertzlink.cases.tasks import Task, count_of_beads
from structures.caution import caution, collected
from structures.checks import count_of

WIDTH, MOST_ROWS = 80, 40  # of a table on the terminal; the file has all rows

AR, TOF, AR_2ND, TOF_2ND = MEASURES = (
    "amplitude ratio", "time of flight (s)", "secondary amplitude ratio", "secondary time of flight (s)"
)  # fmt: skip
# Columns of files, and their heads on the terminal.
HEADS = {"sensor": "bead", "force (N)": "peak, N", "arrival (s)": "arrival, µs"}
HEADS |= {AR: "AR", TOF: "TOF, µs", AR_2ND: "AR, 2nd", TOF_2ND: "TOF, µs"}


@dataclass(frozen=True)
class Table:
    """A table: a file with numbers in SI units, and the part that is shown, if any, in the user's units."""

    file: str
    data: pd.DataFrame
    shown: pd.DataFrame = field(default_factory=pd.DataFrame)

    def csv(self) -> str:
        """Return a CSV file; numbers have all their digits, and missing values are empty."""

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
    """The output of a command on a case."""

    data: xr.Dataset
    tables: list[Table]
    below: list[str] = field(default_factory=list)  # lines below the first table
    title: str = ""
    yielded: xr.Dataset | None = None  # the result with a law of yielding
    sketched: CoSimulation | None = None  # if the result does not hold the set-up to sketch
    others: dict[str, str] = field(default_factory=dict)  # files that are not tables
    code: int = 0

    @property
    def text(self) -> str:
        """The text for the terminal."""
        title = [fill(self.title, WIDTH), ""] if self.title else []
        return "\n".join([*title, *self.tables[0].lines(), *self.below])


def report(task: Task, data: xr.Dataset, yielded: xr.Dataset | None = None) -> Answer:
    """Return the tables of a task's result. yielded: the result with a law of yielding."""
    tables_of = {"run": _run, "sweep": _sweep, "critical distance": _critical}[task.kind]
    tables, below = tables_of(task, data)
    if (tables[0].data.filter(like=AR) > 1.0).any(axis=None):
        below.insert(0, fill(f"AR {ABOVE_ONE}", WIDTH))
    if yielded is None:
        return Answer(data, tables, below, task.case.title)

    # Rows of both contact laws in one table; only the traces have tables of their own, as their times differ.
    with collected() as fresh:
        others, more = tables_of(task, yielded)
    for message in fresh:
        caution(f"fresh spot, {message}")
    both = list[Table]()
    for elastic, yielding in zip(tables, others, strict=True):
        if elastic.file == "traces.csv":
            both += [elastic, Table("traces_yielding.csv", yielding.data)]
            continue
        laws = {"elastic": elastic.data, "Jackson-Green": yielding.data}
        rows = pd.concat([one.assign(**{"contact law": law}) for law, one in laws.items()])
        shown = pd.DataFrame()
        if len(elastic.shown):
            differs = (elastic.shown != yielding.shown).any(axis=1)
            spots = elastic.shown.assign(contacts="elastic"), yielding.shown[differs].assign(contacts="fresh spot")
            shown = pd.concat(spots).sort_index(kind="stable")
        both.append(Table(elastic.file, rows, shown))
    first = fill(f"fresh spot: the metal yields there; computed with {YIELDING}", WIDTH)
    remarks = [line for line in more if line.startswith(("<", ">", "?", "unknown")) and line not in below]
    return Answer(data, both, [first, *remarks, *below], task.case.title, yielded)


def _run(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the waves and the traces of a run."""
    chains = range(len(task.case.all("chain")))
    traces, rows = {"time (s)": data.time.values}, []
    for chain, sensor in product(chains, task.sensors):
        if sensor > count_of_beads(task.case, chain):
            continue
        run = data.isel(chain=chain) if "chain" in data.dims else data
        of = f" of chain {chain}" if len(chains) > 1 else ""
        traces[f"force at bead {sensor}{of} (N)"] = sensor_force(run, sensor).values
        try:
            waves: Any = reflections(run, sensor)
        except NoWaveError:  # as in a chain that nothing strikes
            waves = None
        for name in ("incident", "primary", "secondary"):
            measures = [np.nan] * 4
            if wave := getattr(waves, name, None):
                of_incident = (1.0, 0.0) if name == "incident" else (wave.amplitude_ratio, wave.time_of_flight)
                measures = [wave.amplitude, wave.arrival, *of_incident]
            rows.append([chain, sensor, name, *measures])
    frame = pd.DataFrame(rows, columns=["chain", "sensor", "wave", "force (N)", "arrival (s)", AR, TOF])
    if len(chains) == 1:
        frame = frame.drop(columns="chain")

    below = [f"energy created or lost: {float(energy_error(data)):.1e} of the impact energy"]
    below += ["\n" + error["text"] for error in json.loads(data.attrs.get(NUMERICAL_ERROR, "{}")).values()]
    for sensor, budget in json.loads(data.attrs.get(UNCERTAINTY, "{}")).items():
        below += [f"\nuncertainty at bead {sensor}, with the share of each entry", budget["text"]]
    return [Table("waves.csv", frame, _shown(frame)), Table("traces.csv", pd.DataFrame(traces))], below


def _sweep(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the points of a sweep, and its traces: a column for each run and sensor."""
    names = ["amplitude_ratio", "time_of_flight", "secondary_amplitude_ratio", "secondary_time_of_flight"]
    order = [*(axis.name for axis in task.axes), "sensor"]
    frame = data[names].to_dataframe(order).reset_index()[[*order, *names]]
    frame.columns = pd.Index([*(axis.column for axis in task.axes), "bead", *MEASURES])
    shown = _shown(frame, task)
    if frame[AR_2ND].isna().all():  # no second wave
        shown = shown.iloc[:, :-2]
    tables = [Table("points.csv", frame, shown)]
    if "sensor_force" in data:
        traces = {"time (s)": data.time.values}
        forces = data.sensor_force.transpose(*order, "time").values.reshape(-1, data.time.size)
        for (*texts, sensor), force in zip(shown.values[:, : len(order)].tolist(), forces, strict=True):
            where = "".join(f", {axis.head} {text}" for axis, text in zip(task.axes, texts, strict=True))
            traces[f"force at bead {sensor}{where} (N)"] = force
        tables.append(Table("traces.csv", pd.DataFrame(traces)))
    return tables, []


def _critical(task: Task, data: xr.Dataset) -> tuple[list[Table], list[str]]:
    """Return the critical distances, and AR at all distances that were run."""
    along, tolerance = task.along, float(data.within)
    assert along is not None
    others = [axis for axis in task.axes if axis is not along]
    rows, cells, remarks = [], [], set()
    for places in product(*(range(len(axis.values)) for axis in others)):
        at = data.isel({axis.name: i for axis, i in zip(others, places, strict=True)})
        values = [axis.values[i] for axis, i in zip(others, places, strict=True)]
        critical, low, high, far = map(float, (at.critical_distance, *at.bracket, at.far_value))
        rows.append([*values, critical, low, high, far, tolerance])
        if bool(at.lower_bound):
            remarks.add("> : AR still changes at the last distance with a wave; the critical one is larger")
        if low == 0.0:
            remarks.add("< : AR is within the tolerance at all distances with a wave")
        unknown = " ?" * bool(np.isfinite(high) and not at.settled)
        if unknown:
            remarks.add("? : it is not known whether AR has settled at the greatest distance")
        if np.isnan(low):
            why = "a wave returns from the greatest distance only"
            if np.isnan(far):
                why = f"{SWALLOWED}; take smaller beads"
                if at.short_record:
                    why = "the record ends before the wave from the greatest distance is back; make until longer"
            remarks.add(f"unknown: {why}")
        best = "< " * (low == 0.0) + along.shown(critical, 4)
        if np.isnan(critical):
            best = "unknown" if np.isnan(low) else f"> {along.shown(low)}"
        between = f"{along.shown(low, 4)} to {along.shown(high, 4)}" if np.isfinite(high) else "-"
        texts = [axis.shown(value) for axis, value in zip(others, values, strict=True)]
        cells.append([*texts, best, between, "-" if np.isnan(far) else f"{far:.4f}{unknown}"])

    names, columns = [axis.name for axis in others], [axis.column for axis in others]
    every = data[["sampled", "amplitude_ratio", "time_of_flight"]].to_dataframe([*names, "distance"]).reset_index()
    samples = every[every.sampled.astype(bool)][[*names, "distance", "amplitude_ratio", "time_of_flight"]]
    unit, distance = f", {along.unit}" if along.unit else "", f"distance ({along.si})"
    samples.columns = pd.Index([*columns, distance, AR, TOF])
    columns += [f"critical {distance}", "low (m)", "high (m)", "AR far away", "tolerance of AR"]
    head = [*(axis.head for axis in others), f"critical distance{unit}", f"between{unit}", "AR far away"]
    tables = [
        Table("critical_distance.csv", pd.DataFrame(rows, columns=columns), pd.DataFrame(cells, columns=head)),
        Table("points.csv", samples),
    ]
    below = [fill(remark, WIDTH) for remark in sorted(remarks)]
    if data.bracket.notnull().any():
        below.append(f"beyond the critical distance AR stays within ± {tolerance:g} of AR far away")
    below.append(f"AR at bead {task.sensors[0]} in {count_of(len(samples), 'run')}: points.csv")
    return tables, below


def _shown(frame: pd.DataFrame, task: Task | None = None) -> pd.DataFrame:
    """Return the columns of a file as texts: times in µs, and the axes of a task, which come first, in their units."""
    axes, texts = [] if task is None else task.axes, dict[int, pd.Series]()
    heads = [axis.head for axis in axes] + [HEADS.get(name, name) for name in frame.columns[len(axes) :]]
    for i, name in enumerate(frame.columns):
        if i < len(axes):
            texts[i] = frame.iloc[:, i].map(axes[i].shown)
        elif frame[name].dtype == float:
            factor, form = (1e6, "{:.2f}") if name.endswith("(s)") else (1.0, "{:.4g}")
            texts[i] = (factor * frame[name]).map(form.format).replace("nan", "-")
        else:
            texts[i] = frame[name].astype(str)
    return pd.DataFrame(texts).set_axis(heads, axis=1)
