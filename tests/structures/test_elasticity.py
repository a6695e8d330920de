"""Matrices of elastic bodies against the weak forms, which scikit-fem integrates pair by pair of shape functions."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pytest
from scipy import sparse
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad, MeshQuad2
from skfem.helpers import ddot, div, dot, sym_grad

import hertzlink as hl
from structures.bodies.elasticity import Owner, body_matrices, first_lame_parameter, part_stiffnesses, shear_modulus

PAIR = [hl.STEEL_440C, hl.PTFE]


@BilinearForm
def inertia(u: Any, v: Any, w: Any) -> Any:
    return w.around * w.density * dot(u, v)


@BilinearForm
def strain(u: Any, v: Any, w: Any) -> Any:
    """λ div u div v + 2μ ε(u) : ε(v), with the strain u_r/r of rings around the axis x₀ = 0 where there are any."""
    rings = [w.ring * field[0] / w.x[0] for field in (u, v)]
    volumes = (div(u) + rings[0]) * (div(v) + rings[1])
    shapes = ddot(sym_grad(u), sym_grad(v)) + rings[0] * rings[1]
    return w.around * (w.lame * volumes + 2.0 * w.shear * shapes)


def weak_forms(
    basis: Basis, materials: Sequence[hl.Material], owner: Owner, ring: bool = False
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Mass and stiffness."""
    density, lame, shear = (
        np.array([of(material) for material in materials])[owner][:, None] * np.ones_like(basis.dx)
        for of in (lambda material: material.density, first_lame_parameter, shear_modulus)
    )
    around = 2.0 * np.pi * np.asarray(basis.global_coordinates())[0] if ring else np.ones_like(basis.dx)
    return (
        inertia.assemble(basis, density=density, around=around),
        strain.assemble(basis, lame=lame, shear=shear, around=around, ring=float(ring)),
    )


def assert_same(found: Iterable[Any], wanted: Iterable[Any]) -> None:
    for one, other in zip(found, wanted, strict=True):
        assert abs(one - other).max() < 1e-12 * abs(other).max()


@pytest.fixture
def quarter() -> Basis:
    """Curved cells in a quarter of a ring of radii 1 and 2 m, away from the axis."""
    flat = MeshQuad2.from_mesh(MeshQuad.init_tensor(np.linspace(1.0, 2.0, 4), np.linspace(0.2, 1.2, 5)))
    radius, angle = flat.doflocs
    mesh = MeshQuad2(np.stack([radius * np.cos(angle), radius * np.sin(angle)]), flat.t)
    return Basis(mesh, ElementVector(ElementQuad2()), intorder=5)


@pytest.fixture
def owner(quarter: Basis) -> Owner:
    return np.arange(quarter.mesh.nelements) % 2


def test_body_of_revolution(quarter: Basis, owner: Owner) -> None:
    assert_same(body_matrices(quarter, PAIR, owner), weak_forms(quarter, PAIR, owner, ring=True))


def test_each_part_is_that_of_its_cells_alone(quarter: Basis, owner: Owner) -> None:
    """Its stiffness has no row for motions of other cells, and all parts make the body."""
    parts = part_stiffnesses(quarter, PAIR, owner)
    assert_same([parts[0] + parts[1]], weak_forms(quarter, PAIR, owner, ring=True)[1:])
    for number, part in enumerate(parts):
        own = np.unique(quarter.element_dofs[:, owner == number])
        assert set(part.nonzero()[0]) <= set(own)
