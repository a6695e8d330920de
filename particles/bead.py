"""The bodies that a chain is made of: each knows its mass, its size along the chain, and its surface at a contact."""

from dataclasses import dataclass
from math import pi, sqrt

from structures.checks import instance, one_of, positive, turn, within
from structures.material import Material
from structures.plausible import likely
from structures.surface import Surface

STANDARD_GRAVITY = 9.81


@dataclass(frozen=True)
class Sphere:
    """A solid sphere; radius in m."""

    radius: float
    material: Material

    def __post_init__(self) -> None:
        _check(self, "radius")

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
        """Material and curvature 1/R."""
        return Surface(self.material, 1.0 / self.radius)


@dataclass(frozen=True)
class HollowSphere:
    """A spherical shell; outer radius and inner_radius in m (thesis, section 5.3.3)."""

    radius: float
    inner_radius: float
    material: Material

    def __post_init__(self) -> None:
        _check(self, "radius", "inner_radius")
        if self.inner_radius >= self.radius:
            raise ValueError(f"inner_radius = {self.inner_radius!r}: must be less than the radius, {self.radius} m")

    @property
    def mass(self) -> float:
        """4/3 π (R³ − Rᵢ³) ρ, kg."""
        return 4.0 / 3.0 * pi * (self.radius**3 - self.inner_radius**3) * self.material.density

    @property
    def size(self) -> float:
        """Extent along the chain, m."""
        return 2.0 * self.radius

    @property
    def surface(self) -> Surface:
        """Material and curvature 1/R; `contact_law` adds what the shell gives way."""
        return Surface(self.material, 1.0 / self.radius)


@dataclass(frozen=True)
class Ellipsoid:
    """A solid ellipsoid of revolution (thesis, section 5.3.1).

    radius, m, of its round section; length, m, of its axis of revolution. axis: how that lies, "across" the chain or
    "along" it. angle, rad: of an axis across, about the chain's axis.
    """

    radius: float
    length: float
    material: Material
    axis: str = "across"
    angle: float = 0.0

    def __post_init__(self) -> None:
        _check(self, "radius", "length")
        one_of("axis", self.axis, ("across", "along"))
        object.__setattr__(self, "angle", turn("angle", self.angle))

    @property
    def mass(self) -> float:
        """4/3 π R² (L/2) ρ, kg."""
        return 2.0 / 3.0 * pi * self.radius**2 * self.length * self.material.density

    @property
    def size(self) -> float:
        """Extent along the chain, m."""
        return self.length if self.axis == "along" else 2.0 * self.radius

    @property
    def surface(self) -> Surface:
        """Material and the curvatures where it is touched: at its pole along the chain, at its equator across."""
        half = self.length / 2.0
        if self.axis == "along":
            return Surface(self.material, half / self.radius**2)
        return Surface(self.material, self.radius / half**2, 1.0 / self.radius, self.angle)


@dataclass(frozen=True)
class Cylinder:
    """A solid cylinder that lies across the chain (thesis, section 5.3.2).

    radius and length in m; angle, rad: of its axis, about the chain's axis.
    """

    radius: float
    length: float
    material: Material
    angle: float = 0.0

    def __post_init__(self) -> None:
        _check(self, "radius", "length")
        object.__setattr__(self, "angle", turn("angle", self.angle))

    @property
    def mass(self) -> float:
        """π R² L ρ, kg."""
        return pi * self.radius**2 * self.length * self.material.density

    @property
    def size(self) -> float:
        """Extent along the chain, m."""
        return 2.0 * self.radius

    @property
    def surface(self) -> Surface:
        """Material and curvatures: none along its axis, 1/R across."""
        return Surface(self.material, 0.0, 1.0 / self.radius, self.angle)


Bead = Sphere | HollowSphere | Ellipsoid | Cylinder


def drop_speed(height: float) -> float:
    """Speed √(2gh), m/s, of a striker that falls freely from a height (m) under g = 9.81 m/s²."""
    height = positive("height", height, "m")
    likely("height", "drop_speed", "height", height)
    return sqrt(2.0 * STANDARD_GRAVITY * height)


def _check(bead: "Bead", *lengths: str) -> None:
    for name in lengths:
        object.__setattr__(bead, name, within(name, getattr(bead, name), 1e-9, 1e6, "m"))
        likely("bead", type(bead).__name__, name, getattr(bead, name))
    instance("material", bead.material, Material, "a Material; MATERIALS[name] gives one by name")
