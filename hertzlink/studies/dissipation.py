"""Thesis chapter 4: the decay of a solitary wave in a chain of 70 spheres, and other facts that depend on it.

The experiments of the thesis exist as figures only; so nothing is fitted here, and no measured point is drawn.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import sqrt
from typing import NamedTuple

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.results import with_units
from hertzlink.studies.table import Row, Rows
from particles.moving import STEPS_PER_CONTACT
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from structures.structure import Vector

row = Rows("dissipation")
BEADS, RADIUS = 70, 2.38e-3
SENSORS = (9, 16, 24, 31, 40, 50, 56, 63)
IMPACT_SPEED = 1.77
SHOWN_SENSORS = (16, 56)  # Sensors of figures 4.3b and c.
# m/s. Figure 4.2a shows two of ten striker speeds, but prints only 1.77 m/s; the other one is taken as half of it.
SHOWN_SPEEDS = (0.885, IMPACT_SPEED)
IMPACT_SPEEDS = tuple(np.geomspace(0.3, 3.0, 8))  # m/s, of figure 4.2b; the thesis does not print its own.
DRAG_RATE = 6900.0  # α₁, 1/s (section 4.3, which prints N s/m).
DELAY = 1.4  # A damped wave is delayed by less than this factor; no law of this study delays it more.
ELLIPSOID = hl.Ellipsoid(2.36e-3, 10.16e-3, hl.STEEL_316)
ELLIPSOID_BEADS, ELLIPSOID_SENSORS, ELLIPSOID_SPEED = 50, (8, 16, 28, 41), 0.37
ELLIPSOID_DASHPOTS = (0.0, 3.18, 11.67, 15.55)
# So much stiffer than the beads that a sphere against it is one half of two colliding spheres.
RIGID = hl.Material(1e25, 0.3, 8000.0, "rigid")
MEETINGS = ("at a contact", "at a bead")
MEETING_BEADS, MEETING_SENSOR, MEETING_UNTIL = 70, 50, 9e-4
QUICK_STEP = 4.0  # Factor of the step of quick runs: forces change by less than 1e-4.
YIELD_STRESS = 1e9  # Pa, from Johnson's example of a medium-hard steel; the thesis gives no value.


@dataclass(frozen=True)
class Lossy:
    """The chain of spheres of a material, and its losses of Table 4.1: α, and |γ| in N (s/m)^α."""

    material: hl.Material = hl.STEEL_316
    exponent: float = 1.81
    coefficient: float = 5.58

    @property
    def sphere(self) -> hl.Sphere:
        """A bead with the mass from its geometry."""
        return hl.Sphere(RADIUS, self.material)

    def law(self, name: str) -> hl.Dissipation | None:
        """Return a law of LAWS."""
        if name == "undamped":
            return None
        if name == "drag":
            return hl.MassProportional(DRAG_RATE)
        if name == "thesis, as an acceleration":
            return hl.PowerDashpot(self.coefficient * self.sphere.mass, self.exponent, "thesis")
        return hl.PowerDashpot(self.coefficient, self.exponent, name)

    def until(self, speed: float = IMPACT_SPEED) -> float:
        """Return time, s, in which a wave from the slowest striker passes the whole chain, with any of the losses."""
        moved = PARTICLE_TO_STRIKER_SPEED * speed
        return DELAY * BEADS * 2.0 * RADIUS / waves.long_waves(self.sphere).wave_speed_from_particle_speed(moved)


class Fit(NamedTuple):
    """A row of Table 4.1: chain and law, standard deviations of exponent and coefficient."""

    of: Lossy
    exponent_deviation: float
    coefficient_deviation: float


SOFTER = replace(hl.PTFE, youngs_modulus=1.46e9)
TABLE_4_1 = {
    "steel 316": Fit(Lossy(), 0.25, 1.30),
    "PTFE": Fit(Lossy(SOFTER, 1.78, 0.582), 0.14, 0.087),
    "brass 360": Fit(Lossy(hl.BRASS_360, 1.85, 6.84), 0.13, 0.66),
}
STEEL = Lossy()
LAWS = ("undamped", "thesis", "pairwise", "thesis, as an acceleration", "drag")
LAW_NAMES = {
    "undamped": "undamped",
    "thesis": "the thesis's law",
    "pairwise": "the same α and γ, pairwise",
    "drag": "drag, α₁ = 6900 1/s",
}
CORNERS = {"best fit": (0, 0), "α− γ−": (-1, -1), "α− γ+": (-1, 1), "α+ γ−": (1, -1), "α+ γ+": (1, 1)}


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return peak forces and arrivals at every bead, for the laws and numbers of Table 4.1, and over striker speeds.

    Chains are horizontal and free at their end; the striker equals the beads. quick: steps four times as long, and
    three striker speeds instead of eight for the speed over the force.
    """
    jobs = 1 if quick and jobs is None else jobs  # Starting processes takes longer.
    step = QUICK_STEP if quick else 1.0
    speeds = IMPACT_SPEEDS[::3] if quick else IMPACT_SPEEDS
    parts = [table_4_1(step, jobs), over_corners(step, jobs), over_speeds(speeds, step, jobs), *asides(jobs)]
    data = xr.merge(parts, join="outer", combine_attrs="override")
    return with_units(data, shown_speed="m/s", striker_speed="m/s", dashpot="N s/m")


