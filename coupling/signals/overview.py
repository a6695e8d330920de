"""What a file of a recorder holds, channel by channel, before anything is fitted: sampling, range, clipping, noise."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from coupling.results.sensor_trace import Measures, measures
from coupling.signals.channels import Sampling, even
from coupling.signals.conditioning import mains_hum
from coupling.signals.recorders import opened
from structures.structure import Vector

MAINS = (50.0, 60.0)
CLEAR = 0.8  # A hum is one if what it leaves of the quiet lead is below this part of its standard deviation.
SILENT = 1e-9  # Of the greatest value: what scatters less was simulated, and has no noise.
COLOURED = 1.5  # Noise is not white if the quiet lead scatters by so much more than neighbouring samples do.


class Look(NamedTuple):
    """A channel: its column, name and SI unit; its samples, and what is measured of them; how many are clipped; the
    standard deviation of the quiet lead; how long that is, s; hum as (Hz, amplitude) or None."""

    column: int
    name: str
    unit: str
    time: Vector
    values: Vector
    measures: Measures
    clipped: int
    noise: float
    lead: float
    hum: tuple[float, float] | None


class Overview(NamedTuple):
    """What a file is; its channels; its columns that are none, and why; and what was left out or assumed."""

    kind: str
    looks: list[Look]
    refused: dict[int, str]
    notes: list[str]


def overview(path: Path, asked: Sampling) -> Overview:
    """Return what a file holds. A ValueError that names the file where it holds no channel."""
    recording = opened(path, None, asked)
    looks, refused, notes = list[Look](), dict[int, str](), [*recording.notes]
    for column, channel in recording.channels.items():
        try:
            time, values, unit, said = even(path, recording, column, asked, f"column {column}")
        except ValueError as error:
            refused[column] = str(error).removeprefix(str(path)).lstrip(":, ")
            continue
        notes += said
        seen, hums = measures(time, values), list[tuple[float, float, float]]()
        noise = float(seen.filled[: seen.lead].std(ddof=1)) if seen.lead > 1 else seen.noise
        least = SILENT * float(np.nanmax(np.abs(values)))
        noise, step, white = (size if size > least else 0.0 for size in (noise, seen.step, seen.noise))
        seen = seen._replace(step=step, noise=white)
        for mains in MAINS if noise else ():
            record = measures(time, values, mains)
            if (hum := mains_hum(time, record, mains)[0]) is not None:
                left, before = (float(part[: record.lead].std()) for part in (record.filled - hum, record.filled))
                hums += [(left, mains, float(np.ptp(hum) / 2.0))] if left < CLEAR * before else []
        clipped, lead = int((seen.clipped & np.isfinite(values)).sum()), float(time[seen.lead] - time[0])
        strongest = min(hums)[1:] if hums else None
        looks.append(Look(column, channel.name, unit, time, values, seen, clipped, noise, lead, strongest))
    if not looks:
        raise ValueError(f"{path}: {next(iter(refused.values()), 'holds no channel of samples')}")
    return Overview(recording.kind, looks, refused, [*dict.fromkeys(notes)])
