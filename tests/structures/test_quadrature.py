"""Gauss's quadrature of a sum."""

import numpy as np
import pytest
from scipy.linalg import eigh_tridiagonal

from structures.kernels.quadrature import LANES, tridiagonal


def rule(points, weights, size):
    """Gauss's points and weights, in ascending order."""
    diagonal, squares = np.zeros((2, size))
    tridiagonal(points, weights, np.empty((LANES, 5)), diagonal, squares)
    nodes, vectors = eigh_tridiagonal(diagonal, np.sqrt(squares[1:]))
    return nodes, squares[0] * vectors[0] ** 2


@pytest.mark.parametrize("size", [1, 2, 7, 30])
def test_points_and_weights_are_those_of_chebyshev(size):
    # Chebyshev's polynomials are orthogonal on the zeros of a later one, too, so the rule is that of the integral.
    zeros = np.cos(np.pi * (np.arange(30) + 0.5) / 30.0)
    points, weights = rule(np.random.default_rng(0).permutation(zeros), np.full(30, 2.0), size)
    assert points == pytest.approx(np.sort(np.cos(np.pi * (np.arange(size) + 0.5) / size)), abs=1e-13)
    assert weights == pytest.approx(np.full(size, 60.0 / size), rel=1e-12)


@pytest.mark.parametrize("seed", range(100))
def test_points_that_coincide_or_weigh_nothing_count_as_they_should(seed):
    """Whole points and powers of two meet exactly, so the rotations end early."""
    random = np.random.default_rng(seed)
    points, weights = random.integers(0, 4, 8).astype(float), 2.0 ** random.integers(-1, 2, 8)
    weights[random.random(8) < 0.2] = 0.0
    apart = np.unique(points[weights > 0.0])
    nodes, sums = rule(points, weights, apart.size)
    assert nodes == pytest.approx(apart, abs=1e-10)
    assert sums == pytest.approx([weights[points == point].sum() for point in apart], rel=1e-9)
