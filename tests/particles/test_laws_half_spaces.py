"""Contact laws by boundary elements: Hertz's ellipses and pressures, Love's coefficients, corrections, bad input."""

from math import asinh, pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

import hertzlink as hl
from particles.laws.axisymmetric import contact_law_fem
from particles.laws.computed import ComputedLaw
from particles.laws.half_spaces import (
    CELLS,
    ContactNotConverged,
    PointContact,
    contact_law_bem,
    displacements,
    influence,
    unilateral_pressures,
)
from particles.laws.solid import midplane_correction
from structures.bodies.elasticity import patch_compliance
from structures.structure import Vector

STEEL, ALUMINIUM = hl.STEEL_316, hl.ALUMINIUM_6061
RADIUS = 2.38e-3
ANGLES = [10.0, 20.0, 30.0, 45.0, 60.0, 90.0]
BALL = hl.Sphere(RADIUS, STEEL)


def cylinder(degrees: float = 0.0, material: hl.Material = STEEL) -> hl.Cylinder:
    return hl.Cylinder(RADIUS, 4.76e-3, material, radians(degrees))


def surface_of(body: hl.Sphere | hl.Surface) -> hl.Surface:
    return body if isinstance(body, hl.Surface) else body.surface


def over_theory(law: ComputedLaw, first: hl.Sphere, second: hl.Sphere | hl.Surface) -> Vector:
    """Force over Hertz's, with b/a solved exactly, over the computed range."""
    approaches = np.geomspace(law.smallest, law.largest, 50)
    stiffness = hl.theory.hertz_stiffness(surface_of(first), surface_of(second))
    ratio: Vector = law.force(approaches) / (stiffness * approaches**1.5)
    return ratio


@pytest.mark.parametrize("degrees", ANGLES)
def test_crossed_cylinders(degrees: float) -> None:
    """Hertz's ellipse theory within 0.1 %, its exponent, and an error estimate that holds."""
    pair = cylinder(), cylinder(degrees)
    law = contact_law_bem(*pair, max_force=100.0)
    off = np.abs(over_theory(law, *pair) - 1.0)  # type: ignore[arg-type]
    assert off.max() < law.error < 1e-3
    assert law.fit().exponent == pytest.approx(1.5, abs=1e-6)
    assert float(law.force(np.array(law.largest))) == pytest.approx(100.0, rel=1e-9)
    assert law.caution == ""


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (BALL, None),
        (BALL, hl.Sphere(9.5e-3, ALUMINIUM)),
        (BALL, cylinder(0.0, ALUMINIUM)),
        (cylinder(30.0), hl.Ellipsoid(2.36e-3, 10.16e-3, ALUMINIUM)),
        (hl.Ellipsoid(2.36e-3, 10.16e-3, STEEL, axis="along"), hl.Surface(ALUMINIUM)),
        (BALL, hl.Surface(ALUMINIUM, -100.0, 50.0, 0.3)),
        (cylinder(), hl.Surface(STEEL, 80.0, -20.0, 1.0)),
    ],
)
def test_other_bodies(first: hl.Sphere, second: hl.Sphere | hl.Surface | None) -> None:
    """Hertz within 0.1 %, whatever meets, of whatever materials; the order of two bodies does not matter."""
    law = contact_law_bem(first, second, max_approach=1e-6)
    other = first if second is None else second
    assert over_theory(law, first, other) == pytest.approx(1.0, abs=1e-3)
    assert law.largest == 1e-6
    if not isinstance(other, hl.Surface):
        swapped = contact_law_bem(other, first, max_approach=1e-6)
        approaches = np.geomspace(1e-9, 1e-6, 10)
        assert swapped.force(approaches) == pytest.approx(law.force(approaches), rel=1e-9)


@pytest.mark.parametrize("correction", [0.0, 5e-9])
def test_below_the_first_step_is_hertz(correction: float) -> None:
    """Down to zero, less the correction of both bodies."""
    law = contact_law_bem(BALL, max_approach=1e-6, correction=correction)
    hertz = hl.contact_law(BALL, BALL)
    forces = float(law.force(np.array(law.smallest))) * np.array([1e-8, 1e-6, 1e-4, 1e-2])
    assert law.force(hertz.approach(forces) - 2.0 * correction * forces) == pytest.approx(forces, rel=3e-4)
    assert float(law.force(np.array(0.0))) == 0.0


