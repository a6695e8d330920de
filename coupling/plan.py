"""The plan of a run: its windows and saved times, and the checks of these."""

from math import ceil, inf, log2
from typing import Annotated, NamedTuple

from coupling.black_box import Scheme
from coupling.interface import Interface
from coupling.results.findings import warn
from structures.caution import caution
from structures.checks import positive
from structures.described import described
from structures.quantities import OneOf, Quantity
from structures.units import readable

FEWEST_PER_CONTACT = 8  # fewer windows or saved times give a warning; AR is off by 0.2 % at 3.5, by 3 % at 1.7
SAVED_PER_CONTACT = 64  # saved times in the shortest contact by default, up to twice as many
ADAPTIVE_PER_CONTACT = 16  # the same for adaptive windows, of which none is longer than a saved interval
MOST_SAVED = 2e8  # saved times × bodies: 1.6 GB in each of the three large arrays
LARGE_ARRAYS = 3  # of saved times × bodies: displacements, velocities, and forces
LARGE_SIZE = 1e9  # bytes in these arrays above which the user is warned; results made of them may take as much again
SAME_TIME = 1e-9  # times are equal if they differ by no more than this part


class Accuracy(NamedTuple):
    """The numbers of windows and steps in units of the default; errors fall with the square of these numbers."""

    windows: float
    steps: float


ACCURACIES = {
    "default": Accuracy(1.0, 1.0),
    "screening": Accuracy(windows=40.0 / 112.0, steps=160.0 / 1800.0),
    "reference": Accuracy(4.0, 4.0),
}
"""With Condensed, screening has 40 windows and 160 steps in the shortest contact, the default 112 and 1800. Screening
changed AR by 1e-4 or less on rods, plates and half-spaces, and by 6e-4 where a light tip chatters (tests)."""

HowFine = Annotated[str, OneOf(*ACCURACIES)]


@described
class Adaptive:
    """Windows as long as their error allows; each is the saved interval divided by a power of two.

    Parameters
    ----------
    tolerance : float
        Largest error of a window. Amplitude ratios then differ from those with very short windows by at most about
        three tolerances, on light plates by fifteen (tests).

    Notes
    -----
    In a window the surface moves along a straight line. The error is the distance of this line from the parabola
    through its two ends and the end before them, in units of the greatest approach of a contact. Where nothing touches,
    a tenth of this distance counts.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 3, striker=bead, impact_speed=0.44)
    >>> rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=1e-4)
    >>> run = hl.CoSimulation(chain, rod, window=hl.Adaptive(1e-4)).run(until=1e-4)
    >>> print(f"{1e6 * float(run.surface_displacement.max()):.2f} µm")
    0.62 µm
    """

    tolerance: Annotated[float, Quantity()] = 1e-5


class Plan(NamedTuple):
    """The windows and saved times of a run."""

    length: float  # of a window, s
    stride: int  # windows in a saved interval
    rows: int  # saved times

    @property
    def total(self) -> int:
        """The number of windows of the run."""
        return (self.rows - 1) * self.stride

    @property
    def interval(self) -> float:
        """The time between saved times, s."""
        return self.length * self.stride


def plan_run(
    interface: Interface,
    scheme: Scheme,
    window: float | Adaptive | None,
    until: float,
    save_every: float | None,
    fineness: float = 1.0,
) -> Plan:
    """Return the plan of a run up to `until` s, or raise a ValueError for times that do not fit; see CoSimulation.
    fineness: factor of the number of windows that the scheme has in a contact."""
    valid = min(getattr(body.structure, "valid_until", inf) for body in interface.structures)
    if until > valid * (1.0 + SAME_TIME):
        raise ValueError(
            f"until = {until!r}: the structure was reduced for runs of at most {valid} s; reduce it for this time, "
            "or run for a shorter one"
        )
    fixed, interval = isinstance(window, float), None if save_every is None else positive("save_every", save_every, "s")
    for argument, span in (("window", window), ("save_every", interval)):
        if isinstance(span, float) and span > until:
            raise ValueError(f"{argument} = {span!r}: must not be longer than the run, until = {until!r} s")
    longest = longest_window(interface, scheme, window, fineness)
    if interval is not None:
        if fixed and interval < longest * (1.0 - SAME_TIME):
            raise ValueError(f"save_every = {save_every!r}: must not be shorter than the window, {longest:.6g} s")
        stride = 1 if isinstance(window, Adaptive) else ceil(interval / longest * (1.0 - SAME_TIME))
        length, intervals = interval / stride, until / interval
    elif fixed:
        length, stride, intervals = longest, 1, until / longest
    else:
        intervals = _power_of_two(until / max(interface.contact_time / SAVED_PER_CONTACT, longest))
        stride = _power_of_two(until / intervals / longest)
        length = until / intervals / stride

    bodies = sum(chain.rest.size for chain in interface.chains)
    name, advice = "until", "give save_every"
    if save_every is not None:
        name, advice = f"save_every = {save_every!r}", "take a longer one"
    what, size = f"{name}: {intervals:.3g} saved times of {bodies} bodies", intervals * bodies * LARGE_ARRAYS * 8.0
    if intervals * bodies > MOST_SAVED:
        raise ValueError(f"{what} are too many; {advice}")
    if size > LARGE_SIZE:
        caution(f"{what} take {1e-9 * size:.1f} GB of memory")
    return Plan(length, stride, int(intervals * (1.0 + SAME_TIME)) + 1)


def longest_window(interface: Interface, scheme: Scheme, window: float | Adaptive | None, fineness: float) -> float:
    """Return the given window, or the longest one that the scheme allows, s."""
    if isinstance(window, float):
        return window
    per_contact = ADAPTIVE_PER_CONTACT if isinstance(window, Adaptive) else fineness * scheme.windows_per_contact
    return interface.contact_time / per_contact


def warn_if_coarse(plan: Plan, interface: Interface, adaptive: bool) -> list[str]:
    """Return a finding, and warn of it, if a contact has too few windows or saved times."""
    findings = [] if adaptive else coarse("window", plan.length, interface.contact_time)
    findings = findings or coarse("save_every", plan.interval, interface.contact_time)
    warn(findings)
    return findings


def coarse(name: str, interval: float, contact_time: float) -> list[str]:
    """Return a finding if an interval is long compared with a contact, s. name: the argument of this interval."""
    longest = contact_time / FEWEST_PER_CONTACT
    if interval <= longest * (1.0 + SAME_TIME):
        return []
    error = f"a contact has {contact_time / interval:.2g} of them, and AR is off by 0.2 % with 3.5, by 3 % with 1.7"
    said = f"{name} = {readable(interval, 's')}: is coarse compared with a contact"
    return [f"{said}; {error}; take at most {readable(longest, 's')}"]


def _power_of_two(parts: float) -> int:
    """Return the next power of two: such windows can be halved, and runs of one length have the same saved times."""
    return int(2 ** max(0, ceil(log2(parts * (1.0 - SAME_TIME)))))
