"""Thesis section 5.3.3: waves in chains of hollow aluminium spheres, against the thickness of their walls."""

from functools import partial

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.results import named, with_units
from hertzlink.studies.table import SIMILAR, SIMULATED, Row, Rows
from particles.bead import STANDARD_GRAVITY

row = Rows("hollow_spheres")
RADIUS = 9.525e-3
# The thesis's finite-element laws F = k δⁿ, k in N/mⁿ, by the ratio of inner to outer radius.
TABLE_5_1 = {
    0.0: hl.laws.PowerLaw(3.759e9, 1.504),
    0.5: hl.laws.PowerLaw(3.193e9, 1.493),
    0.75: hl.laws.PowerLaw(1.174e9, 1.423),
    0.908: hl.laws.PowerLaw(4.671e7, 1.222),
}
THIN = 0.908
PRINTED_MASS = 2.38e-3  # kg, of a sphere of the ratio THIN (section 2.1).
BEADS, FIRST, SECOND = 29, 12, 19
measure = partial(waves.passage, first=FIRST, second=SECOND)
IMPACT_SPEED = 0.32
# N, approximate peak forces that the strikers of the curves produce; the thesis prints its own in figures only.
FORCES = tuple(np.geomspace(2.0, 40.0, 9))
APPROACHES = np.geomspace(1e-6, 20e-6, 21)
# m: a least-squares fit over this range gives the thesis's pairs of k and n from finite elements (errata).
FITTED_RANGE = (0.2e-6, 10e-6)
UNTIL = 2.5e-3  # Length of the record, s: a wave of 2 N passes sensor 19 of the solid spheres.
CASES = ("mass from geometry", "printed mass", "printed mass, gravity", "law of hertzlink")


def particle(ratio: float) -> hl.Sphere | hl.HollowSphere:
    """Return a sphere, solid or hollow, by its inner over its outer radius."""
    if ratio <= 0.0:
        return hl.Sphere(RADIUS, hl.ALUMINIUM_6061)
    return hl.HollowSphere(RADIUS, ratio * RADIUS, hl.ALUMINIUM_6061)


def law_of(ratio: float) -> hl.ContactLaw:
    """Return the law of hertzlink: Hertz in series with Reissner's shell."""
    return hl.contact_law(particle(ratio), particle(ratio))


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return speed, peak force and width of waves over the striker speed, by wall; the thesis's cases; contact laws.

    The curves use the laws of Table 5.1, masses from geometry, a striker equal to the beads, and no gravity. quick:
    three of nine striker speeds. jobs: 1 by default, because starting processes takes longer than the runs.
    """
    jobs, forces = jobs or 1, FORCES[::4] if quick else FORCES
    curves = [waves.Curve(_named(r), (particle(r),) * 2, law, law, forces) for r, law in TABLE_5_1.items()]
    data = waves.run_curves(curves, BEADS, FIRST, SECOND, jobs, UNTIL, APPROACHES)
    data = data.rename(curve="ratio", striker="aimed_force", force="table_force")
    data = data.assign_coords(ratio=list(TABLE_5_1), aimed_force=list(forces))
    label = {"units": "N", "long_name": "contact law of hertzlink"}
    data["force"] = (("ratio", "approach"), [law_of(ratio).force(APPROACHES) for ratio in TABLE_5_1], label)
    cases = hl.sweep(case_of_the_thesis, UNTIL, jobs, measure, case=list(CASES))
    return with_units(data.merge(named(cases, "case")), ratio="1", aimed_force="N")


def case_of_the_thesis(case: str) -> hl.CoSimulation:
    """Return figure 5.14a for each interpretation of mass, gravity and law; gravity needs a floor."""
    bead = particle(THIN)
    if case.startswith("printed mass"):
        bead = waves.of_mass(bead, PRINTED_MASS)
    law = None if case == "law of hertzlink" else TABLE_5_1[THIN]
    gravity = STANDARD_GRAVITY if case.endswith("gravity") else 0.0
    chain = hl.Chain([bead] * BEADS, bead, IMPACT_SPEED, gravity, law=law)
    return hl.CoSimulation(chain, hl.half_space(hl.ALUMINIUM_6061) if gravity else None)


def fit(law: hl.ContactLaw) -> tuple[float, float]:
    """Return k (N/mⁿ) and n of a law, by least squares over FITTED_RANGE."""
    nearest = waves.power_fit(law, *FITTED_RANGE, "absolute")
    return nearest.stiffness, nearest.exponent


def _theory(ratio: float) -> hl.theory.UniformChain:
    return waves.long_waves(particle(ratio), TABLE_5_1[ratio].stiffness, TABLE_5_1[ratio].exponent)


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of section 5.3.3, compared with those of hertzlink."""
    return [*_laws(data), *_speeds(data), *_relations(data)]


