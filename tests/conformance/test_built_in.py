"""hertzlink's own participants obey the rules for all participants."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from hertzlink import conformance as checks
from structures.damping import Rayleigh, StandardLinearSolid, damped

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 3, BEAD, 0.31)
FLAT = hl.Surface(hl.STEEL_440C)
ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], elements=8)
LAYERED = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)], elements=4)
SUPPORTS = hl.Supports("clamped", "clamped", "free", "free")
PLATE = hl.kirchhoff_plate(0.2, 0.2, 2.29e-3, hl.ALUMINIUM_6061, SUPPORTS, cells=(6, 6)).at(0.05, 0.1)

STRUCTURES = {
    "rod": ROD,
    "layered rod": LAYERED,
    "damped rod": damped(ROD, Rayleigh(5e2, 1e-7)),
    "rod with an absorbing base": hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing", elements=8),
    "rod with Maxwell arms": damped(ROD, StandardLinearSolid(0.3, 2e-5)),
    "plate": PLATE,
    "reduced plate": hl.reduce(PLATE, until=1e-3),
    "half-space": hl.half_space(hl.BRASS_360),
}


class Duffing:
    """m ẍ + k x + k₃ x³ = F, a black box that is not linear, by twenty steps of Runge and Kutta's method a window."""

    surface = FLAT
    mass, stiffness, cubic = 0.01, 2e7, 1e16

    def start(self) -> tuple[float, float]:
        return 0.0, 0.0

    def advance(self, state: tuple[float, float], force: float, window: float) -> tuple[tuple[float, float], float]:
        y, h = np.array(state), window / 20.0
        for _ in range(20):
            a = self._rate(y, force)
            b = self._rate(y + 0.5 * h * a, force)
            c = self._rate(y + 0.5 * h * b, force)
            d = self._rate(y + h * c, force)
            y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        return (float(y[0]), float(y[1])), float(y[0])

    def _rate(self, y: Any, force: float) -> Any:
        x, v = y
        return np.array([v, (force - self.stiffness * x - self.cubic * x**3) / self.mass])


PARTICIPANTS: dict[str, Callable[[], Any]] = {
    **{name: partial(hl.stepping.MovingStructure, structure) for name, structure in STRUCTURES.items()},
    "Duffing": Duffing,
}


class Struck:
    """A chain as a structure: the drive is the speed of the surface that it faces, the answer its impulse so far."""

    surface = FLAT

    def __init__(self, chain: hl.stepping.MovingChain) -> None:
        self.chain = chain

    def start(self) -> Any:
        return self.chain.start(), 0.0, 0.0

    def advance(self, state: Any, drive: float, window: float) -> tuple[Any, float]:
        chain, place, impulse = state
        end = place + 0.02 * drive * window
        chain, force = self.chain.advance(chain, (place, end), window)
        impulse += float(force) * window
        return (chain, end, impulse), 1e-6 * impulse


LOSSY = hl.Chain([BEAD] * 3, BEAD, 0.31, gravity=9.81, dissipation=hl.LinearDashpot(5.0))
CHAINS: dict[str, Callable[[], Any]] = {
    "chain": lambda: Struck(hl.stepping.MovingChain(CHAIN, FLAT)),
    "chain on a spring": lambda: Struck(hl.stepping.MovingChain(CHAIN, FLAT, 1e-9)),
    "chain with dashpots under gravity": lambda: Struck(hl.stepping.MovingChain(LOSSY, FLAT)),
    "chain in coarse steps": lambda: Struck(hl.stepping.MovingChain(CHAIN, FLAT, dt=1e-6)),
}

Make = Callable[[], Any]
Check = Callable[[Make], None]


def _of_made(check: Callable[[Any], None]) -> Check:
    return lambda make: check(make())


COMMON: dict[str, Check] = {
    "repeatable": _of_made(checks.check_repeatable),
    "independent": _of_made(checks.check_independent),
    "pickles": _of_made(checks.check_pickles),
    "finite": _of_made(checks.check_finite),
    "deterministic": checks.check_deterministic,
}

OF_STRUCTURES = {
    **COMMON,
    "splits": _of_made(checks.check_splits),
    "passive": _of_made(checks.check_passive),
    "at rest": _of_made(checks.check_starts_at_rest),
}


def _splits_as_a_chain(make: Make) -> None:
    """Whole steps fill a window, so their length differs between a window and its halves. Dashpots begin to act as
    beads meet, which steps resolve to first order."""
    lossy = make().chain.chain.dissipation is not None
    checks.check_splits(make(), checks.WINDOW, rounding=2e-3 if lossy else 1e-5)


OF_CHAINS = {**COMMON, "splits": _splits_as_a_chain}


@pytest.mark.parametrize(
    ("make", "check"),
    [
        pytest.param(make, check, id=f"{name}-{what}")
        for makers, owed in ((PARTICIPANTS, OF_STRUCTURES), (CHAINS, OF_CHAINS))
        for name, make in makers.items()
        for what, check in owed.items()
    ],
)
def test_it_keeps_what_it_owes(make: Make, check: Check) -> None:
    check(make)


def test_a_chain_that_changes_its_old_state_is_caught() -> None:
    class Broken(hl.stepping.MovingChain):
        def advance(self, state: Any, surface_motion: Any, window: float) -> Any:
            moved, force = super().advance(state, surface_motion, window)
            state.velocity[:] = moved.velocity
            return moved, force

    with pytest.raises(AssertionError):
        checks.check_repeatable(Struck(Broken(hl.Chain([BEAD], BEAD, 0.31), FLAT)))
