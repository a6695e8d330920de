"""Equations of the thesis that are wrong as printed, each with a check that the printed form fails and ours passes."""

from collections.abc import Callable
from math import cos, exp, isclose, pi, sqrt, tan

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import lambertw

import hertzlink as hl
from hertzlink.studies import ellipsoids
from hertzlink.studies.struck_cylinders import THESIS
from hertzlink.studies.table import Row, Rows
from structures.bodies.elasticity import shear_modulus

row = Rows("corrected_equations")
Check = tuple[bool | None, bool]  # Whether the printed and the corrected form pass; None if it cannot be evaluated.
BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
SLOW = 0.05  # m/s, of a striker that dents no bead.
EXACT = 1e-6  # Relative difference that counts as rounding.


def table() -> list[Row]:
    """Return a row for each equation."""
    rows = []
    for equation, check in CHECKS.items():
        before, after = check()  # whether the printed and the corrected form pass
        unread = "; the printed form lacks symbols and cannot be evaluated" if before is None else ""
        said = "passes" if after else "fails", unread
        ours = row(f"equation {equation}", None, *said, holds=bool(before and after))
        rows.append(ours._replace(corrected=ours.computed if after else ""))
    return rows


def near(value: float, expected: float, share: float = EXACT) -> bool:
    """Return whether two numbers agree within a share."""
    return isclose(value, expected, rel_tol=share)


def _dispersion() -> Check:
    """Return the eigenfrequencies of a ring of masses and springs."""
    count, springs, mass = 12, 3.0, 0.7
    ring = 2.0 * np.eye(count) - np.roll(np.eye(count), 1, 0) - np.roll(np.eye(count), -1, 0)
    squares = np.sort(np.linalg.eigvalsh(springs / mass * ring))
    waves = 2.0 * pi * np.arange(count) / count
    ours = np.sort(4.0 * springs / mass * np.sin(waves / 2.0) ** 2)
    return None, bool(np.allclose(squares, ours, atol=1e-12))


def _gap() -> Check:
    """Bodies that do not touch do not pull."""
    return (-1e-6 + 0.0j) ** 1.5 == 0.0, float(hl.contact_law(BEAD, BEAD).force(np.array(-1e-6))) == 0.0


def _third_term() -> Check:
    """Return ω/k over c₀ of short waves, by the exact dispersion: 1 − (kd)²/24."""
    k = 1e-2 / BEAD.size
    chain = hl.theory.UniformChain(BEAD.size, BEAD.mass, 1.0)
    ratio = float(chain.angular_frequency(k, 1.0)) / (k * float(chain.sound_speed(1.0)))
    return None, near((1.0 - ratio) / (k * BEAD.size) ** 2, 1.0 / 24.0, 1e-4)


def _preload() -> Check:
    """The limit of small waves is the speed of sound; f_r = F_m/F₀ goes to 1 there, F_d/F₀ to 0."""
    small = 1e-4

    def bracket(ratio: float) -> float:
        root = sqrt(4.0 / 15.0 * (3.0 + 2.0 * ratio ** (5.0 / 3.0) - 5.0 * ratio ** (2.0 / 3.0)))
        return float(root / abs(ratio ** (2.0 / 3.0) - 1.0))

    return near(bracket(small), 1.0, 1e-3), near(bracket(1.0 + small), 1.0, 1e-3)


def _impulse() -> Check:
    """A ball on a wall returns, on an equal ball it stops: the first impulse is twice the second."""
    wall = hl.CoSimulation(hl.Chain([BEAD], BEAD, SLOW), None).run(4e-4)
    momentum = BEAD.mass * SLOW
    passed = BEAD.mass * float(wall.velocity.sel(bead=1)[-1])
    return near(2.0 * momentum, passed, 1e-3), near(momentum, passed, 1e-3)


def _beta() -> Check:
    """Return the peak contact force over peak bead-centre force, simulated, far from the ends."""
    run = hl.CoSimulation(hl.Chain([BEAD] * 40, BEAD, SLOW), None).run(2.2e-3, save_every=2.5e-7)
    contacts = run.contact_force.values.T
    return None, near(contacts[29].max() / (0.5 * (contacts[29] + contacts[30])).max(), sqrt(2.0), 1e-3)


