"""Scalar functions of order 4 on a flat mesh of triangles or quadrilaterals, for Mindlin's deflection and rotations.

Triangles have Lagrange polynomials, quadrilaterals products of integrated Legendre polynomials.

A plate with w = 0 on the sides of a polygon does not converge to a plate with w = 0 on a curved edge. With any number
of sides, a thin plate's slope vanishes at its corners, as if the edge were clamped (Babuška's paradox).
Therefore sides that meet at a small angle are treated as chords of a curve through their ends, and w = 0 holds on the
curve.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from skfem import Basis, ElementQuadP, ElementTriP4
from skfem.assembly import Dofs
from skfem.element import DiscreteField

from plates.shapes.mesh_geometry import QUARTER_TURN, find_cells, tangents
from structures.meshes.mesh_reading import Numbers
from structures.structure import Vector

DEGREE = 4  # Degree of the polynomials. With 4 there is no locking down to a thickness of 0.0025 of the side
SMOOTH = 30.0  # Degrees. Sides of an edge that meet at a smaller angle form a curve, as in polygons of 13 sides or more
STRAIGHT = 1e-6  # Rad. Facets that meet at a smaller angle, which is due to rounding, form one side
# Corners of the reference square's sides, in the direction in which its functions run.
SQUARE_SIDES = ((0, 1), (1, 2), (3, 2), (0, 3))


class OrientedQuad(ElementQuadP):  # type: ignore[misc]
    """ElementQuadP for any mesh of quadrilaterals.

    Functions of odd degree on a side change sign with its direction. Here each side runs from its corner with the lower
    number to the other one, so that the functions of neighbours agree.
    """

    def gbasis(self, mapping: Any, X: Any, i: int, tind: Any = None) -> Any:
        """Return a function and its slopes; scikit-fem calls this method."""
        (field,) = super().gbasis(mapping, X, i, tind)
        side, number = divmod(i - 4, self.p - 1)
        if 0 <= side < 4 and number % 2 == 1:
            start, end = mapping.mesh.t[list(SQUARE_SIDES[side])]
            sign = np.where(start > end, -1.0, 1.0)[slice(None) if tind is None else tind][:, None]
            field = DiscreteField(np.asarray(field) * sign, field.grad * sign)
        return (field,)


class Reading(NamedTuple):
    """Matrices, points × functions, that evaluate a deflection and its slopes at points."""

    value: sparse.csr_array
    slope_x: sparse.csr_array
    slope_y: sparse.csr_array


class Curve(NamedTuple):
    """The curve at points of facets, facets × points: its distance beyond the facet, m, and its unit tangents and
    outward unit normals, … × 2."""

    beyond: Vector
    along: Vector
    outward: Vector


class Functions:
    """The functions on a mesh. of_cells: their numbers, cells × functions of a cell."""

    def __init__(self, mesh: Any) -> None:
        self.mesh, self.mapping = mesh, mesh.mapping()
        self.triangles = mesh.t.shape[0] == 3
        self.element = ElementTriP4() if self.triangles else OrientedQuad(DEGREE)
        self._dofs = Dofs(mesh, self.element)
        self.size, self.of_cells = int(self._dofs.N), np.asarray(self._dofs.element_dofs.T, dtype=np.int64)
        code = self.of_cells[:, :, None] * self.size + self.of_cells[:, None, :]
        pairs, slot = np.unique(code, return_inverse=True)
        self._rows, self._columns = np.divmod(pairs, self.size)
        self._slot = slot.ravel()

    def inside(self) -> tuple[Vector, Vector, Vector, Vector]:
        """Return values and slopes, cells × functions × points, weights of integrals over the plate, and points, m."""
        basis = Basis(self.mesh, self.element, self.mapping, 2 * DEGREE, disable_doflocs=True)
        fields = [field for (field,) in basis.basis]
        values = np.stack([np.asarray(field) for field in fields], axis=1)
        slopes = np.stack([field.grad for field in fields], axis=2)
        return values, slopes, basis.dx, np.asarray(basis.global_coordinates())

    def integral(self, weight: Vector, left: Vector, right: Vector) -> Vector:
        """Return the entries of ∫ left · right between functions that share a cell."""
        blocks = (weight[:, None] * left) @ right.swapaxes(1, 2)
        return np.bincount(self._slot, blocks.ravel(), self._rows.size).astype(float)

    def matrix(self, terms: list[tuple[Vector, Vector]]) -> sparse.csr_array:
        """Return Σ A ⊗ B, where the entries of an integral give A, and B is a small dense matrix."""
        entries, small = (np.array(parts) for parts in zip(*terms, strict=True))
        starts = np.searchsorted(self._rows, np.arange(self.size + 1))
        data = np.tensordot(entries.T, small, 1)
        matrix = sparse.bsr_array((data, self._columns, starts)).tocsr()
        matrix.eliminate_zeros()
        return sparse.csr_array(matrix)

    def at(self, points: Vector, cells: Numbers | None = None) -> Reading:
        """Evaluate functions at points, p × 2; a point outside raises a ValueError. cells: of the points, if known."""
        if cells is None:
            cells = find_cells(self.mesh, points)
        places = np.full((2, len(points), 1), 1.0 / 3.0 if self.triangles else 0.5)
        # Newton's method, because the map of a quadrilateral is bilinear. For a triangle one step suffices.
        for _ in range(20):
            away = points.T[:, :, None] - self.mapping.F(places, cells)
            step = np.einsum("ijpq,jpq->ipq", self.mapping.invDF(places, cells), away)
            places = places + step
            if np.abs(step).max() < 1e-12:
                break
        return self.reading(places, cells)

    def reading(self, places: Vector, cells: Numbers) -> Reading:
        """Evaluate functions at places of the reference cell, 2 × places for all cells or 2 × cells × 1."""
        fields = [self.element.gbasis(self.mapping, places, i, cells)[0] for i in range(self.of_cells.shape[1])]
        values = np.stack([np.asarray(field) for field in fields], axis=-1)
        slopes = np.stack([field.grad for field in fields], axis=-1)
        columns = np.broadcast_to(self.of_cells[cells][:, None], values.shape).reshape(-1, values.shape[-1])
        starts, shape = np.arange(len(columns) + 1) * columns.shape[1], (len(columns), self.size)
        return Reading(*(
            sparse.csr_array((entries.ravel(), columns.ravel(), starts), shape) for entries in (values, *slopes)
        ))  # fmt: skip

    def on(self, facets: Numbers) -> tuple[Numbers, Curve]:
        """Return the functions that do not vanish on facets, functions × facets, and the edge's curve there.

        The functions of a side of quadrilaterals do not belong to a point; for them the curve is the side itself.
        """
        numbers = np.concatenate([
            self._dofs.nodal_dofs[0][self.mesh.facets[:, facets]], self._dofs.facet_dofs[:, facets],
        ])  # fmt: skip
        parts = np.append([0.0, 1.0], np.arange(1, DEGREE) / DEGREE)
        bent = (parts == np.round(parts)) | self.triangles
        return numbers, Curve(*(values.swapaxes(0, 1) for values in curve(self.mesh, facets, parts, bent)))


def curve(mesh: Any, facets: Numbers, parts: Vector, bent: Vector) -> Curve:
    """Return the curve of one edge at parts (0 … 1) of the way from the first to the second vertex of its facets.

    Between the ends of a side the curve is a cubic. At each end its direction is the mean of those of the two sides.
    bent: whether each part lies on the curve, or else on the side itself.
    """
    # Facets are oriented with the plate on their left.
    ends = mesh.facets[:, facets]
    inside = mesh.p[:, mesh.t[:, mesh.f2t[0, facets]]].mean(axis=1).T - mesh.p[:, ends[0]].T
    along = tangents(mesh, facets)
    turned = (along[:, 0] * inside[:, 1] - along[:, 1] * inside[:, 0]) < 0.0
    along = np.where(turned[:, None], -along, along)
    start, end = np.where(turned, ends[::-1], ends)
    lengths = np.linalg.norm(mesh.p[:, ends[1]] - mesh.p[:, ends[0]], axis=0)

    # The next facet, and the angle to it: positive to the left, zero at corners and at ends of the edge.
    follows = {int(vertex): facet for facet, vertex in enumerate(start)}
    after = np.array([follows.get(int(vertex), -1) for vertex in end])
    ahead = along[after]
    turn = np.arctan2(along[:, 0] * ahead[:, 1] - along[:, 1] * ahead[:, 0], (along * ahead).sum(axis=1))
    joined = (after >= 0) & (np.abs(turn) < STRAIGHT)
    turn = np.where((after >= 0) & (np.abs(turn) < np.radians(SMOOTH)), turn, 0.0)

    # Facets in one line form a side. The angles at its two ends, and the distance of each facet from its start:
    first, last, before, total = (np.zeros(start.size) for _ in range(4))
    previous = {int(facet): i for i, facet in enumerate(after) if facet >= 0}
    for head in np.setdiff1d(np.arange(start.size), after[joined]):
        side = [int(head)]
        while joined[side[-1]] and after[side[-1]] != head:
            side.append(int(after[side[-1]]))
        before[side] = np.cumsum([0.0, *lengths[side[:-1]]])
        total[side], last[side] = lengths[side].sum(), turn[side[-1]]
        first[side] = turn[previous[side[0]]] if side[0] in previous else 0.0

    total, first, last = total[:, None], first[:, None] / 2.0 * bent, last[:, None] / 2.0 * bent
    place = (before[:, None] + lengths[:, None] * np.where(turned[:, None], 1.0 - parts, parts)) / total
    beyond = total * place * (1.0 - place) * (first * (1.0 - place) + last * place)
    slope = first * (1.0 - 4.0 * place + 3.0 * place**2) + last * (2.0 * place - 3.0 * place**2)
    there = along[:, None] + slope[:, :, None] * (along @ QUARTER_TURN)[:, None]
    there /= np.linalg.norm(there, axis=2, keepdims=True)
    return Curve(beyond, there, there @ QUARTER_TURN)
