"""Yielding in a run with elastic contacts, by an estimate from a table, by Jackson and Green's law."""

import csv
from bisect import bisect_right
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from itertools import count, takewhile
from math import inf, log
from statistics import median

import numpy as np

from coupling.recording.frames import Motion, middle_of
from coupling.results.ar_and_tof import SMALLEST_WAVE
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
"""The first contact's force, in units of that at which it yields, up to which no beads lose much."""

WALL = 4.0
"""The force on the wall, in units of that at which it yields, over that between beads, from which the wall matters."""

CURE = "law=hl.laws.JacksonGreen() in Chain computes it"


def yields(chains: Sequence[MovingChain], motions: Sequence[Motion], times: Vector) -> list[str]:
    """Return a finding on the contact that is pressed farthest beyond yield, where that matters.

    Beads that take no law of contacts have motions without velocity.
    """
    worst, words = 1.0, ""
    for number, (chain, motion) in enumerate(zip(chains, motions, strict=True)):
        ratios = overloads(chain, motion.peaks)
        contact = int(ratios.argmax())
        if not ratios[contact] > worst:
            continue
        change = None if motion.velocity is None else _change(chain, motion, times)
        if change == "":
            continue
        where = f"contact {contact + 1}" + (f" of chain {number}" if len(chains) > 1 else "")
        worst, what = float(ratios[contact]), weaker(chain, contact).name or "the softer body"
        words = (
            f"yield: {where} presses {what} to {worst:.3g} times the pressure at which it yields; "
            f"{change or slower(chain, contact, worst)}"
        )
    unknown = dict.fromkeys(strength for chain in chains for strength in unknown_strengths(chain))
    return [*([words] if words else []), *unknown]


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


def _change(chain: MovingChain, motion: Motion, times: Vector) -> str | None:
    """Return what yielding would change, and the cure; empty where that is little, None where no law applies."""
    limits = chain.once("yield forces", lambda: _yield_forces(chain))
    if limits is None:
        return None
    beyond, sensor = motion.peaks / limits, middle_of(chain)
    between = median(beyond[1 : sensor + 1].tolist())
    change: str | None = ""
    if beyond[-1] > max(1.0, WALL * between):
        change = _of_wall(chain, motion, sensor, float(beyond[-1]), times) if chain.behind is None else None
    elif 1.0 - (left := _estimate("force", 1.0, between)) > LOST:
        change = f"the force at bead {sensor} would be about {left:.2g} times this run's, and AR would differ"
    elif beyond[0] > FEW:
        change = None
    return "" if change == "" else f"{change or 'its dent is left out'}; {CURE}"


def _of_wall(chain: MovingChain, motion: Motion, sensor: int, beyond: float, times: Vector) -> str | None:
    """Return what a dent in the wall would change of the wave that returns; None where there is none.

    beyond: the peak force on the wall, in units of that at which it yields.
    """
    assert motion.velocity is not None
    # The contacts beyond the sensor, as far as they are known without a gap, show where a wave comes from.
    contacts = [*takewhile(motion.contacts.__contains__, count(sensor - 1))]
    force = motion.force[None, :, [motion.contacts.index(index) for index in contacts]]
    series = Series(force, chain.static_force[None, contacts], motion.velocity[None])
    waves = find_waves(times, series, SMALLEST_WAVE, 2)
    if waves.found[0] < 2:
        return None
    elastic, hop = float(waves.amplitude_ratio[0, 0]), float(waves.arrival[0, 0]) / sensor
    ratio, delay = (_estimate(what, elastic, beyond) for what in ("AR", "delay"))
    if elastic * (1.0 - ratio) < NEGLIGIBLE:
        return ""
    travel = (len(chain.chain.beads) - sensor) * elastic ** (-1.0 / 6.0)
    later = hop * (delay + travel * (ratio ** (-1.0 / 6.0) - 1.0))
    return (
        f"on a fresh spot AR at bead {sensor} would be about {elastic * ratio:.2f} ± {ERROR:g} instead of "
        f"{elastic:.2f}, and TOF {1e6 * later:.0f} µs longer"
    )


def _estimate(what: str, elastic: float, beyond: float) -> float:
    """Return a value of the table at an elastic AR and a force, in units of that at which a contact yields; at its ends
    where they lie beyond it."""
    logarithms, ratios, rows = _table(what)
    force = min(log(max(beyond, 1.0)), logarithms[-1])
    i = min(bisect_right(logarithms, force), len(logarithms) - 1) - 1
    part = (force - logarithms[i]) / (logarithms[i + 1] - logarithms[i])
    return float(np.interp(elastic, ratios, rows[i] + part * (rows[i + 1] - rows[i])))


@cache
def _table(what: str) -> tuple[list[float], list[float], Vector]:
    """Return the logarithms of the forces, the elastic AR, and a row for each of the forces, of values for these."""
    head, *lines = csv.reader((files("coupling") / TABLE).read_text(encoding="utf-8").splitlines())
    columns = np.array([[float(number) for number in line[1:]] for line in lines if line[0] == what]).T
    return [log(float(number)) for number in head[2:]], columns[0].tolist(), columns[1:]
