"""Chains of deformable beads, whose motion between the contacts is described by a few of their own vibrations.

Substructuring with free interfaces (MacNeal, Comput. Struct. 1 (1971) 581): a bead moves by its rigid motion and its
lowest free vibrations; beyond those it deforms at once. Of that the part at the pole which is pushed is in the
contact's law, which is not linear; the part at the other pole is a flexibility (`Vibration.cross`).
"""

from collections.abc import Callable
from functools import cached_property, lru_cache
from math import ceil, inf, log2, pi
from typing import Annotated, Any, TypeVar

import numpy as np

from particles import contacts
from particles.bead import Bead
from particles.chain import Chain
from particles.deformable.vibration import Vibration, vibration
from particles.kernels.vibrations import Vibrating
from particles.laws.axisymmetric import computed_law
from particles.laws.axisymmetric_mesh import body_of
from particles.laws.formulas import NARROWEST, SAMPLES, contact_law
from particles.laws.law import ContactLaw, TabulatedLaw
from particles.laws.yielding import YieldingLaw
from particles.moving import MovingChain
from structures.checks import function, short
from structures.damping import Modal, Viscous
from structures.described import described
from structures.quantities import Asks, Count
from structures.structure import Vector
from structures.surface import Surface

MOST_MODES = 20
"""More take time and change little: eight and sixteen modes give the same wave to 0.01 % (docs/deformable.md)."""

DAMPING = "hl.damping.Modal, Rayleigh or StandardLinearSolid, a function of a bead that returns one, or None"

STEPS_PER_VIBRATION = 30
"""Steps in the shortest period of a bead's modes."""

BEYOND = 4.0
"""How far tables go on beyond the deepest approach."""

LEAST_LEFT = 0.2
"""Part of a contact's flexibility that the modes must leave to it: else small errors of both are large ones of what is
left."""

T = TypeVar("T")


@described
class DeformableChain(Chain):
    """A chain whose beads deform and vibrate, as in the thesis's finite elements.

    It replaces a Chain anywhere; results also hold the force through each bead's central section, and the amplitudes
    and energies of its vibration. Gravity, springs, dead loads and force histories act on beads as a whole; losses
    depend on the rate at which poles approach.

    Parameters
    ----------
    beads : sequence of Bead
        Spheres, HollowSpheres and Ellipsoids along the chain, from the struck end on.
    striker, impact_speed, gravity, dissipation, preload, inclination : as of a Chain
        A body that strikes is one of these beads too.
    law : ContactLaw or callable or None
        By default that of finite elements, `hl.laws.computed_law`, up to the approach at which one contact would hold
        all of the striker's energy. One that is given must count the approach of mid-planes.
    modes : int
        The rigid motion and the lowest axisymmetric vibrations of each free bead, 1 to 20. With 1 the beads are rigid
        outside their contacts.
    vibrations : callable
        Function of a bead and the number of its elastic modes that returns a Vibration; by default by finite elements.
    damping : Viscous or callable or None
        The loss inside the beads and the striker: `hl.damping.Modal`, `hl.damping.Rayleigh` or
        `hl.damping.StandardLinearSolid`, or a function of a bead that returns one of them or None.

    References
    ----------
    MacNeal, Comput. Struct. 1 (1971) 581; Khatri's thesis, section 3.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> hl.DeformableChain([bead] * 10, bead, impact_speed=0.44, modes=4)
    DeformableChain(10 Sphere, struck by Sphere at 0.44 m/s, modes=4)
    """

    modes: Annotated[int, Count(1, MOST_MODES), Asks("the motions of a bead that deforms, such as 8")] = 8
    vibrations: Callable[[Bead, int], Vibration] = vibration
    damping: Annotated[Viscous | Callable[[Bead], Viscous | None], Asks("a loss inside beads that deform")] | None = (
        None
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.law, YieldingLaw):
            raise ValueError(f"law = {self.law!r}: needs rigid beads; give a Chain, not a DeformableChain")
        function("vibrations", self.vibrations, 2, "a function of a bead and a number of modes")
        if self.damping is not None and not isinstance(self.damping, Viscous):
            function("damping", self.damping, 1, DAMPING)
        if isinstance(self.damping, Modal):
            self.damping.of_modes(np.ones(1))  # it refuses what damps structures only
        if self.damping is not None and self.modes == 1:
            raise ValueError("damping: acts on vibrations, which modes = 1 leaves out; take more modes")
        for i, bead in enumerate(self.beads):
            body_of(bead, 1.0, f"beads[{i}]")
        if self.body is not None:
            body_of(self.body, 1.0, "striker")


