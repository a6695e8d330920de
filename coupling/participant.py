"""What takes part in a co-simulation: state in, state out, no hidden state."""

from typing import Any, Protocol, runtime_checkable

import numpy as np

from structures.structure import Vector
from structures.surface import Surface


@runtime_checkable
class Participant(Protocol):
    """A structure that chains can face; any object with these three will do.

    Repeating `advance` with an old state repeats the window: it must return a new state and leave the old one as it
    was. With several contact points, `surface` is a tuple with one Surface for each, and force and displacement are
    arrays with one number for each. A structure that has a motor of its own says so by an attribute passive = False;
    all others are held to give back no more energy than they were given.
    """

    @property
    def surface(self) -> Surface | tuple[Surface, ...]:
        """What Hertz's law needs to know of the contact point."""
        ...

    def start(self) -> Any:
        """The state in static equilibrium, at time zero."""
        ...

    def advance(self, state: Any, force: Any, window: float) -> tuple[Any, Any]:
        """Move on by `window` s under the mean force (N) above the static one.

        Returns the new state and the displacement (m) of the contact point at its end, positive away from the
        chain and measured from static equilibrium."""
        ...


class BlackBox:
    """A user's participant, with its answers checked: every error names it.

    Raises ValueError for answers that are not (state, displacement), FloatingPointError where the displacement is
    not finite; what the participant itself raises gets a note.
    """

    def __init__(self, participant: Participant) -> None:
        self.participant, self.surface = participant, participant.surface
        self.name = type(participant).__name__
        self.contacts = len(self.surface) if isinstance(self.surface, tuple) else 1
        self.passive = bool(getattr(participant, "passive", True))

    def start(self) -> Any:
        """The state at time zero."""
        return self.participant.start()

    def advance(self, state: Any, force: Any, window: float) -> tuple[Any, Any]:
        """The participant's own answer, checked."""
        try:
            returned = self.participant.advance(state, force, window)
        except Exception as error:
            error.add_note(f"raised by {self.name}.advance(state, force = {force!r}, window = {window!r})")
            raise
        try:
            state, surface = returned
            place = float(surface) if self.contacts == 1 else np.array(surface, dtype=float)
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"{self.name}.advance returned {returned!r}: must be (state, displacement in m)"
            ) from error
        if self.contacts > 1 and np.shape(place) != (self.contacts,):
            raise ValueError(f"{self.name}.advance returned displacements {place!r}: must be {self.contacts} of them")
        if not np.isfinite(place).all():
            raise FloatingPointError(f"{self.name}.advance returned a displacement of {place!r} m")
        return state, place

    def check(self, force: float, window: float, negligible: float) -> None:
        """A ValueError where it is not at rest at the start, or does not repeat a window under a force (N).

        negligible, m: a displacement that is as good as none.
        """
        rest = self.advance(self.start(), self._pushes(0.0), window)[1]
        if np.any(np.abs(rest) > negligible):
            raise ValueError(
                f"{self.name}.advance returned a displacement of {rest!r} m from start() without force: must be 0, as "
                "displacements are measured from static equilibrium"
            )
        start, pushes = self.start(), self._pushes(force)
        first, second = (self.advance(start, pushes, window)[1] for _ in range(2))
        if np.any(first != second):
            raise ValueError(
                f"{self.name}.advance is not repeatable: from one state, force and window it came to {first!r} m and "
                f"then to {second!r} m. Keep all that changes in the state, and return a new one instead of changing "
                "the old; a solver that cannot repeat a window takes part by Explicit(tolerance=None) only"
            )

    def _pushes(self, force: float) -> float | Vector:
        return force if self.contacts == 1 else np.full(self.contacts, force)
