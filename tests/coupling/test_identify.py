"""Unknowns from signals: truths found within their intervals, blind ones named, and bad input refused."""

import logging
import re
import warnings
from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.linalg import toeplitz
from scipy.optimize import curve_fit
from scipy.signal import lfilter
from threadpoolctl import threadpool_info, threadpool_limits

import hertzlink as hl
from coupling.inference import features
from coupling.inference.disturbances import Disturbance, outliers, whitener
from coupling.inference.identification import Identification, Unknown
from coupling.inference.identify import likely_runs
from coupling.inference.intervals import independent_samples
from coupling.inference.measured import estimated
from coupling.inference.misfit import Measured, Misfit
from coupling.inference.prediction import Curves, Prediction, Range, high_passed, range_of
from coupling.inference.search import GlobalSearch, Solution
from coupling.inference.surrogate import interpolated
from coupling.results.sensor_trace import noise_level

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
UNTIL, LEAD, STEP = 5e-4, 8e-5, 1e-6


def wall(modulus: float, impact_speed: float = 0.31) -> hl.CoSimulation:
    """Ten beads on a half-space."""
    facing = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, impact_speed), facing)


def tap(
    simulation: hl.CoSimulation,
    sensors: tuple[int, ...] = (5,),
    noise: float = 0.01,
    gain: float = 1.0,
    lead: float = LEAD,
    seed: int = 0,
    until: float = UNTIL,
) -> xr.Dataset:
    """A signal of a run with the default accuracy, noisy, scaled and late."""
    run = simulation.run(until, save_every=2.5e-7)
    time, random = np.arange(0.0, lead + until, STEP), np.random.default_rng(seed)
    forces = {}
    for n in sensors:
        curve = CubicSpline(run.time.values, hl.sensor_force(run, n).values)
        clean = gain * np.where(time >= lead, curve(np.clip(time - lead, 0.0, until)), 0.0)
        forces[n] = clean + random.normal(0.0, noise * clean.max(), time.size)
    return hl.as_signal(time, forces)


def test_truth_is_within_the_intervals_whatever_gain_and_time_zero_are() -> None:
    signal = tap(wall(3e9, 0.29), (3, 7), gain=1.7)
    nuisances = ["gain", "time_zero", "offset", "impact_speed"]
    ranges = {"modulus": (1e9, 20e9), "impact_speed": (0.2, 0.5)}
    found = hl.identify(signal, wall, nuisances, until=UNTIL, scan=32, starts=2, **ranges)
    truth = {"modulus": 3e9, "impact_speed": 0.29, "time_zero": LEAD, "gain 3": 1.7, "gain 7": 1.7, "offset 3": 0.0}
    for name, value in truth.items():
        low, high = found[name].interval
        # Three half-widths: a 95 % interval misses one truth of twenty.
        assert abs(value - 0.5 * (low + high)) < 1.5 * (high - low), name
    assert found["modulus"].identifiable
    assert 0.9 < found.misfit < 1.1
    assert found.explained


def test_without_noise_the_truth_is_found_to_what_runs_are_exact_to() -> None:
    found = hl.identify(tap(wall(3e9), noise=0.0), wall, until=UNTIL, scan=16, starts=1, modulus=(1e9, 20e9))
    assert found["modulus"].value == pytest.approx(3e9, rel=2e-3)
    assert found["modulus"].verdict == "identified"
    assert found["modulus"].interval[0] < 3e9 < found["modulus"].interval[1]


def test_the_same_input_gives_the_same_bits() -> None:
    signal = tap(wall(3e9))
    one, two = (hl.identify(signal, wall, until=UNTIL, scan=8, starts=1, modulus=(1e9, 20e9)) for _ in range(2))
    assert one.unknowns == two.unknowns


def layered(glue: float, impact_speed: float = 0.31) -> hl.CoSimulation:
    """Glue below a long layer of PTFE, from where no wave is back within the record."""
    layers = [hl.Layer(hl.PTFE, 0.5, 9.5e-3), hl.Layer(hl.Material(glue, 0.35, 1200.0), 1e-3, 9.5e-3)]
    return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, impact_speed), hl.rod(layers, elements=10))


def test_what_the_record_does_not_show_is_blind_over_its_whole_range() -> None:
    """The wave needs 2 · 0.5 m/√(E/ρ) = 1.2 ms there and back; the record ends after 0.5 ms."""
    rate = np.sqrt(hl.PTFE.youngs_modulus / hl.PTFE.density)
    assert 2.0 * 0.5 / rate > 2.0 * UNTIL
    found = hl.identify(tap(layered(1e9)), layered, until=UNTIL, scan=8, starts=1, glue=(5e8, 4e9))
    assert found["glue"].verdict == "blind"
    assert not found["glue"].identifiable
    assert found["glue"].interval == pytest.approx((5e8, 4e9))
    assert "blind" in str(found)
    design = hl.identifiability(layered, sensors=[5], until=UNTIL, glue=1e9)
    assert design.verdict("glue") == "blind"


def test_bounds_are_those_of_a_fit_by_another_program() -> None:
    """scipy's curve_fit of the same model, with its own derivatives of gain, time zero and modulus together."""
    signal = tap(wall(3e9), lead=LEAD)
    time, force = signal.time.values, signal.sensor_force.sel(sensor=5).values
    noise = 0.01 * force.max()

    def model(moments: np.ndarray, modulus: float, late: float, gain: float) -> np.ndarray:
        run = wall(modulus * 1e9).replace(accuracy="screening").run(UNTIL, save_every=5e-7)
        curve = CubicSpline(run.time.values, hl.sensor_force(run, 5).values)
        after = moments - late * 1e-6
        return gain * np.where(after >= 0.0, curve(np.clip(after, 0.0, UNTIL)), 0.0)

    values, covariance = curve_fit(model, time, force, [3.1, 80.2, 1.0], sigma=np.full(time.size, noise),
                                   absolute_sigma=True, epsfcn=1e-6)  # fmt: skip
    found = hl.identify(signal, wall, until=UNTIL, noise=noise, guess={"modulus": 3.1e9}, modulus=(2e9, 4.5e9))
    assert found["modulus"].value == pytest.approx(values[0] * 1e9, rel=1e-3)
    assert found["modulus"].error / 1.96 == pytest.approx(np.sqrt(covariance[0, 0]) * 1e9, rel=0.05)
    assert found["time_zero"].error / 1.96 == pytest.approx(np.sqrt(covariance[1, 1]) * 1e-6, rel=0.05)
    design = hl.identifiability(wall, 0.01, [5], UNTIL, modulus=3e9)
    assert design.bounds["modulus"] == pytest.approx(found["modulus"].error / 1.96, rel=0.1)


def test_bounds_fall_with_noise_and_samples() -> None:
    """In proportion to the noise, and to the square root of the time between samples."""
    one, half, often = (
        hl.identifiability(wall, noise, [5], UNTIL, sample_every=step, modulus=3e9).bounds["modulus"]
        for noise, step in ((0.01, 1e-6), (0.005, 1e-6), (0.01, 2.5e-7))
    )
    assert half == pytest.approx(0.5 * one, rel=1e-3)
    assert often == pytest.approx(0.5 * one, rel=0.03)


