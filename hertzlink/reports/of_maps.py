"""The text, the table and the report of a map of taps."""

from collections import Counter
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.identification import BLIND, IDENTIFIED, NUISANCE, Unknown
from coupling.inference.tap_maps import MEASURED
from coupling.plots.mapped import mapped
from hertzlink.reports.page import Picture, Section, table
from hertzlink.reports.svg import drawn
from structures.checks import count_of

HEIGHT = 4.4
"""Of a map, inches."""


def of_map(data: xr.Dataset) -> tuple[list[str], list[Section]]:
    """Return what was found at how many points, and maps with their table."""
    pictures: list[Picture] = []
    for name in interesting(data):
        for show, words in (("value", "values"), ("error", "half of the 95 % intervals")):
            caption = f"{name}: {words}."
            pictures.append(drawn(f"{name}-{show}", caption, partial(_draw, data, name, show), HEIGHT))
    head, rows = rows_of(data)
    tables = [table("Points", head, rows), *failures(data)]
    return [summary(data)], [Section("Map", tables=tables, pictures=pictures)]


def _draw(data: xr.Dataset, name: str, show: str, ax: Any) -> None:
    mapped(data, name, show, ax)


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


def failures(data: xr.Dataset) -> list[Any]:
    """Return the table of the points that failed, with files and reasons; none where none failed."""
    rows = [
        [*place_of(data, k), str(data.files.values[k]), str(error)]
        for k, error in enumerate(data.error.values) if error
    ]  # fmt: skip
    head = [*(f"{along}, {data[along].attrs['unit']}" for along in "xy"), "files", "reason"]
    return [table("Points that failed", head, rows)] if rows else []


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
