"""Coupling schemes: error, energy, solves and time by scheme and window, and the cost of a window in Python.

    python benchmarks/coupling_schemes.py [--quick]

The chain strikes a rod, a layered rod and a plate of bounded frequencies (tests/smooth_cases.py). Amplitude ratios are
compared with the monolithic reference, one system of equations with one integrator (tests/monolithic.py). All schemes
have the same windows. Energies are in units of the striker's, times are processor times.
"""

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

from hard_cases import SENSOR, chain
from smooth_cases import INTERVAL, STRUCTURES, UNTIL, reference

WINDOWS, QUICK = (2e-6, 1e-6, 5e-7, 2.5e-7), (1e-6,)
STEP = 5e-9
"""s, of the chain, so small that only the error of the windows remains."""

SCHEMES = {
    "Condensed": hl.Condensed(),
    "Aitken": hl.Aitken(),
    "IQN_ILS": hl.IQN_ILS(),
    "Explicit, 0": hl.Explicit(0, tolerance=None),
    "Explicit, 1": hl.Explicit(1, tolerance=None),
    "Explicit, 2": hl.Explicit(2, tolerance=None),
}


class Counted(hl.stepping.MovingStructure):
    """Counts its solves, and runs window by window."""

    solves, compact = 0, False

    def free(self, state: Any, window: float) -> Any:
        self.solves += 1
        return super().free(state, window)


def timed(work: Callable[[], xr.Dataset]) -> tuple[float, xr.Dataset]:
    begin = process_time()
    run = work()
    return process_time() - begin, run


def row(name: str, body: hl.Structure, scheme: Any, window: float | hl.Adaptive, exact: float) -> str:
    counted = Counted(body)
    simulation = hl.CoSimulation(chain(), body if isinstance(window, hl.Adaptive) else counted, scheme, window, STEP)
    seconds, run = timed(lambda: simulation.run(UNTIL, save_every=INTERVAL))
    windows, mismatch = float(run.windows.sum()), abs(run.interface_mismatch).max() / run.impact_energy
    return (
        f"  {name:22}{float(hl.amplitude_ratio(run, SENSOR)) - exact:11.1e}{hl.energy_error(run):10.0e}"
        f"{float(mismatch):10.0e}{windows:10.0f}{counted.solves / windows:9.2f}"
        f"{float(run.evaluations.sum()) / windows:9.2f}{seconds:9.2f}"
    )


def overhead(scheme: Any, rounds: int = 9) -> float:
    """Seconds that Python adds to a window of a half-space, without the steps of the chain."""
    window, until, every = 5e-7, 1e-3, 4e-6
    half_space = hl.half_space(hl.STEEL_440C)
    compiled = hl.CoSimulation(chain(), half_space, window=window)
    other = hl.CoSimulation(chain(), Counted(half_space), scheme, window=window)
    over, count = [], until / window
    for _ in range(rounds + 1):
        base, _ = timed(lambda: compiled.run(until, save_every=every))
        spent, run = timed(lambda: other.run(until, save_every=every))
        # A window that is repeated repeats the chain's steps, too.
        over.append((spent - base * float(run.evaluations.sum()) / count) / count)
    return median(over[1:])


def main() -> None:
    if os.environ.get("OMP_NUM_THREADS") != "1":
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], {**os.environ, "OMP_NUM_THREADS": "1"})
    head = f"  {'':22}{'AR error':>11}{'energy':>10}{'mismatch':>10}{'windows':>10}{'solves':>9}{'chain':>9}{'s':>9}"
    print("solves, chain: structural solves and chain windows for each window.\n")
    for title, body in STRUCTURES.items():
        exact = float(hl.amplitude_ratio(reference(title), SENSOR))
        for window in QUICK if "--quick" in sys.argv else WINDOWS:
            print(f"{title}, {body.size} unknowns, AR {exact:.7f}; windows of {window * 1e6:g} µs\n{head}")
            for name, scheme in SCHEMES.items():
                print(row(name, body, scheme, window, exact), flush=True)
        for tolerance in (1e-4, 1e-5, 1e-6):
            print(row(f"Adaptive({tolerance:g})", body, hl.Condensed(), hl.Adaptive(tolerance), exact), flush=True)
        print()
    for name, scheme in SCHEMES.items():
        print(f"Python adds to a window with {name:22}{1e6 * overhead(scheme):8.1f} µs", flush=True)


if __name__ == "__main__":
    main()
