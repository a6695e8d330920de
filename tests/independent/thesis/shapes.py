"""Chapter 5: chains of ellipsoids, of cylinders and of hollow spheres."""

from collections.abc import Sequence
from functools import lru_cache
from math import e, log, pi, radians, sqrt

import numpy as np
from scipy.special import lambertw

from . import ellipses, waves
from .geometry import LENGTH, MINOR
from .line import Flight, Line, Numbers, hertzian, row
from .materials import ALUMINIUM, GRAVITY, STEEL_316, between_spheres, sphere_mass
from .values import Chapter, Effort, Variants

bodies = Chapter("nonspherical")
hollow = Chapter("hollow_table_5_1")

STEEL = STEEL_316
BEADS = 20

ELLIPSOID_MASS = 0.925e-3
SIDE = ellipses.Surface((LENGTH / 2.0) ** 2 / (MINOR / 2.0), MINOR / 2.0)
"""At the end of the minor axis."""
TIP = ellipses.sphere((MINOR / 2.0) ** 2 / (LENGTH / 2.0))
EQUIVALENT = (ELLIPSOID_MASS / (4.0 / 3.0 * pi * STEEL.density)) ** (1.0 / 3.0)
"""m, radius of the sphere of an ellipsoid's mass."""

RADIUS = 2.38e-3
SIZE = CYLINDER_LENGTH = 4.76e-3
CYLINDER_MASS = 0.68e-3
CYLINDER = ellipses.cylinder(RADIUS)
STRIKER_MASS, STRIKER_SPEED = 0.45e-3, 0.5
ON_CYLINDER = ellipses.stiffness(ellipses.sphere(RADIUS), CYLINDER, STEEL)
"""The striking sphere on the first cylinder."""

OUTER = 9.525e-3
LAW = 4.671e7, 1.222
"""k, N/m^n, and n of Table 5.1 for R_i/R_o = 0.908."""


def along_force(stiffness: float, mass: float, size: float, force: float, exponent: float = 1.5) -> float:
    """Equation 5.12 with the square root that it lacks, m/s; 5.11 at n = 3/2."""
    return (
        size
        * sqrt(2.0 / (exponent + 1.0) * stiffness ** (1.0 / exponent) / mass)
        * force ** ((exponent - 1.0) / (2.0 * exponent))
    )


def highest(flight: Flight, link: int) -> float:
    """The first peak of a contact's force, N."""
    return waves.peaks(flight.contact(link), flight.until)[0].height


@bodies.entry("ke_major", "3.31e9", "N/m^1.5", "two ellipsoids, tip on tip of the major axes")
def ke_major(_: Effort) -> Variants:
    return {"exact b/a": ellipses.stiffness(TIP, TIP, STEEL)}


STRIKERS = {"sphere of 0.925 g": EQUIVALENT, "sphere of R = 2.38 mm": 2.38e-3, "sphere of D = 2.38 mm": 1.19e-3}
"""m, radii."""


@lru_cache
def ellipsoids(striker: str, gravity: float, exact: bool, tolerance: float) -> Flight:
    """20 ellipsoids, struck at their sides by a sphere or by an equal ellipsoid, 0.626 m/s."""
    between = ellipses.stiffness(SIDE, SIDE, STEEL, exact=exact)
    radius = STRIKERS.get(striker)
    first = between if radius is None else ellipses.stiffness(ellipses.sphere(radius), SIDE, STEEL, exact=exact)
    mass = ELLIPSOID_MASS if radius is None else sphere_mass(radius, STEEL)
    chain = row(BEADS, ELLIPSOID_MASS, between, between, mass, first)
    return hertzian(*chain, gravity=gravity).strike(0.626, 0.25e-3, tolerance)


@bodies.entry(
    "V_ellipsoid_dpm", "524", "m/s", "v = 0.626 m/s, sensors 7 and 12; striker, gravity and b/a by the variant"
)
def V_ellipsoid_dpm(effort: Effort) -> Variants:
    cases = [(striker, gravity, True) for striker in ("equal ellipsoid", *STRIKERS) for gravity in (0.0, GRAVITY)]
    cases += [("sphere of 0.925 g", gravity, False) for gravity in (0.0, GRAVITY)]
    return {
        f"{striker}, g = {gravity:g}" + ("" if exact else ", approximate b/a"): waves.speed(
            ellipsoids(striker, gravity, exact, effort.tolerance), (7, 12), MINOR
        )
        for striker, gravity, exact in cases
    }


@bodies.entry(
    "width_ellipsoid",
    "5.5",
    "D_minor",
    "sensor force above a share of its peak, g = 0, sphere of 0.925 g; equation 5.13",
)
def width_ellipsoid(effort: Effort) -> Variants:
    flight = ellipsoids("sphere of 0.925 g", 0.0, True, effort.tolerance)
    return widths(flight, 10, waves.speed(flight, (7, 12), MINOR), MINOR) | {"equation 5.13": long_wave_width(1.5)}


def widths(flight: Flight, bead: int, speed: float, size: float) -> dict[str, float]:
    return {f"above {share:.1%}": waves.width(flight, bead, share, speed, size) for share in (0.001, 0.01, 0.05)}


def long_wave_width(exponent: float) -> float:
    """Equation 5.13 over D."""
    return pi / (exponent - 1.0) * sqrt(exponent * (exponent + 1.0) / 6.0)


def crossed(angle: float, exact: bool = True) -> float:
    """k of two cylinders whose axes enclose an angle, degrees."""
    return ellipses.stiffness(CYLINDER, CYLINDER, STEEL, radians(angle), exact)


