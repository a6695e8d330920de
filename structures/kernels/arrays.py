"""Small compiled functions for arrays."""

from structures.kernels.compiling import inner
from structures.structure import Vector

# A mask for an index. It tells the compiler that no index counts from the end of an array. Without it, a pass over
# bodies would have no vector instructions and take three times as long.
NOT_NEGATIVE = 0x7FFF_FFFF


@inner()
def copy(source: Vector, target: Vector) -> None:
    """Do the same as `target[:] = source`, for which Numba would also compile an error message for seconds."""
    for i in range(target.size):
        target[i] = source[i]


@inner(forceinline=True, fastmath={"contract", "reassoc"})
def dot(a: Vector, b: Vector) -> float:
    """Return the sum of the products of a with the first entries of b."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


@inner(forceinline=True, fastmath={"contract", "reassoc"})
def weighted(weights: Vector, x: Vector) -> float:
    """Return Σ w x²."""
    total = 0.0
    for i in range(weights.size):
        total += weights[i] * x[i] * x[i]
    return total


@inner()
def solve(matrix: Vector, right: Vector, size: int) -> None:
    """Solve a few linear equations in place, by Gaussian elimination with pivots."""
    for i in range(size):
        pivot = i
        for j in range(i + 1, size):
            if abs(matrix[j, i]) > abs(matrix[pivot, i]):
                pivot = j
        if pivot != i:
            for j in range(size):
                matrix[i, j], matrix[pivot, j] = matrix[pivot, j], matrix[i, j]
            right[i], right[pivot] = right[pivot], right[i]
        for j in range(i + 1, size):
            factor = matrix[j, i] / matrix[i, i]
            for k in range(i, size):
                matrix[j, k] -= factor * matrix[i, k]
            right[j] -= factor * right[i]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            right[i] -= matrix[i, j] * right[j]
        right[i] /= matrix[i, i]
