"""Waves followed from contact to contact through the whole chain: where they go, how fast, where they begin and end."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.signal import find_peaks

from coupling.measures import SMALLEST_WAVE
from coupling.peaks import EARLY, FEWEST_CONTACTS, NEAR_END, SLACK, Peak, hops, interpolated, next_peak
from structures.checks import instance, positive
from structures.structure import Vector

Node = tuple[int, int]
"""A contact's row, and which of its peaks."""


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

    Peaks of at least `smallest` times the greatest force in mid chain are linked: the next contact's peak must come
    about as long after as the last hop, and the incident wave's hops, let expect; at a wave's start, as a solitary wave
    of its force takes (V goes with F^(1/6)). The longest waves take their peaks first. A missing wave is not in the
    list, a third one is, one that merges with another ends in the "chain", and one that is left behind by another
    begins there: only waves that begin at the "structure" tell of it. Raises ValueError for a sweep, a signal, or where
    no wave runs from the struck end.
    """
    instance("run", run, xr.Dataset, "the Dataset of one run")
    if "contact_force" not in run or run.contact_force.ndim != 2:
        raise ValueError("run: must be the Dataset of one run, with its contact forces")
    dynamic = run.contact_force - run.static_force
    web = _Web(run.time.values, dynamic.transpose("contact", "time").values, positive("smallest", smallest))
    tracks = []
    while True:
        best = max([*web.paths(True), *web.paths(False)], key=len, default=[])
        if len(best) < FEWEST_CONTACTS:
            break
        web.take(best)
        tracks.append(_track(best, web.peaks, run.contact.values))
    return sorted(tracks, key=lambda track: float(track.times[0]))


class _Web:
    """The peaks of all contacts, those that no wave has taken yet, and what links them."""

    def __init__(self, time: Vector, force: Vector, smallest: float) -> None:
        self.hops = hops(time, force)
        middle = len(force) // 2
        self.first = float(force[middle].max())
        level = smallest * self.first
        self.peaks: list[list[Peak]] = []
        for series in force:
            found = find_peaks(series, height=level, prominence=level)[0]
            self.peaks.append([interpolated(time, series, int(i)) for i in found])
        if not self.peaks[middle] or not np.isfinite(self.hops).all():
            raise ValueError("run: no wave runs from the struck end; it is too short, or the chain is")
        self.times = [np.array([peak[1] for peak in one]) for one in self.peaks]
        self.free = [set(range(len(one))) for one in self.peaks]
        self.slack = SLACK * float(np.median(self.hops))

    def take(self, path: list[Node]) -> None:
        for row, which in path:
            self.free[row].discard(which)

    def paths(self, forward: bool) -> list[list[Node]]:
        """All waves in one direction that can be linked from free peaks."""
        order = range(len(self.peaks)) if forward else range(len(self.peaks) - 1, -1, -1)
        taken: set[Node] = set()
        found = []
        for row in order:
            for which in sorted(self.free[row]):
                if (row, which) not in taken:
                    found.append(self._path((row, which), 1 if forward else -1, taken))
                    taken.update(found[-1])
        return found

    def _path(self, start: Node, step: int, taken: set[Node]) -> list[Node]:
        """The wave from a peak on, up to where no peak follows, or one that is taken."""
        path, pace = [start], (self.first / self.peaks[start[0]][start[1]][0]) ** (1.0 / 6.0)
        while True:
            row, which = path[-1]
            if not 0 <= row + step < len(self.peaks):
                return path
            now, hop = self.times[row][which], self.hops[min(row, row + step)]
            free = sorted(self.free[row + step])
            following = next_peak(self.times[row + step][free], now, pace * hop, self.slack)
            if following is None:
                return path
            node = row + step, int(np.flatnonzero(self.times[row + step] == following)[0])
            if node in taken:
                return path
            pace = max((following - now) / hop, EARLY * pace)
            path.append(node)


def _track(path: list[Node], peaks: list[list[Peak]], contacts: Vector) -> Track:
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
