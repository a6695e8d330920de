"""Graded lines: nodes along a side, fine at contacts, coarser away from them, with nodes where they are asked for."""

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, log

import numpy as np

from structures.structure import Vector

GROWTH = 1.3
"""Size of a cell over that of its neighbour nearer to the contact."""

NONE = np.zeros(0)

SAME = 1e-2
"""Lines nearer to each other than this part of the finest cell are one. Cells of a thousandth of it cost six digits of
the solution, of a hundred-thousandth all."""


def graded(side: float, positions: Sequence[float], finest: float, coarsest: float, lines: Vector = NONE) -> Vector:
    """Ascending nodes from 0 to `side`: one at each position, with cells of `finest` beside it and `coarsest` far away.

    Each cell is 1.3 times its neighbour nearer to the position until it is `coarsest`; where a side, a line, or the
    middle between two positions cuts the last one off, all in the stretch shrink alike. lines: further places that get
    a node, as far as they lie within.
    """
    nodes = [0.0]
    for left, right in pairwise(stops(side, positions, finest, lines)):
        position = nearest(positions, left, right)
        direction = 1.0 if left + right >= 2.0 * position else -1.0
        near, far = sorted((max(0.0, direction * (left - position)), max(0.0, direction * (right - position))))
        first, last = _count(near, finest, coarsest), _count(far, finest, coarsest)
        cells = max(1, ceil(last - first - 1e-9))
        between = _distance(np.linspace(first, last, cells + 1)[1:-1], finest, coarsest)
        nodes += [*np.sort(position + direction * between), right]
    return np.array(nodes)


def stops(side: float, positions: Sequence[float], finest: float, lines: Vector = NONE) -> list[float]:
    """From 0 to `side`, the positions, the middles between them, and the lines; one of those that are one."""
    middles = [0.5 * (one + other) for one, other in pairwise(sorted(positions))]
    places = np.unique(np.concatenate([[0.0, *positions, *middles, side], lines]))
    places = places[(places >= 0.0) & (places <= side)]
    places = places[np.append(True, np.diff(places) > SAME * finest)]
    # The last stop may have been one with its neighbour; it is the side's end all the same.
    places[-1] = side
    return [float(place) for place in places]


def nearest(positions: Sequence[float], left: float, right: float) -> float:
    """The position that is nearest to a stretch between two stops."""
    return min(positions, key=lambda position: abs(left + right - 2.0 * position))


def _count(distance: float, finest: float, coarsest: float) -> float:
    """How many cells, parts of them included, lie within a distance of the position."""
    growing, reach = _growing(finest, coarsest)
    if distance <= reach:
        return log(1.0 + distance * (GROWTH - 1.0) / finest) / log(GROWTH)
    return growing + (distance - reach) / coarsest


def _distance(count: Vector, finest: float, coarsest: float) -> Vector:
    """The distance within which so many cells lie."""
    growing, reach = _growing(finest, coarsest)
    near = finest * (GROWTH ** np.minimum(count, growing) - 1.0) / (GROWTH - 1.0)
    return np.asarray(np.where(count <= growing, near, reach + (count - growing) * coarsest))


def _growing(finest: float, coarsest: float) -> tuple[float, float]:
    """How many cells grow before they are the coarsest, and how far these reach."""
    growing = log(coarsest / finest) / log(GROWTH)
    return growing, (coarsest - finest) / (GROWTH - 1.0)
