"""Krylov reduction: a large structure becomes a few hundred oscillators that answer alike at the contact."""

import logging

import numpy as np
from scipy import sparse
from scipy.linalg import eigh_tridiagonal

from structures.checks import positive
from structures.factor import shifted_solve
from structures.structure import Structure, Vector

log = logging.getLogger("hertzlink.reduction")

PULSE = 25.0e-6
"""Length, s, of the force pulse for which the error is estimated: the contact time of a small steel bead."""

SHIFT = 2.0 * np.pi * 15.0e3
"""Real expansion point of the Krylov space, 1/s: the middle of the band that steel beads excite."""

BLOCK = 10
LARGEST = 600


def reduce(structure: Structure, until: float, tolerance: float = 1e-4, largest: int = LARGEST) -> Structure:
    """A structure of oscillators (M = I, K diagonal) with the same motion of the contact point up to `until` s.

    Lanczos vectors of (K + s²M)⁻¹M from (K + s²M)⁻¹b, orthogonalised by the recurrence and again in full, then the eigenvectors in their span
    (Bai, Appl. Numer. Math. 43 (2002) 9). A damping matrix is projected on the same basis.
    tolerance: relative error, in the mean square over the time, of the displacement after a force pulse of 25 µs.
    It is estimated by the change over the last ten vectors, chooses the size, and stands in
    `origin["reduction"]["error_estimate"]`; a warning is logged where `largest` vectors do not reach it.
    """
    until, tolerance = positive("until", until, "s"), positive("tolerance", tolerance)
    size = structure.size
    if size == 0:
        return structure
    lanczos = _Lanczos(structure, min(largest, size))
    previous, estimate = None, np.inf
    while estimate > tolerance and lanczos.grow(BLOCK):
        answer = _pulse_answer(lanczos.oscillators(), until)
        if previous is not None:
            estimate = float(np.linalg.norm(answer - previous) / np.linalg.norm(answer))
        previous = answer
        if lanczos.exhausted:
            estimate = 0.0
    if estimate > tolerance:
        log.warning("reduction: %d vectors leave an error of %.1e; raise largest or tolerance", largest, estimate)
    square, contact, damping = lanczos.oscillators()
    report = {"size": square.size, "full_size": size, "tolerance": tolerance, "until": until, "error_estimate": estimate}
    return Structure(
        sparse.csr_array(sparse.eye_array(square.size)),
        sparse.csr_array(sparse.diags_array(square)),
        None if damping is None else sparse.csr_array(damping),
        contact,
        structure.flexibility,
        structure.surface,
        {**structure.origin, "reduction": report},
    )


Modes = tuple[Vector, Vector, Vector | None]


class _Lanczos:
    """The growing Krylov basis V (M-orthonormal), with T = Vᵀ M (K + s²M)⁻¹ M V tridiagonal."""

    def __init__(self, structure: Structure, largest: int) -> None:
        self.structure, self.largest = structure, largest
        self.solve = shifted_solve(structure, SHIFT)
        self.basis = np.empty((largest, structure.size))
        self.weighted = np.empty((largest, structure.size))  # rows M v
        self.diagonal: list[float] = []
        self.off_diagonal: list[float] = []
        self.next = self.solve(structure.contact)
        self.exhausted = False

    def grow(self, count: int) -> bool:
        """Add `count` vectors, or as many as there are; False where none could be added."""
        before = len(self.diagonal)
        while len(self.diagonal) < min(before + count, self.largest) and not self.exhausted:
            self._add()
        return len(self.diagonal) > before

    def _add(self) -> None:
        k, mass = len(self.diagonal), self.structure.mass
        weighted = mass @ self.next
        norm = np.sqrt(self.next @ weighted)
        self.basis[k], self.weighted[k] = self.next / norm, weighted / norm
        candidate = self.solve(self.weighted[k])
        scale = np.sqrt(candidate @ (mass @ candidate))
        self.diagonal.append(float(self.weighted[k] @ candidate))
        candidate -= self.diagonal[k] * self.basis[k]
        if k:
            candidate -= self.off_diagonal[k - 1] * self.basis[k - 1]
        candidate -= (self.weighted[: k + 1] @ candidate) @ self.basis[: k + 1]
        left = np.sqrt(max(candidate @ (mass @ candidate), 0.0))
        self.next, self.exhausted = candidate, bool(left < 1e-13 * scale or k + 1 == self.structure.size)
        self.off_diagonal.append(float(left))

    def oscillators(self) -> Modes:
        """ω², b and C in the eigenvectors of K within the basis."""
        k = len(self.diagonal)
        inverse, vectors = eigh_tridiagonal(self.diagonal, self.off_diagonal[: k - 1])
        square = np.maximum(1.0 / inverse - SHIFT**2, 0.0)
        contact = vectors.T @ (self.basis[:k] @ self.structure.contact)
        damping = None
        if self.structure.damping is not None:
            projected = self.basis[:k] @ (self.structure.damping @ self.basis[:k].T)
            damping = vectors.T @ projected @ vectors
        return square, contact, damping


def _pulse_answer(modes: Modes, until: float) -> Vector:
    """Laplace transform, at σ + iω, of the contact's displacement after a raised-cosine pulse of length PULSE.

    By Parseval its norm is that of e^(−σt) w(t) over time; σ = 2/until keeps what happens up to `until`.
    """
    square, contact, damping = modes
    s = 2.0 / until + 1j * np.linspace(0.0, 8.0 * np.pi / PULSE, 1000)
    if damping is None:
        receptance = ((contact**2) / (square + s[:, None] ** 2)).sum(axis=1)
    else:
        matrix = s[:, None, None] * damping + (square + s[:, None, None] ** 2) * np.eye(square.size)
        receptance = np.linalg.solve(matrix, np.broadcast_to(contact[:, None], (s.size, square.size, 1)))[..., 0] @ contact
    turn = 2.0 * np.pi / PULSE
    pulse = (1.0 - np.exp(-s * PULSE)) * turn**2 / (s * (s**2 + turn**2))
    answer: Vector = receptance * pulse
    return answer
