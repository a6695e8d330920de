"""Contact laws by finite elements for bodies of revolution that touch at their poles, without friction.

Each body is half a bead, down to its mid-plane, condensed to its surface (`surface_compliance`). Strains are small.
"""

from dataclasses import replace
from math import log2, nan, sqrt
from typing import Annotated

import numpy as np

from particles.bead import Bead, HollowSphere, surface_of
from particles.laws.axisymmetric_mesh import WIDEST_CONTACT, Spheroid, body_of, surface_compliance
from particles.laws.formulas import SMALL_CONTACT, contact_law, sharpest_curvatures
from particles.laws.law import PowerLaw, TabulatedLaw
from structures.caution import caution
from structures.checks import within
from structures.described import checked_call, described
from structures.quantities import Length, Place, Quantity
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness, relative_curvatures
from structures.units import readable

# Elements per radius of the widest contact, which is 10 µm elements for the thesis's thickest hollow spheres pressed by
# 20 µm; and elements per radius of the narrowest contact that is computed.
ELEMENTS, FEWEST = 30, 3
TRIES = 12  # trials of wider meshes, and of rough laws that reach a force
Points = tuple[Vector, Vector]  # approaches, m, and forces, N


@described
class ComputedLaw(TabulatedLaw):
    """A law by finite elements, computed between the approaches `smallest` and `largest`, m. Below `smallest` it is
    Hertz's law in series with a spring, through the first computed point.
    """

    smallest: Place = 0.0
    error: Annotated[float, Quantity(or_zero=True)] = 0.0  # largest relative error of the force, from coarser meshes


@checked_call
def computed_law(
    first: Bead,
    second: Bead | Surface | None = None,
    max_force: Annotated[float, Quantity("N", "a force", "2 N")] | None = None,
    max_approach: Length | None = None,
    spacing: Length | None = None,
) -> ComputedLaw:
    """Return the law of two bodies of revolution by axisymmetric finite elements (Khatri's thesis, 3.2 and 5.3).

    Parameters
    ----------
    first, second : Bead or Surface
        A Sphere, HollowSphere or Ellipsoid along the chain, and a second body or a surface; by default equal bodies.
    max_force, max_approach : float, optional
        Force, N, or approach, m, up to which the law is computed. Give one of them.
    spacing : float, optional
        Size of the finite elements at the contact, m; by default a thirtieth of the radius of the contact.

    Returns
    -------
    ComputedLaw
        The law, with its error, and with a caution if contacts are wide or if the error exceeds 1 %.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> hl.laws.computed_law(bead, max_force=50.0, spacing=20e-6).name
    'finite elements'
    """
    second = first if second is None else second
    if (max_force is None) == (max_approach is None):
        raise ValueError(f"max_force = {max_force!r}, max_approach = {max_approach!r}: must be one of them")
    contact = _Contact(first, second)
    # No mesh can distinguish a narrower contact from a point.
    smallest, radius = 1e-12 / contact.sharpest, 1.0 / contact.sharpest
    if max_approach is not None:
        return contact.up_to(within("max_approach", max_approach, smallest, radius, "m"), spacing)
    low, high = contact.theory.force(np.array([smallest, radius]))
    force = within("max_force", max_force, float(low), float(high), "N")  # type: ignore[arg-type]
    # A rough law gives the approach at the force.
    approach = float(contact.theory.approach(np.array(force)))
    for _ in range(TRIES):
        approach *= 1.2
        rough = TabulatedLaw(*contact.steps(approach, 2.0 * contact.good_size(approach)))  # type: ignore[arg-type]
        if rough.forces[-1] > 1.05 * force:
            law = contact.up_to(1.03 * float(rough.approach(np.array(force))), spacing)
            return replace(law, largest=float(law.approach(np.array(force))))
    raise ValueError(f"max_force = {force!r}: must be smaller; an approach of {approach:.3g} m does not reach it")


