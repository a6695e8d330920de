"""The judge of the wave finder: what a person sees in the map of a chain's power. It shares no code with hertzlink.

The map holds the power F v, contacts by times. The eye begins where the structure first pushes the last bead back,
and follows the brightest ridge from contact to contact towards the striker. AR and TOF are those of docs/theory.md: the
greatest force at a bead's centre (the mean of its two contact forces, above the preload) within the pulse on the ridge,
and its time, compared with the greatest force of the incident wave and its time. `chains` draws the chains on which
`compare` sets a finder beside the eye.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.signal import find_peaks

Array = NDArray[np.float64]

Finder = Callable[[xr.Dataset, int], tuple[float, float] | None]
"""From a run and a bead to AR and TOF, s, of the primary wave; None where there is none."""

FAINT = 0.01
"""Part of the incident force below which nothing is a wave."""
CELLS = 6
"""Cells of the map in the time of the incident wave from one contact to the next."""
LONGEST = 25.0
"""Such times that a bead may fly between its two contacts with the wave's energy."""


def dynamic(run: xr.Dataset) -> Array:
    """Return the contact forces above the preload, contacts x times, N."""
    return (run.contact_force - run.static_force).transpose("contact", "time").values


def arrives(force: Array) -> int:
    """Return the first sample above 0.3 of the greatest force."""
    return int(np.argmax(force > 0.3 * force.max()))


