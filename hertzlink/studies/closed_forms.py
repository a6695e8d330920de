"""Numbers of the thesis that follow from equations alone: chapters 1 and 6, and the speed of its striker."""

from math import sqrt

import numpy as np

from coupling.cosimulation import CoSimulation
from hertzlink.studies.table import Row
from particles.bead import Sphere, drop_speed
from particles.chain import Chain
from particles.laws.formulas import contact_law
from particles.solitary import (
    sound_speed,
    transit_time_from_striker,
    wave_speed_from_force,
    wave_speed_from_particle_speed,
    width,
)
from structures.layers import contact_time
from structures.material import STEEL_316, STEEL_440C

LONG_CHAIN, FAR, SLOW, UNTIL = 40, 30, 0.05, 2.2e-3
"""Beads of a chain, a bead at which the wave has its final form, the striker's speed, m/s, which dents no bead, and the
length of the record, s.
"""


def table() -> list[Row]:
    """The constants of sections 1.3, 1.5, 6.1.1 and 6.2.1, computed from the equations of the library."""
    return [*_long_waves(), *_contact()]


def _long_waves() -> list[Row]:
    bead = Sphere(4.76e-3, STEEL_316)
    plane, density = bead.material.youngs_modulus / (1.0 - bead.material.poisson_ratio**2), bead.material.density
    stiffness = plane * sqrt(2.0 * bead.radius) / 3.0
    given = bead.size, bead.mass, stiffness
    # The group of quantities in equations 1.9 and 1.10, for a force of 1 N.
    group = (4.0 * plane**2 / (bead.size**2 * density**3)) ** (1.0 / 6.0)
    return [
        Row("exponent of Hertz's law", 1.5, float(np.log2(_force(2e-6) / _force(1e-6))), "",
            "equation 1.1; the slope of ln F over ln δ of the law between two spheres"),
        Row("factor of the speed with preload, equation 1.9", 0.9314, float(sound_speed(*given, 1.0)) / group, "",
            "from the speed of sound, the limit of 1.9 for small waves"),
        Row("factor of the speed without preload, equation 1.10", 0.6802,
            float(wave_speed_from_force(*given, 1.0)) / group, "", "from equation 5.11"),
        Row("width of the wave, equation 1.8", "about 5", width(bead.size) / bead.size, "D", "π √10/2"),
    ]  # fmt: skip


def _force(approach: float) -> float:
    bead = Sphere(4.76e-3, STEEL_316)
    return float(contact_law(bead, bead).force(np.array(approach)))


def _contact() -> list[Row]:
    bead, speed = Sphere(4.76e-3, STEEL_440C), 1.0
    by_particle = float(wave_speed_from_particle_speed(bead.size, bead.mass, 1.0, speed))
    group = bead.radius * (speed / bead.mass**2) ** 0.2
    one_way = 0.5 * float(transit_time_from_striker(1, 1.0, 1.0, speed))
    collision = float(contact_time(1.0, 1.0, speed))
    return [
        Row("factor of the contact time, equation 6.8", 3.218, collision, "", "2 (5/4)^{2/5} √π Γ(7/5)/Γ(9/10)"),
        Row("speed of particles over the striker's, equation 6.16", 0.682, _particle_speed(), "",
            f"simulated: the greatest speed of bead {FAR}"),
        Row("factor of the wave's speed, equation 6.13", 1.829, by_particle / group, "", "2 (16/25)^{1/5}"),
        Row("factor of the transit time, equation 6.17", "1.180", one_way, "", "from 6.13 and 6.16"),
        Row("factor of the transit there and back, equation 6.20", 2.361, 2.0 * one_way, "", "for e = 1"),
        Row("factor of τ_t, equation 6.39", 1.414, (np.pi / 2.0) ** 0.4 * one_way, "",
            "that of 6.17 with m/k of spheres, (π/2) ρ D^{5/2} (1 − ν²)/E"),
        Row("smallest dimensionless contact time τ_c, equation 6.38", 3.218, collision, "", "that of equation 6.8"),
        Row("speed of the striker after a drop of 10 mm", "", drop_speed(0.01), "m/s", "√(2 g h), section 2.4"),
    ]  # fmt: skip


def _particle_speed() -> float:
    """Greatest speed of a bead far from the striker, over the striker's."""
    bead = Sphere(4.76e-3, STEEL_440C)
    run = CoSimulation(Chain([bead] * LONG_CHAIN, bead, SLOW), None).run(UNTIL, save_every=2.5e-7)
    return float(run.velocity.sel(bead=FAR).max()) / SLOW
