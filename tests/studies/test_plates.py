"""Chains on thin plates (section 6.2): Zener's theory, edges, critical distances and shear."""

import numpy as np
import pytest
from quick import found, quick

import hertzlink as hl
from hertzlink.studies import aspect_ratio, critical_distance, plate_boundary, shared

CROSSINGS = [
    (4.76e-3, 2.29e-3, 14.65e-3), (4.76e-3, 3.18e-3, 16.12e-3), (4.76e-3, 4.83e-3, 17.79e-3),
    (9.53e-3, 2.29e-3, 36.63e-3), (9.53e-3, 3.18e-3, 27.14e-3), (9.53e-3, 4.83e-3, 29.78e-3),
    (19.05e-3, 4.83e-3, 67.5e-3),
]  # fmt: skip
"""Bead, plate and critical distance, m, of docs/numerics.md."""


@pytest.mark.thorough
def test_amplitude_ratio_at_the_centre_is_that_of_zeners_restitution() -> None:
    """AR is within 0.04 of e^(6/5) below D/t = 4, and negligible above 5 (section 6.2.1); a large plate is infinite."""
    data = quick("aspect-ratio").amplitude_ratio.fillna(0.0)
    for diameter, thickness in ((d, t) for d in data.diameter.values for t in data.thickness.values):
        ratio, at = diameter / thickness, data.sel(diameter=diameter, thickness=thickness)
        plate, infinite = (at.sel(body=body).item() for body in aspect_ratio.BODIES)
        if ratio < 4.0:
            assert plate == pytest.approx(aspect_ratio.theory(ratio, 0.31)[0], abs=0.04)
        assert ratio < 5.0 or plate < 0.02
        assert plate == pytest.approx(infinite, abs=0.002)


@pytest.mark.parametrize(
    ("diameter", "thickness", "parameter", "expected"),
    [
        (9.53e-3, 4.83e-3, 0.29, 59.1), (9.53e-3, 2.29e-3, 1.28, 87.81), (19.1e-3, 4.83e-3, 1.158, 164.4),
        (19.1e-3, 2.29e-3, 5.1548, 1435.2),
    ],
)  # fmt: skip
def test_contact_times_of_the_thesis(diameter: float, thickness: float, parameter: float, expected: float) -> None:
    """µs, by Zener's τ_c from a λ that rounds to the printed one, at 0.31 m/s."""
    bead, plate = hl.Sphere(diameter / 2.0, shared.THEIR_STEEL), shared.plate(thickness)
    impact = hl.theory.PlateImpact(bead, plate, shared.THEIR_STRIKER_SPEED, parameter)
    assert impact.contact_time * 1e6 == pytest.approx(expected, rel=1e-3)


def test_waves_of_the_plate() -> None:
    """Recomputed: Rayleigh's 0.571 of the bar speed; A0 in 2.29 and 4.83 mm, D = 9.53 mm, 9 kHz: 895 and 1300 m/s."""
    alloy = shared.ALUMINIUM
    assert plate_boundary.rayleigh_speed() / alloy.bar_speed == pytest.approx(0.571, abs=1e-3)
    frequency = 0.5 / plate_boundary.contact_time(9.53e-3)
    assert frequency == pytest.approx(9.0e3, rel=0.02)
    speeds = [plate_boundary.group_speed(thickness, frequency) for thickness in (2.29e-3, 4.83e-3)]
    assert speeds == pytest.approx([895.0, 1300.0], rel=0.05)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("diameter", "thickness", "distance", "expected", "apart"),
    [
        (9.53e-3, 2.29e-3, 0.457, 0.0695, 0.0005), (9.53e-3, 4.83e-3, 0.457, 0.554, 0.002),
        (9.53e-3, 2.29e-3, 0.020, 0.326, 0.002), (4.76e-3, 2.29e-3, 0.457, 0.522, 0.001),
        (4.76e-3, 3.18e-3, 0.457, 0.702, 0.001), (4.76e-3, 4.83e-3, 0.457, 0.846, 0.001),
    ],
)  # fmt: skip
def test_amplitude_ratios_of_a_prototype(
    diameter: float, thickness: float, distance: float, expected: float, apart: float
) -> None:
    """Numbers from an independent prototype with other meshes and another reduction."""
    run = plate_boundary.build(thickness, distance, diameter).run(plate_boundary.record(diameter))
    assert hl.amplitude_ratio(run, sensor=7).item() == pytest.approx(expected, abs=apart)


@pytest.mark.thorough
def test_the_boundary_study_has_the_shape_of_the_thesis() -> None:
    """AR falls away from the edge, thick plates send back more, small beads settle sooner; the centre is far away."""
    data = quick("plate-boundary")
    ratios = data.amplitude_ratio.fillna(0.0)
    assert np.all(ratios.sel(distance=0.01) > ratios.sel(distance=0.457))
    assert np.all(ratios.sel(distance=0.457).diff("thickness") >= 0.0)
    assert np.isnan(data.amplitude_ratio.sel(distance=0.457, diameter=19.05e-3, thickness=2.29e-3))
    lowest = data.critical_distance.fillna(data.bracket.sel(end="low"))
    assert np.all(lowest.sel(within=0.02).diff("diameter") > 0.0)
    inside = data.infinite_amplitude_ratio.fillna(0.0)
    assert float(abs(data.far_value.fillna(0.0) - inside).max()) < 5e-4


