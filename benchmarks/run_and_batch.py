"""Time of coupled runs: a run as typed over a tuned one, reduction over full order, batches in threads.

    python benchmarks/run_and_batch.py [--quick]

Times are processor times on one thread, the least of some rounds; batches run in two threads. The first run of
each kind, which compiles or loads the kernels, does not count. `--quick` extrapolates the run on the full plate.
"""

import os
import platform
import sys
import warnings
from collections.abc import Callable
from time import perf_counter, process_time
from typing import Any

import numba
import numpy as np
import xarray as xr

import hertzlink as hl

ROUNDS, RUNS, SENSOR = 7, 300, 7
BEAD = hl.Sphere(radius=4.765e-3, material=hl.STEEL_440C)
LAYERS = [hl.Layer(hl.STEEL_440C, length=6.35e-3, radius=9.525e-3), hl.Layer(hl.PTFE, length=25.4e-3, radius=9.525e-3)]
EDGES = hl.Supports(left="clamped", right="clamped")


def chain(impact_speed: float = 0.31) -> hl.Chain:
    return hl.Chain([BEAD] * 20, BEAD, impact_speed)


def least(do: Callable[[], Any], clock: Callable[[], float] = process_time, rounds: int = ROUNDS) -> float:
    """The least time of some calls, s."""
    do()
    times = []
    for _ in range(rounds):
        begin = clock()
        do()
        times.append(clock() - begin)
    return min(times)


def report_rods() -> None:
    """Print the cost of other ways to write a run, over that of the run on a rod reduced before."""
    until = 1.2e-3
    rod = hl.rod(LAYERS)
    small = hl.reduce(rod, until)
    two = [hl.reduce(hl.rod(LAYERS), until) for _ in range(2)]
    cases: dict[str, Callable[[], hl.CoSimulation]] = {
        f"reduced rod ({small.size} oscillators)": lambda: hl.CoSimulation(chain(), small),
        f"rod as written ({rod.size} unknowns)": lambda: hl.CoSimulation(chain(), rod),
        "two chains, two reduced rods": lambda: hl.CoSimulation([chain(), chain(0.3)], two),
        "adaptive windows": lambda: hl.CoSimulation(chain(), small, window=hl.Adaptive()),
        "Aitken, in Python": lambda: hl.CoSimulation(chain(), small, hl.Aitken()),
        "beads that deform": lambda: hl.CoSimulation(hl.DeformableChain([BEAD] * 20, BEAD, 0.31), small),
    }
    times = {name: least(lambda make=make: make().run(until)) for name, make in cases.items()}
    first = next(iter(times.values()))
    for name, seconds in times.items():
        print(f"{name:38} {1e3 * seconds:8.1f} ms {seconds / first:7.2f} times")
    run = hl.CoSimulation(chain(), small).run(until)
    print(f"{'its reflections':38} {1e3 * least(lambda: hl.reflections(run, SENSOR)):8.1f} ms\n")


def report_plate(quick: bool) -> None:
    """Print a run on a plate of full order over one on the reduced plate, and the cost of a new place."""
    until, short = 1.5e-3, 40
    plate = hl.kirchhoff_plate(0.914, 0.914, 2.29e-3, hl.ALUMINIUM_6061, EDGES)
    full = plate.at(0.1, 0.457)
    reduced = hl.reduce(full, until)
    # A run remembers the reduction of an equal structure, so each place is a new one.
    places = iter(np.linspace(0.09, 0.11, 100))
    preparation = least(lambda: hl.reduce(plate.at(next(places), 0.457), until), rounds=2)
    simulation = hl.CoSimulation(chain(), reduced)
    fast, run = least(lambda: simulation.run(until)), simulation.run(until)
    windows = run.sizes["time"] - 1
    whole = hl.CoSimulation(chain(), full, window=until / windows, reduce=False)
    whole.run(until / windows)

    begin = process_time()
    compared = whole.run(until * (short / windows if quick else 1.0))
    slow = (process_time() - begin) * (windows / short if quick else 1.0)
    print(f"plate, {full.size} unknowns: {slow:.1f} s; reduced to {reduced.size} in {preparation:.2f} s: {fast:.5f} s")
    print(f"    {slow / fast:.0f} times as fast, {slow / (fast + preparation):.0f} times with the reduction counted")
    if not quick:
        ratios = [float(hl.amplitude_ratio(one, SENSOR)) for one in (run, compared)]
        print(f"    the amplitude ratios differ by {abs(ratios[0] / ratios[1] - 1.0):.4%}")
    modes = hl.ModalPlate(plate, until)
    begin = process_time()
    modes.at(0.1, 0.457)
    once = process_time() - begin
    each = least(lambda: modes.at(next(places), 0.457))
    print(f"modes of all places {once:.1f} s, then {1e3 * each:.1f} ms a place instead of {preparation:.2f} s\n")


def report_batches() -> None:
    """Print single runs on a plate of some hundred oscillators, and batches of them with AR and TOF."""
    until = 1e-3
    plate = hl.kirchhoff_plate(0.914, 0.914, 4.83e-3, hl.ALUMINIUM_6061, EDGES)
    small, modes = hl.reduce(plate.at(0.06, 0.457), until), hl.ModalPlate(plate, until)

    def tap(impact_speed: float, accuracy: str = "screening") -> hl.CoSimulation:
        return hl.CoSimulation(chain(impact_speed), small, accuracy=accuracy)

    def thin(thickness: float) -> hl.CoSimulation:
        return hl.CoSimulation(chain(), modes.at(0.06, 0.457, thickness), accuracy="screening")

    def waves(runs: xr.Dataset) -> xr.Dataset:
        found = {"amplitude_ratio": hl.amplitude_ratio(runs, SENSOR), "time_of_flight": hl.time_of_flight(runs, SENSOR)}
        return xr.Dataset(found)

    def batch(build: Callable[..., hl.CoSimulation], threads: int, **values: Any) -> xr.Dataset:
        return hl.batch(build, until, sensors=[SENSOR], threads=threads, measure=waves, **values)

    for accuracy in ("default", "screening"):
        one = tap(0.31, accuracy)
        whole, at_sensor = (least(lambda kept=kept, one=one: one.run(until, sensors=kept)) for kept in (None, [SENSOR]))
        print(f"one run, {accuracy:9}: {1e3 * whole:.2f} ms, {1e3 * at_sensor:.2f} ms with sensors=[{SENSOR}]")
    report_batch("impact speed", lambda threads, values: batch(tap, threads, impact_speed=values), 0.2, 0.4)
    report_batch("thickness", lambda threads, values: batch(thin, threads, thickness=values), 4.83e-3, 5.5e-3)


def report_batch(name: str, batch: Callable[[int, Any], xr.Dataset], low: float, high: float) -> None:
    values = np.linspace(low, high, RUNS)
    own = least(lambda: batch(1, values), rounds=2)
    one, two = (least(lambda threads=threads: batch(threads, values), perf_counter, 2) for threads in (1, 2))
    print(f"batch over {name}: {RUNS / own:.0f} runs/s in one thread, {one / two:.2f} times that in two")


def main() -> None:
    if os.environ.get("OMP_NUM_THREADS") != "1":
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], {**os.environ, "OMP_NUM_THREADS": "1"})
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}"
    print(f"{versions}, {os.cpu_count()} cores\n")
    report_rods()
    report_plate("--quick" in sys.argv)
    report_batches()


if __name__ == "__main__":
    main()
