"""Table 2.1, and Hertz's contacts of spheres (equations 1.1, 5.5 and 6.2)."""

from dataclasses import dataclass
from math import pi, sqrt


@dataclass(frozen=True)
class Material:
    """Density, kg/m³; Young's modulus, Pa; Poisson's ratio."""

    density: float
    youngs_modulus: float
    poisson_ratio: float

    @property
    def compliance(self) -> float:
        """(1 − ν²)/E, 1/Pa."""
        return (1.0 - self.poisson_ratio**2) / self.youngs_modulus

    @property
    def bar_speed(self) -> float:
        """√(E/ρ), m/s."""
        return sqrt(self.youngs_modulus / self.density)


STEEL_316 = Material(8000.0, 193.0e9, 0.30)
STEEL_440C = Material(7800.0, 200.0e9, 0.28)
BRASS = Material(8550.0, 103.0e9, 0.34)
ALUMINIUM = Material(2693.0, 68.9e9, 0.33)
PTFE = Material(2151.0, 1.53e9, 0.46)

GRAVITY = 9.81
"""m/s², section 3.1."""


def contact_modulus(one: Material, other: Material) -> float:
    """E* of equation 5.5, Pa."""
    return 1.0 / (one.compliance + other.compliance)


def between_spheres(radius: float, one: Material) -> float:
    """k of equation 1.1 for equal spheres, N/m^1.5."""
    return 4.0 / 3.0 * contact_modulus(one, one) * sqrt(radius / 2.0)


def on_half_space(radius: float, one: Material, wall: Material) -> float:
    """A_w of equation 6.2 with the wall's own Poisson's ratio, N/m^1.5."""
    return 4.0 / 3.0 * contact_modulus(one, wall) * sqrt(radius)


def sphere_mass(radius: float, one: Material) -> float:
    """Kg."""
    return 4.0 / 3.0 * pi * radius**3 * one.density
