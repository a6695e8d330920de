"""Scalar functions of high order on a flat mesh of triangles or quadrilaterals, for Mindlin's w and rotations.

Triangles have Lagrange's polynomials (scikit-fem's ElementTriP3 and P4), quadrilaterals products of integrated Legendre
polynomials (ElementQuadP). Odd functions of a side change sign with its direction. Here each side runs from its corner
with the lower number to the other one, so that the functions of neighbours agree on any mesh of quadrilaterals.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from skfem import ElementQuad1, ElementQuadP, ElementTriP1, ElementTriP3, ElementTriP4
from skfem.assembly import Dofs
from skfem.quadrature import get_quadrature

from plates.elements.curve import Curve, curve
from plates.shapes.mesh_geometry import QUARTER_TURN, find_cells, tangents
from structures.meshes.mesh_reading import Numbers
from structures.structure import Vector

TRIANGLES = {3: ElementTriP3, 4: ElementTriP4}

SQUARE_SIDES = ((0, 1), (1, 2), (3, 2), (0, 3))
"""Corners of the reference square's sides, in the direction in which its functions run."""


class Samples(NamedTuple):
    """All functions of some cells at points of them.

    values: cells × functions × points; slopes: 2 × cells × functions × points, along x and y; weight: cells × points,
    of an integral over the cells or facets; points: 2 × cells × points, m.
    """

    values: Vector
    slopes: Vector
    weight: Vector
    points: Vector


class Reading(NamedTuple):
    """Matrices, points × size, that read a function and its slopes at points."""

    value: sparse.csr_array
    slope_x: sparse.csr_array
    slope_y: sparse.csr_array


