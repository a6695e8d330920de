"""The chain as a guest: another program, through preCICE, controls the time and moves the surface."""

from typing import NamedTuple

import numpy as np

from particles.chain import Chain
from particles.deformable.deformable_chain import moving_chain
from particles.kernels.motion import forces_of_chains
from particles.moving import ChainState, MovingChain
from structures.checks import finite, instance, positive
from structures.structure import Vector
from structures.surface import Surface

ROUNDING = 1e-12
"""A force below this part of the chain's force scale is rounding, and exactly zero: programs that divide by the change
of a force that stays so small, as relative convergence measures do, get no number."""


class GuestState(NamedTuple):
    """The complete state at the end of a window; a checkpoint is this state.

    surface, m: displacement of the surface. mean_force, N: mean of the last contact over the window, relative to the
    static one. contact_force, N: of the N + 1 contacts at the end of the window, relative to the static ones.
    """

    chain: ChainState
    surface: float
    mean_force: float
    contact_force: Vector


def guest_chain(chain: Chain, surface: Surface, flexibility: float = 0.0, dt: float | None = None) -> MovingChain:
    """Return the chain, ready to face a surface that another program moves. Raises ValueError as MovingChain does."""
    instance("chain", chain, Chain, "a Chain")
    instance("surface", surface, Surface, "a Surface(material); of a structure structure.surface")
    return moving_chain(chain, surface, flexibility, dt)


def start(moving: MovingChain) -> GuestState:
    """Return the static equilibrium, at time zero."""
    state = moving.start()
    return GuestState(state, 0.0, 0.0, _contact_force(moving, state, 0.0, 0.0))


def advance(moving: MovingChain, state: GuestState, surface: float, window: float) -> GuestState:
    """Advance by `window` s, while the surface moves linearly to the displacement `surface`, m.

    Raises ValueError for impossible numbers, and FloatingPointError if the state of a bead is no longer finite.
    """
    surface, window = finite("surface displacement", surface, "m"), positive("window", window, "s")
    chain, mean_force = moving.advance(state.chain, (state.surface, surface), window)
    bad = ~(np.isfinite(chain.position) & np.isfinite(chain.velocity))
    if bad.any():
        raise FloatingPointError(f"bead {int(bad.argmax())} is no longer finite at t = {chain.time:.6g} s; check dt")
    rate = (surface - state.surface) / window
    mean_force = mean_force if abs(mean_force) > ROUNDING * moving.scales[0] else 0.0
    return GuestState(chain, surface, mean_force, _contact_force(moving, chain, surface, rate))


def _contact_force(moving: MovingChain, state: ChainState, surface: float, rate: float) -> Vector:
    force, (position, velocity, _, time, _) = np.zeros(moving.mass.size), state
    contacts, work, places = np.arange(force.size), moving.work_space(), np.array([[surface], [rate]])
    forces_of_chains(moving.model, position, velocity, time, *places, contacts, force, work)
    dynamic: Vector = force - moving.static_force
    dynamic[abs(dynamic) <= ROUNDING * moving.scales[0]] = 0.0
    return dynamic
