"""The same snippets with two states of the code, one after the other on the same machine.

    git worktree add ../before COMMIT
    python benchmarks/two_commits.py ../before

First runs are processor seconds of whole processes with an empty kernel cache; all else is measured in a process whose
kernels are compiled. Of each, the best of some rounds counts, in which both states take turns.
"""

import os
import platform
import subprocess
import sys
import tempfile
from pathlib import Path

import numba
import numpy as np
from first_use import HALF_SPACE, ROD, SCRIPT

ROUNDS = 3

FIRST = f"import time\n{SCRIPT}print(time.process_time())\n"

COMMON = """
import time
import numpy as np
import xarray as xr
import hertzlink as hl
bead = hl.Sphere(radius=4.765e-3, material=hl.STEEL_440C)
plate = hl.kirchhoff_plate(0.914, 0.914, 4.83e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped", right="clamped"))
small = hl.reduce(plate.at(0.06, 0.457), until=1.2e-3)
layers = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
rod = hl.reduce(hl.rod(layers), until=1.2e-3)
def best(do, times, clock=time.process_time):
    do()
    found = 1e9
    for _ in range(7):
        begin = clock()
        for _ in range(times):
            do()
        found = min(found, (clock() - begin) / times)
    return found
def tap(speed=0.31):
    return hl.CoSimulation(hl.Chain([bead] * 20, bead, speed), small, accuracy="screening")
def waves(runs):
    return xr.Dataset({"ar": hl.amplitude_ratio(runs, 7), "tof": hl.time_of_flight(runs, 7)})
def batch(threads):
    speeds = np.linspace(0.2, 0.4, 1000)
    return lambda: hl.batch(tap, 1e-3, sensors=[7], measure=waves, threads=threads, speed=speeds)
on_rod = hl.CoSimulation(hl.Chain([bead] * 20, bead, 0.31), rod)
"""

SNIPPETS = {
    "first run, half-space, s": FIRST.format(loss=None, structure=HALF_SPACE),
    "first run, reduced rod, s": FIRST.format(loss=None, structure=ROD),
    "first run, rod and loss, s": FIRST.format(loss="hl.Tsuji(0.05)", structure=ROD),
    "run on a reduced rod, all kept, ms": COMMON + "print(1e3 * best(lambda: on_rod.run(1.2e-3), 10))",
    "run on 110 oscillators, screening, all kept, ms": COMMON + "print(1e3 * best(lambda: tap().run(1e-3), 10))",
    "adaptive windows over one run": COMMON
    + "print(best(lambda: on_rod.replace(window=hl.Adaptive()).run(1.2e-3), 5) / best(lambda: on_rod.run(1.2e-3), 5))",
    "batch with AR and TOF, one thread, ms a run": COMMON + "print(best(batch(1), 1))",
    "the same in two threads, by the clock, ms a run": COMMON + "print(best(batch(2), 1, time.perf_counter))",
    "1 000 beads on a half-space, ms": COMMON
    + "c = hl.CoSimulation(hl.Chain([bead] * 1000, bead, 0.31), hl.half_space(hl.STEEL_440C))\n"
    + "print(1e3 * best(lambda: c.run(2e-3, save_every=1e-4), 1))",
}

HERE = Path(__file__).resolve().parents[1]


def measured(code: str, folder: Path, cache: str) -> float:
    """Run a snippet with the code in a folder; return the number that it prints."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment |= {"PYTHONPATH": f"{folder}:{environment.get('PYTHONPATH', '')}", "NUMBA_CACHE_DIR": cache}
    environment |= {"OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        cwd=folder,  # Python looks there before PYTHONPATH.
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout.split()[-1])


def main() -> None:
    """Print a row for each snippet: before, now, and their ratio."""
    before = Path(sys.argv[1]).resolve()
    print(
        f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}, {os.cpu_count()} cores"
    )
    with tempfile.TemporaryDirectory() as kept:
        for name, code in SNIPPETS.items():
            found = {before: float("inf"), HERE: float("inf")}
            for _ in range(ROUNDS):
                for folder in found:
                    with tempfile.TemporaryDirectory() as empty:
                        cache = empty if "first" in name else f"{kept}/{folder.name}"
                        found[folder] = min(found[folder], measured(code, folder, cache))
            print(f"{name:50s} {found[before]:8.3g} {found[HERE]:8.3g} {found[before] / found[HERE]:7.2f}", flush=True)


if __name__ == "__main__":
    main()
