"""Pressure in a ball, a tank and a vessel: what it changes in the returned wave, and how well one trace gives it."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.information import identifiability
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.sweeps.progress import watched
from hertzlink.studies import draw
from hertzlink.studies.table import Row
from particles.bead import Sphere
from particles.chain import Chain
from structures.caution import collected
from structures.material import STEEL_440C, Material
from structures.reduction import reduce
from structures.spherical_shell import spherical_shell
from structures.structure import Structure
from structures.thin_sphere import buckling_pressure

SENSOR, BEADS, IMPACT_SPEED = 8, 16, 0.3
NOISE = 0.01
"""Of a trace's peak."""

TOLERANCE = 1e-4
"""Of reductions, so that the basis hardly changes with the pressure."""

QUICK_CELLS = 2
"""Cells of the quick study's meshes, instead of four."""

RUBBER = Material(4e6, 0.49, 1100.0, "rubber")
"""A soft rubber; the modulus of a tennis ball's is not known, and the felt is left out."""


@dataclass(frozen=True)
class Shell:
    """A spherical shell on its seat. radius, thickness, diameter of the beads: m. until: s. pressures: Pa.

    near: the pressure at which it is to be found, Pa. mesh, reduction: more arguments of the builder and of `reduce`.
    """

    name: str
    radius: float
    thickness: float
    material: Material
    diameter: float
    until: float
    pressures: tuple[float, ...]
    near: float
    mesh: dict[str, float] = field(default_factory=dict)
    reduction: dict[str, float] = field(default_factory=dict)

    def made(self, pressure: float, factor: float = 1.0) -> Structure:
        """The reduced shell, with a factor of its modulus."""
        own = self.material
        material = Material(factor * own.youngs_modulus, own.poisson_ratio, own.density, own.name)
        whole = spherical_shell(self.radius, self.thickness, material, pressure, **self.mesh)  # type: ignore[arg-type]
        return reduce(whole, self.until, TOLERANCE, **self.reduction)  # type: ignore[arg-type]

    def tapped(self, structure: Structure, impact_speed: float = IMPACT_SPEED) -> CoSimulation:
        """A chain of steel beads on it."""
        bead = Sphere(0.5 * self.diameter, STEEL_440C)
        return CoSimulation(Chain([bead] * BEADS, bead, impact_speed), structure)


SHELLS = (
    Shell(
        "ball", 33e-3, 3.5e-3, RUBBER, 19.05e-3, 20e-3, (0.0, 20e3, 40e3, 60e3, 80e3), 80e3,
        {"patch_radius": 2.2e-3, "highest_frequency": 2e3}, {"pulse": 2e-3},
    ),
    Shell("tank", 0.1, 0.25e-3, STEEL_440C, 4.76e-3, 1.2e-3, (0.0, 0.25e6, 0.5e6, 0.75e6, 1e6), 0.5e6),
    Shell("vessel", 50e-3, 1e-3, STEEL_440C, 4.76e-3, 1.2e-3, (0.0, 1.5e6, 3e6, 4.5e6, 6e6), 4e6),
)  # fmt: skip
"""A rubber ball as soft and as large as a tennis ball, and a thin tank and a thick vessel of hard steel."""


def coarser(shell: Shell) -> Shell:
    """The shell with half as many cells along each side, for the quick study: AR changes by less than 0.002."""
    return replace(shell, mesh={**shell.mesh, "cells": QUICK_CELLS})


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """AR and TOF over the pressure, and the least error of a pressure that is read from one trace.

    quick: three pressures of each shell on a coarser mesh, and the error by one step of its derivatives. jobs: always
    one process.
    """
    with collected():  # that Hertz's contact on soft rubber is wide is said in the docs
        found = [_measured(coarser(one) if quick else one, quick) for one in watched(SHELLS)]
    return xr.concat(found, "shell").assign_coords(shell=[one.name for one in SHELLS])