class Space:
    """Scalar functions of one degree (3 or 4 on triangles) on a MeshTri or MeshQuad of scikit-fem with straight sides.

    cell_dofs: cells × functions. vertex_dofs: by vertex. facet_dofs: functions × facets.
    """

    def __init__(self, mesh: Any, degree: int) -> None:
        self.mesh, self.degree = mesh, degree
        corners = mesh.t.shape[0]
        self.element, self.linear = (
            (TRIANGLES[degree](), ElementTriP1()) if corners == 3 else (ElementQuadP(degree), ElementQuad1())
        )
        numbering = Dofs(mesh, self.element)
        self.size, self.cell_dofs = int(numbering.N), np.asarray(numbering.element_dofs.T, dtype=np.int64)
        self.vertex_dofs, self.facet_dofs = numbering.nodal_dofs[0], numbering.facet_dofs
        self.corners = mesh.p[:, mesh.t]  # 2 × corners × cells
        self.signs = np.ones(self.cell_dofs.shape)
        if corners == 4:
            odd = np.flatnonzero(np.arange(degree - 1) % 2 == 1)
            for side, (start, end) in enumerate(SQUARE_SIDES):
                backwards = np.flatnonzero(mesh.t[start] > mesh.t[end])
                self.signs[np.ix_(backwards, 4 + side * (degree - 1) + odd)] = -1.0

    def inside(self) -> Samples:
        """Return all cells, at the points of a quadrature that is exact for masses of triangles and parallelograms."""
        places, weights = get_quadrature(self.element.refdom, 2 * self.degree)
        count = self.mesh.nelements
        return self._sampled(np.arange(count), np.repeat(places[:, None], count, axis=1), weights)

    def along(self, facets: Numbers) -> Samples:
        """Return the cells next to the facets, at points of the facets."""
        cells = self.mesh.f2t[0, facets]
        part, weights = np.polynomial.legendre.leggauss(self.degree + 1)
        part, weights = (part + 1.0) / 2.0, weights / 2.0
        ends = self.mesh.facets[:, facets]
        start, end = (self.linear.doflocs[(self.mesh.t[:, cells] == corner).argmax(axis=0)].T for corner in ends)
        places = start[:, :, None] * (1.0 - part) + end[:, :, None] * part
        step = self.mesh.p[:, ends[1]] - self.mesh.p[:, ends[0]]
        return self._sampled(cells, places, weights)._replace(weight=np.hypot(*step)[:, None] * weights)

    def on(self, facets: Numbers) -> tuple[Numbers, Curve]:
        """Return the functions that do not vanish on the facets, functions × facets, and the edge's curve there, … ×
        facets.

        On quadrilaterals the functions of a side belong to no single point; for them the curve is the side itself.
        """
        dofs = np.concatenate([self.vertex_dofs[self.mesh.facets[:, facets]], self.facet_dofs[:, facets]])
        parts = np.append([0.0, 1.0], np.arange(1, self.degree) / self.degree)
        bend = curve(self.mesh, facets, parts)
        if self.corners.shape[1] == 4:
            chord = tangents(self.mesh, facets)[:, None]
            bend.beyond[:, 2:], bend.along[:, 2:] = 0.0, chord
            bend.outward[:, 2:] = chord @ QUARTER_TURN
        return dofs, Curve(*(values.swapaxes(0, 1) for values in bend))

    def at(self, points: Vector) -> Reading:
        """Reads functions at points, p × 2; a ValueError where one lies outside."""
        cells, places = self.find(points)
        return self._reading(cells, places[:, :, None])

    def sampled(self, places: Vector) -> Reading:
        """Reads functions at the same places of the reference cell, 2 × places, in each cell in turn."""
        cells = np.arange(self.mesh.nelements)
        return self._reading(cells, np.repeat(places[:, None], cells.size, axis=1))

    def _reading(self, cells: Numbers, places: Vector) -> Reading:
        values, slopes, _, _ = self._sampled(cells, places, np.ones(places.shape[2]))
        shape = len(cells), places.shape[2], values.shape[1]
        rows = np.broadcast_to(np.arange(shape[0] * shape[1]).reshape(*shape[:2], 1), shape).ravel()
        columns = np.broadcast_to(self.cell_dofs[cells][:, None], shape).ravel()

        def matrix(functions: Vector) -> sparse.csr_array:
            entries = functions.swapaxes(1, 2).ravel(), (rows, columns)
            return sparse.csr_array(sparse.coo_array(entries, shape=(shape[0] * shape[1], self.size)))

        return Reading(matrix(values), matrix(slopes[0]), matrix(slopes[1]))

    def find(self, points: Vector) -> tuple[Numbers, Vector]:
        """Return the cell of each point, and its place in the reference cell, 2 × points."""
        cells = find_cells(self.mesh, points)
        corners = self.corners[:, :, cells]
        places = np.repeat(self.linear.doflocs.mean(axis=0)[:, None], len(cells), axis=1)
        # Newton's method, as quadrilaterals are bilinear; triangles take one step.
        for _ in range(20):
            shapes, slopes = self._linear(places)
            difference = points.T - np.einsum("jip,ip->jp", corners, shapes)
            step = np.linalg.solve(np.einsum("jip,kip->pjk", corners, slopes), difference.T[:, :, None])[:, :, 0].T
            places = places + step
            if np.abs(step).max() < 1e-12:
                break
        return cells, places

    def _linear(self, places: Vector) -> tuple[Vector, Vector]:
        """Return values, corners × …, and slopes, 2 × corners × …, of the map from the reference cell to the mesh."""
        pairs = [self.linear.lbasis(places, i) for i in range(self.corners.shape[1])]
        values = np.stack([np.broadcast_to(value, places.shape[1:]) for value, _ in pairs])
        return values, np.stack([np.broadcast_to(_column(slope, places), places.shape) for _, slope in pairs], axis=1)

    def _sampled(self, cells: Numbers, places: Vector, weights: Vector) -> Samples:
        """Return the functions of cells at places in the reference cell, 2 × cells × points."""
        flat = places.reshape(2, -1)
        pairs = [self.element.lbasis(flat, i) for i in range(self.cell_dofs.shape[1])]
        values = np.stack([np.broadcast_to(value, flat.shape[1:]) for value, _ in pairs])
        slopes = np.stack([np.broadcast_to(slope, flat.shape) for _, slope in pairs], axis=1)
        values = values.reshape(-1, *places.shape[1:]).swapaxes(0, 1) * self.signs[cells][:, :, None]
        slopes = slopes.reshape(2, -1, *places.shape[1:]).swapaxes(1, 2) * self.signs[cells][:, :, None]
        linear, turns = self._linear(flat)
        corners, shape = self.corners[:, :, cells], places.shape[1:]
        points = np.einsum("jic,icq->jcq", corners, linear.reshape(-1, *shape))
        jacobian = np.einsum("jic,kicq->cqjk", corners, turns.reshape(2, -1, *shape), optimize=True)
        inverse = np.linalg.inv(jacobian).transpose(3, 2, 0, 1)[:, :, :, None]  # along x or y, of the reference's k
        turned = np.stack([inverse[along, 0] * slopes[0] + inverse[along, 1] * slopes[1] for along in (0, 1)])
        return Samples(values, turned, np.abs(np.linalg.det(jacobian)) * weights, points)


def _column(slope: Any, places: Vector) -> Vector:
    column: Vector = np.asarray(slope).reshape(2, -1)
    return column if column.shape[1] == places.shape[1] else column[:, :1]
