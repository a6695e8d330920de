"""Common parts of the studies of section 6.1: the chain, the cylinders that it strikes, and the kept part of a run."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from scipy.signal import bilinear, lfilter

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import reflections
from coupling.results.measures import contact_time, sensor_force
from coupling.results.signals import as_signal
from coupling.sweeps.sweep import sweep
from particles.bead import STANDARD_GRAVITY, Sphere, drop_speed
from particles.chain import Chain
from particles.dissipation import LinearDashpot
from structures.cylinder import layered_cylinder
from structures.layers import time_of_flight as primary_time_of_flight
from structures.material import STEEL_440C
from structures.reduction import reduce
from structures.rod import Layer, rod
from structures.structure import Structure, Vector
from structures.surface import Surface, hertz_stiffness

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BEAD = Sphere(4.76e-3, STEEL_440C)
BEADS, SENSOR = 20, 7
SENSORS = (SENSOR, 16)
"""AR and TOF are read at bead 7; at 16, four beads from the cylinder, incident and reflected wave overlap."""

DROP_HEIGHT = 0.01
UNTIL = 1.5e-3

WAVES = ("primary", "secondary")

DASHPOT = 5.0
"""N s/m, at every contact; the thesis does not give its coefficient."""

DASHPOTS = (4.0, DASHPOT, 6.0)
"""N s/m; the tables show the outer two as well."""


def chain(dashpot: float = DASHPOT) -> Chain:
    """The thesis's vertical chain of 20 spheres, struck from 1 cm."""
    return Chain([BEAD] * BEADS, BEAD, drop_speed(DROP_HEIGHT), STANDARD_GRAVITY, LinearDashpot(dashpot))


def slender(layers: Sequence[Layer]) -> Structure:
    """The rod of these layers on a fixed base, in the one-dimensional theory; its reduction does not change
    AR and TOF.
    """
    return reduce(rod(layers), UNTIL)


def solid(layers: Sequence[Layer]) -> Structure:
    """The axisymmetric cylinder of these layers on a fixed base, reduced."""
    return reduce(layered_cylinder(layers), UNTIL)


def measure(run: xr.Dataset) -> xr.Dataset:
    """The part of a run that the studies keep: AR and TOF at bead 7, and the motion of the last bead."""
    waves = reflections(run, SENSOR)
    incident, returned = waves.incident, (waves.primary, waves.secondary)
    largest = run.displacement.sel(bead=BEADS).max().reset_coords(drop=True)
    ratios = [wave.amplitude_ratio if wave else np.nan for wave in returned]
    flights = [wave.time_of_flight if wave else np.nan for wave in returned]
    return xr.Dataset(
        {
            "amplitude_ratio": ("wave", ratios, {"units": "1", "long_name": "amplitude ratio"}),
            "time_of_flight": ("wave", flights, {"units": "s", "long_name": "time of flight"}),
            "largest_displacement": largest.assign_attrs(units="m", long_name="largest displacement of the last bead"),
            "contact_time": ((), contact_time(run), {"units": "s", "long_name": "last bead's contact with the rod"}),
            "incident_arrival": ((), incident.arrival if incident else np.nan, {"units": "s"}),
        },
        coords={"wave": list(WAVES)},
    )


def high_pass(run: xr.Dataset, time_constant: float) -> xr.Dataset:
    """The signal of sensor 7 if the piezoelectric disc loses its charge with a time constant RC, s.

    A first-order high-pass filter, ẏ + y/RC = ḟ, by the bilinear transform; the saved times of a run are equidistant.
    """
    force = sensor_force(run, SENSOR)
    step = float(run.time[1] - run.time[0])
    seen = lfilter(*bilinear([time_constant, 0.0], [time_constant, 1.0], 1.0 / step), force.values)
    return as_signal(run.time.values, {SENSOR: seen})


def with_forces(run: xr.Dataset) -> xr.Dataset:
    """AR and TOF, and the force at both sensors over time."""
    force = xr.concat([sensor_force(run, sensor) for sensor in SENSORS], "sensor")
    found = measure(run)[["amplitude_ratio", "time_of_flight"]].assign_coords(sensor=list(SENSORS))
    return found.assign(sensor_force=force.assign_attrs(units="N", long_name="force at the sensor, above the preload"))


