"""Meshes of bodies of revolution around the patch that a chain presses: nodes graded in one direction."""

from collections.abc import Callable
from math import ceil

import numpy as np

from structures.fineness import fineness
from structures.structure import Vector

PATCH_DIVISOR = 8.0
"""The default radius of the patch is the shortest of radius, first layer and shear wavelength, divided by this number.
"""

DEFAULT_CELLS = 4
"""Default number of cells across the radius of the patch and in the shortest shear wavelength; twice as many change AR
by less than 0.05 % (docs/numerics.md).
"""

CELL_GROWTH = 1.2
"""The cell size grows by CELL_GROWTH/cells times the distance from the patch."""

PATCH_EDGE_REFINEMENT = 4.0
"""Cells at the edge of the patch, where the pressure drops to zero, are smaller by this factor. With four cells the
compliance of the patch is then 0.03 % off; without the refinement it is 0.2 % off.
"""

EDGE_GROWTH = 2.0
"""Cells grow away from the edge of the patch, and from the corners of bonded layers, by EDGE_GROWTH/cells times the
distance, up to their size elsewhere.
"""

CORNER_REFINEMENT = 16.0
"""Cells at the rim, the interfaces and the base are smaller than radius/cells by this factor: stresses have no bound in
the corners where two materials, or a layer and its base, are bonded (Williams, J. Appl. Mech. 19 (1952) 526). Cells of
radius/cells there make steel on a short layer of PTFE 3.6 % too stiff.
"""

MOST_CELLS = 100_000
"""Upper limit for the whole mesh: about 800 000 degrees of freedom."""


def check_size(cells: float) -> None:
    if not cells <= MOST_CELLS:
        raise ValueError(
            f"patch_radius, highest_frequency, cells: need {cells:.3g} elements or more; at most {MOST_CELLS} fit"
        )


def about_patch(beyond: Vector, patch: float, cells: int) -> Vector:
    """Return the size of cells, m, at a distance beyond the patch's edge (negative inside), m."""
    on_patch = patch / cells + CELL_GROWTH / cells * np.maximum(beyond, 0.0)
    at_edge = patch / cells / PATCH_EDGE_REFINEMENT + EDGE_GROWTH / cells * np.abs(beyond)
    return np.minimum(on_patch, at_edge)


def about_corner(beyond: Vector, radius: float, cells: int) -> Vector:
    """Return the size of cells, m, at a distance from the rim, an interface or the base, m."""
    return radius / cells / CORNER_REFINEMENT + EDGE_GROWTH / cells * np.abs(beyond)


def graded(start: float, end: float, size: Callable[[Vector], Vector]) -> Vector:
    """Nodes from start to end, m, about `size` apart: at equal steps of ∫ dx/size."""
    near = 0.5 * np.geomspace(1e-7, 1.0, 1000)
    fine = start + (end - start) * np.concatenate([[0.0], near, 1.0 - near[-2::-1], [1.0]])
    density = fineness().cells / size(fine)
    passed = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine))])
    check_size(float(passed[-1]))
    nodes: Vector = np.interp(np.linspace(0.0, passed[-1], ceil(passed[-1] * (1.0 - 1e-9)) + 1), passed, fine)
    nodes[0], nodes[-1] = start, end
    return nodes
