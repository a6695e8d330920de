"""A chain of beads and its striker: `Chain` is data, `MovingChain` the participant that faces a surface."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import pairwise
from math import inf, pi
from typing import Any, NamedTuple

import numpy as np

from particles import kernels
from particles.bead import Sphere
from particles.dissipation import LinearDashpot
from structures.checks import finite, instance, listed, not_negative, one_of, positive, within
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness
from structures.theory import contact_time_half_space

INTEGRATORS = ("verlet", "rk4")

STEPS_PER_CONTACT = 1800
"""Steps in the shortest contact's duration. Verlet then keeps the energy to 1e-6 of the striker's (tests)."""


STEPS_PER_DAMPING = 40
"""Steps in the time in which the strongest dashpot would stop a contact; matters for soft, small, sticky beads only."""


@dataclass(frozen=True)
class Chain:
    """Beads in a row, the first one hit by the striker, the last one facing a structure.

    beads: from the struck end on. striker: a bead that arrives free, at impact_speed (m/s), at time zero.
    gravity, m/s², acts along the chain from striker to structure; the static preload is solved first and motions
    are measured from static equilibrium. dissipation: None or a LinearDashpot at every contact.
    integrator: "verlet" (velocity Verlet) or "rk4" (as in the thesis).
    Equations 1.5 and 6.1 of the thesis (as corrected: all brackets with positive part).
    """

    beads: Sequence[Sphere]
    striker: Sphere
    impact_speed: float
    gravity: float = 0.0
    dissipation: LinearDashpot | None = None
    integrator: str = "verlet"

    def __post_init__(self) -> None:
        object.__setattr__(self, "beads", tuple(listed("beads", self.beads, Sphere, "one Sphere or more")))
        instance("striker", self.striker, Sphere, "a Sphere")
        object.__setattr__(self, "impact_speed", within("impact_speed", self.impact_speed, 1e-12, 1e5, "m/s"))
        object.__setattr__(self, "gravity", not_negative("gravity", self.gravity, "m/s²"))
        if not isinstance(self.dissipation, LinearDashpot | None):
            raise ValueError(f"dissipation = {self.dissipation!r}: must be None or LinearDashpot(coefficient)")
        one_of("integrator", self.integrator, INTEGRATORS)

    @property
    def impact_energy(self) -> float:
        """Kinetic energy of the striker at time zero, J."""
        return 0.5 * self.striker.mass * self.impact_speed**2

    @property
    def centres(self) -> Vector:
        """Distance of the centres of striker and beads from the struck end of the first bead, m."""
        sizes = np.array([bead.size for bead in self.beads])
        ends = np.cumsum(sizes)
        return np.concatenate([[-self.striker.size / 2.0], ends - sizes / 2.0])

    def describe(self) -> dict[str, Any]:
        """The chain as plain data, for the attributes of a result."""
        return {**asdict(self), "beads": [asdict(bead) for bead in self.beads]}


class ChainState(NamedTuple):
    """Positions from touching, unloaded beads (m) and velocities (m/s) of striker and beads; energy lost so far (J)."""

    position: Vector
    velocity: Vector
    lost: float


@dataclass(frozen=True, eq=False)
class MovingChain:
    """A chain as a participant: advance(state, (surface at start, at end), window) → (state, mean force).

    surface: what the last bead faces, None for nothing. flexibility, m/N: a massless spring behind that contact.
    dt: the step, s; by default chosen from the shortest contact time. A window holds a whole number of steps, so
    the step used is at most this. Raises ValueError where dt is too large for a stable step.
    """

    chain: Chain
    surface: Surface | None
    flexibility: float = 0.0
    dt: float | None = None
    mass: Vector = field(init=False)
    stiffness: Vector = field(init=False)
    static_force: Vector = field(init=False)
    preload: Vector = field(init=False)
    rest: Vector = field(init=False)

    def __post_init__(self) -> None:
        chain = self.chain
        bodies = [chain.striker, *chain.beads]
        surfaces = [body.surface for body in bodies]
        mass = np.array([body.mass for body in bodies])
        pairs = pairwise(surfaces)
        last = 0.0 if self.surface is None else hertz_stiffness(surfaces[-1], self.surface)
        stiffness = np.array([*(hertz_stiffness(one, other) for one, other in pairs), last])
        if self.surface is None and chain.gravity > 0.0:
            raise ValueError(f"gravity = {chain.gravity!r}: must be 0 for a chain that nothing holds (structure None)")
        static = np.concatenate([[0.0], chain.gravity * np.cumsum(mass[1:])])
        preload = np.divide(static, stiffness, out=np.zeros_like(static), where=static > 0.0) ** (2.0 / 3.0)
        spring = np.append(np.zeros(len(chain.beads)), self.flexibility * static[-1])
        rest = np.cumsum((preload + spring)[::-1])[::-1].copy()
        finite("flexibility", self.flexibility, "m/N")
        values = {"mass": mass, "stiffness": stiffness, "static_force": static, "preload": preload, "rest": rest}
        for name, value in values.items():
            object.__setattr__(self, name, value)
        self._check_flexibility()
        self._check_step()

    @cached_property
    def contact_time(self) -> float:
        """The shortest time of any contact, s: Hertz's collision at the impact speed, or its preloaded half-swing."""
        closed = self.stiffness > 0.0
        collision = contact_time_half_space(self.reduced_mass[closed], self.stiffness[closed], self.chain.impact_speed)
        tangent = 1.5 * self.stiffness * np.sqrt(self.preload)
        swing = pi / np.sqrt(np.maximum(tangent / self.reduced_mass, 1e-300))
        return float(min(collision.min(), swing.min()))

    @cached_property
    def damping_time(self) -> float:
        """The shortest time, s, in which a dashpot would stop a contact."""
        dissipation = self.chain.dissipation
        rate = dissipation.coefficient / float(self.reduced_mass.min()) if dissipation else 0.0
        return 1.0 / rate if rate > 0.0 else inf

    @cached_property
    def force_scale(self) -> float:
        """The greatest force, N, of the last contact if it took all of the striker's energy."""
        return float((self.stiffness * self._overlap(self.chain.impact_energy) ** 1.5)[-1])

    def start(self) -> ChainState:
        """Static equilibrium, the striker touching the first bead at the impact speed."""
        velocity = np.zeros_like(self.rest)
        velocity[0] = self.chain.impact_speed
        return ChainState(self.rest.copy(), velocity, 0.0)

    def advance(
        self, state: ChainState, surface_motion: tuple[float, float], window: float
    ) -> tuple[ChainState, float]:
        """Move on by one window (s) while the surface moves linearly between two displacements (m).

        Returns the new state and the mean force (N) on the surface above the static one.
        """
        y, v = state.position.copy(), state.velocity.copy()
        start, end = surface_motion
        force, lost = kernels.advance(y, v, self.constants, self.method, self.steps(window), window, start, end)
        return ChainState(y, v, state.lost + lost), force - float(self.static_force[-1])

    def advance_condensed(
        self,
        state: ChainState,
        surface: tuple[float, float],
        compliance: float,
        window: float,
        guess: Vector,
        tolerance: float,
    ) -> tuple[ChainState, float, int, float]:
        """Move on by one window against a linear structure.

        surface: its displacement at the window's start, and at its end where no force above the static one acts;
        compliance, m/N: what the mean force adds to that. guess: mean force and slope of the secant, updated.
        Returns the state, the mean force above the static one, the chain windows tried and the residual (N).
        """
        y, v = state.position.copy(), state.velocity.copy()
        static = float(self.static_force[-1])
        steps = self.steps(window)
        force, lost, count, residual = kernels.advance_condensed(
            y, v, self.constants, self.method, steps, window, *surface, compliance, static, guess, tolerance
        )
        return ChainState(y, v, state.lost + lost), force - static, count, residual

    @cached_property
    def constants(self) -> tuple[Vector, Vector, Vector, float, float]:
        """What the kernels call `chain`."""
        dashpot = self.chain.dissipation.coefficient if self.chain.dissipation else 0.0
        return 1.0 / self.mass, self.stiffness, np.full_like(self.mass, dashpot), self.chain.gravity, self.flexibility

    @cached_property
    def method(self) -> int:
        """What the kernels call `method`."""
        if self.chain.integrator == "rk4":
            return kernels.RK4
        lossless = self.chain.dissipation is None or self.chain.dissipation.coefficient == 0.0
        return kernels.VERLET if lossless else kernels.DASHPOT_VERLET

    def steps(self, window: float) -> int:
        """Steps in a window."""
        automatic = min(self.contact_time / STEPS_PER_CONTACT, self.damping_time / STEPS_PER_DAMPING)
        step = automatic if self.dt is None else self.dt
        return max(1, int(np.ceil(window / step * (1.0 - 1e-9))))

    @cached_property
    def reduced_mass(self) -> Vector:
        """Reduced masses of the N + 1 contacts, kg; a structure counts as immovable."""
        mass = self.mass
        return np.append(mass[:-1] * mass[1:] / (mass[:-1] + mass[1:]), mass[-1])

    def _overlap(self, energy: float) -> Vector:
        """How deep each contact would be, m, if it held this energy (J) alone."""
        closed = self.stiffness > 0.0
        return np.divide(2.5 * energy, self.stiffness, out=np.zeros_like(self.mass), where=closed) ** 0.4

    def _check_flexibility(self) -> None:
        """A spring so negative that the contact would snap shut: its patch is smaller than the contact."""
        deepest = float(self._overlap(self.chain.impact_energy)[-1])
        if -self.flexibility * 1.5 * self.stiffness[-1] * deepest**0.5 >= 1.0:
            raise ValueError(
                f"flexibility = {self.flexibility!r}: more negative than this contact can bear; take a larger patch"
            )

    def _check_step(self) -> None:
        """Twice the highest rate that a contact with all of the striker's energy could have."""
        if self.dt is None:
            return
        object.__setattr__(self, "dt", positive("dt", self.dt, "s"))
        tangent = 1.5 * self.stiffness * np.sqrt(self._overlap(self.chain.impact_energy) + self.preload)
        fastest = np.sqrt(2.0 * tangent / self.reduced_mass).max()
        largest = min(2.0 / float(fastest), 2.0 * self.damping_time)
        if self.dt > largest:
            raise ValueError(f"dt = {self.dt!r}: too large for a stable step; must be below {largest:.3g} s")