@pytest.mark.parametrize("degrees", [10.0, 45.0, 90.0])
def test_pressures_are_an_ellipsoid(degrees: float) -> None:
    """p₀ √(1 − x²/a² − y²/b²) with Hertz's p₀, a and b, by other integrals: see `axes`."""
    pair = cylinder(), cylinder(degrees)
    contact = PointContact(*pair).pressed(2e-6, 128)
    a, b, p0 = axes(degrees, 2e-6)
    inside = 1.0 - (contact.along[:, None] / a) ** 2 - (contact.across / b) ** 2
    theory = p0 * np.sqrt(np.maximum(inside, 0.0))
    assert contact.pressures.max() == pytest.approx(p0, rel=1e-3)
    # Cells that the ellipse cuts hold part of a root that starts there.
    assert np.abs(contact.pressures - theory)[np.abs(inside) > 0.1].max() < 2e-3 * p0
    assert np.abs(contact.pressures - theory).max() < 0.2 * p0
    for positions, pressures, axis in (
        (contact.along, contact.pressures.max(axis=1), a),
        (contact.across, contact.pressures.max(axis=0), b),
    ):
        assert positions[pressures > 0.0].max() == pytest.approx(axis, rel=0.02)


def axes(degrees: float, approach: float) -> tuple[float, float, float]:
    """Semi-axes a, b and p₀ of two crossed cylinders at an approach, by Lur'e's integrals; b/a halves an interval.

    δ = p₀ab/(2E*) ∫₀^∞ dw/√[(a² + w)(b² + w) w]; half the relative curvatures are the same with 1/(a² + w) or
    1/(b² + w) in it (Johnson, Contact Mechanics, section 4.2). Here a = 1 and w = b² tan²φ.
    """
    modulus = STEEL.contact_modulus / 2.0
    flat, sharp = (0.5 / RADIUS * (1.0 - s * np.cos(radians(degrees))) for s in (1.0, -1.0))
    phi = (np.arange(4000) + 0.5) * 0.5 * pi / 4000

    def integrals(ratio: float) -> tuple[float, float, float]:
        w = (ratio * np.tan(phi)) ** 2
        weight = 0.5 * pi / 4000 * ratio / np.cos(phi) / np.sqrt(1.0 + w)
        return float(weight.sum()), float((weight / (1.0 + w)).sum()), float((weight / (ratio**2 + w)).sum())

    low, high = 1e-3, 1.0
    for _ in range(60):
        ratio = 0.5 * (low + high)
        _, along, across = integrals(ratio)
        low, high = (ratio, high) if along / across < flat / sharp else (low, ratio)
    whole, along, _ = integrals(ratio)
    a = float(np.sqrt(approach / flat * along / whole))
    return a, ratio * a, approach * modulus / (a * whole)


def test_love_against_boussinesq() -> None:
    """Far off, area/r; in the middle of a square, 8 asinh(1) times half its side, and the like of a rectangle."""
    square = influence(400, 2.0, 2.0)
    assert square[0, 0] == pytest.approx(8.0 * asinh(1.0), rel=1e-12)
    x, y = np.meshgrid(2.0 * np.arange(50, 400), 2.0 * np.arange(400), indexing="ij")
    assert square[50:] * np.hypot(x, y) == pytest.approx(4.0, rel=1e-4)
    oblong = influence(60, 3.0, 0.5)
    assert oblong[0, 0] == pytest.approx(2.0 * (3.0 * asinh(0.5 / 3.0) + 0.5 * asinh(3.0 / 0.5)), rel=1e-12)
    assert influence(60, 0.5, 3.0) == pytest.approx(oblong.T, rel=1e-9)


def test_even_pressure_on_a_circle() -> None:
    """Its mean displacement is 16 (1 − ν²)/(3 π² E a) per newton (Love; Johnson 3.4)."""
    cells, side = 200, 1.0e-5
    middles = (np.arange(cells) - 0.5 * (cells - 1)) * side
    radius = 0.9e-3
    circle = (np.hypot(middles[:, None], middles) < radius).astype(float)
    force = circle.sum() * side**2
    moved = displacements(influence(cells, side, side) / (pi * STEEL.contact_modulus))(circle)
    mean = float((moved * circle).sum() / circle.sum()) / force
    assert mean == pytest.approx(patch_compliance(STEEL, radius), rel=2e-3)