class _Contact:
    """Two bodies that touch at their poles, and the limits that their radii and walls set."""

    def __init__(self, first: Bead, second: Bead | Surface) -> None:
        self.bodies = (first, second)
        for name, bead in zip(("first", "second"), self.bodies, strict=True):
            body_of(bead, 1.0, name)
        surfaces = surface_of(first), surface_of(second)
        self.curvature, self.sharpest = relative_curvatures(*surfaces)[1], max(sharpest_curvatures(*surfaces))
        self.hertz, self.theory = PowerLaw(hertz_stiffness(*surfaces)), contact_law(first, second)
        self.shells = [bead for bead in self.bodies if isinstance(bead, HollowSphere)]

    def widest(self, approach: float) -> float:
        """Return the contact's radius at an approach, m, by Hertz's law for the approach without that of shells."""
        overlap = float(self.hertz.approach(self.theory.force(np.array(approach))))
        return sqrt(overlap / self.curvature)

    def good_size(self, approach: float) -> float:
        """Return the size of the elements, m; it is larger for thin shells, whose contacts are wider than Hertz's."""
        size = self.widest(approach) / ELEMENTS
        return max(size, self._mesh(approach, size, 5.0)[2] / 200.0) if self.shells else size

    def up_to(self, approach: float, spacing: float | None) -> ComputedLaw:
        """Return the law up to an approach, m, by elements of a size `spacing`, m."""
        size, radius = spacing or self.good_size(approach), self.widest(approach)
        fine = self.steps(approach, size) if size * FEWEST <= radius else None
        if fine is None or fine[0][0] >= approach:
            raise ValueError(f"spacing = {size:.3g} m: must be smaller, such as {radius / ELEMENTS:.3g} m")
        approaches, forces = fine

        # The largest relative error of the force, from the order of convergence of coarser meshes, 1 to 2. If they are
        # too coarse to show an order, it is the whole difference.
        coarse, coarsest = (self.steps(approach, size, coarser, fewest=1) for coarser in (2.0, 4.0))
        by_coarse, by_coarsest = (TabulatedLaw(*points).force(approaches) for points in (coarse, coarsest))  # type: ignore[arg-type]
        near, far = np.abs(by_coarse - forces) / forces, np.abs(by_coarsest - by_coarse) / forces
        common = approaches >= coarsest[0][0]
        order = log2(float(far[common].mean() / near[common].mean())) if np.count_nonzero(common) > 2 else nan
        error = float(near.max()) / (2.0 ** min(max(order, 1.0), 2.0) - 1.0 if order == order else 1.0)
        doubts = []
        if radius * self.sharpest > SMALL_CONTACT:
            doubts.append(f"a contact of {readable(radius, 'm')} radius is too wide for the theory of small strains")
        if any(approach > 0.1 * (shell.radius - shell.inner_radius) for shell in self.shells):
            doubts.append(f"an approach of {readable(approach, 'm')} rotates the thin wall by more than small angles")
        if error > 0.01:
            doubts.append(f"cells of {readable(size, 'm')} make the force wrong by about {100.0 * error:.2g} %")
        words = "; ".join(doubts)
        if words:
            caution(f"contact law: {words}")
        # Below the first point, Hertz's law in series with a spring that leads to this point.
        first = forces[0] * np.geomspace(1e-9, 1.0, 72, endpoint=False)
        softness = (approaches[0] - float(self.hertz.approach(np.array(forces[0])))) / forces[0]
        below = self.hertz.approach(first) + softness * first
        points = np.append(below, approaches), np.append(first, forces)
        return ComputedLaw(*points, "finite elements", words, approach, float(approaches[0]), error)  # type: ignore[arg-type]

    def steps(self, approach: float, size: float, coarser: float = 1.0, fewest: int = FEWEST) -> Points:
        """Return the approaches, m, at which the contact's edge meets a corner of the mesh, and the forces, N. At these
        the error of the force is quadratic in the size. fewest: cells in the narrowest contact.
        """
        compliance, gap, _ = self._mesh(approach, size, coarser)
        points = np.array([pressed_to(compliance, gap, last) for last in range(2 * fewest, gap.size, 2)])
        rising = points[points[:, 0] >= np.maximum.accumulate(points[:, 0])]
        kept = rising[: max(int(np.searchsorted(rising[:, 0], approach)) + 1, 2)]
        return kept[:, 0], kept[:, 1]

    def _mesh(self, approach: float, size: float, coarser: float) -> tuple[Vector, Vector, float]:
        """Return the compliance of both bodies, m/N, their gap, m, and the radius within which they may touch, m."""
        reach = 1.15 * self.widest(approach) + 2.0 * size * coarser
        for _ in range(TRIES):
            known, compliance, gap = dict[Bead | Surface, Points](), np.zeros(1), np.zeros(1)
            for name, bead in zip(("first", "second"), self.bodies, strict=True):
                body = body_of(bead, reach, name)
                if isinstance(body, Spheroid) and reach > WIDEST_CONTACT * body.radius:
                    raise ValueError(f"{name}: must be larger for a contact of {reach:.3g} m radius")
                if bead not in known:
                    known[bead] = surface_compliance(body, reach, size, coarser)
                gap, compliance = gap + body.drop(known[bead][0]), compliance + known[bead][1]
            if pressed_to(compliance, gap, gap.size - 1)[0] >= approach:
                return compliance, gap, reach
            reach *= 1.4
        raise ValueError(f"max_force, max_approach: must be smaller; the contact is wider than {reach:.3g} m")


def pressed_to(compliance: Vector, gap: Vector, last: int) -> tuple[float, float]:
    """Return the approach, m, and the force, N, at which the contact's edge is the node `last`, whose force is zero.
    All nodes inside have a pressure. (The centre of a shell loses it at half its wall thickness, beyond small strains.)
    """
    inside = slice(0, last + 1)
    right = np.stack([gap[inside], np.ones(last + 1)], axis=1)
    by_gap, by_approach = np.linalg.solve(compliance[inside, inside], right).T
    approach = by_gap[last] / by_approach[last]
    return float(approach), float((approach * by_approach - by_gap).sum())
