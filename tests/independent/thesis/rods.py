"""Section 6.1.1: 20 beads of steel 440C, R = 4.76 mm, on half-spaces; equation 6.1 with and without dashpots.

The thesis names neither the gravity nor the dashpots of its runs. The variants are its chain without losses and with
γ = 5 N s/m in all contacts, with and without gravity, and a few others. Where it opens, a contact with a dashpot pulls,
as equation 6.1 is printed; "no pull" leaves such forces out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import sqrt

import numpy as np
from scipy.optimize import brentq

from . import waves
from .line import Flight, Line, Numbers, hertzian, row
from .materials import GRAVITY, PTFE, STEEL_440C, Material, between_spheres, on_half_space, sphere_mass
from .theory import CONTACT_TIME, TRANSIT
from .values import Chapter, Effort, Variants

chapter = Chapter("rods_set1_modulus")

STEEL = STEEL_440C
RADIUS, BEADS, SENSOR = 4.76e-3, 20, 7
MASS, CONTACT = sphere_mass(RADIUS, STEEL), between_spheres(RADIUS, STEEL)
DROP = sqrt(2.0 * GRAVITY * 0.01)
BEHIND = BEADS - SENSOR
"""N of equation 6.10: the beads between the sensor and the wall."""
WALLS = {"steel": STEEL, "ptfe": PTFE}
UNTIL = 1.1e-3


@dataclass(frozen=True)
class Loss:
    """Gravity, m/s², and dashpots, N s/m, between beads and at the wall; whether they may pull."""

    gravity: float
    gamma: float = 0.0
    wall: float = 0.0
    pulls: bool = True

    @property
    def pots(self) -> Numbers:
        """Of each contact, the wall's last."""
        return np.concatenate([np.full(BEADS, self.gamma), [self.wall]])


LOSSES = {
    "undamped, g = 0": Loss(0.0),
    "undamped, g = 9.81": Loss(GRAVITY),
    "gamma = 5, g = 0": Loss(0.0, 5.0, 5.0),
    "gamma = 5, g = 9.81": Loss(GRAVITY, 5.0, 5.0),
    "gamma = 5, no pull, g = 0": Loss(0.0, 5.0, 5.0, pulls=False),
    "gamma = 5, no pull, g = 9.81": Loss(GRAVITY, 5.0, 5.0, pulls=False),
    "gamma = 6, g = 9.81": Loss(GRAVITY, 6.0, 6.0),
    "gamma = 5, wall 0, g = 9.81": Loss(GRAVITY, 5.0, 0.0),
    "gamma = 5, wall 10, g = 9.81": Loss(GRAVITY, 5.0, 10.0),
}


@dataclass(frozen=True)
class Echo:
    """What the sensor and the last bead report of one run."""

    flight: Flight
    sensor: int = SENSOR
    prominence: float = 0.02

    @cached_property
    def seen(self) -> list[waves.Peak]:
        return waves.peaks(self.flight.sensor(self.sensor), self.flight.until, self.prominence)

    @property
    def ratio(self) -> float:
        """AR of the primary reflected wave."""
        return self.seen[1].height / self.seen[0].height

    @property
    def delay(self) -> float:
        """Its TOF, s."""
        return self.seen[1].time - self.seen[0].time

    @property
    def secondary(self) -> waves.Peak | None:
        """The highest wave after the primary one within half a millisecond, where there is one."""
        late = [one for one in self.seen[2:] if one.time < self.seen[1].time + 0.5e-3]
        return max(late, key=lambda one: one.height, default=None)

    @property
    def last(self) -> int:
        return self.flight.line.contacts - 1

    @cached_property
    def deepest(self) -> waves.Peak:
        """When the last bead is farthest, s, and how far from its rest, m."""
        rest = float(self.flight.places(0.0)[self.last])
        times = np.arange(0.0, self.flight.until, waves.STEP)
        at = times[np.argmax(self.flight.places(times)[:, self.last])]
        top = waves.refined(lambda t: self.flight.places(t)[..., self.last], at)
        return waves.Peak(top.time, top.height - rest)

    def above(self, share: float) -> float:
        """How long the wall's force is above this share of its peak around its peak, s."""
        force = self.flight.contact(self.last)
        top = max(waves.peaks(force, self.flight.until), key=lambda one: one.height)
        inside = waves.crossings(force, share * top.height, self.flight.until)
        return min(t for t in inside if t > top.time) - max(t for t in inside if t < top.time)

    def energies(self) -> tuple[float, float, float]:
        """At the last bead's deepest point: in the wall's spring, in all springs, and in all with motion, J."""
        line, time = self.flight.line, self.deepest.time
        approach = np.maximum(line.approaches(self.flight.places(time)), 0.0)
        stored = 0.4 * line.law(approach) * approach
        moving = 0.5 * float(np.sum(line.mass * self.flight.speeds(time) ** 2))
        return float(stored[-1]), float(stored.sum()), float(stored.sum()) + moving


