"""Krylov vectors: the motions of a body that a force at its contacts reaches first, and the projections on them."""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import aslinearoperator

from structures.linear_algebra.factor import factorise
from structures.maxwell import maxwell_arms
from structures.stepping import rayleigh_rates
from structures.structure import Structure, Vector

# s. Length of the force pulse for which the error is estimated by default: the contact time of a small steel bead.
DEFAULT_PULSE = 25.0e-6

# Real expansion point s of the Krylov space, 1/s, for the default pulse, in the upper half of the band that steel
# beads excite. Of 15 to 80 kHz, tried on plates and rods, it needs the fewest vectors for records of 1.5 to 3.5 ms.
# For other pulses it is inversely proportional to their length, so that a body ten times as large needs the same
# vectors.
EXPANSION_POINT = 2.0 * np.pi * 35.0e3


class Modes(NamedTuple):
    """Oscillators; damping and arms are vectors where they are diagonal, and matrices elsewhere."""

    square: Vector  # ω²
    contact: Vector  # b, n × p
    damping: Vector | None
    arms: list[tuple[float, Vector]]  # τ and the stiffness of the arms
    vectors: Vector  # in the basis


class Part(NamedTuple):
    """A symmetric matrix or linear operator; rates: α, β if it is α M + β K and so diagonal in the modes."""

    matrix: Any
    rates: Vector | None


