"""The arrays that a run fills, one column for each saved time."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from coupling.interface import Interface
from coupling.state import CoupledState
from coupling.kernels.recorders import Everything, Traces
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
    """Of one chain: position (m) and velocity (m/s), saved times × coordinates, first those of the bodies;
    contact_force (N), saved times × bodies; and, for each saved time, kinetic and potential energy, the energy lost,
    and the excitation's work (J)."""

    position: Vector
    velocity: Vector
    contact_force: Vector
    kinetic: Vector
    potential: Vector
    lost: Vector
    driven: Vector


class Frames:
    """Saved times from row 0, the start, on.

    saved: all arrays, as the compiled window loop fills them; energies of structures are NaN where not known. thin: with velocities,
    contact forces and surfaces of one chain only. damped: structures × saved times, what their damping
    and gaps took, J, NaN where not known. chains: the parts of each chain.
    """

    def __init__(self, interface: Interface, rows: int, thin: bool = False) -> None:
        self.rows, self.thin = rows, thin
        ends = np.cumsum([(0, 0)] + [(chain.rest.size, chain.mass.size) for chain in interface.chains], axis=0)
        coordinates, bodies = ends[-1]
        if thin:
            self.saved: Any = Traces(
                np.zeros((rows, coordinates)), np.zeros((rows, bodies)), np.zeros((interface.size, rows))
            )
            none = np.zeros(0)
            self.chains = [ChainFrames(none, *self.saved[:2], *(none for _ in range(4)))]
            return
        of_chains, of_contacts, of_structures = (
            (number, rows) for number in (len(interface.chains), interface.size, len(interface.structures))
        )
        tall = [np.zeros((rows, coordinates)), np.zeros((rows, coordinates)), np.zeros((rows, bodies))]
        shapes = [of_chains] * 4 + [of_contacts] * 4 + [of_structures] * 2 + [(rows,)] * 3 + [of_structures]
        self.saved = Everything(*tall, *(np.zeros(shape) for shape in shapes))
        self.damped = self.saved.taken
        self.chains = [
            ChainFrames(
                self.saved.position[:, place:end],
                self.saved.velocity[:, place:end],
                self.saved.contact_force[:, body:last],
                *(one[number] for one in self.saved[3:7]),
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
            kernels.contact_forces(chain.model, y, v, time, wall, rate, forces, work)
            into.kinetic[row], into.potential[row] = kernels.energies(chain.model, y, v, wall, work)
            into.position[row], into.velocity[row] = y, v
            into.lost[row], into.driven[row] = lost, driven
        saved = self.saved
        for number, structure in enumerate(interface.structures):
            now = state.structures[number]
            if isinstance(structure, MovingStructure):
                energies = structure.energies(now, length, interface.at(number, state.force))
                lost = state.ledger.damped[number]
            else:
                *energies, lost = structure.energies(now)
            saved.structure_kinetic[number, row], saved.structure_elastic[number, row] = energies
            self.damped[number, row] = lost
        saved.surface[:, row] = state.surface
        saved.work[:, row], saved.given[:, row], saved.impulse[:, row] = state.ledger[:3]
        saved.evaluations[row], saved.substeps[row], saved.residual[row] = counts

    def count_damping(self, interface: Interface) -> None:
        """What the damping of linear structures took: the part of the work that is not in their energy.

        The midpoint rule keeps that identity.
        """
        for place in interface.damped:
            work = self.saved.work[interface.touched_by(place)].sum(axis=0)
            self.damped[place] = work - self.saved.structure_kinetic[place] - self.saved.structure_elastic[place]

    def upto(self, row: int) -> list[Vector]:
        """Everything up to a row, for a checkpoint: views, as copies of a long run may not fit in memory."""
        return [array[..., : row + 1] if wide else array[: row + 1] for array, wide in self._arrays()]

    def restore(self, row: int, kept: list[Vector]) -> None:
        """Restore what `upto` returned for a row; a ValueError where it does not fit."""
        for place, values in zip(self.upto(row), kept, strict=True):
            if not isinstance(values, np.ndarray) or values.shape != place.shape or values.dtype != place.dtype:
                raise ValueError("frames: have another shape")
            place[...] = values

    def _arrays(self) -> list[tuple[Vector, bool]]:
        """All arrays, and whether the saved times are their last axis."""
        tall = self.saved[:3]
        return [(one, False) for one in tall] + [(one, True) for one in self.saved[3:]]
