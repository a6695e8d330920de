"""Contact laws by finite elements: bodies of revolution that touch at their poles, hollow ones too.

Each body is half a bead, down to its mid-plane, condensed to its surface (`compliance`); both are pressed together
without friction (`active_set`). Linear elasticity, so strains must stay small.
"""

from dataclasses import replace
from math import sqrt

import numpy as np

from particles.bead import Bead, HollowSphere, check_bead, check_body
from particles.laws.active_set import edge_approach, forces_of_steps
from particles.laws.compliance import MIDPLANES, surface_compliance
from particles.laws.computed import ComputedLaw, Points, check_range, continued_to_zero, error_and_order
from particles.laws.formulas import SMALL_CONTACT, contact_law, sharpest_curvatures
from particles.laws.law import PowerLaw, TabulatedLaw
from particles.laws.meshes import Spheroid, body_of, half_plane
from structures.caution import caution
from structures.checks import one_of, positive
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness, relative_curvatures

ELEMENTS = 30
"""Over the radius of the widest contact: 10 µm for the thesis's thickest hollow spheres, pressed by 20 µm."""

FEWEST = 3
"""Elements over the radius of the narrowest contact that is computed."""

MOST, COARSE = 200, 5.0
"""Elements over what may touch of a shell, if no size is asked for; the factor on their size to see how far that is."""

LARGE_ERROR = 0.01
"""Of the force, above which a law says so."""

WIDEST_CONTACT = 0.5
"""Radius of a contact over that of a body, beyond which half a bead pressed along its axis says nothing."""

THIN = 0.1
"""Approach over the thickness of a wall, from which its turns count."""

MARGIN = 1.15
"""How far the mesh lets bodies touch, over the contact's radius that is expected; it widens where they touch beyond."""

WIDENING = 1.4

ROUGH, TRIES = 2.0, 12
"""A factor on the elements' size, and trials, of the rough law that tells the approach at a force."""


def contact_law_fem(
    first: Bead,
    second: Bead | Surface | None = None,
    max_force: float | None = None,
    max_approach: float | None = None,
    midplane: str = "roller",
    spacing: float | None = None,
) -> ComputedLaw:
    """The law of two bodies of revolution by finite elements, up to max_force (N) or max_approach (m).

    first, second: Sphere, HollowSphere or Ellipsoid(axis="along"); second may be a Surface, which is a half-space
    (curved: with the gap of an arc), and is by default like the first. The approach is that of their mid-planes, which
    may slide sideways (midplane "roller", the thesis's) or not ("clamped").
    Quadratic elements on the true arc, the gap that of the undeformed arcs, no friction, small strains; primal-dual
    active set. spacing, m: size of the elements at the contact; by default a thirtieth of the radius of the widest
    contact. Load steps are the approaches at which the contact's edge meets a corner of the mesh: there the force
    converges smoothly, by the square of the spacing, while between them the tangent trembles.
    Ranges that leave small strains, and meshes too coarse for 1 %, get a caution.
    Raises ValueError for other bodies, for surfaces that conform, and where a contact has no three elements;
    ActiveSetNotConverged.
    """
    check_bead("first", first, "a body")
    second = first if second is None else check_body("second", second)
    one_of("midplane", midplane, MIDPLANES)
    contact = _Contact(first, second, midplane)
    check_range(max_force, max_approach, contact.analytic, 1.0 / contact.sharpest)
    size = None if spacing is None else positive("spacing", spacing, "m")
    if max_approach is not None:
        return contact.law(float(max_approach), size)
    return contact.law_to_force(float(max_force), size)  # type: ignore[arg-type]


