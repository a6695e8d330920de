"""The surface of a body at a contact point: the material and curvatures that Hertz's law needs."""

from functools import lru_cache
from math import cos, exp, inf, log, pi, sqrt
from typing import Annotated

import numpy as np
from scipy.special import ellipe, ellipkm1

from structures.described import checked_call, described_as
from structures.material import Material
from structures.quantities import ContactForce, Curvature, Direction, OneOf

# A contact counts as round if its curvatures differ by a smaller fraction, because k depends only on the square of it
NEARLY_ROUND = 1e-6

AxisRatio = Annotated[str, OneOf("exact", "approximate")]


@described_as("a Surface(material)")
class Surface:
    """A smooth surface at a contact point.

    Parameters
    ----------
    material : Material
        The material of the body.
    curvature, second_curvature : float
        Principal curvatures, 1/m, equal by default: 1/R for a sphere, 0 for a plane, negative for a concave surface.
    direction : float
        Direction of the first curvature: an angle about the common normal, rad.

    Examples
    --------
    >>> flat, ball = hl.Surface(hl.STEEL_316), hl.Surface(hl.STEEL_316, curvature=1.0 / 4.76e-3)
    >>> round(hl.theory.hertz_stiffness(flat, ball) * 1e-9, 2)
    9.76
    """

    material: Material
    curvature: Curvature = 0.0
    second_curvature: Curvature | None = None
    direction: Direction = 0.0

    def __post_init__(self) -> None:
        if self.second_curvature is None:
            object.__setattr__(self, "second_curvature", self.curvature)


@checked_call
def relative_curvatures(first: Surface, second: Surface) -> tuple[float, float]:
    """Return the principal relative curvatures 1/R′ ≤ 1/R″ of touching surfaces, 1/m (thesis, equations 5.3, 5.4)."""
    pairs = [(surface.curvature, float(surface.second_curvature or 0.0)) for surface in (first, second)]
    total = 0.5 * sum(map(sum, pairs))
    one, other = (curvature - second_curvature for curvature, second_curvature in pairs)
    square = one**2 + other**2 + 2.0 * one * other * cos(2.0 * (first.direction - second.direction))
    difference = 0.5 * sqrt(max(square, 0.0))
    if total + difference <= 0.0 or total - difference < -1e-9 * total:
        raise ValueError(f"first, second: curvature = {pairs[0]} and {pairs[1]}: their sum must be positive, in 1/m")
    return max(total - difference, 0.0), total + difference


@checked_call
def hertz_stiffness(first: Surface, second: Surface, axis_ratio: AxisRatio = "exact") -> float:
    """Return the stiffness k of Hertz's law F = k δ^1.5 between two surfaces.

    Round contacts: k = 4/3 √R [(1 − ν₁²)/E₁ + (1 − ν₂²)/E₂]⁻¹, where 1/R is the sum of the curvatures. Elliptic
    contacts: equations 5.1 to 5.6 of the thesis, and section 4.2 of Johnson, Contact Mechanics (1985).

    Parameters
    ----------
    first, second : Surface
        The surfaces that touch at a point.
    axis_ratio : {"exact", "approximate"}
        Whether the ratio b/a of the contact ellipse solves Hertz's equation, or is (R′/R″)^(−2/3), as in the thesis.

    Returns
    -------
    float
        k, N/m^1.5.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> round(hl.theory.hertz_stiffness(bead.surface, bead.surface) * 1e-9, 2)
    7.06
    """
    sharp, curvature_ratio, compliance = _at_a_point(first, second)
    stiffness = 4.0 / 3.0 * sharp**-0.5 * curvature_ratio**0.25 / compliance
    if curvature_ratio - 1.0 >= NEARLY_ROUND:
        square = curvature_ratio ** (-4.0 / 3.0) if axis_ratio == "approximate" else _axis_square(curvature_ratio)
        # F₂ of equation 5.6
        factor = 2.0 / pi * ellipkm1(square) * (4.0 / (pi * (1.0 - square)) * _root(square)) ** (-1.0 / 3.0)
        stiffness /= factor**1.5
    return float(stiffness)


@checked_call
def hertz_pressure(first: Surface, second: Surface, force: ContactForce) -> float:
    """Return the peak pressure p₀ at the centre of a Hertz contact between two surfaces (Johnson, 4.24 to 4.28).

    Parameters
    ----------
    first, second : Surface
        As in `hertz_stiffness`.
    force : float
        Contact force, N, zero or more.

    Returns
    -------
    float
        p₀ = 3F/(2πab), Pa, with the semi-axes a and b of the contact ellipse; (6 F E*²/(π³R²))^⅓ if it is round.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> round(hl.theory.hertz_pressure(bead.surface, bead.surface, 50.0) * 1e-9, 2)
    2.72
    """
    sharp, curvature_ratio, compliance = _at_a_point(first, second)
    if force == 0.0:
        return 0.0
    cube = 0.75 * force * compliance * sqrt(curvature_ratio) / sharp
    if curvature_ratio - 1.0 >= NEARLY_ROUND:
        square = _axis_square(curvature_ratio)
        cube *= square**0.75 * 4.0 / (pi * (1.0 - square)) * _root(square)
    return float(1.5 * force / (pi * cube ** (2.0 / 3.0)))


@checked_call
@lru_cache(maxsize=256)
def yield_pressure(material: Material) -> float:
    """Return the peak pressure of a round contact at which a material starts to yield below the surface.

    It follows from von Mises's criterion for the stresses on the axis (Johnson, section 6.1 and equation 3.45).

    Parameters
    ----------
    material : Material
        The material, with its yield strength.

    Returns
    -------
    float
        Pressure, Pa: 1.61 times the yield strength for ν = 0.3; infinite if the material has no yield strength.

    Examples
    --------
    >>> round(hl.theory.yield_pressure(hl.STEEL_316) * 1e-6)
    331
    """
    if material.yield_strength is None:
        return inf
    depth = np.linspace(0.01, 2.0, 400)
    inside = 1.0 / (1.0 + depth**2)
    around = (1.0 + material.poisson_ratio) * (1.0 - depth * np.arctan(1.0 / depth)) - 0.5 * inside
    return float(material.yield_strength / np.abs(inside - around).max())


def _at_a_point(first: Surface, second: Surface) -> tuple[float, float, float]:
    """Return 1/R″, R′/R″ and the sum of the compliances 1/E* of two surfaces that touch at a point."""
    flat, sharp = relative_curvatures(first, second)
    if flat <= 1e-12 * sharp:
        raise ValueError(
            "curvature: must not be 0 in one direction, or the surfaces touch along a line; see contact_law"
        )
    return sharp, sharp / flat, 1.0 / first.material.contact_modulus + 1.0 / second.material.contact_modulus


def _axis_square(curvature_ratio: float) -> float:
    """Return (b/a)² of an elliptic contact, from Hertz's equation; curvature_ratio = R′/R″ > 1."""
    from scipy.optimize import brentq

    def excess(log_square: float) -> float:
        square = exp(log_square)
        k, e = ellipkm1(square), ellipe(1.0 - square)
        return float((e / square - k) / (k - e) / curvature_ratio - 1.0)

    start = -4.0 / 3.0 * log(curvature_ratio) - 20.0
    return exp(brentq(excess, start, -1e-9, xtol=1e-15, rtol=1e-14))


def _root(square: float) -> float:
    """Return √[((a/b)² E − K)(K − E)] of Johnson's equations 4.26 to 4.28; square = (b/a)²."""
    k, e = ellipkm1(square), ellipe(1.0 - square)
    return sqrt((e / square - k) * (k - e))
