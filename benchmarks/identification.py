"""Whether the intervals of `identify` keep what they promise: noisy draws of signals whose truth is known.

For each case: the bias, the spread of the values over the Cramér–Rao bound, and the part of the 95 % intervals that
contain the truth, of all of the eight unknowns. In the last two cases the signal comes from another theory than the
model of the fit.

With --search no guess is given: all of the ranges are searched.

    python benchmarks/identification.py [--search] [draws] [case ...]
"""

import platform
import sys
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

import hertzlink as hl

BEAD = hl.Sphere(radius=4.765e-3, material=hl.STEEL_440C)
UNTIL, LEAD, STEP, NOISE, GAIN, SPEED = 1.2e-3, 1.5e-4, 1e-6, 0.01, 1.3, 0.31
RADIUS = 9.525e-3
SIDE, MIDDLE = 0.914, 0.457
EDGES = hl.Supports(left="clamped", right="clamped")


class Case(NamedTuple):
    """name: of the unknown; build: of the model; truth: its value; sensors; signal: the run that is measured, by
    default of the model itself; others: unknowns, and their values, besides the impact speed.
    """

    name: str
    build: Callable[..., hl.CoSimulation]
    truth: float
    sensors: tuple[int, ...] = (7,)
    signal: Callable[[], hl.CoSimulation] | None = None
    discrepancy: float = 0.0
    others: Mapping[str, float] = {}
    nuisances: tuple[str, ...] = ("gain", "time_zero")

    @property
    def values(self) -> dict[str, float]:
        """All unknowns."""
        return {self.name: self.truth, "impact_speed": SPEED, **self.others}


def on(structure: Any, impact_speed: float, loss: Any = None) -> hl.CoSimulation:
    """A chain on a structure."""
    return hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, impact_speed, dissipation=loss), structure)


def rod_modulus(modulus: float, impact_speed: float) -> hl.CoSimulation:
    """One layer; the mesh stays the same."""
    return on(hl.rod([hl.Layer(hl.Material(modulus, 0.3, 2200.0), 0.1, RADIUS)], elements=40), impact_speed)


def upper_modulus(modulus: float, impact_speed: float) -> hl.CoSimulation:
    """10 mm of a polymer on steel."""
    layers = [hl.Layer(hl.Material(modulus, 0.46, 2200.0), 0.01, RADIUS), hl.Layer(hl.STEEL_440C, 0.1, RADIUS)]
    return on(hl.rod(layers, elements=20), impact_speed)


def plate_thickness(thickness: float, impact_speed: float) -> hl.CoSimulation:
    """Without edges."""
    return on(hl.infinite_plate(thickness, hl.ALUMINIUM_6061), impact_speed)


def edge(distance: float, impact_speed: float) -> hl.CoSimulation:
    """A clamped edge."""
    plate = hl.half_plane(4.83e-3, hl.ALUMINIUM_6061, "clamped", distance, until=UNTIL, highest_frequency=60e3)
    return on(plate, impact_speed)


def delamination(position: float, impact_speed: float) -> hl.CoSimulation:
    """A square of 20 mm with a quarter of the bending stiffness; the chain is 30 mm from it."""
    weak = hl.Weakened((position, position + 0.02, 0.09, 0.11), factor=0.25)
    supports = hl.Supports(left="clamped", right="clamped")
    plate = hl.kirchhoff_plate(0.2, 0.2, 2.29e-3, hl.ALUMINIUM_6061, supports, additions=[weak])
    return on(hl.reduce(plate.at(0.1, 0.1), until=UNTIL), impact_speed)


def bond(modulus: float, impact_speed: float) -> hl.CoSimulation:
    """0.3 mm of soft glue under 10 mm of steel, on steel."""
    glue = hl.Layer(hl.Material(modulus, 0.35, 1200.0), 0.3e-3, RADIUS)
    layers = [hl.Layer(hl.STEEL_440C, 0.01, RADIUS), glue, hl.Layer(hl.STEEL_440C, 0.1, RADIUS)]
    return on(hl.rod(layers, elements=12), impact_speed)