class _Contact:
    """Two bodies that touch at their poles, and what their radii and walls allow."""

    def __init__(self, first: Bead, second: Bead | Surface, midplane: str) -> None:
        self.beads, self.midplane = (("first", first), ("second", second)), midplane
        for name, bead in self.beads:
            body_of(bead, 1.0, name)
        one, other = first.surface, second if isinstance(second, Surface) else second.surface
        self.curvature, self.sharpest = relative_curvatures(one, other)[1], max(sharpest_curvatures(one, other))
        self.hertz = PowerLaw(hertz_stiffness(one, other))
        self.analytic = contact_law(first, second)

    def widest(self, approach: float) -> float:
        """Radius of the contact at an approach, m, by Hertz's law, less the approach that goes into shells."""
        overlap = float(self.hertz.approach(self.analytic.force(np.array(approach))))
        return sqrt(overlap / self.curvature)

    def law(self, approach: float, spacing: float | None) -> ComputedLaw:
        """The law up to an approach, m."""
        size = self._good(approach) if spacing is None else spacing
        if size * FEWEST > self.widest(approach):
            raise self._too_coarse(approach, size)
        fine = self.steps(approach, size)
        if fine[0][0] >= approach:
            raise self._too_coarse(approach, size)
        error, order = error_and_order(fine, *(self.steps(approach, size, coarser, fewest=1) for coarser in (2.0, 4.0)))
        found = self._doubts(approach)
        if error > LARGE_ERROR:
            found.append(f"cells of {size:.3g} m leave the force off by some {100.0 * error:.2g} %")
        doubts = "; ".join(found)
        if doubts:
            caution(f"contact law: {doubts}")
        points = continued_to_zero(fine, self.hertz)
        return ComputedLaw(*points, "finite elements", doubts, approach, float(fine[0][0]), error, order)  # type: ignore[arg-type]

    def law_to_force(self, force: float, spacing: float | None) -> ComputedLaw:
        """The law up to a force, N: a rough law tells how far the bodies approach."""
        approach = float(self.analytic.approach(np.array(force)))
        for _ in range(TRIES):
            approach *= 1.2
            rough = TabulatedLaw(*self.steps(approach, ROUGH * self._good(approach)))  # type: ignore[arg-type]
            if rough.forces[-1] > 1.05 * force:
                law = self.law(1.03 * float(rough.approach(np.array(force))), spacing)
                return replace(law, largest=float(law.approach(np.array(force))))
        raise ValueError(f"max_force = {force!r}: not reached at an approach of {approach:.3g} m; ask for less")

    def steps(self, approach: float, size: float, coarser: float = 1.0, fewest: int = FEWEST) -> Points:
        """Approaches, m, at which the contact's edge meets a corner of the mesh, past `approach` by one; forces, N.

        size: of the cells at the contact, m; coarser: a factor on all cells; fewest: cells in the narrowest contact.
        """
        compliance, gap, _ = self._wide_enough(approach, size, coarser)
        edges = np.array([edge_approach(compliance, gap, last) for last in range(2 * fewest, gap.size, 2)])
        rising = edges[edges >= np.maximum.accumulate(edges)]
        needed = max(int(np.searchsorted(rising, approach)) + 1, 2)
        return rising[:needed], forces_of_steps(compliance, gap, rising[:needed])

    def _wide_enough(self, approach: float, size: float, coarser: float) -> tuple[Vector, Vector, float]:
        """Compliance and gap of a mesh that lets the bodies touch as far as they do at an approach, and how far, m."""
        reach = MARGIN * self.widest(approach) + 2.0 * size * coarser
        for _ in range(TRIES):
            compliance, gap = self._condensed(reach, size, coarser)
            if edge_approach(compliance, gap, gap.size - 1) >= approach:
                return compliance, gap, reach
            reach *= WIDENING
        raise ValueError(
            f"max_force or max_approach: the contact is wider than {reach:.3g} m at {approach:.3g} m; ask for less"
        )

    def _good(self, approach: float) -> float:
        """Size of the elements, m, where none is asked for: thin shells, which touch far beyond Hertz, have larger."""
        size = self.widest(approach) / ELEMENTS
        if not any(isinstance(bead, HollowSphere) for _, bead in self.beads):
            return size
        return max(size, self._wide_enough(approach, size, COARSE)[2] / MOST)

    def _too_coarse(self, approach: float, size: float) -> ValueError:
        return ValueError(
            f"spacing = {size:.3g} m: leaves the radius of the widest contact fewer than {FEWEST} cells; "
            f"{self.widest(approach) / ELEMENTS:.3g} m is a good one"
        )

    def _condensed(self, reach: float, size: float, coarser: float) -> tuple[Vector, Vector]:
        """Compliance of both bodies together, m × m, m/N, and the gap between their surfaces, m numbers, m."""
        compliances, drops = {}, []
        for name, bead in self.beads:
            body = body_of(bead, reach, name)
            if isinstance(body, Spheroid) and reach > WIDEST_CONTACT * body.radius:
                raise ValueError(f"{name} = {bead!r}: is too small for a contact of {reach:.3g} m radius; ask for less")
            plane = half_plane(body, reach, size, coarser)
            drops.append(body.drop(plane.along[plane.surface]))
            if body not in compliances:
                compliances[body] = surface_compliance(body, plane, self.midplane)
        one, other = (compliances[body_of(bead, reach, name)] for name, bead in self.beads)
        return one + other, drops[0] + drops[1]

    def _doubts(self, approach: float) -> list[str]:
        """Where strains or turns are no longer small."""
        doubts, radius = [], self.widest(approach)
        if radius * self.sharpest > SMALL_CONTACT:
            doubts.append(f"a contact of {radius:.3g} m radius is too wide for small strains")
        for _, bead in self.beads:
            if isinstance(bead, HollowSphere) and approach > THIN * (bead.radius - bead.inner_radius):
                doubts.append(f"an approach of {approach:.3g} m turns a wall so thin by more than small angles")
        return list(dict.fromkeys(doubts))
