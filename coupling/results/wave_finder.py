"""The waves that pass a bead in a run. `docs/theory.md` says what a wave is.

In a run forces and velocities are known, and so is the direction of a wave: F v is the power that flows towards the
structure, and it is negative if a wave comes back. The power is averaged over the time that a wave takes from bead to
bead, because light beads rattle between heavy ones while a single wave passes.

A wave may also be turned back inside the chain. This shows in its time, because the time of a wave through a chain of
Hertzian contacts is proportional to F^(−1/6). A wave of AR a that left the structure when the incident wave arrived
there takes a^(−1/6) times as long as the incident wave. A wave that is back earlier was turned back inside the chain.

References
----------
Nesterenko, Dynamics of Heterogeneous Materials (Springer 2001), section 1.3: the speed of a solitary wave.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from coupling.results.reading import Reading
from structures.structure import Vector

# The incident wave rises by at least this part of the greatest force: waves of a heavy striker add up later.
FIRST_WAVE = 0.05
FRONT = 0.3  # A wave arrives when it exceeds this part of its greatest value.
VALLEY = 0.3  # Two pulses are one if the power between them stays above this part of the weaker one's.
TAIL = 0.02  # A pulse ends when its power falls below this part of its greatest power.
# A wave from the structure takes at least this part of the time that F^(−1/6) predicts. In 200 random chains waves were
# followed contact by contact: 99 % take 0.92 and more; those turned back inside the chain take 0.8 and less.
EARLIEST = 0.85
# The same if contacts yield: the dents that the incident wave leaves are stiffer, and the reflected wave runs faster
# over them. In chains of one and of two metals on plates and half-spaces it takes 0.70 and more.
EARLIEST_OVER_DENTS = 0.65
WAVE_LENGTH = 5  # Length of a solitary wave in beads (Nesterenko, J. Appl. Mech. Tech. Phys. 24 (1983) 733).
# The time that a primary wave lasts, in units of a single wave of its strength. Single waves from half-spaces, plates
# without edges and long rods last 0.97 to 0.99 (benchmarks/waves.py); where two waves overlap they last longer.
SHORT, LONG = 0.5, 1.25
# Part by which a pulse may differ from a limit before a small change of a parameter makes it another wave.
DOUBTFUL = 0.05

ANOTHER = "; a small change may give another AR and TOF"

NEAR = 4  # Samples on either side of a peak for the cubic spline that places it.

Window = tuple[int, int]


class Found(NamedTuple):
    """The waves over a bead in one run."""

    force: Vector  # of the bead, above the preload, N
    hops: int  # contacts from the bead to the structure
    travel: float  # time of the incident wave over the hops, s
    leaves: float = np.nan  # time when the push on the structure ends, s; NaN if nothing pushes it
    samples: Sequence[int] = ()  # of the peaks of the waves, the incident wave first
    notes: Sequence[str] = ()  # for each wave, why its AR and TOF may mislead; empty if they do not
    cut: bool = False  # whether the record ends within a wave that comes back


@dataclass
class Passing:
    """A wave over the bead: the samples of its peak, of the last push that belongs to it, and of its begin and end."""

    sample: int
    last: int
    begin: int
    end: int
    note: str = ""  # why its AR and TOF may mislead


def find_waves(
    reading: Reading, sensor: int, smallest: float, most: int, name: str = "sensor"
) -> tuple[Vector, list[Found], xr.DataArray | None]:
    """Return the first `most` waves over a bead of a run, a sweep or a batch: runs × waves × (amplitude, N, and
    arrival, s), NaN for missing waves; the waves found in each run; and a variable over the axes, None for one run.
    smallest: least height, in units of the incident amplitude. name: the argument that gave the sensor."""
    number = reading.checked_sensor(sensor, name)
    reading.check_holds(("contact_force", "velocity"))
    data, time, kept = reading.data, reading.time, reading.data.bead.values.tolist()
    if number not in kept:
        raise ValueError(f"{name} = {sensor!r}: must be a bead that was kept: {', '.join(map(str, kept))}")
    axes = [str(axis) for axis in data.contact_force.dims if axis not in ("time", "contact")]
    template = data.contact_force.isel(time=0, contact=0).reset_coords(drop=True).transpose(*axes) if axes else None

    def of_runs(variable: str, *own: str) -> Vector:
        """Return a variable as runs × its own dimensions; a variable that the runs share is repeated."""
        sizes = {axis: data.sizes[axis] for axis in (*axes, *own)}
        values = data[variable].variable.set_dims(sizes).values  # type: ignore[no-untyped-call]
        return np.asarray(values.reshape(-1, *(data.sizes[axis] for axis in own)))

    forces, statics = of_runs("contact_force", "time", "contact"), of_runs("static_force", "contact")
    velocities = of_runs("velocity", "time", "bead")[:, :, kept.index(number)]
    place = int(np.flatnonzero(data.contact.values == number)[0])
    earliest = EARLIEST_OVER_DENTS if data.attrs.get("yielding", 0) else EARLIEST
    found = []
    for force, static, velocity in zip(forces, statics, velocities, strict=True):
        # Shorter chains are padded with NaN; a failed run is NaN everywhere.
        last = int(np.flatnonzero(np.isfinite(static)).max(initial=0)) or static.size - 1
        above, below, wall = (force[:, k] - static[k] for k in (place, place + 1, last))
        hops, preload = int(data.contact.values[last]) - number, 0.5 * (static[place] + static[place + 1])
        flow = Flow(time, 0.5 * (above + below), wall, velocity, number, hops, preload, earliest)
        found.append(flow.waves(smallest))

    peaks = np.full((len(found), most, 2), np.nan)
    if places := [(run, k) for run, one in enumerate(found) for k in range(min(most, len(one.samples)))]:
        runs, waves = np.array(places).T
        samples = np.array([found[run].samples[k] for run, k in places])
        peaks[runs, waves] = placed(time, [found[run].force for run in runs], samples)
    return peaks, found, template


class Flow:
    """The flow of power over a bead in one run: force above the preload, N, and power, W, with their peaks' samples.
    wall: force on the structure above its preload, N. sensor: the number of the bead. hops: contacts from the bead to
    the structure. towards, back: the averaged power towards the structure and back. first, there: samples at which the
    wave arrives at the bead and at the structure. travel: the time between these, s. width: the samples of one hop.
    leaves: when the push on the structure ends, s. preload: of the bead, N. earliest: no wave from the structure takes
    less than this part of the time by F^(−1/6)."""

    def __init__(
        self, time: Vector, force: Vector, wall: Vector, velocity: Vector, sensor: int, hops: int, preload: float,
        earliest: float,
    ) -> None:  # fmt: skip
        self.time, self.force, self.hops, self.preload, self.earliest = time, force, hops, preload, earliest
        self.top, push = float(force.max(initial=0.0)), wall.max(initial=0.0)
        self.pushed = bool(push > FIRST_WAVE**2 * self.top)
        self.there = int((wall > FRONT * push).argmax()) if self.pushed else time.size - 1
        self.first = int((force > FRONT * force[: self.there + 1].max()).argmax())
        # If the wave has not reached the structure yet, its speed so far gives the time.
        self.travel = float(time[self.there] - time[self.first] if self.pushed else time[self.first] * hops / sensor)
        self.width = max(1, int(np.rint(self.travel / max(hops, 1) / (time[1] - time[0]))))
        self.power = force * velocity
        self.towards, self.back = np.maximum(self.power, 0.0), np.maximum(-self.power, 0.0)
        if self.width > 1:  # beyond the ends of the record the power counts as zero
            self.towards, self.back = (
                scipy.ndimage.uniform_filter1d(power, self.width, mode="constant")
                for power in (self.towards, self.back)
            )
        ended = (wall <= FIRST_WAVE**2 * push) & (np.arange(time.size) >= self.there)
        self.leaves = float(time[ended.argmax() if ended.any() else -1])
        self.peaks, self.peaks_towards, self.peaks_back = map(tops, (force, self.towards, self.back))

    def waves(self, smallest: float) -> Found:
        """Return the incident wave, and the waves that come back from the structure."""
        force, towards, back, there, width = self.force, self.towards, self.back, self.there, self.width
        found = Found(force, self.hops, self.travel)
        if not self.top > 0.0:
            return found
        greatest = float(towards[: there + 1].max())
        begin, end = next(pulses(towards, self.peaks_towards, FIRST_WAVE * greatest), (0, 0))
        # The incident wave has passed the bead soon after it has reached the structure.
        end = min(end, there + width)
        # Heavier beads ahead may turn back a part before all has passed; the force then includes the returning part.
        own = self.peaks[self.peaks > begin]
        own = own[(force[own] >= 0.0) & (towards[own] > back[own])]
        if own.size:
            near = slice(own[0], max(end, own[0]) + width)
            turned = back[near] > towards[near]
            own = own[own < (near.start + turned.argmax() if turned.any() else near.stop)]
        incident = int(own[force[own].argmax()]) if own.size and begin < there else 0
        if not (self.pushed and self.travel > 0.0 and force[incident] >= FIRST_WAVE * self.top):
            return found._replace(samples=[incident], notes=[""]) if 0 < incident < force.size - 1 else found
        waves, cut = self.returning(incident, (begin, end), smallest, greatest)
        self.note_doubts(waves)
        # Nearer to the structure each incident wave meets its own reflection.
        halfway = there + self.hops * width // 2
        if len(waves) > 1 and self.hops > WAVE_LENGTH and towards[self.first : halfway].min() > TAIL * greatest:
            waves[1].note = (
                "is met by a push that goes on, from a drive, a heavy striker or a strong loss: forces add up, and AR "
                "is not the ratio of two waves; push for a shorter time or take a bead farther from the structure"
            )
        samples, notes = [wave.sample for wave in waves], [wave.note for wave in waves]
        return found._replace(samples=samples, notes=notes, leaves=self.leaves, cut=cut)

    def returning(self, incident: int, window: Window, smallest: float, greatest: float) -> tuple[list[Passing], bool]:
        """Return the incident wave and the waves that come back, and whether the record ends within one of these.
        incident, window, greatest: the incident wave's peak, begin and end, and greatest power, W."""
        time, force, power, towards, there = self.time, self.force, self.back, self.towards, self.there
        amplitude, waves, cut = float(force[incident]), [Passing(incident, incident, *window)], False
        lasts, least = duration(time, self.power[: window[1] + 1]), smallest * amplitude
        peaks = self.peaks[force[self.peaks] >= least]
        # The record may end before or soon after a peak.
        if force[-1] > force[-2] and force[-1] >= least:
            peaks = np.append(peaks, force.size - 1)
        # The power of a wave is force times velocity, and the velocity grows with F^(5/6).
        for begin, end in pulses(power, self.peaks_back, smallest ** (11.0 / 6.0) * greatest):
            if end <= incident + 2:
                continue
            begin = max(begin, incident + 1)
            within = peaks[(begin <= peaks) & (peaks <= end)].tolist()
            own = [peak for peak in within if prominence(force, peak) >= least]
            if not own:
                continue
            tallest, highest = max(own, key=force.__getitem__), begin + int(power[begin : end + 1].argmax())
            part = float(force[tallest]) / amplitude
            weaker = (self.preload + part * amplitude) / (self.preload + amplitude)
            arrives = begin + int((power[begin : highest + 1] > FRONT * power[highest]).argmax())
            took = float(time[arrives] - time[there] + self.travel / self.hops)
            relative = took / (self.travel * weaker ** (-1.0 / 6.0))
            ends_open = end == force.size - 1 and bool(power[-1] > FIRST_WAVE * power[highest])
            # Only the first wave is tested: later ones may run faster than by their own force, behind another wave.
            if len(waves) == 1 and relative < self.earliest:
                if not ends_open and relative > (1.0 - DOUBTFUL) * self.earliest:
                    waves[0].note = (
                        f"a pulse at {1e6 * time[tallest]:.4g} µs, AR = {part:.2g}, comes only just too early to be "
                        f"the reflected wave{ANOTHER}"
                    )
                continue
            cut = cut or own[-1] == force.size - 1
            for sample in own:
                if sample == force.size - 1:
                    break
                former, first = waves[-1], len(waves) == 1
                part = max(float(force[sample]), float(force[former.sample])) / amplitude
                apart = float(time[sample] - time[former.last]) / (lasts * part ** (-1.0 / 6.0))
                two = not first and sample < former.end  # in one pulse; the former may still meet the incident wave
                if not first and (apart < 1.0 or (two and power[former.sample] < towards[former.sample])):
                    # Beads that rattle, or have drifted apart, pass one wave on as several pushes; the greatest counts.
                    former.sample = max(former.sample, sample, key=force.__getitem__)
                    former.last, former.end = sample, end
                    continue
                if not first and apart < 1.0 + DOUBTFUL:
                    former.note = former.note or f"is only just apart from the next wave{ANOTHER}"
                if two:
                    former.note = f"overlaps the next wave, of AR = {force[sample] / amplitude:.2g}{ANOTHER}"
                    begin = former.end = former.last + int(power[former.last : sample].argmin())
                early = first and relative < (1.0 + DOUBTFUL) * self.earliest
                note = f"is only just late enough to come from the structure{ANOTHER}" if early else ""
                waves.append(Passing(sample, sample, begin, end, note))
        return waves, cut

    def note_doubts(self, waves: list[Passing]) -> None:
        """Note waves that last too long or too short, that the record cuts off, or that have several high peaks."""
        time, force, incident = self.time, self.force, waves[0]
        lasts, amplitude = duration(time, self.power[: incident.end + 1]), float(force[incident.sample])
        if len(waves) > 1:
            first, final = waves[1], waves[-1]
            weak = self.back[incident.sample : first.sample] < TAIL * self.back[first.begin : first.end + 1].max()
            begin = incident.sample + int(np.flatnonzero(weak).max(initial=0))
            single = lasts * (float(force[first.sample]) / amplitude) ** (-1.0 / 6.0)
            times = duration(time[begin:], -self.power[begin : first.end + 1]) / single
            if not SHORT < times < LONG:
                merged = "two waves that overlap here; beads farther from the structure tell them apart"
                may_be = merged if times > LONG else "a part of a wave from inside the chain; compare other beads"
                said = f"lasts {times:.2g} times as long as a single wave of its strength: it may be {may_be}"
                first.note = first.note or said
            part = float(force[final.sample]) / amplitude
            if time[-1] - time[final.last] < lasts * part ** (-1.0 / 6.0):
                final.note = "may have a higher part after the end of the record, which comes soon after its peak"
        for wave in waves:
            inside = self.peaks[(wave.begin < self.peaks) & (self.peaks < wave.end)]
            high = time[inside[force[inside] >= (1.0 - DOUBTFUL) * force[wave.sample]]]
            if high.size > 1:
                which = f"the one at {1e6 * float(time[wave.sample]):.4g} µs is taken"
                apart = f"{1e6 * float(np.ptp(high)):.3g} µs apart; {which}"
                wave.note = f"has peaks of nearly the same height, {apart}{ANOTHER}"


