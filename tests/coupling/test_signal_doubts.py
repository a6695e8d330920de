"""Warnings of misleading records, with the cure: no lead, drift, hum, AC coupling, swapped sensors,
clipped tops, an offset."""

import warnings
from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from scipy.signal import lfilter

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
STEP = 2e-7


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    chain = hl.Chain([BEAD] * 20, BEAD, 0.31)
    return hl.CoSimulation(chain, hl.half_plane(4e-3, hl.ALUMINIUM_6061, "clamped", 0.03, until=9e-4)).run(9e-4)


def record(run: xr.Dataset, *sensors: int, lead: float = 2e-4, begin: float = 0.0) -> tuple[np.ndarray, dict]:
    """Times and forces as a recorder has them, with a lead, from `begin` on, and noise of 0.2 %."""
    rng, time = np.random.default_rng(7), np.arange(begin, 9e-4 + lead, STEP)
    forces = {}
    for sensor in sensors:
        force = hl.sensor_force(run, sensor)
        forces[sensor] = np.interp(time - lead, force.time, force, left=0.0)
        forces[sensor] += 0.002 * float(force.max()) * rng.standard_normal(time.size)
    return time, forces


def said(signal: xr.Dataset, sensor: int) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        hl.reflections(signal, sensor)
    return [str(one.message) for one in caught]


def test_a_good_record_is_not_doubted(run: xr.Dataset) -> None:
    time, forces = record(run, 7, 12)
    signal = hl.as_signal(time, forces)
    assert said(signal, 7) == []
    assert hl.reflections(signal, 7).primary.amplitude_ratio == pytest.approx(
        hl.reflections(run, 7).primary.amplitude_ratio, abs=0.005
    )


@pytest.mark.parametrize("every", [30, 50, 70, 90, 110])
def test_a_pulse_of_few_samples(run: xr.Dataset, every: int) -> None:
    """The warning bounds the error of AR; with six samples in the width at half height there is none."""
    force, exact = hl.sensor_force(run, 7), hl.reflections(run, 7).primary.amplitude_ratio
    time = np.arange(0.0, 9e-4, STEP)
    values = np.interp(time, force.time, force)
    for start in range(0, every, 7):
        signal = hl.as_signal(time[start::every], {7: values[start::every]})
        bounds = [float(one.split("may be off by ")[1].split(";")[0]) for one in said(signal, 7) if "samples in" in one]
        assert len(bounds) == (every > 30)
        assert abs(hl.reflections(signal, 7).primary.amplitude_ratio - exact) < (bounds or [0.001])[0]


@pytest.mark.parametrize("late", [-4e-6, 0.0, 3e-6, 8e-6])
def test_a_record_that_begins_within_the_wave(run: xr.Dataset, late: float) -> None:
    arrival = hl.reflections(run, 7).incident.arrival
    time, forces = record(run, 7, lead=0.0, begin=arrival + late)
    (message,) = said(hl.as_signal(time - time[0], forces), 7)
    assert "the record begins within a wave" in message
    assert "begin the record before the first wave" in message


def drift(time: np.ndarray, force: np.ndarray) -> np.ndarray:
    return force + 0.1 * force.max() * time / time[-1]


def hum(time: np.ndarray, force: np.ndarray) -> np.ndarray:
    return force + 0.2 * force.max() * np.sin(2.0 * np.pi * 50.0 * time)


def ac_coupled(time: np.ndarray, force: np.ndarray) -> np.ndarray:
    """A high-pass of first order with a time constant of 0.4 ms."""
    part = STEP / 4e-4
    return lfilter([1.0, -1.0], [1.0, -(1.0 - part)], force)


@pytest.mark.parametrize(
    ("spoil", "words"), [(drift, "the zero drifts"), (hum, "the zero drifts"), (ac_coupled, "beads do not pull")]
)
def test_a_zero_that_is_not_that_of_the_force(
    run: xr.Dataset, spoil: Callable[[np.ndarray, np.ndarray], np.ndarray], words: str
) -> None:
    """Each falsifies AR by some percent."""
    time, forces = record(run, 7)
    signal = hl.as_signal(time, {7: spoil(time, forces[7])})
    true = hl.reflections(run, 7).primary.amplitude_ratio
    messages = said(signal, 7)
    assert abs(hl.reflections(signal, 7).primary.amplitude_ratio / true - 1.0) > 0.02
    assert any(words in message and "couple" in message for message in messages)


@pytest.mark.parametrize("part", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("frequency", [5e3, 1e4, 2e4])
def test_fast_hum_is_no_wave(run: xr.Dataset, frequency: float, part: float) -> None:
    """Its crests would be an incident wave in the lead, or a first wave back; AR is wrong only by what hum adds."""
    time, forces = record(run, 7)
    true = hl.reflections(run, 7).primary
    for phase in np.linspace(0.0, 2.0 * np.pi, 5)[1:]:
        hum = part * forces[7].max() * np.sin(2.0 * np.pi * frequency * time + phase)
        signal = hl.as_signal(time, {7: forces[7] + hum})
        assert any("falsifies AR" in message for message in said(signal, 7))
        with pytest.warns(hl.HertzlinkWarning, match="falsifies AR"):
            assert float(hl.amplitude_ratio(signal, 7)) == pytest.approx(true.amplitude_ratio, abs=2.5 * part)


def test_a_wave_that_is_much_stronger_than_the_first() -> None:
    time = np.arange(0.0, 1e-3, STEP)
    force = sum(height * np.exp(-(((time - at) / 2e-5) ** 2)) for height, at in ((10.0, 3e-4), (30.0, 6e-4)))
    messages = said(hl.as_signal(time, {7: force}), 7)
    assert any("the first wave, 10 N, is much weaker than the one at 600 µs, 30 N" in one for one in messages)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda force: force + 5.0, "the force before the first wave is 5 N; this offset falsifies AR"),
        (lambda force: np.minimum(force, 0.8 * force.max()), "samples are clipped at"),
    ],
)
def test_an_offset_and_clipped_tops(run: xr.Dataset, spoil: Callable[[np.ndarray], np.ndarray], words: str) -> None:
    time, forces = record(run, 7)
    (message,) = said(hl.as_signal(time, {7: spoil(forces[7])}), 7)
    assert words in message


def test_swapped_sensors(run: xr.Dataset) -> None:
    time, forces = record(run, 7, 12)
    signal = hl.as_signal(time, {7: forces[12], 12: forces[7]})
    assert any(
        "sensors 7 and 12: the incident wave reaches bead 12" in one and "swapped" in one for one in said(signal, 7)
    )
