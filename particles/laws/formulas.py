"""The contact law of two bodies by formulas: Hertz, line contacts, shells."""

from functools import lru_cache
from math import atan2, cos, e, log, pi, sin
from typing import Any

import numpy as np
from scipy.special import lambertw

from particles.bead import SHAPES, Bead, Cylinder, check_bead, surface_of
from particles.laws.law import ContactLaw, PowerLaw, TabulatedLaw
from structures.caution import caution
from structures.checks import short
from structures.surface import Surface, hertz_stiffness, relative_curvatures

# The ratio of a contact's half-width to the relative radius of curvature, or to a body's own radius if that is smaller,
# up to which half-space theories are trusted.
SMALL_CONTACT = 0.2
NEARLY_ROUND_CONTACT = 1.0001  # ratio of the relative curvatures up to which a contact is called round
# The number of points of a law that is tabulated from a formula, enough for an error of the force of 1e-6; and their
# limits, overlaps in m, from less than an atom to more than any bead can bear.
SAMPLES, NARROWEST, WIDEST = 600, 2.0**-50, 2.0**-5


def contact_law(first: Bead, second: Bead | Surface) -> ContactLaw:
    """Return the law between two bodies by formulas; its `name` states which one.

    It is Hertz's law; for hollow spheres, in series with Reissner's shell. For parallel cylinders, or a cylinder on a
    plane, it is Johnson's line contact (Contact Mechanics (1985), 4.2 and 5.6; Khatri's thesis, equations 5.1 to 5.8).

    Parameters
    ----------
    first, second : Bead or Surface
        One body, and another body or the surface of a structure.

    Returns
    -------
    ContactLaw
        A PowerLaw or a TabulatedLaw, with a caution if half-space theory does not hold.

    Examples
    --------
    >>> hl.contact_law(hl.Sphere(4.76e-3, hl.STEEL_440C), hl.Surface(hl.PTFE)).name
    'Hertz, round contact'
    """
    check_bead("first", first, "a body")
    if not isinstance(second, Surface):
        check_bead("second", second, "a body or a Surface")
    return law_of_bodies(first, second)


def law_of_bodies(first: Bead, second: Bead | Surface) -> ContactLaw:
    """Return `contact_law` for bodies that are checked already."""
    # A user's body may change or not be hashable; the bodies defined here are frozen.
    known = isinstance(first, SHAPES) and isinstance(second, (*SHAPES, Surface))
    try:
        law: ContactLaw = (_known_law if known else _law)(first, second)  # type: ignore[arg-type]
    except ValueError as error:
        raise ValueError(f"{short(first)} on {short(second)}: {error}") from None
    if law.caution:
        caution(f"contact law: {law.caution}")
    return law


def _law(first: Bead, second: Bead | Surface) -> ContactLaw:
    surface, facing = surface_of(first), surface_of(second)
    flat, sharp = relative_curvatures(surface, facing)
    if flat <= 1e-12 * sharp:
        return _line_contact(first, second)
    stiffness = hertz_stiffness(surface, facing)
    # Along a relative curvature c, a contact's half-width is √(δ/c), exactly if it is round, within √2 if it is long.
    directions = zip((flat, sharp), sharpest_curvatures(surface, facing), strict=True)
    largest = SMALL_CONTACT**2 / max(sharpest * (sharpest / relative) for relative, sharpest in directions)
    shells = [body.shell_flexibility for body in (first, second) if hasattr(body, "shell_flexibility")]
    if shells:
        hertz, flexibility = PowerLaw(stiffness), sum(shells)
        overlaps = np.append(np.geomspace(NARROWEST, WIDEST, SAMPLES), largest)
        approaches = overlaps + flexibility * hertz.force(overlaps)
        points, name = (approaches[:-1], hertz.force(overlaps[:-1])), "hollow spheres: Hertz and Reissner's shell"
        return TabulatedLaw(*points, name, largest=float(approaches[-1]))  # type: ignore[arg-type]
    if sharp < NEARLY_ROUND_CONTACT * flat:
        return PowerLaw(stiffness, 1.5, largest, "Hertz, round contact")
    name = f"Hertz, elliptic contact, R'/R'' = {sharp / flat:.4g}"
    if sharp / flat <= 130.65:  # the ratio of cylinders that cross at 10°
        return PowerLaw(stiffness, 1.5, largest, name)
    doubt = f"{name}: as long as between cylinders that cross below 10°, where half-space theory does not hold"
    crossed = PowerLaw(stiffness, 1.5, largest, name, doubt)
    if not (isinstance(first, Cylinder) and isinstance(second, Cylinder)):
        return crossed
    line = _line_contact(first, second)  # they touch at most along their whole length
    approaches = np.geomspace(NARROWEST, line.approaches[-1], SAMPLES)
    forces = np.minimum(crossed.force(approaches), line.force(approaches))
    return TabulatedLaw(approaches, forces, name, doubt, min(largest, line.largest))  # type: ignore[arg-type]


