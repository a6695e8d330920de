"""Equations of the thesis that are wrong as printed, each with a check that the printed form fails and ours passes."""

from collections.abc import Callable, Iterator
from math import cos, exp, isclose, pi, sqrt, tan

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import lambertw

import hertzlink as hl
from hertzlink.studies.compare import MISPRINT, Number, printed
from hertzlink.studies.shared import BEAD, SPEED, wall_stiffness
from structures.bodies.elasticity import shear_modulus

Check = tuple[bool | None, bool]  # Whether the printed and the corrected form pass; None if symbols are missing.
SLOW = 0.05  # m/s, of a striker that dents no bead.
EXACT = 1e-6  # Relative difference that counts as rounding.
PAIR = hl.theory.hertz_stiffness(BEAD.surface, BEAD.surface)


# Misprints without consequence (3.4, 3.5, 4.3, 4.6, units in 4.3, names in 6.1 and 6.8) have no check.
CHECKS: dict[str, Callable[[], Check]] = {}


def numbers() -> Iterator[Number]:
    """Yield each equation: whether only its corrected form passes; whether it holds under its condition."""
    for name, line in printed("equations").items():
        before, after = CHECKS[name.removeprefix("equation ")]()
        misprint = line.kind == MISPRINT
        unread = "the printed form lacks symbols and cannot be evaluated" if before is None else ""
        yield Number(name, after and not before if misprint else after, unread)


def check(equation: str) -> Callable[[Callable[[], Check]], None]:
    """Register the check of an equation; `printed.csv` says what it is."""

    def register(function: Callable[[], Check]) -> None:
        CHECKS[equation] = function

    return register


def near(value: float, expected: float, share: float = EXACT) -> bool:
    """Return whether two numbers agree within a share."""
    return isclose(value, expected, rel_tol=share)


@check("1.3, 1.4")
def _dispersion() -> Check:
    count, springs, mass = 12, 3.0, 0.7
    ring = 2.0 * np.eye(count) - np.roll(np.eye(count), 1, 0) - np.roll(np.eye(count), -1, 0)
    squares = np.sort(np.linalg.eigvalsh(springs / mass * ring))
    ours = np.sort(4.0 * springs / mass * np.sin(pi * np.arange(count) / count) ** 2)
    return None, bool(np.allclose(squares, ours, atol=1e-12))


@check("1.5, 3.1")
def _gap() -> Check:
    return (-1e-6 + 0.0j) ** 1.5 == 0.0, float(hl.contact_law(BEAD, BEAD).force(np.array(-1e-6))) == 0.0


@check("1.6")
def _third_term() -> Check:
    k = 1e-2 / BEAD.size
    chain = hl.theory.UniformChain(BEAD.size, BEAD.mass, 1.0)
    ratio = float(chain.angular_frequency(k, 1.0)) / (k * float(chain.sound_speed(1.0)))
    return None, near((1.0 - ratio) / (k * BEAD.size) ** 2, 1.0 / 24.0, 1e-4)


@check("1.9")
def _preload() -> Check:
    def bracket(ratio: float) -> float:
        root = sqrt(4.0 / 15.0 * (3.0 + 2.0 * ratio ** (5.0 / 3.0) - 5.0 * ratio ** (2.0 / 3.0)))
        return float(root / abs(ratio ** (2.0 / 3.0) - 1.0))

    return near(bracket(1e-4), 1.0, 1e-3), near(bracket(1.0 + 1e-4), 1.0, 1e-3)


@check("2.1")
def _impulse() -> Check:
    run = hl.CoSimulation(hl.Chain([BEAD], BEAD, SLOW), None).run(4e-4)
    momentum, passed = BEAD.mass * SLOW, BEAD.mass * float(run.velocity.sel(bead=1)[-1])
    return near(2.0 * momentum, passed, 1e-3), near(momentum, passed, 1e-3)


@check("3.2")
def _beta() -> Check:
    run = hl.CoSimulation(hl.Chain([BEAD] * 40, BEAD, SLOW), None).run(2.2e-3, save_every=2.5e-7)
    before, behind = run.contact_force.sel(contact=30).values, run.contact_force.sel(contact=31).values
    return None, near(before.max() / (0.5 * (before + behind)).max(), sqrt(2.0), 1e-3)


@check("3.6")
def _shear() -> Check:
    lame = hl.STEEL_316.youngs_modulus / (2.0 * (1.0 + hl.STEEL_316.poisson_ratio))
    return near(2.0 * lame, shear_modulus(hl.STEEL_316)), near(lame, shear_modulus(hl.STEEL_316))


@check("4.1")
def _momentum() -> Check:
    passed = []
    for form in ("thesis", "pairwise"):
        loss = hl.PowerDashpot(5.58, 1.81, form)
        run = hl.CoSimulation(hl.Chain([BEAD] * 12, BEAD, SLOW, dissipation=loss), None).run(6e-4)
        passed.append(near(float(run.velocity.isel(time=-1).sum()), SLOW, 1e-9))
    return passed[0], passed[1]


@check("of R′, section 5.3.1")
def _radius() -> Check:
    long, short, t = 5.08e-3, 2.36e-3, 1e-4
    expected = (long * np.sin(t)) ** 2 / (2.0 * short * (1.0 - cos(t)))
    return near(long**2 / short**2, expected, 1e-4), near(long**2 / short, expected, 1e-4)


