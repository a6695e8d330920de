"""Contact pressures beyond yield: where beads would dent, which elastic contact laws leave out."""

from functools import lru_cache
from math import inf, pi, sqrt

import numpy as np

from particles.bead import Bead, Cylinder
from particles.contacts import once_per_pair
from particles.moving import MovingChain
from structures.material import Material
from structures.structure import Vector
from structures.surface import Surface, hertz_pressure, relative_curvatures, yield_pressure

Side = Bead | Surface

NO_PRESSURE = 0.0, 1.0, inf
"""Factor, power and limit of a contact whose pressure is not known, or leaves nothing out."""

OF_HERTZ = 1.0 / 3.0
"""Power of the force in the pressure of a round or elliptic contact."""


def overloads(chain: MovingChain, force: Vector) -> Vector:
    """Return the pressure of each contact at these forces, N, over that at which it yields; zero where nothing is left
    out."""
    unit, power, limit = chain.once("pressures", lambda: _pressures(chain))
    ratios: Vector = unit * np.maximum(force, 0.0) ** power / limit
    return ratios


def _pressures(chain: MovingChain) -> Vector:
    """Return the factor and the power of each contact's force in the pressure, and the pressure at which it yields."""
    # Contacts whose law yields leave nothing out.
    yields = [*map(bool, chain.yielding or [None] * len(chain.pairs))]
    elastic = [None if beyond else pair for pair, beyond in zip(chain.pairs, yields, strict=True)]
    pressures = once_per_pair(elastic, lambda pair, _: _pressure(*pair))
    return np.array([pressure or NO_PRESSURE for pressure in pressures]).T


def unknown_strengths(chain: MovingChain) -> list[str]:
    """Return a finding for each contact of a law of yielding that takes the strength of the one body for both."""
    materials = dict[str, None]()
    for i, contact in enumerate(chain.yielding or ()):
        pair = chain.pairs[i]
        if pair is None or contact is None or contact.law.yield_strength is not None:
            continue
        taken = contact.bodies.material
        for material in _materials(pair):
            if material.yield_strength is None:
                materials[
                    f"strength: that of {material.name or 'a body'} is not known, and that of "
                    f"{taken.name or 'the other body'}, {1e-6 * contact.bodies.strength:.4g} MPa, is taken where they "
                    "touch; give Material(..., yield_strength=)"
                ] = None
    return list(materials)


def _materials(pair: tuple[Side, Side]) -> list[Material]:
    return [(side if isinstance(side, Surface) else side.surface).material for side in pair]


def slower(chain: MovingChain, contact: int, ratio: float) -> str:
    """Return what keeps a contact from yielding, whose pressure is `ratio` times the one at which it begins."""
    pair = chain.pairs[contact]
    assert pair is not None
    power = _pressure(*pair)[1]
    # Forces of Hertz grow with the speed's power 6/5; a preload, or another law, has no such rule.
    if power != OF_HERTZ or not chain.chain.speed > 0.0 or chain.static_force.any():
        strength = 1e-9 * ratio * float(weaker(chain, contact).yield_strength or 0.0)
        return f"a yield strength of {strength:.2g} GPa would bear it"
    return f"none yields below an impact speed of about {chain.chain.speed * ratio ** (-5.0 / (6.0 * power)):.2g} m/s"


def weaker(chain: MovingChain, contact: int) -> Material:
    """Return the material that yields first."""
    pair = chain.pairs[contact]
    assert pair is not None
    material: Material = chain.once(f"weaker {contact}", lambda: min(_materials(pair), key=yield_pressure))
    return material


def _pressure(first: Side, second: Side) -> tuple[float, float, float]:
    """Return p₀ = unit · F^power, Pa, of two bodies; and that from which the weaker one yields, infinite where not
    known."""
    surface, facing = (side if isinstance(side, Surface) else side.surface for side in (first, second))
    length = min((side.length for side in (first, second) if isinstance(side, Cylinder)), default=inf)
    return _pressure_of_surfaces(surface, facing, length)


@lru_cache(maxsize=256)
def _pressure_of_surfaces(surface: Surface, facing: Surface, length: float) -> tuple[float, float, float]:
    """Return these of two surfaces; length, m, of a line contact. Stored, as thousands of runs have the same beads."""
    limit = min(yield_pressure(surface.material), yield_pressure(facing.material))
    if limit == inf:
        return NO_PRESSURE
    try:
        flat, sharp = relative_curvatures(surface, facing)
    except ValueError:
        return NO_PRESSURE  # bodies that conform have a law of the user's own
    if flat > 1e-12 * sharp:
        return hertz_pressure(surface, facing, 1.0), OF_HERTZ, limit
    modulus = 1.0 / (1.0 / surface.material.contact_modulus + 1.0 / facing.material.contact_modulus)
    return sqrt(modulus * sharp / (pi * length)), 0.5, limit
