"""What mass, stiffness and damping must be: symmetric, and without negative eigenvalues."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import eigsh, splu

Vector: TypeAlias = NDArray[np.float64]

SKEWED = 1e-8
"""The difference between two entries that must be equal, in units of √(Aᵢᵢ Aⱼⱼ): rounding in a mesh is below 1e-12."""

SMALL = 500
"""Rows up to which a matrix is factorised to look for negative eigenvalues: a millisecond or two. Larger matrices are
examined where they are factorised or projected anyway, see `reduce` and the steppers."""

ROUNDING = 1e-9
"""A negative eigenvalue of D^−½ A D^−½ (D the diagonal of A) nearer to zero than this is taken as rounding. Those of
rigid motions of thin plates are below 1e-12."""

PROJECTED = 1e-13
"""A negative eigenvalue of A nearer to zero than this share of the largest diagonal entry is taken as rounding too.
A projection VᵀAV rounds by the size of A, so its small entries carry an error that their own size does not bound."""

UNITS = {"mass": "kg", "stiffness": "N/m", "damping": "N s/m"}


def check_symmetric(name: str, matrix: sparse.csr_array) -> None:
    """A ValueError where a matrix of finite numbers is not symmetric, or cannot be positive semidefinite.

    Looks at all entries: none on the diagonal is negative, and none exceeds √(Aᵢᵢ Aⱼⱼ). A matrix of at most SMALL rows
    is examined by `check_definite` as well.
    """
    diagonal, unit = matrix.diagonal(), UNITS[name]
    if (diagonal < 0.0).any():
        row = int(np.argmin(diagonal))
        raise ValueError(
            f"{name}: must have no negative eigenvalue, but its diagonal entry {row} is {diagonal[row]:.3g} {unit}"
        )
    size = np.sqrt(diagonal + PROJECTED * diagonal.max(initial=0.0))
    entries, skewed = matrix.tocoo(), (matrix - matrix.T).tocoo()
    if (abs(skewed.data) > SKEWED * size[skewed.row] * size[skewed.col]).any():
        worst = int(np.argmax(abs(skewed.data)))
        row, column = int(skewed.row[worst]), int(skewed.col[worst])
        raise ValueError(
            f"{name}: must be symmetric, but entry ({row}, {column}) is {matrix[row, column]:.6g} {unit}, and "
            f"({column}, {row}) is {matrix[column, row]:.6g}"
        )
    limit = (1.0 + SKEWED) * size[entries.row] * size[entries.col]
    if (abs(entries.data) > limit).any():
        worst = int(np.argmax(abs(entries.data) - limit))
        row, column = int(entries.row[worst]), int(entries.col[worst])
        raise ValueError(
            f"{name}: must have no negative eigenvalue, but entry ({row}, {column}) is {entries.data[worst]:.3g} "
            f"{unit}, and the diagonal entries of its row and column are {diagonal[row]:.3g} and {diagonal[column]:.3g}"
        )
    if diagonal.size <= SMALL:
        check_definite(name, matrix)


def check_definite(name: str, matrix: sparse.csr_array) -> None:
    """A ValueError where a symmetric matrix has a negative eigenvalue, above rounding; of a mass also zero ones.

    Rows of zeros are left out: a degree of freedom may have no mass, and a body that floats no stiffness.
    """
    used = np.flatnonzero(matrix.diagonal())
    if used.size == matrix.count_nonzero():
        return  # Diagonal, and its entries are positive.
    inner = matrix[used][:, used]
    scale = 1.0 / np.sqrt(inner.diagonal())
    # A mass must resist every motion of what it belongs to; a stiffness may leave rigid motions.
    if name == "mass":
        raised = np.full(used.size, -ROUNDING)
    else:
        raised = ROUNDING + PROJECTED * np.minimum(scale / scale.min(), 1e8) ** 2
    positive = _dense(inner, scale, raised) if used.size <= SMALL else _sparse(inner, scale, raised)
    if not positive:
        kind = "must be positive definite" if name == "mass" else "must have no negative eigenvalue"
        raise ValueError(f"{name}: {kind}, but has one of about {_lowest(inner):.3g} {UNITS[name]}")


def _dense(matrix: sparse.csr_array, scale: Vector, raised: Vector) -> bool:
    """Whether scale · matrix · scale, its diagonal raised, is positive definite, by Cholesky's factorisation."""
    scaled = scale[:, None] * matrix.toarray() * scale
    scaled.flat[:: scale.size + 1] += raised
    try:
        np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        return False
    return True


def _sparse(matrix: sparse.csr_array, scale: Vector, raised: Vector) -> bool:
    """The same by A = L D Lᵀ, whose pivots have the signs of the eigenvalues (Sylvester)."""
    spread = sparse.diags_array(scale)
    scaled = sparse.csc_array(spread @ matrix @ spread + sparse.diags_array(raised))
    try:
        factor = splu(scaled, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # a pivot is zero
        return False
    return bool((factor.U.diagonal() > 0.0).all()) and np.array_equal(factor.perm_r, factor.perm_c)


def _lowest(matrix: sparse.csr_array) -> float:
    """The lowest eigenvalue."""
    if matrix.shape[0] <= SMALL:
        return float(np.linalg.eigvalsh(matrix.toarray())[0])
    return float(eigsh(matrix, k=1, which="SA", return_eigenvectors=False, tol=1e-2)[0])
