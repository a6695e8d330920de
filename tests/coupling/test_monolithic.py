"""The monolithic reference: closed forms, its own convergence, and what the co-simulation converges to."""

import numpy as np
import pytest
import xarray as xr
from hard_cases import BEAD, CASES, REFERENCE, SENSOR, Case, chain
from monolithic import Contact, monolithic

import hertzlink as hl
from structures.damping import Rayleigh

LAYERS = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
SUPPORTS = hl.Supports("clamped", "clamped", "free", "free")
PLATE = hl.kirchhoff_plate(0.2, 0.2, 2.29e-3, hl.ALUMINIUM_6061, SUPPORTS, cells=(12, 12)).at(0.05, 0.1)
ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.0762, 0.0191)], elements=8)
TIP = hl.Structure(
    np.diag([0.5, 5.0]) * BEAD.mass, [[1e7, -1e7], [-1e7, 1.1e7]], None, [1.0, 0.0], 3e-9, hl.Surface(hl.STEEL_440C)
)


def solve(case: Case, tolerance: float = 1e-12, interval: float = 2.5e-7) -> list[xr.Dataset]:
    times = np.linspace(0.0, case.until, round(case.until / interval) + 1)
    return monolithic(case.chains, case.structures, case.contacts, times, tolerance)


def ratios(runs: list[xr.Dataset]) -> list[float]:
    return [hl.amplitude_ratio(run, SENSOR).item() for run in runs]


def energy_error(run: xr.Dataset) -> float:
    return float(abs(run.total_energy - run.total_energy[0]).max() / run.impact_energy)


@pytest.mark.thorough
def test_two_spheres_exchange_their_speeds_in_hertzs_time() -> None:
    """2.9432 (m²/(k²v))^(1/5) with the reduced mass (Johnson, Contact Mechanics, equation 11.24)."""
    pair = hl.Chain([BEAD], striker=BEAD, impact_speed=0.31)
    stiffness = hl.contact_law(BEAD, BEAD).kernel[0]
    duration = 2.9432 * ((BEAD.mass / 2.0) ** 2 / (stiffness**2 * 0.31)) ** 0.2 * 1.25**0.4
    times = np.linspace(0.0, 1.2 * duration, 12001)
    run = monolithic([pair], [], [], times)[0]
    assert run.velocity.values[-1] == pytest.approx([0.0, 0.31], abs=1e-11)
    assert times[run.contact_force.values[:, 0] > 0.0][-1] == pytest.approx(duration, rel=1e-4)


@pytest.mark.thorough
def test_a_bead_that_is_a_structure_leaves_the_chain_as_it_was() -> None:
    """The eighth of fifteen beads as a mass with two contacts, the second that of the chain behind's first bead."""
    whole = hl.Chain([BEAD] * 15, striker=BEAD, impact_speed=0.31)
    before = hl.Chain([BEAD] * 7, striker=BEAD, impact_speed=0.31)
    behind = hl.Chain([BEAD] * 7, striker=None)
    none = np.zeros((1, 1))
    mass = hl.Structure(np.array([[BEAD.mass]]), none, None, np.array([[1.0, -1.0]]), 0.0, BEAD.surface)
    times = np.linspace(0.0, 6e-4, 601)
    one = monolithic([whole], [], [], times)[0]
    near, far = monolithic([before, behind], [mass], [Contact(0, "last", 0, 0), Contact(1, "first", 0, 1)], times)
    assert near.velocity.values == pytest.approx(one.velocity.values[:, :8], abs=1e-10)
    assert far.velocity.values[:, 1:] == pytest.approx(one.velocity.values[:, 9:], abs=1e-10)
    assert far.contact_force.values[:, 0] == pytest.approx(one.contact_force.values[:, 8], abs=1e-7)
    assert far.first_surface_displacement.values == pytest.approx(-one.displacement.values[:, 8], abs=1e-14)
    assert hl.reflections(far, 3).incident


@pytest.mark.thorough
@pytest.mark.parametrize("name", CASES)
def test_the_reference_has_settled(name: str) -> None:
    """Two tolerances agree, energy is kept, and a twice finer sampling shows the same ratios."""
    fine, coarse = solve(CASES[name]()), solve(CASES[name](), 1e-11)
    assert ratios(fine) == pytest.approx(ratios(coarse), abs=1e-8)
    assert ratios(fine) == pytest.approx(REFERENCE[name], abs=1e-7)
    assert energy_error(fine[0]) < 3e-9


AGREEMENT = {
    "rod": (chain(), ROD),
    "layered rod": (chain(), hl.rod(LAYERS, elements=4)),
    "damped rod": (chain(), hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing", elements=8)),
    "plate": (chain(), hl.reduce(PLATE, until=9e-4)),
    "tip on a spring in series": (chain(), TIP),
    "under gravity, with dashpots": (
        hl.Chain([BEAD] * 14, BEAD, 0.31, gravity=9.81, preload=0.5, dissipation=hl.LinearDashpot(5.0)),
        hl.damping.damped(ROD, Rayleigh(5e2, 1e-7)),
    ),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", AGREEMENT)
def test_the_cosimulation_converges_to_the_reference_at_second_order(name: str) -> None:
    """AR with the window halved twice, and its limit."""
    struck, structure = AGREEMENT[name]
    reference = solve(Case((struck,), (structure,), (Contact(0, "last", 0),), 8e-4), 1e-12, 2e-6)[0]
    assert energy_error(reference) < 1e-8
    found = []
    for window in (2e-6, 1e-6, 5e-7):
        run = hl.CoSimulation(struck, structure, window=window, dt=2.5e-9).run(until=8e-4, save_every=2e-6)
        found.append(hl.amplitude_ratio(run, SENSOR).item())
    errors = np.array(found) - hl.amplitude_ratio(reference, SENSOR).item()
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2.0, abs=0.2)
    assert abs(4.0 * errors[2] - errors[1]) / 3.0 < 2e-6
