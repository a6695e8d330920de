"""Chains of beads that move in their lowest free vibrations, with the quasi-static compliance of all higher modes.

The contact's law contains the compliance at the pushed pole. The compliance at the other pole is `Vibration.cross`
(MacNeal, Comput. Struct. 1 (1971) 581).
"""

from functools import cached_property, lru_cache
from math import ceil, log2
from typing import Annotated, Any

import numpy as np

from particles.chain import Chain
from particles.deformable.vibration import Vibration, vibration
from particles.kernels.vibrations import Vibrations
from particles.laws.axisymmetric import computed_law
from particles.laws.axisymmetric_mesh import body_of
from particles.laws.formulas import NARROWEST, SAMPLES, law_of_bodies
from particles.laws.law import ContactLaw, TabulatedLaw
from particles.laws.yielding import YieldingLaw
from particles.moving import MovingChain
from structures.checks import instance
from structures.damping import Viscous
from structures.described import described
from structures.quantities import Asks, Count
from structures.structure import Vector
from structures.surface import Surface

BEYOND = 4.0  # extent of local laws, in deepest approaches


@described
class DeformableChain(Chain):
    """A chain whose beads deform and vibrate, like the finite elements of the thesis (section 3.2).

    It can replace a Chain anywhere. Results also hold the force through each bead's central section, and its vibration.

    Parameters
    ----------
    beads, striker, impact_speed, gravity, dissipation, preload, inclination : as in Chain
        The bodies are Spheres, HollowSpheres and Ellipsoids along the chain.
    law : ContactLaw or callable or None
        A law of the approach of the mid-planes; by default from finite elements, `hl.laws.computed_law`.
    modes : int
        Number of modes of each free bead, 1 to 20: the rigid motion and the lowest axisymmetric vibrations.
    damping : Viscous or None
        The loss inside the beads and the striker: `hl.damping.Modal` or `Rayleigh`.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.DeformableChain([bead] * 10, bead, impact_speed=0.44, modes=4)
    """

    modes: Annotated[int, Count(1, 20), Asks("the motions of a bead that deforms, such as 8")] = 8
    damping: Annotated[Viscous, Asks("a loss inside beads that deform")] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.law, YieldingLaw):
            raise ValueError(f"law = {self.law!r}: must not yield in a DeformableChain; give a Chain")
        if self.damping is not None:
            instance("damping", self.damping, Viscous, "hl.damping.Modal(ratio) or Rayleigh")
            self.damping.of_modes(np.ones(1))  # refuses damping that is for structures only
            if self.modes == 1:
                raise ValueError("damping: must be None for modes = 1, as there are no vibrations to damp")
        for i, bead in enumerate(self.beads):
            body_of(bead, 1.0, f"beads[{i}]")
        if self.body is not None:
            body_of(self.body, 1.0, "striker")