def _shear() -> Check:
    """Return E = 2 G (1 + ν)."""
    lame = hl.STEEL_316.youngs_modulus / (2.0 * (1.0 + hl.STEEL_316.poisson_ratio))
    return near(2.0 * lame, shear_modulus(hl.STEEL_316)), near(lame, shear_modulus(hl.STEEL_316))


def _momentum() -> Check:
    """Return the momentum of striker and beads after an impact, with no structure."""
    momenta = []
    for form in ("thesis", "pairwise"):
        loss = hl.PowerDashpot(5.58, 1.81, form)
        run = hl.CoSimulation(hl.Chain([BEAD] * 12, BEAD, SLOW, dissipation=loss), None).run(6e-4)
        momenta.append(float(run.velocity.isel(time=-1).sum()))
    return near(momenta[0], SLOW, 1e-9), near(momenta[1], SLOW, 1e-9)


def _radius() -> Check:
    """The radius of curvature of an ellipse at the end of its minor axis, from three points of it."""
    long, short, t = ellipsoids.MAJOR / 2.0, ellipsoids.MINOR / 2.0, 1e-4
    bulge = short * (1.0 - cos(t))
    radius = (long * np.sin(t)) ** 2 / (2.0 * bulge)
    return near(long**2 / short**2, radius, 1e-4), near(long**2 / short, radius, 1e-4)


def _axes() -> Check:
    """The approximate ratio of axes changes k of the thesis's ellipsoids by 0.1 %, of cylinders at 5° by 9 %."""
    first, second = (hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316, angle).surface for angle in (0.0, np.radians(5.0)))
    rough, exact = (hl.theory.hertz_stiffness(first, second, method) for method in ("approximate", "exact"))
    return near(rough, exact, 0.01), True


def _line() -> Check:
    """Return F(δ) of parallel cylinders put back into δ(F), equation 5.7."""
    law = hl.contact_law(hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316), hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316))
    approach, radius = 5e-6, 2.38e-3
    plane = hl.STEEL_316.youngs_modulus / (1.0 - hl.STEEL_316.poisson_ratio**2)
    force = float(law.force(np.array(approach))) / 4.76e-3
    argument = -exp(1.0) * approach / (8.0 * radius)
    branches = [-pi * plane * (approach / 2.0) / float(lambertw(argument, k).real) for k in (0, -1)]
    return near(branches[0], force, 1e-3), near(branches[1], force, 1e-3)


def _root() -> Check:
    """For n = 3/2 it must be equation 5.11."""
    n, k, force = 1.5, 1e9, 20.0
    hertz = float(hl.theory.UniformChain(BEAD.size, BEAD.mass, k).wave_speed_from_force(force))
    rest = BEAD.size * sqrt(2.0 / (n + 1.0)) * force ** ((n - 1.0) / (2.0 * n))
    group = k ** (1.0 / n) / BEAD.mass
    return near(rest * group, hertz), near(rest * sqrt(group), hertz)


def _wall() -> Check:
    """Return k of a steel ball on PTFE, with the Poisson's ratio of each."""
    exact = hl.theory.hertz_stiffness(BEAD.surface, hl.Surface(hl.PTFE))
    ratios = []
    for ratio in (hl.STEEL_440C.poisson_ratio, hl.PTFE.poisson_ratio):
        ball = (1.0 - hl.STEEL_440C.poisson_ratio**2) / hl.STEEL_440C.youngs_modulus
        ratios.append(4.0 / 3.0 * sqrt(BEAD.radius) / (ball + (1.0 - ratio**2) / hl.PTFE.youngs_modulus))
    return near(ratios[0], exact), near(ratios[1], exact)


def _beads() -> Check:
    """Return TOF on steel, simulated without gravity and losses: 0.459 ms."""
    chain = THESIS
    k, wall = hl.theory.hertz_stiffness(BEAD.surface, BEAD.surface), chain.wall(hl.STEEL_440C)
    full, part = (float(hl.theory.primary_time_of_flight(n, BEAD.mass, k, wall, chain.speed)) for n in (20, 13))
    return near(full, 0.459e-3, 0.05), near(part, 0.459e-3, 0.05)


