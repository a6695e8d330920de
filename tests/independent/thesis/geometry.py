"""Chapter 2: masses from dimensions, and the striker's speed from its drop."""

from math import pi

from .materials import ALUMINIUM, STEEL_316, sphere_mass
from .values import Chapter, Effort, Variants

chapter = Chapter("geometry")

MINOR, LENGTH = 4.72e-3, 10.16e-3
"""m, axes of the ellipsoids."""


@chapter.entry("ellipsoid/mass_g", "0.925", "g", "steel 316, axes 4.72 and 10.16 mm")
def ellipsoid_mass(_: Effort) -> Variants:
    return {"from dimensions": pi / 6.0 * MINOR**2 * LENGTH * STEEL_316.density * 1e3}


@chapter.entry("ellipsoid/contact_R1p_mm", "10.93", "mm", "radius of the ellipse at the end of its minor axis")
def ellipsoid_radius(_: Effort) -> Variants:
    return {"(L/2)^2/(D/2)": (LENGTH / 2.0) ** 2 / (MINOR / 2.0) * 1e3}


@chapter.entry("cylinder/mass_g", "0.68", "g", "steel 316, R = 2.38 mm, L = 4.76 mm")
def cylinder_mass(_: Effort) -> Variants:
    return {"from dimensions": pi * 2.38e-3**2 * 4.76e-3 * STEEL_316.density * 1e3}


@chapter.entry("hollow_sphere/mass_g", "2.38", "g", "aluminium, outer and inner radius")
def hollow_mass(_: Effort) -> Variants:
    def mass(outer: float, inner: float) -> float:
        return (sphere_mass(outer, ALUMINIUM) - sphere_mass(inner, ALUMINIUM)) * 1e3

    return {
        "R = 9.53 and 8.66 mm": mass(9.53e-3, 8.66e-3),
        "R = 9.525 mm, wall 0.87 mm": mass(9.525e-3, 9.525e-3 - 0.87e-3),
        "R = 9.525 mm, ratio 0.908": mass(9.525e-3, 0.908 * 9.525e-3),
    }
