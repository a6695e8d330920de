"""The plate study: the thesis's plateaus, and that every knob has settled to 0.5 %."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import xarray as xr
from printed import check

import hertzlink as hl
from hertzlink.studies import plate_boundary as study
from hertzlink.studies.table import bracketed, text

THOROUGH_FIXTURES = ("quick",)


@cache
def ratio(diameter: float, thickness: float, distance: float, **knobs: float) -> float:
    """AR at sensor 7, undamped, with mesh, reduction, window and step as given."""
    frequency = knobs.get("highest_frequency", study.on_plates.HIGHEST_FREQUENCY)
    plate = replace(study.plate(thickness), highest_frequency=frequency)
    structure = hl.reduce(plate.at(distance, study.SIDE / 2.0), until=1.5e-3, tolerance=knobs.get("tolerance", 1e-2))
    chain = study.chain(diameter)
    simulation = hl.CoSimulation(chain, structure, window=knobs.get("window"), dt=knobs.get("dt"))
    return hl.amplitude_ratio(simulation.run(1.5e-3), sensor=7).item()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("diameter", "thickness", "distance", "expected", "tolerance"),
    [
        (9.53e-3, 2.29e-3, 0.457, 0.0695, 0.0005),
        (9.53e-3, 4.83e-3, 0.457, 0.554, 0.002),
        (9.53e-3, 2.29e-3, 0.020, 0.326, 0.002),
        (4.76e-3, 2.29e-3, 0.457, 0.522, 0.001),
        (4.76e-3, 3.18e-3, 0.457, 0.702, 0.001),
        (4.76e-3, 4.83e-3, 0.457, 0.846, 0.001),
    ],
)
def test_amplitude_ratios_of_a_prototype(
    diameter: float, thickness: float, distance: float, expected: float, tolerance: float
) -> None:
    """Numbers from an independent prototype with other meshes and another reduction."""
    assert ratio(diameter, thickness, distance) == pytest.approx(expected, abs=tolerance)


CASES = [(9.53e-3, 2.29e-3, 0.457), (9.53e-3, 2.29e-3, 0.02), (4.76e-3, 4.83e-3, 0.01)]


# Finer meshes and longer bases take their time: one case each, the most sensitive one.
KNOBS = [
    *(({"tolerance": 5e-2, "window": 2e-7, "dt": 5e-9}, case) for case in CASES),
    ({"tolerance": 5e-2}, CASES[1]),
    ({"window": 2e-7}, CASES[2]),
    ({"dt": 5e-9}, CASES[0]),
    ({"tolerance": 1e-3}, CASES[0]),
    ({"highest_frequency": 80e3}, CASES[1]),
    ({"highest_frequency": 80e3}, CASES[2]),
]


@pytest.mark.thorough
@pytest.mark.parametrize(("knob", "case"), KNOBS)
def test_amplitude_ratio_has_settled(knob: dict[str, float], case: tuple[float, float, float]) -> None:
    assert ratio(*case, **knob) == pytest.approx(ratio(*case), rel=5e-3)


@pytest.mark.thorough
def test_reduction_changes_the_ratio_by_less_than_a_thousandth() -> None:
    """The full-order plate, window by window, against the reduced one."""
    plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports("clamped", "clamped"))
    full = plate.at(0.05, 0.15)
    ratios = [
        hl.amplitude_ratio(hl.CoSimulation(study.chain(9.53e-3), s).run(1.0e-3), sensor=7).item()
        for s in (full, hl.reduce(full, until=1.0e-3))
    ]
    assert ratios[1] == pytest.approx(ratios[0], rel=1e-3)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True, jobs=1)


def test_quick_study_has_the_shape_of_the_thesis(quick: xr.Dataset) -> None:
    """AR falls away from the edge, thick plates send back more, small beads settle sooner."""
    ratios = quick.amplitude_ratio.fillna(0.0)
    assert np.all(ratios.sel(distance=0.01) > ratios.sel(distance=0.457))
    assert np.all(ratios.sel(distance=0.457).diff("thickness") >= 0.0)
    assert np.isnan(quick.amplitude_ratio.sel(distance=0.457, diameter=19.05e-3, thickness=2.29e-3))
    lowest = quick.critical_distance.fillna(quick.bracket.sel(end="low"))
    assert np.all(lowest.sel(within=0.02).diff("diameter") > 0.0)


def test_quick_critical_distances(quick: xr.Dataset) -> None:
    """Brackets of 5 mm, in order of the tolerances; the table has a verdict for each."""
    at = quick.sel(within=0.02)
    low, high = (at.bracket.sel(end=end) for end in ("low", "high"))
    assert np.all(((low < at.critical_distance) & (at.critical_distance < high)) | at.lower_bound)
    assert np.all((high - low <= 5e-3) | at.lower_bound)
    assert np.all((quick.critical_distance.diff("within") < 0.0) | quick.lower_bound.any("within"))
    table = " ".join(text(study.table(quick)).split())  # reasons are wrapped
    assert table.count("between the lines") + table.count("below the A0 line") == 7


def test_heavy_beads_have_a_lower_bound(quick: xr.Dataset) -> None:
    """On the thinner plates the wave of 19.05 mm beads is late, or does not come: no distance is claimed."""
    heavy = quick.sel(diameter=19.05e-3, within=0.02)
    assert heavy.lower_bound.values.tolist() == [True, True, False]
    assert np.isnan(heavy.critical_distance[:2]).all()
    assert np.isinf(heavy.bracket.sel(end="high")[:2]).all()
    row = next(row for row in study.table(quick) if row.quantity == "critical distance, D 19.05, t 2.29")
    assert row.computed == "> 100"
    light = next(row for row in study.table(quick) if row.quantity == "critical distance, D 4.76, t 4.83")
    low, high = quick.sel(diameter=4.76e-3, thickness=4.83e-3, within=0.02).bracket.values * 1e3
    assert light.computed == f"{low:.0f} to {high:.0f}"
    assert "a lower bound" in row.reason


@pytest.mark.parametrize(
    ("ends", "text"),
    [((4.52, 5.42), "4.5 to 5.4"), ((5.262, 5.319), "5.26 to 5.32"), ((60.4, 65.4), "60 to 65"), ((0.0, 5.4), "< 5")],
)
def test_a_critical_distance_is_printed_as_its_bracket(ends: tuple[float, float], text: str) -> None:
    assert bracketed(*ends) == text


def test_table_is_honest(quick: xr.Dataset) -> None:
    check("plate-boundary", study.table(quick))


def test_far_value_is_that_of_the_infinite_plate(quick: xr.Dataset) -> None:
    """The other edges of the plate are too far from its centre to matter, and its mesh lacks 5e-4 of AR at most."""
    inside = quick.infinite_amplitude_ratio.fillna(0.0)
    assert float(abs(quick.far_value.fillna(0.0) - inside).max()) < 5e-4


def test_a_numerical_error_widens_the_interval(quick: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error of AR over its slope between the two runs is an error of the distance, on both sides."""
    monkeypatch.setattr(study, "ratio_error", lambda **case: 0.01)
    far = quick.assign(infinite_amplitude_ratio=quick.far_value)
    case = study.with_margins(far, 1).sel(diameter=4.76e-3, thickness=2.29e-3, within=0.02)
    (low, high), margin = case.bracket.values, float(case.margin)
    ends = case.amplitude_ratio.sel(distance=[low, high], method="nearest").values
    assert margin == pytest.approx(0.01 * (high - low) / abs(ends[1] - ends[0]))
    wider = [float(part) for part in study._between(case).split(" to ")]
    assert wider == pytest.approx([1e3 * (low - margin), 1e3 * (high + margin)], abs=1.0)
    assert wider[1] - wider[0] > 1e3 * (high - low)


