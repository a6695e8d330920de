"""Many coupled runs of one simulation: a function of each run, arrays on a processor, and arrays on a GPU.

A chain of 20 beads on a reduced plate runs over 1.0 ms with the accuracy "screening"; AR and TOF at bead 7 are kept.
Rates count all that a user waits for but compilation. On a GPU the script also runs alone:

    python benchmarks/vary.py [runs on the GPU]
"""

import sys
from importlib.metadata import version
from time import perf_counter
from typing import Any

import numpy as np
from coupled_batch import UNTIL, of_batch, print_machine, rate, tap, waves

import hertzlink as hl

RUNS, ON_GPU = 2_000, 131_072
TAP = tap()

RANGES = {
    "speed": {"chain.impact_speed": (0.2, 0.4)},
    "radius": {"chain.bead.radius": (4.7e-3, 4.8e-3)},
    "thickness": {"structure.thickness": (4.83e-3, 5.5e-3)},
    "five": {
        "chain.impact_speed": (0.2, 0.4),
        "chain.bead.radius": (4.7e-3, 4.8e-3),
        "chain.bead.material.youngs_modulus": (1.9e11, 2.1e11),
        "structure.thickness": (4.83e-3, 5.5e-3),
        "structure.material.density": (2650.0, 2750.0),
    },
}


def values(ranges: dict[str, tuple[float, float]], runs: int) -> dict[str, Any]:
    """Random values of each quantity."""
    draw = np.random.default_rng(1).uniform
    return {name: draw(*ends, runs) for name, ends in ranges.items()}


def on_processors() -> None:
    """Print the rates on one thread and on two."""
    speeds = values(RANGES["speed"], RUNS)["chain.impact_speed"]
    for threads in (1, 2):
        hl.batch(tap, UNTIL, sensors=[7], impact_speed=speeds[:8], measure=waves)
        known, by_processor = of_batch(tap, threads, 1, waves, impact_speed=speeds)
        print(f"a function of the speed, {threads} threads: {known:.0f} runs/s ({by_processor:.0f} by processor time)")
    for name, ranges in RANGES.items():
        for threads in (1, 2):
            arguments: dict[str, Any] = {"sensors": [7], "threads": threads}
            hl.vary(TAP, UNTIL, values(ranges, 8), **arguments)
            many, own = rate(RUNS, lambda: hl.vary(TAP, UNTIL, values(ranges, RUNS), **arguments))  # noqa: B023
            print(f"arrays, {name}, {threads} threads: {many:.0f} runs/s ({own:.0f} by processor time)")


def on_gpu(runs: int) -> None:
    """Print the rates on a GPU, and how far AR and TOF are from those on a processor."""
    from numba import cuda

    print(f"{cuda.get_current_device().name}, numba-cuda {version('numba-cuda')}")
    for name, ranges in RANGES.items():
        given = values(ranges, runs)
        few = {path: column[:32] for path, column in given.items()}
        begin = perf_counter()
        hl.vary(TAP, UNTIL, few, sensors=[7], device="gpu")
        first = perf_counter() - begin
        many, _ = rate(runs, lambda: hl.vary(TAP, UNTIL, given, sensors=[7], device="gpu"))  # noqa: B023
        # The same ranges, so that windows and steps are the same.
        ends = {path: np.append(column[:64], [column.min(), column.max()]) for path, column in given.items()}
        gpu, cpu = (hl.vary(TAP, UNTIL, ends, sensors=[7], device=device) for device in ("gpu", "cpu"))
        worst = [float(abs(gpu[one] / cpu[one] - 1.0).max()) for one in ("amplitude_ratio", "time_of_flight")]
        print(
            f"arrays, {name}, GPU: {many:.0f} runs/s for {runs} runs; first call {first:.1f} s; AR differs by "
            f"{worst[0]:.1e} from the processor's, TOF by {worst[1]:.1e}"
        )


def main() -> None:
    """Print one row for each kind of quantity."""
    print_machine()
    on_processors()
    try:
        on_gpu(int(sys.argv[1]) if len(sys.argv) > 1 else ON_GPU)
    except ValueError as error:
        print(error)


if __name__ == "__main__":
    main()
