"""Krylov vectors: the first motions of a body that forces at its contacts excite, and projections on them."""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import aslinearoperator

from structures.linear_algebra.factor import factorise
from structures.maxwell import maxwell_arms
from structures.stepping import rayleigh_rates
from structures.structure import Structure, Vector

# s. Default length of the force pulse for which the error is estimated: the contact time of a small steel bead.
DEFAULT_PULSE = 25.0e-6

# Real expansion point s of the Krylov space, 1/s, for the default pulse. It lies in the upper half of the band that
# steel beads excite. Of the points tried on plates and rods, 15 to 80 kHz, it needs the fewest vectors for records of
# 1.5 to 3.5 ms. For other pulses it is inversely proportional to their length, so that a body ten times as large needs
# the same vectors.
EXPANSION_POINT = 2.0 * np.pi * 35.0e3


class Modes(NamedTuple):
    """Oscillators. Damping and arms are vectors if they are diagonal, and matrices otherwise."""

    square: Vector  # ω²
    contact: Vector  # b, n × p
    damping: Vector | None
    arms: list[tuple[float, Vector]]  # τ and the stiffness of the arms that have it
    vectors: Vector  # their coefficients in the basis


class Part(NamedTuple):
    """A symmetric matrix or linear operator. rates: α and β if it is α M + β K, which is diagonal in the modes."""

    matrix: Any
    rates: Vector | None


class Krylov:
    """The growing M-orthonormal basis V of the degrees of freedom with mass, and the Galerkin projections of K and C.

    The coordinates of Maxwell arms lie in R span V. So their projection is exact and needs only VᵀRᵀRV.
    """

    def __init__(self, structure: Structure, largest: int, pulse: float) -> None:
        # The point has a lower limit for long pulses, so that K + s²M of a free body stays regular.
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
        # Forces of the next vectors, each with the vector before, which the second-order Arnoldi method needs.
        self.pending = [(force, np.zeros(size)) for force in self.contact.T]
        self.postponed: list[tuple[Vector, Vector]] = []
        self.second, self.failures = self.damping is not None and self.damping.rates is None, 0
        self.before = np.empty((self.largest if self.second else 0, size))
        if self.second:
            massive = sparse.diags_array(np.isin(np.arange(self._all), self._body).astype(float))
            damped = structure.stiffness + point * massive @ structure.damping @ massive
            self._solve = factorise(damped + point**2 * structure.mass)
        else:
            self._solve = structure.matrices.shifted_solve(point)

    @property
    def exhausted(self) -> bool:
        """True if the basis contains every motion that the contacts can excite."""
        return not (self.pending or self.postponed) or self.size == len(self.contact)

    def grow(self, count: int) -> bool:
        """Add `count` vectors, or as many as exist; return False if none could be added."""
        before = self.size
        while self.size < min(before + count, self.largest) and not self.exhausted:
            self._add()
        new, done = slice(before, self.size), slice(0, self.size)
        block = self.basis[done] @ (self.elastic @ self.basis[new].T)
        self.projected[done, new], self.projected[new, done] = block, block.T
        return self.size > before

    def _add(self) -> None:
        """Add the next vector.

        Without damping, or with C = α M + β K, it is r = K̃⁻¹M v with K̃ = K + s²M. Other damping needs second-order
        Arnoldi steps: r = −s K̃⁻¹[(2s M + C) v + s M u], with u the vector before v and K̃ = K + s C + s²M. The forces
        of arms come last: in rods of several layers they fill the basis with shapes that matter little.
        """
        k, mass, point, near = self.size, self.mass, self.point, 2 * self.contact.shape[1]
        force, before = (self.pending or self.postponed).pop(0)
        padded = np.zeros(self._all)
        padded[self._body] = force
        vector, lost = self._solve(padded)[self._body], 0.0
        # In exact arithmetic Lanczos's new vector has components only along the last two vectors (for each contact). A
        # second pass over the whole basis removes the rounding.
        for first in (max(k - near, 0) if self.recursive else 0, 0):
            parts = self.weighted[first:k] @ vector
            vector -= parts @ self.basis[first:k]
            lost += float(parts @ parts)
            if self.second:
                before = before - parts @ self.before[first:k]
        weighted = mass @ vector
        square = max(vector @ weighted, 0.0)
        if square <= 1e-20 * (lost + square):  # it adds nothing to the basis
            self.failures += 1
            if self.second and self.failures <= 4:  # u of the pair (v, u) may still lead to new vectors
                self.pending.append((-(point**2) * (mass @ before), np.zeros_like(before)))
            return
        norm = np.sqrt(square)
        self.basis[k], self.weighted[k] = vector / norm, weighted / norm
        self.size, self.failures = k + 1, 0
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
        # Rigid motions have ω² = 0; rounding may make it negative.
        if square.size and square[0] < -1e-9 * max(self.point, EXPANSION_POINT) ** 2:
            raise ValueError("stiffness: must have no negative eigenvalue, but one motion grows")
        square = np.maximum(square, 0.0)

        def projected(part: Part) -> Vector:
            if part.rates is not None:
                return np.asarray(part.rates[0] + part.rates[1] * square)
            matrix = vectors.T @ (basis @ (part.matrix @ basis.T)) @ vectors
            return np.asarray(0.5 * (matrix + matrix.T))  # symmetric to the last bit

        damping = None if self.damping is None else projected(self.damping)
        return Modes(square, contact, damping, [(time, projected(arm)) for time, arm in self.arms], vectors)