@pytest.mark.thorough
def test_heavy_beads_have_a_lower_bound() -> None:
    """On the thinner plates the wave of 19.05 mm beads is late, or does not come: no distance is claimed."""
    heavy = quick("plate-boundary").sel(diameter=19.05e-3, within=0.02)
    assert heavy.lower_bound.values.tolist() == [True, True, False]
    assert np.isnan(heavy.critical_distance[:2]).all()
    assert found("plate-boundary")["critical distance, D 19.05, t 2.29"][""] == "> 100"


@pytest.mark.thorough
def test_a_numerical_error_widens_the_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    """An error of AR over its slope between the two runs is an error of the distance, on both sides."""
    data = quick("plate-boundary")
    monkeypatch.setattr(plate_boundary, "ratio_error", lambda *case: 0.01)
    case = plate_boundary.with_margins(data.assign(infinite_amplitude_ratio=data.far_value))
    case = case.sel(diameter=4.76e-3, thickness=2.29e-3, within=0.02)
    (low, high), margin = case.bracket.values, float(case.margin)
    ratios = case.amplitude_ratio.sel(distance=[low, high], method="nearest").values
    assert margin == pytest.approx(0.01 * (high - low) / abs(ratios[1] - ratios[0]))
    wider = [float(part) for part in plate_boundary.between(case).split(" to ")]
    assert wider == pytest.approx([1e3 * (low - margin), 1e3 * (high + margin)], abs=1.0)


@pytest.mark.thorough
@pytest.mark.parametrize(("diameter", "thickness", "distance"), CROSSINGS)
@pytest.mark.parametrize("plate", ["exact", "modes"])
def test_critical_distances_of_two_plates(diameter: float, thickness: float, distance: float, plate: str) -> None:
    """The exact plate that has one edge, and the study's modes with all edges, agree within 0.1 mm."""
    until = plate_boundary.record(diameter)

    def at(distance: float) -> hl.CoSimulation:
        if plate == "modes":
            return plate_boundary.build(thickness, distance, diameter)
        exact = hl.half_plane(thickness, shared.ALUMINIUM, "clamped", distance, until)
        return hl.CoSimulation(shared.plate_chain(diameter), exact)

    scan = [*(distance + step for step in (-3e-3, -1.5e-3, 1.5e-3, 3e-3)), 0.457]
    found = hl.critical_distance_search(at, until, shared.SENSOR, scan, plate_boundary.TOLERANCE, jobs=1)
    assert found.critical_distance.item() == pytest.approx(distance, abs=0.1e-3)


@pytest.mark.thorough
def test_amplitude_ratios_near_an_edge_collapse() -> None:
    """AR falls towards its far value away from an edge that is held, and rises from a free one; pairs collapse."""
    data = quick("critical-distance")
    difference = data.amplitude_ratio - data.far_ratio
    assert (difference.sel(edge=["clamped", "simple"]).isel(scaled_distance=0) > 0.1).all()
    assert (difference.sel(edge="free").isel(scaled_distance=0) < -0.1).all()
    assert abs(difference.isel(scaled_distance=-1)).max() < 3e-3
    assert abs(data.table_error).where(data.scaled_distance > 0.5).max() < 2e-3
    assert abs(data.other_table_error).max() < 5e-4


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("speed", "place", "lower"),
    [(0.31, 1.0, 0.0252), (0.31, 1.5, 0.0147), (0.02, np.inf, 0.0036), (0.31, np.inf, 0.0097), (3.1, np.inf, 0.0217)],
)
def test_shear_lowers_the_amplitude_ratio(speed: float, place: float, lower: float) -> None:
    """AR by Kirchhoff's theory minus Mindlin's at λ = 0.3 and d/ℓ from a clamped edge; the speed sets t/ℓ to 0.15, 0.23
    and 0.33 (docs/plate_edge.md). The plate is so wide that echoes of its other edges return after the contact."""
    pair = critical_distance.Pair(hl.Sphere(2.38e-3, hl.STEEL_440C), hl.ALUMINIUM_6061, speed)
    length, thickness = pair.length(0.3), pair.plate(0.3).thickness
    side, highest, edges = 22.0 * length, 1.2 / pair.contact_time, hl.Supports(left="clamped")
    plate = hl.mindlin_plate(side, side, thickness, pair.wall, edges, highest_frequency=highest)
    until = 30.0 * pair.contact_time
    mindlin = hl.reduce(plate.at(length * min(place, 11.0), side / 2.0), until, 0.05)
    kirchhoff, sheared = (one.run(until) for one in (pair.near("clamped", 0.3, place), pair.on(mindlin)))
    difference = critical_distance.ratio(kirchhoff) - critical_distance.ratio(sheared)
    assert difference == pytest.approx(lower, abs=5e-4)


def test_the_last_crossing_of_samples() -> None:
    """AR that decays as e^{−x} crosses 0.02 at ln 50, and the last swing of a cosine counts; NaN where it has not."""
    distances = np.linspace(0.1, 6.0, 60)
    crossing = critical_distance.crossing
    assert crossing(np.exp(-distances), 0.02, distances) == pytest.approx(np.log(50.0), abs=1e-3)
    swing = 0.03 * np.cos(distances) * (distances < 4.5)
    assert crossing(swing, 0.02, distances) == pytest.approx(np.pi + np.arccos(2.0 / 3.0), abs=2e-3)
    assert np.isnan(crossing(np.exp(-distances), 1e-3, distances))
