"""Mindlin plates against closed forms, an independent Ritz method, thin plates, and elasticity in three dimensions."""

import numpy as np
import pytest
from frequencies import parameters, ritz
from scipy.integrate import quad
from scipy.linalg import eigh
from scipy.special import j1

import hertzlink as hl
from plates.section import Section
from structures.linear_algebra.factor import factorise

MATERIAL = hl.Material(1.0e9, 0.3, 1000.0)

KINDS = {"C": "clamped", "S": "simple", "T": "soft simple", "F": "free"}


def square(thickness: float, edges: str, cells: int) -> hl.Plate:
    supports = hl.Supports(*(KINDS[letter] for letter in edges))
    return hl.mindlin_plate(1.0, 1.0, thickness, MATERIAL, supports, cells=(cells, cells))


def found(plate: hl.Plate, count: int) -> np.ndarray:
    unit = plate.section.bending[0, 0] / plate.section.mass
    return parameters(plate.at(0.45, 0.45), count, unit)


def navier(section: Section, wave_number: float) -> float:
    """ω² ρt/D of w = cos k x, s = ∇w/|∇w| · amplitude: two equations for the two amplitudes."""
    shear, k = section.shear[0, 0], wave_number
    stiffness = [[shear * k**2, -shear * k], [-shear * k, shear + section.bending[0, 0] * k**2]]
    lowest = eigh(stiffness, np.diag([section.mass, section.rotary_inertia]), eigvals_only=True)[0]
    return float(lowest * section.mass / section.bending[0, 0])


def test_simple_supports() -> None:
    """On hard simple supports the modes are sines in both directions, w = sin(mπx) sin(nπy), exactly."""
    plate = square(0.1, "SSSS", 5)
    exact = [navier(plate.section, np.pi * np.hypot(m, n)) ** 0.5 for m, n in ((1, 1), (1, 2), (2, 1), (2, 2))]
    assert found(plate, 4) == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize("edges", ["CCCC", "FFFF", "SSCC", "SSFF", "CCFF", "TTTT", "TTCF"])
