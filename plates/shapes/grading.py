"""Graded lines: nodes along a side, fine at contacts, coarser away from them, with nodes where they are requested."""

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, log

import numpy as np

from plates.shapes.shape import Cells
from structures.structure import Vector

SAME = 1e-2
"""Lines nearer to each other than this part of the finest cell are merged. Cells of a thousandth of it cost six digits
of the solution, of a hundred-thousandth all."""

ROUNDING = 1e-9
"""Cells by which a count may exceed a whole number without another cell being added."""

SAMPLES = 200
"""Points per cell at which ∫ dx/size is inverted by interpolation."""


def graded(side: float, positions: Sequence[float], cells: Cells, lines: Sequence[float] = ()) -> Vector:
    """Return the ascending nodes from 0 to `side`, m: about the wanted size apart, which grows with the distance from
    the nearest position.

    There is a node at each position, halfway between neighbours, and at the lines, as far as they lie within. Where
    these cut a stretch short, all its cells shrink by the same factor.
    """
    part = _geometric if cells.geometric else _smooth
    nodes = [0.0]
    for start, end in pairwise(stops(side, positions, cells.finest, lines)):
        nodes += [*part(start, end, nearest(positions, start, end), cells)[1:-1], end]
    return np.array(nodes)


def stops(side: float, positions: Sequence[float], finest: float, lines: Sequence[float] = ()) -> list[float]:
    """Return places from 0 to `side`: the positions, the middles between them, and the lines; those that nearly
    coincide merged."""
    middles = [0.5 * (low + high) for low, high in pairwise(sorted(positions))]
    places = np.unique(np.concatenate([[0.0, *positions, *middles, side], np.asarray(lines, dtype=float)]))
    places = places[(places >= 0.0) & (places <= side)]
    places = places[np.append(True, np.diff(places) > SAME * finest)]
    # The last stop may have been merged with its neighbour; it is the side's end all the same.
    places[-1] = side
    return [float(place) for place in places]


def nearest(positions: Sequence[float], left: float, right: float) -> float:
    """Return the position that is nearest to a stretch between two stops; its start where there is none."""
    return min(positions, key=lambda position: abs(left + right - 2.0 * position), default=left)


def _geometric(start: float, end: float, position: float, cells: Cells) -> Vector:
    """Nodes from start to end; each cell is 1 + growth times its neighbour nearer to the position, up to the coarsest.

    All cells shrink by the same share of a cell, so that a whole number of them fits.
    """
    direction = 1.0 if start + end >= 2.0 * position else -1.0
    near, far = sorted((max(0.0, direction * (start - position)), max(0.0, direction * (end - position))))
    first, last = _count(near, cells), _count(far, cells)
    number = max(1, ceil(last - first - ROUNDING))
    between = _distance(np.linspace(first, last, number + 1)[1:-1], cells)
    return np.array([start, *np.sort(position + direction * between), end])


def _count(distance: float, cells: Cells) -> float:
    """Return how many cells, parts of them included, lie within a distance of the position."""
    ratio = 1.0 + cells.growth
    growing, reach = _growing(cells)
    if distance <= reach:
        return log(1.0 + distance * (ratio - 1.0) / cells.finest) / log(ratio)
    return growing + (distance - reach) / cells.coarsest


def _distance(count: Vector, cells: Cells) -> Vector:
    """Return the distance within which `count` cells lie."""
    ratio = 1.0 + cells.growth
    growing, reach = _growing(cells)
    near = cells.finest * (ratio ** np.minimum(count, growing) - 1.0) / (ratio - 1.0)
    return np.asarray(np.where(count <= growing, near, reach + (count - growing) * cells.coarsest))


def _growing(cells: Cells) -> tuple[float, float]:
    """Return how many cells grow before they are the coarsest, and how far these reach."""
    ratio = 1.0 + cells.growth
    growing = log(cells.coarsest / cells.finest) / log(ratio)
    return growing, (cells.coarsest - cells.finest) / (ratio - 1.0)


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