def test_two_sensors_are_better_than_one_and_the_ranking_says_so() -> None:
    ranking = hl.best_sensors(wall, "modulus", count=2, candidates=[3, 5, 7], until=UNTIL, modulus=3e9)
    single = hl.best_sensors(wall, "modulus", candidates=[3, 5, 7], until=UNTIL, modulus=3e9)
    assert (np.diff(ranking.bound) >= 0.0).all()
    assert ranking.bound.values[0] < single.bound.values[0]
    one = hl.identifiability(wall, sensors=[3, 7], until=UNTIL, modulus=3e9).bounds["modulus"]
    assert float(ranking.bound[ranking.sensors.values.tolist().index("3, 7")]) == pytest.approx(one, rel=1e-3)


def test_choices_of_the_experimenter_are_ranked() -> None:
    def build(modulus: float, radius: float) -> hl.CoSimulation:
        bead = hl.Sphere(radius, hl.STEEL_440C)
        return hl.CoSimulation(hl.Chain([bead] * 8, bead, 0.3), hl.half_space(hl.Material(modulus, 0.3, 2000.0)))

    found = hl.best_sensors(build, "modulus", candidates=[5], until=4e-4, choices={"radius": [2e-3, 4e-3]}, modulus=3e9)
    assert sorted(found.radius.values.tolist()) == [2e-3, 4e-3]
    assert found.sizes["rank"] == 2


def test_unknowns_are_shown_in_their_unit() -> None:
    """A length in mm with as many digits as its error allows; an offset near zero with its error, not a percentage."""
    one = Unknown("distance", 0.06, (0.0595, 0.0605), "identified", unit="mm", unit_size=1e-3)
    assert one.row() == ("distance, mm", "60.00", "59.50 to 60.50", "identified (± 0.83 %)")
    blind = Unknown("distance", 0.06, (0.01, 0.2), "blind", unit="mm", unit_size=1e-3)
    assert blind.row() == ("distance, mm", "-", "10 to 200", "blind; best fit 60")
    zero = Unknown("time_zero", -3e-8, (-1.3e-7, 7e-8), "nuisance", unit="µs", unit_size=1e-6)
    assert zero.row() == ("time_zero, µs", "-0.030", "-0.13 to 0.070", "nuisance (± 0.1 µs)")


def on_soft_beads(modulus: float, impact_speed: float = 0.31) -> hl.CoSimulation:
    """Beads of another material than those of `wall`."""
    bead = hl.Sphere(4.76e-3, hl.PTFE)
    facing = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    return hl.CoSimulation(hl.Chain([bead] * 10, bead, impact_speed), facing)


@pytest.mark.parametrize(
    ("build", "ranges"),
    [
        pytest.param(wall, {"modulus": (1e9, 2e9)}, id="range below the truth"),
        pytest.param(wall, {"modulus": (4e9, 20e9)}, id="range above the truth"),
        pytest.param(on_soft_beads, {"modulus": (1e9, 20e9)}, id="other beads"),
    ],
)
def test_no_verdict_stands_where_the_model_does_not_fit(build: Any, ranges: Any) -> None:
    with pytest.warns(hl.HertzlinkWarning, match="the residual is .* times the noise: the model lacks something"):
        found = hl.identify(tap(wall(3e9)), build, ["gain", "time_zero", "impact_speed"], until=UNTIL,
                            guess={"modulus": ranges["modulus"][0], "impact_speed": 0.3}, impact_speed=(0.2, 0.4),
                            **ranges)  # fmt: skip
    assert not found.explained
    assert not found.identified
    assert {one.verdict for one in found.unknowns.values()} == {"not trusted: the model does not fit", "nuisance"}
    assert found["impact_speed"].verdict == found["gain 5"].verdict == "nuisance"
    assert not found["modulus"].identifiable
    assert "identified" not in str(found) + repr(found) + found._repr_html_()
    assert "does NOT explain" in str(found)
    # Other beads leave the modulus blind, wherever in its range the fit ends.
    assert build is not wall or "modulus: at the end of its range; widen it" in str(found)


def test_a_discrepancy_widens_the_interval_of_white_noise() -> None:
    """By √(1 + s²) and more: what is correlated over n samples does not average out over them."""
    signal = tap(wall(3e9))
    given: dict[str, Any] = {"until": UNTIL, "guess": {"modulus": 3.02e9}, "modulus": (2e9, 4.5e9)}
    exact, wide = (hl.identify(signal, wall, discrepancy=d, **given)["modulus"].error for d in (0.0, 0.01))
    assert wide > 2.0 * exact


def test_two_different_fits_are_both_reported() -> None:
    """The sign of an unknown that enters by its square cannot be known."""

    def build(root: float) -> hl.CoSimulation:
        return wall(3e9 * (0.1 + 0.9 * root**2))

    with pytest.warns(hl.HertzlinkWarning, match="2 different fits are as good"):
        found = hl.identify(tap(wall(3e9)), build, until=UNTIL, scan=16, starts=1, root=(-1.6, 1.5))
    assert sorted(round(mode["root"], 1) for mode in found.modes) == [-1.0, 1.0]
    assert found["root"].verdict == "blind"
    assert found["root"].interval[0] < -0.99
    assert found["root"].interval[1] > 0.99


def test_an_unknown_at_the_end_of_its_range_is_said_to_be_there() -> None:
    """So far from the truth that the fit is at an end, so near that noise hides it."""
    with pytest.warns(hl.HertzlinkWarning, match="at the end of its range; widen it"):
        found = hl.identify(tap(wall(3e9), noise=0.1), wall, until=UNTIL, scan=8, starts=1, modulus=(3.1e9, 20e9))
    assert found.explained
    assert not found.identified
    assert found["modulus"].verdict == "at the end of its range"


@pytest.mark.parametrize(
    ("gain", "nuisances", "words"),
    [
        (1003.0, ["gain", "time_zero"], "near 1000: was it measured in mV or mN, and read in V or N"),
        (-9.2e-4, ["gain", "time_zero"], "near 0.001: was it measured in V or N, and read in mV or mN"),
        (1.2e6, ["gain", "time_zero"], r"near 1e\+06: was it measured in µV or µN, and read in V or N"),
        (1.1e3, ["time_zero"], "near 1000: was it measured in mV or mN, and read in V or N"),
        (1.7, ["gain", "time_zero"], ""),
        (30.0, ["gain", "time_zero"], ""),
        (2e-3, ["gain", "time_zero"], ""),
    ],
)
def test_a_force_that_is_a_thousand_times_the_models_may_be_in_another_unit(
    gain: float, nuisances: list[str], words: str
) -> None:
    found = hl.identify(tap(wall(3e9), gain=gain), wall, nuisances, until=UNTIL, guess={"modulus": 3e9},
                        modulus=(2e9, 4e9))  # fmt: skip
    notes = [note for note in found.warnings if "what the model expects" in note]
    assert len(notes) == bool(words)
    assert re.search(words, " ".join(notes))
    assert not words or str(found).count("what the model") == 1