@lru_cache
def cylinders(angle: float, gravity: float, tolerance: float) -> Flight:
    """20 crossed cylinders, struck by a sphere of 0.45 g at 0.5 m/s."""
    between = crossed(angle)
    chain = row(BEADS, CYLINDER_MASS, between, between, STRIKER_MASS, ON_CYLINDER)
    return hertzian(*chain, gravity=gravity).strike(STRIKER_SPEED, 0.3e-3, tolerance)


@bodies.entry("width_cyl90", "6", "D", "90 degrees, v = 0.5 m/s, g = 0; sensor force above a share of its peak")
def width_cyl90(effort: Effort) -> Variants:
    flight = cylinders(90.0, 0.0, effort.tolerance)
    return widths(flight, 10, waves.speed(flight, (7, 13), SIZE), SIZE)


def line_force(approach: Numbers, compliance: float = STEEL.compliance) -> Numbers:
    """Equation 5.8 with sign and branch corrected, N/m: F* = −(π/θ)(δ/2)/W₋₁(−eδ/(8R)); 0 in open contacts."""
    closed = np.maximum(approach, 1e-30)
    return np.where(
        approach > 0.0, -pi / compliance * closed / 2.0 / lambertw(-e * closed / (8.0 * RADIUS), -1).real, 0.0
    )


def line_approach(force: float) -> float:
    """Equation 5.7, m, for F*, N/m."""
    half_width = sqrt(4.0 * force * RADIUS * STEEL.compliance / pi)
    return 2.0 * force * STEEL.compliance / pi * (2.0 * log(4.0 * RADIUS / half_width) - 1.0)


@bodies.entry(
    "n_parallel_cyl_fit",
    "1.15",
    "1",
    "exponent of equation 5.7: local, and fitted over 1 to 100 N on 4.76 mm; thesis by FEM",
)
def n_parallel_cyl_fit(_: Effort) -> Variants:
    def local(force: float) -> float:
        step = 1e-4
        return 2.0 * step / log(line_approach(force * (1.0 + step)) / line_approach(force * (1.0 - step)))

    forces = np.geomspace(1.0, 100.0, 41)
    approaches = [line_approach(one / CYLINDER_LENGTH) for one in forces]
    return {
        "local at 1e3 N/m": local(1e3),
        "local at 3e4 N/m": local(3e4),
        "fit over 1 to 100 N": float(np.polyfit(np.log(approaches), np.log(forces), 1)[0]),
    }


@lru_cache
def parallel_cylinders(tolerance: float) -> Flight:
    """20 parallel cylinders, the last on a wall with the same law, struck by a sphere; no gravity."""

    def law(approach: Numbers) -> Numbers:
        struck = ON_CYLINDER * np.maximum(approach[..., :1], 0.0) ** 1.5
        return np.concatenate([struck, CYLINDER_LENGTH * line_force(approach[..., 1:])], axis=-1)

    mass, _ = row(BEADS, CYLINDER_MASS, 0.0, 0.0, STRIKER_MASS)
    return Line(mass, law, np.zeros_like).strike(STRIKER_SPEED, 0.12e-3, tolerance)


@bodies.entry(
    "speed_cyl0_factor",
    "4",
    "1",
    "0 over 90 degrees, v = 0.5 m/s, striker 0.45 g, g = 0, sensors 7 and 13; thesis by FEM",
)
def speed_cyl0_factor(effort: Effort) -> Variants:
    slow = waves.speed(cylinders(90.0, 0.0, effort.tolerance), (7, 13), SIZE)
    return {"equation 5.8": waves.speed(parallel_cylinders(effort.tolerance), (7, 13), SIZE) / slow}


@hollow.entry(
    "0/k_hertz",
    "3.759e9",
    "N/m^1.5",
    "solid aluminium spheres of R = 9.525 mm, equation 1.1; thesis by FEM with n = 1.504",
)
def solid_stiffness(_: Effort) -> Variants:
    return {"equation 1.1": between_spheres(OUTER, ALUMINIUM)}


@lru_cache
def shells(mass: float, gravity: float, tolerance: float) -> Flight:
    """29 hollow spheres with the law of Table 5.1, struck by an equal one at 0.32 m/s."""
    stiffness, exponent = LAW
    chain = row(29, mass, stiffness, stiffness)
    return hertzian(*chain, exponent=exponent, gravity=gravity).strike(0.32, 1.0e-3, tolerance)


SHELL_MASSES: Sequence[tuple[str, float]] = (
    ("m = 2.38 g", 2.38e-3),
    ("m from dimensions", sphere_mass(OUTER, ALUMINIUM) * (1.0 - 0.908**3)),
)


@hollow.entry("V_dpm", "648.5", "m/s", "R_i/R_o = 0.908, v = 0.32 m/s, N = 29, sensors 12 and 19, D = 19.05 mm")
def V_hollow(effort: Effort) -> Variants:
    found = {
        f"{name}, g = {gravity:g}": waves.speed(shells(mass, gravity, effort.tolerance), (12, 19), 2.0 * OUTER)
        for name, mass in SHELL_MASSES
        for gravity in (0.0, GRAVITY)
    }
    flight = shells(2.38e-3, 0.0, effort.tolerance)
    force = highest(flight, 15)
    return found | {"equation 5.12, m = 2.38 g, g = 0": along_force(LAW[0], 2.38e-3, 2.0 * OUTER, force, LAW[1])}


@hollow.entry("width_theory_D", "7.5", "D", "equation 5.13")
def width_hollow(effort: Effort) -> Variants:
    flight = shells(2.38e-3, 0.0, effort.tolerance)
    speed = waves.speed(flight, (12, 19), 2.0 * OUTER)
    found = {f"n = {n}": long_wave_width(n) for n in (1.222, 1.22, 1.2)}
    return found | {f"discrete chain {k}": v for k, v in widths(flight, 15, speed, 2.0 * OUTER).items()}
