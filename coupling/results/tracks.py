"""Waves followed from contact to contact through the whole chain: where they go, how fast, where they begin and end."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.signal import find_peaks

from coupling.results.measures import SMALLEST_WAVE
from coupling.results.peaks import FAINT, FEWEST_CONTACTS, NEAR_END, Peak, hops, interpolated, traced
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
        """When the wave passes a bead, s: halfway between the peaks of its two contacts; NaN where it misses one.

        In contrast to the peak of the force at the bead's centre, which `reflections` gives, this varies without a leap
        where beads have drifted apart and the wave is two collisions.
        """
        if sensor not in self.contacts or sensor + 1 not in self.contacts:
            return float("nan")
        pair = [self.times[self.contacts.index(n)] for n in (sensor, sensor + 1)]
        return float(0.5 * (pair[0] + pair[1]))

    def speed(self, run: xr.Dataset) -> float:
        """Mean speed along the track, m/s."""
        beads = int(run.bead[run.centre.notnull()][-1])
        first, last = (min(n, beads) for n in (self.contacts[0], self.contacts[-1]))
        way = abs(float(run.centre.sel(bead=last) - run.centre.sel(bead=first)))
        return way / float(self.times[-1] - self.times[0])


def follow_waves(run: xr.Dataset, smallest: float = SMALLEST_WAVE) -> list[Track]:
    """The waves of one run in order of time, each followed from contact to contact.

    Each is traced back from the last contact that it reached: the contact before must have peaked about as much earlier
    as the wave's hops so far, and the incident wave's hops, let expect; the first hop as a solitary wave of its force
    takes it (V goes with F^(1/6)). The longest waves take their peaks first; those whose peaks all stay below
    `smallest` times the greatest force in mid chain are left out. A missing wave is not in the list, a third one is,
    one that merges with another ends in the "chain", and one that is left behind by another begins there: only waves
    that begin at the "structure" tell of it. Raises ValueError for a sweep, a signal, or where no wave runs from the
    struck end.
    """
    instance("run", run, xr.Dataset, "the Dataset of one run")
    if "contact_force" not in run or run.contact_force.ndim != 2:
        axes = [str(axis) for axis in getattr(run, "contact_force", run.time).dims if axis not in ("time", "contact")]
        choose = f"; choose one with run.isel({axes[0]}=0)" if axes else ""
        raise ValueError(f"run: must be the Dataset of one run, with its contact forces{choose}")
    # Chains shorter than the longest are filled up with NaN.
    dynamic = (run.contact_force - run.static_force).dropna("contact", how="all")
    if not positive("smallest", smallest) < 1.0:
        raise ValueError(f"smallest = {smallest!r}: must be below 1, in units of the first wave")
    web = _Web(run.time.values, dynamic.transpose("contact", "time").values, smallest)
    tracks = []
    while True:
        best = max([*web.paths(True), *web.paths(False)], key=len, default=[])
        if len(best) < FEWEST_CONTACTS:
            break
        web.take(best)
        if max(web.peaks[row][which][0] for row, which in best) >= smallest * web.first:
            tracks.append(_track(best, web.peaks, dynamic.contact.values))
    return sorted(tracks, key=lambda track: float(track.times[0]))


class _Web:
    """The peaks of all contacts, those that no wave has taken yet, and what links them."""

    def __init__(self, time: Vector, force: Vector, smallest: float) -> None:
        self.hops = hops(time, force)
        middle = len(force) // 2
        self.first = float(force[middle].max())
        level = FAINT * smallest * self.first
        self.peaks: list[list[Peak]] = []
        for series in force:
            found = find_peaks(series, height=level, prominence=level)[0]
            self.peaks.append([interpolated(time, series, int(i)) for i in found])
        if not self.peaks[middle] or not np.isfinite(self.hops).all():
            raise ValueError("run: no wave runs from the struck end; it is too short, or the chain is")
        self.free = [set(range(len(one))) for one in self.peaks]

    def take(self, path: list[Node]) -> None:
        for row, which in path:
            self.free[row].discard(which)

    def paths(self, forward: bool) -> list[list[Node]]:
        """All waves in one direction that can be linked from free peaks, in order of time.

        Each is traced back from the last contact that it reached, as `reflections` traces it from a sensor.
        """
        rows = list(range(len(self.peaks)))
        if forward:
            rows.reverse()
        numbers = [sorted(self.free[row]) for row in rows]
        times = [np.array([self.peaks[row][k][1] for k in which]) for row, which in zip(rows, numbers, strict=True)]
        back = self.hops[::-1] if forward else self.hops
        taken: set[Node] = set()
        found = []
        for start, row in enumerate(rows):
            for place, which in enumerate(numbers[start]):
                if (row, which) in taken:
                    continue
                now = float(times[start][place])
                pace = (self.first / self.peaks[row][which][0]) ** (1.0 / 6.0)
                path = [(row, which)]
                for step, before in enumerate(traced(times, back, start, now, now, pace, start), start=start + 1):
                    node = rows[step], numbers[step][int(np.flatnonzero(times[step] == before)[0])]
                    if node in taken:
                        break
                    path.append(node)
                taken.update(path)
                found.append(path[::-1])
        return found


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
