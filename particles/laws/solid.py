"""Contact laws by three-dimensional finite elements: parallel cylinders of finite length, and spheres to compare with.

In addition, what a bead's mid-plane takes from the half-space's approach. For a law, each body
is an eighth of a bead (`solid_mesh`), condensed to the nodes that may touch; both are pressed together without friction
(`active_set`). Linear elasticity, so strains must stay small.
"""

from functools import lru_cache
from math import log, nan, pi, sqrt
from typing import Any

import numpy as np
from skfem import ElementTetP2, ElementVector, FacetBasis, LinearForm

from particles.bead import Bead, Cylinder, Sphere
from particles.laws.active_set import contact_forces, forces_of_steps
from particles.laws.computed import ComputedContact, ComputedLaw
from particles.laws.formulas import SMALL_CONTACT, contact_law
from particles.laws.solid_mesh import (
    contact_eighth,
    patch_eighth,
    solid_body,
    supported,
)
from structures.bodies.solid import PATCH_ORDER, patch_compliance
from structures.checks import positive, short
from structures.linear_algebra.factor import compliance_at, factorise
from structures.structure import Vector
from structures.units import readable

ELEMENTS = {Cylinder: 20.0, Sphere: 6.0}
"""Half-width, or radius, of the widest contact over the size of the cells at the pole; those at its edge are larger."""

FEWEST = 2.0
"""The same for the narrowest contact that is computed."""

ORDER = 2.0
"""Of the convergence of F(δ), by which the error is estimated; that of the thesis's cylinders is a third of it."""

STEPS = 60
"""Approaches at which the force is computed, in even ratios."""

LARGE_ERROR = 0.025
"""Relative error of the force, above which a law carries a caution."""

MARGIN, WIDENING = 1.15, 1.4
"""How far the mesh lets bodies touch, over the contact that is expected; it widens where they touch beyond."""

LEAST_PART = 1e-6
"""The least approach over the relative radius: narrower contacts of spheres need too many cells."""

MOST_WORK = 10_000_000
"""Nodes that may touch times those of the mesh, which is solved for one after the other: a minute."""

TRIES, STEP_OUT, SURPLUS = 8, 1.2, 1.02
"""Approaches that are tried for a force, the factor between them, and how much more force the last one must give."""

WIDEST_CONTACT = 0.5
"""Half-width of a contact over the radius of a bead, beyond which an eighth pressed along the chain is no model."""

OUTERMOST = 0.9
"""Of the largest gap of the nodes that may touch: beyond it lie the last ones."""

QUARTERS = 4.0
"""Of the contact: an eighth of a bead bears one of them."""

PATCH, PATCH_CELLS = 0.2, 0.33
"""Radius of the circle that is pressed for the mid-plane's correction over the bead's; its cells over its own."""

TYPICAL = 0.03
"""Radius of a contact over that of the bead: of the thesis's spheres at some 50 N."""


def contact_law_solid(
    first: Bead,
    second: Bead | None = None,
    max_force: float | None = None,
    max_approach: float | None = None,
    spacing: float | None = None,
) -> ComputedLaw:
    """Return the law of two equal cylinders side by side, or two equal spheres, by three-dimensional finite elements.

    Cylinders touch along a line as long as they are, with free ends. Quadratic tetrahedra on the true arc, the gap that
    of the undeformed arcs, no friction, small strains; no node overlaps. Below a contact of two cells the law continues
    as that of `contact_law` in series with a spring. Ranges in which strains are not small, and meshes too coarse for
    2.5 %, get a caution.

    Khatri's thesis, section 5.3.2.
    """
    bead = solid_body("first", first)
    if second is not None and solid_body("second", second) != first:
        raise ValueError(f"second = {short(second)}: must be equal to the first, and lie side by side with it")
    size = None if spacing is None else positive("spacing", spacing, "m")
    return _Pair(bead, size).law(max_force, max_approach)


