"""Critical distances: read from given samples, and found by refinement where the crossing is known in closed form."""

import re
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from coupling.results.critical_distance import last_crossing

NAN, INF = np.nan, np.inf


def curve(values: list[Any], distances: list[Any] | None = None) -> xr.DataArray:
    places = [0.1 * (1 + i) for i in range(len(values))] if distances is None else distances
    return xr.DataArray(values, coords={"distance": places}, dims="distance")


# Given samples.


def test_critical_distance_is_interpolated() -> None:
    """AR falls linearly from 1 at 0 to 0.5 at 100 mm and stays: within 0.1 of 0.5 from 80 mm on."""
    ratio = curve([1.0, 0.75, 0.5, 0.5, 0.5], [0.0, 0.05, 0.1, 0.2, 0.3])
    assert hl.critical_distance(ratio, tolerance=0.1) == pytest.approx(0.08)
    assert hl.critical_distance(ratio[::-1], tolerance=0.1) == pytest.approx(0.08)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([NAN, NAN, NAN, NAN], (NAN, NAN, NAN)),
        ([NAN, NAN, NAN, 0.3], (NAN, NAN, NAN)),
        ([0.3, 0.1, NAN, NAN], (NAN, 0.2, INF)),
        ([0.3, NAN, NAN, NAN], (NAN, 0.1, INF)),
        ([1.0, 0.8, 0.6, 0.4], (NAN, 0.3, INF)),
        ([0.9, 0.8, NAN, 0.1], (NAN, 0.2, INF)),
        # A wave that fades before it is missed may still be followed by a larger, later one.
        ([0.3, 0.1, 0.015, NAN], (NAN, 0.2, INF)),
        ([0.015, 0.012, NAN, NAN], (NAN, NAN, NAN)),
        # A missing wave between waves is unknown, and makes the bracket wider.
        ([0.7, NAN, 0.5, 0.5], (0.1 + 0.2 * 0.18 / 0.2, 0.1, 0.3)),
        ([0.7, 0.5, NAN, 0.5], (0.1 + 0.1 * 0.18 / 0.2, 0.1, 0.2)),
        ([0.5, 0.501, 0.5], (0.1, 0.0, 0.1)),
    ],
)
def test_bracket_of_given_samples(values: list[float], expected: tuple[float, float, float]) -> None:
    samples = curve(values)
    found = last_crossing(samples.distance.values, samples.values, 0.02)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    np.testing.assert_equal(hl.critical_distance(samples), found[0])


