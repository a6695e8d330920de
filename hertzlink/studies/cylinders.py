"""Thesis section 5.3.2: waves in chains of cylinders perpendicular to the chain, each rotated against its neighbour."""

from collections.abc import Iterator
from dataclasses import replace
from math import radians

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.compare import Case, Number
from hertzlink.studies.shared import long_waves, named, of_mass, with_units
from particles.solitary import CONTACT_TO_CENTRE_FORCE
from structures.caution import collected

STEEL, RADIUS, LENGTH = hl.STEEL_316, 2.38e-3, 4.76e-3
STRIKER = hl.Sphere(2.38e-3, STEEL)
STRIKER_MASS, CYLINDER_MASS = 0.45e-3, 0.68e-3  # kg, as printed.
BEADS, SENSORS, IMPACT_SPEED = 20, (7, 13), 0.5
ANGLES = (0.0, 1.0, 3.0, 5.0, 10.0, 30.0, 45.0, 90.0)  # Degrees between neighbours.
HERTZ_ANGLE = 10.0  # Degrees; smaller angles make contacts too long for half-spaces (`contact_law` warns there).
SPEEDS = tuple(np.geomspace(0.1, 1.6, 9))  # m/s, of the striker: a range that covers 10 to 80 N at every angle.
FORCES = (10.0, 40.0, 80.0)  # N, the forces of figure 5.11; 40 N belongs to the thesis's 591.3 m/s.
UNTIL = 4e-4
CASES = ("90°", "90°, gravity", "90°, printed masses", "0°")


def tacit_law(first: hl.Bead, second: hl.Bead | hl.Surface) -> hl.laws.ContactLaw:
    """Return the law of `contact_law` without its warning: the table and the figures mark the limit of the theory."""
    if isinstance(first, hl.Cylinder) and isinstance(second, hl.Cylinder) and first.angle != second.angle:
        return hl.laws.PowerLaw(hl.theory.hertz_stiffness(first.surface, second.surface))
    with collected():
        law = hl.contact_law(first, second)
    return replace(law, caution="") if isinstance(law, hl.laws.TabulatedLaw) else law


def cylinder(angle: float) -> hl.Cylinder:
    """Return the thesis's steel cylinder, rotated by an angle in degrees."""
    return hl.Cylinder(RADIUS, LENGTH, STEEL, radians(angle))


