"""What several studies share: the chains, rods and plates of the thesis, their theories, and waves over a length."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.compare import Case
from structures.structure import Vector

BEADS, SENSOR = 20, 7  # Of the chains of chapter 6. AR and TOF are read at bead 7.

# Section 6.1: a striker that falls from 10 mm, dashpots at every contact, cylinders on a fixed base.
BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
SPEED = hl.drop_speed(0.01)
DASHPOTS = (4.0, 5.0, 6.0)  # N s/m; the thesis does not give its coefficient.
DASHPOT = DASHPOTS[1]
RECORD = 1.5e-3  # s.
WAVES = ("primary", "secondary")
RATIO, FLIGHT = "amplitude_ratio", "time_of_flight"
OPEN = f"γ from {DASHPOTS[0]:g} to {DASHPOTS[-1]:g} N s/m, which is not given"

# Section 6.2: square aluminium plates, clamped at two opposite edges.
SIDE, PLATE_SPEED, ALUMINIUM = 0.914, 0.31, hl.ALUMINIUM_6061
THICKNESSES = (2.29e-3, 3.18e-3, 4.83e-3)
DIAMETERS = (4.76e-3, 9.53e-3, 19.05e-3)
# Hz, resolved by meshes. Where AR above 0.03 was sampled, it is within 0.3 % of AR on a mesh for 100 kHz.
HIGHEST_FREQUENCY = 30.0e3
# The bead, and speeds in m/s, that reproduce the printed numbers of section 6.2.1, which does not state them: that of
# the bead belongs to the printed λ (equation 6.37), that of the striker to the printed T_c (6.38).
THEIR_STEEL = hl.Material(200.0e9, 0.28, 8000.0, "steel 440C as heavy as 316")
THEIR_BEAD_SPEED, THEIR_STRIKER_SPEED = 0.682 * 0.63, 0.31


def chain(dashpot: float = DASHPOT) -> hl.Chain:
    """Return the vertical chain of section 6.1, with a dashpot, N s/m."""
    return hl.Chain([BEAD] * BEADS, BEAD, SPEED, gravity=9.81, dissipation=hl.LinearDashpot(dashpot))


def rod(layers: Sequence[hl.Layer]) -> hl.Structure:
    """Return the rod of these layers on a fixed base; its reduction does not change AR and TOF."""
    return hl.reduce(hl.rod(layers), RECORD)


def cylinder(layers: Sequence[hl.Layer]) -> hl.Structure:
    return hl.reduce(hl.layered_cylinder(layers), RECORD)


def sphere(diameter: float) -> hl.Sphere:
    return hl.Sphere(diameter / 2.0, hl.STEEL_440C)


def plate_chain(diameter: float) -> hl.Chain:
    return hl.Chain([sphere(diameter)] * BEADS, sphere(diameter), PLATE_SPEED)


def plate(thickness: float, **options: Any) -> hl.Plate:
    """Return the square plate of section 6.2, clamped at two opposite edges."""
    return hl.kirchhoff_plate(SIDE, SIDE, thickness, ALUMINIUM, hl.Supports("clamped", "clamped"), **options)


def of_mass(bead: Any, mass: float) -> Any:
    """Return the bead of a material that gives it this mass, kg."""
    material = replace(bead.material, density=bead.material.density * mass / bead.mass, name="")
    return replace(bead, material=material)


def long_waves(bead: hl.Bead, stiffness: float | None = None, exponent: float = 1.5) -> hl.theory.UniformChain:
    """Return the theory of long waves in a chain of these beads, by Hertz's law unless its k, N/mⁿ, and n are given."""
    if stiffness is None:
        stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    return hl.theory.UniformChain(bead.size, bead.mass, stiffness, exponent)


def wall_stiffness(bead: hl.Bead, wall: hl.Material) -> float:
    return hl.theory.hertz_stiffness(bead.surface, hl.Surface(wall))


def contact_time(bead: hl.Bead, wall: hl.Material, speed: float) -> float:
    """Return T_c, s, of a bead that hits a half-space at this speed, m/s (equation 6.8)."""
    return float(hl.theory.hertz_contact_time(bead.mass, wall_stiffness(bead, wall), speed))


