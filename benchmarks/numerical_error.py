"""Estimates of `hl.numerical_error` over true errors, for set-ups drawn at random whose solution is known.

    python benchmarks/numerical_error.py [set-ups of each kind]

Before, it prints how far AR of secondary waves on a meshed plate depends on the mesh.


Rods, half-spaces and infinite plates: Runge–Kutta steps of the chain with the exact response of the wall (d'Alembert's
echoes; a dashpot), which share no code with hertzlink. Meshed plates: the infinite plate, or the exact half-plane where
an edge is near; the other edges are too far to matter while the bead touches. Half-planes: more oscillators. Losses:
shorter steps and finer cells.
"""

import sys
import warnings
from collections.abc import Callable
from functools import partial
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numba import njit

import hertzlink as hl
from structures.fineness import finer
from structures.structure import Vector

SEED, SETUPS = 36, 30
BEADS, SENSOR, UNTIL = 14, 7, 1.0e-3
STEPS = 2000
"""Steps of the reference in the shortest contact."""

FINER = 8
"""Times as many windows and steps in runs that stand for the truth."""

FINEST = 4
"""Times as fine oscillators of half-planes."""

METALS = hl.STEEL_440C, hl.ALUMINIUM_6061, hl.BRASS_360
ANOTHER = 1e-5
"""s: a wave that moves by more is another one."""

QUANTITIES = ("amplitude_ratio", "time_of_flight", "contact_time")


class Setup(NamedTuple):
    """A builder of a simulation, and the function that returns the true measures near those of a run."""

    build: Callable[[], hl.CoSimulation]
    truth: Callable[[dict[str, float]], dict[str, float]]


@njit(cache=True)  # type: ignore[untyped-decorator]
def march(
    law: Vector, mass: float, speed: float, impedance: float, echo: float, delay: float, step: float, count: int
) -> Vector:
    """Return the forces in all contacts, count × contacts.

    The wall moves by (I(t) + 2 Σ echoᵏ I(t − k delay))/impedance, with the impulse I of the last contact.
    """
    bodies = law.size
    forces, impulse = np.zeros((count, bodies)), np.zeros(count)
    x, v, total = np.zeros(bodies), np.zeros(bodies), 0.0
    v[0] = speed
    dx, dv, force = np.zeros((4, bodies)), np.zeros((4, bodies)), np.zeros(bodies)
    dt = np.zeros(4)
    for n in range(count):
        impulse[n] = total
        for stage in range(4):
            ahead = 0.0 if stage == 0 else (step if stage == 3 else 0.5 * step)
            xs, vs, it = x.copy(), v.copy(), total
            if stage > 0:
                xs += ahead * dx[stage - 1]
                vs += ahead * dv[stage - 1]
                it += ahead * dt[stage - 1]
            wall, sign, past = it, 1.0, n * step + ahead - delay
            while past > 0.0:
                sign *= echo
                k = min(int(past / step), n - 1)
                s = past / step - k
                a, b = impulse[k], impulse[k + 1]
                fa, fb = step * forces[k, -1], step * forces[k + 1, -1]
                late = a + s * (fa + s * ((3.0 * (b - a) - 2.0 * fa - fb) + s * (2.0 * (a - b) + fa + fb)))
                wall += 2.0 * sign * late
                past -= delay
            for i in range(bodies):
                beyond = wall / impedance if i == bodies - 1 else xs[i + 1]
                deep = max(xs[i] - beyond, 0.0)
                force[i] = law[i] * deep * np.sqrt(deep)
            for i in range(bodies):
                before = force[i - 1] if i else 0.0
                dx[stage, i], dv[stage, i] = vs[i], (before - force[i]) / mass
            dt[stage] = force[-1]
            if stage == 0:
                forces[n] = force
        x += step / 6.0 * (dx[0] + 2.0 * dx[1] + 2.0 * dx[2] + dx[3])
        v += step / 6.0 * (dv[0] + 2.0 * dv[1] + 2.0 * dv[2] + dv[3])
        total += step / 6.0 * (dt[0] + 2.0 * dt[1] + 2.0 * dt[2] + dt[3])
    return forces