def test_edges(edges: str) -> None:
    """t/a = 0.1 compared with Ritz' method with polynomials of degree 11, in the test: to 1e-4."""
    expected = ritz(tuple(KINDS[letter] for letter in edges), 0.1, 0.3, 6)
    assert found(square(0.1, edges, 6), 6) == pytest.approx(expected, rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("thickness", [0.0025, 0.01])
def test_thin_plates_do_not_lock(thickness: float) -> None:
    """Towards Kirchhoff's plate: what shear takes off is of the order (t/a)², for modes of a few half-waves."""
    thin = hl.kirchhoff_plate(1.0, 1.0, thickness, MATERIAL, hl.Supports(*["clamped"] * 4), cells=(16, 16))
    expected = parameters(thin.at(0.45, 0.45), 4, thin.rigidity / thin.mass_per_area)
    ratio = found(square(thickness, "CCCC", 10), 4) / expected
    assert np.all(ratio < 1.0 + 2e-5)
    assert np.all(ratio > 1.0 - 50.0 * thickness**2)


def test_order_of_convergence() -> None:
    """Polynomials of degree 4 gain h⁸ in frequencies."""
    exact = navier(square(0.1, "SSSS", 3).section, np.pi * 2.0**0.5) ** 0.5
    errors = [found(square(0.1, "SSSS", cells), 1)[0] / exact - 1.0 for cells in (3, 4, 6)]
    orders = np.log(np.divide(errors[:-1], errors[1:])) / np.log([4 / 3, 6 / 4])
    assert orders.mean() == pytest.approx(8.0, abs=0.2)


def test_patch_on_simple_supports() -> None:
    """Navier's series; the mean of a sine over a disc is 2 J₁(ka)/ka times its value in the middle.

    The contact also reads the curvature, see plates/elements/indentation.py: of w_b, the part of w that bends.
    """
    plate = hl.mindlin_plate(0.3, 0.3, 0.01, MATERIAL, hl.Supports(*["simple"] * 4), patch_radius=8e-3)
    structure = plate.at(0.15, 0.11)
    compliance = structure.contact @ factorise(structure.stiffness)(structure.contact)
    m, n = np.meshgrid(np.arange(1, 1201), np.arange(1, 1201))
    k = np.pi / 0.3 * np.hypot(m, n)
    shape = np.sin(np.pi * m / 2.0) * np.sin(np.pi * n * 0.11 / 0.3) * 2.0 * j1(k * 8e-3) / (k * 8e-3)
    wall, bend = plate.section, 0.3 * 0.01**2 / (10.0 * 0.7) - 8e-3**2 / 8.0
    both = (1.0 - bend * k**2) ** 2 / (wall.bending[0, 0] * k**4) + 1.0 / (wall.shear[0, 0] * k**2)
    exact = 4.0 / 0.3**2 * (shape**2 * both).sum()
    assert compliance == pytest.approx(exact, rel=2e-5)


@pytest.mark.parametrize(("shortest", "tolerance"), [(0.1, 2e-3), (0.3, 1e-2), (0.6, 4e-2)])
def test_compliance_of_the_contact_is_that_of_three_dimensions(shortest: float, tolerance: float) -> None:
    """Waves with kt above `shortest`: Mindlin's plate under the default patch, with its flexibility, and the exact
    layer minus all of Hertz's half-space; in units of 1/Et. They differ by terms of the order (kt)² that are left out.

    A pressure p cos kx on a face of a layer moves the face by p (1 − ν²)/Ek · [(ch + 1)/(sh − x) + (ch − 1)/(sh + x)]
    with x = kt (bending and squeezing; Timoshenko and Goodier, Theory of Elasticity, section 24), a half-space's by 2.
    """
    nu = MATERIAL.poisson_ratio
    plate = hl.mindlin_plate(30.0, 30.0, 1.0, MATERIAL, hl.Supports(), cells=(3, 3))
    wall, radius = plate.section, plate.element.patch_radius
    bend = nu / (10.0 * (1.0 - nu)) - radius**2 / 8.0

    def layer(x: float) -> float:
        bending = (np.cosh(x) + 1.0) / (np.sinh(x) - x) + (np.cosh(x) - 1.0) / (np.sinh(x) + x)
        return float((1.0 - nu**2) / (2.0 * np.pi) * (bending - 2.0))

    def mindlin(k: float) -> float:
        spread = (2.0 * j1(k * radius) / (k * radius)) ** 2
        both = (1.0 - bend * k**2) ** 2 / (wall.bending[0, 0] * k**3) + 1.0 / (wall.shear[0, 0] * k)
        return float(MATERIAL.youngs_modulus * spread * both / (2.0 * np.pi))

    hertz_too_long = 2.0 * (1.0 - nu**2) / (2.0 * np.pi) * shortest
    exact = quad(layer, shortest, 40.0, limit=300)[0] - hertz_too_long
    computed = quad(mindlin, shortest, 400.0, limit=4000)[0]
    flexibility = plate.at(15.0, 15.0).flexibility * MATERIAL.youngs_modulus
    assert computed + flexibility == pytest.approx(exact, abs=tolerance)
    assert abs(flexibility) > 5.0 * tolerance


def test_elastic_edges() -> None:
    """Stiff springs are supports; a plate on soft ones bobs as a rigid body, ω² = k · length / mass."""
    for edge, kind in ((hl.ElasticEdge(1e13, 1e13), "across"), (hl.ElasticEdge(1e13), "soft simple")):
        plate = hl.mindlin_plate(1.0, 1.0, 0.1, MATERIAL, hl.Supports(edge, edge, edge, edge), cells=(6, 6))
        assert found(plate, 3) == pytest.approx(ritz((kind,) * 4, 0.1, 0.3, 3), rel=1e-4)
    soft = hl.Supports(left=hl.ElasticEdge(10.0), right=hl.ElasticEdge(10.0))
    plate = hl.mindlin_plate(1.0, 1.0, 0.1, MATERIAL, soft, cells=(3, 3))
    bobbing = (2.0 * 10.0 / (1000.0 * 0.1)) ** 0.5
    lowest = parameters(plate.at(0.5, 0.45), 3, 1.0)
    assert np.abs(lowest - bobbing).min() < 1e-4 * bobbing


@pytest.mark.thorough
def test_patch_radius_and_amplitude_ratio() -> None:
    """Halved and doubled, as the docstring of `mindlin_plate` says; and how far Kirchhoff's plate is off."""
    supports, bead = hl.Supports("clamped", "clamped", "free", "free"), hl.Sphere(2.38e-3, hl.STEEL_440C)

    def ratio(plate: hl.Plate) -> float:
        structure = hl.reduce(plate.at(0.25, 0.25), until=9e-4)
        run = hl.CoSimulation(hl.Chain([bead] * 20, bead, 0.31), structure).run(9e-4)
        return float(hl.amplitude_ratio(run, 7))

    def mindlin(factor: float) -> hl.Plate:
        return hl.mindlin_plate(0.5, 0.5, 4.83e-3, hl.ALUMINIUM_6061, supports, patch_radius=factor * 4.83e-3 / 2.0)

    default = ratio(mindlin(1.0))
    assert [ratio(mindlin(0.5)), ratio(mindlin(2.0))] == pytest.approx([default] * 2, rel=1.5e-3)
    assert ratio(hl.kirchhoff_plate(0.5, 0.5, 4.83e-3, hl.ALUMINIUM_6061, supports)) == pytest.approx(default, rel=2e-2)
