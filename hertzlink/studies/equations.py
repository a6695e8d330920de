"""Numbers of the thesis that follow from equations alone, and its equations that are wrong as printed.

Each of the latter has a check that the printed form fails and the corrected one passes.
"""

from collections.abc import Iterator
from math import cos, exp, isclose, pi, sin, sqrt, tan

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import lambertw

import hertzlink as hl
from hertzlink.studies.compare import MISPRINT, Number, printed
from hertzlink.studies.shared import BEAD, SPEED, long_waves, wall_stiffness
from structures.bodies.elasticity import shear_modulus

Check = tuple[str, bool | None, bool]
"""The equation; whether its printed and its corrected form pass; None for a form that lacks symbols."""

SLOW = 0.05  # m/s, of a striker that dents no bead.
BEADS, FAR, UNTIL = 40, 30, 2.2e-3  # A long chain, a bead at which the wave has its final form, the record, s.


def closed_forms() -> Iterator[Number]:
    """Yield the constants of sections 1.3, 1.5, 6.1.1 and 6.2.1, computed from the equations of the library."""
    bead, speed = hl.Sphere(4.76e-3, hl.STEEL_316), 1.0
    plane, density = bead.material.youngs_modulus / (1.0 - bead.material.poisson_ratio**2), bead.material.density
    chain = hl.theory.UniformChain(bead.size, bead.mass, plane * sqrt(2.0 * bead.radius) / 3.0)
    twice, once = hl.contact_law(bead, bead).force(np.array([2e-6, 1e-6]))
    yield Number("exponent of Hertz's law", float(np.log2(twice / once)))
    # The group of quantities in equations 1.9 and 1.10, for a force of 1 N.
    group = (4.0 * plane**2 / (bead.size**2 * density**3)) ** (1.0 / 6.0)
    yield Number("factor of the speed with preload, equation 1.9", float(chain.sound_speed(1.0)) / group)
    by_force = float(chain.wave_speed_from_force(1.0)) / group
    yield Number("factor of the speed without preload, equation 1.10", by_force)
    yield Number("width of the wave, equation 1.8", chain.width / bead.size)

    collision = float(hl.theory.hertz_contact_time(1.0, 1.0, speed))
    yield Number("factor of the contact time, equation 6.8", collision)
    moved = float(long_run().velocity.sel(bead=FAR).max()) / SLOW
    yield Number("speed of particles over the striker's, equation 6.16", moved, f"simulated, at bead {FAR}")
    by_particle = hl.theory.UniformChain(BEAD.size, BEAD.mass, 1.0).wave_speed_from_particle_speed(speed)
    group = BEAD.radius * (speed / BEAD.mass**2) ** 0.2
    yield Number("factor of the wave's speed, equation 6.13", float(by_particle) / group)
    one_way = 0.5 * float(hl.theory.UniformChain(1.0, 1.0, 1.0).transit_time(1, speed))
    yield Number("factor of the transit time, equation 6.17", one_way)
    yield Number("factor of the transit there and back, equation 6.20", 2.0 * one_way)
    yield Number("factor of τ_t, equation 6.39", (pi / 2.0) ** 0.4 * one_way)
    yield Number("smallest dimensionless contact time τ_c, equation 6.38", collision)


def long_run() -> xr.Dataset:
    """Return the run of a long chain without a structure."""
    return hl.CoSimulation(hl.Chain([BEAD] * BEADS, BEAD, SLOW), None).run(UNTIL, save_every=2.5e-7)


def numbers() -> Iterator[Number]:
    """Yield each equation: whether only its corrected form passes, or whether it holds under its condition."""
    found = {equation: (before, after) for equation, before, after in checks()}
    for equation, line in printed("equations").items():
        before, after = found[equation]
        unread = "the printed form lacks symbols and cannot be evaluated" if before is None else ""
        yield Number(equation, after and not before if line.kind == MISPRINT else after, unread)


def near(value: float, expected: float, share: float = 1e-6) -> bool:
    return isclose(value, expected, rel_tol=share)


def checks() -> Iterator[Check]:
    """Yield the checks. Misprints without consequence (3.4, 3.5, 4.3, 4.6, names in 6.1 and 6.8) have none."""
    yield from of_chains()
    yield from of_contacts()
    yield from of_walls_and_plates()


