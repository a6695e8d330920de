"""Contact laws of parallel cylinders by finite elements in the plane of their section: plane strain and plane stress.

The two states bound a cylinder of finite length, whose middle is held by its neighbours as in plane strain while its
ends are free. Each section is half a disc above its mid-plane, condensed to its surface; both are pressed together
without friction (`active_set`). Linear elasticity, so strains must stay small.
"""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
from skfem import Basis, ElementQuad2, ElementVector

from particles.bead import Cylinder
from particles.laws.active_set import edge_approach, forces_of_steps
from particles.laws.axisymmetric_mesh import HalfPlane, Spheroid, half_plane
from particles.laws.computed import LEAST_ORDER, ComputedContact, ComputedLaw, Points, error_and_order
from particles.laws.formulas import SMALL_CONTACT, contact_law
from structures.bodies.elasticity import first_lame_parameter, plane_stiffness, shear_modulus
from structures.checks import instance, one_of, positive
from structures.linear_algebra.factor import compliance_at
from structures.material import Material
from structures.structure import Vector
from structures.surface import relative_curvatures
from structures.units import readable

STATES = ("strain", "stress")

ELEMENTS = 36
"""Over the half-width of the widest contact."""

FEWEST = 3
"""Elements over the half-width of the narrowest contact that is computed: the force is right to 2e-4 there."""

COARSEST = 8
"""Elements over the half-width of the widest contact, so that a mesh of cells four times as large shows the error."""

WIDEST_CONTACT = 0.5
"""Half-width of a contact over a cylinder's radius, beyond which half a disc pressed along its axis is no model."""

MARGIN = 1.15
"""How far the mesh lets cylinders touch, over the half-width that is expected."""

INTEGRATION_ORDER = 5
"""Exact for products of two quadratic shape functions on rectangles."""


def contact_law_plane(
    first: Cylinder,
    second: Cylinder | None = None,
    state: str = "strain",
    max_force: float | None = None,
    max_approach: float | None = None,
    spacing: float | None = None,
) -> ComputedLaw:
    """Return the law of two parallel cylinders by plane finite elements.

    Quadratic elements on the true arc, the gap that of the undeformed arcs, no friction, small strains; primal-dual
    active set. Load steps are the approaches at which the contact's edge meets a corner of the mesh.
    In the limit of narrow contacts this is Johnson's law of `contact_law`, with E in place of E/(1 − ν²) for "stress";
    below the first load step it continues as that. Contacts in which strains are not small get a caution.

    Johnson, Contact Mechanics (1985), section 5.6; Khatri's thesis, section 5.3.2.
    """
    instance("first", first, Cylinder, "a Cylinder")
    second = first if second is None else instance("second", second, Cylinder, "a Cylinder")
    one_of("state", state, STATES)
    size = None if spacing is None else positive("spacing", spacing, "m")
    return _Line(first, second, state, size).law(max_force, max_approach)


