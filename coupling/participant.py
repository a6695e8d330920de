"""What takes part in a co-simulation: state in, state out, no hidden state."""

from typing import Any, Protocol, runtime_checkable

from structures.surface import Surface


@runtime_checkable
class Participant(Protocol):
    """A structure that the chain can face; any object with these three will do.

    Repeating `advance` with an old state repeats the window.
    """

    @property
    def surface(self) -> Surface:
        """What Hertz's law needs to know of the contact point."""
        ...

    def start(self) -> Any:
        """The state in static equilibrium, at time zero."""
        ...

    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        """Move on by `window` s under the mean force (N) above the static one.

        Returns the new state and the displacement (m) of the contact point at its end, positive away from the
        chain and measured from static equilibrium."""
        ...
