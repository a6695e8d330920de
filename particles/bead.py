"""The bodies that a chain is made of."""

from dataclasses import dataclass
from math import pi, sqrt

from structures.checks import instance, positive, within
from structures.material import Material
from structures.surface import Surface

STANDARD_GRAVITY = 9.81


@dataclass(frozen=True)
class Sphere:
    """A solid sphere; radius in m."""

    radius: float
    material: Material

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", within("radius", self.radius, 1e-9, 1e6, "m"))
        instance("material", self.material, Material, "a Material; MATERIALS[name] gives one by name")

    @property
    def mass(self) -> float:
        """4/3 π R³ ρ, kg."""
        return 4.0 / 3.0 * pi * self.radius**3 * self.material.density

    @property
    def size(self) -> float:
        """Extent along the chain, m."""
        return 2.0 * self.radius

    @property
    def surface(self) -> Surface:
        """What Hertz's law needs: material and curvature 1/R."""
        return Surface(self.material, 1.0 / self.radius)


def drop_speed(height: float) -> float:
    """Speed √(2gh), m/s, of a striker that falls freely from a height (m) under g = 9.81 m/s²."""
    return sqrt(2.0 * STANDARD_GRAVITY * positive("height", height, "m"))
