"""The law of the critical distance: against simulations at other beads, plates and speeds, and its bounds."""

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import hertzlink as hl
from hertzlink.studies.critical_distance import Pair
from plates import critical_distance as law
from plates.additions import Addition

TABLE = Path(law.__file__).with_name(law.TABLE)


def plate(thickness: float, material: hl.Material = hl.ALUMINIUM_6061) -> hl.Plate:
    return hl.kirchhoff_plate(0.9, 0.9, thickness, material, hl.Supports(left="clamped"))


def bead(diameter: float, material: hl.Material = hl.STEEL_440C) -> hl.Sphere:
    return hl.Sphere(diameter / 2.0, material)


@pytest.mark.parametrize(
    ("diameter", "thickness", "expected"),
    [
        (4.76e-3, 2.29e-3, 14.7e-3), (4.76e-3, 3.18e-3, 16.1e-3), (4.76e-3, 4.83e-3, 17.8e-3),
        (9.53e-3, 2.29e-3, 37.0e-3), (9.53e-3, 3.18e-3, 27.3e-3), (9.53e-3, 4.83e-3, 29.8e-3),
    ],
)  # fmt: skip
def test_the_law_holds_on_the_thesis_s_plates(diameter: float, thickness: float, expected: float) -> None:
    """Critical distances of meshed plates, AR ± 0.02, sampled every 1 to 2 mm: good to 0.3 mm."""
    found = hl.critical_distance_law(bead(diameter), plate(thickness), impact_speed=0.31)
    assert found.low <= found.value <= found.high
    assert found.low - 0.3e-3 <= expected <= found.high + 0.3e-3
    assert found.value == pytest.approx(expected, abs=0.5e-3)


@pytest.mark.parametrize(
    ("edge", "pair", "parameter", "tolerance"),
    [
        ("clamped", Pair(bead(6e-3), hl.ALUMINIUM_6061, 0.5), 0.45, 0.02),
        ("simple", Pair(bead(12e-3), hl.ALUMINIUM_6061, 0.2), 0.12, 0.02),
        ("free", Pair(bead(9e-3), hl.ALUMINIUM_6061, 0.31), 0.25, 0.05),
        ("clamped", Pair(bead(9e-3), hl.MATERIALS["copper"], 0.31), 0.3, 0.02),
        ("free", Pair(bead(9e-3, hl.BRASS_360), hl.ALUMINIUM_6061, 0.31), 0.6, 0.05),
    ],
)
def test_ar_crosses_the_tolerance_at_the_law_s_distance(
    edge: str, pair: Pair, parameter: float, tolerance: float
) -> None:
    """A simulation at d_c, and one beyond each bound, at λ and materials that are not in the table."""
    found = hl.critical_distance_law(pair.bead, pair.plate(parameter), pair.speed, edge, tolerance)
    scaled = np.array(found) / pair.length(parameter)
    far, *near = pair.ratios(edge, parameter, (np.inf, scaled[0], scaled[1] * 0.99, scaled[2] * 1.01))
    at, inside, outside = (abs(one - far) for one in near)
    assert at == pytest.approx(tolerance, abs=law.ERROR if pair.wall is hl.ALUMINIUM_6061 else 0.008)
    assert inside > tolerance > outside


def test_a_stricter_tolerance_is_farther_away_and_jumps_are_within_the_bounds() -> None:
    """At a simple edge and λ = 0.235 a swing of AR is as large as 0.02: the bounds hold both sides of the jump."""
    ratio = Pair(bead(9e-3), hl.ALUMINIUM_6061, 0.31).stiffness_ratio
    for edge in ("clamped", "simple", "free"):
        for parameter in (0.05, 0.3, 0.9, 1.5):
            found = [law.scaled_critical_distance(edge, ratio, parameter, t).value for t in (0.1, 0.05, 0.02, 0.01)]
            assert found == sorted(found)
    below, above = (law.scaled_critical_distance("simple", ratio, p, 0.02) for p in (0.22, 0.26))
    assert above.value > 1.4 * below.value
    at = law.scaled_critical_distance("simple", ratio, 0.235, 0.02)
    assert at.low < below.value * 1.05
    assert at.high > above.value * 0.95


