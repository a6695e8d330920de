"""Unknowns from signals: truths found within their intervals, blind ones named, and bad input refused."""

import re
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.linalg import toeplitz
from scipy.optimize import curve_fit
from scipy.signal import lfilter

import hertzlink as hl
from coupling.inference.identification import Identification, Unknown
from coupling.inference.measured import estimated, measured_signal

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
UNTIL, LEAD, STEP = 5e-4, 8e-5, 1e-6


def wall(modulus: float, impact_speed: float = 0.31) -> hl.CoSimulation:
    """Ten beads on a half-space."""
    facing = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, impact_speed), facing)


def tap(
    simulation: hl.CoSimulation, sensors: tuple[int, ...] = (5,), noise: float = 0.01, gain: float = 1.0,
    lead: float = LEAD, seed: int = 0, until: float = UNTIL,
) -> xr.Dataset:  # fmt: skip
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
    found = hl.identify(signal, wall, nuisances, until=UNTIL, **ranges)
    truth = {"modulus": 3e9, "impact_speed": 0.29, "time_zero": LEAD, "gain 3": 1.7, "gain 7": 1.7}
    for name, value in truth.items():
        low, high = found[name].interval
        # Three half-widths: a 95 % interval misses one truth of twenty.
        assert abs(value - 0.5 * (low + high)) < 1.5 * (high - low), name
    assert found["time_zero"].row()[3].endswith(" µs)")  # whose part of the time means nothing
    assert found["modulus"].identifiable
    assert 0.9 < found.misfit < 1.1
    assert found.explained


def layered(glue: float, impact_speed: float = 0.31) -> hl.CoSimulation:
    """Glue below a long layer of PTFE, from where no wave is back within the record."""
    layers = [hl.Layer(hl.PTFE, 0.5, 9.5e-3), hl.Layer(hl.Material(glue, 0.35, 1200.0), 1e-3, 9.5e-3)]
    return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, impact_speed), hl.rod(layers, elements=10))


def test_what_the_record_does_not_show_is_blind_over_its_whole_range() -> None:
    """The wave needs 2 · 0.5 m/√(E/ρ) = 1.2 ms there and back; the record ends after 0.5 ms."""
    rate = np.sqrt(hl.PTFE.youngs_modulus / hl.PTFE.density)
    assert 2.0 * 0.5 / rate > 2.0 * UNTIL
    found = hl.identify(tap(layered(1e9)), layered, until=UNTIL, glue=(5e8, 4e9))
    assert found["glue"].verdict == "blind"
    assert not found["glue"].identifiable
    assert found["glue"].interval == pytest.approx((5e8, 4e9))
    assert "blind" in str(found)
    early = " ".join(str(hl.identify(tap(wall(3e9), until=1.4e-4), wall, modulus=(1e9, 20e9))).split())
    assert "blind: the record ends at 139 µs, before a reflected wave can be back at bead 5" in early
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


def test_bounds_fall_with_noise_samples_and_sensors() -> None:
    """In proportion to the noise, and to the square root of the time between samples."""
    one, half, often, two = (
        hl.identifiability(wall, noise, sensors, UNTIL, sample_every=step, modulus=3e9).bounds["modulus"]
        for noise, step, sensors in ((0.01, 1e-6, [5]), (0.005, 1e-6, [5]), (0.01, 2.5e-7, [5]), (0.01, 1e-6, [5, 7]))
    )
    assert two < one
    assert half == pytest.approx(0.5 * one, rel=1e-3)
    assert often == pytest.approx(0.5 * one, rel=0.03)


def test_unknowns_are_shown_in_their_unit() -> None:
    """A length in mm with as many digits as its error allows; an offset near zero with its error, not a percentage."""
    one = Unknown("distance", 0.06, (0.0595, 0.0605), "identified", unit="mm", unit_size=1e-3)
    assert one.row() == ("distance, mm", "60.00", "59.50 to 60.50", "identified (± 0.83 %)")
    blind = Unknown("distance", 0.06, (0.01, 0.2), "blind", unit="mm", unit_size=1e-3)
    assert replace(one, value=12340.0, interval=(11000.0, 13000.0), unit_size=1.0).row()[1] == "12300"
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
    assert "identified" not in repr(found)
    assert "does NOT explain" in str(found)
    # Other beads leave the modulus blind, wherever in its range the fit ends.
    assert build is not wall or "modulus: at the end of its range; widen it" in str(found)


