"""Contact laws of parallel cylinders by finite elements in the plane of their section: plane strain and plane stress.

The two states bound a cylinder of finite length, whose middle is held by its neighbours as in plane strain while its
ends are free. Each section is half a disc above its mid-plane, condensed to its surface; both are pressed together
without friction (`active_set`). Linear elasticity, so strains must stay small.
"""

from dataclasses import replace
from math import pi, sqrt

import numpy as np

from particles.bead import Cylinder
from particles.laws.axisymmetric_mesh import Disc
from particles.laws.compliance import condensed, forces_at_corners
from particles.laws.computed import LEAST_ORDER, ComputedContact, ComputedLaw, error_and_order
from particles.laws.formulas import SMALL_CONTACT, contact_law
from structures.checks import instance, one_of, positive
from structures.surface import relative_curvatures
from structures.units import readable

STATES = ("strain", "stress")

ELEMENTS = 36
"""Over the half-width of the widest contact."""

FEWEST = 3
"""Elements over the half-width of the narrowest contact that is computed: the force is right to 2e-4 there."""

COARSEST = 8
"""Elements over the half-width of the widest contact, so that a mesh of cells four times as large shows the error."""

MARGIN = 1.15
"""How far the mesh lets cylinders touch, over the half-width that is expected."""


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
        self.bodies, self.spacing = (first, second), spacing
        self.method = f"finite elements, plane {state}"
        flat, sharp = relative_curvatures(first.surface, second.surface)
        if flat > 1e-12 * sharp:
            raise ValueError(
                f"second: crosses the first, with angle = {second.angle!r} and {first.angle!r}; "
                'plane strain and stress are for parallel cylinders, the method "half-spaces" for crossed ones'
            )
        self.curvature, self.length = sharp, min(first.length, second.length)
        self.discs = [
            Disc(body.material, body.radius, body.radius, length=self.length, stress=state == "stress")
            for body in (first, second)
        ]
        if state == "stress":
            # The compliance of a thin disc at a contact depends on E alone.
            first, second = (
                replace(body, material=replace(body.material, poisson_ratio=0.0)) for body in (first, second)
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
        fine, *coarser = (
            forces_at_corners(*condensed(self.discs, MARGIN * widest, size, factor), fewest)
            for factor, fewest in ((1.0, FEWEST), (2.0, 1), (4.0, 1))
        )
        # At the narrowest contacts the order is less than elsewhere: the whole difference is the error.
        error, order = error_and_order(fine, *coarser, highest=LEAST_ORDER)
        doubts = []
        if widest * self.curvature > SMALL_CONTACT:
            doubts.append(f"a contact of {readable(widest, 'm')} half-width is too wide for small strains")
        return self.made(fine, float(fine[0][-1]), error, order, doubts)
