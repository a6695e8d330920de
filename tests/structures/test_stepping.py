"""Structures in time: order, energy, passivity, and that participants hold no state."""

from decimal import Decimal, getcontext
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import expm

import hertzlink as hl
from structures.damping import Rayleigh
from structures.kernels import linear
from structures.oscillators import OscillatorStep
from structures.stepping import ImplicitMidpoint

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


def exact_window(phase: float, drag: float) -> list[list[Decimal]]:
    """exp of the generator of u, v and a steady force over a window of 1 s, to 40 digits: scaled, Taylor, squared."""
    context = getcontext()
    context.prec = 60
    halvings = int(np.ceil(np.log2(max(1.0, 4.0 * drag))))
    h, p, d, zero = Decimal(2) ** -halvings, Decimal(phase), Decimal(drag), Decimal(0)
    generator = [[zero, h, zero], [-p * h, -2 * d * h, h], [zero] * 3]

    def product(a: list[list[Decimal]], b: list[list[Decimal]]) -> list[list[Decimal]]:
        return [[sum((a[i][k] * b[k][j] for k in range(3)), zero) for j in range(3)] for i in range(3)]

    term = [[Decimal(i == j) for j in range(3)] for i in range(3)]
    total = term
    for k in range(1, 50):
        term = [[value / k for value in row] for row in product(term, generator)]
        total = [[a + b for a, b in zip(*rows, strict=True)] for rows in zip(total, term, strict=True)]
    for _ in range(halvings):
        total = product(total, total)
    return total


def test_slow_oscillators_are_exact_to_rounding() -> None:
    """Undamped to far overdamped, at rest to (ωH)² = 1, close to and at critical damping: to 4e-15."""
    phases = np.array([0.0, *10.0 ** np.arange(-18, 1, 3), 0.3])
    drags = np.array([0.0, *10.0 ** np.arange(-18, 3, 2), 0.1, 0.3, 0.499, 0.501, 0.7, 1.05, 1.12, 3.0])
    cases = np.array(
        [(p, d) for p in phases for d in (*drags, *np.sqrt(p) * np.array([1.0, 1.0 + 1e-12, 1.0 - 1e-6, 1.001]))]
    )
    diagonal = [sparse.csr_array(sparse.diags_array(values)) for values in (np.ones(len(cases)), *cases.T)]
    structure = hl.Structure(diagonal[0], diagonal[1], 2.0 * diagonal[2], np.ones(len(cases)), 0.0, hl.Surface(hl.PTFE))
    found = OscillatorStep(structure, 1.0)
    exact = np.array([[[float(x) for x in row] for row in exact_window(*case)] for case in cases])
    for got, want in (
        (found.rows[0], exact[:, 0, 0]),
        (found.rows[1], exact[:, 0, 1]),
        (found.rows[2], exact[:, 1, 0]),
        (found.response.displacement[:, 0], exact[:, 0, 2]),
        (found.response.velocity[:, 0], exact[:, 1, 2]),
    ):
        assert abs(got - want).max() > 0.0
        assert np.all(abs(got - want) <= 4e-15 * abs(want))
    # What is left of a rate goes through zero: to rounding of the two parts that are subtracted there.
    parts = np.maximum(abs(exact[:, 1, 1]), np.minimum(abs(exact[:, 0, 0]), 2.0 * cases[:, 1] * exact[:, 0, 1]))
    assert np.all(abs(found.rows[3] - exact[:, 1, 1]) <= 4e-15 * parts)


@pytest.mark.parametrize("structure", [ROD, oscillator(1e3), oscillator(5e7)])
def test_work_equals_energy(structure: hl.Structure) -> None:
    """Undamped: F̄ (w₁ − w₀) summed is the energy gained, to rounding, for any window."""
    moving = hl.stepping.MovingStructure(structure)
    forces = np.random.default_rng(1).normal(size=200)
    state, surface, work = moving.start(), 0.0, 0.0
    for force in forces:
        state, after = moving.advance(state, force, 1e-6)
        work, surface = work + force * (after - surface), after
    assert work == pytest.approx(moving.energy(state), rel=1e-9)


