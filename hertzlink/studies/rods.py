"""What the studies of section 6.1 share: what a run gives, sweeps over a length, and their figures."""

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, shared
from hertzlink.studies.compare import Case

SENSORS = (shared.SENSOR, 16)  # At 16 incident and reflected wave overlap.
WAVES = ("primary", "secondary")
RATIO, FLIGHT = "amplitude_ratio", "time_of_flight"
OPEN = f"γ from {shared.DASHPOTS[0]:g} to {shared.DASHPOTS[-1]:g} N s/m, which is not given"


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return AR and TOF at bead 7, and the motion of the last bead."""
    back = [shared.returned(run, wave) for wave in WAVES]
    incident, moved = hl.reflections(run, shared.SENSOR).incident, run.displacement.sel(bead=shared.BEADS).max()
    data: xr.Dataset = xr.concat(back, "wave").assign_coords(wave=list(WAVES))
    return data.merge(
        shared.scalars(
            largest_displacement=(moved, "m", "largest displacement of the last bead"),
            contact_time=(hl.contact_time(run), "s", "last bead's contact with the rod"),
            incident_arrival=(incident.arrival if incident else np.nan, "s", "arrival of the incident wave"),
        )
    )


def with_forces(run: xr.Dataset) -> xr.Dataset:
    return measure(run)[[RATIO, FLIGHT]].assign(sensor_force=shared.sensor_forces(run, SENSORS))


def over_lengths(
    stack: Callable[[float], list[hl.Layer]], lengths: Sequence[float], solid_lengths: Sequence[float],
    jobs: int | None,
) -> xr.Dataset:  # fmt: skip
    """Return AR and TOF over a length, m: rods for all dashpots, axisymmetric cylinders (solid_…) for the middle one.

    The force at the sensors is that of the middle dashpot.
    """

    def against_rod(length: float, dashpot: float) -> hl.CoSimulation:
        return hl.CoSimulation(shared.chain(dashpot), shared.rod(stack(length)))

    def against_cylinder(solid_length: float) -> hl.CoSimulation:
        return hl.CoSimulation(shared.chain(), shared.cylinder(stack(solid_length)))

    data = hl.sweep(against_rod, shared.RECORD, jobs, with_forces, length=lengths, dashpot=shared.DASHPOTS)
    data["sensor_force"] = data.sensor_force.sel(dashpot=shared.DASHPOT, drop=True)
    solids = hl.sweep(against_cylinder, shared.RECORD, jobs, measure, solid_length=solid_lengths)
    data = data.assign(shared.named(solids[[RATIO, FLIGHT]], "solid").data_vars)
    return shared.with_units(data, length="m", solid_length="m", dashpot="N s/m")


def over_dashpots(values: xr.DataArray, factor: float = 1.0) -> dict[str, Case]:
    """Return the number of the middle dashpot, and the range of all; a missing wave counts as zero."""
    filled = values.fillna(0.0) * factor
    return {"": float(filled.sel(dashpot=shared.DASHPOT)), OPEN: ends(filled)}


def ends(values: xr.DataArray, factor: float = 1.0) -> tuple[float, float]:
    return float(values.min()) * factor, float(values.max()) * factor


def lost(values: xr.DataArray) -> float:
    """Return the difference between the largest and the smallest value, in percent of the largest."""
    return 100.0 * float(1.0 - values.min() / values.max())


def beyond_rod(data: xr.Dataset, name: str, wave: str = "primary") -> xr.DataArray:
    """Return AR or TOF of the cylinders minus that of rods of the same length."""
    middle = data[name].sel(wave=wave, dashpot=shared.DASHPOT)
    return data[f"solid_{name}"].sel(wave=wave) - middle.dropna("length").interp(length=data.solid_length)


def against_length(axis: draw.Axes, data: xr.Dataset, name: str, wave: str, label: str, xlabel: str) -> None:
    """Draw AR or TOF of one wave over a length: rods, their band between the outer dashpots, and cylinders."""
    factor = 1e6 if name == FLIGHT else 1.0
    values, length = data[name].sel(wave=wave) * factor, data.length.values * 1e3
    band = f"γ = {shared.DASHPOTS[0]:g} to {shared.DASHPOTS[-1]:g} N s/m"
    low, high = values.min("dashpot"), values.max("dashpot")
    axis.fill_between(length, low, high, color=draw.COLOURS[0], alpha=0.15, linewidth=0.0, label=band)
    axis.plot(length, values.sel(dashpot=shared.DASHPOT), "-", color=draw.COLOURS[0], label="rod, 1-D")
    solids = data[f"solid_{name}"].sel(wave=wave) * factor
    draw.points(axis, data.solid_length.values * 1e3, solids.values, 1, "cylinder, axisymmetric")
    axis.set(xlabel=xlabel, ylabel=label)
    draw.logarithmic(axis, "x")


def force_map(data: xr.Dataset, label: str) -> draw.Figure:
    return draw.intensity_map(data.sensor_force.sel(sensor=shared.SENSOR), "length", label, 1e3)
