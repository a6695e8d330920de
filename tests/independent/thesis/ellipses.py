"""Elliptic contacts of equal materials: equations 5.1 to 5.6, with b/a exact and as the thesis approximates it.

K. L. Johnson, Contact Mechanics, equations 4.24 to 4.32. scipy's elliptic integrals take m = e².
"""

from dataclasses import dataclass
from math import cos, inf, pi, sqrt

from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from .materials import Material, contact_modulus


@dataclass(frozen=True)
class Surface:
    """Principal radii of curvature at the contact, m: R′ ≥ R″. A straight generator has an infinite one."""

    larger: float
    smaller: float


def relative_radii(one: Surface, other: Surface, angle: float = 0.0) -> tuple[float, float]:
    """R′ and R″ of equations 5.3 and 5.4, m; angle, rad, between the principal directions."""
    first = 1.0 / one.larger - 1.0 / one.smaller
    second = 1.0 / other.larger - 1.0 / other.smaller
    total = 0.5 * (1.0 / one.larger + 1.0 / one.smaller + 1.0 / other.larger + 1.0 / other.smaller)
    square = first**2 + second**2 + 2.0 * first * second * cos(2.0 * angle)
    part = 0.5 * sqrt(max(square, 0.0))
    return 1.0 / (total - part), 1.0 / (total + part)


def axes_ratio(larger: float, smaller: float, exact: bool = True) -> float:
    """b/a of the contact area: R′/R″ = [(a/b)²E − K]/(K − E), or the approximation (R′/R″)^(−2/3)."""
    guess = (larger / smaller) ** (-2.0 / 3.0)
    if not exact or larger - smaller < 1e-9 * larger:
        return guess

    def excess(ratio: float) -> float:
        parameter = 1.0 - ratio**2
        first, second = ellipk(parameter), ellipe(parameter)
        return float((second / ratio**2 - first) / (first - second)) - larger / smaller

    return float(brentq(excess, 0.2 * guess, 1.0 - 1e-6, xtol=1e-15))


def shape_factor(ratio: float) -> float:
    """F₂ of equation 5.6."""
    if ratio > 1.0 - 1e-9:
        return 1.0
    parameter = 1.0 - ratio**2
    first, second = float(ellipk(parameter)), float(ellipe(parameter))
    product = sqrt((second / ratio**2 - first) * (first - second))
    return 2.0 / pi * first * (4.0 / (pi * parameter) * product) ** (-1.0 / 3.0)


def stiffness(one: Surface, other: Surface, material: Material, angle: float = 0.0, exact: bool = True) -> float:
    """k_e of equation 5.1, N/m^1.5."""
    larger, smaller = relative_radii(one, other, angle)
    factor = shape_factor(axes_ratio(larger, smaller, exact))
    return 4.0 / 3.0 * contact_modulus(material, material) * sqrt(sqrt(larger * smaller)) / factor**1.5


def sphere(radius: float) -> Surface:
    return Surface(radius, radius)


def cylinder(radius: float) -> Surface:
    return Surface(inf, radius)
