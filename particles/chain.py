"""A chain of beads and what sets it in motion, as data; `MovingChain` moves it."""

import inspect
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import asdict, dataclass
from math import pi, sin
from typing import Any

import numpy as np

from particles.bead import Bead
from particles.dissipation import Dissipation
from particles.excitation import Excitation, Piston, PushedBead, SpringLoaded
from particles.laws.formulas import ContactLaw
from structures.checks import instance, listed, not_negative, one_of, turn, within
from structures.plausible import likely
from structures.structure import Vector

INTEGRATORS = ("verlet", "rk4")

STILL = 1e-2
"""m/s, the scale of speeds in a chain that is at rest."""


@dataclass(frozen=True)
class Chain:
    """Beads in a row, the first one struck, the last one facing a structure.

    beads: from the struck end on, of any kind and mixed. striker: a bead that arrives free, at impact_speed (m/s), at
    time zero; or a SpringLoaded striker, a PushedBead or a Piston, which bring their own and take no impact_speed; or
    None: the first bead itself starts at impact_speed, by default at rest.
    gravity, m/s², acts on a chain whose axis, from the striker to the structure, falls at an angle of `inclination`
    (rad) to the horizontal: π/2 by default, the striker on top. preload, N: a static force along the chain, held
    constant by a dead load on the first bead, or, with a Piston or a structure behind the chain, by its place. The
    static forces are solved first, and motions are measured from static equilibrium.
    dissipation: None, or a loss such as LinearDashpot at every contact. integrator: "verlet" (velocity Verlet) or "rk4"
    (as in the thesis). law: what `contact_law` finds; or a law for all contacts between bodies; or a function
    law(body, next body or Surface) that returns one.
    Equations 1.5, 3.1 and 6.1 of the thesis (as corrected: all brackets with positive part).
    """

    beads: Sequence[Bead]
    striker: Bead | Excitation | None
    impact_speed: float | None = None
    gravity: float = 0.0
    dissipation: Dissipation | None = None
    integrator: str = "verlet"
    preload: float = 0.0
    inclination: float = pi / 2.0
    law: ContactLaw | Callable[[Bead, Any], ContactLaw] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "beads", tuple(listed("beads", self.beads, Bead, "one bead, such as Sphere, or more")))  # type: ignore[arg-type]
        what = "a bead, such as Sphere, or SpringLoaded, PushedBead, Piston or None"
        instance("striker", self.striker, Bead | Excitation | None, what)  # type: ignore[arg-type]
        if isinstance(self.striker, Bead):
            if self.impact_speed is None:
                raise ValueError("impact_speed = None: must be given, in m/s, for a striker that is a bead")
            object.__setattr__(self, "impact_speed", within("impact_speed", self.impact_speed, 1e-12, 1e5, "m/s"))
        elif self.striker is None:
            if self.impact_speed is not None and self.impact_speed != 0.0:
                object.__setattr__(self, "impact_speed", within("impact_speed", self.impact_speed, 1e-12, 1e5, "m/s"))
        elif self.impact_speed is not None:
            kind = type(self.striker).__name__
            raise ValueError(
                f"impact_speed = {self.impact_speed!r}: must be left out for a {kind}, which sets the speed"
            )
        object.__setattr__(self, "gravity", not_negative("gravity", self.gravity, "m/s²"))
        object.__setattr__(self, "preload", not_negative("preload", self.preload, "N"))
        object.__setattr__(self, "inclination", turn("inclination", self.inclination))
        likely("speed", "Chain", "impact_speed", self.impact_speed or 0.0)
        likely("gravity", "Chain", "gravity", self.gravity)
        likely("preload", "Chain", "preload", self.preload)
        if not isinstance(self.dissipation, Dissipation | None):
            raise ValueError(
                f"dissipation = {self.dissipation!r}: must be None or a loss such as LinearDashpot(coefficient)"
            )
        if not (self.law is None or isinstance(self.law, ContactLaw) or callable(self.law)):
            raise ValueError(
                f"law = {self.law!r}: must be None, a law such as PowerLaw(k, n), or a function of two bodies"
            )
        if callable(self.law):
            _check_takes_two(self.law)
        one_of("integrator", self.integrator, INTEGRATORS)
        if not self.impact_energy > 0.0:
            raise ValueError(f"striker = {self.striker!r}: moves nothing")

    @property
    def gravity_along(self) -> float:
        """Gravity's part along the chain, m/s²."""
        return self.gravity * sin(self.inclination)

    @property
    def body(self) -> Bead | None:
        """Body 0 of the results, the striker; None where there is none, or a force or a motion stands for it."""
        if isinstance(self.striker, SpringLoaded):
            return self.striker.striker
        return None if isinstance(self.striker, PushedBead | Piston) else self.striker

    @property
    def speed(self) -> float:
        """Of the striker at time zero, or of the first bead where there is none, m/s."""
        if isinstance(self.striker, SpringLoaded):
            return self.striker.speed(self.gravity_along)
        return self.impact_speed or 0.0

    @property
    def impact_energy(self) -> float:
        """What the excitation brings, J: the scale of steps, tolerances and of energy_error.

        The striker's kinetic energy at time zero, and what is left in its spring. For a force history ½ J²/m with its
        impulse J on the first bead, for a piston the energy of the first bead at twice the greatest speed; for
        one at rest, ½ m (10 mm/s)². Without a striker the first bead's kinetic energy, at rest ½ m (10 mm/s)² too.
        """
        if self.body is not None:
            spring = (
                0.5 * self.striker.stiffness * self.striker.left**2 if isinstance(self.striker, SpringLoaded) else 0.0
            )
            return 0.5 * self.body.mass * self.speed**2 + spring
        mass = self.beads[0].mass
        if self.striker is None:
            return 0.5 * mass * (self.speed or STILL) ** 2
        times, values, rates = self.striker.history  # type: ignore[union-attr]
        if isinstance(self.striker, PushedBead):
            impulse = float(np.sum(0.5 * np.abs(values[1:] + values[:-1]) * np.diff(times)))
            impulse = impulse or float(np.abs(values).max() * times[-1])
            return 0.5 * impulse**2 / mass
        fastest = float(max(np.abs(rates).max(), np.abs(np.diff(values) / np.diff(times)).max()))
        return 0.5 * mass * (2.0 * fastest if fastest > 0.0 else STILL) ** 2

    @property
    def centres(self) -> Vector:
        """Distance of the centres of striker and beads from the struck end of the first bead, m."""
        sizes = np.array([bead.size for bead in self.beads])
        ends = np.cumsum(sizes)
        return np.concatenate([[-self.body.size / 2.0 if self.body else 0.0], ends - sizes / 2.0])

    def describe(self) -> dict[str, Any]:
        """The chain as plain data, for the attributes of a result."""
        # Chains repeat their beads; to write each of them anew takes as long as some of a short run.
        rest, known = copy(self), {id(bead): asdict(bead) for bead in self.beads}
        object.__setattr__(rest, "beads", ())
        return {**asdict(rest), "beads": [known[id(bead)] for bead in self.beads]}


def _check_takes_two(law: Callable[..., Any]) -> None:
    """A ValueError where the function does not take a body and the next."""
    try:
        signature = inspect.signature(law)
    except (TypeError, ValueError):  # of some that are written in C
        return
    try:
        signature.bind(None, None)
    except TypeError as error:
        raise ValueError(
            f"law = {law!r}: must be a function of two bodies, law(body, next body or Surface) ({error})"
        ) from None
