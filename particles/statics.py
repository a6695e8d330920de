"""Static equilibrium of a chain: forces of gravity and preload."""

import numpy as np

from particles.chain import Chain
from structures.structure import Vector
from structures.surface import Surface

ACROSS = 1e-12
"""Component along the chain over the whole, below which gravity acts across a chain that nothing holds."""


def static_forces(chain: Chain, surface: Surface | None, structure_behind: bool) -> Vector:
    """Return the static force of each contact, N; that of contact 1 is the preload if the place of body 0 bears it.

    Raises a ValueError for a static load on a chain that nothing holds, and for one that hangs and is not pressed.
    """
    for name, value, along in (
        ("gravity", chain.gravity, chain.gravity_along),
        ("preload", chain.preload, chain.preload),
    ):
        if surface is None and abs(along) > ACROSS * value:
            raise ValueError(f"{name} = {value!r}: must be 0 for a chain that nothing holds (structure None)")
    held = chain.preload - dead_load(chain, structure_behind)
    weights = np.cumsum([bead.mass for bead in chain.beads])
    static = np.concatenate([[held], chain.preload + chain.gravity_along * weights])
    if static.min() < 0.0:
        least = chain.preload - static.min()
        raise ValueError(f"preload = {chain.preload!r}: must be at least {least:.4g} N to hold a chain that hangs")
    return static


def dead_load(chain: Chain, structure_behind: bool) -> float:
    """Return what presses on the first bead where nothing there bears the preload, N."""
    return 0.0 if structure_behind or chain.excitation.bears_preload else chain.preload