def under(loss: Loss, mass: Numbers | Sequence[Numbers], stiffness: Numbers, bonds: Numbers | None = None) -> Line:
    """A line with these losses and this gravity."""
    return hertzian(mass, stiffness, bonds=bonds, gravity=loss.gravity, dashpot=loss.pots, pulls=loss.pulls)


def on_wall(wall: Material, loss: Loss, tolerance: float) -> Flight:
    """The chain of section 6.1 on a half-space, struck after a drop of 1 cm."""
    mass, stiffness = row(BEADS, MASS, CONTACT, on_half_space(RADIUS, STEEL, wall))
    return under(loss, mass, stiffness).strike(DROP, UNTIL, tolerance)


@lru_cache
def echo(wall: str, loss: str, tolerance: float) -> Echo:
    return Echo(on_wall(WALLS[wall], LOSSES[loss], tolerance))


def time_of_flight(wall: Material, behind: float = BEHIND) -> float:
    """Equation 6.20, s."""
    stiffness = on_half_space(RADIUS, STEEL, wall)
    return (CONTACT_TIME * stiffness**-0.4 + 2.0 * TRANSIT * behind * CONTACT**-0.4) * (MASS**2 / DROP) ** 0.2


MAIN = ("undamped, g = 0", "undamped, g = 9.81", "gamma = 5, wall 0, g = 9.81")
"""Variants of what is not read for all of them."""


def _wall_entries(wall: str, depth: str, contact: str, shares: Sequence[float]) -> None:
    """Displacement and contact time of the last bead on a wall."""

    @chapter.entry(f"wall_disp_{wall}", depth, "um", "largest displacement of the last bead from its rest")
    def displacement(effort: Effort) -> Variants:
        return {loss: echo(wall, loss, effort.tolerance).deepest.height * 1e6 for loss in LOSSES}

    @chapter.entry(
        f"contact_{wall}", contact, "us", "wall's force above a share of its peak; 6.8 with the striker's speed"
    )
    def duration(effort: Effort) -> Variants:
        stiffness = on_half_space(RADIUS, STEEL, WALLS[wall])
        found = {"equation 6.8": CONTACT_TIME * (MASS**2 / (DROP * stiffness**2)) ** 0.2 * 1e6}
        for loss in MAIN:
            for share in shares:
                found[f"{loss}, above {share:.1%}"] = echo(wall, loss, effort.tolerance).above(share) * 1e6
        return found


_wall_entries("steel", "4.39", "85", (0.001, 0.01, 0.05))
_wall_entries("ptfe", "16.66", "241", (0.01, 0.05, 0.2))


@chapter.entry("ptfe_collision_times", "450 561", "us", "PTFE: bead 19 meets bead 20 twice after the incident wave")
def ptfe_collision_times(effort: Effort) -> Variants:
    """The force between them peaks, or begins: it rises through 0.1 N."""
    found = {}
    for loss in LOSSES:
        flight = echo("ptfe", loss, effort.tolerance).flight
        force = flight.contact(BEADS - 1)
        found[f"{loss}, peaks"] = [one.time * 1e6 for one in waves.peaks(force, flight.until)[1:3]]
        # Every second crossing is a rise, and the first one is the incident wave's.
        found[f"{loss}, beginnings"] = [t * 1e6 for t in waves.crossings(force, 0.1, flight.until)[2:6:2]]
    return found


@chapter.entry("ptfe_max_compression_time", "450", "us", "PTFE: when the last bead is farthest, from the impact")
def ptfe_max_compression_time(effort: Effort) -> Variants:
    return {loss: echo("ptfe", loss, effort.tolerance).deepest.time * 1e6 for loss in LOSSES}


def _ratio_entry(wall: str, printed: str) -> None:
    @chapter.entry(
        f"AR_psw_{wall}_exp", printed, "1", "sensor in bead 7, dynamic forces where not said; thesis by experiment"
    )
    def ratio(effort: Effort) -> Variants:
        found = {loss: echo(wall, loss, effort.tolerance).ratio for loss in LOSSES}
        for loss in LOSSES:
            one = echo(wall, loss, effort.tolerance)
            if LOSSES[loss].gravity:
                weight = float(np.mean(one.flight.static[SENSOR - 1 : SENSOR + 1]))
                found[f"{loss}, with the weight"] = (one.seen[1].height + weight) / (one.seen[0].height + weight)
        return found


_ratio_entry("steel", "0.77")
_ratio_entry("ptfe", "0.421")


def _flight_entry(wall: str, printed: str) -> None:
    @chapter.entry(f"TOF_psw_{wall}", printed, "ms", "sensor in bead 7, peak to peak; equation 6.20 with N = 13")
    def delay(effort: Effort) -> Variants:
        found = {"equation 6.20": time_of_flight(WALLS[wall]) * 1e3}
        return found | {loss: echo(wall, loss, effort.tolerance).delay * 1e3 for loss in LOSSES}


_flight_entry("steel", "0.483")
_flight_entry("ptfe", "0.616")