def test_a_sensor_whose_wires_are_turned_is_fitted() -> None:
    found = hl.identify(tap(wall(3e9), gain=-1.0), wall, until=UNTIL, guess={"modulus": 2.5e9}, modulus=(2e9, 4e9))
    assert found.explained
    assert found["modulus"].value == pytest.approx(3e9, rel=0.02)
    assert found["gain 5"].value == pytest.approx(-1.0, rel=0.01)


def test_swapped_channels_are_refused_before_any_search() -> None:
    """The incident wave passes bead 3 first; a spike before it is no wave."""
    signal = tap(wall(3e9), (3, 7))
    spiked = signal.sensor_force.transpose("sensor", "time").values.copy()
    spiked[:, 20] = spiked.max()
    swapped = hl.as_signal(signal.time.values, dict(zip((7, 3), spiked, strict=True)))
    with pytest.raises(ValueError, match=r"signal: the wave reaches sensor 7 7. µs before sensor 3, but in the chain"):
        hl.identify(swapped, wall, until=UNTIL, modulus=(1e9, 20e9))
    right = hl.as_signal(signal.time.values, dict(zip((3, 7), spiked, strict=True)))
    assert hl.identify(right, wall, until=UNTIL, guess={"modulus": 3e9}, modulus=(1e9, 20e9)).explained


@pytest.mark.parametrize("seed", range(2))
def test_a_short_lead_gives_the_zero_of_the_force_with_an_error(seed: int) -> None:
    """The median of 200 samples errs by 0.09 times the noise, which 2 000 samples show; it is no error of the model."""
    run = wall(3e9).run(UNTIL, save_every=2.5e-7)
    time, curve = np.arange(0.0, LEAD / 2.0 + UNTIL, STEP / 4.0), CubicSpline(run.time.values, hl.sensor_force(run, 5))
    clean = np.where(time >= LEAD / 2.0, curve(np.clip(time - LEAD / 2.0, 0.0, UNTIL)), 0.0)
    noise = 0.01 * clean.max()
    force = clean + noise * (np.random.default_rng(seed).normal(size=time.size) + 0.2 * (np.arange(time.size) > 300))
    found = hl.identify(
        hl.as_signal(time, {5: force}), wall, until=UNTIL, guess={"modulus": 3e9}, modulus=(2e9, 4.5e9)
    )  # fmt: skip
    assert found.explained
    assert found["modulus"].value == pytest.approx(3e9, abs=3.3 / 1.96 * found["modulus"].error)


def test_runs_that_fail_are_left_out() -> None:
    def build(modulus: float) -> hl.CoSimulation:
        if modulus > 5e9:
            raise ValueError("too stiff for this test")
        return wall(modulus)

    with pytest.warns(hl.HertzlinkWarning, match="runs failed, and were left out"):
        found = hl.identify(tap(wall(3e9)), build, until=UNTIL, scan=16, starts=1, modulus=(1e9, 8e9))
    assert found["modulus"].value == pytest.approx(3e9, rel=0.05)


def test_the_time_constant_of_a_sensor_is_found() -> None:
    signal = tap(wall(3e9), noise=0.003)
    force = signal.sensor_force.values[:, 0]
    signal = hl.as_signal(signal.time, {5: high_passed(force, STEP, 3e-4)})
    found = hl.identify(signal, wall, ["gain", "time_zero", "time_constant"], until=UNTIL, scan=8, starts=1,
                        modulus=(1e9, 20e9))  # fmt: skip
    low, high = found["time_constant"].interval
    assert low < 3e-4 * 1.05
    assert high > 3e-4 * 0.95
    assert found["modulus"].value == pytest.approx(3e9, rel=0.05)


def test_what_was_found_is_saved_and_read_back(tmp_path: Any) -> None:
    found = hl.identify(tap(wall(3e9)), wall, until=UNTIL, scan=8, starts=1, modulus=(1e9, 20e9))
    found.save(tmp_path / "found.nc")
    with xr.open_dataset(tmp_path / "found.nc", engine="h5netcdf") as read:
        assert read.unknown.values.tolist() == list(found)
        assert float(read.value[0]) == found["modulus"].value
        assert (float(read.low[0]), float(read.high[0])) == found["modulus"].interval
        np.testing.assert_allclose(read.residual, read.measured - read.fitted, atol=1e-12)
        assert "identify" in read.attrs["input"]
    assert all(len(line) <= 80 for line in str(found).splitlines())
    assert "modulus" in repr(found)
    assert "<table>" in found._repr_html_()


def test_a_time_constant_that_a_signal_does_not_show_lies_within_its_range() -> None:
    """Its interval was 1e-18 to 1e25 ms."""
    found = hl.identify(tap(wall(3e9)), wall, ["gain", "time_zero", "time_constant"], until=UNTIL,
                        guess={"modulus": 3e9}, modulus=(2e9, 4.5e9))  # fmt: skip
    low, high = found["time_constant"].interval
    assert 1e-5 <= low < found["time_constant"].value <= high <= 10.0


def test_noise_is_estimated_to_some_per_cent() -> None:
    random = np.random.default_rng(3)
    time = np.arange(1000.0)
    pulse = 40.0 * np.exp(-(((time - 500.0) / 20.0) ** 2))
    assert estimated(pulse + random.normal(0.0, 0.5, 1000)) == pytest.approx(0.5, rel=0.1)
    # Noise of low frequency, such as hum, shows in the lead alone.
    hum = 0.5 * np.sqrt(2.0) * np.sin(2.0 * np.pi * time / 97.0)
    assert estimated(pulse + hum + random.normal(0.0, 0.05, 1000)) == pytest.approx(0.5, rel=0.15)


@pytest.mark.parametrize("samples", [1_000, 10_000, 100_000])
def test_noise_is_not_that_of_the_foot_of_a_wave(samples: int) -> None:
    """A solitary wave begins slowly: at many samples a microsecond its foot was taken for noise of the quiet lead."""
    time = np.linspace(0.0, 1e-3, samples)
    assert estimated(np.cosh((time - 5e-4) / 8e-6) ** -4) < 2e-4


def test_a_high_pass_loses_charge_as_its_time_constant_says() -> None:
    """A step decays as e^(−t/τ)."""
    time = 1e-6 * np.arange(1000)
    step = high_passed(np.concatenate([[0.0], np.ones(999)]), 1e-6, 2e-4)
    np.testing.assert_allclose(step[1:], step[1] * np.exp(-(time[1:] - time[1]) / 2e-4), rtol=1e-9)