def test_critical_distance_over_other_dimensions() -> None:
    ratio = xr.concat([curve([1.0, 0.5, 0.5]), curve([0.9, NAN, NAN])], "plate")
    found = hl.critical_distance(ratio, tolerance=0.25)
    assert isinstance(found, xr.DataArray)
    assert found.attrs["units"] == "m"
    np.testing.assert_allclose(found, [0.15, NAN])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"ratio": 3}, "ratio = 3: must be a DataArray"),
        ({"ratio": curve([1.0, 0.5])}, "three distances"),
        ({"ratio": xr.DataArray(0.5)}, "three distances"),
        ({"ratio": curve([0.9, 0.6, 0.5], [NAN, 0.02, 0.03])}, "distance = "),
        ({"ratio": curve([0.9, 0.6, 0.5], [-1.0, 0.02, 0.03])}, "none of them negative"),
        ({"ratio": curve([0.9, 0.6, 0.5], [0.01, 0.02, INF])}, "must be finite numbers of m"),
        ({"ratio": curve([0.9, 0.6, 0.5], [0.01, 0.01, 0.03])}, "none of them negative or twice"),
        ({"ratio": curve([0.9, 0.6, 0.5], [*"abc"])}, "must be finite numbers of m"),
        ({"ratio": curve([*"abc"])}, "ratio: must hold real numbers"),
        ({"ratio": curve([1j, 0, 0])}, "ratio: must hold real numbers"),
        ({"tolerance": 0.0}, "tolerance = 0"),
        ({"tolerance": NAN}, "tolerance = nan"),
    ],
)
def test_bad_input_to_given_samples(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.critical_distance(**{"ratio": curve([1.0, 0.5, 0.5]), **given})


# A builder whose AR is known at every distance.


class Known(hl.CoSimulation):
    """Two pulses at a sensor, the second AR times the first; none where AR is NaN."""

    def __init__(self, ratio: float) -> None:
        self.ratio = ratio

    def run(self, until: float, *given: Any, **named: Any) -> xr.Dataset:
        time = np.arange(0.0, until, 1e-6)
        ratio = 0.0 if np.isnan(self.ratio) else self.ratio
        force = np.exp(-(((time - 1e-4) / 2e-5) ** 2)) + ratio * np.exp(-(((time - 4e-4) / 2e-5) ** 2))
        return hl.as_signal(time, {7: force})


def sampled(ratio: Callable[[float], float], seen: list[float], distance: float) -> Known:
    seen.append(distance)
    return Known(ratio(distance))


def falling(distance: float) -> float:
    """0.5 + e^(−d/10 mm)/2: within 0.02 of 0.5 from 10 mm · ln 25 on."""
    return float(0.5 + 0.5 * np.exp(-distance / 0.01))


def oscillating(distance: float) -> float:
    return float(0.5 + 0.4 * np.exp(-distance / 0.05) * np.cos(2.0 * np.pi * distance / 0.03))


SCAN = [0.005 * i for i in range(1, 21)] + [1.0]

FEW = [0.01, 0.03, 0.06, 0.1, 0.2, 1.0]

find: Callable[..., xr.Dataset] = partial(hl.critical_distance_search, until=6e-4, sensor=7, distances=SCAN, jobs=1)


@pytest.mark.parametrize("bracket", [1e-3, 2e-4, 1e-5])
def test_refinement_meets_the_closed_form(bracket: float) -> None:
    """The bracket holds the crossing and is as narrow as asked; AR read from pulses is good to 1e-5."""
    seen: list[float] = []
    found = find(partial(sampled, falling, seen), bracket=bracket)
    low, high = found.bracket.values
    exact = 0.01 * np.log(25.0)
    assert low - 1e-5 < exact < high + 1e-5
    assert 0.0 < high - low <= bracket
    assert found.critical_distance.item() == pytest.approx(exact, abs=0.02 * bracket + 5e-6)
    assert found.far_value.item() == pytest.approx(0.5, abs=1e-4)
    assert len(seen) == len(set(seen)) == found.sizes["distance"]
    assert len(seen) <= len(SCAN) + 4  # two beside the crossing of a spline, and two where they miss it


def test_last_crossing_of_an_oscillating_curve() -> None:
    found = find(partial(sampled, oscillating, []), tolerance=0.1)
    fine = np.linspace(0.0, 0.2, 200001)
    outside = np.flatnonzero(np.abs([oscillating(d) - 0.5 for d in fine]) > 0.1)
    low, high = found.bracket.values
    assert low - 1e-5 < fine[outside[-1]] < high + 1e-5
    assert high - low <= 2e-4


def test_a_turn_between_samples_counts() -> None:
    """AR leaves the band near 52.5 mm; the samples at 50 and 55 mm are within it."""
    found = find(partial(sampled, lambda d: falling(3.0 * d) + 0.025 * np.exp(-(((d - 0.0525) / 0.003) ** 2)), []))
    assert found.critical_distance.item() == pytest.approx(0.0525 + 0.003 * np.sqrt(np.log(1.25)), abs=5e-5)


def dip(place: float, depth: float, distance: float) -> float:
    """A turn of AR, 2.5 mm wide, below a far value that holds everywhere else."""
    return float(0.5 - depth * np.exp(-(((distance - place) / 0.0025) ** 2)))


def test_a_turn_that_a_coarse_scan_steps_over_counts() -> None:
    """All samples of the scan lie within 0.001 of the far value; AR leaves the band between the first two."""
    seen: list[float] = []
    found = find(partial(sampled, partial(dip, 0.017, 0.025), seen), distances=[0.012, 0.062, 0.112, 0.162])
    assert found.critical_distance.item() == pytest.approx(0.017 + 0.0025 * np.sqrt(np.log(1.25)), abs=5e-5)
    assert len(seen) < 20
    assert found.settled
    assert "warnings" not in found.attrs or "far value" not in found.attrs["warnings"]


def test_a_turn_near_the_edge_of_the_band_is_announced() -> None:
    """The dip at 50 mm reaches 0.0195: with a tolerance of 0.019 it counts."""
    with pytest.warns(
        hl.HertzlinkWarning, match=r"0\.95 times the tolerance gives a critical distance of about 5\d mm"
    ):
        found = find(partial(sampled, lambda d: falling(3.0 * d) + dip(0.05, 0.0195, d) - 0.5, []))
    assert found.critical_distance.item() == pytest.approx(0.01 / 3.0 * np.log(25.0), abs=5e-5)


@pytest.mark.parametrize(
    ("distances", "why"),
    [
        ([0.005, 0.011, 0.0125, 0.0155], r"AR changes by 0\.016 in the last third of the distances"),
        ([0.005, 0.0125, 0.015], "fewer than three distances beyond the critical one have a wave"),
    ],
)
def test_a_short_scan_is_said_to_be_short(distances: list[float], why: str) -> None:
    """AR rises by 0.0035 a mm, and no wave returns at 5 mm."""
    with pytest.warns(hl.HertzlinkWarning) as said:
        found = find(partial(sampled, lambda d: NAN if d < 0.008 else 0.5 + 3.5 * d, []), distances=distances)
    texts = "\n".join(str(one.message) for one in said)
    assert not found.settled
    assert re.search(f"^far value: AR may not have settled: {why}; give greater distances$", texts, re.MULTILINE)
    assert "waves: none returned at 5 mm, so" in texts
    smallest = f"the smallest, {1e3 * distances[1]:g} mm, is an upper bound"
    assert f"at all distances with a wave, so {smallest}" in texts
    assert f"{smallest};" not in texts


def test_several_tolerances_share_samples_and_their_order() -> None:
    """A looser tolerance is met nearer to the edge; no distance is run twice."""
    seen: list[float] = []
    found = find(partial(sampled, falling, seen), tolerance=[0.05, 0.02, 0.01])
    exact = 0.01 * np.log(0.5 / np.array([0.05, 0.02, 0.01]))
    np.testing.assert_allclose(found.critical_distance.sel(within=[0.05, 0.02, 0.01]), exact, atol=2e-5)
    assert np.all(found.bracket.sel(end="low") < found.critical_distance)
    assert np.all(found.critical_distance < found.bracket.sel(end="high"))
    assert len(seen) == len(set(seen))
    assert not found.lower_bound.any()


def late(distance: float) -> float:
    """The wave of `falling` minus its far value, so that the far value is 0; no wave beyond 32 mm."""
    return falling(distance) - 0.5 if distance < 0.032 else NAN


def test_without_a_wave_from_far_away_there_is_a_lower_bound() -> None:
    """The last sample that differs from no wave bounds the distance from below."""
    found = find(partial(sampled, late, []), tolerance=[0.02, 0.04])
    assert found.lower_bound.values.tolist() == [True, True]
    np.testing.assert_allclose(found.bracket, [[0.03, INF], [0.025, INF]])
    assert np.isnan(found.critical_distance).all()
    assert np.isnan(found.amplitude_ratio.sel(distance=1.0))
    assert found.sampled.sel(distance=1.0)


@pytest.mark.parametrize("near", [NAN, 0.015])
def test_a_structure_that_takes_the_wave(near: float) -> None:
    found = find(partial(sampled, lambda d: near if d < 0.03 else NAN, []))
    assert np.isnan([found.critical_distance, *found.bracket]).all()
    assert not np.any([found.lower_bound, found.short_record])
    assert re.fullmatch("critical distance: no wave above 1 %.*; take smaller beads", found.attrs["warnings"])


def test_an_upper_bound_is_announced() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="the smallest, 5 mm, is an upper bound"):
        found = find(partial(sampled, lambda d: 0.5, []))
    assert "upper bound" in found.attrs["warnings"]
    np.testing.assert_allclose(found.bracket, [0.0, 0.005])


