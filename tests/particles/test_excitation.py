"""What moves a chain, and what presses on it: impulse, energy, static forces, wave speeds of preloaded chains."""

from math import pi

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from particles import solitary
from structures.surface import hertz_stiffness

STEEL = hl.STEEL_316
BEAD = hl.Sphere(2.38e-3, STEEL)
STIFFNESS = hertz_stiffness(BEAD.surface, BEAD.surface)
WALL = hl.half_space(STEEL)
TIME = np.linspace(0.0, 5e-5, 101)
FORCE = 30.0 * np.sin(pi * TIME / 5e-5) ** 2
LOSS = hl.LinearDashpot(3.0)


@pytest.mark.parametrize("loss", [None, LOSS])
def test_a_pushed_chain_takes_the_impulse_and_the_work(loss: hl.LinearDashpot | None) -> None:
    """Before the wave reaches the wall the beads' momentum is ∫F dt, and their energy the work of the force.

    Whichever of them is heavier.
    """
    beads = [BEAD, hl.Sphere(4e-3, STEEL), *[BEAD] * 18]
    chain = hl.Chain(beads, hl.PushedBead(TIME, FORCE), dissipation=loss)  # type: ignore[arg-type]
    run = hl.CoSimulation(chain, WALL).run(until=4e-4)
    momentum = run.velocity.sel(bead=slice(1, 20)).dot(xr.DataArray([bead.mass for bead in beads], dims="bead"))
    assert float(momentum.sel(time=1e-4, method="nearest")) == pytest.approx(30.0 * 2.5e-5, rel=1e-6)
    assert run.contact_force.sel(contact=1).values == pytest.approx(
        np.interp(run.time, TIME, FORCE), abs=0.01
    )  # The cubic through the points, compared with lines.
    assert hl.energy_error(run) < 1e-6
    assert abs(run.velocity.sel(bead=0)).max() == 0.0


@pytest.mark.parametrize("loss", [None, LOSS])
def test_a_piston_does_the_work_that_the_chain_gets(loss: hl.LinearDashpot | None) -> None:
    motion = 5e-6 * 0.5 * (1.0 - np.cos(pi * TIME / TIME[-1]))
    chain = hl.Chain([BEAD] * 20, hl.Piston(TIME, motion), dissipation=loss, preload=3.0)  # type: ignore[arg-type]
    run = hl.CoSimulation(chain, WALL).run(until=4e-4)
    assert run.displacement.sel(bead=0).values == pytest.approx(np.interp(run.time, TIME, motion), abs=1e-9)
    assert hl.energy_error(run) < 1e-5
    assert float(run.excitation_work.max()) > 0.0


def test_a_push_goes_on_in_a_chain_as_long_as_a_window_has_steps() -> None:
    push, plate = hl.PushedBead([0.0, 1e-4, 1e-3], [0.0, 30.0, 30.0]), hl.infinite_plate(1e-3, STEEL)
    runs = [hl.CoSimulation(hl.Chain([BEAD] * count, push), plate).run(3e-4) for count in range(8, 16)]
    assert max(map(hl.energy_error, runs)) < 1e-7


def test_a_piston_at_rest_holds_a_preloaded_chain() -> None:
    """Nothing moves; contact 1 carries the preload, and a dead load on the first bead carries it as well."""
    for striker, first in ((hl.Piston(), 20.0), (hl.PushedBead([0.0, 1e-3], [1e-9, 1e-9]), 1e-9)):
        run = hl.CoSimulation(hl.Chain([BEAD] * 6, striker, preload=20.0), WALL).run(until=2e-4)
        expected = np.append(first, np.full(6, 20.0))
        assert run.contact_force.isel(time=-1).values == pytest.approx(expected, rel=1e-6)
        assert float(abs(run.displacement).max()) < 1e-12


def test_a_spring_loaded_striker_brings_its_springs_energy() -> None:
    """½k(c² − (c − s)²) on the way to the chain; with gravity m g s more; the rest while it still pushes."""
    whole = hl.SpringLoaded(BEAD, stiffness=2e3, compression=2e-3)
    assert whole.speed(0.0) == pytest.approx(2e-3 * (2e3 / BEAD.mass) ** 0.5)
    assert whole.speed(9.81) ** 2 == pytest.approx(whole.speed(0.0) ** 2 + 2.0 * 9.81 * 2e-3)
    early = hl.SpringLoaded(BEAD, stiffness=2e3, compression=2e-3, travel=5e-4)
    energy = 0.5 * 2e3 * (2e-3**2 - 1.5e-3**2)
    assert 0.5 * BEAD.mass * early.speed(0.0) ** 2 == pytest.approx(energy)
    run = hl.CoSimulation(hl.Chain([BEAD] * 20, early), WALL).run(until=5e-4)
    assert hl.energy_error(run) < 1e-6
    assert float(run.impact_energy) == pytest.approx(0.5 * 2e3 * 2e-3**2)
    free = hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, whole.speed(0.0)), WALL).run(until=3e-4)
    thrown = hl.CoSimulation(hl.Chain([BEAD] * 20, whole), WALL).run(until=3e-4)
    until_it_returns = slice(0.0, 1.5e-4)
    forces = [run.contact_force.sel(time=until_it_returns).values for run in (free, thrown)]
    assert forces[1] == pytest.approx(forces[0], rel=1e-6, abs=1e-6)


