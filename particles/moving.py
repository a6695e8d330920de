"""A chain in motion: the participant that faces a surface, and its state."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, wraps
from itertools import pairwise
from math import ceil, inf, pi, sqrt
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.special import gamma

from particles import contacts
from particles.chain import Chain
from particles.contacts import joined, pace_of
from particles.kernels import motion as kernels
from particles.kernels.drives import FREE, MOVED
from particles.kernels.laws import NEVER
from particles.kernels.vibrations import Vibrations
from particles.laws.formulas import law_of_bodies
from particles.laws.law import ContactLaw, check_contact_law, unchanging
from particles.laws.yielding import YieldingContact, YieldingLaw
from structures.checks import instance, positive, short
from structures.structure import Vector
from structures.surface import Surface

# Steps in the duration of the shortest contact, for an energy error of 1e-6 of the striker's energy (tests).
STEPS_PER_CONTACT = 1800
# Steps in the time in which the strongest loss would stop a contact; only soft, small beads with strong losses need it.
STEPS_PER_DAMPING = 40
TINY = float(np.finfo(float).tiny)

# The common facts of chains with equal parts and loads, which the chains fill; a batch has thousands of such chains.
known_facts: Any = lru_cache(maxsize=64)(lambda *parts: {})


class ChainState(NamedTuple):
    """The motion of the striker, or of the surface behind, and of the beads."""

    position: Vector  # m, from touching, unloaded beads; then the memory of contacts that yield
    velocity: Vector  # m/s
    lost: float = 0.0  # energy lost so far, J
    time: float = 0.0  # s from the first contact
    driven: float = 0.0  # work of a force history or piston so far, J


class StrongestLoss(NamedTuple):
    """A loss, and the time in which it would stop a motion."""

    argument: str  # the user's argument
    at_contacts: bool  # whether it would stop a contact, or else a vibration of a body
    time: float  # s, infinite without a loss


T = TypeVar("T")


def fact(make: Callable[[Any], T]) -> cached_property[T]:
    """Return a property that is computed once for chains that differ only in the impact speed; use as a decorator."""
    return cached_property(wraps(make)(lambda chain: chain.once(make.__name__, make)))


@dataclass(frozen=True, eq=False)
class MovingChain:
    """A chain as a participant: advance(state, (surface at start, at end), window) → (state, mean force).

    Parameters
    ----------
    chain : Chain
        The chain.
    surface, behind : Surface or None
        The surface that the last bead faces, and one that takes the place of the striker, body 0; None for no surface.
    flexibility, behind_flexibility : float
        Flexibilities of massless springs behind these contacts, m/N.
    dt, fineness : float, optional
        The longest step, s, by default from the shortest contact time; and a factor of the default number of steps.
    impact_energy : float, optional
        Energy scale of steps and tolerances, J; by default the chain's own.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> side = hl.stepping.MovingChain(hl.Chain([bead] * 10, bead, 0.44), hl.Surface(hl.STEEL_316))
    """

    chain: Chain
    surface: Surface | None
    flexibility: float = 0.0
    dt: float | None = None
    behind: Surface | None = None
    behind_flexibility: float = 0.0
    impact_energy: float | None = None
    fineness: float = 1.0

    def __post_init__(self) -> None:
        instance("chain", self.chain, Chain, "a Chain")
        if self.surface is not None:
            instance("surface", self.surface, Surface, "a Surface(material), or None")
        if isinstance(law := self.chain.law, ContactLaw) and unchanging(law) is not law:
            object.__setattr__(self, "chain", replace(self.chain, law=unchanging(law)))
        if self.behind is not None and self.chain.excitation.drive.kind in (FREE, MOVED):
            given = f"striker = {short(self.chain.striker)}"
            raise ValueError(f"{given}: must be None or a PushedBead if a structure stands behind")
        _ = self.rest, self.strongest_loss  # these check loads, laws, bodies and the loss
        deepest = self._deepest_alone
        for name, contact in (("flexibility", -1), ("behind_flexibility", 0)):
            flexibility = getattr(self, name)
            if (excess := -flexibility * float(self.of_laws("tangent", deepest)[contact])) >= 1.0:
                raise ValueError(
                    f"{name} = {flexibility!r}: must be less negative, as this contact is wider than the patch; give "
                    f"the structure a patch_radius at least {ceil(100.0 * excess) / 100.0:g} times as large"
                )
        if self.dt is not None:
            object.__setattr__(self, "dt", positive("dt", self.dt, "s"))
            if self.dt > (most := self.stable_step):
                raise ValueError(f"dt = {self.dt!r}: must be below {most:.3g} s for a stable step")

    def once(self, name: str, make: Callable[[Any], Any]) -> Any:
        """Return make(self), which must not depend on the impact speed; otherwise equal chains share it."""
        if name not in self.shared:
            self.shared[name] = make(self)
        return self.shared[name]

    @cached_property
    def shared(self) -> dict[str, Any]:
        """The facts shared with chains that differ only in speed, unless there are objects of a user's classes."""
        chain = self.chain
        parts = (*chain.beads, chain.striker, chain.body, chain.law, chain.dissipation)
        loads = chain.impact_speed is None, chain.gravity, chain.inclination, chain.preload
        ends = self.surface, self.flexibility, self.behind, self.behind_flexibility
        ours = all(part is None or type(part).__module__.startswith("particles.") for part in parts)
        return known_facts(parts, loads, ends) if ours and type(self) is MovingChain else {}

    @fact
    def mass(self) -> Vector:
        """The masses of striker and beads, kg; infinite if a structure, a piston or a force replaces the striker."""
        body = self.chain.body
        return np.array([body.mass if body else inf, *(bead.mass for bead in self.chain.beads)])

    @fact
    def reduced_mass(self) -> Vector:
        """The reduced masses of the N + 1 contacts, kg. A structure or a piston counts as immovable."""
        inverse = np.append(1.0 / self.mass, 0.0)
        return np.asarray(1.0 / (inverse[:-1] + inverse[1:]))

    @fact
    def pairs(self) -> tuple[contacts.Pair | None, ...]:
        """The bodies that touch at each contact; None if a force replaces the contact, or if there is none."""
        chain, first = self.chain, self.chain.beads[0]
        faced = self.behind if self.behind is not None else chain.excitation.faces(first)
        struck: contacts.Pair | None = (first, faced) if faced is not None else None
        struck = (chain.body, first) if chain.body is not None else struck
        return (struck, *pairwise(chain.beads), None if self.surface is None else (chain.beads[-1], self.surface))

    @fact
    def laws(self) -> tuple[ContactLaw | None, ...]:
        """The law of each contact before it yields: the user's, or that of `law_between`; None without a contact."""
        given = None if isinstance(self.chain.law, YieldingLaw) else self.chain.law

        def between(pair: contacts.Pair, _: int) -> ContactLaw:
            if given is None or (isinstance(given, ContactLaw) and isinstance(pair[1], Surface)):
                return self.law_between(*pair)
            if isinstance(given, ContactLaw):
                return given
            what = "a function that returns a contact law such as PowerLaw(k, n)"
            return unchanging(check_contact_law("law", given(*pair), what))

        return tuple(contacts.once_per_pair(self.pairs, between))

    law_between = staticmethod(law_of_bodies)  # the law of two bodies for which the user gives none

    @property
    def local_laws(self) -> tuple[ContactLaw | None, ...]:
        """The laws for the compiled loops."""
        return self.laws

    @property
    def stiffness(self) -> Vector:
        """k of each contact, N/mⁿ; zero without a contact, one if the law is a table."""
        return np.array([law.kernel[0] if law else 0.0 for law in self.local_laws])

    @fact
    def yielding(self) -> tuple[YieldingContact | None, ...] | None:
        """The yielding of each contact, or None if it does not yield; None if the chain has no YieldingLaw."""
        if not isinstance(law := self.chain.law, YieldingLaw):
            return None
        yielding = contacts.once_per_pair(self.pairs, lambda pair, i: law.contact(*pair, self.laws[i]))
        if not any(yielding):
            raise ValueError(f"law = {law!r}: must have a yield_strength, as no material of the chain has one")
        return tuple(yielding)

    @fact
    def model(self) -> kernels.Chains:
        """The chain in the form for the compiled loops."""
        return joined([self])

    @fact
    def vibrations(self) -> Vibrations:
        """The vibrations of the bodies for the compiled loops; there are none, because the bodies are rigid."""
        none = np.zeros((self.mass.size, 0))
        return Vibrations(none, none, none, none, np.zeros(self.mass.size))

    @fact
    def groups(self) -> contacts.Groups:
        """The different laws and their contacts."""
        groups = contacts.grouped(self.laws)
        if not groups:
            raise ValueError("beads: must have a contact; a single bead without a striker faces nothing")
        return groups

    def of_laws(self, quantity: str, at: Vector) -> Vector:
        """Return the force, tangent, energy, approach or overlap of each contact by its law; zero without a contact."""
        values = np.zeros(len(self.laws))
        for law, which in self.groups.items():
            values[which] = getattr(law, quantity)(at[which])
        return values

    def approach(self, force: Vector) -> Vector:
        """Return the approach of each contact, m, at its force, N, without losses, on first loading."""
        overlap = self.of_laws("approach", np.maximum(force, 0.0))
        for i, contact in enumerate(self.yielding or ()):
            if contact is not None and force[i] > contact.yield_force:
                overlap[i] = contact.approach(force[i])
        return overlap

    @fact
    def static_force(self) -> Vector:
        """The static force of each contact, N; that of contact 1 is the preload that body 0 bears."""
        chain = self.chain
        loads = {"gravity": (chain.gravity, chain.gravity_along), "preload": (chain.preload, chain.preload)}
        for name, (value, along) in loads.items():
            # Gravity may act perpendicular to a chain that nothing holds.
            if self.surface is None and abs(along) > 1e-12 * value:
                raise ValueError(f"{name} = {value!r}: must be 0 for a chain that nothing holds (structure None)")
        weights = np.cumsum([bead.mass for bead in chain.beads])
        # A piston or a structure bears the preload; without one it is a dead load on the first bead.
        borne = self.behind is not None or chain.excitation.drive.kind == MOVED
        static = np.append(borne * chain.preload, chain.preload + chain.gravity_along * weights)
        if static.min() < 0.0:
            least = chain.preload - static.min()
            raise ValueError(f"preload = {chain.preload!r}: must be at least {least:.4g} N to hold a chain that hangs")
        return static

    @fact
    def preload(self) -> Vector:
        """The static approach of each contact, m."""
        return self.approach(self.static_force)

    @fact
    def rest(self) -> Vector:
        """The positions in static equilibrium, m, the amplitudes of modes, and the memory of contacts that yield."""
        force, vibrations, approach = self.static_force, self.vibrations, self.preload.copy()
        if self.local_laws is not self.laws:
            for law, which in contacts.grouped(self.local_laws).items():
                approach[which] = law.approach(force[which])
        approach[[0, -1]] += np.array([self.behind_flexibility, self.flexibility]) * force[[0, -1]]
        approach[1:] -= vibrations.cross[1:] * force[:-1]
        approach[:-1] -= vibrations.cross[1:] * force[1:]
        behind, ahead = np.append(0.0, force[:-1])[:, None], force[:, None]
        stiffness = np.where(vibrations.stiffness > 0.0, vibrations.stiffness, inf)
        amplitude = (vibrations.struck * behind - vibrations.far * ahead) / stiffness
        shortened = approach - (vibrations.far * amplitude).sum(axis=1)
        shortened[:-1] += (vibrations.struck * amplitude).sum(axis=1)[1:]
        moving = np.append(np.cumsum(shortened[::-1])[::-1], amplitude.ravel())
        if self.yielding is None:
            return moving

        # The memory: limits, stiffnesses and dents; see `Yielding`.
        limit, hard, dent = np.full(force.size, NEVER), self.stiffness, np.zeros(force.size)
        for i, (contact, overlap) in enumerate(zip(self.yielding, self.preload, strict=True)):
            if contact is not None and contact.overlap < inf:
                limit[i] = max(contact.overlap, overlap)
                if overlap > contact.overlap:
                    dent[i] = contact.dent(overlap)
                    hard[i] = contact.force(overlap) / (overlap - dent[i]) ** 1.5
        return np.concatenate([moving, limit, hard, dent])

    def amplitudes(self, coordinates: Vector) -> Vector:
        """Return amplitudes of modes from positions, or rates from velocities, times × bodies × modes."""
        bodies, modes = self.vibrations.struck.shape
        return coordinates[:, bodies : bodies * (1 + modes)].reshape(len(coordinates), bodies, modes)

    def poles(self, position: Vector) -> tuple[Vector, Vector]:
        """Return the positions of the bodies' struck poles and other poles, m, saved times × bodies."""
        place, amplitude = position[:, : self.mass.size], self.amplitudes(position)
        if not amplitude.size:
            return place, place
        struck, far = ((shape * amplitude).sum(axis=2) for shape in (self.vibrations.struck, self.vibrations.far))
        return place + struck, place + far

    @cached_property
    def energy(self) -> float:
        """The scale of energies for steps and tolerances, J."""
        return self.chain.impact_energy if self.impact_energy is None else self.impact_energy

    @property
    def speed(self) -> float:
        """The scale of speeds, m/s: the speed of the first body with all of that energy."""
        return sqrt(2.0 * self.energy / float(self.mass[0 if self.chain.body else 1]))

    @cached_property
    def _contact_times(self) -> Vector:
        """The time of each contact, s: of a collision, or half a period under preload; zero without a contact."""
        energy = 0.5 * self.reduced_mass * self.speed**2
        deepest = self.of_laws("overlap", energy)
        # For F = k δⁿ a collision takes 2√π Γ(1 + 1/(n+1))/Γ(½ + 1/(n+1)) times the deepest approach over the speed.
        force = self.of_laws("force", deepest)
        order = np.divide(energy, force * deepest, out=np.ones(force.size), where=force > 0.0)
        collision = deepest / self.speed * 2.0 * sqrt(pi) * gamma(1.0 + order) / gamma(0.5 + order)
        there = np.array([0.0 if law is None else pi for law in self.laws])
        swing = there / np.sqrt(np.maximum(self.of_laws("tangent", self.preload) / self.reduced_mass, TINY))
        return np.minimum(collision, swing)  # type: ignore[no-any-return]

    @cached_property
    def contact_time(self) -> float:
        """The shortest time of any contact, s."""
        return float(self._contact_times[self._contact_times > 0.0].min())

    @cached_property
    def transit_time(self) -> float:
        """The travel time of a wave from one end to the other, s; for equal beads, within about 10 %."""
        # Solitary waves and linear waves reach the next bead in about half the time of a contact.
        return 0.5 * float(self._contact_times.sum())

    @cached_property
    def _deepest_alone(self) -> Vector:
        """The deepest approach of each contact, m, if it stored the scale of energies alone."""
        return self.of_laws("overlap", np.full(self.mass.size, self.energy))

    @cached_property
    def scales(self) -> tuple[float, float]:
        """The greatest force, N, and approach, m, of the last contact, or else the hardest, at that energy."""
        deepest = self._deepest_alone
        force = self.of_laws("force", deepest)
        contact = -1 if self.laws[-1] is not None else int(force.argmax())
        return float(force[contact]), float(deepest[contact])

    @cached_property
    def strongest_loss(self) -> StrongestLoss:
        """The loss that would stop a contact or a vibration in the shortest time."""
        at_contacts = in_bodies = inf
        if (loss := self.chain.dissipation) is not None:
            deepest = self._deepest_alone + self.preload
            tangent, force = self.of_laws("tangent", deepest), self.of_laws("force", deepest)
            rates = loss.rates(self.reduced_mass, tangent, force / np.maximum(deepest, TINY), self.speed)
            if (fastest := float(np.max(rates))) > 0.0:
                at_contacts = 1.0 / fastest
            # The poles of bodies that vibrate are lighter than the bodies.
            inverse, struck, far = 1.0 / self.reduced_mass, self.vibrations.struck, self.vibrations.far
            behind, ahead = (far**2).sum(axis=1), np.append((struck**2).sum(axis=1)[1:], 0.0)
            at_contacts *= float((inverse / (inverse + behind + ahead)).min())
        if (fastest := float(self.vibrations.rate.max(initial=0.0))) > 0.0:
            in_bodies = 1.0 / fastest
        name = "dissipation" if at_contacts <= in_bodies else "damping"
        argument = f"{name} = {short(getattr(self.chain, name))}"
        return StrongestLoss(argument, at_contacts <= in_bodies, min(at_contacts, in_bodies))

    @cached_property
    def shortest_period(self) -> float:
        """The shortest period of the bodies' vibrations, s."""
        fastest = float(self.vibrations.stiffness.max(initial=0.0)) ** 0.5
        return 2.0 * pi / fastest if fastest > 0.0 else inf

    @property
    def stable_step(self) -> float:
        """The longest stable step, s, if one contact stores all of the energy."""
        stiffest = self.of_laws("tangent", self._deepest_alone + self.preload)
        fastest = float(np.sqrt(2.0 * stiffest / self.reduced_mass).max())
        return min(2.0 / fastest, 2.0 * self.strongest_loss.time, 0.9 * self.shortest_period / pi)

    @cached_property
    def longest_step(self) -> float:
        """The default step, s. A fineness below 1 does not lengthen the steps for strong losses and vibrations."""
        finer = max(self.fineness, 1.0)
        by_loss, by_period = self.strongest_loss.time / (STEPS_PER_DAMPING * finer), self.shortest_period / (30 * finer)
        return min(self.contact_time / (STEPS_PER_CONTACT * self.fineness), by_loss, by_period)

    def steps(self, window: float) -> int:
        """Return the number of steps in a window."""
        step = self.longest_step if self.dt is None else self.dt
        count = window / step * (1.0 - 1e-9) if step > 0.0 else inf
        if count * self.mass.size > 1e13:  # takes hours
            loss, asked = self.strongest_loss, f"until = {window:.3g}" if self.dt is None else f"dt = {step:.3g}"
            name = loss.argument if self.dt is None and loss.time < self.contact_time else asked
            raise ValueError(f"{name}: takes {count:.3g} steps in {window:.3g} s; must take fewer")
        return max(1, ceil(count))

    def start(self) -> ChainState:
        """Return the static equilibrium with the impact speed of the striker, or else of the first bead."""
        velocity = np.zeros(self.rest.size)
        velocity[0 if self.chain.body else 1] = self.chain.speed
        return ChainState(self.rest.copy(), velocity)

    def advance(self, state: ChainState, motion: tuple[Any, Any], window: float) -> tuple[ChainState, Any]:
        """Return the state after a window, s, and the mean force on the surface minus the static force, N. motion:
        displacements of the surface at start and end, m. With a surface behind, displacements and forces are arrays of
        two, first for the last bead's end, positive away from the chain.
        """
        y, v = np.empty_like(state.position), np.empty_like(state.velocity)
        contact, moved = np.zeros(np.size(motion[0]), kernels.TRIED), np.zeros(1, kernels.MOVED)
        contact["start"], contact["surface"] = motion
        kernels.advance_chains(
            self.model, state.position, state.velocity, y, v, np.zeros((kernels.WORK_ROWS, y.size)), state.time,
            window, contact, pace_of(self.model, [self.steps(window)], y.size), moved, False,
        )  # fmt: skip
        lost, driven = moved[0].tolist()
        end = ChainState(y, v, state.lost + lost, state.time + window, state.driven + driven)
        if self.behind is None:
            return end, float(contact["answer"][0] - self.static_force[-1])
        return end, contact["answer"] - self.static_force[[-1, 0]]