def simulation(
    of: Lossy, law: hl.Dissipation | None, speed: float = IMPACT_SPEED, step: float = 1.0
) -> hl.CoSimulation:
    """Return the horizontal chain of spheres; step in units of the default step."""
    chain = hl.Chain([of.sphere] * BEADS, of.sphere, speed, dissipation=law)
    free = hl.CoSimulation(chain, None)
    return free if step == 1.0 else hl.CoSimulation(chain, None, dt=step * free.chain.contact_time / STEPS_PER_CONTACT)


def table_4_1(step: float, jobs: int | None) -> xr.Dataset:
    """Return all laws in steel with the force over time, and all except the drag in PTFE and brass."""

    def build(law: str, material: str) -> hl.CoSimulation:
        of = TABLE_4_1[material].of
        return simulation(of, of.law(law), step=step)

    parts = []
    for name, fit in TABLE_4_1.items():
        keep, laws = (with_history, LAWS) if fit.of == STEEL else (peaks, LAWS[:-1])
        parts.append(hl.sweep(build, fit.of.until(), jobs, keep, law=laws, material=[name]))
    steel = parts[0][["force", "contact_peak"]].sel(material="steel 316", drop=True)
    waves_of_materials = xr.concat([part[["peak", "arrival"]] for part in parts], "material", join="outer")
    return waves_of_materials.assign(steel.data_vars).assign_attrs(parts[0].attrs).reindex(law=list(LAWS))


def over_corners(step: float, jobs: int | None) -> xr.Dataset:
    """Return the thesis's law in steel with both parameters changed by a standard deviation."""
    fit = TABLE_4_1["steel 316"]

    def build(shown_speed: float, corner: str) -> hl.CoSimulation:
        exponent, coefficient = CORNERS[corner]
        changed = fit.of.coefficient + coefficient * fit.coefficient_deviation
        law = hl.PowerDashpot(changed, fit.of.exponent + exponent * fit.exponent_deviation, "thesis")
        return simulation(STEEL, law, shown_speed, step)

    slowest = STEEL.until(min(SHOWN_SPEEDS))
    corners = hl.sweep(build, slowest, jobs, peaks, shown_speed=SHOWN_SPEEDS, corner=list(CORNERS))
    return corners.rename(peak="corner_peak").drop_vars("arrival")


def over_speeds(speeds: tuple[float, ...], step: float, jobs: int | None) -> xr.Dataset:
    """Return the peaks and arrivals in steel without losses and with the thesis's law."""

    def build(striker_speed: float, law: str) -> hl.CoSimulation:
        return simulation(STEEL, STEEL.law(law), striker_speed, step)

    runs = hl.sweep(build, STEEL.until(min(speeds)), jobs, peaks, striker_speed=speeds, law=LAWS[:2])
    return runs.sel(sensor=list(SENSORS)).rename(peak="swept_peak", arrival="swept_arrival", sensor="swept_sensor")


