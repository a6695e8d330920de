"""Explicit coupling: one exchange a substep, for participants that cannot repeat a window."""

from dataclasses import dataclass
from math import inf

import numpy as np

from coupling.interface import Interface
from coupling.schemes.condensed import TOLERANCES, trial_force
from coupling.state import CoupledState, NotConverged, foretold
from structures.checks import instance, whole, within
from structures.structure import Vector

MOST_ORDER = 2

MOST_MADE = 0.05
"""Part of the impact energy; what makes or loses more of it is no longer the motion of the bodies."""


@dataclass(frozen=True)
class Explicit:
    """One exchange a substep: the structures are pushed by forces foretold from the last substeps.

    predictor: order of the polynomial through the last mean forces, 0 to 2; 0 repeats the last one, which makes the
    scheme of first order, 1 and 2 are of second. parallel: both sides move at once, the chains against surfaces that
    are foretold alike; else, in series, they follow the surfaces' new motion. Explicit schemes create or lose energy,
    see the run's ledger.
    tolerance: the greatest difference between foretold and answered forces, in units of the greatest force that the
    contact could bear; where it is larger the substep is halved. That stops a scheme that grows unstable on a light
    structure, but seldom rescues it: its forces are foretold from the longer substeps before. A force that jumps, as
    where a contact with a dashpot closes, stays as wrong however short the substep, and is let through once its impulse
    is small. None takes every substep as it is, as a participant must that cannot repeat one.
    """

    predictor: int = 1
    parallel: bool = False
    tolerance: float | None = 1e-2
    substeps_per_contact = 512
    whole_window = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "predictor", whole("predictor", self.predictor, 0))
        if self.predictor > MOST_ORDER:
            raise ValueError(f"predictor = {self.predictor!r}: must be 0, 1 or 2")
        instance("parallel", self.parallel, bool, "True or False")
        if self.tolerance is not None:
            object.__setattr__(self, "tolerance", within("tolerance", self.tolerance, *TOLERANCES))

    @property
    def repeats(self) -> bool:
        """Whether it repeats windows."""
        return self.tolerance is not None

    def start(self, interface: Interface) -> Vector:
        """Where the chains saw the surfaces last, m."""
        return np.zeros(interface.size)

    def step(self, interface: Interface, state: CoupledState, length: float, substeps: int) -> list[CoupledState]:
        """From one substep's end to the next. Raises NotConverged where the forces were foretold badly."""
        force = trial_force(interface, state, length, self.predictor)
        pushed, surface = interface.push(state.structures, force, length)
        seen, past = surface, state.past
        if self.parallel:
            seen = self._foretold_surface(state, length)
            # The chains go on from where they saw the surfaces last, or their jumps would do work unseen.
            past = (*past[:-1], past[-1]._replace(surface=state.memory)) if past else ()
        followed, answer, work = interface.follow(state.chains, past, seen, length)
        wrong = float(abs(answer - force).max())
        enough = self._enough(interface, length)
        if wrong > enough:
            raise NotConverged(
                f"foretold force {wrong:.3g} N beside the answer, tolerance {enough:.3g} N", evaluations=1
            )
        end = interface.next(state, length, followed, pushed, surface, force, (answer, work), seen, 1)
        made = float(abs((end.ledger.given - end.ledger.work).sum())) / interface.impact_energy
        if self.tolerance is not None and made > MOST_MADE:
            raise NotConverged(f"the exchange has made or lost {made:.2g} of the impact energy", evaluations=1)
        return [end]

    def _enough(self, interface: Interface, length: float) -> float:
        """The greatest difference between foretold and answered forces, N; in short substeps its impulse counts."""
        if self.tolerance is None:
            return inf
        usual = interface.contact_time / self.substeps_per_contact
        return self.tolerance * interface.force_scale * max(1.0, usual / length)

    def _foretold_surface(self, state: CoupledState, length: float) -> Vector:
        past = state.past
        if not past:
            return state.surface
        times, places = [node.time for node in past], [node.surface for node in past]
        if len(past) < MOST_ORDER + 1:
            times, places = [times[0] - past[0].length, *times], [np.zeros_like(state.surface), *places]
        return foretold(times, places, self.predictor, state.time + length)
