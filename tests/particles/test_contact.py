"""Bodies and their contact laws: the thesis's numbers, other forms of the same law, limits, ranges, bad input."""

import math
import warnings
from collections.abc import Callable
from math import pi, radians
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import lambertw

import hertzlink as hl
from particles import bead as beads
from particles.laws.law import ContactLaw
from structures.structure import Vector

STEEL = hl.STEEL_316


def ellipsoid(axis: str) -> hl.Ellipsoid:
    return hl.Ellipsoid(2.36e-3, 10.16e-3, STEEL, axis)


def cylinder(degrees: float = 0.0) -> hl.Cylinder:
    return hl.Cylinder(2.38e-3, 4.76e-3, STEEL, radians(degrees))


def stiffness(first: hl.Sphere, second: hl.Sphere) -> float:
    law = hl.contact_law(first, second)
    assert isinstance(law, hl.laws.PowerLaw)
    assert law.exponent == 1.5
    return law.stiffness


def test_masses_of_the_thesis() -> None:
    """Section 2.1: 0.68 g of cylinder; by geometry 0.948 g of ellipsoid, 2.43 g of hollow sphere."""
    assert cylinder().mass == pytest.approx(0.6776e-3, rel=1e-3)
    assert ellipsoid("across").mass == pytest.approx(0.948e-3, rel=1e-3)
    assert hl.HollowSphere(9.525e-3, 8.655e-3, hl.ALUMINIUM_6061).mass == pytest.approx(2.43e-3, rel=5e-3)
    assert (ellipsoid("across").size, ellipsoid("along").size) == pytest.approx((4.72e-3, 10.16e-3))


def test_ellipsoids_of_the_thesis() -> None:
    """Section 5.3.1: 3.31e9 pole to pole; equator to equator 7.473e9 exactly, 7.480e9 with the thesis's b/a."""
    pole, equator = ellipsoid("along"), ellipsoid("across")
    assert stiffness(pole, pole) == pytest.approx(3.31e9, rel=1e-3)  # type: ignore[arg-type]
    assert stiffness(equator, equator) == pytest.approx(7.473e9, rel=1e-4)  # type: ignore[arg-type]
    approximate = hl.theory.hertz_stiffness(equator.surface, equator.surface, "approximate")
    assert approximate == pytest.approx(7.480e9, rel=1e-4)
    assert 1.0 / equator.surface.curvature == pytest.approx(10.93e-3, rel=1e-3)


@pytest.mark.parametrize("degrees", [15.0, 40.0, 75.0])
def test_an_elliptic_contact_presses_its_surfaces_together(degrees: float) -> None:
    """Hertz's pressure over the ellipse moves the surfaces as their shapes ask, by Boussinesq's integral (Johnson 4.2).

    An independent form of the same solution: semi-axes and approach from the integrals of Lur'e, ∫ dw/[(a²+w)√…].
    """
    law = hl.contact_law(cylinder(), cylinder(degrees))
    modulus = STEEL.contact_modulus / 2.0
    total = 1.0 / 2.38e-3
    difference = total * np.cos(radians(degrees))
    flat, sharp = total - difference, total + difference
    force = 30.0

    def integral(ratio: float, which: int) -> float:
        """With b = 1, a = ratio; w = tan² maps to a finite interval."""

        def integrand(angle: float) -> float:
            w = np.tan(angle) ** 2
            step = 2.0 * np.tan(angle) / np.cos(angle) ** 2
            base = np.sqrt((ratio**2 + w) * (1.0 + w) * w) if w > 0.0 else np.inf
            return float(step / base / (1.0, ratio**2 + w, 1.0 + w)[which])

        return float(quad(integrand, 1e-12, pi / 2.0 - 1e-12, limit=400)[0])

    ratio = brentq(lambda r: integral(r, 1) / integral(r, 2) - flat / sharp, 1.0001, 60.0)
    # F·3/(4π)·J₁/(E* b³) = (1/R″)/2, F·3/(4π)·J₀/(E* b) = δ, in lengths of b.
    b = (3.0 * force / (4.0 * pi * modulus) * integral(ratio, 2) / (0.5 * sharp)) ** (1.0 / 3.0)
    approach = 3.0 * force / (4.0 * pi * modulus) * integral(ratio, 0) / b
    assert float(law.approach(np.array(force))) == pytest.approx(approach, rel=1e-5)


radii = st.floats(1e-3, 2e-2)


