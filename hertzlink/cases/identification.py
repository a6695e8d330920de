"""The section [identify] of a case: its question, its signal, the fit and its tables; and maps of taps with a case."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path as File
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from coupling.inference.identification import BLIND, IDENTIFIED, NUISANCE, Identification, Unknown
from coupling.inference.identify import identify
from coupling.inference.misfit import OF_SENSORS
from coupling.inference.prediction import FROM_IMPACT
from coupling.inference.tap_maps import MEASURED, Grid, Taps, mapped_taps, read_grid, waves_at, where
from coupling.results.provenance import versions
from coupling.signals.conditioning import clean_signal
from coupling.signals.signals import read_signal
from coupling.sweeps.store import Store
from hertzlink.cases import Fault, Path, parsed, written
from hertzlink.cases.case import Build, Case, of_case
from hertzlink.cases.parts import Identify
from hertzlink.cases.sweeps import path_of, si_value, unit_at
from hertzlink.cases.tasks import WIDTH, Answer, Table, count_of_beads, sensors_of
from structures.caution import collected
from structures.checks import count_of, existing

WIDE = 2.0
"""The range of a nuisance without one: from its value over this factor to its value times it."""

MOST_ELEMENTS = 400
"""Elements of a layer whose mesh is the same for all values."""

NOT_IDENTIFIED = 3
"""Exit code where results are written, but an unknown is not identified."""


@dataclass(frozen=True)
class Question:
    """A question: the unknowns by path, their ranges (SI), units of tables and sizes; nuisances; sensors."""

    case: Case
    asked: Identify
    ranges: dict[str, tuple[float, float]]
    units: dict[str, tuple[str, float]]
    nuisances: list[str]
    columns: dict[int, int]

    @property
    def build(self) -> Build:
        """What builds the case with values at the paths of the unknowns, for `identify`."""
        return Build(self.case, {name: parsed(name) for name in self.ranges})


def question_of(case: Case) -> Question:
    """Return the section [identify], checked; a Fault for what does not fit."""
    asked = case.identify
    if asked is None:
        raise Fault(("identify",), "is missing; add a section [identify] with sensors and unknowns")
    case.only_chain("an identification")
    count = count_of_beads(case, 0)
    for name in asked.sensors:
        if not name.isdigit() or not 1 <= int(name) <= count:
            reason = f'"{name}" is no bead of 1 to {count}; write {{ 7 = 1 }} for bead 7 in column 1'
            raise Fault(("identify", "sensors", name), reason)

    ranges: dict[str, tuple[float, float]] = {}
    units: dict[str, tuple[str, float]] = {}
    for key, ends in asked.unknowns.items():
        place: Path = ("identify", "unknowns", key)
        path = path_of(key, place)
        low, high = (si_value(case, path, end, (*place, i)) for i, end in enumerate(ends))
        if not isinstance(low, int | float) or not isinstance(high, int | float) or low >= high:
            raise Fault(place, "must have two numbers, the lowest and the highest value")
        if written(path) in ranges:
            raise Fault(place, f'"{key}" is given twice')
        ranges[written(path)], units[written(path)] = (float(low), float(high)), unit_at(case, path, ends)[:2]
    nuisances = []
    for i, key in enumerate(asked.nuisances):
        place = ("identify", "nuisances", i)
        if key not in OF_SENSORS and "." not in key:
            choices = ", ".join(OF_SENSORS)
            raise Fault(place, f'"{key}" is none; take {choices}, or a path such as chain.impact_speed')
        nuisances.append(key if key in OF_SENSORS else written(path := path_of(key, place)))
        if nuisances[-1] not in (*OF_SENSORS, *ranges):
            value = case.value(path)
            if not isinstance(value, int | float) or not value > 0.0:
                raise Fault(place, f'"{key}" has no value in the case; give it a range in identify.unknowns')
            ranges[written(path)], units[written(path)] = (value / WIDE, value * WIDE), unit_at(case, path, ())[:2]
    columns = {int(name): column for name, column in asked.sensors.items()}
    return Question(case, asked, ranges, units, nuisances, columns)


def signal_of(question: Question, file: File) -> xr.Dataset:
    """Return the measured signal, conditioned; a Fault, or raise a ValueError that names the file."""
    asked = question.asked
    calibration: Any = asked.calibration
    if isinstance(calibration, Mapping):
        calibration = {int(name): value for name, value in calibration.items() if name.isdigit()}
    with question.case.located("identify"):
        signal = read_signal(
            existing(str(file), file), question.columns, asked.time_column, asked.time_unit, asked.unit, calibration,
            "lead", None, asked.interval, asked.start, asked.segment,
        )  # fmt: skip
        # The lead is short; identify estimates the noise from all samples.
        return clean_signal(signal, asked.mains).drop_vars("noise")


def fit(question: Question, signal: xr.Dataset, file: File | None = None) -> Identification:
    """Return what the signal of a file says about the unknowns, in the units of the case."""
    asked = question.asked
    question, until = prepared(question, float(signal.time[-1] - signal.time[0]))
    settings: dict[str, Any] = dict(question.ranges)
    try:
        found = identify(
            signal, question.build, question.nuisances, until=until, noise=asked.noise, seed=asked.seed,
            discrepancy=asked.discrepancy, **settings,
        )  # fmt: skip
    except ValueError as error:
        if file is None or not str(error).startswith("signal: "):
            raise
        raise ValueError(f"{file}{str(error).removeprefix('signal')}") from None
    shown = dict(found.unknowns)
    for name, (unit, size) in question.units.items():
        shown[name] = replace(shown[name], unit=unit, unit_size=size)
    return replace(found, unknowns=shown)


def prepared(question: Question, record: float = inf) -> tuple[Question, float]:
    """Return the question of a case whose runs are as long as its signal counts, and that length, s. record: s.

    A rod gets the same mesh at all values.
    """
    until = question.asked.until
    ends = [{name: both[end] for name, both in question.ranges.items()} for end in (0, 1)]
    if until is None:
        with collected():
            middle = {name: 0.5 * sum(both) for name, both in question.ranges.items()}
            until = min(record, FROM_IMPACT * question.build(**middle).chain.transit_time)
    question = replace(question, case=question.case.changed({"run.until": until, "run.accuracy": "default"}))
    body = question.case.all("structure")[0]
    varies = any(name.startswith("structure") for name in question.ranges)
    if body.form.kind == "rod" and "elements" not in body.entries and varies:
        meshes = [question.build(**at).structure.structure.origin["elements"] for at in ends]
        elements = min(max(map(max, meshes)), MOST_ELEMENTS)
        question = replace(question, case=question.case.changed({"structure.elements": elements}))
    return question, until


def answer_of(question: Question, found: Identification) -> Answer:
    """Return what was found: tables, the case with the values found, and a simulation to sketch."""
    unknowns = found.unknowns.items()
    rows = [[name, one.value, *one.interval, one.verdict, found.misfit] for name, one in unknowns]
    frame = pd.DataFrame(rows, columns=["unknown", "value (SI)", "low", "high", "verdict", "residual over noise"])
    head = ["unknown", "value", "95 % interval", "verdict"]
    table = Table("unknowns.csv", frame, pd.DataFrame([one.row() for _, one in unknowns], columns=head))
    traces = {"time (s)": found.data.time.values}
    for bead in found.data.sensor.values:
        for quantity in ("measured", "fitted"):
            traces[f"{quantity} at bead {bead} (N)"] = found.data[quantity].sel(sensor=bead).values

    in_case = replace(found, warnings=[of_case(warning) for warning in found.warnings])
    values = {name: found[name].value for name in question.ranges}
    best = {"identified.toml" if found.explained else "best_fit.toml": question.case.changed(values).to_toml()}
    result = found.to_dataset().assign_attrs(case=question.case.to_toml())
    code = 0 if found.identified else NOT_IDENTIFIED
    notes = str(in_case).splitlines()[1 + len(found.unknowns) :]
    tables = [table, Table("fit.csv", pd.DataFrame(traces))]
    return Answer(result, tables, notes, sketched=question.build(**values), others=best, code=code)


@dataclass(frozen=True)
class Taken:
    """What is asked at each point of a map: the section [identify] of a case, or AR and TOF without one."""

    case: Case

    def read(self, file: File) -> xr.Dataset:
        """Return the signal of a file. Without [identify], its columns 1, 2, … are the sensors of [measure]."""
        if self.case.identify is not None:
            return signal_of(question_of(self.case), file)
        columns = {sensor: column for column, sensor in enumerate(sensors_of(self.case, self.case), 1)}
        try:
            signal = read_signal(file, columns, calibration=1.0)  # AR and TOF do not depend on it
        except ValueError as error:
            if not str(error).startswith("calibration"):
                raise
            signal = read_signal(file, columns)
        return clean_signal(signal)

    def answer(self, signal: xr.Dataset, point: Mapping[str, Any]) -> Identification:
        """Return what the signal says at a point, whose entries the case gets."""
        entries = {name: value for name, value in point.items() if "." in name}
        return fit(question_of(self.case.changed(entries)), signal)

    def convert(self, name: str, text: str, unit: str) -> Any:
        """Return the value (SI) that an entry of the case gets from a cell; other columns, without a point in their
        name, as they are."""
        if "." not in name:
            return text
        path = path_of(name, ())
        asked = self.case.identify.unknowns if self.case.identify else ()
        if path in (path_of(key, ()) for key in asked):
            raise ValueError("is an unknown of [identify] as well; leave the column out, or the unknown")
        value: Any = f"{text} {unit}".strip()
        if not unit:
            try:
                value = float(text)
            except ValueError:
                value = text
        return si_value(self.case, path, value, path)


def grid_of(case: Case, table: File) -> Grid:
    """Return the points of a table, or of points.csv in a folder, checked with the case."""
    if case.identify is not None:
        question_of(case)
    return read_grid(table, Taken(case).convert)


def map_of(case: Case, grid: Grid, keep: File, jobs: int | None) -> Answer:
    """Return the map. keep: a folder for the answers, from which a map that was interrupted continues."""
    taken, toml = Taken(case), case.to_toml()
    keep.mkdir(exist_ok=True)
    work = Taps(waves_at if case.identify is None else taken.answer, 0.0, taken.read, Store(keep))
    data = mapped_taps(grid, work, jobs, f"{versions()['hertzlink']}\n{toml}").assign_attrs(case=toml)
    failed = [
        fill(f"failed: {where(data, k)}: {error}", WIDTH, subsequent_indent="  ", break_on_hyphens=False)
        for k, error in enumerate(data.error.values) if error
    ]  # fmt: skip

    # Of each point one verdict for all unknowns, or each that they have.
    asked = [name for name in data.unknown.values if NUISANCE not in data.verdict.sel(unknown=name).values]
    verdicts = [
        ", ".join(dict.fromkeys(verdict.partition(":")[0] for verdict in row))
        for row in data.verdict.sel(unknown=asked).values.tolist()
    ]
    counts = ", ".join(f"{count} {verdict}" for verdict, count in Counter(verdicts).items())
    summary = f"{count_of(data.sizes['point'], 'point')}: {counts}"
    code = 0 if set(verdicts) <= {IDENTIFIED, MEASURED} else NOT_IDENTIFIED
    return Answer(data, [_map_table(data, asked, verdicts)], [*failed, summary], code=code)


def _map_table(data: xr.Dataset, asked: list[str], verdicts: list[str]) -> Table:
    """Return a row of the file for each point and unknown, and of the terminal for each point, in the user's units."""
    columns = {
        "x": "x (m)", "y": "y (m)", "unknown": "unknown", "value": "value (SI)", "low": "low", "high": "high",
        "verdict": "verdict", "misfit": "residual over noise", "taps": "taps", "files": "files", "error": "reason",
    }  # fmt: skip
    of_points = data[[name for name in columns if name != "unknown"]]
    frame = of_points.to_dataframe(["point", "unknown"]).reset_index()[[*columns]].rename(columns=columns)
    short = {name: name.split(".")[-1] for name in asked}
    if len(set(short.values())) < len(asked):
        short = {name: name for name in asked}
    units = {name: str(data.unit.sel(unknown=name).item()) for name in asked}
    head = [f"{along}, {data[along].attrs['unit']}" for along in "xy"] + ["taps"]
    head += [f"{short[name]}, {units[name]}" if units[name] else short[name] for name in asked] + ["verdict"]
    cells = []
    for k, verdict in enumerate(verdicts):
        point = data.isel(point=k)
        shown = [f"{float(point[along]) / data[along].attrs['size']:g}" for along in "xy"] + [str(int(point.taps))]
        for name in asked:
            one = point.sel(unknown=name)
            value, low, high, size = (float(one[what]) for what in ("value", "low", "high", "unit_size"))
            said = str(one.verdict.item())
            if np.isnan(value):
                shown.append("-")
            else:  # half of the interval, or the interval alone of an unknown that is blind
                text = Unknown(name, value, (low, high), said, unit_size=size).row()
                shown.append(f"({text[2]})" if said == BLIND else f"{text[1]} ± {(high - low) / 2.0 / size:#.2g}")
        cells.append([*shown, verdict])
    return Table("map.csv", frame, pd.DataFrame(cells, columns=head))
