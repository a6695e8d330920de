"""Sparse symmetric matrices: assembly, checks and factorisations, and the pair of matrices of a body."""

from collections.abc import Callable
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import SuperLU, eigsh, splu

from structures.checks import each, finite
from structures.linear_algebra.one_thread import one_thread

Vector: TypeAlias = NDArray[np.float64]
Solve: TypeAlias = Callable[[Vector], Vector]

AT_ONCE = 16  # Right-hand sides that are solved together, in less than half the time of separate solutions

# A matrix of at most this many rows is checked for negative eigenvalues immediately, in one or two milliseconds. Larger
# matrices are checked when they are factorised or projected anyway (`reduce`, windows).
SMALL_MATRIX = 500

# Negative eigenvalues closer to zero count as rounding. The first limit is for D^−½ A D^−½ with the diagonal D of A:
# rigid motions of thin plates have less than 1e-12. The second is for A as a fraction of its largest diagonal entry,
# because the rounding of a projection VᵀAV depends on the size of A.
EIGENVALUE_ROUNDING, PROJECTION_ROUNDING = 1e-9, 1e-13

UNITS = {"mass": "kg", "stiffness": "N/m", "damping": "N s/m"}


def sum_of_cells(dofs: NDArray[np.int64], blocks: Vector, size: int) -> sparse.csr_array:
    """Assemble a matrix, size × size, from blocks, cells × d × d; dofs: the degrees of freedom, cells × d."""
    rows, columns = np.broadcast_arrays(dofs[:, :, None], dofs[:, None, :])
    entries = blocks.ravel(), (rows.ravel(), columns.ravel())
    return sparse.csr_array(sparse.coo_array(entries, shape=(size, size)))


