"""Numbers of the thesis that follow from equations alone: chapters 1 and 6, and the speed of its striker."""

from math import sqrt

import numpy as np

import hertzlink as hl
from hertzlink.studies.table import Row, Rows

row = Rows("closed_forms")
# Beads of a chain, a bead at which the wave has its final form, the striker's speed, m/s, which dents no bead, and the
# length of the record, s.
LONG_CHAIN, FAR, SLOW, UNTIL = 40, 30, 0.05, 2.2e-3


def table() -> list[Row]:
    """Return the constants of sections 1.3, 1.5, 6.1.1 and 6.2.1, computed from the equations of the library."""
    return [*_long_waves(), *_contact()]


def _long_waves() -> list[Row]:
    bead = hl.Sphere(4.76e-3, hl.STEEL_316)
    plane, density = bead.material.youngs_modulus / (1.0 - bead.material.poisson_ratio**2), bead.material.density
    stiffness = plane * sqrt(2.0 * bead.radius) / 3.0
    chain = hl.theory.UniformChain(bead.size, bead.mass, stiffness)
    twice, once = hl.contact_law(bead, bead).force(np.array([2e-6, 1e-6]))
    # The group of quantities in equations 1.9 and 1.10, for a force of 1 N.
    group = (4.0 * plane**2 / (bead.size**2 * density**3)) ** (1.0 / 6.0)
    return [
        row("exponent of Hertz's law", float(np.log2(twice / once))),
        row("factor of the speed with preload, equation 1.9", float(chain.sound_speed(1.0)) / group),
        row("factor of the speed without preload, equation 1.10", float(chain.wave_speed_from_force(1.0)) / group),
        row("width of the wave, equation 1.8", chain.width / bead.size),
    ]


def _contact() -> list[Row]:
    bead, speed = hl.Sphere(4.76e-3, hl.STEEL_440C), 1.0
    by_particle = float(hl.theory.UniformChain(bead.size, bead.mass, 1.0).wave_speed_from_particle_speed(speed))
    group = bead.radius * (speed / bead.mass**2) ** 0.2
    one_way = 0.5 * float(hl.theory.UniformChain(1.0, 1.0, 1.0).transit_time(1, speed))
    collision = float(hl.theory.hertz_contact_time(1.0, 1.0, speed))
    run = hl.CoSimulation(hl.Chain([bead] * LONG_CHAIN, bead, SLOW), None).run(UNTIL, save_every=2.5e-7)
    moved = run.velocity.sel(bead=FAR)
    return [
        row("factor of the contact time, equation 6.8", collision),
        row("speed of particles over the striker's, equation 6.16", float(moved.max()) / SLOW, FAR),
        row("factor of the wave's speed, equation 6.13", by_particle / group),
        row("factor of the transit time, equation 6.17", one_way),
        row("factor of the transit there and back, equation 6.20", 2.0 * one_way),
        row("factor of τ_t, equation 6.39", (np.pi / 2.0) ** 0.4 * one_way),
        row("smallest dimensionless contact time τ_c, equation 6.38", collision),
        row("speed of the striker after a drop of 10 mm", hl.drop_speed(0.01)),
    ]
