"""Matrices of rectangular Kirchhoff plates: Bogner–Fox–Schmit elements as tensor products of Hermite beams.

With the beam matrices A0 = ∫uv, A1 = ∫u′v′, A2 = ∫u″v″, A20 = ∫u″v along x and along y,
K = D [A2⊗A0 + A0⊗A2 + ν (A20⊗A20ᵀ + A20ᵀ⊗A20) + 2 (1 − ν) A1⊗A1], M = ρt A0⊗A0 and b = b_x⊗b_y.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from skfem import Basis, BilinearForm, ElementLineHermite, MeshLine

from structures.structure import Vector


@dataclass(frozen=True, eq=False)
class Beam:
    """Hermite beam matrices along one side of a plate; degrees of freedom that the ends hold are left out."""

    a0: sparse.csr_array
    a1: sparse.csr_array
    a2: sparse.csr_array
    a20: sparse.csr_array
    basis: Basis
    kept: Vector

    def at(self, position: float) -> Vector:
        """The values of all kept shape functions at a position, m."""
        values: Vector = np.asarray(self.basis.point_source(np.array([position])))[self.kept]
        return values


def beam(nodes: Vector, start: str, end: str) -> Beam:
    """The beam over ascending nodes (m), its two ends "clamped", "simple", "free" or "mirror" (a plane of symmetry)."""
    basis = Basis(MeshLine(nodes), ElementLineHermite(), intorder=6)
    held: list[int] = []
    for node, kind in ((0, start), (-1, end)):
        deflection, slope = basis.nodal_dofs[:, node]
        held += {"clamped": [deflection, slope], "simple": [deflection], "mirror": [slope], "free": []}[kind]
    kept = np.setdiff1d(np.arange(basis.N), held)
    forms = (_value_value, _slope_slope, _bend_bend, _bend_value)
    a0, a1, a2, a20 = (sparse.csr_array(form.assemble(basis))[kept][:, kept] for form in forms)
    return Beam(a0, a1, a2, a20, basis, kept)


def plate_matrices(
    x: Beam, y: Beam, rigidity: float, poisson_ratio: float, mass_per_area: float
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """M and K of the plate spanned by two beams; rigidity D in N m, mass per area in kg/m²."""
    kron = sparse.kron
    nu = poisson_ratio
    bending = kron(x.a2, y.a0) + kron(x.a0, y.a2) + 2.0 * (1.0 - nu) * kron(x.a1, y.a1)
    coupling = kron(x.a20, y.a20.T) + kron(x.a20.T, y.a20)
    return (
        sparse.csr_array(mass_per_area * kron(x.a0, y.a0)),
        sparse.csr_array(rigidity * (bending + nu * coupling)),
    )


@BilinearForm
def _value_value(u: Any, v: Any, _: Any) -> Any:
    return u * v


@BilinearForm
def _slope_slope(u: Any, v: Any, _: Any) -> Any:
    return u.grad[0] * v.grad[0]


@BilinearForm
def _bend_bend(u: Any, v: Any, _: Any) -> Any:
    return u.hess[0][0] * v.hess[0][0]


@BilinearForm
def _bend_value(u: Any, v: Any, _: Any) -> Any:
    return u.hess[0][0] * v
