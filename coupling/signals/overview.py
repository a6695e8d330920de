"""What a file of a recorder holds, channel by channel, before anything is fitted: sampling, range, clipping, noise."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from coupling.results.sensor_trace import clipped_samples, interpolated_over_gaps, is_inverted, noise_level, resolution
from coupling.signals.conditioning import lead_of, mains_hum
from coupling.signals.files import opened, sampled
from coupling.signals.recordings import Sampling
from structures.structure import Vector

MAINS = (50.0, 60.0)
CLEAR = 0.8  # A hum is one if what it leaves of the quiet lead is below this part of its standard deviation.
COLOURED = 1.5  # Noise is not white if the quiet lead scatters by so much more than neighbouring samples do.


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


def overview(path: Path, interval: float | None = None, segment: int | None = None) -> Overview:
    """Return what a file holds. A ValueError that names the file where it holds no channel. interval: s."""
    sampling = Sampling(interval=interval, segment=segment)
    recording = opened(path, None, sampling)
    looks, refused, notes = list[Look](), dict[int, str](), [*recording.notes]
    for column, channel in recording.channels.items():
        try:
            time, values, unit, said = sampled(path, recording, column, sampling, f"column {column}")
        except ValueError as error:
            refused[column] = str(error).removeprefix(str(path)).lstrip(":, ")
            continue
        notes += said
        filled, missing = interpolated_over_gaps(values), int((~np.isfinite(values)).sum())
        step, white = resolution(values[np.isfinite(values)]), noise_level(filled)
        lead = lead_of(-filled if is_inverted(filled) else filled)
        quiet = float(np.median(filled[:lead] if lead else filled))
        clipped = int(clipped_samples(time, values, quiet, step, white)[0].sum()) - missing
        noise = float(filled[:lead].std(ddof=1)) if lead > 1 else white
        hums = list[tuple[float, float, float]]()
        for mains in MAINS:
            long_lead = lead_of(filled, mains)
            hum, _ = mains_hum(time, filled, long_lead, mains)
            if hum is not None:
                left, before = (float(part[:long_lead].std()) for part in (filled - hum, filled))
                hums += [(left, mains, float(np.ptp(hum) / 2.0))] if left < CLEAR * before else []
        found = min(hums)[1:] if hums else None
        sizes = clipped, missing, step, noise, white, float(time[lead] - time[0])
        looks.append(Look(column, channel.name, unit, time, values, *sizes, found))
    if not looks:
        raise ValueError(f"{path}: {next(iter(refused.values()), 'holds no channel of samples')}")
    return Overview(recording.kind, looks, refused, [*dict.fromkeys(notes)])
