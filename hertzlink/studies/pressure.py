"""Pressure in a ball, a tank and a vessel: what it changes in the returned wave, and how well one trace gives it."""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, levels
from hertzlink.studies.levels import NOISE, TOLERANCE
from hertzlink.studies.table import Row, Rows, span

row = Rows("pressure")
QUICK_CELLS = 2  # Cells of the quick study's meshes, instead of four.
# A soft rubber; the modulus of a tennis ball's is not known, and the felt is left out.
RUBBER = hl.Material(4e6, 0.49, 1100.0, "rubber")


@dataclass(frozen=True)
class Shell(levels.Body):
    """A spherical shell on its seat. radius, thickness: m. mesh, reduction: for the builder and `reduce`."""

    radius: float
    thickness: float
    material: hl.Material
    mesh: dict[str, Any] = field(default_factory=dict)
    reduction: dict[str, Any] = field(default_factory=dict)

    beads: ClassVar[int] = 16
    sensor: ClassVar[int] = 8
    speed: ClassVar[float] = 0.3

    def built(self, level: float, factor: float) -> hl.Structure:
        """Return the reduced shell, with a factor of its modulus."""
        material = replace(self.material, youngs_modulus=factor * self.material.youngs_modulus)
        shell = hl.spherical_shell(self.radius, self.thickness, material, level, **self.mesh)
        return hl.reduce(shell, self.until, TOLERANCE, **self.reduction)

    def scales(self, levels: np.ndarray) -> dict[str, Any]:
        """Return the pressures, Pa, and those over the one outside that would buckle the shell."""
        buckling = hl.theory.ThinSphere(self.radius, self.thickness, self.material).buckling_pressure
        relative = {"units": "1", "long_name": "pressure over buckling's"}
        return {
            "pressure": ("case", levels, {"units": "Pa"}),
            "relative_pressure": ("case", levels / buckling, relative),
            "buckling_pressure": ((), buckling, {"units": "Pa"}),
        }


# A rubber ball as soft and as large as a tennis ball, and a thin tank and a thick vessel of hard steel.
SHELLS = (
    Shell(
        "ball", 19.05e-3, 20e-3, (0.0, 20e3, 40e3, 60e3, 80e3), 80e3, 33e-3, 3.5e-3, RUBBER,
        {"patch_radius": 2.2e-3, "highest_frequency": 2e3}, {"pulse": 2e-3},
    ),
    Shell("tank", 4.76e-3, 1.2e-3, (0.0, 0.25e6, 0.5e6, 0.75e6, 1e6), 0.5e6, 0.1, 0.25e-3, hl.STEEL_440C),
    Shell("vessel", 4.76e-3, 1.2e-3, (0.0, 1.5e6, 3e6, 4.5e6, 6e6), 4e6, 50e-3, 1e-3, hl.STEEL_440C),
)  # fmt: skip


def coarser(shell: Shell) -> Shell:
    """Return the shell with half as many cells along each side, for the quick study: AR changes by less than 0.002."""
    return replace(shell, mesh={**shell.mesh, "cells": QUICK_CELLS})


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR and TOF over the pressure, and the least error of a pressure that is read from one trace.

    quick: three pressures of each shell on a coarser mesh, and the error by one step of its derivatives. jobs: always
    one process.
    """
    shells = [coarser(shell) if quick else shell for shell in SHELLS]
    return levels.over_bodies("shell", shells, quick, (0.5, 0.0 if quick else 1.0))


def table(data: xr.Dataset) -> list[Row]:
    """Compare shells: the thesis does not name any under pressure."""
    rows = []
    for shell in SHELLS:
        at = data.sel(shell=shell.name)
        pressure, flight = 1e-3 * at.pressure.values, 1e6 * at.time_of_flight.values
        sigma, other = 1e-3 * float(at.deviation), 1e-3 * float(at.deviation_by_twice_the_step)
        check = "" if np.isnan(other) else f"; {other:.2g} by twice the step"
        said = shell.sensor, 100 * NOISE, 1e-3 * shell.near, check, 100.0 * float(at.deviation / at.buckling_pressure)
        ends = pressure[0], pressure[-1], at.relative_pressure.values[-1]
        rows += [
            row("AR", span(at.amplitude_ratio.values), *ends, shell=shell.name),
            row("TOF", span(flight, ".1f"), 100.0 * (flight[-1] / flight[0] - 1.0), shell=shell.name),
            row("error", f"{sigma:.2g}", *said, shell=shell.name),
        ]
    return rows


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR and TOF over the pressure, in units of that which buckles the shell from outside."""
    lines = []
    for shell in SHELLS:
        at = data.sel(shell=shell.name)
        name = f"{shell.name}, {1e3 * shell.radius:.0f} × {1e3 * shell.thickness:g} mm"
        ratio, flight = at.amplitude_ratio, at.time_of_flight
        lines.append((name, at.relative_pressure, ratio - ratio[0], 100.0 * (flight / flight[0] - 1.0)))
    figure, _ = levels.figure(lines, "pressure / buckling pressure", ("AR − AR without pressure", "change of TOF (%)"))
    return {"pressure": figure}
