"""Maps of taps: tables, AR and TOF of pulses of known heights and times, failures, interrupted maps, pictures."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.signal
import xarray as xr
from independent.traces import Case, trace
from independent.walls import EdgedPlate

import hertzlink as hl
from coupling.inference.identification import Identification
from coupling.inference.tap_maps import _mean_of_taps, measured_waves, read_grid
from coupling.plots.mapped import MARKS

STEP = 0.01
"""Of a digitiser of 8 bits over 2.56 V."""


def pulses(file: Path, ratio: float, flight: float, seed: int, noise: float = 0.004) -> None:
    """Write two Gaussian pulses at 2 MHz, 8 bits, with noise: AR and TOF are what they were made of."""
    time = np.arange(0.0, 7e-4, 0.5e-6)
    volts = sum(size * np.exp(-(((time - at) / 1.5e-5) ** 2)) for size, at in ((1.0, 2e-4), (ratio, 2e-4 + flight)))
    volts = np.round((volts + np.random.default_rng(seed).normal(0.0, noise, time.size)) / STEP) * STEP
    rows = "\n".join(f"{t:.7f},{v:.2f}" for t, v in zip(time, volts, strict=True))
    file.write_text(f"time (s),force (V)\n{rows}\n")


def read(file: Path) -> xr.Dataset:
    return hl.read_signal(file, {7: 1}, calibration=25.0)


def test_a_broken_file_costs_no_other_point(tmp_path: Path) -> None:
    for name in ("a", "b"):
        pulses(tmp_path / f"{name}.csv", 0.5, 3e-4, 1)
    (tmp_path / "flat.csv").write_text("time (s),force (V)\n" + "\n".join(f"{1e-6 * k},0.1" for k in range(999)))
    for name in ("lost", "gone"):
        (tmp_path / f"{name}.csv").touch()
    table = "x / mm, y / mm, file\n0, 0, a.csv\n5, 0, lost.csv\n10, 0, b.csv\n10, 0, gone.csv\n15, 0, flat.csv\n"
    (tmp_path / "points.csv").write_text(table)
    with pytest.warns(hl.HertzlinkWarning, match=r"failed: x = 5 mm, y = 0 mm: .*lost\.csv: holds 0 lines"):
        taps = hl.map_taps(tmp_path / "points.csv", read, jobs=1)
    assert [bool(error) for error in taps.error.values] == [False, True, False, True]
    assert "constant" in str(taps.error.values[3])
    assert taps.verdict.values[:, 0].tolist() == ["measured", "failed", "measured", "failed"]
    assert taps.taps.values.tolist() == [1, 0, 1, 0]
    assert np.isnan(taps.value.values[1]).all()
    assert any("tap left out" in line and "gone.csv" in line for line in taps.warnings.splitlines())
    axes = hl.plots.mapped(taps)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["failed"]
    squares, crosses = axes.collections
    assert len(squares.get_paths()) == 2
    half = hl.plots.mapped(taps, show="error").collections[0].get_array()
    assert [*half] == pytest.approx(((taps.high - taps.low) / 2.0).values[[0, 2], 0])
    assert np.asarray(crosses.get_offsets()).tolist() == [[5.0, 0.0], [15.0, 0.0]]
    assert set(MARKS) >= {"failed", "blind"}


@pytest.mark.thorough
def test_ar_and_tof_of_pulses_are_inside_their_intervals(tmp_path: Path) -> None:
    """24 points of single taps, 8 of 3 taps: of 95 % intervals at least 80 % hold the truth (p < 1e-4 and 0.01)."""
    rows = ["x / mm, y / mm, file"]
    truth = []
    for k in range(32):
        ratio, flight = 0.3 + 0.005 * k, 3e-4 + 1e-6 * k
        truth.append((ratio, flight))
        for tap in range(1 if k < 24 else 3):
            pulses(tmp_path / f"{k}-{tap}.csv", ratio, flight, 10 * k + tap)
            rows.append(f"{5 * (k % 10)}, {10 * (k // 10)}, {k}-{tap}.csv")
    (tmp_path / "points.csv").write_text("\n".join(rows))
    taps = hl.map_taps(tmp_path, read, jobs=1)
    assert taps.taps.values.tolist() == [1] * 24 + [3] * 8
    assert taps.x.values[:3].tolist() == [0.0, 0.005, 0.01]
    inside = (taps.low.values < truth) & (truth < taps.high.values)
    assert inside[:24].mean() > 0.8
    assert inside[24:].mean() > 0.8
    half = (taps.high - taps.low).values / 2.0
    assert half[:24, 0].max() < 0.01
    assert half[:24, 1].max() < 1e-6


def test_intervals_hold_ar_and_tof_of_asymmetric_pulses() -> None:
    """The pulse from a plate rises and falls unequally. Noise of 0.5 %, 2 MHz: of four intervals three or more hold
    AR, and as many TOF; a fit over a wider part of the pulse put TOF 1.4 µs too low, outside all of them."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    plate = hl.half_plane(4e-3, hl.ALUMINIUM_6061, "clamped", 20e-3, until=6e-4)
    run = hl.CoSimulation(hl.Chain([bead] * 14, bead, 0.31), plate).run(6e-4, save_every=0.5e-6)
    force, primary = hl.sensor_force(run, 5).values, hl.reflections(run, 5).primary
    noise = 0.005 * force.max() * np.random.default_rng(7).standard_normal((4, force.size))
    read = [measured_waves(hl.as_signal(run.time, {5: force + one}), {}) for one in noise]
    for k, truth in enumerate((primary.amplitude_ratio, primary.time_of_flight)):
        assert sum(float(one.low[k]) < truth < float(one.high[k]) for one in read) >= 3


