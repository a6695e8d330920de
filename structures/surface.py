"""What Hertz's law needs to know of a body at the point where it is touched."""

from dataclasses import dataclass
from math import cos, exp, log, pi, sqrt

from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1

from structures.checks import finite, instance, one_of
from structures.material import Material

NEARLY_ROUND = 1e-6
"""Difference over sum of the relative curvatures below which a contact is a circle: k then changes by its square."""

AXIS_RATIOS = ("exact", "approximate")


@dataclass(frozen=True)
class Surface:
    """A smooth surface at a point of contact.

    curvature in 1/m is that of the surface at the contact: 1/R for a sphere, 0 for a flat, negative for a hollow.
    second_curvature: that across it, by default the same; direction (rad): of the first, about the common normal.
    """

    material: Material
    curvature: float = 0.0
    second_curvature: float | None = None
    direction: float = 0.0

    def __post_init__(self) -> None:
        instance("material", self.material, Material, "a Material; MATERIALS[name] gives one by name")
        object.__setattr__(self, "curvature", finite("curvature", self.curvature, "1/m"))
        second = self.curvature if self.second_curvature is None else self.second_curvature
        object.__setattr__(self, "second_curvature", finite("second_curvature", second, "1/m"))
        object.__setattr__(self, "direction", finite("direction", self.direction, "rad"))


def relative_curvatures(first: Surface, second: Surface) -> tuple[float, float]:
    """The principal relative curvatures 1/R′ ≤ 1/R″ of two surfaces that touch, 1/m (thesis, equations 5.3, 5.4).

    Raises ValueError where they would touch along more than a point or a line.
    """
    instance("first", first, Surface, "a Surface")
    instance("second", second, Surface, "a Surface")
    total, steps = 0.0, []
    for surface in (first, second):
        one, other = surface.curvature, float(surface.second_curvature or 0.0)
        total += 0.5 * (one + other)
        steps.append(one - other)
    angle = first.direction - second.direction
    square = steps[0] ** 2 + steps[1] ** 2 + 2.0 * steps[0] * steps[1] * cos(2.0 * angle)
    difference = 0.5 * sqrt(max(square, 0.0))
    if total + difference <= 0.0 or total - difference < -1e-9 * total:
        pairs = [(surface.curvature, surface.second_curvature) for surface in (first, second)]
        raise ValueError(f"curvature = {pairs[0]} and {pairs[1]}: their sum must be positive, in 1/m")
    return max(total - difference, 0.0), total + difference


def hertz_stiffness(first: Surface, second: Surface, axis_ratio: str = "exact") -> float:
    """k in N/m^1.5 of Hertz's law F = k δ^1.5 between two surfaces.

    Round contacts: k = 4/3 √R [(1 − ν₁²)/E₁ + (1 − ν₂²)/E₂]⁻¹ with 1/R the sum of the curvatures (thesis, section 6.1,
    equation 6.2, with the wall's own ν; Johnson, Contact Mechanics, equation 4.23). Elliptic contacts: equations 5.1 to
    5.6, whose K and E take the modulus e (Johnson, section 4.2). axis_ratio: "exact" solves for b/a; "approximate"
    takes the thesis's (R′/R″)^(−2/3), which is off by 0.1 % in k for its ellipsoids and 9 % for cylinders at 5°.
    Raises ValueError where the surfaces touch along a line or conform.
    """
    one_of("axis_ratio", axis_ratio, AXIS_RATIOS)
    flat, sharp = relative_curvatures(first, second)
    if flat <= 1e-12 * sharp:
        raise ValueError(f"curvature: {flat:.3g} in one direction, so the surfaces touch along a line; see contact_law")
    compliance = 1.0 / first.material.contact_modulus + 1.0 / second.material.contact_modulus
    round_stiffness = 4.0 / 3.0 / (flat * sharp) ** 0.25 / compliance
    return float(round_stiffness / _elliptic_factor(sharp / flat, axis_ratio) ** 1.5)


def _elliptic_factor(curvature_ratio: float, axis_ratio: str) -> float:
    """F₂ of equation 5.6; curvature_ratio = R′/R″ ≥ 1."""
    if curvature_ratio - 1.0 < NEARLY_ROUND:
        return 1.0

    def excess(log_square: float) -> float:
        square = exp(log_square)
        first, second = ellipkm1(square), ellipe(1.0 - square)
        return float((second / square - first) / (first - second) / curvature_ratio - 1.0)

    square = curvature_ratio ** (-4.0 / 3.0)
    if axis_ratio == "exact":
        square = exp(brentq(excess, log(square) - 20.0, -1e-9, xtol=1e-15, rtol=1e-14))
    first, second = ellipkm1(square), ellipe(1.0 - square)
    root = sqrt((second / square - first) * (first - second))
    return float(2.0 / pi * first * (4.0 / (pi * (1.0 - square)) * root) ** (-1.0 / 3.0))
