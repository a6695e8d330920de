"""Closed forms for plates: the impedance at a point, and how far away an edge still matters."""

from typing import Protocol

from plates.plate import Plate
from structures.checks import instance, positive
from structures.material import Material
from structures.surface import Surface, hertz_stiffness
from structures.theory import contact_time_half_space

A0_LAMB = 0.2
"""Speed of the A0 Lamb wave over √(E/ρ) that the thesis takes for its plates (section 6.2.2)."""

RAYLEIGH = 0.57
"""Speed of the Rayleigh wave over √(E/ρ) (thesis, section 6.2.2)."""


class Bead(Protocol):
    """What theory needs of a bead."""

    @property
    def mass(self) -> float:
        """kg."""
        ...

    @property
    def surface(self) -> Surface:
        """What Hertz's law needs."""
        ...


def point_impedance(plate: Plate) -> float:
    """Force over velocity of an infinite thin plate at a point, 8 √(D ρ t), N s/m; see Plate.rigidity for laminates.

    (Cremer, Heckl, Petersson, Structure-Borne Sound, 3rd ed., table 5.1.) It is real: an impulse I moves the point by
    I / (8 √(D ρ t)), and there it stays until an echo returns.
    """
    instance("plate", plate, Plate, "a Plate, as kirchhoff_plate makes")
    return float(8.0 * (plate.rigidity * plate.mass_per_area) ** 0.5)


def critical_distance_bounds(bead: Bead, plate: Plate, impact_speed: float) -> tuple[float, float]:
    """The thesis's two estimates of the critical distance, m: by the A0 Lamb wave, and by the Rayleigh wave.

    L = c T/2 with T the Hertzian contact time of the bead on a half-space of the plate's material (equations 6.41
    and 6.42, section 6.2.2) and c = 0.2 or 0.57 √(E/ρ). impact_speed, m/s, is the striker's; the printed factor 1.37 of
    equation 6.42 follows from 0.682 times it, the speed of the wave's beads; with the striker's it is 1.272.
    """
    instance("plate", plate, Plate, "a Plate, as kirchhoff_plate makes")
    if not hasattr(bead, "mass") or not hasattr(bead, "surface"):
        raise ValueError(f"bead = {bead!r}: must be a bead, with mass and surface")
    if not isinstance(plate.material, Material):
        raise ValueError(f"plate.material = {plate.material!r}: must be a Material, with one speed √(E/ρ)")
    stiffness = hertz_stiffness(bead.surface, Surface(plate.material))
    duration = contact_time_half_space(bead.mass, stiffness, positive("impact_speed", impact_speed, "m/s"))
    reach = plate.material.bar_speed * duration / 2.0
    return A0_LAMB * reach, RAYLEIGH * reach
