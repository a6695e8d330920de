"""Laminates: against the homogeneous plate, a bimetal, closed forms, what the contact is made of; bad input."""

from math import pi, tan
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from plates.section import homogeneous_section, stiffness_towards

CARBON = hl.OrthotropicMaterial(140e9, 10e9, 0.3, 5e9, 5.2e9, 3.6e9, 1600.0, "carbon-epoxy")
CROSS = hl.OrthotropicMaterial(135e9, 9e9, 0.3, 5e9, 5e9, 3.2e9, 1560.0)
STEEL, BRASS = hl.STEEL_316, hl.Material(103e9, 0.30, 8550.0)


def test_equal_layers_are_the_homogeneous_plate() -> None:
    one = hl.Laminate([hl.Ply(STEEL, 0.5e-3, angle) for angle in (0.0, 0.7, -1.1)] + [hl.Ply(STEEL, 2e-3)])
    found, expected = one.section(), homogeneous_section(3.5e-3, STEEL)
    assert one.thickness == pytest.approx(3.5e-3)
    assert found.bending == pytest.approx(expected.bending, rel=1e-12, abs=1e-9)
    assert found.shear == pytest.approx(expected.shear, rel=1e-12, abs=1e-3)
    assert (found.mass, found.rotary_inertia) == pytest.approx((expected.mass, expected.rotary_inertia), rel=1e-12)
    assert found.struck == STEEL
    supports = hl.Supports("clamped", "free", "simple", "free")
    plates = [
        hl.kirchhoff_plate(0.3, 0.2, 3.5e-3, material, supports, cells=(5, 4)).at(0.1, 0.1) for material in (one, STEEL)
    ]
    for name in ("mass", "stiffness"):
        first, second = (getattr(plate, name) for plate in plates)
        assert abs(first - second).max() < 1e-12 * abs(second).max()


def test_orthotropic_with_isotropic_constants_is_isotropic_at_any_angle() -> None:
    e, nu = STEEL.youngs_modulus, STEEL.poisson_ratio
    shear = e / (2.0 * (1.0 + nu))
    sheet = hl.OrthotropicMaterial(e, e, nu, shear, shear, shear, STEEL.density)
    found, expected = hl.Laminate([hl.Ply(sheet, 2e-3, 0.4)]).section(), homogeneous_section(2e-3, STEEL)
    assert found.bending == pytest.approx(expected.bending, rel=1e-12, abs=1e-9)
    assert found.shear == pytest.approx(expected.shear, rel=1e-12, abs=1e-3)
    assert found.struck.contact_modulus == pytest.approx(STEEL.contact_modulus, rel=1e-12)


def test_two_metals_bend_about_their_own_neutral_line() -> None:
    """A compound beam by the parallel-axis theorem, over 1 − ν², as both have the same ν; B is not zero."""
    t1, t2 = 1e-3, 2.5e-3
    laminate = hl.Laminate([hl.Ply(STEEL, t1), hl.Ply(BRASS, t2)])
    parts = [(STEEL.youngs_modulus, t1, t1 / 2.0), (BRASS.youngs_modulus, t2, t1 + t2 / 2.0)]
    neutral = sum(e * t * z for e, t, z in parts) / sum(e * t for e, t, _ in parts)
    rigidity = sum(e * (t**3 / 12.0 + t * (z - neutral) ** 2) for e, t, z in parts) / (1.0 - 0.3**2)
    assert laminate.section().bending[0, 0] == pytest.approx(rigidity, rel=1e-12)
    assert laminate.section().bending[2, 2] == pytest.approx(rigidity * 0.35, rel=1e-12)
    assert abs(laminate.stiffnesses[1]).max() > 1e3
    assert laminate.section().struck == STEEL
    turned = hl.Laminate(laminate.plies[::-1])
    assert turned.section().bending == pytest.approx(laminate.section().bending, rel=1e-12)
    assert turned.section().struck == BRASS


