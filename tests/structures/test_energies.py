"""The energy that a structure keeps, and what damping takes of it."""

from collections.abc import Callable

import numpy as np
import pytest

import hertzlink as hl
from structures.damping import Modal, Rayleigh, StandardLinearSolid
from structures.stepping import StructureState

LAYERS = [hl.Layer(hl.STEEL_440C, 0.01, 0.01), hl.Layer(hl.ACRYLIC, 0.05, 0.01)]
ROD = hl.rod(LAYERS, elements=6)
WINDOW = 4e-7
"""s. The fastest motion of the rod turns by some 5 rad in it."""


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


DAMPED: dict[str, Callable[[], hl.Structure]] = {
    "Rayleigh": lambda: hl.damping.damped(ROD, Rayleigh(1e4, 1e-7)),
    "dashpot": lambda: hl.rod(LAYERS, base="absorbing", elements=6),
    "arms": lambda: hl.damping.damped(ROD, StandardLinearSolid(0.5, 1e-6)),
    "modes": lambda: hl.damping.damped(hl.reduce(ROD, until=1e-4, tolerance=1e-6), Modal(0.05)),
    "overdamped modes": lambda: hl.damping.damped(hl.reduce(ROD, until=1e-4, tolerance=1e-6), Modal(3.0)),
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
