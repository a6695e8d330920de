"""Waves followed from contact to contact through the whole chain: direction, speed, beginning and end."""

from dataclasses import dataclass

import numpy as np
import scipy
import xarray as xr

from coupling.results.ar_and_tof import SMALLEST_WAVE
from coupling.results.reading import Reading, without_padding
from coupling.results.wave_finder import FIRST_WAVE, placed
from structures.checks import html_table, positive
from structures.structure import Vector

FEWEST_CONTACTS = 4
"""A wave passes at least this many contacts; fewer are beads that rattle."""

NEAR_END = 3
"""A wave whose first or last peak is within this many contacts of an end begins or ends there."""

EARLY, LATE, SLACK = 0.55, 1.8, 0.3
"""A wave's next peak comes after this part of the expected time, give or take SLACK of the chain's median one."""

FAINT = 0.5
"""On its way a wave may be lower than the smallest one that is reported by this factor."""

Node = tuple[int, float]
"""A contact's row, and the time of one of its peaks, s."""


@dataclass(frozen=True, eq=False)
class Track:
    """One wave on its way through the chain.

    Parameters
    ----------
    contacts : tuple of int
        Numbers of the contacts that it passes, in order; contact n lies before bead n.
    times : ndarray
        Time of the peak at each of these contacts, s.
    forces : ndarray
        Force of the peak above the preload, N.
    begins, ends : str
        "struck end", "structure", or "chain" if the wave parts from other waves there or merges with them.
    """

    contacts: tuple[int, ...]
    times: Vector
    forces: Vector
    begins: str
    ends: str

    @property
    def towards_structure(self) -> bool:
        """True if it runs towards the structure."""
        return self.contacts[-1] > self.contacts[0]

    def __repr__(self) -> str:
        (_, contacts), (_, ends), (_, times), (_, force) = self._rows()
        return f"Track(contacts {contacts}, {ends}, {times}, at most {force})"

    def _repr_html_(self) -> str:
        return html_table("Track", self._rows())

    def _rows(self) -> list[tuple[str, str]]:
        return [
            ("contacts", f"{self.contacts[0]} to {self.contacts[-1]}"),
            ("from", f"{self.begins} to {self.ends}"),
            ("time", f"{1e6 * self.times[0]:.1f} to {1e6 * self.times[-1]:.1f} µs"),
            ("largest force", f"{self.forces.max():.1f} N"),
        ]

    def arrival(self, sensor: int) -> float:
        """Return when the wave passes a bead, s: halfway between the peaks of its two contacts; NaN where it misses
        one. Unlike the peak of the force that `reflections` gives, this has no jump where a wave is two collisions."""
        if sensor not in self.contacts or sensor + 1 not in self.contacts:
            return float("nan")
        pair = [self.times[self.contacts.index(n)] for n in (sensor, sensor + 1)]
        return float(0.5 * (pair[0] + pair[1]))

    def speed(self, run: xr.Dataset) -> float:
        """Return the mean speed along the track, m/s."""
        reading = Reading(run)
        first, last = (min(n, reading.beads[0]) for n in (self.contacts[0], self.contacts[-1]))
        distance = abs(reading.position(last) - reading.position(first))
        return distance / float(self.times[-1] - self.times[0])


