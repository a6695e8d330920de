"""Sparse symmetric factorisations, scaled, and the object that owns those of a body."""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import lu_factor, lu_solve

from structures.linear_algebra.symmetric import SMALL_MATRIX, check_definite, check_symmetric, decomposition

Vector: TypeAlias = NDArray[np.float64]
Solve: TypeAlias = Callable[[Vector], Vector]

AT_ONCE = 16
"""Right-hand sides that are solved together, which takes less than half as long for each as alone."""


def factorise(matrix: sparse.sparray | Vector) -> Solve:
    """Return a function that solves matrix · x = y for a symmetric positive definite matrix; y: n numbers, or n × q.

    Rows and columns are first scaled by 1/√diagonal, because Hermite degrees of freedom have different units.
    """
    scale = 1.0 / np.sqrt(matrix.diagonal())
    if isinstance(matrix, np.ndarray):
        by, factors = scale[:, None], lu_factor(scale[:, None] * matrix * scale, check_finite=False)

        def solve_dense(right: Vector) -> Vector:
            columns = by * right.reshape(len(by), -1)
            return np.asarray(by * lu_solve(factors, columns, check_finite=False)).reshape(right.shape)

        return solve_dense
    factor = decomposition(sparse.diags_array(scale) @ matrix @ sparse.diags_array(scale))

    def solve(right: Vector) -> Vector:
        by = scale if right.ndim == 1 else scale[:, None]
        solution: Vector = by * factor.solve(by * right)
        return solution

    return solve


def compliance_at(stiffness: sparse.sparray, places: NDArray[np.int64]) -> Vector:
    """Return the displacements at m places by unit forces there, m × m, for a symmetric positive definite stiffness."""
    solve, compliance = factorise(stiffness), np.empty((places.size, places.size))
    for first in range(0, places.size, AT_ONCE):
        columns = slice(first, first + AT_ONCE)
        forces = np.zeros((stiffness.shape[0], places[columns].size))
        forces[places[columns], np.arange(forces.shape[1])] = 1.0
        compliance[:, columns] = solve(forces)[places]
    return compliance


class Matrices:
    """Mass M and stiffness K of a body: checked once, and factorised once for each shift.

    Code that assembles M and K keeps this object and passes it to every structure that shares them, for example to the
    structures of many contact points on one mesh. It keeps the factorisations. A copy, also one in another process,
    starts without factorisations.

    mass, stiffness: sparse, n × n. Raises ValueError if one is not square, finite and symmetric, or has a negative
    eigenvalue (`check_symmetric` says what is found immediately in a large matrix).
    """

    def __init__(self, mass: Any, stiffness: Any) -> None:
        self.mass, self.stiffness = symmetric("mass", mass), symmetric("stiffness", stiffness)
        self._solves: dict[float, Solve] = {}
        self._examined = self.mass.shape[0] <= SMALL_MATRIX

    def belong(self, mass: object, stiffness: object) -> bool:
        """Return whether these are the matrices themselves; equal copies do not count."""
        return self.mass is mass and self.stiffness is stiffness

    def shifted_solve(self, shift: float) -> Solve:
        """Return a solver of (K + shift² M) x = y, shift in 1/s."""
        if shift not in self._solves:
            self._solves[shift] = factorise(self.stiffness + shift**2 * self.mass)
        return self._solves[shift]

    def examine(self) -> None:
        """Raise a ValueError if a matrix of any size has a negative eigenvalue; needs one factorisation of each,
        once.
        """
        if not self._examined:
            check_definite("mass", self.mass)
            check_definite("stiffness", self.stiffness)
            self._examined = True

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_solves": {}}


def symmetric(name: str, value: Any) -> sparse.csr_array:
    """Return matrix as a csr_array; a ValueError if it is not square, finite, symmetric and positive semidefinite."""
    matrix = value
    if not isinstance(matrix, sparse.csr_array):
        matrix = matrix if sparse.issparse(matrix) else np.atleast_2d(numbers(name, matrix))
        matrix = sparse.csr_array(matrix) if matrix.ndim == 2 else matrix
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise ValueError(f"{name} has shape {matrix.shape}: must be square")
    if not np.isfinite(matrix.data).all():
        raise ValueError(f"{name}: must hold finite numbers")
    check_symmetric(name, matrix)
    return matrix


def numbers(name: str, values: object) -> Vector:
    """Return an array of finite numbers, or raise a ValueError."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.array(np.nan)
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: must hold finite numbers")
    return array
