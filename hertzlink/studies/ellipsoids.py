"""Thesis sections 5.1 and 5.3.1: waves in chains of spheres of four sizes, and of ellipsoids lying and standing."""

from collections.abc import Iterator
from functools import partial
from math import pi

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.compare import Number
from hertzlink.studies.shared import named, of_mass, with_units

STEEL, MINOR, MAJOR = hl.STEEL_316, 4.72e-3, 10.16e-3
PRINTED_MASS = 0.925e-3  # kg, of the ellipsoids and of the spherical striker (sections 2.1 and figure 5.5).
PRINTED_RADIUS = float((0.75 * PRINTED_MASS / (pi * STEEL.density)) ** (1.0 / 3.0))  # m, of a sphere of this mass.
BEADS, SENSORS, IMPACT_SPEED = 20, (7, 12), 0.626
DIAMETERS = (2.38e-3, 4.76e-3, 9.53e-3, 19.1e-3)
# N, approximate peak forces that the strikers of the curves produce; the thesis prints its own in figures only.
FORCES = tuple(np.geomspace(5.0, 100.0, 9))
UNTIL = 1.2e-3  # Length of the record, s: a wave of 4 N passes sensor 12 of the largest spheres.
SHAPES = ("minor axis", "major axis", "equivalent sphere")
# Masses of beads and striker, and the striker's size, as the text may be read.
CASES = ("printed mass", "mass from geometry", "gravity", "striker of radius 2.38 mm", "striker of diameter 2.38 mm")


def particle(shape: str) -> hl.Bead:
    """Return an ellipsoid that touches its neighbours along an axis, or the sphere of the same mass."""
    if shape == "equivalent sphere":
        return hl.Sphere(0.5 * (MINOR**2 * MAJOR) ** (1.0 / 3.0), STEEL)
    return hl.Ellipsoid(MINOR / 2.0, MAJOR, STEEL, axis="across" if shape == "minor axis" else "along")


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return speed, peak force and width of waves over the striker speed, by shape and size, and in the thesis's cases.

    The curves are without gravity, with masses from geometry and a striker equal to the beads. quick: three of the nine
    forces. jobs: 1 by default, because starting processes takes longer than the runs.
    """
    jobs, forces = jobs or 1, FORCES[::4] if quick else FORCES
    shapes = {shape: particle(shape) for shape in SHAPES}
    spheres = {diameter: hl.Sphere(diameter / 2.0, hl.STEEL_440C) for diameter in DIAMETERS}

    def curves(name: str, beads: dict) -> xr.Dataset:  # type: ignore[type-arg]
        of = {key: waves.Curve((bead, bead), hl.contact_law(bead, bead), forces=forces) for key, bead in beads.items()}
        return waves.run_curves(name, of, BEADS, SENSORS, UNTIL, jobs).drop_vars(["striker_speed", "width"])

    def case_of_the_thesis(case: str) -> hl.CoSimulation:
        bead: hl.Bead = hl.Ellipsoid(MINOR / 2.0, MAJOR, STEEL)
        if case != "mass from geometry":
            bead = of_mass(bead, PRINTED_MASS)
        radius = {"striker of radius 2.38 mm": 2.38e-3, "striker of diameter 2.38 mm": 1.19e-3}.get(case)
        gravity = 9.81 if case == "gravity" else 0.0  # it needs a floor
        chain = hl.Chain([bead] * BEADS, hl.Sphere(radius or PRINTED_RADIUS, STEEL), IMPACT_SPEED, gravity)
        return hl.CoSimulation(chain, hl.half_space(STEEL) if gravity else None)

    measure = partial(waves.passage, first=SENSORS[0], second=SENSORS[1])
    cases = hl.sweep(case_of_the_thesis, UNTIL, jobs, measure, case=list(CASES))
    data = curves("shape", shapes).merge(named(curves("diameter", spheres), "size")).merge(named(cases, "case"))
    return with_units(data, diameter="m")


def numbers(data: xr.Dataset) -> Iterator[Number]:
    """Yield the numbers of sections 5.1 and 5.3.1; unit of k: 10⁹ N/m^1.5."""
    # Geometry and stiffness of the contacts.
    printed, stiffness = hl.Sphere(PRINTED_RADIUS, STEEL), hl.theory.hertz_stiffness
    surfaces = [*(particle(shape).surface for shape in SHAPES), printed.surface]
    minor, major, sphere, light = (stiffness(surface, surface) * 1e-9 for surface in surfaces)
    yield Number("larger radius of curvature R'", 1e3 / surfaces[0].curvature)
    yield Number("mass of an ellipsoid", particle("minor axis").mass * 1e3)
    yield Number("k, along the major axis", major)
    yield Number("k, along the minor axis", minor, "", "10⁹ N/m^1.5")
    said = f"of 0.925 g, radius {1e3 * printed.radius:.4g} mm; {sphere:.4g} for the mass from geometry"
    yield Number("k, equivalent sphere", light, said, "10⁹ N/m^1.5")

    # The wave of figure 5.5a.
    speeds = data.case_wave_speed.to_series().to_dict()
    by_mass, gravity = speeds["printed mass"], {"gravity": speeds["gravity"]}
    readings = {
        "mass from geometry": speeds["mass from geometry"],
        "striker D 2.38 mm": speeds["striker of diameter 2.38 mm"],
        "striker R 2.38 mm": speeds["striker of radius 2.38 mm"],
    }
    yield Number("wave speed, discrete particles", {"": by_mass} | readings)
    yield from (Number(f"wave speed, {name}", speed) for name, speed in readings.items())
    yield Number("wave speed, finite elements", {"": by_mass} | gravity)
    yield Number("wave speed, experiment", by_mass)
    width = waves.widths(data.case_width.sel(case="printed mass").values, MINOR)
    yield Number("width, in minor diameters", width | waves.OF_THEORY)

    # Speed and force in figures 5.1 and 5.5b.
    lying = data.sel(shape="minor axis")
    slope = waves.power_exponent(lying.peak_force.values, lying.wave_speed.values)
    yield Number("exponent n of Hertz's law", 1.0 / (1.0 - 2.0 * slope), f"(n − 1)/(2n) = {slope:.4f}")
    minor, major, sphere = (waves.speed_at(data.sel(shape=shape), 40.0) for shape in SHAPES)
    yield Number("wave speed along the minor axis", minor / sphere)
    yield Number("wave speed along the major axis", major / sphere)
    yield Number("wave speed over equation 5.11", float((data.wave_speed / data.theory).mean()))
    sizes = xr.Dataset({"wave_speed": data.size_wave_speed, "peak_force": data.size_peak_force})
    by_size = [waves.speed_at(sizes.sel(diameter=diameter), 20.0) for diameter in DIAMETERS]
    yield Number("wave speed over size, exponent", waves.power_exponent(np.array(DIAMETERS), np.array(by_size)))


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return wave speed against peak contact force: spheres of four sizes (5.1), ellipsoids and their sphere (5.5b)."""
    sizes = [(f"D = {d * 1e3:.2f} mm", data.sel(diameter=d)) for d in DIAMETERS]
    by_size = [(label, s.size_peak_force.values, s.size_wave_speed.values, s.size_theory.values) for label, s in sizes]
    names = ("along the minor axis", "along the major axis", "equivalent sphere")
    by_shape = [waves.line(data.sel(shape=shape), name) for name, shape in zip(names, SHAPES, strict=True)]
    return {"particle_size": draw.compared(by_size), "ellipsoids": draw.compared(by_shape)}
