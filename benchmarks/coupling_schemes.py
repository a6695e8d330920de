"""Coupling schemes compared: error, energy, solves and time by scheme and window, and the overhead of a window.

    python benchmarks/coupling_schemes.py [--quick]

The chain strikes a rod, a layered rod and a plate of bounded frequencies (tests/smooth_cases.py). Amplitude ratios are
compared with the monolithic reference, which is one system of equations with one integrator (tests/monolithic.py).
All schemes have the same windows. Energies are in units of the striker's.
"""

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import xarray as xr

import hertzlink as hl

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from hard_cases import BEAD, SENSOR, chain
from smooth_cases import INTERVAL, STRUCTURES, UNTIL, reference

WINDOWS = (2e-6, 1e-6, 5e-7, 2.5e-7)
QUICK = (1e-6, 5e-7)

STEP = 5e-9
"""s, of the chain, so small that only the error of the windows remains."""

SCHEMES = {
    "Condensed": hl.Condensed(),
    "Aitken": hl.Aitken(),
    "IQN_ILS": hl.IQN_ILS(),
    "Explicit, 0": hl.Explicit(0, tolerance=None),
    "Explicit, 1": hl.Explicit(1, tolerance=None),
    "Explicit, 2": hl.Explicit(2, tolerance=None),
    "Explicit, 1, parallel": hl.Explicit(1, parallel=True, tolerance=None),
}

ROUNDS = 9
LARGEST_OVERHEAD = 20e-6

EDGES = hl.Supports("clamped", "clamped", "free", "free")
PLATE = hl.kirchhoff_plate(0.914, 0.914, 2.29e-3, hl.ALUMINIUM_6061, EDGES)


class Counted(hl.stepping.MovingStructure):
    """Counts its solves, and runs window by window."""

    solves, compact = 0, False

    def free(self, state: Any, window: float) -> Any:
        """One solve."""
        self.solves += 1
        return super().free(state, window)


def one_thread() -> None:
    """Restart with one thread: then processor time, which other users of the machine influence little, equals time."""
    if os.environ.get("OMP_NUM_THREADS") != "1":
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)


def timed(work: Callable[[], xr.Dataset]) -> tuple[float, xr.Dataset]:
    """Seconds of processor time, and the run."""
    begin = process_time()
    run = work()
    return process_time() - begin, run


def line(name: str, body: hl.Structure, scheme: Any, window: float | hl.Adaptive, exact: float) -> str:
    """One line of the table."""
    counted = Counted(body)
    simulation = hl.CoSimulation(chain(), body if isinstance(window, hl.Adaptive) else counted, scheme, window, STEP)
    seconds, run = timed(lambda: simulation.run(UNTIL, save_every=INTERVAL))
    windows = float(run.windows.sum())
    energy = float(run.impact_energy)
    return (
        f"  {name:22}{float(hl.amplitude_ratio(run, SENSOR)) - exact:11.1e}{hl.energy_error(run):10.0e}"
        f"{float(abs(run.interface_mismatch).max()) / energy:10.0e}{windows:10.0f}{counted.solves / windows:9.2f}"
        f"{float(run.evaluations.sum()) / windows:9.2f}{seconds:9.2f}"
    )


def report_schemes(quick: bool) -> None:
    """Print the table of schemes and windows."""
    for title, body in STRUCTURES.items():
        exact = float(hl.amplitude_ratio(reference(title), SENSOR))
        for window in QUICK if quick else WINDOWS:
            print(f"{title}, {body.size} degrees of freedom, AR {exact:.7f}; windows of {window * 1e6:g} µs")
            print(f"  {'':22}{'AR error':>11}{'energy':>10}{'mismatch':>10}{'windows':>10}", end="")
            print(f"{'solves':>9}{'chain':>9}{'s':>9}")
            for name, scheme in SCHEMES.items():
                print(line(name, body, scheme, window, exact), flush=True)
        for tolerance in (1e-4, 1e-5, 1e-6):
            print(line(f"Adaptive({tolerance:g})", body, hl.Condensed(), hl.Adaptive(tolerance), exact), flush=True)
        print()


def overhead(scheme: Any, every: float) -> float:
    """Seconds for a window of a half-space, minus those of the compiled loop for the same chain windows.

    every, s: between saved times.
    """
    window, until = 5e-7, 1e-3
    half_space, given = hl.half_space(hl.STEEL_440C), {"window": window}
    fused = hl.CoSimulation(chain(), half_space, **given)
    other = hl.CoSimulation(chain(), Counted(half_space), scheme, **given)
    for simulation in (fused, other):
        simulation.run(until, save_every=every)
    over, count = [], until / window
    for _ in range(ROUNDS):
        base, _ = timed(lambda: fused.run(until, save_every=every))
        took, run = timed(lambda: other.run(until, save_every=every))
        # A repeated window also repeats the chain's steps, which are not overhead.
        over.append((took - base * float(run.evaluations.sum()) / count) / count)
    return median(over)


def report_overhead() -> None:
    """Print the cost of a window in Python, on a half-space, compared with the compiled loop."""
    print(f"What Python adds to a window on a half-space, less the chain's own steps, medians of {ROUNDS} rounds:")
    print(f"  {'':22}{'µs':>8}{'µs where every window is saved':>34}")
    for name, scheme in SCHEMES.items():
        seldom, always = overhead(scheme, 4e-6), overhead(scheme, 5e-7)
        target = f"  (≤ {LARGEST_OVERHEAD * 1e6:.0f}, {'met' if seldom <= LARGEST_OVERHEAD else 'MISSED'})"
        note = target if name == "Condensed" else ""
        print(f"  {name:22}{seldom * 1e6:8.1f}{always * 1e6:34.1f}{note}", flush=True)
    print()


def report_fused() -> None:
    """Print the time of the compiled loop on the reduced plate of benchmarks/coupled_plate.py."""
    until = 1.5e-3
    reduced = hl.reduce(PLATE.at(0.1, 0.457), until)
    bead = hl.Sphere(9.53e-3 / 2.0, hl.STEEL_440C)
    simulation = hl.CoSimulation(hl.Chain([bead] * 20, bead, impact_speed=0.31), reduced)
    run = simulation.run(until)
    spent = median(timed(lambda: simulation.run(until))[0] for _ in range(2 * ROUNDS))
    windows, tried = float(run.windows.sum()), float(run.evaluations.sum())
    steps = simulation.chain.steps(until / windows) * tried * simulation.chain.mass.size
    print(f"The compiled loop on a reduced plate of {reduced.size} oscillators, {windows:.0f} windows:")
    print(f"{spent * 1e3:.2f} ms a run, {spent / windows * 1e6:.2f} µs a window,", end=" ")
    print(f"{spent / steps * 1e9:.2f} ns a step of a bead.")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="two lengths of windows instead of four")
    quick = parser.parse_args().quick
    one_thread()
    hl.CoSimulation(hl.Chain([BEAD], BEAD, 0.31), None).run(1e-5)
    print("Processor time on one thread. solves, chain: structural solves and chain windows for each window.\n")
    report_schemes(quick)
    report_overhead()
    report_fused()


if __name__ == "__main__":
    main()
