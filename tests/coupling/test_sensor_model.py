"""The sensor model against closed forms; its inverse; bad input."""

from itertools import pairwise

import numpy as np
import pytest
import scipy

import hertzlink as hl

TAU = 1e-3


def test_step_decays_with_the_time_constant() -> None:
    time = np.linspace(0.0, 3e-3, 61)
    seen = hl.SensorModel(time_constant=TAU).response(time, np.full(61, 10.0))
    assert seen == pytest.approx(10.0 * np.exp(-time / TAU), rel=1e-9)


@pytest.mark.parametrize(
    ("model", "frequency", "gain"),
    [
        (hl.SensorModel(bandwidth=1e5), 1e5, 0.5**0.5),
        (hl.SensorModel(time_constant=1e-3), 1.0 / (2e-3 * np.pi), 0.5**0.5),
        (hl.SensorModel(stiffness=4e8, mass=1e-3, damping=0.05), (4e11) ** 0.5 / 2 / np.pi, 10.0),
    ],
)
def test_gain_at_a_frequency(model: hl.SensorModel, frequency: float, gain: float) -> None:
    """A sine, after the transient: its amplitude by least squares."""
    time = np.arange(18_000) / (200.0 * frequency)
    phase = 2.0 * np.pi * frequency * time
    seen = model.response(time, np.sin(phase))
    late = slice(12_000, None)
    parts = np.linalg.lstsq(np.column_stack([np.sin(phase), np.cos(phase)])[late], seen[late], rcond=None)[0]
    assert np.hypot(*parts) == pytest.approx(gain, rel=2e-3)


def after_half_sine(t: float, length: float) -> float:
    """The output of an RC high-pass at the time t of a half-sine pulse of amplitude 1, t ≥ length: −∫e^…/τ."""
    w = np.pi / length
    integral = w * TAU**2 * (1.0 + np.exp(length / TAU)) / (1.0 + (w * TAU) ** 2) * np.exp(-t / TAU)
    return -integral / TAU


def test_charge_lost_by_a_rectangular_and_a_half_sine_pulse() -> None:
    """After a pulse of length T the trace is −(1 − e^{−T/τ}) e^{−(t−T)/τ}; for the half sine in closed form too."""
    model, length = hl.SensorModel(time_constant=TAU), 1e-4
    time = np.arange(10_001) * 1e-7
    rectangle = model.response(time, (time < length - 5e-8).astype(float))
    after = slice(1005, None)
    expected = -(1.0 - np.exp(-length / TAU)) * np.exp(-(time - length) / TAU)
    assert rectangle[after] == pytest.approx(expected[after], rel=2e-3)
    pulse = np.where(time <= length, np.sin(np.pi * time / length), 0.0)
    seen = model.response(time, pulse)
    assert seen[after] == pytest.approx([after_half_sine(t, length) for t in time[after]], rel=1e-5)


def test_second_order_in_the_sampling_interval() -> None:
    model = hl.SensorModel(time_constant=TAU, bandwidth=2e4, stiffness=4e8, mass=1e-2, damping=0.1)
    seen = []
    for count in (101, 201, 401, 801):
        time = np.linspace(0.0, 4e-4, count)
        seen.append(model.response(time, np.sin(np.pi * time / 4e-4) ** 2)[:: (count - 1) // 100])
    errors = [np.abs(coarse - fine).max() for coarse, fine in pairwise(seen)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.2)


def test_exact_for_a_force_that_is_linear_between_samples() -> None:
    model = hl.SensorModel(time_constant=TAU, bandwidth=2e4, stiffness=4e8, mass=1e-2)
    time = np.linspace(0.0, 1e-3, 101)
    force = np.random.default_rng(1).normal(size=101)
    fine = np.linspace(0.0, 1e-3, 1001)
    assert model.response(fine, np.interp(fine, time, force))[::10] == pytest.approx(
        model.response(time, force), abs=1e-9
    )


def test_the_loss_of_charge_is_restored() -> None:
    """Exactly for the high-pass; an offset ε grows as ε t/τ."""
    model = hl.SensorModel(time_constant=TAU)
    time = np.arange(5001) * 2e-7
    force = np.sin(2e4 * time) ** 2 * np.exp(-time / 2e-4)
    seen = model.response(time, force)
    restored = model.correct(hl.as_signal(time, {1: seen, 2: seen + 0.01})).sensor_force
    assert restored.sel(sensor=1).values == pytest.approx(force, abs=1e-10)
    assert restored.sel(sensor=2).values[-1] - force[-1] == pytest.approx(0.01 * (1.0 + 1.0), rel=1e-6)
    signal = hl.as_signal(time, {7: force, 9: 2.0 * force}, {7: 0.06, 9: 0.08})
    twice = model.correct(model.apply(signal, sensors=[9]))
    assert twice.sensor_force.sel(sensor=9).values == pytest.approx(2.0 * force, abs=1e-10)
    assert float(twice.centre.sel(sensor=9)) == 0.08
    assert "Seen by SensorModel" in twice.conditioning
    assert "restored" in twice.conditioning


def test_runs_become_signals() -> None:
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.44), hl.half_space(hl.STEEL_440C)).run(6e-4)
    seen = hl.SensorModel(bandwidth=5e4).apply(run, sensors=[8])
    assert float(seen.sensor_force.max()) < float(hl.sensor_force(run, 8).max())
    assert np.isfinite(float(hl.amplitude_ratio(seen, 8)))
    with pytest.raises(ValueError, match="sensors = None: must be a list of one bead number or more"):
        hl.SensorModel(bandwidth=5e4).apply(run)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "stiffness = None, mass = None: give both, or else a time_constant or a bandwidth"),
        ({"time_constant": -1e-3}, "time_constant = -0.001"),
        ({"bandwidth": 0.0}, "bandwidth = 0.0"),
        ({"stiffness": 1e8}, r"stiffness = 1.*, mass = None: give both"),
        ({"mass": 1e-3}, r"stiffness = None, mass = 0\.001: give both"),
        ({"bandwidth": 1e5, "damping": 0.0}, "damping = 0.0"),
    ],
)
def test_bad_models(given: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.SensorModel(**given)


def test_bad_traces() -> None:
    time = np.arange(100) * 1e-6
    force = scipy.signal.windows.hann(100)
    low = hl.SensorModel(bandwidth=1e6)
    high = hl.SensorModel(time_constant=TAU)
    signal = hl.as_signal(time, {7: force})
    for call, message in (
        (lambda: low.response(time, force), r"bandwidth = 1e\+06 Hz: must be at most half the sampling rate, 5e\+05"),
        (lambda: low.correct(signal), "time_constant = None: must be given"),
        (lambda: high.response(time, []), r"force: has shape \(0,\)"),
        (lambda: high.response(time, np.where(time > 5e-5, np.nan, force)), r"force\[51\] = nan"),
        (lambda: high.response(time**1.1, force), "time: must have equal steps"),
        (lambda: high.response(time, force[1:]), "force: holds 99 numbers, must be as many as time, 100"),
        (lambda: high.apply(signal, [8]), "sensor = 8: must be one that was measured: 7"),
        (lambda: high.apply(3), "signal = 3: must be a run"),
        (lambda: high.correct(signal.where(signal.time < 9e-5)), "sensor 7 has .* clipped samples"),
    ):
        with pytest.raises(ValueError, match=message) as caught:
            call()
        assert "\n" not in str(caught.value)