@given(radii, radii, st.floats(0.0, pi))
def test_laws_of_round_bodies_agree(one: float, other: float, angle: float) -> None:
    """An ellipsoid as long as it is wide, and crossed cylinders of one radius, are spheres to each other."""
    sphere, wall = hl.Sphere(one, STEEL), hl.Sphere(other, hl.BRASS_360)
    as_ellipsoid = hl.Ellipsoid(one, 2.0 * one, STEEL, "across", angle)
    assert stiffness(as_ellipsoid, wall) == pytest.approx(stiffness(sphere, wall), rel=1e-9)  # type: ignore[arg-type]
    first, second = hl.Cylinder(one, 1e-2, STEEL, angle), hl.Cylinder(one, 1e-2, STEEL, angle + pi / 2.0)
    assert stiffness(first, second) == pytest.approx(stiffness(sphere, sphere) * 2.0**0.5, rel=1e-9)  # type: ignore[arg-type]


def test_parallel_cylinders_follow_the_lambert_function() -> None:
    """Equation 5.8 with sign and branch corrected, and 5.7, of which it is the inverse."""
    law = hl.contact_law(cylinder(), cylinder())
    modulus, length, radius = STEEL.contact_modulus, 4.76e-3, 2.38e-3
    approach = np.geomspace(1e-9, 5e-5, 30)
    per_length = -pi * modulus * (approach / 2.0) / lambertw(-np.e * approach / (8.0 * radius), -1).real
    assert law.force(approach) == pytest.approx(length * per_length, rel=1e-6)
    width = np.sqrt(4.0 * per_length * radius / (pi * modulus))
    back = 2.0 * per_length / (pi * modulus) * (2.0 * np.log(4.0 * radius / width) - 1.0)
    assert back == pytest.approx(approach, rel=1e-12)


def test_crossed_cylinders_on_a_plate_are_warned_of_their_line() -> None:
    """The last cylinder lies on the plate along a line, where all others meet at points. A sphere has a point."""
    crossed = [cylinder(90.0 * (n % 2)) for n in range(6)]
    wall = hl.half_space(STEEL)
    with pytest.warns(
        hl.HertzlinkWarning, match="line contact of a cylinder on a flat, 4.76 mm long: the law is for a half-space"
    ):
        run = hl.CoSimulation(hl.Chain(crossed, crossed[0], 0.3), wall).run(2e-5)
    assert "line contact of a cylinder on a flat" in run.attrs["warnings"]
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "contact law", hl.HertzlinkWarning)
        hl.contact_law(cylinder(), cylinder())
        sphere = hl.Sphere(2.38e-3, STEEL)
        run = hl.CoSimulation(hl.Chain([*crossed, sphere], sphere, 0.3), wall).run(2e-5)
    assert "line contact" not in run.attrs.get("warnings", "")