@check("5.3, 5.6")
def _axes() -> Check:
    first, second = (hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316, angle).surface for angle in (0.0, np.radians(5.0)))
    rough, exact = (hl.theory.hertz_stiffness(first, second, method) for method in ("approximate", "exact"))
    return near(rough, exact, 0.01), True


@check("5.8")
def _line() -> Check:
    bead, approach = hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316), 5e-6
    plane = hl.STEEL_316.youngs_modulus / (1.0 - hl.STEEL_316.poisson_ratio**2)
    force = float(hl.contact_law(bead, bead).force(np.array(approach))) / bead.length
    argument = -exp(1.0) * approach / (8.0 * bead.radius)
    branches = [-pi * plane * (approach / 2.0) / float(lambertw(argument, k).real) for k in (0, -1)]
    return near(branches[0], force, 1e-3), near(branches[1], force, 1e-3)


@check("5.12")
def _root() -> Check:
    n, k, force = 1.5, 1e9, 20.0
    hertz = float(hl.theory.UniformChain(BEAD.size, BEAD.mass, k).wave_speed_from_force(force))
    rest, group = BEAD.size * sqrt(2.0 / (n + 1.0)) * force ** ((n - 1.0) / (2.0 * n)), k ** (1.0 / n) / BEAD.mass
    return near(rest * group, hertz), near(rest * sqrt(group), hertz)


@check("6.2")
def _wall() -> Check:
    ball = (1.0 - hl.STEEL_440C.poisson_ratio**2) / hl.STEEL_440C.youngs_modulus
    printed_form, ours = (
        4.0 / 3.0 * sqrt(BEAD.radius) / (ball + (1.0 - ratio**2) / hl.PTFE.youngs_modulus)
        for ratio in (hl.STEEL_440C.poisson_ratio, hl.PTFE.poisson_ratio)
    )
    exact = wall_stiffness(BEAD, hl.PTFE)
    return near(printed_form, exact), near(ours, exact)


@check("6.10")
def _beads() -> Check:
    on_steel = wall_stiffness(BEAD, hl.STEEL_440C)
    full, part = (float(hl.theory.primary_time_of_flight(n, BEAD.mass, PAIR, on_steel, SPEED)) for n in (20, 13))
    return near(full, 0.459e-3, 0.05), near(part, 0.459e-3, 0.05)


@check("6.17, 6.19")
def _stiffer() -> Check:
    soft, stiff = (float(hl.theory.UniformChain(BEAD.size, BEAD.mass, k).transit_time(13, 0.3)) for k in (1e9, 32e9))
    return near(32.0**0.4, stiff / soft), near(32.0**-0.4, stiff / soft)


@check("before 6.19")
def _particle_ratio() -> Check:
    ratio = 0.5 ** (1.0 / 5.0)
    return near(ratio ** (-1.0 / 5.0), 0.5), near(ratio**5, 0.5)


@check("6.32")
def _half_period() -> Check:
    area, upper, lower = pi * 9.525e-3**2, 6.35e-3, 152.4e-3
    heavy, light = hl.STEEL_440C.density * area * upper, hl.PTFE.density * area * lower
    spring = float(hl.theory.layer_stiffness(hl.PTFE.youngs_modulus, area, lower))
    x = float(brentq(lambda x: x * tan(x) - light / heavy, 1e-6, pi / 2.0 - 1e-9))
    exact = pi * lower / (x * hl.PTFE.bar_speed)
    without, third = (float(hl.theory.secondary_delay(heavy, mass, spring)) for mass in (0.0, light))
    return near(without, exact, 0.1), near(third, exact, 0.1)


@check("below 6.38")
def _restitution() -> Check:
    inelasticity = 1.28

    def rates(_: float, state: np.ndarray) -> list[float]:
        force = max(state[0], 0.0) ** 1.5
        return [state[1] - inelasticity * force, -force]

    def left(_: float, state: np.ndarray) -> float:
        return float(state[0])

    left.terminal, left.direction = True, -1.0  # type: ignore[attr-defined]
    end = solve_ivp(rates, (0.0, 100.0), [1e-12, 1.0], events=left, rtol=1e-10, atol=1e-12).y_events[0][0]
    expected = float(hl.theory.zener_restitution(inelasticity))
    return near(0.0, expected), near(-float(end[1]), expected, 1e-4)


@check("6.39")
def _slower() -> Check:
    chain = hl.theory.UniformChain(BEAD.size, BEAD.mass, 1e9)
    full, less = (float(chain.transit_time(13, 0.3, rebound)) for rebound in (1.0, 0.5))
    return bool(less < full), bool(less > full)


@check("(statement) in 6.2.2 and chapter 7")
def _aspect() -> Check:
    thick, thin = (float(hl.theory.zener_restitution(0.07 * ratio**2) ** 1.2) for ratio in (1.0, 4.0))
    return thick < thin, thick > thin


@check("(Table 4.1)")
def _modulus() -> Check:
    table_2_1 = float(printed("materials")["Young's modulus, PTFE"].low)
    return near(1.46, table_2_1), near(1.53, table_2_1)