def duration(time: Vector, power: Vector) -> float:
    """Return the time in which 5 to 95 % of the energy of a pulse pass, s, from its power where this is positive."""
    passed = power.clip(0.0).cumsum()
    return float(np.ptp(time[passed.searchsorted([0.05 * passed[-1], 0.95 * passed[-1]])]))


def tops(values: Vector) -> NDArray[np.intp]:
    """Return the samples of the local maxima of a trace."""
    return 1 + np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:]))


def prominence(force: Vector, peak: int) -> float:
    """Return by how much a force falls on both sides of a peak before it is higher again. It falls after the record."""
    before, after = force[peak::-1], force[peak:]
    left, right = int((before > force[peak]).argmax()), int((after > force[peak]).argmax())
    lowest = (before[:left] if left else before).min()
    return float(force[peak] - (max(lowest, after[:right].min()) if right else lowest))


def pulses(power: Vector, peaks: NDArray[np.intp], least: float) -> Iterator[Window]:
    """Yield the first and last samples of the pulses of a power that reach `least`, down to TAIL of their peaks."""
    peaks, before, k = peaks[power[peaks] >= least], 0, 0
    while k < peaks.size:
        first = top = last = int(peaks[k])
        k += 1
        while k < peaks.size:
            following = int(peaks[k])
            if power[last:following].min() <= VALLEY * min(power[top], power[following]):
                break
            last, k = following, k + 1
            top = last if power[last] > power[top] else top
        after = int(peaks[k]) if k < peaks.size else power.size - 1
        ahead, behind = power[before : first + 1], power[last : after + 1]
        quiet, over = ahead[::-1] < TAIL * power[top], behind < TAIL * power[top]
        rise, fall = int(quiet.argmax()), int(over.argmax())
        begin = first - rise if quiet[rise] else before + int(ahead.argmin())
        yield begin, last + (fall if over[fall] else int(behind.argmin()))
        before = last