LAWS = [
    hl.contact_law(cylinder(), cylinder()),
    hl.contact_law(cylinder(), hl.Surface(STEEL)),
    hl.contact_law(*[hl.HollowSphere(9.525e-3, 8.65e-3, hl.ALUMINIUM_6061)] * 2),  # type: ignore[arg-type]
    hl.laws.PowerLaw(4.671e7, 1.222),
    hl.laws.PowerLaw(1e9),
    hl.laws.TabulatedLaw([0.0, 1e-6, 3e-6, 1e-5, 2e-5], [0.0, 1.0, 4.5, 30.0, 80.0]),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_laws_are_continuous_and_increase(law: ContactLaw) -> None:
    approach = np.concatenate([[0.0], np.geomspace(1e-12, 1e-3, 20001)])
    force = law.force(approach)
    assert force[0] == 0.0
    assert np.all(np.diff(force) > 0.0)
    assert np.all(np.diff(np.log(force[1:])) < 0.01)
    middle = np.sqrt(approach[1:-1] * approach[2:])
    slope = np.diff(force[1:]) / np.diff(approach[1:])
    assert law.tangent(middle) == pytest.approx(slope, rel=0.03)
    assert law.energy(np.array(1e-5)) == pytest.approx(
        quad(lambda d: float(law.force(np.array(d))), 0, 1e-5)[0], rel=1e-6
    )
    assert float(law.overlap(law.energy(np.array(7e-6)))) == pytest.approx(7e-6, rel=1e-6)


def test_a_law_may_be_a_function_of_the_bodies() -> None:
    bead, wall = hl.Sphere(4e-3, STEEL), hl.Surface(STEEL)
    seen = []

    def law(one: object, other: object) -> hl.laws.PowerLaw:
        seen.append((one, other))
        return hl.laws.PowerLaw(1e9 if other is wall else 2e9, 1.4)

    moving = hl.stepping.MovingChain(hl.Chain([bead] * 2, bead, 0.3, law=law), wall)
    assert moving.stiffness.tolist() == [2e9, 2e9, 1e9]
    assert (bead, wall) in seen
    with pytest.raises(ValueError, match=r"law = 3\.0: must be a function that returns a contact law"):
        hl.stepping.MovingChain(hl.Chain([bead], bead, 0.3, law=lambda one, other: 3.0), wall)  # type: ignore[arg-type,return-value]


class Odd(ContactLaw):
    """A user's law with a fault."""

    name, largest, caution = "odd", float("inf"), ""

    def __init__(self, force: Callable[[Vector], Vector], tangent: Callable[[Vector], Vector]) -> None:
        self._force, self.tangent = force, tangent  # type: ignore[method-assign]

    def force(self, approach: Vector) -> Vector:
        return self._force(approach)


@pytest.mark.parametrize(
    ("force", "tangent"),
    [
        (lambda d: None, lambda d: 0.0 * d), (lambda d: 5.0, lambda d: 0.0 * d),
        (lambda d: 1e10 * d[1:] ** 1.5, lambda d: 1.5e10 * d**0.5),
        (lambda d: 1e5 * d - 1e9 * d * d, lambda d: 1e5 - 2e9 * d), (lambda d: 5.0 + 0.0 * d, lambda d: 0.0 * d),
        (lambda d: np.nan * d, lambda d: np.nan * d), (lambda d: 1.0 + 1e3 * d, lambda d: 1e3 + 0.0 * d),
        (lambda d: 1e9 * d, lambda d: 1e8 + 0.0 * d), (lambda d: 0.5 + 1e10 * d**1.5, lambda d: 1.5e10 * d**0.5),
    ],
)  # fmt: skip
def test_odd_laws_of_ones_own(force: Callable[[Vector], Vector], tangent: Callable[[Vector], Vector]) -> None:
    bead = hl.Sphere(4e-3, STEEL)
    with pytest.raises(ValueError, match=r"law: Odd\.force: must be finite and rise from zero"):
        hl.CoSimulation(hl.Chain([bead], bead, 0.3, law=Odd(force, tangent)), None).run(1e-5)


@pytest.mark.parametrize("force", [lambda d: 1e10 * math.pow(d, 1.5), lambda d: 1e10 * d**1.5 if d > 0.0 else 0.0])
def test_a_law_of_single_numbers_is_named(force: Callable[[Any], Any]) -> None:
    bead = hl.Sphere(4e-3, STEEL)
    with pytest.raises(ValueError, match=r"law: Odd\.force: must take an array of approaches \("):
        hl.CoSimulation(hl.Chain([bead], bead, 0.3, law=Odd(force, force)), None)


def test_a_curvature_that_does_not_fit_names_its_bodies() -> None:
    bead, hollow = hl.Sphere(1e-2, STEEL), hl.Surface(STEEL, -200.0)
    body = hl.Structure([[0.05]], [[2e6]], None, [1.0], 0.0, hollow)
    with pytest.raises(ValueError, match=r"^Sphere\(radius=0\.01.* on Surface.*curvature"):
        hl.CoSimulation(hl.Chain([bead], bead, 0.3), body)


def test_names_and_cautions() -> None:
    sphere = hl.Sphere(4e-3, STEEL)
    assert hl.contact_law(sphere, sphere).name == "Hertz, round contact"
    assert "elliptic" in hl.contact_law(cylinder(), cylinder(30.0)).name
    assert "line contact" in hl.contact_law(cylinder(), cylinder(180.0)).name
    longer = hl.contact_law(cylinder(), hl.Cylinder(2.38e-3, 9e-3, STEEL))
    assert longer.force(1e-6) == hl.contact_law(cylinder(), cylinder()).force(1e-6)
    for _ in range(2):
        with pytest.warns(hl.HertzlinkWarning, match="half-space theory does not hold"):
            law = hl.contact_law(cylinder(1.0), cylinder(8.0))
        assert "half-space theory does not hold" in law.caution
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert hl.contact_law(cylinder(), cylinder(10.0)).caution == ""


def test_a_law_beyond_its_range_is_warned_of_once() -> None:
    bead = hl.Sphere(4e-3, STEEL)
    chain = hl.Chain([bead] * 5, bead, 0.3, law=hl.laws.PowerLaw(1e9, 1.5, largest=1e-6))
    with pytest.warns(hl.HertzlinkWarning, match="contact law: ") as caught:
        run = hl.CoSimulation(chain, None).run(until=2e-4)
    (finding,) = [
        line for line in run.attrs["warnings"].splitlines() if line.startswith("contact law: the approach of")
    ]
    assert "at contact 1 is beyond 1 µm, the limit of its law (power law)" in finding
    assert [str(one.message) for one in caught].count(finding) == 1
    quiet = hl.CoSimulation(hl.Chain([bead] * 5, bead, 0.3), None).run(until=2e-4)
    assert "contact law" not in quiet.attrs.get("warnings", "")


def test_the_shapes_of_beads_are_in_shapes() -> None:
    kinds = {name: kind for name, kind in vars(beads).items() if hl.Bead in getattr(kind, "__mro__", ())}
    assert {kind for name, kind in kinds.items() if name[0] != "_"} - {hl.Bead} == set(beads.SHAPES)
