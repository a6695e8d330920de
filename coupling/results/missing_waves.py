"""Reasons for a missing reflected wave: the record ends too early, or the sensor is too near to an end of the chain."""

import re
from collections.abc import Sequence
from math import ceil, floor, isfinite, log10, nan

from coupling.results.wave_finder import WAVE_LENGTH, Found
from structures.caution import caution
from structures.checks import count_of
from structures.structure import Vector
from structures.units import readable

PUSH = 3.0  # Estimated length of a push on a structure, in hops of the wave.
UNTIL = re.compile(r"until = [-+.\de]+ \(([^()]+)\)")  # The cure in these sentences; its group is the time in words.


def warn_of_ends(sensor: int, chains: Sequence[int]) -> None:
    """Warn if a bead is fewer than WAVE_LENGTH beads from an end of a chain. chains: the number of beads of each."""
    beads = min(beads for beads in chains if beads >= sensor)
    cure = f"choose one from {1 + WAVE_LENGTH} to {beads - WAVE_LENGTH}"
    if beads <= 2 * WAVE_LENGTH:
        cure = f"take a chain of {2 * WAVE_LENGTH + 1} beads or more"
    for distance, end in ((sensor - 1, "struck end"), (beads - sensor, "structure")):
        if distance < WAVE_LENGTH:
            caution(
                f"sensor = {sensor}: bead {sensor} is {_from_end(distance)} the {end}; within {WAVE_LENGTH} beads "
                f"of it, the length of a wave, incident and reflected waves merge, which falsifies AR and TOF; {cure}"
            )


def why_missing(time: Vector, found: Found, smallest: float, sensor: int) -> tuple[str, float]:
    """Return why a run has no reflected wave, or no further one, empty if unknown; and the `until` (s) of a record that
    would hold it, NaN if a longer record does not help."""
    ends, slowest, where = float(time[-1]), smallest ** (-1.0 / 6.0), f"bead {sensor}"
    hop, leaves = found.travel / found.hops, found.leaves
    if not isfinite(leaves) and found.samples:
        there = float(time[found.samples[0]]) + 2.0 * found.travel
        if there < ends:
            return f"there is no structure, or nothing pushes it within the record, {readable(ends, 's', 4)}", nan
        leaves = there + PUSH * hop
    if found.cut:
        needed = ends + WAVE_LENGTH * slowest * hop
        return short_record(ends, where, needed, within=True), needed
    if len(found.samples) > 1:
        return "", nan
    needed = leaves + slowest * found.travel + 3.0 * hop
    if needed > ends:
        return short_record(ends, where, needed), needed
    if found.hops <= WAVE_LENGTH:
        return f"{where} is {_from_end(found.hops - 1)} the structure, where incident and reflected waves merge", nan
    return (
        f"no wave above {100.0 * smallest:.3g} % of the incident one (smallest = {smallest:g}) is back by the end of "
        f"the record, {readable(ends, 's', 4)}: the structure absorbed it, or it is weaker"
    ), nan


def short_record(ends: float, where: str, needed: float = nan, within: bool = False) -> str:
    """Return a sentence on a record that ends before a wave can be back, or within one. needed: the `until` (s) of a
    record that would hold it, NaN for a signal."""
    early = f"within a wave that comes back to {where}" if within else f"before a reflected wave can be back at {where}"
    cure = "record longer"
    if isfinite(needed):
        value = rounded_up(needed)
        cure = f"until = {value:g} ({readable(value, 's', 4)}) would hold it"
    return f"ends at {readable(ends, 's', 4)}, {early}; {cure}"


def rounded_up(value: float) -> float:
    """Return a number rounded up to two digits."""
    step = 10.0 ** (floor(log10(value)) - 1)
    return float(f"{ceil(value / step * (1.0 - 1e-9)) * step:.2g}")


def _from_end(distance: int) -> str:
    return f"{count_of(distance, 'bead')} from" if distance else "at"
