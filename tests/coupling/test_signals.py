"""Signals: what is read from scope files, what is refused, and what noise does to the measures."""

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from coupling.results.waves import Wave
from coupling.signals.signals import as_signal, read_signal

STEP = 1e-7
KAPPA = 20.0


@cache
def run(radius: float = 4.76e-3, wall: str = "steel", dashpot: float = 5.0) -> xr.Dataset:
    bead = hl.Sphere(radius, hl.STEEL_440C)
    loss = hl.LinearDashpot(dashpot) if dashpot else None
    chain = hl.Chain([bead] * 20, bead, hl.drop_speed(0.01), gravity=9.81, dissipation=loss)
    soft = hl.rod([hl.Layer(hl.PTFE, 76.2e-3, 19.1e-3)], base="fixed")
    structure = hl.half_space(hl.STEEL_440C) if wall == "steel" else soft
    until = 1e-3 if wall == "steel" else 1.2e-3
    return hl.CoSimulation(chain, structure, window=STEP).run(until * radius / 4.76e-3, save_every=STEP)


def pulses(time: np.ndarray, *waves: tuple[float, float]) -> np.ndarray:
    return np.sum([a * np.exp(-(((time - at) / 2e-5) ** 2)) for a, at in waves], axis=0)


def write(path: Path, lines: list[str], end: str = "\n") -> Path:
    path.write_text("\n".join(lines) + end, encoding="utf-8")
    return path


HEADER = ["Model,TDS2014", "Record Length,1000", "Sample Interval,1e-6", "", "TIME,CH1,CH2"]


def rows(delimiter: str = ",", scale: float = 1.0, offset: float = 0.0) -> list[str]:
    """Waves of 3 V at 0.2 ms and 1.2 V at 0.6 ms in column 1; column 2 holds them 50 µs later. Trigger at 0.1 ms."""
    time = 1e-6 * np.arange(1000)
    first, second = (offset + pulses(time, (3.0, 2e-4 + d), (1.2, 6e-4 + d)) for d in (0.0, 5e-5))
    table = zip((time - 1e-4) * scale, first, second, strict=True)
    return [delimiter.join(f"{x:.9g}" for x in row) for row in table]


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "  ", ", "])
def test_files_of_scopes(tmp_path: Path, delimiter: str) -> None:
    path = write(tmp_path / "scope.csv", HEADER + rows(delimiter, offset=0.25) + ["", "  "])
    data = read_signal(path, {7: 1, 16: 2}, calibration={7: 20.0, 16: 40.0})
    assert data.sensor_force.dims == ("time", "sensor")
    assert data.sensor_force.attrs["units"] == "N"
    assert data.time.values[0] == pytest.approx(-1e-4)
    assert np.ptp(np.diff(data.time)) < 1e-15
    for sensor, amplitude, arrival in ((7, 60.0, 1e-4), (16, 120.0, 1.5e-4)):
        waves = hl.reflections(data, sensor)
        assert waves.incident == Wave(pytest.approx(amplitude, rel=1e-3), pytest.approx(arrival, abs=1e-8))
        assert waves.primary.amplitude_ratio == pytest.approx(0.4, abs=1e-3)
        assert waves.primary.time_of_flight == pytest.approx(4e-4, abs=1e-8)
        assert not waves.secondary
    data.to_netcdf(tmp_path / "signal.nc")
    with xr.open_dataset(tmp_path / "signal.nc") as stored:
        assert hl.amplitude_ratio(stored, 7).item() == hl.amplitude_ratio(data, 7).item()


