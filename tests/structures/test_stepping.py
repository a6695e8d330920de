"""Structures in time: order, energy, passivity, and that participants hold no state."""

from typing import Any

import numpy as np
import pytest
from scipy import sparse

import hertzlink as hl
from structures.kernels import linear


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
        moving = hl.stepping.MovingStructure(structure)
        state, surface = moving.start(), 0.0
        for _ in range(steps):
            state, surface = moving.advance(state, 1.0, end / steps)
        errors.append(abs(surface - (1.0 - np.cos(omega * end)) / (2.0 * omega**2)))
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.2)


@pytest.mark.parametrize("damping", [0.0, 300.0, 5000.0])
def test_slow_oscillators_move_exactly(damping: float) -> None:
    """One large window equals many small ones, damped or not, to rounding."""
    moving = hl.stepping.MovingStructure(oscillator(1000.0, damping))
    assert moving.structure.is_modal
    large, _ = moving.advance(moving.start(), 1.0, 9e-4)
    small = moving.start()
    for _ in range(300):
        small, _ = moving.advance(small, 1.0, 3e-6)
    assert small.displacement == pytest.approx(large.displacement, rel=1e-11)
    assert small.velocity == pytest.approx(large.velocity, rel=1e-9)


def test_an_oscillator_with_the_period_of_the_window_is_seen() -> None:
    """Under a constant force it swings about F/k; its exact motion, seen once a period, would rest at zero."""
    window = 1e-6
    moving = hl.stepping.MovingStructure(oscillator(2.0 * np.pi / window))
    state, seen = moving.start(), []
    for _ in range(1000):
        state, surface = moving.advance(state, 1.0, window)
        seen.append(surface)
    assert np.mean(seen) * (2.0 * np.pi / window) ** 2 == pytest.approx(1.0, rel=1e-2)


@pytest.mark.parametrize("seats", [[0, 1], [1, 0], [-1, 0], [0, -1]])
def test_a_structure_has_the_contacts_of_the_run_where_they_are(seats: list[int]) -> None:
    body = hl.Structure(np.eye(2), np.diag([1e9, 3e9]), None, [[1.0, -0.5], [0.3, 2.0]], 0.0, hl.Surface(hl.PTFE))
    part: Any = hl.stepping.MovingStructure(body).window(1e-6)
    piece: Any = linear.joined([part], [seats], 1 + max(seats))
    for point, seat in enumerate(seats):
        if seat >= 0:
            assert piece.contact[seat].tolist() == part.contact[point].tolist()
            assert piece.response[seat].tolist() == part.response[point].tolist()


def test_a_half_space_beside_a_rod_leaves_it_oscillators() -> None:
    bodies = hl.half_space(hl.PTFE), hl.rod([hl.Layer(hl.ACRYLIC, 0.02, 0.008)], elements=3)
    parts = [hl.stepping.MovingStructure(body).window(1e-6) for body in bodies]
    assert linear.joined(parts, [[0], [1]], 2).squares.tolist() == parts[1].squares.tolist()


def test_structures_of_both_kinds_move_as_alone() -> None:
    """In one piece: motion, responses, displacements and energies are those of each."""
    rod, random = [hl.Layer(hl.ACRYLIC, 0.02, 0.008)], np.random.default_rng(1)
    bodies = [hl.rod(rod, base, elements=count) for base, count in (("absorbing", 2), ("fixed", 3), ("absorbing", 4))]
    parts = [hl.stepping.MovingStructure(body).window(1e-6) for body in bodies]
    assert [part.squares.size for part in parts] == [0, 6, 0]
    both: Any = linear.joined(parts, [[0], [1], [2]], 3)
    sizes = [part.response.shape[1] for part in parts]
    alone = [random.normal(size=size) for size in sizes]
    state, free = np.concatenate(alone), np.zeros(sum(sizes))
    pending = np.zeros(3, [("pending", float)]).view(np.recarray)
    linear.follow(both, pending, state, free)
    for k, part in enumerate(parts):
        energies = linear.energies_of_structure(part, 0, alone[k])
        assert linear.energies_of_structure(both, k, state) == pytest.approx(energies, rel=1e-12)
        assert linear.read(both, k, state) == pytest.approx(linear.read(part, 0, alone[k]), rel=1e-12)
        linear.push(both, k, 3.0, free)
    ends = np.split(free, np.cumsum(sizes)[:-1])
    for part, begin, end in zip(parts, alone, ends, strict=True):
        expected = np.zeros(begin.size)
        linear.follow(part, pending[:1], begin, expected)
        linear.push(part, 0, 3.0, expected)
        assert end == pytest.approx(expected, rel=1e-12, abs=1e-12 * abs(expected).max())