@settings(max_examples=20, deadline=None)
@given(cells=st.integers(2, 9), ratio=st.floats(0.02, 50.0), seed=st.integers(0, 1000))
def test_convolution_is_exact(cells: int, ratio: float, seed: int) -> None:
    """By transforms as by the dense matrix, to rounding."""
    coefficients = influence(cells, 1.0, ratio)
    places = np.arange(cells)
    apart = np.abs(places[:, None] - places)
    dense = coefficients[apart[:, None, :, None], apart[None, :, None, :]].reshape(cells**2, cells**2)
    pressures = np.random.default_rng(seed).normal(size=(cells, cells))
    moved = displacements(coefficients)(pressures)
    assert moved.ravel() == pytest.approx(dense @ pressures.ravel(), abs=1e-11 * coefficients[0, 0] * cells)


@settings(max_examples=20, deadline=None)
@given(cells=st.integers(3, 8), ratio=st.floats(0.1, 10.0), seed=st.integers(0, 1000))
def test_same_pressures_by_non_negative_least_squares(cells: int, ratio: float, seed: int) -> None:
    """Any gap, not only a bowl: Lawson and Hanson's method on the dense matrix finds the same pressures."""
    coefficients, places = influence(cells, 1.0, ratio), np.arange(cells)
    apart = np.abs(places[:, None] - places)
    dense = coefficients[apart[:, None, :, None], apart[None, :, None, :]].reshape(cells**2, cells**2)
    gap = np.random.default_rng(seed).uniform(0.0, 2.0, (cells, cells))
    pressures = unilateral_pressures(coefficients, gap, 1.0, np.ones_like(gap))
    root = np.linalg.cholesky(dense).T
    expected, _ = nnls(root, np.linalg.solve(root.T, 1.0 - gap.ravel()))
    assert pressures.ravel() == pytest.approx(expected, abs=1e-6 * max(expected.max(), 1e-3))


@pytest.mark.parametrize("degrees", [10.0, 90.0])
def test_complementarity(degrees: float) -> None:
    """No cell pulls, none overlaps, and only those that touch bear: to 1e-9 of the approach."""
    pair, approach = (cylinder(), cylinder(degrees)), 3e-6
    contact = PointContact(*pair).pressed(approach, CELLS)
    modulus = STEEL.contact_modulus / 2.0
    sides = (contact.along[1] - contact.along[0], contact.across[1] - contact.across[0])
    moved = displacements(influence(contact.along.size, *sides) / (pi * modulus))(contact.pressures)
    flat, sharp = (0.5 / RADIUS * (1.0 - s * np.cos(radians(degrees))) for s in (1.0, -1.0))
    opening = moved + flat * contact.along[:, None] ** 2 + sharp * contact.across**2 - approach
    assert contact.pressures.min() >= 0.0
    assert opening.min() > -1e-9 * approach
    assert np.abs(opening[contact.pressures > 0.0]).max() < 1e-9 * approach
    border = [contact.pressures[0], contact.pressures[-1], contact.pressures[:, 0], contact.pressures[:, -1]]
    assert np.max(border) == 0.0


@pytest.mark.thorough
def test_observed_order() -> None:
    """The error of the force falls by the square of the cells' side, scattered by how the ellipse cuts cells."""
    pair = cylinder(), cylinder(90.0)
    exact = float(hl.contact_law(*pair).force(np.array(1e-6)))
    cells = np.unique(np.geomspace(32, 110, 24).astype(int))
    errors = np.array([PointContact(*pair).pressed(1e-6, int(number)).force / exact - 1.0 for number in cells])
    assert -np.polyfit(np.log(cells), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.2)
    assert errors.max() < 0.5 / cells[0] ** 2


@pytest.mark.thorough
@settings(max_examples=10, deadline=None)
@given(size=st.floats(1e-3, 1e3), modulus=st.floats(1e-4, 1e2), degrees=st.floats(10.0, 90.0))
def test_laws_scale(size: float, modulus: float, degrees: float) -> None:
    """s times as large and m times as stiff: F(s δ) = s² m F(δ)."""
    stiffer = hl.Material(modulus * STEEL.youngs_modulus, STEEL.poisson_ratio, 1.0)
    large = [hl.Cylinder(size * RADIUS, size * 4.76e-3, stiffer, radians(turn)) for turn in (0.0, degrees)]
    law = contact_law_bem(cylinder(), cylinder(degrees), max_approach=1e-6, cells=32)
    scaled = contact_law_bem(*large, max_approach=size * 1e-6, cells=32)
    approaches = np.geomspace(1e-9, 1e-6, 10)
    assert scaled.force(size * approaches) == pytest.approx(size**2 * modulus * law.force(approaches), rel=1e-6)


