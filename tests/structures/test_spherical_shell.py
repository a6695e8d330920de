"""Spherical shells under pressure: an independent series, closed forms, limits, conservation, bad input."""

import re
import warnings
from collections.abc import Callable
from functools import partial
from math import pi

import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh, splu

import hertzlink as hl
from structures.damping import stiffness_parts
from tests.independent.shells import Ball

RADIUS, WALL, PATCH = 33e-3, 3.5e-3, 3e-3
RUBBER = hl.Material(4e6, 0.45, 1100.0, "rubber")
CONSTANTS = (RADIUS, WALL, RUBBER.youngs_modulus, RUBBER.poisson_ratio, RUBBER.density)
VACUUM_OUTSIDE = {"ambient": 1e9, "heat_capacity_ratio": 0.0}
"""So that any pressure is allowed, and the gas adds nothing."""


def ball(pressure: float = 0.0, **given: object) -> hl.Structure:
    usual = {"base": "free", "patch_radius": PATCH, "highest_frequency": 5e3, **VACUUM_OUTSIDE}
    return hl.spherical_shell(RADIUS, WALL, RUBBER, pressure, **usual | given)


def metal(thickness: float, pressure: float = 0.0, **given: object) -> hl.Structure:
    usual = {"base": "free", **VACUUM_OUTSIDE}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hl.HertzlinkWarning)  # steel yields long before
        return hl.spherical_shell(0.1, thickness, hl.STEEL_316, pressure, **usual | given)


def displaced(structure: hl.Structure, rate: float = 0.0) -> float:
    """Laplace transform at `rate`, 1/s, of what a unit impulse moves the contact by, m/N, without flexibility."""
    stiffness = sparse.csc_array(structure.stiffness + rate**2 * structure.mass)
    return float(structure.contact @ splu(stiffness).solve(structure.contact))


def frequencies(structure: hl.Structure, count: int, near: float = 0.0) -> np.ndarray:
    """Angular frequencies, rad/s, next to one, in order."""
    mass, stiffness = sparse.csc_array(structure.mass), sparse.csc_array(structure.stiffness)
    values = eigsh(stiffness, count, M=mass, sigma=near**2 - 1e6, return_eigenvectors=False)
    return np.sqrt(np.maximum(np.sort(values), 0.0))


@pytest.mark.parametrize("pressure", [0.0, 80e3, -25e3])
@pytest.mark.parametrize("rate", [2e3, 2e4])
def test_a_tap_by_an_independent_series(pressure: float, rate: float) -> None:
    """Exact along the meridian: stress of the wall, the pressure that follows it, and the gas inside."""
    bulk = 1.4 * (101325.0 + pressure)
    exact = Ball(*CONSTANTS, pressure, bulk).receptance(PATCH, rate, 300)
    found = displaced(ball(pressure, ambient=101325.0, heat_capacity_ratio=1.4, cells=6), rate)
    assert found == pytest.approx(exact, rel=1e-3)


def test_the_mesh_converges() -> None:
    """Towards the series, faster than with order 1 in `cells`; the patch's edge is refined by `cells` too."""
    exact = Ball(*CONSTANTS, 80e3).receptance(PATCH, 2e3, 400)
    errors = [abs(displaced(ball(80e3, cells=cells), 2e3) / exact - 1.0) for cells in (1, 2, 4)]
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2]
    assert errors[2] < 1e-3


@pytest.mark.parametrize("pressure", [0.0, -20e3, 80e3])
def test_frequencies_by_the_series(pressure: float) -> None:
    series = Ball(*CONSTANTS, pressure)
    squares = np.sort(np.concatenate([series.frequencies(n, 3) for n in range(12)]))
    assert abs(squares[0]) < 1e-6 * squares[1]  # the motion of the whole ball
    assert frequencies(ball(pressure), 8)[1:] == pytest.approx(np.sqrt(squares[1:8]), rel=2e-3)


