"""How often the 95 % intervals of `identify` contain the truth, without a guess, and how long it takes.

Signals are runs of the model with 1 % noise. A row counts the draws whose intervals contain the truth (the mean over
the unknowns), that are called identified, and whose fits are all in a wrong valley; other figures are medians.

    python benchmarks/identification.py [--draws 100] [--case rod] [--seed 0]
"""

import argparse
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

import hertzlink as hl

BEAD, SMALL = hl.Sphere(4.765e-3, hl.STEEL_440C), hl.Sphere(2.38e-3, hl.STEEL_440C)
RADIUS, LEAD, STEP, NOISE, GAIN, SPEED = 9.525e-3, 1.5e-4, 1e-6, 0.01, 1.3, {"impact_speed": (0.2, 0.5)}
CLAMPED = hl.Supports(left="clamped", right="clamped")


class Case(NamedTuple):
    """truth, ranges: of the unknowns in question, and of others. noise: a further disturbance. exact: the builder of
    the signal, if the echoes of a default mesh are wrong by more than the noise."""

    build: Callable[..., hl.CoSimulation]
    truth: dict[str, float]
    ranges: dict[str, tuple[float, float]]
    sensors: tuple[int, ...] = (7,)
    noise: str = "white"
    until: float = 1.2e-3
    nuisances: tuple[str, ...] = ("impact_speed", "gain", "time_zero")
    exact: Callable[..., hl.CoSimulation] | None = None


def on(structure: Any, impact_speed: float, loss: Any = None, bead: hl.Sphere = BEAD) -> hl.CoSimulation:
    return hl.CoSimulation(hl.Chain([bead] * 20, bead, impact_speed, dissipation=loss), structure)


def rod(modulus: float, impact_speed: float) -> hl.CoSimulation:
    return on(hl.rod([hl.Layer(hl.Material(modulus, 0.3, 2200.0), 0.1, RADIUS)], elements=40), impact_speed)


def layered_rod(modulus: float, impact_speed: float) -> hl.CoSimulation:
    layers = [hl.Layer(hl.Material(modulus, 0.46, 2200.0), 0.01, RADIUS), hl.Layer(hl.STEEL_440C, 0.1, RADIUS)]
    return on(hl.rod(layers, elements=20), impact_speed)


def bond(modulus: float, impact_speed: float) -> hl.CoSimulation:
    glue = hl.Layer(hl.Material(modulus, 0.35, 1200.0), 0.3e-3, RADIUS)
    layers = [hl.Layer(hl.STEEL_440C, 0.01, RADIUS), glue, hl.Layer(hl.STEEL_440C, 0.1, RADIUS)]
    return on(hl.rod(layers, elements=12), impact_speed)


def edge(distance: float, impact_speed: float, thickness: float = 4.83e-3) -> hl.CoSimulation:
    return on(hl.half_plane(thickness, hl.ALUMINIUM_6061, "clamped", distance, 1.2e-3, 60e3), impact_speed)


def small_plate(distance: float, impact_speed: float, frequency: float = 40e3) -> hl.CoSimulation:
    """A thin plate with many echoes, which make two valleys less than a millimetre apart."""
    metal = replace(hl.BRASS_360, yield_strength=None)
    brass = hl.kirchhoff_plate(0.3, 0.2, 1e-3, metal, CLAMPED, highest_frequency=frequency)
    return on(brass.at(distance, 0.1), impact_speed, bead=SMALL)


def eight() -> Case:
    """A chain with losses on a clamped plate; calibrated sensors tell speed and moduli apart."""
    modes = hl.ModalPlate(hl.kirchhoff_plate(0.3, 0.3, 2.4e-3, hl.ALUMINIUM_6061, CLAMPED), 1.2e-3)

    def build(**of: float) -> hl.CoSimulation:
        steel = replace(hl.STEEL_440C, youngs_modulus=of["bead_modulus"])
        wall, striker = hl.Material(of["modulus"], 0.33, of["density"]), hl.Sphere(of["striker_radius"], steel)
        loss = hl.LinearDashpot(of["coefficient"])
        chain = hl.Chain([hl.Sphere(BEAD.radius, steel)] * 20, striker, of["impact_speed"], dissipation=loss)
        return hl.CoSimulation(chain, modes.at(of["distance"], 0.12, thickness=of["thickness"], material=wall))

    truth = {
        "distance": 0.063, "thickness": 3e-3, "modulus": 68.9e9, "density": 2700.0, "impact_speed": 0.31,
        "bead_modulus": 200e9, "coefficient": 4.0, "striker_radius": BEAD.radius,
    }  # fmt: skip
    ranges = {name: (0.75 * value, 1.3 * value) for name, value in truth.items()}
    ranges |= {"distance": (0.05, 0.08), "thickness": (2.5e-3, 3.6e-3)}
    return Case(build, truth, ranges, (7, 16), nuisances=("time_zero",))