@pytest.mark.parametrize("correction", [2e-9, -2e-9, (3e-9, 1e-9)])
def test_correction(correction: float | tuple[float, float]) -> None:
    """δ − (c₁ + c₂) F, at max_approach as at max_force."""
    total = sum(correction) if isinstance(correction, tuple) else 2.0 * correction
    pair = cylinder(), cylinder(30.0)
    plain = contact_law_bem(*pair, max_force=100.0)
    law = contact_law_bem(*pair, max_force=100.0, correction=correction)
    forces = np.geomspace(0.1, 100.0, 20)
    assert law.approach(forces) == pytest.approx(plain.approach(forces) - total * forces, rel=1e-4)
    again = contact_law_bem(*pair, max_approach=law.largest, correction=correction, midplane=True)
    assert again.largest == law.largest
    assert float(again.force(np.array(law.largest))) == pytest.approx(100.0, rel=1e-3)
    assert np.all(np.diff(again.approaches) > 0.0)
    assert max(again.approaches) > law.largest


def test_correction_of_a_sphere_by_finite_elements() -> None:
    """One number c makes the half-spaces, 0.3 to 1.6 % too soft from 1 to 20 µm, the beads of finite elements."""
    ball = hl.Sphere(9.525e-3, ALUMINIUM)
    beads, approaches = contact_law_fem(ball, max_approach=20e-6), np.geomspace(1e-6, 20e-6, 20)
    end = float(beads.force(np.array(20e-6)))
    correction = (float(hl.contact_law(ball, ball).approach(np.array(end))) - 20e-6) / (2.0 * end)
    law = contact_law_bem(ball, max_approach=20e-6, correction=correction, midplane=True)
    assert law.force(approaches) == pytest.approx(beads.force(approaches), rel=1.5e-3)


@pytest.mark.thorough
def test_mid_planes_of_spheres_by_finite_elements() -> None:
    """A steel sphere's own correction makes half-spaces, 0.4 to 2.3 % too soft, its axisymmetric finite elements."""
    approaches = np.geomspace(1e-6, 10e-6, 10)
    beads = contact_law_fem(BALL, max_approach=10e-6).force(approaches)
    law = contact_law_bem(BALL, max_approach=10e-6, midplane=True)
    assert law.force(approaches) == pytest.approx(beads, rel=3e-3)
    assert law.largest == 10e-6


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("first", "second"), [(BALL, hl.Surface(STEEL)), (BALL, BALL), (cylinder(), BALL), (cylinder(), cylinder(90.0))]
)
def test_mid_planes_take_off_the_correction_of_each_body(
    first: hl.Sphere | hl.Cylinder, second: hl.Sphere | hl.Cylinder | hl.Surface
) -> None:
    """Each its own; a Surface has none."""
    taken = sum(0.0 if isinstance(body, hl.Surface) else midplane_correction(body) for body in (first, second))
    law = contact_law_bem(first, second, max_force=50.0, midplane=True)
    plain = contact_law_bem(first, second, max_force=50.0)
    assert plain.largest - law.largest == pytest.approx(50.0 * taken, rel=1e-3)


def test_corrections_may_be_an_array() -> None:
    one, other = (
        contact_law_bem(BALL, max_force=10.0, correction=c) for c in ((1e-10, 2e-10), np.array([1e-10, 2e-10]))
    )  # type: ignore[arg-type]
    assert one == other


def test_a_contact_along_a_groove_is_wide_beside_the_ball() -> None:
    """Small across the groove, but long along it, where ball and groove have nearly one radius."""
    law = contact_law_bem(BALL, hl.Surface(STEEL, 0.0, -0.95 / RADIUS), max_force=1000.0)
    assert "too wide for small strains" in law.caution
    groove = hl.contact_law(BALL, hl.Surface(STEEL, 0.0, -0.95 / RADIUS))
    turned = hl.contact_law(BALL, hl.Surface(STEEL, 0.0, -0.95 / RADIUS, 0.7))
    assert groove.largest == pytest.approx(0.04 * 0.05 * RADIUS, rel=1e-9)
    assert turned.largest == pytest.approx(groove.largest, rel=1e-9)


def test_no_correction_for_a_surface() -> None:
    """A half-space has no mid-plane: what is taken off is the ball's share."""
    plain = contact_law_bem(BALL, hl.Surface(STEEL), max_force=50.0)
    law = contact_law_bem(BALL, hl.Surface(STEEL), max_force=50.0, correction=2e-9)
    assert plain.largest - law.largest == pytest.approx(2e-9 * 50.0, rel=1e-4)