def test_frequencies_of_a_thin_shell() -> None:
    """Bending and stretching without shear: the lower branch of Junger, Feit, Sound, Structures and Their Interaction,
    2nd ed. (1986), equation 7.114; Ω² in ω²ρR²(1 − ν²)/E.
    """
    thickness, steel = 1e-3, hl.STEEL_316
    middle, nu = 0.1 - 0.5 * thickness, steel.poisson_ratio
    bending, n = thickness**2 / (12.0 * middle**2), np.arange(2, 7)
    turns = n * (n + 1.0)
    linear = 1.0 + 3.0 * nu + turns - bending * (1.0 - nu - turns**2 - nu * turns)
    constant = (turns - 2.0) * (1.0 - nu**2)
    constant = constant + bending * (turns**3 - 4.0 * turns**2 + turns * (5.0 - nu**2) - 2.0 * (1.0 - nu**2))
    squared = 0.5 * (linear - np.sqrt(linear**2 - 4.0 * constant))
    exact = np.sqrt(squared * steel.youngs_modulus / (steel.density * (1.0 - nu**2))) / middle
    assert frequencies(metal(thickness), 6)[1:] == pytest.approx(exact, rel=1e-3)


def test_breathing_of_a_thick_sphere() -> None:
    """u = d/dρ [(A sin kρ + B cos kρ)/ρ] with no radial stress on both surfaces, k = ω/c_p."""
    thickness, m = 0.04, hl.ALUMINIUM_6061
    shear = m.youngs_modulus / (2.0 * (1.0 + m.poisson_ratio))
    lame = 2.0 * shear * m.poisson_ratio / (1.0 - 2.0 * m.poisson_ratio)
    speed = np.sqrt((lame + 2.0 * shear) / m.density)

    def stresses(k: float, rho: float) -> list[float]:
        """(λ + 2μ) u′ + 2λ u/ρ of both solutions f″ = −k² f of f = ρ φ, u = φ′."""
        found = []
        for f, df in ((np.sin(k * rho), k * np.cos(k * rho)), (np.cos(k * rho), -k * np.sin(k * rho))):
            u = df / rho - f / rho**2
            du = -(k**2) * f / rho - 2.0 * df / rho**2 + 2.0 * f / rho**3
            found.append((lame + 2.0 * shear) * du + 2.0 * lame * u / rho)
        return found

    def determinant(k: float) -> float:
        return float(np.linalg.det([stresses(k, 0.1), stresses(k, 0.1 - thickness)]))

    thin = np.sqrt(2.0 * m.youngs_modulus / (m.density * (1.0 - m.poisson_ratio))) / 0.08
    exact = brentq(determinant, 0.8 * thin / speed, 1.2 * thin / speed) * speed
    body = hl.spherical_shell(0.1, thickness, m, base="free", highest_frequency=6e4, **VACUUM_OUTSIDE)
    found = frequencies(body, 6, near=exact)
    assert abs(found / exact - 1.0).min() < 1e-4


def test_a_thin_shell_under_a_force_is_that_of_shallow_shells() -> None:
    """Reissner, and Vella et al. under pressure. What shear and the patch add hardly depends on the pressure."""
    pressures = np.array([-0.8, 0.0, 1.0, 3.0]) * hl.theory.ThinSphere(0.1, 5e-4, hl.STEEL_316).buckling_pressure
    exact = np.array([1.0 / hl.theory.ThinSphere(0.1, 5e-4, hl.STEEL_316).point_stiffness(one) for one in pressures])
    bodies = [metal(5e-4, one, base="fixed") for one in pressures]
    found = np.array([displaced(one) + one.flexibility for one in bodies])
    assert found == pytest.approx(exact, rel=0.03)
    assert found - found[1] == pytest.approx(exact - exact[1], rel=0.03)


def test_closed_forms() -> None:
    """Their integral by quadrature, and where the formula changes its form."""
    from scipy.integrate import quad

    middle, steel = 0.1 - 5e-4, hl.STEEL_316
    bending = steel.youngs_modulus * 1e-9 / (12.0 * (1.0 - steel.poisson_ratio**2))
    for pressure in (-20e6, -1.0, 1e6, 23.5e6, 60e6):

        def moved(k: float, pressure: float = pressure) -> float:
            spring = steel.youngs_modulus * 1e-3 / middle**2
            return k / (bending * k**4 + 0.5 * pressure * middle * k**2 + spring) / (2.0 * pi)

        exact = 1.0 / quad(moved, 0.0, 2e4, limit=500)[0]
        assert hl.theory.ThinSphere(0.1, 1e-3, steel).point_stiffness(pressure) == pytest.approx(exact, rel=1e-3)
    around = [hl.theory.ThinSphere(0.1, 1e-3, steel).buckling_pressure * (1.0 + step) for step in (-2e-6, 0.0, 2e-6)]
    low, same, high = (hl.theory.ThinSphere(0.1, 1e-3, steel).point_stiffness(one) for one in around)
    assert same == pytest.approx(0.5 * (low + high), rel=1e-9)


