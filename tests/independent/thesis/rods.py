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
        """The dashpots of all contacts, that of the wall last."""
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
        """The time, s, at which the last bead is farthest from its rest, and its distance, m."""
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


@lru_cache
def secondary_ratio(modulus: float, gravity: float, tolerance: float) -> float:
    """The highest wave after the primary reflected one over the incident one; 0 where none rises by 0.2 %."""
    wall = Material(STEEL.density, modulus, STEEL.poisson_ratio)
    one = Echo(on_wall(wall, Loss(gravity), tolerance), prominence=0.002)
    return one.secondary.height / one.seen[0].height if one.secondary else 0.0
