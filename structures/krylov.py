"""Krylov vectors: the motions of a body that a force at its contacts reaches first, and the projections on them."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from structures.linear_algebra.factor import factorise
from structures.maxwell import maxwell_arms
from structures.structure import Structure, Vector

DEFAULT_PULSE, LONGEST_PULSE = 25.0e-6, 2.5e-3
"""s. Length of the force pulse for which the error is estimated by default: the contact time of a small steel bead. For
pulses longer than the second the expansion point falls no further, so that K + s²M of a free body stays regular."""

EXPANSION_POINT = 2.0 * np.pi * 35.0e3
"""Real expansion point s of the Krylov space, 1/s, for the default pulse, in the upper half of the band that steel
beads excite. Of 15 to 80 kHz, tried on plates and rods, it needs the fewest vectors for records of 1.5 to 3.5 ms. For
other pulses it is inversely proportional to their length, so that a body ten times as large needs the same vectors.
"""

LEAST_NEW_PART, MOST_IN_VAIN = 1e-10, 4
"""A vector is dropped if the fraction of it that is new to the basis is smaller than the first. And the steps with
damping forces, one after the other, that may bring nothing new."""

NEGATIVE_ROUNDING = 1e-9
"""A negative square of an angular frequency above −NEGATIVE_ROUNDING s² is attributed to rounding. s: the expansion
point, at least that of the default pulse."""

RANDOM_PROBES, PROPORTIONAL_DIFFERENCE = 3, 1e-11
"""A matrix counts as α M + β K if its products with so many random vectors differ by less than this fraction."""

Apply: TypeAlias = Callable[[Vector], Vector]


def expansion_point(pulse: float) -> float:
    """Return the expansion point for a pulse of this length, 1/s."""
    return EXPANSION_POINT * (DEFAULT_PULSE / min(pulse, LONGEST_PULSE))


class Modes(NamedTuple):
    """Oscillators: ω², b (n × p), their damping (None, a vector if it is diagonal, or a matrix), (τ, the stiffness of
    the arms in the same form) for each relaxation time, and their vectors in the basis.
    """

    square: Vector
    contact: Vector
    damping: Vector | None
    arms: list[tuple[float, Vector]]
    vectors: Vector


class Part(NamedTuple):
    """A symmetric matrix as a linear operator; rates: (α, β) if it is α M + β K and so diagonal in the modes."""

    apply: Apply
    rates: tuple[float, float] | None


def stretching(root: sparse.csr_array, x: Vector) -> Vector:
    return np.asarray(root.T @ (root @ x))


class Krylov:
    """The growing M-orthonormal basis V of the degrees of freedom with mass, and the Galerkin projections of K and C.

    The coordinates of Maxwell arms are q ∈ R span V, so the projection leaves them exact: only VᵀRᵀRV is needed.
    point: the expansion point, 1/s.
    """

    def __init__(self, structure: Structure, largest: int, point: float) -> None:
        self.point, self._size = point, structure.size
        self.mass, self.stiffness, damping = structure.mass, structure.stiffness, structure.damping
        self.contact: Vector = structure.contact_vectors
        self._inner: Any = slice(None)
        self.coupling, found = sparse.csr_array((0, structure.size)), maxwell_arms(structure)
        if found is not None:
            inner, self._inner, self.coupling = np.ix_(found.body, found.body), found.body, found.coupling
            self.mass, self.stiffness, self.contact = self.mass[inner], self.stiffness[inner], self.contact[found.body]
            damping = damping[inner] if damping is not None and damping[inner].count_nonzero() else None
        self.damping = None if damping is None else self._part(lambda x: damping @ x)
        self.arms = list[tuple[float, Part]]()
        for time in [] if found is None else np.unique(found.time):
            root = found.coupling[found.time == time]  # type: ignore[union-attr]
            self.arms.append((float(time), self._part(partial(stretching, root))))
        size = self.contact.shape[0]
        self.largest, self.size = min(largest, size), 0
        self.basis, self.weighted = np.empty((self.largest, size)), np.empty((self.largest, size))  # rows v and M v
        self.projected = np.empty((self.largest, self.largest))
        parts = [self.damping, *(arm for _, arm in self.arms)]
        self.recursive = all(part is None or part.rates is not None for part in parts)
        # Forces that lead on, each with the vector before, which Arnoldi's second-order method needs.
        self.pending = [(force, np.zeros(size)) for force in self.contact.T]
        self.postponed: list[tuple[Vector, Vector]] = []
        self.second, self.vain = self.damping is not None and self.damping.rates is None, 0
        self.before, shifted = np.empty((self.largest if self.second else 0, size)), structure.matrices.shifted_solve
        if self.second:
            of_body = np.zeros(self._size)
            of_body[self._inner] = 1.0
            whole = sparse.diags_array(of_body) @ structure.damping @ sparse.diags_array(of_body)
            self._solve = factorise(structure.stiffness + point * whole + point**2 * structure.mass)
        else:
            self._solve = shifted(point)

    def solve(self, right: Vector) -> Vector:
        """Solve (K + s²M) x = y, with no force on the arms."""
        padded = np.zeros(self._size)
        padded[self._inner] = right
        solution: Vector = self._solve(padded)[self._inner]
        return solution

    def elastic(self, x: Vector) -> Vector:
        """Return K x."""
        force: Vector = self.stiffness @ x - self.coupling.T @ (self.coupling @ x)
        return force

    def _part(self, apply: Apply) -> Part:
        """Return the matrix, compared with M and K in units that suit Hermite elements."""
        scale = 1.0 / np.sqrt(self.stiffness.diagonal() + self.point**2 * self.mass.diagonal())[:, None]
        probe = scale * np.random.default_rng(0).normal(size=(scale.size, RANDOM_PROBES))
        units = np.column_stack([(scale * (self.mass @ probe)).ravel(), (scale * self.elastic(probe)).ravel()])
        image = (scale * apply(probe)).ravel()
        sizes = np.maximum(np.linalg.norm(units, axis=0), np.finfo(float).tiny)
        rates = np.linalg.lstsq(units / sizes, image, rcond=None)[0] / sizes
        proportional = np.linalg.norm(units @ rates - image) <= PROPORTIONAL_DIFFERENCE * np.linalg.norm(image)
        return Part(apply, (float(rates[0]), float(rates[1])) if proportional else None)

    @property
    def exhausted(self) -> bool:
        """True if the basis contains every motion that the contacts can excite."""
        return not (self.pending or self.postponed) or self.size == self.contact.shape[0]

    def grow(self, count: int) -> bool:
        """Add `count` vectors, or as many as exist; False if none could be added."""
        before = self.size
        while self.size < min(before + count, self.largest) and not self.exhausted:
            self._add()
        new, done = slice(before, self.size), slice(0, self.size)
        block = self.basis[done] @ self.elastic(self.basis[new].T)
        self.projected[done, new], self.projected[new, done] = block, block.T
        return self.size > before

    def _add(self) -> None:
        """Add the next vector: by inertia alone r = K̃⁻¹M v, K̃ = K + s²M; with damping forces that no sum of M and K
        has, r = −s K̃⁻¹[(2s M + C) v + s M u], u the vector before, K̃ = K + s C + s²M, in second-order Arnoldi steps.

        The forces of arms come last: in rods of several layers they fill the basis with shapes that matter little.
        """
        k, mass, point, near = self.size, self.mass, self.point, 2 * self.contact.shape[1]
        force, before = (self.pending or self.postponed).pop(0)
        vector, lost = self.solve(force), 0.0
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
        if square <= LEAST_NEW_PART**2 * (lost + square):
            self.vain += 1
            if self.second and self.vain <= MOST_IN_VAIN:  # the pair (v, u) may still lead on by u
                self.pending.append((-(point**2) * (mass @ before), np.zeros_like(before)))
            return
        norm = np.sqrt(square)
        self.basis[k], self.weighted[k] = vector / norm, weighted / norm
        self.size, self.vain = k + 1, 0
        if self.second:
            self.before[k] = before / norm
            force = (2.0 * point) * self.weighted[k] + self.damping.apply(self.basis[k])  # type: ignore[union-attr]
            self.pending.append((-point * (force + point * (mass @ self.before[k])), self.basis[k]))
        else:
            self.pending.append((self.weighted[k], before))
        none = np.zeros_like(before)
        self.postponed += [(arm.apply(self.basis[k]), none) for _, arm in self.arms if arm.rates is None]

    def oscillators(self) -> Modes:
        """Return ω², b, C and the arms in the eigenvectors of K within the basis."""
        basis = self.basis[: self.size]
        square, vectors = eigh(self.projected[: self.size, : self.size])
        contact = vectors.T @ (basis @ self.contact)
        if square.size and square[0] < -NEGATIVE_ROUNDING * max(self.point, EXPANSION_POINT) ** 2:
            raise ValueError(
                "stiffness: must have no negative eigenvalue, but there is a motion that grows as "
                f"e^(t/τ) with τ = {1.0 / np.sqrt(-square[0]):.3g} s"
            )
        # Rigid motions have ω² = 0, which rounding may have made negative.
        square = np.maximum(square, 0.0)

        def projected(part: Part) -> Vector:
            if part.rates is not None:
                return np.asarray(np.maximum(part.rates[0] + part.rates[1] * square, 0.0))
            matrix = vectors.T @ (basis @ part.apply(basis.T)) @ vectors
            return np.asarray(0.5 * (matrix + matrix.T))  # symmetric to the last bit

        damping = None if self.damping is None else projected(self.damping)
        return Modes(square, contact, damping, [(time, projected(arm)) for time, arm in self.arms], vectors)

    def shapes(self, modes: Modes) -> Vector:
        """Return the motion of the body in each oscillator, degrees of freedom × oscillators."""
        return np.asarray(self.basis[: self.size].T @ modes.vectors)
