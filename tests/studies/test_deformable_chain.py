"""The study of deformable beads compared with the thesis, and physics that its curves must obey."""

import numpy as np
import pytest
import xarray as xr
from printed import check

from hertzlink.studies import deformable_chain as study

THOROUGH_FIXTURES = ("quick",)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True, jobs=1)


def test_point_masses_are_those_that_were_recomputed(quick: xr.Dataset) -> None:
    """20.55 N and 569.1 m/s at 0.5 m/s, 596.0 m/s at 0.63, by an independent program."""
    points = quick.sel(model="point masses")
    assert points.peak_force.item() == pytest.approx(20.55, rel=5e-4)
    assert points.wave_speed.item() == pytest.approx(569.1, rel=5e-4)
    assert quick.shape_wave_speed.sel(beads="point masses").item() == pytest.approx(596.0, rel=5e-4)


def test_deformable_beads_are_those_that_were_recomputed(quick: xr.Dataset) -> None:
    """20.9 to 20.95 N and 572.5 m/s by two other programs; the coarsest mesh of the contact's law is off by more."""
    finest = study.by_modes(study.LAW_SPACINGS[-1])
    for run, close in ((quick.sel(model="modes"), 4e-3), (finest, 2e-3)):
        assert run.peak_force.item() == pytest.approx(20.92, rel=close)
        assert run.wave_speed.item() == pytest.approx(572.5, rel=0.5 * close)


def test_measures_of_a_travelling_pulse_that_trembles() -> None:
    """cos⁶ pulses, each 8 µs after the one before, with a ripple of 3 % whose phase changes from contact to contact."""
    time, contacts = np.arange(0.0, 165e-6, 0.25e-6), np.arange(1, 22)
    phase = (time[:, None] - 20e-6 - 8e-6 * (contacts - 1)) / 20e-6
    pulse = np.where(abs(phase) < 1.0, np.cos(0.5 * np.pi * phase), 0.0) ** 6
    ripple = 1.0 + 0.03 * np.sin(2.0 * np.pi * time[:, None] / 0.9e-6 + contacts)
    still = xr.zeros_like(xr.DataArray(time, dims="time"))
    energies = dict.fromkeys(
        ["contact_energy", "dissipated_energy", "excitation_work", "structure_energy",
         "structure_dissipated_energy", "structure_work"], still)  # fmt: skip
    run = xr.Dataset(
        {"contact_force": (("time", "contact"), 20.0 * pulse * ripple), "kinetic_energy": still + 1.0, **energies},
        {"time": time, "contact": contacts, "static_force": ("contact", 0.0 * contacts), "impact_energy": 1.0},
    )
    found = study.measure(run)
    assert found.wave_speed.item() == pytest.approx(study.BEAD.size / 8e-6, rel=1e-4)
    assert found.peak_force.item() == pytest.approx(20.0, rel=5e-3)
    assert abs(run.contact_force.sel(contact=16).max().item() - 20.0) > 0.3


def test_speed_obeys_long_wave_theory(quick: xr.Dataset) -> None:
    """Point masses are 1.2 % faster than equation 1.10 at every force; deformable beads more so the harder the hit."""
    ratio = quick.speed_wave_speed / quick.speed_theory
    assert ratio.sel(beads="point masses").values == pytest.approx(1.012, abs=1e-3)
    ahead = (ratio.sel(beads="modes") - ratio.sel(beads="point masses")).values
    assert np.all(np.diff(ahead, prepend=0.0) > 0.0)
    assert ahead[-1] < 0.01


def test_theory_is_a_solution_of_its_own_speed(quick: xr.Dataset) -> None:
    """The peak of equation 1.8 and equation 1.10 are inverse to each other."""
    time = np.linspace(-20e-6, 20e-6, 401)
    force = study.theory(time, 0.0, 570.0)
    assert time[force.argmax()] == pytest.approx(0.0, abs=1e-12)
    assert float(study.by_force(force.max())) == pytest.approx(570.0, rel=1e-9)


def test_waves_come_back_from_the_rigid_wall(quick: xr.Dataset) -> None:
    """Nothing is lost there: echoes are as high as the waves, and come to bead 15 first."""
    echo = quick.sensor_force.sel(shape_time=slice(study.UNTIL, None))
    peak = quick.sensor_force.max("shape_time")
    assert (echo.max("shape_time") / peak).values == pytest.approx(1.0, abs=0.01)
    arrival = echo.idxmax("shape_time")
    assert np.all(arrival.sel(sensor=15) < arrival.sel(sensor=10))


def test_energy_stays_and_hardly_any_is_left_in_vibrations(quick: xr.Dataset) -> None:
    """Rayleigh (Phil. Mag. 11 (1906) 283): slow collisions leave little behind."""
    assert quick.energy_error.max().item() < 1e-5
    share = quick.vibration_share.sum("bead").values
    assert 0.01 < share[300:600].min() < share[300:600].max() < 0.03
    assert quick.vibration_share.isel(time=-1).sel(bead=slice(1, 8)).sum().item() < 1e-4


def test_the_section_carries_what_the_contacts_bring(quick: xr.Dataset) -> None:
    mean = quick.sensor_force.sel(beads="modes", sensor=10)
    section = quick.section_force.sel(sensor=10)
    assert section.max().item() == pytest.approx(mean.max().item(), rel=5e-3)
    assert float(abs(section - mean).max()) > 1e-4 * mean.max().item()
    apart = quick.section_apart
    assert 0.0 == apart.sel(model="point masses") < apart.sel(model="modes") < 5e-3


def test_vibrations_stiffen_the_chain(quick: xr.Dataset) -> None:
    """Without vibrations a ball is stiffer than two half-spaces already; with them waves are higher and faster."""
    for name in ("peak_force", "wave_speed"):
        assert quick[name].sel(model="point masses") < quick[f"modes_{name}"][0] < quick[f"modes_{name}"][1]


def test_the_table_has_every_fact(quick: xr.Dataset) -> None:
    rows = study.table(quick)
    printed = {
        ("wave speed at 0.63 m/s, discrete particles", 635.0),
        ("wave speed at 0.63 m/s, finite elements", 641.0),
        ("wave speed at 0.63 m/s, experiment", 610.0),
        ("peak force, discrete particles", 20.5),
        ("peak force, finite elements", 20.53),
        ("wave speed, discrete particles", 560.0),
        ("wave speed, finite elements", 552.8),
        ("time with modes", "19 h 11 min 2 s"),
    }
    assert printed <= {(row.quantity, row.thesis) for row in rows}
    check("deformable-chain", rows)


def test_the_deformation_is_static(quick: xr.Dataset) -> None:
    """Kinetic over potential energy of the deformation, in a bead whose lowest mode has a period T, and a pulse of the
    duration P: of the order of (T/2πP)², 1e-4 at most here, and above zero."""
    assert 1e-6 < quick.inertia.sel(model="modes").item() < 1e-4
    assert np.isnan(quick.inertia.sel(model="point masses").item())


def test_figures(quick: xr.Dataset) -> None:
    figures = study.figures(quick)
    assert set(figures) == {"section", "sensors", "speed_force", "contacts", "meshes", "modes"}
    assert [axis.get_ylabel() for axis in figures["meshes"].axes[:2]] == list(study.LABELS)
    assert len(figures["contacts"].axes[0].lines) == 21 + 1  # every contact, and the marked one again