def _measured(shell: Shell, quick: bool) -> xr.Dataset:
    pressures = np.array(shell.pressures[::2] if quick else shell.pressures)
    made = cache(shell.made)  # almost half the runs are of a shell that another one had

    def at(pressure: float, stiffness: float, impact_speed: float) -> CoSimulation:
        return shell.tapped(made(pressure, stiffness), impact_speed)

    runs = [at(pressure, 1.0, IMPACT_SPEED).run(shell.until) for pressure in pressures]
    bounds = [
        np.nan if quick and part == 1.0 else bound(at, shell.near, part, shell.until, SENSOR, IMPACT_SPEED)
        for part in (0.5, 1.0)
    ]
    buckling = buckling_pressure(shell.radius, shell.thickness, shell.material)
    ratio = [float(amplitude_ratio(one, SENSOR)) for one in runs]
    flight = [float(time_of_flight(one, SENSOR)) for one in runs]
    return xr.Dataset(
        {
            "pressure": ("case", pressures, {"units": "Pa"}),
            "relative_pressure": (
                "case",
                pressures / buckling,
                {"units": "1", "long_name": "pressure over buckling's"},
            ),
            "amplitude_ratio": ("case", ratio, {"units": "1"}),
            "time_of_flight": ("case", flight, {"units": "s"}),
            "buckling_pressure": ((), buckling, {"units": "Pa"}),
            "deviation": ((), bounds[0], {"units": "Pa", "long_name": "least standard deviation"}),
            "deviation_by_twice_the_step": ((), bounds[1], {"units": "Pa"}),
        }
    )


def bound(
    at: Callable[[float, float, float], CoSimulation], near: float, part: float, until: float, sensor: int, speed: float
) -> float:  # fmt: skip
    """The Cramér–Rao bound of a level, in its unit, from one trace. near: its value; part: of the step by which
    `identifiability` changes it; at: the tap for a level, a factor of the stiffness and an impact speed, m/s.
    """

    def build(level: float, stiffness: float, impact_speed: float) -> CoSimulation:
        return at(near * (1.0 + part * (level - 1.0)), stiffness, impact_speed)

    with collected():  # that elastic contacts are beyond yield, or wide, is said elsewhere
        known = identifiability(
            build, NOISE, sensors=[sensor], until=until, level=1.0, stiffness=1.0, impact_speed=speed
        )
    return float(known.bounds["level"] * near * part)


def table(data: xr.Dataset) -> list[Row]:
    """The thesis does not name shells under pressure."""
    rows = []
    for one in SHELLS:
        found = data.sel(shell=one.name)
        pressure, ratio = 1e-3 * found.pressure.values, found.amplitude_ratio.values
        flight, share = 1e6 * found.time_of_flight.values, found.relative_pressure.values
        sigma, other = 1e-3 * float(found.deviation), 1e-3 * float(found.deviation_by_twice_the_step)
        share_of_it = 100.0 * float(found.deviation / found.buckling_pressure)
        check = "" if np.isnan(other) else f"; {other:.2g} by twice the step"
        rows += [
            Row(f"AR, {one.name}", "", f"{ratio[0]:.3f} to {ratio[-1]:.3f}", "",
                f"from {pressure[0]:.0f} to {pressure[-1]:.0f} kPa, or to {share[-1]:.2g} of the pressure outside that "
                "would buckle it"),
            Row(f"TOF, {one.name}", "", f"{flight[0]:.1f} to {flight[-1]:.1f}", "µs",
                f"over the same pressures; {100.0 * (flight[-1] / flight[0] - 1.0):+.2g} %"),
            Row(f"least 1 σ of the pressure, {one.name}", "", f"{sigma:.2g}", "kPa",
                f"of one trace at bead {SENSOR} with {100 * NOISE:.0f} % of noise, at {1e-3 * one.near:.0f} kPa, where "
                f"modulus, impact speed, gain and time zero are not known either{check}. {share_of_it:.2g} % of the "
                "buckling pressure. A bound of a perfect model, not of a test"),
        ]  # fmt: skip
    return rows


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """AR and TOF over the pressure, in units of that which buckles the shell from outside."""
    figure, axes = draw.panels(2, width=3.7, height=3.4, sharey=False)
    read: tuple[Callable[[Any], Any], ...] = (
        lambda found: found.amplitude_ratio - found.amplitude_ratio[0],
        lambda found: 100.0 * (found.time_of_flight / found.time_of_flight[0] - 1.0),
    )
    for one in SHELLS:
        found = data.sel(shell=one.name)
        words = f"{one.name}, {1e3 * one.radius:.0f} × {1e3 * one.thickness:g} mm"
        for axis, change in zip(axes, read, strict=True):
            axis.plot(found.relative_pressure, change(found), label=words)
    for axis, name in zip(axes, ("AR − AR without pressure", "change of TOF (%)"), strict=True):
        axis.set(xlabel="pressure / buckling pressure", ylabel=name)
    axes[1].legend(loc="lower left")
    return {"pressure": figure}