class MovingDeformableChain(MovingChain):
    """A DeformableChain as a participant. The amplitudes of the modes follow the positions of the centres of mass.
    `laws` are laws of the approach of the mid-planes; `local_laws` are those of the remainder without the modes.
    """

    chain: DeformableChain

    @cached_property
    def shapes(self) -> tuple[Vibration | None, ...]:
        """The vibrations of body 0 and of the beads; None without a body."""
        bodies: tuple[Any, ...] = (self.chain.body, *self.chain.beads)
        return tuple(None if body is None else vibration(body, self.chain.modes - 1) for body in bodies)

    @cached_property
    def vibrations(self) -> Vibrations:  # type: ignore[override]
        damping, elastic = self.chain.damping, self.chain.modes - 1
        stiffness, struck, far, rate = np.zeros((4, len(self.shapes), elastic))
        cross = np.zeros(len(self.shapes))
        for i, shape in enumerate(self.shapes):
            if shape is not None and elastic:
                stiffness[i], struck[i], far[i], cross[i] = shape.frequencies**2, shape.struck, shape.far, shape.cross
                if damping is not None:
                    rate[i] = damping.of_modes(shape.frequencies)
        return Vibrations(stiffness, struck, far, rate, cross)

    def law_between(self, bead: Any, facing: Any) -> ContactLaw:
        """Return a law by finite elements, or by formulas for a structure that is not round at the contact."""
        analytic = law_of_bodies(bead, facing)
        if isinstance(facing, Surface) and facing.second_curvature != facing.curvature:
            return analytic
        deepest, speed = self._deepest(analytic), self.chain.impact_speed
        try:
            # Up to the next power of √2, so that the runs of a sweep share their laws.
            return _law_of_bodies(bead, facing, max_approach=2.0 ** (ceil(2.0 * log2(deepest)) / 2.0))
        except ValueError as error:
            culprit = "chain" if speed is None else f"impact_speed = {speed!r}"
            raise ValueError(f"{culprit}: gives {self.energy:.3g} J, too much for finite elements; add law=") from error

    @cached_property
    def local_laws(self) -> tuple[ContactLaw | None, ...]:
        if self.chain.modes == 1:
            return self.laws
        softness = [0.0 if shape is None else shape.compression - shape.cross for shape in self.shapes]
        in_modes = np.add(softness, [*softness[1:], 0.0]).tolist()
        pairs = zip(self.laws, in_modes, strict=True)
        return tuple(law and _local_law(law, part, self._deepest(law), self.chain.modes) for law, part in pairs)

    def _deepest(self, law: ContactLaw) -> float:
        """Return the approach, m, at which one contact would hold all energy, plus that of the largest static force."""
        beads = sum(bead.mass for bead in self.chain.beads)
        static = self.chain.preload + abs(self.chain.gravity_along) * beads
        return float(law.overlap(np.array(self.energy)) + law.approach(np.array(static)))

    def section_force(self, contact_force: Vector, position: Vector, velocity: Vector) -> Vector:
        """Return the compressive force through the central section of each body, N, by the struck half's momentum."""
        vibrations = self.vibrations
        # If nothing touches the first bead, contact 1 is a force history, which acts on the whole bead.
        pushed = np.where([law is not None for law in self.laws[:-1]], contact_force[:, :-1], 0.0)
        behind = np.column_stack([np.zeros(len(contact_force)), pushed])[:, :, None]
        ahead = contact_force[:, :, None]
        elastic = vibrations.stiffness * self.amplitudes(position)
        viscous = vibrations.rate * self.amplitudes(velocity)
        acceleration = vibrations.struck * behind - vibrations.far * ahead - elastic - viscous
        section = np.array([np.zeros(self.chain.modes - 1) if s is None else s.section for s in self.shapes])
        return np.asarray(0.5 * (behind + ahead)[:, :, 0] - (section * acceleration).sum(axis=2))

    def vibration_energy(self, position: Vector, velocity: Vector) -> Vector:
        """Return the kinetic and elastic energy of each body's modes, times × bodies, J."""
        amplitude, rate = self.amplitudes(position), self.amplitudes(velocity)
        return np.asarray(0.5 * (rate**2 + self.vibrations.stiffness * amplitude**2).sum(axis=2))


def moving_chain(chain: Chain, *facts: Any, **more: Any) -> MovingChain:
    """Return the MovingChain of a chain of rigid or deformable beads."""
    kind = MovingDeformableChain if isinstance(chain, DeformableChain) else MovingChain
    return kind(chain, *facts, **more)


_law_of_bodies = lru_cache(maxsize=256)(computed_law)


@lru_cache(maxsize=64)  # the runs of a fit or a sweep share their tables
def _local_law(law: ContactLaw, flexibility: float, deepest: float, modes: int) -> ContactLaw:
    """Return the law without a linear flexibility, m/N, up to at least the approach `deepest`, m."""
    approaches = np.geomspace(NARROWEST, BEYOND * deepest, SAMPLES)
    forces = law.force(approaches)
    local = approaches - flexibility * forces
    # If the modes account for almost all of the approach, small errors of both are large in the remainder.
    enough = np.append(True, np.diff(local) > 0.2 * np.diff(approaches))
    count = approaches.size if enough.all() else int(enough.argmin())
    if approaches[count - 1] < deepest:
        raise ValueError(f"modes = {modes!r}: must be fewer for a contact of {law.name} pressed by {deepest:.3g} m")
    return TabulatedLaw(local[:count], forces[:count], law.name, law.caution)  # type: ignore[arg-type]
