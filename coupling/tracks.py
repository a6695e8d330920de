"""Waves followed from contact to contact through the whole chain: where they go, how fast, where they begin and end."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.signal import find_peaks

from coupling.measures import SMALLEST_WAVE, reflections
from coupling.peaks import interpolated
from structures.checks import instance, positive
from structures.structure import Vector

FEWEST_CONTACTS = 4
"""A wave passes at least so many contacts; fewer are beads that rattle."""

NEAR_END = 3
"""A wave that is first or last seen within so many contacts of an end begins or ends there."""

EARLY, LATE = 0.55, 1.8
"""A wave's next peak comes within this range of the time from the last one."""

Peak = tuple[float, float]
"""Force (N) and time (s)."""


@dataclass(frozen=True, eq=False)
class Track:
    """One wave: the contacts that it passes in order, with the time (s) and force (N, above the preload) of each peak.

    begins, ends: "struck end", "structure", or "chain" where it is born of, or lost in, other waves.
    """

    contacts: tuple[int, ...]
    times: Vector
    forces: Vector
    begins: str
    ends: str

    @property
    def goes_on(self) -> bool:
        """Whether it runs towards the structure."""
        return self.contacts[-1] > self.contacts[0]

    def arrival(self, sensor: int) -> float:
        """Time between the peaks of a bead's two contacts, s; NaN where the wave does not pass both."""
        if sensor not in self.contacts or sensor + 1 not in self.contacts:
            return float("nan")
        pair = [self.times[self.contacts.index(n)] for n in (sensor, sensor + 1)]
        return float(0.5 * (pair[0] + pair[1]))

    def speed(self, run: xr.Dataset) -> float:
        """Mean speed along the track, m/s."""
        first, last = (min(n, int(run.bead[-1])) for n in (self.contacts[0], self.contacts[-1]))
        way = abs(float(run.centre.sel(bead=last) - run.centre.sel(bead=first)))
        return way / float(self.times[-1] - self.times[0])


def follow_waves(run: xr.Dataset, smallest: float = SMALLEST_WAVE) -> list[Track]:
    """The waves of one run in order of time, each followed from contact to contact.

    Peaks of at least `smallest` times the first wave's force are linked: the next contact's peak must come about as
    long after as the last one did, or, at a wave's start, as a solitary wave of its force takes (V goes with F^(1/6)).
    The longest waves take their peaks first. A missing wave is not in the list, a third one is, one that merges
    with another ends in the "chain", and one that is left behind by another begins there: only waves that begin at
    the "structure" tell of it. Raises ValueError for a sweep, a signal, or where no wave runs from the struck end.
    """
    instance("run", run, xr.Dataset, "the Dataset of one run")
    if "contact_force" not in run or run.contact_force.ndim != 2:
        raise ValueError("run: must be the Dataset of one run, with its contact forces")
    force = (run.contact_force - run.static_force).values
    time, contacts = run.time.values, run.contact.values
    scale = _first_wave(run)
    level = positive("smallest", smallest) * scale[0]
    peaks = []
    for series in force.T:
        found = find_peaks(series, height=level, prominence=level)[0]
        peaks.append([interpolated(time, series, int(i)) for i in found])
    tracks = []
    free = [set(range(len(one))) for one in peaks]
    while True:
        paths = [path for forward in (True, False) for path in _paths(peaks, free, forward, scale)]
        best = max(paths, key=len, default=[])
        if len(best) < FEWEST_CONTACTS:
            break
        for n, k in best:
            free[n].discard(k)
        tracks.append(_track(best, peaks, contacts))
    return sorted(tracks, key=lambda track: float(track.times[0]))


def _first_wave(run: xr.Dataset) -> tuple[float, float]:
    """Force (N) of the first wave, and the time (s) that it takes from contact to contact, in mid chain."""
    beads = run.sizes["contact"] - 1
    for sensor in (max(1, beads // 2), max(1, beads // 3)):
        incident = reflections(run, sensor).incident
        after = reflections(run, sensor + 1).incident if sensor < beads else None
        if incident and after and after.arrival > incident.arrival:
            top = float((run.contact_force - run.static_force).sel(contact=sensor + 1).max())
            return top, after.arrival - incident.arrival
    raise ValueError("run: no wave runs from the struck end; it is too short, or the chain is")


def _paths(
    peaks: list[list[Peak]], free: list[set[int]], forward: bool, scale: tuple[float, float]
) -> list[list[tuple[int, int]]]:
    """All waves in one direction that can be linked from free peaks, each as (contact, peak) pairs."""
    order = range(len(peaks)) if forward else range(len(peaks) - 1, -1, -1)
    step = 1 if forward else -1
    taken: set[tuple[int, int]] = set()
    found = []
    for n in order:
        for k in sorted(free[n]):
            if (n, k) in taken:
                continue
            path, wait = [(n, k)], scale[1] * (scale[0] / peaks[n][k][0]) ** (1.0 / 6.0)
            while True:
                last, which = path[-1]
                following = _next(peaks, free, last + step, peaks[last][which][1], wait)
                if following is None or (last + step, following) in taken:
                    break
                wait = peaks[last + step][following][1] - peaks[last][which][1]
                path.append((last + step, following))
            taken.update(path)
            found.append(path)
    return found


def _next(peaks: list[list[Peak]], free: list[set[int]], contact: int, time: float, wait: float) -> int | None:
    """The free peak of a contact that comes most nearly `wait` after `time`, or None."""
    if not 0 <= contact < len(peaks):
        return None
    late = {k: (peaks[contact][k][1] - time) / wait for k in free[contact]}
    fitting = {k: abs(np.log(ratio)) for k, ratio in late.items() if EARLY < ratio < LATE}
    return min(fitting, key=fitting.__getitem__) if fitting else None


def _track(path: list[tuple[int, int]], peaks: list[list[Peak]], contacts: Vector) -> Track:
    numbers = tuple(int(contacts[n]) for n, _ in path)
    values = [peaks[n][k] for n, k in path]

    def place(number: int) -> str:
        if number <= contacts[0] + NEAR_END - 1:
            return "struck end"
        return "structure" if number > contacts[-1] - NEAR_END else "chain"

    return Track(
        numbers,
        np.array([time for _, time in values]),
        np.array([force for force, _ in values]),
        place(numbers[0]),
        place(numbers[-1]),
    )
