"""Reasons for a missing reflected wave: the record ends too early, or the sensor is too near to an end of the chain."""

import re
from collections.abc import Sequence
from itertools import pairwise
from math import ceil, floor, isfinite, log10, nan

import numpy as np

from coupling.results.peaks import hops, rises
from coupling.results.wave_kernels import FIRST_WAVE
from structures.caution import caution
from structures.checks import count_of
from structures.structure import Vector
from structures.units import readable

RECORD = "the record "
"""With these words a reason begins that a longer record removes."""

WAVE_LENGTH = 5
"""Beads that a solitary wave is long (Nesterenko, J. Appl. Mech. Tech. Phys. 24 (1983) 733)."""

TAIL = 0.01
"""A push on the structure ends where it falls below this part of its greatest force."""

NEAR = 3
"""Contacts of a bead and beyond it, where a wave that comes is looked for: one farther away may never arrive."""

PUSH = 3.0
"""Hops that a push on a half-space lasts; until it is known, that on any structure."""


def warn_of_ends(sensor: int, chains: Sequence[int]) -> None:
    """Warn where a bead is fewer than WAVE_LENGTH beads from an end of a chain; chains: the number of beads of each."""
    beads = min(beads for beads in chains if beads >= sensor)
    for distance, end in ((sensor - 1, "struck end"), (beads - sensor, "structure")):
        if distance < WAVE_LENGTH:
            cure = f"choose one from {1 + WAVE_LENGTH} to {beads - WAVE_LENGTH}"
            if beads <= 2 * WAVE_LENGTH:
                cure = f"take a chain of {2 * WAVE_LENGTH + 1} beads or more"
            caution(
                f"sensor = {sensor}: is {count_of(distance, 'bead')} from the {end}; nearer than {WAVE_LENGTH}, "
                f"the length of a wave, incident and reflected waves merge, which falsifies AR and TOF; {cure}"
            )


def latest_return(time: Vector, force: Vector, smallest: float) -> float:
    """Return the time, s, by which a wave of `smallest` times the incident amplitude is back at the first contact.

    force, contacts × time: dynamic, from a sensor's contacts to the structure's. The reflected wave leaves when the
    push on the structure ends, or after the record where it lasts to its end, and is slower than the incident one:
    its speed is proportional to F^(1/6) (Nesterenko, as above). NaN without an incident wave.
    """
    top, taken = float(force[0].max(initial=0.0)), hops(time, force)
    if top <= 0.0 or not np.isfinite(taken).all():
        return nan
    travel, hop = float(taken.sum()), float(np.median(taken))
    reaches = float(time[int((force[0] >= 0.5 * top).argmax())]) + travel + hop
    leaves = end_of_push(time, force[-1], FIRST_WAVE * top, reaches + PUSH * hop)
    return leaves + float(smallest ** (-1.0 / 6.0)) * travel + 3.0 * hop


def end_of_push(time: Vector, force: Vector, least: float, otherwise: float) -> float:
    """Return when a contact's first push ends, s: the record's end where it lasts, `otherwise` where none is above
    `least`."""
    top = float(force.max(initial=0.0))
    if top < least or top <= 0.0:
        return otherwise
    begins = int((force > TAIL * top).argmax())
    ends = begins + int((force[begins:] <= TAIL * top).argmax())
    return float(time[ends]) if ends > begins else float(time[-1])


def cut_off(time: Vector, force: Vector, smallest: float) -> float:
    """Return time, s, that would hold a wave which the record's end cuts off on its way back over a bead; NaN for none.

    force, contacts × time: dynamic, the bead's two contacts first. Such a wave has risen at a contact, and not yet, or
    later, at the one before, which the last wave there does not explain. It takes the time of a weak wave over the
    length of a wave.
    """
    taken = hops(time, force)
    if not np.isfinite(taken).all():
        return nan
    pace = float(np.median(taken)) * float(smallest ** (-1.0 / 6.0))
    rises_of_sensors = [rises(time, trace, smallest * float(trace.max(initial=0.0))) for trace in force[:NEAR]]
    for away, ((near, near_open), (far, far_open)) in enumerate(pairwise(rises_of_sensors)):
        lasts = (away + WAVE_LENGTH) * pace
        if not far.size or time[-1] - far[-1] >= lasts:
            continue
        nearest = int(abs(near - far[-1]).argmin()) if near.size else -1
        together = nearest >= 0 and int(abs(far - near[nearest]).argmin()) == far.size - 1
        if together:
            still = (near_open and nearest == near.size - 1) or far_open
            comes = still and near[nearest] > far[-1]
        else:
            comes = not near.size or near[-1] <= far[-1]
        if comes:
            return float(far[-1]) + lasts
    return nan


def rounded_up(value: float) -> float:
    """Return a number to give instead, rounded up to two digits."""
    step = 10.0 ** (floor(log10(value)) - 1)
    return float(f"{ceil(value / step * (1.0 - 1e-9)) * step:.2g}")


UNTIL = re.compile(r"until = [-+.\de]+ \(([^()]+)\)")
"""What `until_of` returns; its group is the time in words."""


def until_of(seconds: float) -> str:
    """Return what to give for `until`, s, rounded up to two digits, and the same in words."""
    value = rounded_up(seconds)
    return f"until = {value:g} ({readable(value, 's', 4)})"


def short_record(ends: float, needed: float, where: str) -> str:
    """Return a sentence; ends and needed: the record's end, and the one that would hold the wave, s."""
    return (
        f"{RECORD}ends at {readable(ends, 's', 4)}, before a reflected wave can be back at {where}; {until_of(needed)} "
        "would hold it"
    )


def cut_record(ends: float, needed: float, where: str) -> str:
    """Return the sentence for a record that ends within a wave; needed: NaN for a signal."""
    cure = f"{until_of(needed)} would hold it" if isfinite(needed) else "record longer"
    return f"{RECORD}ends at {readable(ends, 's', 4)}, within a wave that comes back to {where}; {cure}"


def why_missing(
    time: Vector, force: Vector, smallest: float, sensor: int, chains: Sequence[int], back: bool
) -> tuple[str, float]:
    """Return why a run has no wave that came back, or no further one, and the `until` (s) that would hold it; empty and
    NaN where neither is known.

    force: contacts × time, dynamic, the sensor's two contacts first. chains: the number of beads of each. back: whether
    a wave came back.
    """
    complete = len(force) - 2 + sensor in chains
    reason, needed = ("", nan) if back else _why_none(time, force, smallest, sensor, complete)
    if not needed > time[-1] and (cut := cut_off(time, force, smallest)) > time[-1]:
        return cut_record(float(time[-1]), cut, f"bead {sensor}"), cut
    return reason, needed


def _why_none(time: Vector, force: Vector, smallest: float, sensor: int, complete: bool) -> tuple[str, float]:
    """Return why no wave came back, and the `until` (s) that would hold it; complete: whether the contacts reach to the
    structure."""
    needed = latest_return(time, force, smallest) if complete else nan
    if needed > time[-1]:
        return short_record(float(time[-1]), needed, f"bead {sensor}"), needed
    distance = len(force) - 2 if complete else WAVE_LENGTH
    if distance < WAVE_LENGTH:
        near = count_of(distance, "bead")
        return f"bead {sensor} is {near} from the structure, where incident and reflected waves merge", nan
    return (
        f"none above {100.0 * smallest:.3g} % of the incident one (smallest = {smallest:g}) is back by the end of the "
        f"record, {readable(time[-1], 's', 4)}: the structure took it, or it is weaker"
    ), nan