def test_intervals_are_as_wide_as_correlated_noise_scatters() -> None:
    time = np.arange(0.0, 7e-4, 0.5e-6)
    clean = sum(size * np.exp(-(((time - at) / 1.5e-5) ** 2)) for size, at in ((40.0, 2e-4), (20.0, 5e-4)))
    noise = scipy.signal.lfilter([0.1], [1.0, -0.9], np.random.default_rng(2).normal(size=(40, time.size)))
    read = [measured_waves(hl.as_signal(time, {5: clean + one}), {}) for one in noise]
    half = np.mean([0.5 * (one.high - one.low).values[0] for one in read])
    assert 0.6 < half / 1.96 / np.std([one.value.values[0] for one in read]) < 1.5


def read_and_note(file: Path) -> xr.Dataset:
    with (file.parent / "asked").open("a") as notes:
        notes.write(f"{file.name}\n")
    return read(file)


def test_a_map_that_is_repeated_reads_what_is_new_or_failed(tmp_path: Path) -> None:
    pulses(tmp_path / "a.csv", 0.5, 3e-4, 1)
    points = [{"x": 0.01 * k, "y": 0.0, "files": [tmp_path / name]} for k, name in enumerate(("a.csv", "b.csv"))]
    with pytest.warns(hl.HertzlinkWarning, match="failed"):
        hl.map_taps(points, read_and_note, jobs=1, store=tmp_path / "kept")
    pulses(tmp_path / "b.csv", 0.6, 3e-4, 2)
    taps = hl.map_taps(points, read_and_note, jobs=1, store=tmp_path / "kept")
    assert (tmp_path / "asked").read_text().split() == ["a.csv", "b.csv"]
    assert taps.value.values[:, 0] == pytest.approx([0.5, 0.6], abs=0.01)
    # A file that was written again is read again.
    pulses(tmp_path / "a.csv", 0.4, 3e-4, 3)
    taps = hl.map_taps(points, read_and_note, jobs=1, store=tmp_path / "kept")
    assert (tmp_path / "asked").read_text().split() == ["a.csv", "b.csv", "a.csv"]
    assert taps.value.values[:, 0] == pytest.approx([0.4, 0.6], abs=0.01)


def test_columns_of_a_table_come_with_the_point(tmp_path: Path) -> None:
    """A table of a German spreadsheet; x sets an entry, too."""
    (tmp_path / "a,1.csv").touch()
    (tmp_path / "t.csv").write_text(
        "\ufeffx = structure.distance / mm;y (cm);file;chain.impact_speed / (mm/s);by\n1,5;2;a,1.csv;310;Eva\n", "utf-8"
    )
    grid = read_grid(tmp_path / "t.csv")
    assert grid.units == ("mm", "cm")
    point: Mapping[str, Any] = grid.points[0]
    numbers = {name: value for name, value in point.items() if isinstance(value, float)}
    assert numbers == pytest.approx({"x": 1.5e-3, "structure.distance": 1.5e-3, "y": 0.02, "chain.impact_speed": 0.31})
    assert (point["by"], point["files"]) == ("Eva", [str(tmp_path / "a,1.csv")])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", 'has no columns; must have one column "x", as in x / mm, y / mm, file'),
        ("x / mm, file\n", 'has the columns x, file; must have one column "y", as in x / mm, y / mm, file'),
        ("x, y / mm, file\n0, 0, a\n", "column x has no unit; write one of length: x / mm"),
        ("x / mm, y / mm, file\n0, 0, b\n", ":2: file: b: there is no such file"),
        ("x / mV, y / mm, file\n0, 0, a\n", 'column x has the unit "mV"'),
        ("x / mm, y / mm, file\n0, zero, a\n", r":2: column y: 'zero' is not a number with the unit mm"),
        ("x / mm, y / mm, file\n0, 0\n", ":2: names no file"),
        ("x / mm, y / mm, file\n0, 0, a, 5\n", ":2: 4 entries for 3 columns; decimal commas need semicolons"),
        ("x / mm, y / mm, file\n0, 0, a\n0, 0, a\n", ":3: names 'a' again, as line 2 does"),
        ("x / mm, y / mm, file\n", "has no points below its head"),
        ("x / mm, y / mm, file\n0, 0, ../a.csv\n", ":2: '../a.csv' is not in the table's folder; move it there"),
        ("x / mm, y / mm, file, d / mm\n0, 0, a, far\n", ":2: column d: 'far' is not a number with the unit mm"),
    ],
)
def test_a_table_is_refused_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "points.csv").write_text(text)
    (tmp_path / "a").touch()
    with pytest.raises(ValueError, match=message):
        read_grid(tmp_path)
    with pytest.raises(ValueError, match="there is no such file"):
        read_grid(tmp_path / "other.csv")