def of_chains() -> Iterator[Check]:
    # Frequencies of a ring of equal masses and springs.
    count, spring, mass = 12, 3.0, 0.7
    ring = 2.0 * np.eye(count) - np.roll(np.eye(count), 1, 0) - np.roll(np.eye(count), -1, 0)
    squares = np.sort(np.linalg.eigvalsh(spring / mass * ring))
    dispersion = np.sort(4.0 * spring / mass * np.sin(pi * np.arange(count) / count) ** 2)
    yield "equation 1.3, 1.4", None, bool(np.allclose(squares, dispersion, atol=1e-12))

    # No force at a gap.
    gap = float(hl.contact_law(BEAD, BEAD).force(np.array(-1e-6)))
    yield "equation 1.5, 3.1", (-1e-6 + 0.0j) ** 1.5 == 0.0, gap == 0.0

    # The first term beyond long waves.
    k, chain = 1e-2 / BEAD.size, hl.theory.UniformChain(BEAD.size, BEAD.mass, 1.0)
    slower = 1.0 - float(chain.angular_frequency(k, 1.0)) / (k * float(chain.sound_speed(1.0)))
    yield "equation 1.6", None, near(slower / (k * BEAD.size) ** 2, 1.0 / 24.0, 1e-4)

    # The speed over that of sound, for two ratios of forces: near zero, and near one.
    ratio = np.array([1e-4, 1.0 + 1e-4])
    root = np.sqrt(4.0 / 15.0 * (3.0 + 2.0 * ratio ** (5.0 / 3.0) - 5.0 * ratio ** (2.0 / 3.0)))
    near_zero, near_one = (root / abs(ratio ** (2.0 / 3.0) - 1.0)).tolist()
    yield "equation 1.9", near(near_zero, 1.0, 1e-3), near(near_one, 1.0, 1e-3)

    run = hl.CoSimulation(hl.Chain([BEAD], BEAD, SLOW), None).run(4e-4)
    momentum, passed = BEAD.mass * SLOW, BEAD.mass * float(run.velocity.sel(bead=1)[-1])
    yield "equation 2.1", near(2.0 * momentum, passed, 1e-3), near(momentum, passed, 1e-3)

    before, behind = long_run().contact_force.sel(contact=[FAR, FAR + 1]).transpose("contact", "time").values
    yield "equation 3.2", None, near(before.max() / (0.5 * (before + behind)).max(), sqrt(2.0), 1e-3)

    # The momentum of a free chain.
    passes = []
    for form in ("thesis", "pairwise"):
        lossy = hl.Chain([BEAD] * 12, BEAD, SLOW, dissipation=hl.PowerDashpot(5.58, 1.81, form))
        passes.append(near(float(hl.CoSimulation(lossy, None).run(6e-4).velocity.isel(time=-1).sum()), SLOW, 1e-9))
    yield "equation 4.1", passes[0], passes[1]

    n, k, force = 1.5, 1e9, 20.0
    hertz = float(long_waves(BEAD, k).wave_speed_from_force(force))
    rest, group = BEAD.size * sqrt(2.0 / (n + 1.0)) * force ** ((n - 1.0) / (2.0 * n)), k ** (1.0 / n) / BEAD.mass
    yield "equation 5.12", near(rest * group, hertz), near(rest * sqrt(group), hertz)

    soft, stiff = (float(long_waves(BEAD, k).transit_time(13, 0.3)) for k in (1e9, 32e9))
    yield "equation 6.17, 6.19", near(32.0**0.4, stiff / soft), near(32.0**-0.4, stiff / soft)

    fifth = 0.5 ** (1.0 / 5.0)
    yield "equation before 6.19", near(fifth ** (-1.0 / 5.0), 0.5), near(fifth**5, 0.5)

    full, slower = (float(long_waves(BEAD, 1e9).transit_time(13, 0.3, rebound)) for rebound in (1.0, 0.5))
    yield "equation 6.39", slower < full, slower > full