def test_a_spring_pushes_on_where_a_preload_has_moved_the_chain() -> None:
    """Soft beads have moved by more than the spring is still compressed, 0.1 mm."""
    spring, soft = hl.SpringLoaded(BEAD, stiffness=2e3, compression=2e-3, travel=1.9e-3), hl.Sphere(2.38e-3, hl.PTFE)
    chains = (hl.Chain([soft] * 20, *one, preload=20.0) for one in ((spring,), (BEAD, spring.speed(0.0))))
    pushed, thrown = (hl.CoSimulation(chain, WALL).run(2e-6).velocity.values[-1, 0] for chain in chains)
    assert pushed - thrown == pytest.approx(2e3 * 1e-4 * 2e-6 / BEAD.mass, rel=0.1)


def peak(run: xr.Dataset) -> float:
    return float((run.contact_force - run.static_force).sel(contact=slice(20, 30)).max())


@pytest.mark.parametrize(("preload", "speed"), [(0.5, 0.5), (5.0, 0.5), (20.0, 1.0)])
def test_speed_of_waves_in_a_preloaded_chain(preload: float, speed: float) -> None:
    """Equation 5.10 (1.9 with f_r = F_m/F_0); long waves are an approximation of 1 % here."""
    run = hl.CoSimulation(hl.Chain([BEAD] * 50, BEAD, speed, preload=preload), WALL).run(until=3e-4)
    theory = solitary.UniformChain(BEAD.size, BEAD.mass, STIFFNESS).wave_speed_from_force(peak(run), preload)
    assert hl.wave_speed(run, 20, 30) == pytest.approx(theory, rel=0.012)
    assert hl.energy_error(run) < 1e-6


@pytest.mark.parametrize("frequency", [8e3, 30e3])
def test_linear_waves_obey_the_dispersion_relation(frequency: float) -> None:
    """Equation 1.4: a piston oscillates by 1 nm; the phase from bead to bead gives the wave number."""
    time = np.linspace(0.0, 1.3e-3, int(1.3e-3 * frequency * 60) + 1)
    motion = 1e-9 * np.minimum(time / 4e-4, 1.0) * np.sin(2.0 * pi * frequency * time)
    chain = hl.Chain([BEAD] * 150, hl.Piston(time, motion), preload=20.0)  # type: ignore[arg-type]
    run = hl.CoSimulation(chain, WALL).run(until=1.2e-3, save_every=1e-6)
    late = run.displacement.sel(time=slice(6e-4, 1.1e-3), bead=slice(5, 30))
    angle = 2.0 * pi * frequency * late.time.values
    waves = np.linalg.lstsq(np.column_stack([np.cos(angle), np.sin(angle)]), late.values, rcond=None)[0]
    phase = np.unwrap(np.arctan2(waves[1], waves[0]))
    wave_number = abs(np.polyfit(np.arange(phase.size), phase, 1)[0]) / BEAD.size
    theory = solitary.UniformChain(BEAD.size, BEAD.mass, STIFFNESS).angular_frequency(wave_number, 20.0)
    assert theory / (2.0 * pi) == pytest.approx(frequency, rel=5e-3)


def test_a_hundred_spheres_against_an_independent_code() -> None:
    """R = 6 mm, ρ 7800, E 200 GPa, ν 0.28, first sphere at 0.099188 m/s: rebound velocities over v, and the last's.

    The other code's first number is −0.07109; here it is −0.0710849 (Verlet), half a digit off.
    """
    sphere = hl.Sphere(6e-3, hl.Material(200e9, 0.28, 7800.0))
    run = hl.CoSimulation(hl.Chain([sphere] * 99, sphere, 0.099188), None).run(until=4e-3, save_every=5e-6)
    end = run.velocity.isel(time=-1).values / 0.099188
    assert end[:4] == pytest.approx([-0.07109, -0.03027, -0.01583, -0.00889], abs=6e-6)
    assert end[-1] == pytest.approx(0.9857, abs=5e-5)
