"""Coupled runs of a chain of 20 beads on reduced plates: single ones, and batches in threads and in processes.

Single runs are repeated in one process. Their times are of the processor; the least of many counts.

Every run is built by a function of its parameters, run over 1.0 ms with the accuracy "screening", and measured at
bead 7. Rates count everything: chain, structure, run, and AR and TOF. The largest difference of AR from single runs
with the default accuracy is printed with them.
"""

import os
import platform
import warnings
from collections.abc import Callable
from time import perf_counter, process_time
from typing import Any

import numba
import numpy as np
import xarray as xr

import hertzlink as hl

UNTIL, RUNS, ROUNDS, REPEATS = 1.0e-3, 1_000, 3, 100
BEAD = hl.Sphere(radius=4.765e-3, material=hl.STEEL_440C)
EDGES = hl.Supports(left="clamped", right="clamped")
PLATE = hl.kirchhoff_plate(0.914, 0.914, 4.83e-3, hl.ALUMINIUM_6061, EDGES)
SMALL = hl.reduce(PLATE.at(0.06, 0.457), until=UNTIL)
MODES = hl.ModalPlate(PLATE, UNTIL)


def tap(impact_speed: float = 0.31, accuracy: str = "screening") -> hl.CoSimulation:
    """One structure for all runs."""
    return hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, impact_speed), SMALL, accuracy=accuracy)


def thin(thickness: float, accuracy: str = "screening") -> hl.CoSimulation:
    """A plate of its own for each run, of the same modes."""
    return hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, 0.31), MODES.at(0.06, 0.457, thickness), accuracy=accuracy)


def waves(runs: xr.Dataset) -> xr.Dataset:
    """AR and TOF of each run."""
    found = {"amplitude_ratio": hl.amplitude_ratio(runs, 7), "time_of_flight": hl.time_of_flight(runs, 7)}
    return xr.Dataset(found)


def rate(runs: int, do: Callable[[], Any]) -> tuple[float, float]:
    """Runs in a second of the clock and of the processor, the best of some rounds."""
    best = [0.0, 0.0]
    for _ in range(ROUNDS):
        begin, own = perf_counter(), process_time()
        do()
        spent = perf_counter() - begin, process_time() - own
        best = [max(old, runs / seconds) for old, seconds in zip(best, spent, strict=True)]
    return best[0], best[1]


def of_batch(build: Callable[..., hl.CoSimulation], threads: int, measure: Any, **values: Any) -> Any:
    """The same of a batch."""
    given: dict[str, Any] = {"sensors": [7], "threads": threads, "measure": measure, **values}
    return rate(len(next(iter(values.values()))), lambda: hl.batch(build, UNTIL, **given))


def milliseconds(do: Callable[[], Any]) -> float:
    """Processor time of a call that was made before, ms."""
    spent = []
    for _ in range(REPEATS):
        begin = process_time()
        do()
        spent.append(1e3 * (process_time() - begin))
    return min(spent)


def print_single() -> None:
    """Print what building one run takes, and the run itself, with everything kept and with a sensor alone."""
    for accuracy in ("default", "screening"):
        one = tap(accuracy=accuracy)
        times = milliseconds(lambda a=accuracy: tap(accuracy=a)), milliseconds(lambda o=one: o.run(UNTIL))
        at_sensor = milliseconds(lambda o=one: o.run(UNTIL, sensors=[7]))
        print(
            f"one run, {accuracy:10s} {times[0]:.2f} ms to build, {times[1]:.2f} ms to run, {at_sensor:.2f} ms "
            "with sensors=[7]"
        )


def print_machine() -> None:
    """Print versions, cores and the structure."""
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}"
    print(f"{versions}, {os.cpu_count()} cores; runs of {1e3 * UNTIL} ms on {SMALL.size} oscillators")


def main() -> None:
    """Print one row for each kind of batch."""
    print_machine()
    print_single()
    rows: list[tuple[str, Callable[..., hl.CoSimulation], Any, dict[str, Any]]] = [
        ("impact speed, forces kept", tap, None, {"impact_speed": np.linspace(0.2, 0.4, RUNS)}),
        ("impact speed, AR and TOF kept", tap, waves, {"impact_speed": np.linspace(0.2, 0.4, RUNS)}),
        ("thickness, AR and TOF kept", thin, waves, {"thickness": np.linspace(4.83e-3, 5.5e-3, RUNS)}),
    ]
    for name, build, measure, values in rows:
        hl.batch(build, UNTIL, sensors=[7], **{one: column[:8] for one, column in values.items()})
        one, own = of_batch(build, 1, measure, **values)
        two, _ = of_batch(build, 2, measure, **values)
        print(f"{name:30s} {one:4.0f} runs/s in one thread ({own:.0f} by processor time), {two / one:.2f} times in two")
    for build, (name, column) in ((tap, ("impact_speed", [0.2, 0.3, 0.4])), (thin, ("thickness", [5e-3, 5.4e-3]))):
        kept = hl.batch(build, UNTIL, sensors=[7], measure=waves, **{name: column}).amplitude_ratio.values
        alone = [float(hl.amplitude_ratio(build(value, "default").run(UNTIL), 7)) for value in column]
        print(f"largest difference of AR from runs with the default accuracy, {name}: {abs(kept - alone).max():.1e}")


if __name__ == "__main__":
    main()
