"""Where no wave came the reason is known; records that are too short and sensors near an end are warned of."""

import copy
import pickle
import warnings

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from coupling.results.waves import NoWave

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 20, BEAD, 0.4)
FIELDS = ("amplitude", "arrival", "amplitude_ratio", "time_of_flight")


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    return hl.CoSimulation(CHAIN, hl.half_space(hl.STEEL_440C)).run(8e-4)


def upto(run: xr.Dataset, until: float) -> xr.Dataset:
    return run.sel(time=slice(None, until))


def messages(caught: pytest.WarningsRecorder) -> list[str]:
    return [str(one.message) for one in caught]


@pytest.mark.parametrize("name", FIELDS)
def test_a_missing_wave_is_false_and_says_why(name: str) -> None:
    wave = NoWave("primary", "the record is short")
    assert not wave
    for same in (wave, copy.deepcopy(wave), pickle.loads(pickle.dumps(wave))):
        assert same == wave
        assert not hasattr(same, name)
        assert getattr(same, name, 0.0) == 0.0
        with pytest.raises(ValueError, match=f"{name}: there is no primary wave; the record is short"):
            getattr(same, name)
    assert "the record is short" in repr(wave)
    with pytest.raises(AttributeError, match="'NoWave' object has no attribute 'speed'"):
        _ = wave.speed


@pytest.mark.parametrize("sensor", [7, 11, 15])
def test_the_until_that_is_named_holds_the_wave(run: xr.Dataset, sensor: int) -> None:
    """At every length of record without the wave; the wave of a hard wall comes somewhat earlier."""
    flight, arrives = hl.time_of_flight(run, sensor).item(), hl.reflections(run, sensor).primary.arrival
    for until in (arrives - 0.9 * flight, arrives - 0.5 * flight, arrives - 20e-6):
        with pytest.warns(hl.HertzlinkWarning, match=f"record: .* can be back at bead {sensor}; until = ") as caught:
            waves = hl.reflections(upto(run, until), sensor)
        assert waves.incident
        (message,) = messages(caught)
        needed = float(message.split("until = ")[1].split()[0])
        assert arrives < needed < 2.5 * arrives
        with pytest.raises(ValueError, match="amplitude_ratio: there is no primary wave; the record ends at"):
            _ = waves.primary.amplitude_ratio
        with pytest.raises(ValueError, match="no secondary wave; the record ends at"):
            _ = waves.secondary.amplitude_ratio
        with pytest.warns(hl.HertzlinkWarning) as caught:
            assert np.isnan(hl.amplitude_ratio(upto(run, until), sensor))
        assert messages(caught) == [message]


def test_the_until_that_is_named_holds_a_weak_wave() -> None:
    """AR is 0.1: such a wave is slower than the incident one by half."""
    run = hl.CoSimulation(CHAIN, hl.infinite_plate(2.5e-3, hl.ALUMINIUM_6061)).run(1e-3)
    with pytest.warns(hl.HertzlinkWarning, match="record: ") as caught:
        hl.reflections(upto(run, 6e-4), 7)
    assert float(messages(caught)[0].split("until = ")[1].split()[0]) > hl.reflections(run, 7).primary.arrival


@pytest.fixture(scope="module")
def layered() -> xr.Dataset:
    """Steel on PTFE: the second wave follows the first one."""
    rod = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.5e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.5e-3)]
    return hl.CoSimulation(CHAIN, hl.rod(rod)).run(1.2e-3)


@pytest.fixture(scope="module")
def edged() -> xr.Dataset:
    """A plate whose edge sends a weak second wave."""
    return hl.CoSimulation(CHAIN, hl.half_plane(4.76e-3, hl.ALUMINIUM_6061, "clamped", 0.06, 1.1e-3)).run(1.1e-3)


@pytest.mark.parametrize("of", ["layered", "edged"])
@pytest.mark.parametrize("sensor", [7, 12])
def test_a_record_that_ends_within_a_second_wave_says_so(of: str, sensor: int, request: pytest.FixtureRequest) -> None:
    """The `until` that is named holds it. A signal of the same force ends rising, too."""
    run: xr.Dataset = request.getfixturevalue(of)
    second, before = hl.reflections(run, sensor).secondary, 10e-6
    short = upto(run, second.arrival - before)
    with pytest.warns(hl.HertzlinkWarning, match=f"within a wave that comes back to bead {sensor}; until = ") as caught:
        waves = hl.reflections(short, sensor)
    assert waves.primary
    with pytest.raises(ValueError, match=r"no secondary wave; the record ends at .* within a wave"):
        _ = waves.secondary.amplitude_ratio
    needed = float(messages(caught)[0].split("until = ")[1].split()[0])
    assert hl.reflections(upto(run, needed), sensor).secondary == second
    with pytest.warns(hl.HertzlinkWarning) as again:
        assert np.isnan(hl.amplitude_ratio(short, sensor, "secondary"))
    assert messages(again) == messages(caught)
    signal = hl.as_signal(short.time.values, {sensor: hl.sensor_force(short, sensor).values})
    with pytest.warns(hl.HertzlinkWarning, match="record: ends at .*; record longer"):
        assert not hl.reflections(signal, sensor).secondary
    past = hl.reflections(upto(run, second.arrival + before), sensor)
    assert past.secondary.amplitude == pytest.approx(second.amplitude, rel=1e-5)


def test_a_record_that_ends_between_waves_says_nothing_of_a_second(run: xr.Dataset) -> None:
    """On a hard wall the first wave is followed, for 100 µs, only by its return from the struck end."""
    arrives = hl.reflections(run, 7).primary.arrival
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for until in np.arange(arrives + 40e-6, arrives + 1e-4, 10e-6):
            assert "no second reflected wave above 1 %" in hl.reflections(upto(run, until), 7).secondary.reason


def test_a_wave_that_is_weaker_than_asked_for_is_no_short_record(run: xr.Dataset) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        waves = hl.reflections(run, 7, smallest=1.5)
    with pytest.raises(ValueError, match=r"no wave above 150 % of the incident one \(smallest = 1.5\) is back"):
        _ = waves.primary.amplitude_ratio


def test_a_wave_before_the_record_is_long_enough(run: xr.Dataset) -> None:
    waves = hl.reflections(upto(run, 5e-5), 12)
    assert not any(waves)
    with pytest.raises(ValueError, match="no incident wave; no wave runs over bead 12 to the structure within"):
        _ = waves.incident.amplitude


@pytest.mark.parametrize(
    ("sensor", "words"),
    [
        (1, "at the struck end"), (5, "4 beads from the struck end"), (6, ""), (15, ""),
        (16, "4 beads from the structure"), (20, "at the structure"),
    ],
)  # fmt: skip
def test_sensors_near_an_end_are_warned_of(run: xr.Dataset, sensor: int, words: str) -> None:
    for measure in (hl.reflections, hl.amplitude_ratio, hl.time_of_flight):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            measure(run, sensor)
        found = [str(one.message) for one in caught if str(one.message).startswith("sensor = ")]
        assert len(found) == bool(words)
        assert all(f"bead {sensor} is {words}" in one and "choose one from 6 to 15" in one for one in found)


def test_records_of_a_sweep_are_counted(run: xr.Dataset) -> None:
    short = upto(run, 5e-4)
    silent = short.assign(contact_force=short.contact_force.where(short.contact < 0, 0.0))
    several = xr.concat([short, short, silent], "case")
    with pytest.warns(hl.HertzlinkWarning, match=r"would hold it, in 2 of 3 runs$") as caught:
        hl.amplitude_ratio(several, 9)
    assert len(messages(caught)) == 1
