"""What the coupling schemes have in common: for one window each finds the mean forces on which both sides agree."""

from abc import ABC, abstractmethod
from typing import Annotated, Any

from coupling.interface import Interface
from coupling.state import CoupledState
from structures.quantities import Quantity

Tolerance = Annotated[float, Quantity(low=1e-14, high=1.0)]
"""Of forces, in units of the greatest one; below the range lies rounding."""


class Scheme(ABC):
    """A coupling scheme. States are never changed in place: a window that fails is repeated from the old state, with
    half the length."""

    substeps_per_contact = 112
    """Substeps in the shortest contact's duration that are enough, where both sides agree on every one of them. With 64
    the worst amplitude ratio found, on a tip of one bead's mass that chatters, was off by 3e-4; the error falls with
    the square."""

    whole_window = False
    """Whether it solves for all substeps of a window together. If not, each substep is a window."""

    @property
    def repeats(self) -> bool:
        """True if it repeats a window from the same state, which needs participants that can."""
        return True

    def start(self, interface: Interface) -> Any:
        """Return memory of the first window; a ValueError where the scheme cannot serve this interface."""
        return None

    @abstractmethod
    def step(self, interface: Interface, state: CoupledState, length: float, substeps: int) -> list[CoupledState]:
        """The states at the ends of the substeps, each of `length` s. Raises NotConverged; the window is then cut."""
