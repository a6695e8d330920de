"""The field of rectangular plates that are products of beams."""

import numpy as np
import pytest
from scipy import sparse

import hertzlink as hl
from plates.elements.field import product_sampler


def powers(x: np.ndarray) -> list[sparse.csr_array]:
    """What reads f, f′ and f″ from the coefficients of 1, x, x², x³."""
    one, none = np.ones_like(x), np.zeros_like(x)
    rows = ([one, x, x**2, x**3], [none, one, 2 * x, 3 * x**2], [none, none, 2 * one, 6 * x])
    return [sparse.csr_array(np.stack(row, axis=1)) for row in rows]


def test_product_of_beams() -> None:
    """w = x² y: curvatures 2y, 0 and 2 · 2x; moments by the isotropic wall; stress 6 M/t² at the struck face."""
    x, y, wall = np.linspace(0.0, 0.4, 5), np.linspace(0.0, 0.2, 3), hl.homogeneous_section(2e-3, hl.PTFE)
    sampler = product_sampler(x, y, powers(x), powers(y), wall, sparse.csr_array((16, 16)))
    u = np.kron([0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0])
    place, cells = sampler.grid.points, sampler.grid.cells
    assert sampler.displacement(u) == pytest.approx(
        np.stack([0 * place[:, 0]] * 2 + [-(place[:, 0] ** 2) * place[:, 1]], 1)
    )
    nu, rigidity = hl.PTFE.poisson_ratio, wall.bending[0, 0]
    moments = rigidity * np.stack([2 * place[:, 1], nu * 2 * place[:, 1], (1 - nu) / 2 * 4 * place[:, 0]], axis=1)
    assert sampler.stress(u)[:, [0, 1, 3]] == pytest.approx(6.0 / 2e-3**2 * moments)
    assert cells.shape == (2, 9)
    at = place[cells][:, :, :2]
    assert np.allclose(at[:, 8], at[:, :4].mean(axis=1))
    assert np.allclose(at[:, 4:8], 0.5 * (at[:, :4] + np.roll(at[:, :4], -1, axis=1)))
