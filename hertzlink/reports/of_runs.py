"""Reports of runs, signals, sweeps and batches."""

import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr

from coupling.plots import swept, traces
from coupling.results.ar_and_tof import UNCERTAINTY, amplitude_ratio, reflections, time_of_flight
from coupling.results.measures import energy_error
from coupling.results.reading import Reading
from coupling.results.schema import RUN, kind_of
from coupling.results.waves import ABOVE_ONE, NoWave, ReflectedWave
from hertzlink.reports import in_a_sentence
from hertzlink.reports.page import Picture, Section, Table, table
from hertzlink.reports.svg import drawn
from structures.checks import count_of

MOST_POINTS = 60
"""A table of a sweep has at most this number of rows."""

MEASURES = (("AR", 1.0, amplitude_ratio), ("TOF (µs)", 1e6, time_of_flight))


def of_one(data: xr.Dataset, sensors: Any, yielded: xr.Dataset | None = None) -> tuple[list[str], list[Section]]:
    """Return a run or a signal; of several chains each by itself. yielded: the same run with a law of yielding."""
    reading = Reading(data)
    is_run, numbers = kind_of(data) == RUN, traces.sensors_of(reading, sensors)
    several = data.sizes.get("chain", 1) > 1

    def parts_of(run: xr.Dataset) -> dict[str, xr.Dataset]:
        return {f"chain {i}": run.isel(chain=i) for i in range(run.sizes["chain"])} if several else {"": run}

    parts, fresh = parts_of(data), {} if yielded is None else parts_of(yielded)
    summary = [in_a_sentence.of_run(part, numbers[0], who) for who, part in parts.items()]
    sections = [_chain(part, numbers, who, fresh.get(who)) for who, part in parts.items()]
    length = f"{1e6 * (reading.time[-1] - reading.time[0]):.6g} µs in {count_of(reading.time.size, 'sample')}"
    record = f"The record is {'simulated' if is_run else 'measured'}: {length}."
    if is_run and "kinetic_energy" in data:
        change = f"The energy changes by {float(energy_error(data)):.1g} of the impact energy."
        words = "Where the energy is over time. The sum must not change."
        picture = drawn("energy", words, lambda ax: traces.energy(data, ax))
        return summary, [*sections, Section("Record and energy", [record, change], pictures=[picture])]
    return summary, [*sections, Section("Record", [record])]


def _chain(data: xr.Dataset, numbers: list[int], who: str, fresh: xr.Dataset | None) -> Section:
    """Return the waves of one chain, or of a signal. who: which of several chains. fresh: with a law of yielding."""
    rows: list[tuple[str, ...]] = []
    for number in numbers:
        rows += _waves(data, number)
        rows += [] if fresh is None else [*_waves(fresh, number, ", fresh spot")][1:]
    head = ("sensor and wave", "peak (N)", "arrival (µs)", "AR", "TOF (µs)", "remark")

    def shown(kind: str, words: str, draw: Callable[[Any], Any]) -> Picture:
        return drawn("-".join([kind, *who.split()]), f"Of {who}: {words}" if who else words, draw)

    words = f"Force at bead{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}, and its waves."

    def forces(ax: Any) -> None:
        traces.traces(data, numbers, ax)
        if fresh is not None:
            traces.on_a_fresh_spot(fresh, numbers, ax)

    pictures = [shown("traces", words, forces)]
    if kind_of(data) == RUN and not Reading(data).at_sensors:
        words = "Force at each contact over time: waves run down the chain, and back from the structure."
        pictures.append(shown("map", words, lambda ax: traces.contact_map(data, ax)))
    words = f"Amplitude spectrum of the force at bead {numbers[0]}."
    with suppress(ValueError):  # of clipped samples, of which the table tells
        pictures.append(shown("spectrum", words, lambda ax: traces.spectrum(data, numbers[0], ax)))
    title = f"Waves of {who}" if who else "Waves"
    tables = [table(f"AR and TOF at the sensors{' of ' * bool(who)}{who}", head, rows)]
    if budgets := json.loads(data.attrs.get(UNCERTAINTY, "{}")):
        shares = [row for budget in budgets.values() for row in budget["rows"]]
        columns = "measure", "value ± standard uncertainty", "shares of the variance"
        tables.append(table("What uncertain parameters do to AR and TOF", columns, shares))
    return Section(title, tables=tables, pictures=pictures)


