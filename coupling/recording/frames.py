"""The arrays that a run fills, one column for each saved time."""

from typing import NamedTuple

import numpy as np

from coupling.interface import Interface
from coupling.state import CoupledState
from particles import kernels
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


class ChainFrames:
    """Of one chain: position (m) and velocity (m/s), saved times × coordinates, first those of the bodies;
    contact_force (N), saved times × bodies; and, for each saved time, kinetic and potential energy, the energy lost,
    and the excitation's work (J)."""

    def __init__(self, rows: int, bodies: int, coordinates: int) -> None:
        self.position, self.velocity = (np.zeros((rows, coordinates)) for _ in range(2))
        self.contact_force = np.zeros((rows, bodies))
        self.kinetic, self.potential, self.lost, self.driven = (np.zeros(rows) for _ in range(4))


class Frames:
    """Saved times from row 0, the start, on.

    Contacts × saved times: surface (m), work and given (J), impulse (N s), see Ledger. Structures × saved times:
    kinetic, elastic and damped (J), NaN where not known. For each saved time: evaluations, substeps and residual, see
    Counts.
    """

    def __init__(self, interface: Interface, rows: int) -> None:
        self.rows = rows
        self.chains = [ChainFrames(rows, chain.mass.size, chain.rest.size) for chain in interface.chains]
        self.surface, self.work, self.given, self.impulse = (np.zeros((interface.size, rows)) for _ in range(4))
        self.kinetic, self.elastic, self.damped = (np.zeros((len(interface.structures), rows)) for _ in range(3))
        self.evaluations, self.substeps, self.residual = (np.zeros(rows) for _ in range(3))

    def record(self, interface: Interface, row: int, state: CoupledState, counts: Counts, length: float) -> None:
        """Put a state into a row. length, s: of a substep."""
        past = state.past
        for number, (chain, into) in enumerate(zip(interface.chains, self.chains, strict=True)):
            y, v, lost, time, driven = state.chains[number]
            seat = interface.of_chain[number][0]
            wall, rate = float(state.surface[seat]), 0.0
            if past:
                rate = (wall - float(past[-2].surface[seat] if len(past) > 1 else 0.0)) / past[-1].length
            into.kinetic[row], into.potential[row] = kernels.frame(
                y, v, chain.constants, time, wall, rate, into.contact_force[row]
            )
            into.position[row], into.velocity[row] = y, v
            into.lost[row], into.driven[row] = lost, driven
        for number, structure in enumerate(interface.structures):
            known = isinstance(structure, MovingStructure)
            force = interface.at(number, state.force)
            energies = structure.energies(state.structures[number], length, force) if known else (np.nan, np.nan)
            self.kinetic[number, row], self.elastic[number, row] = energies
            self.damped[number, row] = state.ledger.damped[number] if known else np.nan
        self.surface[:, row] = state.surface
        self.work[:, row], self.given[:, row], self.impulse[:, row] = state.ledger[:3]
        self.evaluations[row], self.substeps[row], self.residual[row] = counts

    def compiled(self) -> kernels.Saved:
        """Of one chain and one contact, as the compiled window loop fills them."""
        chain = self.chains[0]
        return kernels.Saved(
            position=chain.position,
            velocity=chain.velocity,
            contact_force=chain.contact_force,
            kinetic=chain.kinetic,
            potential=chain.potential,
            lost=chain.lost,
            driven=chain.driven,
            surface=self.surface[0],
            work=self.work[0],
            given=self.given[0],
            impulse=self.impulse[0],
            structure_kinetic=self.kinetic[0],
            structure_elastic=self.elastic[0],
            evaluations=self.evaluations,
            residual=self.residual,
        )

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
        found: list[tuple[Vector, bool]] = []
        for chain in self.chains:
            found += [(array, False) for array in vars(chain).values()]
        found += [(array, True) for name, array in vars(self).items() if isinstance(array, np.ndarray)]
        return found
