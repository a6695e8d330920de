"""Thesis sections 5.1 and 5.3.1: waves in chains of spheres of four sizes, and of ellipsoids lying and standing."""

from collections.abc import Iterator, Mapping
from math import pi
from typing import Any

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
FORCES = np.geomspace(5.0, 100.0, 9)
UNTIL = 1.2e-3  # Length of the record, s: a wave of 4 N passes sensor 12 of the largest spheres.
SHAPES = ("minor axis", "major axis", "equivalent sphere")
# Masses of beads and striker, and the striker's size, as the text may be read.
CASES = ("printed mass", "mass from geometry", "gravity", "striker D 2.38 mm", "striker R 2.38 mm")


def particle(shape: str) -> hl.Bead:
    """Return an ellipsoid that touches its neighbours along an axis, or the sphere of the same mass."""
    if shape == "equivalent sphere":
        return hl.Sphere(0.5 * (MINOR**2 * MAJOR) ** (1.0 / 3.0), STEEL)
    return hl.Ellipsoid(MINOR / 2.0, MAJOR, STEEL, axis="across" if shape == "minor axis" else "along")


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return speed, peak force and width of waves over the striker speed, by shape and size, and in the thesis's cases.

    The curves are without gravity, with masses from geometry and a striker equal to the beads. quick: three of the nine
    forces. jobs: always one process.
    """
    forces = FORCES[::4] if quick else FORCES

    def curves(name: str, beads: Mapping[Any, hl.Bead]) -> xr.Dataset:
        laws = {key: hl.contact_law(bead, bead) for key, bead in beads.items()}
        of = {
            key: waves.Curve((bead, bead), laws[key], waves.striker_speeds(bead, laws[key], forces))
            for key, bead in beads.items()
        }
        return waves.run_curves(name, of, BEADS, SENSORS, UNTIL).drop_vars("width")

    def case_of_the_thesis(case: str) -> hl.CoSimulation:
        bead: hl.Bead = hl.Ellipsoid(MINOR / 2.0, MAJOR, STEEL)
        if case != "mass from geometry":
            bead = of_mass(bead, PRINTED_MASS)
        radius = {"striker R 2.38 mm": 2.38e-3, "striker D 2.38 mm": 1.19e-3}.get(case, PRINTED_RADIUS)
        gravity = 9.81 if case == "gravity" else 0.0  # it needs a floor
        chain = hl.Chain([bead] * BEADS, hl.Sphere(radius, STEEL), IMPACT_SPEED, gravity)
        return hl.CoSimulation(chain, hl.half_space(STEEL) if gravity else None)

    data = curves("shape", {shape: particle(shape) for shape in SHAPES})
    sizes = curves("diameter", {diameter: hl.Sphere(diameter / 2.0, hl.STEEL_440C) for diameter in DIAMETERS})
    cases = waves.swept(case_of_the_thesis, UNTIL, SENSORS, case=CASES)
    return with_units(data.merge(named(sizes, "size")).merge(named(cases, "case")), diameter="m")


def numbers(data: xr.Dataset) -> Iterator[Number]:
    """Yield the numbers of sections 5.1 and 5.3.1."""
    lying = particle("minor axis")
    yield Number("larger radius of curvature R'", 1e3 / lying.surface.curvature)
    yield Number("mass of an ellipsoid", lying.mass * 1e3)
    # The wave of figure 5.5a.
    speeds = data.case_wave_speed.to_series().to_dict()
    by_mass, gravity = speeds.pop("printed mass"), {"gravity": speeds.pop("gravity")}
    yield Number("wave speed, discrete particles", {"": by_mass} | speeds)
    yield Number("wave speed, finite elements", {"": by_mass} | gravity)
    yield Number("wave speed, experiment", by_mass)
    width = waves.widths(data.case_width.sel(case="printed mass").values, MINOR)
    yield Number("width, in minor diameters", width | waves.OF_THEORY)

    # Speed and force in figures 5.1 and 5.5b.
    curve = data.sel(shape="minor axis")
    slope = waves.power_exponent(curve.peak_force.values, curve.wave_speed.values)
    yield Number("exponent n of Hertz's law", 1.0 / (1.0 - 2.0 * slope), f"(n − 1)/(2n) = {slope:.4f}")
    along_minor, along_major, equal = (waves.speed_at(data.sel(shape=shape), 40.0) for shape in SHAPES)
    yield Number("wave speed along the minor axis", along_minor / equal)
    yield Number("wave speed along the major axis", along_major / equal)
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
