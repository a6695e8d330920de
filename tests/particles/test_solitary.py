"""Theory of solitary waves: the thesis's constants, limits, scaling, the equation itself, simulated chains."""

from decimal import Decimal, localcontext
from math import cos, pi, sqrt

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import hertzlink as hl
from particles import solitary
from structures.bodies.layers import HERTZ_COLLISION

STEEL = hl.STEEL_316
BEAD = hl.Sphere(2.38e-3, STEEL)
D, M, K = BEAD.size, BEAD.mass, hl.theory.hertz_stiffness(BEAD.surface, BEAD.surface)
MODULUS, DENSITY = STEEL.contact_modulus, STEEL.density
STRIKER_SPEED = 0.5
EXPONENTS = st.floats(1.05, 4.0)


def equation_1_9(total: float, preload: float) -> float:
    """Equation 1.9 without its coefficient, f_r = F_m/F_0."""
    f = total / preload
    root = (4.0 * MODULUS**2 * preload / (D**2 * DENSITY**3)) ** (1.0 / 6.0)
    return float(root / (f ** (2 / 3) - 1.0) * sqrt(4.0 / 15.0 * (3.0 + 2.0 * f ** (5 / 3) - 5.0 * f ** (2 / 3))))


def equation_1_10(force: float) -> float:
    """Equation 1.10 without its coefficient."""
    return float((2.0 * MODULUS / (D * DENSITY**1.5)) ** (1.0 / 3.0) * force ** (1.0 / 6.0))


def transit(restitution: float = 1.0) -> float:
    """Equation 6.17 for 13 beads at 0.31 m/s, in units of N m^{2/5} v^{−1/5} k^{−2/5}."""
    return solitary.UniformChain(D, M, K).transit_time(13, 0.31, restitution) / (13 * M**0.4 * 0.31**-0.2 * K**-0.4)


STEEL_SPHERE = MODULUS**0.4 / DENSITY**0.4 * 0.31**0.2
CONSTANTS = {
    "lwa_speed_coeff_precompressed": (
        0.9314,
        solitary.UniformChain(D, M, K).wave_speed_from_force(40.0, 10.0) / equation_1_9(50, 10),
    ),
    "lwa_speed_coeff": (0.6802, solitary.UniformChain(D, M, K).wave_speed_from_force(20.5) / equation_1_10(20.5)),
    "lwa_width_spheres_D": (5.0, solitary.UniformChain(D, M, K).width / D),
    "contact_time_const": (3.218, HERTZ_COLLISION),
    "vp_over_vstriker": (0.682, solitary.PARTICLE_TO_STRIKER_SPEED),
    "coeff_6_13": (
        1.829,
        solitary.UniformChain(D, M, K).wave_speed_from_particle_speed(0.3) / (D / 2 * (0.3 * K**2 / M**2) ** 0.2),
    ),
    "coeff_6_17": (1.180, transit(0.3) / (1.0 + 0.3**-0.2)),
    "coeff_6_20": (2.361, transit()),
    "coeff_6_39_Tt": (
        1.414,
        solitary.UniformChain(D, M, K).transit_time(13, 0.31, 0.3) / (D * 13 * (1.0 + 0.3**-0.2)) * STEEL_SPHERE,
    ),
    "coeff_6_39_Tc": (0.853, (pi * sqrt(2.0) / 8.0) ** 0.4 * solitary.PARTICLE_TO_STRIKER_SPEED**-0.2),
    "eq_5_13_n1p222": (9.52, solitary.UniformChain(D, M, K, 1.222).width / D),
}


@pytest.mark.parametrize("name", CONSTANTS)
def test_constants_of_the_thesis(name: str) -> None:
    """Rows of theory_constants in facts.yaml: three digits are printed, and they hold (one digit for the width)."""
    printed, found = CONSTANTS[name]
    assert found == pytest.approx(printed, rel=1e-2 if name == "lwa_width_spheres_D" else 5e-4)


