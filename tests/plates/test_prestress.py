"""Plates under forces in their plane: closed forms, buckling loads, limits, energy."""

from math import inf, pi

import numpy as np
import pytest
from independent.plates import frequencies

import hertzlink as hl

ALUMINIUM, SIDE, THICKNESS = hl.Material(70e9, 0.3, 2700.0), 0.2, 1e-3
EULER = 70e9 * THICKNESS**3 / 12.0 / 0.91 * (pi / SIDE) ** 2
"""π²D/b², N/m."""


def square(kind: str, *forces: float, held: str = "simple", **more: object) -> hl.Plate:
    additions = [hl.Prestress(*forces)]
    if kind == "panel":
        corners = [(0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE)]
        shape, edges = hl.Outline(corners, edges="rim"), {"rim": held}
        return hl.mindlin_panel(shape, THICKNESS, ALUMINIUM, edges, additions=additions, **more)
    build = {"kirchhoff": hl.kirchhoff_plate, "mindlin": hl.mindlin_plate}[kind]
    return build(SIDE, SIDE, THICKNESS, ALUMINIUM, hl.Supports(*[held] * 4), additions=additions, **more)


def exact(forces: tuple[float, float], count: int) -> np.ndarray:
    """ω of a simply supported plate, rad/s."""
    p, q = np.meshgrid(pi * np.arange(1, 9) / SIDE, pi * np.arange(1, 9) / SIDE)
    rigidity = EULER * (SIDE / pi) ** 2
    square = rigidity * (p**2 + q**2) ** 2 + forces[0] * p**2 + forces[1] * q**2
    return np.sqrt(np.sort(square.ravel())[:count] / (2700.0 * THICKNESS))


FORCES = (-1.7 * EULER, 0.8 * EULER)


def test_simple_plate_with_order_4() -> None:
    """Frequencies of Bogner–Fox–Schmit elements converge with order 4 under tension and compression."""
    errors = [frequencies(square("kirchhoff", *FORCES, cells=(n, n)), 4) / exact(FORCES, 4) - 1.0 for n in (10, 20, 40)]
    assert np.all(errors[0] > 0.0)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.2)
    assert abs(errors[2]).max() < 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize(("kind", "within"), [("panel", 1e-3), ("mindlin", 1e-3)])
def test_other_elements(kind: str, within: float) -> None:
    plate = square(kind, *FORCES, highest_frequency=2e4)
    assert frequencies(plate, 4) == pytest.approx(exact(FORCES, 4), rel=within)


@pytest.mark.parametrize(
    ("held", "forces", "factor", "within"),
    [
        ("simple", (-1.0, 0.0, 0.0), 4.0, 1e-3),
        ("simple", (-1.0, -1.0, 0.0), 2.0, 1e-3),
        # Timoshenko, Gere, Theory of Elastic Stability, 2nd ed.: table 9-11 and sections 9.7, 9.9 and 9.14.
        ("simple", (0.0, 0.0, 1.0), 9.34, 1e-2),
        ("clamped", (-1.0, 0.0, 0.0), 10.07, 1e-2),
        ("clamped", (0.0, 0.0, 1.0), 14.71, 1e-2),
    ],
)
def test_a_plate_that_buckles_is_refused(
    held: str, forces: tuple[float, float, float], factor: float, within: float
) -> None:
    """It is refused even if it buckles in a way that the contact does not excite."""
    below, above = (
        square("kirchhoff", *(part * factor * EULER * one for one in forces), held=held, highest_frequency=1e4)
        for part in (1.0 - within, 1.0 + within)
    )
    below.at(SIDE / 2.0, SIDE / 2.0)
    with pytest.raises(ValueError, match="buckles under this prestress"):
        above.at(SIDE / 2.0, SIDE / 2.0)


@pytest.mark.parametrize(
    ("forces", "mises"),
    [
        ((1.0, 0.0, 0.0), 1.0), ((0.0, -1.0, 0.0), 1.0), ((1.0, 1.0, 0.0), 1.0), ((1.0, -1.0, 0.0), 3.0**0.5),
        ((0.0, 0.0, -1.0), 3.0**0.5),
    ],
)  # fmt: skip
def test_a_stress_beyond_yield_is_told(
    forces: tuple[float, float, float], mises: float, recwarn: pytest.WarningsRecorder
) -> None:
    """Von Mises's stress counts; a stress that is given in place of a force per length causes the same warning."""
    held, at_yield = hl.Supports(*["clamped"] * 4), 276e6 * THICKNESS / mises
    for factor, told in ((0.99, 0), (1.01, 1), (1e3, 1)):
        stress = hl.Prestress(*(factor * at_yield * one for one in forces))
        hl.kirchhoff_plate(SIDE, SIDE, THICKNESS, hl.ALUMINIUM_6061, held, additions=[stress])
        found = [str(one.message) for one in recwarn]
        assert len(found) == told
        assert all("beyond its yield strength of 276 MPa; Prestress takes forces per length" in one for one in found)
        recwarn.clear()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hl.Prestress("a"), "xx = 'a'"),
        (lambda: hl.Prestress(yy=inf), "yy = inf"),
        (lambda: square("kirchhoff", -5.0 * EULER).at(0.1, 0.1), "buckles under this prestress"),
        (lambda: square("kirchhoff", -5.0, held="free").at(0.1, 0.1), "buckles under this prestress"),
        (lambda: square("kirchhoff", 0.0, 0.0, 5.0, held="symmetry"), "and no prestress with shear"),
    ],
)  # fmt: skip
def test_bad_input(call: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
