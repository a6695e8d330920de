"""A chain at a distance from one straight edge of a plate, in the units of the law of the critical distance."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import reflections
from hertzlink.studies.on_plates import ALUMINIUM_STIFFNESS_RATIO, BEADS, RECORD, SENSOR
from particles.bead import Sphere
from particles.chain import Chain
from plates.builders import kirchhoff_plate
from plates.critical_distance import edge_length
from plates.half_plane import half_plane
from plates.infinite import infinite_plate
from plates.plate import Plate
from plates.support import Supports
from plates.theory.impact import inelasticity_parameter, wall_stiffness
from structures.layers import contact_time as contact_time_half_space
from structures.material import ALUMINIUM_6061, BRASS_360, COPPER, STEEL_316, STEEL_440C, Material
from structures.structure import Structure, half_space
from structures.surface import hertz_stiffness

STEPS_PER_CONTACT = 450
"""Steps of the chain in a contact time. The default of 1800 changes AR by 1e-6."""

HIGHEST_PHASE = 3.3
"""Highest frequency of the half-plane times the contact time. Twice this value changes AR by 2e-5."""

SMALLEST_WAVE = 2e-3
"""A wave below this fraction of the incident one counts as none, with AR = 0; the law's error is larger."""

BEAD, SPEED = Sphere(5e-3, STEEL_440C), 0.3
"""The bead and speed of the law's table; any others with the same λ, d/ℓ and ratio of stiffnesses give the same AR."""


@dataclass(frozen=True)
class Pair:
    """A chain of equal beads on a plate of a material, struck at a speed, m/s; λ determines the thickness
    of the plate.
    """

    bead: Sphere
    wall: Material
    speed: float

    @cached_property
    def chain(self) -> Chain:
        """The chain and its striker, undamped and without gravity."""
        return Chain([self.bead] * BEADS, striker=self.bead, impact_speed=self.speed)

    @cached_property
    def contact_time(self) -> float:
        """T_c, s: Hertz's contact time of a bead on a half-space at the striker speed."""
        return float(contact_time_half_space(self.bead.mass, wall_stiffness(self.bead, self._plate(1e-3)), self.speed))

    @property
    def stiffness_ratio(self) -> float:
        """Stiffness of the contact between bead and plate over that between two beads."""
        wall = wall_stiffness(self.bead, self._plate(1e-3))
        return float(wall / hertz_stiffness(self.bead.surface, self.bead.surface))

    def plate(self, inelasticity: float) -> Plate:
        """Return a plate of the thickness that gives λ."""
        parameter = inelasticity_parameter(self.bead, self._plate(1e-3), self.speed)
        return self._plate(float(1e-3 * (parameter / inelasticity) ** 0.5))

    def length(self, inelasticity: float) -> float:
        """Return ℓ, m."""
        return edge_length(self.bead, self.plate(inelasticity), self.speed)

    def struck(self, edge: str, inelasticity: float, scaled_distance: float, until: float | None = None) -> Structure:
        """Return the plate at a distance d/ℓ from an edge; a half-space directly at a supported edge, the infinite
        plate far away.

        until: the longest run, s; by default the `record`.
        """
        thickness = self.plate(inelasticity).thickness
        if np.isinf(scaled_distance):
            return infinite_plate(thickness, self.wall)
        if scaled_distance == 0.0 and edge != "free":
            return half_space(self.wall)
        distance, highest = scaled_distance * self.length(inelasticity), HIGHEST_PHASE / self.contact_time
        return half_plane(thickness, self.wall, edge, distance, until or self.record, highest)

    @property
    def record(self) -> float:
        """Length of the record, s. Stiff walls shorten T_c, but not the travel time of the wave in the chain."""
        return float(RECORD * self.contact_time * max(1.0, (self.stiffness_ratio / ALUMINIUM_STIFFNESS_RATIO) ** 0.4))

    def coupled(self, structure: Structure) -> CoSimulation:
        """Return the chain against a structure."""
        return CoSimulation(self.chain, structure, dt=self.contact_time / STEPS_PER_CONTACT)

    def _plate(self, thickness: float) -> Plate:
        return kirchhoff_plate(1.0, 1.0, thickness, self.wall, Supports())


MAIN = Pair(Sphere(4.765e-3, STEEL_440C), ALUMINIUM_6061, 0.31)
"""The thesis's middle bead on aluminium; λ determines the thickness of the plate."""

OTHER_PAIRS = {
    "4.76 mm beads": Pair(Sphere(2.38e-3, STEEL_440C), ALUMINIUM_6061, 0.31),
    "1.2 m/s": Pair(Sphere(4.765e-3, STEEL_440C), ALUMINIUM_6061, 1.2),
    "steel 316 beads": Pair(Sphere(4.765e-3, STEEL_316), ALUMINIUM_6061, 0.31),
    "brass beads": Pair(Sphere(4.765e-3, BRASS_360), ALUMINIUM_6061, 0.31),
    "glass plate": Pair(Sphere(4.765e-3, STEEL_440C), Material(70e9, 0.22, 2500.0, "glass"), 0.31),
    "copper plate": Pair(Sphere(4.765e-3, STEEL_440C), COPPER, 0.31),
    "steel plate": Pair(Sphere(4.765e-3, STEEL_440C), STEEL_440C, 0.31),
}
"""Other beads, speeds and materials at the same λ and d/ℓ."""

SAME_MATERIALS = ("4.76 mm beads", "1.2 m/s")
"""The pairs with the materials of MAIN."""


def tabulated_pair(stiffness_ratio: float) -> Pair:
    """Return BEAD on a plate that gives the ratio: 1/E* = 1/M + 1/M_plate, M = E/(1 − ν²); two beads have half the
    radius."""
    beads = STEEL_440C.contact_modulus
    modulus = beads * stiffness_ratio / (2.0 * 2.0**0.5 - stiffness_ratio)
    return Pair(BEAD, Material(modulus * (1.0 - 0.33**2), 0.33, 2700.0), SPEED)


def ratio(run: xr.Dataset) -> float:
    """Return AR of the primary wave; 0 if there is none."""
    primary = reflections(run, SENSOR, SMALLEST_WAVE).primary
    return primary.amplitude_ratio if primary else 0.0


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return the part of a run that the study keeps."""
    return xr.Dataset({"amplitude_ratio": ratio(run)})


def ratios(pair: Pair, edge: str, inelasticity: float, distances: Iterable[float]) -> list[float]:
    """Return AR at distances over ℓ; infinity is the plate without an edge."""
    return [ratio(pair.coupled(pair.struck(edge, inelasticity, distance)).run(pair.record)) for distance in distances]
