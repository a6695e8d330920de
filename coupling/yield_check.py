"""Yielding in a run with elastic contacts, by an estimate from a table, by Jackson and Green's law."""

import csv
from collections.abc import Iterator, Sequence
from functools import cache
from importlib.resources import files
from itertools import count, takewhile
from math import inf
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from coupling.recording.frames import Motion, middle_of
from coupling.results.ar_and_tof import SMALLEST_WAVE
from coupling.results.findings import Finding
from coupling.results.waves_of_runs import Series, find_waves
from particles.contacts import once_per_pair
from particles.deformable.deformable_chain import DeformableChain
from particles.laws.yielding import JacksonGreen
from particles.moving import MovingChain
from particles.overloads import overloads, slower, unknown_strengths, weaker
from structures.structure import Vector

TABLE = "yield_effect.csv"
"""Over the peak force of a contact, in units of that at which it yields; `benchmarks/yield_effect.py` computes it."""

ERROR = 0.05
"""Of the estimated AR, in 75 of 77 runs on rods, walls and plates; docs/yield.md."""

NEGLIGIBLE = 0.005
"""A change of AR of which the user is not warned: contacts just beyond yield."""

LOST = 0.02
"""Part of the incident force that beads lose without a warning: a striker dents the first ones a little."""

FEW = 2.0
"""The greatest force between bodies, in units of that at which their contact yields, up to which none loses much."""

WALL = 4.0
"""The force on the wall, in units of that at which it yields, over that between beads, from which the wall matters."""

Numbers: TypeAlias = NDArray[np.intp]

CURE = "law=hl.laws.JacksonGreen() in Chain computes it"


def is_of_yield(finding: str) -> bool:
    """Return whether a law of yielding would change the run that a finding is about."""
    return finding.startswith("yield: ") and CURE in finding


def yields(
    chains: Sequence[Sequence[MovingChain]], motions: Sequence[Motion], times: Vector
) -> Iterator[tuple[int, str]]:
    """Yield the number of a run and a finding on its contact that is pressed farthest beyond yield, where that matters.

    chains: of each motion, one for each run.
    """
    worst, words = np.ones(len(chains[0])), [""] * len(chains[0])
    for number, (of_runs, motion) in enumerate(zip(chains, motions, strict=True)):
        ratios = overloads(of_runs[0], motion.peaks)
        contacts, greatest = ratios.argmax(axis=1), ratios.max(axis=1)
        beyond = np.flatnonzero(greatest > worst)
        for run, change in zip(beyond.tolist(), _changes(of_runs[0], motion, times, beyond), strict=True):
            if change == "":
                continue
            chain, contact, worst[run] = of_runs[run], int(contacts[run]), greatest[run]
            where = f"contact {contact + 1}" + (f" of chain {number}" if len(chains) > 1 else "")
            what = weaker(chain, contact).name or "the softer body"
            words[run] = Finding(
                f"yield: {where} presses {what} to {worst[run]:.3g} times the pressure at which it yields; "
                f"{change or slower(chain, contact, float(worst[run]))}",
                {"chain": number, **change.spot} if isinstance(change, Finding) and change.spot else {},
            )
    unknown = dict.fromkeys(strength for of_runs in chains for strength in unknown_strengths(of_runs[0]))
    for run, finding in enumerate(words):
        yield from ((run, line) for line in ([finding] if finding else []) + [*unknown])


def _yield_forces(chain: MovingChain) -> Vector | None:
    """Return force, N, at which each contact begins to yield by Jackson and Green's law, infinite where it does not.

    None for a chain that does not take this law, or has another.
    """
    if isinstance(chain.chain, DeformableChain) or chain.chain.law is not None:
        return None
    law, pairs, laws = JacksonGreen(), chain.pairs, chain.laws
    try:
        contacts = once_per_pair(pairs, lambda pair, i: law.of_law(*pair, laws[i]))  # type: ignore[arg-type]
    except ValueError:  # bodies that do not touch in a circle
        return None
    return np.array([contact.yield_force if contact and contact.overlap < inf else inf for contact in contacts])