def exact(
    bead: Any, speed: float, wall: hl.Material, impedance: float, echo: float, delay: float, near: dict[str, float]
) -> dict[str, float]:
    """Return the measures of the reference."""
    own, other = bead.material.contact_modulus, wall.contact_modulus
    between = 2.0 / 3.0 * own * (bead.radius / 2.0) ** 0.5
    last = 4.0 / 3.0 / (1.0 / own + 1.0 / other) * bead.radius**0.5
    law = np.append(np.full(BEADS, between), last)
    # Hertz's time of a collision of two beads.
    shortest = 2.943 * (5.0 / 4.0 * bead.mass / 2.0 / max(between, last)) ** 0.4 / speed**0.2
    step = shortest / STEPS
    forces = march(law, bead.mass, speed, impedance, echo, delay, step, int(UNTIL / step) + 1)
    return measures(step, forces, near)


def measures(step: float, forces: Vector, near: dict[str, float]) -> dict[str, float]:
    """Return AR, TOF and contact time; near: the same, roughly."""
    mean = 0.5 * (forces[:, SENSOR - 1] + forces[:, SENSOR])
    first = int(mean[: int(forces[:, -1].argmax())].argmax())
    about = first + round(near["time_of_flight"] / step)
    reach = int(5e-6 / step)
    second = about - reach + int(mean[about - reach : about + reach].argmax())
    tops = [peak(mean, place) for place in (first, second)]
    last = forces[:, -1]
    level = 0.01 * last.max()
    above = last > level
    start = int(above.argmax())
    end = start + int((~above[start:]).argmax())
    crossings = [i - 1 + (level - last[i - 1]) / (last[i] - last[i - 1]) for i in (start, end)]
    return {
        "amplitude_ratio": tops[1][0] / tops[0][0],
        "time_of_flight": step * (tops[1][1] - tops[0][1]),
        "contact_time": step * (crossings[1] - crossings[0]),
    }


def peak(values: Vector, place: int) -> tuple[float, float]:
    """Return the height and the place of the top of the quartic through values near it."""
    near = np.polynomial.Polynomial.fit(np.arange(-6, 7), values[place - 6 : place + 7], 4)
    tops = [float(root.real) for root in near.deriv().roots() if abs(root.imag) < 1e-9 and abs(root.real) < 2.0]
    return float(near(tops[0])), place + tops[0]


def finely(build: Callable[..., hl.CoSimulation], cells: int = 1) -> dict[str, float]:
    """Return the measures of a run in windows and steps that are FINER times as short, on cells so many times finer."""
    with finer(cells=cells, tolerance=1.0 if cells == 1 else 1e-2):
        simulation = build()
    plan = simulation.plan(UNTIL)
    steps = simulation.chain.steps(plan.length)
    short = simulation.replace(window=plan.length / FINER, dt=plan.length / steps / FINER)
    run = short.run(UNTIL, plan.interval / FINER, sensors=[SENSOR, BEADS])
    return {name: float(getattr(hl, name)(run, *() if name == "contact_time" else (SENSOR,))) for name in QUANTITIES}


def between(random: np.random.Generator, low: float, high: float) -> float:
    return float(low * (high / low) ** random.random())


def chain(random: np.random.Generator) -> tuple[Any, float, hl.Chain, str]:
    """Return a bead, the impact speed, the chain, and the accuracy of its runs."""
    bead = hl.Sphere(between(random, 2e-3, 8e-3), METALS[random.integers(3)])
    speed = between(random, 0.1, 1.0)
    accuracy = str(random.choice(["screening", "default"]))
    return bead, speed, hl.Chain([bead] * BEADS, bead, speed), accuracy


def half_space(random: np.random.Generator) -> Setup:
    bead, speed, beads, accuracy = chain(random)
    wall = (*METALS, hl.PTFE)[random.integers(4)]
    build = lambda: hl.CoSimulation(beads, hl.half_space(wall), accuracy=accuracy)  # noqa: E731
    return Setup(build, partial(exact, bead, speed, wall, np.inf, 0.0, np.inf))


