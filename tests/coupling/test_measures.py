"""Measures on synthetic signals whose answers are known, and on runs."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzlink as hl
from coupling.results.waves import NoWaveError, Wave
from coupling.signals.signals import as_signal

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)


def signal(*pulses: tuple[float, float, float], step: float = 3.7e-7, static: float = 0.0) -> xr.Dataset:
    """A run of two beads whose force at bead 1 is a sum of pulses (amplitude, arrival, direction).

    A pulse that goes on (direction 1) passes contact 1 8 µs before contact 2, one that comes back 8 µs after it. The
    bead moves the way that it goes.
    """
    time = np.arange(0.0, 1e-3, step)
    contacts, velocity = np.full((time.size, 3), static), np.zeros((time.size, 3))
    for amplitude, arrival, direction in pulses:
        velocity += 1e-3 * direction * amplitude * np.exp(-(((time - arrival) / 12e-6) ** 2))[:, None]
        for contact in range(3):
            delay = direction * (2 * contact - 1) * 4e-6
            contacts[:, contact] += amplitude * np.exp((1.0 / 3.0) ** 2 - ((time - arrival - delay) / 12e-6) ** 2)
    return xr.Dataset(
        {"contact_force": (("time", "contact"), contacts), "velocity": (("time", "bead"), velocity)},
        coords={
            "time": time,
            "bead": [0, 1, 2],
            "contact": [1, 2, 3],
            "static_force": ("contact", np.full(3, static)),
            "centre": ("bead", [-0.005, 0.005, 0.015]),
        },
    )


@settings(max_examples=40)
@given(st.floats(0.02, 1.5), st.floats(2e-4, 7e-4), st.floats(0.0, 5.0))
def test_known_pulses_are_found_between_samples(ratio: float, flight: float, static: float) -> None:
    run = signal((50.0, 1.234567e-4, 1.0), (50.0 * ratio, 1.234567e-4 + flight, -1.0), static=static)
    assert hl.amplitude_ratio(run, 1).item() == pytest.approx(ratio, rel=1e-5)
    assert hl.time_of_flight(run, 1).item() == pytest.approx(flight, abs=2e-10)


def test_incident_primary_and_secondary() -> None:
    waves = hl.reflections(signal((50.0, 1e-4, 1.0), (20.0, 5e-4, -1.0), (10.0, 7e-4, -1.0)), sensor=1)
    assert waves.incident == Wave(pytest.approx(50.0, rel=1e-5), pytest.approx(1e-4, abs=1e-9))
    assert waves.primary
    assert waves.secondary
    assert waves.primary.amplitude_ratio == pytest.approx(0.4, rel=1e-5)
    assert waves.secondary.time_of_flight == pytest.approx(6e-4, abs=1e-9)


@pytest.mark.parametrize(
    "run",
    [
        signal((50.0, 1e-4, 1.0)),
        signal((50.0, 1e-4, 1.0), (20.0, 5e-4, 1.0)),
        signal((50.0, 1e-4, 1.0), (0.2, 5e-4, -1.0)),
    ],
    ids=["nothing came back", "a second wave that goes on", "a ripple"],
)
def test_no_wave_is_none_and_never_a_wrong_peak(run: xr.Dataset) -> None:
    waves = hl.reflections(run, sensor=1)
    assert waves.incident
    assert not waves.primary
    assert np.isnan(hl.amplitude_ratio(run, 1).item())
    assert np.isnan(hl.time_of_flight(run, 1).item())


def test_no_wave_is_its_own_reflection() -> None:
    """A PTFE bead among steel ones: nothing comes back before the incident wave has passed."""
    beads = [BEAD] * 10 + [hl.Sphere(4.76e-3, hl.PTFE)] + [BEAD] * 9
    run = hl.CoSimulation(hl.Chain(beads, BEAD, 0.44), hl.half_space(hl.STEEL_440C)).run(until=1.8e-3)
    for sensor in range(2, 20):
        primary = hl.reflections(run, sensor).primary
        assert not primary or primary.time_of_flight > 10e-6


def test_a_weak_wave_in_the_wake_of_the_primary_one_counts() -> None:
    """Under gravity a hard wall sends a second wave of 2 %, which is back sooner than a single wave of its strength."""
    chain = hl.Chain([BEAD] * 20, BEAD, hl.drop_speed(0.01), gravity=9.81)
    run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(0.8e-3)
    assert hl.amplitude_ratio(run, 7, "secondary") == pytest.approx(0.021, abs=1e-3)
    assert hl.time_of_flight(run, 7, "secondary") == pytest.approx(575e-6, abs=2e-6)


def test_small_peaks_are_not_reported_even_from_below_zero() -> None:
    run = signal((50.0, 1e-4, 1.0), (20.0, 5e-4, -1.0), (-2.0, 6.6e-4, 1.0), (1.9, 7e-4, -1.0), static=0.0)
    secondary = hl.reflections(run, sensor=1, smallest=0.1).secondary
    assert not secondary


def test_a_third_wave_is_told_from_the_second() -> None:
    run = signal((50.0, 1e-4, 1.0), (20.0, 4e-4, -1.0), (10.0, 6e-4, -1.0), (5.0, 8e-4, -1.0))
    found = [hl.time_of_flight(run, 1, wave).item() for wave in ("primary", "secondary", "third")]
    assert found == pytest.approx([3e-4, 5e-4, 7e-4], abs=1e-9)
    assert hl.amplitude_ratio(run, 1, "third").item() == pytest.approx(0.1, rel=1e-5)
    assert np.isnan(hl.amplitude_ratio(signal((50.0, 1e-4, 1.0), (20.0, 5e-4, -1.0)), 1, "third").item())


def test_a_silent_run_has_no_waves() -> None:
    waves = hl.reflections(signal(static=1.0), sensor=1)
    assert not any(waves)
    with pytest.raises(NoWaveError, match="arrival: there is no incident wave; no wave runs over bead 1"):
        _ = waves.incident.arrival


def test_amplitudes_are_dynamic() -> None:
    """The preload of a vertical chain of heavy beads is subtracted."""
    chain = hl.Chain([BEAD] * 10, BEAD, 0.3, gravity=300.0)
    run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=1e-4)
    force = hl.sensor_force(run, 5)
    assert abs(force.isel(time=0)) < 1e-9
    assert float(run.contact_force.isel(time=0).sel(contact=6)) > 5.0


def test_contact_time_of_a_known_pulse() -> None:
    """A triangle of 100 µs on top of a preload: it exceeds 1 % of its height for 99 µs."""
    time = np.arange(0.0, 3e-4, 7e-7)
    force = 2.0 + 30.0 * np.clip(1.0 - abs(time - 1.5e-4) / 5e-5, 0.0, None)
    run = xr.Dataset(
        {"contact_force": (("time", "contact"), force[:, None])},
        coords={"time": time, "static_force": ("contact", [2.0])},
    )
    assert hl.contact_time(run) == pytest.approx(99e-6, abs=0.4e-6)
    assert np.isnan(hl.contact_time(run.isel(time=slice(None, 200))))
    assert np.isnan(hl.contact_time(run.isel(time=slice(None, 50))))


def test_measures_over_a_sweep() -> None:
    """Energy error and contact time of each point equal those of the single runs."""

    def at(speed: float) -> hl.CoSimulation:
        return hl.CoSimulation(hl.Chain([BEAD] * 4, BEAD, speed), hl.half_space(hl.STEEL_440C))

    runs = hl.sweep(at, until=4e-4, jobs=1, speed=[0.1, 0.4])
    single = at(0.1).run(until=4e-4)
    errors, times = hl.energy_error(runs), hl.contact_time(runs)
    assert isinstance(errors, xr.DataArray)
    assert isinstance(times, xr.DataArray)
    assert errors.sel(speed=0.1).item() == pytest.approx(hl.energy_error(single), rel=0.5)
    assert times.sel(speed=0.1).item() == pytest.approx(hl.contact_time(single), rel=1e-3)


@pytest.mark.parametrize("preload", [3.0, 10.0])
def test_the_tail_of_an_incident_wave_is_no_wave_that_came_back(preload: float) -> None:
    """The contacts of a run show where waves go; in a signal, the trough before the tail shows it."""
    plate = hl.half_plane(4e-3, hl.ALUMINIUM_6061, "free", 2.0, until=9e-4)  # whose edge is too far away to answer
    run = hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, 0.31, preload=preload), plate).run(9e-4)
    primary = hl.reflections(run, 10).primary
    force = as_signal(run.time.values, {10: hl.sensor_force(run, 10).values})
    for earliest in (0.0, 0.8 * primary.time_of_flight):
        alone = hl.reflections(force, 10, earliest=earliest).primary
        assert alone.amplitude_ratio == pytest.approx(primary.amplitude_ratio, abs=1e-4)
        assert alone.time_of_flight == pytest.approx(primary.time_of_flight, abs=1e-7)
    with pytest.raises(ValueError, match=r"earliest = 0.0003: must be 0 for a run"):
        hl.reflections(run, 10, earliest=3e-4)
    with pytest.raises(ValueError, match="earliest"):
        hl.reflections(force, 10, earliest=-1.0)
