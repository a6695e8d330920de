"""Thesis section 5.3.3: waves in chains of hollow aluminium spheres, against the thickness of their walls."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.conditions import BEAD, FORCE
from hertzlink.studies.conditions import Conditions as Parameters
from hertzlink.studies.expected import Rows
from hertzlink.studies.table import SIMULATED, Row
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
APPROACHES = tuple(np.geomspace(1e-6, 20e-6, 21))
# m: a least-squares fit over this range gives the thesis's pairs of k and n from finite elements (errata).
FITTED_RANGE = (0.2e-6, 10e-6)
UNTIL = 2.5e-3  # Length of the record, s: a wave of 2 N passes sensor 19 of the solid spheres.
CASES = ("mass from geometry", "printed mass", "printed mass, gravity", "law of hertzlink")


@dataclass(frozen=True)
class Conditions(Parameters):
    """Parameters to change. Contact laws are then Hertz's in series with Reissner's shell, not those of Table 5.1."""

    material: Annotated[hl.Material, "Material of the spheres"] = hl.ALUMINIUM_6061
    radius: Annotated[float, BEAD, "Outer radius of the spheres"] = RADIUS
    ratio: Annotated[
        tuple[float, ...],
        hl.quantities.Quantity(or_zero=True, high=0.95),
        "Inner over outer radius; 0 is a solid sphere",
    ] = tuple(TABLE_5_1)
    peak_force: Annotated[tuple[float, ...], FORCE, "Approximate peak forces of the waves"] = FORCES

    def check(self) -> None:
        """Refuse more curves than colours."""
        waves.check_count(self, "ratio")

    def particle(self, ratio: float) -> hl.Sphere | hl.HollowSphere:
        """Return a sphere, solid or hollow."""
        if ratio <= 0.0:
            return hl.Sphere(self.radius, self.material)
        return hl.HollowSphere(self.radius, ratio * self.radius, self.material)

    def curves(self) -> list[waves.Curve]:
        """Return one for each wall."""
        beads = {_named(ratio): self.particle(ratio) for ratio in self.ratio}
        return [
            waves.Curve(label, (bead, bead), hl.contact_law(bead, bead), forces=self.peak_force)
            for label, bead in beads.items()
        ]


particle = Conditions().particle  # A bead of the thesis.


def run(quick: bool = False, jobs: int | None = None, **parameters: Any) -> xr.Dataset:
    """Return the speed, peak force and width of waves over the striker speed, by wall; the thesis's cases; the contact
    laws.

    The curves use the laws of Table 5.1, masses from geometry, a striker equal to the beads, and no gravity. quick:
    three of nine striker speeds. jobs: 1 by default, because starting processes takes longer than the runs.
    """
    of, jobs = Conditions.of(parameters), jobs or 1
    if of.own:
        return of.marked(waves.run_curves(of.curves(), BEADS, FIRST, SECOND, jobs))
    forces = FORCES[::4] if quick else FORCES
    data = hl.sweep(struck, UNTIL, jobs, measure, ratio=list(TABLE_5_1), aimed_force=forces)
    label = {"units": "m/s", "long_name": "wave speed, equation 5.12"}
    data["theory"] = (("ratio", "aimed_force"), [_theory(r, data.peak_force.sel(ratio=r)) for r in TABLE_5_1], label)
    cases = hl.sweep(case_of_the_thesis, UNTIL, jobs, measure, case=list(CASES))
    data = data.merge(waves.named(cases, "case"))
    approach = np.array(APPROACHES)
    data = data.assign_coords(approach=("approach", approach, {"units": "m"}))
    for name, laws in (("force", own_laws()), ("table_force", TABLE_5_1)):
        data[name] = (("ratio", "approach"), [law.force(approach) for law in laws.values()], {"units": "N"})
    data["force"].attrs["long_name"] = "contact law of hertzlink"
    data["table_force"].attrs["long_name"] = "contact law of Table 5.1"
    data["ratio"].attrs.update(units="1", long_name="inner over outer radius")
    data["aimed_force"].attrs["units"] = "N"
    return data


def own_laws() -> dict[float, hl.ContactLaw]:
    """Return the laws of hertzlink for the four walls: Hertz in series with Reissner's shell."""
    return {ratio: hl.contact_law(particle(ratio), particle(ratio)) for ratio in TABLE_5_1}


def struck(ratio: float, aimed_force: float) -> hl.CoSimulation:
    """A chain with a free end whose wave has about this peak force, N."""
    bead, law = particle(ratio), TABLE_5_1[ratio]
    speed = waves.striker_speed(aimed_force, bead.mass, law.stiffness, law.exponent)
    return hl.CoSimulation(hl.Chain([bead] * BEADS, bead, speed, law=law), None)


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
    nearest = hl.laws.fit_power_law(law, *FITTED_RANGE, weighting="absolute")
    return nearest.stiffness, nearest.exponent