def time_of_flight(wall: Vector | float, restitution: Vector | float = 1.0) -> Vector:
    """Return TOF, s, of the primary wave by equation 6.18, over the 13 beads between sensor 7 and the structure.

    wall: stiffness of the contact with the structure, N/m^1.5.
    """
    pair = long_waves(BEAD).stiffness
    return np.asarray(hl.theory.primary_time_of_flight(BEADS - SENSOR, BEAD.mass, pair, wall, SPEED, restitution))


def along(name: str, values: Iterable[Any], compute: Callable[[Any], xr.Dataset]) -> xr.Dataset:
    """Return what is computed for each value, along a dimension of this name."""
    places = list(values)
    found: xr.Dataset = xr.concat([compute(value) for value in places], name, join="outer")
    return found.assign_coords({name: places})


def scalars(**values: tuple[float | xr.DataArray, str, str]) -> xr.Dataset:
    """Return single numbers as variables: value, unit and long name of each."""
    return xr.Dataset(
        {name: ((), float(value), {"units": unit, "long_name": words}) for name, (value, unit, words) in values.items()}
    )


def named(data: xr.Dataset, prefix: str) -> xr.Dataset:
    return data.rename({name: f"{prefix}_{name}" for name in data.data_vars})


def with_units(data: xr.Dataset, **units: str) -> xr.Dataset:
    for name, unit in units.items():
        data[name].attrs["units"] = unit
    return data


def returned(run: xr.Dataset, wave: str = "primary") -> xr.Dataset:
    """Return AR and TOF of a wave at bead 7."""
    return xr.Dataset({RATIO: hl.amplitude_ratio(run, SENSOR, wave), FLIGHT: hl.time_of_flight(run, SENSOR, wave)})


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return AR and TOF of both waves at bead 7."""
    return along("wave", WAVES, lambda wave: returned(run, wave))


def over_lengths(
    stack: Callable[[float], list[hl.Layer]], lengths: Sequence[float], solid_lengths: Sequence[float],
    jobs: int | None,
) -> xr.Dataset:  # fmt: skip
    """Return AR and TOF over a length, m: rods for all dashpots, axisymmetric cylinders (solid_…) for the middle."""
    rods = hl.sweep(
        lambda length, dashpot: hl.CoSimulation(chain(dashpot), rod(stack(length))),
        RECORD, jobs, measure, length=lengths, dashpot=DASHPOTS,
    )  # fmt: skip
    solids = hl.sweep(
        lambda solid_length: hl.CoSimulation(chain(), cylinder(stack(solid_length))),
        RECORD, jobs, measure, solid_length=solid_lengths,
    )  # fmt: skip
    data = rods.assign(named(solids, "solid").data_vars)
    return with_units(data, length="m", solid_length="m", dashpot="N s/m")


def over_dashpots(values: xr.DataArray, factor: float = 1.0) -> dict[str, Case]:
    """Return the number of the middle dashpot, and the range of all; a missing wave counts as zero."""
    filled = values.fillna(0.0) * factor
    return {"": float(filled.sel(dashpot=DASHPOT)), OPEN: ends(filled)}


def ends(values: xr.DataArray) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def lost(values: xr.DataArray) -> float:
    """Return the difference between the largest and the smallest value, in percent of the largest."""
    return 100.0 * float(1.0 - values.min() / values.max())


def against_length(axis: draw.Axes, data: xr.Dataset, name: str, wave: str, label: str, xlabel: str) -> None:
    """Draw AR or TOF of one wave over a length: rods, their band between the outer dashpots, and cylinders."""
    factor = 1e6 if name == FLIGHT else 1.0
    values, length = data[name].sel(wave=wave) * factor, data.length.values * 1e3
    band = f"γ = {DASHPOTS[0]:g} to {DASHPOTS[-1]:g} N s/m"
    low, high = values.min("dashpot"), values.max("dashpot")
    axis.fill_between(length, low, high, color=draw.COLOURS[0], alpha=0.15, linewidth=0.0, label=band)
    axis.plot(length, values.sel(dashpot=DASHPOT), "-", color=draw.COLOURS[0], label="rod, 1-D")
    solids = data[f"solid_{name}"].sel(wave=wave) * factor
    draw.points(axis, data.solid_length.values * 1e3, solids.values, 1, "cylinder, axisymmetric")
    axis.set(xlabel=xlabel, ylabel=label)
    draw.logarithmic(axis, "x")