@given(st.floats(1e-12, 1e9), EXPONENTS)
def test_preload_loses_no_digits(ratio: float, n: float) -> None:
    """Equation 5.10, for any n, as it is printed but with 60 digits, against F_d/F_0 down to where 5.10 is 0/0."""
    preload = 3.0
    with localcontext() as context:
        context.prec = 60
        one, power = Decimal(1), Decimal(n)
        s = (one + Decimal(ratio * preload) / Decimal(preload)) ** (one / power)
        bracket = float((s ** (power + 1) + power - (power + 1) * s) / (s - one) ** 2)
    expected = D * sqrt(2.0 / (n + 1.0) * K ** (1.0 / n) / M * preload ** ((n - 1.0) / n) * bracket)
    assert solitary.UniformChain(D, M, K, n).wave_speed_from_force(ratio * preload, preload) == pytest.approx(
        expected, rel=1e-12
    )


@given(st.floats(1e-3, 1e3), EXPONENTS)
def test_without_preload_force_and_speed_obey_5_12(force: float, n: float) -> None:
    expected = D * sqrt(2.0 / (n + 1.0)) * sqrt(K ** (1.0 / n) / M) * force ** ((n - 1.0) / (2.0 * n))
    assert solitary.UniformChain(D, M, K, n).wave_speed_from_force(force) == pytest.approx(expected)
    assert solitary.UniformChain(D, M, K, n).wave_speed_from_force(force, force * 1e-40) == pytest.approx(
        expected, rel=1e-9
    )


def test_linear_waves() -> None:
    """Equation 1.4 against the eigenvalue problem of a ring of 12 masses, and its two ends."""
    preload, beads = 30.0, 12
    stiffness = solitary.UniformChain(D, M, K).tangent_stiffness(preload)
    step = 1e-3
    overlap = [((preload + sign * step) / K) ** (2 / 3) for sign in (-1, 1)]
    assert stiffness == pytest.approx(2.0 * step / (overlap[1] - overlap[0]), rel=1e-6)
    ring = 2.0 * np.eye(beads) - np.roll(np.eye(beads), 1, axis=0) - np.roll(np.eye(beads), -1, axis=0)
    exact = np.sqrt(np.linalg.eigvalsh(stiffness / M * ring).clip(0.0))
    numbers = 2.0 * pi * np.arange(beads) / (beads * D)
    found = solitary.UniformChain(D, M, K).angular_frequency(numbers, preload)
    assert np.sort(found) == pytest.approx(exact, abs=1e-6 * exact[-1])
    assert found.max() == pytest.approx(2.0 * sqrt(solitary.UniformChain(D, M, K).tangent_stiffness(preload) / M))
    slow = solitary.UniformChain(D, M, K).angular_frequency(1e-3, preload) / 1e-3
    assert slow == pytest.approx(solitary.UniformChain(D, M, K).sound_speed(preload), rel=1e-9)
    assert solitary.UniformChain(D, M, K, 1.0).sound_speed(preload) == pytest.approx(D * sqrt(K / M))


# Simulations: Chain for spheres, and a chain of another law, preloaded, by an integrator from outside hertzlink.


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    """40 steel spheres of 4.76 mm, struck by another at 0.5 m/s (thesis, section 3.4); nothing behind the last."""
    return hl.CoSimulation(hl.Chain([BEAD] * 40, BEAD, STRIKER_SPEED), None).run(until=3e-4, save_every=2e-7)


def test_speed_of_a_chain_by_5_11(run: xr.Dataset) -> None:
    """569.2 against 562.2 m/s: a wave of five beads is not long, and the bead-to-bead chain is 1.2 % faster."""
    force = float(run.contact_force.sel(contact=16).max())
    speed = solitary.UniformChain(D, M, K).wave_speed_from_force(force)
    assert hl.wave_speed(run, 13, 20) == pytest.approx(speed, rel=0.02)
    assert hl.wave_speed(run, 13, 20) / speed == pytest.approx(1.0122, abs=1e-3)


