"""Contact laws that are computed point by point: the range, the error, and their continuation below the first point."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from math import log2, nan
from typing import Annotated

import numpy as np

from particles.bead import Bead
from particles.laws.formulas import contact_law
from particles.laws.law import ContactLaw, TabulatedLaw
from particles.laws.power_fit import PowerFit, fit_power_law
from structures.caution import caution, collected
from structures.checks import positive, within
from structures.described import described
from structures.quantities import Component, ContactForce, Place, Quantity
from structures.structure import Vector
from structures.surface import Surface

ORDER = 2.0
"""Of the convergence of F(δ), by finite elements where the contact's edge lies at a corner of the mesh."""

LEAST_ORDER = 1.0
"""Below this, the difference to the coarser law is taken for the error as it is."""

PARTS_BELOW = np.geomspace(1e-9, 1.0, 72, endpoint=False)
"""Forces below the first computed one, over it."""

LEAST_PART = 1e-12
"""The least approach that is computed, over the radius: narrower contacts a mesh cannot distinguish from a point."""

ROUNDING = 1e-9
"""Of a range's ends."""

Points = tuple[Vector, Vector]
"""Approaches, m, and forces, N."""


@described
class ComputedLaw(TabulatedLaw):
    """A contact law by a numerical method, computed from the approach `smallest` to `largest`.

    Below that range the law continues as that of its theory in series with a spring, through the first computed point;
    beyond it a run warns.

    Parameters
    ----------
    approaches : sequence of float
        Approaches, m, increasing.
    forces : sequence of float
        Forces, N, increasing.
    name : str
        The method.
    caution : str
        What a user of the law must know; a run repeats it as a warning.
    largest : float
        Largest approach that was computed, m.
    smallest : float
        Smallest approach that was computed, m.
    error : float
        Largest relative error of the force in the range, estimated from coarser meshes.
    order : float
        Observed order of convergence; nan where the meshes are too coarse to show it.
    formula : float
        Force at the last point by `contact_law` of the two bodies, N; 0 where they are not known. A chain in which the
        law has other bodies warns.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> from particles.laws.axisymmetric import contact_law_fem
    >>> law = contact_law_fem(bead, max_force=50.0, spacing=20e-6)
    >>> law
    ComputedLaw('finite elements', ... points up to ... m and ... N)
    >>> law.error < 0.01
    True
    """

    smallest: Place = 0.0
    error: Annotated[float, Quantity(or_zero=True)] = 0.0
    order: Component = nan
    formula: ContactForce = 0.0

    def fit(self, lowest: float | None = None, highest: float | None = None, weighting: str = "relative") -> PowerFit:
        """Return the nearest power law, by default over the whole computed range; see `fit_power_law`.

        Raises ValueError for a range that was not computed.
        """
        low = self.smallest if lowest is None else positive("lowest", lowest, "m")
        high = self.largest if highest is None else positive("highest", highest, "m")
        for name, end in (("lowest", low), ("highest", high)):
            if not self.smallest * (1.0 - ROUNDING) <= end <= self.largest * (1.0 + ROUNDING):
                raise ValueError(
                    f"{name} = {end!r}: must lie between {self.smallest:.4g} and {self.largest:.4g} m, which were "
                    "computed; beyond, see fit_power_law"
                )
        return fit_power_law(self, low, high, weighting)


class ComputedContact(ABC):
    """Two bodies whose contact a method computes. A subclass gives laws up to an approach and up to a force.

    method: its name. bodies: the two. theory: the law that is expected, which bounds the range; below: the law that
    continues the computed one to zero. radius, m: the smallest of the contact; least: the smallest approach over it.
    """

    method: str
    bodies: tuple[Bead, Bead | Surface]
    theory: ContactLaw
    below: ContactLaw
    radius: float
    least: float = LEAST_PART

    def law(self, max_force: float | None, max_approach: float | None) -> ComputedLaw:
        """Return the law up to one of the two, N or m: an approach from the part `least` of the radius to all of it."""
        smallest = self.least * self.radius
        if max_approach is not None and max_force is None:
            return self.up_to(within("max_approach", max_approach, smallest, self.radius, "m"))
        if max_force is None or max_approach is not None:
            raise ValueError(f"max_force = {max_force!r}, max_approach = {max_approach!r}: give one of them")
        low, high = self.theory.force(np.array([smallest, self.radius]))
        law = self.up_to_force(within("max_force", max_force, float(low), float(high), "N"))
        return replace(law, largest=float(law.approach(np.array(max_force, float))))

    @abstractmethod
    def up_to(self, approach: float) -> ComputedLaw:
        """Return the law up to an approach, m."""

    @abstractmethod
    def up_to_force(self, force: float) -> ComputedLaw:
        """Return a law that reaches this force, N."""

    def made(self, points: Points, largest: float, error: float, order: float, doubts: Sequence[str]) -> ComputedLaw:
        """Return the law through computed points; the user is warned of doubts."""
        words = "; ".join(doubts)
        if words:
            caution(f"contact law: {words}")
        points_to_zero = continued_to_zero(points, self.below)
        expected = force_by_formula(self.bodies, float(points[0][-1]))
        return ComputedLaw(*points_to_zero, self.method, words, largest, float(points[0][0]), error, order, expected)  # type: ignore[arg-type]


def force_by_formula(bodies: tuple[Bead, Bead | Surface], approach: float) -> float:
    """Return the force of two bodies by `contact_law` at an approach, m, in N."""
    with collected():  # the doubts of the formula do not matter where a number only tells bodies apart
        return float(contact_law(*bodies).force(np.array(approach)))


def error_and_order(fine: Points, coarse: Points, coarsest: Points, *, highest: float = ORDER) -> tuple[float, float]:
    """Return the largest relative error of the finest law's force, and the observed order, from meshes of cells twice
    as large.

    The order is that of the mean differences where all three hold. Without one, the whole difference is the error;
    observed orders above the `highest` are not trusted to last: the error is then that of this order.
    """
    approaches, forces = fine
    by_coarse, by_coarsest = (TabulatedLaw(*points).force(approaches) for points in (coarse, coarsest))  # type: ignore[arg-type]
    near = np.abs(by_coarse - forces) / forces
    far = np.abs(by_coarsest - by_coarse) / forces
    common = approaches >= coarsest[0][0]
    order = log2(float(far[common].mean() / near[common].mean())) if np.count_nonzero(common) > 2 else nan
    gain = 2.0 ** min(max(order, LEAST_ORDER), highest) if order == order else 2.0
    return float(near.max()) / (gain - 1.0), order


def continued_to_zero(points: Points, theory: ContactLaw) -> Points:
    """Return the points, and before them a theory's law in series with the spring that leads to the first one."""
    approach, force = points[0][0], points[1][0]
    forces = force * PARTS_BELOW
    softness = (approach - float(theory.approach(np.array(force)))) / force
    return np.append(theory.approach(forces) + softness * forces, points[0]), np.append(forces, points[1])