class MovingDeformableChain(MovingChain):
    """A DeformableChain as a participant, see MovingChain.

    Its state's positions and velocities are those of the centres of mass, and behind them the amplitudes (m √kg) and
    rates of the modes, body by body. laws count the approach of mid-planes, local_laws what is left of it without the
    modes.
    """

    chain: DeformableChain

    def _of_bodies(self, of: Callable[[Any], T]) -> tuple[T | None, ...]:
        """Return of(body) of body 0 and of the beads, found once for equal ones; None where there is no body."""
        bodies = (self.chain.body, *self.chain.beads)
        found = {body: None if body is None else of(body) for body in dict.fromkeys(bodies)}
        return tuple(found[body] for body in bodies)

    @cached_property
    def shapes(self) -> tuple[Vibration | None, ...]:
        """The vibrations of body 0 and of the beads; None where there is no body."""
        return self._of_bodies(lambda body: self.chain.vibrations(body, self.chain.modes - 1))

    @cached_property
    def vibrations(self) -> Vibrating:
        """The vibrations of the bodies as a piece of the compiled loops."""
        damping, bodies, elastic = self.chain.damping, len(self.shapes), self.chain.modes - 1
        stiffness, struck, far, rate, arm, relaxation = (np.zeros((bodies, elastic)) for _ in range(6))
        cross = np.zeros(bodies)
        losses = self._of_bodies(lambda body: damping(body) if callable(damping) else damping)
        for i, (shape, loss) in enumerate(zip(self.shapes, losses, strict=True)):
            if not isinstance(loss, Viscous | None):
                raise ValueError(f"damping: gives {short(loss)} for a bead; must be {DAMPING}")
            if shape is not None and elastic:
                stiffness[i], struck[i], far[i] = shape.frequencies**2, shape.struck, shape.far
                cross[i] = shape.cross
                if loss is not None:
                    stiffness[i], rate[i], arm[i], relaxation[i] = loss.of_modes(shape.frequencies)
        if not arm.any():
            none = np.zeros((bodies, 0))
            arm, relaxation, rate = none, none, rate if rate.any() else none
        return Vibrating(stiffness, struck, far, cross, rate, arm, relaxation)

    @cached_property
    def local_laws(self) -> tuple[ContactLaw | None, ...]:
        """Force against the approach of poles less what the modes hold: the residual flexibility, and Hertz's."""
        if self.chain.modes == 1:
            return self.laws
        softness = [0.0 if shape is None else shape.compression - shape.cross for shape in self.shapes]
        in_modes = np.add(softness, [*softness[1:], 0.0]).tolist()
        return tuple(
            law and _without(law, flexibility, self._deepest(law), self.chain.modes)
            for law, flexibility in zip(self.laws, in_modes, strict=True)
        )

    @property
    def vibrating(self) -> Vibrating | None:
        """The vibrations of the bodies as a piece; None where they are rigid."""
        return None if self.chain.modes == 1 else self.vibrations

    @cached_property
    def damping_time(self) -> float:
        """The shortest time, s, in which a loss would stop a contact or a vibration."""
        return min(self._damping_times)

    @property
    def strongest_loss(self) -> tuple[str, bool]:
        in_contacts, in_bodies = self._damping_times
        if in_contacts <= in_bodies:
            return super().strongest_loss
        return f"damping = {short(self.chain.damping)}", False

    @cached_property
    def _damping_times(self) -> tuple[float, float]:
        """The times of contacts, whose poles are lighter than their bodies, and of vibrations."""
        vibrations, inverse = self.vibrations, 1.0 / self.reduced_mass
        behind, ahead = (vibrations.far**2).sum(axis=1), np.append((vibrations.struck**2).sum(axis=1)[1:], 0.0)
        in_contacts = self._damping_of_contacts() * float((inverse / (inverse + behind + ahead)).min())
        fastest = max(float(vibrations.rate.max(initial=0.0)), float(vibrations.relaxation.max(initial=0.0)))
        return in_contacts, 1.0 / fastest if fastest > 0.0 else inf

    @cached_property
    def longest_step(self) -> float:
        """The step by default, s."""
        return min(super().longest_step, self._shortest_period / (STEPS_PER_VIBRATION * max(self.fineness, 1.0)))

    @cached_property
    def _shortest_period(self) -> float:
        stiffness, arm = self.vibrations.stiffness, self.vibrations.arm
        fastest = float((stiffness + arm if arm.size else stiffness).max(initial=0.0)) ** 0.5
        return 2.0 * pi / fastest if fastest > 0.0 else inf

    def amplitudes(self, coordinates: Vector) -> Vector:
        """Return the amplitudes of the modes, or their rates, from positions or velocities, saved times × bodies ×
        modes."""
        bodies, (_, elastic) = self.mass.size, self.vibrations.struck.shape
        return coordinates[:, bodies : bodies * (1 + elastic)].reshape(len(coordinates), bodies, elastic)

    def poles(self, position: Vector) -> tuple[Vector, Vector]:
        """Return where the bodies' poles are, of the struck side and the other, saved times × bodies, m; see
        `ChainState`."""
        bodies = self.mass.size
        amplitude = self.amplitudes(position)
        struck, far = ((shape * amplitude).sum(axis=2) for shape in (self.vibrations.struck, self.vibrations.far))
        return position[:, :bodies] + struck, position[:, :bodies] + far

    def section_force(self, contact_force: Vector, position: Vector, velocity: Vector) -> Vector:
        """Return the compressive force through the central section of each body, saved times × bodies, N.

        contact_force, position and velocity: saved times × contacts, and × coordinates. From the momentum of the struck
        half.
        """
        vibrations = self.vibrations
        amplitude = self.amplitudes(position)
        # Where nothing touches the first bead, a force history stands for its contact, which pushes all of the bead.
        pushed = np.where([law is not None for law in self.laws[:-1]], contact_force[:, :-1], 0.0)
        behind = np.column_stack([np.zeros(len(contact_force)), pushed])[:, :, None]
        ahead = contact_force[:, :, None]
        acceleration = vibrations.struck * behind - vibrations.far * ahead - vibrations.stiffness * amplitude
        if vibrations.rate.size:
            acceleration -= vibrations.rate * self.amplitudes(velocity)
        if vibrations.arm.size:
            acceleration -= vibrations.arm * self._stretch(position)
        section = np.array([np.zeros(self.chain.modes - 1) if s is None else s.section for s in self.shapes])
        force: Vector = 0.5 * (behind + ahead)[:, :, 0] - (section * acceleration).sum(axis=2)
        return force

    def vibration_energy(self, position: Vector, velocity: Vector) -> Vector:
        """Return the kinetic and elastic energy of each body's modes beyond the rigid one, saved times × bodies, J."""
        amplitude, rate = self.amplitudes(position), self.amplitudes(velocity)
        energy: Vector = 0.5 * (rate**2 + self.vibrations.stiffness * amplitude**2).sum(axis=2)
        if self.vibrations.arm.size:
            energy += 0.5 * (self.vibrations.arm * self._stretch(position) ** 2).sum(axis=2)
        return energy

    def _stretch(self, position: Vector) -> Vector:
        """Return the stretch q − z of the arms' springs, saved times × bodies × modes."""
        amplitude = self.amplitudes(position)
        return amplitude - position[:, -amplitude[0].size :].reshape(amplitude.shape)

    def _found_law(self, bead: Any, facing: Any) -> ContactLaw:
        """Return the law by finite elements; by formulas for surfaces of structures that are curved in one direction
        only."""
        analytic = contact_law(bead, facing)
        if isinstance(facing, Surface) and facing.second_curvature != facing.curvature:
            return analytic
        deepest, speed = self._deepest(analytic), self.chain.impact_speed
        try:
            # To the next power of √2, so that the runs of a sweep share their laws.
            return _law_of_bodies(bead, facing, max_approach=2.0 ** (ceil(2.0 * log2(deepest)) / 2.0))
        except ValueError as error:
            culprit = "chain" if speed is None else f"impact_speed = {speed!r}"
            raise ValueError(
                f"{culprit}: a contact that holds all {self.energy:.3g} J is pressed by {deepest:.3g} m, for which "
                "finite elements give no law; take less, or give a law"
            ) from error

    def _deepest(self, law: ContactLaw) -> float:
        """Return the approach, m, at which one contact would hold all energy, on top of the greatest static force."""
        beads = sum(bead.mass for bead in self.chain.beads)
        static = self.chain.preload + abs(self.chain.gravity_along) * beads
        return float(law.overlap(np.array(self.energy)) + law.approach(np.array(static)))

    @cached_property
    def rest(self) -> Vector:
        """The positions and amplitudes in static equilibrium."""
        force, vibrations = self.static_force, self.vibrations
        behind, ahead = np.append(0.0, force[:-1])[:, None], force[:, None]
        rates = np.where(vibrations.stiffness > 0.0, vibrations.stiffness, inf)
        amplitude = (vibrations.struck * behind - vibrations.far * ahead) / rates
        approach = np.zeros_like(force)
        for law, which in contacts.grouped(self.local_laws).items():
            approach[which] = law.approach(force[which])
        approach[[0, -1]] += np.array([self.behind_flexibility, self.flexibility]) * force[[0, -1]]
        approach[1:] -= vibrations.cross[1:] * force[:-1]
        approach[:-1] -= vibrations.cross[1:] * force[1:]
        shortened = approach - (vibrations.far * amplitude).sum(axis=1)
        shortened[:-1] += (vibrations.struck * amplitude).sum(axis=1)[1:]
        arms = amplitude.ravel() if vibrations.arm.size else np.empty(0)
        return np.concatenate([np.cumsum(shortened[::-1])[::-1], amplitude.ravel(), arms])

    def _check_step(self) -> None:
        super()._check_step()
        largest = self._shortest_period / pi
        if self.dt is not None and self.dt > 0.9 * largest:
            raise ValueError(f"dt = {self.dt!r}: too large for the beads' modes; must be below {0.9 * largest:.3g} s")


