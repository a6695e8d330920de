"""Maps of taps with a case: each point of a table is identified, or read for AR and TOF."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from coupling.inference.identification import BLIND, IDENTIFIED, NUISANCE, Identification, Unknown
from coupling.inference.tap_maps import MEASURED, Grid, Taps, mapped_taps, read_grid, waves_at, where
from coupling.results.provenance import versions
from coupling.signals.conditioning import clean_signal
from coupling.signals.signals import read_signal
from coupling.sweeps.store import Store
from hertzlink.cases.case import Case
from hertzlink.cases.identification import NOT_IDENTIFIED, fit, question_of, signal_of
from hertzlink.cases.sweeps import path_of, si_value
from hertzlink.cases.tasks import WIDTH, Answer, Table, sensors_of
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


def grid_of(case: Case, table: Path) -> Grid:
    """Return the points of a table, or of points.csv in a folder, checked with the case."""
    if case.identify is not None:
        question_of(case)
    return read_grid(table, Taken(case).convert)


def map_of(case: Case, grid: Grid, keep: Path, jobs: int | None) -> Answer:
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
    return Answer(data, [_table(data, asked, verdicts)], [*failed, summary], code=code)


def _table(data: xr.Dataset, asked: list[str], verdicts: list[str]) -> Table:
    """Return a row of the file for each point and unknown, and of the terminal for each point, in the user's units."""
    columns = ["x (m)", "y (m)", "unknown", "value (SI)", "low", "high", "verdict", "residual over noise", "taps"]
    columns += ["files", "reason"]
    short = {name: name.split(".")[-1] for name in asked}
    if len(set(short.values())) < len(asked):
        short = {name: name for name in asked}
    units = {name: str(data.unit.sel(unknown=name).item()) for name in asked}
    head = [f"{along}, {data[along].attrs['unit']}" for along in "xy"] + ["taps"]
    head += [f"{short[name]}, {units[name]}" if units[name] else short[name] for name in asked] + ["verdict"]
    rows: list[list[Any]] = []
    cells = []
    for k, verdict in enumerate(verdicts):
        point = data.isel(point=k)
        place, taps = [float(point.x), float(point.y)], int(point.taps)
        shown = [f"{value / data[along].attrs['size']:g}" for along, value in zip("xy", place, strict=True)]
        shown.append(str(taps))
        for name in map(str, data.unknown.values):
            one = point.sel(unknown=name)
            value, low, high, size = (float(one[what]) for what in ("value", "low", "high", "unit_size"))
            said = str(one.verdict.item())
            end = [float(point.misfit), taps, str(point.files.item()), str(point.error.item())]
            rows.append([*place, name, value, low, high, said, *end])
            if name in asked and np.isnan(value):
                shown.append("-")
            elif name in asked:  # half of the interval, or the interval alone of an unknown that is blind
                text = Unknown(name, value, (low, high), said, unit_size=size).row()
                shown.append(f"({text[2]})" if said == BLIND else f"{text[1]} ± {(high - low) / 2.0 / size:#.2g}")
        cells.append([*shown, verdict])
    return Table("map.csv", pd.DataFrame(rows, columns=columns), pd.DataFrame(cells, columns=head))
