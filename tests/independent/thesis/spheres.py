"""Chapters 3 and 4: chains of spheres of steel 316, R = 2.38 mm, without and with losses."""

from functools import lru_cache
from itertools import pairwise
from math import log, pi

import numpy as np

from . import waves
from .line import Flight, hertzian, row
from .materials import BRASS, GRAVITY, PTFE, STEEL_316, Material, between_spheres, on_half_space, sphere_mass
from .values import Chapter, Effort, Variants

fem = Chapter("fem_validation")
losses = Chapter("dissipation_table_4_1")

RADIUS = 2.38e-3
SIZE = 2.0 * RADIUS
CONTACT = between_spheres(RADIUS, STEEL_316)
WALL = on_half_space(RADIUS, STEEL_316, STEEL_316)
MASS = sphere_mass(RADIUS, STEEL_316)
GRAVITIES = {"g = 0": 0.0, "g = 9.81": GRAVITY}

SENSORS = (9, 16, 24, 31, 40, 50, 56, 63)
FAST = 1.77
"""m/s, the striker of chapter 4."""
TABLE_MASS = 0.45e-3
"""kg, Table 4.1."""
DRAG = 6900.0
"""1/s, α₁ of section 4.3."""
GAMMA, ALPHA = 5.58, 1.81
"""|γ| and α of steel in Table 4.1."""


@lru_cache
def flight(speed: float, gravity: float, tolerance: float) -> Flight:
    """20 beads against a wall of their own material."""
    return hertzian(*row(20, MASS, CONTACT, WALL), gravity=gravity).strike(speed, 0.25e-3, tolerance)


def speeds(striker: float, effort: Effort) -> dict[str, float]:
    """Wave speeds by gravity and pair of sensors, m/s."""
    return {
        f"{name}, sensors {pair[0]} and {pair[1]}": waves.speed(flight(striker, g, effort.tolerance), pair, SIZE)
        for name, g in GRAVITIES.items()
        for pair in ((10, 15), (7, 16))
    }


def by_force(force: float) -> float:
    """Equation 1.10, m/s, with the coefficient of 5.11."""
    return SIZE * (0.8 * CONTACT ** (2.0 / 3.0) / MASS) ** 0.5 * force ** (1.0 / 6.0)


@fem.entry("V_v0p63_dpm", "635", "m/s", "v = 0.63 m/s; thesis: beads 10 and 15, vertical chain of 20")
def V_v0p63_dpm(effort: Effort) -> Variants:
    top = waves.peaks(flight(0.63, 0.0, effort.tolerance).contact(12), 0.25e-3)[0].height
    return speeds(0.63, effort) | {"equation 1.10 at the contact force, g = 0": by_force(top)}


@fem.entry("F_v0p50_dpm", "20.5", "N", "v = 0.5 m/s; highest force in the contact of beads 15 and 16")
def F_v0p50_dpm(effort: Effort) -> Variants:
    found = {}
    for name, gravity in GRAVITIES.items():
        one = flight(0.5, gravity, effort.tolerance)
        top = waves.peaks(one.contact(15), one.until)[0].height
        found[name] = top
        if gravity:
            found[f"{name}, with the weight"] = top + float(one.static[15])
    return found


@fem.entry("V_v0p50_dpm", "560", "m/s", "v = 0.5 m/s; the sensors are not named")
def V_v0p50_dpm(effort: Effort) -> Variants:
    return speeds(0.5, effort) | {"equation 1.10 at 20.5 N": by_force(20.5)}


def horizontal(
    mass: float, drag: float, diffusion: tuple[float, float] | None, tolerance: float, speed: float = FAST
) -> Flight:
    """The 70 beads of chapter 4, without gravity along the chain."""
    masses, contacts = row(70, mass, CONTACT, CONTACT)
    return hertzian(masses, contacts, drag=drag, diffusion=diffusion).strike(speed, 0.75e-3, tolerance)