def test_a_residual_of_the_size_of_the_noise_is_none_if_it_is_correlated() -> None:
    """A ripple after the impact is no part of the model: it hardly changes χ², but it is correlated."""
    signal = tap(wall(3e9))
    late, force = signal.time - LEAD, signal.sensor_force
    ripple = (0.01 * force.max() * np.sin(late / 5e-6)).where(late > 0.0, 0.0)
    asked = {"until": UNTIL, "nuisances": ["time_zero"], "modulus": (1e9, 20e9)}
    for part, explained in ((0.0, True), (0.8, False)):
        assert hl.identify(signal.assign(sensor_force=force + part * ripple), wall, **asked).explained == explained


def test_a_discrepancy_widens_the_interval_and_noise_that_is_too_low_explains_nothing() -> None:
    """The factor is √(1 + s²) or more: an error that is correlated over n samples does not average out over them."""
    signal = tap(wall(3e9))
    given: dict[str, Any] = {"until": UNTIL, "guess": {"modulus": 3.02e9}, "modulus": (2e9, 4.5e9)}
    exact, wide = (hl.identify(signal, wall, discrepancy=d, **given) for d in (0.0, 0.01))
    assert wide["modulus"].error > 2.0 * exact["modulus"].error
    noise = float(exact.data.noise[0])
    for part, explained in ((1.0, True), (0.8, False)):
        assert hl.identify(signal, wall, noise=part * noise, **given).explained == explained


def test_two_different_fits_are_both_reported() -> None:
    """The sign of an unknown that enters by its square cannot be known."""

    def build(root: float) -> hl.CoSimulation:
        return wall(3e9 * (0.1 + 0.9 * root**2))

    with pytest.warns(hl.HertzlinkWarning, match="2 different fits are as good"):
        found = hl.identify(tap(wall(3e9)), build, until=UNTIL, root=(-1.6, 1.5))
    assert sorted(round(mode["root"], 1) for mode in found.modes) == [-1.0, 1.0]
    assert found["root"].verdict == "blind"
    assert found["root"].interval[0] < -0.99
    assert found["root"].interval[1] > 0.99


def test_an_unknown_at_the_end_of_its_range_is_said_to_be_there() -> None:
    """The range is so far from the truth that the fit is at an end, and so near that noise hides this."""
    with pytest.warns(hl.HertzlinkWarning, match="at the end of its range; widen it"):
        found = hl.identify(tap(wall(3e9), noise=0.1), wall, until=UNTIL, modulus=(3.1e9, 20e9))
    assert found.explained
    assert not found.identified
    assert found["modulus"].verdict == "at the end of its range"


def test_a_sensor_whose_wires_are_turned_is_fitted() -> None:
    found = hl.identify(tap(wall(3e9), gain=-1.0), wall, until=UNTIL, guess={"modulus": 2.5e9}, modulus=(2e9, 4e9))
    assert found.explained
    assert found["modulus"].value == pytest.approx(3e9, rel=0.02)
    assert found["gain 5"].value == pytest.approx(-1.0, rel=0.01)
    assert any(note.startswith("gain 5 is negative: this sensor's sign is reversed") for note in found.warnings)


def test_a_short_lead_gives_the_zero_of_the_force_with_an_error() -> None:
    """The median of 200 samples errs by 0.09 times the noise, which 2 000 samples show; the model has no error."""
    run = wall(3e9).run(UNTIL, save_every=2.5e-7)
    time, curve = np.arange(0.0, LEAD / 2.0 + UNTIL, STEP / 4.0), CubicSpline(run.time.values, hl.sensor_force(run, 5))
    clean = np.where(time >= LEAD / 2.0, curve(np.clip(time - LEAD / 2.0, 0.0, UNTIL)), 0.0)
    force = clean + 0.01 * clean.max() * (
        np.random.default_rng(0).normal(size=time.size) + 0.2 * (np.arange(time.size) > 300)
    )
    found = modulus_of(time, force)
    assert found.explained
    assert found["modulus"].value == pytest.approx(3e9, abs=3.3 / 1.96 * found["modulus"].error)


