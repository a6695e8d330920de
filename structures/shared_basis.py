"""One Krylov basis for forces at many places of one body, and the few oscillators that each place needs of it."""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, eigh_tridiagonal

from structures.kernels.quadrature import LANES, tridiagonal
from structures.linear_algebra.factor import Matrices
from structures.linear_algebra.one_thread import one_thread
from structures.reduction import LEAST_NEW_PART, Modes, change, expansion_point, pulse_answer
from structures.structure import Vector

Whole = NDArray[np.intp]

FIRST_SHARE = 1e-5
"""A direction of the first block, of unit vectors, is dropped if its share is smaller: it holds the static response of
all places."""

SHARE = 0.05
"""A direction of a later block is dropped if it is shorter than this fraction of the block's longest. Waves from places
less than half a wavelength apart differ little. With 0.1, AR differs by 8e-5 from that of a basis for one place, with
0.05 by less than 1e-5.
"""

STEPS_PER_CHECK = 10
"""Least number of blocks between two estimates of the error, as `reduce` adds ten vectors for each contact."""

MORE_PER_CHECK = 0.2
"""Increase of the number of blocks between two estimates, which cost as much as some blocks when the basis is large;
that of a single load stays small."""

COMPRESSION_STEP = 10
"""The number of oscillators that a place needs is found to within this number."""


class SharedBasis(NamedTuple):
    """ω² of the oscillators, their motion at the degrees of freedom `rows` (rows × oscillators), and the estimated
    error for pulses of the given length and of its halves. speeds: of the waves for which it is valid, see
    `shared_basis`; point: the expansion point, 1/s."""

    square: Vector
    rows: Whole
    shapes: Vector
    errors: list[tuple[float, float]]
    speeds: tuple[float, ...]
    point: float

    def contact(self, vectors: Vector) -> Vector:
        """Return the contact vectors of the oscillators, m × p, from those of the body, n × p."""
        return np.asarray(self.shapes.T @ vectors[self.rows])


@one_thread
def shared_basis(
    matrices: Matrices,
    loads: Vector,
    checks: Vector,
    rows: Whole,
    until: float,
    tolerance: float,
    pulses: list[float],
    largest: int,
    speeds: tuple[float, ...] = (1.0,),
) -> SharedBasis:
    """Return a basis for forces on the loads (n × q) and all between them: block Lanczos, with the directions dropped
    that hardly differ.

    checks: n × p, vectors at whose direct responses and responses to each other the error is estimated, by its change
    over the last ten blocks or more, until it is below the tolerance for the first of the pulses, s. speeds: the
    basis also serves bodies with the same modes whose waves are slower by these factors, 1 or less; for this body,
    their record and pulses are shorter by the factor. The largest error counts.
    """
    several = loads.shape[1] > 1
    # Directions are dropped by their lengths at the expansion point, so it lies between those for the slowest and the
    # fastest waves. A single load drops none, and its fastest waves need the most vectors.
    point = expansion_point(pulses[0] * (min(speeds) ** 0.5 if several else 1.0))
    krylov = _Block(matrices, min(largest, loads.shape[0]), point)
    krylov.start(loads)
    modes, error = krylov.modes(checks), np.inf
    before, answers = modes, _answers(modes, until, pulses[0], speeds)
    more = MORE_PER_CHECK if several else 0.0
    while error > tolerance and krylov.grow(max(STEPS_PER_CHECK, round(more * krylov.blocks))):
        before, modes, earlier = modes, krylov.modes(checks), answers
        answers = _answers(modes, until, pulses[0], speeds)
        error = _change(earlier, answers)
    complete = krylov.size == loads.shape[0]
    errors = [(pulse, 0.0 if complete else _error(before, modes, until, pulse, speeds)) for pulse in pulses]
    return SharedBasis(modes.square, rows, krylov.basis[: krylov.size, rows].T @ modes.vectors, errors, speeds, point)


