"""Time of the whole plate-boundary study; its distribution; and the time that full-order plates would need.

    python benchmarks/plate_study.py [--quick] [--jobs 2]

The study runs as users run it, in processes. A sample of its points then runs in this process, part by part, and is
extrapolated: every plate point is reduced once, for all bead diameters. All thicknesses share a basis, near the edge
all points, too. Refined points farther away are reduced alone. The sample's distances there are distributed evenly but
exclude the centre, where the symmetric quarter of the plate costs less.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage, struct_rusage
from time import perf_counter

import xarray as xr
from coupled_plate import full_order_run, one_thread, timed, verdict, warm_up
from joblib.externals.loky import get_reusable_executor

import hertzlink as hl
from hertzlink.studies import plate_boundary as study

SHORT = 20
"""Windows of a shortened full-order run."""

NEAR_PLACES = (0.0123, 0.0234, 0.0345)
"""m, near the edge."""

CORES, LONGEST = 2, 30.0
"""Target: the whole study in two processes, s."""

ASSEMBLY, REDUCTION = "assembly", "reduction (factorisation, Krylov vectors)"
BASIS, SCANNED = "one basis for all points near the edge", "one basis for a farther distance of the scan"
POSITION = "oscillators of a point from a basis"
COUPLED_RUN, MEASURES, FULL_ORDER = "coupled run", "measures", "full-order run"

PARTS = {
    BASIS: "study", SCANNED: "scan", POSITION: "shared", ASSEMBLY: "alone", REDUCTION: "alone",
    COUPLED_RUN: "run", MEASURES: "run",
}  # fmt: skip
"""The parts, and whether each is needed once, for a farther distance of the scan, for a plate point from a basis or
without one, or for a run."""


@dataclass
class Sample:
    """Seconds of processor time of each part, one number for each plate point or run, and the degrees of freedom."""

    seconds: dict[str, list[float]] = field(default_factory=lambda: {part: [] for part in (*PARTS, FULL_ORDER)})
    full: list[int] = field(default_factory=list)
    reduced: list[int] = field(default_factory=list)

    def mean(self, part: str) -> float:
        """Mean for a plate point or run, s."""
        return sum(self.seconds[part]) / len(self.seconds[part])


@dataclass(frozen=True)
class Whole:
    """The study as a whole: seconds on the clock and of all processors, MiB of this process and the largest other."""

    runs: int
    shared: int
    alone: int
    clock: float
    processor: float
    memory: float
    child_memory: float


def processor_seconds(usage: struct_rusage) -> float:
    """In user code and in the kernel."""
    return usage.ru_utime + usage.ru_stime


def mebibytes(usage: struct_rusage) -> float:
    """Peak of resident memory; macOS counts it in bytes, Linux in kibibytes."""
    return usage.ru_maxrss / (1024.0**2 if sys.platform == "darwin" else 1024.0)


def whole_study(quick: bool, jobs: int) -> Whole:
    """Run all of it, its processes started and ended within the time."""
    before, begin = [getrusage(who) for who in (RUSAGE_SELF, RUSAGE_CHILDREN)], perf_counter()
    data = study.run(quick, jobs)
    # The system counts the time and memory of processes only once they have ended, and joblib keeps its own.
    get_reusable_executor().shutdown(wait=True)
    clock = perf_counter() - begin
    after = [getrusage(who) for who in (RUSAGE_SELF, RUSAGE_CHILDREN)]
    processor = sum(map(processor_seconds, after)) - sum(map(processor_seconds, before))
    sampled = data.sampled.any("diameter")
    scanned = data.distance.isin(study.THESIS.distances(quick))
    shared = int(sampled.where((data.distance <= study.NEAR) | scanned, False).sum())
    return Whole(int(data.sampled.sum()), shared, int(sampled.sum()) - shared, clock, processor, *map(mebibytes, after))


def take_sample(distances: Sequence[float], tolerance: float) -> Sample:
    """The parts at some points of each thickness, with all diameters, each compared with its full-order run."""
    sample = Sample()
    walls = min(study.THESIS.thickness), max(study.THESIS.thickness)
    seconds, basis = timed(study.reduced, (study.DISTANCES[0], study.NEAR), walls)
    sample.seconds[BASIS].append(seconds)
    sample.seconds[POSITION] += [timed(basis.at, place, study.THESIS.side / 2.0)[0] for place in NEAR_PLACES]
    sample.seconds[SCANNED] += [timed(study.reduced, distance, walls)[0] for distance in distances]
    for thickness, distance in product(study.THESIS.thickness, distances):
        assembly, full = timed(study.THESIS.plate(thickness).at, distance, study.THESIS.side / 2.0)
        reduction, reduced = timed(hl.reduce, full, study.THESIS.until, tolerance)
        sample.seconds[ASSEMBLY].append(assembly)
        sample.seconds[REDUCTION].append(reduction)
        sample.full.append(full.size)
        sample.reduced.append(reduced.size)
        for diameter in study.THESIS.bead:
            take_run(sample, study.THESIS.chain(diameter), full, reduced)
    return sample


def take_run(sample: Sample, chain: hl.Chain, full: hl.Structure, reduced: hl.Structure) -> None:
    """One bead diameter at a plate point."""
    seconds, run = timed(lambda: hl.CoSimulation(chain, reduced).run(study.THESIS.until))
    sample.seconds[COUPLED_RUN].append(seconds)
    sample.seconds[MEASURES].append(timed(measured, run)[0])
    windows = run.sizes["time"] - 1
    other = full_order_run(chain, full, study.THESIS.until / windows, windows, study.THESIS.sensor, SHORT)
    sample.seconds[FULL_ORDER].append(other.seconds)


def measured(run: xr.Dataset) -> tuple[float, float]:
    """What the study keeps of a run."""
    return float(hl.amplitude_ratio(run, study.THESIS.sensor)), float(hl.time_of_flight(run, study.THESIS.sensor))


def report_whole(whole: Whole, jobs: int, quick: bool) -> None:
    """Print times and memory."""
    kind = "quick study" if quick else "whole study"
    target = "" if quick or jobs != CORES else f" (≤ {LONGEST:.0f} s, {verdict(whole.clock <= LONGEST)})"
    print(f"{kind}: {whole.runs} runs at {whole.shared + whole.alone} plate points, processes: {jobs}")
    print(f"  clock            {whole.clock:8.1f} s{target}")
    print(f"  processor time   {whole.processor:8.1f} s, all processes, their start included")
    print(f"  a process busy   {whole.processor / jobs / whole.clock:8.1%}   of the clock, on average")
    print(f"  peak memory      {whole.memory:8.0f} MiB this process, {whole.child_memory:.0f} MiB the largest other")
    print(f"                   {whole.memory + jobs * whole.child_memory:8.0f} MiB at most, all together\n", flush=True)


def report_sample(whole: Whole, sample: Sample, jobs: int, quick: bool) -> None:
    """Print the distribution of the time, compared with the full order."""
    scan = len(study.THESIS.bases(quick)) - 1
    counts = {"study": 1, "scan": scan, "shared": whole.shared, "alone": whole.alone, "run": whole.runs}
    totals = {part: sample.mean(part) * counts[kind] for part, kind in PARTS.items()}
    known = sum(totals.values())
    dofs = f"{min(sample.full)} to {max(sample.full)} reduced to {min(sample.reduced)} to {max(sample.reduced)}"
    print(f"where it goes, from {len(sample.full)} plate points ({dofs} degrees of freedom), processor time")
    print(f"  {'':42}{'each, ms':>10}{'times':>8}{'all, s':>9}{'share':>8}")
    for part, total in totals.items():
        print(f"  {part:42}{sample.mean(part) * 1e3:10.2f}{counts[PARTS[part]]:8d}{total:9.1f}{total / known:8.1%}")
    print(f"  {'sum, extrapolated':42}{'':18}{known:9.1f}{1.0:8.1%}")
    rest = "other edges and Mindlin's theory, start of processes, shared cache"
    print(f"  {'measured, the whole':42}{'':18}{whole.processor:9.1f}{whole.processor / known:8.1%}  {rest}\n")
    assembly, runs = sample.mean(ASSEMBLY) * (whole.shared + whole.alone), sample.mean(FULL_ORDER) * whole.runs
    print(f"on full-order plates, extrapolated from {SHORT} windows a run; processor time")
    print(f"  {FULL_ORDER:42}{sample.mean(FULL_ORDER) * 1e3:10.0f}{whole.runs:8d}{runs:9.0f}")
    print(
        f"  {'with the assembly':42}{'':18}{assembly + runs:9.0f}  {(assembly + runs) / known:.0f} times the sum above"
    )
    print(f"  {f'that is, on {jobs} idle cores':42}{'':18}{(assembly + runs) / jobs / 3600.0:7.1f} h")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="the quick study, and a smaller sample")
    parser.add_argument("--jobs", type=int, default=CORES, help=f"processes of the study (default {CORES})")
    options = parser.parse_args()
    one_thread()
    # The time excludes compilation: the processes load the kernels that this one compiled.
    warm_up(study.THESIS.plate(study.THESIS.thickness[-1]).at(0.1, study.THESIS.side / 2.0), window=1e-6)
    whole = whole_study(options.quick, options.jobs)
    report_whole(whole, options.jobs, options.quick)
    distances, tolerance = (study.QUICK_DISTANCES[3:4], 0.2) if options.quick else (study.DISTANCES[4::8], 0.05)
    report_sample(whole, take_sample(distances, tolerance), options.jobs, options.quick)


if __name__ == "__main__":
    main()
