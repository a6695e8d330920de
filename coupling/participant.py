"""Participants of a co-simulation. They take a state and return a new one; they have no hidden state."""

from math import inf
from typing import Any, Protocol, runtime_checkable

import numpy as np

from structures.checks import instance, short
from structures.structure import Structure, Vector, surfaces_of
from structures.surface import Surface

ROUNDING = 1e-9  # part of a negligible displacement; smaller motions towards the chain are rounding errors
LEAST_RESISTANCE = 1.0  # kg/s; half of force over velocity in the first window, on a plate 4√(D·m)
LARGEST_DISPLACEMENT = 1e3  # m; no structure moves so far, and with more the forces of the chain would overflow


@runtime_checkable
class Participant(Protocol):
    """A structure that chains can face. Any object with these three members works.

    `advance` returns a new state and does not change the old one, so that a call with the old state repeats the window.
    With several contact points, `surface` is a tuple of Surfaces, and force and displacement are arrays with one number
    for each point. A structure with a motor of its own sets an attribute passive = False. All others must not give back
    more energy than they received.

    Examples
    --------
    A mass of 14 g on a spring, moved exactly over a window with a constant force:

    >>> import numpy as np
    >>> class SpringMass:
    ...     surface = hl.Surface(hl.PTFE)
    ...
    ...     def start(self):
    ...         return 0.0, 0.0
    ...
    ...     def advance(self, state, force, window):
    ...         rest, omega = force / 1.7e7, np.sqrt(1.7e7 / 0.014)
    ...         x, v, c, s = state[0] - rest, state[1], np.cos(omega * window), np.sin(omega * window)
    ...         moved = rest + x * c + v * s / omega, v * c - x * s * omega
    ...         return moved, moved[0]
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 3, striker=bead, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, SpringMass(), scheme=hl.Aitken()).run(until=1e-4)
    >>> print(f"{1e6 * float(run.surface_displacement.max()):.2f} µm")
    0.30 µm
    """

    @property
    def surface(self) -> Surface | tuple[Surface, ...]:
        """Material and curvature at the contact point, for Hertz's law."""
        ...

    def start(self) -> Any:
        """Return the state in static equilibrium, at time zero."""
        ...

    def advance(self, state: Any, force: Any, window: float) -> tuple[Any, Any]:
        """Advance by `window` s under the mean force (N) above the static force.

        Returns the new state and the displacement (m) of the contact point at the end of the window, measured from
        static equilibrium and positive away from the chain."""
        ...


class CheckedParticipant:
    """A user's participant whose answers are checked. Every error names the participant."""

    structure: Structure | None = None
    """A user's participant has no matrices."""

    def __init__(self, participant: Participant) -> None:
        self.participant, self.surfaces = participant, surfaces_of(participant)
        self.name = type(participant).__name__
        if not self.surfaces or not all(isinstance(surface, Surface) for surface in self.surfaces):
            raise ValueError(
                f"{self.name}.surface = {short(participant.surface)}: must be a Surface(material), or a tuple with "
                "one for each contact point"
            )
        self.contacts = len(self.surfaces)
        self.last_forces = np.zeros(self.contacts)
        self.findings: list[str] = []
        """The findings of `check`."""
        passive = getattr(participant, "passive", True)
        self.passive: Any = instance(f"{self.name}.passive", passive, bool | np.bool_, "True or False")  # type: ignore[arg-type]
        self.start = participant.start

    def move(self, state: Any, forces: Vector, window: float) -> tuple[Any, Vector]:
        """Return the checked answer to the mean forces (N) of K contacts: the new state and K displacements, m."""
        self.last_forces, force = forces.copy(), self._as_given(forces.copy())
        returned = self.participant.advance(state, force, window)
        try:
            # An array of two numbers is not a pair of state and displacement.
            state, surface = returned if isinstance(returned, tuple | list) else ()
            place = np.array(surface)
        except (TypeError, ValueError):
            place = np.array(None)
        if place.dtype.kind not in "iuf" or place.shape != np.shape(force):
            many = f"{self.contacts} displacements" if self.contacts > 1 else "displacement"
            raise ValueError(f"{self.name}.advance returned {short(returned)}: must be (state, {many} in m)")
        if not (abs(place) <= LARGEST_DISPLACEMENT).all():
            raise FloatingPointError(
                f"{self.name}.advance returned a displacement of {surface!r} m under force = {force!r}: must be at "
                f"most {LARGEST_DISPLACEMENT:g} m"
            )
        return state, place.reshape(self.contacts).astype(float)

    def check(self, force: float, window: float, negligible: float) -> None:
        """Raise a ValueError if the participant is not at rest at the start, does not repeat a window, or moves against
        a force (N). Note one that moves more easily than a foil. negligible: a displacement that counts as zero, m."""
        self.check_rest(self.move(self.start(), np.zeros(self.contacts), window)[1], negligible)
        self.check_repeats(self.start(), np.full(self.contacts, force), window)
        light = inf
        for number, alone in enumerate(force * np.eye(self.contacts)):
            place = float(self.move(self.start(), alone, window)[1][number])
            if self.passive and place < -ROUNDING * negligible:
                point = f"contact point {number}" if self.contacts > 1 else "the contact point"
                raise ValueError(
                    f"{self.name}.advance moved {point} by {place:.3g} m, towards the chain, under {force:.3g} N from "
                    "rest; away from the chain is positive; a structure that creates energy must set passive = False"
                )
            # A free mass that moves as far from rest under this force.
            light = min(light, force * window**2 / (2.0 * place) if place > 0.0 else inf)
        self.findings = []
        if light < LEAST_RESISTANCE * window:
            self.findings = [
                f"units: {self.name} moves in a first window of {window:.3g} s like {light:.3g} kg, more easily than a "
                "foil; check its units of force, time and displacement, and that it returns a displacement"
            ]

    def check_rest(self, places: Vector, negligible: float) -> None:
        """Raise a ValueError if the displacements (m) after a first window without force are not zero."""
        if np.any(np.abs(places) > negligible):
            place = self._as_given(places)
            raise ValueError(
                f"{self.name}.advance returned a displacement of {place!r} m from start() without force: must be 0"
            )

    def check_repeats(self, state: Any, forces: Vector, window: float) -> None:
        """Raise a ValueError if a window, or the window after it, gives another result when it is repeated."""
        ends = [self.move(state, forces, window) for _ in range(2)]
        after = [self.move(end, forces, window) for end, _ in ends]
        when = ("from one state, force and window", "after a window and its repetition")
        for ((_, one), (_, other)), words in zip((ends, after), when, strict=True):
            if np.any(one != other):
                raise ValueError(
                    f"{self.name}.advance is not repeatable: {words} it returned {self._as_given(one)!r} m and then "
                    f"{self._as_given(other)!r} m; return a new state that holds all that changes, or use the scheme "
                    "Explicit(tolerance=None)"
                )

    def _as_given(self, numbers: Vector) -> Any:
        """Return K numbers in the form that the participant uses: a float if it has one contact, else an array."""
        return float(numbers[0]) if self.contacts == 1 else numbers
