"""How time and memory grow: beads of a coupled chain, points of a sweep, runs of a batch, contacts, and cores.

    python benchmarks/growth.py [--quick]

Beads: a chain struck against a half-space, over 400 steps of the chain at least, saved at five times, so that the
particle-steps count and not the records; with it a free chain of as many beads, by the kernel alone. Points: of a
sweep over impact speeds, in this process. Contacts: chains of 20 beads on one reduced plate with a contact point for
each. Cores: a batch in one and two threads. The exponent is the slope of log(time) over log(size) by least squares
over the rows of a table; 1 is linear growth. Peak memory is that of the process so far, so that it only grows.
"""

import argparse
import json
import resource
import warnings
from collections.abc import Callable, Sequence
from statistics import median
from time import perf_counter, process_time
from typing import Any

import numpy as np

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
STEP = 1e-7
EDGES = hl.Supports("clamped", "clamped", "clamped", "clamped")


def timed(work: Callable[[], Any], rounds: int, clock: Callable[[], float] = process_time) -> float:
    """Seconds of the median round, after one that compiles."""
    work()
    spent = []
    for _ in range(rounds):
        begin = clock()
        work()
        spent.append(clock() - begin)
    return median(spent)


def memory() -> float:
    """Peak memory of this process, MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """The slope of log(time) over log(size)."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def chain(beads: int, speed: float = 0.44) -> hl.Chain:
    """Struck by an equal bead."""
    return hl.Chain([BEAD] * beads, BEAD, impact_speed=speed)


def beads(rounds: int, quick: bool) -> None:
    """Chains on a half-space and free ones."""
    print("beads on a half-space       s   particle-steps/s   free chain   ratio   peak MiB")
    sizes, spent = [20, 100, 1_000, 10_000] + ([] if quick else [100_000]), []
    for count in sizes:
        steps = max(400, 2_000_000 // count // 400 * 400)
        until = steps * STEP
        free = hl.stepping.MovingChain(chain(count), None, dt=STEP)
        start = free.start()
        alone = timed(lambda free=free, start=start, until=until: free.advance(start, (0.0, 0.0), until), rounds)  # type: ignore[misc]
        coupled = hl.CoSimulation(chain(count), hl.half_space(hl.STEEL_440C), dt=STEP)
        seconds = timed(lambda one=coupled, until=until: one.run(until, save_every=until / 4), rounds)  # type: ignore[misc]
        spent.append(seconds / steps)
        rate, other = (count + 1) * steps / seconds, (count + 1) * steps / alone
        print(f"{count:21d} {seconds:7.4f} {rate:18.2e} {other:12.2e} {rate / other:7.2f} {memory():10.0f}", flush=True)
    print(f"exponent of the time of a step: {exponent(sizes, spent):.2f}\n")


def saved(rounds: int) -> None:
    """What a saved time of a long chain costs, in which all its bodies are kept."""
    print("saved times, 1 000 beads    s   particle-steps/s")
    one, until = hl.CoSimulation(chain(1_000), hl.half_space(hl.STEEL_440C), dt=STEP), 4e-4
    sizes, spent = [4, 64, 256, 1_024], []
    for count in sizes:
        run = one.run(until, save_every=until / count)
        given = json.loads(run.attrs["input"])
        steps = given["steps"][0] * round(until / given["window"])
        spent.append(timed(lambda count=count: one.run(until, save_every=until / count), rounds))  # type: ignore[misc]
        print(f"{count:21d} {spent[-1]:7.4f} {1_001 * steps / spent[-1]:18.2e}", flush=True)
    print(f"a saved time costs {1e6 * (spent[-1] - spent[0]) / (sizes[-1] - sizes[0]):.0f} µs\n")


def points(rounds: int, quick: bool) -> None:
    """Points of a sweep, and runs of a batch."""
    rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.05, 9.525e-3)]), until=2e-4)

    def tap(speed: float) -> hl.CoSimulation:
        return hl.CoSimulation(chain(20, speed), rod)

    def measure(run: Any) -> Any:
        return hl.sensor_force(run, 7).max("time").to_dataset(name="peak")

    sizes = [10, 100, 1_000] + ([] if quick else [10_000])
    doers: dict[str, Callable[[Any], Any]] = {
        "points of a sweep": lambda speeds: hl.sweep(tap, until=2e-4, jobs=1, measure=measure, speed=speeds),
        "runs of a batch": lambda speeds: hl.batch(tap, until=2e-4, measure=measure, threads=1, speed=speeds),
    }
    for name, do in doers.items():
        print(f"{name:>21}       s   ms each   peak MiB")
        spent = []
        for count in sizes:
            speeds = np.linspace(0.3, 0.6, count)
            seconds = timed(lambda do=do, speeds=speeds: do(speeds), rounds if count < 1_000 else 1)  # type: ignore[misc]
            spent.append(seconds)
            print(f"{count:21d} {seconds:7.3f} {1e3 * seconds / count:9.2f} {memory():10.0f}", flush=True)
        print(f"exponent: {exponent(sizes, spent):.2f}\n")


def contacts(rounds: int) -> None:
    """Chains on one plate."""
    plate = hl.kirchhoff_plate(0.3, 0.2, 3e-3, hl.ALUMINIUM_6061, EDGES)
    print("contacts of one plate       s   unknowns   peak MiB")
    sizes, spent = [1, 2, 4, 8], []
    for count in sizes:
        body = hl.reduce(plate.at(np.linspace(0.06, 0.24, count), np.full(count, 0.09)), until=3e-4)
        facing = [hl.ContactPoint(body, k) for k in range(count)]
        one = hl.CoSimulation([chain(20) for _ in range(count)], facing)
        spent.append(timed(lambda one=one: one.run(3e-4), rounds))  # type: ignore[misc]
        print(f"{count:21d} {spent[-1]:7.4f} {body.size:10d} {memory():10.0f}", flush=True)
    print(f"exponent: {exponent(sizes, spent):.2f}\n")


def cores(rounds: int) -> None:
    """A batch in one and two threads; by the clock."""
    rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.05, 9.525e-3)]), until=1e-3)
    speeds = np.linspace(0.3, 0.6, 100)

    def batch(threads: int) -> None:
        hl.batch(lambda speed: hl.CoSimulation(chain(20, speed), rod), 1e-3, sensors=[7], threads=threads, speed=speeds)

    seconds = [timed(lambda n=n: batch(n), rounds, perf_counter) for n in (1, 2)]  # type: ignore[misc]
    print("cores, batch of 100 runs    s   (clock)")
    for count, one in zip((1, 2), seconds, strict=True):
        print(f"{count:21d} {one:7.3f}")
    print(f"exponent: {exponent((1, 2), seconds):.2f}; two are {seconds[0] / seconds[1]:.2f} times as fast as one\n")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="without the largest sizes, one round")
    quick = parser.parse_args().quick
    rounds = 1 if quick else 3
    warnings.simplefilter("ignore", hl.HertzlinkWarning)  # records are short, and saved seldom
    print(f"Processor time, medians of {rounds} rounds after one that compiles.\n")
    beads(rounds, quick)
    saved(rounds)
    contacts(rounds)
    cores(rounds)
    points(rounds, quick)


if __name__ == "__main__":
    main()