def test_derivatives_are_of_second_order_inside_a_range_and_at_its_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a closed form in the place of runs: half the step, a quarter of the error."""
    prediction = Prediction(wall, [Range("modulus", 1e9, 5e9)], [5], UNTIL)
    time = np.linspace(0.0, 1.0, 50)

    def traces(places: list[np.ndarray]) -> np.ndarray:
        return np.array([[np.sin(3.0 * time + 2.0 * place[0])] for place in places])

    monkeypatch.setattr(prediction, "traces", traces)
    for place in (0.0, 0.5, 1.0):
        here, exact = traces([np.array([place])])[0], 2.0 * np.cos(3.0 * time + 2.0 * place)
        one, two = (
            abs(prediction.slopes(np.array([place]), here, np.array([step])) - exact).max() for step in (0.01, 0.02)
        )
        assert np.log2(two / one) == pytest.approx(2.0, abs=0.2), place


def test_projected_derivatives_are_those_of_the_residual_where_it_vanishes() -> None:
    """Kaufman's approximation is exact for a residual of zero."""
    prediction = Prediction(wall, [Range("modulus", 2e9, 4e9), Range("impact_speed", 0.2, 0.4)], [5], UNTIL)
    places = np.array([0.5, 0.55])
    trace = prediction.traces([places])[0]
    time = np.arange(0.0, 5e-4, 1e-6)
    force = 1.4 * Curves(trace, prediction.interval).at(time - 2e-5) + 0.3
    misfit = Misfit(prediction, Measured(time, force, [5], np.ones(1)), ["gain", "offset", "time_zero"], UNTIL)
    p = np.array([*places, 2e-5 / misfit.unit])
    misfit.at(p + [0.2, 0.0, 0.0], np.full(2, 1e-3))  # What it keeps of one place is not taken for that of another.
    point = misfit.at(p, np.full(2, 1e-3))
    assert abs(point.residual).max() < 1e-9
    assert (point.gains[0], point.offsets[0]) == (pytest.approx(1.4), pytest.approx(0.3))
    for k in range(3):
        shift = 1e-3 * np.eye(3)[k]
        change = (misfit.residual(p + shift) - misfit.residual(p - shift)) / 2e-3
        np.testing.assert_allclose(point.projected[:, k], change, atol=2e-3 * abs(change).max())


@pytest.mark.parametrize(
    ("level", "given", "away", "explained"),
    [
        (1.0, True, 0.0, True), (0.9, True, 0.0, False), (0.9, False, 0.0, True),
        (0.7, False, 0.0, False), (1.0, False, 0.1, False), (0.9, False, 0.1, False),
    ],
)  # fmt: skip
def test_noise_estimated_too_low_hides_no_explanation(level: float, given: bool, away: float, explained: bool) -> None:
    """χ² of the truth is 1/0.81 a sample: noise of a known size is not so, by 5 standard deviations. No estimate is too
    low by 30 %, and the residual beside the truth is no noise. level: noise that is assumed, over the true one."""
    prediction = Prediction(wall, [Range("modulus", 2e9, 4e9), Range("impact_speed", 0.2, 0.4)], [5], UNTIL)
    places, time = np.array([0.5, 0.55]), np.arange(0.0, UNTIL, 1e-6 / 3.0)
    clean = Curves(prediction.traces([places])[0], prediction.interval).at(time)[0]
    force = clean + np.random.default_rng(0).normal(0.0, 0.01 * clean.max(), time.size)
    noise = np.array([level * 0.01 * clean.max()])
    misfit = Misfit(prediction, Measured(time, force[None], [5], noise, given), ["gain"], UNTIL)
    p = places + [away, 0.0]
    residual = misfit.residual(p)
    assert misfit.explains(float(residual @ residual), p) == explained


def noisy(clean: np.ndarray, correlation: float, seed: int) -> np.ndarray:
    """Noise of 1 % of the peak, whose correlation falls to 1/e over so many samples; 0: none."""
    decay = np.exp(-1.0 / correlation) if correlation else 0.0
    drawn = np.random.default_rng(seed).normal(size=clean.size + 1000)
    size = 0.01 * clean.max() * np.sqrt(1.0 - decay**2)
    return clean + np.asarray(lfilter([size], [1.0, -decay], drawn))[1000:]


def tapped(modulus: float = 3e9) -> tuple[np.ndarray, np.ndarray]:
    """Times and a clean signal, whose lead is long enough to show what disturbs it."""
    lead, run = 2.0 * LEAD, wall(modulus).run(UNTIL, save_every=2.5e-7)
    time, curve = np.arange(0.0, lead + UNTIL, STEP), CubicSpline(run.time.values, hl.sensor_force(run, 5).values)
    return time, np.where(time >= lead, curve(np.clip(time - lead, 0.0, UNTIL)), 0.0)


def error_under(covariance: np.ndarray) -> float:
    """The error of the modulus, Pa, by Gauss and Markov's theorem: 1/√ of (XᵀC⁻¹X) for modulus, gain and time zero.

    covariance: of the samples, in parts of the peak.
    """
    time, clean = tapped()
    columns = np.stack([(tapped(3.03e9)[1] - tapped(2.97e9)[1]) / 0.06, clean, 1e-4 * np.gradient(clean, time)], axis=1)
    information = columns.T @ np.linalg.solve(clean.max() ** 2 * covariance, columns)
    return 1e9 * float(np.sqrt(np.linalg.inv(information)[0, 0]))


def modulus_of(force: np.ndarray) -> Identification:
    time = tapped()[0]
    signal = hl.as_signal(time, {5: force})
    return hl.identify(signal, wall, until=UNTIL, guess={"modulus": 3e9}, modulus=(2e9, 4.5e9))


@pytest.mark.parametrize("correlation", [2.0, 20.0])
def test_errors_under_correlated_noise_are_those_of_generalised_least_squares(correlation: float) -> None:
    time, clean = tapped()
    expected = error_under(1e-4 * toeplitz(np.exp(-np.arange(time.size) / correlation)))
    fits = [modulus_of(noisy(clean, correlation, seed)) for seed in range(4)]
    assert np.mean([one["modulus"].error / 1.96 for one in fits]) == pytest.approx(expected, rel=0.25)
    assert all(abs(one["modulus"].value - 3e9) < 4.0 * expected for one in fits)
    # The lead of some 130 samples knows the correlation of one of these too badly to make its residual white.
    assert sum(one.identified for one in fits) >= 3
    assert any("correlated from sample to sample" in said for said in fits[0].warnings)


def test_hum_drift_and_outliers_leave_the_interval_that_a_cubic_costs() -> None:
    time, clean = tapped()
    places = 2.0 * time / time[-1] - 1.0
    level, cubic = 0.01 * clean.max(), np.stack([places**k for k in range(4)])
    expected = error_under(1e-4 * np.eye(time.size) + cubic.T @ cubic)
    for seed in range(2):
        random = np.random.default_rng(seed)
        far = np.where(random.random(time.size) < 0.005, 12.0 * level, 0.0)
        slow = 4.0 * level * np.sin(2.0 * np.pi * 50.0 * time + 0.7) + 3.0 * level * places
        found = modulus_of(noisy(clean, 0.0, seed) + slow + far)
        assert found["modulus"].error / 1.96 == pytest.approx(expected, rel=0.1)
        assert found["modulus"].value == pytest.approx(3e9, abs=4.0 * expected)
        assert found.identified
        said = " ".join(found.warnings)
        assert re.search(r"hum, drift or an offset of .* % of the peak in the quiet lead was fitted", said)
        assert f"{int((far > 0.0).sum())} samples are outliers" in said
        assert float(abs(found.data.baseline[0] - slow).max()) < level


