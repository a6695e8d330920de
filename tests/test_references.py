"""hl.testing: differences are found and reported, and only differences."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from hertzlink.testing import assert_same_waves

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)


def tap(speed: float = 0.3, count: int = 12, **given: Any) -> xr.Dataset:
    chain = hl.Chain([BEAD] * count, BEAD, impact_speed=speed)
    return hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C), **given).run(until=4e-4)


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    return tap()


@pytest.fixture
def reference(run: xr.Dataset, tmp_path: Path) -> Path:
    path = tmp_path / "wall.nc"
    assert_same_waves(run, path, sensors=[6, 7], update=True)
    return path


def complaint(run: xr.Dataset, reference: Path, **given: Any) -> str:
    with pytest.raises(AssertionError) as caught:
        assert_same_waves(run, reference, **given)
    return str(caught.value)


def test_the_same_run_agrees_to_the_bit(run: xr.Dataset, reference: Path) -> None:
    assert_same_waves(run, reference, rtol=0.0)
    assert_same_waves(tap(), reference, rtol=0.0)


def test_another_speed_is_found_with_its_numbers_and_its_input(run: xr.Dataset, reference: Path) -> None:
    """Contact forces of a chain without preload scale with the speed to the power of 6/5, and the time with −1/5."""
    factor = 1.01
    faster = tap(0.3 * factor)
    said = complaint(faster, reference)
    assert "chain.impact_speed = 0.3 there and 0.303 here" in said
    assert "versions: the same" in said
    (there, here), (force, _) = (
        map(float, re.findall(rf"{name}: (\S+) .*? there and (\S+) .*? here", said)[0])
        for name in ("TOF at bead 6, primary wave", "force at bead 6")
    )
    assert there == pytest.approx(1e6 * float(hl.time_of_flight(run, 6)), rel=1e-6)
    assert here / there == pytest.approx(factor**-0.2, abs=2e-5)
    assert force == pytest.approx(np.sqrt(np.mean(hl.sensor_force(run, 6).values ** 2)), rel=1e-6)
    assert "quantities agree" in said  # AR hardly depends on the speed
    assert_same_waves(faster, reference, rtol=0.3)


def test_a_trace_of_the_same_norm_is_not_the_same(run: xr.Dataset, reference: Path) -> None:
    turned = run.assign(contact_force=run.contact_force.isel(time=slice(None, None, -1)).assign_coords(time=run.time))
    assert "force at the last contact" in complaint(turned, reference)


def test_a_wave_that_is_missing_is_a_difference(run: xr.Dataset, tmp_path: Path) -> None:
    """A cut record has no reflected wave; the length of the record is named as well."""
    assert_same_waves(run, tmp_path / "whole.nc", sensors=[6], update=True)
    with pytest.warns(hl.HertzlinkWarning):
        said = complaint(run.isel(time=slice(0, run.time.size // 2)), tmp_path / "whole.nc")
    assert "no wave" in said
    assert "the record ends at 400 µs there and 199" in said


def test_other_saved_times_are_interpolated(run: xr.Dataset, reference: Path) -> None:
    """A cubic spline through every second sample differs by less than 1e-4 of the trace; the message says so."""
    sparse = run.isel(time=slice(0, None, 2))
    assert_same_waves(sparse, reference, rtol=1e-3)
    assert "forces are interpolated" in complaint(sparse, reference, rtol=1e-12)


def test_a_sweep_reports_its_worst_run(tmp_path: Path) -> None:
    chain = hl.Chain([BEAD] * 12, BEAD, impact_speed=0.3)

    def build(modulus: float) -> hl.CoSimulation:
        return hl.CoSimulation(chain, hl.half_space(hl.Material(modulus, 0.3, 7800.0)))

    first = hl.sweep(build, until=4e-4, jobs=1, modulus=[2e11, 1e11])
    path = tmp_path / "sweep.nc"
    assert_same_waves(first, path, sensors=[6], update=True)
    assert_same_waves(first, path, rtol=0.0)
    second = first.copy(deep=True)
    second.contact_force[{"modulus": 1}] *= 1.1
    assert "force at bead 6 at modulus = 100000000000.0" in complaint(second, path)
    said = complaint(first.isel(modulus=[0]), path)
    assert "modulus = [200000000000.0, 100000000000.0] there and [200000000000.0] here" in said


def test_a_signal_and_its_sensors(tmp_path: Path) -> None:
    time = np.linspace(0.0, 4e-4, 801)
    force = np.exp(-(((time - 1e-4) / 1e-5) ** 2)) + 0.5 * np.exp(-(((time - 3e-4) / 1e-5) ** 2))
    signal = hl.as_signal(time, {3: force, 5: 2.0 * force})
    assert_same_waves(signal, tmp_path / "signal.nc", update=True)
    assert_same_waves(signal, tmp_path / "signal.nc", rtol=0.0)
    weaker = hl.as_signal(time, {3: force, 5: 2.1 * force})
    said = complaint(weaker, tmp_path / "signal.nc")
    assert "force at bead 5" in said
    assert "force at bead 3" not in said
    assert "9 of 10 quantities agree" in said


def test_the_message_names_another_version(run: xr.Dataset, reference: Path) -> None:
    with xr.open_dataset(reference, engine="h5netcdf") as file:
        old = file.load()
    there = json.loads(old.attrs["versions"]) | {"hertzlink": "0.0.7", "numpy": "1.0"}
    old.attrs |= {"hertzlink": "0.0.7", "versions": json.dumps(there)}
    old.to_netcdf(reference, engine="h5netcdf")
    assert_same_waves(run, reference)
    said = complaint(tap(0.31), reference)
    assert f"hertzlink 0.0.7 wrote the reference; this is {hl.__version__}" in said
    assert f"numpy = '1.0' there and '{np.__version__}' here" in said


def test_references_of_the_same_run_are_the_same_bytes(run: xr.Dataset, reference: Path) -> None:
    before = reference.read_bytes()
    assert_same_waves(run, reference, sensors=[6, 7], update=True)
    assert reference.read_bytes() == before
    assert [path.name for path in reference.parent.iterdir()] == [reference.name]


def test_a_write_that_fails_leaves_the_reference(
    run: xr.Dataset, reference: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    before = reference.read_bytes()
    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OSError, match="No space left"):
        assert_same_waves(run, reference, update=True)
    assert reference.read_bytes() == before
    assert [path.name for path in reference.parent.iterdir()] == [reference.name]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"rtol": -1.0}, "rtol = -1.0: must be zero or a positive number"),
        ({"sensors": 7}, "sensors = 7: must be a list"),
        ({"sensors": [99]}, "sensor = 99: must be a bead from 1 to 12"),
        ({"update": "yes"}, "update = 'yes': must be True, False or None"),
        ({"reference": "nowhere.nc"}, r"nowhere\.nc does not exist; write it with update=True"),
        ({"run": 3}, "run = 3: must be the Dataset"),
    ],
)
def test_wrong_arguments_are_named(run: xr.Dataset, reference: Path, given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        assert_same_waves(**({"run": run, "reference": reference} | given))


def test_what_is_no_reference_is_refused(run: xr.Dataset, tmp_path: Path) -> None:
    (tmp_path / "text.nc").write_text("no netCDF")
    with pytest.raises(ValueError, match="is not an HDF5 file"):
        assert_same_waves(run, tmp_path / "text.nc")
    run.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    with pytest.raises(ValueError, match="was not written by assert_same_waves"):
        assert_same_waves(run, tmp_path / "run.nc")


def test_the_lines_of_the_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (Path(__file__).parent.parent / "docs" / "python.md").read_text(encoding="utf-8")
    (in_pytest,) = re.findall(r"^```python\n((?:(?!```).)*?def test_wall.*?)^```", page, re.DOTALL | re.MULTILINE)
    bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    test: dict[str, Any] = {"hl": hl, "bead": bead, "__file__": str(tmp_path / "own" / "test_wall.py")}
    exec(in_pytest, test)
    with pytest.raises(ValueError, match="does not exist; write it with update=True, or with HERTZLINK_UPDATE"):
        test["test_wall"]()
    monkeypatch.setenv("HERTZLINK_UPDATE_REFERENCES", "1")
    test["test_wall"]()
    monkeypatch.delenv("HERTZLINK_UPDATE_REFERENCES")
    test["test_wall"]()