def test_an_absorbing_base_only_takes_energy() -> None:
    moving = hl.stepping.MovingStructure(hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing"))
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
    moving = hl.stepping.MovingStructure(structure)
    state, _ = moving.advance(moving.start(), 3.0, 1e-6)
    first, second = moving.advance(state, -1.0, 1e-6), moving.advance(state, -1.0, 1e-6)
    assert np.array_equal(first[0].displacement, second[0].displacement)
    assert first[1] == second[1]


def test_an_oscillator_with_the_period_of_the_window_is_seen() -> None:
    """Under a constant force it swings about F/k; its exact motion, seen once a period, would rest at zero."""
    window = 1e-6
    moving = hl.stepping.MovingStructure(oscillator(2.0 * np.pi / window))
    state, seen = moving.start(), []
    for _ in range(1000):
        state, surface = moving.advance(state, 1.0, window)
        seen.append(surface)
    assert np.mean(seen) * (2.0 * np.pi / window) ** 2 == pytest.approx(1.0, rel=1e-2)


def single(omega: float, mass: float = 2.0, rate: float = 0.0) -> hl.Structure:
    """One oscillator that is no mode, since its mass is not 1."""
    one = sparse.csr_array(np.eye(1))
    damping = mass * rate * one if rate else None
    return hl.Structure(mass * one, mass * omega**2 * one, damping, np.ones(1), 0.0, hl.Surface(hl.PTFE))


def greatest_errors(steps: int, rate: float) -> tuple[float, float]:
    """Of displacement and rate under 1 − cos Ωt N from rest, over 5 ms, relative to their peaks.

    The exact answer is a matrix exponential; the drive is the exact mean of the force over each window.
    """
    omega, drive, window = 2000.0, 3300.0, 5e-3 / steps
    moving = hl.stepping.MovingStructure(single(omega, 2.0, rate))
    generator = np.zeros((5, 5))
    generator[0, 1], generator[1] = 1.0, [-(omega**2), -rate, -0.5, 0.0, 0.5]
    generator[2, 3], generator[3, 2] = -drive, drive
    step, exact, state = expm(window * generator), np.array([0.0, 0.0, 1.0, 0.0, 1.0]), moving.start()
    answers, exacts = [], []
    for k in range(steps):
        mean = 1.0 - (np.sin(drive * (k + 1) * window) - np.sin(drive * k * window)) / (drive * window)
        state, surface = moving.advance(state, mean, window)
        exact = step @ exact
        answers.append((surface, state.velocity[0]))
        exacts.append(exact[:2])
    errors = abs(np.array(answers) - exacts).max(axis=0) / abs(np.array(exacts)).max(axis=0)
    return float(errors[0]), float(errors[1])


@pytest.mark.parametrize("rate", [0.0, 800.0], ids=["undamped", "damped"])
def test_order_two_under_a_smooth_force(rate: float) -> None:
    """Displacement and rate, where the force is given by its means."""
    errors = np.array([greatest_errors(steps, rate) for steps in (160, 320, 640)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders == pytest.approx(np.full((2, 2), 2.0), abs=0.2)
    assert errors[-1].max() < 1e-3


@pytest.mark.parametrize("base", ["fixed", "free", "absorbing"])
def test_damping_makes_no_energy(base: str) -> None:
    """After a push."""
    rod = hl.damped(hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base=base, elements=6), Rayleigh(1e3, 1e-7))
    moving = hl.stepping.MovingStructure(rod)
    state = moving.start()
    for step in range(20):
        state, _ = moving.advance(state, 1.0 - np.cos(2.0 * np.pi * (step + 0.5) / 20.0), 1e-6)
    found = []
    for _ in range(300):
        state, _ = moving.advance(state, 0.0, 1e-6)
        found.append(moving.energy(state))
    assert np.diff(found).max() < 1e-12 * found[0]


BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=0.31)
LAYERED = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)])


def test_a_moving_structure_is_the_structure() -> None:
    """Handed over as a participant it changes nothing, to the bit: neither compiled, nor with a spring behind it."""
    soft = hl.Structure(LAYERED.mass, LAYERED.stiffness, None, LAYERED.contact, 1e-8, LAYERED.surface)
    for structure in (soft, hl.reduce(soft, until=4e-4), hl.half_space(hl.PTFE)):
        runs = [hl.CoSimulation(CHAIN, s).run(4e-4) for s in (structure, hl.stepping.MovingStructure(structure))]
        assert runs[0].identical(runs[1])


def test_the_midpoint_is_the_default() -> None:
    assert isinstance(hl.stepping.MovingStructure(ROD).step(1e-6), ImplicitMidpoint)


@pytest.mark.parametrize("seats", [[0, 1], [1, 0], [-1, 0], [0, -1]])
def test_a_structure_has_the_contacts_of_the_run_where_they_are(seats: list[int]) -> None:
    body = hl.Structure(np.eye(2), np.diag([1e9, 3e9]), None, [[1.0, -0.5], [0.3, 2.0]], 0.0, hl.Surface(hl.PTFE))
    part: Any = hl.stepping.MovingStructure(body).window(1e-6)
    piece: Any = linear.joined([part], [seats], 1 + max(seats))
    for point, seat in enumerate(seats):
        if seat >= 0:
            assert piece.contact[seat].tolist() == part.contact[point].tolist()
            assert piece.response[seat].tolist() == part.response[point].tolist()


def test_structures_of_both_kinds_move_as_alone() -> None:
    """In one piece: motion, responses, displacements and energies are those of each."""
    rod, random = [hl.Layer(hl.ACRYLIC, 0.02, 0.008)], np.random.default_rng(1)
    bodies = [hl.rod(rod, base, elements=count) for base, count in (("absorbing", 2), ("fixed", 3), ("absorbing", 4))]
    parts = [hl.stepping.MovingStructure(body).window(1e-6) for body in bodies]
    assert [type(part) for part in parts] == [linear.Coupled, linear.Oscillators, linear.Coupled]
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