def moving_chain(chain: Chain, *facts: Any, **more: Any) -> MovingChain:
    """Return what moves a chain, of rigid or of deformable beads; see MovingChain for what else it takes."""
    kind = MovingDeformableChain if isinstance(chain, DeformableChain) else MovingChain
    return kind(chain, *facts, **more)


_law_of_bodies = lru_cache(maxsize=256)(computed_law)


@lru_cache(maxsize=64)  # the runs of a fit or a sweep share their tables
def _without(law: ContactLaw, flexibility: float, deepest: float, modes: int) -> ContactLaw:
    """Return the law less a linear flexibility, m/N: as deep as enough is left, and as `deepest`, m, at least."""
    approaches = np.geomspace(NARROWEST, BEYOND * deepest, SAMPLES)
    forces = law.force(approaches)
    local = approaches - flexibility * forces
    enough = np.append(True, np.diff(local) > LEAST_LEFT * np.diff(approaches))
    count = approaches.size if enough.all() else int(enough.argmin())
    if approaches[count - 1] < deepest:
        raise ValueError(
            f"modes = {modes!r}: too many for a contact that is pressed by {deepest:.3g} m, and whose law is that of "
            f"{law.name}; they suit up to {approaches[count - 1]:.3g} m; take fewer, or give a law= of mid-planes"
        )
    return TabulatedLaw(local[:count], forces[:count], law.name, law.caution)  # type: ignore[arg-type]