def _laws(data: xr.Dataset) -> list[Row]:
    """Return table 5.1 compared with Hertz in series with Reissner's shell."""
    solid = hl.contact_law(particle(0.0), particle(0.0)).kernel[0]
    rows = [row("mass of a hollow sphere", particle(THIN).mass * 1e3), row("k, Ri/Ro 0", solid * 1e-9)]
    for ratio, printed in TABLE_5_1.items():
        law, at = law_of(ratio), np.array(5e-6)
        share = 100.0 * (data.force / data.table_force - 1.0).sel(ratio=ratio)
        said = "Hertz" if ratio == 0.0 else "Hertz and Reissner's shell in series", *share.values[[0, -1]]
        k, n = fit(law)
        reason = f"of a fit over 0.2 to 10 µm, k = {k:.4g} N/mⁿ; the thesis has {printed.stiffness:.4g}"
        rows += [
            row("F at 5 µm", float(law.force(at)), *said, theory=float(printed.force(at)), ratio=ratio),
            of_table_5_1("exponent n, Ri/Ro", ratio, printed.exponent, n, reason),
        ]
    return rows


def of_table_5_1(what: str, ratio: float, printed: float, ours: float, reason: str, unit: str = "") -> Row:
    """Return a number of Table 5.1, which finite elements gave, beside ours."""
    name = f"{what} {ratio:g}"
    return Row(name, printed, ours, unit, reason, within=SIMULATED, number=name)


def _speeds(data: xr.Dataset) -> list[Row]:
    """Return the wave of figure 5.14a."""
    plain, lighter, gravity, computed = data.case_wave_speed.sel(case=list(CASES)).values.tolist()
    wide, wider = data.case_width.sel(case="mass from geometry").values / (2.0 * RADIUS)
    return [
        row("wave speed, discrete particles", plain, lighter, gravity),
        row("wave speed, hertzlink's own law", computed),
        row("wave speed, finite elements", plain),
        row("wave speed, experiment", plain),
        row("width, by equation 5.13", _theory(THIN).width / (2.0 * RADIUS)),
        row("width, experiment", float(wide), wider, otherwise={"from 0.1 % to 0.1 % of the peak": float(wider)}),
    ]


def _relations(data: xr.Dataset) -> list[Row]:
    """Return figures 5.14b and 5.14c: the influence of the force."""
    n, rounded = TABLE_5_1[THIN].exponent, {"n = 1.2 instead of 1.222": (1.2 - 1.0) / 2.4}
    slopes = {ratio: waves.exponent(data.sel(ratio=ratio)) for ratio in (0.0, THIN)}
    at = [waves.speed_at(data.sel(ratio=ratio), 20.0) for ratio in TABLE_5_1]
    ahead = (data.wave_speed / data.theory).mean("aimed_force").sel(ratio=[0.0, THIN])
    shown, close = ", ".join(f"{speed:.0f}" for speed in at), bool((abs(ahead - 1.0) < SIMILAR).all())
    return [
        row("exponent n, Pauchard and Rica", fit(law_of(THIN))[1]),
        row("wave speed over force, exponent, Ri/Ro 0.908", slopes[THIN], (n - 1.0) / (2.0 * n), otherwise=rounded),
        row("wave speed over force, exponent, solid", slopes[0.0]),
        row("wave speed at 20 N, Ri/Ro 0, 0.5, 0.75, 0.908", shown, holds=all(np.diff(at) < 0.0)),
        row("wave speed over equation 5.12", "{:.3f}, {:.3f}".format(*ahead.values), holds=close),
    ]


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the wave speed against peak contact force (5.14b), its exponents (5.14c), and the contact laws (5.12b)."""
    walls = {ratio: data.sel(ratio=ratio) for ratio in TABLE_5_1}
    slopes = {r: rf"{_named(r)}: $V \propto F^{{{waves.exponent(walls[r]):.4f}}}$" for r in (0.0, THIN)}
    scaling = draw.compared([waves.line(walls[r], label) for r, label in slopes.items()], log=True, height=3.6)
    scaling.axes[0].set_yticks([300, 400, 500, 600, 700])
    microns = data.approach.values * 1e6
    forces = [(_named(r), microns, s.force.values, s.table_force.values) for r, s in walls.items()]
    names = draw.Look(theory="the thesis's finite elements", simulation="Hertz and Reissner's shell")
    return {
        "speed_force": draw.compared(waves.line(wall, _named(ratio)) for ratio, wall in walls.items()),
        "exponents": scaling,
        "laws": draw.compared(forces, draw.FORCE_OVER_APPROACH, log=True, **names),
    }


def _named(ratio: float) -> str:
    return f"Ri/Ro = {ratio:g}" if ratio else "solid"
