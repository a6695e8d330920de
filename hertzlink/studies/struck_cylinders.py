"""The studies of section 6.1: parameters of the vertical chain, the cylinders that it strikes, and what a run gives."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

import hertzlink as hl
from coupling.inference.prediction import high_passed
from hertzlink.studies import draw, waves
from hertzlink.studies.results import named, with_units
from hertzlink.studies.verdicts import NOT_GIVEN
from particles.bead import STANDARD_GRAVITY
from structures.structure import Vector

BEADS, SENSOR = 20, 7
SENSORS = (SENSOR, 16)  # AR and TOF are read at bead 7; at 16 incident and reflected wave overlap.
WAVES = ("primary", "secondary")
UNTIL = 1.5e-3  # Length of the thesis's records, s.
DROP_HEIGHT = 0.01
DASHPOTS = (4.0, 5.0, 6.0)  # N s/m, at every contact; the thesis does not give its coefficient.
DASHPOT = DASHPOTS[1]


@dataclass(frozen=True)
class Striking:
    """The chain of 20 beads, and the cylinders that it strikes."""

    bead_material: hl.Material = hl.STEEL_440C

    @property
    def sphere(self) -> hl.Sphere:
        """A bead."""
        return hl.Sphere(4.76e-3, self.bead_material)

    @property
    def speed(self) -> float:
        """The speed of the striker, m/s."""
        return hl.drop_speed(DROP_HEIGHT)

    def chain(self, dashpot: float = DASHPOT) -> hl.Chain:
        """Return the chain of 20 spheres, with a dashpot, N s/m."""
        return hl.Chain([self.sphere] * BEADS, self.sphere, self.speed, STANDARD_GRAVITY, hl.LinearDashpot(dashpot))

    def wall(self, material: hl.Material) -> float:
        """Return k of a bead on a half-space, N/m^1.5."""
        return waves.wall_stiffness(self.sphere, material)

    def time_of_flight(self, wall: Vector | float, restitution: Vector | float = 1.0) -> Vector:
        """Return TOF, s, of the primary wave by equation 6.18, with the 13 beads between sensor 7 and the structure."""
        pair, mass = waves.long_waves(self.sphere).stiffness, self.sphere.mass
        return np.asarray(hl.theory.primary_time_of_flight(BEADS - SENSOR, mass, pair, wall, self.speed, restitution))

    def contact_time(self, material: hl.Material) -> float:
        """Return the contact time of one bead on a half-space at the striker's speed, s (equation 6.8)."""
        return waves.contact_time(self.sphere, material, self.speed)

    def slender(self, layers: Sequence[hl.Layer]) -> hl.Structure:
        """Return the rod of these layers on a fixed base; its reduction does not change AR and TOF."""
        return hl.reduce(hl.rod(layers), UNTIL)

    def solid(self, layers: Sequence[hl.Layer]) -> hl.Structure:
        """Return the axisymmetric cylinder of these layers on a fixed base, reduced."""
        return hl.reduce(hl.layered_cylinder(layers), UNTIL)


class OverLength(Striking):
    """A study over a length of the cylinder."""

    def stack(self, length: float) -> list[hl.Layer]:
        """Return the cylinder, with this length, m."""
        raise NotImplementedError

    def expected(self, lengths: Vector) -> xr.Dataset:
        """Return what theory says over the lengths, m: at least TOF."""
        raise NotImplementedError


