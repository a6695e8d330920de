"""Requirements on mass, stiffness and damping: symmetric, without negative eigenvalues."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import SuperLU, eigsh, splu

from structures.linear_algebra.one_thread import one_thread

Vector: TypeAlias = NDArray[np.float64]

LARGEST_ASYMMETRY = 1e-8
"""Largest difference between two entries that must be equal, in units of √(Aᵢᵢ Aⱼⱼ); rounding in a mesh is below 1e-12.
"""

SMALL_MATRIX = 500
"""A matrix of at most this many rows is factorised immediately to look for negative eigenvalues, in one or two
milliseconds. Larger matrices are checked when they are factorised or projected anyway (`reduce`, windows).
"""

EIGENVALUE_ROUNDING = 1e-9
"""Negative eigenvalues of D^−½ A D^−½ (D the diagonal of A) closer to zero than this are attributed to rounding. Those
of the rigid motions of thin plates are below 1e-12.
"""

PROJECTION_ROUNDING = 1e-13
"""Negative eigenvalues of A closer to zero than this fraction of the largest diagonal entry are attributed to rounding,
too. The rounding error of a projection VᵀAV depends on the size of A, so the size of its small entries does not bound
their error.
"""

UNITS = {"mass": "kg", "stiffness": "N/m", "damping": "N s/m"}


def check_symmetric(name: str, matrix: sparse.csr_array) -> None:
    """Raise a ValueError if a matrix of finite numbers is not symmetric or cannot be positive semidefinite.

    All entries are checked: none on the diagonal may be negative, and none may exceed √(Aᵢᵢ Aⱼⱼ). A matrix of at most
    SMALL_MATRIX rows is checked by `check_definite` as well.
    """
    diagonal, unit = matrix.diagonal(), UNITS[name]
    if (diagonal < 0.0).any():
        row = int(np.argmin(diagonal))
        raise ValueError(
            f"{name}: must have no negative eigenvalue, but its diagonal entry {row} is {diagonal[row]:.3g} {unit}"
        )
    if np.count_nonzero(diagonal) == matrix.count_nonzero():
        return  # Diagonal, and its entries are positive.
    size = np.sqrt(diagonal + PROJECTION_ROUNDING * diagonal.max(initial=0.0))
    entries, skewed = matrix.tocoo(), (matrix - matrix.T).tocoo()
    if (abs(skewed.data) > LARGEST_ASYMMETRY * size[skewed.row] * size[skewed.col]).any():
        worst = int(np.argmax(abs(skewed.data)))
        row, column = int(skewed.row[worst]), int(skewed.col[worst])
        raise ValueError(
            f"{name}: must be symmetric, but entry ({row}, {column}) is {matrix[row, column]:.6g} {unit}, and "
            f"({column}, {row}) is {matrix[column, row]:.6g}"
        )
    limit = (1.0 + LARGEST_ASYMMETRY) * size[entries.row] * size[entries.col]
    if (abs(entries.data) > limit).any():
        worst = int(np.argmax(abs(entries.data) - limit))
        row, column = int(entries.row[worst]), int(entries.col[worst])
        raise ValueError(
            f"{name}: must have no negative eigenvalue, but entry ({row}, {column}) is {entries.data[worst]:.3g} "
            f"{unit} between diagonal entries of {diagonal[row]:.3g} and {diagonal[column]:.3g}"
        )
    if diagonal.size <= SMALL_MATRIX:
        check_definite(name, matrix)


def check_definite(name: str, matrix: sparse.csr_array) -> None:
    """Raise a ValueError if a symmetric matrix has a negative eigenvalue beyond rounding; a mass must not have zero
    ones.
    """
    if not is_definite(name, matrix):
        kind = "must be positive definite" if name == "mass" else "must have no negative eigenvalue"
        used = np.flatnonzero(matrix.diagonal())
        raise ValueError(f"{name}: {kind}, but has one of about {_lowest(matrix[used][:, used]):.3g} {UNITS[name]}")


def is_definite(name: str, matrix: sparse.csr_array) -> bool:
    """Return whether a symmetric matrix has no negative eigenvalue beyond rounding, and a mass no zero one.

    Rows of zeros are left out: a degree of freedom may be massless, and a free body has no stiffness against rigid
    motion.
    """
    used = np.flatnonzero(matrix.diagonal())
    if used.size == matrix.count_nonzero():
        return True  # Diagonal, and its entries are positive.
    inner = matrix[used][:, used]
    scale = 1.0 / np.sqrt(inner.diagonal())
    # Every motion needs inertia, but a rigid motion needs no stiffness.
    if name == "mass":
        raised = np.full(used.size, -EIGENVALUE_ROUNDING)
    else:
        raised = EIGENVALUE_ROUNDING + PROJECTION_ROUNDING * np.minimum(scale / scale.min(), 1e8) ** 2
    return _dense(inner, scale, raised) if used.size <= SMALL_MATRIX else _sparse(inner, scale, raised)


@one_thread
def _dense(matrix: sparse.csr_array, scale: Vector, raised: Vector) -> bool:
    """Return whether scale · matrix · scale, with its diagonal raised, is positive definite, by Cholesky's method."""
    scaled = scale[:, None] * matrix.toarray() * scale
    scaled.flat[:: scale.size + 1] += raised
    try:
        np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        return False
    return True


def _sparse(matrix: sparse.csr_array, scale: Vector, raised: Vector) -> bool:
    """Return the same by A = L D Lᵀ, whose pivots have the signs of the eigenvalues (Sylvester)."""
    spread = sparse.diags_array(scale)
    return has_positive_pivots(spread @ matrix @ spread + sparse.diags_array(raised))


def decomposition(matrix: sparse.sparray) -> SuperLU:
    """Return L U of a symmetric matrix, without pivoting. Raises RuntimeError if a pivot is zero."""
    return splu(sparse.csc_array(matrix), "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})


def has_positive_pivots(matrix: sparse.sparray) -> bool:
    """Return whether a symmetric matrix is positive definite; see `_sparse`."""
    try:
        factor = decomposition(matrix)
    except RuntimeError:  # a pivot is zero
        return False
    return bool((factor.U.diagonal() > 0.0).all()) and np.array_equal(factor.perm_r, factor.perm_c)


def _lowest(matrix: sparse.csr_array) -> float:
    """Return the lowest eigenvalue."""
    if matrix.shape[0] <= SMALL_MATRIX:
        return float(np.linalg.eigvalsh(matrix.toarray())[0])
    return float(eigsh(matrix, k=1, which="SA", return_eigenvectors=False, tol=1e-2)[0])