def over_lengths(
    layers: Callable[[float], list[Layer]], lengths: Iterable[float], solid_lengths: Iterable[float], jobs: int | None
) -> xr.Dataset:
    """AR and TOF over a length (m): rods for all dashpots, axisymmetric cylinders (solid_…) for the middle one.

    The force at the sensors is that of the rods, for the middle dashpot.
    """

    def against_rod(length: float, dashpot: float) -> CoSimulation:
        return CoSimulation(chain(dashpot), slender(layers(length)))

    def against_cylinder(solid_length: float) -> CoSimulation:
        return CoSimulation(chain(), solid(layers(solid_length)))

    data = sweep(against_rod, UNTIL, jobs, with_forces, length=lengths, dashpot=DASHPOTS)
    solids = sweep(against_cylinder, UNTIL, jobs, measure, solid_length=solid_lengths)
    data["sensor_force"] = data.sensor_force.sel(dashpot=DASHPOT, drop=True)
    for name in ("amplitude_ratio", "time_of_flight"):
        data[f"solid_{name}"] = solids[name]
    for name, units in (("length", "m"), ("solid_length", "m"), ("dashpot", "N s/m")):
        data[name].attrs["units"] = units
    return data


def theory_time_of_flight(wall_stiffness: Vector | float, restitution: Vector | float = 1.0) -> Vector:
    """TOF, s, of the primary wave by equation 6.18, with the 13 beads between sensor 7 and the structure."""
    bead_to_bead, speed = hertz_stiffness(BEAD.surface, BEAD.surface), drop_speed(DROP_HEIGHT)
    return np.asarray(
        primary_time_of_flight(BEADS - SENSOR, BEAD.mass, bead_to_bead, wall_stiffness, speed, restitution)
    )


STEEL_WALL = hertz_stiffness(BEAD.surface, Surface(STEEL_440C))


def ratio(values: xr.DataArray, wave: str = "primary") -> float:
    """AR of one run; zero if the wave does not return."""
    return float(values.sel(wave=wave).fillna(0.0))


def flight(values: xr.DataArray, wave: str = "primary") -> float:
    """TOF of one run, µs."""
    return float(values.sel(wave=wave)) * 1e6


def lost(values: xr.DataArray) -> float:
    """Difference between the largest and the smallest value, in percent of the largest."""
    return 100.0 * float(1.0 - values.min() / values.max())


def beyond_rod(data: xr.Dataset, name: str, wave: str = "primary") -> xr.DataArray:
    """AR or TOF of the cylinders minus that of rods of the same length."""
    rods = data[name].sel(wave=wave, dashpot=DASHPOT).dropna("length").interp(length=data.solid_length)
    return data[f"solid_{name}"].sel(wave=wave) - rods


def interval(values: xr.DataArray, factor: float = 1.0) -> str:
    """The smallest and the largest value."""
    low, high = (f"{float(value) * factor:.3g}" for value in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"


def sensitivity(values: xr.DataArray, factor: float = 1.0) -> str:
    """The results with the other dashpots."""
    low, high = values.sel(dashpot=[DASHPOTS[0], DASHPOTS[-1]]).fillna(0.0).values * factor
    return f"γ is not given; {low:.3g} and {high:.3g} for γ = 4 and 6 N s/m"


def against_length(axis: "Axes", data: xr.Dataset, name: str, wave: str, label: str, xlabel: str) -> None:
    """AR or TOF of one wave over a length (mm): rods, their band between the outer dashpots, and cylinders."""
    from coupling.views import plots

    factor = 1e6 if name == "time_of_flight" else 1.0
    values, solids = data[name].sel(wave=wave) * factor, data[f"solid_{name}"].sel(wave=wave) * factor
    plots.banded(axis, data.length.values * 1e3, values, DASHPOT, "rod, 1-D")
    plots.points(axis, data.solid_length.values * 1e3, solids.values, 1, "cylinder, axisymmetric")
    axis.set(xlabel=xlabel, ylabel=label)
    plots.log_x(axis)


def layers_figures(
    data: xr.Dataset, xlabel: str, theory: Callable[["Axes", str, str, Vector], None]
) -> dict[str, "Figure"]:
    """AR and TOF of both waves over the thickness of a layer, and the force-intensity map.

    theory: draws the theory lines; its arguments are axis, measure, wave, thicknesses in m.
    """
    from coupling.views import plots

    found, lengths = {}, np.geomspace(float(data.length.min()), float(data.length.max()), 200)
    for name, label in (("time_of_flight", "TOF (µs)"), ("amplitude_ratio", "AR")):
        figure, axes = plots.panels(2, width=3.9, height=3.4, sharey=False)
        for axis, wave in zip(axes, WAVES, strict=True):
            against_length(axis, data, name, wave, f"{label}, {wave} wave", xlabel)
            theory(axis, name, wave, lengths)
            if name == "amplitude_ratio":
                axis.set_ylim(bottom=0.0)
            axis.legend(frameon=False, fontsize="small")
        found[name] = figure
    force = data.sensor_force.sel(sensor=SENSOR).transpose("length", "time")
    found["force_intensity"] = plots.intensity_map(data.time.values, data.length.values, force.values, xlabel, 1e3)
    return found
