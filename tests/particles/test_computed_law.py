"""Which method `computed_law` picks, and that its laws are those of the method."""

from math import pi

import numpy as np
import pytest

import hertzlink as hl
from particles.laws.axisymmetric import contact_law_fem
from particles.laws.choose import METHODS, method_for
from particles.laws.half_spaces import contact_law_bem
from particles.laws.plane import contact_law_plane

STEEL = hl.STEEL_316
BALL, SHELL = hl.Sphere(4.76e-3, STEEL), hl.HollowSphere(9.525e-3, 8.655e-3, STEEL)
LYING, LONG = hl.Cylinder(2.38e-3, 4.76e-3, STEEL), hl.Cylinder(2.38e-3, 40e-3, STEEL)
CROSSING = hl.Cylinder(2.38e-3, 4.76e-3, STEEL, angle=pi / 4)


@pytest.mark.parametrize(
    ("first", "second", "method"),
    [
        (BALL, SHELL, "axisymmetric"),
        (BALL, hl.Surface(STEEL), "axisymmetric"),
        (hl.Ellipsoid(4e-3, 9e-3, STEEL, axis="along"), BALL, "axisymmetric"),
        (hl.Ellipsoid(4e-3, 9e-3, STEEL), BALL, "half-spaces"),
        (LYING, LYING, "three-dimensional"),
        (LONG, LONG, "plane strain"),
        (LYING, LONG, "plane strain"),
        (LYING, CROSSING, "half-spaces"),
        (BALL, LYING, "half-spaces"),
        (BALL, hl.Surface(STEEL, 0.0, 50.0), "half-spaces"),
    ],
)
def test_the_method_that_suits_two_bodies(first: hl.Bead, second: hl.Bead | hl.Surface, method: str) -> None:
    assert method_for(first, second) == method
    assert method in METHODS


def test_the_law_is_that_of_the_method() -> None:
    law = hl.laws.computed_law(BALL, max_approach=5e-6, spacing=20e-6)
    assert law == contact_law_fem(BALL, max_approach=5e-6, spacing=20e-6)
    between = {"max_force": 20.0, "cells": 32}
    given = hl.laws.computed_law(LYING, CROSSING, correction=1e-10, **between)
    assert given == contact_law_bem(LYING, CROSSING, correction=1e-10, **between)
    stress = hl.laws.computed_law(LONG, max_approach=1e-6, method="plane stress", spacing=2e-6)
    assert stress == contact_law_plane(LONG, None, "stress", max_approach=1e-6, spacing=2e-6)


@pytest.mark.thorough
def test_methods_agree_where_two_suit() -> None:
    """Spheres by elements and by half-spaces with the mid-planes' correction, to 0.3 %."""
    approach = np.array([2e-6, 5e-6])
    by_elements = hl.laws.computed_law(BALL, max_approach=5e-6)
    by_half_spaces = hl.laws.computed_law(BALL, max_approach=5e-6, method="half-spaces")
    assert by_half_spaces.force(approach) == pytest.approx(by_elements.force(approach), rel=3e-3)