class _Line(ComputedContact):
    """Two parallel cylinders, and what Johnson's theory expects of them."""

    def __init__(self, first: Cylinder, second: Cylinder, state: str, spacing: float | None) -> None:
        self.cylinders = self.bodies = first, second
        self.state, self.spacing = state, spacing
        self.method = f"finite elements, plane {state}"
        flat, sharp = relative_curvatures(first.surface, second.surface)
        if flat > 1e-12 * sharp:
            raise ValueError(
                f"second: crosses the first, with angle = {second.angle!r} and {first.angle!r}; "
                'plane strain and stress are for parallel cylinders, the method "half-spaces" for crossed ones'
            )
        self.curvature, self.length = sharp, min(first.length, second.length)
        if state == "stress":
            # The compliance of a thin disc at a contact depends on E alone.
            first, second = (
                replace(body, material=replace(body.material, poisson_ratio=0.0)) for body in self.cylinders
            )
        self.theory = self.below = contact_law(first, second)
        self.radius = 1.0 / sharp
        self.softness = sum(1.0 / body.material.contact_modulus for body in (first, second))

    def half_width(self, force: float) -> float:
        """Return half the width of the contact under a force, m (Johnson, Contact Mechanics, equation 4.43)."""
        return sqrt(4.0 * force * self.softness / (pi * self.length * self.curvature))

    def up_to(self, approach: float) -> ComputedLaw:
        """Return the law up to an approach, m."""
        return replace(self.up_to_force(float(self.theory.force(np.array(approach)))), largest=approach)

    def up_to_force(self, force: float) -> ComputedLaw:
        """Return the law up to a force, N, and somewhat beyond."""
        widest = self.half_width(force)
        size = widest / ELEMENTS if self.spacing is None else self.spacing
        if size * COARSEST > widest * (1.0 + 1e-9):
            raise ValueError(
                f"spacing = {size:.3g} m: leaves the half-width of the widest contact fewer than {COARSEST} cells; "
                f"{widest / ELEMENTS:.3g} m is a good one"
            )
        fine, *coarser = (self.steps(MARGIN * widest, size, factor) for factor in (1.0, 2.0, 4.0))
        # At the narrowest contacts the order is less than elsewhere: the whole difference is the error.
        error, order = error_and_order(fine, *coarser, highest=LEAST_ORDER)
        doubts = []
        if widest * self.curvature > SMALL_CONTACT:
            doubts.append(f"a contact of {readable(widest, 'm')} half-width is too wide for small strains")
        return self.made(fine, float(fine[0][-1]), error, order, doubts)

    def steps(self, reach: float, size: float, coarser: float = 1.0) -> Points:
        """Return the approaches, m, at which the contact's edge meets a corner of the mesh, and forces, N.

        reach, m: how far the cylinders may touch; size: of the cells there, m; coarser: a factor on all cells.
        """
        fewest = FEWEST if coarser == 1.0 else 1
        compliance, gap = self._condensed(reach, size, coarser)
        edges = np.array([edge_approach(compliance, gap, last) for last in range(2 * fewest, gap.size, 2)])
        rising = edges[edges >= np.maximum.accumulate(edges)]
        return rising, forces_of_steps(compliance, gap, rising)

    def _condensed(self, reach: float, size: float, coarser: float) -> tuple[Vector, Vector]:
        """Return the compliance of both cylinders together, m × m, m/N, and the gap between them, m numbers, m."""
        compliances: dict[Spheroid, Vector] = {}
        discs = [Spheroid(body.material, body.radius, body.radius) for body in self.cylinders]
        gap = np.zeros(1)
        for name, disc in zip(("first", "second"), discs, strict=True):
            if reach > WIDEST_CONTACT * disc.radius:
                raise ValueError(f"{name}: radius = {disc.radius:.3g} m is too small for a contact of {reach:.3g} m")
            plane = half_plane(disc, reach, size, coarser)
            gap = gap + disc.drop(plane.along[plane.surface])
            if disc not in compliances:
                compliances[disc] = section_compliance(disc.material, plane, self.state, self.length)
        return compliances[discs[0]] + compliances[discs[1]], gap


def section_compliance(material: Material, plane: HalfPlane, state: str, length: float) -> Vector:
    """Return the displacements of the m nodes that may touch by unit forces there, m × m, m/N; symmetric.

    plane: a quarter of the disc, x ≥ 0; a node's force is that on both sides of x = 0, over the length, m, of the
    cylinder. The mid-plane may slide sideways. All nodes at the centre share one place, which neither x = 0 nor the
    mid-plane lets move: held, they may share it.
    """
    basis = Basis(plane.mesh, ElementVector(ElementQuad2()), intorder=INTEGRATION_ORDER)
    across, upright = (
        np.concatenate([basis.nodal_dofs[i], basis.facet_dofs[i], basis.interior_dofs[i]]) for i in (0, 1)
    )
    symmetric, end, centre = plane.along == 0.0, plane.along == plane.along.max(), plane.depth == plane.depth.max()
    free = np.setdiff1d(np.arange(basis.N), np.concatenate([across[symmetric | centre], upright[end | centre]]))
    lame, shear = first_lame_parameter(material), shear_modulus(material)
    if state == "stress":
        lame *= 2.0 * shear / (lame + 2.0 * shear)
    stiffness = 2.0 * length * plane_stiffness(basis, lame, shear)[free][:, free]
    pressed = np.searchsorted(free, upright[plane.surface])
    compliance = compliance_at(stiffness, pressed)
    both: Vector = 0.5 * (compliance + compliance.T)
    return both
