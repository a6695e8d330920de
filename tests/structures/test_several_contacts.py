"""Structures with several contacts: reciprocity, superposition, reduction, bad input."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import sparse

import hertzlink as hl
from structures.damping import Rayleigh, StandardLinearSolid

Array = NDArray[np.float64]

LAYERS = [hl.Layer(hl.STEEL_440C, 0.02, 0.01), hl.Layer(hl.ACRYLIC, 0.05, 0.01)]
ROD = hl.rod(LAYERS, base="contact", elements=6)


def single(structure: hl.Structure, i: int) -> hl.Structure:
    """The structure with the contact i alone."""
    return replace(
        structure, contact=structure.contact[:, i], flexibility=structure.flexibility[i], surface=structure.surface[i]
    )


def run(structure: hl.Structure, forces: Array, window: float) -> Array:
    """Displacements, windows × contacts, under forces of the same shape (of one contact without the last axis)."""
    moving = hl.stepping.MovingStructure(structure)
    state, found = moving.start(), []
    for force in forces:
        state, moved = moving.advance(state, force, window)
        found.append(moved)
    return np.array(found)


def test_a_wave_runs_from_end_to_end_of_a_rod() -> None:
    """d'Alembert: after L/c the far end of a free bar moves by twice the impulse over ρcA, the struck one by once."""
    layer = hl.Layer(hl.STEEL_440C, 0.5, 0.01)
    rod = hl.rod([layer], base="contact")
    speed = layer.material.bar_speed
    impedance, travel = layer.material.density * speed * layer.area, layer.length / speed
    window = travel / 200.0
    times = (np.arange(300) + 0.5) * window
    pulse = np.where(times < 0.4 * travel, 1.0 - np.cos(2.0 * np.pi * times / (0.4 * travel)), 0.0)
    impulse = 0.4 * travel
    for struck in (0, 1):
        forces = np.zeros((300, 2))
        forces[:, struck] = pulse
        moved = run(rod, forces, window)
        assert moved[150, struck] == pytest.approx(impulse / impedance, rel=1e-3)
        assert abs(moved[190, 1 - struck]) < 1e-3 * impulse / impedance
        assert moved[299, 1 - struck] == pytest.approx(-2.0 * impulse / impedance, rel=1e-3)


DAMPED: dict[str, Callable[[hl.Structure], hl.Structure]] = {
    "undamped": lambda body: body,
    "Rayleigh": lambda body: hl.damping.damped(body, Rayleigh(1e3, 1e-7)),
    "arms": lambda body: hl.damping.damped(body, StandardLinearSolid(0.5, 1e-5)),
    "dashpot": lambda body: replace(body, damping=sparse.diags_array(900.0 * abs(body.contact[:, 1]))),
}


@pytest.mark.parametrize("damping", DAMPED)
def test_two_contacts_are_the_sum_of_two_structures(damping: str) -> None:
    structure = DAMPED[damping](ROD)
    forces, window = np.random.default_rng(0).normal(size=(100, 2)), 2e-7
    both = run(structure, forces, window)
    for read in (0, 1):
        apart = np.zeros(100)
        for pushed in (0, 1):
            moving = hl.stepping.MovingStructure(single(structure, pushed))
            state = moving.start()
            for k, force in enumerate(forces[:, pushed]):
                state, _ = moving.advance(state, force, window)
                apart[k] += structure.contact[:, read] @ state.displacement
        assert both[:, read] == pytest.approx(apart, abs=1e-12 * abs(apart).max())


def test_compliance_is_what_forces_add_and_is_reciprocal() -> None:
    """Maxwell and Betti; and no pair of forces gains work."""
    moving, window = hl.stepping.MovingStructure(hl.damping.damped(ROD, Rayleigh(1e3, 1e-7))), 2e-7
    state, _ = moving.advance(moving.start(), np.array([1.0, -2.0]), window)
    found = moving.compliance(window)
    _, still = moving.advance(state, np.zeros(2), window)
    for i, force in enumerate(np.eye(2)):
        assert moving.advance(state, force, window)[1] - still == pytest.approx(found[:, i], abs=1e-12 * found.max())
    assert found == pytest.approx(found.T, abs=1e-12 * found.max())
    assert np.linalg.eigvalsh(found).min() > 0.0


@settings(max_examples=25, deadline=None)
@given(
    ends=st.lists(st.integers(0, ROD.size - 1), min_size=2, max_size=4, unique=True),
    window=st.floats(1e-8, 1e-4),
    seed=st.integers(0, 2**32 - 1),
)
def test_the_work_of_all_forces_is_the_energy(ends: list[int], window: float, seed: int) -> None:
    """Two to four contacts anywhere: Σ F̄ (w₁ − w₀) is what the midpoint gains and Rayleigh's damping takes."""
    columns = np.eye(ROD.size)[:, ends] * np.where(np.arange(len(ends)) % 2, -1.0, 1.0)
    body = hl.damping.damped(
        hl.Structure(ROD.mass, ROD.stiffness, None, columns, 0.0, hl.Surface(hl.PTFE)), Rayleigh(1e3, 1e-7)
    )
    moving = hl.stepping.MovingStructure(body)
    state, before, work, taken = moving.start(), np.zeros(len(ends)), 0.0, 0.0
    for force in np.random.default_rng(seed).normal(size=(30, len(ends))):
        after, moved = moving.advance(state, force, window)
        work += force @ (moved - before)
        mean = 0.5 * (state.velocity + after.velocity)
        taken += window * float(mean @ (body.damping @ mean))
        state, before = after, moved
    gain = sum(moving.energies(state))
    assert gain + taken == pytest.approx(work, rel=1e-7)


def pulses(windows: int, window: float) -> Array:
    """Raised cosines of 40 µs on contact 0, and of 30 µs, later, on contact 1."""
    times = (np.arange(windows) + 0.5) * window
    first = np.where(times < 40e-6, 1.0 - np.cos(2.0 * np.pi * times / 40e-6), 0.0)
    late = times - 60e-6
    return np.column_stack([first, np.where((late > 0) & (late < 30e-6), 1.0 - np.cos(2 * np.pi * late / 30e-6), 0.0)])


LONG = hl.rod([hl.Layer(hl.STEEL_440C, 0.3, 0.01), hl.Layer(hl.ACRYLIC, 0.2, 0.01)], base="contact")


@pytest.mark.thorough
@pytest.mark.parametrize("damping", DAMPED)
def test_reduced_answers_like_the_full_one_at_both_contacts(damping: str) -> None:
    full = DAMPED[damping](LONG)
    reduced = hl.reduce(full, until=4e-4, tolerance=1e-3)
    assert (reduced.contacts, reduced.surface) == (2, full.surface)
    assert reduced.size < full.size / 2
    forces, fading = pulses(4000, 1e-7), np.exp(-4.0 * np.arange(4000) / 4000.0)[:, None]
    for pushed in (0, 1):
        chosen = forces * (np.arange(2) == pushed)
        exact, found = run(full, chosen, 1e-7), run(reduced, chosen, 1e-7)
        own = np.linalg.norm(fading * exact, axis=0)
        error = np.linalg.norm(fading * (found - exact), axis=0)
        # Steel against acrylic: contacts that are 6 times as stiff as each other.
        assert error[pushed] < 3e-3 * own[pushed]
        assert error[1 - pushed] < 3e-3 * own[pushed] * np.array([6.0, 1.0])[pushed]