def compressed(basis: SharedBasis, contact: Vector, size: int) -> Modes:
    """Return at most `size` oscillators with the response of a basis (contact vectors m × p), by block Lanczos in its
    space; their vectors are left out.

    The number of vectors, not a tolerance, ends it, so the result is a smooth function of the contact vectors.
    """
    if contact.shape[1] == 1:
        return _oscillators(*_tridiagonal(basis, contact[:, 0], size), basis.point)
    return _projected(_vectors(basis, contact, size), basis.square, contact)


@one_thread
def needed_size(basis: SharedBasis, contacts: Vector, until: float, tolerance: float) -> tuple[int, SharedBasis]:
    """Return how many oscillators each of the places (contact vectors m × p) needs, so that its direct response differs
    by less than the tolerance from that of the whole basis; and the basis with the error that they add."""
    most, size, pulse = basis.square.size, COMPRESSION_STEP, basis.errors[0][0]
    for contact in contacts.T[:, :, None]:
        diagonal, squares = _tridiagonal(basis, contact[:, 0], most)
        complete_answers = _answers(Modes(basis.square, contact, None, [], contact), until, pulse, basis.speeds)
        high = most
        while high - size > COMPRESSION_STEP:
            middle = (size + high) // 2
            modes = _oscillators(diagonal[:middle], squares[:middle], basis.point)
            answers = _answers(modes, until, pulse, basis.speeds)
            size, high = (size, middle) if _change(answers, complete_answers) <= tolerance else (middle, high)
        size = high
    added = np.zeros(len(basis.errors))
    for contact in contacts.T[:, :, None]:
        both = compressed(basis, contact, size), Modes(basis.square, contact, None, [], contact)
        added = np.maximum(added, [_error(*both, until, pulse, basis.speeds) for pulse, _ in basis.errors])
    errors = [(pulse, error + float(more)) for (pulse, error), more in zip(basis.errors, added, strict=True)]
    return size, basis._replace(errors=errors)


def _tridiagonal(basis: SharedBasis, contact: Vector, size: int) -> tuple[Vector, Vector]:
    """Return (K + σ²M)⁻¹σ²M, of the oscillators and the point σ, in the Krylov vectors from one contact that are
    orthonormal by K + σ²M: its diagonal, and the squares of the entries beside it, of at most `size` rows.

    There it is tridiagonal, and no vectors are needed: it is that of the sum of 1/(1 + ω²/σ²) with the weights b²/(ω² +
    σ²).
    """
    points = 1.0 / (1.0 + basis.square / basis.point**2)
    diagonal, squares = np.zeros((2, min(size, points.size)))
    tridiagonal(points, points * contact**2, np.empty((LANES, 5)), diagonal, squares)
    complete = np.append(squares[1:] <= LEAST_NEW_PART**2, True)
    rows = int(np.argmax(complete)) + 1
    return diagonal[:rows], squares[:rows]


@one_thread
def _oscillators(diagonal: Vector, squares: Vector, point: float) -> Modes:
    """Return the oscillators of such a matrix."""
    values, vectors = eigh_tridiagonal(diagonal, np.sqrt(squares[1:]), check_finite=False)
    contact = abs(vectors[0])[:, None] * np.sqrt(squares[0] / values)[:, None]
    return Modes(np.maximum(point**2 * (1.0 / values - 1.0), 0.0), contact, None, [], contact)


@one_thread
def _vectors(shared: SharedBasis, contact: Vector, size: int) -> Vector:
    """Return the orthonormal Krylov vectors of oscillators, started at the contacts, in rows."""
    square = shared.square
    count, weight = min(size, square.size), 1.0 / (square + shared.point**2)
    basis, pending, done = np.empty((count, square.size)), list(contact.T), 0
    near = 2 * contact.shape[1]
    while pending and done < count:
        vector = weight * pending.pop(0)
        before = sqrt(vector @ vector)  # of so few numbers, ten times as fast as norm
        for first in (max(done - near, 0), 0):
            vector = vector - (basis[first:done] @ vector) @ basis[first:done]
        norm = sqrt(vector @ vector)
        if norm > LEAST_NEW_PART * before:
            basis[done] = vector / norm
            pending.append(basis[done])
            done += 1
    return basis[:done]


