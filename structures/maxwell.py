"""Maxwell arms of structures: massless degrees of freedom q, with the energy |R u − q|²/2 and the loss τ|q̇|²."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from structures.linear_algebra.factor import decomposition
from structures.structure import Structure, Vector, is_diagonal


class MaxwellArms(NamedTuple):
    """body: the degrees of freedom u with mass. coupling: R, √J/m, a row for each q. time: τ of each q, s."""

    body: NDArray[np.intp]
    coupling: sparse.csr_array
    time: Vector


def with_arms(structure: Structure, root: sparse.csr_array, time: float, stiffness: Any = None) -> Structure:
    """Return the structure with one arm for each row of R (√J/m), with a relaxation time (s).

    R may lack the columns of earlier arms. stiffness: K of the body with rigid dashpots. The default, K + RᵀR, keeps
    the structure's own K for slow loads.
    """
    count = root.shape[0]
    root = sparse.csr_array((root.data, root.indices, root.indptr), (count, structure.size))
    held = structure.stiffness + root.T @ root if stiffness is None else stiffness
    damping = sparse.csr_array(structure.mass.shape) if structure.damping is None else structure.damping
    return replace(
        structure,
        mass=sparse.csr_array(sparse.block_diag([structure.mass, sparse.csr_array((count, count))])),
        stiffness=sparse.csr_array(sparse.block_array([[held, -root.T], [-root, sparse.eye_array(count)]])),
        damping=sparse.csr_array(sparse.block_diag([damping, time * sparse.eye_array(count)])),
        contact=np.concatenate([structure.contact, np.zeros((count, *structure.contact.shape[1:]))]),
    )


def maxwell_arms(structure: Structure) -> MaxwellArms | None:
    """Return the Maxwell arms of a structure, or None if it has none."""
    if structure.damping is None:
        return None
    # A massless degree of freedom without damping belongs to the body.
    massless, damped = (abs(matrix).sum(axis=0).ravel() for matrix in (structure.mass, structure.damping))
    is_arm = (massless == 0.0) & (damped > 0.0)
    arms, body = np.flatnonzero(is_arm), np.flatnonzero(~is_arm)
    losses, springs = structure.damping[arms], structure.stiffness[arms]
    own = springs[:, arms].diagonal()
    alone = abs(losses).sum() == abs(losses[:, arms].diagonal()).sum() and is_diagonal(springs[:, arms])
    if not arms.size or not alone or not (own > 0.0).all():
        return None
    scale = 1.0 / np.sqrt(own)
    coupling = sparse.csr_array(sparse.diags_array(-scale) @ springs[:, body])
    return MaxwellArms(body, coupling, scale**2 * losses[:, arms].diagonal())


def root_of(matrix: sparse.csr_array) -> sparse.csr_array:
    """Return R with RᵀR = matrix, a stiffness. R has as many rows as the rank of the matrix."""
    used = np.flatnonzero(abs(matrix).sum(axis=0))
    diagonal = matrix.diagonal()[used]
    spread = sparse.csr_array((np.ones(used.size), (np.arange(used.size), used)), (used.size, matrix.shape[0]))
    if is_diagonal(matrix):
        return sparse.csr_array(sparse.diags_array(np.sqrt(diagonal)) @ spread)
    # L D Lᵀ of the scaled matrix. SuperLU fails at the pivots of exactly zero that rigid motions leave, so 1e-15 is
    # added; rounding changes pivots by more.
    scale = 1.0 / np.sqrt(diagonal)
    by = sparse.diags_array(scale)
    factor = decomposition(by @ matrix[used][:, used] @ by + 1e-15 * sparse.eye_array(scale.size))
    lower, pivots = sparse.diags_array(1.0 / scale) @ sparse.csr_array(factor.L)[factor.perm_r], factor.U.diagonal()
    rigid = 1e-6  # in plates of 6 000 degrees of freedom, pivots of rigid motions are below 6e-9, others above 2e-4
    if pivots.min() < -rigid:
        raise ValueError("stiffness: must have no negative eigenvalue")
    positive = pivots > rigid
    root = sparse.diags_array(np.sqrt(pivots[positive])) @ sparse.csc_array(lower)[:, positive].T
    return sparse.csr_array(root @ spread)