def infinite_plate(random: np.random.Generator) -> Setup:
    bead, speed, beads, accuracy = chain(random)
    wall, thickness = METALS[random.integers(3)], bead.radius * between(random, 0.8, 2.5)
    build = lambda: hl.CoSimulation(beads, hl.infinite_plate(thickness, wall), accuracy=accuracy)  # noqa: E731
    return Setup(build, partial(exact, bead, speed, wall, impedance(wall, thickness), 0.0, np.inf))


def impedance(wall: hl.Material, thickness: float) -> float:
    """Return 8 √(D ρ t)."""
    rigidity = wall.youngs_modulus * thickness**3 / 12.0 / (1.0 - wall.poisson_ratio**2)
    return float(8.0 * (rigidity * wall.density * thickness) ** 0.5)


def rod(random: np.random.Generator, largest: int = 300) -> Setup:
    bead, speed, beads, accuracy = chain(random)
    wall, base = (*METALS, hl.PTFE)[random.integers(4)], str(random.choice(["fixed", "free"]))
    layer = hl.Layer(wall, between(random, 0.02, 0.2), bead.radius * between(random, 1.0, 3.0))
    travel = layer.length / wall.bar_speed
    elements = max(2, round(travel / between(random, 1e-6, 1e-5)))
    tolerance = between(random, 1e-2, 0.5)

    def build() -> hl.CoSimulation:
        body = hl.rod([layer], base, elements)
        return hl.CoSimulation(beads, hl.reduce(body, UNTIL, tolerance, largest), accuracy=accuracy)

    z = wall.density * wall.bar_speed * pi * layer.radius**2
    return Setup(build, partial(exact, bead, speed, wall, z, 1.0 if base == "free" else -1.0, 2.0 * travel))


def plate(random: np.random.Generator, edge: str = "") -> Setup:
    bead, speed, beads, accuracy = chain(random)
    wall, thickness = METALS[random.integers(3)], bead.radius * between(random, 0.8, 2.5)
    side, frequency, tolerance = 0.4, between(random, 20e3, 60e3), between(random, 1e-2, 0.5)
    away = between(random, 8e-3, 60e-3) if edge else side / 2.0
    left = edge or "free"

    def build() -> hl.CoSimulation:
        supports = hl.Supports(left, "free", "free", "free")
        body = hl.kirchhoff_plate(side, side, thickness, wall, supports, highest_frequency=frequency)
        return hl.CoSimulation(beads, hl.reduce(body.at(away, side / 2.0), UNTIL, tolerance), accuracy=accuracy)

    if not edge:
        return Setup(build, partial(exact, bead, speed, wall, impedance(wall, thickness), 0.0, np.inf))
    body = partial(hl.half_plane, thickness, wall, edge, away, UNTIL)
    return Setup(build, lambda near: finely(lambda: hl.CoSimulation(beads, body(), accuracy=accuracy), FINEST))


def half_plane(random: np.random.Generator) -> Setup:
    _, _, beads, accuracy = chain(random)
    wall, thickness = METALS[random.integers(3)], between(random, 2e-3, 6e-3)
    edge, away = str(random.choice(["clamped", "simple", "free"])), between(random, 8e-3, 60e-3)
    body = partial(hl.half_plane, thickness, wall, edge, away, UNTIL)
    build = lambda: hl.CoSimulation(beads, body(), accuracy=accuracy)  # noqa: E731
    return Setup(build, lambda near: finely(build, FINEST))


def lossy(random: np.random.Generator) -> Setup:
    """Return a set-up of the kinds above with losses; its truth is a run in shorter steps, on finer cells."""
    setup = (half_space, rod, plate)[random.integers(3)](random)
    losses = (
        hl.LinearDashpot(between(random, 0.5, 8.0)), hl.KuwabaraKono(between(random, 1e-7, 2e-6)),
        hl.Restitution(between(random, 0.8, 0.98)), hl.MassProportional(between(random, 20.0, 500.0)),
    )  # fmt: skip
    loss = losses[random.integers(4)]

    def build() -> hl.CoSimulation:
        usual = setup.build()
        chain: Any = usual.chain.chain
        return usual.replace(chain=hl.Chain(chain.beads, chain.striker, chain.impact_speed, dissipation=loss))

    return Setup(build, lambda near: finely(build, FINEST))