_known_law = lru_cache(maxsize=4096)(_law)


def sharpest_curvatures(first: Surface, second: Surface) -> tuple[float, float]:
    """Return the largest curvatures, of a body or relative, along the flattest direction and across it, 1/m."""
    flattest, across = ([relative] for relative in relative_curvatures(first, second))
    parts = []
    for surface in (first, second):
        other = float(surface.second_curvature or 0.0)
        parts.append((0.5 * (surface.curvature + other), 0.5 * (surface.curvature - other), 2.0 * surface.direction))
    sharpest = atan2(sum(d * sin(angle) for _, d, angle in parts), sum(d * cos(angle) for _, d, angle in parts))
    for mean, difference, angle in parts:
        turned = difference * cos(angle - sharpest)
        flattest.append(abs(mean - turned))
        across.append(abs(mean + turned))
    return max(flattest), max(across)


def _line_contact(first: Any, second: Any) -> TabulatedLaw:
    """Return the law of parallel cylinders, or of a cylinder on a plane: each adds c F* (constant − ln w²)."""
    cylinders = [body for body in (first, second) if isinstance(body, Cylinder)]
    if not cylinders or not all(isinstance(body, Cylinder | Surface) for body in (first, second)):
        must = "must not touch the first along a line, unless the chain has a law= for this contact"
        raise ValueError(f"second = {second!r}: {must}")
    length = min(body.length for body in cylinders)
    surfaces = surface_of(first), surface_of(second)
    curvatures = [max(surface.curvature, float(surface.second_curvature or 0.0), key=abs) for surface in surfaces]
    relative = sum(curvatures)
    shares = []
    for body in (first, second):
        depth = 2.0 * log(4.0 * body.radius) - 1.0 if isinstance(body, Cylinder) else 2.0 * log(2.0 * length) + 1.0
        shares.append((1.0 / (pi * body.material.contact_modulus), depth))
    compliance = sum(c for c, _ in shares)
    half_width_square = 4.0 * compliance / relative
    offset = sum(c * depth for c, depth in shares) / compliance - log(half_width_square)
    # With F* = F/length, δ = C F* (B − ln F*) increases up to C e^{B−1}, where the contact is as wide as the bodies.
    approaches = np.geomspace(NARROWEST, 0.9 * (compliance * e ** (offset - 1.0)), SAMPLES)
    scaled = approaches / compliance
    forces = -length * scaled / lambertw(-scaled * np.exp(-offset), -1).real
    # The half-width w is proportional to √F*. The law is trusted while w is small compared with the radii.
    sharpest = max(relative, *map(abs, curvatures))
    trusted = (SMALL_CONTACT / sharpest) ** 2 / half_width_square * length
    name, doubt = "line contact of parallel cylinders", ""
    if isinstance(second, Surface):
        name = f"line contact of a cylinder on a flat, {1e3 * length:.3g} mm long"
        doubt = (
            f"{name}: the law is for a half-space under the whole length of the cylinder, but the structure is pushed "
            "at one point; end the chain with a rounded body for a contact at a point, or give a function law="
        )
    return TabulatedLaw(approaches, forces, name, doubt, float(np.interp(trusted, forces, approaches)))  # type: ignore[arg-type]