@pytest.mark.parametrize(
    ("first", "second", "asked", "words"),
    [
        (cylinder(), cylinder(30.0), {}, "max_force = None, max_approach = None"),
        (cylinder(), cylinder(30.0), {"max_force": 1.0, "max_approach": 1e-6}, "max_force = 1.0, max_approach = 1e-06"),
        (cylinder(), cylinder(30.0), {"max_force": -1.0}, "max_force"),
        (cylinder(), cylinder(30.0), {"max_approach": 0.0}, "max_approach"),
        (cylinder(), cylinder(30.0), {"max_force": 1.0, "cells": 16}, "cells = 16: must be a whole number, 32 or more"),
        (cylinder(), cylinder(30.0), {"max_force": 1.0, "cells": 40.5}, "cells = 40.5"),
        (cylinder(), cylinder(30.0), {"max_force": 1.0, "cells": 20000}, "cells = 20000: must be at most 512"),
        (cylinder(), cylinder(30.0), {"max_force": 1e12}, "max_force = 1000000000000.0: must lie between"),
        (BALL, None, {"max_force": 1e-300}, "max_force = 1e-300: must lie between"),
        (BALL, None, {"max_force": 1.0, "midplane": "no"}, "midplane = 'no': must be True or False"),
        (cylinder(), cylinder(30.0), {"max_force": 1.0, "correction": "soft"}, "correction = 'soft'"),
        (cylinder(), cylinder(30.0), {"max_force": 1.0, "correction": (1e-9,)}, "one for each body"),
        (hl.Ellipsoid(1e-3, 3e-3, STEEL), BALL, {"max_force": 1.0, "midplane": True}, "correction = None"),
        (cylinder(), cylinder(30.0), {"max_force": 100.0, "correction": 1e-6}, "correction"),
        (cylinder(), cylinder(30.0), {"max_approach": 1e-6, "correction": 1e-6}, "correction"),
        (cylinder(), cylinder(), {"max_force": 1.0}, "for parallel cylinders use plane strain"),
        (cylinder(), cylinder(180.0), {"max_force": 1.0}, "for parallel cylinders use plane strain"),
        (cylinder(), hl.Surface(STEEL), {"max_force": 1.0}, "along a line"),
        (BALL, hl.Surface(STEEL, -1.0 / RADIUS), {"max_force": 1.0}, "curvature"),
        (hl.HollowSphere(1e-2, 9e-3, STEEL), BALL, {"max_force": 1.0}, "first = HollowSphere"),
        (BALL, hl.HollowSphere(1e-2, 9e-3, STEEL), {"max_force": 1.0}, "second = HollowSphere"),
        (hl.Surface(STEEL), BALL, {"max_force": 1.0}, "first = Surface"),
        ("ball", None, {"max_force": 1.0}, "first"),
    ],
)
def test_bad_input(first: object, second: object, asked: dict[str, object], words: str) -> None:
    """A ValueError names what is wrong."""
    with pytest.raises(ValueError, match=words):
        contact_law_bem(first, second, **asked)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("degrees", "asked", "words"),
    [
        (5.0, {"max_force": 10.0}, "half-space theory ends"),
        (1.0, {"max_force": 100.0}, "mm long is longer than a cylinder, 4.76 mm"),
        (90.0, {"max_approach": 2e-4}, "small strains"),
    ],
)
def test_cautions(degrees: float, asked: dict[str, float], words: str) -> None:
    """Long and large contacts are named by the law, and warned of."""
    with pytest.warns(hl.HertzlinkWarning, match="contact law: ") as caught:
        law = contact_law_bem(cylinder(), cylinder(degrees), **asked)  # type: ignore[arg-type]
    assert words in law.caution
    assert f"contact law: {law.caution}" in [str(one.message) for one in caught]


def test_pressures_that_do_not_converge_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three iterations are too few; the error reports the approach of the first load step."""
    monkeypatch.setattr("particles.laws.half_spaces.MOST_ITERATIONS", 3)
    with pytest.raises(ContactNotConverged, match="pressures still changed after 3 iterations") as caught:
        contact_law_bem(cylinder(), cylinder(30.0), max_approach=1e-6)
    assert caught.value.approach == pytest.approx(1.02e-9)


def test_chain_of_crossed_cylinders() -> None:
    """A chain runs with the law as with Hertz's: the same largest forces within 0.1 %."""
    beads = [cylinder(90.0 * (n % 2)) for n in range(12)]
    law = contact_law_bem(beads[0], beads[1], max_force=100.0)
    peaks = [
        float(hl.CoSimulation(hl.Chain(beads, beads[1], 0.3, law=picked), None).run(2e-4).contact_force.values.max())
        for picked in (None, law)
    ]
    assert peaks[1] == pytest.approx(peaks[0], rel=1e-3)