def test_one_ply_towards_its_fibres_and_across() -> None:
    """E t³/12(1 − ν₁₂ν₂₁) along and across; the transformed constants at 45° by hand."""
    angle = 0.5
    section = hl.Laminate([hl.Ply(CARBON, 2e-3, angle)]).section()
    minor = 0.3 * 10e9 / 140e9
    unit = 2e-3**3 / 12.0 / (1.0 - 0.3 * minor)
    assert stiffness_towards(section, np.array([angle, angle + pi / 2.0])) == pytest.approx(
        [140e9 * unit, 10e9 * unit], rel=1e-12
    )
    mixed = unit * (140e9 + 10e9 + 2.0 * minor * 140e9) / 4.0 + 2e-3**3 / 12.0 * 5e9
    assert stiffness_towards(section, np.array(angle + pi / 4.0)) == pytest.approx(mixed, rel=1e-12)
    along = np.array([np.cos(angle), np.sin(angle)])
    assert along @ section.shear @ along == pytest.approx(5.0 / 6.0 * 5.2e9 * 2e-3, rel=1e-12)
    across = np.array([-np.sin(angle), np.cos(angle)])
    assert across @ section.shear @ across == pytest.approx(5.0 / 6.0 * 3.6e9 * 2e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("ply", "modulus"),
    [
        (hl.OrthotropicMaterial(138e9, 9e9, 0.3, 6.9e9, 6.9e9, 3.2e9, 1600.0), 11.64e9),
        (hl.OrthotropicMaterial(45e9, 12e9, 0.28, 4.5e9, 4.5e9, 12e9 / 2.8, 2000.0), 13.02e9),
        (hl.OrthotropicMaterial(2.6e9, 2.6e9 * (1 + 1e-7), 0.3, 1e9, 1e9, 1e9, 2000.0), 2.6e9 / 0.91),
    ],
    ids=["carbon", "glass", "isotropic"],
)
def test_what_the_contact_sees(ply: hl.OrthotropicMaterial, modulus: float) -> None:
    """The modulus of a half-space of the struck ply; E₂/(1 − ν₂₃²) was 7.4 % low for carbon and 10 % high for glass."""
    assert hl.Laminate([hl.Ply(ply, 1e-3, 0.3)]).struck.contact_modulus == pytest.approx(modulus, rel=1e-3)


def test_shear_makes_carbon_softer_to_a_tap() -> None:
    """Plies shear easily, so a plate that may shear takes more of the wave: docs/trust.md."""
    wall = hl.Laminate([hl.Ply(CROSS, 0.5e-3, angle) for angle in (0.0, pi / 2.0, pi / 2.0, 0.0)])
    bead, ratios = hl.Sphere(2.38e-3, hl.STEEL_440C), []
    for make in (hl.kirchhoff_plate, hl.mindlin_plate):
        body = make(0.16, 0.16, None, wall, hl.Supports(*["clamped"] * 4)).at(0.08, 0.08)
        chain = hl.Chain([bead] * 16, bead, 0.31, gravity=9.81)
        run = hl.CoSimulation(chain, hl.reduce(body, until=5e-4)).run(5e-4)
        ratios.append(hl.amplitude_ratio(run, 8).item())
    assert ratios == pytest.approx([0.489, 0.470], abs=2e-3)


OBLIQUE = [(0.0, 0.0), (0.3, 0.0), (0.3, 0.3 * tan(0.3) + 0.2), (0.0, 0.2)]
"""Its third side runs along the fibres of plies at 0.3 rad."""


@pytest.mark.parametrize(
    ("make", "edge", "along"),
    [
        (lambda wall: hl.kirchhoff_plate(0.3, 0.2, None, wall, hl.Supports(left="symmetry")), "left", 0.0),
        (lambda wall: hl.mindlin_plate(0.3, 0.2, None, wall, hl.Supports(top="symmetry")), "top", 0.0),
        (lambda wall: hl.mindlin_panel(hl.Outline(OBLIQUE), None, wall, {"side 3": "symmetry"}), "side 3", 0.3),
    ],
    ids=["kirchhoff_plate", "mindlin_plate", "mindlin_panel"],
)
def test_symmetry_edges_refuse_a_wall_that_is_not_its_own_mirror_image(make: Any, edge: str, along: float) -> None:
    """Fibres along the edge, or across it, are fine; others bend and twist the wall at once."""
    for angle in (along, along + pi / 2.0):
        make(hl.Laminate([hl.Ply(CARBON, 1e-3, angle)]))
    with pytest.raises(ValueError, match=rf"supports\['{edge}'\] = 'symmetry': must have a wall without D₁₆ and D₂₆"):
        make(hl.Laminate([hl.Ply(CARBON, 1e-3, along + 0.3)]))
