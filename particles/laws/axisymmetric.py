"""Contact laws by finite elements: bodies of revolution that touch at their poles, hollow ones too.

Each body is half a bead, down to its mid-plane, condensed to its surface (`compliance`); both are pressed together
without friction (`active_set`). Linear elasticity, so strains must stay small.
"""

from dataclasses import replace
from math import sqrt
from typing import Annotated

import numpy as np

from particles.bead import Bead, HollowSphere, check_bead, check_body
from particles.laws.active_set import edge_approach
from particles.laws.axisymmetric_mesh import body_of
from particles.laws.compliance import MIDPLANES, condensed, forces_at_corners
from particles.laws.computed import ComputedLaw, Points, continued_to_zero, error_and_order, force_by_formula
from particles.laws.formulas import SMALL_CONTACT, contact_law, sharpest_curvatures
from particles.laws.law import PowerLaw, TabulatedLaw
from structures.caution import caution
from structures.checks import within
from structures.described import checked_call
from structures.quantities import Length, OneOf, Quantity
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness, relative_curvatures
from structures.units import readable

ELEMENTS = 30
"""Over the radius of the widest contact: 10 µm for the thesis's thickest hollow spheres, pressed by 20 µm."""

FEWEST = 3
"""Elements over the radius of the narrowest contact that is computed."""

MOST, COARSE = 200, 5.0
"""Elements over what may touch of a shell, if no size is asked for; the factor on their size to see how far that is."""

LARGE_ERROR = 0.01
"""Relative error of the force, above which a law carries a caution."""

THIN = 0.1
"""Approach over the thickness of a wall, from which its rotations count."""

MARGIN = 1.15
"""How far the mesh lets bodies touch, over the contact's radius that is expected; it widens where they touch beyond."""

WIDENING = 1.4
"""Factor on the reach where bodies touch beyond it; the law is then computed again."""

LEAST_PART = 1e-12
"""The least approach that is computed, over the radius: narrower contacts a mesh cannot distinguish from a point."""

ROUGH, TRIES = 2.0, 12
"""A factor on the elements' size, and trials, of the rough law that shows the approach at a force."""

STEP_OUT, SURPLUS, BEYOND = 1.2, 1.05, 1.03
"""The rough law's range grows by this factor until it holds more than the force; the fine one ends beyond the rough
approach, which is some per cent off."""


@checked_call
def computed_law(
    first: Bead,
    second: Bead | Surface | None = None,
    max_force: Annotated[float, Quantity("N", "a force", "2 N")] | None = None,
    max_approach: Length | None = None,
    midplane: Annotated[str, OneOf(*MIDPLANES)] = "roller",
    spacing: Length | None = None,
) -> ComputedLaw:
    """Return the law of two bodies of revolution that touch at their poles, by axisymmetric finite elements.

    Quadratic elements on the true arc, the gap that of the undeformed arcs, no friction, small strains; primal-dual
    active set. Load steps are the approaches at which the contact's edge meets a corner of the mesh: there the force
    converges smoothly, by the square of the spacing; between them the tangent scatters.
    Ranges in which strains are not small, and meshes too coarse for 1 %, get a caution.

    Parameters
    ----------
    first : Bead
        One body: a Sphere, a HollowSphere or an Ellipsoid along the chain.
    second : Bead or Surface, optional
        The other one, or a surface; by default like the first.
    max_force : float, optional
        Force up to which the law is computed, N. Give this or max_approach.
    max_approach : float, optional
        Approach up to which the law is computed, m.
    midplane : str
        "roller", whose mid-planes slide sideways as in the thesis, or "clamped".
    spacing : float, optional
        The size of the finite elements at the contact, m; by default a thirtieth of its radius.

    Returns
    -------
    ComputedLaw
        It holds its error, and the observed order of convergence.

    Raises
    ------
    ValueError
        For other bodies, and for a contact of few elements.
    RuntimeError
        Where the nodes in contact were not found.

    References
    ----------
    Khatri's thesis, sections 3.2 and 5.3; Hintermüller, Ito and Kunisch, SIAM J. Optim. 13 (2002) 865.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> hl.laws.computed_law(bead, max_force=50.0, spacing=20e-6).name
    'finite elements'
    """
    check_bead("first", first, "a body")
    second = first if second is None else check_body("second", second)
    return _Contact(first, second, midplane, spacing).law(max_force, max_approach)


