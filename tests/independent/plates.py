"""Independent sources for the tests of plates: a Ritz method in Legendre polynomials, and Levy's solution."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh
from scipy.special import binom

import hertzlink as hl

Numbers = NDArray[np.float64]

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(40)

HELD = {"clamped": 2, "simple": 1, "free": 0}


def frequencies(plate: hl.Plate, count: int) -> Numbers:
    """Lowest angular frequencies, rad/s, by a shifted Lanczos solver on the plate's matrices."""
    structure = plate.at(0.4871 * plate.length, 0.4632 * plate.width)
    unit = plate.rigidity / (plate.mass_per_area * max(plate.length, plate.width) ** 4)
    scale = sparse.diags_array(1.0 / np.sqrt(structure.stiffness.diagonal() + unit * structure.mass.diagonal()))
    stiffness = sparse.csc_array(scale @ structure.stiffness @ scale)
    mass = sparse.csc_array(scale @ structure.mass @ scale)
    square = eigsh(stiffness, count, M=mass, sigma=-unit, return_eigenvectors=False)
    return np.sqrt(np.maximum(np.sort(square), 0.0))


def ritz(bending: Numbers, mass: float, sides: tuple[float, float], edges: tuple[str, ...], terms: int = 16) -> Numbers:
    """All angular frequencies of a plate in a basis of polynomials, edges in the order left, right, bottom, top."""
    shapes = [_shapes(sides[0], edges[0], edges[1], terms), _shapes(sides[1], edges[2], edges[3], terms)]

    def product(v: tuple[int, int], u: tuple[int, int]) -> Numbers:
        """∫∫ of the (i, j)-th derivative of v times that of u."""
        parts = [
            shapes[axis][v[axis]] @ np.diag(WEIGHTS * sides[axis] / 2.0) @ shapes[axis][u[axis]].T for axis in (0, 1)
        ]
        return np.kron(*parts)

    curvatures = [((2, 0), 1.0), ((0, 2), 1.0), ((1, 1), 2.0)]
    stiffness = sum(
        bending[i, j] * one * other * product(v, u)
        for i, (v, one) in enumerate(curvatures)
        for j, (u, other) in enumerate(curvatures)
    )
    square = linalg.eigh(stiffness, mass * product((0, 0), (0, 0)), eigvals_only=True)
    return np.sqrt(np.maximum(square, 0.0))


def _shapes(side: float, start: str, end: str, terms: int) -> list[Numbers]:
    """Polynomials that meet the supports, at Gauss points; and their first two derivatives."""
    hold = Polynomial([1.0, 1.0]) ** HELD[start] * Polynomial([1.0, -1.0]) ** HELD[end]
    many = [hold * Legendre.basis(n).convert(kind=Polynomial) for n in range(terms)]
    scale = 2.0 / side
    return [np.array([(p.deriv(d) if d else p)(POINTS) * scale**d for p in many]) for d in range(3)]


def levy(ratio: float, edge: str, half_waves: int, highest: float, poisson_ratio: float = 0.3) -> list[float]:
    """ω a² √(ρt/D) below `highest` of the modes sin(mπx/a) Y(y): x = 0, a simple, the edges y = ±a/(2 ratio) equal.

    Y = A cosh αy + B cos βy or A sinh αy + B sin βy, α² = Ω + k², β² = Ω − k² (Leissa, J. Sound Vib. 31 (1973) 257).
    """
    k, half = half_waves * np.pi, 0.5 / ratio
    found = []
    for even in (True, False):
        condition = _levy_condition(k, half, edge, even, poisson_ratio)
        grid = np.linspace(1e-3, highest, 4000) + 1e-7
        values = np.array([condition(one) for one in grid])
        for i in np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:])):
            found.append(brentq(condition, grid[i], grid[i + 1], xtol=1e-12))
    return sorted(found)


