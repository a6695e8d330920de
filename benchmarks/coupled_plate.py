"""A coupled run on the reduced plate compared with the full-order plate: time, and amplitude ratio.

    python benchmarks/coupled_plate.py [--quick]

The chain strikes the thesis's thinnest plate off its centre. The full order needs one sparse solve for each window, by
the implicit midpoint; the reduced plate consists of about a hundred oscillators in the compiled window loop. Both use
the same window. Both benefit from the plate's symmetry: the full order is that of the half plate that the force can
excite.
"""

import argparse
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from time import process_time
from typing import ParamSpec, TypeVar

import hertzlink as hl

Given = ParamSpec("Given")
Result = TypeVar("Result")

BEAD = hl.Sphere(9.53e-3 / 2.0, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 20, BEAD, impact_speed=0.31)
EDGES = hl.Supports(left="clamped", right="clamped", bottom="free", top="free")
PLATE = hl.kirchhoff_plate(0.914, 0.914, 2.29e-3, hl.ALUMINIUM_6061, EDGES)
PLACE = (0.1, 0.457)
SENSOR = 7
UNTIL = 1.5e-3

ROUNDS = 11
"""Rounds of the reduced run before the full one, and again after it, so that a busy machine slows both equally."""

SHORT = 40
"""Windows of the shortened full-order run."""

OTHER_PLACE, MOST_SECONDS = 0.0937, 0.02
"""m: positions that share a basis, and one of them; s: target for its oscillators."""

STRESSES, MOST_PRESTRESS = (20e6, -0.5e6), 1.1
"""Pa, tension and a compression that the plate bears; what a run may cost under them, over the one without."""

LEAST_SPEEDUP = 500.0
LARGEST_DIFFERENCE = 1e-3


@dataclass(frozen=True)
class FullOrder:
    """A run on the full-order plate. amplitude_ratio: None after a shortened run, which ends before the
    wave returns.
    """

    factorisation: float
    windows: float
    amplitude_ratio: float | None

    @property
    def seconds(self) -> float:
        """The whole run."""
        return self.factorisation + self.windows