ROD = Case(rod, {"modulus": 3e9}, {"modulus": (1e9, 10e9)})
CASES: dict[str, Callable[[], Case]] = {
    "rod": lambda: ROD,
    "layered rod": lambda: Case(layered_rod, {"modulus": 1.46e9}, {"modulus": (0.5e9, 5e9)}),
    "plate": lambda: Case(
        lambda thickness, impact_speed: on(hl.infinite_plate(thickness, hl.ALUMINIUM_6061), impact_speed),
        {"thickness": 3e-3}, {"thickness": (1e-3, 6e-3)},
    ),
    "edge": lambda: Case(edge, {"distance": 0.06}, {"distance": (0.01, 0.2)}),
    "bond": lambda: Case(bond, {"modulus": 0.3e9}, {"modulus": (0.1e9, 1e9)}),
    "dashpot": lambda: Case(
        lambda coefficient, impact_speed: on(hl.half_space(hl.STEEL_440C), impact_speed, hl.LinearDashpot(coefficient)),
        {"coefficient": 6.0}, {"coefficient": (2.0, 20.0)}, (7, 16),
    ),
    **{kind: partial(ROD._replace, noise=kind) for kind in ("hum", "drift", "correlated")},
    # A mesh for 160 kHz moves the best distance by half a standard deviation, one for 640 kHz by a twentieth.
    "two valleys": lambda: Case(
        small_plate, {"distance": 0.037}, {"distance": (0.02, 0.06)}, (7, 13), until=1e-3,
        exact=partial(small_plate, frequency=640e3),
    ),
    "edge and thickness": lambda: Case(
        edge, {"distance": 0.06, "thickness": 4.83e-3}, {"distance": (5e-3, 0.3), "thickness": (1e-3, 6e-3)}, (7, 13)
    ),
    "eight unknowns": eight,
}  # fmt: skip


def disturbed(case: Case, time: np.ndarray, force: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return a force with noise: 3 % of 50 Hz, a ramp of up to 5 %, or a correlation of 0.95 from sample to sample."""
    noise = random.normal(size=time.size + 1000)
    if case.noise == "correlated":
        noise = lfilter([np.sqrt(1.0 - 0.95**2)], [1.0, -0.95], noise)
    slow = np.zeros(time.size)
    if case.noise == "hum":
        slow = 0.03 * np.sin(2.0 * np.pi * (50.0 * time + random.uniform()))
    if case.noise == "drift":
        slow = 0.05 * random.uniform(-1.0, 1.0) * time / time[-1]
    return force + force.max() * (NOISE * noise[1000:] + slow)


def row(name: str, case: Case, draws: int, first: int) -> str:
    """Return the figures of a case."""
    speed = {} if "impact_speed" in case.truth else {"impact_speed": 0.31}
    run = (case.exact or case.build)(**case.truth, **speed).run(case.until, save_every=2.5e-7)
    time, gain = np.arange(0.0, LEAD + case.until, STEP), GAIN if "gain" in case.nuisances else 1.0
    clean = {n: gain * np.interp(time - LEAD, run.time, hl.sensor_force(run, n), left=0.0) for n in case.sensors}
    inside, identified, astray, figures = 0.0, 0, 0, list[tuple[float, float, float]]()
    for seed in range(first, first + draws):
        random, begin = np.random.default_rng(seed), process_time()
        signal = hl.as_signal(time, {n: disturbed(case, time, force, random) for n, force in clean.items()})
        ranges: dict[str, Any] = (SPEED if speed else {}) | case.ranges
        found = hl.identify(signal, case.build, case.nuisances, until=case.until, seed=seed, **ranges)
        spent, (main, truth) = process_time() - begin, next(iter(case.truth.items()))
        inside += np.mean([found[n].interval[0] <= value <= found[n].interval[1] for n, value in case.truth.items()])
        identified += found.identified
        astray += all(abs(mode[main] - truth) > 4.0 * max(found[main].error, 1e-3 * truth) for mode in found.modes)
        figures.append((100.0 * found[main].error / truth, float(found.runs), spent))
    width, runs, seconds = np.median(figures, axis=0)
    return f"{name:19s} {inside:6.4g} {identified:10d} {astray:12d} {width:9.2f} % {runs:6.0f} {seconds:7.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--case", choices=CASES, action="append")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    print(f"{asked.draws} draws    inside identified wrong valley half-width   runs seconds")
    for name in asked.case or CASES:
        print(row(name, CASES[name](), asked.draws, asked.seed), flush=True)


if __name__ == "__main__":
    main()
