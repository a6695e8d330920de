"""Coupling schemes: each finds, for one window, the mean force on which chain and structure agree."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from coupling.participant import Participant
from particles.moving import ChainState, MovingChain
from structures.checks import positive, whole
from structures.moving import MovingStructure
from structures.structure import Vector


class NotConverged(RuntimeError):
    """Chain and structure did not agree on the mean force of a window."""


class CoupledState(NamedTuple):
    """Everything at a window's end: the states of both sides, and what the scheme remembers.

    surface, m: displacement of the contact point. force, N: mean over the window, above the static one.
    evaluations: chain windows tried. residual, N. memory: numbers that the scheme starts the next window from.
    """

    chain: ChainState
    structure: Any
    surface: float
    force: float
    evaluations: int
    residual: float
    memory: Vector


class Scheme(Protocol):
    """One window of both participants."""

    def step(self, chain: MovingChain, structure: Any, state: CoupledState, window: float) -> CoupledState:
        """From one window's end to the next."""
        ...


@dataclass(frozen=True)
class Condensed:
    """Strong coupling with one structural solve a window, for structures that are linear.

    The surface ends a window at w_free + c F̄ with c known beforehand, so a scalar secant on F̄ over the cheap
    chain window closes the loop. The interface creates no energy: the surface moves linearly, and the structure is
    driven by the mean force of the chain's own steps.
    tolerance: of the mean force, in units of the greatest force that the contact could bear.
    """

    tolerance: float = 1e-10

    def __post_init__(self) -> None:
        object.__setattr__(self, "tolerance", positive("tolerance", self.tolerance))

    def step(self, chain: MovingChain, structure: MovingStructure, state: CoupledState, window: float) -> CoupledState:
        """From one window's end to the next. Raises NotConverged."""
        tolerance = self.tolerance * chain.force_scale
        free = structure.free(state.structure, window)
        memory = state.memory.copy()
        moved, force, count, residual = chain.advance_condensed(
            state.chain, (state.surface, structure.read(free)), structure.compliance(window), window, memory, tolerance
        )
        if abs(residual) > tolerance:
            raise NotConverged(f"residual {residual:.3g} N after {count} evaluations, tolerance {tolerance:.3g} N")
        end = structure.pushed(free, force, window)
        return CoupledState(moved, end, structure.read(end), force, count, residual, memory)


@dataclass(frozen=True)
class Aitken:
    """Fixed-point iteration on the mean force with Aitken's relaxation, for structures that are black boxes.

    (Küttler and Wall, Comput. Mech. 43 (2008) 61, section 3.2.) Each iteration repeats the window on both sides.
    tolerance: of the mean force, in units of the greatest force that the contact could bear. relaxation: the
    factor of the first iteration. A zero residual, as of an open gap, ends the iteration.
    """

    tolerance: float = 1e-9
    relaxation: float = 0.5
    largest_count: int = 50

    def __post_init__(self) -> None:
        object.__setattr__(self, "tolerance", positive("tolerance", self.tolerance))
        object.__setattr__(self, "relaxation", positive("relaxation", self.relaxation))
        object.__setattr__(self, "largest_count", whole("largest_count", self.largest_count))

    def step(self, chain: MovingChain, structure: Participant, state: CoupledState, window: float) -> CoupledState:
        """From one window's end to the next. Raises NotConverged."""
        tolerance = self.tolerance * chain.force_scale
        tried, factor, last = float(state.memory[0]), self.relaxation, 0.0
        for count in range(1, self.largest_count + 1):
            moved, surface = _answer(structure.advance(state.structure, tried, window))
            struck, force = chain.advance(state.chain, (state.surface, surface), window)
            residual = force - tried
            if not abs(residual) > tolerance:
                memory = np.array([force, factor])
                return CoupledState(struck, moved, surface, force, count, residual, memory)
            if count > 1 and residual != last:
                factor *= -last / (residual - last)
            tried, last = tried + factor * residual, residual
        raise NotConverged(f"residual {residual:.3g} N after {count} iterations, tolerance {tolerance:.3g} N")


def _answer(returned: Any) -> tuple[Any, float]:
    """What a structure's advance returned, or a ValueError where it is not (state, displacement)."""
    try:
        state, surface = returned
        return state, float(surface)
    except (TypeError, ValueError) as error:
        raise ValueError(f"structure.advance returned {returned!r}: must be (state, displacement in m)") from error
