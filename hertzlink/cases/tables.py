"""The results of a case as a user reads them: tables of 80 columns, and CSV files."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from textwrap import fill, wrap
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.results.ar_and_tof import NUMERICAL_ERROR, UNCERTAINTY, reflections
from coupling.results.measures import energy_error, sensor_force
from coupling.results.waves import ABOVE_ONE, NoWaveError
from hertzlink.cases.axes import Axis
from hertzlink.cases.faults import YIELDING
from hertzlink.cases.running import Task, of_chain, points
from structures.caution import collected
from structures.checks import count_of

WIDTH = 80
CONTINUED = "  "
"""Before lines that belong to the one above."""

MOST_ROWS = 40
"""Rows of a table on the terminal; the file has all."""

TRACES, TRACES_YIELDING = "traces.csv", "traces_yielding.csv"

SPOTS = ("elastic", "fresh spot")
"""The same in the table of the terminal."""

ON_A_FRESH_SPOT = f"fresh spot: there the metal yields; computed with {YIELDING}"
"""Below such a table."""

CONTACT_LAWS = ("elastic", "Jackson-Green")
"""Of the rows of CSV files, where the metal yields."""

OF_SECOND = (3, 4)
"""Columns of the second wave behind the axes of a sweep; a table without such a wave leaves them out."""

Row = Sequence[Any]


def table(head: Sequence[str], rows: Sequence[Sequence[str]], file: str) -> list[str]:
    """Return the lines of a table, numbers to the right; what is left out is said to be in the file.

    Of a table that is too wide the heads have two lines; if that does not help, the widest column stands on a line
    above each row, or each row is a sentence.
    """
    shown = [*rows[:MOST_ROWS]]
    more = [f"... and {len(rows) - MOST_ROWS} more in {file}"] if len(rows) > MOST_ROWS else []
    first, *lines = _aligned(head, *shown)
    if len(first) <= WIDTH:
        return [first, "-" * len(first), *lines, *more]
    halves = [(words.rpartition(" ")[::2] if " " in words else ("", words)) for words in head]
    top, first, *lines = _aligned(*zip(*halves, strict=True), *shown)
    if len(first) <= WIDTH:
        return [top, first, "-" * len(first), *lines, *more]
    sizes = [max(len(row[i]) for row in (head, *shown)) for i in range(len(head))]
    widest = sizes.index(max(sizes))
    first, *lines = _aligned(*([*row[:widest], *row[widest + 1 :]] for row in (head, *shown)))
    if len(first) + len(CONTINUED) <= WIDTH:
        both = zip(shown, lines, strict=True)
        pairs = [line for row, rest in both for line in (*wrap(row[widest], WIDTH), CONTINUED + rest)]
        return [head[widest], CONTINUED + first, "-" * (len(CONTINUED) + len(first)), *pairs, *more]
    texts = ["; ".join(f"{name}: {cell}" for name, cell in zip(head, row, strict=True)) for row in shown]
    return [*(fill(text, WIDTH, subsequent_indent=CONTINUED) for text in texts), *more]


def _aligned(*rows: Sequence[str]) -> list[str]:
    """Return the rows of cells as lines of the same length."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]


