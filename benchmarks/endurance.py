"""Many runs, many points, many windows, many beads: do memory, open files and the time of each stay the same?

Each row compares the second half of one series with the first half, after a start that compiles and fills caches. The
last row is what a store adds to a point of a sweep.
"""

import os
import platform
import resource
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

import numpy as np
import xarray as xr

import hertzlink as hl

BEAD = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
RUNS, POINTS, WINDOWS, BEADS = 2_000, 10_000, 1_000_000, 100_000


def chain(beads: int = 20) -> hl.Chain:
    """Steel beads without losses, struck by one more."""
    return hl.Chain([BEAD] * beads, striker=BEAD, impact_speed=0.31)


def rod() -> hl.Structure:
    """A reduced PTFE rod."""
    return hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=1e-3)


def memory() -> float:
    """Resident memory of this process now, MiB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2**20


def files() -> int:
    """Open file handles of this process."""
    return len(os.listdir("/proc/self/fd"))


def halves(name: str, unit: str, count: int, do: Callable[[int], None]) -> None:
    """Do half of them twice. do: takes a number of units."""
    do(max(count // 20, 1))
    marks, times = [(perf_counter(), memory(), files())], []
    for _ in range(2):
        do(count // 2)
        marks.append((perf_counter(), memory(), files()))
        times.append((marks[-1][0] - marks[-2][0]) / (count // 2))
    report(name, unit, count, times, marks)


def report(name: str, unit: str, count: int, times: Sequence[float], marks: Sequence[tuple[float, float, int]]) -> None:
    """One row. times, s: of one unit, in each half; marks: clock, memory and files before, between and after."""
    (_, least, opened), (_, middle, _), (_, most, left) = marks
    print(
        f"{name:20} {count:>9,} {unit:7} {1e3 * times[1]:9.4f} ms each, {times[1] / times[0]:.2f} times those of the "
        f"first half; memory {middle - least:+.1f}, {most - middle:+.1f} MiB; files {opened}, {left}"
    )


def runs(structure: hl.Structure) -> Callable[[int], None]:
    """Coupled runs, each of a simulation of its own."""

    def do(count: int) -> None:
        for _ in range(count):
            hl.CoSimulation(chain(), structure).run(until=1e-4)

    return do


def points(folder: Path) -> None:
    """One sweep with a store, each point a small file; the clock is read where half of them are done."""
    marks = []

    def measure(run: xr.Dataset) -> xr.Dataset:
        marks.append((perf_counter(), memory(), files()))
        return run[["contact_force"]].max()

    speeds = [0.1 + 1e-5 * number for number in range(POINTS)]
    hl.sweep(struck, until=2e-5, speed=speeds, store=folder / "store", measure=measure, jobs=1)
    start, middle, end = marks[POINTS // 20], marks[POINTS // 2], marks[-1]
    counts = POINTS // 2 - POINTS // 20, POINTS - POINTS // 2
    times = [(middle[0] - start[0]) / counts[0], (end[0] - middle[0]) / counts[1]]
    report("points in one store", "points", POINTS, times, (start, middle, end))


def struck(speed: float) -> hl.CoSimulation:
    """Three free beads."""
    return hl.CoSimulation(hl.Chain([BEAD] * 3, striker=BEAD, impact_speed=speed), None)


def store(folder: Path, structure: hl.Structure, count: int = 40) -> None:
    """Whole runs of 20 beads: the processor time of a point without a store, with one, and from it."""

    def build(speed: float) -> hl.CoSimulation:
        return hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, impact_speed=speed), structure)

    def point(**keywords: Path) -> float:
        begin = process_time()
        hl.sweep(build, until=4e-4, jobs=1, speed=[0.1 + 1e-3 * i for i in range(count)], **keywords)
        return 1e3 * (process_time() - begin) / count

    point()
    plain, kept, again = point(), point(store=folder / "kept"), point(store=folder / "kept")
    print(f"a point of a sweep: {plain:.1f} ms, with a store {kept:.1f} ms, from the store {again:.1f} ms of processor")


def windows() -> Callable[[int], None]:
    """Windows of one run against a mass on a spring, of which every thousandth is saved."""
    mass, spring = np.array([[10.0 * BEAD.mass]]), np.array([[1e6]])
    body = hl.Structure(mass, spring, None, np.ones(1), 0.0, hl.Surface(hl.STEEL_440C))
    structure = hl.reduce(body, until=WINDOWS * 1e-7)

    def do(count: int) -> None:
        hl.CoSimulation(chain(), structure, window=1e-7).run(until=count * 1e-7, save_every=1e-4)

    return do


def beads() -> Callable[[int], None]:
    """Long free chains: a run of so many beads."""

    def do(count: int) -> None:
        hl.CoSimulation(chain(count), None).run(until=2e-5, save_every=1e-5)

    return do


def main() -> None:
    """Print one row for each series."""
    print(f"Python {platform.python_version()}, hertzlink on {platform.machine()}, {os.cpu_count()} cores")
    halves("runs in one process", "runs", RUNS, runs(rod()))
    with TemporaryDirectory() as folder:
        points(Path(folder))
    halves("windows in one run", "windows", WINDOWS, windows())
    halves("beads in one chain", "beads", BEADS, beads())
    with TemporaryDirectory() as folder:
        store(Path(folder), rod())


if __name__ == "__main__":
    sys.exit(main())
