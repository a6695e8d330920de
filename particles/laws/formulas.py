"""`contact_law` picks the law of two bodies by formulas: Hertz, line contacts, shells."""

from functools import lru_cache
from math import atan2, cos, e, log, pi, sin
from typing import Any

import numpy as np
from scipy.special import lambertw

from particles.bead import SHAPES, Bead, Cylinder, check_bead, check_body
from particles.laws.law import ContactLaw, PowerLaw, TabulatedLaw
from structures.caution import caution
from structures.checks import one_of
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness, relative_curvatures

SMALL_CONTACT = 0.2
"""Half-width of a contact over the relative radius of curvature, or over a body's own if that is smaller: up to here
half-space theories are trusted."""

MOST_ELONGATED = 130.65
"""R′/R″ of cylinders that cross at 10°; more elongated contacts exceed what a half-space represents."""

SAMPLES = 600
"""Points of a law that is tabulated from a formula, from NARROWEST to WIDEST: enough for 1e-6 of the force."""

NARROWEST, WIDEST = 2.0**-50, 2.0**-5
"""m, overlaps from less than an atom to more than any bead bears."""

LINE = 1e-12
"""Ratio of the relative curvatures below which bodies touch along a line."""

NEARLY_ROUND_CONTACT = 1.0001
"""Ratio of the relative curvatures up to which a contact is named round."""

PART_OF_LIMIT = 0.9
"""Of the approach at which a line contact would be as wide as the bodies: the last point of its table."""


def contact_law(first: Bead, second: Bead | Surface, axis_ratio: str = "exact") -> ContactLaw:
    """Return the law between two bodies by formulas; its `name` states which one was picked.

    Spheres, ellipsoids, crossed cylinders and a user's bodies, any two of them: Hertz. Parallel cylinders: Johnson's
    line contact over the shorter length. Hollow spheres: Hertz in series with the compliance of Reissner's shell.
    A cylinder on a flat surface touches it along its whole length, whatever the angles of its neighbours; the law is
    that of a line on a half-space, and carries a caution, because the structure is pushed at one point.
    Contacts more elongated than those of cylinders that cross at 10° get a caution: half-space theory ends there.
    The force of such cylinders never exceeds that of parallel ones over the shorter length.

    Parameters
    ----------
    first : Bead
        One body.
    second : Bead or Surface
        The other body, or the surface of a structure.
    axis_ratio : str
        Axis ratio b/a of an elliptic contact: "exact", or "approximate" as in the thesis, see `hertz_stiffness`.

    Returns
    -------
    ContactLaw
        A PowerLaw or a TabulatedLaw.

    Raises
    ------
    ValueError
        For bodies whose surfaces conform, and for a line contact of bodies that are no cylinders.

    References
    ----------
    Johnson, Contact Mechanics (1985), sections 4.2 and 5.6; Khatri's thesis, equations 5.1 to 5.8; Reissner,
    J. Math. Phys. 25 (1946) 279.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> law = hl.contact_law(bead, hl.Surface(hl.PTFE))
    >>> law.name, round(float(law.force(10e-6)), 2)  # N
    ('Hertz, round contact', 5.6)
    """
    check_bead("first", first, "a body")
    check_body("second", second)
    one_of("axis_ratio", axis_ratio, ("exact", "approximate"))
    # A user's body may change, or be no key of a dictionary; those defined here are frozen.
    if isinstance(first, SHAPES) and isinstance(second, (*SHAPES, Surface)):
        law = _known_contact_law(first, second, axis_ratio)
    else:
        law = _contact_law(first, second, axis_ratio)
    if law.caution:
        caution(f"contact law: {law.caution}")
    return law


def _contact_law(first: Bead, second: Bead | Surface, axis_ratio: str) -> ContactLaw:
    surface, facing = (body if isinstance(body, Surface) else body.surface for body in (first, second))
    flat, sharp = relative_curvatures(surface, facing)
    if flat <= LINE * sharp:
        return _line_contact(first, second)
    stiffness = hertz_stiffness(surface, facing, axis_ratio)
    # Along a relative curvature c a contact is √(δ/c) wide to either side: as round ones are, and long ones to √2.
    directions = zip((flat, sharp), sharpest_curvatures(surface, facing), strict=True)
    largest = SMALL_CONTACT**2 / max(sharpest * (sharpest / relative) for relative, sharpest in directions)
    shells = [body.shell_flexibility for body in (first, second) if hasattr(body, "shell_flexibility")]
    if shells:
        return _in_series(PowerLaw(stiffness, largest=largest), sum(shells))
    if sharp < NEARLY_ROUND_CONTACT * flat:
        return PowerLaw(stiffness, 1.5, largest, "Hertz, round contact")
    name, doubts = f"Hertz, elliptic contact, R'/R'' = {sharp / flat:.4g}, b/a {axis_ratio}", ""
    if sharp / flat > MOST_ELONGATED:
        doubts = f"{name}, is as long as between cylinders that cross below 10°, where half-space theory ends"
        if isinstance(first, Cylinder) and isinstance(second, Cylinder):
            return _bounded(PowerLaw(stiffness, 1.5, largest, name, doubts), _line_contact(first, second))
    return PowerLaw(stiffness, 1.5, largest, name, doubts)


_known_contact_law = lru_cache(maxsize=4096)(_contact_law)