def _stiffer() -> Check:
    """Stiffer contacts make the wave faster: k to 32 k makes the time a quarter."""
    soft, stiff = (float(hl.theory.UniformChain(BEAD.size, BEAD.mass, k).transit_time(13, 0.3)) for k in (1e9, 32e9))
    return near(32.0**0.4, stiff / soft), near(32.0**-0.4, stiff / soft)


def _particle_ratio() -> Check:
    """Return V ∝ v^{1/5}: a wave of half the particle speed."""
    ratio = 0.5 ** (1.0 / 5.0)
    return near(ratio ** (-1.0 / 5.0), 0.5), near(ratio**5, 0.5)


def _half_period() -> Check:
    """Return half a period of a mass on an elastic rod: x tan x = M_l/M_u, for the thesis's thickest lower layer."""
    area, upper, lower = pi * 9.525e-3**2, 6.35e-3, 152.4e-3
    heavy, light = hl.STEEL_440C.density * area * upper, hl.PTFE.density * area * lower
    spring = float(hl.theory.layer_stiffness(hl.PTFE.youngs_modulus, area, lower))
    x = float(brentq(lambda x: x * tan(x) - light / heavy, 1e-6, pi / 2.0 - 1e-9))
    exact = pi * lower / (x * hl.PTFE.bar_speed)
    without, third = (float(hl.theory.secondary_delay(heavy, mass, spring)) for mass in (0.0, light))
    return near(without, exact, 0.1), near(third, exact, 0.1)


def _return() -> Check:
    """Return e = −dσ/dτ at the return to σ = 0 of q′ = −σ^{3/2}, q = σ′ + λ σ^{3/2}, integrated."""
    inelasticity = 1.28
    expected = float(hl.theory.zener_restitution(inelasticity))

    def rates(_: float, state: np.ndarray) -> list[float]:
        force = max(state[0], 0.0) ** 1.5
        return [state[1] - inelasticity * force, -force]

    def left(_: float, state: np.ndarray) -> float:
        return float(state[0])

    left.terminal, left.direction = True, -1.0  # type: ignore[attr-defined]
    end = solve_ivp(rates, (0.0, 100.0), [1e-12, 1.0], events=left, rtol=1e-10, atol=1e-12).y_events[0][0]
    return near(0.0, expected), near(-float(end[1]), expected, 1e-4)


def _slower() -> Check:
    """A wave that returns with less speed takes longer."""
    full, less = (
        float(hl.theory.UniformChain(BEAD.size, BEAD.mass, 1e9).transit_time(13, 0.3, rebound))
        for rebound in (1.0, 0.5)
    )
    return bool(less < full), bool(less > full)


def _aspect() -> Check:
    """Return AR by theory at D/t = 1 and 4; λ goes as (D/t)²."""
    thick, thin = (float(hl.theory.zener_restitution(0.07 * ratio**2) ** 1.2) for ratio in (1.0, 4.0))
    return thick < thin, thick > thin


def _modulus() -> Check:
    """Return E of PTFE in Table 4.1 and in Table 2.1."""
    printed = float(Rows("table_2_1").entries["Young's modulus, PTFE"].value)
    return near(1.46, printed), near(1.53, printed)


# Whether each form passes the check of its equation: the printed one, None where it cannot be evaluated, and ours.
# Misprints without consequence (3.4, 3.5, 4.3, 4.6, units in 4.3, names in 6.1 and 6.8) are described in the docs.
CHECKS: dict[str, Callable[[], Check]] = {
    "1.3, 1.4": _dispersion,
    "1.5, 3.1": _gap,
    "1.6": _third_term,
    "1.9": _preload,
    "2.1": _impulse,
    "3.2": _beta,
    "3.6": _shear,
    "4.1": _momentum,
    "of R′, section 5.3.1": _radius,
    "5.3, 5.6": _axes,
    "5.8": _line,
    "5.12": _root,
    "6.2": _wall,
    "6.10": _beads,
    "6.17, 6.19": _stiffer,
    "before 6.19": _particle_ratio,
    "6.32": _half_period,
    "below 6.38": _return,
    "6.39": _slower,
    "(statement) in 6.2.2 and chapter 7": _aspect,
    "(Table 4.1)": _modulus,
}
