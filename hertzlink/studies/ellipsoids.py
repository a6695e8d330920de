"""Thesis sections 5.1 and 5.3.1: waves in chains of spheres of four sizes, and of ellipsoids lying and standing."""

from functools import partial
from math import pi
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.results import named, with_units
from hertzlink.studies.table import SIMILAR, Row, Rows
from particles.bead import STANDARD_GRAVITY

row = Rows("ellipsoids")
MINOR, MAJOR = 4.72e-3, 10.16e-3
PRINTED_MASS = 0.925e-3  # kg, of the ellipsoids and of the spherical striker (sections 2.1 and figure 5.5).
BEADS, FIRST, SECOND = 20, 7, 12
measure = partial(waves.passage, first=FIRST, second=SECOND)
IMPACT_SPEED = 0.626
DIAMETERS = (2.38e-3, 4.76e-3, 9.53e-3, 19.1e-3)
# N, approximate peak forces that the strikers of the curves produce; the thesis prints its own in figures only.
FORCES = tuple(np.geomspace(5.0, 100.0, 9))
UNTIL = 1.2e-3  # Length of the record, s: a wave of 4 N passes sensor 12 of the largest spheres.
SHAPES = ("minor axis", "major axis", "equivalent sphere")
CASES = ("printed mass", "mass from geometry", "gravity", "striker of radius 2.38 mm", "striker of diameter 2.38 mm")


def particle(shape: str) -> hl.Bead:
    """Return an ellipsoid that touches its neighbours along an axis, or the sphere of the same mass."""
    if shape == "equivalent sphere":
        return hl.Sphere(0.5 * (MINOR**2 * MAJOR) ** (1.0 / 3.0), hl.STEEL_316)
    return hl.Ellipsoid(MINOR / 2.0, MAJOR, hl.STEEL_316, axis="across" if shape == "minor axis" else "along")


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return speed, peak force and width of waves over the striker speed, by shape and size, and in the thesis's cases.

    The curves are without gravity, with masses from geometry and a striker equal to the beads. quick: three of the nine
    forces. jobs: 1 by default, because starting processes takes longer than the runs.
    """
    jobs, forces = jobs or 1, FORCES[::4] if quick else FORCES
    spheres = {diameter: hl.Sphere(diameter / 2.0, hl.STEEL_440C) for diameter in DIAMETERS}
    groups: dict[str, dict[Any, waves.Curve]] = {
        "shape": {shape: struck_by_its_like(shape, particle(shape), forces) for shape in SHAPES},
        "diameter": {d: struck_by_its_like(f"{d:g} m", sphere, forces) for d, sphere in spheres.items()},
    }
    each = []
    for name, curves in groups.items():
        run = waves.run_curves([*curves.values()], BEADS, FIRST, SECOND, jobs, UNTIL)
        run = run[["wave_speed", "peak_force", "width", "theory"]].rename(curve=name, striker="aimed_force")
        each.append(run.assign_coords({name: list(curves), "aimed_force": list(forces)}))
    cases = hl.sweep(case_of_the_thesis, UNTIL, jobs, measure, case=list(CASES))
    data = each[0].merge(named(each[1], "size")).merge(named(cases, "case"))
    return with_units(data, aimed_force="N", diameter="m")


def struck_by_its_like(label: str, bead: hl.Bead, forces: tuple[float, ...]) -> waves.Curve:
    """Return a chain of equal beads whose waves have about these peak forces, N; the striker equals the beads."""
    return waves.Curve(label, (bead, bead), hl.contact_law(bead, bead), forces=forces)


def case_of_the_thesis(case: str) -> hl.CoSimulation:
    """Return section 5.3.1 for each interpretation of the masses of beads and striker; gravity needs a floor."""
    bead = hl.Ellipsoid(MINOR / 2.0, MAJOR, hl.STEEL_316)
    if case != "mass from geometry":
        bead = waves.of_mass(bead, PRINTED_MASS)
    radius = {"striker of radius 2.38 mm": 2.38e-3, "striker of diameter 2.38 mm": 1.19e-3}.get(case)
    striker = hl.Sphere(radius or printed_radius(), hl.STEEL_316)
    gravity = STANDARD_GRAVITY if case == "gravity" else 0.0
    chain = hl.Chain([bead] * BEADS, striker, IMPACT_SPEED, gravity)
    return hl.CoSimulation(chain, hl.half_space(hl.STEEL_316) if gravity else None)


def printed_radius() -> float:
    """Return the radius, m, of a steel sphere of the printed mass."""
    return float((0.75 * PRINTED_MASS / (pi * hl.STEEL_316.density)) ** (1.0 / 3.0))


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of sections 5.1 and 5.3.1, compared with those of hertzlink."""
    return [*_contacts(), *_speeds(data), *_relations(data)]


