"""Axisymmetric cylinders of about 20 000 degrees of freedom: reduction, coupled runs compared with full order, the
studies.

    python benchmarks/solids.py [--quick]

A chain of 20 spheres strikes a cylinder of steel, and one of steel on PTFE, as in the studies of section 6.1: undamped,
with a dashpot at every contact, and with the cylinder as a standard linear solid, whose arms are added after the
reduction. The full order needs one sparse solve for each window, the reduced one a small product; both use the same
window. The undamped case runs in full, and amplitude ratios are compared; the others are extrapolated from some
windows. Times are processor times, except those of the studies, which run in full as users run them, on the clock.
"""

import argparse
import os
import subprocess
import sys
from dataclasses import dataclass
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

from coupled_plate import FullOrder, full_order_run, one_thread, timed, verdict, warm_up

import hertzlink as hl
from hertzlink.studies.shared import BEAD, BEADS, DASHPOT, RECORD, SENSOR, SPEED
from particles.bead import STANDARD_GRAVITY

RADIUS = 9.525e-3
STEEL = [hl.Layer(hl.STEEL_440C, 0.2, RADIUS)]
ON_PTFE = [hl.Layer(hl.STEEL_440C, 0.1, RADIUS), hl.Layer(hl.PTFE, 0.1, RADIUS)]
CYLINDERS = {"steel": (STEEL, 10), "steel on PTFE": (ON_PTFE, 7)}
"""Layers, and the number of cells for a mesh of the required size."""

SHARE, TIME = 0.3, 2e-5
"""The standard linear solid: the arm's share of the modulus and its relaxation time, s."""

STUDIES = ("rod-stiffness", "rod-length", "upper-layer", "lower-layer")

ROUNDS, REDUCTIONS = 15, 3
SHORT = 20
"""Windows of a shortened full-order run."""

LONGEST_REDUCTION, LONGEST_RUN, LONGEST_DAMPED_RUN, LEAST_SPEEDUP = 5.0, 20e-3, 40e-3, 200.0
LARGEST_DIFFERENCE, LONGEST_STUDIES = 1e-3, 180.0


@dataclass(frozen=True)
class Case:
    """A chain against a body at full order and reduced; longest: the target of the reduced run, s."""

    name: str
    chain: hl.Chain
    full: hl.Structure
    reduced: hl.Structure
    longest: float


def chain(loss: float | None) -> hl.Chain:
    """The studies' chain, with dashpots (N s/m) or none."""
    dashpot = None if loss is None else hl.LinearDashpot(loss)
    return hl.Chain([BEAD] * BEADS, BEAD, SPEED, STANDARD_GRAVITY, dashpot)


def prepare(name: str) -> list[Case]:
    """Assemble and reduce a cylinder, print the time, and return the cases to run on it."""
    layers, cells = CYLINDERS[name]
    assembly, reduction = [], []
    for _ in range(REDUCTIONS):
        spent, full = timed(hl.layered_cylinder, layers, cells=cells)
        assembly.append(spent)
        spent, reduced = timed(hl.reduce, full, until=RECORD)
        reduction.append(spent)
    whole = median(assembly) + median(reduction)
    print(f"{name}: {full.size} degrees of freedom to {reduced.size}")
    print(
        f"  assembly {median(assembly):.2f} s, reduction {median(reduction):.2f} s, together {whole:.2f} s "
        f"(≤ {LONGEST_REDUCTION:.0f}, {verdict(whole <= LONGEST_REDUCTION)})"
    )
    solids = [hl.damped(body, hl.damping.StandardLinearSolid(SHARE, TIME)) for body in (full, reduced)]
    return [
        Case("undamped", chain(None), full, reduced, LONGEST_RUN),
        Case("dashpots", chain(DASHPOT), full, reduced, LONGEST_RUN),
        Case("linear solid", chain(None), solids[0], solids[1], LONGEST_DAMPED_RUN),
    ]


def compare(case: Case, in_full: bool) -> None:
    """Print one line: reduced, full order, ratio. Reduced runs are made before and after the full one."""

    def rounds() -> list[float]:
        return [timed(lambda: hl.CoSimulation(case.chain, case.reduced).run(RECORD))[0] for _ in range(ROUNDS)]

    run = hl.CoSimulation(case.chain, case.reduced).run(RECORD)
    windows, spent = run.sizes["time"] - 1, rounds()
    other = full_order_run(case.chain, case.full, RECORD / windows, windows, SENSOR, None if in_full else SHORT)
    seconds = median(spent + rounds())
    speedup = other.seconds / seconds
    print(
        f"  {case.name:13}{seconds * 1e3:6.1f} ms (≤ {case.longest * 1e3:.0f}, {verdict(seconds <= case.longest)});"
        f"{other.seconds:6.1f} s full order, {speedup:.0f} times (≥ {LEAST_SPEEDUP:.0f}, "
        f"{verdict(speedup >= LEAST_SPEEDUP)}); {agreement(float(hl.amplitude_ratio(run, SENSOR)), other)}",
        flush=True,
    )


def agreement(ratio: float, other: FullOrder) -> str:
    """The difference of the amplitude ratios, or why they are not compared."""
    if other.amplitude_ratio is None:
        return f"full order extrapolated from {SHORT} windows"
    difference = abs(ratio / other.amplitude_ratio - 1.0)
    met = verdict(difference <= LARGEST_DIFFERENCE)
    return f"AR differs by {difference:.4%} (≤ {LARGEST_DIFFERENCE:.1%}, {met})"


def studies(quick: bool) -> None:
    """Run the studies one after the other, with the command's default number of processes."""
    # One thread of linear algebra was asked for in this process only.
    environment = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    spent = []
    with TemporaryDirectory() as folder:
        for name in STUDIES:
            command = [sys.executable, "-m", "hertzlink", "study", name]
            command += ["--output", f"{folder}/{name}", *["--quick"] * quick]
            begin = perf_counter()
            subprocess.run(command, env=environment, check=True, capture_output=True)
            spent.append(perf_counter() - begin)
            print(f"  {name:14}{spent[-1]:7.1f} s", flush=True)
    whole = sum(spent)
    target = "" if quick else f" (≤ {LONGEST_STUDIES:.0f}, {verdict(whole <= LONGEST_STUDIES)})"
    print(f"  together      {whole:7.1f} s{target}")


def main() -> None:
    """Print everything."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="extrapolate every full-order run; the quick studies")
    quick = parser.parse_args().quick
    one_thread()
    for loss in (None, DASHPOT):
        warm_up(hl.rod(ON_PTFE), window=1e-6)
        hl.CoSimulation(chain(loss), hl.reduce(hl.rod(ON_PTFE), RECORD)).run(1e-5)
    for name in CYLINDERS:
        for case in prepare(name):
            compare(case, in_full=case.name == "undamped" and not quick)
    print(f"{'quick' if quick else 'whole'} studies, {os.cpu_count()} cores, on the clock")
    studies(quick)


if __name__ == "__main__":
    main()
