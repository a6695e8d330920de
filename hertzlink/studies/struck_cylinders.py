"""Common parts of the studies of section 6.1: the chain, the cylinders that it strikes, and the kept part of a run."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np
import xarray as xr

import hertzlink as hl
from coupling.inference.prediction import high_passed
from hertzlink.studies import draw
from hertzlink.studies.expected import Rows
from hertzlink.studies.striking import BEADS, DASHPOTS, Striking
from hertzlink.studies.striking import SENSOR as SENSOR
from hertzlink.studies.table import Row
from structures.structure import Vector

row = Rows("struck_cylinders")
THESIS = Striking()  # The thesis's chain.
# AR and TOF are read at bead 7; at 16, four beads from the cylinder, incident and reflected wave overlap.
SENSORS = (SENSOR, 16)
WAVES = ("primary", "secondary")
DASHPOT = THESIS.middle  # N s/m; the tables show the other two of DASHPOTS as well.


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return the part of a run that the studies keep: AR and TOF at bead 7, and the motion of the last bead."""
    waves = hl.reflections(run, SENSOR)
    incident, returned = waves.incident, (waves.primary, waves.secondary)
    largest = run.displacement.sel(bead=BEADS).max().reset_coords(drop=True)
    ratios = [wave.amplitude_ratio if wave else np.nan for wave in returned]
    flights = [wave.time_of_flight if wave else np.nan for wave in returned]
    return xr.Dataset(
        {
            "amplitude_ratio": ("wave", ratios, {"units": "1", "long_name": "amplitude ratio"}),
            "time_of_flight": ("wave", flights, {"units": "s", "long_name": "time of flight"}),
            "largest_displacement": largest.assign_attrs(units="m", long_name="largest displacement of the last bead"),
            "contact_time": ((), hl.contact_time(run), {"units": "s", "long_name": "last bead's contact with the rod"}),
            "incident_arrival": ((), incident.arrival if incident else np.nan, {"units": "s"}),
        },
        coords={"wave": list(WAVES)},
    )


def high_pass(run: xr.Dataset, time_constant: float) -> xr.Dataset:
    """Return the signal of sensor 7 if the piezoelectric disc loses its charge with a time constant RC, s."""
    step = float(run.time[1] - run.time[0])  # those of a run are equal
    return hl.as_signal(
        run.time.values, {SENSOR: high_passed(hl.sensor_force(run, SENSOR).values, step, time_constant)}
    )


def with_forces(run: xr.Dataset) -> xr.Dataset:
    """Return AR and TOF, and the force at both sensors over time."""
    force = xr.concat([hl.sensor_force(run, sensor) for sensor in SENSORS], "sensor")
    measures = measure(run)[["amplitude_ratio", "time_of_flight"]].assign_coords(sensor=list(SENSORS))
    return measures.assign(
        sensor_force=force.assign_attrs(units="N", long_name="force at the sensor, above the preload")
    )


def over_lengths(
    layers: Callable[[float], list[hl.Layer]],
    lengths: Iterable[float],
    solid_lengths: Iterable[float],
    jobs: int | None,
    of: Striking = THESIS,
) -> xr.Dataset:
    """Return AR and TOF over a length (m): rods for all dashpots, axisymmetric cylinders (solid_…) for the middle one.

    The force at the sensors is that of the rods, for the middle dashpot.
    """

    of.check_meshes()

    def against_rod(length: float, dashpot: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(dashpot), of.slender(layers(length)))

    def against_cylinder(solid_length: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(), of.solid(layers(solid_length)))

    data = hl.sweep(against_rod, of.until, jobs, with_forces, length=lengths, dashpot=of.dashpot)
    solids = hl.sweep(against_cylinder, of.until, jobs, measure, solid_length=solid_lengths)
    data["sensor_force"] = data.sensor_force.sel(dashpot=of.middle, drop=True)
    for name in ("amplitude_ratio", "time_of_flight"):
        data[f"solid_{name}"] = solids[name]
    if not of.own:
        ends = [float(data.length[place]) for place in (0, -1)]
        free = hl.sweep(lambda end: against_rod(end, 0.0), of.until, 1, measure, end=ends)
        data["undamped_time_of_flight"] = free.time_of_flight
    for name, units in (("length", "m"), ("solid_length", "m"), ("dashpot", "N s/m")):
        data[name].attrs["units"] = units
    return data


def ratio(values: xr.DataArray, wave: str = "primary") -> float:
    """Return AR of one run; zero if the wave does not return."""
    return float(values.sel(wave=wave).fillna(0.0))


def flight(values: xr.DataArray, wave: str = "primary") -> float:
    """Return TOF of one run, µs."""
    return float(values.sel(wave=wave)) * 1e6


def lost(values: xr.DataArray) -> float:
    """Return the difference between the largest and the smallest value, in percent of the largest."""
    return 100.0 * float(1.0 - values.min() / values.max())