def test_what_the_quiet_lead_does_not_show_is_an_error_of_the_model() -> None:
    """A slow force that begins with the waves could be taken off as drift, and the residual would be white."""
    time, clean = tapped()
    late = 0.05 * clean.max() * np.clip(time - 3e-4, 0.0, None) / 3e-4
    found = modulus_of(noisy(clean, 0.0, 0) + late)
    assert not found.explained
    assert "baseline" not in found.data


def test_noise_is_whitened_by_the_root_of_its_inverse_covariance() -> None:
    """WᵀW · C = 1 for noise of first order and any slow shapes, at the samples that count."""
    time, memory, noise = 1e-6 * np.arange(60), 0.8, 2.0
    used = (time > 5e-6) & (time != 3e-5)
    slow = np.stack([np.cos(2e4 * time), 3.0 * np.ones(60), 0.1 * np.sin(9e4 * time)], axis=1)
    step = noise * np.sqrt(1.0 - memory**2)
    count = int(used.sum())
    for remembered, new in ((np.array([memory]), step), (np.zeros(0), noise)):
        root = whitener(Disturbance(remembered, new, slow, 1.0), noise, used, 0)(np.eye(count))
        alone = toeplitz(memory ** np.arange(count)) if remembered.size else np.eye(count)
        covariance = alone + slow[used] @ slow[used].T / noise**2
        np.testing.assert_allclose(root.T @ root @ covariance, np.eye(count), atol=1e-9)


def test_a_valley_beside_the_best_fit_belongs_to_the_interval() -> None:
    """A parabola of the unknown gives the same wall at 49.75 and 50.25, 50 standard deviations apart."""

    def build(x: float) -> hl.CoSimulation:
        return wall(3e9 * (1.0 + ((x - 50.0) ** 2 - 0.25**2) / 6.25))

    found = hl.identify(tap(wall(3e9)), build, until=UNTIL, guess={"x": 49.7}, x=(40.0, 60.0))
    low, high = found["x"].interval
    assert low < 49.75 < 50.25 < high
    assert high - low < 0.6
    assert [mode["x"] for mode in found.modes] == pytest.approx([49.75, 50.25], abs=0.03)
    assert any("2 different fits are as good" in note for note in found.warnings)


def test_samples_that_are_left_out_do_not_count_between_runs_either() -> None:
    """Else a residual and its derivatives have other sizes."""
    time, clean = tapped()
    measured = Measured(time, noisy(clean, 0.0, 3)[None], [5], np.array([0.01 * clean.max()]))
    prediction = Prediction(wall, [Range("modulus", 1e9, 8e9)], [5], UNTIL)
    search = GlobalSearch(Misfit(prediction, measured, ["gain", "time_zero"], UNTIL), 1, 16, 0, None, [0])
    best = search.solutions()[0]
    force = measured.force.copy()
    force[0, 300:309] = np.nan
    search.misfit.measured = measured._replace(force=force)
    before = search.misfit.samples
    search.count_other_samples(search.misfit.time_zero(best.p))
    assert search.misfit.samples == before - 9
    assert search.solved(best.p).p[0] == pytest.approx(best.p[0], abs=0.01)


def test_shares_of_outliers_that_differ_are_of_the_model() -> None:
    """Fisher's exact test: with none of 200 samples before the waves, 10 of 800 have a chance of 23 %, 26 of 0.4 %."""
    for count, taken in ((10, 10), (26, 0)):
        left = np.random.default_rng(0).normal(size=1000)
        left[205 : 205 + 30 * count : 30] = 12.0
        assert outliers(left, 200).sum() == taken
    left[205:250] = 12.0
    assert not outliers(left, 200)[205:250].any()


@pytest.mark.parametrize(
    ("lacking", "white", "drifts"),
    [
        ("nothing", True, False), ("an offset", True, True), ("a ramp", True, True), ("hum", True, True),
        ("correlation", False, True),
    ],
)  # fmt: skip
def test_small_slow_errors_widen_intervals_and_correlation_takes_the_verdict(
    lacking: str, white: bool, drifts: bool
) -> None:
    """Slow ones of a sixth of the noise: the sum of squares of the correlations does not see them."""
    time = np.arange(0.0, 1e-3, STEP)
    draw = noisy(np.full(time.size, 100.0), 3.0 if lacking == "correlation" else 0.0, 0) - 100.0
    slow = {"an offset": np.full(time.size, 0.17), "a ramp": 340.0 * time, "hum": 0.25 * np.sin(600.0 * np.pi * time)}
    residual = draw + slow.get(lacking, 0.0)
    prediction = Prediction(wall, [Range("modulus", 2e9, 4e9)], [5], UNTIL)
    misfit = Misfit(prediction, Measured(time, residual[None], [5], np.array([1.0])), ["gain"], UNTIL)
    assert (misfit.is_white(residual), misfit.drifts(residual)) == (white, drifts)


def test_a_trace_whose_squares_are_zero_has_no_gain() -> None:
    """Where time zero lies so far off that only the rest of a trace is compared, nothing is fitted to its digits."""
    time, force = 1e-6 * np.arange(20.0), np.linspace(0.0, 2.0, 20)
    measured = Measured(time, force[None], [5], np.array([0.5]))
    misfit = Misfit(Prediction(wall, [Range("modulus", 2e9, 4e9)], [5], UNTIL), measured, ["gain"], UNTIL)
    residual, gain, *_ = misfit._fitted(0, np.full(20, 1e-200))
    assert gain == 1.0
    np.testing.assert_allclose(residual, force / 0.5, atol=1e-12)


def test_a_small_offset_widens_the_interval() -> None:
    """By the shift that it causes, of 0.2 times the noise."""
    time = np.arange(0.0, LEAD + UNTIL, STEP)
    clean = tap(wall(3e9), noise=0.0).sensor_force.values[:, 0]
    fits = [
        hl.identify(hl.as_signal(time[: clean.size], {5: noisy(clean, 0.0, 0) + offset}), wall, until=UNTIL,
                    guess={"modulus": 3e9}, modulus=(2e9, 4.5e9))
        for offset in (0.0, 0.002 * clean.max())
    ]  # fmt: skip
    assert [one["modulus"].verdict for one in fits] == ["identified"] * 2
    shift = abs(fits[1]["modulus"].value - fits[0]["modulus"].value)
    assert fits[1]["modulus"].error ** 2 > fits[0]["modulus"].error ** 2 + shift**2