def test_what_was_found_is_saved_and_read_back(tmp_path: Any) -> None:
    found = hl.identify(tap(wall(3e9)), wall, until=UNTIL, modulus=(1e9, 20e9))
    found.to_dataset().to_netcdf(tmp_path / "found.nc")
    with xr.open_dataset(tmp_path / "found.nc", engine="h5netcdf") as read:
        assert read.unknown.values.tolist() == list(found)
        assert float(read.value[0]) == found["modulus"].value
        assert (float(read.low[0]), float(read.high[0])) == found["modulus"].interval
        np.testing.assert_allclose(read.residual, read.measured - read.fitted, atol=1e-12)
        assert "identify" in read.attrs["input"]
    assert all(len(line) <= 80 for line in str(found).splitlines())
    assert repr(found) == str(found)


def test_noise_is_estimated_to_some_per_cent() -> None:
    random = np.random.default_rng(3)
    time = np.arange(1000.0)
    pulse = 40.0 * np.exp(-(((time - 500.0) / 20.0) ** 2))
    assert estimated(pulse + random.normal(0.0, 0.5, 1000)) == pytest.approx(0.5, rel=0.1)
    # Noise of low frequency, such as hum, shows in the lead alone.
    hum = 0.5 * np.sqrt(2.0) * np.sin(2.0 * np.pi * time / 97.0)
    assert estimated(pulse + hum + random.normal(0.0, 0.05, 1000)) == pytest.approx(0.5, rel=0.15)


def test_noise_that_is_given_stays_where_the_lead_drifts() -> None:
    time, clean = tapped()
    signal = hl.as_signal(time, {5: noisy(clean, 0.0, 0) + 5.0 * time / time[-1]})
    (sensor,) = measured_signal(signal, None, 0.7).sensors
    assert sensor.drifts
    assert sensor.noise == pytest.approx(0.7, rel=1e-3)


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


def error_under(covariance: np.ndarray, terms: int = 2) -> float:
    """The error of the modulus, Pa, by Gauss and Markov's theorem: 1/√ of (XᵀC⁻¹X) for modulus, gain, time zero and a
    baseline of some terms.

    covariance: of the samples, in parts of the peak.
    """
    time, clean = tapped()
    columns = [(tapped(3.03e9)[1] - tapped(2.97e9)[1]) / 0.06, clean, 1e-4 * np.gradient(clean, time)]
    matrix = np.stack([*columns, *(clean.max() * (2.0 * time / time[-1] - 1.0) ** k for k in range(terms))], axis=1)
    information = matrix.T @ np.linalg.solve(clean.max() ** 2 * covariance, matrix)
    return 1e9 * float(np.sqrt(np.linalg.inv(information)[0, 0]))


def modulus_of(time: np.ndarray, force: np.ndarray) -> Identification:
    return hl.identify(hl.as_signal(time, {5: force}), wall, until=UNTIL, guess={"modulus": 3e9}, modulus=(2e9, 4.5e9))


@pytest.mark.parametrize("correlation", [pytest.param(2.0, marks=pytest.mark.thorough), 20.0])
def test_errors_under_noise_are_those_of_generalised_least_squares(correlation: float) -> None:
    time, clean = tapped()
    expected = error_under(1e-4 * toeplitz(np.exp(-np.arange(time.size) / correlation)))
    fits = [modulus_of(time, noisy(clean, correlation, seed)) for seed in range(3)]
    assert np.mean([one["modulus"].error / 1.96 for one in fits]) == pytest.approx(expected, rel=0.3)
    assert all(abs(one["modulus"].value - 3e9) < 4.0 * expected for one in fits)
    assert sum(one.identified for one in fits) >= 2
    assert "correlated from sample to sample" in " ".join(fits[0].warnings)