@pytest.mark.thorough
def test_numerical_error_is_that_of_the_exact_half_plane() -> None:
    """The modes of the study err by 2e-5 of AR at this critical distance."""
    diameter, thickness, _, distance = CROSSINGS[0]
    exact = hl.half_plane(thickness, hl.ALUMINIUM_6061, "clamped", distance, study.UNTIL)
    modal, true = (
        hl.amplitude_ratio(hl.CoSimulation(study.chain(diameter), structure).run(study.UNTIL), sensor=7).item()
        for structure in (study.struck(thickness, distance), exact)
    )
    assert abs(modal - true) < 1e-4
    assert 0.3 < study.ratio_error(diameter, thickness, distance) / abs(modal - true) < 3.0


CROSSINGS = [
    (4.76e-3, 2.29e-3, 0.8e-3, 14.65e-3),
    (4.76e-3, 3.18e-3, 0.8e-3, 16.12e-3),
    (4.76e-3, 4.83e-3, 0.8e-3, 17.79e-3),
    (9.53e-3, 2.29e-3, 1.3e-3, 36.63e-3),
    (9.53e-3, 3.18e-3, 1.3e-3, 27.14e-3),
    (9.53e-3, 4.83e-3, 1.3e-3, 29.78e-3),
    (19.05e-3, 4.83e-3, 3.0e-3, 67.5e-3),
]


