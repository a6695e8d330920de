"""The content of a recorder's file, channel by channel, before anything is fitted: sampling, range, clipping, noise."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from coupling.results.sensor_trace import Measures, measures
from coupling.signals.channels import Sampling, even
from coupling.signals.conditioning import mains_hum
from coupling.signals.recorders import opened
from structures.structure import Vector

MAINS = (50.0, 60.0)
CLEAR = 0.8  # A hum counts if, without it, the standard deviation of the quiet lead falls below this part.
SILENT = 1e-9  # Part of the greatest value; a signal that scatters less was simulated and has no noise.
COLOURED = 1.5  # Noise is not white if the quiet lead scatters by this factor more than neighbouring samples do.


class Look(NamedTuple):
    """A channel and its measures."""

    column: int
    name: str
    unit: str  # SI
    time: Vector
    values: Vector
    measures: Measures
    clipped: int  # number of clipped samples
    noise: float  # standard deviation of the quiet lead
    lead: float  # length of the quiet lead, s
    hum: tuple[float, float] | None  # frequency, Hz, and amplitude


class Overview(NamedTuple):
    """The content of a file."""

    kind: str
    looks: list[Look]
    refused: dict[int, str]  # the columns that are not channels, and why
    notes: list[str]  # what was left out or assumed


def overview(path: Path, asked: Sampling) -> Overview:
    """Return the content of a file; raise a ValueError that names the file if it has no channel."""
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