def asides(jobs: int | None) -> list[xr.Dataset]:
    """Return the waves that collide, and linear dashpots in a chain of ellipsoids perpendicular to it."""

    def meeting(meeting: str) -> hl.CoSimulation:
        beads = [STEEL.sphere] * MEETING_BEADS
        return hl.CoSimulation(hl.Chain(beads, STEEL.sphere, IMPACT_SPEED), mirror(meeting))

    def ellipsoids(dashpot: float) -> hl.CoSimulation:
        beads, loss = [ELLIPSOID] * ELLIPSOID_BEADS, hl.LinearDashpot(dashpot)
        return hl.CoSimulation(hl.Chain(beads, ELLIPSOID, ELLIPSOID_SPEED, dissipation=loss), None)

    slow = ELLIPSOID_BEADS * ELLIPSOID.size / 300.0
    dashpots = hl.sweep(ellipsoids, slow, jobs, peaks, dashpot=ELLIPSOID_DASHPOTS)
    dashpots = dashpots.sel(sensor=list(ELLIPSOID_SENSORS)).drop_vars("arrival")
    return [
        hl.sweep(meeting, MEETING_UNTIL, jobs, secondary_waves, meeting=MEETINGS),
        dashpots.rename(peak="ellipsoid_peak", sensor="ellipsoid_sensor"),
    ]


def mirror(meeting: str) -> hl.Structure:
    """Return the structure with which a wave meets its mirror image, at a contact or at the centre of a bead.

    A sphere on a rigid flat is one half of two colliding spheres; a bead that waves hit from both sides stays at rest.
    """
    if meeting == "at a contact":
        return hl.half_space(RIGID)
    return replace(hl.half_space(hl.STEEL_316), surface=STEEL.sphere.surface)


def peaks(run: xr.Dataset) -> xr.Dataset:
    """Return the largest force (N) and its time (s) at each bead except the last, interpolated by a parabola.

    No wave returns before this time from the free end, so this is the incident wave.
    """
    contacts = (run.contact_force - run.static_force).transpose("contact", "time").values[:-1]
    # As sensor_force, for all beads at once: separate calls would take longer than the run.
    force = 0.5 * (contacts[:-1] + contacts[1:])
    beads, top = np.arange(1, force.shape[0] + 1), force.argmax(axis=1)
    before, peak, after = (force[beads - 1, top + shift] for shift in (-1, 0, 1))
    share = 0.5 * (before - after) / (before - 2.0 * peak + after)
    step = float(run.time[1] - run.time[0])
    return xr.Dataset(
        {
            "peak": ("sensor", peak - 0.25 * (before - after) * share, {"units": "N", "long_name": "peak force"}),
            "arrival": ("sensor", step * (top + share), {"units": "s", "long_name": "time of the peak"}),
        },
        coords={"sensor": beads},
    )


def with_history(run: xr.Dataset) -> xr.Dataset:
    """Return the peaks, those of contacts, and the force over time at the sensors of figures 4.3b and c."""
    contacts = run.contact_force.max("time").reset_coords(drop=True)
    return peaks(run).assign(
        force=waves.sensor_forces(run, SHOWN_SENSORS).rename(sensor="shown"),
        contact_peak=contacts.assign_attrs(units="N", long_name="greatest force between bead n - 1 and bead n"),
    )


def secondary_waves(run: xr.Dataset) -> xr.Dataset:
    """Return the peak force of the secondary wave over that of the original one."""
    wave = hl.reflections(run, MEETING_SENSOR, smallest=1e-3).secondary
    return xr.Dataset({"secondary": ((), wave.amplitude_ratio if wave else np.nan, {"units": "1"})})


