"""The waves of a measured signal, which does not show their directions, and what may mislead in it."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import scipy
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from coupling.results.reading import Reading
from coupling.results.sensor_trace import (
    interpolated_over_gaps,
    is_inverted,
    measures,
    noise_level,
    resolution,
    smoothed,
)
from coupling.results.wave_finder import FIRST_WAVE, FRONT
from structures.checks import count_of
from structures.structure import Vector
from structures.units import readable

ORDER = 4  # The top of a pulse is fitted by a polynomial of this order.
# A wave in a signal rises by this many standard deviations of the noise that smoothing leaves, and by more than one
# step of the digitiser: from valley to peak, the greatest of a thousand noises reaches 6.5.
CLEAR = 8.0
# A wave is also higher, by this factor, than the force swings below zero before the waves. Beads do not pull, so such a
# swing is hum, whose crests are as high as its troughs are deep.
SWING = 1.5
# A wave is fitted over ± (noise² / samples)^(1/11) of its width at half height, within these limits, and over at least
# two samples on either side, as a cubic spline through a run's samples uses.
NARROWEST, WIDEST = 0.02, 0.7
# The first wave back in a signal may be the incident wave's tail if a later wave is stronger by this factor. In 28
# random chains a later wave was so strong in all 15 in which the tail was read as a wave, and in none of the others.
TAIL = 1.5
# A record begins within a wave if its first sample exceeds this part of the greatest one, and soon falls.
BEGINS = 0.05
# Largest error of the zero without a warning, as a part of the incident wave's force: AR is then off by as much.
OFF = 0.02
CERTAIN = 3.0  # A slope or a level of so many standard errors is real: by chance it is so in one clean record of 370.
FEWEST = 16  # Least number of samples of a lead, or between two waves, for a level.
# A reflected wave has at most the incident wave's energy, and so about its force; this allows for two waves in one.
MOST = 2.0
# The time from the beginning of a wave to its peak, over that from half its force; a Gaussian begins with 0.002.
RISE = 3.0
PULSE = 1.5  # A pulse extends over this many widths on either side of its peak.
# Pulses with fewer samples than this in their width at half height get a warning. In five runs, sampled at 20 rates
# with 40 random phases each, AR was off by up to COARSE/width³: 0.06 with 1.6 samples, 0.013 with 2.7, 0.004 with 4.5.
FEWEST_IN_WIDTH, COARSE = 5.0, 0.4


Peak = tuple[float, float]
"""The height of a wave, N, and its time, s."""


class SignalWaves:
    """The waves in the force of one sensor (N), which may have gaps: the first, and all later ones in any direction.
    Waves are looked for in the signal smoothed over an eighth of a pulse. They must rise above the noise that this
    leaves and above one step of the digitiser. A least-squares polynomial through the original samples then gives
    height and time. smallest: least height, in units of the first wave. earliest: peaks sooner than this after the
    first wave are its tail, s. In a compressed chain the tail swings below zero: a peak that is weaker than a later
    wave by TAIL, and follows a trough of half its height, is left out as well."""

    def __init__(self, time: Vector, force: Vector, smallest: float, earliest: float = 0.0) -> None:
        self.time, self.given, self.smallest = time, force, smallest
        self.peaks: list[Peak] = []
        if not np.isfinite(force).any():
            return
        self.force = interpolated_over_gaps(force)
        self.smooth, self.left, self.width = smoothed(self.force)
        self.noise, smooth = noise_level(self.force), self.smooth
        self.floor = CLEAR * self.left + resolution(self.force)
        # Only waves exceed this force, which is higher than any swing below zero before them.
        self.hum = -SWING * float(smooth[: int((smooth > FRONT * smooth.max()).argmax())].min(initial=0.0))
        least = max(FIRST_WAVE * smooth.max(initial=0.0), self.floor)
        first = self._tops(least)
        if not (least > 0.0 and first.size):
            return
        later = self._tops(max(smallest * self._placed(first)[0][0], self.floor))
        begin, *peaks = self._placed(np.append(first[0], later[later > first[0]]))
        peaks = [peak for peak in peaks if peak[1] >= begin[1] + earliest]
        while len(peaks) > 1 and max(peaks[1:])[0] > TAIL * peaks[0][0]:
            between = self.force[(time > begin[1]) & (time < peaks[0][1])]
            if between.min(initial=0.0) > -0.5 * peaks[0][0]:
                break
            del peaks[0]
        self.peaks = [begin, *peaks]

    def _tops(self, least: float) -> NDArray[np.intp]:
        """Return the samples of the peaks of the smoothed signal that rise by `least`, N, and are not hum."""
        tops: NDArray[np.intp] = scipy.signal.find_peaks(self.smooth, height=max(least, self.hum), prominence=least)[0]
        return tops

    def _placed(self, peaks: NDArray[np.intp]) -> list[Peak]:
        """Return height and time of each wave: the top of a polynomial through the samples around its peak. The
        smoothed signal has its peak at another place if a pulse is asymmetric or has two humps. So polynomials over the
        same reach first slide along the upper half of the pulse, between its two valleys, and the one that is highest
        in its middle is taken."""
        time, force, smooth, step = self.time, self.force, self.smooth, self.time[1] - self.time[0]
        edges = [0, *map(int, peaks), force.size - 1]
        valleys = [edge + int(smooth[edge : following + 1].argmin()) for edge, following in pairwise(edges)]
        placed = list[Peak]()
        for peak, (before, after) in zip(peaks.tolist(), pairwise(valleys), strict=True):
            # Reflected pulses are asymmetric. The fifth-order term, which the fit lacks, shifts its maximum by the
            # fourth power of the reach, and noise scatters it by noise / (√samples · reach^1.5), in units of pulse
            # height and width. Both stay in proportion if the reach grows with the eleventh root of noise² per sample.
            # With the factor 1 the shift was a quarter of the scatter; it was less than all of it in 14 chains of all
            # kinds.
            width = float(scipy.signal.peak_widths(smooth, [peak], rel_height=0.5)[0][0])
            part = ((self.noise / smooth[peak]) ** 2 / width) ** (1.0 / 11.0)
            reach, half = max(2, round(width * float(np.clip(part, NARROWEST, WIDEST)))), max(1, round(0.5 * width))
            first, last = max(before, peak - half), min(after, peak + half) + 1
            start, stop = max(0, first - reach), min(force.size, last + reach)
            if stop - start > 2 * reach:
                moving = scipy.signal.savgol_filter(force[start:stop], 2 * reach + 1, ORDER, mode="nearest")
                peak = first + int(moving[first - start : last - start].argmax())
            near = slice(max(0, peak - reach), peak + reach + 1)
            fit = Polynomial.fit(time[near], force[near], min(ORDER, time[near].size - 1))
            roots, most = fit.deriv().roots(), 0.5 * reach * step
            tops = [t.real for t in roots if abs(t.imag) < step and abs(t - time[peak]) <= most]
            best = max(tops, key=fit, default=time[peak])
            placed.append((float(fit(best)), float(best)))
        return placed

    def ends_rising(self) -> bool:
        """Return whether the record ends within a wave, whose peak is not known."""
        least, smooth = max(self.smallest * self.peaks[0][0], self.floor), self.smooth
        last = int(self._tops(least).max(initial=0))
        valley = last + int(smooth[last:].argmin())
        return bool(least > 0.0 and smooth[valley:].max() >= max(smooth[valley] + least, least, self.hum))

    def check_peaks(self, needed: Sequence[int], sensor: int) -> None:
        """Raise a ValueError if samples of the upper half of a needed peak are missing."""
        unknown = ~np.isfinite(self.given)
        for amplitude, arrival in (self.peaks[place] for place in needed if place < len(self.peaks)):
            at = int(np.clip(np.searchsorted(self.time, arrival), 0, self.time.size - 1))
            low = np.flatnonzero(self.force < 0.5 * amplitude)
            upper = slice(low[low < at].max(initial=0), low[low > at].min(initial=self.time.size))
            if count := int(unknown[upper].sum()):
                raise ValueError(
                    f"run: sensor {sensor}: the peak at {1e6 * arrival:.4g} µs has "
                    f"{count_of(count, 'clipped sample')} (NaN), so its height is unknown; record it with a wider range"
                )

    def doubts(self, sensor: int) -> list[str]:
        """Return sentences on what may mislead in the signal."""
        if not np.isfinite(self.given).any():
            return []
        force, smooth, peaks = self.force, self.smooth, self.peaks
        said, zero, clipped = list[str](), float(np.median(force)), measures(self.time, force).clipped
        if clipped.any():
            said.append(
                f"{count_of(int(clipped.sum()), 'sample is', 'samples are')} clipped at {force[clipped].max():.4g} N, "
                "so the height of the peak is unknown; record it with a wider range"
            )
        if peaks and 0.0 < self.width < FEWEST_IN_WIDTH:
            said.append(
                f"a pulse has only {self.width:.2g} samples in its width at half height, so AR may be off by "
                f"{min(COARSE / self.width**3, 1.0):.1g}; sample {FEWEST_IN_WIDTH / self.width:.2g} times as fast"
            )
        half = 1 + int(PULSE * self.width)
        soon = smooth[: 2 * half] - zero
        high = soon[0] > BEGINS * (smooth.max() - zero)
        begins = high and soon[:half].min() < 0.5 * soon[0] and soon.min() > -0.5 * soon[0]
        if begins and not (peaks and peaks[0][1] < self.time[soon.size - 1]):
            said.append(
                f"the record begins within a wave, at {smooth[0]:.3g} N, and has no lead, so the incident wave is not "
                "in it; begin the record before the first wave"
            )
        elif peaks:
            (top, arrival), *later = peaks
            greatest, at_greatest = max(peaks)
            if greatest > MOST * top:
                said.append(
                    f"the first wave, {top:.3g} N, is much weaker than the one at {readable(at_greatest, 's', 4)}, "
                    f"{greatest:.3g} N; no wave comes back stronger than it went, so look at the signal: perhaps hum "
                    "is read as a wave, or a heavy striker sends several waves"
                )
            if later and max(later)[0] > TAIL * later[0][0]:
                (first, came), (strong, then) = later[0], max(later)
                said.append(
                    f"the first wave after the incident one, AR = {first / top:.3g} after "
                    f"{readable(came - arrival, 's', 4)}, is weaker than a later one, AR = {strong / top:.3g} after "
                    f"{readable(then - arrival, 's', 4)}; in a compressed chain it may be the tail of the incident "
                    "wave, which reflections(..., earliest=...) leaves out"
                )
            said += self._doubts_of_zero(zero)
        return [f"sensor {sensor}: {text}" for text in said]

    def _doubts_of_zero(self, zero: float) -> Iterator[str]:
        """Yield sentences on a wrong zero before the first wave, and between the waves."""
        time, force, smooth, noise = self.time, self.force, self.smooth, self.noise
        (top, arrival), last = self.peaks[0], self.peaks[min(1, len(self.peaks) - 1)][1]
        before = time[(time < arrival) & (smooth - zero < 0.5 * (top - zero))]
        lead = time < arrival - RISE * (arrival - before.max(initial=time[0]))
        if lead.sum() >= FEWEST:
            at = time[lead] - time[lead].mean()
            level, slope = float(np.median(force[lead])), float(at @ force[lead] / (at @ at))
            swing = float((level + slope * at - smooth[lead]).max())
            drift = slope * (last - float(time[lead].mean()))
            if swing > max(OFF * top, CLEAR * self.left):
                yield (
                    f"the force swings by {swing:.3g} N below its zero before the first wave, as hum does, which "
                    "falsifies AR; shield the cable, or remove the hum (clean_signal(mains=its frequency))"
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
        pulse = PULSE * self.width * (time[1] - time[0])
        between = (time > arrival + pulse) & (time < last - pulse)
        if between.sum() >= FEWEST:
            level = float(np.median(force[between]))
            if level < -OFF * top and -level * np.sqrt(between.sum()) > CERTAIN * noise:
                yield (
                    f"the force between the waves is {level:.3g} N, but beads do not pull; AC coupling, drift, an "
                    "offset or a preload falsifies AR; couple the recorder to DC, or use clean_signal"
                )


def doubts_of_sensors(reading: Reading) -> list[str]:
    """Return sentences on sensors that the incident wave of a signal reaches in the wrong order."""
    sensors = sorted(int(sensor) for sensor in reading.data.sensor.values)
    forces = {n: np.asarray(reading.measured(n).values) for n in sensors}
    # A sensor of the wrong polarity shows no time of arrival.
    known = {n: interpolated_over_gaps(force) for n, force in forces.items() if np.isfinite(force).any()}
    upright = [n for n, force in known.items() if not is_inverted(force)]
    waves = {n: SignalWaves(reading.time, forces[n], 0.5).peaks for n in upright}
    arrivals = [(n, peaks[0][1]) for n, peaks in waves.items() if peaks]
    return [
        f"sensors {first} and {second}: the incident wave reaches bead {second} {readable(before - after, 's', 3)} "
        f"before bead {first}, which is nearer to the striker; are their columns or channels swapped?"
        for (first, before), (second, after) in pairwise(arrivals)
        if before > after
    ]
