"""What a file of a recorder holds, channel by channel, before anything is fitted: sampling, range, clipping, noise."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from coupling.results.conditioning import clipped_samples, lead_of, mains_hum
from coupling.results.sensor_trace import interpolated_over_gaps, noise_level, resolution
from coupling.results.signal_file import Sampling, Trace, columns_of, open_trace, read_trace
from structures.structure import Vector

MAINS = (50.0, 60.0)

CLEAR = 0.8
"""A hum is one if what it leaves of the quiet lead is below this part of its standard deviation."""

COLOURED = 1.5
"""Noise is not white if the quiet lead scatters by so much more than neighbouring samples do."""


class Look(NamedTuple):
    """A channel: its column, name and SI unit; its samples; those that are clipped or missing; the digitiser's step;
    the standard deviation of the quiet lead, that of white noise, and the lead, s; hum as (Hz, amplitude) or None."""

    column: int
    name: str
    unit: str
    time: Vector
    values: Vector
    clipped: int
    missing: int
    step: float
    noise: float
    white: float
    lead: float
    hum: tuple[float, float] | None


class Overview(NamedTuple):
    """What a file is; its channels; its columns that are none, and why; and what was left out or assumed."""

    kind: str
    looks: list[Look]
    refused: dict[int, str]
    notes: list[str]


def overview(path: Path, sampling: Sampling) -> Overview:
    """Return what a file holds. A ValueError that names the file where it holds no channel."""
    opened = open_trace(path, sampling.segment)
    looks, refused, notes = list[Look](), dict[int, str](), list[str]()
    for column in columns_of(path, opened):
        try:
            trace = read_trace(path, {column: column}, sampling, None, opened)
        except ValueError as error:
            refused[column] = str(error).removeprefix(f"{path}: ")
            continue
        looks.append(_look(column, trace))
        said = [note.replace(f"sensor {column}:", f"column {column}:") for note in trace.notes]
        notes += [note for note in said if note not in notes]
    if not looks:
        raise ValueError(f"{path}: {next(iter(refused.values()), 'holds no channel of samples')}")
    return Overview(opened.kind, looks, refused, notes)


def _look(column: int, trace: Trace) -> Look:
    time, values = trace.time, trace.columns[column]
    filled, missing = interpolated_over_gaps(values), int((~np.isfinite(values)).sum())
    step, white = resolution(values[np.isfinite(values)]), noise_level(filled)
    lead = lead_of(filled, None)
    quiet = float(np.median(filled[:lead])) if lead else float(np.median(filled))
    clipped = int(clipped_samples(time, values, quiet, step, white)[0].sum()) - missing
    noise = float(filled[:lead].std(ddof=1)) if lead > 1 else white
    hums = []
    for mains in MAINS:
        long_lead = lead_of(filled, mains)
        hum, _ = mains_hum(time, filled, long_lead, mains)
        if hum is not None:
            remainder = float((filled - hum)[:long_lead].std() / filled[:long_lead].std())
            hums.append((remainder, mains, float(np.ptp(hum) / 2.0)))
    left, mains, size = min(hums, default=(1.0, 0.0, 0.0))
    return Look(
        column, re.split(r"\s*[(\[](?!\d+\])", trace.names[column])[0], trace.units[column], time, values, clipped,
        missing, step, noise, white, float(time[lead] - time[0]), (mains, size) if left < CLEAR else None,
    )  # fmt: skip