class Map:
    """Contacts x cells of time: the power towards the striker, in units of the incident wave's at the same contact."""

    def __init__(self, force: Array, velocity: Array) -> None:
        """force: contacts x times, N; velocity: of striker and beads, m/s."""
        self.last, self.reached = len(force) - 1, arrives(force[-1])
        speed = np.vstack([0.5 * (velocity[:-1] + velocity[1:]), velocity[-1:]])
        arrival = np.array([arrives(row[: self.reached + 1]) for row in force])
        # Samples to the next contact, a mean over seven contacts: light beads move at once with heavy ones.
        ends = [(max(0, n - 3), min(self.last, n + 4)) for n in range(self.last)]
        self.hop = np.array([max(2.0, (arrival[j] - arrival[i]) / (j - i)) for i, j in ends])
        usual = int(np.median(self.hop))
        self.cell, mean, before = max(1, usual // CELLS), np.ones(usual) / usual, self.reached + 2 * usual
        there, back = (
            np.array([np.convolve(row, mean, "same") for row in np.maximum(sign * force * speed, 0.0)])
            for sign in (1, -1)
        )
        self.power = self.cells(back) / there[:, :before].max(axis=1, keepdims=True)
        self.moving = self.cells(np.array([np.convolve(np.minimum(v, 0.0) ** 2, mean, "same") for v in velocity]))

    def cells(self, rows: Array) -> Array:
        """Return the greatest value in each cell."""
        return rows[:, : rows.shape[1] // self.cell * self.cell].reshape(len(rows), -1, self.cell).max(axis=2)

    def departure(self) -> slice | None:
        """Return the cells in which the first pulse leaves the structure, as the last contact but one shows it."""
        power, begin = self.power[-2], self.reached // self.cell
        above = begin + np.flatnonzero(power[begin:] > FAINT)
        if not above.size:
            return None
        top = end = int(above[0])
        while end < power.size and power[end] > 0.3 * power[top]:
            top = end if power[end] > power[top] else top
            end += 1
        return slice(begin, end)

    def ways(self, start: slice) -> list[dict[int, int]]:
        """Return for contacts from the structure on the brightest way of a wave to each: a cell for each contact."""
        cells = self.power.shape[1]
        bright = np.where(self.power > FAINT ** (5.0 / 3.0), self.power**0.3, -np.inf)
        bright[-1] = self.power[-1] ** 0.3  # A stiff structure gives back momentum at once, and hardly any power.
        score, ways, delays = np.full(cells, -np.inf), list[dict[int, int]](), np.zeros(self.power.shape, int)
        score[start] = bright[-1, start]
        for n in range(self.last, -1, -1):
            if n < self.last:
                hop, best, moving = self.hop[n] / self.cell, np.full(cells, -np.inf), self.moving[n + 1]
                least, most, near = np.full(cells, np.inf), np.zeros(cells), int(hop)
                for delay in range(int(LONGEST * hop)):
                    way, most[delay:] = np.full(cells, -np.inf), np.maximum(most[delay:], moving[: cells - delay])
                    way[delay:] = score[: cells - delay] - 0.4 * np.log(np.clip(delay / hop, 0.1, 4.0)) ** 2
                    if (within := delay - near) >= near:
                        least[within:] = np.minimum(least[within:], moving[: cells - within])
                    if delay > 2.0 * hop:  # The bead between both contacts must carry the wave: it does not slow down.
                        way[least < 0.5 * most] = -np.inf
                    delays[n][way > best] = delay
                    best = np.maximum(best, way)
                score = best + bright[n]
            if not np.isfinite(score).any():
                break
            ways.append({n: int(score.argmax())})
            for m in range(n, self.last):
                ways[-1][m + 1] = ways[-1][m] - delays[m, ways[-1][m]]
        return ways


class Seen(NamedTuple):
    """What a person sees at a bead: AR and TOF, s, NaN where no wave is back; why it is doubtful; when it passes, s."""

    ratio: float = np.nan
    flight: float = np.nan
    doubt: str = ""
    window: tuple[float, float] = (np.nan, np.nan)


def pulse(power: Array, top: int) -> tuple[int, int]:
    """Return the ends of a pulse: a twentieth of its top, or a valley below 0.15 of both sides."""
    ends = []
    for step in (-1, 1):
        i = low = top
        while 0 < i < power.size - 1 and power[i] > 0.05 * power[top]:
            i += step
            if power[i] < power[low]:
                low = i
            elif power[low] < 0.15 * min(power[i], power[top]):
                i = low
                break
        ends.append(i)
    return ends[0], ends[1] + 1


def top_of(time: Array, force: Array, at: int) -> tuple[float, float]:
    """Return the force and the time of a peak, by the parabola through its three samples."""
    left, middle, right = force[np.clip([at - 1, at, at + 1], 0, time.size - 1)]
    if middle < max(left, right) or middle == min(left, right):
        return float(middle), float(time[at])
    shift = 0.5 * (left - right) / (left - 2.0 * middle + right)
    return float(middle - 0.25 * (left - right) * shift), float(time[at] + shift * (time[1] - time[0]))


def by_eye(force: Array, velocity: Array, time: Array) -> dict[int, Seen]:
    """Return what a person sees at each bead that is five or more from both ends."""
    chart = Map(force, velocity)
    beads, start = range(6, chart.last - 4), chart.departure()
    if start is None:
        return dict.fromkeys(beads, Seen())
    ways, seen, lasting = chart.ways(start), dict[int, Seen](), list[int]()
    for bead in range(1, chart.last + 1):
        # In this time 10 to 80 % of the incident wave's energy pass; later a tail of any length follows.
        power = (force[bead - 1] + force[bead]) * velocity[bead]
        passed = np.cumsum(np.maximum(power, 0.0)[: chart.reached])
        lasting.append(int(np.ptp(np.searchsorted(passed, [0.1 * passed[-1], 0.8 * passed[-1]]))))
    for bead in reversed(beads):
        sensor, hop = 0.5 * (force[bead - 1] + force[bead]), int(chart.hop[bead - 1])
        lasts = max(lasting[bead - 2 : bead + 1])
        first, seen[bead] = int(sensor[: chart.reached + 1].argmax()), Seen(doubt="faded")
        if len(ways) <= chart.last - bead + 1:
            continue
        (incident, arrival), way = top_of(time, sensor, first), ways[chart.last - bead + 1]
        back = np.maximum(-sensor * velocity[bead], 0.0)
        near = slice(max(first + lasts, way[bead] * chart.cell - hop), (way[bead - 1] + 1) * chart.cell + hop)
        strongest = np.where(back[near] > 0.0, sensor[near], 0.0).max(initial=0.0)
        if strongest < FAINT * incident:
            continue
        # A weaker wave is slower by the sixth root of its force.
        lasts = int(lasts * min(strongest / incident, 1.0) ** (-1.0 / 6.0))
        mean = np.convolve(back, np.ones(lasts) / lasts, "same")
        begin, end = pulse(mean, near.start + int(mean[near].argmax()))
        begin = max(begin, first + lasts)
        tops = begin + find_peaks(sensor[begin:end])[0]
        if not tops.size:
            continue
        at = int(tops[sensor[tops].argmax()])
        amplitude, when = top_of(time, sensor, at)
        peaks = find_peaks(sensor, prominence=0.02 * amplitude)[0]
        peaks = peaks[(velocity[bead, peaks] < 0.0) & (peaks > first + lasts) & (peaks != at)]
        high = peaks[sensor[peaks] > 0.9 * amplitude]
        within, beside = (begin <= high) & (high < end), (begin - lasts < high) & (high < end + lasts)
        before = mean[first + lasts : max(begin - lasts, first + lasts)]
        nearer = max((one.ratio for one in seen.values() if one.ratio > 0.0), default=0.0)
        doubts = {
            "two peaks": within.any(),
            "broken up": (beside & ~within).any(),
            "drowned": before.max(initial=0.0) > 0.3 * mean[begin:end].max(),
            "faded": amplitude < 0.2 * nearer * incident,
            "record ends": end >= time.size - chart.cell,
        }
        doubt = ", ".join(name for name, there in doubts.items() if there)
        seen[bead] = Seen(amplitude / incident, when - arrival, doubt, (time[begin], time[min(end, time.size - 1)]))
    return seen


class Differs(NamedTuple):
    """A bead at which two pairs of AR and TOF, s, differ, how they do, and the eye's doubt."""

    chain: str
    bead: int
    kind: str
    doubt: str
    one: tuple[float, float] | None
    other: tuple[float, float] | None

    def __str__(self) -> str:
        pairs = " and ".join(f"{p[0]:.3f} at {1e6 * p[1]:.1f} µs" if p else "none" for p in (self.one, self.other))
        return f"{self.chain}, bead {self.bead}: {self.kind}{f' ({self.doubt})' if self.doubt else ''}: {pairs}"


def compare(finder: Finder, runs: Iterable[tuple[str, xr.Dataset]]) -> tuple[int, int, list[Differs]]:
    """Return at how many beads a finder agrees with the eye, of how many, and where it does not.

    They agree where AR is within 1 % and TOF within half a sample, or both have none. runs: from `chains.run_of`.
    """
    beads, differ = 0, []
    for chain, run in runs:
        time, velocity = run.time.values, run.velocity.transpose("bead", "time").values
        for bead, eye in by_eye(dynamic(run), velocity, time).items():
            found, beads, sees = finder(run, bead), beads + 1, (eye.ratio, eye.flight) if eye.ratio > 0.0 else None
            if found and sees:
                late, wide = found[1] - sees[1], eye.window[1] - eye.window[0]
                if abs(found[0] / sees[0] - 1.0) < 0.01 and abs(late) < 0.5 * (time[1] - time[0]):
                    continue
                kind = "another peak of the pulse" if abs(late) < wide else "earlier" if late < 0.0 else "later"
            elif not found and not sees:
                continue
            else:
                kind = "the eye alone" if sees else "the finder alone"
            differ.append(Differs(chain, bead, kind, eye.doubt, sees, found))
    return beads - len(differ), beads, differ


def changes(finder: Finder, pairs: Iterable[tuple[tuple[str, xr.Dataset], ...]]) -> tuple[int, int, list[Differs]]:
    """Return at how many beads AR and TOF change by less than 1 % from the first run of a pair to the second."""
    beads, differ = 0, []
    for (chain, first), (_, second) in pairs:
        for bead in range(6, first.sizes["contact"] - 5):
            one, other, beads = finder(first, bead), finder(second, bead), beads + 1
            if one and other:
                far = [what for what, p, q in zip(("AR", "TOF"), one, other, strict=True) if abs(q / p - 1.0) >= 0.01]
                kind = " and ".join(far)
            else:
                kind = "none in one of them" if one or other else ""
            if kind:
                differ.append(Differs(chain, bead, kind, "", one, other))
    return beads - len(differ), beads, differ
