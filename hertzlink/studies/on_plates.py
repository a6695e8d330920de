"""Parameters that can be changed in the studies of section 6.2: the chain, and the plate that it strikes."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import waves
from hertzlink.studies.conditions import BEAD, LENGTH, SPEED, THICKNESS, Conditions, WrongValue
from plates.critical_distance import edge_length
from plates.theory.impact import THESIS_IMPACT
from structures.reduction import DEFAULT_PULSE

SIDE, IMPACT_SPEED = 0.914, 0.31
THICKNESSES = (2.29e-3, 3.18e-3, 4.83e-3)
DIAMETERS = (4.76e-3, 9.53e-3, 19.05e-3)
BEADS, SENSOR = 20, 7
# Length of the record, s. Chains of the largest beads on the two thinner plates send a wave back only when the echo of
# the edge pushes them; the larger the distance of the edge, the later this is. Records of up to 15 ms do not settle
# these cases (docs/numerics.md).
UNTIL = 3.5e-3
# Hz, resolved by the mesh. Where AR above 0.03 was sampled, it is within 0.3 % of AR on a mesh for 100 kHz. The default
# of 40 kHz is equally close and takes 50 % longer (benchmarks/plate_meshes.py).
HIGHEST_FREQUENCY = 30.0e3
# Length of other records in contact times of aluminium plates, after 30 of which the slowest reflected wave returns;
# and the ratio of contact stiffnesses of steel beads on aluminium, up to which it is enough.
RECORD, ALUMINIUM_STIFFNESS_RATIO = 45.0, 0.743
# Of a plate's mesh, about. Its reduction takes some minutes and 4 GB.
CELLS_PER_WAVELENGTH, MOST_UNKNOWNS = 1.4, 250_000
SCAN = (*(0.25 * i for i in range(2, 17)), 4.5, 5.0, 6.0, 8.0, 10.0)
# The first scan of other plates in units of ℓ = (T_c √(D/m))^½, on which AR near an edge depends.
QUICK_SCAN = (0.5, 1.0, 1.5, 2.0, 3.0, 5.0)
CLOSEST = 1.05  # Ratio of neighbouring distances of a scan, at least.
SUPPORT = "Support of two opposite edges, from which distances are measured; the other two are free"


@dataclass(frozen=True)
class OnPlate(Conditions):
    """The chain and the plate. Records and meshes follow the contact time where they are not the thesis's."""

    material: Annotated[hl.Material, "Material of the plate"] = hl.ALUMINIUM_6061
    thickness: Annotated[tuple[float, ...], THICKNESS, "Thickness of the plate"] = THICKNESSES
    bead: Annotated[tuple[float, ...], BEAD, "Diameter of the beads and the striker"] = DIAMETERS
    bead_material: Annotated[hl.Material, "Material of the beads and the striker"] = hl.STEEL_440C
    impact_speed: Annotated[float, SPEED, "Speed of the striker"] = IMPACT_SPEED
    side: Annotated[float, LENGTH, "Side of the square plate"] = SIDE
    support: Annotated[str, hl.quantities.OneOf("clamped", "simple", "free"), SUPPORT] = "clamped"
    beads: Annotated[int, hl.quantities.Count(2, 200), "Number of beads"] = BEADS
    sensor: Annotated[int, hl.quantities.Count(1, 199), "Bead whose force is read, from the struck end"] = SENSOR

    coloured = ("thickness", "bead")
    shortest_side: ClassVar[float] = 0.0  # in units of ℓ

    def check(self) -> None:
        """Require a sensor within the chain, and a plate that a mesh can resolve."""
        if self.sensor >= self.beads:
            raise WrongValue("sensor", self.sensor, f"must be less than the number of beads, {self.beads}")
        if not self.own:
            return
        least = self.shortest_side * self.lengths().max()
        if self.side < least:
            cure = f"must be {least:.3g} m or more, so that these beads and plates have a place away from all edges"
            raise WrongValue("side", self.side, cure)
        self._check_mesh()

    def _check_mesh(self) -> None:
        across = CELLS_PER_WAVELENGTH * self.side / self.plate(min(self.thickness)).shortest_wavelength
        unknowns = 4.0 * (across + 1.0) ** 2
        if unknowns > MOST_UNKNOWNS:
            most = self.side * (MOST_UNKNOWNS / unknowns) ** 0.5
            name = "side" if self.side != SIDE else "thickness" if "thickness" in self.differing() else "bead"
            value = self.side if name == "side" else min(getattr(self, name))
            cure = f"needs a mesh of {unknowns:.2g} unknowns; give a side of {0.99 * most:.2g} m or less"
            raise WrongValue(name, value, f"{cure}, thicker plates or larger beads")

    def sphere(self, diameter: float) -> hl.Sphere:
        """Return a bead."""
        return hl.Sphere(diameter / 2.0, self.bead_material)

    def chain(self, diameter: float) -> hl.Chain:
        """Return the chain and its striker, undamped and without gravity."""
        bead = self.sphere(diameter)
        return hl.Chain([bead] * self.beads, striker=bead, impact_speed=self.impact_speed)

    def plate(self, thickness: float) -> hl.Plate:
        """Return the square plate."""
        supports, highest = hl.Supports(left=self.support, right=self.support), self.highest_frequency
        return hl.kirchhoff_plate(self.side, self.side, thickness, self.material, supports, highest_frequency=highest)

    def contact_time(self, diameter: float) -> float:
        """Return T_c, s: of one bead on a half-space at the striker's speed."""
        return waves.contact_time(self.sphere(diameter), self.material, self.impact_speed)

    @property
    def highest_frequency(self) -> float:
        """Hz, that the mesh resolves."""
        if not self.own:
            return HIGHEST_FREQUENCY
        return HIGHEST_FREQUENCY * OnPlate().contact_time(DIAMETERS[0]) / self.contact_time(min(self.bead))

    @property
    def pulse(self) -> float:
        """s, for which reductions are checked."""
        return min(DEFAULT_PULSE, self.contact_time(min(self.bead))) if self.own else DEFAULT_PULSE

    @cached_property
    def until(self) -> float:
        """Length of the record, s."""
        if not self.own:
            return UNTIL
        bead = self.sphere(max(self.bead))
        ratio = waves.wall_stiffness(bead, self.material) / waves.long_waves(bead).stiffness
        longer = max(1.0, (ratio / ALUMINIUM_STIFFNESS_RATIO) ** 0.4, self.beads / BEADS)
        return float(RECORD * longer * self.contact_time(max(self.bead)))

    def length(self, thickness: float, diameter: float) -> float:
        """Return ℓ, m."""
        return edge_length(self.sphere(diameter), self.plate(thickness), self.impact_speed)

    def lengths(self) -> np.ndarray:
        """Return ℓ, m, of all plates and beads."""
        return np.array([[self.length(t, d) for d in self.bead] for t in self.thickness])

    def scan(self, quick: bool) -> list[float]:
        """Return the distances from the edge, m, to the centre: those in units of ℓ for every plate and bead."""
        centre, distances = self.side / 2.0, list[float]()
        for distance in sorted(float(x) for x in np.outer(self.lengths(), QUICK_SCAN if quick else SCAN).ravel()):
            if distance * CLOSEST < centre and (not distances or distance > CLOSEST * distances[-1]):
                distances.append(distance)
        return [*distances, centre]


def theirs(diameter: float) -> hl.Sphere:
    """Return the bead with the data of section 6.2.1: 8000 kg/m³, and 19.1 mm for the 19.05 mm of 6.2.2."""
    return hl.Sphere({19.05e-3: 19.1e-3}.get(round(float(diameter), 5), diameter) / 2.0, THESIS_IMPACT.material)


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return AR at the thesis's sensor."""
    return xr.Dataset({"amplitude_ratio": hl.amplitude_ratio(run, SENSOR)})
