"""Peak pressures of Hertz contacts, and those from which a material yields."""

from math import exp, pi

import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import hertzlink as hl
from structures.surface import relative_curvatures

STEEL, BRASS = hl.STEEL_440C, hl.BRASS_360
FLAT = hl.Surface(BRASS)
CROSSED = hl.Cylinder(2e-3, 4e-3, STEEL), hl.Cylinder(2e-3, 4e-3, BRASS, angle=0.7)


def test_a_round_contact() -> None:
    """(6 F E*²/(π³R²))^⅓ (Johnson 1985, equation 4.24), and the mean pressure over the contact is two thirds of it."""
    ball = hl.Sphere(3e-3, STEEL)
    modulus = 1.0 / (1.0 / STEEL.contact_modulus + 1.0 / BRASS.contact_modulus)
    found = hl.theory.hertz_pressure(ball.surface, FLAT, 40.0)
    assert found == pytest.approx((6.0 * 40.0 * modulus**2 / (pi**3 * 3e-3**2)) ** (1.0 / 3.0), rel=1e-12)
    radius = (0.75 * 40.0 * 3e-3 / modulus) ** (1.0 / 3.0)
    assert found == pytest.approx(1.5 * 40.0 / (pi * radius**2), rel=1e-12)
    assert hl.theory.hertz_pressure(ball.surface, FLAT, 0.0) == 0.0


def test_an_elliptic_contact() -> None:
    """Semi-axes from Johnson's equations 4.26a and b, solved here for their ratio; F = ⅔ π a b p₀."""
    one, other = (body.surface for body in CROSSED)
    flat, sharp = relative_curvatures(one, other)
    modulus = 1.0 / (1.0 / STEEL.contact_modulus + 1.0 / BRASS.contact_modulus)

    def ratio(part: float) -> float:
        m = 1.0 - part**2
        return float((ellipe(m) / part**2 - ellipk(m)) / (ellipk(m) - ellipe(m)))

    part = brentq(lambda p: ratio(p) - sharp / flat, 1e-3, 0.999)
    m = 1.0 - part**2
    found = hl.theory.hertz_pressure(one, other, 30.0)
    long = 0.5 * flat * modulus / found * m / (part * (ellipk(m) - ellipe(m)))
    a = 1.0 / long
    assert 2.0 / 3.0 * pi * a * (part * a) * found == pytest.approx(30.0, rel=1e-9)


@pytest.mark.parametrize("ratio", [0.2, 0.3, 0.4, 0.46])
def test_yield_below_the_surface(ratio: float) -> None:
    """1.60 for ν = 0.3 (Johnson, section 6.1); 1.295 e^(0.736 ν) (Jackson and Green, J. Tribol. 127 (2005) 343)."""
    material = hl.Material(1e11, ratio, 8e3, yield_strength=2e8)
    assert hl.theory.yield_pressure(material) / 2e8 == pytest.approx(1.295 * exp(0.736 * ratio), rel=0.01)
    if ratio == 0.3:
        assert hl.theory.yield_pressure(material) / 2e8 == pytest.approx(1.60, rel=0.01)


def test_materials_without_yield_strength_never_yield() -> None:
    assert hl.theory.yield_pressure(hl.PTFE) == float("inf")