LOSSES: dict[str, tuple[float, float, tuple[float, float] | None]] = {
    "undamped, m = 0.45 g": (TABLE_MASS, 0.0, None),
    "undamped, rho = 8000": (MASS, 0.0, None),
    "drag 6900/s, m = 0.45 g": (TABLE_MASS, DRAG, None),
    "drag 6900/s, rho = 8000": (MASS, DRAG, None),
    "equation 4.1, |gamma|/m, m = 0.45 g": (TABLE_MASS, 0.0, (GAMMA / TABLE_MASS, ALPHA)),
    "equation 4.1, |gamma|, m = 0.45 g": (TABLE_MASS, 0.0, (GAMMA, ALPHA)),
}
"""Mass, kg; drag, 1/s; γ and α of equation 4.1, read as a force over the mass and as an acceleration."""


@lru_cache
def incident_waves(name: str, tolerance: float) -> tuple[waves.Peak, ...]:
    """At the eight sensors."""
    mass, drag, diffusion = LOSSES[name]
    one = horizontal(mass, drag, diffusion, tolerance)
    return tuple(waves.incident(one, bead) for bead in SENSORS)


@losses.entry("rayleigh_alpha1/forces", "", "N", "v = 1.77 m/s, 70 beads, g = 0; sensors 9, 16, 24, 31, 40, 50, 56, 63")
def rayleigh_alpha1(effort: Effort) -> Variants:
    """The thesis prints α₁ = 6900 and shows the decay in figure 4.3 only."""
    wanted = [name for name in LOSSES if not name.startswith("equation")]
    return {name: [one.height for one in incident_waves(name, effort.tolerance)] for name in wanted}


@losses.entry("steel_316/forces", "", "N", "as rayleigh_alpha1/forces; alpha = 1.81, |gamma| = 5.58 in all contacts")
def equation_4_1(effort: Effort) -> Variants:
    """Equation 4.1 with |γ|, as printed it feeds energy. γ has no stated unit: a force, or an acceleration."""
    wanted = [name for name in LOSSES if name.startswith("equation")]
    return {name: [one.height for one in incident_waves(name, effort.tolerance)] for name in wanted}


@losses.entry(
    "steel_316/beta", "", "1", "largest contact force over largest sensor force (equation 3.2), far from the ends"
)
def beta(effort: Effort) -> Variants:
    one = horizontal(MASS, 0.0, None, effort.tolerance)
    return {"undamped": waves.peaks(one.contact(40), one.until)[0].height / waves.incident(one, 40).height}


@losses.entry("speed_force_exponent", "0.17", "1", "slope of log V over log F, g = 0")
def speed_force_exponent(effort: Effort) -> Variants:
    """Two strikers on an undamped chain, and one chain with losses: neighbouring sensors, and their mean force."""
    slow, fast = (flight(v, 0.0, effort.tolerance) for v in (0.5, 0.63))
    tops = [waves.incident(one, 12).height for one in (slow, fast)]
    ratio = waves.speed(fast, (10, 15), SIZE) / waves.speed(slow, (10, 15), SIZE)
    found = {"undamped, two strikers": log(ratio) / log(tops[1] / tops[0])}
    for name in ("drag 6900/s, m = 0.45 g", "equation 4.1, |gamma|/m, m = 0.45 g"):
        crests = incident_waves(name, effort.tolerance)
        pairs = list(pairwise(crests))
        between = [SIZE * (j - i) for i, j in pairwise(SENSORS)]
        logs = [log(d / (b.time - a.time)) for d, (a, b) in zip(between, pairs, strict=True)]
        forces = [0.5 * log(a.height * b.height) for a, b in pairs]
        found[name] = float(np.polyfit(forces, logs, 1)[0])
    return found


def _mass_entry(name: str, printed: str, material: Material) -> None:
    @losses.entry(f"{name}/m_g", printed, "g", "a sphere of R = 2.38 mm with the density of Table 2.1")
    def mass(_: Effort) -> Variants:
        return {"from dimensions": 4.0 / 3.0 * pi * RADIUS**3 * material.density * 1e3}


for _name, _printed, _material in (("steel_316", "0.45", STEEL_316), ("ptfe", "0.123", PTFE), ("brass", "0.48", BRASS)):
    _mass_entry(_name, _printed, _material)