def _levy_condition(k: float, half: float, edge: str, even: bool, nu: float) -> Callable[[float], float]:
    def condition(parameter: float) -> float:
        rows = []
        for square in (k**2 + parameter, k**2 - parameter):
            # cosh and cos, or sinh/α and sin/β, are one function of the square: real whatever its sign.
            root = np.sqrt(complex(square))
            cosh, sinh = np.cosh(root * half).real, (np.sinh(root * half) / root).real
            derivatives = [cosh, square * sinh, square * cosh, square**2 * sinh]
            if not even:
                derivatives = [sinh, cosh, square * sinh, square * cosh]
            value, slope, bend, third = derivatives
            if edge == "clamped":
                rows.append((value, slope))
            elif edge == "simple":
                rows.append((value, bend))
            else:
                rows.append((bend - nu * k**2 * value, third - (2.0 - nu) * k**2 * slope))
        (a, b), (c, d) = rows
        # Scaled, as cosh α grows without end; the two squares meet where Ω = 0 only.
        return float((a * d - b * c) / np.cosh(np.sqrt(k**2 + parameter) * half) / (1.0 + parameter**2))

    return condition


# A plate that fills the half-plane x ≥ 0, struck at x = 1, by Fourier transform along its edge and Laplace transform in
# time; in units of D, of the mass per area and of the distance from the edge.

EDGE_CONDITIONS: dict[str, Callable[[Any, Any, float], list[Any]]] = {
    "clamped": lambda rate, k, nu: [1.0 + 0.0 * rate, rate],
    "simple": lambda rate, k, nu: [1.0 + 0.0 * rate, rate**2 - nu * k**2],
    "free": lambda rate, k, nu: [rate**2 - nu * k**2, rate**3 - (2.0 - nu) * k**2 * rate],
}
"""What must vanish at x = 0 for e^{rate x + iky}."""


def reflected_transform(edge: str, poisson_ratio: float, s: complex) -> complex:
    """Laplace transform at s of g(t): the displacement after a unit impulse is (1 + g(t))/8."""
    ends = np.append(0.0, np.geomspace(1e-7, 1.0, 40)) * (40.0 + 3.0 * abs(s) ** 0.5)
    half, middle = np.diff(ends)[:, None] / 2.0, (ends[1:] + ends[:-1])[:, None] / 2.0
    k, width = (middle + half * POINTS).ravel(), (half * WEIGHTS).ravel()
    rates = [np.sqrt(k**2 + sign * s) for sign in (1j, -1j)]
    free = [sign / (4j * s * rate) * np.exp(-rate) for sign, rate in zip((-1.0, 1.0), rates, strict=True)]
    # The free field grows towards the contact, e^{rate x}; what the edge sends back decays, e^{−rate x}.
    conditions = EDGE_CONDITIONS[edge]
    one, two = (conditions(-rate, k, poisson_ratio) for rate in rates)
    there = np.array([conditions(rate, k, poisson_ratio) for rate in rates])
    right = -(there[0] * free[0] + there[1] * free[1])
    determinant = one[0] * two[1] - one[1] * two[0]
    back = (right[0] * two[1] - right[1] * two[0]) / determinant, (one[0] * right[1] - one[1] * right[0]) / determinant
    reflected = back[0] * np.exp(-rates[0]) + back[1] * np.exp(-rates[1])
    return complex(8.0 / np.pi * (width @ reflected))


def reflected_response(edge: str, poisson_ratio: float, time: float) -> float:
    """g(t), by Euler summation of the inversion integral (Abate and Whitt, ORSA J. Comput. 7 (1995) 36)."""
    terms, averaged, accuracy = 30, 12, 18.4
    values = [
        reflected_transform(edge, poisson_ratio, (accuracy + 2j * np.pi * n) / (2.0 * time)).real
        for n in range(terms + averaged + 1)
    ]
    signed = np.array(values) * (-1.0) ** np.arange(len(values))
    signed[0] /= 2.0
    sums = np.cumsum(signed)[terms:]
    return float(np.exp(accuracy / 2.0) / time * (binom(averaged, np.arange(averaged + 1.0)) / 2.0**averaged @ sums))
