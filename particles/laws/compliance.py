"""Compliance of the surface of a body of revolution to forces on it: finite elements, condensed to a matrix."""

import numpy as np
from scipy import sparse
from skfem import Basis, ElementQuad2, ElementVector

from particles.laws.axisymmetric_mesh import Block, Body, HalfPlane, Whole
from structures.bodies.elasticity import part_stiffnesses
from structures.linear_algebra.factor import compliance_at
from structures.structure import Vector

INTEGRATION_ORDER = 5
"""Exact for the mass matrix of rectangular quadratic elements with the weight r."""

MIDPLANES = ("roller", "clamped")


def surface_compliance(body: Body, plane: HalfPlane, midplane: str) -> Vector:
    """Return displacements along the axis of the m nodes that may touch, by unit forces there, m × m, m/N; symmetric.

    A node's force is that on its whole ring. The body is factorised once. midplane: see `supported_stiffness`.
    """
    stiffness, pressed = supported_stiffness(body, plane, midplane)
    compliance = compliance_at(stiffness, pressed)
    symmetric: Vector = 0.5 * (compliance + compliance.T)
    return symmetric


def supported_stiffness(body: Body, plane: HalfPlane, midplane: str) -> tuple[sparse.csr_array, Whole]:
    """Return the stiffness of what the supports leave free, n × n, N/m; and where in it the axial motions of
    `plane.surface` are.

    midplane: "roller", free to slide sideways, or "clamped". The far sides of a half-space are held. All nodes at the
    centre of a solid bead share one place, which neither axis nor mid-plane lets move: held, they may share it.
    """
    basis = Basis(plane.mesh, ElementVector(ElementQuad2()), intorder=INTEGRATION_ORDER)
    across, axial = (np.concatenate([basis.nodal_dofs[i], basis.facet_dofs[i], basis.interior_dofs[i]]) for i in (0, 1))
    axis, end, bottom = plane.along == 0.0, plane.along == plane.along.max(), plane.depth == plane.depth.max()
    if isinstance(body, Block):
        end = bottom = end | bottom
    clamped = isinstance(body, Block) or midplane == "clamped"
    solid = isinstance(body, Block) or body.hollow == 0.0
    held = [across[axis], axial[end]]
    held += [across[end]] if clamped else []
    held += [across[bottom], axial[bottom]] if solid else []
    free = np.setdiff1d(np.arange(basis.N), np.concatenate(held))
    owner = np.zeros(plane.mesh.nelements, dtype=np.int64)
    stiffness = part_stiffnesses(basis, [body.material], owner)[0]
    return stiffness[free][:, free], np.searchsorted(free, axial[plane.surface])