def placed(time: Vector, forces: Sequence[Vector], samples: NDArray[np.intp]) -> Vector:
    """Return heights and times (s) of peaks, peaks × 2, by cubic splines through the samples around each. forces,
    samples: the force and the sample of each peak. Saved times must be equidistant."""
    count, step = min(2 * NEAR + 1, time.size), time[1] - time[0]
    begins = np.clip(samples - count // 2, 0, time.size - count)
    near = np.array([force[begin : begin + count] for force, begin in zip(forces, begins, strict=True)])
    spline = scipy.interpolate.CubicSpline(np.arange(count), near, axis=1)
    # Within a sample of the peak, the greatest of the spline's stationary points.
    c, b, slope, value = spline.c  # each: intervals x peaks
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(4.0 * b * b - 12.0 * c * slope)
        linear = -slope / (2.0 * b)
        places = np.stack([(-2.0 * b - root) / (6.0 * c), (-2.0 * b + root) / (6.0 * c), linear])
        height = value + places * (slope + places * (b + places * c))
    knots, at = np.arange(count - 1)[:, None], samples - begins
    inside = (places >= 0.0) & (places <= 1.0) & (abs(knots + places - at) <= 1.0)
    heights = np.where(inside, height, -np.inf)
    flat = heights.reshape(-1, samples.size)
    best, each = flat.argmax(axis=0), np.arange(samples.size)
    top, where = flat[best, each], (knots + places).reshape(-1, samples.size)[best, each]
    found = np.isfinite(top) & np.isfinite(where)
    heights = np.where(found, top, near[each, at])
    return np.stack([heights, time[begins] + step * np.where(found, where, at)], axis=-1)
