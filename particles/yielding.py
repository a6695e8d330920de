"""Contact pressures beyond yield: where beads would dent, which elastic contact laws leave out."""

from collections.abc import Sequence
from functools import lru_cache
from math import inf, pi, sqrt

from particles.bead import Bead, Cylinder
from particles.moving import MovingChain
from structures.material import Material
from structures.structure import Vector
from structures.surface import Surface, hertz_pressure, relative_curvatures, yield_pressure

Side = Bead | Surface

OF_HERTZ = 1.0 / 3.0
"""Power of the force in the pressure of a round or elliptic contact."""


def yields(chains: Sequence[MovingChain], forces: Sequence[Vector]) -> list[str]:
    """A finding where peak contact forces, N, of each chain, press any body beyond yield; of the worst contact."""
    worst, beyond, known = (1.0, "", ""), 0, dict[tuple[int, int], tuple[float, float, float]]()
    for number, (chain, force) in enumerate(zip(chains, forces, strict=True)):
        for i, pair in enumerate(chain.pairs):
            # Contacts whose law yields leave nothing out.
            if pair is None or (chain.yielding is not None and chain.yielding[i] is not None):
                continue
            key = id(pair[0]), id(pair[1])
            if key not in known:
                known[key] = _pressure(*pair)
            unit, power, limit = known[key]
            if not force[i] > 0.0 or limit == inf:
                continue
            pressure = unit * float(force[i]) ** power
            beyond += pressure > limit
            if pressure / limit > worst[0]:
                where = f"contact {i + 1}" + (f" of chain {number}" if len(chains) > 1 else "")
                weaker = _weaker(*pair)
                text = (
                    f"{1e-9 * pressure:.2g} GPa at {where} is {pressure / limit:.3g} times the pressure at which "
                    f"{weaker.name or 'the weaker material'} begins to yield"
                )
                worst = pressure / limit, text, _cure(chain, power, pressure / limit, weaker, where)
    if not beyond:
        return []
    count = sum(pair is not None for chain in chains for pair in chain.pairs)
    many = f"{beyond} of {count} contacts {'is' if beyond == 1 else 'are'} beyond yield, and bodies would be dented"
    return [f"yield: {worst[1]}; {many} there; {worst[2]}"]


def _cure(chain: MovingChain, power: float, ratio: float, weaker: Material, where: str) -> str:
    """What keeps a contact from yielding, whose pressure is so many times the one at which it begins."""
    strength = f"{where} needs a yield strength of {1e-9 * ratio * float(weaker.yield_strength or 0.0):.2g} GPa"
    # Forces of Hertz grow with the speed's power 6/5; a preload, or another law, has no such rule.
    if power != OF_HERTZ or not chain.chain.speed > 0.0 or chain.static_force.any():
        return strength
    speed = chain.chain.speed * ratio ** (-5.0 / (6.0 * power))
    return f"none yields below an impact speed of about {speed:.2g} m/s; {strength}"


def _pressure(first: Side, second: Side) -> tuple[float, float, float]:
    """p₀ = unit · F^power, Pa, of two bodies; and that from which the weaker one yields, infinite where not known."""
    one, other = (side if isinstance(side, Surface) else side.surface for side in (first, second))
    length = min((side.length for side in (first, second) if isinstance(side, Cylinder)), default=inf)
    return _pressure_of_surfaces(one, other, length)


@lru_cache(maxsize=256)
def _pressure_of_surfaces(one: Surface, other: Surface, length: float) -> tuple[float, float, float]:
    """The same; length, m, of a line contact. Kept, as thousands of runs have the same beads."""
    limit = min(yield_pressure(one.material), yield_pressure(other.material))
    if limit == inf:
        return 0.0, 1.0, inf
    try:
        flat, sharp = relative_curvatures(one, other)
    except ValueError:
        # Bodies that conform have a law of the user's own, and no pressure of Hertz's.
        return 0.0, 1.0, inf
    if flat > 1e-12 * sharp:
        return hertz_pressure(one, other, 1.0), OF_HERTZ, limit
    modulus = 1.0 / (1.0 / one.material.contact_modulus + 1.0 / other.material.contact_modulus)
    return sqrt(modulus * sharp / (pi * length)), 0.5, limit


def _weaker(first: Side, second: Side) -> Material:
    """The material that yields first."""
    materials = [(side if isinstance(side, Surface) else side.surface).material for side in (first, second)]
    return min(materials, key=yield_pressure)
