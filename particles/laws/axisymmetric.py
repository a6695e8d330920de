"""Contact laws by finite elements: bodies of revolution that touch at their poles, hollow ones too.

Each body is half a bead, down to its mid-plane, condensed to its surface (`surface_compliance`); both are pressed
together without friction. Linear elasticity, so strains must stay small.
"""

from dataclasses import replace
from math import log2, nan, sqrt
from typing import Annotated

import numpy as np

from particles.bead import Bead, HollowSphere, check_bead, surface_of
from particles.laws.axisymmetric_mesh import WIDEST_CONTACT, Spheroid, body_of, surface_compliance
from particles.laws.formulas import SMALL_CONTACT, check_bodies, contact_law, sharpest_curvatures
from particles.laws.law import PowerLaw, TabulatedLaw
from structures.caution import caution, collected
from structures.checks import within
from structures.described import checked_call, described
from structures.quantities import Component, ContactForce, Length, Place, Quantity
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness, relative_curvatures
from structures.units import readable

ELEMENTS, FEWEST = 30, 3
"""Elements over the radius of the widest contact: 10 µm for the thesis's thickest hollow spheres, pressed by 20 µm; and
over that of the narrowest contact that is computed."""

MOST, COARSE = 200, 5.0
"""Elements over what may touch of a shell, if no size is asked for; the factor on their size to see how far that is."""

LARGE_ERROR = 0.01
"""Relative error of the force, above which a law carries a caution."""

TRIES = 12
"""Trials of a wider mesh, and of a rough law that reaches a force."""

PARTS_BELOW = np.geomspace(1e-9, 1.0, 72, endpoint=False)
"""Forces below the first computed one, over it."""

Points = tuple[Vector, Vector]
"""Approaches, m, and forces, N."""


@described
class ComputedLaw(TabulatedLaw):
    """A law by finite elements, computed from the approach `smallest` to `largest`, m; beyond it a run warns.

    Below `smallest` it continues as that of its theory in series with a spring, through the first computed point.
    """

    smallest: Place = 0.0
    error: Annotated[float, Quantity(or_zero=True)] = 0.0
    """Largest relative error of the force, estimated from coarser meshes."""
    order: Component = nan
    """Observed order of convergence; nan where the meshes are too coarse to show it."""
    formula: ContactForce = 0.0
    """Force at the last point by `contact_law`, N, by which a chain notices other bodies; 0 where not known."""


def force_by_formula(bodies: tuple[Bead, Bead | Surface], approach: float) -> float:
    """Return the force of two bodies by `contact_law` at an approach, m, in N."""
    with collected():  # the doubts of the formula do not matter where a number only tells bodies apart
        return float(contact_law(*bodies).force(np.array(approach)))


@checked_call
def computed_law(
    first: Bead,
    second: Bead | Surface | None = None,
    max_force: Annotated[float, Quantity("N", "a force", "2 N")] | None = None,
    max_approach: Length | None = None,
    spacing: Length | None = None,
) -> ComputedLaw:
    """Return the law of two bodies of revolution that touch at their poles, by axisymmetric finite elements.

    Quadratic elements on the true arc, no friction, small strains, mid-planes that slide sideways (thesis, 3.2, 5.3).
    Load steps are the approaches at which the contact's edge meets a corner of the mesh: there the force converges by
    the square of the spacing. Wide contacts, and meshes too coarse for 1 %, get a caution.

    Parameters
    ----------
    first : Bead
        One body: a Sphere, a HollowSphere or an Ellipsoid along the chain.
    second : Bead or Surface, optional
        The other one, or a surface; by default like the first.
    max_force, max_approach : float, optional
        Force, N, or approach, m, up to which the law is computed. Give one of them.
    spacing : float, optional
        The size of the finite elements at the contact, m; by default a thirtieth of its radius.

    Returns
    -------
    ComputedLaw
        It holds its error, and the observed order of convergence.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> hl.laws.computed_law(bead, max_force=50.0, spacing=20e-6).name
    'finite elements'
    """
    second = check_bead("first", first, "a body") if second is None else second
    check_bodies(first, second)
    if (max_force is None) == (max_approach is None):
        raise ValueError(f"max_force = {max_force!r}, max_approach = {max_approach!r}: give one of them")
    contact = _Contact(first, second)
    # Narrower contacts a mesh cannot distinguish from a point.
    smallest, radius = 1e-12 / contact.sharpest, 1.0 / contact.sharpest
    if max_approach is not None:
        return contact.up_to(within("max_approach", max_approach, smallest, radius, "m"), spacing)
    low, high = contact.theory.force(np.array([smallest, radius]))
    force = within("max_force", max_force, float(low), float(high), "N")  # type: ignore[arg-type]
    # A rough law shows how far the bodies approach.
    approach = float(contact.theory.approach(np.array(force)))
    for _ in range(TRIES):
        approach *= 1.2
        rough = TabulatedLaw(*contact.steps(approach, 2.0 * contact.good_size(approach)))  # type: ignore[arg-type]
        if rough.forces[-1] > 1.05 * force:
            law = contact.up_to(1.03 * float(rough.approach(np.array(force))), spacing)
            return replace(law, largest=float(law.approach(np.array(force))))
    raise ValueError(f"max_force = {force!r}: not reached at an approach of {approach:.3g} m; ask for less")