def record(file: Path, wall: EdgedPlate, seed: int) -> None:
    """Write an independent trace as a scope would: 2 MHz, 8 bits, 45 ms before the impact, hum of 2 % of the peak."""
    random = np.random.default_rng(seed)
    moments, forces = trace(Case(wall, until=1.3e-3), (7,), random.uniform(0.28, 0.34), sample_every=0.5e-6)
    time = np.arange(-0.045, 1.2e-3, 0.5e-6)
    force = np.interp(time - 0.5e-6 * random.uniform(), moments, forces[7], left=0.0)
    volts = force / force.max() + 0.02 * np.sin(2.0 * np.pi * 50.0 * time + random.uniform(0.0, 6.0))
    volts = np.round((volts + random.normal(0.0, 0.004, time.size)) / STEP) * STEP
    np.savetxt(file, np.column_stack([time, volts]), "%.7f", ",", header="time (s),force (V)", comments="")


@pytest.mark.thorough
def test_a_grid_near_an_edge_is_mapped_from_independent_traces(tmp_path: Path) -> None:
    """Thickness and distance at two points that differ in both, in files of 8 bits and 2 MHz with hum."""
    rows, truth = ["x / mm, y / mm, file"], []
    for k, (distance, thickness) in enumerate([(20e-3, 3e-3), (35e-3, 2.5e-3)]):
        record(tmp_path / f"{k}.csv", EdgedPlate(thickness, distance), k)
        rows.append(f"{1e3 * distance:g}, {20 * k}, {k}.csv")
        truth.append((thickness, distance))
    (tmp_path / "points.csv").write_text("\n".join(rows))
    ranges = {"thickness": (2e-3, 4e-3), "distance": (10e-3, 50e-3), "impact_speed": (0.2, 0.5)}
    bead = hl.Sphere(4.765e-3, hl.STEEL_440C)
    elastic = replace(hl.ALUMINIUM_6061, yield_strength=None)

    def build(thickness: float, distance: float, impact_speed: float) -> hl.CoSimulation:
        plate = hl.half_plane(thickness, elastic, "clamped", distance, 1.3e-3)
        return hl.CoSimulation(hl.Chain([bead] * 20, bead, impact_speed), plate)

    def answer(signal: xr.Dataset, point: Mapping[str, Any]) -> Identification:
        guess = {"thickness": 2.75e-3, "distance": point["x"] + 1e-3, "impact_speed": 0.3}
        return hl.identify(signal, build, ["impact_speed", "gain", "time_zero"], until=1.15e-3, guess=guess, **ranges)

    taps = hl.map_taps(tmp_path, lambda file: hl.clean_signal(read(file), 50.0).drop_vars("noise"), answer, jobs=1)
    both = taps.sel(unknown=["thickness", "distance"])
    assert set(both.verdict.values.ravel()) == {"identified"}
    slack = (both.high - both.low).values / 2.0  # four standard deviations in all
    assert ((both.low.values - slack < truth) & (truth < both.high.values + slack)).all()
    assert (slack < 0.05 * np.array(truth)).all()


@pytest.mark.parametrize(
    ("values", "half", "expected"),
    [
        # Equal intervals that overlap: the mean, and 1/√2 of the interval.
        ((1.0, 1.1), 0.2, (1.05, 0.2 / 2**0.5)),
        # Apart: Student's interval of two values, 12.706 · s/√2 with s = 1/√2.
        ((1.0, 2.0), 0.2, (1.5, 12.7062 * 0.5)),
    ],
)
def test_taps_of_a_point_that_disagree_have_the_interval_of_student(
    values: tuple[float, float], half: float, expected: tuple[float, float]
) -> None:
    columns = [{"value": value, "low": value - half, "high": value + half, "verdict": "identified"} for value in values]
    taps = [
        xr.Dataset({name: ("unknown", [one]) for name, one in c.items()}, {"unknown": ["d"]}, {"fits": int(values[1])})
        for c in columns
    ]
    data, findings = _mean_of_taps(taps)
    assert float(data.value[0]) == pytest.approx(expected[0])
    assert float(data.high[0] - data.low[0]) / 2.0 == pytest.approx(expected[1], rel=1e-4)
    assert bool(findings) == (data.attrs["fits"] == 2) == (values[1] == 2.0)
