"""Thesis chapter 4: the decay of a solitary wave in a chain of 70 spheres, and other facts that depend on it.

The experiments of the thesis exist as figures only; so nothing is fitted here, and no measured point is drawn.
"""

from collections.abc import Iterator
from dataclasses import replace
from math import sqrt
from typing import NamedTuple

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.compare import Number
from hertzlink.studies.shared import long_waves, with_units
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from structures.structure import Vector

BEADS, RADIUS, IMPACT_SPEED = 70, 2.38e-3, 1.77
SENSORS = (9, 16, 24, 31, 40, 50, 56, 63)
# m/s. Figure 4.2a shows two of ten striker speeds, but prints only 1.77 m/s; the other one is taken as half of it.
SHOWN_SPEEDS = (0.885, IMPACT_SPEED)
IMPACT_SPEEDS = tuple(np.geomspace(0.3, 3.0, 8))  # m/s, of figure 4.2b; the thesis does not print its own.
DRAG_RATE = 6900.0  # α₁, 1/s (section 4.3, which prints N s/m).
DELAY = 1.4  # A damped wave is delayed by less than this factor; no law of this study delays it more.
# So much stiffer than the beads that a sphere against it is one half of two colliding spheres.
RIGID = hl.Material(1e25, 0.3, 8000.0, "rigid")
MEETINGS, MEETING_SENSOR, MEETING_UNTIL = ("at a contact", "at a bead"), 50, 9e-4
YIELD_STRESS = 1e9  # Pa, from Johnson's example of a medium-hard steel; the thesis gives no value.


class Loss(NamedTuple):
    """A row of Table 4.1: the beads, α, |γ| in N (s/m)^α, and their standard deviations."""

    bead: hl.Sphere
    exponent: float
    coefficient: float
    deviations: tuple[float, float]

    def law(self, name: str) -> hl.Dissipation | None:
        if name == "undamped":
            return None
        if name == "drag":
            return hl.MassProportional(DRAG_RATE)
        if name == "as an acceleration":
            return hl.PowerDashpot(self.coefficient * self.bead.mass, self.exponent, "thesis")
        return hl.PowerDashpot(self.coefficient, self.exponent, name)

    def until(self, speed: float = IMPACT_SPEED) -> float:
        """Return the time, s, in which the wave of a striker passes the whole chain, with any of the losses."""
        moved = PARTICLE_TO_STRIKER_SPEED * speed
        return DELAY * BEADS * 2.0 * RADIUS / float(long_waves(self.bead).wave_speed_from_particle_speed(moved))

    def simulation(self, law: hl.Dissipation | None, speed: float = IMPACT_SPEED) -> hl.CoSimulation:
        """Return the horizontal chain, free at its end."""
        return hl.CoSimulation(hl.Chain([self.bead] * BEADS, self.bead, speed, dissipation=law), None)


