"""What may mislead in a measured signal: no lead, a zero that is not that of the force, swapped sensors."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from coupling.results.sensor_trace import noise_level, smoothed
from coupling.results.wave_finder import Peak
from structures.structure import Vector
from structures.units import readable

TAIL = 1.5
"""A signal's first wave back may be the incident one's tail where a later one is stronger by this factor: in 28 chains
drawn at random the tail was read as a wave in 15, and by this factor in all of them, in none of the others."""

BEGINS = 0.05
"""A record begins within a wave if its first sample exceeds this part of the greatest one, and soon falls."""

OFF = 0.02
"""Part of the incident wave's force by which the zero may be off without a warning: AR is then off by as much."""

CERTAIN = 5.0
"""Standard errors by which a slope or a level differs from zero."""

FEWEST = 16
"""Samples of a lead, or between two waves, from which a level is read."""

PULSE = 1.5
"""Widths of a pulse on either side of its peak that belong to it."""


def doubts_of_signal(time: Vector, force: Vector, peaks: Sequence[Peak], sensor: int) -> list[str]:
    """Return sentences on the zero of a signal, without gaps; peaks: its waves, the incident one first."""
    smooth, _, width = smoothed(force)
    pulse, noise = PULSE * width * (time[1] - time[0]), noise_level(force)
    falls = smooth[: 1 + int(2.0 * PULSE * width)]
    if smooth[0] > BEGINS * smooth.max() and falls.min() < 0.5 * smooth[0] and falls.argmax() == 0:
        return [
            f"sensor {sensor}: the record begins within a wave, at {smooth[0]:.3g} N, and has no lead, so the incident "
            "wave is not in it; begin the record before the first wave"
        ]
    if not peaks:
        return []
    top, arrival = peaks[0]
    doubts, last = list[str](), peaks[min(1, len(peaks) - 1)][1]
    lead = time < arrival - pulse
    if lead.sum() >= FEWEST:
        at = time[lead] - time[lead].mean()
        slope = float(at @ force[lead] / (at @ at))
        drift = slope * (last - float(time[lead].mean()))
        if abs(drift) > OFF * top and abs(slope) * np.sqrt(at @ at) > CERTAIN * noise:
            doubts.append(
                f"sensor {sensor}: the zero drifts in the lead, by {drift:.3g} N until the wave at "
                f"{readable(last, 's', 4)}, which falsifies AR; remove hum (clean_signal(mains=...)), or couple the "
                "recorder to DC"
            )
    between = (time > arrival + pulse) & (time < last - pulse)
    if between.sum() >= FEWEST:
        level = float(np.median(force[between]))
        if level < -OFF * top and -level * np.sqrt(between.sum()) > CERTAIN * noise:
            doubts.append(
                f"sensor {sensor}: the force between the waves is {level:.3g} N, but beads do not pull; AC coupling, "
                "drift or an offset falsifies AR: couple the recorder to DC, or remove the offset (clean_signal)"
            )
    return doubts


def swapped(arrivals: dict[int, float]) -> list[str]:
    """Return a sentence for sensors that the incident wave reaches in the wrong order; arrivals, s, by bead."""
    return [
        f"sensors {first} and {second}: the incident wave reaches bead {second} {readable(before - after, 's', 3)} "
        f"before bead {first}, which is nearer to the striker; are their columns or channels swapped?"
        for (first, before), (second, after) in pairwise(sorted(arrivals.items()))
        if before > after
    ]


def without_tail(force: Vector, time: Vector, peaks: list[Peak]) -> list[Peak]:
    """Return the waves of a signal without the tail of the incident one, which swings below zero in a compressed chain:
    what is weaker than a later wave by TAIL, and follows a trough of half its height."""
    while len(peaks) > 2 and max(peak[0] for peak in peaks[2:]) > TAIL * peaks[1][0]:
        trough = force[(time > peaks[0][1]) & (time < peaks[1][1])].min(initial=0.0)
        if trough > -0.5 * peaks[1][0]:
            break
        peaks = [peaks[0], *peaks[2:]]
    return peaks
