"""Sweeps: any axes into one Dataset, the same numbers as single runs, in one process or more."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 5, BEAD, 0.3)


def on(material: hl.Material, length: float) -> hl.CoSimulation:
    return hl.CoSimulation(CHAIN, hl.rod([hl.Layer(material, length, 0.01)], elements=4))


def on_half_space(radius: float) -> hl.CoSimulation:
    bead = hl.Sphere(radius, hl.STEEL_440C)
    return hl.CoSimulation(hl.Chain([bead] * 5, bead, 0.3, gravity=9.81), hl.half_space(hl.PTFE))


@pytest.mark.thorough
def test_two_axes_equal_single_runs() -> None:
    axes = {"material": [hl.PTFE, hl.ACRYLIC], "length": [0.02, 0.05, 0.1]}
    runs = hl.sweep(on, until=4e-4, jobs=1, **axes)
    assert dict(runs.sizes) == {"material": 2, "length": 3, "time": runs.sizes["time"], "bead": 6, "contact": 6}
    assert runs.material.values.tolist() == ["PTFE", "acrylic"]
    single = on(hl.ACRYLIC, 0.05).run(until=4e-4)
    point = runs.sel(material="acrylic", length=0.05)
    for name in single.data_vars:
        assert np.array_equal(point[name].values, single[name].values)
    ratio = hl.amplitude_ratio(runs, sensor=3)
    assert ratio.dims == ("material", "length")
    assert ratio.sel(material="acrylic", length=0.05).item() == hl.amplitude_ratio(single, sensor=3).item()


@pytest.mark.thorough
@pytest.mark.usefixtures("cores")
def test_processes_change_nothing() -> None:
    """Their usual number, one for each core, changes nothing either."""
    one, two, usual = (
        hl.sweep(on_half_space, until=4e-4, radius=[2e-3, 3e-3, 4e-3], **jobs)
        for jobs in ({"jobs": 1}, {"jobs": 2}, dict[str, int]())
    )
    assert one.identical(two)
    assert one.identical(usual)


def test_different_beads_share_their_times() -> None:
    """The coarsest sampling is kept, and coordinates that differ get the axis."""
    runs = hl.sweep(on_half_space, until=4e-4, jobs=1, radius=[1e-3, 8e-3])
    large = on_half_space(8e-3).run(until=4e-4)
    assert np.array_equal(runs.time.values, large.time.values)
    assert runs.static_force.dims == ("radius", "contact")
    assert runs.centre.dims == ("radius", "bead")
    assert hl.amplitude_ratio(runs, 3).dims == ("radius",)


def test_measure_keeps_what_it_returns() -> None:
    def ratio(run: xr.Dataset) -> xr.Dataset:
        return xr.Dataset({"ratio": hl.amplitude_ratio(run, 3)})

    runs = hl.sweep(on_half_space, until=4e-4, jobs=1, measure=ratio, radius=[2e-3, 4e-3])
    assert list(runs.data_vars) == ["ratio"]
    assert runs.ratio.dims == ("radius",)


def test_structures_of_every_kind_in_one_sweep() -> None:
    """The energy that a structure's damping takes is reported with its energy."""

    def on_base(base: str) -> hl.CoSimulation:
        return hl.CoSimulation(CHAIN, hl.rod([hl.Layer(hl.PTFE, 0.05, 0.01)], base=base, elements=6))

    runs = hl.sweep(on_base, until=4e-4, jobs=1, base=["fixed", "free", "absorbing"])
    errors = hl.energy_error(runs)
    assert isinstance(errors, xr.DataArray)
    assert (errors < 1e-6).all()
    taken = runs.structure_dissipated_energy.isel(time=-1)
    assert taken.sel(base="absorbing") > 1e-3 * runs.impact_energy
    assert (taken.sel(base=["fixed", "free"]) == 0.0).all()


def of_modes(modes: int) -> hl.CoSimulation:
    return hl.CoSimulation(hl.DeformableChain([BEAD] * 3, BEAD, 0.3, modes=modes), None)


@pytest.mark.thorough
@pytest.mark.parametrize("kept", [False, True])
def test_modes_may_be_an_axis(kept: bool, tmp_path: Path) -> None:
    """Amplitudes of modes that a point does not have are NaN; all others are those of the single run."""
    runs = hl.sweep(of_modes, until=5e-5, jobs=1, store=tmp_path / "store" if kept else None, modes=[1, 2, 5])
    assert runs.vibration_amplitude.dims == ("modes", "time", "bead", "mode")
    assert runs.sizes["mode"] == 4
    assert runs.vibration_amplitude.attrs["units"] == "m √kg"
    for modes in (1, 2, 5):
        point, single = runs.sel(modes=modes), of_modes(modes).run(until=5e-5)
        shared = single.time.values[:: (single.sizes["time"] - 1) // (runs.sizes["time"] - 1)]
        single = single.sel(time=shared)
        amplitude = point.vibration_amplitude.values
        assert np.array_equal(amplitude[..., : modes - 1], single.vibration_amplitude.values)
        assert np.isnan(amplitude[..., modes - 1 :]).all()
        assert np.array_equal(point.contact_force.values, single.contact_force.values)


def of_beads(count: int) -> hl.CoSimulation:
    return hl.CoSimulation(hl.Chain([BEAD] * count, BEAD, 0.3), None)


@pytest.mark.parametrize(
    ("build", "keywords", "message"),
    [
        (on_half_space, {}, "axes: name at least one"),
        (on_half_space, {"radius": []}, "radius = "),
        (on_half_space, {"radius": 3e-3}, r"radius = 0\.003: must be a list"),
        (on_half_space, {"until": -1.0, "radius": [1e-3]}, "until = -1"),
        (on_half_space, {"jobs": 0, "radius": [1e-3]}, "jobs = 0"),
        (on_half_space, {"radius": [1e-3, -1e-3]}, r"radius = -0\.001"),
        (on_half_space, {"radius": [1e-3, 2e-3, 1e-3]}, r"radius = .*: must not hold 0\.001 twice"),
        (on, {"length": [0.1], "material": [hl.PTFE, replace(hl.PTFE, density=1.0)]}, "must not hold 'PTFE' twice"),
        (on, {"length": [0.1]}, r"takes material, length, but the axes are length \(missing .*'material'"),
        (on_half_space, {"time": [1e-3]}, "time is a name that every run uses"),
        (of_modes, {"mode": [1]}, "mode is a name that every run uses"),
        (on_half_space, {"velocity": [1e-3]}, "velocity is a name that every run uses"),
        (3, {"radius": [1e-3]}, "build = 3"),
        (lambda radius: None, {"radius": [1e-3]}, r"build\(\.\.\.\) = None"),
        (of_beads, {"count": [2, 3]}, "build: runs differ in beads"),
    ],
)
def test_bad_sweeps(build: object, keywords: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.sweep(build, **{"until": 4e-4, "jobs": 1, **keywords})  # type: ignore[arg-type]


def test_an_error_names_the_point() -> None:
    with pytest.raises(ValueError, match="radius") as caught:
        hl.sweep(on_half_space, until=4e-4, jobs=1, radius=[1e-3, -1e-3])
    assert caught.value.__notes__ == ["in the sweep's point radius = -0.001"]


def dying(radius: float) -> hl.CoSimulation:
    if radius == 4e-3:
        os._exit(1)
    return on_half_space(radius)


@pytest.mark.thorough
def test_a_process_that_dies_is_told() -> None:
    with pytest.raises(RuntimeError, match="a process ended before its work was done: perhaps memory ran out"):
        hl.sweep(dying, until=1e-4, jobs=2, radius=[2e-3, 4e-3])
