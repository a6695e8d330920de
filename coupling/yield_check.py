"""The check for yielding in a run with elastic contacts: how far the greatest force of a contact is beyond yield."""

from collections.abc import Iterator, Sequence
from math import inf, pi, sqrt
from operator import itemgetter

import numpy as np

from coupling.recording.frames import Motion
from particles.bead import Cylinder, contact_modulus, surface_of
from particles.contacts import Pair, once_per_pair
from particles.deformable.deformable_chain import DeformableChain
from particles.laws.yielding import JacksonGreen
from particles.moving import MovingChain
from structures.surface import hertz_pressure, relative_curvatures, yield_pressure

SLIGHT = 1.12
"""Largest pressure without a warning, in units of the pressure at which the contact yields; the force is then 1.4 times
the yield force. There, by Jackson and Green's law, AR at bead 10 of 20 is lower by 0.011 to 0.013 on half-spaces, by
0.007 and 0.010 on plates of brass and aluminium, and the incident force by up to 2.5 % where beads yield."""

OF_HERTZ = 1.0 / 3.0  # power of the force in the pressure of a round or elliptic contact
UNKNOWN = 0.0, 1.0, inf  # unit, power and limit of a contact that never yields
CURE = "law=hl.laws.JacksonGreen() in Chain computes it"


def is_of_yield(finding: str) -> bool:
    """Return whether a finding is about yielding that another contact law can compute."""
    return finding.startswith("yield: ") and CURE in finding


def yields(chains: Sequence[MovingChain], motions: Sequence[Motion]) -> Iterator[str]:
    """Yield a finding on the contact that is pressed farthest beyond yield. motions: one for each chain."""
    pressed = []
    for number, (chain, motion) in enumerate(zip(chains, motions, strict=True)):
        unit, power, limit = chain.once("pressures", _pressures)
        ratios = unit * np.maximum(motion.force.max(axis=1), 0.0) ** power / limit
        pressed.append((float(ratios.max()), number, int(ratios.argmax()), float(power[ratios.argmax()])))
    ratio, number, contact, power = max(pressed, key=itemgetter(0))
    if ratio > SLIGHT:
        chain = chains[number]
        where = f"contact {contact + 1}" + (f" of chain {number}" if len(chains) > 1 else "")
        weaker = min((surface_of(side).material for side in chain.pairs[contact] or ()), key=yield_pressure)
        if chain.once("takes a law of yielding", _takes_a_law):
            cure = f"its dent is left out; {CURE}"
        # Hertzian forces grow with the speed to the power 6/5. With a preload or another law there is no such rule.
        elif power == OF_HERTZ and chain.chain.speed > 0.0 and not chain.static_force.any():
            slower = chain.chain.speed * ratio ** (-5.0 / (6.0 * power))
            cure = f"no contact yields below an impact speed of about {slower:.2g} m/s"
        else:
            cure = f"a yield strength of {1e-9 * ratio * float(weaker.yield_strength or 0.0):.2g} GPa would bear it"
        what = weaker.name or "the softer body"
        yield f"yield: {where} presses {what} to {ratio:.3g} times the pressure at which it yields; {cure}"

    # A law of yielding uses the strength of one body for both if that of the other is not known.
    unknown = dict[str, None]()
    for chain in chains:
        for pair, beyond in zip(chain.pairs, chain.yielding or (), strict=False):
            if beyond is None or beyond.law.yield_strength is not None:
                continue
            for material in (surface_of(side).material for side in pair or ()):
                if material.yield_strength is None:
                    taken = beyond.bodies.material.name or "the other body"
                    words = (
                        f"strength: the yield strength of {material.name or 'a body'} is not known; that of {taken}, "
                        f"{1e-6 * beyond.bodies.strength:.4g} MPa, is used where they touch; give its yield_strength"
                    )
                    unknown[words] = None
    yield from unknown


def _pressures(chain: MovingChain) -> np.ndarray:
    """Return unit, power and limit of each contact, 3 × contacts. The greatest pressure is p₀ = unit · F^power, Pa; the
    weaker body yields above the limit. It is infinite if no strength is known, or the contact's law includes yielding.
    """
    yielding = chain.yielding or [None] * len(chain.pairs)
    elastic = [None if beyond else pair for pair, beyond in zip(chain.pairs, yielding, strict=True)]

    def of(pair: Pair, _: int) -> tuple[float, float, float]:
        surface, facing = surface_of(pair[0]), surface_of(pair[1])
        limit = min(yield_pressure(surface.material), yield_pressure(facing.material))
        if limit == inf:
            return UNKNOWN
        try:
            flat, sharp = relative_curvatures(surface, facing)
        except ValueError:
            return UNKNOWN  # conforming bodies have a law of the user's own
        if flat > 1e-12 * sharp:
            return hertz_pressure(surface, facing, 1.0), OF_HERTZ, limit
        length = min((body.length for body in pair if isinstance(body, Cylinder)), default=inf)
        return sqrt(contact_modulus(surface, facing) * sharp / (pi * length)), 0.5, limit

    return np.array([pressure or UNKNOWN for pressure in once_per_pair(elastic, of)]).T


def _takes_a_law(chain: MovingChain) -> bool:
    """Return whether a chain can have a law of yielding: all contacts are circular, and it has no law of its own."""
    if isinstance(chain.chain, DeformableChain) or chain.chain.law is not None:
        return False
    law, laws = JacksonGreen(), chain.laws
    try:
        once_per_pair(chain.pairs, lambda pair, i: law.contact(*pair, laws[i]))
    except ValueError:
        return False
    return True
