"""Motion of the beads of deformable chains: sections, contacts that stay shut, preload, places, ends, wrong input."""

import re
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import xarray as xr
from PIL import Image
from scipy.integrate import simpson

import hertzlink as hl
from coupling.plots.motion import known_motion

STEEL = hl.STEEL_316
BEAD = hl.Sphere(2.38e-3, STEEL)
CHAIN = hl.DeformableChain([BEAD] * 6, BEAD, 0.5)
ROD = hl.rod([hl.Layer(STEEL, 30e-3, 5e-3)])


THOROUGH_FIXTURES = ("run",)  # its loop takes ten seconds to compile


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    return hl.CoSimulation(CHAIN, None).run(until=6e-5)


@pytest.fixture(scope="module")
def passage(run: xr.Dataset) -> xr.Dataset:
    """The wave passes beads 3 and 4."""
    peak = float(run.time[int(run.contact_force.sel(contact=4).values.argmax())])
    return hl.plots.motion(run, CHAIN, peak + np.arange(-12e-6, 13e-6, 3e-6), [3, 4])


def of_bead(motion: xr.Dataset, number: int) -> xr.Dataset:
    return motion.isel(point=np.flatnonzero(motion.bead == number))


def through_section(motion: xr.Dataset, number: int, centre: float) -> np.ndarray:
    """Force through the central section of a bead at each time, N."""
    one = of_bead(motion, number)
    r, _, z = one.position.values.T
    nodes = np.flatnonzero(abs(z + centre) < 1e-9)
    nodes = nodes[np.argsort(r[nodes])]
    axial = one.stress.sel(stress_component="axial").values[:, nodes]
    return np.asarray(-2.0 * pi * simpson(r[nodes] * axial, x=r[nodes]))


def pole(motion: xr.Dataset, chain: hl.Chain, number: int, side: str) -> np.ndarray:
    """Displacement of a pole along the chain at each time, m."""
    one, bead = of_bead(motion, number), chain.beads[number - 1] if number else chain.body
    assert bead is not None
    place = chain.centres[number] + {"struck": -0.5, "far": 0.5}[side] * bead.size
    r, _, z = one.position.values.T
    return np.asarray(-one.displacement.values[:, np.flatnonzero((r == 0.0) & (abs(z + place) < 1e-9))[0], 2])


def test_central_sections_bear_what_the_run_says(run: xr.Dataset, passage: xr.Dataset) -> None:
    """The integral of the axial stress is the force from the momentum of half a bead, whatever the wave does."""
    for number in (3, 4):
        expected = run.section_force.sel(bead=number, time=passage.time).values
        found = through_section(passage, number, CHAIN.centres[number])
        assert found == pytest.approx(expected, abs=2e-3 * expected.max())
        assert expected.max() > 10.0


@pytest.mark.thorough
def test_mixed_bodies_stay_shut_and_bear_the_force() -> None:
    """A shell, an ellipsoid and another material: each contact has the radius of its pair."""
    row = [
        hl.Sphere(3e-3, hl.ALUMINIUM_6061),
        hl.HollowSphere(4e-3, 2.4e-3, STEEL),
        hl.Ellipsoid(2e-3, 6e-3, STEEL, "along"),
    ]
    chain = hl.DeformableChain(row, BEAD, 0.5, modes=6)
    run = hl.CoSimulation(chain, None).run(until=3e-5)
    motion = hl.plots.motion(run, chain, np.arange(4e-6, 30e-6, 4e-6))
    assert set(np.unique(motion.bead)) == {0, 1, 2, 3}
    for number in range(4):
        expected = run.section_force.sel(bead=number, time=motion.time).values
        found = through_section(motion, number, chain.centres[number])
        assert found == pytest.approx(expected, abs=1e-2 * float(run.section_force.max()))
    for contact in (1, 2, 3):
        force = run.contact_force.sel(contact=contact, time=motion.time).values
        gap = pole(motion, chain, contact, "struck") - pole(motion, chain, contact - 1, "far")
        approach = float(abs(run.displacement.sel(bead=contact - 1) - run.displacement.sel(bead=contact)).max())
        assert gap[force > 0.5] == pytest.approx(np.zeros((force > 0.5).sum()), abs=1e-2 * approach)


@pytest.mark.thorough
def test_at_rest_under_a_preload() -> None:
    """No displacement yet, but Hertz's pressure at the poles: p₀ = (6 F E*²/π³R²)^(1/3) (Johnson, equation 4.24)."""
    chain = hl.DeformableChain([BEAD] * 3, None, gravity=9.81, preload=20.0, modes=4)
    run = hl.CoSimulation(chain, ROD).run(until=2e-6)
    motion = hl.plots.motion(run, chain, 0.0, 2)
    assert float(abs(motion.displacement).max()) < 1e-14
    modulus = 0.5 * STEEL.youngs_modulus / (1.0 - STEEL.poisson_ratio**2)
    pressure = (6.0 * 20.0 * modulus**2 / pi**3 / (0.5 * BEAD.radius) ** 2) ** (1.0 / 3.0)
    assert -float(motion.stress.sel(stress_component="axial").min()) == pytest.approx(pressure, rel=0.03)
    assert through_section(motion, 2, chain.centres[2]) == pytest.approx([20.0], rel=3e-3)
    assert float(motion.von_mises.max()) == pytest.approx(0.62 * pressure, rel=0.03)