def _theory(ratio: float, force: xr.DataArray) -> np.ndarray:
    law, bead = TABLE_5_1[ratio], particle(ratio)
    return hl.theory.UniformChain(bead.size, bead.mass, law.stiffness, law.exponent).wave_speed_from_force(force.values)


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of section 5.3.3, compared with those of hertzlink."""
    of = Conditions.read(data)
    if of.own:
        return waves.curve_rows(data)
    return [*_laws(data), *_speeds(data), *_relations(data)]


def _laws(data: xr.Dataset) -> list[Row]:
    """Return table 5.1 compared with Hertz in series with Reissner's shell."""
    solid = hl.contact_law(particle(0.0), particle(0.0))
    rows = [row("mass of a hollow sphere", particle(THIN).mass * 1e3), row("k, Ri/Ro 0", solid.kernel[0] * 1e-9)]
    for ratio, law in own_laws().items():
        printed = TABLE_5_1[ratio]
        share = data.force.sel(ratio=ratio) / data.table_force.sel(ratio=ratio) - 1.0
        k, n = fit(law)
        what = "Hertz" if ratio == 0.0 else "Hertz and Reissner's shell in series"
        said, at = (what, *(100.0 * float(share[end]) for end in (0, -1))), np.array(5e-6)
        rows += [
            row("F at 5 µm", float(law.force(at)), *said, theory=float(printed.force(at)), ratio=ratio),
            Row(f"exponent n, Ri/Ro {ratio:g}", printed.exponent, n, "",
                f"of a fit over 0.2 to 10 µm, k = {k:.4g} N/mⁿ; the thesis has {printed.stiffness:.4g}",
                within=SIMULATED),
        ]  # fmt: skip
    return rows


def _speeds(data: xr.Dataset) -> list[Row]:
    """Return the wave of figure 5.14a."""
    speeds = {str(case): float(data.case_wave_speed.sel(case=case)) for case in data.case.values}
    plain, computed = speeds["mass from geometry"], speeds["law of hertzlink"]
    lighter, gravity = speeds["printed mass"], speeds["printed mass, gravity"]
    size = 2.0 * RADIUS
    wide, wider = data.case_width.sel(case="mass from geometry").values / size
    theory = hl.theory.UniformChain(size, 1.0, 1.0, TABLE_5_1[THIN].exponent).width / size
    return [
        row("wave speed, discrete particles", plain, lighter, gravity),
        row("wave speed, hertzlink's own law", computed),
        row("wave speed, finite elements", plain),
        row("wave speed, experiment", plain),
        row("width, by equation 5.13", theory),
        row("width, experiment", float(wide), wider,
            otherwise={"from 0.1 % to 0.1 % of the peak": float(wider)}),
    ]  # fmt: skip


def _relations(data: xr.Dataset) -> list[Row]:
    """Return figures 5.14b and 5.14c: the influence of the force."""
    thin, solid = data.sel(ratio=THIN), data.sel(ratio=0.0)
    n = TABLE_5_1[THIN].exponent
    at = [waves.speed_at(data.sel(ratio=ratio), 20.0) for ratio in TABLE_5_1]
    ahead = [float((data.wave_speed / data.theory).sel(ratio=ratio).mean()) for ratio in (0.0, THIN)]
    return [
        row("exponent n, Pauchard and Rica", fit(own_laws()[THIN])[1]),
        row("wave speed over force, exponent, Ri/Ro 0.908", waves.exponent(thin), (n - 1.0) / (2.0 * n),
            otherwise={"n = 1.2 instead of 1.222": (1.2 - 1.0) / 2.4}),
        row("wave speed over force, exponent, solid", waves.exponent(solid)),
        row("wave speed at 20 N, Ri/Ro 0, 0.5, 0.75, 0.908", ", ".join(f"{speed:.0f}" for speed in at),
            holds=all(np.diff(at) < 0.0)),
        row("wave speed over equation 5.12", f"{ahead[0]:.3f}, {ahead[1]:.3f}",
            holds=max(abs(ratio - 1.0) for ratio in ahead) < 2.0 * SIMULATED),
    ]  # fmt: skip


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the wave speed against peak contact force (5.14b), its exponents (5.14c), and the contact laws (5.12b)."""
    if Conditions.read(data).own:
        return waves.curve_figures(data)
    walls = {ratio: data.sel(ratio=ratio) for ratio in TABLE_5_1}
    slopes = {r: rf"{_named(r)}: $V \propto F^{{{waves.exponent(walls[r]):.4f}}}$" for r in (0.0, THIN)}
    two = [waves.line(walls[ratio], label) for ratio, label in slopes.items()]
    scaling = draw.compared(two, log=True, height=3.6)
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
