"""Cylinders crossed at so small an angle that their Hertzian contact would be longer than the cylinders themselves."""

from math import pi, sqrt

import numpy as np
from scipy.optimize import brentq

import hertzlink as hl
from hertzlink.studies import cylinders
from particles.laws.computed import ComputedLaw, continued_to_zero
from particles.laws.half_spaces import influence, unilateral_pressures
from structures.surface import relative_curvatures

APPROACH_STEPS = 24  # Number of approaches at which the force is computed, in equal ratios.
SMALLEST_APPROACH = 0.2e-6  # The first of them, m.
CELLS = 64  # Number of cells along each side of the grid.
ANGLE_RANGE = (2.0, 20.0)  # Degrees; between these angles the ends begin to matter at approaches of 2 to 100 µm.
# Half of the grid's side across the cylinders, over the half-width of the overlap of undeformed cylinders; for a
# circular contact the ratio is 0.71.
GRID_HALF_WIDTH = 0.78


def cut_law(angle: float, approach: float, cells: int) -> ComputedLaw:
    """Return the law at an angle, degrees, up to an approach, m, for reference points at infinity.

    Boundary elements, as in `laws.computed_law`: two half-spaces, which touch only in the area that both cylinders
    cover. At such small angles their ends face each other. The ends are therefore less compliant than free ends, and
    the approach of the mid-planes would be smaller. error: estimated with half as many cells along each side.
    """
    steps = np.geomspace(SMALLEST_APPROACH, approach, APPROACH_STEPS)
    fine, coarse = (np.array([_force(angle, step, count) for step in steps]) for count in (cells, cells // 2))
    error = float(np.abs(coarse / fine - 1.0).max())
    points = continued_to_zero((steps, fine), _theory(angle))
    return ComputedLaw(*points, "boundary elements, cut at the ends", "", approach, SMALLEST_APPROACH, error)  # type: ignore[arg-type]


def loss_at_ends(angle: float, approach: float, cells: int = CELLS) -> float:
    """Return the part of Hertz's force that cylinders at an angle, degrees, lose at an approach, m, as they end."""
    return 1.0 - _force(angle, approach, cells) / float(_theory(angle).force(np.array(approach)))


def approach_of_ends(angle: float, loss: float = 0.01) -> float:
    """Return approach, m, up to which cylinders at an angle, degrees, lose less than this fraction of Hertz's force."""
    flat = relative_curvatures(cylinders.cylinder(0.0).surface, cylinders.cylinder(angle).surface)[0]
    # At this approach the overlap of undeformed cylinders reaches their ends; the contact itself is shorter.
    overlap = 0.5 * flat * (0.5 * cylinders.LENGTH) ** 2
    return float(brentq(lambda part: loss_at_ends(angle, part * overlap) - loss, 0.5, 4.0, xtol=1e-3) * overlap)


def angle_of_ends(approach: float, loss: float = 0.01) -> float:
    """Return angle, degrees, above which cylinders lose less than this fraction of Hertz's force at an approach, m."""
    return float(brentq(lambda angle: loss_at_ends(angle, approach) - loss, *ANGLE_RANGE, xtol=1e-2))


def _theory(angle: float) -> hl.ContactLaw:
    """Return Hertz's law of the thesis's cylinders at an angle, degrees."""
    return cylinders.Tacit()(cylinders.cylinder(0.0), cylinders.cylinder(angle))


def _force(angle: float, approach: float, cells: int) -> float:
    """Return the force, N, at an approach, m. The grid follows the cylinders to their ends, or out of the contact."""
    flat, sharp = relative_curvatures(cylinders.cylinder(0.0).surface, cylinders.cylinder(angle).surface)
    modulus, longest = 0.5 * cylinders.cylinder(0.0).material.contact_modulus, 0.5 * cylinders.LENGTH
    extent = longest if flat * longest**2 < 2.0 * approach else sqrt(2.0 * approach / flat)
    numbers = (2.0 * np.arange(cells) + 1.0) / cells - 1.0
    along, across = extent * numbers, GRID_HALF_WIDTH * sqrt(2.0 * approach / sharp) * numbers
    sides = along[1] - along[0], across[1] - across[0]
    gap = 0.5 * (flat * along[:, None] ** 2 + sharp * across**2)
    begin = np.full(gap.shape, 0.5 * modulus * sharp * across[-1])
    pressures = unilateral_pressures(influence(cells, *sides) / (pi * modulus), gap, approach, begin)
    return float(pressures.sum() * sides[0] * sides[1])
