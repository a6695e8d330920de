"""Reasons for a missing reflected wave: the record ends too early, or the sensor is too near to an end of the chain."""

import re
from collections.abc import Sequence
from math import ceil, floor, isfinite, log10, nan

from coupling.results.wave_finder import WAVE_LENGTH, Found
from structures.caution import caution
from structures.checks import count_of
from structures.structure import Vector
from structures.units import readable

RECORD = "the record "  # With these words a reason begins that a longer record removes.
PUSH = 3.0  # Hops that a push on a structure lasts, until it is known.
TAIL = 0.01  # A push on the structure ends where it falls below this part of its greatest force.
UNTIL = re.compile(r"until = [-+.\de]+ \(([^()]+)\)")  # The cure in these sentences; its group is the time in words.


def warn_of_ends(sensor: int, chains: Sequence[int]) -> None:
    """Warn where a bead is fewer than WAVE_LENGTH beads from an end of a chain; chains: the number of beads of each."""
    beads = min(beads for beads in chains if beads >= sensor)
    cure = f"choose one from {1 + WAVE_LENGTH} to {beads - WAVE_LENGTH}"
    if beads <= 2 * WAVE_LENGTH:
        cure = f"take a chain of {2 * WAVE_LENGTH + 1} beads or more"
    for distance, end in ((sensor - 1, "struck end"), (beads - sensor, "structure")):
        if distance < WAVE_LENGTH:
            caution(
                f"sensor = {sensor}: is {_from_end(distance)} the {end}; within {WAVE_LENGTH} beads of it, the length "
                f"of a wave, incident and reflected waves merge, which falsifies AR and TOF; {cure}"
            )


def why_missing(time: Vector, found: Found, smallest: float, sensor: int, hops: int) -> tuple[str, float]:
    """Return why a run has no wave that came back, or no further one, and the `until` (s) that would hold it; empty and
    NaN where neither is known. hops: contacts from the bead to the structure."""
    ends, slowest = float(time[-1]), smallest ** (-1.0 / 6.0)
    hop, leaves, where = found.travel / hops, found.leaves, f"bead {sensor}"
    if not isfinite(leaves) and found.samples:
        there = float(time[found.samples[0]]) + 2.0 * found.travel
        if there < ends:
            return f"nothing pushes a structure by the end of the record, {readable(ends, 's', 4)}", nan
        leaves = there + PUSH * hop
    if found.cut:
        needed = ends + WAVE_LENGTH * slowest * hop
        return cut_record(ends, where, needed), needed
    if len(found.samples) > 1:
        return "", nan
    needed = leaves + slowest * found.travel + 3.0 * hop
    if needed > ends:
        return short_record(ends, needed, where), needed
    if hops <= WAVE_LENGTH:
        return f"{where} is {_from_end(hops - 1)} the structure, where incident and reflected waves merge", nan
    return (
        f"none above {100.0 * smallest:.3g} % of the incident one (smallest = {smallest:g}) is back by the end of the "
        f"record, {readable(ends, 's', 4)}: the structure took it, or it is weaker"
    ), nan


def _from_end(distance: int) -> str:
    return f"{count_of(distance, 'bead')} from" if distance else "the bead at"


def end_of_push(time: Vector, force: Vector, least: float, otherwise: float) -> float:
    """Return when a contact's first push ends, s: the record's end where it lasts, `otherwise` where none is above
    `least`."""
    top = float(force.max(initial=0.0))
    if top < least or top <= 0.0:
        return otherwise
    begins = int((force > TAIL * top).argmax())
    ends = begins + int((force[begins:] <= TAIL * top).argmax())
    return float(time[ends]) if ends > begins else float(time[-1])


def rounded_up(value: float) -> float:
    """Return a number to give instead, rounded up to two digits."""
    step = 10.0 ** (floor(log10(value)) - 1)
    return float(f"{ceil(value / step * (1.0 - 1e-9)) * step:.2g}")


def short_record(ends: float, needed: float, where: str) -> str:
    """Return the sentence for a record that ends at `ends` instead of `needed`, before a wave can be back, s."""
    return f"{RECORD}ends at {readable(ends, 's', 4)}, before a reflected wave can be back at {where}; {_cure(needed)}"


def cut_record(ends: float, where: str, needed: float = nan) -> str:
    """Return the sentence for a record that ends within a wave; needed: NaN for a signal."""
    within = f"within a wave that comes back to {where}"
    return (
        f"{RECORD}ends at {readable(ends, 's', 4)}, {within}; {_cure(needed) if isfinite(needed) else 'record longer'}"
    )


def _cure(needed: float) -> str:
    value = rounded_up(needed)
    return f"until = {value:g} ({readable(value, 's', 4)}) would hold it"
