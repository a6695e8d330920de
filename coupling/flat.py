"""Chains, structures and contacts as the compiled window loop takes them: arrays, one after the other."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coupling.interface import FIRST, Interface
from particles import kernels
from particles.moving import MovingChain
from structures.closing import PARTS, Closing
from structures.moving import Propagator
from structures.structure import Vector

MOST_WINDOWS = 64
"""Windows that are kept at a time."""


def flat_chains(interface: Interface) -> kernels.Chains:
    """All that does not change of the chains."""
    moving = interface.chains
    constants = [chain.constants for chain in moving]
    vibrations = [chain.vibrations or _rigid(chain) for chain in moving]
    rows, tables, yielding, begin = [], [], [], 0
    for one in constants:
        if one.yielding is not None:
            own = one.yielding
            yielding.append(own._replace(loading=own.loading + begin, dent=own.dent + begin))
        tables.append(np.where(one.table < 0, one.table, one.table + begin))
        rows.append(one.rows)
        begin += len(one.rows)
    layout = [
        (
            chain.rest.size,
            one.inverse_mass.size,
            one.history.size,
            vibration.struck.size,
            vibration.rate.size,
            vibration.arm.size,
            0 if one.yielding is None else one.yielding.begin.size,
        )
        for chain, one, vibration in zip(moving, constants, vibrations, strict=True)
    ]
    shapes: list[Vector | None] = [None] * len(kernels.Vibrations._fields)
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
        rate=shapes[4],
        arm=shapes[5],
        relaxation=shapes[6],
        yielding=kernels.Yielding(*map(_joined, zip(*yielding, strict=True))) if yielding else None,
        numbers=np.array([tuple(one.numbers) for one in constants], dtype=float),
        layout=_layout(layout),
        method=methods if np.any(methods != kernels.VERLET) else None,
        rest=np.array([chain.rest[0] for chain in moving]),
    )


def _rigid(chain: MovingChain) -> kernels.Vibrations:
    """No modes."""
    none = np.zeros((chain.mass.size, 0))
    return kernels.Vibrations(none, none, none, np.zeros(chain.mass.size), none, none, none)


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


def flat_gaps(closing: Closing, window: float) -> kernels.Gaps:
    """The gaps of a structure over a window, s."""
    count, part = closing.opening.size, window / PARTS
    one, other = (closing.moving.propagator(length) for length in (window, part))
    place, rate = (np.ascontiguousarray(rows[-count:]) for rows in (one.contact, one.rate))
    return kernels.Gaps(
        whole=_span(window, one, rate),
        part=_span(part, other, rate),
        parts=PARTS,
        place=place,
        rate=rate,
        opening=closing.opening,
        preload=closing.preload,
        damping=np.ascontiguousarray(one.damping),
    )


def _span(length: float, one: Propagator, rate: Vector) -> kernels.Span:
    softness = rate @ one.response[-len(rate) :, one.contact.shape[1] :].T
    spread, response = map(np.ascontiguousarray, (one.spread, one.response))
    return kernels.Span(length, spread, response, 0.5 * (softness + softness.T))


class FlatWindows:
    """Windows of structures that were asked for last: thousands of runs meet the same structure in equal windows."""

    def __init__(self) -> None:
        self._known: dict[Any, tuple[Sequence[Any], kernels.Structures]] = {}

    def of(self, structures: Sequence[Any], length: float) -> kernels.Structures:
        """A window of these MovingStructures, `length` s long."""
        key = (*((id(one.structure), one.stepper) for one in structures), length)
        if key not in self._known:
            made = flat_structures([one.propagator(length) for one in structures])
            for old in list(self._known)[: -MOST_WINDOWS or None]:
                self._known.pop(old, None)
            # With the structures: another object could get the number of one that is gone.
            self._known[key] = [one.structure for one in structures], made
        return self._known[key][1]


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
    flat = [array.ravel() for array in arrays]
    return flat[0] if len(flat) == 1 else np.concatenate(flat)


def _layout(sizes: Sequence[Sequence[int]]) -> NDArray[np.int64]:
    """Where each one's numbers begin, and in the last row the end."""
    ends = np.zeros((len(sizes) + 1, len(sizes[0])), dtype=np.int64)
    ends[1:] = sizes
    return ends if len(sizes) == 1 else ends.cumsum(axis=0)
