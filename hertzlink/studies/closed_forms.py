"""Numbers of the thesis that follow from equations alone: chapters 1 and 6, its materials and its set-ups."""

from collections.abc import Iterator
from math import pi, sqrt

import numpy as np

import hertzlink as hl
from hertzlink.studies.compare import Number, printed

# Beads of a chain, a bead at which the wave has its final form, the striker's speed, m/s, which dents no bead, and the
# length of the record, s.
LONG_CHAIN, FAR, SLOW, UNTIL = 40, 30, 0.05, 2.2e-3


def numbers() -> Iterator[Number]:
    """Yield the constants of sections 1.3, 1.5, 6.1.1 and 6.2.1, computed from the equations of the library."""
    bead, speed = hl.Sphere(4.76e-3, hl.STEEL_316), 1.0
    plane, density = bead.material.youngs_modulus / (1.0 - bead.material.poisson_ratio**2), bead.material.density
    chain = hl.theory.UniformChain(bead.size, bead.mass, plane * sqrt(2.0 * bead.radius) / 3.0)
    twice, once = hl.contact_law(bead, bead).force(np.array([2e-6, 1e-6]))
    yield Number("exponent of Hertz's law", float(np.log2(twice / once)))
    # The group of quantities in equations 1.9 and 1.10, for a force of 1 N.
    group = (4.0 * plane**2 / (bead.size**2 * density**3)) ** (1.0 / 6.0)
    yield Number("factor of the speed with preload, equation 1.9", float(chain.sound_speed(1.0)) / group)
    by_force = float(chain.wave_speed_from_force(1.0)) / group
    yield Number("factor of the speed without preload, equation 1.10", by_force)
    yield Number("width of the wave, equation 1.8", chain.width / bead.size)

    collision = float(hl.theory.hertz_contact_time(1.0, 1.0, speed))
    yield Number("factor of the contact time, equation 6.8", collision)
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    run = hl.CoSimulation(hl.Chain([bead] * LONG_CHAIN, bead, SLOW), None).run(UNTIL, save_every=2.5e-7)
    moved = float(run.velocity.sel(bead=FAR).max()) / SLOW
    yield Number("speed of particles over the striker's, equation 6.16", moved, f"simulated, at bead {FAR}")
    by_particle = hl.theory.UniformChain(bead.size, bead.mass, 1.0).wave_speed_from_particle_speed(speed)
    group = bead.radius * (speed / bead.mass**2) ** 0.2
    yield Number("factor of the wave's speed, equation 6.13", float(by_particle) / group)
    one_way = 0.5 * float(hl.theory.UniformChain(1.0, 1.0, 1.0).transit_time(1, speed))
    yield Number("factor of the transit time, equation 6.17", one_way)
    yield Number("factor of the transit there and back, equation 6.20", 2.0 * one_way)
    yield Number("factor of τ_t, equation 6.39", (pi / 2.0) ** 0.4 * one_way)
    yield Number("smallest dimensionless contact time τ_c, equation 6.38", collision)
    yield Number("speed of the striker after a drop of 10 mm", hl.drop_speed(0.01), "√(2 g h), section 2.4", "m/s")


def set_ups() -> Iterator[Number]:
    """Yield chapter 2 and the set-ups of chapters 3 to 6: inputs, which the studies take over or leave out."""
    for name in printed("set-ups"):
        yield Number(name, "")


def materials() -> Iterator[Number]:
    """Yield the 27 numbers of Table 2.1, densities and elastic constants, from the library of materials."""
    for name in printed("materials"):
        constant, _, material = name.partition(", ")
        of = hl.MATERIALS[material]
        ours = {"density": of.density, "Young's modulus": 1e-9 * of.youngs_modulus, "Poisson's ratio": of.poisson_ratio}
        yield Number(name, ours[constant])