def one_thread() -> None:
    """Restart with one thread: then processor time, which other users of the machine influence little, equals time."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)


def timed(work: Callable[Given, Result], *given: Given.args, **named: Given.kwargs) -> tuple[float, Result]:
    """Seconds of processor time, and the result of the work."""
    begin = process_time()
    result = work(*given, **named)
    return process_time() - begin, result


def warm_up(structure: hl.Structure, window: float) -> None:
    """Compile the kernels of both kinds of run, or load compiled ones."""
    hl.CoSimulation(CHAIN, hl.reduce(structure, UNTIL, tolerance=0.5), window=window).run(window)
    hl.CoSimulation(CHAIN, structure, window=window, reduce=False).run(window)


def full_order_run(
    chain: hl.Chain, structure: hl.Structure, window: float, windows: int, sensor: int, short: int | None = None
) -> FullOrder:
    """The run, or one of `short` windows extrapolated to all of them."""
    simulation = hl.CoSimulation(chain, structure, window=window, reduce=False)
    factorisation, _ = timed(simulation.structure.step, window)
    seconds, run = timed(simulation.run, (short or windows) * window)
    if short is not None:
        return FullOrder(factorisation, seconds * windows / short, None)
    return FullOrder(factorisation, seconds, float(hl.amplitude_ratio(run, sensor)))


def reduced_runs(simulation: hl.CoSimulation) -> list[float]:
    """Seconds of each round."""
    return [timed(simulation.run, UNTIL)[0] for _ in range(ROUNDS)]


def report(
    structures: tuple[hl.Structure, hl.Structure], reduction: float, spent: list[float], ratio: float, other: FullOrder
) -> None:
    """Print the table, and whether the targets are met."""
    full, reduced = structures
    shortened, seconds = other.amplitude_ratio is None, median(spent)
    full_ratio = "—" if other.amplitude_ratio is None else f"{other.amplitude_ratio:.7f}"
    note = f"  extrapolated from {SHORT} windows" if shortened else ""
    aside = f", {note.strip()}" if shortened else ""
    speedup = other.seconds / seconds
    print(f"{'':34}{'full order':>14}{'reduced':>14}")
    print(f"{'degrees of freedom':34}{full.size:14d}{reduced.size:14d}")
    print(f"{'preparation, once for a plate, s':34}{'—':>14}{reduction:14.3f}  the reduction")
    print(f"{'coupled run, s':34}{other.seconds:14.3f}{seconds:14.5f}{note}")
    print(f"{'  of it factorisation, s':34}{other.factorisation:14.3f}{'—':>14}")
    print(f"{'  fastest and slowest round, s':34}{'—':>14}{min(spent):14.5f} to {max(spent):.5f}")
    print(f"{'amplitude ratio':34}{full_ratio:>14}{ratio:14.7f}\n")
    print(f"A run is {speedup:.0f} times faster (≥ {LEAST_SPEEDUP:.0f}, {verdict(speedup >= LEAST_SPEEDUP)}){aside}.")
    print(
        f"With the reduction counted, a first run is {other.seconds / (reduction + seconds):.0f} times faster{aside}."
    )
    if other.amplitude_ratio is None:
        print("The amplitude ratios are not compared: the shortened run ends before the wave comes back.")
    else:
        difference = abs(ratio / other.amplitude_ratio - 1.0)
        met = verdict(difference <= LARGEST_DIFFERENCE)
        print(f"The amplitude ratios differ by {difference:.4%} (≤ {LARGEST_DIFFERENCE:.1%}, {met}).")


def report_position() -> None:
    """Print what a new contact position costs: a mesh and a reduction, or its oscillators from the modes."""
    anew = timed(lambda: hl.reduce(PLATE.at(OTHER_PLACE, PLACE[1]), UNTIL))[0]
    basis = hl.ModalPlate(PLATE, UNTIL)
    once = timed(basis.at, *PLACE)[0]
    each = median(timed(basis.at, OTHER_PLACE + 1e-6 * i, PLACE[1])[0] for i in range(ROUNDS))
    print(f"A new position takes {anew:.3f} s anew. The modes of all take {once:.1f} s, and a position from")
    print(f"them {each:.4f} s (≤ {MOST_SECONDS} s, {verdict(each <= MOST_SECONDS)}): it pays from")
    print(f"{once / (anew - each):.0f} positions on.")


def driven(structure: hl.Structure, window: float, windows: int) -> None:
    """The structure alone, under the same force whatever it answers: 10 N in each window."""
    moving = hl.stepping.MovingStructure(structure)
    state = moving.start()
    for _ in range(windows):
        state, _ = moving.advance(state, 10.0, window)


def report_prestress(window: float, windows: int) -> None:
    """Print what a run, and the plate alone, costs under stress over what it costs without, in turn."""
    structures = {0.0: hl.reduce(PLATE.at(*PLACE), UNTIL)}
    for stress in STRESSES:
        inside = hl.Prestress(xx=stress * PLATE.section.thickness, yy=stress * PLATE.section.thickness)
        plate = hl.kirchhoff_plate(0.914, 0.914, PLATE.section.thickness, hl.ALUMINIUM_6061, EDGES, additions=[inside])
        structures[stress] = hl.reduce(plate.at(*PLACE), UNTIL)
    simulations = {stress: hl.CoSimulation(CHAIN, one) for stress, one in structures.items()}
    rounds = [{stress: timed(one.run, UNTIL)[0] for stress, one in simulations.items()} for _ in range(ROUNDS)]
    alone = [{stress: timed(driven, one, window, windows)[0] for stress, one in structures.items()} for _ in range(5)]
    for stress in STRESSES:
        ratio, structure = (median(spent[stress] / spent[0.0] for spent in of) for of in (rounds, alone))
        print(
            f"Under {stress / 1e6:g} MPa a run takes {ratio:.2f} times the time (≤ {MOST_PRESTRESS}, "
            f"{verdict(ratio <= MOST_PRESTRESS)}), and the plate under one force {structure:.2f}."
        )


def verdict(met: bool) -> str:
    """The text for a target that is met or missed."""
    return "met" if met else "MISSED"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="shorten the full-order run, and extrapolate")
    quick = parser.parse_args().quick
    one_thread()
    full = PLATE.at(*PLACE)
    reduction, reduced = timed(hl.reduce, full, until=UNTIL)
    run = hl.CoSimulation(CHAIN, reduced).run(UNTIL)
    windows = run.sizes["time"] - 1
    window = UNTIL / windows
    warm_up(full, window)
    simulation = hl.CoSimulation(CHAIN, reduced, window=window)
    print(f"Processor time on one thread; {windows} windows of {window * 1e6:.4f} µs; the reduced run is the median")
    print(f"of {2 * ROUNDS} rounds, half of them before the full-order run and half after it.\n", flush=True)
    spent = reduced_runs(simulation)
    other = full_order_run(CHAIN, full, window, windows, SENSOR, SHORT if quick else None)
    spent += reduced_runs(simulation)
    report((full, reduced), reduction, spent, float(hl.amplitude_ratio(simulation.run(UNTIL), SENSOR)), other)
    report_position()
    report_prestress(window, windows)


if __name__ == "__main__":
    main()