def loss(coefficient: float, impact_speed: float) -> hl.CoSimulation:
    """A dashpot at each contact."""
    return on(hl.half_space(hl.STEEL_440C), impact_speed, hl.LinearDashpot(coefficient))


class Plates(NamedTuple):
    """Kirchhoff plates of the same modes."""

    modes: hl.ModalPlate

    def __call__(self, distance: float, impact_speed: float) -> hl.CoSimulation:
        """At a distance from the left edge."""
        return on(self.modes.at(distance, MIDDLE), impact_speed)


class EightUnknowns(NamedTuple):
    """A chain with losses on a plate of 0.3 m, clamped at its left and right edges; the same modes serve all."""

    modes: hl.ModalPlate

    def __call__(
        self, distance: float, thickness: float, modulus: float, density: float, impact_speed: float,
        bead_modulus: float, coefficient: float, striker_radius: float,
    ) -> hl.CoSimulation:  # fmt: skip
        """Distance: from the left edge; thickness, modulus and density of the plate; coefficient: of the dashpots."""
        steel = replace(hl.STEEL_440C, youngs_modulus=bead_modulus)
        bead, striker = hl.Sphere(BEAD.radius, steel), hl.Sphere(striker_radius, steel)
        wall = hl.Material(modulus, hl.ALUMINIUM_6061.poisson_ratio, density)
        chain = hl.Chain([bead] * 20, striker, impact_speed, dissipation=hl.LinearDashpot(coefficient))
        return hl.CoSimulation(chain, self.modes.at(distance, 0.12, thickness=thickness, material=wall))


def eight() -> Case:
    """With calibrated sensors: with an unknown gain, speed and moduli would hardly be told apart."""
    thin = hl.kirchhoff_plate(0.3, 0.3, 2.4e-3, hl.ALUMINIUM_6061, EDGES)
    build = EightUnknowns(hl.ModalPlate(thin, UNTIL))
    others = {
        "thickness": 3e-3, "modulus": hl.ALUMINIUM_6061.youngs_modulus, "density": hl.ALUMINIUM_6061.density,
        "bead_modulus": hl.STEEL_440C.youngs_modulus, "coefficient": 4.0, "striker_radius": BEAD.radius,
    }  # fmt: skip
    return Case("distance", build, 0.063, (7, 16), others=others, nuisances=("time_zero",))


def mindlin() -> hl.CoSimulation:
    """The signal of the edge in another theory."""
    plate = hl.mindlin_plate(SIDE, SIDE, 4.83e-3, hl.ALUMINIUM_6061, EDGES)
    return on(hl.reduce(plate.at(0.06, MIDDLE), until=UNTIL), SPEED)


def cylinder() -> hl.CoSimulation:
    """The signal of the rod in three dimensions."""
    layers = [hl.Layer(hl.Material(3.0e9, 0.3, 2200.0), 0.1, RADIUS)]
    return on(hl.reduce(hl.layered_cylinder(layers), until=UNTIL), SPEED)


def cases(chosen: list[str]) -> dict[str, Case]:
    """All, or those chosen."""
    found = {
        "rod modulus": Case("modulus", rod_modulus, 3.0e9),
        "layered rod": Case("modulus", upper_modulus, 1.46e9),
        "plate thickness": Case("thickness", plate_thickness, 3.0e-3),
        "edge distance": Case("distance", edge, 0.06),
        "delamination": Case("position", delamination, 0.13),
        "bond": Case("modulus", bond, 0.3e9),
        "dissipation": Case("coefficient", loss, 6.0, (7, 16)),
        "cylinder, by rod": Case("modulus", rod_modulus, 3.0e9, signal=cylinder, discrepancy=0.01),
        "Mindlin, by Kirchhoff": Case("distance", edge, 0.06, signal=mindlin, discrepancy=0.01),
    }
    found = {name: case for name, case in found.items() if not chosen or any(part in name for part in chosen)}
    if not chosen or any(part in "eight unknowns" for part in chosen):
        found["eight unknowns"] = eight()
    if "Mindlin, by Kirchhoff" in found:
        plate = hl.kirchhoff_plate(SIDE, SIDE, 4.83e-3, hl.ALUMINIUM_6061, EDGES)
        plates = hl.ModalPlate(plate, UNTIL)
        found["Mindlin, by Kirchhoff"] = found["Mindlin, by Kirchhoff"]._replace(build=Plates(plates))
    return found


