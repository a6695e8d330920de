"""Static equilibrium of a chain: forces of gravity and preload, and the positions at which the bodies rest."""

import numpy as np

from particles.chain import Chain
from structures.structure import Vector
from structures.surface import Surface

ACROSS = 1e-12
"""Component along the chain over the whole, below which gravity acts across a chain that nothing holds."""


def static_forces(chain: Chain, structure_behind: bool) -> Vector:
    """Return the static force of each contact, N; that of contact 1 is the preload if the place of body 0 bears it."""
    weights = np.cumsum([bead.mass for bead in chain.beads])
    held = chain.preload if structure_behind or chain.excitation.bears_preload else 0.0
    return np.concatenate([[held], chain.preload + chain.gravity_along * weights])


def dead_load(chain: Chain, structure_behind: bool) -> float:
    """Return what presses on the first bead where nothing there bears the preload, N."""
    return 0.0 if structure_behind or chain.excitation.bears_preload else chain.preload


def check_support(chain: Chain, surface: Surface | None, static: Vector) -> None:
    """Raise a ValueError for a static load on a chain that nothing holds, and for one that hangs and is not pressed."""
    if surface is None:
        for name, value, along in (
            ("gravity", chain.gravity, chain.gravity_along),
            ("preload", chain.preload, chain.preload),
        ):
            if abs(along) > ACROSS * value:
                raise ValueError(f"{name} = {value!r}: must be 0 for a chain that nothing holds (structure None)")
    if static.min() < 0.0:
        least = chain.preload - static.min()
        raise ValueError(f"preload = {chain.preload!r}: must be at least {least:.4g} N to hold a chain that hangs")


def places_at_rest(shortened: Vector, static: Vector, springs: Vector) -> Vector:
    """Return the positions of the bodies from touching, unloaded beads, m, in static equilibrium.

    shortened: static approach of each contact, m; springs: flexibility behind the first and the last contact, m/N.
    """
    total = shortened.copy()
    total[[0, -1]] += springs * static[[0, -1]]
    return np.cumsum(total[::-1])[::-1].copy()
