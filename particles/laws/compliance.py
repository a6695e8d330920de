"""Compliance of the surface of a body of revolution to forces on it: finite elements, condensed to a matrix."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import sparse
from skfem import Basis, ElementQuad2, ElementVector

from particles.laws.active_set import edge_approach, forces_of_steps
from particles.laws.axisymmetric_mesh import Block, Body, HalfPlane, Spheroid, Whole, half_plane
from structures.bodies.elasticity import part_stiffnesses
from structures.linear_algebra.factor import compliance_at
from structures.structure import Vector

INTEGRATION_ORDER = 5
"""Exact for the mass matrix of rectangular quadratic elements with the weight r."""

MIDPLANES = ("roller", "clamped")

WIDEST_CONTACT = 0.5
"""Radius of a contact over that of a body, beyond which half a bead pressed along its axis is no model."""


def condensed(
    bodies: Sequence[Body], reach: float, size: float, coarser: float, midplane: str = "roller"
) -> tuple[Vector, Vector]:
    """Return the compliance of two bodies together, m × m, m/N, and the gap between their surfaces, m numbers, m.

    reach, m: how far they may touch; size: of the cells there, m; coarser: a factor on all cells.
    """
    compliances, gap = dict[Body, Vector](), np.zeros(1)
    for name, body in zip(("first", "second"), bodies, strict=True):
        if isinstance(body, Spheroid) and reach > WIDEST_CONTACT * body.radius:
            raise ValueError(
                f"{name}: radius = {body.radius:.3g} m is too small for a contact of {reach:.3g} m; ask for less"
            )
        plane = half_plane(body, reach, size, coarser)
        gap = gap + body.drop(plane.along[plane.surface])
        if body not in compliances:
            compliances[body] = surface_compliance(body, plane, midplane)
    return compliances[bodies[0]] + compliances[bodies[1]], gap


def forces_at_corners(compliance: Vector, gap: Vector, fewest: int, past: float = np.inf) -> tuple[Vector, Vector]:
    """Return the approaches, m, at which the contact's edge meets a corner of the mesh, and the forces there, N.

    From `fewest` cells in the contact on, up to the first one past an approach, m.
    """
    edges = np.array([edge_approach(compliance, gap, last) for last in range(2 * fewest, gap.size, 2)])
    rising = edges[edges >= np.maximum.accumulate(edges)]
    approaches = rising[: max(int(np.searchsorted(rising, past)) + 1, 2)]
    return approaches, forces_of_steps(compliance, gap, approaches)


def surface_compliance(body: Body, plane: HalfPlane, midplane: str) -> Vector:
    """Return displacements along the axis of the m nodes that may touch, by unit forces there, m × m, m/N; symmetric.

    A node's force is that on its whole ring. The body is factorised once.
    midplane: see `supported_stiffness`.
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
    basis, across, axial = motions(plane.mesh)
    axis, end, bottom = plane.along == 0.0, plane.along == plane.along.max(), plane.depth == plane.depth.max()
    if isinstance(body, Block):
        end = bottom = end | bottom
    clamped = isinstance(body, Block) or midplane == "clamped"
    solid = isinstance(body, Block) or body.hollow == 0.0
    held = [across[axis], axial[end]]
    held += [across[end]] if clamped else []
    held += [across[bottom], axial[bottom]] if solid else []
    free = np.setdiff1d(np.arange(basis.N), np.concatenate(held))
    stiffness = part_stiffnesses(basis, [body.material], np.zeros(basis.mesh.nelements, dtype=np.int64))[0]
    return stiffness[free][:, free], np.searchsorted(free, axial[plane.surface])


def motions(mesh: Any) -> tuple[Any, Whole, Whole]:
    """Return the shape functions of motions on quadratic cells, and the numbers of those across and along the axis."""
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=INTEGRATION_ORDER)
    across, along = (np.concatenate([basis.nodal_dofs[i], basis.facet_dofs[i], basis.interior_dofs[i]]) for i in (0, 1))
    return basis, across, along
