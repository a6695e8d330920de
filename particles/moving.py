"""A chain in motion: the participant that faces a surface, and its state."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, inf, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.special import gamma

from particles import contacts
from particles.bead import Bead
from particles.chain import Chain, reduced_masses, static_forces
from particles.dissipation import fastest_rate
from particles.facts import fact, shared_facts
from particles.joined import joined, pace_of
from particles.kernels import motion as kernels
from particles.kernels.losses import NoLoss
from particles.kernels.vibrations import Vibrating
from particles.laws.formulas import contact_law
from particles.laws.law import ContactLaw, PowerLaw, unchanging
from particles.laws.yielding import YieldingContact
from structures.checks import finite, instance, positive, short
from structures.structure import Vector
from structures.surface import Surface

STEPS_PER_CONTACT = 1800
"""Steps in the shortest contact's duration. Verlet then keeps the energy to 1e-6 of the striker's (tests)."""

HOP = 0.5
"""Time in which a wave goes on by one bead, over that of a contact. Solitary waves behind a striker like the beads:
1.19 (m²/(k²v))^⅕ (`wave_speed_from_particle_speed`) over 2.44 of these; linear waves: √(m/C) over π√(m/2C)."""

STEPS_PER_DAMPING = 40
"""Steps in the time in which the strongest loss would stop a contact; matters for soft, small, sticky beads only."""


class ChainState(NamedTuple):
    """Positions from touching, unloaded beads (m) and velocities (m/s) of striker, or the surface behind, and beads.

    Where contacts yield, behind the positions is what they remember, see particles.kernels.laws.Yielding.
    lost: energy lost so far (J); time: s from the first contact; driven: work of a force history or piston so far (J).
    """

    position: Vector
    velocity: Vector
    lost: float = 0.0
    time: float = 0.0
    driven: float = 0.0


TINY = float(np.finfo(float).tiny)

MOST_STEPS = 1e13
"""Steps × bodies in a run: some hours."""


@dataclass(frozen=True, eq=False, repr=False)
class MovingChain:
    """A chain as a participant: advance(state, (surface at start, at end), window) → (state, mean force).

    Parameters
    ----------
    chain : Chain
        The chain.
    surface : Surface or None
        What the last bead faces; None for nothing.
    flexibility : float
        Massless spring behind that contact, m/N.
    dt : float, optional
        The step, s; by default chosen from the shortest contact time. A window holds a whole number of steps, so the
        step used is at most this.
    behind : Surface, optional
        What the first bead faces with its struck side. It takes the striker's place: it is body 0, and contact 1 is
        with it, so it needs a chain without striker or with a PushedBead.
    behind_flexibility : float
        Massless spring behind that contact, m/N.
    impact_energy : float, optional
        Scale of steps and tolerances, J; by default the chain's own.
    fineness : float
        Factor of the number of steps, where no dt is given.

    Raises
    ------
    ValueError
        For a dt that is too large for a stable step, for a striker with a surface behind, and for static loads on a
        chain that nothing holds.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> side = hl.stepping.MovingChain(hl.Chain([bead] * 10, bead, 0.44), hl.Surface(hl.STEEL_316))
    >>> state, force = side.advance(side.start(), (0.0, 0.0), 1e-6)
    >>> side
    MovingChain(Chain(10 Sphere, struck by Sphere at 0.44 m/s), Surface(...)
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
        if isinstance(self.chain.law, ContactLaw):
            object.__setattr__(self, "chain", self.chain.with_law(unchanging(self.chain.law)))
        finite("flexibility", self.flexibility, "m/N")
        self._check_behind()
        if self.impact_energy is not None:
            positive("impact_energy", self.impact_energy, "J")
        positive("fineness", self.fineness)
        vars(self).update(self.shared)
        _ = self.rest  # the equilibrium refuses what is wrong with loads, laws and bodies
        if min(self.flexibility, self.behind_flexibility) < 0.0:
            self._check_flexibility()
        self._check_step()

    def once(self, name: str, make: Callable[[], Any]) -> Any:
        """Return a fact that does not depend on the impact speed, made once for chains that differ in nothing else."""
        if name not in self.shared:
            self.shared[name] = make()
        return self.shared[name]

    @cached_property
    def shared(self) -> dict[str, Any]:
        """The facts of an earlier chain that differs in its speed alone; empty where there is none."""
        springs, ends = (self.flexibility, self.behind_flexibility), (self.surface, self.behind)
        facts: dict[str, Any] = shared_facts(self.chain, springs, ends) if type(self) is MovingChain else {}
        return facts

    @fact
    def mass(self) -> Vector:
        """The masses of striker and beads, kg; infinite where a structure, a piston or a force replaces the striker."""
        return self.chain.masses

    @fact
    def static_force(self) -> Vector:
        """The static force of each contact, N."""
        return static_forces(self.chain, self.surface, self.dead_load)

    @fact
    def laws(self) -> tuple[ContactLaw | None, ...]:
        """The law of each contact; None where there is no contact."""
        return contacts.laws_of(self.chain, self.pairs, self._found_law)

    @fact
    def yielding(self) -> tuple[YieldingContact | None, ...] | None:
        """How each contact yields; None where none does."""
        return contacts.yielding_of(self.chain, self.pairs, self.laws)

    @fact
    def preload(self) -> Vector:
        """The static approach of each contact, m."""
        return self.approach(self.static_force)

    def __repr__(self) -> str:
        facing = short(self.surface) if self.behind is None else f"{short(self.surface)}, behind={short(self.behind)}"
        return f"{type(self).__name__}({self.chain!r}, {facing})"

    @cached_property
    def energy(self) -> float:
        """The scale of energies that chooses steps and tolerances, J."""
        return self.chain.impact_energy if self.impact_energy is None else self.impact_energy

    @cached_property
    def contact_time(self) -> float:
        """The shortest time of any contact, s: a free collision at the striker's speed, or the preloaded half-swing.

        For F = k δⁿ a collision takes 2√π Γ(1 + 1/(n+1))/Γ(½ + 1/(n+1)) times deepest approach over speed.
        """
        return float(self._contact_times[self._contact_times > 0.0].min())

    @cached_property
    def _contact_times(self) -> Vector:
        """That time of each contact, s; zero where there is none."""
        if self._speed_powers is None:
            collision = self._collisions(self.speed)
        else:
            collision = self.once("collisions", lambda: self._collisions(1.0)) * self.speed**self._speed_powers
        times: Vector = np.minimum(collision, self._swings)
        return times

    @fact
    def _speed_powers(self) -> Vector | None:
        """The power of the speed that the time of each collision follows; None where not all laws are powers."""
        if any(type(law) is not PowerLaw for law in self._groups):
            return None
        exponent = self._over_contacts(lambda law, i: np.full(i.size, law.exponent))  # type: ignore[attr-defined]
        powers: Vector = (1.0 - exponent) / (1.0 + exponent)
        return powers

    def _collisions(self, speed: float) -> Vector:
        """Return the time of a free collision at a speed (m/s) of each contact, s; zero where there is none."""
        energy = 0.5 * self.reduced_mass * speed**2
        deepest = self._over_contacts(lambda law, i: law.overlap(energy[i]))
        force = self._over_contacts(lambda law, i: law.force(deepest[i]))
        order = np.divide(energy, force * deepest, out=np.ones(force.size), where=force > 0.0)
        times: Vector = deepest / speed * 2.0 * sqrt(pi) * gamma(1.0 + order) / gamma(0.5 + order)
        return times

    @fact
    def _swings(self) -> Vector:
        """A half-swing of each contact under its preload, s; zero where there is no contact."""
        tangent = self._over_contacts(lambda law, i: law.tangent(self.preload[i]))
        there = self._over_contacts(lambda law, i: np.ones(i.size))
        return there * pi / np.sqrt(np.maximum(tangent / self.reduced_mass, TINY))

    @cached_property
    def transit_time(self) -> float:
        """The time of a wave from the struck end to the other, s, to some 10 % in a chain of like beads.

        In each contact HOP of the time of a free collision at the striker's speed, or of a preloaded half-swing.
        """
        return HOP * float(self._contact_times.sum())

    @property
    def speed(self) -> float:
        """The scale of the bodies' speeds, m/s: the first body's with all of that energy."""
        return sqrt(2.0 * self.energy / float(self.mass[0 if self.chain.body else 1]))

    @cached_property
    def damping_time(self) -> float:
        """The shortest time, s, in which a loss would stop a contact."""
        return self._damping_of_contacts()

    def _damping_of_contacts(self) -> float:
        """Return that time between the bodies' full masses, s."""
        loss = self.chain.dissipation
        if loss is None:
            return inf
        deepest = self._deepest_alone + self.preload
        tangent = self._over_contacts(lambda law, i: law.tangent(deepest[i]))
        secant = self._over_contacts(lambda law, i: law.force(deepest[i]) / np.maximum(deepest[i], TINY))
        fastest = fastest_rate(loss, self.reduced_mass, tangent, secant, self.speed)
        return 1.0 / fastest if fastest > 0.0 else inf

    @property
    def strongest_loss(self) -> tuple[str, bool]:
        """The loss to which `damping_time` belongs, as it was given, and whether it is one of the contacts."""
        return f"dissipation = {short(self.chain.dissipation)}", True

    @cached_property
    def _deepest_alone(self) -> Vector:
        """The depth of each contact, m, if it held the scale of energies alone."""
        return self._over_contacts(lambda law, i: law.overlap(np.full(i.size, self.energy)))

    @cached_property
    def scales(self) -> tuple[float, float]:
        """The greatest force, N, and approach, m, of the last contact if it took all of that energy; those of the
        hardest contact where the last bead faces nothing."""
        deepest = self._deepest_alone
        force = self._over_contacts(lambda law, i: law.force(deepest[i]))
        contact = -1 if self.laws[-1] is not None else int(force.argmax())
        return float(force[contact]), float(deepest[contact])

    @property
    def stiffness(self) -> Vector:
        """k of each contact, N/mⁿ; zero where there is none, one where the law is a table."""
        return np.array([law.kernel[0] if law else 0.0 for law in self.local_laws])

    @property
    def local_laws(self) -> tuple[ContactLaw | None, ...]:
        """The contacts' laws as the kernels take them."""
        return self.laws

    def poles(self, position: Vector) -> tuple[Vector, Vector]:
        """Return where the bodies' poles are, of the struck side and the other, saved times × bodies, m; see
        `ChainState`."""
        places = position[:, : self.mass.size]
        return places, places

    def dents(self, position: Vector) -> Vector:
        """Return the dents of contacts that yield, saved times × contacts, m; see `ChainState`."""
        return position[:, 3 * self.mass.size :]

    @cached_property
    def longest_step(self) -> float:
        """The step by default, s; strong losses and vibrations need theirs in coarse runs too."""
        finer = max(self.fineness, 1.0)
        return min(
            self.contact_time / (STEPS_PER_CONTACT * self.fineness), self.damping_time / (STEPS_PER_DAMPING * finer)
        )

    def start(self) -> ChainState:
        """Return the static equilibrium, the striker touching the first bead at the impact speed; without one that bead
        has it."""
        velocity = np.zeros(self.rest.size)
        velocity[0 if self.chain.body else 1] = self.chain.speed
        return ChainState(self.rest.copy(), velocity)

    def advance(self, state: ChainState, motion: tuple[Any, Any], window: float) -> tuple[ChainState, Any]:
        """Move on by one window (s) while the surface moves linearly between two displacements (m).

        Returns the new state and the mean force (N) on the surface above the static one. With a surface behind, each
        displacement and the force are arrays of two numbers, the last end's first; displacements are positive away
        from the chain, so backwards for the surface behind.
        """
        y, v = np.empty_like(state.position), np.empty_like(state.velocity)
        contact, moved = np.zeros(np.size(motion[0]), kernels.TRIED), np.zeros(1, kernels.MOVED)
        contact["start"], contact["surface"] = motion
        kernels.advance_chains(
            self.model, state.position, state.velocity, y, v, self.work_space(), state.time, window, contact,
            pace_of(self.model, [self.steps(window)], y.size), moved, False,
        )  # fmt: skip
        lost, driven = moved[0]
        end = ChainState(y, v, state.lost + float(lost), state.time + window, state.driven + float(driven))
        if self.behind is None:
            return end, float(contact["answer"][0] - self.static_force[-1])
        return end, contact["answer"] - self.static_force[[-1, 0]]

    def work_space(self) -> Vector:
        """Return the rows of numbers that the compiled loops write to."""
        return np.zeros((kernels.WORK_ROWS, self.rest.size))

    @fact
    def model(self) -> kernels.Chains:
        """The chain as the compiled loops take it."""
        return joined([self])

    @property
    def dead_load(self) -> float:
        """What presses on the first bead where nothing there bears the preload, N."""
        borne = self.behind is not None or self.chain.excitation.bears_preload
        return 0.0 if borne else self.chain.preload

    @property
    def vibrating(self) -> Vibrating | None:
        """The vibrations of the bodies as a piece; None where they are rigid."""
        return None

    def steps(self, window: float) -> int:
        """Return the steps in a window."""
        step = self.longest_step if self.dt is None else self.dt
        count = window / step * (1.0 - 1e-9) if step > 0.0 else inf
        if count * self.mass.size > MOST_STEPS:
            name, cure = f"until = {window:.3g}", "a shorter time"
            if self.dt is not None:
                name, cure = f"dt = {step:.3g}", "a longer dt"
            elif self.damping_time < self.contact_time:
                name, cure = self.strongest_loss[0], "a weaker loss"
            raise ValueError(f"{name}: takes {count:.3g} steps in {window:.3g} s; give {cure}")
        return max(1, ceil(count))

    @fact
    def reduced_mass(self) -> Vector:
        """The reduced masses of the N + 1 contacts, kg."""
        return reduced_masses(self.mass)

    def cautions(self, deepest: Vector) -> tuple[list[str], list[str]]:
        """Return the laws' own cautions, and those of approaches (m, of each contact) beyond what a law is good for."""
        return contacts.cautions(self.pairs, self._groups, deepest)

    def approach(self, force: Vector) -> Vector:
        """Return the approach of each contact, m, at a force on each, N, without losses; as it is first loaded."""
        overlap = self._over_contacts(lambda law, i: law.approach(np.maximum(force[i], 0.0)))
        for i, contact in enumerate(self.yielding or ()):
            if contact is not None and force[i] > contact.yield_force:
                overlap[i] = contact.approach(force[i])
        return overlap

    def force(self, approach: Vector) -> Vector:
        """Return the force of each contact, N, at approaches, ... × contacts, m, without losses and springs."""
        force, closed = np.zeros(approach.shape), np.maximum(approach, 0.0)
        for law, which in self._groups.items():
            force[..., which] = law.force(closed[..., which])
        return force

    @property
    def force_by_approach(self) -> bool:
        """True if the force of a contact depends on the approach of its two bodies alone."""
        return isinstance(self.model.loss, NoLoss) and self.yielding is None and self.vibrating is None

    @fact
    def pairs(self) -> tuple[contacts.Pair | None, ...]:
        """The bodies that touch at each contact; None where a force replaces it, or nothing is there."""
        return contacts.pairs_of(self.chain, self.surface, self.behind)

    def _found_law(self, bead: Bead, facing: Bead | Surface) -> ContactLaw:
        """Return the law of two bodies where the user gives none."""
        return contact_law(bead, facing)

    @fact
    def rest(self) -> Vector:
        """The positions in static equilibrium, m, and behind them what contacts that yield remember."""
        approach = self.preload.copy()
        approach[[0, -1]] += np.array([self.behind_flexibility, self.flexibility]) * self.static_force[[0, -1]]
        places: Vector = np.cumsum(approach[::-1])[::-1].copy()
        if self.yielding is None:
            return places
        return np.append(places, contacts.unloading(self.yielding, self.stiffness, self.preload))

    def _over_contacts(self, of: Callable[[ContactLaw, Vector], Vector]) -> Vector:
        """Return of(law, contacts) for each law and the contacts that have it; zero where there is no contact."""
        values = np.zeros(len(self.laws))
        for law, which in self._groups.items():
            values[which] = of(law, which)
        return values

    @fact
    def _groups(self) -> contacts.Groups:
        """The different laws and their contacts."""
        groups = contacts.grouped(self.laws)
        if not groups:
            raise ValueError("beads: a single one that no striker meets and that faces nothing has no contact")
        return groups

    def _check_behind(self) -> None:
        """A surface behind the chain has the place of a striker."""
        spring = finite("behind_flexibility", self.behind_flexibility, "m/N")
        if self.behind is None and spring != 0.0:
            raise ValueError(f"behind_flexibility = {spring!r}: must be 0 where nothing is behind")
        if self.behind is not None:
            instance("behind", self.behind, Surface, "a Surface(material), or None")
            if not self.chain.excitation.allows_structure_behind:
                raise ValueError(
                    f"striker = {type(self.chain.striker).__name__}: must be None or a PushedBead for a chain with a "
                    "structure behind it, which has the striker's place"
                )

    def _check_flexibility(self) -> None:
        """Refuse a spring so negative that the contact would snap shut: its patch is smaller than the contact."""
        deepest = self._deepest_alone
        tangent = self._over_contacts(lambda law, i: law.tangent(deepest[i]))
        for name, contact in (("flexibility", -1), ("behind_flexibility", 0)):
            flexibility = getattr(self, name)
            if (excess := -flexibility * float(tangent[contact])) >= 1.0:
                raise ValueError(
                    f"{name} = {flexibility!r}: more negative than this contact can bear, which is wider than the "
                    f"patch; give the structure a patch_radius at least {ceil(100.0 * excess) / 100.0:g} times as large"
                )

    def _check_step(self) -> None:
        """Refuse a step too long for the highest rate that a contact with all of the scale's energy could have."""
        if self.dt is None:
            return
        object.__setattr__(self, "dt", positive("dt", self.dt, "s"))
        deepest = self._deepest_alone + self.preload
        tangent = self._over_contacts(lambda law, i: law.tangent(deepest[i]))
        fastest = np.sqrt(2.0 * tangent / self.reduced_mass).max()
        largest = min(2.0 / float(fastest), 2.0 * self.damping_time)
        if self.dt > largest:
            raise ValueError(f"dt = {self.dt!r}: too large for a stable step; must be below {largest:.3g} s")
