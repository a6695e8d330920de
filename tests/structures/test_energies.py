"""The energy that each stepper keeps, and what damping takes of it."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from scipy import sparse

import hertzlink as hl
from structures.damping import Modal, Rayleigh, StandardLinearSolid
from structures.stepping import CentralDifference, GeneralisedAlpha, Newmark, Stepper, StructureState

LAYERS = [hl.Layer(hl.STEEL_440C, 0.01, 0.01), hl.Layer(hl.ACRYLIC, 0.05, 0.01)]
ROD = hl.rod(LAYERS, elements=6)
WINDOW = 4e-7
"""s. The fastest motion of the rod turns by some 5 rad in it, by 1 in one of the steps of central differences."""

KEEPING: dict[str, str | Stepper] = {
    "midpoint": "midpoint",
    "newmark": "newmark",
    "newmark, beta 0.3": partial(Newmark, beta=0.3),
    "newmark, beta 1": partial(Newmark, beta=1.0),
    "generalised-alpha, 1": partial(GeneralisedAlpha, spectral_radius=1.0),
    "central-difference": "central-difference",
    "central-difference, 20": partial(CentralDifference, steps=20),
}


def oscillator(omega: float, rate: float = 0.0, mass: float = 1.0) -> hl.Structure:
    one = sparse.csr_array(np.eye(1))
    return hl.Structure(mass * one, mass * omega**2 * one, mass * rate * one, np.ones(1), 0.0, hl.Surface(hl.PTFE))


def shaken(
    moving: hl.stepping.MovingStructure, windows: int, window: float
) -> list[tuple[StructureState, float, float]]:
    """The states after each window, the force's work in it, and what damping took in it; under random forces."""
    state, before, found = moving.start(), 0.0, []
    for force in np.random.default_rng(5).normal(size=windows):
        after, moved = moving.advance(state, force, window)
        found.append((after, force * (moved - before), moving.dissipated(state, after, window)))
        state, before = after, moved
    return found


@pytest.mark.parametrize("structure", [ROD, hl.reduce(ROD, until=1e-4, tolerance=1e-6)], ids=["rod", "modes"])
@pytest.mark.parametrize("name", KEEPING)
def test_a_free_motion_keeps_its_energy(name: str, structure: hl.Structure) -> None:
    """To rounding, though it holds motions as fast as the window."""
    moving = hl.stepping.MovingStructure(structure, KEEPING[name])
    state = shaken(moving, 20, WINDOW)[-1][0]
    # The velocity that generalised-α takes for the mean starts with the accelerations of a steady force.
    state, _ = moving.advance(state._replace(memory=np.zeros(0)), 0.0, WINDOW)
    found = []
    for _ in range(300):
        state, _ = moving.advance(state, 0.0, WINDOW)
        found.append(moving.energies(state, WINDOW))
    sums = np.sum(found, axis=1)
    assert np.ptp(np.array(found)[:, 0]) > 0.1 * sums[0]
    assert abs(sums - sums[0]).max() < 1e-9 * sums[0]


@pytest.mark.parametrize(
    ("stepper", "factor"),
    [("central-difference", 1.0 - 0.8**2 / 4.0), (partial(Newmark, beta=1.0 / 6.0), 1.0 - 0.8**2 / 12.0),
     (partial(Newmark, beta=0.5), 1.0 + 0.8**2 / 4.0), ("newmark", 1.0), ("midpoint", 1.0), ("generalised-alpha", 1.0),
     (partial(Newmark, beta=0.4, gamma=0.7), 1.0)],
)  # fmt: skip
def test_elastic_energy_of_one_oscillator(stepper: str | Stepper, factor: float) -> None:
    """½ k u² (1 − (ωh)²/4) for central differences, ½ k u² (1 + (β − ¼)(ωh)²) for Newmark's, by hand; ωh = 0.8."""
    moving = hl.stepping.MovingStructure(oscillator(0.8e6, mass=3.0), stepper)
    state = StructureState(np.array([2e-6]), np.array([0.5]))
    kinetic, elastic = moving.energies(state, 1e-6)
    assert kinetic == pytest.approx(0.5 * 3.0 * 0.25, rel=1e-12)
    assert elastic == pytest.approx(0.5 * 3.0 * 0.8e6**2 * 4e-12 * factor, rel=1e-12)