def _changes(chain: MovingChain, motion: Motion, times: Vector, runs: Numbers) -> list[str | None]:
    """Return what yielding would change in runs, and the cure; empty where little, None where no law applies."""
    limits = chain.once("yield forces", lambda: _yield_forces(chain))
    if limits is None or not runs.size:
        return [None] * runs.size
    beyond, sensor = motion.peaks[runs] / limits, middle_of(chain)
    ordered = np.sort(beyond[:, 1 : sensor + 1], axis=1)
    between = 0.5 * (ordered[:, (sensor - 1) // 2] + ordered[:, sensor // 2])
    of_wall = np.flatnonzero(beyond[:, -1] > np.maximum(1.0, WALL * between))
    left = _estimate("force", np.ones(runs.size), between)
    changes: list[str | None] = [
        f"the force at bead {sensor} would be about {part:.2g} times this run's, and AR would differ"
        if 1.0 - part > LOST
        else None
        if most > FEW
        else ""
        for part, most in zip(left.tolist(), beyond[:, :-1].max(axis=1).tolist(), strict=True)
    ]
    dents = _of_wall(chain, motion, beyond[of_wall, -1], times, runs[of_wall])
    for place, change in zip(of_wall.tolist(), dents, strict=True):
        changes[place] = change
    spots = [change.spot if isinstance(change, Finding) else {} for change in changes]
    return [
        change if change == "" else Finding(f"{change or 'its dent is left out'}; {CURE}", spot)
        for change, spot in zip(changes, spots, strict=True)
    ]


def _of_wall(chain: MovingChain, motion: Motion, beyond: Vector, times: Vector, runs: Numbers) -> list[str | None]:
    """Return what a dent in the wall would change of the wave that returns in each run; None where there is none.

    beyond: the peak forces on the wall, in units of that at which it yields.
    """
    if chain.behind is not None or not runs.size:
        return [None] * runs.size
    # The contacts beyond the sensor, as far as they are known without a gap, show where a wave comes from.
    sensor = middle_of(chain)
    contacts = [*takewhile(motion.contacts.__contains__, count(sensor - 1))]
    force = motion.force[runs][:, [motion.contacts.index(index) for index in contacts]].swapaxes(1, 2)
    static = np.tile(chain.static_force[contacts], (runs.size, 1))
    waves = find_waves(times, Series(force, static, motion.velocity[runs]), SMALLEST_WAVE, 2)
    elastic, hop = waves.amplitude_ratio[:, 0], waves.arrival[:, 0] / sensor
    ratio, delay = (_estimate(what, elastic, beyond) for what in ("AR", "delay"))
    travel = (len(chain.chain.beads) - sensor) * elastic ** (-1.0 / 6.0)
    later = hop * (delay + travel * (ratio ** (-1.0 / 6.0) - 1.0))
    return [
        None
        if many < 2
        else ""
        if before * (1.0 - part) < NEGLIGIBLE
        else Finding(
            f"on a fresh spot AR at bead {sensor} would be about {before * part:.2f} ± {ERROR:g} instead of "
            f"{before:.2f}, and TOF {1e6 * time:.0f} µs longer",
            {"ratio": part, "later": time, "error": ERROR},
        )
        for many, before, part, time in zip(
            waves.found.tolist(), elastic.tolist(), ratio.tolist(), later.tolist(), strict=True
        )
    ]


def _estimate(what: str, elastic: Vector, beyond: Vector) -> Vector:
    """Return values of the table at elastic AR and forces, in units of those at which contacts yield; at its ends where
    they lie beyond it."""
    forces, ratios, rows = _table(what)
    (i, far), (j, up) = _cells(forces, np.log(np.maximum(beyond, 1.0))), _cells(ratios, elastic)
    low, high = (rows[row, j] + up * (rows[row, j + 1] - rows[row, j]) for row in (i, i + 1))
    values: Vector = low + far * (high - low)
    return values


def _cells(nodes: Vector, places: Vector) -> tuple[Numbers, Vector]:
    """Return the nodes before places, and how far beyond these they are, in units of the distance to the next node."""
    inside = np.fmax(places, nodes[0])
    cell = nodes.searchsorted(inside, side="right") - 1
    return cell, (inside - nodes[cell]) / (nodes[cell + 1] - nodes[cell])


@cache
def _table(what: str) -> tuple[Vector, Vector, Vector]:
    """Return the logarithms of the forces, the elastic AR, and a row for each of the forces, of values for these.

    The last ones hold up to infinity.
    """
    head, *lines = csv.reader((files("coupling") / TABLE).read_text(encoding="utf-8").splitlines())
    columns = np.array([[float(number) for number in line[1:]] for line in lines if line[0] == what]).T
    forces = np.log(np.array(head[2:], float))
    return np.append(forces, inf), np.append(columns[0], inf), np.pad(columns[1:], (0, 1), "edge")
