"""Frequencies of structures, and an independent Ritz method for square Mindlin plates, for tests of plates."""

import numpy as np
from numpy.polynomial.legendre import legder, leggauss, legval
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh

import hertzlink as hl

Numbers = NDArray[np.float64]


def parameters(structure: hl.Structure, count: int, unit: float) -> Numbers:
    """√(ω²/unit) of the lowest modes, unit in 1/s², by a shifted Lanczos solver."""
    scale = sparse.diags_array(1.0 / np.sqrt(structure.stiffness.diagonal() + unit * structure.mass.diagonal()))
    stiffness = sparse.csc_array(scale @ structure.stiffness @ scale)
    mass = sparse.csc_array(scale @ structure.mass @ scale)
    start = np.random.default_rng(0).normal(size=structure.size)
    square = eigsh(stiffness, count, M=mass, sigma=-unit, return_eigenvectors=False, v0=start)
    return np.sqrt(np.maximum(np.sort(square), 0.0) / unit)


def ritz(edges: tuple[str, str, str, str], thickness: float, poisson_ratio: float, count: int) -> Numbers:
    """ω a² √(ρt/D) of a square Mindlin plate (κ = 5/6) of side a = 1, edges left, right, bottom, top; "across" is
    clamped but for the slope along the edge.

    Legendre polynomials up to degree 11 for w and both slopes, times x, 1 − x, y, 1 − y where an edge holds them.
    """
    left, right, bottom, top = edges
    # What holds w, the slope across and the slope along an edge.
    holds = {"clamped": "wan", "simple": "wn", "soft simple": "w", "free": "", "across": "wa"}

    def along(start: str, end: str, field: str) -> tuple[Numbers, Numbers]:
        x, _ = POINTS
        factor = np.polynomial.Polynomial([1.0])
        if field in holds[start]:
            factor *= np.polynomial.Polynomial([0.0, 1.0])
        if field in holds[end]:
            factor *= np.polynomial.Polynomial([1.0, -1.0])
        cubes = np.eye(12)
        shapes = np.array([legval(2.0 * x - 1.0, one) for one in cubes])
        slopes = np.array([2.0 * legval(2.0 * x - 1.0, legder(one)) for one in cubes])
        return factor(x) * shapes, factor(x) * slopes + factor.deriv()(x) * shapes

    # Across left and right is x: s_x is "a" there and "n" at bottom and top.
    spaces = [(along(left, right, fx), along(bottom, top, fy)) for fx, fy in (("w", "w"), ("a", "n"), ("n", "a"))]
    nu, rigidity = poisson_ratio, 1.0
    shear = 5.0 / 6.0 * 6.0 * (1.0 - nu) * rigidity / thickness**2

    def overlap(i: int, dx: int, dy: int, j: int, ex: int, ey: int) -> Numbers:
        (fx, fy), (gx, gy), weight = spaces[i], spaces[j], POINTS[1]
        return np.kron((fx[dx] * weight) @ gx[ex].T, (fy[dy] * weight) @ gy[ey].T)

    zero = np.zeros_like(overlap(0, 0, 0, 0, 0, 0))
    mass = [[zero] * 3 for _ in range(3)]
    stiff = [[zero] * 3 for _ in range(3)]
    for i, inertia in enumerate((1.0, thickness**2 / 12.0, thickness**2 / 12.0)):
        mass[i][i] = inertia * overlap(i, 0, 0, i, 0, 0)
    stiff[0][0] = shear * (overlap(0, 1, 0, 0, 1, 0) + overlap(0, 0, 1, 0, 0, 1))
    stiff[0][1], stiff[0][2] = -shear * overlap(0, 1, 0, 1, 0, 0), -shear * overlap(0, 0, 1, 2, 0, 0)
    twist = (1.0 - nu) / 2.0
    stiff[1][1] = overlap(1, 1, 0, 1, 1, 0) + twist * overlap(1, 0, 1, 1, 0, 1) + shear * overlap(1, 0, 0, 1, 0, 0)
    stiff[2][2] = overlap(2, 0, 1, 2, 0, 1) + twist * overlap(2, 1, 0, 2, 1, 0) + shear * overlap(2, 0, 0, 2, 0, 0)
    stiff[1][2] = nu * overlap(1, 1, 0, 2, 0, 1) + twist * overlap(1, 0, 1, 2, 1, 0)
    for i, j in ((1, 0), (2, 0), (2, 1)):
        stiff[i][j] = stiff[j][i].T
    square = eigh(np.block(stiff), np.block(mass), eigvals_only=True, subset_by_index=[0, count - 1])
    return np.sqrt(np.maximum(square, 0.0))


POINTS = (0.5 * (leggauss(20)[0] + 1.0), 0.5 * leggauss(20)[1])