STEEL = Loss(hl.Sphere(RADIUS, hl.STEEL_316), 1.81, 5.58, (0.25, 1.30))
TABLE_4_1 = {
    "steel 316": STEEL,
    "PTFE": Loss(hl.Sphere(RADIUS, replace(hl.PTFE, youngs_modulus=1.46e9)), 1.78, 0.582, (0.14, 0.087)),
    "brass 360": Loss(hl.Sphere(RADIUS, hl.BRASS_360), 1.85, 6.84, (0.13, 0.66)),
}
# The thesis's form, with γ as a force, and three others.
LAWS = ("undamped", "thesis", "pairwise", "as an acceleration", "drag")
CORNERS = {"best fit": (0, 0), "α− γ−": (-1, -1), "α− γ+": (-1, 1), "α+ γ−": (1, -1), "α+ γ+": (1, 1)}


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return peak forces and arrivals at every bead, for the laws and numbers of Table 4.1, and over striker speeds.

    quick: three striker speeds instead of eight for the speed over the force.
    """
    speeds = IMPACT_SPEEDS[::3] if quick else IMPACT_SPEEDS

    # All laws in steel, and all except the drag in PTFE and brass.
    materials = [
        hl.sweep(
            lambda material, law: TABLE_4_1[material].simulation(TABLE_4_1[material].law(law)),
            of.until(), jobs, peaks, material=[name], law=LAWS if of is STEEL else LAWS[:-1],
        )
        for name, of in TABLE_4_1.items()
    ]  # fmt: skip
    alpha, gamma = STEEL.deviations
    extremes = {
        name: hl.PowerDashpot(STEEL.coefficient + up * gamma, STEEL.exponent + right * alpha, "thesis")
        for name, (right, up) in CORNERS.items()
    }
    corners = hl.sweep(
        lambda shown_speed, corner: STEEL.simulation(extremes[corner], shown_speed),
        STEEL.until(min(SHOWN_SPEEDS)), jobs, peaks, shown_speed=SHOWN_SPEEDS, corner=list(CORNERS),
    )  # fmt: skip
    swept = hl.sweep(
        lambda striker_speed, law: STEEL.simulation(STEEL.law(law), striker_speed),
        STEEL.until(min(speeds)), jobs, peaks, striker_speed=speeds, law=LAWS[:2],
    )  # fmt: skip
    swept = swept[["peak", "arrival"]].sel(sensor=list(SENSORS))

    def with_meeting(meeting: str) -> hl.CoSimulation:
        # A sphere on a rigid flat is one half of two colliding spheres; a bead that waves hit from both sides rests.
        wall = hl.half_space(RIGID)
        if meeting == "at a bead":
            wall = replace(hl.half_space(hl.STEEL_316), surface=STEEL.bead.surface)
        return hl.CoSimulation(hl.Chain([STEEL.bead] * BEADS, STEEL.bead, IMPACT_SPEED), wall)

    def secondary_wave(run: xr.Dataset) -> xr.Dataset:
        wave = hl.reflections(run, MEETING_SENSOR, smallest=1e-3).secondary
        return xr.Dataset({"secondary": wave.amplitude_ratio if wave else np.nan})

    met = hl.sweep(with_meeting, MEETING_UNTIL, jobs, secondary_wave, meeting=MEETINGS)
    found = [
        xr.concat(materials, "material", join="outer", combine_attrs="override"),
        corners[["peak"]].rename(peak="corner_peak"),
        swept.rename(peak="swept_peak", arrival="swept_arrival", sensor="swept_sensor"),
        met,
    ]
    return with_units(xr.merge(found, join="outer", combine_attrs="override"), shown_speed="m/s", striker_speed="m/s")


def peaks(run: xr.Dataset) -> xr.Dataset:
    """Return the largest force (N) at each contact, and at each bead except the last, with its time (s), by a parabola.

    No wave returns before this time from the free end, so this is the incident wave.
    """
    contacts = (run.contact_force - run.static_force).transpose("contact", "time").values[:-1]
    # As sensor_force, for all beads at once: separate calls would take longer than the run.
    force = 0.5 * (contacts[:-1] + contacts[1:])
    beads, top = np.arange(1, force.shape[0] + 1), force.argmax(axis=1)
    before, peak, after = (force[beads - 1, top + shift] for shift in (-1, 0, 1))
    share = 0.5 * (before - after) / (before - 2.0 * peak + after)
    arrival = float(run.time[1] - run.time[0]) * (top + share)
    label = {"units": "N", "long_name": "greatest force between bead n - 1 and bead n"}
    return xr.Dataset(
        {
            "peak": ("sensor", peak - 0.25 * (before - after) * share, {"units": "N", "long_name": "peak force"}),
            "arrival": ("sensor", arrival, {"units": "s", "long_name": "time of the peak"}),
            "contact_peak": run.contact_force.max("time").reset_coords(drop=True).assign_attrs(label),
        },
        coords={"sensor": beads},
    )


def forces_and_speeds(data: xr.Dataset, law: str) -> tuple[Vector, Vector]:
    """Return the geometric mean of neighbouring sensors' peak forces (N), and the front speed between them (m/s)."""
    swept = data[["swept_peak", "swept_arrival"]].sel(law=law).transpose("striker_speed", "swept_sensor")
    peak, distance = swept.swept_peak.values, np.diff(swept.swept_sensor.values) * 2.0 * RADIUS
    speed = distance / np.diff(swept.swept_arrival.values, axis=1)
    return np.sqrt(peak[:, 1:] * peak[:, :-1]).ravel(), speed.ravel()


