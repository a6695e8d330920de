"""The section [identify] of a case: its question, its signal, the fit and its tables; and maps of taps with a case."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from inspect import signature
from math import inf
from pathlib import Path as File
from textwrap import fill
from typing import Annotated, Any

import numpy as np
import pandas as pd
import xarray as xr

from coupling.inference import tap_maps
from coupling.inference.identification import IDENTIFIED, Identification, unknowns_of
from coupling.inference.identify import identify
from coupling.inference.misfit import GAIN, OF_SENSORS, TIME_ZERO
from coupling.results.provenance import versions
from coupling.signals.conditioning import clean_signal
from coupling.signals.signals import read_signal
from coupling.sweeps.store import Store
from hertzlink.cases import Fault, Path, parsed, written
from hertzlink.cases.axes import Axis, axis_of, path_of, si_value
from hertzlink.cases.case import Case, of_case
from hertzlink.cases.forms import in_cases
from hertzlink.cases.tables import WIDTH, Answer, Table
from hertzlink.cases.tasks import Task, count_of_beads, sensors_of
from structures.checks import count_of, existing
from structures.quantities import Asks, Count, Quantity

WIDE = 2.0  # a nuisance without a range lies between its value divided and multiplied by this factor
MOST_ELEMENTS = 400  # of a layer whose mesh is the same for all values
NOT_IDENTIFIED = 3  # exit code where results are written, but an unknown is not identified

Calibration = Annotated[float, Quantity("N/V", "a calibration", "25 N/V", low=-inf)]


def arguments_of(function: Callable[..., Any], entries: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that are arguments of a function."""
    return {name: entries[name] for name in signature(function).parameters if name in entries}


@in_cases(
    identify,
    also=(read_signal, clean_signal),
    without=("signal", "build", "guess", "ranges", "path", "baseline", "positions"),
)
def question(
    sensors: Annotated[
        Mapping[str, Annotated[int, Count(0)]],
        Asks("a table of beads and columns, such as { 7 = 1 } for bead 7 in column 1, counted from 0"),
    ],
    unknowns: Annotated[
        Mapping[str, Annotated[tuple[Any, Any], Asks('a range, such as ["1 mm", "6 mm"]')]],
        Asks('a table of paths and ranges, such as { "structure.thickness" = ["1 mm", "6 mm"] }'),
    ],
    calibration: Calibration | Mapping[str, Calibration] | None = None,
    nuisances: Sequence[str] = (GAIN, TIME_ZERO),
    **others: Any,
) -> dict[str, Any]:
    """The unknowns to find from a measured signal, and how."""
    by_bead: Any = calibration
    if isinstance(calibration, Mapping):
        by_bead = {int(bead): value for bead, value in calibration.items() if bead.isdigit()}
    return {"columns": sensors, "unknowns": unknowns, "nuisances": nuisances, "calibration": by_bead, **others}


def question_of(case: Case) -> Task:
    """Return the task of the section [identify], checked: its axes are the ranges of the unknowns."""
    if (section := case.identify) is None:
        raise Fault(("identify",), "is missing; add a section [identify] with sensors and unknowns")
    case.only_chain("an identification")
    count = count_of_beads(case, 0)
    for name in section["columns"]:
        if not name.isdigit() or not 1 <= int(name) <= count:
            reason = f'"{name}" is not a bead from 1 to {count}; write {{ 7 = 1 }} for bead 7 in column 1'
            raise Fault(("identify", "sensors", name), reason)

    axes: dict[str, Axis] = {}
    for key, ends in section["unknowns"].items():
        place: Path = ("identify", "unknowns", key)
        axis = axis_of(case, key, place, ends)
        if not axis.is_number:
            raise Fault(place, f"{axis.path[-1]} is not a number and cannot be fitted; run one fit for each value")
        if axis.values[0] >= axis.values[1]:
            order = f"; the order is wrong: give {[*ends[::-1]]}" if len({*axis.values}) > 1 else ""
            raise Fault(place, f"must have two numbers, the lowest and the highest value{order}")
        axes[axis.name] = axis
    for i, key in enumerate(section["nuisances"]):
        place = ("identify", "nuisances", i)
        if key in OF_SENSORS:
            continue
        if "." not in key:
            choices = ", ".join(OF_SENSORS)
            raise Fault(place, f'"{key}" is not a nuisance; take {choices}, or a path such as chain.impact_speed')
        axis = axis_of(case, key, place)
        if axis.name not in axes:
            value = case.value(axis.path)
            if not isinstance(value, int | float) or not value > 0.0:
                raise Fault(place, f'"{key}" has no value in the case; give it a range in identify.unknowns')
            axes[axis.name] = replace(axis, values=[value / WIDE, value * WIDE])
    return Task(case, tuple(axes.values()), tuple(map(int, section["columns"])))