def refused(build: Callable[[], hl.Structure]) -> float:
    """The part of the pressure at which the wall buckles, from the error that says so."""
    with pytest.raises(ValueError, match="at which the wall buckles") as error:
        build()
    given, critical = re.findall(r"-[\d.e+]+", str(error.value))
    return float(critical) / float(given)


@pytest.mark.parametrize("base", ["fixed", "free", "contact"])
def test_buckling(base: str) -> None:
    """Zoelly's pressure for a thin wall, and the series for any."""
    critical = hl.theory.ThinSphere(0.1, 1e-3, hl.STEEL_316).buckling_pressure
    assert refused(partial(metal, 1e-3, -2.0 * critical, base=base)) == pytest.approx(0.5, rel=0.01)
    factor = Ball(*CONSTANTS, -1e5).buckling_factor(range(2, 40))
    assert refused(partial(ball, -1e5, base="free")) == pytest.approx(factor, rel=1e-3)
    assert ball(-0.99 * factor * 1e5, base="free").size > 0


def test_neither_pressure_nor_gas_resists_a_motion_of_the_whole_ball() -> None:
    body = ball(80e3, ambient=101325.0, heat_capacity_ratio=1.4)
    mass, stiffness = sparse.csc_array(body.mass), sparse.csc_array(body.stiffness)
    values, modes = eigsh(stiffness, 2, M=mass, sigma=-1e6)
    lowest = int(values.argmin())
    assert abs(values[lowest]) < 1e-6 * values.max()
    assert body.field is not None
    moved = body.field.displacement(modes[:, lowest])
    across, along = abs(moved[:, :2]).max(), moved[:, 2]
    assert across < 1e-6 * abs(along).max()
    assert along == pytest.approx(np.full(len(along), along[0]), rel=1e-6)
    assert abs(body.contact @ modes[:, lowest]) == pytest.approx(abs(along[0]), rel=1e-6)


@pytest.mark.parametrize("ratio", [0.0, 1.4])
def test_the_gas_is_a_spring(ratio: float) -> None:
    """Of the bulk modulus κ p: it raises the frequency of breathing."""
    exact = np.sqrt(Ball(*CONSTANTS, 0.0, ratio * 101325.0).frequencies(0, 1)[0])
    found = frequencies(ball(ambient=101325.0, heat_capacity_ratio=ratio), 4, near=exact)
    assert abs(found / exact - 1.0).min() < 1e-5


def test_without_pressure_the_stiffness_is_that_of_the_wall() -> None:
    body = ball()
    (wall,) = stiffness_parts(body)
    assert abs(body.stiffness - wall).max() == 0.0
    assert (ball(1e3).stiffness - ball(-1e3).stiffness - (ball(2e3).stiffness - body.stiffness)).max() < 1e-6


def test_two_chains_from_both_sides() -> None:
    """Both poles are alike: a force on either moves the other by as much, and equal taps push the ball nowhere."""
    body = ball(80e3, base="contact")
    stiffness = sparse.csc_array(body.stiffness + 1e6 * body.mass)
    answer = body.contact.T @ splu(stiffness).solve(body.contact)
    assert answer[0, 0] == pytest.approx(answer[1, 1], rel=1e-6)
    assert answer[0, 1] == pytest.approx(answer[1, 0], rel=1e-9)
    bead = hl.Sphere(9.525e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 4, bead, impact_speed=0.1)
    run = hl.CoSimulation([chain, chain], hl.reduce(body, until=3e-3, pulse=1e-3)).run(until=3e-3)
    first, second = (run.contact_force.isel(chain=i).values for i in (0, 1))
    assert first == pytest.approx(second, abs=1e-4 * first.max())