class _Contact:
    """Two bodies that touch at their poles, and what their radii and walls allow."""

    def __init__(self, first: Bead, second: Bead | Surface) -> None:
        self.bodies = (first, second)
        for name, bead in zip(("first", "second"), self.bodies, strict=True):
            body_of(bead, 1.0, name)
        surfaces = surface_of(first), surface_of(second)
        self.curvature, self.sharpest = relative_curvatures(*surfaces)[1], max(sharpest_curvatures(*surfaces))
        self.hertz, self.theory = PowerLaw(hertz_stiffness(*surfaces)), contact_law(first, second)
        self.shells = [bead for bead in self.bodies if isinstance(bead, HollowSphere)]

    def widest(self, approach: float) -> float:
        """Return the contact's radius at an approach, m, by Hertz's law, less the approach that goes into shells."""
        overlap = float(self.hertz.approach(self.theory.force(np.array(approach))))
        return sqrt(overlap / self.curvature)

    def good_size(self, approach: float) -> float:
        """Return the size of the elements, m; thin shells, which touch far beyond Hertz, have larger ones."""
        size = self.widest(approach) / ELEMENTS
        return max(size, self._mesh(approach, size, COARSE)[2] / MOST) if self.shells else size

    def up_to(self, approach: float, spacing: float | None) -> ComputedLaw:
        """Return the law up to an approach, m, by elements of a size, m."""
        size, radius = spacing or self.good_size(approach), self.widest(approach)
        fine = self.steps(approach, size) if size * FEWEST <= radius else None
        if fine is None or fine[0][0] >= approach:
            raise ValueError(
                f"spacing = {size:.3g} m: leaves the radius of the widest contact fewer than {FEWEST} cells; "
                f"{radius / ELEMENTS:.3g} m is a good one"
            )
        (approaches, forces), error, order = fine, *self._error(fine, approach, size)
        doubts = []
        if radius * self.sharpest > SMALL_CONTACT:
            doubts.append(f"a contact of {readable(radius, 'm')} radius is too wide for small strains")
        if any(approach > 0.1 * (shell.radius - shell.inner_radius) for shell in self.shells):
            doubts.append(f"an approach of {readable(approach, 'm')} turns a wall so thin by more than small angles")
        if error > LARGE_ERROR:
            doubts.append(f"cells of {readable(size, 'm')} leave the force off by some {100.0 * error:.2g} %")
        words = "; ".join(doubts)
        if words:
            caution(f"contact law: {words}")
        # Below the first point, Hertz's law in series with the spring that leads to it.
        first = forces[0] * PARTS_BELOW
        softness = (approaches[0] - float(self.hertz.approach(np.array(forces[0])))) / forces[0]
        below = self.hertz.approach(first) + softness * first
        expected = force_by_formula(self.bodies, float(approaches[-1]))
        return ComputedLaw(
            np.append(below, approaches), np.append(first, forces), "finite elements", words, approach,  # type: ignore[arg-type]
            float(approaches[0]), error, order, expected,
        )  # fmt: skip

    def _error(self, fine: Points, approach: float, size: float) -> tuple[float, float]:
        """Return the largest relative error of the force, and the observed order, from meshes of cells twice as large.

        The order is that of the mean differences where all three hold. Without one, the whole difference is the error;
        observed orders above two are not trusted to last: the error is then that of this order.
        """
        coarse, coarsest = (self.steps(approach, size, coarser, fewest=1) for coarser in (2.0, 4.0))
        approaches, forces = fine
        by_coarse, by_coarsest = (TabulatedLaw(*points).force(approaches) for points in (coarse, coarsest))  # type: ignore[arg-type]
        near, far = np.abs(by_coarse - forces) / forces, np.abs(by_coarsest - by_coarse) / forces
        common = approaches >= coarsest[0][0]
        order = log2(float(far[common].mean() / near[common].mean())) if np.count_nonzero(common) > 2 else nan
        gain = 2.0 ** min(max(order, 1.0), 2.0) if order == order else 2.0
        return float(near.max()) / (gain - 1.0), order

    def steps(self, approach: float, size: float, coarser: float = 1.0, fewest: int = FEWEST) -> Points:
        """Return the approaches, m, at which the contact's edge meets a corner of the mesh, past `approach` by one;
        forces, N.

        size: of the cells at the contact, m; coarser: a factor on all cells; fewest: cells in the narrowest contact.
        """
        compliance, gap, _ = self._mesh(approach, size, coarser)
        points = np.array([pressed_to(compliance, gap, last) for last in range(2 * fewest, gap.size, 2)])
        rising = points[points[:, 0] >= np.maximum.accumulate(points[:, 0])]
        kept = rising[: max(int(np.searchsorted(rising[:, 0], approach)) + 1, 2)]
        return kept[:, 0], kept[:, 1]

    def _mesh(self, approach: float, size: float, coarser: float) -> tuple[Vector, Vector, float]:
        """Return the compliance of both bodies together, m × m, m/N, the gap between them, m, and the mesh's reach, m:
        as far as they touch at an approach."""
        reach = 1.15 * self.widest(approach) + 2.0 * size * coarser
        for _ in range(TRIES):
            known, compliance, gap = dict[Bead | Surface, Points](), np.zeros(1), np.zeros(1)
            for name, bead in zip(("first", "second"), self.bodies, strict=True):
                body = body_of(bead, reach, name)
                if isinstance(body, Spheroid) and reach > WIDEST_CONTACT * body.radius:
                    raise ValueError(
                        f"{name}: radius = {body.radius:.3g} m is too small for a contact of {reach:.3g} m"
                    )
                if bead not in known:
                    known[bead] = surface_compliance(body, reach, size, coarser)
                gap, compliance = gap + body.drop(known[bead][0]), compliance + known[bead][1]
            if pressed_to(compliance, gap, gap.size - 1)[0] >= approach:
                return compliance, gap, reach
            reach *= 1.4
        raise ValueError(
            f"max_force or max_approach: the contact is wider than {reach:.3g} m at {approach:.3g} m; ask for less"
        )


def pressed_to(compliance: Vector, gap: Vector, last: int) -> tuple[float, float]:
    """Return approach, m, and force, N, at which the edge of a round contact is the node `last`, whose own force is
    then just zero.

    All nodes inside push, but the centre of a shell that is pressed by half its wall, where small strains end: there it
    pulls by up to 1e-3 of the largest force.
    """
    inside = slice(0, last + 1)
    right = np.stack([gap[inside], np.ones(last + 1)], axis=1)
    by_gap, by_approach = np.linalg.solve(compliance[inside, inside], right).T
    approach = by_gap[last] / by_approach[last]
    return float(approach), float((approach * by_approach - by_gap).sum())