class Krylov:
    """The growing M-orthonormal basis V of the degrees of freedom with mass, and the Galerkin projections of K and C.

    The coordinates of Maxwell arms are q ∈ R span V, so the projection leaves them exact: only VᵀRᵀRV is needed.
    """

    def __init__(self, structure: Structure, largest: int, pulse: float) -> None:
        # Of long pulses the point falls no further, so that K + s²M of a free body stays regular.
        self.point = point = EXPANSION_POINT * (DEFAULT_PULSE / min(pulse, 100.0 * DEFAULT_PULSE))
        arms, damping, stiffness = maxwell_arms(structure), structure.damping, structure.stiffness
        self._all, self._body = structure.size, np.arange(structure.size)
        self.mass, self.contact, self.elastic = structure.mass, structure.contact_vectors, aslinearoperator(stiffness)
        if arms is not None:
            self._body, inner = arms.body, np.ix_(arms.body, arms.body)
            self.mass, self.contact, stiffness = self.mass[inner], self.contact[arms.body], stiffness[inner]
            damping, coupling = structure.damping[inner], aslinearoperator(arms.coupling)  # type: ignore[index]
            self.elastic = aslinearoperator(stiffness) - coupling.T @ coupling
        scale = 1.0 / np.sqrt(stiffness.diagonal() + point**2 * self.mass.diagonal())

        def part(matrix: Any) -> Part:
            return Part(matrix, rayleigh_rates(matrix, self.mass, self.elastic, scale))

        self.damping = part(damping) if damping is not None and damping.count_nonzero() else None
        self.arms: list[tuple[float, Part]] = []
        for time in [] if arms is None else np.unique(arms.time):
            root = aslinearoperator(arms.coupling[arms.time == time])  # type: ignore[union-attr]
            self.arms.append((float(time), part(root.T @ root)))

        size = len(self._body)
        self.largest, self.size = min(largest, size), 0
        self.basis, self.weighted = np.empty((self.largest, size)), np.empty((self.largest, size))  # rows v and M v
        self.projected = np.empty((self.largest, self.largest))
        parts = [self.damping, *(arm for _, arm in self.arms)]
        self.recursive = all(one is None or one.rates is not None for one in parts)
        # Forces that lead on, each with the vector before, which Arnoldi's second-order method needs.
        self.pending = [(force, np.zeros(size)) for force in self.contact.T]
        self.postponed: list[tuple[Vector, Vector]] = []
        self.second, self.vain = self.damping is not None and self.damping.rates is None, 0
        self.before = np.empty((self.largest if self.second else 0, size))
        if self.second:
            ours = sparse.diags_array(np.isin(np.arange(self._all), self._body).astype(float))
            damped = structure.stiffness + point * ours @ structure.damping @ ours
            self._solve = factorise(damped + point**2 * structure.mass)
        else:
            self._solve = structure.matrices.shifted_solve(point)

    @property
    def exhausted(self) -> bool:
        """True if the basis contains every motion that the contacts can excite."""
        return not (self.pending or self.postponed) or self.size == len(self.contact)

    def grow(self, count: int) -> bool:
        """Add `count` vectors, or as many as exist; False if none could be added."""
        before = self.size
        while self.size < min(before + count, self.largest) and not self.exhausted:
            self._add()
        new, done = slice(before, self.size), slice(0, self.size)
        block = self.basis[done] @ (self.elastic @ self.basis[new].T)
        self.projected[done, new], self.projected[new, done] = block, block.T
        return self.size > before

    def _add(self) -> None:
        """Add the next vector: by inertia alone r = K̃⁻¹M v, K̃ = K + s²M; with damping forces that no sum of M and K
        has, r = −s K̃⁻¹[(2s M + C) v + s M u], u the vector before, K̃ = K + s C + s²M, in second-order Arnoldi steps.

        The forces of arms come last: in rods of several layers they fill the basis with shapes that matter little.
        """
        k, mass, point, near = self.size, self.mass, self.point, 2 * self.contact.shape[1]
        force, before = (self.pending or self.postponed).pop(0)
        padded = np.zeros(self._all)
        padded[self._body] = force
        vector, lost = self._solve(padded)[self._body], 0.0
        # Lanczos's new vector has a part in the last two (for each contact) only, in exact numbers; the whole basis
        # clears the rounding.
        for first in (max(k - near, 0) if self.recursive else 0, 0):
            parts = self.weighted[first:k] @ vector
            vector -= parts @ self.basis[first:k]
            lost += float(parts @ parts)
            if self.second:
                before = before - parts @ self.before[first:k]
        weighted = mass @ vector
        square = max(vector @ weighted, 0.0)
        if square <= 1e-20 * (lost + square):  # nothing of it is new to the basis
            self.vain += 1
            if self.second and self.vain <= 4:  # the pair (v, u) may still lead on by u
                self.pending.append((-(point**2) * (mass @ before), np.zeros_like(before)))
            return
        norm = np.sqrt(square)
        self.basis[k], self.weighted[k] = vector / norm, weighted / norm
        self.size, self.vain = k + 1, 0
        if self.second:
            self.before[k] = before / norm
            force = (2.0 * point) * self.weighted[k] + self.damping.matrix @ self.basis[k]  # type: ignore[union-attr]
            self.pending.append((-point * (force + point * (mass @ self.before[k])), self.basis[k]))
        else:
            self.pending.append((self.weighted[k], before))
        none = np.zeros_like(before)
        self.postponed += [(arm.matrix @ self.basis[k], none) for _, arm in self.arms if arm.rates is None]

    def oscillators(self) -> Modes:
        """Return ω², b, C and the arms in the eigenvectors of K within the basis."""
        basis = self.basis[: self.size]
        square, vectors = eigh(self.projected[: self.size, : self.size])
        contact = vectors.T @ (basis @ self.contact)
        # Rigid motions have ω² = 0, which rounding may have made negative.
        if square.size and square[0] < -1e-9 * max(self.point, EXPANSION_POINT) ** 2:
            raise ValueError("stiffness: must have no negative eigenvalue, but there is a motion that grows")
        square = np.maximum(square, 0.0)

        def projected(part: Part) -> Vector:
            if part.rates is not None:
                return np.asarray(part.rates[0] + part.rates[1] * square)
            matrix = vectors.T @ (basis @ (part.matrix @ basis.T)) @ vectors
            return np.asarray(0.5 * (matrix + matrix.T))  # symmetric to the last bit

        damping = None if self.damping is None else projected(self.damping)
        return Modes(square, contact, damping, [(time, projected(arm)) for time, arm in self.arms], vectors)

    def shapes(self, modes: Modes) -> Vector:
        """Return the motion of the body in each oscillator, degrees of freedom × oscillators."""
        return np.asarray(self.basis[: self.size].T @ modes.vectors)
