"""Gaussian quadrature of a sum: a few points with weights replace many."""

from structures.kernels.compiling import entry
from structures.structure import Vector

# Number of points that are inserted together, each one row behind the last, so that the divisions of the processor
# overlap
LANES = 4


@entry
def tridiagonal(points: Vector, weights: Vector, lanes: Vector, diagonal: Vector, squares: Vector) -> None:
    """Fill the first rows of the tridiagonal matrix of a sum, by Rutishauser's rotations for one point after another.

    Its eigenvalues are Gauss's points, and the squares of the first entries of its eigenvectors their weights.
    diagonal: m numbers. squares: m squares of the entries beside the diagonal; the first is the sum of the weights.
    Both are zero at the start. lanes: LANES × 5 numbers.

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