class _Contact:
    """Two bodies that touch at their poles, and what their radii and walls allow."""

    def __init__(self, first: Bead, second: Bead | Surface, midplane: str, spacing: float | None) -> None:
        self.bodies, self.midplane, self.spacing = (first, second), midplane, spacing
        self.beads = ("first", first), ("second", second)
        for name, bead in self.beads:
            body_of(bead, 1.0, name)
        surface, facing = first.surface, second if isinstance(second, Surface) else second.surface
        self.curvature = relative_curvatures(surface, facing)[1]
        self.sharpest = max(sharpest_curvatures(surface, facing))
        self.below, self.radius = PowerLaw(hertz_stiffness(surface, facing)), 1.0 / self.sharpest
        self.theory = contact_law(first, second)

    def widest(self, approach: float) -> float:
        """Return the contact's radius at an approach, m, by Hertz's law, less the approach that goes into shells."""
        overlap = float(self.below.approach(self.theory.force(np.array(approach))))
        return sqrt(overlap / self.curvature)

    def law(self, max_force: float | None, max_approach: float | None) -> ComputedLaw:
        """Return the law up to one of the two, N or m."""
        smallest = LEAST_PART * self.radius
        if max_approach is not None and max_force is None:
            return self.up_to(within("max_approach", max_approach, smallest, self.radius, "m"))
        if max_force is None or max_approach is not None:
            raise ValueError(f"max_force = {max_force!r}, max_approach = {max_approach!r}: give one of them")
        low, high = self.theory.force(np.array([smallest, self.radius]))
        law = self.up_to_force(within("max_force", max_force, float(low), float(high), "N"))
        return replace(law, largest=float(law.approach(np.array(max_force, float))))

    def up_to(self, approach: float) -> ComputedLaw:
        """Return the law up to an approach, m."""
        size = self._good(approach) if self.spacing is None else self.spacing
        if size * FEWEST > self.widest(approach):
            raise self._too_coarse(approach, size)
        fine = self.steps(approach, size)
        if fine[0][0] >= approach:
            raise self._too_coarse(approach, size)
        error, order = error_and_order(fine, *(self.steps(approach, size, coarser, fewest=1) for coarser in (2.0, 4.0)))
        doubts = self._doubts(approach)
        if error > LARGE_ERROR:
            doubts.append(f"cells of {readable(size, 'm')} leave the force off by some {100.0 * error:.2g} %")
        words = "; ".join(doubts)
        if words:
            caution(f"contact law: {words}")
        points = continued_to_zero(fine, self.below)
        expected = force_by_formula(self.bodies, float(fine[0][-1]))
        return ComputedLaw(*points, "finite elements", words, approach, float(fine[0][0]), error, order, expected)  # type: ignore[arg-type]

    def up_to_force(self, force: float) -> ComputedLaw:
        """Return the law up to a force, N: a rough law shows how far the bodies approach."""
        approach = float(self.theory.approach(np.array(force)))
        for _ in range(TRIES):
            approach *= STEP_OUT
            rough = TabulatedLaw(*self.steps(approach, ROUGH * self._good(approach)))  # type: ignore[arg-type]
            if rough.forces[-1] > SURPLUS * force:
                return self.up_to(BEYOND * float(rough.approach(np.array(force))))
        raise ValueError(f"max_force = {force!r}: not reached at an approach of {approach:.3g} m; ask for less")

    def steps(self, approach: float, size: float, coarser: float = 1.0, fewest: int = FEWEST) -> Points:
        """Return the approaches, m, at which the contact's edge meets a corner of the mesh, past `approach` by one;
        forces, N.

        size: of the cells at the contact, m; coarser: a factor on all cells; fewest: cells in the narrowest contact.
        """
        compliance, gap, _ = self._wide_enough(approach, size, coarser)
        return forces_at_corners(compliance, gap, fewest, approach)

    def _wide_enough(self, approach: float, size: float, coarser: float) -> tuple[Vector, Vector, float]:
        """Return the compliance and gap of a mesh that lets the bodies touch as far as they do at an approach, and how
        far, m."""
        reach = MARGIN * self.widest(approach) + 2.0 * size * coarser
        for _ in range(TRIES):
            bodies = [body_of(bead, reach, name) for name, bead in self.beads]
            compliance, gap = condensed(bodies, reach, size, coarser, self.midplane)
            if edge_approach(compliance, gap, gap.size - 1) >= approach:
                return compliance, gap, reach
            reach *= WIDENING
        raise ValueError(
            f"max_force or max_approach: the contact is wider than {reach:.3g} m at {approach:.3g} m; ask for less"
        )

    def _good(self, approach: float) -> float:
        """Return the size of the elements, m, where none is asked for: thin shells, which touch far beyond Hertz, have
        larger."""
        size = self.widest(approach) / ELEMENTS
        if not any(isinstance(bead, HollowSphere) for _, bead in self.beads):
            return size
        return max(size, self._wide_enough(approach, size, COARSE)[2] / MOST)

    def _too_coarse(self, approach: float, size: float) -> ValueError:
        return ValueError(
            f"spacing = {size:.3g} m: leaves the radius of the widest contact fewer than {FEWEST} cells; "
            f"{self.widest(approach) / ELEMENTS:.3g} m is a good one"
        )

    def _doubts(self, approach: float) -> list[str]:
        """Return where strains or turns are no longer small."""
        doubts, radius = [], self.widest(approach)
        if radius * self.sharpest > SMALL_CONTACT:
            doubts.append(f"a contact of {readable(radius, 'm')} radius is too wide for small strains")
        for _, bead in self.beads:
            if isinstance(bead, HollowSphere) and approach > THIN * (bead.radius - bead.inner_radius):
                doubts.append(
                    f"an approach of {readable(approach, 'm')} turns a wall so thin by more than small angles"
                )
        return list(dict.fromkeys(doubts))