@pytest.mark.thorough
@pytest.mark.parametrize("place", [7, 25, 52, 60, 96, 140])
def test_the_table_is_reproduced(place: int) -> None:
    """Some entries, simulated again."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        head, *lines = csv.reader(file)
    edge, ratio, parameter, far, *values = lines[place]
    columns = (8, 16, 22)
    # A plate that gives the ratio of stiffnesses: 1/E* = 1/M + 1/M_plate, M = E/(1 − ν²); pairs have half the radius.
    modulus = hl.STEEL_440C.contact_modulus * float(ratio) / (2.0 * 2.0**0.5 - float(ratio))
    pair = Pair(bead(10e-3), hl.Material(modulus * (1.0 - 0.33**2), 0.33, 2700.0), 0.3)
    found = pair.ratios(edge, float(parameter), (np.inf, *(float(head[4 + i]) for i in columns)))
    assert found == pytest.approx([float(far), *(float(values[i]) for i in columns)], abs=1e-4)


STEEL_BEAD = bead(4.76e-3)


@pytest.mark.parametrize(
    "law",
    [
        lambda one: hl.critical_distance_law(STEEL_BEAD, one, 0.31),
        lambda one: hl.theory.PlateImpact(STEEL_BEAD, one, 0.31).inelasticity,
        lambda one: hl.theory.PlateImpact(STEEL_BEAD, one, 0.31).contact_time,
        lambda one: one.point_impedance,
    ],
)
def test_laws_of_plain_plates_name_what_they_leave_out(law: Callable[[hl.Plate], object]) -> None:
    """The distance of a plate 1.5 mm thick under 200 MPa is 4 % larger than that of the law."""
    additions: list[Addition] = [hl.Prestress(xx=3e5), hl.PointMass(0.2, 0.2, 1e-3)]
    sides = hl.Supports(left="clamped", right="clamped")
    loaded, plain = (
        hl.kirchhoff_plate(0.4, 0.4, 1.5e-3, hl.ALUMINIUM_6061, sides, additions=some) for some in (additions, [])
    )
    with pytest.warns(hl.HertzlinkWarning, match="neglect Prestress, PointMass; runs include them") as caught:
        found = law(loaded)
    assert sum("neglect" in str(one.message) for one in caught) == 1
    assert found == law(plain)


RIB = hl.ALUMINIUM_6061.youngs_modulus * 3e-3 * 10e-3**3 / 12.0, 2.3, hl.ALUMINIUM_6061.density * 3e-5
"""Bending and torsion stiffness, N m², and mass per length, kg/m, of a bar of 3 mm by 10 mm."""


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"edge": "clampd"}, "edge = 'clampd'.*did you mean 'clamped'"),
        ({"tolerance": 0.001}, r"tolerance = 0\.001: must lie between 0\.01 and 0\.1"),
        ({"tolerance": 2.0}, r"tolerance = 2\.0: must lie between 0\.01 and 0\.1"),
        ({"tolerance": None}, "tolerance = None"),
        ({"impact_speed": 0.0}, r"impact_speed = 0\.0"),
        ({"plate": plate(20e-3)}, r"inelasticity parameter is 0\.0\d+; must lie between 0\.05 and 2"),
        ({"plate": plate(0.5e-3)}, r"inelasticity parameter is 6\.\d+; must lie between 0\.05 and 2"),
        ({"plate": plate(4e-3, hl.PTFE)}, r"stiffness ratio of the contacts .* is 0\.02\d+; must lie between 0\.35"),
        ({"plate": hl.ALUMINIUM_6061}, "plate = Material"),
        ({"bead": 3.0}, r"bead = 3\.0: must be a bead"),
    ],
)
def test_bad_input(change: dict[str, object], message: str) -> None:
    arguments = {"bead": STEEL_BEAD, "plate": plate(2.29e-3), "impact_speed": 0.31, **change}
    with pytest.raises(ValueError, match=message) as error:
        hl.critical_distance_law(**arguments)  # type: ignore[arg-type]
    assert "\n" not in str(error.value)
    assert ("critical_distance_search" in str(error.value)) == (
        "parameter is" in message or "stiffness ratio" in message
    )


@pytest.mark.parametrize(
    ("material", "times"), [(hl.BRASS_360, "5.6"), (hl.ALUMINIUM_6061, "2.8"), (hl.STEEL_440C, "")]
)
def test_a_plate_that_yields_is_said(material: hl.Material, times: str, recwarn: pytest.WarningsRecorder) -> None:
    """The pressures are those that runs against thick walls report at the last bead."""
    hl.critical_distance_law(bead(9.52e-3), plate(2e-3, material), impact_speed=0.31)
    said = [str(one.message) for one in recwarn]
    assert [f"presses {material.name} to about {times} times" in one for one in said] == [True] * bool(times)