@pytest.mark.thorough
def test_a_rigid_outside_has_its_static_fields(run: xr.Dataset) -> None:
    """With modes = 1 a bead is accelerated evenly at every moment: its section bears the mean of both contacts."""
    chain = replace(CHAIN, modes=1)
    rigid = hl.CoSimulation(chain, None).run(until=3e-5)
    motion = hl.plots.motion(rigid, chain, [1e-5, 1.5e-5, 2e-5], 2)
    mean = hl.sensor_force(rigid, 2).sel(time=motion.time).values
    assert through_section(motion, 2, chain.centres[2]) == pytest.approx(mean, rel=2e-3, abs=1e-6)


@pytest.mark.thorough
def test_a_bead_that_touches_a_structure_is_refused() -> None:
    """Before the wave arrives there, its stress is known."""
    chain = hl.DeformableChain([BEAD] * 2, None, 0.3, modes=3)
    run = hl.CoSimulation(chain, hl.half_space(hl.ACRYLIC), behind=ROD).run(until=4e-5)
    assert hl.plots.motion(run, chain, 1e-6, 1).sizes["time"] == 1
    with pytest.raises(ValueError, match="beads: bead 2 touches no bead at contact 3, so its stress is not known"):
        hl.plots.motion(run, chain, np.arange(5e-6, 40e-6, 5e-6), 2)
    pressed = replace(chain, impact_speed=None, preload=5.0)
    back = hl.CoSimulation(pressed, hl.half_space(STEEL), behind=ROD)
    with pytest.raises(ValueError, match="beads: bead 1 touches no bead at contact 1"):
        hl.plots.motion(back.run(until=1e-6), pressed, 0.0, 1)