def forces_and_speeds(data: xr.Dataset, law: str) -> tuple[Vector, Vector]:
    """Return the geometric mean of neighbouring sensors' peak forces (N), and the front speed between them (m/s)."""
    swept = data[["swept_peak", "swept_arrival"]].sel(law=law).transpose("striker_speed", "swept_sensor")
    peak, distance = swept.swept_peak.values, np.diff(swept.swept_sensor.values) * 2.0 * RADIUS
    speed = distance / np.diff(swept.swept_arrival.values, axis=1)
    return np.sqrt(peak[:, 1:] * peak[:, :-1]).ravel(), speed.ravel()


def formation(peak: xr.DataArray) -> int:
    """Return the last value that differs by more than 1 % from that in the middle of the chain, counted from 1."""
    values = peak.values[: BEADS // 2]
    return int(np.flatnonzero(abs(values / values[-1] - 1.0) > 0.01)[-1]) + 1


def yield_speed(bead: hl.Sphere, yield_stress: float = YIELD_STRESS) -> float:
    """Return the relative speed, m/s, at which two equal spheres yield: ½ m V² = 53 R³Y⁵/E*⁴, with reduced m, R and E*.

    Johnson, Contact Mechanics, section 11.4; for a sphere on a flat it gives his 0.14 m/s for Y = 1 GPa.
    """
    mass, radius, modulus = bead.mass / 2.0, bead.radius / 2.0, bead.material.contact_modulus / 2.0
    return sqrt(2.0 * 53.0 * radius**3 * yield_stress**5 / (modulus**4 * mass))


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of chapter 4 and those that depend on them, compared with those of hertzlink."""
    return [*(row for name in TABLE_4_1 for row in _material_rows(data, name)), *_other_rows(data)]


def _material_rows(data: xr.Dataset, name: str) -> list[Row]:
    """Return a row of Table 4.1, and what is left of the wave by three readings of it."""
    of, peak = TABLE_4_1[name].of, data.peak.sel(material=name, sensor=[9, 56])
    forces = {law: peak.sel(law=law).values for law in ("thesis", "thesis, as an acceleration", "pairwise")}
    left = {law: float(last / first) for law, (first, last) in forces.items()}
    ends = {law: " and ".join(f"{force:.4g} N" for force in values) for law, values in forces.items()}
    struck = "recomputed elsewhere with 0.45 g: 41.7 and 11.7" if of == STEEL else "striker at 1.77 m/s"
    return [
        row(f"mass, {name}", of.sphere.mass * 1e3),
        row(f"α and γ, {name}", f"{of.exponent}, {of.coefficient:g}"),
        row("γ as a force", left["thesis"], ends["thesis"], struck, material=name),
        row("γ as an acceleration", left["thesis, as an acceleration"], material=name),
        row("pairwise form", left["pairwise"], ends["pairwise"], material=name),
    ]


def _other_rows(data: xr.Dataset) -> list[Row]:
    """Return mass-proportional losses, speed over force, ellipsoids, waves that meet, and how soon a wave forms."""
    steel = data.peak.sel(material="steel 316", sensor=list(SENSORS))
    drag = [f"{value:.1f}" for value in steel.sel(law="drag").values]
    free, lossy = (waves.power_exponent(*forces_and_speeds(data, law)) for law in ("undamped", "thesis"))
    left = data.ellipsoid_peak.sel(ellipsoid_sensor=41) / data.ellipsoid_peak.sel(ellipsoid_sensor=8)
    weak, middle, strong = left.sel(dashpot=list(ELLIPSOID_DASHPOTS[1:])).values.tolist()
    contact, bead = data.secondary.sel(meeting=list(MEETINGS)).values.tolist()
    undamped, speeds = data.sel(law="undamped"), data.striker_speed.values
    centre, first = formation(undamped.peak.sel(material="steel 316")), float(formation(undamped.contact_peak))
    at_nine = float(steel.sel(law="undamped", sensor=9))
    return [
        row("α₁, steel 316", DRAG_RATE),
        row("F(9) and F(63) with α₁", f"{drag[0]} and {drag[-1]}", ", ".join(drag), at_nine),
        row("exponent of speed over force, undamped", free),
        row("exponent of speed over force, thesis's law", lossy, speeds[0], speeds[-1]),
        row("γ of ellipsoids at 0.37 m/s", "not comparable", middle, weak, strong),
        row("speed from which beads yield", yield_speed(STEEL.sphere)),
        row("secondary wave after waves meet at a contact", contact),
        row("secondary wave after waves meet at a bead", bead),
        row("beads to form a solitary wave", first, centre),
    ]


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the decay over beads (figure 4.2a), speed over force (4.2b), and the laws compared (4.3)."""
    lines = []
    for colour, speed in zip(draw.COLOURS, data.shown_speed.values, strict=False):
        corners = data.corner_peak.sel(shown_speed=speed)
        lines += [
            (colour, "-", f"losses of the thesis, {speed:g} m/s", corners.sel(corner="best fit")),
            (colour, "--", "extremes of α ± σ and γ ± σ", corners.min("corner")),
            (colour, "--", "", corners.max("corner")),
        ]
    return {"decay": _decay(data, lines), "speed_over_force": _speed_over_force(data), "laws": _laws(data)}


def _decay(data: xr.Dataset, lines: Iterable[tuple[str, str, str, xr.DataArray]]) -> draw.Figure:
    """Return the greatest forces over the beads. lines: colour, style, label and values of each."""
    figure, (axis,) = draw.panels(1, width=4.6, height=3.6)
    for colour, style, label, values in lines:
        axis.plot(data.sensor, values, style, color=colour, label=label)
    axis.set(xlabel="bead number n", ylabel="maximum force (N)", xlim=(0.0, data.sizes["sensor"] + 1))
    axis.set_ylim(bottom=0.0)
    axis.legend()
    return figure


def _speed_over_force(data: xr.Dataset) -> draw.Figure:
    figure, (axis,) = draw.panels(1, width=4.6, height=3.6)
    for i, (law, name) in enumerate((("undamped", "undamped"), ("thesis", "thesis's law"))):
        force, speed = forces_and_speeds(data, law)
        label = f"{name}, fitted slope {waves.power_exponent(force, speed):.3f}"
        draw.points(axis, force, speed, i, label)
    ends = np.array([force.min(), force.max()])
    middle = np.exp(np.log(speed).mean()) * (ends / np.exp(np.log(force).mean())) ** (1.0 / 6.0)
    draw.theory_line(axis, ends, middle, "slope 1/6", "--")
    draw.logarithmic(axis)
    axis.set(xlabel="maximum force (N)", ylabel="front speed (m/s)")
    axis.legend()
    return figure


def _laws(data: xr.Dataset) -> draw.Figure:
    figure, axes = draw.panels(3, width=3.0, sharey=False)
    steel = data.peak.sel(material="steel 316", sensor=list(SENSORS))
    for (law, label), style in zip(LAW_NAMES.items(), ("-", "--", "-.", ":"), strict=True):
        axes[0].plot(SENSORS, steel.sel(law=law), linestyle=style, label=label)
        for axis, sensor in zip(axes[1:], SHOWN_SENSORS, strict=True):
            axis.plot(data.time * 1e6, data.force.sel(law=law, shown=sensor), style)
    axes[0].set(title="peaks at the sensors", xlabel="bead number n", ylabel="maximum force (N)")
    axes[0].set_ylim(bottom=0.0)
    for axis, sensor in zip(axes[1:], SHOWN_SENSORS, strict=True):
        force = data.force.sel(shown=sensor, law=list(LAW_NAMES))
        busy = force.time[(force > 0.01 * force.max("time")).any("law").values] * 1e6
        axis.set(title=f"n = {sensor}", xlabel="time (µs)", ylabel="force (N)")
        axis.set_xlim(float(busy[0]) - 5.0, float(busy[-1]) + 5.0)
    draw.legend_above(figure, axes[0], 4)
    return figure
