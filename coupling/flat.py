"""Chains, structures and contacts as the compiled window loop takes them: arrays, one after the other."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from coupling.interface import FIRST, Interface
from particles import kernels
from particles.moving import MovingChain
from structures.moving import Propagator
from structures.structure import Vector


def flat_chains(interface: Interface) -> kernels.Chains:
    """All that does not change of the chains."""
    moving = interface.chains
    constants = [chain.constants for chain in moving]
    vibrations = [chain.vibrations or _rigid(chain) for chain in moving]
    rows, tables, begin = [], [], 0
    for one in constants:
        tables.append(np.where(one.table < 0, one.table, one.table + begin))
        rows.append(one.rows)
        begin += len(one.rows)
    layout = [
        (chain.rest.size, one.inverse_mass.size, one.history.size, vibration.struck.size)
        for chain, one, vibration in zip(moving, constants, vibrations, strict=True)
    ]
    shapes: list[Vector | None] = [None] * 4
    if any(vibration.struck.size for vibration in vibrations):
        shapes = [_joined(field) for field in zip(*vibrations, strict=True)]
    methods = np.array([chain.method for chain in moving], dtype=np.int64)
    return kernels.Chains(
        inverse_mass=_joined(one.inverse_mass for one in constants),
        stiffness=_joined(one.stiffness for one in constants),
        table=_joined(tables),
        rows=np.concatenate(rows),
        damping=_joined(one.damping for one in constants),
        history=_joined(one.history for one in constants),
        squares=shapes[0],
        struck=shapes[1],
        far=shapes[2],
        cross=shapes[3],
        numbers=np.array([tuple(one.numbers) for one in constants], dtype=float),
        layout=_layout(layout),
        method=methods if np.any(methods != kernels.VERLET) else None,
        rest=np.array([chain.rest[0] for chain in moving]),
    )


def _rigid(chain: MovingChain) -> kernels.Vibrations:
    """No modes."""
    none = np.zeros((chain.mass.size, 0))
    return kernels.Vibrations(none, none, none, np.zeros(chain.mass.size))


def flat_structures(propagators: Sequence[Propagator]) -> kernels.Structures:
    """A window of all structures."""
    layout = [
        (
            one.response.shape[1],
            *(part.size for part in (one.contact, one.stiffness, one.mass, one.spread, one.response)),
            len(one.spread),
            one.contact.shape[1],
        )
        for one in propagators
    ]
    begins = _layout(layout)
    begins[:-1, 6:] = np.array(layout)[:, 6:]
    names = ("spread", "response", "contact", "stiffness", "mass")
    joined = {name: _joined(getattr(one, name) for one in propagators) for name in names}
    return kernels.Structures(**joined, layout=begins)


def flat_seats(interface: Interface) -> kernels.Seats:
    """The contacts."""
    contacts = interface.contacts
    return kernels.Seats(
        np.array([contact.chain for contact in contacts], dtype=np.int64),
        np.array([contact.end == FIRST for contact in contacts]),
        np.array([contact.structure for contact in contacts], dtype=np.int64),
        np.array([contact.point for contact in contacts], dtype=np.int64),
        interface.static,
        np.array([*(seats[0] for seats in interface.of_chain), len(contacts)], dtype=np.int64),
    )


def _joined(arrays: Iterable[Vector]) -> Vector:
    return np.concatenate([np.ravel(array) for array in arrays])


def _layout(sizes: Sequence[Sequence[int]]) -> NDArray[np.int64]:
    """Where each one's numbers begin, and in the last row the end."""
    return np.concatenate([np.zeros((1, len(sizes[0])), dtype=np.int64), np.cumsum(sizes, axis=0, dtype=np.int64)])