def formation(peak: xr.DataArray) -> int:
    """Return the number, from 1, of the last value that differs by more than 1 % from the one in mid chain."""
    values = peak.values[: BEADS // 2]
    return int(np.flatnonzero(abs(values / values[-1] - 1.0) > 0.01)[-1]) + 1


def yield_speed(bead: hl.Sphere, yield_stress: float = YIELD_STRESS) -> float:
    """Return the relative speed, m/s, at which two equal spheres yield: ½ m V² = 53 R³Y⁵/E*⁴, with reduced m, R and E*.

    Johnson, Contact Mechanics, section 11.4; for a sphere on a flat it gives his 0.14 m/s for Y = 1 GPa.
    """
    mass, radius, modulus = bead.mass / 2.0, bead.radius / 2.0, bead.material.contact_modulus / 2.0
    return sqrt(2.0 * 53.0 * radius**3 * yield_stress**5 / (modulus**4 * mass))


def numbers(data: xr.Dataset) -> Iterator[Number]:
    # Table 4.1, and the part of the wave at bead 9 that is left at bead 56, for three readings of the table.
    for name, of in TABLE_4_1.items():
        yield Number(f"mass, {name}", of.bead.mass * 1e3)
        ends = data.peak.sel(material=name, law=list(LAWS[1:4]))
        force, pairwise, acceleration = (ends.sel(sensor=56) / ends.sel(sensor=9)).values
        said = f"F(56)/F(9) with γ as a force {force:.4g}, as an acceleration {acceleration:.4g}, "
        yield Number(f"α and γ, {name}", f"{of.exponent}, {of.coefficient:g}", f"{said}pairwise {pairwise:.4g}")
    steel = data.sel(material="steel 316")
    at_sensors = steel.peak.sel(sensor=list(SENSORS))
    drag, plain = (at_sensors.sel(law=law).values for law in ("drag", "undamped"))
    said = f"forces at the sensors {', '.join(f'{value:.1f}' for value in drag)} N, for {plain[0]:.1f} N without it"
    yield Number("α₁, steel 316", DRAG_RATE, said)
    for law, name in (("undamped", "undamped"), ("thesis", "thesis's law")):
        exponent = waves.power_exponent(*forces_and_speeds(data, law))
        yield Number(f"exponent of speed over force, {name}", exponent)
    yield Number("γ of ellipsoids at 0.37 m/s", "not comparable")
    yield Number("speed from which beads yield", yield_speed(STEEL.bead))
    contact, bead = data.secondary.sel(meeting=list(MEETINGS)).values.tolist()
    yield Number("secondary wave after waves meet at a contact", {"": contact, "at a bead": bead})
    undamped = steel.sel(law="undamped")
    at_centres = formation(undamped.peak)
    said = f"until peak contact forces stay within 1 %; forces at bead centres after {at_centres}"
    yield Number("beads to form a solitary wave", float(formation(undamped.contact_peak)), said)


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the decay over beads (figure 4.2a), and speed over force (4.2b)."""
    decay, (axis,) = draw.panels(xlabel="bead number n", ylabel="maximum force (N)")
    for i, speed in enumerate(data.shown_speed.values):
        corners, colour = data.corner_peak.sel(shown_speed=speed), draw.COLOURS[i]
        label = f"losses of the thesis, {speed:g} m/s"
        axis.plot(data.sensor, corners.sel(corner="best fit"), "-", color=colour, label=label)
        axis.plot(data.sensor, corners.min("corner"), "--", color=colour, label="extremes of α ± σ and γ ± σ")
        axis.plot(data.sensor, corners.max("corner"), "--", color=colour)
    axis.set_xlim(0.0, data.sizes["sensor"] + 1)
    axis.set_ylim(bottom=0.0)
    axis.legend()

    speeds, (axis,) = draw.panels(xlabel="maximum force (N)", ylabel="front speed (m/s)")
    for i, (law, name) in enumerate((("undamped", "undamped"), ("thesis", "thesis's law"))):
        force, speed = forces_and_speeds(data, law)
        draw.points(axis, force, speed, i, f"{name}, fitted slope {waves.power_exponent(force, speed):.3f}")
    ends = np.array([force.min(), force.max()])
    middle = np.exp(np.log(speed).mean()) * (ends / np.exp(np.log(force).mean())) ** (1.0 / 6.0)
    draw.theory_line(axis, ends, middle, "slope 1/6", "--")
    draw.logarithmic(axis)
    axis.legend()
    return {"decay": decay, "speed_over_force": speeds}
