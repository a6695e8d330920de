"""Thesis section 5.3.2: waves in chains of cylinders perpendicular to the chain, each rotated against its neighbour."""

import warnings
from dataclasses import dataclass, replace
from functools import partial
from math import radians

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.results import named, with_units
from hertzlink.studies.table import MEASURED, Row, Rows
from particles.bead import STANDARD_GRAVITY
from particles.solitary import CONTACT_TO_CENTRE_FORCE
from structures.structure import Vector

row = Rows("cylinders")
RADIUS, LENGTH = 2.38e-3, 4.76e-3
DIAMETER = 2.0 * RADIUS
STRIKER = hl.Sphere(2.38e-3, hl.STEEL_316)
STRIKER_MASS, CYLINDER_MASS = 0.45e-3, 0.68e-3  # kg, as printed.
BEADS, FIRST, SECOND = 20, 7, 13
measure = partial(waves.passage, first=FIRST, second=SECOND)
IMPACT_SPEED = 0.5
ANGLES = (0.0, 1.0, 3.0, 5.0, 10.0, 30.0, 45.0, 90.0)  # Degrees between neighbours.
HERTZ_ANGLE = 10.0  # Degrees; smaller angles make contacts too long for half-spaces (`contact_law` warns there).
SPEEDS = tuple(np.geomspace(0.1, 1.6, 9))  # m/s, of the striker: a range that covers 10 to 80 N at every angle.
FORCES = (10.0, 40.0, 80.0)  # N, the forces of figure 5.11; 40 N belongs to the thesis's 591.3 m/s.
APPROACHES = np.geomspace(0.1e-6, 10e-6, 21)
UNTIL = 4e-4
CASES = {
    "90°": (90.0, "mass from geometry"),
    "90°, gravity": (90.0, "gravity"),
    "90°, printed masses": (90.0, "printed masses"),
    "0°": (0.0, "mass from geometry"),
}


@dataclass(frozen=True)
class Tacit:
    """The law from `contact_law` without its warning: the table and the figures mark the limit of the theory."""

    name: str = "contact_law"

    def __call__(self, first: hl.Bead, second: hl.Bead | hl.Surface) -> hl.ContactLaw:
        """Return Hertz's law of crossed cylinders at any angle. The floor carries the weight until the wave is read."""
        if isinstance(first, hl.Cylinder) and isinstance(second, hl.Cylinder) and first.angle != second.angle:
            return hl.laws.PowerLaw(hl.theory.hertz_stiffness(first.surface, second.surface))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", hl.HertzlinkWarning)
            law = hl.contact_law(first, second)
        return replace(law, caution="") if isinstance(law, hl.laws.TabulatedLaw) else law


def curve(angle: float, speeds: tuple[float, ...]) -> waves.Curve:
    """Return the chain of an angle, degrees, for strikers of these speeds, m/s."""
    law, pair = Tacit(), (cylinder(0.0), cylinder(angle))
    return waves.Curve(_named(angle), pair, law(*pair), law, speeds=speeds, striker=STRIKER)


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return speed, peak force and width of waves over angle (degrees) and striker speed (m/s), and the thesis's cases.

    Without gravity, with masses from geometry and the thesis's striker. quick: three of nine striker speeds. jobs: 1 by
    default, because starting processes takes longer than the runs.
    """
    jobs, speeds = jobs or 1, SPEEDS[::4] if quick else SPEEDS
    curves = [curve(angle, speeds) for angle in ANGLES]
    data = waves.run_curves(curves, BEADS, FIRST, SECOND, jobs, UNTIL, APPROACHES)
    data = data.rename(curve="angle", striker="impact_speed")
    data = data.assign_coords(angle=list(ANGLES), impact_speed=list(speeds))
    cases = hl.sweep(case_of_the_thesis, UNTIL, jobs, measure, case=list(CASES))
    return with_units(data.merge(named(cases, "case")), angle="degree", impact_speed="m/s")


def cylinder(angle: float) -> hl.Cylinder:
    """Return the thesis's steel cylinder, rotated by an angle in degrees."""
    return hl.Cylinder(RADIUS, LENGTH, hl.STEEL_316, radians(angle))


def stiffness(angle: float, axis_ratio: str = "exact") -> float:
    """Return k, N/m^1.5, of two cylinders that cross at an angle in degrees."""
    return hl.theory.hertz_stiffness(cylinder(0.0).surface, cylinder(angle).surface, axis_ratio)


def by_force(angle: float, force: Vector) -> Vector:
    """Return the wave speed, m/s, at peak contact forces, N, and an angle in degrees (equation 5.11)."""
    return waves.long_waves(cylinder(0.0), stiffness(angle)).wave_speed_from_force(force)


def chain(angle: float, impact_speed: float) -> hl.Chain:
    """Return the thesis's chain. As only the angle between neighbours matters, cylinders are turned back and forth."""
    beads = [cylinder(angle * (i % 2)) for i in range(BEADS)]
    return hl.Chain(beads, STRIKER, impact_speed, law=Tacit())


