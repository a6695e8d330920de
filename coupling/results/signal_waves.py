"""The waves of a measured signal, which shows no directions, and what may mislead in it."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np
import scipy
from numpy.polynomial import Polynomial

from coupling.results.sensor_trace import interpolated_over_gaps, measures, noise_level, resolution, smoothed
from coupling.results.wave_finder import FIRST_WAVE, FRONT, Peak
from structures.checks import count_of
from structures.structure import Vector
from structures.units import readable

ORDER = 4  # The top of a pulse is fitted by a polynomial of this order.
# A wave in a signal rises by this many standard deviations of the noise that smoothing leaves, and by more than one
# step of the digitiser: from valley to peak, the greatest of a thousand noises reaches 6.5.
CLEAR = 8.0
# And it is higher by this factor than what the force swings below zero before the waves: beads do not pull, so that
# is hum, whose crests are as high as its troughs are deep.
SWING = 1.5
# It is fitted over ± REACH (noise² / samples)^(1/12) of its width at half height, within these limits. At the
# least two samples on either side: a cubic spline through a run's samples reads no more.
REACH, NARROWEST, WIDEST = 2.0, 0.02, 0.7
# A signal's first wave back may be the incident one's tail where a later one is stronger by this factor: in 28 chains
# drawn at random the tail was read as a wave in 15, and by this factor in all of them, in none of the others.
TAIL = 1.5
# A record begins within a wave if its first sample exceeds this part of the greatest one, and soon falls.
BEGINS = 0.05
# Part of the incident wave's force by which the zero may be off without a warning: AR is then off by as much.
OFF = 0.02
CERTAIN = 3.0  # Standard errors by which a slope or a level differs from zero: by chance in one clean record of 370.
FEWEST = 16  # Samples of a lead, or between two waves, from which a level is read.
# A wave comes back with the incident one's energy at most, and so with about its force; this allows for two in one.
MOST = 2.0
# A wave begins this many times as long before its peak as it rises from half its force; a Gaussian is 0.002 there.
RISE = 3.0
PULSE = 1.5  # Widths of a pulse on either side of its peak that belong to it.


def waves_back(time: Vector, force: Vector, smallest: float, earliest: float = 0.0) -> list[Peak]:
    """Return the first wave of a signal, which may have gaps, and those that may have come back, without its tail.

    earliest: what comes sooner after the first wave is its tail, s. In a compressed chain the tail swings below zero:
    what is weaker than a later wave by TAIL, and follows a trough of half its height, is left out as well.
    """
    if not np.isfinite(force).any():
        return []
    filled = interpolated_over_gaps(force)
    peaks = waves_of_signal(time, filled, smallest)
    peaks = [*peaks[:1], *(peak for peak in peaks[1:] if peak[1] >= peaks[0][1] + earliest)]
    while len(peaks) > 2 and max(peak[0] for peak in peaks[2:]) > TAIL * peaks[1][0]:
        trough = filled[(time > peaks[0][1]) & (time < peaks[1][1])].min(initial=0.0)
        if trough > -0.5 * peaks[1][0]:
            break
        peaks = [peaks[0], *peaks[2:]]
    return peaks


def check_peaks(time: Vector, force: Vector, peaks: Sequence[Peak], needed: Sequence[int], sensor: int) -> None:
    """Raise a ValueError where samples of the upper half of a needed peak are missing."""
    unknown = ~np.isfinite(force)
    if not unknown.any() or not peaks:
        return
    filled = interpolated_over_gaps(force)
    for amplitude, arrival in (peaks[place] for place in needed if place < len(peaks)):
        at = int(np.clip(np.searchsorted(time, arrival), 0, time.size - 1))
        low = np.flatnonzero(filled < 0.5 * amplitude)
        upper = slice(low[low < at].max(initial=0), low[low > at].min(initial=time.size))
        if count := int(unknown[upper].sum()):
            raise ValueError(
                f"run: sensor {sensor}: the peak at {1e6 * arrival:.4g} µs has {count_of(count, 'clipped sample')} "
                "(NaN), so its height is unknown; record it with a wider range"
            )


def waves_of_signal(time: Vector, force: Vector, smallest: float) -> list[Peak]:
    """Return the first wave of a signal, and all later ones, whichever way they go.

    Waves are looked for in the signal smoothed over an eighth of a pulse, must rise clear of the noise that this leaves
    and of one step of the digitiser, and are then placed by a least-squares polynomial through the samples as they are.
    """
    smooth, noise, _ = smoothed(force)
    floor, hum = CLEAR * noise + resolution(force), _top_of_hum(smooth)
    least = max(FIRST_WAVE * smooth.max(initial=0.0), floor)
    first = scipy.signal.find_peaks(smooth, height=max(least, hum), prominence=least)[0]
    if not (least > 0.0 and first.size):
        return []
    level = noise_level(force)
    least = max(smallest * _fitted(time, force, smooth, level, *_valleys(smooth, first)[0])[0], floor)
    later = scipy.signal.find_peaks(smooth, height=max(least, hum), prominence=least)[0]
    peaks = np.append(first[0], later[later > first[0]])
    return [_fitted(time, force, smooth, level, *place) for place in _valleys(smooth, peaks)]


def _top_of_hum(smooth: Vector) -> float:
    """Return the force that only waves exceed, from how far the force swings below zero before them."""
    return -SWING * float(smooth[: int((smooth > FRONT * smooth.max()).argmax())].min(initial=0.0))


def _valleys(force: Vector, peaks: Vector) -> list[tuple[int, tuple[int, int]]]:
    """Return each peak with the lowest samples before and after it, between it and its neighbours or the ends."""
    edges = [0, *map(int, peaks), force.size - 1]
    lowest = [edge + int(force[edge : following + 1].argmin()) for edge, following in pairwise(edges)]
    return [(int(peak), valleys) for peak, valleys in zip(peaks, pairwise(lowest), strict=True)]


def _fitted(time: Vector, force: Vector, smooth: Vector, noise: float, peak: int, between: tuple[int, int]) -> Peak:
    """Return amplitude and time of the top of a polynomial through the samples around a peak of the smoothed signal.

    The smoothed signal has its peak elsewhere where a pulse is lopsided or has two humps. So polynomials over the same
    reach first slide along the upper half of the pulse, between its two valleys; the one that is highest in its middle
    is taken. noise: in the signal, N.
    """
    # The error of a fourth-order fit grows with the sixth power of the reach, the variance of its noise falls with the
    # reach: their sum is least where the reach grows with the twelfth root of noise² per sample (both in units of the
    # pulse's own height and width). So clean signals are fitted narrowly, and noisy ones widely.
    width, step = float(scipy.signal.peak_widths(smooth, [peak], rel_height=0.5)[0][0]), time[1] - time[0]
    part = REACH * ((noise / smooth[peak]) ** 2 / width) ** (1.0 / 12.0)
    reach, half = max(2, round(width * float(np.clip(part, NARROWEST, WIDEST)))), max(1, round(0.5 * width))
    first, last = max(between[0], peak - half), min(between[1], peak + half) + 1
    start, stop = max(0, first - reach), min(force.size, last + reach)
    if stop - start > 2 * reach:
        moving = scipy.signal.savgol_filter(force[start:stop], 2 * reach + 1, ORDER)
        peak = first + int(moving[first - start : last - start].argmax())
    near = slice(max(0, peak - reach), peak + reach + 1)
    fit = Polynomial.fit(time[near], force[near], min(ORDER, time[near].size - 1))
    tops = [t.real for t in fit.deriv().roots() if abs(t.imag) < step and abs(t - time[peak]) <= 0.5 * reach * step]
    best = max(tops, key=fit, default=time[peak])
    return float(fit(best)), float(best)


def ends_rising(force: Vector, incident: float, smallest: float) -> bool:
    """Return whether a signal ends within a wave, whose peak is not known: as `waves_of_signal` reads it."""
    smooth, noise, _ = smoothed(force)
    least, hum = max(smallest * incident, CLEAR * noise + resolution(force)), _top_of_hum(smooth)
    peaks = scipy.signal.find_peaks(smooth, height=max(least, hum), prominence=least)[0]
    last = int(peaks[-1]) if peaks.size else 0
    valley = last + int(smooth[last:].argmin())
    return bool(least > 0.0 and smooth[valley:].max() >= max(smooth[valley] + least, least, hum))


def doubts_of_signal(
    time: Vector, force: Vector, peaks: Sequence[Peak], sensor: int, arrivals: Mapping[int, float]
) -> list[str]:
    """Return sentences on what misleads in a signal without gaps.

    peaks: its waves, the incident one first. arrivals: of the incident wave at all sensors, s.
    """
    trace = smoothed(force)
    smooth, _, width = trace
    said, zero, clipped = list[str](), float(np.median(force)), measures(time, force).clipped
    if clipped.any():
        said.append(
            f"{count_of(int(clipped.sum()), 'sample is', 'samples are')} clipped at {force[clipped].max():.4g} N, so "
            "the height of the peak is unknown; record it with a wider range"
        )
    half = 1 + int(PULSE * width)
    soon = smooth[: 2 * half] - zero
    high = soon[0] > BEGINS * (smooth.max() - zero)
    begins = high and soon[:half].min() < 0.5 * soon[0] and soon.min() > -0.5 * soon[0]
    if begins and not (peaks and peaks[0][1] < time[soon.size - 1]):
        said.append(
            f"the record begins within a wave, at {smooth[0]:.3g} N, and has no lead, so the incident wave is not in "
            "it; begin the record before the first wave"
        )
    elif peaks:
        said += [*_doubts_of_waves(peaks), *_doubts_of_zero(time, force, peaks, trace)]
    swapped = [
        f"sensors {first} and {second}: the incident wave reaches bead {second} {readable(before - after, 's', 3)} "
        f"before bead {first}, which is nearer to the striker; are their columns or channels swapped?"
        for (first, before), (second, after) in pairwise(sorted(arrivals.items()))
        if before > after
    ]
    return [*(f"sensor {sensor}: {text}" for text in said), *swapped]


def _doubts_of_waves(peaks: Sequence[Peak]) -> Iterator[str]:
    """Yield what misleads in the heights of the waves of a signal."""
    (top, arrival), later = peaks[0], peaks[1:]
    greatest, at_greatest = max(peaks)
    if greatest > MOST * top:
        yield (
            f"the first wave, {top:.3g} N, is much weaker than the one at {readable(at_greatest, 's', 4)}, "
            f"{greatest:.3g} N; no wave comes back stronger than it went, so look at the signal: hum may be read as a "
            "wave, or a heavy striker sends several"
        )
    if later and max(later)[0] > TAIL * later[0][0]:
        (first, came), (strong, then) = later[0], max(later)
        yield (
            f"the first wave after the incident one, AR = {first / top:.3g} after {readable(came - arrival, 's', 4)}, "
            f"is weaker than a later one, AR = {strong / top:.3g} after {readable(then - arrival, 's', 4)}; in a "
            "compressed chain it may be the tail of the incident wave, which reflections(..., earliest=...) leaves out"
        )


def _doubts_of_zero(
    time: Vector, force: Vector, peaks: Sequence[Peak], trace: tuple[Vector, float, float]
) -> Iterator[str]:
    """Yield what misleads in the zero before the first wave, and between the waves; trace: of `smoothed`."""
    (smooth, left, width), (top, arrival), last = trace, peaks[0], peaks[min(1, len(peaks) - 1)][1]
    zero, noise = float(np.median(force)), noise_level(force)
    before = time[(time < arrival) & (smooth - zero < 0.5 * (top - zero))]
    lead = time < arrival - RISE * (arrival - before.max(initial=time[0]))
    if lead.sum() >= FEWEST:
        at = time[lead] - time[lead].mean()
        level, slope = float(np.median(force[lead])), float(at @ force[lead] / (at @ at))
        swing = float((level + slope * at - smooth[lead]).max())
        drift = slope * (last - float(time[lead].mean()))
        if swing > max(OFF * top, CLEAR * left):
            yield (
                f"the force swings by {swing:.3g} N below its zero before the first wave, as hum does, which falsifies "
                "AR; shield the cable, or remove the hum (clean_signal(mains=its frequency))"
            )
        elif abs(drift) > OFF * top and abs(slope) * np.sqrt(at @ at) > CERTAIN * noise:
            yield (
                f"the zero drifts in the lead, by {drift:.3g} N until the wave at {readable(last, 's', 4)}, which "
                "falsifies AR; remove hum (clean_signal(mains=...)), or couple the recorder to DC"
            )
        elif abs(level) > OFF * top and abs(level) * np.sqrt(lead.sum()) > CERTAIN * noise:
            yield (
                f"the force before the first wave is {level:.3g} N; this offset falsifies AR; remove it "
                "(baseline='lead' where the signal is read, or clean_signal)"
            )
    pulse = PULSE * width * (time[1] - time[0])
    between = (time > arrival + pulse) & (time < last - pulse)
    if between.sum() >= FEWEST:
        level = float(np.median(force[between]))
        if level < -OFF * top and -level * np.sqrt(between.sum()) > CERTAIN * noise:
            yield (
                f"the force between the waves is {level:.3g} N, but beads do not pull; AC coupling, drift, an offset "
                "or a preload falsifies AR; couple the recorder to DC, or use clean_signal"
            )