def test_particle_speed_of_a_chain(run: xr.Dataset) -> None:
    """Equation 6.16, and 6.12 from it: 0.8 % fast."""
    ratio = run.velocity.sel(bead=[15, 20, 25]).max("time") / STRIKER_SPEED
    assert ratio.values == pytest.approx(solitary.PARTICLE_TO_STRIKER_SPEED, rel=1e-3)
    assert ratio.values == pytest.approx(0.6817, rel=3e-4)
    v = float(ratio.mean()) * STRIKER_SPEED
    speed = solitary.UniformChain(D, M, K).wave_speed_from_particle_speed(v)
    assert hl.wave_speed(run, 13, 20) / speed == pytest.approx(0.992, abs=1e-3)


def test_contact_force_over_bead_force(run: xr.Dataset) -> None:
    """β of 3.2 from the chain; Nesterenko's profile, sampled half a bead either side of the crest, gives 1.357."""
    contact = float(run.contact_force.sel(contact=16).max())
    found = contact / float(hl.sensor_force(run, 16).max())
    assert found == pytest.approx(solitary.CONTACT_TO_CENTRE_FORCE, rel=1e-3)
    x = np.linspace(-1.0, 1.0, 2001) * D
    force = [solitary.UniformChain(D, M, K).strain(x + shift, 0.0, 560.0) ** 1.5 for shift in (-D / 2, 0.0, D / 2)]
    by_profile = force[1].max() / (0.5 * (force[0] + force[2])).max()
    assert by_profile == pytest.approx(cos(sqrt(0.1)) ** -6, rel=1e-6)
    assert by_profile == pytest.approx(1.357, abs=1e-3)


def passing(n: float, preload: float, until: float) -> tuple[float, float]:
    """Force above the preload, and speed, of the wave past contacts 40 to 60 of 90 unit masses, D = k = 1, v = 1."""
    beads, overlap = 90, preload ** (1.0 / n)

    def rates(_: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        contacts = np.maximum(overlap - np.diff(y[:beads]), 0.0) ** n
        forces = np.concatenate([[preload], contacts, [preload]])
        return np.concatenate([y[beads:], -np.diff(forces)])

    start = np.zeros(2 * beads)
    start[beads] = 1.0
    solution = solve_ivp(
        rates, (0.0, until), start, "DOP853", rtol=1e-9, atol=1e-11, t_eval=np.arange(0.0, until, 0.02)
    )
    force = np.maximum(overlap - np.diff(solution.y[:beads], axis=0), 0.0) ** n
    peaks = []
    for contact in (40, 60):
        top = int(force[contact].argmax())
        spline = CubicSpline(solution.t[top - 4 : top + 5], force[contact, top - 4 : top + 5])
        moment = max(spline.derivative().roots(extrapolate=False), key=spline)
        peaks.append((float(spline(moment)) - preload, float(moment)))
    return 0.5 * (peaks[0][0] + peaks[1][0]), 20.0 / (peaks[1][1] - peaks[0][1])


@pytest.mark.parametrize(
    ("n", "preload", "until", "share"),
    [
        (1.5, 0.0, 85.0, 1.012), (1.5, 0.01, 85.0, 1.008), (1.5, 0.1, 75.0, 1.003), (1.5, 1.0, 60.0, 0.992),
        (1.222, 0.0, 85.0, 1.003), (2.0, 0.0, 90.0, 1.036),
    ],
)  # fmt: skip
def test_speed_of_preloaded_and_other_chains(n: float, preload: float, until: float, share: float) -> None:
    """5.10 and 5.12 (corrected), F_d/F_0 from 0.4 up: the steeper the law, the shorter the wave, and the faster."""
    force, speed = passing(n, preload, until)
    assert speed / solitary.UniformChain(1.0, 1.0, 1.0, n).wave_speed_from_force(force, preload) == pytest.approx(
        share, abs=1.5e-3
    )