def case_of_the_thesis(case: str) -> hl.CoSimulation:
    """Return figures 5.9a and 5.10a for each interpretation of masses and gravity; gravity needs a floor."""
    angle, reading = CASES[case]
    struck = chain(angle, IMPACT_SPEED)
    if reading == "gravity":
        return hl.CoSimulation(replace(struck, gravity=STANDARD_GRAVITY), hl.half_space(hl.STEEL_316))
    if reading == "printed masses":
        beads = [waves.of_mass(bead, CYLINDER_MASS) for bead in struck.beads]
        struck = replace(struck, beads=beads, striker=waves.of_mass(STRIKER, STRIKER_MASS))
    return hl.CoSimulation(struck, None)


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of section 5.3.2, compared with those of hertzlink."""
    return [*_crossed_at_right_angles(data), *_turned(data), *_parallel(data)]


def _crossed_at_right_angles(data: xr.Dataset) -> list[Row]:
    """Return figure 5.9a, and 40 N of figure 5.9b."""
    speeds = data.case_wave_speed.to_series().to_dict()
    plain, printed, gravity = speeds["90°"], speeds["90°, printed masses"], speeds["90°, gravity"]
    width_1_percent, width_0_1_percent = data.case_width.sel(case="90°").values / DIAMETER
    curve = data.sel(angle=90.0)
    contact, centre = (waves.speed_at(curve, force) for force in (FORCES[1], FORCES[1] * CONTACT_TO_CENTRE_FORCE))
    between = {"F between the force at a contact and at a sensor": f"{contact:.5g} to {centre:.5g}"}
    return [
        row("mass of a cylinder", cylinder(0.0).mass * 1e3),
        row("wave speed at 90°, discrete particles", plain, gravity, printed, otherwise={"gravity": gravity}),
        row("wave speed at 90°, finite elements", plain, gravity, otherwise={"gravity": gravity}),
        row("wave speed at 90°, experiment", plain, gravity, otherwise={"gravity": gravity}),
        row(
            "width at 90°", float(width_1_percent), width_0_1_percent, otherwise=waves.widths(float(width_0_1_percent))
        ),
        row("wave speed at 90°, 40 N", contact, centre, float(by_force(90.0, np.array(FORCES[1]))), otherwise=between),
    ]


def _turned(data: xr.Dataset) -> list[Row]:
    """Return figures 5.9b and 5.11: the influence of smaller angles."""
    gain = {angle: f"{100.0 * (_normalised(data, angle, FORCES[1]) - 1.0):.1f} %" for angle in (45.0, 30.0)}
    methods = ("exact", "approximate")
    by_theory = [100.0 * ((stiffness(30.0, m) / stiffness(90.0, m)) ** (1.0 / 3.0) - 1.0) for m in methods]
    at_five = ", ".join(f"{_normalised(data, 5.0, force):.2f}" for force in FORCES)
    return [
        row("speed gained at 45°, 40 N", gain[45.0]),
        row("speed gained at 30°, 40 N", gain[30.0], *by_theory),
        row("speed at 5° over 90°, at 10, 40, 80 N", at_five),
    ]


def _parallel(data: xr.Dataset) -> list[Row]:
    """Return the line contact, equation 5.8, and figure 5.10."""
    law, fitted = Tacit()(cylinder(0.0), cylinder(0.0)), np.geomspace(1.0, 100.0, 41)
    power = waves.power_exponent(law.approach(fitted), fitted)
    low, high = local_exponent(law, np.array([1e3, 3e4]) * LENGTH)
    reason = f"equation 5.8 over 1 to 100 N, locally {low:.3f} to {high:.3f} for 1 to 30 kN/m"
    width_1_percent, width_0_1_percent = data.case_width.sel(case="0°").values / DIAMETER
    factor = float(data.case_wave_speed.sel(case="0°") / data.case_wave_speed.sel(case="90°"))
    slow, _, fast = (waves.speed_at(data.sel(angle=0.0), force) for force in FORCES)
    return [
        row("exponent n of parallel cylinders", power, reason),
        row("exponent n, Harris (2001)", power, reason),
        row(
            "width at 0°",
            float(width_1_percent),
            width_0_1_percent,
            otherwise={"from 0.1 % to 0.1 % of the peak": float(width_0_1_percent)},
        ),
        row("wave speed at 0° over 90°", factor, _normalised(data, 0.0, FORCES[1])),
        row("wave speed at 0° from 10 to 80 N", f"{slow:.0f} to {fast:.0f}", holds=abs(fast / slow - 1.0) < MEASURED),
    ]


def local_exponent(law: hl.ContactLaw, force: Vector) -> Vector:
    """Return d ln F / d ln δ of a law at these forces, N."""
    approach = law.approach(force)
    exponents: Vector = law.tangent(approach) * approach / force
    return exponents


def _normalised(data: xr.Dataset, angle: float, force: float) -> float:
    """Return the wave speed at an angle over that at 90°, at the same peak contact force, N."""
    return waves.speed_at(data.sel(angle=angle), force) / waves.speed_at(data.sel(angle=90.0), force)


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return wave speed against peak contact force (5.9b), against the angle (5.11), and the contact laws (5.7c)."""
    curves = [waves.line(data.sel(angle=angle), f"{angle:.0f}°") for angle in (30.0, 45.0, 90.0)]
    speeds = [(f"F = {force:.0f} N", np.array([_normalised(data, a, force) for a in ANGLES])) for force in FORCES]
    angles = np.sort([*np.geomspace(1.0, 90.0, 91), HERTZ_ANGLE])
    ratios = [(stiffness(angle) / stiffness(90.0)) ** (1.0 / 3.0) for angle in angles]
    theory = xr.DataArray(ratios, {"angle": angles}, ("angle",))  # equation 5.11, at the same force
    return {
        "speed_force": draw.compared(curves),
        "angle": draw.against_angle(np.array(ANGLES), speeds, theory, HERTZ_ANGLE, "wave speed over that at 90°"),
        "laws": draw.contact_laws(data.force.sel(angle=[0.0, 5.0, 10.0, 30.0, 90.0]), "angle", _named),
    }


def _named(angle: float) -> str:
    beyond = ", beyond half-space theory" if 0.0 < angle < HERTZ_ANGLE else ""
    return "0°, line contact" if angle == 0.0 else f"{angle:.0f}°{beyond}"
