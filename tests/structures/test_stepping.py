"""Structures in time: order, energy, passivity, and that participants hold no state."""

import numpy as np
import pytest
from scipy import sparse

import hertzlink as hl
from structures.stepping import is_modal

ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], elements=6)


def oscillator(omega: float, damping: float = 0.0) -> hl.Structure:
    one = sparse.csr_array(np.eye(1))
    return hl.Structure(one, omega**2 * one, damping * one, np.ones(1), 0.0, hl.Surface(hl.PTFE))


def test_implicit_midpoint_has_order_two() -> None:
    """One oscillator (not in modal form) under a constant force: u = (1 − cos ωt) F/k."""
    omega, end = 1000.0, 2e-3
    structure = hl.Structure(
        sparse.csr_array(2.0 * np.eye(1)), sparse.csr_array([[2.0 * omega**2]]), None, np.ones(1), 0.0,
        hl.Surface(hl.PTFE),
    )  # fmt: skip
    errors = []
    for steps in (20, 40, 80):
        moving = hl.MovingStructure(structure)
        state, surface = moving.start(), 0.0
        for _ in range(steps):
            state, surface = moving.advance(state, 1.0, end / steps)
        errors.append(abs(surface - (1.0 - np.cos(omega * end)) / (2.0 * omega**2)))
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.2)


@pytest.mark.parametrize("damping", [0.0, 300.0, 5000.0])
def test_slow_oscillators_move_exactly(damping: float) -> None:
    """One large window equals many small ones, damped or not, to rounding."""
    moving = hl.MovingStructure(oscillator(1000.0, damping))
    assert is_modal(moving.structure)
    large, _ = moving.advance(moving.start(), 1.0, 9e-4)
    small = moving.start()
    for _ in range(300):
        small, _ = moving.advance(small, 1.0, 3e-6)
    assert small.displacement == pytest.approx(large.displacement, rel=1e-11)
    assert small.velocity == pytest.approx(large.velocity, rel=1e-9)


@pytest.mark.parametrize("structure", [ROD, oscillator(1e3), oscillator(5e7)])
def test_work_equals_energy(structure: hl.Structure) -> None:
    """Undamped: F̄ (w₁ − w₀) summed is the energy gained, to rounding, for any window."""
    moving = hl.MovingStructure(structure)
    forces = np.random.default_rng(1).normal(size=200)
    state, surface, work = moving.start(), 0.0, 0.0
    for force in forces:
        state, after = moving.advance(state, force, 1e-6)
        work, surface = work + force * (after - surface), after
    assert work == pytest.approx(moving.energy(state), rel=1e-9)


def test_an_absorbing_base_only_takes_energy() -> None:
    moving = hl.MovingStructure(hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing"))
    state = moving.start()
    for step in range(20):
        state, _ = moving.advance(state, 1.0 - np.cos(2.0 * np.pi * (step + 0.5) / 20.0), 1e-6)
    energies = [moving.energy(state)]
    for _ in range(100):
        state, _ = moving.advance(state, 0.0, 1e-6)
        energies.append(moving.energy(state))
    assert np.all(np.diff(energies) <= 1e-12 * energies[0])
    assert energies[-1] < 1e-4 * energies[0]


@pytest.mark.parametrize("structure", [ROD, oscillator(1e5)])
def test_a_window_can_be_repeated(structure: hl.Structure) -> None:
    moving = hl.MovingStructure(structure)
    state, _ = moving.advance(moving.start(), 3.0, 1e-6)
    first, second = moving.advance(state, -1.0, 1e-6), moving.advance(state, -1.0, 1e-6)
    assert np.array_equal(first[0].displacement, second[0].displacement)
    assert first[1] == second[1]


def test_bad_structures() -> None:
    one = sparse.csr_array(np.eye(1))
    with pytest.raises(ValueError, match="stiffness has shape"):
        hl.Structure(one, sparse.csr_array(np.eye(2)), None, np.ones(1), 0.0, hl.Surface(hl.PTFE))
    with pytest.raises(ValueError, match="mass: must hold finite numbers"):
        hl.Structure(sparse.csr_array([[np.inf]]), one, None, np.ones(1), 0.0, hl.Surface(hl.PTFE))
    with pytest.raises(ValueError, match="contact"):
        hl.Structure(one, one, None, np.array([np.nan]), 0.0, hl.Surface(hl.PTFE))
    with pytest.raises(ValueError, match="window = -1"):
        hl.MovingStructure(ROD).advance(hl.MovingStructure(ROD).start(), 0.0, -1.0)


def test_an_oscillator_with_the_period_of_the_window_is_seen() -> None:
    """Under a constant force it swings about F/k; its exact motion, seen once a period, would rest at zero."""
    window = 1e-6
    moving = hl.MovingStructure(oscillator(2.0 * np.pi / window))
    state, seen = moving.start(), []
    for _ in range(1000):
        state, surface = moving.advance(state, 1.0, window)
        seen.append(surface)
    assert np.mean(seen) * (2.0 * np.pi / window) ** 2 == pytest.approx(1.0, rel=1e-2)
