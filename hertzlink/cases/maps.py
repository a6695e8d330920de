"""Maps of taps with a case: each point of a table is identified, or read for AR and TOF."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.identification import BLIND, IDENTIFIED, NUISANCE, Identification, Unknown
from coupling.inference.tap_maps import MEASURED, Grid, Taps, mapped_taps, read_grid, where
from coupling.results.provenance import versions
from coupling.signals.conditioning import clean_signal
from coupling.signals.signals import read_signal
from coupling.sweeps.store import Store
from hertzlink.cases.axes import path_of, si_value
from hertzlink.cases.case import Case
from hertzlink.cases.identification import NOT_IDENTIFIED, fit, question_of, signal_of
from hertzlink.cases.paths import written
from hertzlink.cases.tables import WIDTH, Answer, Table
from hertzlink.cases.tasks import sensors_of
from structures.checks import count_of


@dataclass(frozen=True)
class Taken:
    """What is asked at each point of a map: the section [identify] of a case, or AR and TOF without one."""

    case: Case

    def read(self, file: Path) -> xr.Dataset:
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
        value: Any = f"{text} {unit}".strip()
        if not unit:
            try:
                value = float(text)
            except ValueError:
                value = text
        path = path_of(name, ())
        asked = self.case.identify.unknowns if self.case.identify else ()
        if written(path) in (written(path_of(key, ())) for key in asked):
            raise ValueError("is an unknown of [identify] as well; leave the column out, or the unknown")
        return si_value(self.case, path, value, path)


def grid_of(case: Case, table: Path) -> Grid:
    """Return the points of a table, or of points.csv in a folder, checked with the case."""
    if case.identify is not None:
        question_of(case)
    return read_grid(table, Taken(case).convert)


def map_of(case: Case, grid: Grid, keep: Path, jobs: int | None) -> Answer:
    """Return the map. keep: a folder for the answers, from which a map that was interrupted continues."""
    taken, toml = Taken(case), case.to_toml()
    keep.mkdir(exist_ok=True)
    work = Taps(taken.answer, 0.0, taken.read, Store(keep), asked=case.identify is not None)
    data = mapped_taps(grid, work, jobs, f"{versions()['hertzlink']}\n{toml}").assign_attrs(case=toml)
    failed = [
        fill(f"failed: {where(data, k)}: {error}", WIDTH, subsequent_indent="  ", break_on_hyphens=False)
        for k, error in enumerate(data.error.values) if error
    ]  # fmt: skip
    columns, rows = csv_rows(data)
    table = Table("map.csv", columns, rows, *rows_of(data))
    return Answer(data, [table], [*failed, summary(data)], code=0 if all_identified(data) else NOT_IDENTIFIED)


def interesting(data: xr.Dataset) -> list[str]:
    """Return the names of the unknowns that are no nuisances."""
    return [str(name) for name in data.unknown.values if NUISANCE not in data.verdict.sel(unknown=name).values]


def verdicts(data: xr.Dataset) -> list[str]:
    """Return the verdict of each point in a word or two: one for all unknowns, or each that they have."""
    each = data.verdict.sel(unknown=interesting(data)).values.tolist()
    return [", ".join(dict.fromkeys(verdict.partition(":")[0] for verdict in row)) for row in each]


def all_identified(data: xr.Dataset) -> bool:
    """Return whether all unknowns are identified, or AR and TOF read, at all points."""
    return set(verdicts(data)) <= {IDENTIFIED, MEASURED}


def summary(data: xr.Dataset) -> str:
    """Return how many points there are, and how many have each verdict."""
    counts = Counter(verdicts(data))
    return f"{count_of(data.sizes['point'], 'point')}: " + ", ".join(f"{n} {verdict}" for verdict, n in counts.items())


def rows_of(data: xr.Dataset) -> tuple[list[str], list[list[str]]]:
    """Return the head and a row for each point, in the units of the table and of the case."""
    names = interesting(data)
    units = [str(data.unit.sel(unknown=name).item()) for name in names]
    short = {name: name.split(".")[-1] for name in names}
    short = short if len(set(short.values())) == len(names) else dict(zip(names, names, strict=True))
    head = [f"{along}, {data[along].attrs['unit']}" for along in "xy"] + ["taps"]
    head += [f"{short[name]}, {unit}" if unit else short[name] for name, unit in zip(names, units, strict=True)] + [
        "verdict"
    ]
    rows = []
    for k, verdict in enumerate(verdicts(data)):
        rows.append([*place_of(data, k), str(int(data.taps[k])), *(_cell(data, k, name) for name in names), verdict])
    return head, rows


def place_of(data: xr.Dataset, point: int) -> list[str]:
    """Return x and y of a point, in the units of the table."""
    return [f"{data[along].values[point] / data[along].attrs['size']:g}" for along in "xy"]


def _cell(data: xr.Dataset, point: int, name: str) -> str:
    """Return a value and half of its interval; the interval alone of an unknown that is blind."""
    one = data.isel(point=point).sel(unknown=name)
    value, low, high = (float(one[what]) for what in ("value", "low", "high"))
    if np.isnan(value):
        return "-"
    verdict, size = str(one.verdict.item()), float(one.unit_size)
    row = Unknown(name, value, (low, high), verdict, unit_size=size).row()
    return f"({row[2]})" if verdict == BLIND else f"{row[1]} ± {(high - low) / 2.0 / size:#.2g}"


def csv_rows(data: xr.Dataset) -> tuple[list[str], list[list[Any]]]:
    """Return the head and the rows of a CSV file in SI units: one for each point and unknown."""
    head = ["x (m)", "y (m)", "unknown", "value (SI)", "low", "high", "verdict", "residual over noise", "taps", "files"]
    rows = [
        [
            float(data.x[k]), float(data.y[k]), str(name),
            *(float(data[what][k, i]) for what in ("value", "low", "high")),
            str(data.verdict.values[k, i]), float(data.misfit[k]), int(data.taps[k]), str(data.files.values[k]),
            str(data.error.values[k]),
        ]
        for k in range(data.sizes["point"]) for i, name in enumerate(data.unknown.values)
    ]  # fmt: skip
    return [*head, "reason"], rows
