"""The numbers of docs/yield.md: the table of the default, and the error of the estimate for elastic runs.

    python benchmarks/yield_error.py [table | error]

Each takes some minutes of one processor. The table compares an elastic run with the first and the fifth tap on a spot
by Jackson and Green's law, and with the first by Thornton's. A later tap begins with the contacts as the taps before
have left them: each remembers the largest overlap so far. The error compares AR and the delay that the finding
"yield" of an elastic run states with those of a run with Jackson and Green's law.
"""

import re
import sys
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np

import hertzlink as hl
from coupling.results.waves import Reflections
from hertzlink.studies import rod_stiffness, struck_cylinders
from particles import contacts
from structures.structure import Vector

BEADS, TAPS, PLATES, RODS = 20, 5, 0.31, 0.44
"""Beads of a chain, taps on a spot, and the impact speeds, m/s, of the thesis on plates and on rods."""

STEEL, ALUMINIUM, BRASS, PTFE = hl.STEEL_440C, hl.ALUMINIUM_6061, hl.BRASS_360, hl.PTFE
BEAD = hl.Sphere(4.76e-3, STEEL)
LAW = hl.laws.JacksonGreen()
"""The law of the estimate."""

ESTIMATE = re.compile(r"would be about ([\d.]+) .*TOF (-?\d+) µs longer")


class Case(NamedTuple):
    """A chain on a structure, and the length of the record, s."""

    name: str
    chain: hl.Chain
    structure: Any
    until: float


def chain(bead: Any = BEAD, speed: float = PLATES, **changes: Any) -> hl.Chain:
    return hl.Chain([bead] * BEADS, bead, speed, **changes)


def defaults() -> Iterator[Case]:
    """The set-ups of the table, in its order."""
    thesis = struck_cylinders.THESIS.chain()
    yield Case("440C on a half-space of 440C, dashpot", thesis, hl.half_space(STEEL), 1.5e-3)
    yield Case(
        "440C on a rod of PTFE", thesis, hl.reduce(hl.rod(rod_stiffness.Conditions().layers(PTFE)), 1.5e-3), 1.5e-3
    )
    for radius, thickness in ((4.765e-3, (4.83e-3, 3.18e-3, 2.29e-3)), (2.38e-3, (4.83e-3, 2.29e-3))):
        for one in thickness:
            name = f"{2e3 * radius:.2f} mm on {1e3 * one:.2f} mm of aluminium"
            yield Case(name, chain(hl.Sphere(radius, STEEL)), hl.infinite_plate(one, ALUMINIUM), 0.42 * radius)
    yield Case("9.52 mm on 2 mm of brass 360", chain(), hl.infinite_plate(2e-3, BRASS), 2e-3)


def taps(case: Case, law: Any, count: int) -> list[Reflections]:
    """The waves at bead 7 of taps on the same spot."""
    reached = np.zeros(BEADS + 1)
    fresh, found = contacts.unloading, []

    def dented(yielding: Any, stiffness: Vector, overlaps: Vector) -> Vector:
        return fresh(yielding, stiffness, np.maximum(overlaps, reached))

    with patch.object(contacts, "unloading", dented):
        for _ in range(count):
            simulation = hl.CoSimulation(case.chain.with_law(law) if law else case.chain, case.structure)
            run = simulation.run(case.until)
            found.append(hl.reflections(run, 7))
            peaks = run.contact_force.max("time").values
            for i, contact in enumerate(simulation.chain.yielding or ()):
                reached[i] = max(reached[i], 0.0 if contact is None else float(contact.approach(peaks[i])))
    return found


def table() -> None:
    """A line for each row of the page: AR, and TOF in µs."""
    print("set-up: elastic | Jackson–Green, first tap | fifth | Thornton, first")
    for case in defaults():
        elastic, *_ = taps(case, None, 1)
        first, *_, last = taps(case, LAW, TAPS)
        thornton, *_ = taps(case, hl.laws.Thornton(), 1)
        print(f"{case.name}: {' | '.join(map(_words, (elastic, first, last, thornton)))}", flush=True)