def test_hum_and_drift_leave_the_interval_that_a_cubic_costs() -> None:
    time, clean = tapped()
    level, expected = 0.01 * clean.max(), error_under(1e-4 * np.eye(time.size), 4)
    for seed in range(2):
        slow = 4.0 * level * np.sin(2.0 * np.pi * 50.0 * time + 0.7) + 3.0 * level * (2.0 * time / time[-1] - 1.0)
        found = modulus_of(time, noisy(clean, 0.0, seed) + slow)
        assert found["modulus"].error / 1.96 == pytest.approx(expected, rel=0.1)
        assert found["modulus"].value == pytest.approx(3e9, abs=4.0 * expected)
        assert found.identified
        assert "the quiet lead shows hum or drift" in " ".join(found.warnings)
        assert float(abs(found.data.baseline[0] - slow).max()) < level


def test_what_the_quiet_lead_does_not_show_is_an_error_of_the_model() -> None:
    """A slow force that begins with the waves could be taken off as drift, and the residual would be white."""
    time, clean = tapped()
    late = 0.05 * clean.max() * np.clip(time - 3e-4, 0.0, None) / 3e-4
    found = modulus_of(time, noisy(clean, 0.0, 0) + late)
    assert not found.explained
    assert "baseline" not in found.data


@pytest.mark.thorough
def test_runs_that_fail_and_swapped_channels_explain_nothing() -> None:
    def build(modulus: float) -> hl.CoSimulation:
        if modulus > 5e9:
            raise ValueError("too stiff for this test")
        return wall(modulus)

    with pytest.warns(hl.HertzlinkWarning, match="runs failed and were left out"):
        found = hl.identify(tap(wall(3e9)), build, until=UNTIL, modulus=(1e9, 8e9))
    assert found["modulus"].value == pytest.approx(3e9, rel=0.05)
    swapped = tap(wall(3e9), (3, 7)).assign_coords(sensor=[7, 3])
    with pytest.warns(hl.HertzlinkWarning, match="the incident wave reaches bead 7 .* before bead 3"):
        assert not hl.identify(swapped, wall, until=UNTIL, guess={"modulus": 3e9}, modulus=(1e9, 20e9)).explained


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


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
def test_an_edge_that_the_trace_hardly_shows_is_blind() -> None:
    """Its echo changes the forces by less than the noise, so χ² has ten valleys that are nearly as deep."""
    time, random, bead = np.arange(-1e-4, 1.5e-3, 5e-7), np.random.default_rng(12), hl.Sphere(2.38e-3, hl.STEEL_440C)

    def build(thickness: float, distance: float, impact_speed: float) -> hl.CoSimulation:
        plate = hl.half_plane(thickness, hl.BRASS_360, "free", distance, until=1.5e-3)
        return hl.CoSimulation(hl.Chain([bead] * 20, bead, impact_speed), plate)

    run = build(2.4e-3, 0.075, 0.31).run(1.5e-3)
    forces = {n: np.interp(time, run.time, hl.sensor_force(run, n), left=0.0) for n in (7, 13)}
    signal = hl.as_signal(time, {n: f + 0.01 * f.max() * random.normal(size=time.size) for n, f in forces.items()})
    ranges = {"thickness": (1e-3, 4e-3), "distance": (5e-3, 0.2), "impact_speed": (0.2, 0.5)}
    found = hl.identify(signal, build, ["impact_speed", "gain", "time_zero"], until=1.5e-3, **ranges)
    assert found["distance"].verdict == "blind"
    assert found["distance"].interval[0] < 0.075 < found["distance"].interval[1]


def test_a_second_valley_beside_a_flat_one_belongs_to_the_interval() -> None:
    """The modulus hardly changes at 0.3, so the curvature promises nothing, and it is nearly the same at 0.47."""
    signal = tap(wall(3e9))
    best = hl.identify(signal, wall, until=UNTIL, modulus=(1e9, 9e9))["modulus"].value

    def build(place: float) -> hl.CoSimulation:
        flat, other = 7e10 * (place - 0.3) ** 3, 1e6 + 1e10 * (place - 0.47) ** 2
        return wall(best + (flat if place < 0.35 else min(flat, other)))

    found = hl.identify(signal, build, until=UNTIL, place=(0.0, 1.0))
    assert [mode["place"] for mode in found.modes] == pytest.approx([0.3, 0.47], abs=0.01)
    assert found["place"].interval[0] < 0.29 < 0.48 < found["place"].interval[1]


