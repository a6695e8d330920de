"""Derivatives of a coupled run on a reduced rod: their cost in runs, side by side, in processor time."""

import time
import warnings
from dataclasses import replace
from functools import cache
from statistics import median

import hertzlink as hl
from coupling.compiled_run import Engine
from coupling.inference.derivatives import TangentEngine, parameters_around
from coupling.recording.frames import Frames, kept_at

REPEATS = 15
UNTIL = 1.0e-3
SENSORS = [12]
RADII = [f"radius_{n}" for n in range(20)]
"""Twenty parameters: the radii of the beads."""

USUAL = {"modulus": hl.STEEL_440C.youngs_modulus, **dict.fromkeys(RADII, 4.76e-3)}


@cache
def rod(modulus: float) -> hl.Structure:
    """Return a rod of 60 oscillators."""
    steel = replace(hl.STEEL_440C, youngs_modulus=modulus)
    return hl.reduce(hl.rod([hl.Layer(steel, 0.5, 9.525e-3)], elements=600), until=UNTIL, tolerance=1e-4)


def build(modulus: float = USUAL["modulus"], **radii: float) -> hl.CoSimulation:
    """Return a chain of twenty beads on a rod."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    changed = [replace(bead, radius=radius) for radius in radii.values()]
    return hl.CoSimulation(hl.Chain([*changed, *[bead] * (20 - len(changed))], bead, 0.54), rod(modulus))


def main() -> None:
    """Print the processor time of derivatives over that of the run, both alternately."""
    print(f"{rod(USUAL['modulus']).size} oscillators, of a run with one sensor to {1e3 * UNTIL:g} ms")
    for names in (RADII[:1], ["modulus"], RADII[:3], RADII[:10], ["modulus", *RADII[:9]], RADII):
        values = {name: USUAL[name] for name in names}
        simulation, around = build(**values), parameters_around(build, values)
        plan, kept = simulation.plan(UNTIL), kept_at(SENSORS, 20)
        loops, everything = list[float](), list[float]()
        for _ in range(REPEATS):
            begin = time.process_time()
            frames = Frames(simulation.interface, plan.rows, kept)
            engine = Engine(simulation.interface, simulation.scheme, plan, frames.saved)
            made = time.process_time() - begin
            run = seconds(engine, plan.total)
            begin = time.process_time()
            frames = Frames(simulation.interface, plan.rows, kept)
            tangents = TangentEngine(simulation, simulation, plan, frames, around)
            tangents.recorder_of(plan.length)
            more = time.process_time() - begin
            loop = seconds(tangents, plan.total)
            loops.append(loop / run - 1.0)
            everything.append((more + loop) / (made + run) - 1.0)
        print(
            f"{len(names):3d} parameters, {names[0]}: {median(loops):5.2f} runs of {1e3 * run:.2f} ms more, "
            f"{median(everything):5.2f} with the derivatives of what the run is made of"
        )


def seconds(engine: Engine, windows: int) -> float:
    """Return the processor time of a run."""
    run = engine.start()
    begin = time.process_time()
    engine.advance(run, 0, windows)
    return time.process_time() - begin


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