def test_energy_is_the_physical_one_for_all() -> None:
    for stepper in ("midpoint", "central-difference", "newmark"):
        moving = hl.stepping.MovingStructure(oscillator(0.8e6, mass=3.0), stepper)
        state = StructureState(np.array([2e-6]), np.array([0.5]))
        assert moving.energy(state) == pytest.approx(0.375 + 1.5 * 0.8e6**2 * 4e-12, rel=1e-12)


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
    """For the midpoint and for oscillators, in every window, to rounding of the energy."""
    moving = hl.stepping.MovingStructure(DAMPED[name]())
    before, total, greatest = 0.0, 0.0, 0.0
    for state, work, taken in shaken(moving, 200, window):
        energy = sum(moving.energies(state, window))
        greatest = max(greatest, energy)
        assert before + work == pytest.approx(energy + taken, abs=1e-9 * greatest)
        assert taken > -1e-9 * greatest
        before, total = energy, total + taken
    # In the shortest run no wave has come to the dashpot.
    assert total > 0.03 * greatest or (window < WINDOW and name in ("dashpot", "coupled modes"))


@pytest.mark.parametrize("phase", [0.0, 1e-3, 0.3, 0.99])
@pytest.mark.parametrize("drag", [1e-3, 0.2, 1.0, 4.0])
def test_exact_oscillators_tell_exactly_what_damping_takes(phase: float, drag: float) -> None:
    """∫ c v² dt by quadrature of the exact motion v(t), a matrix exponential; phase ωH and drag cH/2 of one window."""
    from scipy.linalg import expm

    moving = hl.stepping.MovingStructure(oscillator(phase, 2.0 * drag))
    assert moving.modal
    start, force = StructureState(np.array([0.4]), np.array([-0.7])), 1.3
    end, _ = moving.advance(start, force, 1.0)
    generator = np.array([[0.0, 1.0, 0.0], [-(phase**2), -2.0 * drag, force], [0.0, 0.0, 0.0]])
    points, weights = np.polynomial.legendre.leggauss(40)
    rates = np.array([(expm(0.5 * (1.0 + t) * generator) @ [0.4, -0.7, 1.0])[1] for t in points])
    assert moving.dissipated(start, end, 1.0) == pytest.approx(0.5 * weights @ (2.0 * drag * rates**2), rel=1e-11)


def test_a_mass_in_a_drag_loses_its_kinetic_energy() -> None:
    """½ v² (1 − e^(−2cH)) where nothing pulls it back, by hand."""
    moving = hl.stepping.MovingStructure(oscillator(0.0, 3e3))
    start = StructureState(np.zeros(1), np.array([0.2]))
    end, _ = moving.advance(start, 0.0, 1e-4)
    assert moving.dissipated(start, end, 1e-4) == pytest.approx(0.02 * (1.0 - np.exp(-0.6)), rel=1e-12)


@pytest.mark.parametrize(
    "stepper", ["newmark", "central-difference", partial(Newmark, beta=1 / 6), "generalised-alpha"]
)
def test_the_other_steppers_close_the_balance_to_second_order(stepper: str | Stepper) -> None:
    """One damped oscillator (ω 2000/s, ζ 0.2) under a smooth force: what is missing falls with the window's square."""
    missing = []
    for steps in (200, 400, 800):
        window, moving = 5e-3 / steps, hl.stepping.MovingStructure(oscillator(2000.0, 800.0, 2.0), stepper)
        state, before, balance, taken = moving.start(), 0.0, 0.0, 0.0
        for k in range(steps):
            force = np.sin(700.0 * (k + 0.5) * window) ** 2
            after, moved = moving.advance(state, force, window)
            lost = moving.dissipated(state, after, window)
            balance, taken = balance + force * (moved - before) - lost, taken + lost
            state, before = after, moved
        missing.append(abs(balance - sum(moving.energies(state, window))) / taken)
    if stepper == "newmark":
        assert max(missing) < 1e-10
    else:
        assert np.log2(np.divide(missing[:-1], missing[1:])) == pytest.approx([2.0, 2.0], abs=0.2)
        assert missing[-1] < 1e-3


def test_nothing_is_taken_without_damping() -> None:
    moving = hl.stepping.MovingStructure(ROD)
    state, _ = moving.advance(moving.start(), 1.0, WINDOW)
    assert moving.dissipated(moving.start(), state, WINDOW) == 0.0
    wall = hl.stepping.MovingStructure(hl.half_space(hl.PTFE))
    assert wall.energies(wall.start(), WINDOW) == (0.0, 0.0)
    assert wall.dissipated(wall.start(), wall.start(), WINDOW) == 0.0