def stiffness(angle: float, axis_ratio: str = "exact") -> float:
    """Return k, N/m^1.5, of two cylinders that cross at an angle in degrees."""
    return hl.theory.hertz_stiffness(cylinder(0.0).surface, cylinder(angle).surface, axis_ratio)


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return speed, peak force and width of waves over angle (degrees) and striker, and the thesis's cases.

    Without gravity, with masses from geometry and the thesis's striker. quick: three of nine striker speeds. jobs:
    always one process.
    """
    speeds = SPEEDS[::4] if quick else SPEEDS

    def case_of_the_thesis(case: str) -> hl.CoSimulation:
        # As only the angle between neighbours matters, cylinders are turned back and forth.
        beads = [cylinder(90.0 * (i % 2) if case.startswith("90°") else 0.0) for i in range(BEADS)]
        struck = hl.Chain(beads, STRIKER, IMPACT_SPEED, law=tacit_law)
        if case.endswith("gravity"):  # it needs a floor
            return hl.CoSimulation(replace(struck, gravity=9.81), hl.half_space(STEEL))
        if case.endswith("printed masses"):
            beads = [of_mass(bead, CYLINDER_MASS) for bead in beads]
            struck = replace(struck, beads=beads, striker=of_mass(STRIKER, STRIKER_MASS))
        return hl.CoSimulation(struck, None)

    pairs = {angle: (cylinder(0.0), cylinder(angle)) for angle in ANGLES}
    curves = {angle: waves.Curve(pair, tacit_law(*pair), speeds, STRIKER, tacit_law) for angle, pair in pairs.items()}
    data = waves.run_curves("angle", curves, BEADS, SENSORS, UNTIL)
    cases = waves.swept(case_of_the_thesis, UNTIL, SENSORS, case=CASES)
    return with_units(data.merge(named(cases, "case")), angle="degree")


def normalised(data: xr.Dataset, angle: float, force: float) -> float:
    """Return the wave speed at an angle over that at 90°, at the same peak contact force, N."""
    return waves.speed_at(data.sel(angle=angle), force) / waves.speed_at(data.sel(angle=90.0), force)


def numbers(data: xr.Dataset) -> Iterator[Number]:
    # Figure 5.9a, and 40 N of figure 5.9b.
    speeds = data.case_wave_speed.to_series().to_dict()
    plain = {"": speeds["90°"], "gravity": speeds["90°, gravity"]}
    yield Number("mass of a cylinder", cylinder(0.0).mass * 1e3)
    with_masses = f"with the printed masses {speeds['90°, printed masses']:.1f}"
    yield Number("wave speed at 90°, discrete particles", plain, with_masses)
    yield Number("wave speed at 90°, finite elements", plain)
    yield Number("wave speed at 90°, experiment", plain)
    yield Number("width at 90°", waves.widths(data.case_width.sel(case="90°").values, 2.0 * RADIUS) | waves.OF_THEORY)
    right = data.sel(angle=90.0)
    contact, centre = (waves.speed_at(right, force) for force in (FORCES[1], FORCES[1] * CONTACT_TO_CENTRE_FORCE))
    expected = float(long_waves(cylinder(0.0), stiffness(90.0)).wave_speed_from_force(FORCES[1]))
    cases: dict[str, Case] = {"": contact, "F between the force at a contact and at a sensor": (contact, centre)}
    yield Number("wave speed at 90°, 40 N", cases, f"equation 5.11: {expected:.1f}")

    # Figures 5.9b and 5.11: the influence of smaller angles.
    yield Number("speed gained at 45°, 40 N", 100.0 * (normalised(data, 45.0, FORCES[1]) - 1.0))
    by_theory = [(stiffness(30.0, m) / stiffness(90.0, m)) ** (1.0 / 3.0) for m in ("exact", "approximate")]
    said = "equation 5.11: {:.1f} %; {:.1f} % with the thesis's b/a".format(*(100.0 * (r - 1.0) for r in by_theory))
    yield Number("speed gained at 30°, 40 N", 100.0 * (normalised(data, 30.0, FORCES[1]) - 1.0), said)

    # The line contact, equation 5.8, and figure 5.10.
    law, force = tacit_law(cylinder(0.0), cylinder(0.0)), np.geomspace(1.0, 100.0, 41)
    power = waves.power_exponent(law.approach(force), force)
    approach = law.approach(np.array([1e3, 3e4]) * LENGTH)
    local = law.tangent(approach) * approach / law.force(approach)
    said = "equation 5.8 over 1 to 100 N; locally {:.3f} to {:.3f} for 1 to 30 kN/m".format(*local)
    yield Number("exponent n of parallel cylinders", power, said)
    yield Number("exponent n, Harris (2001)", power)
    yield Number("width at 0°", waves.widths(data.case_width.sel(case="0°").values, 2.0 * RADIUS))
    factor, at_40 = speeds["0°"] / speeds["90°"], normalised(data, 0.0, FORCES[1])
    yield Number("wave speed at 0° over 90°", factor, f"both struck at 0.5 m/s; {at_40:.2f} at 40 N")
    slow, _, fast = (waves.speed_at(data.sel(angle=0.0), force) for force in FORCES)
    yield Number("wave speed at 0° from 10 to 80 N", fast / slow, f"{slow:.0f} to {fast:.0f} m/s")


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return wave speed against peak contact force (5.9b), and against the angle (5.11)."""
    curves = [waves.line(data.sel(angle=angle), f"{angle:.0f}°") for angle in (30.0, 45.0, 90.0)]

    # Hollow and dashed where contacts are too long for half-spaces.
    over_angle, (axis,) = draw.panels()
    angles = np.array(ANGLES)
    beyond = (angles > 0.0) & (angles < HERTZ_ANGLE)
    for i, force in enumerate(FORCES):
        ratios, size = np.array([normalised(data, a, force) for a in ANGLES]), 7.5 - 2.0 * i
        draw.points(axis, angles[~beyond], ratios[~beyond], i, f"F = {force:.0f} N", size=size)
        draw.points(axis, angles[beyond], ratios[beyond], i, hollow=True, size=size)
    axis.annotate("line contact", (0.0, ratios[0]), (8, 0), textcoords="offset points", va="center", fontsize="small")
    labels = "theory of long waves, any force", ""
    for low, high, style, label in zip((HERTZ_ANGLE, 1.0), (90.0, HERTZ_ANGLE), ("-", "--"), labels, strict=True):
        fine = np.geomspace(low, high, 50)
        draw.theory_line(axis, fine, [(stiffness(a) / stiffness(90.0)) ** (1.0 / 3.0) for a in fine], label, style)
    label = f"below {HERTZ_ANGLE:.0f}°: beyond half-space theory"
    axis.plot([], [], "o--", color="black", linewidth=0.9, markerfacecolor="white", label=label)
    axis.set(xlabel="angle between neighbours (°)", ylabel="wave speed over that at 90°")
    axis.set(xticks=[0, 10, 30, 45, 60, 75, 90], ylim=(0.0, None))
    axis.legend()
    return {"speed_force": draw.compared(curves), "angle": over_angle}