@pytest.fixture
def by_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs go window by window: the compiled loop, for chains of which there is one test, compiles for 7 s to 9 s."""
    monkeypatch.setattr("coupling.engine.is_compiled", lambda *_: False)


@pytest.mark.thorough
@pytest.mark.usefixtures("by_window")
def test_a_push_from_outside_acts_on_the_bead_as_a_whole() -> None:
    """It is reported as contact 1, but acts on no pole: the section carries half the force of the contact ahead."""
    moments = np.linspace(0.0, 2e-5, 41)
    push = hl.PushedBead(moments, 10.0 * np.sin(pi * moments / 2e-5))
    chain = hl.DeformableChain([BEAD] * 2, push, modes=1)
    run = hl.CoSimulation(chain, None).run(until=2e-5)
    motion = hl.plots.motion(run, chain, [1e-5, 1.5e-5], 1)
    ahead = run.contact_force.sel(contact=2, time=motion.time).values
    assert ahead.max() > 0.5
    assert through_section(motion, 1, chain.centres[1]) == pytest.approx(0.5 * ahead, rel=3e-3)


@pytest.mark.thorough
def test_the_dataset_tells_all_and_is_drawn_and_written(passage: xr.Dataset, run: xr.Dataset, tmp_path: Path) -> None:
    known_motion(passage)
    assert passage.stress.dims == ("time", "point", "stress_component")
    assert {passage[name].attrs["units"] for name in ("stress", "von_mises")} == {"Pa"}
    assert passage.attrs["input"] == run.attrs["input"]
    z = -passage.position.sel(component="z").values
    for number in (3, 4):
        own = z[passage.bead.values == number]
        assert [own.min(), own.max()] == pytest.approx(CHAIN.centres[number] + np.array([-1.0, 1.0]) * BEAD.radius)
    radial, hoop, axial, shear = np.moveaxis(passage.stress.values, -1, 0)
    square = 0.5 * ((radial - hoop) ** 2 + (hoop - axial) ** 2 + (axial - radial) ** 2) + 3.0 * shear**2
    assert passage.von_mises.values == pytest.approx(np.sqrt(square), rel=1e-9)
    passage.to_netcdf(tmp_path / "motion.nc", engine="h5netcdf")
    listing = hl.plots.write_vtu(passage.isel(time=[3]), tmp_path / "paraview")
    written = meshio.read(listing.with_name("motion_0000.vtu"))
    assert written.point_data["von_mises"] == pytest.approx(passage.von_mises.values[3])
    axial = passage.stress.sel(stress_component="axial").values[3]
    assert written.point_data["axial_stress"] == pytest.approx(axial)
    assert set(np.unique(written.cell_data["part"][0])) == {3, 4}


@pytest.mark.thorough
def test_beads_are_drawn_side_by_side(passage: xr.Dataset, tmp_path: Path) -> None:
    hl.plots.picture(passage, tmp_path / "beads.png", factor=0.0)
    width, height = Image.open(tmp_path / "beads.png").size
    assert width > height  # with title, ruler and colours


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"times": [7e-5]}, "times = [7e-05]: must be in the run, between 0 and 6e-05 s"),
        ({"beads": 7}, "beads = 7: must be a whole number, at most 6"),
        ({"beads": [-1]}, "beads = -1: must be a whole number, 0 or more"),
        ({"beads": []}, "beads = []: must be a list of numbers"),
        ({"body": hl.Chain([BEAD] * 6, BEAD, 0.5)}, "must be the Structure or the DeformableChain that was run"),
        ({"body": replace(CHAIN, beads=[BEAD] * 5)}, "body: is not that of the run: "),
        ({"body": replace(CHAIN, modes=7)}, "modes = 8 there and 7 here"),
        (
            {"body": replace(CHAIN, striker=hl.Sphere(2e-3, STEEL))},
            "body: is not that of the run: striker.radius = 0.00238 there and 0.002 here; give the one that was run",
        ),
        ({"body": replace(CHAIN, beads=[hl.Sphere(BEAD.radius, hl.PTFE)] * 6)}, "beads[0].material.youngs_modulus ="),
        ({"body": replace(CHAIN, impact_speed=0.4)}, "impact_speed = 0.5 there and 0.4 here"),
        ({"body": replace(CHAIN, dissipation=hl.LinearDashpot(0.1))}, "dissipation = None there and "),
        ({"run": {"time": 0}}, "must be the Dataset of a run of a DeformableChain"),
    ],
)
def test_bad_input_is_named(run: xr.Dataset, given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        hl.plots.motion(**{"run": run, "body": CHAIN, "times": [2e-5], **given})


def of_speed_and_material(speed: float, material: hl.Material) -> hl.DeformableChain:
    return hl.DeformableChain([hl.Sphere(2e-3, material)] * 2, hl.Sphere(2e-3, material), speed, modes=3)


@pytest.mark.thorough
def test_points_of_a_sweep_have_the_first_ones_input() -> None:
    """So only the bodies' places, the modes and the energy of such points are compared."""

    def build(speed: float, material: hl.Material) -> hl.CoSimulation:
        return hl.CoSimulation(of_speed_and_material(speed, material), None)

    runs = hl.sweep(build, 1e-5, jobs=1, speed=[0.3, 0.5], material=[STEEL, hl.ALUMINIUM_6061])
    last = runs.isel(speed=1, material=1)
    chain = of_speed_and_material(0.5, hl.ALUMINIUM_6061)
    motion = hl.plots.motion(last, chain, 8e-6, 1)
    own = hl.plots.motion(build(0.5, hl.ALUMINIUM_6061).run(1e-5), chain, float(motion.time[0]), 1)
    assert motion.stress.values == pytest.approx(own.stress.values, rel=1e-6, abs=1.0)
    with pytest.raises(ValueError, match=r"impact energy = .* there and .* here; give the one"):
        hl.plots.motion(last, of_speed_and_material(0.3, hl.ALUMINIUM_6061), 8e-6, 1)


def test_runs_of_another_kind(run: xr.Dataset) -> None:
    rigid = hl.CoSimulation(hl.Chain([BEAD] * 6, BEAD, 0.5), None).run(until=1e-5)
    with pytest.raises(ValueError, match="run: holds no vibration_amplitude; must be the Dataset of a DeformableChain"):
        hl.plots.motion(rigid, CHAIN, 1e-5)
    with pytest.raises(ValueError, match=r"has the axes speed; choose one run with run\.isel\(speed=0\)"):
        hl.plots.motion(xr.concat([run, run], dim="speed"), CHAIN, 1e-5)


@pytest.mark.thorough
@pytest.mark.usefixtures("by_window")
def test_one_of_several_chains() -> None:
    short = hl.DeformableChain([BEAD] * 3, BEAD, 0.5, modes=3)
    long = hl.DeformableChain([BEAD] * 4, BEAD, 0.5, modes=5)
    run = hl.CoSimulation([short, long], [hl.half_space(STEEL), hl.half_space(STEEL)]).run(until=2e-5)
    with pytest.raises(ValueError, match=r"run: has the axes chain; choose one chain with run\.isel\(chain=0\)"):
        hl.plots.motion(run, short, 1e-5)
    for place, chain in enumerate((short, long)):
        one = run.isel(chain=place)
        motion = hl.plots.motion(one, chain, [1e-5, 1.5e-5], 2)
        expected = one.section_force.sel(bead=2, time=motion.time).values
        assert through_section(motion, 2, chain.centres[2]) == pytest.approx(expected, abs=3e-3 * expected.max())
    with pytest.raises(ValueError, match="body: is not that of the run: "):
        hl.plots.motion(run.isel(chain=1), short, 1e-5)