KINDS: dict[str, Callable[[np.random.Generator], Setup]] = {
    "half-space": half_space,
    "infinite plate": infinite_plate,
    "rod": rod,
    "rod, few oscillators": lambda random: rod(random, int(random.integers(4, 12))),
    "half-plane": half_plane,
    "with losses": lossy,
    "mesh of the infinite plate": plate,
    "mesh, an edge near": lambda random: plate(random, str(random.choice(["clamped", "simple", "free"]))),
}


def ratios(kind: str, number: int) -> list[tuple[float, float, float, float]] | None:
    """Return the true error, and estimates over it: the margin, the part of time, those of mesh and reduction together.

    None where no wave, or another one, returns; NaN where nothing has a mesh.
    """
    setup, found = KINDS[kind](np.random.default_rng([SEED, number])), []
    error = hl.numerical_error(setup.build, UNTIL, SENSOR)
    if not set(QUANTITIES) <= set(error.values) or error.margins["time_of_flight"] > ANOTHER:
        return None
    truth, in_time = setup.truth(error.values), finely(setup.build)
    for name in QUANTITIES:
        time, *others = (part[name] for part in error.parts.values())
        true, of_time = error.values[name] - truth[name], error.values[name] - in_time[name]
        in_space = sum(others) / (in_time[name] - truth[name]) if any(others) else np.nan
        found.append((abs(true), error.margins[name] / abs(true), (1.0 - FINER**-2.0) * time / of_time, in_space))
        texts = "".join(f"{number:+10.1e}" for number in (true, *found[-1][1:], time, *others))
        print(f"{kind:26} {number:3} {name:16} {texts}", flush=True)
    return found


def secondary_waves() -> None:
    """Print AR of both waves on a plate with the default mesh and with finer ones."""
    bead = hl.Sphere(4.5e-3, hl.STEEL_440C)
    beads = hl.Chain([bead] * 32, bead, 1.0)
    for frequency in (40e3, 120e3, 480e3):
        wall = hl.kirchhoff_plate(0.4, 0.3, 7.58e-3, hl.ALUMINIUM_6061, hl.Supports(), highest_frequency=frequency)
        run = hl.CoSimulation(beads, wall.at(0.1, 0.15)).run(3e-3)
        for sensor in (19, 27):
            waves = hl.reflections(run, sensor)
            ratios = waves.primary.amplitude_ratio, waves.secondary.amplitude_ratio
            print(f"mesh for {1e-3 * frequency:.0f} kHz, bead {sensor}: AR {ratios[0]:.5f}, secondary {ratios[1]:.5f}")


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else SETUPS
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    secondary_waves()
    drawn = {kind: [ratios(kind, number) for number in range(count)] for kind in KINDS}
    drawn["all"] = [one for many in drawn.values() for one in many]
    for place, name in enumerate(QUANTITIES):
        print(f"\n| {name} | set-ups | median error | margin | time | mesh and reduction |\n|{'---|' * 6}")
        for kind, many in drawn.items():
            true, *ratio = np.array([one[place] for one in many if one is not None]).T
            print(f"| {kind} | {true.size} | {np.median(true):.1e} | {' | '.join(map(spread, ratio))} |")


def spread(ratio: Vector) -> str:
    """Return the part of ratios between 0.5 and 2, and the least and the greatest one."""
    ratio = ratio[~np.isnan(ratio)]
    if not ratio.size:
        return "none"
    inside = 100.0 * ((ratio >= 0.5) & (ratio <= 2.0)).mean()
    return f"{inside:.0f} %, {ratio.min():.2g} to {ratio.max():.2g}"


if __name__ == "__main__":
    main()
