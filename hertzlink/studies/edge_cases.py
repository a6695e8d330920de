"""A chain at a distance from one straight edge of a plate, in the units of the law of the critical distance."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import shared
from plates.critical_distance import edge_length

# Length of records in contact times of aluminium plates, after 30 of which the slowest reflected wave returns; and the
# ratio of contact stiffnesses of steel beads on aluminium, up to which it is enough.
RECORD, ALUMINIUM_STIFFNESS_RATIO = 45.0, 0.743
STEPS_PER_CONTACT = 450  # Steps of the chain in a contact time. The default of 1800 changes AR by 1e-6.
HIGHEST_PHASE = 3.3  # Highest frequency of the half-plane times the contact time. Twice this value changes AR by 2e-5.
# A wave below this fraction of the incident one counts as none, with AR = 0; the law's error is larger.
SMALLEST_WAVE = 2e-3
# The bead and speed of the law's table; any others with the same λ, d/ℓ and ratio of stiffnesses give the same AR.
BEAD, SPEED = hl.Sphere(5e-3, hl.STEEL_440C), 0.3


@dataclass(frozen=True)
class Pair:
    """A chain of equal beads on a plate of a material, struck at a speed, m/s; λ determines the plate's thickness."""

    bead: hl.Sphere
    wall: hl.Material
    speed: float = 0.31

    @cached_property
    def chain(self) -> hl.Chain:
        return hl.Chain([self.bead] * shared.BEADS, self.bead, self.speed)

    @cached_property
    def contact_time(self) -> float:
        """T_c, s: Hertz's contact time of a bead on a half-space at the striker speed."""
        return shared.contact_time(self.bead, self.wall, self.speed)

    @property
    def stiffness_ratio(self) -> float:
        """Stiffness of the contact between bead and plate over that between two beads."""
        return shared.wall_stiffness(self.bead, self.wall) / shared.long_waves(self.bead).stiffness

    def plate(self, inelasticity: float) -> hl.Plate:
        """Return a plate of the thickness that gives λ, which goes as its power −2."""
        thin = hl.kirchhoff_plate(1.0, 1.0, 1e-3, self.wall, hl.Supports())
        parameter = hl.theory.PlateImpact(self.bead, thin, self.speed).inelasticity
        return hl.kirchhoff_plate(1.0, 1.0, float(1e-3 * (parameter / inelasticity) ** 0.5), self.wall, hl.Supports())

    def length(self, inelasticity: float) -> float:
        return edge_length(self.bead, self.plate(inelasticity), self.speed)

    def struck(self, edge: str, inelasticity: float, scaled: float, until: float | None = None) -> hl.Structure:
        """Return the plate at d/ℓ from an edge, a half-space directly at a supported one, the infinite plate far away.

        until: the longest run, s; by default the `record`.
        """
        thickness = self.plate(inelasticity).thickness
        if np.isinf(scaled):
            return hl.infinite_plate(thickness, self.wall)
        if scaled == 0.0 and edge != "free":
            return hl.half_space(self.wall)
        distance, highest = scaled * self.length(inelasticity), HIGHEST_PHASE / self.contact_time
        return hl.half_plane(thickness, self.wall, edge, distance, until or self.record, highest)

    @property
    def record(self) -> float:
        """Length of the record, s. Stiff walls shorten T_c, but not the travel time of the wave in the chain."""
        return float(RECORD * self.contact_time * max(1.0, (self.stiffness_ratio / ALUMINIUM_STIFFNESS_RATIO) ** 0.4))

    def coupled(self, structure: hl.Structure) -> hl.CoSimulation:
        return hl.CoSimulation(self.chain, structure, dt=self.contact_time / STEPS_PER_CONTACT)


# The thesis's middle bead on aluminium; λ determines the thickness of the plate.
LARGE, SMALL = hl.Sphere(4.765e-3, hl.STEEL_440C), hl.Sphere(2.38e-3, hl.STEEL_440C)
MAIN = Pair(LARGE, hl.ALUMINIUM_6061)
# Other beads, speeds and materials at the same λ and d/ℓ.
OTHER_PAIRS = {
    "4.76 mm beads": Pair(SMALL, hl.ALUMINIUM_6061),
    "1.2 m/s": Pair(LARGE, hl.ALUMINIUM_6061, 1.2),
    "steel 316 beads": Pair(hl.Sphere(LARGE.radius, hl.STEEL_316), hl.ALUMINIUM_6061),
    "brass beads": Pair(hl.Sphere(LARGE.radius, hl.BRASS_360), hl.ALUMINIUM_6061),
    "glass plate": Pair(LARGE, hl.Material(70e9, 0.22, 2500.0, "glass")),
    "copper plate": Pair(LARGE, hl.MATERIALS["copper"]),
    "steel plate": Pair(LARGE, hl.STEEL_440C),
}
SAME_MATERIALS = ("4.76 mm beads", "1.2 m/s")  # The pairs with the materials of MAIN.


def tabulated_pair(stiffness_ratio: float) -> Pair:
    """Return BEAD on a plate that gives the ratio: 1/E* = 1/M + 1/M_plate, M = E/(1 − ν²); pairs: half the radius."""
    modulus = hl.STEEL_440C.contact_modulus * stiffness_ratio / (2.0 * 2.0**0.5 - stiffness_ratio)
    return Pair(BEAD, hl.Material(modulus * (1.0 - 0.33**2), 0.33, 2700.0), SPEED)


def ratio(run: xr.Dataset) -> float:
    """Return AR of the primary wave; 0 if there is none."""
    primary = hl.reflections(run, shared.SENSOR, SMALLEST_WAVE).primary
    return primary.amplitude_ratio if primary else 0.0


def measure(run: xr.Dataset) -> xr.Dataset:
    return xr.Dataset({"amplitude_ratio": ratio(run)})


def ratios(pair: Pair, edge: str, inelasticity: float, distances: Iterable[float]) -> list[float]:
    """Return AR at distances over ℓ; infinity is the plate without an edge."""
    return [ratio(pair.coupled(pair.struck(edge, inelasticity, distance)).run(pair.record)) for distance in distances]
