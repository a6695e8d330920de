"""`contact_law` picks the law of two bodies by formulas: Hertz, line contacts, shells."""

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

# Half-width of a contact over the relative radius of curvature, or over a body's own if that is smaller: up to here
# half-space theories are trusted.
SMALL_CONTACT = 0.2
NEARLY_ROUND_CONTACT = 1.0001  # ratio of the relative curvatures up to which a contact is named round
# Points of a law that is tabulated from a formula, enough for 1e-6 of the force; and between which overlaps they lie,
# m: from less than an atom to more than any bead bears.
SAMPLES, NARROWEST, WIDEST = 600, 2.0**-50, 2.0**-5


def contact_law(first: Bead, second: Bead | Surface) -> ContactLaw:
    """Return the law between two bodies by formulas; its `name` states which one was picked.

    Hertz; for hollow spheres in series with Reissner's shell; for cylinders side by side, or one on a flat, Johnson's
    line contact (Contact Mechanics (1985), 4.2 and 5.6; Khatri's thesis, equations 5.1 to 5.8).

    Parameters
    ----------
    first, second : Bead or Surface
        One body, and the other one or the surface of a structure.

    Returns
    -------
    ContactLaw
        A PowerLaw or a TabulatedLaw, with a caution where half-space theory ends.

    Examples
    --------
    >>> hl.contact_law(hl.Sphere(4.76e-3, hl.STEEL_440C), hl.Surface(hl.PTFE)).name
    'Hertz, round contact'
    """
    check_bodies(first, second)
    return law_of_bodies(first, second)


def law_of_bodies(first: Bead, second: Bead | Surface) -> ContactLaw:
    """Return the same of bodies that are checked already."""
    # A user's body may change, or be no key of a dictionary; those defined here are frozen.
    known = isinstance(first, SHAPES) and isinstance(second, (*SHAPES, Surface))
    try:
        law: ContactLaw = (_known_law if known else _law)(first, second)  # type: ignore[arg-type]
    except ValueError as error:
        raise ValueError(f"{short(first)} on {short(second)}: {error}") from None
    if law.caution:
        caution(f"contact law: {law.caution}")
    return law


def check_bodies(first: Any, second: Any) -> None:
    """Refuse what is not a Bead, and a Bead or Surface."""
    check_bead("first", first, "a body")
    if not isinstance(second, Surface):
        check_bead("second", second, "a body or a Surface")


def _law(first: Bead, second: Bead | Surface) -> ContactLaw:
    surface, facing = surface_of(first), surface_of(second)
    flat, sharp = relative_curvatures(surface, facing)
    if flat <= 1e-12 * sharp:
        return _line_contact(first, second)
    stiffness = hertz_stiffness(surface, facing)
    # Along a relative curvature c a contact is √(δ/c) wide to either side: as round ones are, and long ones to √2.
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
    if sharp / flat <= 130.65:  # that of cylinders which cross at 10°
        return PowerLaw(stiffness, 1.5, largest, name)
    doubt = f"{name}, is as long as between cylinders that cross below 10°, where half-space theory ends"
    crossed = PowerLaw(stiffness, 1.5, largest, name, doubt)
    if not (isinstance(first, Cylinder) and isinstance(second, Cylinder)):
        return crossed
    line = _line_contact(first, second)  # they touch on no more than their whole length
    approaches = np.geomspace(NARROWEST, line.approaches[-1], SAMPLES)
    forces = np.minimum(crossed.force(approaches), line.force(approaches))
    return TabulatedLaw(approaches, forces, name, doubt, min(largest, line.largest))  # type: ignore[arg-type]


_known_law = lru_cache(maxsize=4096)(_law)


def sharpest_curvatures(first: Surface, second: Surface) -> tuple[float, float]:
    """Return the largest curvatures, relative or of one body, along the flattest direction and across it, 1/m."""
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


def _line_contact(first: Any, second: Any) -> TabulatedLaw:
    """Return the law of cylinders side by side, or of one on a flat: each adds c F* (constant − ln w²)."""
    cylinders = [body for body in (first, second) if isinstance(body, Cylinder)]
    if not cylinders or not all(isinstance(body, Cylinder | Surface) for body in (first, second)):
        raise ValueError(f"second = {second!r}: touches the first along a line; give the chain a law= of this contact")
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
    # δ = C F* (B − ln F*) rises up to C e^{B−1}, where the contact is as wide as the bodies. F* is per length.
    approaches = np.geomspace(NARROWEST, 0.9 * (compliance * e ** (offset - 1.0)), SAMPLES)
    scaled = approaches / compliance
    forces = -length * scaled / lambertw(-scaled * np.exp(-offset), -1).real
    # The half-width w grows as √F*; the law is trusted while w is small compared with the radii.
    sharpest = max(relative, *map(abs, curvatures))
    trusted = (SMALL_CONTACT / sharpest) ** 2 / half_width_square * length
    name, doubt = "line contact of parallel cylinders", ""
    if isinstance(second, Surface):
        name = f"line contact of a cylinder on a flat, {1e3 * length:.3g} mm long"
        doubt = (
            f"{name}: the cylinder lies on the surface along its whole length, as on a half-space deeper than that, "
            "while the structure is pushed at one point; end the chain with a rounded body for a contact at a point, "
            "or give a function law="
        )
    return TabulatedLaw(approaches, forces, name, doubt, float(np.interp(trusted, forces, approaches)))  # type: ignore[arg-type]