SIGNAL = hl.as_signal(np.arange(0.0, 6e-4, 1e-6), {5: 40.0 * np.exp(-(((np.arange(600) - 300) / 20.0) ** 2))})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"signal": SIGNAL * np.nan}, "signal: sensor 5 has 0 samples with a number; needs 16"),
        ({"signal": SIGNAL * 0.0}, "signal: sensor 5 is constant, 0 N; must hold a wave"),
        ({"signal": 3}, "signal = 3: must be a signal of read_signal or as_signal, or a run"),
        ({"signal": SIGNAL.isel(time=slice(0, 40))}, r"signal: 39 µs are compared, but the wave needs about .* µs"),
        ({"signal": SIGNAL.isel(time=slice(0, None, 25))}, "signal: has a sample every 25 µs, too coarse for contacts"),
        ({"until": 5e-5}, "signal: 50 µs are compared, but the wave needs"),
        ({"until": -1.0}, "until = -1.0: must be a positive number of s"),
        ({"sensors": [99]}, r"sensor = 99|sensor 99"),
        ({"modulus": (3e9, 3e9)}, "has no width; must be the lowest and the highest value"),
        ({"modulus": 3e9}, "modulus = 3000000000.0: must be the lowest and the highest value"),
        ({"modulus": (1e9, np.inf)}, "modulus = inf: must be a finite number"),
        ({"thickness": (1.0, 2.0)}, "takes modulus, impact_speed, but the unknowns are modulus, thickness"),
        ({"nuisances": ["gains"]}, "nuisances: 'gains' is none; must be gain, offset, time_zero, time_constant"),
        ({"noise": 0.0}, "noise = 0.0: must be a positive number of N"),
        ({"noise": {7: 1.0}}, "noise = {7: 1.0}: must hold sensor 5"),
        ({"starts": 0}, "starts = 0"),
        ({"guess": {"speed": 1.0}}, "guess = {'speed': 1.0}: must give a value for each of modulus"),
        ({"guess": {"modulus": 1.0}}, r"guess\['modulus'\] = 1.0: must be from 1e\+09 to 2e\+10"),
        ({"discrepancy": -0.1}, "discrepancy = -0.1"),
        ({"build": 3}, "build = 3: must be a function"),
        ({"build": lambda modulus: 3}, r"build\(...\) = 3: must be a CoSimulation"),
    ],
)
def test_bad_input_is_refused_in_a_line(change: Mapping[str, Any], message: str) -> None:
    given: dict[str, Any] = {"signal": SIGNAL, "build": wall, "modulus": (1e9, 20e9), **change}
    with pytest.raises(ValueError, match=message) as caught:
        hl.identify(given.pop("signal"), given.pop("build"), **given)
    assert "\n" not in str(caught.value)


def test_a_sensor_beyond_the_chain_is_refused() -> None:
    with pytest.raises(ValueError, match=r"sensors = \[12\]: bead 12 is not in the chain, which has 10"):
        hl.identify(hl.as_signal(SIGNAL.time, {12: SIGNAL.sensor_force.values[:, 0]}), wall, modulus=(1e9, 20e9))


def test_a_run_needs_its_sensors_named_and_unknowns_are_needed() -> None:
    run = wall(3e9).run(UNTIL)
    with pytest.raises(ValueError, match="must name the beads of a run that are compared"):
        hl.identify(run, wall, modulus=(1e9, 20e9))
    with pytest.raises(ValueError, match="name at least one unknown of the builder"):
        hl.identify(SIGNAL, wall)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"modulus": 0.0}, "modulus = 0: bounds are relative to the value, which must not be zero"),
        ({"noise": -1.0}, "noise = -1.0: must be a positive number"),
        ({"sensors": []}, "sensors = []"),
        ({"sensors": [40]}, "bead 40 is not in the chain, which has 10"),
        ({"compare": "all"}, "compare = 'all'"),
        ({"sample_every": 0.0}, "sample_every = 0.0"),
        ({"nuisances": ["drift"]}, "nuisances: 'drift' is none"),
    ],
)
def test_bad_designs_are_refused(change: Mapping[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        hl.identifiability(wall, **{"until": UNTIL, "sensors": [5], "modulus": 3e9, **change})


def test_a_ranking_needs_an_unknown_with_a_value_and_enough_beads() -> None:
    with pytest.raises(ValueError, match="unknown = 'density': has no value; must be one of modulus"):
        hl.best_sensors(wall, "density", modulus=3e9)
    with pytest.raises(ValueError, match="count = 3: is more than the 2 candidates"):
        hl.best_sensors(wall, "modulus", count=3, candidates=[4, 5], until=UNTIL, modulus=3e9)


def test_places_and_values_of_ranges_belong_together() -> None:
    for one in (range_of("a", (1e-3, 6e-3)), range_of("b", (1e8, 1e11)), range_of("c", [-2.0, 1.0])):
        for place in (0.0, 0.3, 1.0):
            assert one.place(one.value(place)) == pytest.approx(place, abs=1e-12)
            slope = (one.value(min(place + 1e-6, 1.0)) - one.value(max(place - 1e-6, 0.0))) / (
                min(place + 1e-6, 1.0) - max(place - 1e-6, 0.0)
            )
            assert one.slope(place) == pytest.approx(slope, rel=1e-4)


@pytest.mark.thorough
def test_a_large_structure_is_reduced_for_the_fit() -> None:
    """A plate as it is written, of 5 000 unknowns, is fitted as oscillators."""

    def build(impact_speed: float) -> hl.CoSimulation:
        plate = hl.kirchhoff_plate(0.2, 0.2, 4e-3, hl.ALUMINIUM_6061, hl.Supports("clamped", "clamped"))
        return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, impact_speed), plate.at(0.05, 0.1))

    signal = tap(build(0.31), lead=0.0)
    given: dict[str, Any] = {"noise": 1.0, "guess": {"impact_speed": 0.31}, "impact_speed": (0.2, 0.5)}
    found = hl.identify(signal, build, [], until=UNTIL, **given)
    assert found["impact_speed"].identifiable


LONGER = 8e-4
"""A record that holds the primary and the secondary wave."""


@pytest.mark.parametrize("seeds", [(0,), pytest.param((1, 2), marks=pytest.mark.thorough)])
def test_amplitude_ratio_and_time_of_flight_alone_contain_the_truth(seeds: tuple[int, ...]) -> None:
    """Of three intervals of 95 % one or more miss the truth once in seven times."""
    values, inside = list[float](), 0
    for seed in seeds:
        signal = tap(wall(3e9), (3, 7), gain=1.7, seed=seed, until=LONGER)
        found = hl.identify(
            signal, wall, until=LONGER, guess={"modulus": 3.1e9}, compare="features", modulus=(1e9, 2e10)
        )
        values.append(found["modulus"].value)
        low, high = found["modulus"].interval
        inside += low <= 3e9 <= high
    assert inside == len(seeds)
    assert np.mean(values) == pytest.approx(3e9, abs=0.6 * (high - low))
    assert [str(name) for name in found.data.feature.values][:2] == ["primary AR at bead 3", "primary TOF at bead 3"]
    known = hl.identifiability(wall, sensors=[3, 7], until=LONGER, compare="features", modulus=3e9)
    assert 0.5 < found["modulus"].error / 1.96 / known.bounds["modulus"] < 2.0


