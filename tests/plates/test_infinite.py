"""The infinite plate: against finite plates before the first echo, and its energy."""

from math import pi

import numpy as np
import pytest

import hertzlink as hl

CARBON = hl.OrthotropicMaterial(140e9, 10e9, 0.3, 5e9, 5e9, 3.6e9, 1600.0)
LAMINATE = hl.Laminate([hl.Ply(CARBON, 1e-3, 0.3), hl.Ply(CARBON, 1e-3, 1.2)])
BEAD = hl.Sphere(2.38e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 20, BEAD, impact_speed=0.31)


def test_a_run_equals_that_on_a_large_plate() -> None:
    """The thesis's plate at its centre: the contact of a small bead is over before the edges answer."""
    plate = hl.kirchhoff_plate(0.914, 0.914, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports("clamped", "clamped"))
    runs = [
        hl.CoSimulation(CHAIN, one).run(0.8e-3)
        for one in (hl.infinite_plate(2.29e-3, hl.ALUMINIUM_6061), hl.reduce(plate.at(0.457, 0.457), 0.8e-3))
    ]
    infinite, finite = (hl.amplitude_ratio(run, sensor=7).item() for run in runs)
    assert infinite == pytest.approx(finite, rel=1e-3)
    # The first wave has come and gone by then; what small beads do later, waves of over 40 kHz still move.
    forces = [run.contact_force.isel(contact=-1).sel(time=slice(0.0, 0.22e-3)).values for run in runs]
    assert forces[0] == pytest.approx(forces[1], abs=1e-3 * forces[1].max())


@pytest.mark.thorough
@pytest.mark.parametrize("laminate", [LAMINATE, hl.Laminate([hl.Ply(CARBON, 2e-3, 0.7)])], ids=["two plies", "one ply"])
def test_a_laminate_stays_where_an_impulse_left_it(laminate: hl.Laminate) -> None:
    """With D₁₆ and D₂₆, reduced for B: the displacement on a large plate is I/Z, until the echo."""
    plate = hl.kirchhoff_plate(0.7, 0.7, None, laminate, hl.Supports(), highest_frequency=25e3)
    pulse, window, after = 100e-6, 1e-6, []
    moving = hl.stepping.MovingStructure(hl.reduce(plate.at(0.35, 0.35), until=1.8e-4, tolerance=1e-3))
    state = moving.start()
    for step in range(170):
        time = (step + 0.5) * window
        force = 1.0 - np.cos(2.0 * pi * time / pulse) if time < pulse else 0.0
        state, surface = moving.advance(state, force, window)
        if time > pulse:
            after.append(surface)
    impedance = hl.infinite_plate(None, laminate).damping[0, 0]
    assert impedance == pytest.approx(plate.point_impedance, rel=1e-12)
    assert np.array(after) * impedance / pulse == pytest.approx(np.ones(len(after)), abs=5e-4)


@pytest.mark.thorough
def test_work_is_what_the_dashpot_takes() -> None:
    """Z Σ (Δw)²/H over all windows, by hand from the motion; compiled and window by window."""
    plate = hl.infinite_plate(3e-3, hl.ALUMINIUM_6061)
    compiled = hl.CoSimulation(CHAIN, plate).run(0.6e-3)
    impedance = plate.damping[0, 0]
    steps, window = np.diff(compiled.surface_displacement.values), float(compiled.time[1])
    taken = impedance * (steps**2).sum() / window
    assert taken == pytest.approx(float(compiled.interface_work[-1]), rel=1e-9)
    assert taken > 0.1 * float(compiled.impact_energy)
    assert abs(hl.energy_error(compiled)) < 1e-5
    other = hl.CoSimulation(CHAIN, plate, scheme=hl.Aitken(tolerance=1e-12)).run(0.6e-3)
    assert other.surface_displacement.values == pytest.approx(
        compiled.surface_displacement.values, abs=1e-7 * abs(compiled.surface_displacement.values).max()
    )


def test_reduction_leaves_it_as_it_is() -> None:
    plate = hl.infinite_plate(3e-3, hl.ALUMINIUM_6061)
    assert hl.reduce(plate, 1e-3) is plate
    run = hl.CoSimulation(CHAIN, hl.damped(plate, hl.damping.Rayleigh(mass_rate=10.0))).run(0.6e-3)
    assert hl.amplitude_ratio(run, 7) == hl.amplitude_ratio(hl.CoSimulation(CHAIN, plate).run(0.6e-3), 7)