def follow_waves(run: xr.Dataset, smallest: float = SMALLEST_WAVE) -> list[Track]:
    """Return the waves of one run in order of time, each followed from contact to contact.

    A wave that merges with another one ends in the "chain", and one that parts from another one begins there; only
    waves that begin at the "structure" carry information on it.

    Parameters
    ----------
    run : Dataset
        One run of one chain.
    smallest : float
        Waves whose peaks all stay below this part of the greatest force in mid chain are left out.

    Returns
    -------
    list of Track

    Raises
    ------
    ValueError
        If the Dataset is a sweep or a signal, or if no wave runs from the struck end.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 12, striker=bead, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=5e-4)
    >>> [wave.begins for wave in hl.follow_waves(run)[:2]]
    ['struck end', 'structure']
    """
    reading = Reading(run, "the Dataset of one run")
    reading.check_holds(["contact_force"], "one run")
    reading.check_one_chain("contact_force")
    reading.check_every_contact()
    if not positive("smallest", smallest) < 1.0:
        raise ValueError(f"smallest = {smallest!r}: must be below 1, in units of the first wave")
    dynamic = without_padding(reading.dynamic_force().transpose("contact", "time").values)
    numbers = run.contact.values[: len(dynamic)]

    # All peaks of all contacts, and those of each contact that no wave has claimed so far.
    middle = len(dynamic) // 2
    first = float(dynamic[middle].max())
    level, force = FAINT * smallest * first, dict[Node, float]()
    for row, series in enumerate(dynamic):
        peaks = scipy.signal.find_peaks(series, height=level, prominence=level)[0]
        if peaks.size:
            heights, times = placed(reading.time, series[None], np.zeros_like(peaks), peaks)
            force |= {(row, at): top for top, at in zip(heights.tolist(), times.tolist(), strict=True)}
    unclaimed = [{at for place, at in force if place == row} for row in range(len(dynamic))]
    taken = hops(reading.time, dynamic)
    if not unclaimed[middle] or not np.isfinite(taken).all():
        raise ValueError("run: no wave runs from the struck end; the run or the chain is too short")

    tracks = list[Track]()
    while True:
        both = [path for forward in (True, False) for path in _paths(unclaimed, force, taken, first, forward)]
        best = max(both, key=len, default=[])
        if len(best) < FEWEST_CONTACTS:
            return sorted(tracks, key=lambda track: float(track.times[0]))
        for row, at in best:
            unclaimed[row].discard(at)
        forces = np.array([force[node] for node in best])
        if forces.max() >= smallest * first:
            contacts = tuple(int(numbers[row]) for row, _ in best)
            begins, ends = (_place(contacts[i], int(numbers[0]), int(numbers[-1])) for i in (0, -1))
            tracks.append(Track(contacts, np.array([at for _, at in best]), forces, begins, ends))


def _paths(
    unclaimed: list[set[float]], force: dict[Node, float], hops: Vector, first: float, forward: bool
) -> list[list[Node]]:
    """Return all waves in one direction that can be linked from unclaimed peaks, in order of time.

    Each is traced back from the last contact that it reached. first: the greatest force in mid chain, N.
    """
    rows = [*range(len(unclaimed))][:: -1 if forward else 1]
    times = [np.array(sorted(unclaimed[row])) for row in rows]
    back = hops[::-1] if forward else hops
    taken, paths = set[Node](), list[list[Node]]()
    for start, row in enumerate(rows):
        for now in times[start].tolist():
            if (row, now) in taken:
                continue
            # The speed of a solitary wave grows as the sixth root of its force (thesis, equation 5.12).
            pace = (first / force[row, now]) ** (1.0 / 6.0)
            path = [(row, now)]
            for step, before in enumerate(_traced(times, back, start, now, pace), start=start + 1):
                if (rows[step], before) in taken:
                    break
                path.append((rows[step], before))
            taken.update(path)
            paths.append(path[::-1])
    return paths


def _traced(peaks: list[Vector], hops: Vector, first: int, left: float, pace: float) -> list[float]:
    """Return the peaks (s) that a wave left in the rows after the row `first`, which it left at `left`, the latest one
    first. pace: its time from row to row, in units of `hops`."""
    path, row, now, slack = list[float](), first, left, SLACK * float(np.median(hops))
    while row + 1 < len(peaks) and len(peaks[row + 1]):
        early, wait = now - peaks[row + 1], pace * hops[row]
        fits = (early > EARLY * wait - slack) & (early < LATE * wait + slack)
        if not fits.any():
            break
        now = float(peaks[row + 1][np.where(fits, abs(early - wait), np.inf).argmin()])
        path.append(now)
        row += 1
        pace = max((left - now) / float(hops[first:row].sum()), EARLY * pace)
    return path


def _place(contact: int, first: int, last: int) -> str:
    """Return where a wave is that begins or ends at a contact; first, last: the numbers of the chain's contacts."""
    if contact < first + NEAR_END:
        return "struck end"
    return "structure" if contact > last - NEAR_END else "chain"


def hops(time: Vector, force: Vector) -> Vector:
    """Return the time of the incident wave from each contact to the next, s; force: contacts × time.

    A soft structure delays it at the last contact, and beads that move as one pass it on at once. Neither is the time
    of another wave; the median limits both.
    """
    arrivals = []
    for row in force:
        least = FIRST_WAVE * row.max(initial=0.0)
        peaks = scipy.signal.find_peaks(row, height=least, prominence=least)[0] if least > 0.0 else []
        arrivals.append(time[peaks[0]] if len(peaks) else np.nan)
    taken = np.diff(arrivals)
    usual = float(np.nanmedian(taken)) if np.isfinite(taken).any() else np.nan
    taken = np.where(np.isfinite(taken), taken, usual)
    taken[-1] = min(taken[-1], usual)
    return np.asarray(np.maximum(taken, SLACK * usual))