@pytest.mark.parametrize("stated", [None, 0.3])
def test_features_of_a_signal_without_noise_are_read_without_bias(stated: float | None) -> None:
    """Whatever noise is stated: the reader does not smooth, so the prediction is not biased as if it did."""
    signal = tap(wall(3e9), (3, 7), noise=0.0, until=LONGER)
    found = hl.identify(signal, wall, until=LONGER, guess={"modulus": 3.1e9}, compare="features", noise=stated,
                        modulus=(1e9, 2e10))  # fmt: skip
    low, high = found["modulus"].interval
    assert low <= 3e9 <= high
    assert found.explained
    assert found["modulus"].value == pytest.approx(3e9, rel=1e-3)


@pytest.mark.parametrize("memory", [0.0, 0.4, 0.8])
def test_noise_of_features_has_the_memory_of_the_signals(memory: float) -> None:
    """White draws made intervals half as wide as noise that is correlated over some samples scatters."""
    white = np.random.default_rng(2).normal(size=(1, 20_000))
    noise = features.correlated(white, np.array([memory]))
    assert noise.std() == pytest.approx(1.0, rel=0.05)
    assert np.corrcoef(noise[0, 1:], noise[0, :-1])[0, 1] == pytest.approx(memory, abs=0.03)
    assert features.memory_of(np.array([noise_level(noise[0])])) == pytest.approx(memory, abs=0.06)


def test_features_of_a_compressed_chain_are_those_of_the_reflected_wave() -> None:
    """The incident wave has a tail, of which AR and TOF say nothing of the plate."""

    def build(thickness: float) -> hl.CoSimulation:
        facing = hl.infinite_plate(thickness, hl.ALUMINIUM_6061)
        return hl.CoSimulation(hl.Chain([BEAD] * 16, BEAD, 0.31, preload=3.0), facing)

    signal = tap(build(4e-3), (8,), noise=0.003, until=LONGER, lead=0.0)
    found = hl.identify(signal, build, until=LONGER, guess={"thickness": 3.7e-3}, compare="features",
                        thickness=(2e-3, 6e-3))  # fmt: skip
    assert found["thickness"].verdict == "identified"
    assert abs(found["thickness"].value - 4e-3) < 1.5 * found["thickness"].error
    assert hl.identifiability(build, sensors=[8], until=LONGER, compare="features", thickness=4e-3).verdict(
        "thickness"
    ) == "identified"  # fmt: skip


@pytest.mark.parametrize(("made_for", "lead", "warned"), [(6e-4, 1e-4, False), (3e-4, 2e-4, True)])
def test_a_prediction_is_no_longer_than_the_structure_was_made_for(made_for: float, lead: float, warned: bool) -> None:
    """However long the record is, whose quiet lead is not known before the fit."""

    def build(thickness: float) -> hl.CoSimulation:
        plate = hl.half_plane(thickness, hl.ALUMINIUM_6061, "clamped", 0.05, made_for)
        return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, 0.31), plate)

    signal = tap(build(4e-3), until=made_for, lead=lead)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = hl.identify(signal, build, guess={"thickness": 3.9e-3}, thickness=(2e-3, 6e-3))
    assert found.input["until"] == made_for
    assert any("made for runs of" in str(one.message) for one in caught) == warned
    with pytest.warns(hl.HertzlinkWarning, match="made for runs of .*; make it for"):
        assert np.isfinite(hl.identifiability(build, sensors=[5], thickness=4e-3).bounds["thickness"])
    with pytest.raises(ValueError, match=r"reduced for runs of at most .*; make it with that until, or take a shorter"):
        hl.identify(signal, build, until=1.1 * made_for, thickness=(2e-3, 6e-3))


@pytest.mark.thorough
def test_features_of_a_signal_that_the_model_lacks_are_not_explained() -> None:
    signal = tap(wall(3e9, 0.1), (3, 7), until=LONGER)
    with pytest.warns(hl.HertzlinkWarning, match="the model lacks something"):
        found = hl.identify(signal, wall, until=LONGER, compare="features", guess={"modulus": 3e9}, modulus=(2e9, 5e9))
    assert not found.explained


def test_features_that_are_fewer_than_the_unknowns_are_refused() -> None:
    def build(modulus: float, density: float, poisson_ratio: float) -> hl.CoSimulation:
        facing = hl.half_space(hl.Material(modulus, poisson_ratio, density))
        return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, 0.31), facing)

    with pytest.raises(ValueError, match=r"2 values .* cannot determine 3 unknowns"):
        hl.identify(
            tap(wall(3e9), until=6e-4), build, until=6e-4, compare="features", modulus=(1e9, 2e10), density=(1e3, 3e3),
            poisson_ratio=(0.2, 0.4),
        )  # fmt: skip


@pytest.mark.thorough
def test_the_posterior_of_a_sharp_minimum_is_the_interval() -> None:
    """1 600 runs are some 50 independent draws, whose standard deviation scatters by 10 %."""
    signal = tap(wall(3e9))
    found = hl.identify(signal, wall, until=UNTIL, guess={"modulus": 3.1e9}, modulus=(2e9, 4.5e9))
    draws = found.posterior(1600, seed=1)
    assert draws.modulus.mean() == pytest.approx(found["modulus"].value, abs=0.5 * found["modulus"].error)
    assert 1.96 * draws.modulus.std() == pytest.approx(found["modulus"].error, rel=0.3)