def csv_text(head: Sequence[str], rows: Iterable[Row]) -> str:
    """Return a CSV file; numbers have all their digits, and what is unknown is empty."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(head)
    for row in rows:
        writer.writerow(["" if isinstance(cell, float) and np.isnan(cell) else cell for cell in row])
    return file.getvalue()


class Answer(NamedTuple):
    """A table by its head and rows, the file that has all of these, lines below the table, and CSV files by name."""

    head: list[str]
    rows: list[list[str]]
    file: str
    below: list[str]
    files: dict[str, str]


def report(task: Task, data: xr.Dataset, yielded: xr.Dataset | None = None) -> tuple[str, dict[str, str]]:
    """Return the text for the terminal, and CSV files by name. yielded: the result with a law of yielding."""
    of = {"run": _run, "sweep": _sweep, "critical distance": _critical}[task.kind]
    head, rows, file, below, files = of(task, data)
    if yielded is not None:
        with collected():  # The warnings of a run are those of its elastic contacts.
            law = of(task, yielded)
        head, files = [*head, "contacts"], _both(files, law.files)
        pairs = zip(rows, law.rows, strict=True)
        rows = [
            [*row, spot]
            for pair in pairs
            for row, spot in zip(pair, SPOTS, strict=True)
            if row != pair[0] or spot == SPOTS[0]
        ]
        below = [fill(ON_A_FRESH_SPOT, WIDTH), *below]
    title = [fill(task.case.model.title, WIDTH), ""] if task.case.model.title else []
    return "\n".join([*title, *table(head, rows, file), *below]), files


def _both(elastic: Mapping[str, str], yielded: Mapping[str, str]) -> dict[str, str]:
    """Return CSV files of both contact laws: a last column says which; traces, whose times differ, are two files."""
    files = dict(elastic)
    for name, text in yielded.items():
        if name == TRACES:
            files[TRACES_YIELDING] = text
            continue
        rows = [*csv.reader(io.StringIO(elastic[name]))], [*csv.reader(io.StringIO(text))]
        both = [[*row, law] for law, (_, *some) in zip(CONTACT_LAWS, rows, strict=True) for row in some]
        files[name] = csv_text([*rows[0][0], "contact law"], both)
    return files


def _run(task: Task, data: xr.Dataset) -> Answer:
    rows: list[list[Any]] = []
    chains = task.case.model.chains
    of = [(chain, sensor) for chain, part in enumerate(chains) for sensor in task.sensors if sensor <= part.count]
    forces = [sensor_force(of_chain(data, chain), sensor) for chain, sensor in of]
    for chain, sensor in of:
        waves = _waves(of_chain(data, chain), sensor)
        for name in ("incident", "primary", "secondary"):
            wave = getattr(waves, name, None)
            if not wave:
                rows.append([chain, sensor, name, *[float("nan")] * 4])
                continue
            ratio = 1.0 if name == "incident" else wave.amplitude_ratio
            flight = 0.0 if name == "incident" else wave.time_of_flight
            rows.append([chain, sensor, name, wave.amplitude, wave.arrival, ratio, flight])
    head = ["chain", "bead", "wave", "peak, N", "arrival, µs", "AR", "TOF, µs"]
    heads = ["chain", "sensor", "wave", "force (N)", "arrival (s)", "amplitude ratio", "time of flight (s)"]
    shown = [[str(row[0]), str(row[1]), row[2], *map(_cell, row[3:], ("", "µs", "", "µs"))] for row in rows]
    names = [f"force at bead {sensor}{f' of chain {chain}' * (len(chains) > 1)} (N)" for chain, sensor in of]
    if len(chains) == 1:
        head, heads, shown, rows = head[1:], heads[1:], [row[1:] for row in shown], [row[1:] for row in rows]
    error = float(energy_error(data))
    above = _above_one(row[-2] for row in rows)
    lines = [*above, f"energy created or lost: {error:.1e} of the impact's"]
    lines += ["\n" + entry["text"] for entry in json.loads(data.attrs.get(NUMERICAL_ERROR, "{}")).values()]
    for sensor, budget in json.loads(data.attrs.get(UNCERTAINTY, "{}")).items():
        lines += [f"\nuncertainty at bead {sensor}, with the share of each entry", budget["text"]]
    columns = np.column_stack([data.time.values, *(force.values for force in forces)])
    files = {"waves.csv": csv_text(heads, rows), TRACES: csv_text(["time (s)", *names], columns.tolist())}
    return Answer(head, shown, "waves.csv", lines, files)


def _above_one(ratios: Iterable[float]) -> list[str]:
    """Return a remark where an AR exceeds 1."""
    return [fill(f"AR {ABOVE_ONE}", WIDTH)] if any(ratio > 1.0 for ratio in ratios) else []


def _waves(run: xr.Dataset, sensor: int) -> Any:
    """Return the waves at a sensor; nothing where no wave came, as in a chain that nothing strikes."""
    try:
        return reflections(run, sensor)
    except NoWaveError:
        return None


def _cell(value: float, unit: str) -> str:
    if np.isnan(value):
        return "-"
    return f"{1e6 * value:.2f}" if unit == "µs" else f"{value:.4g}"


def _heads(axes: Iterable[Axis]) -> list[str]:
    return [f"{axis.name} ({axis.si})" if axis.si else axis.name for axis in axes]


def _sweep(task: Task, data: xr.Dataset) -> Answer:
    names = "amplitude_ratio", "time_of_flight", "secondary_amplitude_ratio", "secondary_time_of_flight"
    rows, shown = [], []
    for at, values, texts in points(task.axes, data):
        for sensor in task.sensors:
            measures = [float(at[name].sel(sensor=sensor)) for name in names]
            rows.append([*values, sensor, *measures])
            shown.append([*texts, str(sensor), *map(_cell, measures, ("", "µs", "", "µs"))])
    wide = ["amplitude ratio", "time of flight (s)", "secondary amplitude ratio", "secondary time of flight (s)"]
    head = [*(axis.head for axis in task.axes), "bead", "AR", "TOF, µs", "AR, 2nd", "TOF, µs"]
    below = _above_one(ratio for row in rows for ratio in (row[-4], row[-2]))
    if all(row[-2] == "-" for row in shown):
        head, *shown = (
            [cell for i, cell in enumerate(row) if i - len(task.axes) not in OF_SECOND] for row in (head, *shown)
        )
    files = {"points.csv": csv_text([*_heads(task.axes), "bead", *wide], rows)}
    return Answer(head, shown, "points.csv", below, files)


def _critical(task: Task, data: xr.Dataset) -> Answer:
    along, wanted = task.along, task.case.model.measure.critical_distance
    assert along is not None
    assert wanted is not None
    rows, shown, samples = [], [], []
    remarks = set()
    for at, values, texts in points(task.others, data):
        low, high = (float(end) for end in at.bracket)
        critical, far = float(at.critical_distance), float(at.far_value)
        rows.append([*values, critical, low, high, far, wanted.tolerance])
        if bool(at.lower_bound):
            remarks.add("> : AR does not settle within the distances or the record; the true one is larger")
        if low == 0.0:
            remarks.add("< : AR is within the tolerance at all distances; give smaller ones")
        number = f"> {along.shown(low)}" if np.isnan(critical) else f"{'< ' * (low == 0.0)}{_round(along, critical)}"
        bracket = f"{_round(along, low)} to {_round(along, high)}" if np.isfinite(high) else "-"
        shown.append([*texts, number, bracket, f"{far:.4f}"])
        done = at.sampled.values.astype(bool)
        for i in np.flatnonzero(done):
            sample = at.isel(distance=int(i))
            samples.append(
                [*values, float(sample.distance), float(sample.amplitude_ratio), float(sample.time_of_flight)]
            )
    unit = f", {along.unit}" if along.unit else ""
    heads = _heads(task.others)
    head = [*(axis.head for axis in task.others), f"critical distance{unit}", f"between{unit}", "AR far away"]
    axis = f"distance ({along.si})"
    lines = [fill(remark, WIDTH) for remark in sorted(remarks)]
    share = f"{100.0 * wanted.tolerance:g} %" if wanted.relative else f"± {wanted.tolerance:g}"
    lines.append(f"beyond the critical distance AR stays within {share} of AR far away")
    lines.append(f"AR at bead {task.sensors[0]} in {count_of(len(samples), 'run')}: points.csv")
    within = f"tolerance of AR{', as a part of AR far away' * wanted.relative}"
    of_curves = [*heads, f"critical {axis}", "low (m)", "high (m)", "AR far away", within]
    files = {
        "critical_distance.csv": csv_text(of_curves, rows),
        "points.csv": csv_text([*heads, axis, "amplitude ratio", "time of flight (s)"], samples),
    }
    return Answer(head, shown, "critical_distance.csv", lines, files)


def _round(along: Axis, value: float) -> str:
    return f"{value / along.size:.4g}"
