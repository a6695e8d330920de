"""What people type: a layered rod as written, two chains, each over the run that was tuned.

Every figure is the least of several runs, one after the other in one process. The first run of each, which compiles or
loads the kernels and finds the modes, is not counted; that of a fresh environment is measured apart.
"""

import os
import platform
import subprocess
import sys
import warnings
from collections.abc import Callable
from tempfile import TemporaryDirectory
from time import perf_counter

import numba
import numpy as np

import hertzlink as hl

UNTIL, REPEATS = 1.2e-3, 7
BEAD = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
LAYERS = [
    hl.Layer(hl.STEEL_440C, length=6.35e-3, radius=9.525e-3),
    hl.Layer(hl.PTFE, length=25.4e-3, radius=9.525e-3),
]
FIRST_RUN = """
import sys
from time import perf_counter
begin = perf_counter()
import hertzlink as hl
imported = perf_counter()
bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, striker=bead, impact_speed=hl.drop_speed(0.01), gravity=9.81)
rod = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)], base="fixed")
hl.reflections(hl.CoSimulation(chain, rod).run(until=1.2e-3), sensor=7)
print(imported - begin, perf_counter() - imported)
"""


def chain(speed: float = hl.drop_speed(0.01)) -> hl.Chain:
    """The README's chain."""
    return hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=speed, gravity=9.81, dissipation=hl.LinearDashpot(5.0))


def least(make: Callable[[], hl.CoSimulation]) -> float:
    """Seconds of a simulation, made and run."""
    times = []
    for _ in range(REPEATS + 1):
        begin = perf_counter()
        make().run(UNTIL)
        times.append(perf_counter() - begin)
    return min(times[1:])


def fresh() -> tuple[float, float]:
    """Seconds of the import and of the first run and its measure in an environment that has compiled nothing."""
    with TemporaryDirectory() as cache:
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", FIRST_RUN],
            env={**os.environ, "NUMBA_CACHE_DIR": cache}, capture_output=True, text=True, check=True,
        )  # fmt: skip
    imported, run = map(float, done.stdout.split())
    return imported, run


def main() -> None:
    """Print one row for each way to write a run."""
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    print(
        f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}, {os.cpu_count()} cores"
    )
    rod = hl.rod(LAYERS, base="fixed")
    small = hl.reduce(rod, until=UNTIL)
    others = [hl.reduce(hl.rod(LAYERS, base="fixed"), until=UNTIL) for _ in range(2)]
    one = least(lambda: hl.CoSimulation(chain(), small))
    print(f"one chain on a reduced rod ({small.size} oscillators), {1e3 * UNTIL} ms: {1e3 * one:.1f} ms")
    cases: dict[str, Callable[[], hl.CoSimulation]] = {
        f"rod as written ({rod.size} unknowns)": lambda: hl.CoSimulation(chain(), rod),
        "two chains, two rods": lambda: hl.CoSimulation([chain(), chain(0.3)], others),
        "adaptive windows": lambda: hl.CoSimulation(chain(), small, window=hl.Adaptive()),
        "Aitken": lambda: hl.CoSimulation(chain(), small, hl.Aitken()),
    }
    for name, make in cases.items():
        taken = least(make)
        print(f"{name:32} {1e3 * taken:8.1f} ms {taken / one:8.2f} times")
    run = hl.CoSimulation(chain(), small).run(UNTIL)
    hl.reflections(run, sensor=7)  # compiles
    begin = perf_counter()
    for _ in range(20):
        hl.reflections(run, sensor=7)
    print(f"{'reflections':32} {1e3 * (perf_counter() - begin) / 20:8.1f} ms")
    imported, first = fresh()
    print(f"fresh environment: import {imported:.1f} s, first run and measure {first:.1f} s")


if __name__ == "__main__":
    main()