def test_a_posterior_has_a_seed_and_enough_runs() -> None:
    found = hl.identify(tap(wall(3e9)), wall, until=UNTIL, guess={"modulus": 3.1e9}, modulus=(2e9, 4.5e9))
    one, again, other = (found.posterior(64, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.modulus, again.modulus)
    assert not np.array_equal(one.modulus, other.modulus)
    with pytest.raises(ValueError, match="runs = 20: must be at least"):
        found.posterior(20)


def test_a_fit_takes_one_thread_of_linear_algebra() -> None:
    """While it searches; afterwards there are as many as before. Beside other work, threads wait for each other."""
    seen = list[set[int]]()

    def build(modulus: float) -> hl.CoSimulation:
        seen.append({one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"})
        return wall(modulus)

    signal = tap(wall(3e9))
    with threadpool_limits(2, "blas"):
        hl.identify(signal, build, until=UNTIL, guess={"modulus": 2.9e9}, modulus=(1e9, 20e9))
        after = {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}
    assert after == {2}
    assert seen[-1] == {1}
    assert seen.count({1}) > len(seen) / 2  # all but the first, which checks what build gives


def test_an_interval_does_not_depend_on_how_the_unknown_is_written() -> None:
    """The modulus on a logarithmic scale, or its change on a linear one: the same likelihood, but two parabolas."""
    signal = tap(wall(3e9), noise=1.5)
    one = hl.identify(signal, wall, ["gain", "time_zero"], until=UNTIL, guess={"modulus": 3e9}, modulus=(0.3e9, 30e9))

    def changed(change: float) -> hl.CoSimulation:
        return wall(3e9 * (1.0 + change))

    guess, ends = {"change": 0.0}, {"change": (-0.9, 9.0)}
    other = hl.identify(signal, changed, ["gain", "time_zero"], until=UNTIL, guess=guess, **ends)
    expected = [3e9 * (1.0 + end) for end in other["change"].interval]
    # The two parabolas differ by 0.1 of the error.
    assert one["modulus"].interval == pytest.approx(expected, abs=0.05 * one["modulus"].error)


def test_a_fit_says_its_stage_and_count(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of about as many runs as it likely takes; the count is that of the result, and the first runs of each name."""
    monkeypatch.setattr("coupling.sweeps.progress.LOG_INTERVAL", 0.0)
    with caplog.at_level(logging.INFO, "hertzlink.sweep"):
        found = hl.identify(tap(wall(3e9)), wall, until=UNTIL, modulus=(2e9, 4.5e9))
    said = [record.getMessage() for record in caplog.records]
    assert said[0] == "identify: search 1 of about 33 runs"
    assert {line.split()[1] for line in said} >= {"search", "intervals"}
    assert abs(int(said[-1].split()[2]) - found.runs) <= 0.1 * found.runs


@pytest.mark.parametrize(
    ("given", "runs"),
    [
        ({"unknowns": 1}, (29, 29)), ({"unknowns": 1, "nuisances": 1}, (53, 66)),
        ({"unknowns": 2, "nuisances": 1}, (147, 211)), ({"unknowns": 1, "nuisances": 1, "guess": True}, (32, 43)),
    ],
)  # fmt: skip
def test_likely_runs_are_those_of_fits(given: dict[str, Any], runs: tuple[int, int]) -> None:
    """Least and most that fits of rods, plates, an edge, a bond and losses took."""
    assert runs[0] / 1.25 < likely_runs(**given) < runs[1] * 1.25


def test_traces_between_runs_are_those_of_hertz_scaling() -> None:
    """Hertz's contacts make forces v^(6/5) and times v^(-1/5), so one run tells those of all speeds."""
    speeds = Range("impact_speed", 0.2, 0.5)
    prediction = Prediction(lambda impact_speed: wall(3e9, impact_speed), [speeds], [5], UNTIL)
    places = np.linspace(0.0, 1.0, 9)[:, None]
    between = interpolated(prediction, places, prediction.traces(list(places)))
    assert between is not None
    usual, time = prediction.trace(places[4])[0], prediction.time
    for place in (0.19, 0.43):
        slower = speeds.value(place) / speeds.value(0.5)
        expected = slower**1.2 * np.interp(slower**0.2 * time, time, usual)
        assert between.trace(np.array([place]))[0] == pytest.approx(expected, abs=3e-3 * usual.max())


@pytest.mark.parametrize("decay", [0.0, 0.5, 0.9, 0.99])
def test_independent_samples_of_correlated_noise(decay: float) -> None:
    """n (1 − a)/(1 + a) where the correlation is aᵏ: a geometric series."""
    covariance = 3.0 * decay ** np.arange(2000.0)
    expected = 1e4 * (1.0 - decay) / (1.0 + decay)
    # Correlations below a tenth are left out.
    assert independent_samples(covariance, 10_000) == pytest.approx(expected, rel=0.15)


def test_an_unknown_that_must_be_a_whole_number_is_named() -> None:
    """The number of beads varies by jumps, so that no fit and no derivative can use it."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)

    def build(modulus: float, beads: float) -> hl.CoSimulation:
        wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
        return hl.CoSimulation(hl.Chain([bead] * beads, bead, 0.3), wall)  # type: ignore[operator]

    signal = hl.as_signal(np.linspace(0.0, 5e-4, 501), {5: np.sin(np.linspace(0.0, 9.0, 501))})
    with pytest.raises(ValueError, match=r"beads = 10\.0: .* continuously"):
        hl.identify(signal, build, modulus=(1e9, 10e9), beads=(8, 12))
    with pytest.raises(ValueError, match=r"beads = 10\.0: .* continuously"):
        hl.sensitivities(build, 5e-4, 5, modulus=3e9, beads=10)


@pytest.mark.parametrize("names", [("radius", "speed"), ("speed", "radius")])
def test_an_error_of_types_in_a_builder_is_its_own(names: tuple[str, str]) -> None:
    """No whole number helps: a radius would be zero and a speed out of its range, whose errors would hide it."""

    def build(radius: float, speed: float) -> hl.CoSimulation:
        assert 1.0 / radius > 0.0
        if speed < 1.2:
            raise ValueError("too slow")
        return hl.CoSimulation(len(3))  # type: ignore[arg-type]

    values = {"radius": 4.7e-3, "speed": 1.5}
    with pytest.raises(TypeError, match=r"object of type 'int' has no len\(\)"):
        hl.sensitivities(build, 5e-4, [5], **{name: values[name] for name in names})


def test_least_squares_that_end_with_reused_derivatives_go_on_until_nothing_falls() -> None:
    """Derivatives with a secant may lack a direction in which χ² still falls: 9, then 4 with new ones, then 4 again."""
    falls, forgotten = iter([9.0, 4.0, 4.0]), list[None]()
    misfit = SimpleNamespace(reused=True, forget_slopes=lambda: forgotten.append(None))

    def ended(start: Any, *_: Any) -> Solution:
        return Solution(start + 1.0, next(falls), True)

    search: Any = SimpleNamespace(misfit=misfit, _least_squares=ended)
    solution = GlobalSearch.solved(search, np.zeros(1))
    assert (solution.misfit, len(forgotten)) == (4.0, 2)
    misfit.reused, falls = False, iter([9.0])
    assert GlobalSearch.solved(search, np.zeros(1)).misfit == 9.0


@pytest.mark.thorough
def test_a_fit_of_many_unknowns_advises_another_seed() -> None:
    """It begins with least squares on runs, and says that these may end at another minimum."""

    def tapped(modulus: float, speed: float, striker: float, bead: float, radius: float) -> hl.CoSimulation:
        steel = replace(hl.STEEL_440C, youngs_modulus=bead)
        chain = hl.Chain([hl.Sphere(radius, steel)] * 10, hl.Sphere(striker, steel), speed)
        return hl.CoSimulation(chain, hl.half_space(hl.Material(modulus, 0.3, 2000.0)))

    truth = {"modulus": 3e9, "speed": 0.31, "striker": 4.8e-3, "bead": 2.0e11, "radius": 4.76e-3}
    signal = tapped(**truth).run(6e-4, save_every=1e-6)
    ranges = {name: (0.9 * value, 1.15 * value) for name, value in truth.items()}
    with pytest.warns(hl.HertzlinkWarning, match="5 unknowns or more may end at a wrong minimum .* another seed"):
        result = hl.identify(signal, tapped, sensors=[3, 7], noise=0.5, until=6e-4, scan=16, **ranges)
    assert "another seed" in result.warnings[-1]
    assert "another seed" in str(result)
    assert result.explained
    near = hl.identify(signal, tapped, sensors=[3, 7], noise=0.5, until=6e-4, guess=truth, **ranges)
    assert not any("another seed" in warning for warning in near.warnings)
