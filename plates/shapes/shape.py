"""Common parts of shapes of plates: a mesh with named edges, sizes of cells, and graded lines of nodes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, log
from typing import Any, NamedTuple

import numpy as np

from structures.fineness import fineness
from structures.meshes.mesh_reading import Groups
from structures.structure import Vector

MIRROR = "middle"  # Name of the edges beyond which the plate is the mirror image of the mesh


class PlateMesh(NamedTuple):
    """A scikit-fem mesh in m, and the facets of its edges by name."""

    mesh: Any
    edges: Groups


@dataclass(frozen=True)
class Cells:
    """The properties of a mesh that a plate requires.

    finest, coarsest: sizes of cells at the contacts and far away, m. growth: increase of the size per distance from the
    contacts. geometric: each cell is exactly 1 + growth times its neighbour nearer to the contact (for beams). lines:
    places along x and along y, m, where cells should end. halved: whether the left and right halves, and the bottom and
    top halves, of a rectangle are equal, so that one of them is meshed. Shapes without rows of cells ignore the last
    three.
    """

    finest: float
    growth: float
    coarsest: float
    geometric: bool = False
    lines: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    halved: tuple[bool, bool] = (False, False)

    def finer(self) -> "Cells":
        """Return cells that are smaller by the fineness of the context, all by the same factor."""
        parts = fineness().cells
        growth = (1.0 + self.growth) ** (1.0 / parts) - 1.0 if self.geometric else self.growth / parts
        return replace(self, finest=self.finest / parts, growth=growth, coarsest=self.coarsest / parts)


# Lines that are closer than this fraction of the finest cell are merged. Cells of a thousandth of its size cost six
# digits of the solution, cells of a hundred-thousandth all digits.
SAME = 1e-2
ROUNDING = 1e-9  # A count of cells may exceed a whole number by this without another cell
SAMPLES = 200  # Points per cell for the inversion of ∫ dx/size by interpolation


def graded(side: float, positions: Sequence[float], cells: Cells, lines: Sequence[float] = ()) -> Vector:
    """Return ascending nodes from 0 to `side`, m, with sizes that grow with the distance from the nearest position.

    There are nodes at the positions, halfway between neighbouring positions, and at the lines, if these lie within. All
    cells between two of them shrink by the same factor, so that a whole number of cells fits.
    """
    middles = [0.5 * (low + high) for low, high in pairwise(sorted(positions))]
    stops = np.unique(np.concatenate([[0.0, *positions, *middles, side], np.asarray(lines, dtype=float)]))
    stops = stops[(stops >= 0.0) & (stops <= side)]
    stops = stops[np.append(True, np.diff(stops) > SAME * cells.finest)]
    stops[-1] = side  # it may have been merged with its neighbour

    part = _geometric if cells.geometric else _smooth
    nodes = [0.0]
    for start, end in pairwise(stops.tolist()):
        position = min(positions, key=lambda place: abs(start + end - 2.0 * place), default=start)
        nodes += [*part(start, end, position, cells)[1:-1], end]
    return np.array(nodes)


def _geometric(start: float, end: float, position: float, cells: Cells) -> Vector:
    """Return nodes from start to end; a cell is 1 + growth times its neighbour nearer to the position, up to coarsest.

    All cells shrink by the same share of a cell, so that a whole number of cells fits.
    """
    direction = 1.0 if start + end >= 2.0 * position else -1.0
    near, far = sorted((max(0.0, direction * (start - position)), max(0.0, direction * (end - position))))
    # The number of cells that grow before they are the coarsest, and their extent.
    ratio, finest, coarsest = 1.0 + cells.growth, cells.finest, cells.coarsest
    growing, reach = log(coarsest / finest) / log(ratio), (coarsest - finest) / cells.growth

    def count(distance: float) -> float:
        """Return the number of cells, including fractions, within a distance of the position."""
        if distance <= reach:
            return log(1.0 + distance * cells.growth / finest) / log(ratio)
        return growing + (distance - reach) / coarsest

    first, last = count(near), count(far)
    number = np.linspace(first, last, max(1, ceil(last - first - ROUNDING)) + 1)[1:-1]
    inner = finest * (ratio ** np.minimum(number, growing) - 1.0) / cells.growth
    between = np.where(number <= growing, inner, reach + (number - growing) * coarsest)
    return np.array([start, *np.sort(position + direction * between), end])


def _smooth(start: float, end: float, position: float, cells: Cells) -> Vector:
    """Return nodes at equal steps of ∫ dx/size, with size = finest + growth · distance, up to coarsest."""
    near, far = sorted((abs(start - position), abs(end - position)))

    def passed(distance: Vector) -> Vector:
        """Return ∫ dx/size from the position to a distance."""
        finest, coarsest, growth = cells.finest, cells.coarsest, cells.growth
        growing = min((coarsest - finest) / growth, far) if coarsest > finest else 0.0
        inner = np.log1p(np.minimum(distance, growing) * growth / finest) / growth
        return np.asarray(inner + np.maximum(distance - growing, 0.0) / max(coarsest, finest))

    count = max(ceil(float(passed(np.array(far)) - passed(np.array(near))) * (1.0 - ROUNDING)), 1)
    fine = np.linspace(near, far, SAMPLES * count + 1)
    steps = passed(fine)
    distance = np.interp(np.linspace(steps[0], steps[-1], count + 1), steps, fine)
    nodes = position + distance if start + end >= 2.0 * position else position - distance[::-1]
    nodes[0], nodes[-1] = start, end
    return np.asarray(nodes)
