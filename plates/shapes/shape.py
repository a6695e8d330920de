"""What shapes of plates share: a mesh with named edges, the sizes of its cells, and graded lines of nodes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, log
from typing import Any, NamedTuple

import numpy as np

from structures.fineness import fineness
from structures.meshes.mesh_reading import Groups
from structures.structure import Vector

MIRROR = "middle"  # Name of the edges where a mesh ends because the other half of the plate is its mirror image


class PlateMesh(NamedTuple):
    """A mesh of scikit-fem in m, and the facets of its edges by name."""

    mesh: Any
    edges: Groups


@dataclass(frozen=True)
class Cells:
    """The properties of a mesh that a plate asks for.

    finest, coarsest: sizes of cells at the contacts and far away, m. growth: increase of the size per distance from the
    contacts. geometric: each cell is exactly 1 + growth times its neighbour nearer to the contact (nodes of beams).
    lines: places along x and along y, m, where cells should end. halved: whether the left and right half, and the
    bottom and top half, of a rectangle are equal, so that one of them may be meshed. Shapes without rows of cells
    ignore the last three.
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


# Lines nearer to each other than this part of the finest cell are merged. Cells of a thousandth of it cost six digits
# of the solution, of a hundred-thousandth all.
SAME = 1e-2
ROUNDING = 1e-9  # Cells by which a count may exceed a whole number without another cell being added
SAMPLES = 200  # Points per cell at which ∫ dx/size is inverted by interpolation


def graded(side: float, positions: Sequence[float], cells: Cells, lines: Sequence[float] = ()) -> Vector:
    """Return the ascending nodes from 0 to `side`, m: about the wanted size apart, which grows with the distance from
    the nearest position.

    There is a node at each position, halfway between neighbours, and at the lines, as far as they lie within. Where
    these cut a stretch short, all its cells shrink by the same factor.
    """
    middles = [0.5 * (low + high) for low, high in pairwise(sorted(positions))]
    stops = np.unique(np.concatenate([[0.0, *positions, *middles, side], np.asarray(lines, dtype=float)]))
    stops = stops[(stops >= 0.0) & (stops <= side)]
    stops = stops[np.append(True, np.diff(stops) > SAME * cells.finest)]
    stops[-1] = side  # perhaps merged with its neighbour

    part = _geometric if cells.geometric else _smooth
    nodes = [0.0]
    for start, end in pairwise(stops.tolist()):
        position = min(positions, key=lambda place: abs(start + end - 2.0 * place), default=start)
        nodes += [*part(start, end, position, cells)[1:-1], end]
    return np.array(nodes)


def _geometric(start: float, end: float, position: float, cells: Cells) -> Vector:
    """Nodes from start to end; each cell is 1 + growth times its neighbour nearer to the position, up to the coarsest.

    All cells shrink by the same share of a cell, so that a whole number of them fits.
    """
    direction = 1.0 if start + end >= 2.0 * position else -1.0
    near, far = sorted((max(0.0, direction * (start - position)), max(0.0, direction * (end - position))))
    # Cells that grow before they are the coarsest, and how far these reach.
    ratio, finest, coarsest = 1.0 + cells.growth, cells.finest, cells.coarsest
    growing, reach = log(coarsest / finest) / log(ratio), (coarsest - finest) / cells.growth

    def count(distance: float) -> float:
        """Return how many cells, parts of them included, lie within a distance of the position."""
        if distance <= reach:
            return log(1.0 + distance * cells.growth / finest) / log(ratio)
        return growing + (distance - reach) / coarsest

    first, last = count(near), count(far)
    number = np.linspace(first, last, max(1, ceil(last - first - ROUNDING)) + 1)[1:-1]
    inner = finest * (ratio ** np.minimum(number, growing) - 1.0) / cells.growth
    between = np.where(number <= growing, inner, reach + (number - growing) * coarsest)
    return np.array([start, *np.sort(position + direction * between), end])


def _smooth(start: float, end: float, position: float, cells: Cells) -> Vector:
    """Nodes from start to end at equal steps of ∫ dx/size, where size = finest + growth · distance, up to coarsest."""
    near, far = sorted((abs(start - position), abs(end - position)))

    def passed(distance: Vector) -> Vector:
        """Return ∫ dx/size from the position on."""
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