THESIS = Striking()


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return the part of a run that the studies keep: AR and TOF at bead 7, and the motion of the last bead."""
    seen = hl.reflections(run, SENSOR)
    incident, returned = seen.incident, (seen.primary, seen.secondary)
    largest = run.displacement.sel(bead=BEADS).max().reset_coords(drop=True)
    ratios = [wave.amplitude_ratio if wave else np.nan for wave in returned]
    flights = [wave.time_of_flight if wave else np.nan for wave in returned]
    contact = {"units": "s", "long_name": "last bead's contact with the rod"}
    return xr.Dataset(
        {
            "amplitude_ratio": ("wave", ratios, {"units": "1", "long_name": "amplitude ratio"}),
            "time_of_flight": ("wave", flights, {"units": "s", "long_name": "time of flight"}),
            "largest_displacement": largest.assign_attrs(units="m", long_name="largest displacement of the last bead"),
            "contact_time": ((), hl.contact_time(run), contact),
            "incident_arrival": ((), incident.arrival if incident else np.nan, {"units": "s"}),
        },
        coords={"wave": list(WAVES)},
    )


def high_pass(run: xr.Dataset, time_constant: float) -> xr.Dataset:
    """Return the signal of sensor 7 if the piezoelectric disc loses its charge with a time constant RC, s."""
    step = float(run.time[1] - run.time[0])  # those of a run are equal
    filtered = high_passed(hl.sensor_force(run, SENSOR).values, step, time_constant)
    return hl.as_signal(run.time.values, {SENSOR: filtered})


def with_forces(run: xr.Dataset) -> xr.Dataset:
    """Return AR and TOF, and the force at both sensors over time."""
    measures = measure(run)[["amplitude_ratio", "time_of_flight"]]
    return measures.assign(sensor_force=waves.sensor_forces(run, SENSORS))


def over_lengths(
    of: OverLength, quick: bool, jobs: int | None, lengths: Sequence[float], solid_lengths: Sequence[float]
) -> xr.Dataset:
    """Return AR and TOF over a length (m): rods for all dashpots, axisymmetric cylinders (solid_…) for the middle one.

    The force at the sensors is that of the rods, for the middle dashpot.
    """
    jobs = 1 if quick and jobs is None else jobs  # Starting processes takes longer.

    def against_rod(length: float, dashpot: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(dashpot), of.slender(of.stack(length)))

    def against_cylinder(solid_length: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(), of.solid(of.stack(solid_length)))

    data = hl.sweep(against_rod, UNTIL, jobs, with_forces, length=lengths, dashpot=DASHPOTS)
    solids = hl.sweep(against_cylinder, UNTIL, jobs, measure, solid_length=solid_lengths)
    data["sensor_force"] = data.sensor_force.sel(dashpot=DASHPOT, drop=True)
    data = data.assign(named(solids[["amplitude_ratio", "time_of_flight"]], "solid").data_vars)
    ends = data.length.values[[0, -1]].tolist()
    free = hl.sweep(lambda end: against_rod(end, 0.0), UNTIL, 1, measure, end=ends)
    data = data.assign(named(free[["amplitude_ratio", "time_of_flight"]], "undamped").data_vars)
    return with_units(data, length="m", solid_length="m", dashpot="N s/m")


def ratio(values: xr.DataArray, wave: str = "primary") -> float:
    """Return AR of one run; zero if the wave does not return."""
    return float(values.sel(wave=wave).fillna(0.0))


def flight(values: xr.DataArray, wave: str = "primary") -> float:
    """Return TOF of one run, µs."""
    return float(values.sel(wave=wave)) * 1e6


def delay(flights: xr.DataArray) -> float:
    """Return the secondary wave's delay after the primary one, µs; NaN without one."""
    return flight(flights, "secondary") - flight(flights)


def lost(values: xr.DataArray) -> float:
    """Return the difference between the largest and the smallest value, in percent of the largest."""
    return 100.0 * float(1.0 - values.min() / values.max())


def beyond_rod(data: xr.Dataset, name: str, wave: str = "primary") -> xr.DataArray:
    """Return AR or TOF of the cylinders minus that of rods of the same length."""
    middle = data[name].sel(wave=wave, dashpot=DASHPOT)
    return data[f"solid_{name}"].sel(wave=wave) - middle.dropna("length").interp(length=data.solid_length)


def interval(values: xr.DataArray, factor: float = 1.0) -> str:
    """Return the smallest and the largest value."""
    low, high = (f"{float(value) * factor:.3g}" for value in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"


def sensitivity(values: xr.DataArray, factor: float = 1.0) -> str:
    """Return the results with the least and the greatest dashpot."""
    (low, high), (least, most) = values.fillna(0.0).values[[0, -1]] * factor, values.dashpot.values[[0, -1]]
    return f"γ is not given; {low:.3g} and {high:.3g} for γ = {least:g} and {most:g} N s/m"


def over_dashpots(values: xr.DataArray, factor: float = 1.0) -> dict[str, str]:
    """Return the range of the results over the dashpots, by the name of this condition."""
    low, high = float(values.fillna(0.0).min()) * factor, float(values.fillna(0.0).max()) * factor
    return {f"γ between {DASHPOTS[0]:g} and {DASHPOTS[-1]:g} N s/m, {NOT_GIVEN}": f"{low:.5g} to {high:.5g}"}


def undamped(data: xr.Dataset) -> str:
    """Return what the primary wave is without losses, for the shortest and the longest cylinder.

    That is no condition of a TOF, because AR of the same experiment excludes it.
    """
    flights, ratios = (data[f"undamped_{name}"].sel(wave="primary") for name in ("time_of_flight", "amplitude_ratio"))
    return f"without losses {interval(flights, 1e6)}, but then AR is {interval(ratios)}"


def against_length(axis: draw.Axes, data: xr.Dataset, name: str, wave: str, label: str, xlabel: str) -> None:
    """Draw AR or TOF of one wave over a length (mm): rods, their band between the outer dashpots, and cylinders."""
    factor = 1e6 if name == "time_of_flight" else 1.0
    values, solids = data[name].sel(wave=wave) * factor, data[f"solid_{name}"].sel(wave=wave) * factor
    draw.banded(axis, data.length.values * 1e3, values, DASHPOT, "rod, 1-D")
    draw.points(axis, data.solid_length.values * 1e3, solids.values, 1, "cylinder, axisymmetric")
    axis.set(xlabel=xlabel, ylabel=label)
    draw.log_x(axis)


def force_intensity(data: xr.Dataset, xlabel: str) -> draw.Figure:
    """Return the force at bead 7 over time and a length."""
    force = data.sensor_force.sel(sensor=SENSOR).transpose("length", "time").values
    return draw.intensity_map(data.time.values, data.length.values, force, xlabel, 1e3)
