"""Thesis section 5.3.3: waves in chains of hollow aluminium spheres, against the thickness of their walls."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.compare import Number
from hertzlink.studies.shared import long_waves, named, of_mass, with_units

METAL, RADIUS = hl.ALUMINIUM_6061, 9.525e-3
# The thesis's finite-element laws F = k δⁿ, k in N/mⁿ, by the ratio of inner to outer radius.
TABLE_5_1 = {
    0.0: hl.laws.PowerLaw(3.759e9, 1.504),
    0.5: hl.laws.PowerLaw(3.193e9, 1.493),
    0.75: hl.laws.PowerLaw(1.174e9, 1.423),
    0.908: hl.laws.PowerLaw(4.671e7, 1.222),
}
THIN = 0.908
PRINTED_MASS = 2.38e-3  # kg, of a sphere of the ratio THIN (section 2.1).
BEADS, SENSORS, IMPACT_SPEED = 29, (12, 19), 0.32
# N, approximate peak forces that the strikers of the curves produce; the thesis prints its own in figures only.
FORCES = np.geomspace(2.0, 40.0, 9)
# m: a least-squares fit over this range gives the thesis's pairs of k and n from finite elements (errata).
FITTED_RANGE = (0.2e-6, 10e-6)
UNTIL = 2.5e-3  # Length of the record, s: a wave of 2 N passes sensor 19 of the solid spheres.
CASES = ("mass from geometry", "hertzlink's own law", "printed mass", "printed mass, gravity")


def particle(ratio: float) -> hl.Sphere | hl.HollowSphere:
    """Return a sphere, solid or hollow, by its inner over its outer radius."""
    return hl.HollowSphere(RADIUS, ratio * RADIUS, METAL) if ratio else hl.Sphere(RADIUS, METAL)


def law_of(ratio: float) -> hl.laws.ContactLaw:
    """Return the law of hertzlink: Hertz in series with Reissner's shell."""
    return hl.contact_law(particle(ratio), particle(ratio))


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return speed, peak force and width of waves over the striker, by wall, and in the thesis's cases.

    The curves use the laws of Table 5.1, masses from geometry, a striker equal to the beads, and no gravity. quick:
    three of nine striker speeds. jobs: always one process.
    """
    forces = FORCES[::4] if quick else FORCES

    def case_of_the_thesis(case: str) -> hl.CoSimulation:
        bead = of_mass(particle(THIN), PRINTED_MASS) if case.startswith("printed mass") else particle(THIN)
        law = None if case == "hertzlink's own law" else TABLE_5_1[THIN]
        gravity = 9.81 if case.endswith("gravity") else 0.0  # it needs a floor
        chain = hl.Chain([bead] * BEADS, bead, IMPACT_SPEED, gravity, law=law)
        return hl.CoSimulation(chain, hl.half_space(METAL) if gravity else None)

    curves = {}
    for ratio, law in TABLE_5_1.items():
        bead = particle(ratio)
        curves[ratio] = waves.Curve((bead, bead), law, waves.striker_speeds(bead, law, forces), of_pair=law)
    data = waves.run_curves("ratio", curves, BEADS, SENSORS, UNTIL)
    cases = waves.swept(case_of_the_thesis, UNTIL, SENSORS, case=CASES)
    return with_units(data.merge(named(cases, "case")), ratio="1")


def numbers(data: xr.Dataset) -> Iterator[Number]:
    # The wave of figure 5.14a.
    yield Number("mass of a hollow sphere", particle(THIN).mass * 1e3)
    plain, *others = data.case_wave_speed.sel(case=list(CASES)).values.tolist()
    yield Number("wave speed, discrete particles", {"": plain, **dict(zip(CASES[1:], others, strict=True))})
    yield Number("wave speed, finite elements", plain)
    yield Number("wave speed, experiment", plain)
    thin = TABLE_5_1[THIN]
    theory = long_waves(particle(THIN), thin.stiffness, thin.exponent)
    yield Number("width, by equation 5.13", theory.width / (2.0 * RADIUS))
    width = data.case_width.sel(case="mass from geometry").values
    yield Number("width, experiment", waves.widths(width, 2.0 * RADIUS))

    # Figures 5.14b and 5.14c: the influence of the force.
    yield Number("exponent n, Pauchard and Rica", waves.power_fit(law_of(THIN), *FITTED_RANGE, relative=False).exponent)
    slopes = exponents(data)
    rounded = {"": slopes[THIN], "n = 1.2 instead of the 1.222 of Table 5.1": (1.2 - 1.0) / 2.4}
    said = f"equation 5.12: {(thin.exponent - 1.0) / (2.0 * thin.exponent):.4f}"
    yield Number("wave speed over force, exponent, Ri/Ro 0.908", rounded, said)
    yield Number("wave speed over force, exponent, solid", slopes[0.0])
    speeds = [waves.speed_at(data.sel(ratio=ratio), 20.0) for ratio in TABLE_5_1]
    shown = ", ".join(f"{speed:.0f}" for speed in speeds)
    yield Number("wave speed at 20 N, Ri/Ro 0, 0.5, 0.75, 0.908", all(np.diff(speeds) > 0.0), f"{shown} m/s")
    ahead = (data.wave_speed / data.theory).mean("striker").sel(ratio=[0.0, THIN])
    yield Number("wave speed over equation 5.12", (float(ahead[0]), float(ahead[1])))


def exponents(data: xr.Dataset) -> dict[float, float]:
    """Return the slopes of ln V over ln F of the solid and of the thinnest spheres."""
    walls = {ratio: data.sel(ratio=ratio) for ratio in (0.0, THIN)}
    return {r: waves.power_exponent(wall.peak_force.values, wall.wave_speed.values) for r, wall in walls.items()}


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the wave speed against peak contact force (5.14b), and its exponents (5.14c)."""
    walls = {ratio: data.sel(ratio=ratio) for ratio in TABLE_5_1}
    names = {ratio: f"Ri/Ro = {ratio:g}" if ratio else "solid" for ratio in TABLE_5_1}
    slopes = {r: rf"{names[r]}: $V \propto F^{{{slope:.4f}}}$" for r, slope in exponents(data).items()}
    scaling = draw.compared([waves.line(walls[r], label) for r, label in slopes.items()], log=True)
    scaling.axes[0].set_yticks([300, 400, 500, 600, 700])
    speeds = draw.compared(waves.line(wall, names[ratio]) for ratio, wall in walls.items())
    return {"speed_force": speeds, "exponents": scaling}