def test_energy_and_input() -> None:
    """Energy is conserved under pressure, and the input of a run rebuilds the ball to the same bits."""
    bead = hl.Sphere(9.525e-3, hl.STEEL_440C)
    body = hl.reduce(ball(80e3, base="fixed"), until=3e-3, pulse=1e-3)
    run = hl.CoSimulation(hl.Chain([bead] * 4, bead, 0.1), body).run(until=3e-3)
    assert hl.energy_error(run) < 1e-6
    assert hl.from_input(run).run().identical(run)


def test_a_held_ball_is_stiffer_where_more_of_it_is_held() -> None:
    moved = [displaced(ball(base="fixed", seat=seat)) for seat in (0.1, 0.5, 1.5)]
    assert moved[0] > moved[1] > moved[2]


def test_what_may_mislead_is_said() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="pressure = 300 kPa: stretches the wall by 18 %"):
        ball(3e5)
    # p R/2t with the mean radius R of the wall.
    for radius, wall, pressure, told in ((0.1, 1e-3, 1e7, "498 MPa"), (0.01, 3e-3, -2e8, "283 MPa")):
        with pytest.warns(hl.HertzlinkWarning, match=rf"stresses steel 316 to {told}, beyond its yield strength"):
            hl.spherical_shell(radius, wall, hl.STEEL_316, pressure, ambient=2e8)
    with warnings.catch_warnings():
        warnings.simplefilter("error", hl.HertzlinkWarning)
        hl.spherical_shell(0.01, 3e-3, hl.STEEL_316, -1e8, ambient=2e8)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"radius": 33.0}, r"radius = 33\.0: must be at most 5 m; is it in millimetres\?"),
        ({"radius": -1.0}, r"radius = -1\.0"),
        (
            {"thickness": 0.033},
            r"thickness = 0\.033: must lie between 0\.001 and 0\.9 of the radius, 3\.3e-05 and 0\.0297 m",
        ),
        ({"thickness": 1e-6}, r"thickness = 1e-06: must lie between"),
        ({"material": "rubber"}, "material = 'rubber'"),
        ({"pressure": "80 kPa"}, "pressure = '80 kPa'"),
        (
            {"pressure": -2e5, "ambient": 101325.0},
            r"pressure = -200000\.0: must be at least -101325 Pa, as ambient is 101325 Pa",
        ),
        ({"pressure": 1e8}, r"pressure = 1.*\.0: must be at most 1\.6.*e\+06 Pa, which would stretch the wall"),
        ({"ambient": -1.0}, r"ambient = -1\.0"),
        ({"ambient": 1e12}, r"ambient = 1.*\.0: must lie between 0 and 1e\+09 Pa"),
        ({"heat_capacity_ratio": 1.4e5}, r"heat_capacity_ratio = 140000\.0: must lie between 0 and 5"),
        ({"heat_capacity_ratio": -1.4}, r"heat_capacity_ratio = -1\.4"),
        ({"base": "clamped"}, "base = 'clamped': must be one of 'fixed', 'free', 'contact'"),
        ({"seat": 30.0}, r"seat = 30\.0: must lie between 0\.02 and π/2, in rad; for 30° write math\.radians\(30\)"),
        ({"seat": 0.0}, r"seat = 0\.0"),
        ({"patch_radius": 0.02}, r"patch_radius = 0\.02: must not exceed half the radius, 0\.0165 m"),
        ({"highest_frequency": 0.0}, r"highest_frequency = 0\.0"),
        ({"highest_frequency": 1e8}, "elements or more; at most 100000 fit"),
        ({"cells": 0}, "cells = 0"),
    ],
)
def test_bad_input(given: dict[str, object], message: str) -> None:
    usual = {"radius": RADIUS, "thickness": WALL, "material": RUBBER, **VACUUM_OUTSIDE}
    with pytest.raises(ValueError, match=message):
        hl.spherical_shell(**usual | given)


@pytest.mark.parametrize("pressure", [-25e6, 1e300, "much"])
def test_bad_input_of_closed_forms(pressure: object) -> None:
    with pytest.raises(ValueError, match="pressure = "):
        hl.theory.ThinSphere(0.1, 1e-3, hl.STEEL_316).point_stiffness(pressure)