def clean(case: Case) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Times, and the forces without noise: with a gain, and later than they are."""
    made = case.build(**case.values) if case.signal is None else case.signal()
    run = made.run(UNTIL, save_every=2.5e-7)
    time = np.arange(0.0, LEAD + UNTIL, STEP)
    forces, gain = {}, GAIN if "gain" in case.nuisances else 1.0
    for sensor in case.sensors:
        curve = CubicSpline(run.time.values, hl.sensor_force(run, sensor).values)
        moments = time - LEAD
        forces[sensor] = gain * np.where(moments >= 0.0, curve(np.clip(moments, 0.0, run.time.values[-1])), 0.0)
    return time, forces


def judged(case: Case, draws: int, search: bool) -> dict[str, float]:
    """Bias, spread and coverage; of fits without a guess, or with one."""
    time, forces = clean(case)
    # A region must stay on the plate, and clear of the chain; a basis serves its positions and thicknesses.
    bounds = {"position": (0.115, 0.16), "impact_speed": (0.25, 0.38)}
    if case.others:
        bounds |= {"distance": (0.05, 0.08), "thickness": (2.5e-3, 3.6e-3)}
    part = (0.75, 1.3) if case.others else (0.6, 1.5)
    ranges = {n: bounds.get(n, (part[0] * value, part[1] * value)) for n, value in case.values.items()}
    guess = None if search else {n: value * 1.005 for n, value in case.values.items()}
    known = hl.identifiability(case.build, NOISE, case.sensors, UNTIL, case.nuisances, sample_every=STEP, **case.values)
    values, inside, explained, runs, spent = [], 0.0, 0, 0, process_time()
    for draw in range(draws):
        random = np.random.default_rng(draw)
        noisy = {n: force + random.normal(0.0, NOISE * force.max(), force.size) for n, force in forces.items()}
        found = hl.identify(
            hl.as_signal(time, noisy), case.build, case.nuisances, until=UNTIL, guess=guess,
            discrepancy=case.discrepancy, **ranges,
        )  # fmt: skip
        values.append(found[case.name].value)
        ends = {n: found[n].interval for n in (case.name, *case.others)}
        inside += sum(low <= case.values[n] <= high for n, (low, high) in ends.items()) / len(ends)
        explained += found.explained
        runs += found.runs
    bound = known.bounds[case.name]
    return {
        "bias": (float(np.mean(values)) - case.truth) / case.truth,
        "bound": bound / case.truth,
        "spread": float(np.std(values, ddof=1)) / bound,
        "coverage": inside / draws,
        "explained": explained / draws,
        "runs": runs / draws,
        "seconds": (process_time() - spent) / draws,
    }


def main() -> None:
    """One row for each case."""
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    search, given = "--search" in sys.argv, [word for word in sys.argv[1:] if word != "--search"]
    draws = int(given[0]) if given else 100
    print(f"Python {platform.python_version()}, numpy {np.__version__}; {draws} draws with {100 * NOISE:g} % noise")
    print("case                        bias    bound  spread/bound  inside  explained  runs  s each")
    for name, case in cases(given[1:]).items():
        row = judged(case, draws, search)
        print(
            f"{name:22s} {100 * row['bias']:+7.3f} % {100 * row['bound']:6.3f} % {row['spread']:13.2f} "
            f"{100 * row['coverage']:5.0f} % {100 * row['explained']:8.0f} % {row['runs']:5.0f} {row['seconds']:7.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
