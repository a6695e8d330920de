"""The gain of a force's own displacement between the nodes of a mesh of Bogner–Fox–Schmit elements.

A mesh lacks c·h²/D of the displacement of a point force under itself; c depends on the place in the cell (0.0021 at a
node of square cells, 0.0058 in the middle). Between the nodes of equal cells this would make results ripple with the
position. On an infinite plate the displacement is the same everywhere, so its difference from that at a node is the
mesh's error.
"""

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from plates.elements.hermite import Beam, plate_matrices
from plates.section import Section
from structures.linear_algebra.factor import factorise
from structures.structure import Vector

REACH = 14
"""Cells of the patch on each side of the loaded cell."""

DECAY = 3.0
"""Length over which the patch's displacement decays, in cells: it does not feel the edges, and the cells resolve it."""


@dataclass(frozen=True, eq=False)
class SelfDisplacement:
    """The displacement that is missing in one of equal cells, compared with its corner.

    x, y: least and greatest coordinates of the cell, m; compliance: of its 16 degrees of freedom, m/N.
    """

    x: Vector
    y: Vector
    compliance: Vector

    def missing(self, x: float, y: float) -> float:
        """Return what is missing, m/N, at a place in any of the cells, which repeat in x and y from this one."""
        place = [
            ends[0] + (coordinate - ends[0]) % (ends[1] - ends[0]) for coordinate, ends in ((x, self.x), (y, self.y))
        ]
        return self._own(self.x[0], self.y[0]) - self._own(*place)

    def _own(self, x: float, y: float) -> float:
        values = np.outer(Beam(self.x, "free", "free").at(x), Beam(self.y, "free", "free").at(y)).ravel()
        return float(values @ self.compliance @ values)


def self_displacement(section: Section, x: Vector, y: Vector) -> SelfDisplacement:
    """Return it from a patch of nodes x and y, m, equally far apart around the middle cell, which is the loaded one.

    The patch has inertia forces at a real Laplace frequency, so that its displacement decays before its edges.
    """
    beam_x, beam_y = (Beam(nodes, "free", "free") for nodes in (x, y))
    mass, stiffness = plate_matrices(beam_x, beam_y, section)
    cells = [(nodes.size - 1) // 2 for nodes in (x, y)]
    own_x, own_y = (nodes[cell : cell + 2] for nodes, cell in zip((x, y), cells, strict=True))
    length = DECAY * max(np.diff(own_x)[0], np.diff(own_y)[0])
    shifted = stiffness + section.bending[0, 0] / (length**4 * section.mass) * mass
    along, across = (np.arange(2 * cell, 2 * cell + 4) for cell in cells)
    loaded = (along[:, None] * beam_y.size + across).ravel()
    loads = sparse.csc_array((np.ones(16), (loaded, np.arange(16))), shape=(mass.shape[0], 16)).toarray()
    return SelfDisplacement(own_x, own_y, factorise(shifted)(loads)[loaded])


def patch(nodes: Vector, low: float, high: float) -> Vector:
    """Return the nodes of a patch along one axis: equal cells as in the range from low to high, or the mesh around one
    place.

    The middle cell begins at the place, or at low.
    """
    if high > low:
        first = int(np.argmin(abs(nodes - low)))
        cell = nodes[first + 1] - nodes[first]
        return np.asarray(low + cell * np.arange(-REACH, REACH + 2))
    near = nodes - low
    finest = np.diff(nodes).min()
    below, above = (np.sort(abs(near[side])) for side in (near < -0.5 * finest, near > 0.5 * finest))
    # A mesh that ends at the place continues as its mirror image; one that ends nearby, with cells of its last size.
    if above.size == 0 or below.size == 0:
        above = below = above if below.size == 0 else below
    sides = [_extended(side) for side in (below, above)]
    return np.concatenate([low - sides[0][REACH - 1 :: -1], [low], low + sides[1][: REACH + 1]])


def _extended(distances: Vector) -> Vector:
    """Return the ascending distances of nodes; where they are too few, the last cell is repeated."""
    last = np.diff(np.concatenate([[0.0], distances]))[-1]
    return np.concatenate([distances, distances[-1] + last * np.arange(1, REACH + 2)])
