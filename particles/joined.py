"""Chains as the compiled loops take them: one after the other, in arrays."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from particles import contacts
from particles.dissipation import kernel_losses
from particles.kernels.drives import FREE, MOVED, Driven, Free
from particles.kernels.laws import Mixed
from particles.kernels.losses import NoLoss
from particles.kernels.motion import ENDS, PACE, Chains, DampedVerlet, Verlet
from particles.kernels.vibrations import Rigid, Vibrating
from structures.structure import Vector

if TYPE_CHECKING:
    from particles.moving import MovingChain


def joined(chains: Sequence[MovingChain]) -> Chains:
    """Return chains as the compiled loops take them; surfaces count by chain, the last bead's before the first's."""
    first = np.cumsum([0, *(chain.mass.size for chain in chains)])
    present = np.concatenate([[law is not None for law in chain.laws] for chain in chains])
    has_behind = np.array([chain.behind is not None for chain in chains])
    facing = np.cumsum(1 + has_behind) - 1 - has_behind
    wall, spring = np.full(first[-1], -1), np.zeros(first[-1])
    wall[first[1:] - 1] = facing
    spring[first[:-1]] = [chain.behind_flexibility for chain in chains]
    spring[first[1:] - 1] = [chain.flexibility for chain in chains]
    mass = np.concatenate([chain.mass for chain in chains])
    free = np.isfinite(mass)
    along = np.concatenate([np.full(chain.mass.size, chain.chain.gravity_along) for chain in chains])
    vibrations = _vibrations(chains, int(first[-1]))
    losses = [(chain.chain.dissipation, chain.reduced_mass) for chain in chains]
    thesis = any(loss is not None and loss.piece == "bodies" for loss, _ in losses)
    modes = 0 if vibrations is None else vibrations.struck.shape[1]
    ends = np.zeros(len(chains), ENDS)
    ends["striker"], ends["last"], ends["behind"] = first[:-1], first[1:] - 1, np.where(has_behind, facing + 1, -1)
    ends["rest"] = [float(chain.rest[0]) for chain in chains]
    ends["quiet"] = [not chain.rest[: chain.mass.size].any() for chain in chains]
    ends["touched"], ends["faces"] = present[first[:-1]], present[first[1:] - 1]
    return Chains(
        DampedVerlet() if modes or thesis else Verlet(),
        _law(chains),
        kernel_losses(losses, present, free),
        _drive(chains),
        Rigid() if vibrations is None else vibrations,
        1.0 / mass,
        np.where(free, along, 0.0),
        wall,
        spring,
        ends,
        modes,
        1 if vibrations is None else 3 if vibrations.arm.size else 2,
    )


def pace_of(model: Chains, steps: Sequence[int], coordinates: int) -> Any:
    """Return the steps of each chain in a window, and how far the motion of its surface reaches, as records PACE.

    With velocity Verlet neighbours act on each other, so a step passes on the motion of the surface by one body. All
    trials begin with the surface at the same place, which the last body feels at the second of the steps + 1 kicks; its
    velocity, which losses feel, acts at the first. Contacts that yield remember what a trial did to them, so that all
    are moved again; so are those of a chain with a structure behind. A drive moves the first two bodies together.
    """
    pace = np.zeros(len(steps), PACE)
    pace["steps"], pace["reached"] = steps, model.ends["striker"]
    if isinstance(model.stepper, Verlet) and coordinates == model.inverse_mass.size:
        first = model.ends["last"] + 1 - pace["steps"] - (not isinstance(model.loss, NoLoss))
        least = model.ends["striker"] + (1 if isinstance(model.drive, Free) else 2)
        part = (first >= least) & (model.ends["behind"] < 0)
        pace["reached"] = np.where(part, first, model.ends["striker"])
    return pace


def coordinates(chains: Sequence[MovingChain], model: Chains) -> tuple[list[Any], int]:
    """Return where each chain's own coordinates, see ChainState, are among those of all, and the number of all.

    Those of all are the bodies of all chains, then their modes, then their arms, then what contacts remember.
    """
    bodies, modes, remembers = model.inverse_mass.size, model.modes, any(chain.yielding for chain in chains)
    moving = bodies * (1 + modes * (model.parts - 1))
    total = moving + 3 * bodies * remembers
    if len(chains) == 1:
        return [slice(None)], total
    places: list[Any] = []
    for chain, (begin, end) in zip(chains, pairwise([*model.ends["striker"].tolist(), bodies]), strict=True):
        own = np.arange(begin, end)
        if chain.rest.size == own.size:
            places.append(slice(begin, end))
            continue
        count = (chain.rest.size - own.size) // own.size
        if chain.yielding:
            places.append(np.concatenate([own, *(moving + part * bodies + own for part in range(3))]))
            continue
        elastic = cast(Any, chain).chain.modes - 1
        parts = [
            (bodies * (1 + part * modes) + own[:, None] * modes + np.arange(elastic)).ravel()
            for part in range(count // elastic)
        ]
        places.append(np.concatenate([own, *parts]))
    return places, total


def _law(chains: Sequence[MovingChain]) -> Any:
    """Return the laws of all contacts as a piece; the memory of contacts that yield lies in the coordinates."""
    laws = [law for chain in chains for law in chain.local_laws]
    yields = np.concatenate([np.full(chain.mass.size, chain.yielding is not None) for chain in chains])
    if not yields.any():
        return contacts.kernel_laws(laws)
    yielding = [contact for chain in chains for contact in chain.yielding or [None] * chain.mass.size]
    own = contacts.kernel_yielding(yielding, np.concatenate([chain.stiffness for chain in chains]))
    if yields.all():
        return own
    return Mixed(
        own, contacts.kernel_laws([None if does else law for does, law in zip(yields, laws, strict=True)]), yields
    )


def _drive(chains: Sequence[MovingChain]) -> Any:
    """Return what drives the chains as a piece."""
    drives = [chain.chain.excitation.drive for chain in chains]
    loads = np.array([chain.dead_load for chain in chains])
    if not loads.any() and all(drive.kind == FREE and drive.spring == 0.0 for drive in drives):
        return Free()
    histories = [np.array(drive.history, dtype=float) for drive in drives]
    for drive, history, chain in zip(drives, histories, chains, strict=True):
        if drive.kind == MOVED:
            history[1] += chain.rest[0]
    return Driven(
        np.array([drive.kind for drive in drives]),
        np.cumsum([0, *(history.shape[1] for history in histories)]),
        np.concatenate(histories, axis=1),
        loads,
        np.array([float(drive.spring) for drive in drives]),
        np.array([float(chain.rest[0] + drive.left) for chain, drive in zip(chains, drives, strict=True)]),
    )


def _vibrations(chains: Sequence[MovingChain], bodies: int) -> Vibrating | None:
    """Return the vibrations of all bodies; None where all are rigid. Modes that a body does not have rest."""
    own = [chain.vibrating for chain in chains]
    known = [vibrations for vibrations in own if vibrations is not None]
    if not known:
        return None
    if len(chains) == 1:
        return known[0]
    widest = max(vibrations.struck.shape[1] for vibrations in known)

    def stacked(name: str) -> Vector:
        given = [getattr(vibrations, name) for vibrations in known]
        if not any(array.size for array in given):
            return np.zeros((bodies, 0))
        rows = []
        for chain, vibrations in zip(chains, own, strict=True):
            part = np.zeros((chain.mass.size, widest))
            if vibrations is not None and (array := getattr(vibrations, name)).size:
                part[:, : array.shape[1]] = array
            rows.append(part)
        return np.concatenate(rows)

    cross = [np.zeros(chain.mass.size) if one is None else one.cross for chain, one in zip(chains, own, strict=True)]
    stiffness, struck, far, rate, arm, relaxation = map(
        stacked, ("stiffness", "struck", "far", "rate", "arm", "relaxation")
    )
    return Vibrating(stiffness, struck, far, np.concatenate(cross), rate, arm, relaxation)