class _Pair(ComputedContact):
    """Two equal beads that touch, and how wide their contact is by theory."""

    method = "finite elements, 3-D"
    least = LEAST_PART

    def __init__(self, bead: Cylinder | Sphere, spacing: float | None) -> None:
        self.bead, self.spacing, self.radius = bead, spacing, bead.radius / 2.0  # the relative radius of equal bodies
        self.bodies = bead, bead
        self.theory = self.below = contact_law(bead, bead)

    def width(self, approach: float) -> float:
        """Return the half-width, or radius, of the contact at an approach, m: Johnson's equations 4.43 and 4.22."""
        if isinstance(self.bead, Sphere):
            return sqrt(0.5 * approach * self.bead.radius)
        force = float(self.theory.force(np.array(approach))) / self.bead.length
        return sqrt(4.0 * force * self.bead.radius / (pi * self.bead.material.contact_modulus))

    def approach(self, width: float) -> float:
        """Return the approach, m, at which the contact has a half-width, or radius, m."""
        if isinstance(self.bead, Sphere):
            return 2.0 * width**2 / self.bead.radius
        force = width**2 * pi * self.bead.material.contact_modulus / (4.0 * self.bead.radius) * self.bead.length
        return float(self.theory.approach(np.array(force)))

    def up_to(self, approach: float) -> ComputedLaw:
        """Return the law up to an approach, m."""
        good = self.width(approach) / ELEMENTS[type(self.bead)]
        size = good if self.spacing is None else self.spacing
        if FEWEST * size >= self.width(approach):
            raise ValueError(
                f"spacing = {size:.3g} m: leaves the widest contact, {self.width(approach):.3g} m to its edge, fewer "
                f"than {FEWEST:g} cells; {good:.3g} m is a good one"
            )
        approaches = np.geomspace(self.approach(FEWEST * size), approach, STEPS)
        forces, coarse = (self.forces(approaches, size, coarser) for coarser in (1.0, 2.0))
        error = float(np.abs(coarse / forces - 1.0).max()) / (2.0**ORDER - 1.0)
        doubts = []
        if self.width(approach) > SMALL_CONTACT * 0.5 * self.bead.radius:
            doubts.append(
                f"a contact of {readable(self.width(approach), 'm')} to its edge is too wide for small strains"
            )
        if error > LARGE_ERROR:
            doubts.append(f"cells of {readable(size, 'm')} leave the force off by some {100.0 * error:.2g} %")
        return self.made((approaches, forces), approach, error, nan, doubts)

    def up_to_force(self, force: float) -> ComputedLaw:
        """Return the law up to a force, N, which may need a larger approach than theory expects."""
        approach = float(self.theory.approach(np.array(force)))
        for _ in range(TRIES):
            approach *= STEP_OUT
            size = self.width(approach) / ELEMENTS[type(self.bead)]
            reached = self.forces(np.array([approach]), size, coarser=2.0)[0]
            if reached > SURPLUS * force:
                return self.up_to(approach)
        raise ValueError(f"max_force = {force!r}: not reached at an approach of {approach:.3g} m; ask for less")

    def forces(self, approaches: Vector, size: float, coarser: float) -> Vector:
        """Return the force, N, at each of ascending approaches, m; size of the cells at the pole, m, times coarser."""
        last = float(approaches[-1])
        reach = MARGIN * self.width(last)
        for _ in range(TRIES):
            if reach > WIDEST_CONTACT * self.bead.radius:
                break
            compliance, gap = _condensed(self.bead, reach, size, coarser)
            touching = contact_forces(compliance, gap, last, gap < 0.5 * last)[1]
            if not touching[gap > OUTERMOST * gap[-1]].any():
                return QUARTERS * forces_of_steps(compliance, gap, approaches)
            reach *= WIDENING
        raise ValueError(
            f"max_force or max_approach: the contact is wider than {reach:.3g} m at {last:.3g} m; ask for less"
        )


