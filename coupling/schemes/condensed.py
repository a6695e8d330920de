"""Coupling schemes: each finds, for one window, the mean forces on which chains and structures agree."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from coupling.interface import Interface
from coupling.state import CoupledState, NotConverged, foretold
from structures.checks import within
from structures.structure import Vector

SUBSTEPS_PER_CONTACT = 112
"""Substeps in the shortest contact's duration, where both sides agree on every one of them. With 64 the worst amplitude
ratio found, on a tip of one bead's mass that chatters, was off by 3e-4; the error falls with the square."""

TOLERANCES = 1e-14, 1.0
"""Below lies rounding."""

MOST_TRIALS = 40


class Scheme(Protocol):
    """One window of both sides."""

    @property
    def substeps_per_contact(self) -> int:
        """So many substeps of the shortest contact's duration are enough for it."""
        ...

    @property
    def repeats(self) -> bool:
        """Whether it repeats windows, and needs participants that can."""
        ...

    @property
    def whole_window(self) -> bool:
        """Whether it solves for all substeps of a window together; else a window of several is several windows."""
        ...

    def start(self, interface: Interface) -> Any:
        """What the first window starts from; a ValueError where the scheme cannot serve this interface."""
        ...

    def step(self, interface: Interface, state: CoupledState, length: float, substeps: int) -> list[CoupledState]:
        """The states at the ends of the substeps of `length` s that make a window. Raises NotConverged."""
        ...


@dataclass(frozen=True)
class Condensed:
    """Strong coupling with one structural solve a window, for structures that are linear.

    The surfaces end a window at w_free + C F̄ with C known beforehand. One contact takes a scalar secant on F̄ over the
    cheap chain window, several contacts Newton's method with C and a secant slope for each. The interface creates no
    energy: the surface moves linearly, and the structure is driven by the mean force of the chain's own steps.
    tolerance: of the mean force, in units of the greatest force that the contact could bear.
    """

    tolerance: float = 1e-11
    substeps_per_contact = SUBSTEPS_PER_CONTACT
    repeats = True
    whole_window = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "tolerance", within("tolerance", self.tolerance, *TOLERANCES))

    def start(self, interface: Interface) -> Vector:
        """Of one contact what `MovingChain.advance_condensed` calls guess, of several the slopes of their secants."""
        if interface.boxes:
            name = interface.boxes[0].name
            raise ValueError(f"scheme = {self!r}: needs a Structure; use Aitken() for a solver of your own ({name})")
        return np.array([0.0, -1.0, 0.0, 0.0]) if self._scalar(interface) else np.zeros(interface.size)

    def step(self, interface: Interface, state: CoupledState, length: float, substeps: int) -> list[CoupledState]:
        """From one window's end to the next. Raises NotConverged."""
        solve = self._scalar_step if self._scalar(interface) else self._dense_step
        return [solve(interface, state, length)]

    def _scalar(self, interface: Interface) -> bool:
        return interface.single and not interface.quadratic

    def _scalar_step(self, interface: Interface, state: CoupledState, length: float) -> CoupledState:
        chain, structure = interface.chains[0], interface.structures[0]
        tolerance = self.tolerance * chain.force_scale
        free = structure.free(state.structures[0], length)
        memory, before, compliance = state.memory.copy(), float(state.surface[0]), structure.compliance(length)
        moved, force, count, residual = chain.advance_condensed(
            state.chains[0], (before, structure.read(free)), compliance, length, memory, tolerance
        )
        if abs(residual) > tolerance:
            raise NotConverged(
                f"residual {residual:.3g} N after {count} evaluations, tolerance {tolerance:.3g} N", evaluations=count
            )
        end = structure.pushed(free, force, length)
        surface, push = np.array([structure.read(end)]), np.array([force])
        # The chain saw the surface end where the force before its last answer would have brought it.
        work = push * (surface - compliance * residual - before)
        return interface.next(
            state, length, (moved,), (end,), surface, push, (push, work), memory, count, abs(residual)
        )

    def _dense_step(self, interface: Interface, state: CoupledState, length: float) -> CoupledState:
        """Newton's method on r(F) = G(w_free + C F) − F with G the chains' mean forces, its slopes by secants."""
        tolerance = self.tolerance * interface.force_scale
        free = [s.free(one, length) for s, one in zip(interface.structures, state.structures, strict=True)]
        at_rest, compliance = interface.read(free), interface.compliance(length)
        slope, identity = state.memory.copy(), np.eye(interface.size)
        force = trial_force(interface, state, length)
        last_surface, last_answer = at_rest, force
        for count in range(1, MOST_TRIALS + 1):
            surface = at_rest + compliance @ force
            moved, answer, work = interface.follow(state.chains, state.past, surface, length)
            residual = answer - force
            if not abs(residual).max() > tolerance:
                pushed = interface.pushed(free, force, length)
                return interface.next(state, length, moved, pushed, surface, force, (answer, work), slope, count)
            if count > 1:
                way = surface - last_surface
                seen = abs(way) > 1e-14 * interface.indentation_scale
                slope[seen] = np.minimum((answer - last_answer)[seen] / way[seen], 0.0)
            last_surface, last_answer = surface, answer
            force = force + np.linalg.solve(identity - slope[:, None] * compliance, residual)
        worst = int(abs(residual).argmax())
        raise NotConverged(
            f"residual {residual[worst]:.3g} N at contact {worst} after {count} evaluations, "
            f"tolerance {tolerance:.3g} N",
            evaluations=count,
        )


def trial_force(interface: Interface, state: CoupledState, length: float, order: int = 2) -> Vector:
    """Mean forces (N) over the coming substep, foretold from the last ones; no pull on a surface."""
    past = state.past
    if not past:
        return np.zeros(interface.size)
    middles = [node.time - node.length / 2.0 for node in past]
    guess = foretold(middles, [node.force for node in past], order, state.time + length / 2.0)
    forces: Vector = np.maximum(guess, -interface.static)
    return forces
