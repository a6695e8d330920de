"""Derivatives of a coupled run on a reduced rod: their cost in runs, side by side, in processor time."""

import time
import warnings
from dataclasses import replace
from statistics import median
from typing import Any

import hertzlink as hl
from coupling.inference.derivatives import TangentEngine, parameters_around
from coupling.loops import Work
from coupling.recording.frames import Frames, kept_at

REPEATS = 15
UNTIL = 1.0e-3
SENSORS = [12]
RADII = [f"radius_{n}" for n in range(10)]
"""Ten parameters: the radii of ten beads."""


def build(**radii: float) -> hl.CoSimulation:
    """Return a chain of twenty beads on a rod of 110 oscillators."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    changed = [replace(bead, radius=radius) for radius in radii.values()]
    return hl.CoSimulation(hl.Chain([*changed, *[bead] * (20 - len(changed))], bead, 0.54), ROD)


def seconds(work: Any) -> float:
    """Return the processor time of a call, the median of many."""
    times = []
    for _ in range(REPEATS):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return median(times)


def main() -> None:
    simulation = build(**dict.fromkeys(RADII, 4.76e-3))
    kept, plan = kept_at(SENSORS, 20), simulation.plan(UNTIL)

    def run() -> None:
        frames = Frames(simulation.interface, plan.rows, kept)
        engine = Work(simulation.interface, simulation.scheme, None, plan, frames, None, None).engine(frames.saved)
        engine.advance(engine.start(), 0, plan.total)

    alone = seconds(run)
    print(f"{ROD.size} oscillators, {plan.total} windows; the loop of a run: {1e3 * alone:.2f} ms")
    for count in (1, 2, 3, 10, 20):
        names = RADII[:count] if count <= 10 else [*RADII, *(f"radius_{n}" for n in range(10, 20))]
        radii = dict.fromkeys(names, 4.76e-3)
        around, spent = parameters_around(build, radii), list[float]()

        def derivatives(around: Any = around, spent: list[float] = spent) -> None:
            frames = Frames(simulation.interface, plan.rows, kept)
            engine = TangentEngine(simulation, simulation, plan, frames, around)
            engine.recorder_of(plan.length)
            begin = time.process_time()
            engine.advance(engine.start(), 0, plan.total)
            spent.append(time.process_time() - begin)

        whole = seconds(derivatives)
        more = median(spent) / alone - 1.0
        print(
            f"{count:3d} directions: {more:.2f} runs more; {whole / alone - 1.0:.2f} with the derivatives of the pieces"
        )


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    ROD = hl.reduce(hl.rod([hl.Layer(hl.STEEL_440C, 0.5, 9.525e-3)]), until=UNTIL, tolerance=1e-4)
    main()
