"""The protocol of a coupling scheme: for one window it finds the mean forces on which chains and structures agree."""

from typing import Annotated, Any, Protocol, runtime_checkable

from coupling.interface import Interface
from coupling.state import CoupledState
from structures.checks import has_members, instance, whole
from structures.quantities import Quantity

Tolerance = Annotated[float, Quantity(low=1e-14, high=1.0)]
"""Of forces, in units of the greatest one; below the range lies rounding."""

FLAGS, METHODS = ("repeats", "whole_window"), {"start": 1, "step": 4}
MEMBERS = ("substeps_per_contact", *FLAGS, *METHODS)
"""What makes an object a scheme."""

SUBSTEPS_PER_CONTACT = 112
"""Substeps in the shortest contact's duration, where both sides agree on every one of them. With 64 the worst amplitude
ratio found, on a tip of one bead's mass that chatters, was off by 3e-4; the error falls with the square."""


@runtime_checkable
class Scheme(Protocol):
    """What CoSimulation needs of a coupling scheme; any object with these five members works.

    For one window a scheme finds the mean forces (N, one for each of the K contacts) on which chains and structures
    agree. It moves the structures by `interface.push`, the chains by `interface.follow`, and joins both sides to the
    next state by `interface.next`. States are never changed in place: a window that fails is repeated from the old
    state, with half the length.

    Attributes
    ----------
    substeps_per_contact : int
        Substeps in the shortest contact that are enough for this scheme.
    repeats : bool
        Whether it repeats a window from the same state, which needs participants that can.
    whole_window : bool
        Whether it solves for all substeps of a window together. If not, each substep is a window.

    Examples
    --------
    A scheme of one's own, which takes the forces of the last substep for the next one:

    >>> import hertzlink as hl
    >>> class Lagged:
    ...     substeps_per_contact, repeats, whole_window = 512, False, False
    ...
    ...     def start(self, interface):
    ...         return None
    ...
    ...     def step(self, interface, state, length, substeps):
    ...         force = state.past[-1].force if state.past else state.force
    ...         structures, surface = interface.push(state.structures, force, length)
    ...         chains, answer, work = interface.follow(state.chains, state.past, surface, length)
    ...         return [interface.next(state, length, chains, structures, surface, force, (answer, work), None, 1)]
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 3, striker=bead, impact_speed=0.44)
    >>> rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=1e-4)
    >>> run = hl.CoSimulation(chain, rod, scheme=Lagged()).run(until=1e-4)
    >>> print(f"{1e6 * float(run.surface_displacement.max()):.2f} µm")
    0.62 µm
    """

    @property
    def substeps_per_contact(self) -> int:
        """Substeps in the shortest contact that are enough for this scheme."""
        ...

    @property
    def repeats(self) -> bool:
        """True if it repeats a window from the same state."""
        ...

    @property
    def whole_window(self) -> bool:
        """True if it solves for all substeps of a window together."""
        ...

    def start(self, interface: Interface) -> Any:
        """Return memory of the first window, any object; a ValueError where the scheme cannot serve this interface."""
        ...

    def step(self, interface: Interface, state: CoupledState, length: float, substeps: int) -> list[CoupledState]:
        """The states at the ends of the substeps, each of `length` s. Raises NotConverged; the window is then cut."""
        ...


def check_scheme(name: str, scheme: Any) -> None:
    """Raise a ValueError for what is no Scheme; it names the members that are missing or wrong."""
    has_members(name, scheme, ("substeps_per_contact", *FLAGS), METHODS, "a scheme such as Condensed() or Aitken()")
    own = type(scheme).__name__
    whole(f"{own}.substeps_per_contact", scheme.substeps_per_contact)
    for flag in FLAGS:
        instance(f"{own}.{flag}", getattr(scheme, flag), bool, "True or False")
