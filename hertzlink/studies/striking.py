"""Parameters of the studies of section 6.1: the vertical chain, and the cylinder that it strikes."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Annotated

import numpy as np

import hertzlink as hl
from hertzlink.studies.conditions import BEAD, HEIGHT, SPEED, Conditions, WrongValue
from particles.bead import STANDARD_GRAVITY
from structures.elasticity import HIGHEST_FREQUENCY
from structures.reduction import DEFAULT_PULSE
from structures.structure import Vector

BEADS, SENSOR = 20, 7
UNTIL = 1.5e-3  # Length of the thesis's records, s.
DROP_HEIGHT = 0.01
DASHPOTS = (4.0, 5.0, 6.0)  # N s/m, at every contact; the thesis does not give its coefficient.
CROSSING = 1e-6  # s, in which a wave crosses an element of a rod by default.
DASHPOT = hl.quantities.Quantity("N s/m", "a dashpot", "5 N s/m", high=1e6)
BAND = "Dashpot at each contact; of several values the middle one counts, and the others give its band"


@dataclass(frozen=True)
class Striking(Conditions):
    """The chain. Records, meshes and pulses follow the contact time where the chain is not the thesis's."""

    bead: Annotated[float, BEAD, "Diameter of the beads and the striker"] = 9.52e-3
    bead_material: Annotated[hl.Material, "Material of the beads and the striker"] = hl.STEEL_440C
    drop_height: Annotated[float, HEIGHT, "Height from which the striker falls"] = DROP_HEIGHT
    impact_speed: Annotated[float | None, SPEED, "Speed of the striker, in place of the drop height"] = None
    dashpot: Annotated[tuple[float, ...], DASHPOT, BAND] = DASHPOTS

    def check(self) -> None:
        """Refuse both a speed and a height."""
        if self.impact_speed is not None and self.drop_height != DROP_HEIGHT:
            raise WrongValue("impact_speed", self.impact_speed, "give it or the drop height, not both")

    @property
    def sphere(self) -> hl.Sphere:
        """A bead."""
        return hl.Sphere(self.bead / 2.0, self.bead_material)

    @property
    def speed(self) -> float:
        """The speed of the striker, m/s."""
        return hl.drop_speed(self.drop_height) if self.impact_speed is None else self.impact_speed

    @property
    def middle(self) -> float:
        """The dashpot that counts, N s/m."""
        return self.dashpot[len(self.dashpot) // 2]

    def chain(self, dashpot: float | None = None) -> hl.Chain:
        """Return the chain of 20 spheres, with a dashpot, N s/m, by default that which counts."""
        loss = hl.LinearDashpot(self.middle if dashpot is None else dashpot)
        return hl.Chain([self.sphere] * BEADS, self.sphere, self.speed, STANDARD_GRAVITY, loss)

    def wall(self, material: hl.Material) -> float:
        """Return k of a bead on a half-space, N/m^1.5."""
        return hl.theory.hertz_stiffness(self.sphere.surface, hl.Surface(material))

    def time_of_flight(self, wall: Vector | float, restitution: Vector | float = 1.0) -> Vector:
        """Return TOF, s, of the primary wave by equation 6.18, with the 13 beads between sensor 7 and the structure."""
        bead_to_bead = hl.theory.hertz_stiffness(self.sphere.surface, self.sphere.surface)
        return np.asarray(
            hl.theory.primary_time_of_flight(
                BEADS - SENSOR, self.sphere.mass, bead_to_bead, wall, self.speed, restitution
            )
        )

    def contact_time(self, material: hl.Material) -> float:
        """Return the contact time of one bead on a half-space at the striker's speed, s (equation 6.8)."""
        return float(hl.theory.hertz_contact_time(self.sphere.mass, self.wall(material), self.speed))

    def stacks(self) -> Iterable[Sequence[hl.Layer]]:
        """Return the cylinders of the study at their longest."""
        raise NotImplementedError

    @cached_property
    def until(self) -> float:
        """Length of the record, s: the thesis's, in terms of the chain's TOF on a soft wall, and the longest echo."""
        if not self.own:
            return UNTIL
        stacks = list(self.stacks())
        softest = min(self.wall(hl.PTFE), *(self.wall(stack[0].material) for stack in stacks))
        thesis = replace(self, **{name: self.thesis(name) for name in self.differing()})
        scale = float(self.time_of_flight(softest) / thesis.time_of_flight(thesis.wall(hl.PTFE)))
        echo = max(2.0 * sum(layer.length / layer.material.bar_speed for layer in stack) for stack in stacks)
        return UNTIL * scale + echo + self.spring_time()

    def spring_time(self) -> float:
        """Return the time, s, by which a soft layer makes the record longer."""
        return 0.0

    @cached_property
    def sharper(self) -> float:
        """The factor by which the contact is shorter than the thesis's with steel, at least 1."""
        return (
            max(1.0, type(self)().contact_time(hl.STEEL_440C) / self.contact_time(hl.STEEL_440C)) if self.own else 1.0
        )

    def slender(self, layers: Sequence[hl.Layer]) -> hl.Structure:
        """Return the rod of these layers on a fixed base, in the one-dimensional theory; its reduction does not change
        AR and TOF."""
        elements = None
        if self.sharper > 1.0:
            elements = max(ceil(self.sharper * layer.length / layer.material.bar_speed / CROSSING) for layer in layers)
        return hl.reduce(hl.rod(layers, elements=elements), self.until, pulse=DEFAULT_PULSE / self.sharper)

    def check_meshes(self) -> None:
        """Raise a ValueError before any run where a mesh would be too large; the thesis's are not."""
        if self.own:
            for stack in self.stacks():
                try:
                    self._cylinder(stack)
                except ValueError as error:
                    cure = f"makes too fine a mesh for this cylinder ({error}); give larger beads or a smaller cylinder"
                    raise WrongValue("bead", self.bead, cure) from None

    def _cylinder(self, layers: Sequence[hl.Layer]) -> hl.Structure:
        return hl.layered_cylinder(layers, highest_frequency=HIGHEST_FREQUENCY * self.sharper)

    def solid(self, layers: Sequence[hl.Layer]) -> hl.Structure:
        """Return the axisymmetric cylinder of these layers on a fixed base, reduced."""
        return hl.reduce(self._cylinder(layers), self.until, pulse=DEFAULT_PULSE / self.sharper)
