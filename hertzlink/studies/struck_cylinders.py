"""The studies of section 6.1: parameters of the vertical chain, the cylinders that it strikes, and what a run gives."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Annotated, ClassVar

import numpy as np
import xarray as xr

import hertzlink as hl
from coupling.inference.prediction import high_passed
from hertzlink.studies import draw, waves
from hertzlink.studies.conditions import BEAD, HEIGHT, SPEED, Conditions, WrongValue
from hertzlink.studies.results import named, with_units
from hertzlink.studies.table import Row, Rows
from hertzlink.studies.verdicts import NOT_GIVEN
from particles.bead import STANDARD_GRAVITY
from structures.bodies.elasticity import HIGHEST_FREQUENCY
from structures.reduction import DEFAULT_PULSE
from structures.structure import Vector

row = Rows("struck_cylinders")
BEADS, SENSOR = 20, 7
SENSORS = (SENSOR, 16)  # AR and TOF are read at bead 7; at 16 incident and reflected wave overlap.
WAVES = ("primary", "secondary")
UNTIL = 1.5e-3  # Length of the thesis's records, s.
DROP_HEIGHT = 0.01
DASHPOTS = (4.0, 5.0, 6.0)  # N s/m, at every contact; the thesis does not give its coefficient.
CROSSING = 1e-6  # s, in which a wave crosses an element of a rod by default.
DAMPING = hl.quantities.Quantity("N s/m", "a dashpot", "5 N s/m", high=1e6)
BAND = "Dashpot at each contact; of several values the middle one counts, and the others give its band"


@dataclass(frozen=True)
class Striking(Conditions):
    """The chain. Records, meshes and pulses follow the contact time where the chain is not the thesis's."""

    bead: Annotated[float, BEAD, "Diameter of the beads and the striker"] = 9.52e-3
    bead_material: Annotated[hl.Material, "Material of the beads and the striker"] = hl.STEEL_440C
    drop_height: Annotated[float, HEIGHT, "Height from which the striker falls"] = DROP_HEIGHT
    impact_speed: Annotated[float | None, SPEED, "Speed of the striker, in place of the drop height"] = None
    dashpot: Annotated[tuple[float, ...], DAMPING, BAND] = DASHPOTS

    def check(self) -> None:
        """Refuse both a speed and a height."""
        if self.impact_speed is not None and self.drop_height != DROP_HEIGHT:
            raise WrongValue("impact_speed", self.impact_speed, "give it or the drop height, not both")

    @property
    def sphere(self) -> hl.Sphere:
        """A bead."""
        return hl.Sphere(self.bead / 2.0, self.bead_material)

    @property
    def speed(self) -> float:
        """The speed of the striker, m/s."""
        return hl.drop_speed(self.drop_height) if self.impact_speed is None else self.impact_speed

    @property
    def middle(self) -> float:
        """The dashpot that counts, N s/m."""
        return self.dashpot[len(self.dashpot) // 2]

    def chain(self, dashpot: float | None = None) -> hl.Chain:
        """Return the chain of 20 spheres, with a dashpot, N s/m, by default that which counts."""
        loss = hl.LinearDashpot(self.middle if dashpot is None else dashpot)
        return hl.Chain([self.sphere] * BEADS, self.sphere, self.speed, STANDARD_GRAVITY, loss)

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

    def stacks(self) -> Iterable[Sequence[hl.Layer]]:
        """Return the cylinders of the study at their longest."""
        raise NotImplementedError

    @cached_property
    def until(self) -> float:
        """Length of the record, s: the thesis's, in terms of the chain's TOF on a soft wall, and the longest echo."""
        if not self.own:
            return UNTIL
        stacks = list(self.stacks())
        softest = min(self.wall(hl.PTFE), *(self.wall(stack[0].material) for stack in stacks))
        thesis = replace(self, **{name: self.thesis(name) for name in self.differing()})
        scale = float(self.time_of_flight(softest) / thesis.time_of_flight(thesis.wall(hl.PTFE)))
        echo = max(2.0 * sum(layer.length / layer.material.bar_speed for layer in stack) for stack in stacks)
        return UNTIL * scale + echo + self.spring_time()

    def spring_time(self) -> float:
        """Return the time, s, by which a soft layer makes the record longer."""
        return 0.0

    @cached_property
    def sharper(self) -> float:
        """The factor by which the contact is shorter than the thesis's with steel, at least 1."""
        thesis = type(self)().contact_time(hl.STEEL_440C)
        return max(1.0, thesis / self.contact_time(hl.STEEL_440C)) if self.own else 1.0

    def slender(self, layers: Sequence[hl.Layer]) -> hl.Structure:
        """Return the rod of these layers on a fixed base; its reduction does not change AR and TOF."""
        elements = None
        if self.sharper > 1.0:
            elements = max(ceil(self.sharper * layer.length / layer.material.bar_speed / CROSSING) for layer in layers)
        return hl.reduce(hl.rod(layers, elements=elements), self.until, pulse=DEFAULT_PULSE / self.sharper)

    def check_meshes(self) -> None:
        """Raise a ValueError before any run where a mesh would be too large; the thesis's are not."""
        for stack in self.stacks() if self.own else ():
            try:
                self._cylinder(stack)
            except ValueError as error:
                cure = f"makes too fine a mesh for this cylinder ({error}); give larger beads or a smaller cylinder"
                raise WrongValue("bead", self.bead, cure) from None

    def _cylinder(self, layers: Sequence[hl.Layer]) -> hl.Structure:
        return hl.layered_cylinder(layers, highest_frequency=HIGHEST_FREQUENCY * self.sharper)

    def solid(self, layers: Sequence[hl.Layer]) -> hl.Structure:
        """Return the axisymmetric cylinder of these layers on a fixed base, reduced."""
        return hl.reduce(self._cylinder(layers), self.until, pulse=DEFAULT_PULSE / self.sharper)


@dataclass(frozen=True)
class OverLength(Striking):
    """Parameters of a study over a length of the cylinder: that of the parameter `swept`."""

    swept: ClassVar[str]

    def stack(self, length: float) -> list[hl.Layer]:
        """Return the cylinder, with this length, m."""
        raise NotImplementedError

    def stacks(self) -> Iterable[Sequence[hl.Layer]]:
        """Return the longest cylinder."""
        return [self.stack(max(getattr(self, self.swept)))]

    def expected(self, lengths: Vector) -> xr.Dataset:
        """Return what theory says over the lengths, m: at least TOF."""
        raise NotImplementedError


THESIS = Striking()
DASHPOT = THESIS.middle


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

    The force at the sensors is that of the rods, for the middle dashpot. lengths, solid_lengths: the thesis's; of a
    user's own cylinders those that are solid are chosen.
    """
    of.check_meshes()
    jobs = 1 if quick and jobs is None else jobs  # Starting processes takes longer.
    lengths = of.few(of.swept, lengths)

    def against_rod(length: float, dashpot: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(dashpot), of.slender(of.stack(length)))

    def against_cylinder(solid_length: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(), of.solid(of.stack(solid_length)))

    data = hl.sweep(against_rod, of.until, jobs, with_forces, length=lengths, dashpot=of.dashpot)
    solid_lengths = chosen(lengths) if of.own else solid_lengths
    solids = hl.sweep(against_cylinder, of.until, jobs, measure, solid_length=solid_lengths)
    data["sensor_force"] = data.sensor_force.sel(dashpot=of.middle, drop=True)
    data = data.assign(named(solids[["amplitude_ratio", "time_of_flight"]], "solid").data_vars)
    if not of.own:
        ends = data.length.values[[0, -1]].tolist()
        free = hl.sweep(lambda end: against_rod(end, 0.0), of.until, 1, measure, end=ends)
        data = data.assign(named(free[["amplitude_ratio", "time_of_flight"]], "undamped").data_vars)
    return of.marked(with_units(data, length="m", solid_length="m", dashpot="N s/m"))


def ratio(values: xr.DataArray, wave: str = "primary") -> float:
    """Return AR of one run; zero if the wave does not return."""
    return float(values.sel(wave=wave).fillna(0.0))


def flight(values: xr.DataArray, wave: str = "primary") -> float:
    """Return TOF of one run, µs."""
    return float(values.sel(wave=wave)) * 1e6


def delay(flights: xr.DataArray) -> float:
    """Return the secondary wave's delay after the primary one, µs; NaN without one."""
    return flight(flights, "secondary") - flight(flights)


def known(value: float) -> float | str:
    """Return a number, or words where no wave was seen."""
    return value if np.isfinite(value) else "no wave"


def lost(values: xr.DataArray) -> float:
    """Return the difference between the largest and the smallest value, in percent of the largest."""
    return 100.0 * float(1.0 - values.min() / values.max())


def beyond_rod(data: xr.Dataset, name: str, wave: str = "primary") -> xr.DataArray:
    """Return AR or TOF of the cylinders minus that of rods of the same length."""
    middle = data[name].sel(wave=wave).isel(dashpot=data.sizes["dashpot"] // 2)
    return data[f"solid_{name}"].sel(wave=wave) - middle.dropna("length").interp(length=data.solid_length)


def interval(values: xr.DataArray, factor: float = 1.0) -> str:
    """Return the smallest and the largest value."""
    low, high = (f"{float(value) * factor:.3g}" for value in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"


def sensitivity(values: xr.DataArray, factor: float = 1.0) -> str:
    """Return the results with the other dashpots."""
    return f"γ is not given; {band(values, factor)}"


def band(values: xr.DataArray, factor: float = 1.0) -> str:
    """Return the results with the least and the greatest dashpot."""
    if values.sizes["dashpot"] == 1:
        return f"γ = {float(values.dashpot[0]):g} N s/m"
    (low, high), (least, most) = values.fillna(0.0).values[[0, -1]] * factor, values.dashpot.values[[0, -1]]
    return f"{low:.3g} and {high:.3g} for γ = {least:g} and {most:g} N s/m"


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


def chosen(lengths: Sequence[float], most: int = 9) -> tuple[float, ...]:
    """Return at most `most` of the lengths, evenly among them, with the first and the last one."""
    places = np.unique(np.linspace(0, len(lengths) - 1, min(most, len(lengths))).round().astype(int))
    return tuple(lengths[i] for i in places)


def own_rows(data: xr.Dataset, of: OverLength, what: str, equations: str) -> list[Row]:
    """Return AR and TOF over the length of a user's own chain and cylinder, with theory. equations: of AR and TOF."""
    rows, theory = [], of.expected(data.solid_length.values)
    for i, length in enumerate(data.solid_length.values):
        rods, solids, expected = (
            data.sel(length=length, method="nearest"),
            data.isel(solid_length=i),
            theory.isel(length=i),
        )
        at, label = rods.sel(dashpot=of.middle), f"{what} {length * 1e3:.4g} mm"
        for name, variable, factor in (("AR", "amplitude_ratio", 1.0), ("TOF", "time_of_flight", 1e6)):
            wide, spread = (part.sel(wave="primary") for part in (solids[f"solid_{variable}"], rods[variable]))
            predicted = factor * float(expected[variable]) if variable in expected else ""
            said = equations if variable in expected else "", factor * float(wide), band(spread, factor)
            value = known(factor * float(at[variable].sel(wave="primary")))
            rows.append(row(name, value, *said, theory=predicted, cylinder=label))
        later, layered = delay(at.time_of_flight), "delay" in expected
        if layered or np.isfinite(later):
            seen = f"{later:.4g} µs after the primary one" if np.isfinite(later) else "none is seen"
            rows.append(row("AR, secondary", ratio(at.amplitude_ratio, "secondary"), seen, cylinder=label))
        if layered:
            lighter, heavier = 1e6 * float(expected.delay), 1e6 * float(expected.delay_with_lower_mass)
            rows.append(row("delay", known(later), heavier, theory=lighter, cylinder=label))
    return rows


def against_length(axis: draw.Axes, data: xr.Dataset, name: str, wave: str, label: str, xlabel: str) -> None:
    """Draw AR or TOF of one wave over a length (mm): rods, their band between the outer dashpots, and cylinders."""
    factor = 1e6 if name == "time_of_flight" else 1.0
    values, solids = data[name].sel(wave=wave) * factor, data[f"solid_{name}"].sel(wave=wave) * factor
    middle = float(data.dashpot[data.sizes["dashpot"] // 2])
    draw.banded(axis, data.length.values * 1e3, values, middle, "rod, 1-D")
    draw.points(axis, data.solid_length.values * 1e3, solids.values, 1, "cylinder, axisymmetric")
    axis.set(xlabel=xlabel, ylabel=label)
    draw.log_x(axis)


def force_intensity(data: xr.Dataset, xlabel: str) -> draw.Figure:
    """Return the force at bead 7 over time and a length."""
    force = data.sensor_force.sel(sensor=SENSOR).transpose("length", "time").values
    return draw.intensity_map(data.time.values, data.length.values, force, xlabel, 1e3)
