"""The arrays that a run fills, one column for each saved time."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from coupling.interface import Interface
from coupling.kernels.recorders import (
    CHAIN_FRAME,
    CONTACT_FRAME,
    STRUCTURE_FRAME,
    TIME_FRAME,
    TRACE_FRAME,
    Everything,
    Traces,
)
from coupling.kernels.state import Records
from coupling.state import CoupledState
from particles.kernels import chain as kernels
from structures.moving import MovingStructure
from structures.structure import Vector


class Counts(NamedTuple):
    """Since the last saved time: chain windows tried, substeps, and the greatest residual (N)."""

    evaluations: int = 0
    substeps: int = 0
    residual: float = 0.0

    def after(self, state: CoupledState) -> "Counts":
        """With one more substep, or its parts, which ended in this state."""
        return Counts(
            self.evaluations + state.evaluations,
            self.substeps + state.substeps,
            max(self.residual, state.residual),
        )


class ChainFrames(NamedTuple):
    """The saved times of one chain.

    position (m) and velocity (m/s): saved times × coordinates, first those of the bodies; contact_force (N): saved
    times × bodies; energy: records CHAIN_FRAME.
    """

    position: Vector
    velocity: Vector
    contact_force: Vector
    energy: Records


class Frames:
    """Saved times from row 0, the start, on.

    saved: all arrays, as the compiled window loop fills them; energies of structures are NaN where not known. thin:
    with velocities, contact forces and surfaces of one chain only. contact: its records of contacts. chains: the
    parts of each chain.
    """

    def __init__(self, interface: Interface, rows: int, thin: bool = False) -> None:
        self.rows, self.thin = rows, thin
        ends = np.cumsum([(0, 0)] + [(chain.rest.size, chain.mass.size) for chain in interface.chains], axis=0)
        coordinates, bodies = ends[-1]
        velocity, force = np.zeros((rows, coordinates)), np.zeros((rows, bodies))
        contacts, chains, structures = interface.size, len(interface.chains), len(interface.structures)
        self.saved: Any = Traces(velocity, force, np.zeros((contacts, rows), TRACE_FRAME))
        if not thin:
            self.saved = Everything(
                np.zeros((rows, coordinates)),
                velocity,
                force,
                np.zeros((chains, rows), CHAIN_FRAME),
                np.zeros((contacts, rows), CONTACT_FRAME),
                np.zeros((structures, rows), STRUCTURE_FRAME),
                np.zeros(rows, TIME_FRAME),
            )
        self.contact = self.saved.contact
        self.chains = [
            ChainFrames(
                np.zeros((0, end - place)) if thin else self.saved.position[:, place:end],
                self.saved.velocity[:, place:end],
                self.saved.contact_force[:, body:last],
                np.zeros(0, CHAIN_FRAME) if thin else self.saved.chain[number],
            )
            for number, ((place, body), (end, last)) in enumerate(pairwise(ends))
        ]

    def record(self, interface: Interface, row: int, state: CoupledState, counts: Counts, length: float) -> None:
        """Put a state into a row. length, s: of a substep."""
        past = state.past
        for number, (chain, into) in enumerate(zip(interface.chains, self.chains, strict=True)):
            y, v, lost, time, driven = state.chains[number]
            seat = interface.of_chain[number][0]
            wall, rate = float(state.surface[seat]), 0.0
            if past:
                rate = (wall - float(past[-2].surface[seat] if len(past) > 1 else 0.0)) / past[-1].length
            work, forces = chain.work_space(), into.contact_force[row]
            kernels.forces_of_chain(chain.model, y, v, time, wall, rate, forces, work)
            into.energy[row] = *kernels.energies_of_chain(chain.model, y, v, wall, work), lost, driven
            into.position[row], into.velocity[row] = y, v
        saved = self.saved
        for number, structure in enumerate(interface.structures):
            now = state.structures[number]
            if isinstance(structure, MovingStructure):
                energies = structure.energies(now, length, interface.at(number, state.force))
                lost = state.ledger.damped[number]
            else:
                *energies, lost = structure.energies(now)
            saved.structure[number, row] = *energies, lost
        saved.contact[:, row] = list(zip(state.surface, *state.ledger[:3], strict=True))
        saved.time[row] = counts

    def count_damping(self, interface: Interface) -> None:
        """What the damping of linear structures took: the part of the work that is not in their energy.

        The midpoint rule keeps that identity.
        """
        for place in interface.damped:
            work, frames = self.contact["work"][interface.touched_by(place)].sum(axis=0), self.saved.structure[place]
            frames["taken"] = work - frames["kinetic"] - frames["elastic"]

    def upto(self, row: int) -> list[Vector]:
        """Everything up to a row, for a checkpoint: views, as copies of a long run may not fit in memory."""
        *tall, chain, contact, structure, time = self.saved
        return [*(one[: row + 1] for one in (*tall, time)), *(one[:, : row + 1] for one in (chain, contact, structure))]

    def restore(self, row: int, kept: list[Vector]) -> None:
        """Restore what `upto` returned for a row; a ValueError where it does not fit."""
        for place, values in zip(self.upto(row), kept, strict=True):
            if not isinstance(values, np.ndarray) or values.shape != place.shape or values.dtype != place.dtype:
                raise ValueError("frames: have another shape")
            place[...] = values