@chapter.entry("TOF_increase_pct", "45", "%", "TOF on PTFE over TOF on steel, less one")
def TOF_increase_pct(effort: Effort) -> Variants:
    def more(ptfe: float, steel: float) -> float:
        return (ptfe / steel - 1.0) * 100.0

    found = {"printed 0.616 over 0.483": more(0.616, 0.483), "equation 6.20": more(*map(time_of_flight, (PTFE, STEEL)))}
    return found | {
        loss: more(*(echo(wall, loss, effort.tolerance).delay for wall in ("ptfe", "steel"))) for loss in LOSSES
    }


@chapter.entry(
    "ssw_delay", "0.1", "ms", "PTFE, sensor in bead 7: highest wave after the primary reflected one, less that"
)
def ssw_delay(effort: Effort) -> Variants:
    found = {}
    for loss in LOSSES:
        one = echo("ptfe", loss, effort.tolerance)
        if one.secondary is not None:
            found[loss] = (one.secondary.time - one.seen[1].time) * 1e3
    return found


def _energy_entry(wall: str, printed: str) -> None:
    @chapter.entry(f"PE_fraction_{wall}", printed, "1", "at the last bead's deepest point; which energy by the variant")
    def fraction(effort: Effort) -> Variants:
        found = {}
        for loss in MAIN:
            at_wall, stored, total = echo(wall, loss, effort.tolerance).energies()
            given = 0.5 * MASS * DROP**2
            found[f"{loss}, wall over the striker's energy"] = at_wall / given
            found[f"{loss}, wall over what is left"] = at_wall / total
            found[f"{loss}, all contacts over what is left"] = stored / total
        return found


_energy_entry("steel", "0.825")
_energy_entry("ptfe", "0.917")


@chapter.entry("E_critical_ratio", "0.55", "1", "E_w/E at which A_w = A_c, equal Poisson's ratios (equation 6.22)")
def E_critical_ratio(_: Effort) -> Variants:
    return {
        "root of A_w = A_c": critical_modulus() / STEEL.youngs_modulus,
        "1/(2 sqrt(2) - 1)": 1.0 / (2.0 * sqrt(2.0) - 1.0),
    }


def critical_modulus() -> float:
    """Pa."""

    def excess(modulus: float) -> float:
        wall = Material(STEEL.density, modulus, STEEL.poisson_ratio)
        return on_half_space(RADIUS, STEEL, wall) / CONTACT - 1.0

    return float(brentq(excess, 1e9, 1e12, xtol=1.0))


@chapter.entry("E_critical_text", "100", "GPa", "the same with E = 200 GPa; thesis: about 100 GPa")
def E_critical_text(_: Effort) -> Variants:
    return {"440C": critical_modulus() / 1e9}


@lru_cache
def secondary_ratio(modulus: float, gravity: float, tolerance: float) -> float:
    """The highest wave after the primary reflected one over the incident one; 0 where none rises by 0.2 %."""
    wall = Material(STEEL.density, modulus, STEEL.poisson_ratio)
    one = Echo(on_wall(wall, Loss(gravity), tolerance), prominence=0.002)
    return one.secondary.height / one.seen[0].height if one.secondary else 0.0


@chapter.entry(
    "ssw_amplitude_at_E_critical", "0.05", "1", "undamped, nu_w = 0.28, sensor in bead 7, over the incident wave"
)
def ssw_amplitude_at_E_critical(effort: Effort) -> Variants:
    return {
        f"{name}, g = {gravity:g}": secondary_ratio(modulus, gravity, effort.tolerance)
        for name, modulus in (("critical modulus", critical_modulus()), ("30 GPa", 30e9))
        for gravity in (0.0, GRAVITY)
    }


@chapter.entry(
    "reflected_speed_diff_max", "0.05", "1", "steel: 1 - V_ref/V_in between sensors 7 and 16; thesis: below 0.05"
)
def reflected_speed_diff_max(effort: Effort) -> Variants:
    found = {}
    for loss in LOSSES:
        flight = echo("steel", loss, effort.tolerance).flight
        near, far = (Echo(flight, sensor).seen for sensor in (7, 16))
        found[loss] = 1.0 - (far[0].time - near[0].time) / (near[1].time - far[1].time)
    return found


@chapter.entry(
    "incident_arrival_sensor7", "120", "us", "peak of the incident wave in bead 7, from the impact; printed in ms"
)
def incident_arrival_sensor7(effort: Effort) -> Variants:
    return {loss: echo("steel", loss, effort.tolerance).seen[0].time * 1e6 for loss in LOSSES}


@chapter.entry(
    "steel_stiffer_than_ptfe_pct", "57", "%", "what the ratio of moduli, or of contact stiffnesses, makes of it"
)
def steel_stiffer_than_ptfe_pct(_: Effort) -> Variants:
    contacts = on_half_space(RADIUS, STEEL, STEEL) / on_half_space(RADIUS, STEEL, PTFE)
    return {"E, 440C over PTFE": STEEL.youngs_modulus / PTFE.youngs_modulus * 100 - 100, "A_w": contacts * 100 - 100}