def signal_of(task: Task, file: File) -> xr.Dataset:
    """Return the measured signal, conditioned; raise a Fault, or a ValueError that names the file."""
    section = task.case.identify
    columns = {int(bead): column for bead, column in section["columns"].items()}
    with task.case.located("identify"):
        signal = read_signal(existing(str(file), file), columns, **arguments_of(read_signal, section))
        # The lead is short; identify estimates the noise from all samples.
        return clean_signal(signal, **arguments_of(clean_signal, section)).drop_vars("noise")


def fit(task: Task, signal: xr.Dataset, file: File | None = None) -> Identification:
    """Return what the signal of a file says about the unknowns, in the units of the case."""
    # Runs last as long as samples count, and a rod has the same mesh at all values.
    section = task.case.identify
    task = replace(task, case=task.case.changed({"run.until": section["until"], "run.accuracy": "default"}))
    body = task.case.all("structure")[0]
    varies = any(name.startswith("structure") for name in task.ranges)
    if body.form.kind == "rod" and "elements" not in body.entries and varies:
        ends = [{name: both[end] for name, both in task.ranges.items()} for end in (0, 1)]
        meshes = [task(**at).structure.structure.origin["elements"] for at in ends]
        elements = min(max(map(max, meshes)), MOST_ELEMENTS)
        task = replace(task, case=task.case.changed({"structure.elements": elements}))

    nuisances = [key if key in OF_SENSORS else written(parsed(key)) for key in section["nuisances"]]
    settings = arguments_of(identify, section) | {"nuisances": nuisances}
    try:
        found = identify(signal, task, **settings, **task.ranges)
    except ValueError as error:
        if file is None or not str(error).startswith("signal: "):
            raise
        raise ValueError(f"{file}{str(error).removeprefix('signal')}") from None
    shown = {axis.name: replace(found[axis.name], unit=axis.unit, unit_size=axis.size) for axis in task.axes}
    # What the reading of the file assumed may be why a value is wrong.
    assumed = [f"signal: {note}" for note in str(signal.attrs.get("reading", "")).splitlines()]
    return replace(found, unknowns=found.unknowns | shown, warnings=[*found.warnings, *assumed])


def answer_of(task: Task, found: Identification) -> Answer:
    """Return what was found: tables, the case with the values found, and a simulation to sketch."""
    unknowns = found.unknowns
    rows = [[name, one.value, *one.interval, one.verdict, found.misfit] for name, one in unknowns.items()]
    frame = pd.DataFrame(rows, columns=["unknown", "value (SI)", "low", "high", "verdict", "residual over noise"])
    texts = [one.row() for one in unknowns.values()]
    shown = pd.DataFrame(texts, columns=["unknown", "value", "95 % interval", "verdict"])
    traces = {"time (s)": found.data.time.values}
    for bead in found.data.sensor.values:
        for quantity in ("measured", "fitted"):
            traces[f"{quantity} at bead {bead} (N)"] = found.data[quantity].sel(sensor=bead).values
    tables = [Table("unknowns.csv", frame, shown), Table("fit.csv", pd.DataFrame(traces))]
    # Below the head and the rows of its text.
    said = replace(found, warnings=[of_case(warning) for warning in found.warnings])
    notes = str(said).splitlines()[1 + len(unknowns) :]
    values = {name: found[name].value for name in task.ranges}
    best = {"identified.toml" if found.explained else "best_fit.toml": task.case.changed(values).to_toml()}
    result = found.to_dataset().assign_attrs(case=task.case.to_toml())
    code = 0 if found.identified else NOT_IDENTIFIED
    return Answer(result, tables, notes, sketched=task(**values), others=best, code=code)


