"""The products of an element on a mesh: matrices, contact vectors, and the fields of displacement and stress.

The struck face is on top. A pushed plate moves down, so the displacement along z is −w. The stress is that of bending
at the struck face of a homogeneous wall, 6 M/t² at z = t/2; at the lower face it has the opposite sign. Fields are
evaluated at the points of quadratic cells.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy import sparse

from plates.section import Section
from structures.field import Grid, Sampler
from structures.meshes.mesh_reading import Numbers
from structures.structure import Vector

Matrix: TypeAlias = sparse.csr_array
# The reference triangle as three quadrilaterals.
THREE_QUADS = np.array([
    [[0, 0], [1 / 2, 0], [1 / 3, 1 / 3], [0, 1 / 2]],
    [[1, 0], [1 / 2, 1 / 2], [1 / 3, 1 / 3], [1 / 2, 0]],
    [[0, 1], [0, 1 / 2], [1 / 3, 1 / 3], [1 / 2, 1 / 2]],
])  # fmt: skip
# The reference square as four quadrilaterals.
FOUR_QUADS = np.array([
    [[x, y], [x + 0.5, y], [x + 0.5, y + 0.5], [x, y + 0.5]] for x in (0.0, 0.5) for y in (0.0, 0.5)
])  # fmt: skip
# Points of a quadratic quadrilateral, in VTK's order.
NINE = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0], [1, 0.5], [0.5, 1], [0, 0.5], [0.5, 0.5]])
SAME = 1e-7  # Points that are closer than this fraction of the plate's size are merged


class Touch(NamedTuple):
    """One contact: place (x, y), m; lines of symmetry through it, as unit normals into the mesh; the struck wall."""

    place: Vector
    mirrors: Sequence[Vector]
    wall: Section


@dataclass(frozen=True, eq=False)
class Assembled:
    """A plate on a mesh, in the n degrees of freedom that the supports leave free.

    mass, stiffness: n × n. contact: a function of a Touch that returns n numbers, which spread a unit force there and
    read the displacement, and the part of the indentation that neither the plate nor Hertz's law contains, m/N.
    sampler: a function of the stiffness of the whole plate that returns the sampler of fields.
    """

    mass: Matrix
    stiffness: Matrix
    contact: Callable[[Touch], tuple[Vector, float]]
    sampler: Callable[[Matrix], Sampler]


@dataclass(frozen=True, eq=False)
class PlateSampler:
    """The sampler of a plate. points: p × 2, m. cells: quad9. deflection: p × n. curvature: 3 p × n, by point."""

    points: Vector
    cells: Numbers
    deflection: Matrix
    curvature: Matrix
    section: Section
    stiffness: Matrix

    @property
    def grid(self) -> Grid:
        """The points and cells, in the plane z = 0."""
        flat = np.column_stack([self.points, np.zeros(len(self.points))])
        return Grid(flat, self.cells, "quad9", np.zeros(len(self.cells), dtype=np.int64), False)

    def displacement(self, u: Vector) -> Vector:
        """Return the displacement, p × 3, m."""
        sinking = self.deflection @ u
        return np.column_stack([np.zeros((sinking.size, 2)), -sinking])

    def stress(self, u: Vector) -> Vector:
        """Return the stress at the struck face, p × 6, Pa."""
        moments = (self.curvature @ u).reshape(-1, 3) @ self.section.bending.T
        face = np.zeros((len(moments), 6))
        face[:, [0, 1, 3]] = 6.0 / self.section.thickness**2 * moments
        return face

    def stiffness_parts(self) -> list[Matrix]:
        """Return the stiffness of the only part, the wall."""
        return [self.stiffness]


def mesh_sampler(mesh: Any, space: Any, motions: Matrix, section: Section, stiffness: Matrix) -> PlateSampler:
    """Return the sampler of a plate on a mesh. motions: from the free to all degrees of freedom."""
    triangles = mesh.t.shape[0] == 3
    quads = THREE_QUADS if triangles else FOUR_QUADS
    (x, y), (corners_x, corners_y) = NINE.T, quads.transpose(2, 1, 0)
    shares = np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y])
    nine = np.stack([shares.T @ corners_x, shares.T @ corners_y], axis=-1).swapaxes(0, 1)
    places, local = np.unique(np.round(nine.reshape(-1, 2), 12), axis=0, return_inverse=True)

    x, y = places.T
    shares = np.stack([1.0 - x - y, x, y] if triangles else [(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y])
    points = np.einsum("jic,iq->cqj", mesh.p[:, mesh.t], shares).reshape(-1, 2)
    scale = SAME * np.ptp(points, axis=0).max()
    # The offset keeps the limits of the lattice away from round numbers, where many points lie.
    _, first, number = np.unique(np.floor(points / scale + 0.12345), axis=0, return_index=True, return_inverse=True)
    number = number.ravel()
    cells = number.reshape(mesh.nelements, -1)[:, local.reshape(len(quads), 9)].reshape(-1, 9)

    # All cells become anticlockwise.
    at = points[first][cells[:, [0, 1, 3]]]
    one, other = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
    inverted = one[:, 0] * other[:, 1] < one[:, 1] * other[:, 0]
    cells = np.where(inverted[:, None], cells[:, [0, 3, 2, 1, 7, 6, 5, 4, 8]], cells)

    deflection, curvature = space.sampled(places.T)
    mean = sparse.csr_array((1.0 / np.bincount(number)[number], (number, np.arange(number.size))))
    spread = sparse.kron(mean, sparse.eye_array(3), format="csr")
    return PlateSampler(
        points[first], cells, deflection[first] @ motions, spread @ curvature @ motions, section, stiffness
    )
