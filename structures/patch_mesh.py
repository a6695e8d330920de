"""Meshes of bodies of revolution around the patch that a chain presses: nodes graded in one direction."""

from collections.abc import Callable
from math import ceil

import numpy as np

from structures.structure import Vector

PATCH_DIVISOR = 8.0
"""The default radius of the patch is the shortest of radius, first layer and shear wavelength, divided by this number.
"""

DEFAULT_CELLS = 4
"""Default number of cells across the radius of the patch and in the shortest shear wavelength; twice as many change AR
by 0.1 %.
"""

CELL_GROWTH = 1.2
"""The cell size grows by CELL_GROWTH/cells times the distance from the patch, the interfaces and the base."""

PATCH_EDGE_REFINEMENT = 4.0
"""Cells at the edge of the patch, where the pressure drops to zero, are smaller by this factor. With four cells the
compliance of the patch is then 0.03 % off; without the refinement it is 0.2 % off.
"""

PATCH_EDGE_GROWTH = 2.0
"""Cells grow away from the edge of the patch by PATCH_EDGE_GROWTH/cells times the distance from it, up to their size
elsewhere.
"""

MOST_CELLS = 100_000
"""Upper limit for the whole mesh: about 800 000 degrees of freedom."""


def check_size(cells: float) -> None:
    if not cells <= MOST_CELLS:
        raise ValueError(
            f"patch_radius, highest_frequency, cells: need {cells:.3g} elements or more; at most {MOST_CELLS} fit"
        )


def about_patch(beyond: Vector, patch: float, cells: int) -> Vector:
    """Size of cells, m, at a distance beyond the patch's edge (negative inside), m."""
    on_patch = patch / cells + CELL_GROWTH / cells * np.maximum(beyond, 0.0)
    at_edge = patch / cells / PATCH_EDGE_REFINEMENT + PATCH_EDGE_GROWTH / cells * np.abs(beyond)
    return np.minimum(on_patch, at_edge)


def graded(start: float, end: float, size: Callable[[Vector], Vector]) -> Vector:
    """Nodes from start to end, m, about `size` apart: at equal steps of ∫ dx/size."""
    near = 0.5 * np.geomspace(1e-7, 1.0, 1000)
    fine = start + (end - start) * np.concatenate([[0.0], near, 1.0 - near[-2::-1], [1.0]])
    density = 1.0 / size(fine)
    passed = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine))])
    check_size(float(passed[-1]))
    nodes: Vector = np.interp(np.linspace(0.0, passed[-1], ceil(passed[-1] * (1.0 - 1e-9)) + 1), passed, fine)
    nodes[0], nodes[-1] = start, end
    return nodes
