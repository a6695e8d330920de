"""Hexahedra, wedges and pyramids as tetrahedra, and quadrilaterals as triangles, so that neighbours fit.

Every quadrilateral is cut by the diagonal through its least corner, and every cell is made of the pyramids from its
least corner over the sides that do not have it (Dompierre and others, Proc. 8th Int. Meshing Roundtable, 1999).
"""

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from structures.structure import Vector

Numbers: TypeAlias = NDArray[np.int64]

Sides = Sequence[Sequence[int]]

TETRAHEDRON: Sides = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
HEXAHEDRON: Sides = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
WEDGE: Sides = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
PYRAMID: Sides = ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))
TRIANGLE: Sides = ((0, 1), (1, 2), (2, 0))
QUADRILATERAL: Sides = ((0, 1), (1, 2), (2, 3), (3, 0))
"""Corners of the sides of a cell in meshio's order, seen from outside in the same sense."""

BY_CORNERS = {4: TETRAHEDRON, 5: PYRAMID, 6: WEDGE, 8: HEXAHEDRON}


def triangles(quadrilaterals: Numbers) -> tuple[Numbers, Numbers]:
    """Return the two triangles of each quadrilateral."""
    even = (quadrilaterals.argmin(axis=1) % 2 == 0)[:, None]
    first = np.where(even, quadrilaterals[:, [0, 1, 2]], quadrilaterals[:, [0, 1, 3]])
    return first, np.where(even, quadrilaterals[:, [0, 2, 3]], quadrilaterals[:, [1, 2, 3]])


def tetrahedra(cells: Numbers) -> tuple[Numbers, Numbers]:
    """Return the tetrahedra of cells with 4, 5, 6 or 8 corners, and the cell of each."""
    least, parts, owner = cells.argmin(axis=1), [], []
    for corner in range(cells.shape[1]):
        rows = np.flatnonzero(least == corner)
        for side in BY_CORNERS[cells.shape[1]]:
            if corner in side:
                continue
            opposite = cells[rows][:, side]
            for base in triangles(opposite) if len(side) == 4 else (opposite,):
                parts.append(np.column_stack([cells[rows, corner], base]))
                owner.append(rows)
    return np.concatenate(parts), np.concatenate(owner)


def edge_lengths(points: Vector, corners: Numbers, sides: Sides = ()) -> Vector:
    """Return the lengths of the edges of cells, m. sides: of flat cells; of others they follow from their corners."""
    of_cell = sides or BY_CORNERS[corners.shape[1]]
    pairs = {tuple(sorted((side[i - 1], side[i]))) for side in of_cell for i in range(len(side))}
    first_ends, last_ends = np.array(sorted(pairs)).T
    return np.asarray(np.linalg.norm(points[corners[:, first_ends]] - points[corners[:, last_ends]], axis=2))
