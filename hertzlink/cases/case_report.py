"""The report of a case: one page, with what its result shows."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice, product
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.plots.canvas import COLOURS, from_zero, legend_below, styled
from coupling.plots.swept import MARKERS, MEASURES, MOST_CURVES, label_of, parameter, swept, words_of
from coupling.results.findings import findings_of, one_of_each
from hertzlink.cases.run_with_yielding import WITH_YIELDING
from hertzlink.reports import in_a_sentence
from hertzlink.reports.page import Page, Picture, Section, Table, table, usual_facts
from hertzlink.reports.report import page_of, with_setup
from hertzlink.reports.svg import drawn
from structures.units import handy

MOST_ROWS, MOST_PICTURES = 60, 8
"""Of a report; the files beside it hold all."""

NOT_SHOWN = ("traces.csv",)

WITH_UNIT = re.compile(r"(.*) \(([^()]+)\)")
"""A head of a column, and its unit."""


def page(
    data: xr.Dataset,
    files: Mapping[str, str],
    title: str,
    took: float,
    sensors: Sequence[int] | None = None,
    sketched: CoSimulation | None = None,
    yielded: xr.Dataset | None = None,
) -> Page:
    """Return the page.

    files: the CSV files of the case by name, which become tables. sensors: of a run. sketched: of an identification.
    yielded: the result with a law of yielding.
    """
    yielding = [str(data.attrs[WITH_YIELDING])] if data.attrs.get(WITH_YIELDING) else []
    if "amplitude_ratio" not in data:  # one run, or an identification
        of_one = page_of(data, title, sensors, sketched, took, yielded=yielded)
        return replace(of_one, summary=[*of_one.summary[:-1], *yielding, *of_one.summary[-1:]])
    tables = [_table(name, text) for name, text in files.items() if name.endswith(".csv") and name not in NOT_SHOWN]
    warnings = one_of_each([str(finding) for finding in findings_of(data)])
    sections = with_setup([Section("Results", tables=tables, pictures=_pictures(data))], data, None, warnings)
    if "bracket" in data:
        summary = [in_a_sentence.of_critical(data, " of elastic contacts" if yielding else "")]
    else:
        ratios = {int(sensor): data.amplitude_ratio.sel(sensor=sensor) for sensor in data.sensor.values}
        summary = [in_a_sentence.of_sweep(data, ratio, sensor) for sensor, ratio in ratios.items()]
    summary += [*yielding, in_a_sentence.DEFINED]
    return Page(title, summary, sections, usual_facts(took, {}))


def _pictures(data: xr.Dataset) -> list[Picture]:
    """Return AR and TOF over the axis of the most numbers; a figure for each combination of all but one other."""
    pictures = list[Picture]()
    for wave, prefix in (("primary", ""), ("secondary", "secondary_")):
        if f"{prefix}amplitude_ratio" in data and bool(data[f"{prefix}amplitude_ratio"].notnull().any()):
            pictures += _of_wave(data, wave)
    return pictures


def _of_wave(data: xr.Dataset, wave: str) -> list[Picture]:
    """Return AR and TOF of a wave."""
    ratio = data.amplitude_ratio
    names = sorted(map(str, ratio.dims), key=lambda name: (ratio[name].dtype.kind not in "iuf", -ratio.sizes[name]))
    along, others = names[0], [name for name in names[1:] if ratio.sizes[name] > 1]
    curves = next((name for name in others if ratio.sizes[name] <= MOST_CURVES), None)
    fixed = [name for name in names[1:] if name != curves]
    combinations = product(*(range(ratio.sizes[name]) for name in fixed))
    pictures = list[Picture]()
    for place in islice(combinations, MOST_PICTURES // len(MEASURES)):
        part = data.isel(dict(zip(fixed, place, strict=True)))
        where = "".join(f", {_shown(part[name])}" for name in fixed)
        for measure, words in (("amplitude_ratio", "Amplitude ratio AR"), ("time_of_flight", "Time of flight TOF")):
            caption = f"{words} of the {wave} wave{where}."
            name = "-".join([wave, measure, *map(str, place)])
            draw = _sampled if "sampled" in part else _draw
            pictures.append(drawn(name, caption, partial(draw, part, measure, along, wave)))
    return pictures


def _draw(part: xr.Dataset, measure: str, along: str, wave: str, ax: Any) -> None:
    swept(part, None, measure, along, wave, ax)


def _sampled(part: xr.Dataset, measure: str, along: str, wave: str, ax: Any) -> None:
    """Draw the refined samples of each curve, and its critical distance; each curve has places of its own."""
    words, factor, _ = MEASURES[measure]
    scale, unit = parameter(part[along])
    curves = next((str(name) for name in part[measure].dims if name != along), None)
    for number in range(part.sizes[curves] if curves else 1):
        curve = part.isel({curves: number}) if curves else part
        curve = curve.isel({along: curve.sampled.values.astype(bool)})
        label = _shown(curve[curves]) if curves else "runs"
        style = {"color": COLOURS[number], "marker": MARKERS[number], "markersize": 4.0, "linewidth": 1.1}
        ax.plot(scale * curve[along].values, factor * curve[measure].values, label=label, **style)
        low, high = scale * curve.bracket.values.ravel()
        if np.isfinite([low, high]).all():
            span = f"critical: {low:.4g} to {high:.4g} {unit}"
            ax.axvspan(low, high, color=COLOURS[number], alpha=0.35, label=span)
    if measure == "amplitude_ratio":
        from_zero(ax)
    styled(ax, label_of(part[along]), words)
    legend_below(ax, f"{wave} wave")


def _shown(value: xr.DataArray) -> str:
    """Return a parameter with its value."""
    words = words_of(value)
    if value.dtype.kind not in "iuf":
        return f"{words} {value.item()}"
    factor, unit = parameter(value)
    return f"{words} {factor * value.item():.4g} {unit}".strip()


def _table(name: str, text: str) -> Table:
    """Return a CSV file as a table, in handy units."""
    head, *rows = list(csv.reader(io.StringIO(text)))
    words = f"The first {MOST_ROWS} of {len(rows)} rows of {name}" if len(rows) > MOST_ROWS else f"All rows of {name}"
    columns = [_column(title, [row[i] for row in rows]) for i, title in enumerate(head)]
    shown = list(zip(*(cells[:MOST_ROWS] for _, cells in columns), strict=True))
    return table(f"{words} (there in SI units).", [title for title, _ in columns], shown)


def _column(head: str, cells: Sequence[str]) -> tuple[str, list[str]]:
    """Return a column with five digits, in the unit with a prefix that suits its numbers; other text as it is."""
    numbers = [_number(cell) for cell in cells]
    numeric = [number for number in numbers if number is not None]
    match = WITH_UNIT.fullmatch(head)
    factor, title = 1.0, head
    if match and numeric:
        factor, unit = handy(numeric, match[2])
        title = f"{match[1]} ({unit})"
    return title, [
        cell or "none" if number is None else f"{factor * number:.5g}"
        for cell, number in zip(cells, numbers, strict=True)
    ]


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None