def _waves(data: xr.Dataset, sensor: int, spot: str = "") -> Iterator[tuple[str, ...]]:
    """Yield a row for each wave at a sensor. spot: which, in words."""
    try:
        waves = reflections(data, sensor)
    except ValueError as error:
        yield f"bead {sensor}", "", "", "", "", str(error)
        return
    for name, wave in zip(waves._fields, waves, strict=True):
        words = f"bead {sensor}, {name}{spot}"
        if isinstance(wave, NoWave):
            yield words, "", "", "", "", f"none; {wave.reason}"
            continue
        peak = (f"{wave.amplitude:.2f}", f"{1e6 * wave.arrival:.2f}")
        if isinstance(wave, ReflectedWave):
            begins = "" if wave.begins == "unknown" else f"begins at the {wave.begins}"
            remark = "; ".join(filter(None, (begins, ABOVE_ONE * (wave.amplitude_ratio > 1.0))))
            yield words, *peak, *wave.texts, remark
        else:
            yield words, *peak, "", "", ""


def of_many(data: xr.Dataset, sensors: Any) -> tuple[list[str], list[Section]]:
    """Return a sweep or a batch."""
    reading = Reading(data)
    numbers = traces.sensors_of(reading, sensors)
    sections = [_bead(data, number) for number in numbers]
    return [in_a_sentence.of_sweep(data, amplitude_ratio(data, number), number) for number in numbers], sections


def _bead(data: xr.Dataset, number: int) -> Section:
    """Return AR and TOF at a bead."""
    pictures, sentences = [], []
    for wave in ("primary", "secondary"):
        if wave == "secondary" and bool(amplitude_ratio(data, number, wave).isnull().all()):
            sentences.append("No run has a secondary wave at this bead.")
            continue
        for measure, words in (("amplitude_ratio", "Amplitude ratio AR"), ("time_of_flight", "Time of flight TOF")):
            caption, name = f"{words} of the {wave} wave at bead {number}.", f"{measure}-{wave}-{number}"
            try:
                pictures.append(drawn(name, caption, _swept(data, number, measure, wave)))
            except ValueError as error:  # of too many parameters for a curve
                sentences = [f"No curves: {error}"]
    return Section(f"Bead {number}", sentences, tables=[_points(data, number)], pictures=pictures)


def _swept(data: xr.Dataset, sensor: int, measure: str, wave: str) -> Callable[[Any], Any]:
    """Return the curves over the parameter that has the most values."""
    ratio = amplitude_ratio(data, sensor)
    over = max(map(str, ratio.dims), key=lambda name: ratio.sizes[name]) if ratio.dims else None
    return lambda ax: swept.swept(data, sensor, measure, over, wave, ax)


def _points(data: xr.Dataset, sensor: int) -> Table:
    """Return AR and TOF of each run, of the first ones where there are many."""
    values = [
        (f"{wave} {words}", factor, measure(data, sensor, wave))
        for wave in ("primary", "secondary")
        for words, factor, measure in MEASURES
    ]
    axes = [str(name) for name in values[0][2].dims]
    units = {name: swept.parameter(values[0][2][name]) for name in axes}
    rows = []
    for place in list(np.ndindex(*values[0][2].shape))[:MOST_POINTS]:
        at = [values[0][2][name].values[i] for name, i in zip(axes, place, strict=True)]
        texts = [
            f"{units[name][0] * value:.5g}" if np.isreal(value) else str(value)
            for name, value in zip(axes, at, strict=True)
        ]
        measures = [factor * float(quantity.values[place]) for _, factor, quantity in values]
        rows.append((*texts, *("none" if np.isnan(value) else f"{value:.4g}" for value in measures)))
    head = [swept.label_of(values[0][2][name]) for name in axes]
    left = values[0][2].size - len(rows)
    caption = f"AR and TOF at bead {sensor}" + (
        f"; {count_of(left, 'more run is', 'more runs are')} left out" if left else ""
    )
    return table(caption, (*head, *(name for name, _, _ in values)), rows)
