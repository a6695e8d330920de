"""Motion of struck bodies: the contact of the run, bars in theory, full and reduced structures, wrong input."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import simpson

import hertzlink as hl
from coupling.plots.motion import known_motion
from structures.structure import known_field

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 6, BEAD, hl.drop_speed(0.01), gravity=9.81)
LAYER = hl.Layer(hl.STEEL_440C, 25.4e-3, 9.53e-3)
UNTIL = 3e-4
FULL = hl.layered_cylinder([LAYER])
BODY = hl.reduce(FULL, until=UNTIL, tolerance=1e-3, keep_field=True)


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    return hl.CoSimulation(CHAIN, BODY).run(UNTIL)


def peak_time(run: xr.Dataset) -> float:
    return float(run.time[int(run.contact_force.isel(contact=-1).values.argmax())])


def patch_mean(motion: xr.Dataset, patch: float) -> np.ndarray:
    """Mean sinking of the patch at each time, m: Simpson's rule on the nodes of quadratic cells."""
    r, _, z = motion.position.values.T
    number = np.flatnonzero((z == 0.0) & (r <= patch * (1.0 + 1e-9)))
    number = number[np.argsort(r[number])]
    return np.asarray(simpson(-2.0 * r[number] * motion.displacement.values[:, number, 2], x=r[number]) / patch**2)


def test_the_patch_sinks_as_the_runs_contact(run: xr.Dataset) -> None:
    """It agrees within 0.1 % at every time, recomputed by the reduced and by the full structure, which agree."""
    times = peak_time(run) + np.arange(-40e-6, 30e-6, 10e-6)
    full, reduced = (hl.plots.motion(run, structure, times) for structure in (FULL, BODY))
    for motion, tolerance in ((reduced, 1e-3), (full, 2e-3)):
        assert motion.attrs["contact_error"] < tolerance
        expected = run.surface_displacement.sel(time=motion.time).values
        greatest = float(abs(run.surface_displacement).max())
        assert patch_mean(motion, BODY.origin["patch_radius"]) == pytest.approx(expected, abs=tolerance * greatest)
    for name in ("displacement", "von_mises"):
        assert abs(full[name] - reduced[name]).max() < 5e-3 * abs(full[name]).max()


def test_wave_in_a_slender_bar() -> None:
    """F(t − x/c)/A passes the middle of a bar, c = √(E/ρ): the mean axial stress is von Mises' there."""
    layer = hl.Layer(hl.STEEL_440C, 0.3, 5e-3)
    bar = hl.reduce(hl.layered_cylinder([layer]), until=3e-4, tolerance=1e-3, keep_field=True)
    run = hl.CoSimulation(CHAIN, bar).run(3e-4)
    force = run.contact_force.isel(contact=-1) - run.static_force.isel(contact=-1)
    z = known_field(bar).grid.points[:, 2]
    depth = -float(z[np.argmin(abs(z + 0.12))])
    times = peak_time(run) + depth / layer.material.bar_speed + np.arange(-15e-6, 16e-6, 5e-6)
    motion = hl.plots.motion(run, bar, times)
    found = motion.von_mises.values[:, np.isclose(z, -depth)].mean(axis=1)
    expected = force.interp(time=motion.time - depth / layer.material.bar_speed).values / layer.area
    assert found == pytest.approx(expected, abs=0.03 * expected.max())


def test_dataset_tells_all_and_goes_to_netcdf(run: xr.Dataset, tmp_path: Path) -> None:
    motion = hl.plots.motion(run, BODY, [0.0, 1e-4])
    assert motion.displacement.dims == ("time", "point", "component")
    assert motion.von_mises.dims == ("time", "point")
    assert (motion.displacement[0] == 0.0).all()
    assert motion.displacement.attrs["units"] == "m"
    assert motion.von_mises.attrs["units"] == "Pa"
    assert motion.attrs["input"] == run.attrs["input"]
    assert float(motion.time[1]) == pytest.approx(1e-4, abs=float(run.time[1]))
    motion.to_netcdf(tmp_path / "motion.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "motion.nc", engine="h5netcdf") as again:
        known_motion(again)
        assert again.drop_attrs().equals(motion.drop_attrs())


@pytest.mark.parametrize(
    ("times", "message"),
    [
        ([], r"times = \[\]: must be in the run"), ("now", "times = 'now': must be a number"),
        ([-1e-5], r"must be in the run, between 0 and 0\.0003 s"), ([2e-4, 4e-4], "must be in the run"),
    ],
)  # fmt: skip
def test_times_that_cannot_be_told(run: xr.Dataset, times: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.plots.motion(run, BODY, times)


def test_runs_of_another_kind(run: xr.Dataset) -> None:
    signal = hl.as_signal(np.arange(2000) * 1e-7, {3: np.exp(-(((np.arange(2000) - 900) / 90.0) ** 2))})
    two_runs = xr.concat([run, run], dim="speed")
    for wrong, message in (
        (signal, "holds no contact_force and surface_displacement"),
        (two_runs, r"has the axes speed; choose one run with run\.isel\(speed=0\)"),
        (run.isel(time=slice(10, None)), "from its start on, with every saved time"),
        (run.isel(time=[0, 1, 3]), "with every saved time"),
        (run.isel(time=[0]), "must be a whole run"),
        ({"time": 0}, "run = .*: must be the Dataset of a run"),
    ):
        with pytest.raises(ValueError, match=message):
            hl.plots.motion(wrong, BODY, [1e-4])  # type: ignore[arg-type]


def test_structures_that_were_not_run(run: xr.Dataset) -> None:
    other = hl.layered_cylinder([hl.Layer(hl.BRASS_360, LAYER.length, LAYER.radius)])
    with pytest.raises(ValueError, match=r"contact moves differently, by .* give the structure that was run"):
        hl.plots.motion(run, other, [peak_time(run)])
    with pytest.raises(ValueError, match="this rod has no field"):
        hl.plots.motion(run, hl.rod([LAYER]), [1e-4])
    with pytest.raises(ValueError, match=r"body: was reduced for runs of at most 0\.0001 s, the run has 0\.0003 s"):
        hl.plots.motion(run, replace(BODY, valid_until=1e-4), [5e-5])


def test_a_run_saved_too_rarely_is_refused() -> None:
    run = hl.CoSimulation(CHAIN, BODY).run(UNTIL, save_every=2.5e-5)
    with pytest.raises(ValueError, match="save the run more often"):
        hl.plots.motion(run, BODY, [UNTIL])