def grid_of(case: Case, table: File) -> tap_maps.Grid:
    """Return the points of a table, or of points.csv in a folder, checked with the case."""
    unknowns = [] if case.identify is None else [axis.path for axis in question_of(case).axes]

    def convert(name: str, text: str, unit: str) -> Any:
        """Return the value (SI) that an entry of the case gets from a cell; other columns stay as they are."""
        if "." not in name:
            return text
        path = path_of(name, ())
        if path in unknowns:
            raise ValueError("is an unknown of [identify] as well; leave out the column or the unknown")
        value: Any = f"{text} {unit}".strip()
        if not unit:
            with suppress(ValueError):
                value = float(text)
        return si_value(case, path, value, path)

    return tap_maps.read_grid(table, convert)


def map_of(case: Case, grid: tap_maps.Grid, keep: File, jobs: int | None) -> Answer:
    """Return the map. keep: a folder for the answers, from which a map that was interrupted continues."""

    def tap(file: File) -> xr.Dataset:
        """Return the signal of a file. Without [identify], its columns 1, 2, … are the sensors of [measure]."""
        if case.identify is not None:
            return signal_of(question_of(case), file)
        columns = {sensor: column for column, sensor in enumerate(sensors_of(case, case), 1)}
        try:
            signal = read_signal(file, columns, calibration=1.0)  # AR and TOF do not depend on it
        except ValueError as error:
            if not str(error).startswith("calibration"):
                raise
            signal = read_signal(file, columns)  # of a file in newtons
        return clean_signal(signal)

    def fit_at(signal: xr.Dataset, point: Mapping[str, Any]) -> Identification:
        """Return what a tap says about the case, which gets the entries that the point has."""
        return fit(question_of(case.changed({name: value for name, value in point.items() if "." in name})), signal)

    toml = case.to_toml()
    keep.mkdir(exist_ok=True)
    answer = tap_maps.measured_waves if case.identify is None else fit_at
    work = tap_maps.Taps(answer, 0.0, tap, Store(keep, versions()["hertzlink"], toml))
    data = tap_maps.mapped_taps(grid, work, jobs).assign_attrs(case=toml)
    failed = [
        fill(f"failed: {tap_maps.where(data, k)}: {error}", WIDTH, subsequent_indent="  ", break_on_hyphens=False)
        for k, error in enumerate(data.error.values) if error
    ]  # fmt: skip

    points = tap_maps.points_of(data)
    verdicts = [tap_maps.verdict_of(point) for point in points]
    counts = ", ".join(f"{count} {verdict}" for verdict, count in Counter(verdicts).items())
    summary = f"{count_of(len(points), 'point')}: {counts}"
    rivals = ["* other values fit as well; the interval contains them"] if (data.fits > 1).any() else []
    code = 0 if set(verdicts) <= {IDENTIFIED, tap_maps.MEASURED} else NOT_IDENTIFIED
    return Answer(data, [map_table(data, points)], [*rivals, *failed, summary], code=code)


def map_table(data: xr.Dataset, points: Sequence[xr.Dataset]) -> Table:
    """Return the map: in the file a row for each point and unknown, on the terminal a row for each point."""
    columns = {
        "x": "x (m)", "y": "y (m)", "unknown": "unknown", "value": "value (SI)", "low": "low", "high": "high",
        "verdict": "verdict", "misfit": "residual over noise", "taps": "taps", "files": "files", "error": "reason",
    }  # fmt: skip
    of_points = data[[name for name in columns if name != "unknown"]]
    frame = of_points.to_dataframe(["point", "unknown"]).reset_index()[[*columns]].rename(columns=columns)
    # The last parts of the unknowns' paths name them, if they differ.
    names = points[0].unknown.values.tolist()
    last = [name.split(".")[-1] for name in names]
    short = dict(zip(names, last if len({*last}) == len(names) else names, strict=True))
    cells = []
    for point in points:
        unknowns = [replace(one, name=short[one.name]) for one in unknowns_of(point)]
        values = ["-" if np.isnan(one.value) else "{} ({})".format(*one.row()[1:3]) for one in unknowns]
        cells.append([*tap_maps.place_of(point), *values, tap_maps.verdict_of(point) + "*" * (int(point.fits) > 1)])
    head = [f"{along}, {data[along].attrs['unit']}" for along in "xy"]
    head += [*(one.head for one in unknowns), "verdict"]
    return Table("map.csv", frame, pd.DataFrame(cells, columns=head))
