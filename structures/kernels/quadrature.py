"""Few points with weights that integrate polynomials as many do: Gauss's quadrature of a sum."""

from math import sqrt

from structures.kernels.kernel_cache import entry, inner
from structures.structure import Vector

LANES = 4
"""Points that are inserted together, each one row behind the last: the processor divides for one while it waits for
another."""

ROUNDING = 2.2e-16


@entry
def tridiagonal(points: Vector, weights: Vector, lanes: Vector, diagonal: Vector, squares: Vector) -> None:
    """Fill the first rows of the tridiagonal matrix of a sum: by Rutishauser's rotations, one point after the other.

    Its eigenvalues, and the squares of the first entries of its eigenvectors, are Gauss's points and weights. diagonal,
    squares: of the entries beside it, the first being the sum of the weights, m numbers each, zeros before. lanes:
    LANES × 5 numbers.

    References
    ----------
    Gragg and Harwood, Numer. Math. 44 (1984) 317 (algorithm RKPW); Gautschi, Orthogonal Polynomials (2004), 2.2.3.
    """
    size = diagonal.size
    for first in range(0, points.size, LANES):
        for lane in range(min(LANES, points.size - first)):
            lanes[lane, 0], lanes[lane, 1], lanes[lane, 2] = weights[first + lane], 1.0, 0.0
            lanes[lane, 3], lanes[lane, 4] = 0.0, points[first + lane]
        for step in range(min(first + LANES, size) + LANES - 1):
            for lane in range(min(LANES, points.size - first)):
                row = step - lane
                if row < 0 or row >= size or row > first + lane:
                    continue
                point = lanes[lane, 4]
                if row == first + lane:
                    diagonal[row] = point
                before, cosine, sine, square = lanes[lane, 0], lanes[lane, 1], lanes[lane, 2], squares[row]
                total, last = square + before, sine
                squares[row] = cosine * total
                cosine, sine = (square / total, before / total) if total > 0.0 else (1.0, 0.0)
                shift = sine * (diagonal[row] - point) - cosine * lanes[lane, 3]
                diagonal[row] -= shift - lanes[lane, 3]
                lanes[lane, 0] = shift * shift / sine if sine > 0.0 else last * square
                lanes[lane, 1], lanes[lane, 2], lanes[lane, 3] = cosine, sine, shift


@entry
def eigenvalues(diagonal: Vector, beside: Vector, first: Vector) -> None:
    """Turn a tridiagonal matrix into its eigenvalues, and fill the first entries of its eigenvectors: by implicit QL.

    beside: the entries beside the diagonal, then a zero; all are overwritten. All have m numbers.

    References
    ----------
    Golub and Welsch, Math. Comp. 23 (1969) 221.
    """
    size = diagonal.size
    first[:] = 0.0
    first[0] = 1.0
    for low in range(size):
        high = _end_of_block(diagonal, beside, low)
        while high > low:
            _sweep(diagonal, beside, first, low, high)
            high = _end_of_block(diagonal, beside, low)


@inner()
def _end_of_block(diagonal: Vector, beside: Vector, low: int) -> int:
    """Return the row from which on no entry couples the rows of a block."""
    high = low
    while high < diagonal.size - 1 and abs(beside[high]) > ROUNDING * (abs(diagonal[high]) + abs(diagonal[high + 1])):
        high += 1
    return high


@inner()
def _sweep(diagonal: Vector, beside: Vector, first: Vector, low: int, high: int) -> None:
    """Rotate a block from its last row to its first one, with Wilkinson's shift."""
    ratio = (diagonal[low + 1] - diagonal[low]) / (2.0 * beside[low])
    root = sqrt(ratio * ratio + 1.0)
    bulge = diagonal[high] - diagonal[low] + beside[low] / (ratio + (root if ratio >= 0.0 else -root))
    sine, cosine, moved = 1.0, 1.0, 0.0
    for i in range(high - 1, low - 1, -1):
        out, along = sine * beside[i], cosine * beside[i]
        root = sqrt(out * out + bulge * bulge)
        beside[i + 1] = root
        if root == 0.0:  # the block falls apart here
            diagonal[i + 1] -= moved
            beside[high] = 0.0
            return
        sine, cosine = out / root, bulge / root
        bulge = diagonal[i + 1] - moved
        turned = (diagonal[i] - bulge) * sine + 2.0 * cosine * along
        moved = sine * turned
        diagonal[i + 1] = bulge + moved
        bulge = cosine * turned - along
        first[i + 1], first[i] = sine * first[i] + cosine * first[i + 1], cosine * first[i] - sine * first[i + 1]
    diagonal[low] -= moved
    beside[low], beside[high] = bulge, 0.0