SIGNAL = hl.as_signal(np.arange(0.0, 6e-4, 1e-6), {5: 40.0 * np.exp(-(((np.arange(600) - 300) / 20.0) ** 2))})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"signal": SIGNAL * np.nan}, "signal: sensor 5 has 0 samples that are not NaN; must have 16"),
        ({"signal": SIGNAL * 0.0}, "signal: sensor 5 is constant, 0 N; must hold a wave"),
        ({"signal": 3}, "signal = 3: must be a signal of read_signal or as_signal, or a run"),
        ({"signal": SIGNAL.isel(time=slice(0, 40))}, r"signal: 39 µs are compared, but a wave needs about .* µs"),
        ({"signal": SIGNAL.isel(time=slice(0, None, 25))}, "signal: has a sample every 25 µs, too coarse for contacts"),
        ({"until": 5e-5}, "signal: 50 µs are compared, but a wave needs"),
        ({"sensors": [99]}, r"sensor = 99|sensor 99"),
        ({"signal": SIGNAL.assign_coords(sensor=[12])}, r"sensors = \[12\]: must be beads from 1 to 10"),
        ({"signal": wall(3e9).run(1e-5)}, "sensors = None: must be a list of one bead number or more"),
        ({"modulus": (3e9, 3e9)}, r"modulus = \(3.*\): must be the lowest and the highest value"),
        ({"modulus": 3e9}, "modulus = 3000000000.0: must be the lowest and the highest value"),
        ({"thickness": (1.0, 2.0)}, "takes modulus, impact_speed, but the unknowns are modulus, thickness"),
        ({"nuisances": ["gains"]}, "nuisances = 'gains': must be gain, offset, time_zero, or"),
        ({"guess": {"speed": 1.0}}, "guess = {'speed': 1.0}: must give a value for each of modulus"),
        ({"guess": {"modulus": 1.0}}, r"guess\['modulus'\] = 1.0: must lie between 1e\+09 and 2e\+10"),
        ({"build": 3}, "build = 3: must be a function"),
        ({"build": lambda modulus: 3}, r"build\(...\) = 3: must be a CoSimulation"),
    ],
)
def test_bad_input_is_refused_in_a_line(change: Mapping[str, Any], message: str) -> None:
    given: dict[str, Any] = {"signal": SIGNAL, "build": wall, "modulus": (1e9, 20e9), **change}
    with pytest.raises(ValueError, match=message) as caught:
        hl.identify(given.pop("signal"), given.pop("build"), **given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"modulus": 0.0}, "modulus = 0: must not be zero, because bounds are relative to the value"),
        ({"noise": -1.0}, "noise = -1.0: must be a positive number"),
        ({"sensors": [40]}, "must be beads from 1 to 10"),
        ({"compare": "all"}, "compare = 'all'"),
        ({"sample_every": 0.0}, "sample_every = 0.0"),
    ],
)
def test_bad_designs_are_refused(change: Mapping[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        hl.identifiability(wall, **{"until": UNTIL, "sensors": [5], "modulus": 3e9, **change})


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
    assert any("reduced for runs of" in str(one.message) for one in caught) == warned
    with pytest.warns(hl.HertzlinkWarning, match="reduced for runs of .*; reduce it for"):
        assert np.isfinite(hl.identifiability(build, sensors=[5], thickness=4e-3).bounds["thickness"])
    with pytest.raises(ValueError, match=r"reduced for runs of at most .*; reduce it for this time, or"):
        hl.identify(signal, build, until=1.1 * made_for, thickness=(2e-3, 6e-3))


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
        result = hl.identify(signal, tapped, sensors=[3, 7], noise=0.5, until=6e-4, **ranges)
    assert "another seed" in result.warnings[-1]
    assert "another seed" in str(result)
    assert result.explained
    near = hl.identify(signal, tapped, sensors=[3, 7], noise=0.5, until=6e-4, guess=truth, **ranges)
    assert not any("another seed" in warning for warning in near.warnings)
