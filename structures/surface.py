"""What Hertz's law needs to know of a body at the point where it is touched."""

from dataclasses import dataclass

from structures.checks import finite, instance
from structures.material import Material


@dataclass(frozen=True)
class Surface:
    """A smooth surface at a point of contact.

    curvature in 1/m is that of the surface at the contact, equal in all directions: 1/R for a sphere, 0 for a
    flat, negative for a hollow.
    """

    material: Material
    curvature: float = 0.0

    def __post_init__(self) -> None:
        instance("material", self.material, Material, "a Material; MATERIALS[name] gives one by name")
        object.__setattr__(self, "curvature", finite("curvature", self.curvature, "1/m"))


def hertz_stiffness(first: Surface, second: Surface) -> float:
    """k in N/m^1.5 of Hertz's law F = k δ^1.5 between two surfaces.

    k = 4/3 √R [(1 − ν₁²)/E₁ + (1 − ν₂²)/E₂]⁻¹ with 1/R the sum of the curvatures (thesis, section 6.1, equation 6.2,
    with the wall's own ν; Johnson, Contact Mechanics, equation 4.23).
    Raises ValueError where the sum of the curvatures is not positive: such surfaces touch on more than a point.
    """
    instance("first", first, Surface, "a Surface")
    instance("second", second, Surface, "a Surface")
    curvature = first.curvature + second.curvature
    if curvature <= 0.0:
        raise ValueError(f"curvature = {first.curvature!r} + {second.curvature!r}: the sum must be positive, in 1/m")
    compliance = 1.0 / first.material.contact_modulus + 1.0 / second.material.contact_modulus
    return float(4.0 / 3.0 / curvature**0.5 / compliance)
