"""The energy that a structure keeps, and what damping takes of it."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import sparse

import hertzlink as hl
from structures.damping import Modal, Rayleigh, StandardLinearSolid
from structures.stepping import StructureState

LAYERS = [hl.Layer(hl.STEEL_440C, 0.01, 0.01), hl.Layer(hl.ACRYLIC, 0.05, 0.01)]
ROD = hl.rod(LAYERS, elements=6)
WINDOW = 4e-7
"""s. The fastest motion of the rod turns by some 5 rad in it."""


def oscillator(omega: float, rate: float = 0.0, mass: float = 1.0) -> hl.Structure:
    one = sparse.csr_array(np.eye(1))
    return hl.Structure(mass * one, mass * omega**2 * one, mass * rate * one, np.ones(1), 0.0, hl.Surface(hl.PTFE))


def shaken(
    moving: hl.stepping.MovingStructure, windows: int, window: float
) -> list[tuple[StructureState, float, float]]:
    """The states after each window, the force's work in it, and H v̄ᵀC v̄, what damping takes under the midpoint rule;
    under random forces.
    """
    state, before, found = moving.start(), 0.0, []
    for force in np.random.default_rng(5).normal(size=windows):
        after, moved = moving.advance(state, force, window)
        mean, damping = 0.5 * (state.velocity + after.velocity), moving.structure.damping
        taken = 0.0 if damping is None else window * float(mean @ (damping @ mean))
        found.append((after, force * (moved - before), taken))
        state, before = after, moved
    return found


@pytest.mark.parametrize("structure", [ROD, hl.reduce(ROD, until=1e-4, tolerance=1e-6)], ids=["rod", "modes"])
def test_a_free_motion_keeps_its_energy(structure: hl.Structure) -> None:
    """To rounding, though it holds motions as fast as the window."""
    moving = hl.stepping.MovingStructure(structure)
    state = shaken(moving, 20, WINDOW)[-1][0]
    found = []
    for _ in range(300):
        state, _ = moving.advance(state, 0.0, WINDOW)
        found.append(moving.energies(state))
    sums = np.sum(found, axis=1)
    assert np.ptp(np.array(found)[:, 0]) > 0.1 * sums[0]
    assert abs(sums - sums[0]).max() < 1e-9 * sums[0]


def test_energies_of_one_oscillator() -> None:
    """½ m v² and ½ k u², by hand."""
    moving = hl.stepping.MovingStructure(oscillator(0.8e6, mass=3.0))
    kinetic, elastic = moving.energies(StructureState(np.array([2e-6]), np.array([0.5])))
    assert kinetic == pytest.approx(0.5 * 3.0 * 0.25, rel=1e-12)
    assert elastic == pytest.approx(0.5 * 3.0 * 0.8e6**2 * 4e-12, rel=1e-12)


DAMPED: dict[str, Callable[[], hl.Structure]] = {
    "Rayleigh": lambda: hl.damped(ROD, Rayleigh(1e4, 1e-7)),
    "dashpot": lambda: hl.rod(LAYERS, base="absorbing", elements=6),
    "arms": lambda: hl.damped(ROD, StandardLinearSolid(0.5, 1e-6)),
    "modes": lambda: hl.damped(hl.reduce(ROD, until=1e-4, tolerance=1e-6), Modal(0.05)),
    "overdamped modes": lambda: hl.damped(hl.reduce(ROD, until=1e-4, tolerance=1e-6), Modal(3.0)),
    "coupled modes": lambda: hl.reduce(hl.rod(LAYERS, base="absorbing", elements=6), until=1e-4, tolerance=1e-6),
}


@pytest.mark.parametrize("window", [1e-8, WINDOW, 1e-5])
@pytest.mark.parametrize("name", DAMPED)
def test_work_is_what_is_gained_and_taken(name: str, window: float) -> None:
    """In every window, to rounding of the energy: exactly under the midpoint rule, never negative for oscillators."""
    moving = hl.stepping.MovingStructure(DAMPED[name]())
    before, total, greatest = 0.0, 0.0, 0.0
    for state, work, expected in shaken(moving, 200, window):
        energy = sum(moving.energies(state))
        greatest, taken = max(greatest, energy), before + work - energy
        if not moving.structure.is_modal:
            assert taken == pytest.approx(expected, abs=1e-9 * greatest)
        assert taken > -1e-9 * greatest
        before, total = energy, total + taken
    # In the shortest run no wave has come to the dashpot.
    assert total > 0.03 * greatest or (window < WINDOW and name in ("dashpot", "coupled modes"))


@pytest.mark.parametrize("phase", [0.0, 1e-3, 0.3, 0.99])
@pytest.mark.parametrize("drag", [1e-3, 0.2, 1.0, 4.0])
def test_exact_oscillators_lose_exactly_what_damping_takes(phase: float, drag: float) -> None:
    """∫ c v² dt by quadrature of the exact motion v(t), a matrix exponential; phase ωH and drag cH/2 of one window."""
    from scipy.linalg import expm

    moving = hl.stepping.MovingStructure(oscillator(phase, 2.0 * drag))
    assert moving.structure.is_modal
    start, force = StructureState(np.array([0.4]), np.array([-0.7])), 1.3
    end, moved = moving.advance(start, force, 1.0)
    generator = np.array([[0.0, 1.0, 0.0], [-(phase**2), -2.0 * drag, force], [0.0, 0.0, 0.0]])
    points, weights = np.polynomial.legendre.leggauss(40)
    rates = np.array([(expm(0.5 * (1.0 + t) * generator) @ [0.4, -0.7, 1.0])[1] for t in points])
    taken = force * (moved - 0.4) + moving.energy(start) - moving.energy(end)
    assert taken == pytest.approx(0.5 * weights @ (2.0 * drag * rates**2), rel=1e-10, abs=1e-14)


def test_a_rigid_wall_has_no_energy() -> None:
    wall = hl.stepping.MovingStructure(hl.half_space(hl.PTFE))
    assert wall.energies(wall.start()) == (0.0, 0.0)
