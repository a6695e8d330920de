"""Calibration on impacts whose factor is known, and what is read from a trace: noise, resolution, quiet lead."""

import numpy as np
import pytest

import hertzlink as hl
from coupling.results.sensor_trace import quiet_lead, smoothed
from coupling.signals.calibration import calibration_factor

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
KAPPA = 12.5
STEP = 1e-7


def impact(backing: str) -> tuple[np.ndarray, np.ndarray]:
    """Force of a striker at 0.44 m/s on a steel block, or on an equal free bead, with a lead of 30 µs."""
    if backing == "immobile":
        rigid = hl.Material(2e16, 0.3, 7800.0)
        run = hl.CoSimulation(hl.Chain([BEAD], BEAD, 0.44), hl.half_space(rigid), window=STEP).run(until=1e-4)
    else:
        run = hl.CoSimulation(hl.Chain([BEAD], BEAD, 0.44), None, window=STEP).run(until=1e-4)
    force = np.r_[np.zeros(300), run.contact_force.sel(contact=1).values]
    return STEP * np.arange(force.size), force


def pulse(amplitude: float = 1.0, at: float = 5e-4, width: float = 2e-5, step: float = STEP) -> np.ndarray:
    time = np.arange(0.0, 1e-3, step)
    return amplitude * np.exp(-(((time - at) / width) ** 2))


def half_sine(lead: float, mass: float = 3.5e-3, speed: float = 0.44, duration: float = 40e-6) -> tuple:
    """The force m v (π/T) sin(πt/T) against an immobile block stops the striker at T/2 exactly."""
    time = np.arange(0.0, 2e-4, STEP)
    inside = (time > lead) & (time < lead + duration)
    force = np.where(inside, mass * speed * np.pi / duration * np.sin(np.pi * (time - lead) / duration), 0.0)
    return time, force, mass, speed


def test_calibration_by_a_known_impulse() -> None:
    time, force, mass, speed = half_sine(lead=5e-5)
    assert calibration_factor(time, force / KAPPA, mass, speed) == pytest.approx(KAPPA, rel=2e-3)
    assert calibration_factor(time, -force / -KAPPA + 0.3, mass, speed) == pytest.approx(KAPPA, rel=2e-3)


def test_calibration_against_a_free_equal_bead_has_half_the_impulse() -> None:
    """Both simulated: both factors are equal, and twice as large where the wrong backing is assumed."""
    time, force = impact("free")
    free = calibration_factor(time, force / KAPPA, BEAD.mass, 0.44, backing="free")
    assert free == pytest.approx(KAPPA, rel=3e-3)
    assert calibration_factor(time, force / KAPPA, BEAD.mass, 0.44) == pytest.approx(2.0 * free)


def test_calibration_survives_noise_and_an_offset() -> None:
    time, force, mass, speed = half_sine(lead=5e-5)
    rng = np.random.default_rng(1)
    noise = 0.02 * force.max() * rng.standard_normal((100, force.size))
    found = [calibration_factor(time, (force + one) / KAPPA - 0.1, mass, speed) for one in noise]
    assert np.mean(found) == pytest.approx(KAPPA, rel=5e-3)
    assert np.max(np.abs(np.array(found) / KAPPA - 1.0)) < 0.03


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"backing": "rubber"}, "backing = 'rubber': must be one of 'immobile', 'free'"),
        ({"mass": 0.0}, "mass = 0.0"),
        ({"impact_speed": -1.0}, "impact_speed = -1.0"),
        ({"time": [0.0] * 50}, "time: must increase"),
        ({"time": [0.0, 1.0]}, "time: has shape"),
        ({"voltage": [0.0, np.nan] * 25}, r"voltage\[1\] = nan"),
        ({"voltage": np.zeros(51)}, "voltage: holds 51 numbers"),
        ({"voltage": np.zeros(50)}, "voltage: has no quiet lead"),
        ({"voltage": -np.exp(-(((np.arange(50) - 30.0) / 5.0) ** 2))}, "greatest deflection is negative"),
        ({"voltage": np.exp(-(((np.arange(50) - 1.0) / 5.0) ** 2))}, "quiet lead"),
    ],
)
def test_bad_calibration(change: dict, message: str) -> None:
    good = {"time": np.arange(50.0), "voltage": np.exp(-(((np.arange(50) - 30.0) / 5.0) ** 2))}
    good |= {"mass": 1.0, "impact_speed": 1.0}
    assert calibration_factor(**good) > 0.0
    with pytest.raises(ValueError, match=message):
        calibration_factor(**(good | change))


def test_smoothing_lowers_noise_as_it_says() -> None:
    """The noise that is left is measured far from the pulse."""
    values = pulse() + 0.02 * np.random.default_rng(0).standard_normal(pulse().size)
    smooth, left, width = smoothed(values)
    assert width == pytest.approx(2.0 * np.sqrt(np.log(2.0)) * 200, rel=0.1)
    assert np.std(smooth[:3000]) == pytest.approx(left, rel=0.3)


def test_the_quiet_lead_ends_before_the_pulse() -> None:
    values = 0.4 + pulse() + 0.02 * np.random.default_rng(0).standard_normal(pulse().size)
    assert 1000 < quiet_lead(values) < 4500
    assert quiet_lead(pulse(at=0.0) + 0.5 * pulse()) == 0
