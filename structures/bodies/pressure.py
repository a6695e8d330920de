"""A gas under pressure inside a body of revolution: the stress that it causes, and the stiffness that comes with it."""

from math import pi
from typing import Any

import numpy as np
from scipy import sparse
from skfem import BilinearForm

from structures.bodies.elasticity import Cells

ATMOSPHERE = 101_325.0
"""Pa: the standard atmosphere (ISO 2533)."""

AIR = 1.4
"""Ratio of the heat capacities of air, c_p/c_v."""


def stress_stiffness(basis: Any, radii: tuple[float, float], centre: float, pressure: float) -> sparse.csr_array:
    """Return the stiffness of the stress in the wall of a pressurised sphere, n × n: ∫ σ_ij u_k,i v_k,j dV.

    σ is Lamé's exact stress in a thick sphere (Timoshenko, Goodier, Theory of Elasticity, 3rd ed., section 136).

    basis: of the displacement in the half-plane (r, z). radii: inner and outer, m. centre: its z, m. pressure: inside
    less outside, Pa.
    """
    inner, outer = radii
    r, z = np.asarray(basis.global_coordinates())
    distance = np.hypot(r, z - centre)
    level = pressure * inner**3 / (outer**3 - inner**3)
    radial, hoop = level * (1.0 - (outer / distance) ** 3), level * (1.0 + 0.5 * (outer / distance) ** 3)
    across, along = r / distance, (z - centre) / distance
    more = radial - hoop
    shear = more * across * along
    stress = np.array([[hoop + more * across**2, shear], [shear, hoop + more * along**2]])
    return Cells(basis, ring=True).stress_stiffness(stress, hoop)


def following_stiffness(faces: Any, pressure: float) -> sparse.csr_array:
    """Return the stiffness of a constant pressure that stays normal to the surface it acts on, n × n.

    The pressure does the work p V on the volume V inside. With the meridian's arc length s, V = π ∫ r² z′ ds, so that
    the terms of second order in the displacement u are π ∫ (u_r² z′ + 2 r u_r u_z′) ds. The stiffness is −p times their
    second derivative.

    faces: a facet basis of the inner surface. pressure: Pa.
    """
    return sparse.csr_array(_following.assemble(faces, pressure=pressure * np.ones_like(faces.dx)))


def with_gas(stiffness: Any, opening: Any, modulus: float, volume: float) -> sparse.csr_array:
    """Return stiffness of a body that is filled with a gas of one pressure: n + m degrees of freedom, n of the body's.

    The gas adds ½ (modulus/volume) (Σ opening u)² to the energy, a matrix that is full on the inner surface. The m
    massless degrees of freedom are the volumes that the first 1, 2, … m rings open. m equal springs tie each to the
    ring and to the one before, and one more ties the last to the ground. All bear the change of pressure. Half of the
    gas's compliance is in the m springs and half in the last, so that the energy is the same, and all is sparse.

    stiffness: n × n, N/m. opening: m × n, of the volume that each ring opens, m². modulus: bulk modulus, Pa. volume:
    m³.
    """
    rings, size = opening.shape
    spring = 2.0 * modulus / volume
    steps = sparse.diags_array([np.ones(rings), -np.ones(rings - 1)], offsets=[0, -1])
    stretch = sparse.csr_array(sparse.hstack([-opening, steps]))
    last = sparse.csr_array(([spring], ([size + rings - 1], [size + rings - 1])), shape=(size + rings,) * 2)
    body = sparse.block_diag([stiffness, sparse.csr_array((rings, rings))])
    return sparse.csr_array(body + rings * spring * (stretch.T @ stretch) + last)


def ring_openings(faces: Any, rings: Any, order: Any) -> sparse.csr_array:
    """Return the derivatives of the volume inside with respect to the displacements, m²: a row for each ring of the
    surface.

    faces: a facet basis of the displacement on the inner surface. rings: one of a constant in each cell. order: the
    numbers of the cells, along the meridian.
    """
    return sparse.csr_array(_opening.assemble(faces, rings))[order]


@BilinearForm
def _following(u: Any, v: Any, w: Any) -> Any:
    # The tangent that leads from the struck pole to the other one; n points into the cavity.
    along_r, along_z = w.n[1], -w.n[0]
    du, dv = (shape.grad[1][0] * along_r + shape.grad[1][1] * along_z for shape in (u, v))
    return -2.0 * pi * w.pressure * (u[0] * v[0] * along_z + w.x[0] * (u[0] * dv + v[0] * du))


@BilinearForm
def _opening(u: Any, v: Any, w: Any) -> Any:
    return -2.0 * pi * w.x[0] * (u[0] * w.n[0] + u[1] * w.n[1]) * v
