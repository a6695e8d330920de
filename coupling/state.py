"""The state of a co-simulation: both sides, the ledger of energies, and the memory of the scheme."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from coupling.kernels.records import CHAIN, CONTACT, NODE, REMEMBERED, TOTALS, WINDOW, Run
from particles.moving import ChainState
from structures.structure import Vector


class NotConverged(RuntimeError):
    """Chains and structures did not agree on the mean forces of a window.

    Parameters
    ----------
    message : str
        The window and the residual.
    evaluations : int
        Chain windows that were tried for it.
    """

    def __init__(self, message: str, evaluations: int = 0) -> None:
        super().__init__(message)
        self.evaluations = evaluations


class Node(NamedTuple):
    """The end of a substep of `length` s: surface displacements (m) there, mean forces (N) that the chains answered."""

    time: float
    length: float
    surface: Vector
    force: Vector


class Ledger(NamedTuple):
    """Sums since the start. For each contact: work (J) of its dynamic force as the structure felt it and the chain gave
    it, and impulse (N s); for each structure the energy (J) that its damping took."""

    work: Vector
    given: Vector
    impulse: Vector
    damped: Vector


class Differences(NamedTuple):
    """A memory of IQN_ILS, of one window's repetitions.

    The length of its substeps, s, and the changes of residuals and answers, newest first.
    """

    length: float
    residuals: Vector
    answers: Vector


class Counts(NamedTuple):
    """Counts of some windows: of the chain, tried; substeps; and the greatest residual (N)."""

    evaluations: int = 0
    substeps: int = 0
    residual: float = 0.0

    def plus(self, other: "Counts") -> "Counts":
        """Return the counts of both."""
        residual = max(self.residual, other.residual)
        return Counts(self.evaluations + other.evaluations, self.substeps + other.substeps, residual)


class CoupledState(NamedTuple):
    """Everything at a window's end. K contacts, in the order of `Interface.contacts`.

    surface, m, K: displacement of the structures' contact points. force, N, K: the mean over the last substep that the
    structures felt, above the static one. counts: of what led here from the state before; several substeps where one
    was halved; the residual, N, is the greatest difference between the forces that the chains answered and those that
    the structures felt. past: the last nodes, newest last. memory: what the scheme starts the next window from. piece:
    how many substeps converged together where a window was cut, else 0.
    """

    time: float
    chains: tuple[ChainState, ...]
    structures: tuple[Any, ...]
    surface: Vector
    force: Vector
    ledger: Ledger
    counts: Counts
    past: tuple[Node, ...]
    memory: Any
    piece: int = 0


def predicted(places: Sequence[float], values: Sequence[Vector], order: int, at: float) -> Vector:
    """Return the polynomial of at most this order through the newest values, last in the sequences, at another place.

    Of lower order where there are fewer values, zero where there is none yet.
    """
    places, values = places[-order - 1 :], values[-order - 1 :]
    total: Vector = np.zeros(0)
    for i, value in enumerate(values):
        weight = 1.0
        for j, place in enumerate(places):
            if j != i:
                weight *= (at - place) / (places[i] - place)
        total = weight * value + (total if i else 0.0)
    return total


def as_run(state: CoupledState, counts: Counts) -> Run:
    """Return a state as the compiled loop has it, but for its structures."""
    size, past, none = state.surface.size, state.past[::-1], np.zeros(0)
    contact, node, window = np.zeros(size, CONTACT), np.zeros((REMEMBERED, size), NODE), np.zeros(REMEMBERED, WINDOW)
    contact["surface"] = state.surface
    contact["work"], contact["given"], contact["impulse"], _ = state.ledger
    for i, (time, length, surface, force) in enumerate(past):
        node["surface"][i], node["force"][i], window[i] = surface, force, (time - length / 2.0, length)
    chain = np.array([(chain_state.lost, chain_state.driven) for chain_state in state.chains], CHAIN)
    totals = np.array([(len(past), *counts)], TOTALS)
    position, velocity = (np.concatenate(parts) for parts in list(zip(*state.chains, strict=True))[:2])
    return Run(position, velocity, none, contact, chain, node, window, totals)