def _contacts() -> list[Row]:
    """Return the geometry and stiffness of the three contacts, unit of k: 10⁹ N/m^1.5."""
    printed, stiffness = hl.Sphere(printed_radius(), hl.STEEL_316), hl.theory.hertz_stiffness
    surfaces = [*(particle(shape).surface for shape in SHAPES), printed.surface]
    minor, major, sphere, light = (stiffness(surface, surface) * 1e-9 for surface in surfaces)
    return [
        row("larger radius of curvature R'", 1e3 / surfaces[0].curvature),
        row("mass of an ellipsoid", particle("minor axis").mass * 1e3),
        row("k, along the major axis", major),
        row("k, along the minor axis", minor, stiffness(surfaces[0], surfaces[0], "approximate") * 1e-9),
        row("k, equivalent sphere", light, printed.radius * 1e3, sphere),
    ]


def _speeds(data: xr.Dataset) -> list[Row]:
    """Return the wave of figure 5.5a."""
    speeds = data.case_wave_speed.to_series().to_dict()
    printed, gravity = speeds["printed mass"], speeds["gravity"]
    width_1_percent, width_0_1_percent = data.case_width.sel(case="printed mass").values / MINOR
    return [
        row("wave speed, discrete particles", printed),
        row("wave speed, mass from geometry", speeds["mass from geometry"]),
        row("wave speed, finite elements", printed, gravity, otherwise={"gravity": gravity}),
        row("wave speed, experiment", printed),
        row("wave speed, striker D 2.38 mm", speeds["striker of diameter 2.38 mm"]),
        row("wave speed, striker R 2.38 mm", speeds["striker of radius 2.38 mm"]),
        row(
            "width, in minor diameters",
            float(width_1_percent),
            width_0_1_percent,
            otherwise=waves.widths(float(width_0_1_percent)),
        ),
    ]


def _relations(data: xr.Dataset) -> list[Row]:
    """Return the relation of speed and force in figures 5.1 and 5.5b."""
    minor, major, sphere = (waves.speed_at(data.sel(shape=shape), 40.0) for shape in SHAPES)
    slope = waves.exponent(data.sel(shape="minor axis"))
    sizes = xr.Dataset({"wave_speed": data.size_wave_speed, "peak_force": data.size_peak_force})
    by_size = [waves.speed_at(sizes.sel(diameter=diameter), 20.0) for diameter in DIAMETERS]
    ahead = float((data.wave_speed / data.theory).mean())
    return [
        row("exponent n of Hertz's law", 1.0 / (1.0 - 2.0 * slope), slope),
        row("wave speed along the minor axis", minor / sphere, holds=minor < sphere),
        row("wave speed along the major axis", major / sphere, holds=major > sphere),
        row("wave speed over equation 5.11", ahead, holds=abs(ahead - 1.0) < SIMILAR),
        row("wave speed over size, exponent", waves.power_exponent(np.array(DIAMETERS), np.array(by_size))),
    ]


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return wave speed against peak contact force: spheres of four sizes (5.1), ellipsoids and their sphere (5.5b)."""
    sizes = [(f"D = {d * 1e3:.2f} mm", data.sel(diameter=d)) for d in DIAMETERS]
    by_size = [(label, s.size_peak_force.values, s.size_wave_speed.values, s.size_theory.values) for label, s in sizes]
    names = ("along the minor axis", "along the major axis", "equivalent sphere")
    by_shape = [waves.line(data.sel(shape=shape), name) for name, shape in zip(names, SHAPES, strict=True)]
    return {"particle_size": draw.compared(by_size), "ellipsoids": draw.compared(by_shape)}