def decomposition(matrix: sparse.sparray) -> SuperLU:
    """Return L U of a symmetric matrix, without pivoting; a pivot of zero raises a RuntimeError."""
    return splu(sparse.csc_array(matrix), "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})


def factorise(matrix: sparse.sparray | Vector) -> Solve:
    """Return a function that solves matrix · x = y for a symmetric positive definite matrix; y: n numbers, or n × q."""
    # Scaled, as degrees of freedom may have different units.
    scale = 1.0 / np.sqrt(matrix.diagonal())
    if isinstance(matrix, np.ndarray):
        factors = lu_factor(scale[:, None] * matrix * scale, check_finite=False)
        inner: Solve = partial(lu_solve, factors, check_finite=False)
    else:
        inner = decomposition(sparse.diags_array(scale) @ matrix @ sparse.diags_array(scale)).solve

    def solve(right: Vector) -> Vector:
        by = scale if right.ndim == 1 else scale[:, None]
        solution: Vector = by * inner(by * right)
        return solution

    return solve


def compliance_at(stiffness: sparse.sparray, places: NDArray[np.int64]) -> Vector:
    """Return the displacements at m places under unit forces there, m × m, for a positive definite stiffness."""
    solve, compliance = factorise(stiffness), np.empty((places.size, places.size))
    for first in range(0, places.size, AT_ONCE):
        columns = slice(first, first + AT_ONCE)
        forces = np.zeros((stiffness.shape[0], places[columns].size))
        forces[places[columns], np.arange(forces.shape[1])] = 1.0
        compliance[:, columns] = solve(forces)[places]
    return compliance


class Matrices:
    """Mass M and stiffness K, n × n, of structures on one mesh, checked once and factorised once for each shift."""

    def __init__(self, mass: Any, stiffness: Any) -> None:
        self.mass, self.stiffness = symmetric("mass", mass), symmetric("stiffness", stiffness)
        self._solves: dict[float, Solve] = {}
        self._examined = self.mass.shape[0] <= SMALL_MATRIX

    def shifted_solve(self, shift: float) -> Solve:
        """Return a function that solves (K + shift² M) x = y; shift: 1/s."""
        if shift not in self._solves:
            self._solves[shift] = factorise(self.stiffness + shift**2 * self.mass)
        return self._solves[shift]

    def examine(self) -> None:
        """Raise a ValueError if a matrix has a negative eigenvalue, whatever its size; it is checked once."""
        if not self._examined:
            check_definite("mass", self.mass)
            check_definite("stiffness", self.stiffness)
            self._examined = True

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the factorisations for copies and other processes."""
        return {**self.__dict__, "_solves": {}}


def symmetric(name: str, value: Any) -> sparse.csr_array:
    """Return a csr_array; raise a ValueError unless it is square, finite, symmetric and, if small, semidefinite."""
    matrix = value if sparse.issparse(value) else np.atleast_2d(each(finite, name, value))
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise ValueError(f"{name} has shape {matrix.shape}: must be square")
    matrix = matrix if isinstance(matrix, sparse.csr_array) else sparse.csr_array(matrix)
    if np.iscomplexobj(matrix.data) or not np.isfinite(matrix.data).all():
        raise ValueError(f"{name}: must hold finite, real numbers")
    diagonal = matrix.diagonal()
    if (diagonal < 0.0).any():
        row = int(np.argmin(diagonal))
        raise ValueError(f"{name}: must have no negative eigenvalue, but entry ({row}, {row}) is {diagonal[row]:.3g}")
    if np.count_nonzero(diagonal) == matrix.count_nonzero():
        return matrix  # diagonal, and its entries are positive
    size = np.sqrt(diagonal + PROJECTION_ROUNDING * diagonal.max(initial=0.0))
    skewed = (matrix - matrix.T).tocoo()
    # Rounding in a mesh stays below 1e-12 in these units.
    wrong = np.flatnonzero(abs(skewed.data) > 1e-8 * size[skewed.row] * size[skewed.col])
    if wrong.size:
        row, column = int(skewed.row[wrong[0]]), int(skewed.col[wrong[0]])
        raise ValueError(f"{name}: must be symmetric, but entries ({row}, {column}) and ({column}, {row}) differ")
    if diagonal.size <= SMALL_MATRIX:
        check_definite(name, matrix)
    return matrix


def check_definite(name: str, matrix: sparse.csr_array) -> None:
    """Raise a ValueError if a symmetric matrix has a negative eigenvalue, or a mass a zero eigenvalue."""
    if is_definite(name, matrix):
        return
    kind = "must be positive definite" if name == "mass" else "must have no negative eigenvalue"
    if matrix.shape[0] <= SMALL_MATRIX:
        lowest = np.linalg.eigvalsh(matrix.toarray())[0]
    else:
        lowest = eigsh(matrix, k=1, which="SA", return_eigenvectors=False, tol=1e-2)[0]
    raise ValueError(f"{name}: {kind}, but has an eigenvalue of about {lowest:.3g} {UNITS[name]}")


@one_thread
def is_definite(name: str, matrix: sparse.csr_array) -> bool:
    """Return whether a symmetric matrix has no negative eigenvalue, and a mass, without empty rows, no zero one."""
    used = np.flatnonzero(matrix.diagonal())
    if used.size == matrix.count_nonzero():
        return True  # diagonal, and its entries are positive
    inner = matrix[used][:, used]
    if abs(matrix).sum() - abs(inner).sum() > PROJECTION_ROUNDING * abs(matrix).sum():
        return False  # a row with a zero on the diagonal has an entry
    scale = 1.0 / np.sqrt(inner.diagonal())
    # Every motion needs inertia, but a rigid motion needs no stiffness.
    if name == "mass":
        raised = np.full(used.size, -EIGENVALUE_ROUNDING)
    else:
        raised = EIGENVALUE_ROUNDING + PROJECTION_ROUNDING * np.minimum(scale / scale.min(), 1e8) ** 2
    spread = sparse.diags_array(scale)
    scaled = spread @ inner @ spread + sparse.diags_array(raised)
    try:
        if used.size <= SMALL_MATRIX:
            np.linalg.cholesky(scaled.toarray())
            return True
        # The pivots of A = L D Lᵀ have the signs of the eigenvalues (Sylvester).
        factor = decomposition(scaled)
    except (np.linalg.LinAlgError, RuntimeError):  # RuntimeError: a pivot is zero
        return False
    return bool((factor.U.diagonal() > 0.0).all()) and np.array_equal(factor.perm_r, factor.perm_c)
