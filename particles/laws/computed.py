"""Contact laws that are computed point by point: the range, the error, and their continuation below the first point."""

from math import log2, nan
from typing import Annotated

import numpy as np

from particles.bead import Bead
from particles.laws.formulas import contact_law
from particles.laws.law import ContactLaw, TabulatedLaw
from structures.caution import collected
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
    >>> law = hl.laws.computed_law(bead, max_force=50.0, spacing=20e-6)
    >>> law
    ComputedLaw('finite elements', ... points up to ... m and ... N)
    >>> law.error < 0.01
    True
    """

    smallest: Place = 0.0
    error: Annotated[float, Quantity(or_zero=True)] = 0.0
    order: Component = nan
    formula: ContactForce = 0.0


def force_by_formula(bodies: tuple[Bead, Bead | Surface], approach: float) -> float:
    """Return the force of two bodies by `contact_law` at an approach, m, in N."""
    with collected():  # the doubts of the formula do not matter where a number only tells bodies apart
        return float(contact_law(*bodies).force(np.array(approach)))


def error_and_order(fine: Points, coarse: Points, coarsest: Points) -> tuple[float, float]:
    """Return the largest relative error of the finest law's force, and the observed order, from meshes of cells twice
    as large.

    The order is that of the mean differences where all three hold. Without one, the whole difference is the error;
    observed orders above two are not trusted to last: the error is then that of this order.
    """
    approaches, forces = fine
    by_coarse, by_coarsest = (TabulatedLaw(*points).force(approaches) for points in (coarse, coarsest))  # type: ignore[arg-type]
    near = np.abs(by_coarse - forces) / forces
    far = np.abs(by_coarsest - by_coarse) / forces
    common = approaches >= coarsest[0][0]
    order = log2(float(far[common].mean() / near[common].mean())) if np.count_nonzero(common) > 2 else nan
    gain = 2.0 ** min(max(order, LEAST_ORDER), ORDER) if order == order else 2.0
    return float(near.max()) / (gain - 1.0), order


def continued_to_zero(points: Points, theory: ContactLaw) -> Points:
    """Return the points, and before them a theory's law in series with the spring that leads to the first one."""
    approach, force = points[0][0], points[1][0]
    forces = force * PARTS_BELOW
    softness = (approach - float(theory.approach(np.array(force)))) / force
    return np.append(theory.approach(forces) + softness * forces, points[0]), np.append(forces, points[1])
