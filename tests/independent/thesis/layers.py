"""Sections 6.1.3 and 6.1.4: a steel cylinder glued on a PTFE cylinder, R = 9.525 mm, the base fixed.

Equations 6.25 to 6.34, and two models of the layers under the chain: the steel as a rigid mass on the PTFE as a spring
without mass (equation 6.31), and both as one-dimensional rods.
"""

from functools import lru_cache
from math import pi, sqrt

import numpy as np

from .line import Numbers, on_rods, rod_cells, row
from .materials import GRAVITY, PTFE, on_half_space
from .rods import BEADS, BEHIND, CONTACT, DROP, MASS, RADIUS, STEEL, Echo, Loss, under
from .theory import CONTACT_TIME, TRANSIT
from .values import Chapter, Effort, Variants

upper = Chapter("layers_set3_upper")

AREA = pi * 9.525e-3**2
UPPER, LOWER = (6.35, 101.6), 25.4
"""mm, set 3: the ends of the range, and the lower layer."""
THIN, LOWER_LENGTHS = 6.35, (9.52, 25.4, 152.4)
"""mm, set 4."""
MODELS = {
    "mass on spring, undamped, g = 0": (False, Loss(0.0)),
    "rods, undamped, g = 0": (True, Loss(0.0)),
    "rods, undamped, g = 9.81": (True, Loss(GRAVITY)),
    "rods, gamma = 5, g = 9.81": (True, Loss(GRAVITY, 5.0, 5.0)),
    "rods, gamma = 5, no pull, g = 9.81": (True, Loss(GRAVITY, 5.0, 5.0, pulls=False)),
}
"""Rods, or mass and spring; gravity and dashpots."""


def upper_mass(length: float) -> float:
    """M_u, kg, of a length in mm."""
    return STEEL.density * AREA * length * 1e-3


def lower_stiffness(length: float) -> float:
    """k_d, N/m, of a length in mm."""
    return PTFE.youngs_modulus * AREA / (length * 1e-3)


def restitution(length: float) -> float:
    """Equation 6.25, its magnitude."""
    return (upper_mass(length) - MASS) / (upper_mass(length) + MASS)


def amplitude_ratio(length: float) -> float:
    """Equations 6.26 and 6.24."""
    return float(restitution(length) ** 1.2)


def primary_time(length: float) -> float:
    """Equation 6.29, s."""
    wall = CONTACT_TIME * on_half_space(RADIUS, STEEL, STEEL) ** -0.4
    transit = TRANSIT * BEHIND * CONTACT**-0.4 * (1.0 + restitution(length) ** -0.2)
    return float((wall + transit) * (MASS**2 / DROP) ** 0.2)


def layer_time(upper_length: float, lower_length: float, share: float = 0.0) -> float:
    """Equation 6.32, s, with a share of the lower layer's mass added to the upper one's."""
    below = PTFE.density * AREA * lower_length * 1e-3
    return pi * sqrt((upper_mass(upper_length) + share * below) / lower_stiffness(lower_length))


def stack(rods: bool, upper_length: float, lower_length: float, cell: float) -> tuple[Numbers, Numbers]:
    """Masses and bonds below the last contact."""
    if not rods:
        return np.array([upper_mass(upper_length)]), np.array([lower_stiffness(lower_length)])
    steel = rod_cells(upper_length * 1e-3, AREA, STEEL.density, STEEL.youngs_modulus, cell)
    # Waves in PTFE are six times slower, and so are its cells shorter.
    ptfe = rod_cells(lower_length * 1e-3, AREA, PTFE.density, PTFE.youngs_modulus, cell / 4.0)
    return on_rods([steel, ptfe])


@lru_cache
def echo(upper_length: float, lower_length: float, model: str, effort: Effort, until: float = 1.15e-3) -> Echo:
    """The chain on layers of these lengths, mm; the time, s, is enough for secondary waves."""
    rods, loss = MODELS[model]
    mass, stiffness = row(BEADS, MASS, CONTACT, on_half_space(RADIUS, STEEL, STEEL))
    nodes, bonds = stack(rods, upper_length, lower_length, effort.cell * 1e-3)
    return Echo(under(loss, [mass, nodes], stiffness, bonds).strike(DROP, until, effort.tolerance))


def secondary_ratio(one: Echo) -> float:
    """Over the incident wave; 0 where no later wave rises by 2 %."""
    return one.secondary.height / one.seen[0].height if one.secondary else 0.0


@upper.entry("AR_psw", "0.428 0.769", "1", "L_u = 6.35 and 101.6 mm, L_l = 25.4 mm; thesis by experiment")
def AR_upper(effort: Effort) -> Variants:
    found = {"equations 6.26 and 6.24": [amplitude_ratio(length) for length in UPPER]}
    return found | {m: [echo(length, LOWER, m, effort).ratio for length in UPPER] for m in MODELS}


@upper.entry(
    "AR_ssw",
    "0.3 0.0",
    "1",
    "L_u = 6.35 and 101.6 mm, L_l = 25.4 mm; highest later wave within 0.5 ms; thesis by experiment",
)
def AR_secondary(effort: Effort) -> Variants:
    return {m: [secondary_ratio(echo(length, LOWER, m, effort)) for length in UPPER] for m in MODELS}


@upper.entry("TOF_psw_reduction_pct", "3.19", "%", "from L_u = 6.35 to 101.6 mm")
def TOF_reduction(effort: Effort) -> Variants:
    def less(first: float, second: float) -> float:
        return (1.0 - second / first) * 100.0

    found = {"equation 6.29": less(*map(primary_time, UPPER))}
    return found | {m: less(*(echo(length, LOWER, m, effort).delay for length in UPPER)) for m in MODELS}


@upper.entry("TOF_ssw", "0.619 0.821", "ms", "L_u = 6.35 and 101.6 mm; equation 6.34; thesis by experiment")
def TOF_secondary(_: Effort) -> Variants:
    return {
        name: [(primary_time(length) + layer_time(length, LOWER, share)) * 1e3 for length in UPPER]
        for name, share in (("equation 6.34", 0.0), ("with a third of the lower mass in 6.32", 1.0 / 3.0))
    }


@upper.entry(
    "TOF_ssw/L_u_6p35", "0.619", "ms", "L_u = 6.35 mm: highest later wave in bead 7 of the chain, within 0.5 ms"
)
def TOF_secondary_of_chain(effort: Effort) -> Variants:
    found = {}
    for model in MODELS:
        one = echo(UPPER[0], LOWER, model, effort)
        if one.secondary is not None:
            found[model] = (one.secondary.time - one.seen[0].time) * 1e3
    return found