def middle(data: xr.Dataset) -> float:
    """Return the dashpot that counts, N s/m."""
    return float(data.dashpot[data.sizes["dashpot"] // 2])


def beyond_rod(data: xr.Dataset, name: str, wave: str = "primary") -> xr.DataArray:
    """Return AR or TOF of the cylinders minus that of rods of the same length."""
    rods = data[name].sel(wave=wave, dashpot=middle(data)).dropna("length").interp(length=data.solid_length)
    return data[f"solid_{name}"].sel(wave=wave) - rods


def interval(values: xr.DataArray, factor: float = 1.0) -> str:
    """Return the smallest and the largest value."""
    low, high = (f"{float(value) * factor:.3g}" for value in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"


def sensitivity(values: xr.DataArray, factor: float = 1.0) -> str:
    """Return the results with the other dashpots."""
    low, high = values.sel(dashpot=[DASHPOTS[0], DASHPOTS[-1]]).fillna(0.0).values * factor
    return f"γ is not given; {low:.3g} and {high:.3g} for γ = 4 and 6 N s/m"


def over_dashpots(values: xr.DataArray, factor: float = 1.0) -> dict[str, str]:
    """Return the range of the results over the dashpots, by the name of this condition."""
    low, high = float(values.fillna(0.0).min()) * factor, float(values.fillna(0.0).max()) * factor
    return {f"γ between {DASHPOTS[0]:g} and {DASHPOTS[-1]:g} N s/m, which is not given": f"{low:.5g} to {high:.5g}"}


def undamped(data: xr.Dataset) -> dict[str, str]:
    """Return TOF of the primary wave without losses, µs, for the shortest and the longest one, by its condition."""
    flights = data.undamped_time_of_flight.sel(wave="primary")
    return {"no losses": interval(flights, 1e6)}


def chosen(lengths: Sequence[float], most: int = 9) -> tuple[float, ...]:
    """Return at most so many of the lengths, evenly among them, with the first and the last one."""
    places = np.unique(np.linspace(0, len(lengths) - 1, min(most, len(lengths))).round().astype(int))
    return tuple(lengths[i] for i in places)


def own_rows(
    data: xr.Dataset, what: str, theory: Callable[[float], tuple[float, float | str, str]], secondary: bool = False
) -> list[Row]:
    """Return AR and TOF over the length, m, of a user's own chain and cylinder.

    theory: TOF, s, AR or nothing, and the equations, for a length. secondary: whether its delay is a row too.
    """
    rows, gamma = [], middle(data)
    for length in data.solid_length.values:
        rods, solids = data.sel(length=length, method="nearest"), data.sel(solid_length=length)
        at, label = rods.sel(dashpot=gamma), f"{what} {length * 1e3:.4g} mm"
        tof, expected, source = theory(float(length))
        waves = (("AR", "amplitude_ratio", 1.0, expected), ("TOF", "time_of_flight", 1e6, tof * 1e6))
        for name, variable, factor, predicted in waves:
            wide = factor * float(solids[f"solid_{variable}"].sel(wave="primary"))
            said = (
                f"theory: {source}; " if predicted != "" else "",
                wide,
                band(rods[variable].sel(wave="primary"), factor),
            )
            value = known(factor * float(at[variable].sel(wave="primary")))
            rows.append(row(name, value, *said, theory=predicted, cylinder=label))
        later = delay_of(at.time_of_flight)
        seen = f"{later:.4g} µs after the primary one" if np.isfinite(later) else "none is seen"
        if secondary or np.isfinite(later):
            rows.append(row("AR, secondary", ratio(at.amplitude_ratio, "secondary"), seen, cylinder=label))
    return rows


def delay_of(flights: xr.DataArray) -> float:
    """Return the secondary wave's delay after the primary one, µs; NaN without one."""
    return flight(flights, "secondary") - flight(flights)


def known(value: float) -> float | str:
    """Return a number, or words where no wave was seen."""
    return value if np.isfinite(value) else "no wave"


def band(values: xr.DataArray, factor: float = 1.0) -> str:
    """Return the results with the least and the greatest dashpot, if there are several."""
    if values.sizes["dashpot"] == 1:
        return ""
    ends = values.isel(dashpot=[0, -1])
    low, high = ends.fillna(0.0).values * factor
    least, most = ends.dashpot.values
    return f"; {low:.4g} and {high:.4g} for γ = {least:g} and {most:g} N s/m"


def against_length(axis: draw.Axes, data: xr.Dataset, name: str, wave: str, label: str, xlabel: str) -> None:
    """Draw AR or TOF of one wave over a length (mm): rods, their band between the outer dashpots, and cylinders."""
    factor = 1e6 if name == "time_of_flight" else 1.0
    values, solids = data[name].sel(wave=wave) * factor, data[f"solid_{name}"].sel(wave=wave) * factor
    draw.banded(axis, data.length.values * 1e3, values, middle(data), "rod, 1-D")
    draw.points(axis, data.solid_length.values * 1e3, solids.values, 1, "cylinder, axisymmetric")
    axis.set(xlabel=xlabel, ylabel=label)
    draw.log_x(axis)


def layers_figures(
    data: xr.Dataset, xlabel: str, theory: Callable[[draw.Axes, str, str, Vector], None]
) -> dict[str, draw.Figure]:
    """Return AR and TOF of both waves over the thickness of a layer, and the force-intensity map.

    theory: draws the theory lines; its arguments are axis, measure, wave, thicknesses in m.
    """
    figures_by_name, lengths = {}, np.geomspace(float(data.length.min()), float(data.length.max()), 200)
    for name, label in (("time_of_flight", "TOF (µs)"), ("amplitude_ratio", "AR")):
        figure, axes = draw.panels(2, width=3.9, height=3.4, sharey=False)
        for axis, wave in zip(axes, WAVES, strict=True):
            against_length(axis, data, name, wave, f"{label}, {wave} wave", xlabel)
            theory(axis, name, wave, lengths)
            if name == "amplitude_ratio":
                axis.set_ylim(bottom=0.0)
            axis.legend()
        figures_by_name[name] = figure
    force = data.sensor_force.sel(sensor=SENSOR).transpose("length", "time")
    figures_by_name["force_intensity"] = draw.intensity_map(
        data.time.values, data.length.values, force.values, xlabel, 1e3
    )
    return figures_by_name
