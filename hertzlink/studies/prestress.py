"""Stress in a plate, a strip and a rail: what it changes in the returned wave, and how well one trace gives it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, levels
from hertzlink.studies.levels import NOISE, TOLERANCE
from hertzlink.studies.table import Row, Rows, span

row = Rows("prestress")
HAMMER = 2.8  # K: the error of the neutral temperature of rails that is reported for tests with a hammer.
BLIND = 1000.0  # K, an error beyond which a trace holds nothing of the temperature.
MEGA = 1e6


@dataclass(frozen=True)
class Body(levels.Body):
    """A body under stress. stress_of_kelvin: Pa of a fall by 1 K where it is held."""

    stress_of_kelvin: float
    build: Callable[[float, float], hl.Structure]  # of the stress, Pa, and of a factor of the bending stiffness

    def built(self, level: float, factor: float) -> hl.Structure:
        """Return the reduced body."""
        return hl.reduce(self.build(level, factor), self.until, TOLERANCE)

    def scales(self, levels: np.ndarray) -> dict[str, Any]:
        """Return the stresses, Pa, and the fall of the temperature, K, that makes them."""
        return {
            "stress": ("case", levels, {"units": "Pa"}),
            "colder_by": ("case", levels / self.stress_of_kelvin, {"units": "K"}),
            "stress_of_kelvin": ((), self.stress_of_kelvin, {"units": "Pa/K"}),
        }


def _plate(stress: float, factor: float) -> hl.Structure:
    """Return an aluminium membrane of 80 × 80 × 1 mm, clamped all around."""
    thickness = 1e-3
    held = hl.Supports("clamped", "clamped", "clamped", "clamped")
    inside = hl.Prestress(xx=stress * thickness, yy=stress * thickness)
    material = replace(hl.ALUMINIUM_6061, youngs_modulus=factor * hl.ALUMINIUM_6061.youngs_modulus)
    membrane = hl.kirchhoff_plate(0.08, 0.08, thickness, material, held, additions=[inside], highest_frequency=5e4)
    return membrane.at(0.04, 0.04)


def _strip(stress: float, factor: float) -> hl.Structure:
    """Return an aluminium strip of 60 × 10 × 3 mm, clamped at both ends."""
    area, inertia = 10e-3 * 3e-3, 10e-3 * 3e-3**3 / 12.0
    bending, heavy = factor * hl.ALUMINIUM_6061.youngs_modulus * inertia, hl.ALUMINIUM_6061.density * area
    return hl.beam(0.06, bending, heavy, hl.ALUMINIUM_6061, 0.03, ("clamped", "clamped"), stress * area)


# m², m⁴ (sideways) and kg/m of the profile 60E1 of EN 13674-1.
RAIL_AREA, RAIL_INERTIA, RAIL_MASS = 76.7e-4, 512.3e-8, 60.2
RAIL_SPAN = 3.0  # m of rail between ends that are held far away; its waves do not return from there within the record.
RAIL_STEEL = hl.Material(210e9, 0.3, 7850.0, "rail steel", 5e8)


def _rail(stress: float, factor: float) -> hl.Structure:
    """Return a rail struck sideways with large beads, on 20 MN/m² of elastic ground."""
    bending, ends = factor * RAIL_STEEL.youngs_modulus * RAIL_INERTIA, ("clamped", "clamped")
    return hl.beam(RAIL_SPAN, bending, RAIL_MASS, RAIL_STEEL, 0.5 * RAIL_SPAN, ends, stress * RAIL_AREA, 2e7, 2e4)


# Pa, of a bar that is held and gets colder by 1 K; its expansions, 1/K.
ALUMINIUM_STRESS, STEEL_STRESS = 23.6e-6 * hl.ALUMINIUM_6061.youngs_modulus, 11.5e-6 * RAIL_STEEL.youngs_modulus
THIN_LEVELS = tuple(MEGA * np.array([-30.0, -20.0, -10.0, 0.0, 10.0, 20.0]))
RAIL_LEVELS = tuple(MEGA * np.array([-100.0, -50.0, 0.0, 50.0, 100.0]))
PLANE_STRESS = ALUMINIUM_STRESS / (1.0 - hl.ALUMINIUM_6061.poisson_ratio)
BODIES = (
    Body("plate 80 × 80 × 1 mm", 4.76e-3, 1.2e-3, THIN_LEVELS, 10e6, PLANE_STRESS, _plate),
    Body("strip 60 × 10 × 3 mm", 4.76e-3, 1.2e-3, THIN_LEVELS, 10e6, ALUMINIUM_STRESS, _strip),
    Body("rail 60E1", 19.05e-3, 4e-3, RAIL_LEVELS, 50e6, STEEL_STRESS, _rail),
)


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR and TOF over the stress, and the least error of a stress that is read from one trace.

    quick: three stresses of each body. jobs: always one process.
    """
    return levels.over_bodies("body", BODIES, quick, (0.5, 1.0))


def table(data: xr.Dataset) -> list[Row]:
    """Compare bodies: the thesis names neither stress nor temperature."""
    rows = []
    for body in BODIES:
        at = data.sel(body=body.name).dropna("case")
        stress, ratio = at.stress.values / MEGA, at.amplitude_ratio.values
        sigma, other = float(at.deviation) / MEGA, float(at.deviation_by_twice_the_step) / MEGA
        unit, said = body.stress_of_kelvin / MEGA, (body.sensor, 100 * NOISE, body.near / MEGA, other)
        kelvin, blind = sigma / unit, sigma / unit > BLIND
        reach = "less" if kelvin < HAMMER else "more"
        rows += [
            row("AR", span(ratio), stress[0], stress[-1], ratio.min(), ratio.max(), body=body.name),
            row("TOF", span(1e6 * at.time_of_flight.values, ".1f"), body=body.name),
            row("error", "blind" if blind else sigma, *said, body=body.name),
            row("temperature", f"above {BLIND:.0f}" if blind else kelvin, unit, reach, HAMMER, body=body.name),
        ]
    return rows


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR and TOF, less their values without stress, over the stress."""
    lines = []
    for body in BODIES:
        at = data.sel(body=body.name).dropna("case")
        stress = at.stress.values / MEGA
        measures = at.amplitude_ratio.values, 1e6 * at.time_of_flight.values
        lines.append((body.name, stress, *(values - np.interp(0.0, stress, values) for values in measures)))
    labels = ("AR − AR without stress", "TOF − TOF without stress (µs)")
    figure, axes = levels.figure(lines, "stress, tension positive (MPa)", labels)
    for axis, linear in zip(axes, (1e-3, 0.1), strict=True):
        axis.set_yscale("symlog", linthresh=linear)
    return {"stress": figure}