def test_the_baseline(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", rows(offset=0.25))
    for baseline, expected in (("lead", 3.0), (50e-6, 3.0), (0, 3.25)):
        data = read_signal(path, {7: 1}, calibration=1.0, baseline=baseline)
        assert hl.reflections(data, 7).incident.amplitude == pytest.approx(expected, rel=1e-3)
    late = write(tmp_path / "late.csv", rows(offset=0.25)[205:])
    with pytest.raises(
        ValueError, match=r"late\.csv: sensor 7, baseline = 'lead': has no quiet lead .*; the record lasts 794 µs"
    ):
        read_signal(late, {7: 1}, calibration=1.0)


def test_wave_speed_needs_positions(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", rows())
    data = read_signal(path, {7: 1, 16: 2}, calibration=1.0, positions={7: 0.062, 16: 0.092})
    assert hl.wave_speed(data, 7, 16) == pytest.approx(0.03 / 5e-5, rel=1e-4)
    with pytest.raises(ValueError, match="run: holds no positions of its sensors"):
        hl.wave_speed(read_signal(path, {7: 1, 16: 2}, calibration=1.0), 7, 16)


def test_a_signal_that_is_no_file(tmp_path: Path) -> None:
    """Missing, a folder, an address; a pipe that nobody writes to, a link to itself, messages of the system."""
    os.mkfifo(tmp_path / "pipe")
    for name, target in (("loop", "loop"), ("messages", "/proc/kmsg")):
        (tmp_path / name).symlink_to(target)
    no_files = dict.fromkeys(("pipe", "loop", "messages"), "is not a regular file")
    for name, said in {"none.csv": "there is no such file", "": "is a folder", **no_files}.items():
        with pytest.raises(ValueError, match=f"path = '{tmp_path / name}': {said}"):
            read_signal(tmp_path / name, {7: 1}, calibration=20.0)
    with pytest.raises(ValueError, match="there is no such file"):
        read_signal("https://example.com/scope.csv", {7: 1}, calibration=20.0)


def test_a_file_for_each_sensor(tmp_path: Path) -> None:
    """The second one begins 30 samples later; what both hold is read."""
    one = write(tmp_path / "C1.csv", [*HEADER[:-1], "TIME,CH1", *(line.rpartition(",")[0] for line in rows())])
    other = write(tmp_path / "C2.csv", ["time (s);a (mV);b (mV)", *(line.replace(",", ";") for line in rows()[30:])])
    columns = {7: 1, 16: 2}
    both = read_signal(write(tmp_path / "both.csv", [*HEADER, *rows()]), columns, calibration=20.0)
    read = read_signal({7: one, 16: other}, columns, calibration={7: 20.0, 16: 2e4})
    xr.testing.assert_allclose(read.sensor_force, both.sensor_force.isel(time=slice(30, None)), atol=1e-6)
    assert "begin up to 30 µs apart; the 969 µs that all hold are read" in read.reading
    for path, message in (
        ({7: one}, "must hold a file for each of sensors 7, 16"),
        ({7: one, 16: 2}, r"path\[16\] = 2: must be the name of a file"),
        ([one, other], r"must be one file, or \{sensor: file\} .*; for taps, average_taps"),
    ):
        with pytest.raises(ValueError, match=message):
            read_signal(path, columns, calibration=1.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sensors": {}}, "sensors = {}"),
        ({"sensors": [7]}, r"sensors = \[7\]: must be a mapping"),
        ({"sensors": {0: 1}}, "sensor = 0"),
        ({"sensors": {7: -1}}, r"sensors\[7\] = -1"),
        ({"sensors": {7: 0}, "interval": 1e-6}, "^sensors: .* column 0 increases .*, as a time does: are the columns"),
        ({"sensors": {7: 0}}, "column 0 increases from line to line, .*: are the columns swapped"),
        ({"sensors": {7: 0}, "time_column": 0}, "column 0 is the time column"),
        ({"sensors": {7: 1, 8: 1}}, "two of them read the same column"),
        ({"sensors": {7: 9}}, r"sensors: .* has no column 9; its columns are 0 to "),
        ({"time_unit": "mV"}, "time_unit = 'mV': must be a unit of a time"),
        ({"unit": "pC"}, "unit = 'pC': must be a unit of a voltage or a force"),
        ({"unit": 1.0}, "unit = 1.0: must be a text"),
        ({"interval": 0.0}, "interval = 0.0: must be a positive number"),
        ({"interval": 1e-6, "time_column": 0}, "interval = 1e-06: is for a file without times"),
        ({"start": "x"}, "start = 'x': must be a finite number"),
        ({"skip": -1}, "skip = -1"),
        ({"unit": "N"}, "calibration = 20.0: must be left out"),
        ({"calibration": None}, "calibration = None: give a number of N/V for sensor 7"),
        ({"calibration": 0.0}, "calibration = 0.0"),
        ({"calibration": {8: 2.0}}, "give a number of N/V for sensor 7"),
        ({"baseline": "start"}, "baseline = 'start'"),
        ({"baseline": -1.0}, "baseline = -1.0"),
        ({"baseline": 1.0}, "baseline = 1.0: must be shorter"),
        ({"positions": {8: 0.1}}, "for each of the sensors 7, which increases"),
        ({"positions": {7: np.nan}}, r"positions\[7\] = nan"),
    ],
)
def test_bad_arguments(tmp_path: Path, change: dict, message: str) -> None:
    path = write(tmp_path / "scope.csv", [*HEADER, *rows()])
    with pytest.raises(ValueError, match=message):
        read_signal(path, **({"sensors": {7: 1}, "calibration": 20.0} | change))


def test_bad_arrays() -> None:
    time = 1e-6 * np.arange(1000)
    force = pulses(time, (3.0, 2e-4))
    gap = np.where(time > 5e-4, time + 1e-6, time)
    for bad_time, forces, message in (
        (time, {7: force[1:]}, r"forces\[7\]: holds 999 numbers, must be as many as time, 1000"),
        (time, {7: force * 0.0}, "sensor 7: the signal is constant"),
        (time, {7: np.where(time > 5e-4, np.nan, force)}, r"forces\[7\]\[501\] = nan"),
        (gap, {7: force}, "sample 501: .* a gap"),
        (time[::-1], {7: force}, "sample 1: .* must increase"),
        (time, force, "must be a mapping"),
        (time[:15], {7: force[:15]}, "at least 16"),
    ):
        with pytest.raises(ValueError, match=message):
            as_signal(bad_time, forces)


def test_the_first_wave_of_a_train_is_the_incident_one() -> None:
    """A heavy striker: 145 N, 122 N, 109 N … pile up to 270 N at the wall, and stay apart."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 20, hl.Sphere(20e-3, hl.STEEL_440C), 0.44)
    data = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=2e-3)
    found = hl.reflections(as_signal(data.time, {7: hl.sensor_force(data, 7)}), 7)
    assert found.incident.amplitude == pytest.approx(hl.reflections(data, 7).incident.amplitude, rel=1e-3)
    assert found.primary.time_of_flight == pytest.approx(42.2e-6, abs=0.5e-6)


@pytest.mark.thorough
@pytest.mark.parametrize(("radius", "wall"), [(2.38e-3, "steel"), (4.76e-3, "steel"), (4.76e-3, "soft")])
def test_noise_moves_little(radius: float, wall: str) -> None:
    """White noise of 2 % of the incident peak, 100 draws at 10 MHz: AR scatters by less than 0.006, TOF by less than
    0.4 µs, and both are on average the run's within half of their scatter."""
    data = run(radius, wall)
    expected, force = hl.reflections(data, 7), hl.sensor_force(data, 7).values
    noise = 0.02 * expected.incident.amplitude * np.random.default_rng(7).standard_normal((100, force.size))
    shots = xr.concat([as_signal(data.time, {7: force + one}) for one in noise], "shot")
    for measure, truth, most in (
        (hl.amplitude_ratio, expected.primary.amplitude_ratio, 0.006),
        (hl.time_of_flight, expected.primary.time_of_flight, 0.4e-6),
    ):
        errors = measure(shots, 7).values - truth
        assert errors.std() < most
        assert abs(errors.mean()) < 0.5 * errors.std()


@pytest.mark.thorough
def test_noise_makes_no_waves() -> None:
    """The incident wave of the steel run alone, then noise alone: nothing comes back that was not there."""
    data = run().sel(time=slice(None, 4e-4))
    force = hl.sensor_force(data, 7).values
    rng = np.random.default_rng(3)
    for level in (0.005, 0.02, 0.05, 0.1):
        for _ in range(50):
            waves = hl.reflections(as_signal(data.time, {7: force + level * 46.0 * rng.standard_normal(force.size)}), 7)
            assert waves.incident
            assert not waves.primary
    for _ in range(50):
        assert not any(hl.reflections(as_signal(data.time, {7: rng.standard_normal(force.size)}), 7))


def test_a_digitiser_of_eight_bits_keeps_the_waves() -> None:
    data = run(dashpot=0.0)
    force = hl.sensor_force(data, 7).values
    step = 1.2 * force.max() / 256.0
    waves = hl.reflections(as_signal(data.time, {7: np.round(force / step) * step}), 7)
    expected = hl.reflections(data, 7)
    assert waves.primary.amplitude_ratio == pytest.approx(expected.primary.amplitude_ratio, abs=5e-3)
    assert waves.primary.time_of_flight == pytest.approx(expected.primary.time_of_flight, abs=5e-7)
    assert bool(waves.secondary) == bool(expected.secondary)


@pytest.mark.parametrize(("radius", "sensors"), [(4.76e-3, (7, 8)), (2.38e-3, (7, 9))])
def test_a_run_that_is_read_as_a_signal_keeps_its_ratios_and_flights(radius: float, sensors: tuple[int, ...]) -> None:
    """Small waves between beads that have drifted apart are two collisions; both readings take the higher peak.

    A run read the middle between the two: 703.35 µs at bead 7 of the larger spheres, a signal the peak, 724.83 µs.
    """
    bead, until = hl.Sphere(radius, hl.STEEL_440C), 1.2e-3
    plate = hl.kirchhoff_plate(0.2, 0.15, 2e-3, hl.ALUMINIUM_6061, hl.Supports(*["clamped"] * 4))
    chain = hl.Chain([bead] * 14, bead, impact_speed=0.4)
    found = hl.CoSimulation(chain, hl.reduce(plate.at(0.06, 0.07), until)).run(until)
    for sensor in sensors:
        force = hl.sensor_force(found, sensor)
        read = as_signal(found.time, {sensor: force})
        for wave in ("primary", "secondary"):
            ratio, flight = (measure(found, sensor, wave).item() for measure in (hl.amplitude_ratio, hl.time_of_flight))
            assert hl.amplitude_ratio(read, sensor, wave).item() == pytest.approx(ratio, abs=1e-5)
            assert hl.time_of_flight(read, sensor, wave).item() == pytest.approx(flight, abs=5e-8)
            arrival = flight + hl.reflections(found, sensor).incident.arrival
            near = force.sel(time=slice(arrival - 20e-6, arrival + 20e-6))
            assert abs(float(near.idxmax()) - arrival) <= 1.01 * float(found.time[1])
    if radius == 4.76e-3:
        assert hl.time_of_flight(found, 7).item() == pytest.approx(724.7e-6, abs=5e-7)
