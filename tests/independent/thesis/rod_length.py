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


@chapter.entry(
    "AR_numeric_drop",
    "0.764 0.734",
    "1",
    "L = 6.35 and 609.6 mm; the lengths of the thesis's two numbers are not named",
)
def AR_numeric_drop(effort: Effort) -> Variants:
    return {loss: [curve(loss, effort)[0], curve(loss, effort)[-1]] for loss in LOSSES}
