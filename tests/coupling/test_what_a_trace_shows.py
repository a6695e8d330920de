"""What a trace determines of a plate's edge and of a bond: the facts of docs/identification.md."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

import hertzlink as hl

BEAD, ALLOY, THICKNESS = hl.Sphere(4.765e-3, hl.STEEL_440C), hl.ALUMINIUM_6061, 4.83e-3
SHORT, LONG, HIGHEST = 1.4e-3, 2.8e-3, 60e3  # Records, s; the highest frequency of the plate's motion, Hz.


def edge(
    distance: float, thickness: float, impact_speed: float, modulus: float = ALLOY.youngs_modulus, known: bool = True
) -> hl.CoSimulation:
    """A chain beside a clamped edge. known: the contact's stiffness does not follow from the plate's modulus."""
    plate = hl.half_plane(thickness, replace(ALLOY, youngs_modulus=modulus), "clamped", distance, LONG, HIGHEST)
    if known:
        plate = replace(plate, surface=hl.Surface(ALLOY))
    return hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, impact_speed), plate)


def test_an_edge_whose_echo_is_late_is_blind() -> None:
    """The fastest resolved bending wave has the group speed 2 √(a ω): its echo is back after the end of the record."""
    stiffness = ALLOY.youngs_modulus * THICKNESS**2 / 12.0 / (1.0 - ALLOY.poisson_ratio**2) / ALLOY.density
    late = 0.6 * 2.0 * (stiffness**0.5 * 2.0 * np.pi * HIGHEST) ** 0.5 * LONG
    known = hl.identifiability(edge, 0.01, [7, 13, 16], LONG, distance=late, thickness=THICKNESS, impact_speed=0.31)
    assert known.relative["distance"] == inf
    assert known.relative["impact_speed"] < 0.05


@pytest.mark.thorough
def test_two_numbers_do_not_give_three_unknowns() -> None:
    found = hl.identifiability(
        edge, 0.01, [7], SHORT, compare="features", distance=0.03, thickness=THICKNESS, impact_speed=0.31
    )
    assert found.relative == dict.fromkeys(("distance", "thickness", "impact_speed"), inf)


def test_an_alloy_of_any_modulus_bends_like_another_plate() -> None:
    """Its motion depends on E t⁴ and d⁴/(E t²) alone: no trace distinguishes such plates where the contact is known."""
    factor, modulus = 1.3, 1.3 * ALLOY.youngs_modulus
    cases = (
        edge(0.03, THICKNESS, 0.31), edge(0.03, THICKNESS, 0.31, modulus),
        edge(0.03 * factor**0.125, THICKNESS * factor**-0.25, 0.31, modulus),
    )  # fmt: skip
    first, other, same = (hl.sensor_force(one.run(1e-3), 7).values for one in cases)
    assert same == pytest.approx(first, abs=1e-3 * first.max())
    assert abs(other - first).max() > 0.02 * first.max()

    def build(distance: float, thickness: float, modulus: float) -> hl.CoSimulation:
        return edge(distance, thickness, 0.31, modulus)

    values = {"distance": 0.06, "thickness": THICKNESS, "modulus": ALLOY.youngs_modulus}
    assert hl.identifiability(build, 0.01, [7], SHORT, **values).verdict("modulus") == "blind"


@pytest.mark.thorough
def test_the_contact_shows_the_modulus() -> None:
    """The contact's stiffness follows from the plate's modulus; distance, thickness and speed are unknown."""

    def build(distance: float, thickness: float, modulus: float, impact_speed: float) -> hl.CoSimulation:
        return edge(distance, thickness, impact_speed, modulus, known=False)

    values = {"distance": 0.06, "thickness": THICKNESS, "modulus": ALLOY.youngs_modulus, "impact_speed": 0.31}
    known = hl.identifiability(build, 0.01, [7], SHORT, **values)
    assert 1.96 * known.relative["modulus"] == pytest.approx(0.018, rel=0.1)


UPPERS = {"steel": hl.STEEL_440C, "PTFE": hl.PTFE}


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("upper", "stiffness", "half_width"),
    [
        ("steel", 3e10, 0.6), ("steel", 3e11, 0.5), ("steel", 3e12, 11.0), ("steel", 3e13, inf),
        ("PTFE", 3e10, 3.3), ("PTFE", 3e11, inf), ("PTFE", 3e12, inf), ("PTFE", 3e13, inf),
    ],
)  # fmt: skip
def test_bonds_are_seen_where_they_are_soft_compared_with_the_layer(
    upper: str, stiffness: float, half_width: float
) -> None:
    """Compliances add. N/m³ of 0.1 mm of glue below 12.2 mm; per cent, with the layer's thickness and speed unknown."""

    def build(bond: float, thickness: float, impact_speed: float) -> hl.CoSimulation:
        glue = hl.Material(bond * 0.1e-3, 0.35, 1200.0, "glue")
        stack = ((UPPERS[upper], thickness), (glue, 0.1e-3), (hl.STEEL_440C, 50.8e-3))
        rod = hl.rod([hl.Layer(material, length, 9.525e-3) for material, length in stack], "fixed", elements=15)
        return hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, impact_speed), rod)

    known = hl.identifiability(build, 0.01, [7, 13], SHORT, bond=stiffness, thickness=12.2e-3, impact_speed=0.31)
    found = 196.0 * known.relative["bond"]
    assert found > 50.0 if half_width == inf else found == pytest.approx(half_width, rel=0.15)