def _condensed(bead: Cylinder | Sphere, reach: float, size: float, coarser: float) -> tuple[Vector, Vector]:
    """Return two beads' compliance to forces on a quarter of their contact, m × m, m/N; and the gap, m, ascending."""
    part = contact_eighth(bead, reach, size, coarser)
    nodes = part.touching(reach)
    nodes = nodes[np.argsort(part.drop(nodes), kind="stable")]
    if nodes.size * part.box.shape[1] > MOST_WORK:
        raise ValueError(f"spacing = {size:.3g} m: {nodes.size} nodes may touch, which takes too long; must be larger")
    body = supported(part)
    compliance = compliance_at(body.stiffness, body.motions[2, nodes])
    return compliance + compliance.T, 2.0 * part.drop(nodes)


def midplane_correction(bead: Cylinder | Sphere) -> float:
    """Return the difference of the compliances of a half-space and of a bead between its pole and its mid-plane.

    Two such bodies under a force F approach by the half-space theory's δ less 2cF, with this c. The bead is pressed
    from both sides on a circle, and its mean displacement is subtracted from that of the half-space.
    On a curved surface c decreases with the logarithm of the radius of that circle, so it is given for contacts of
    3 % of the bead's radius, to some 5 %, which is some 1e-3 of the force. It differs by as much as 20 % for contacts
    a third or three times as wide.

    Johnson, Contact Mechanics (1985), equations 3.20 and 3.75.
    """
    return _midplane_correction(solid_body("bead", bead))


@lru_cache(maxsize=256)
def _midplane_correction(bead: Any) -> float:
    """Return the correction of a solid body, which has a hash."""
    if isinstance(bead, Cylinder) and bead.length < bead.radius:
        raise ValueError(f"length = {bead.length!r}: must be at least the radius, {bead.radius!r} m")
    wide = PATCH * bead.radius
    correction = patch_compliance(bead.material, wide) - _patch_displacement(bead, wide, PATCH_CELLS)
    return correction - _by_curvature(bead) * log(PATCH / TYPICAL)


def _by_curvature(bead: Cylinder | Sphere) -> float:
    """Return what c gains where the pressed circle is e times as wide, m/N: (1 − 2ν)² (1 + ν) H/(2πE), H the mean
    curvature.

    Boussinesq's half-space under a point force F pulls its surface along itself, by (1 − 2ν)F/(2πr²). A curved surface
    is free of what that pull has across it, H r times as large, which sinks the pole by Cerruti's (1 − 2ν)/(2μ) ∫ dr of
    it (Johnson, equations 3.20 and 3.75).
    """
    ratio, modulus = bead.material.poisson_ratio, bead.material.youngs_modulus
    mean = (0.5 if isinstance(bead, Cylinder) else 1.0) / bead.radius
    return (1.0 - 2.0 * ratio) ** 2 * (1.0 + ratio) * mean / (2.0 * pi * modulus)


def _patch_displacement(bead: Cylinder | Sphere, radius: float, cells: float) -> float:
    """Return mean displacement, m/N, towards the mid-plane of a circle about the pole; pressure and weights 1 − r²/a².

    cells: size of those at the pole over the radius a, m.
    """
    part = patch_eighth(bead, radius, cells)
    body, element = supported(part), ElementVector(ElementTetP2())
    facets = part.mesh.boundary_facets()
    corners = part.box[:, part.mesh.facets[:, facets]]
    pressed = (corners[2] == 0.0).all(axis=0) & (corners[:2].min(axis=1).max(axis=0) < 1.5 * radius)
    faces = FacetBasis(part.mesh, element, facets=facets[pressed], intorder=PATCH_ORDER)
    pushed = _pressure.assemble(faces, radius=radius)[np.concatenate([faces.nodal_dofs[2], faces.edge_dofs[2]])]
    force, axial = np.zeros(body.stiffness.shape[0]), body.motions[2]
    force[axial[axial >= 0]] = pushed[axial >= 0] / pushed.sum()
    return float(force @ factorise(body.stiffness)(force)) / QUARTERS


@LinearForm
def _pressure(v: Any, w: Any) -> Any:
    """Return the pressure of a circle on the part of the surface that lies across the chain."""
    return v[2] * w.n[2] * np.maximum(1.0 - (w.x[0] ** 2 + w.x[1] ** 2) / w.radius**2, 0.0)