def sharpest_curvatures(first: Surface, second: Surface) -> tuple[float, float]:
    """Return the largest curvatures, 1/m, along the flattest direction of two surfaces that touch, and across it.

    They are the relative ones, or that of a body itself where it is more, as it is where the other is hollow.
    Raises ValueError as `relative_curvatures` does.
    """
    flattest, across = ([relative] for relative in relative_curvatures(first, second))
    parts = [
        (0.5 * (surface.curvature + other), 0.5 * (surface.curvature - other), 2.0 * surface.direction)
        for surface in (first, second)
        for other in [float(surface.second_curvature or 0.0)]
    ]
    sharpest = atan2(sum(d * sin(angle) for _, d, angle in parts), sum(d * cos(angle) for _, d, angle in parts))
    for mean, difference, angle in parts:
        turned = difference * cos(angle - sharpest)
        flattest.append(abs(mean - turned))
        across.append(abs(mean + turned))
    return max(flattest), max(across)


def line_force(approach: Vector, compliance: float, offset: float) -> Vector:
    """Return the force per length F*, N/m, of parallel cylinders: δ = C F* (B − ln F*), by the Lambert function's
    branch −1.

    F* = −(δ/C) / W₋₁(−(δ/C) e^{−B}); its limit is δ = C e^{B−1}, where the contact would be as wide as the bodies.
    For two equal cylinders C = 2(1 − ν²)/(πE) and B = ln(4πER/(1 − ν²)) − 1, and this is the thesis's equation 5.8 with
    the sign and branch that it lacks, F* = −(πE/(1 − ν²)) (δ/2)/W₋₁(−eδ/(8R)) up to 8R/e² (Johnson, section 5.6).
    """
    scaled = np.asarray(approach, float) / compliance
    if np.any(scaled > np.exp(offset - 1.0)):
        raise ValueError(f"approach = {approach!r}: must be at most {compliance * np.exp(offset - 1.0):.4g} m")
    argument = np.maximum(scaled * np.exp(-offset), 1e-300)
    return np.where(scaled > 0.0, -scaled / lambertw(-argument, -1).real, 0.0)


def _line_contact(first: Any, second: Any) -> TabulatedLaw:
    """Return the law of cylinders side by side, or of one on a flat.

    A cylinder's part is F*c [2 ln(4R/w) − 1] with c = (1 − ν²)/(πE), from its contact to its middle (Johnson, equation
    5.57); a flat has no middle; its compliance is c [2 ln(2L/w) + 1] under a line of length L. w² = 4F*RC with the
    relative radius R and the sum C of both c, so that both parts are of the form F*(constant − c ln F*).
    """
    cylinders = [body for body in (first, second) if isinstance(body, Cylinder)]
    if not cylinders or not all(isinstance(body, Cylinder | Surface) for body in (first, second)):
        raise ValueError(
            f"second = {second!r}: touches the first along a line; formulas know that for Cylinders only; give the "
            "chain a law="
        )
    length = min(body.length for body in cylinders)
    surfaces = [body if isinstance(body, Surface) else body.surface for body in (first, second)]
    curvatures = [max(surface.curvature, float(surface.second_curvature or 0.0), key=abs) for surface in surfaces]
    relative = sum(curvatures)
    sharpest = max(relative, *map(abs, curvatures))
    shares = []
    for body in (first, second):
        c = 1.0 / (pi * body.material.contact_modulus)
        shares.append(
            (c, 2.0 * log(4.0 * body.radius) - 1.0 if isinstance(body, Cylinder) else 2.0 * log(2.0 * length) + 1.0)
        )
    compliance = sum(c for c, _ in shares)
    half_width_square = 4.0 * compliance / relative
    offset = sum(c * part for c, part in shares) / compliance - log(half_width_square)
    limit = compliance * e ** (offset - 1.0)
    approaches = np.geomspace(NARROWEST, PART_OF_LIMIT * limit, SAMPLES)
    forces = length * line_force(approaches, compliance, offset)
    # The contact's half-width w grows as √F*; the law is trusted while w is small compared with the radii.
    trusted = (SMALL_CONTACT / sharpest) ** 2 / half_width_square * length
    largest = float(np.interp(trusted, forces, approaches))
    name, doubt = "line contact of parallel cylinders", ""
    if isinstance(second, Surface):
        name = f"line contact of a cylinder on a flat, {1e3 * length:.3g} mm long"
        doubt = (
            f"{name}: the cylinder lies on the surface along its whole length, as on a half-space deeper than that, "
            "while the structure is pushed at one point; end the chain with a rounded body for a contact at a point, "
            "or give a function law="
        )
    return TabulatedLaw(approaches, forces, name, doubt, largest)  # type: ignore[arg-type]


def _in_series(law: PowerLaw, flexibility: float) -> TabulatedLaw:
    """Return a law in series with a linear compliance, m/N."""
    overlaps = np.geomspace(NARROWEST, WIDEST, SAMPLES)
    forces = law.force(overlaps)
    approaches = overlaps + flexibility * forces
    largest = law.largest + flexibility * float(law.force(np.array(law.largest)))
    return TabulatedLaw(approaches, forces, "hollow spheres: Hertz and Reissner's shell", largest=largest)  # type: ignore[arg-type]


def _bounded(law: PowerLaw, bound: TabulatedLaw) -> TabulatedLaw:
    """Return the lesser force of two laws: cylinders that cross at a small angle touch on no more than their whole
    length."""
    approaches = np.geomspace(NARROWEST, bound.approaches[-1], SAMPLES)
    forces = np.minimum(law.force(approaches), bound.force(approaches))
    return TabulatedLaw(approaches, forces, law.name, law.caution, min(law.largest, bound.largest))  # type: ignore[arg-type]
