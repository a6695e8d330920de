"""What may mislead in a measured signal: no lead, clipped tops, hum, a wrong zero, swapped sensors."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from coupling.results.conditioning import clipped_samples
from coupling.results.sensor_trace import noise_level, resolution, smoothed
from coupling.results.wave_finder import CLEAR, Peak
from structures.checks import count_of
from structures.structure import Vector
from structures.units import readable

TAIL = 1.5
"""A signal's first wave back may be the incident one's tail where a later one is stronger by this factor: in 28 chains
drawn at random the tail was read as a wave in 15, and by this factor in all of them, in none of the others."""

BEGINS = 0.05
"""A record begins within a wave if its first sample exceeds this part of the greatest one, and soon falls."""

OFF = 0.02
"""Part of the incident wave's force by which the zero may be off without a warning: AR is then off by as much."""

CERTAIN = 3.0
"""Standard errors by which a slope or a level differs from zero: by chance in one clean record of 370."""

FEWEST = 16
"""Samples of a lead, or between two waves, from which a level is read."""

MOST = 2.0
"""A wave comes back with the incident one's energy at most, and so with about its force; this allows for two in one."""

RISE = 3.0
"""A wave begins this many times as long before its peak as it rises from half its force; a Gaussian is 0.002 there."""

PULSE = 1.5
"""Widths of a pulse on either side of its peak that belong to it."""


def doubts_of_signal(time: Vector, force: Vector, peaks: Sequence[Peak], sensor: int) -> list[str]:
    """Return sentences on what misleads in a signal without gaps; peaks: its waves, the incident one first."""
    smooth, left, width = smoothed(force)
    pulse, noise, zero = PULSE * width * (time[1] - time[0]), noise_level(force), float(np.median(force))
    doubts = list[str]()
    clipped, _ = clipped_samples(time, force, zero, resolution(force), noise)
    if clipped.any():
        doubts.append(
            f"sensor {sensor}: {count_of(int(clipped.sum()), 'sample is', 'samples are')} clipped at "
            f"{force[clipped].max():.4g} N, so the height of the peak is unknown; record it with a wider range"
        )
    half = 1 + int(PULSE * width)
    soon = smooth[: 2 * half] - zero
    begins = (
        soon[0] > BEGINS * (smooth.max() - zero) and soon[:half].min() < 0.5 * soon[0] and soon.min() > -0.5 * soon[0]
    )
    if begins and not (peaks and peaks[0][1] < time[soon.size - 1]):
        doubts.append(
            f"sensor {sensor}: the record begins within a wave, at {smooth[0]:.3g} N, and has no lead, so the incident "
            "wave is not in it; begin the record before the first wave"
        )
        return doubts
    if not peaks:
        return doubts
    top, arrival = peaks[0]
    last = peaks[min(1, len(peaks) - 1)][1]
    greatest, at_greatest = max(peaks)
    if greatest > MOST * top:
        doubts.append(
            f"sensor {sensor}: the first wave, {top:.3g} N, is much weaker than the one at "
            f"{readable(at_greatest, 's', 4)}, {greatest:.3g} N; no wave comes back stronger than it went, so look at "
            "the signal: hum may be read as a wave, or a heavy striker sends several"
        )
    before = time[(time < arrival) & (smooth - zero < 0.5 * (top - zero))]
    lead = time < arrival - RISE * (arrival - before.max(initial=time[0]))
    if lead.sum() >= FEWEST:
        at = time[lead] - time[lead].mean()
        level, slope = float(np.median(force[lead])), float(at @ force[lead] / (at @ at))
        swing = float((level + slope * at - smooth[lead]).max())
        drift = slope * (last - float(time[lead].mean()))
        if swing > max(OFF * top, CLEAR * left):
            doubts.append(
                f"sensor {sensor}: the force swings by {swing:.3g} N below its zero before the first wave, as hum "
                "does, which falsifies AR; shield the cable, or remove the hum (clean_signal(mains=its frequency))"
            )
        elif abs(drift) > OFF * top and abs(slope) * np.sqrt(at @ at) > CERTAIN * noise:
            doubts.append(
                f"sensor {sensor}: the zero drifts in the lead, by {drift:.3g} N until the wave at "
                f"{readable(last, 's', 4)}, which falsifies AR; remove hum (clean_signal(mains=...)), or couple the "
                "recorder to DC"
            )
        elif abs(level) > OFF * top and abs(level) * np.sqrt(lead.sum()) > CERTAIN * noise:
            doubts.append(
                f"sensor {sensor}: the force before the first wave is {level:.3g} N; this offset falsifies AR; remove "
                "it (baseline='lead' where the signal is read, or clean_signal)"
            )
    between = (time > arrival + pulse) & (time < last - pulse)
    if between.sum() >= FEWEST:
        level = float(np.median(force[between]))
        if level < -OFF * top and -level * np.sqrt(between.sum()) > CERTAIN * noise:
            doubts.append(
                f"sensor {sensor}: the force between the waves is {level:.3g} N, but beads do not pull; AC coupling, "
                "drift, an offset or a preload falsifies AR; couple the recorder to DC, or use clean_signal"
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