def by_plate(distance: float, thickness: float, diameter: float) -> Known:
    return Known(falling(distance * thickness / diameter))


@pytest.mark.thorough
def test_axes_and_processes() -> None:
    """One curve for each plate and bead, by name, whatever the number of processes."""
    beads, plates = [1.0, 2.0], [1.0, 3.0]
    found = find(by_plate, distances=FEW, thickness=plates, diameter=beads, jobs=2)
    expected = 0.01 * np.log(25.0) / np.array(plates)[:, None] * np.array(beads)
    assert found.critical_distance.dims == ("thickness", "diameter")
    np.testing.assert_allclose(found.critical_distance, expected, atol=2e-5)
    assert found.identical(find(by_plate, distances=FEW, thickness=plates, diameter=beads))
    for plate in plates:
        for bead in beads:
            one = found.sel(thickness=plate, diameter=bead)
            samples = one.amplitude_ratio.dropna("distance")
            assert samples.size == one.sampled.sum()
            assert hl.critical_distance(samples) == one.critical_distance


def test_neighbours_on_the_last_axis_meet_in_one_process() -> None:
    """A builder that keeps the last distance's structure makes it once for all beads of the first scan."""
    made: list[tuple[float, float]] = []

    def build(distance: float, thickness: float, diameter: float) -> Known:
        if made[-1:] != [(thickness, distance)]:
            made.append((thickness, distance))
        return Known(falling(distance))

    find(build, distances=FEW, thickness=[1.0, 2.0], diameter=[1.0, 2.0, 3.0])
    assert len(made) == len(set(made))