def of_contacts() -> Iterator[Check]:
    steel, ptfe, alloy = hl.STEEL_440C, hl.PTFE, hl.STEEL_316
    yield "equation (Table 4.1)", near(1.46e9, ptfe.youngs_modulus), near(1.53e9, ptfe.youngs_modulus)

    shear, exact = alloy.youngs_modulus / (2.0 * (1.0 + alloy.poisson_ratio)), shear_modulus(alloy)
    yield "equation 3.6", near(2.0 * shear, exact), near(shear, exact)

    # The curvature of an ellipse at its end, from a point beside it.
    long, short, t = 5.08e-3, 2.36e-3, 1e-4
    radius, equation = (long * sin(t)) ** 2 / (2.0 * short * (1.0 - cos(t))), "equation of R′, section 5.3.1"
    yield equation, near(long**2 / short**2, radius, 1e-4), near(long**2 / short, radius, 1e-4)

    first, second = (hl.Cylinder(2.38e-3, 4.76e-3, alloy, angle).surface for angle in (0.0, np.radians(5.0)))
    rough, exact = (hl.theory.hertz_stiffness(first, second, method) for method in ("approximate", "exact"))
    yield "equation 5.3, 5.6", near(rough, exact, 0.01), True

    bead, approach = hl.Cylinder(2.38e-3, 4.76e-3, alloy), 5e-6
    plane = alloy.youngs_modulus / (1.0 - alloy.poisson_ratio**2)
    force = float(hl.contact_law(bead, bead).force(np.array(approach))) / bead.length
    argument = -exp(1.0) * approach / (8.0 * bead.radius)
    branches = [-pi * plane * (approach / 2.0) / float(lambertw(argument, k).real) for k in (0, -1)]
    yield "equation 5.8", near(branches[0], force, 1e-3), near(branches[1], force, 1e-3)

    ball, exact = (1.0 - steel.poisson_ratio**2) / steel.youngs_modulus, wall_stiffness(BEAD, ptfe)
    steels, walls = (
        4.0 / 3.0 * sqrt(BEAD.radius) / (ball + (1.0 - ratio**2) / ptfe.youngs_modulus)
        for ratio in (steel.poisson_ratio, ptfe.poisson_ratio)
    )
    yield "equation 6.2", near(steels, exact), near(walls, exact)


def of_walls_and_plates() -> Iterator[Check]:
    steel, ptfe = hl.STEEL_440C, hl.PTFE
    pair, on_steel = long_waves(BEAD).stiffness, wall_stiffness(BEAD, steel)
    full, part = (float(hl.theory.primary_time_of_flight(n, BEAD.mass, pair, on_steel, SPEED)) for n in (20, 13))
    yield "equation 6.10", near(full, 0.459e-3, 0.05), near(part, 0.459e-3, 0.05)

    # Half a period of a mass on an elastic rod.
    area, upper, lower = pi * 9.525e-3**2, 6.35e-3, 152.4e-3
    heavy, light = steel.density * area * upper, ptfe.density * area * lower
    spring = ptfe.youngs_modulus * area / lower
    x = float(brentq(lambda x: x * tan(x) - light / heavy, 1e-6, pi / 2.0 - 1e-9))
    exact = pi * lower / (x * ptfe.bar_speed)
    without, third = (float(hl.theory.secondary_delay(heavy, mass, spring)) for mass in (0.0, light))
    yield "equation 6.32", near(without, exact, 0.1), near(third, exact, 0.1)

    # Zener's equation, integrated until the bead leaves.
    inelasticity = 1.28

    def rates(_: float, state: np.ndarray) -> list[float]:
        force = max(state[0], 0.0) ** 1.5
        return [state[1] - inelasticity * force, -force]

    def left(_: float, state: np.ndarray) -> float:
        return float(state[0])

    left.terminal, left.direction = True, -1.0  # type: ignore[attr-defined]
    end = solve_ivp(rates, (0.0, 100.0), [1e-12, 1.0], events=left, rtol=1e-10, atol=1e-12).y_events[0][0]
    restitution = float(hl.theory.zener_restitution(inelasticity))
    yield "equation below 6.38", near(0.0, restitution), near(-float(end[1]), restitution, 1e-4)

    thick, thin = (float(hl.theory.zener_restitution(0.07 * ratio**2) ** 1.2) for ratio in (1.0, 4.0))
    yield "equation (statement) in 6.2.2 and chapter 7", thick < thin, thick > thin
