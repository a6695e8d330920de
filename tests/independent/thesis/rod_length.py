"""Section 6.1.2: rods of steel 440C, R = 9.53 mm, clamped at the base, of 6.35 to 609.6 mm.

The rod is one-dimensional, by finite differences; the half-space's contact stiffness lies between it and the last bead.
"""

from functools import lru_cache
from math import pi

from .line import on_rods, rod_cells, row
from .materials import GRAVITY, on_half_space
from .rods import BEADS, CONTACT, DROP, MASS, RADIUS, STEEL, Echo, Loss, under
from .theory import CONTACT_TIME
from .values import Chapter, Effort, Variants

chapter = Chapter("rods_set2_length")

AREA = pi * 9.53e-3**2
LENGTHS = (6.35, 50.8, 101.6, 152.4, 609.6)
"""mm."""
LOSSES = {
    "undamped, g = 0": Loss(0.0),
    "undamped, g = 9.81": Loss(GRAVITY),
    "gamma = 5, wall 0, g = 0": Loss(0.0, 5.0, 0.0),
    "gamma = 5, g = 0": Loss(0.0, 5.0, 5.0),
    "gamma = 5, g = 9.81": Loss(GRAVITY, 5.0, 5.0),
    "gamma = 5, no pull, g = 9.81": Loss(GRAVITY, 5.0, 5.0, pulls=False),
}


@lru_cache
def echo(length: float, loss: str, effort: Effort) -> Echo:
    """The chain on a rod of this length, mm."""
    mass, stiffness = row(BEADS, MASS, CONTACT, on_half_space(RADIUS, STEEL, STEEL))
    rod = rod_cells(length * 1e-3, AREA, STEEL.density, STEEL.youngs_modulus, effort.cell * 1e-3)
    nodes, bonds = on_rods([rod])
    return Echo(under(LOSSES[loss], [mass, nodes], stiffness, bonds).strike(DROP, 0.75e-3, effort.tolerance))


def curve(loss: str, effort: Effort) -> list[float]:
    """AR by length."""
    return [echo(length, loss, effort).ratio for length in LENGTHS]


@chapter.entry("characteristic_length", "101", "mm", "c T_c/2 with 6.8, the striker's speed and a steel half-space")
def characteristic_length(_: Effort) -> Variants:
    def length(mass_density: float, speed_density: float) -> float:
        mass = MASS / STEEL.density * mass_density
        contact = CONTACT_TIME * (mass**2 / (DROP * on_half_space(RADIUS, STEEL, STEEL) ** 2)) ** 0.2
        return (STEEL.youngs_modulus / speed_density) ** 0.5 * contact / 2.0 * 1e3

    return {
        "rho = 7800": length(7800.0, 7800.0),
        "rho = 8000": length(8000.0, 8000.0),
        "mass with 8000, c with 7800": length(8000.0, 7800.0),
    }


@chapter.entry("AR_exp_range", "0.73 0.78", "1", "L = 6.35, 50.8, 101.6, 152.4, 609.6 mm; thesis by experiment")
def AR_exp_range(effort: Effort) -> Variants:
    return {loss: curve(loss, effort) for loss in LOSSES}


@chapter.entry("TOF_exp_range", "0.44 0.45", "ms", "L = 6.35, 50.8, 101.6, 152.4, 609.6 mm; thesis by experiment")
def TOF_exp_range(effort: Effort) -> Variants:
    return {loss: [echo(length, loss, effort).delay * 1e3 for length in LENGTHS] for loss in LOSSES}


@chapter.entry(
    "AR_numeric_drop",
    "0.764 0.734",
    "1",
    "L = 6.35 and 609.6 mm; the lengths of the thesis's two numbers are not named",
)
def AR_numeric_drop(effort: Effort) -> Variants:
    return {loss: [curve(loss, effort)[0], curve(loss, effort)[-1]] for loss in LOSSES}


@chapter.entry(
    "AR_drop_max_pct", "5", "%", "largest less smallest AR of the five lengths over the largest; thesis: below 5 %"
)
def AR_drop_max_pct(effort: Effort) -> Variants:
    found = {}
    for loss in LOSSES:
        ratios = curve(loss, effort)
        found[loss] = (1.0 - min(ratios) / max(ratios)) * 100.0
    return found


@chapter.entry("psw_arrival_abs", "0.53", "ms", "peak of the reflected wave in bead 7 from the impact, L = 101.6 mm")
def psw_arrival_abs(effort: Effort) -> Variants:
    return {loss: echo(101.6, loss, effort).seen[1].time * 1e3 for loss in LOSSES}


@chapter.entry(
    "ssw", "", "1", "highest later wave within 0.2 ms over the incident one, largest of the five lengths; thesis: none"
)
def ssw(effort: Effort) -> Variants:
    """Waves of less than 2 % of the incident one are not counted: then 0."""
    found = {}
    for loss in LOSSES:
        ratios = [0.0]
        for length in LENGTHS:
            seen = echo(length, loss, effort).seen
            ratios += [one.height / seen[0].height for one in seen[2:] if one.time < seen[1].time + 0.2e-3]
        found[loss] = max(ratios)
    return found
