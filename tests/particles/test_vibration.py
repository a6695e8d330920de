"""Free vibrations of beads: Lamb's frequencies, breathing shells, what the poles lack beyond the modes, bad input."""

from collections.abc import Callable
from math import pi, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import spherical_jn, spherical_yn

import hertzlink as hl
from particles.deformable.vibration import Vibration, vibration
from structures.bodies.elasticity import shear_speed
from structures.material import Material
from structures.structure import Vector

STEEL = hl.STEEL_316
RADIUS = 2.38e-3
OBLATE, PROLATE = (hl.Ellipsoid(2.36e-3, length, STEEL, axis="along") for length in (3.0e-3, 10.16e-3))


def slowness(poisson_ratio: float) -> float:
    """Speed of shear waves over that of pressure waves."""
    return sqrt((1.0 - 2.0 * poisson_ratio) / (2.0 - 2.0 * poisson_ratio))


def waves(order: int, slow: Vector, poisson_ratio: float) -> tuple[Vector, Vector]:
    """Radial motion, times r, and (radial, tangential) tractions, times r²/2μ, of waves of (pressure, shear).

    2 and 2 × 2 numbers, for r ∇ and r ∇×∇×(r ·) of j_l(kr) P_l; slow: r times the wavenumber k of shear waves. A. C.
    Eringen and E. S. Suhubi, Elastodynamics II (1975), section 8.13.
    """
    fast = slow * slowness(poisson_ratio)
    push, after_push, shear, after_shear = (spherical_jn(n, k) for k in (fast, slow) for n in (order, order + 1))
    both = order * (order + 1)
    motion = np.array([order * push - fast * after_push, both * shear])
    radial = [
        (order**2 - order - 0.5 * slow**2) * push + 2.0 * fast * after_push,
        both * ((order - 1) * shear - slow * after_shear),
    ]
    tangential = [(order - 1) * push - fast * after_push, (order**2 - 1 - 0.5 * slow**2) * shear + slow * after_shear]
    return motion, np.array([radial, tangential])


def roots(function: Callable[[Vector], Vector], low: float, high: float) -> list[float]:
    at = np.linspace(low, high, 1000)
    values = function(at)
    changes = np.flatnonzero(values[1:] * values[:-1] < 0.0)
    return [brentq(function, at[i], at[i + 1], xtol=1e-14) for i in changes]


def spheroidal(order: int, poisson_ratio: float) -> list[float]:
    """Lamb's frequencies ωR/c_s up to 12 of a free solid sphere's spheroidal modes, without the rigid motion."""

    def free_surface(slow: Vector) -> Vector:
        (radial, by_shear), (tangential, other) = waves(order, slow, poisson_ratio)[1]
        return radial if order == 0 else radial * other - tangential * by_shear

    return roots(free_surface, 0.5, 12.0)


def breathing(shell: hl.HollowSphere) -> float:
    """Lowest frequency, rad/s, of the purely radial motion of a shell: no traction inside or outside."""
    material = shell.material
    ratio = slowness(material.poisson_ratio)

    def free_surfaces(frequency: Vector) -> Vector:
        rows = []
        for radius in (shell.radius, shell.inner_radius):
            slow = frequency * radius / shear_speed(material)
            fast = slow * ratio
            rows.append([-0.5 * slow**2 * f(0, fast) + 2.0 * fast * f(1, fast) for f in (spherical_jn, spherical_yn)])
        (outer, also_outer), (inner, also_inner) = rows
        return outer * also_inner - inner * also_outer

    thin = thin_breathing(shell)
    return roots(free_surfaces, 0.5 * thin, 2.0 * thin)[0]


def thin_breathing(shell: hl.HollowSphere) -> float:
    """√(2E/ρ(1 − ν)) over the mean radius, rad/s."""
    material, mean = shell.material, 0.5 * (shell.radius + shell.inner_radius)
    return sqrt(2.0 * material.youngs_modulus / (material.density * (1.0 - material.poisson_ratio))) / mean


