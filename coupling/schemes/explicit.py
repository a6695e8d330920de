"""Explicit coupling: one exchange a substep, for participants that cannot repeat a window."""

from math import inf
from typing import Annotated

import numpy as np

from coupling.interface import Interface
from coupling.schemes.condensed import trial_force
from coupling.schemes.scheme import Scheme, Tolerance
from coupling.state import CoupledState, NotConverged, predicted
from structures.described import described
from structures.quantities import Count
from structures.structure import Vector

MOST_ORDER = 2
"""Order of a predictor; polynomials of higher order are unstable."""

MOST_MADE = 0.05
"""Part of the impact energy; what makes or loses more of it is no longer the motion of the bodies."""


@described
class Explicit(Scheme):
    """One exchange for each substep: forces predicted from the last substeps push the structures.

    Parameters
    ----------
    predictor : int
        Order of the polynomial through the last mean forces, 0 to 2. 0 repeats the last force, and the scheme is of
        first order; with 1 and 2 it is of second order.
    parallel : bool
        Whether both sides move at once, the chains against predicted surfaces. Else, in series, the chains follow the
        new motion of the surfaces.
    tolerance : float or None
        The greatest difference between predicted and answered forces, in units of the greatest force that the contact
        could bear. The substep is halved where it is exceeded. None accepts every substep, for a participant that
        cannot repeat one.

    Notes
    -----
    Explicit schemes create or lose energy, see interface_mismatch in the result. The tolerance stops a scheme that
    becomes unstable on a light structure, but seldom rescues it, because its forces are predicted from the longer
    substeps before. A force that jumps, as where a contact with a dashpot closes, remains wrong in any substep; it is
    accepted once its impulse is small.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.Explicit(tolerance=None)
    Explicit(predictor=1, parallel=False, tolerance=None)
    """

    predictor: Annotated[int, Count(0, MOST_ORDER)] = 1
    parallel: bool = False
    tolerance: Tolerance | None = 1e-2
    substeps_per_contact = 512

    @property
    def repeats(self) -> bool:
        """True if it repeats windows."""
        return self.tolerance is not None

    def start(self, interface: Interface) -> Vector:
        """Return the displacements of the surfaces that the chains last followed, m."""
        return np.zeros(interface.size)

    def step(self, interface: Interface, state: CoupledState, length: float, substeps: int) -> list[CoupledState]:
        """Advance from one substep's end to the next. Raises NotConverged where the prediction was poor."""
        force = trial_force(interface, state, length, self.predictor)
        pushed, surface = interface.push(state.structures, force, length)
        target, past = surface, state.past
        if self.parallel:
            target = self._predicted_surface(state, length)
            # The chains continue from the last surfaces that they followed; jumps would do work that is not counted.
            past = (*past[:-1], past[-1]._replace(surface=state.memory)) if past else ()
        followed, answer, work = interface.follow(state.chains, past, target, length)
        wrong, enough = float(abs(answer - force).max()), inf
        if self.tolerance is not None:
            # In short substeps the impulse counts.
            usual = interface.contact_time / self.substeps_per_contact
            enough = self.tolerance * interface.force_scale * max(1.0, usual / length)
        if wrong > enough:
            raise NotConverged(
                f"the predicted force differs by {wrong:.3g} N from the answer, tolerance {enough:.3g} N", evaluations=1
            )
        end = interface.next(state, length, followed, pushed, surface, force, (answer, work), target, 1)
        gained = float(abs((end.ledger.given - end.ledger.work).sum())) / interface.impact_energy
        if self.tolerance is not None and gained > MOST_MADE:
            raise NotConverged(f"the exchange has made or lost {gained:.2g} of the impact energy", evaluations=1)
        return [end]

    def _predicted_surface(self, state: CoupledState, length: float) -> Vector:
        past = state.past
        if not past:
            return state.surface
        times, places = [node.time for node in past], [node.surface for node in past]
        if len(past) < MOST_ORDER + 1:
            times, places = [times[0] - past[0].length, *times], [np.zeros_like(state.surface), *places]
        return predicted(times, places, self.predictor, state.time + length)
