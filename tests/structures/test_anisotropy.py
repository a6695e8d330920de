"""The indentation modulus of anisotropic half-spaces: closed forms, eigenvectors, elliptic contacts, bad input."""

from math import pi, sqrt

import numpy as np
import pytest
from numpy.typing import NDArray

import hertzlink as hl

Numbers = NDArray[np.float64]

CARBON = ((138e9, 9e9, 9e9), (0.40625, 0.3, 0.3), (3.2e9, 6.9e9, 6.9e9))
GLASS = ((45e9, 12e9, 12e9), (0.4, 0.28, 0.28), (12e9 / 2.8, 4.5e9, 4.5e9))
CLOTH = ((60e9, 55e9, 10e9), (0.3, 0.35, 0.05), (3.5e9, 4e9, 5e9))


def hexagonal(c11: float, c33: float, c12: float, c13: float, c44: float) -> Numbers:
    """Isotropic around axis 3."""
    matrix = np.diag([c11, c11, c33, c44, c44, (c11 - c12) / 2.0])
    for i, j, value in ((0, 1, c12), (0, 2, c13), (1, 2, c13)):
        matrix[i, j] = matrix[j, i] = value
    return matrix


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.3, 0.49])
def test_isotropic(poisson_ratio: float) -> None:
    e, shear = 70e9, 70e9 / (2.0 * (1.0 + poisson_ratio))
    matrix = hl.theory.orthotropic_stiffness((e,) * 3, (poisson_ratio,) * 3, (shear,) * 3)
    assert hl.theory.indentation_modulus(matrix) == pytest.approx(e / (1.0 - poisson_ratio**2), rel=1e-10)


@pytest.mark.parametrize("constants", [(163.7, 63.5, 36.4, 53.0, 38.8), (307.1, 358.1, 165.0, 102.7, 75.5)])
def test_isotropic_around_the_normal(constants: tuple[float, ...]) -> None:
    """Elliott's closed form (Proc. Camb. Phil. Soc. 45 (1949) 621), by Delafargue and Ulm, for zinc and cobalt.

    2 √[(C₁₁C₃₃ − C₁₃²)/C₁₁ / (1/C₄₄ + 2/(√(C₁₁C₃₃) + C₁₃))] (Int. J. Solids Struct. 41 (2004) 7351, equation 17).
    """
    c11, c33, _, c13, c44 = constants
    softness = 1.0 / c44 + 2.0 / (sqrt(c11 * c33) + c13)
    expected = 2.0 * sqrt((c11 * c33 - c13**2) / c11 / softness)
    assert hl.theory.indentation_modulus(hexagonal(*constants)) == pytest.approx(expected, rel=1e-9)


def surface_compliance(matrix: Numbers, angles: Numbers) -> Numbers:
    """Ĝ of u₃ = Ĝ p/k under a pressure p cos(k n·x), 1/Pa, for n at angles: by the eigenvectors of Stroh's problem."""
    voigt = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
    constants = matrix[voigt[:, :, None, None], voigt[None, None]]
    found = []
    for angle in angles:
        n, m = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([0.0, 0.0, 1.0])
        q, r, t = (np.einsum("j,ijkl,l->ik", a, constants, b) for a, b in ((n, n), (n, m), (m, m)))
        inverse = np.linalg.inv(t)
        block = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ q, -inverse @ (r + r.T)]])
        roots, vectors = np.linalg.eig(block)
        decays = roots.imag > 0.0
        shapes = vectors[:3, decays]
        tractions = r.T @ shapes + t @ shapes * roots[decays]
        found.append((1j * shapes @ np.linalg.inv(tractions))[2, 2].real)
    return np.array(found)


@pytest.mark.parametrize("solid", [CARBON, GLASS, CLOTH])
def test_in_any_direction(solid: tuple[tuple[float, ...], ...]) -> None:
    matrix = hl.theory.orthotropic_stiffness(*solid)
    angles = (np.arange(60) + 0.5) * pi / 60.0
    expected = 2.0 / surface_compliance(matrix, angles).mean()
    assert hl.theory.indentation_modulus(matrix) == pytest.approx(expected, rel=1e-6)