@one_thread
def _projected(basis: Vector, square: Vector, contact: Vector) -> Modes:
    values, vectors = eigh((basis * square) @ basis.T)
    return Modes(np.maximum(values, 0.0), vectors.T @ (basis @ contact), None, [], vectors)


def _answers(modes: Modes, until: float, pulse: float, speeds: tuple[float, ...]) -> list[Vector]:
    """Return the responses for each speed of waves."""
    return [pulse_answer(modes, speed * until, speed * pulse) for speed in speeds]


def _change(earlier: list[Vector], answers: list[Vector]) -> float:
    return max(map(change, earlier, answers))


def _error(before: Modes, modes: Modes, until: float, pulse: float, speeds: tuple[float, ...]) -> float:
    return _change(*(_answers(basis, until, pulse, speeds) for basis in (before, modes)))


class _Block:
    """The growing M-orthonormal basis, rows of `basis`; `weighted`: rows M v; and the projection of K."""

    def __init__(self, matrices: Matrices, largest: int, point: float) -> None:
        self.mass, self.elastic = matrices.mass, matrices.stiffness
        self.solve = matrices.shifted_solve(point)
        n = self.mass.shape[0]
        self.basis, self.weighted = np.empty((largest, n)), np.empty((largest, n))
        self.stiffness = np.empty((largest, largest))
        self.size = self.projected = self.local = self.blocks = 0
        self.exhausted = False
        self.block = np.empty((0, n))

    def start(self, loads: Vector) -> None:
        """Begin with the first block, from the loads; the response of each counts equally."""
        vectors = self.solve(loads).T
        vectors /= np.sqrt(np.einsum("ij,ij->i", vectors, (self.mass @ vectors.T).T))[:, None]
        self._take(vectors, FIRST_SHARE)

    def grow(self, steps: int) -> bool:
        """Add blocks; False if none could be added."""
        before = self.size
        for _ in range(steps):
            if self.exhausted or self.size == len(self.basis):
                break
            self._take(self.solve(self.block.T).T, SHARE)
        return self.size > before

    def _take(self, vectors: Vector, share: float) -> None:
        """Add the new directions of solutions (rows), and make them the next block."""
        longest = np.sqrt(np.linalg.eigvalsh(vectors @ (self.mass @ vectors.T))[-1])
        # Lanczos's new block has a part in the last two only, in exact numbers; the whole basis clears the rounding.
        for first in (self.local, 0):
            vectors = vectors - (vectors @ self.weighted[first : self.size].T) @ self.basis[first : self.size]
        lengths, turn = np.linalg.eigh(vectors @ (self.mass @ vectors.T))
        independent = lengths > (share * longest) ** 2
        independent[-1] = lengths[-1] > (LEAST_NEW_PART * longest) ** 2
        independent[: max(independent.size - len(self.basis) + self.size, 0)] = False
        if not independent.any():
            self.exhausted = True
            return
        self.blocks += 1
        vectors = (turn[:, independent] / np.sqrt(lengths[independent])).T @ vectors
        new = slice(self.size, self.size + len(vectors))
        self.basis[new], self.weighted[new] = vectors, (self.mass @ vectors.T).T
        self.local, self.size, self.block = new.start - len(self.block), new.stop, self.weighted[new]

    def modes(self, checks: Vector) -> Modes:
        """Return the oscillators, and the vectors of the checks in them."""
        done, new = slice(0, self.size), slice(self.projected, self.size)
        block = self.basis[done] @ (self.elastic @ self.basis[new].T)
        self.stiffness[done, new], self.stiffness[new, done] = block, block.T
        self.projected = self.size
        square, vectors = eigh(self.stiffness[done, done])
        return Modes(np.maximum(square, 0.0), vectors.T @ (self.basis[done] @ checks), None, [], vectors)
