"""What takes part in a co-simulation: state in, state out, no hidden state."""

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from coupling.state import NotConverged
from structures.checks import short
from structures.structure import Vector
from structures.surface import Surface

ROUNDING = 1e-9
"""Part of a negligible displacement that is rounding."""

FARTHEST = 1e3
"""m; no structure gives way so far, and the chain's forces would overflow."""


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

    Raises ValueError for a surface that is none, a `passive` that is not True or False, and answers that are not
    (state, displacement); FloatingPointError where the displacement is not finite, or absurdly far. What the
    participant itself raises gets a note; of a FloatingPointError it ends the message, and of a NotConverged, which
    becomes a RuntimeError.
    """

    def __init__(self, participant: Participant) -> None:
        self.participant, self.surface = participant, participant.surface
        self.last_force: Any = None
        self.name = type(participant).__name__
        surfaces = self.surface if isinstance(self.surface, tuple) else (self.surface,)
        if not surfaces or not all(isinstance(one, Surface) for one in surfaces):
            raise ValueError(
                f"{self.name}.surface = {short(self.surface)}: must be a Surface(material), or a tuple with one for "
                "each contact point"
            )
        self.contacts = len(surfaces)
        self.passive = getattr(participant, "passive", True)
        if not isinstance(self.passive, bool | np.bool_):
            raise ValueError(f"{self.name}.passive = {short(self.passive)}: must be True or False")

    def start(self) -> Any:
        """The state at time zero."""
        try:
            return self.participant.start()
        except Exception as error:
            error.add_note(f"raised by {self.name}.start()")
            raise

    def advance(self, state: Any, force: Any, window: float) -> tuple[Any, Any]:
        """The participant's own answer, checked."""
        force = force if self.contacts == 1 else np.array(force)
        self.last_force = force if self.contacts == 1 else force.copy()
        try:
            returned = self.participant.advance(state, force, window)
        except Exception as error:
            told = f"raised by {self.name}.advance(state, force = {force!r}, window = {window!r})"
            # The loop over windows would take these two for its own.
            if isinstance(error, FloatingPointError):
                raise FloatingPointError(f"{error}, {told}") from error
            if isinstance(error, NotConverged):
                raise RuntimeError(f"{error}, {told}") from error
            error.add_note(told)
            raise
        try:
            state, surface = returned
            place = np.array(surface)
        except (TypeError, ValueError) as error:
            raise self._wrong(returned) from error
        if place.dtype.kind not in "iuf" or place.shape != self._pushes(0.0).shape:
            raise self._wrong(returned)
        if not (abs(place) <= FARTHEST).all():
            raise FloatingPointError(
                f"{self.name}.advance returned a displacement of {surface!r} m under force = {force!r}: must be at "
                f"most {FARTHEST:g} m"
            )
        return state, float(place) if self.contacts == 1 else place.astype(float)

    def check(self, force: float, window: float, negligible: float) -> None:
        """A ValueError where it is not at rest at the start, does not repeat a window, or moves against a force (N).

        negligible, m: a displacement that is as good as none.
        """
        self.check_rest(self._once(self.start(), self._pushes(0.0), window)[1], negligible)
        self.check_repeats(self.start(), self._pushes(force), window)
        if self.passive:
            for number in range(self.contacts):
                self._check_direction(number, force, window, ROUNDING * negligible)

    def check_rest(self, place: Any, negligible: float) -> None:
        """A ValueError where a first window without force did not end as good as at rest, at displacements (m)."""
        if np.any(np.abs(place) > negligible):
            raise ValueError(
                f"{self.name}.advance returned a displacement of {place!r} m from start() without force: must be 0, as "
                "displacements are measured from static equilibrium"
            )

    def check_repeats(self, state: Any, force: Any, window: float) -> None:
        """A ValueError where a window, or what follows it, comes to something else the second time."""
        ends, places = zip(*(self._once(state, force, window) for _ in range(2)), strict=True)
        self._check_repeated(places, "from one state, force and window")
        self._check_repeated([self._once(end, force, window)[1] for end in ends], "after a window and its repetition")

    def _check_repeated(self, places: Sequence[Any], told: str) -> None:
        first, second = places
        if np.any(first != second):
            raise ValueError(
                f"{self.name}.advance is not repeatable: {told} it came to {first!r} m and then to {second!r} m. Keep "
                "all that changes in the state, and return a new one instead of changing the old; a solver that cannot "
                "repeat a window takes part by Explicit(tolerance=None) only"
            )

    def _check_direction(self, number: int, force: float, window: float, rounding: float) -> None:
        """From rest, a point that is pushed alone can but give way: else the structure gives energy at once."""
        pushes = np.zeros(self.contacts)
        pushes[number] = force
        place = float(np.ravel(self._once(self.start(), pushes.reshape(self._pushes(0.0).shape), window)[1])[number])
        if place < -rounding:
            point = f"contact point {number}" if self.contacts > 1 else "the contact point"
            raise ValueError(
                f"{self.name}.advance moved {point} by {place:.3g} m, towards the chain, under {force:.3g} N from rest "
                f"for {window:.3g} s; displacements are positive away from the chain. A structure that gives "
                "energy says passive = False"
            )

    def _once(self, state: Any, pushes: Vector, window: float) -> tuple[Any, Any]:
        """One window under forces of any shape, a float where there is one."""
        return self.advance(state, float(pushes) if self.contacts == 1 else pushes, window)

    def _pushes(self, force: float) -> Vector:
        """The same force on all contact points."""
        return np.full(() if self.contacts == 1 else self.contacts, force)

    def _wrong(self, returned: Any) -> ValueError:
        many = f"{self.contacts} displacements" if self.contacts > 1 else "displacement"
        return ValueError(f"{self.name}.advance returned {short(returned)}: must be (state, {many} in m)")