def _words(waves: Reflections) -> str:
    wave = waves.primary
    return f"{wave.amplitude_ratio:.3f}, {1e6 * wave.time_of_flight:.0f} µs" if wave else "no wave"


def walls() -> Iterator[Case]:
    """The runs that the estimate is compared with."""
    metals = (ALUMINIUM, BRASS, hl.STEEL_316)
    for metal in metals:
        for speed in (0.1, PLATES, 0.6):
            yield Case(f"{metal.name}, {speed} m/s", chain(speed=speed), hl.half_space(metal), 2e-3)
        for edge in ("clamped", "free", "simple"):
            for distance in (5e-3, 15e-3, 25e-3, 40e-3):
                plate = hl.half_plane(3e-3, metal, edge, distance, until=2e-3)
                yield Case(f"3 mm of {metal.name}, {edge}, {1e3 * distance:g} mm", chain(), plate, 2e-3)
        for length in (0.02, 0.1, 0.4):
            metal_rod, upper = ([hl.Layer(metal, one, 9.5e-3)] for one in (length, 0.25 * length))
            on_ptfe = [*upper, hl.Layer(PTFE, 0.025, 9.5e-3)]
            name, lossy = f"rod of {1e3 * length:g} mm, {metal.name}", hl.LinearDashpot(5.0)
            yield Case(name, chain(speed=RODS), hl.rod(metal_rod), 2e-3)
            yield Case(f"{name}, a quarter, on PTFE", chain(speed=RODS), hl.rod(on_ptfe), 2e-3)
            yield Case(f"{name}, dashpot", chain(speed=RODS, dissipation=lossy, gravity=9.81), hl.rod(metal_rod), 2e-3)
    for distance in (15e-3, 40e-3):
        plate = hl.half_plane(2e-3, BRASS, "clamped", distance, until=2e-3)
        yield Case(f"2 mm of {BRASS.name}, clamped, {1e3 * distance:g} mm", chain(), plate, 2e-3)
    for radius in (1e-3, 10e-3, 20e-3):
        case = chain(hl.Sphere(radius, STEEL), 0.3), hl.infinite_plate(radius, ALUMINIUM)
        yield Case(f"beads of {2e3 * radius:g} mm", *case, 0.42 * radius)
    yield Case("preload of 5 N", chain(preload=5.0), hl.half_space(ALUMINIUM), 2e-3)


def error() -> None:
    """Each run's estimate and what a run with the law gives, then the errors of all."""
    ratios, delays = [], []
    for case in walls():
        facing = hl.reduce(case.structure, case.until) if case.name.startswith("rod") else case.structure
        elastic = hl.CoSimulation(case.chain, facing).run(case.until)
        yielded = hl.CoSimulation(case.chain.with_law(LAW), facing).run(case.until)
        before, after = (hl.reflections(run, BEADS // 2).primary for run in (elastic, yielded))
        said = ESTIMATE.search(elastic.attrs["warnings"])
        if said is None or before is None or after is None:
            print(f"{case.name}: no estimate")
            continue
        later = 1e6 * (after.time_of_flight - before.time_of_flight)
        ratios.append(float(said[1]) - after.amplitude_ratio)
        delays.append(float(said[2]) / later - 1.0)
        print(
            f"{case.name}: AR {after.amplitude_ratio:.3f}, {later:.0f} µs later; estimate {said[1]}, {said[2]}",
            flush=True,
        )
    off = np.abs(ratios)
    within = ", ".join(f"{(off <= limit).sum()} within {limit:g}" for limit in (0.03, 0.045))
    print(f"{off.size} runs: AR {within}, at most {off.max():.3f} off")
    print(f"TOF {100 * np.median(np.abs(delays)):.0f} % off (median)")


if __name__ == "__main__":
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    for part in sys.argv[1:] or ("table", "error"):
        {"table": table, "error": error}[part]()
