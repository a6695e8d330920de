"""Plates as structures: where they may be struck, meshes, theory, bad input."""

import numpy as np
import pytest

import hertzlink as hl

CLAMPED = hl.Supports("clamped", "clamped", "free", "free")
PLATE = hl.kirchhoff_plate(0.914, 0.914, 2.29e-3, hl.ALUMINIUM_6061, CLAMPED)


def test_struck_anywhere_on_a_shared_mesh() -> None:
    """Off the nodes the contact vector reads a cubic field exactly, and all points share the matrices."""
    plate = hl.kirchhoff_plate(0.4, 0.3, 2e-3, hl.ALUMINIUM_6061, hl.Supports(), cells=(4, 3))
    one, other = plate.at(0.123, 0.271), plate.at(0.2, 0.1)
    assert one.stiffness is other.stiffness
    x, y = np.linspace(0.0, 0.4, 5), np.linspace(0.0, 0.3, 4)
    field = np.kron(np.c_[x**3, 3.0 * x**2].ravel(), np.c_[y**2, 2.0 * y].ravel())
    assert one.contact @ field == pytest.approx(0.123**3 * 0.271**2)


def test_point_impedance_of_the_thesis_plate() -> None:
    """8 √(D ρ t) with D = E t³ / 12(1 − ν²), by hand."""
    rigidity = 68.9e9 * 2.29e-3**3 / (12.0 * (1.0 - 0.33**2))
    assert PLATE.point_impedance == pytest.approx(8.0 * (rigidity * 2693.0 * 2.29e-3) ** 0.5, rel=1e-12)


@pytest.mark.parametrize(("diameter", "expected"), [(9.53e-3, (27.8, 79.3)), (19.1e-3, (55.8, 159.0))])
def test_bounds_of_the_critical_distance(diameter: float, expected: tuple[float, float]) -> None:
    """Equation 6.41 of the thesis with v = 0.31 m/s, recomputed independently, in mm."""
    bead = hl.Sphere(diameter / 2.0, hl.STEEL_440C)
    bounds = np.array(hl.critical_distance_bounds(bead, PLATE, impact_speed=0.31)) * 1e3
    assert bounds == pytest.approx(expected, abs=0.06)


@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        (-0.01, 0.4, r"x = -0\.01: must lie on the plate"),
        (0.4, 1.0, r"y = 1\.0: must lie on the plate, between 0 and 0\.914 m"),
        (0.0, 0.4, r"x, y = 0, 0\.4: must not lie on a clamped edge"),
        (0.914, 0.4, r"x, y = 0\.914, 0\.4: must not lie on a clamped edge"),
        (float("nan"), 0.4, "x = nan"),
    ],
)
def test_contact_off_the_plate(x: float, y: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        PLATE.at(x, y)


def test_a_thick_plate_is_warned_of() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="Kirchhoff's theory is for thin plates"):
        hl.kirchhoff_plate(0.1, 0.1, 0.05, hl.PTFE, CLAMPED)


def test_texts_are_short() -> None:
    """One line each, whatever they hold."""
    rim = hl.Outline(hl.circle(0.1), edges="rim")
    ply = hl.Ply(hl.OrthotropicMaterial(135e9, 9e9, 0.3, 5e9, 5e9, 3.2e9, 1560.0), 2e-4)
    wall = hl.Laminate([ply] * 40)
    mass = hl.PointMass(0.01, 0.02, 1e-3)
    for one in (rim, wall, PLATE, hl.mindlin_panel(rim, None, wall, {"rim": "simple"}, additions=[mass])):
        assert len(repr(one)) < 160
        assert "\n" not in repr(one)
    panel = hl.mindlin_panel(rim, 2e-3, hl.PTFE, {"rim": hl.ElasticEdge(1e5)}, additions=[mass])
    described = "<Mindlin panel, polygon of 96 corners, 0.2001 × 0.2001 m, 2 mm of PTFE; rim on springs; 1 addition>"
    assert repr(panel) == described
    assert panel.data([])["supports"] == {"rim": {"translation": 1e5, "rotation": 0.0}}


def test_one_form_of_input_for_all_plates() -> None:
    """What a result holds of a plate: the same entries in every theory, and those of the shape."""
    origins = [make(0.2, 0.1, 2e-3, hl.PTFE, CLAMPED, cells=(4, 2)).at(0.1, 0.05).origin
               for make in (hl.kirchhoff_plate, hl.mindlin_plate)]  # fmt: skip
    assert set(origins[1]) - set(origins[0]) == {"shear_correction"}
    for name in ("length", "width", "cells", "thickness", "material", "supports", "highest_frequency", "at"):
        assert origins[0][name] == origins[1][name]