class Marked(Known):
    """A run with a finding."""

    def run(self, until: float, *given: Any, **named: Any) -> xr.Dataset:
        return super().run(until).assign_attrs(warnings="yield: 2 GPa")


def test_findings_of_runs_are_gathered() -> None:
    """One warning of each kind, which names its first point."""

    def build(distance: float) -> Known:
        return Marked(falling(distance)) if distance > 0.5 else Known(falling(distance))

    with pytest.warns(
        hl.HertzlinkWarning, match=r"yield: 2 GPa \(at distance = 1 m; reported at [12] of \d+ points\)$"
    ):
        found = find(build)
    assert "yield: 2 GPa" in found.attrs["warnings"]


def test_bisection_where_the_spline_misleads() -> None:
    """A step has no smooth crossing: the bracket still closes, in as many runs as bisection takes, and a few more."""
    seen: list[float] = []
    found = find(partial(sampled, lambda d: 0.9 if d < 0.0371234 else 0.5, seen))
    low, high = found.bracket.values
    assert low < 0.0371234 <= high
    assert high - low <= 2e-4
    assert len(seen) < len(SCAN) + 20


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"build": 3}, "build = 3"),
        ({"build": lambda place: None}, "build = .*takes place, but the axes are distance"),
        ({"build": lambda distance: None}, "build\\(\\.\\.\\.\\) = None: must be a CoSimulation"),
        ({"until": 0.0}, "until = 0"),
        ({"sensor": 8}, "sensor = 8: must be one that was measured"),
        ({"distances": [0.1, 0.2]}, r"distances = \[0\.1, 0\.2\]: must be three or more"),
        ({"distances": [0.1, -0.2, 0.3]}, r"distances = -0\.2"),
        ({"distances": [0.1, 0.2, 0.2]}, r"distances = .* none of them twice"),
        ({"tolerance": []}, r"tolerance = \[\]"),
        ({"tolerance": [0.02, -1.0]}, r"tolerance = -1\.0"),
        ({"bracket": 1e-9}, "bracket = 1e-09"),
        ({"within": [1.0]}, "within is a name that every run uses"),
        ({"thickness": []}, r"thickness = \[\]"),
        ({"thickness": [1.0]}, "takes distance, but the axes are distance, thickness"),
    ],
)
def test_bad_input_to_the_search(given: dict[str, Any], message: str) -> None:
    def build(distance: float) -> Known:
        return Known(falling(distance))

    with pytest.raises(ValueError, match=message):
        find(**{"build": build, **given})


BEAD = hl.Sphere(2.38e-3, hl.STEEL_440C)
PLATE = hl.kirchhoff_plate(0.9, 0.9, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
PLY = ((138e9, 9e9, 9e9), (0.4, 0.3, 0.3), (3.2e9, 6.9e9, 6.9e9))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hl.half_plane(1e300, hl.ALUMINIUM_6061, "clamped", 0.02), "thickness = 1e+300: must be a finite"),
        (lambda: hl.half_plane(1e-3, hl.ALUMINIUM_6061, "clamped", 1e-300), "distance = 0.0: must be a positive"),
        (
            lambda: hl.half_plane(1e-3, hl.ALUMINIUM_6061, "free", 0.02, highest_frequency=1e-300),
            "highest_frequency = 1e-300: must be a positive number",
        ),
        (lambda: hl.critical_distance_law(BEAD, PLATE, impact_speed=[]), "impact_speed = []: must be a finite number"),
        (lambda: hl.critical_distance_law(BEAD, PLATE, impact_speed=1e300), "impact_speed = 1e+300: must be a finite"),
        (
            lambda: hl.reduce(hl.half_plane(2e-3, hl.PTFE, "free", 0.02), 1e-4, pulse=1e-300),
            "pulse = 1e-300: must be a",
        ),
        (lambda: hl.theory.yield_pressure(None), "material = None: must be a Material"),
        (lambda: hl.theory.indentation_modulus(1j * np.eye(6)), "must be a number or an array of numbers"),
        (lambda: hl.theory.orthotropic_stiffness((1j, 1, 1), *PLY[1:]), "moduli = (1j, 1, 1): must be a number"),
        (lambda: hl.theory.orthotropic_stiffness(PLY[0], [[1, 2], [3]], PLY[2]), "poisson_ratios = [[1, 2], [3]]"),
        (lambda: hl.theory.orthotropic_stiffness(PLY[0], PLY[1], {}), "shear_moduli = {}: must be a number"),
    ],
)
def test_bad_input_to_what_predicts_it(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        call()