def crossing(diameter: float, thickness: float, until: float, expected: float, plate: str) -> float:
    """The critical distance for the study's tolerance, on its plate, by modes, or on the exact plate with one edge."""

    def at(distance: float) -> hl.CoSimulation:
        if plate == "exact":
            structure = hl.half_plane(thickness, hl.ALUMINIUM_6061, "clamped", distance, until)
        else:
            structure = study.struck(thickness, distance)
        return hl.CoSimulation(study.chain(diameter), structure)

    scan = [expected - 3e-3, expected - 1.5e-3, expected + 1.5e-3, expected + 3e-3, 0.457]
    found = hl.critical_distance_search(at, until, study.SENSOR, scan, study.TOLERANCE, jobs=1)
    return found.critical_distance.item()


@pytest.mark.thorough
@pytest.mark.parametrize("case", CROSSINGS)
def test_critical_distances_of_the_exact_half_plane(case: tuple[float, float, float, float]) -> None:
    """The numbers of docs/numerics.md, within the bracket."""
    assert crossing(*case, "exact") == pytest.approx(case[-1], abs=0.1e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("case", [CROSSINGS[i] for i in (2, 3, 5)])
def test_critical_distances_of_the_modal_plate(case: tuple[float, float, float, float]) -> None:
    """The study's plates, with all edges, agree with the exact plate that has one."""
    assert crossing(*case, "modal") == pytest.approx(case[-1], abs=0.1e-3)


def test_a_distance_outside_the_lines_is_explained(quick: xr.Dataset) -> None:
    moved = quick.assign(critical_distance=quick.critical_distance * 0.3)
    assert "below the A0 line" in text(study.table(moved))


def test_figures_are_drawn(quick: xr.Dataset) -> None:
    figures = study.figures(quick)
    assert set(figures) == {"amplitude_ratio", "time_of_flight", "critical_distance", "refinement", "edges"}
    for figure in figures.values():
        assert all("mm" in axis.get_xlabel() for axis in figure.axes)


def test_the_legend_covers_no_line(quick: xr.Dataset) -> None:
    """It stands above the axes, in which lines reach to all corners."""
    figure = study.figures(quick)["critical_distance"]
    figure.draw_without_rendering()
    (legend,), (axis,) = figure.legends, figure.axes
    assert legend.get_window_extent().y0 >= axis.get_window_extent().y1
    assert axis.get_legend() is None
    assert axis.get_ylabel() == "critical distance (mm), AR ± 0.02"


def test_the_tolerance_is_in_each_row_of_a_critical_distance(quick: xr.Dataset) -> None:
    rows = [row for row in study.table(quick) if row.quantity.startswith(("critical distance", "by the echo"))]
    assert rows
    assert all(row.reason.startswith("AR within ± 0.02") for row in rows)


def test_softer_edges_send_back_less(quick: xr.Dataset) -> None:
    """Clamped, simple, free: the stiffer the edge, the more comes back; far away all are one plate."""
    ratios = quick.edge_amplitude_ratio.fillna(0.0).sel(edge_bead=9.53e-3)
    near = [float(ratios.sel(edge=edge, edge_distance=0.02)) for edge in ("clamped", "simple", "free")]
    assert near[0] > near[1] > near[2]
    far = ratios.sel(edge_distance=0.15)
    assert float(far.max() - far.min()) < 5e-3


def test_shear_takes_a_little(quick: xr.Dataset) -> None:
    """Mindlin's plate is softer than Kirchhoff's, by a few percent of AR for these beads."""
    thin, thick = (quick.theory_amplitude_ratio.sel(theory=theory) for theory in ("Kirchhoff", "Mindlin"))
    assert np.all(thick < thin)
    assert np.all(thick > 0.95 * thin)