def own(bead: hl.Sphere, found: Vibration) -> Vector:
    """ωR/c_s."""
    return found.frequencies * bead.radius / shear_speed(bead.material)


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.25, 0.33, 0.45])
def test_lambs_frequencies(poisson_ratio: float) -> None:
    """The ten lowest of all orders together are the sphere's modes, in order, and 1e-4 too high at most."""
    bead = hl.Sphere(RADIUS, Material(200e9, poisson_ratio, 8000.0))
    exact = np.sort(np.concatenate([spheroidal(order, poisson_ratio) for order in range(13)]))[:10]
    off = own(bead, vibration(bead, 10)) / exact - 1.0
    assert np.all(off > 0.0)
    assert np.all(off < 1e-4)


@pytest.mark.thorough
@pytest.mark.parametrize("inner", [0.1, 0.5, 0.75, 0.908, 0.97])
def test_breathing_shells(inner: float) -> None:
    """One mode of the shell is purely radial; where it is thin, ω² = 2E/ρ(1 − ν)R², and all points move equally, but
    the outer surface less, by the wall's own strain, −2ν/(1 − ν) of that along it."""
    shell = hl.HollowSphere(RADIUS, inner * RADIUS, STEEL)
    found = vibration(shell, 16)
    off = np.abs(found.frequencies / breathing(shell) - 1.0)
    assert off.min() < 1e-5
    if inner > 0.9:
        mode = off.argmin()
        assert found.frequencies[mode] == pytest.approx(thin_breathing(shell), rel=0.003)
        share, wall = STEEL.poisson_ratio / (1.0 - STEEL.poisson_ratio), 2.0 * (1.0 - inner) / (1.0 + inner)
        assert found.struck[mode] * sqrt(shell.mass) == pytest.approx(1.0 - share * wall, rel=0.003)
        assert found.section[mode] / sqrt(shell.mass) == pytest.approx(0.25, rel=0.003)


def pole_to_pole(bead: hl.Sphere, slow: float) -> float:
    """Exact motion along the chain, m/N, of one pole of a solid sphere by a harmonic unit force at the other.

    A point force is a sum of pressures (2l + 1)/4πR² P_l; slow: ωR/c_s. The sum alternates: the means of its partial
    sums, taken over and over, settle to 1e-10.
    """
    material, radius = bead.material, bead.radius
    scale = radius / (4.0 * pi * radius**2) * (1.0 + material.poisson_ratio) / material.youngs_modulus
    terms = []
    for order in range(60):
        motion, traction = waves(order, np.array(slow), material.poisson_ratio)
        both = np.linalg.solve(traction, [1.0, 0.0]) if order else np.array([1.0 / traction[0, 0], 0.0])
        terms.append(-scale * (2 * order + 1) * (-1) ** order * float(motion @ both))
    sums = np.cumsum(terms)
    while sums.size > 20:
        sums = 0.5 * (sums[1:] + sums[:-1])
    return float(sums[-1])


@pytest.mark.thorough
@pytest.mark.parametrize("poisson_ratio", [0.0, 0.25, 0.45])
@pytest.mark.parametrize(
    ("modes", "slow", "tolerance"), [(0, 0.05, 1e-4), (4, 0.1, 1e-4), (30, 0.3, 1e-4), (30, 1.0, 1e-3)]
)
def test_answer_of_the_other_pole(poisson_ratio: float, modes: int, slow: float, tolerance: float) -> None:
    """Rigid motion, modes and `cross` together answer as the exact series does: within 1e-4 of what a pole itself gives
    way to slow forces, 1e-3 at a third of the first frequency."""
    bead = hl.Sphere(RADIUS, Material(200e9, poisson_ratio, 8000.0))
    found = vibration(bead, modes)
    square = (slow * shear_speed(bead.material) / RADIUS) ** 2
    by_modes = float(np.sum(found.struck * found.far / (found.frequencies**2 - square)))
    answer = by_modes + found.cross - 1.0 / (bead.mass * square)
    given_way = vibration(bead, 10).compression
    assert answer == pytest.approx(pole_to_pole(bead, slow), rel=0.0, abs=tolerance * given_way)
