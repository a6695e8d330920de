"""Matrices of thin (Kirchhoff) plates on any flat mesh of triangles: Morley's elements, and how their edges are held.

w is quadratic in each triangle. Its values at the corners and its slopes across the sides at their midpoints determine
it. w is not continuous, but the element converges, with order 2 of frequencies (Morley, Aero. Quart. 19 (1968) 149).
scikit-fem's ElementTriMorley is the same; here each triangle has its own coordinates, so that small triangles in a
large plate lose no digits. Degrees of freedom: w at the vertices, then the slopes across the facets.

Morley's plate is too soft: the curvature is constant in each triangle, and the energy of its variation is missing. It
is added here, computed from the jumps of the curvature between neighbours; see `MorleyFunctions.matrices`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np
from scipy import sparse
from skfem.quadrature import get_quadrature
from skfem.refdom import RefTri

from plates.additions import Addition, Stiffener
from plates.elements.curve import curve
from plates.elements.theory import Assembled, Supported, on_mesh, thick_wavelength
from plates.section import Section
from plates.shapes.mesh_geometry import QUARTER_TURN, find_cells, tangents
from plates.shapes.shape import Cells, PlateMesh
from plates.support import ElasticEdge, Support
from structures.bodies.assembly import sum_of_cells
from structures.meshes.mesh_reading import Numbers, Tag
from structures.structure import Vector

Matrix: TypeAlias = sparse.csr_array

JUMPS = 2.25
"""Weight of the energy of the curvature's jumps. It is 1 for a curvature that varies linearly. The discontinuity of w
makes the triangles softer still, which requires more: the error of order 2 vanishes at 2.0, 2.3 and 2.6 on gmsh's
triangles (ν = 0, 0.3 and 0.45), and at 1.8 and 2.2 (ν = 0 and 0.3) for plane waves on equilateral ones."""

FINEST, COARSEST = 24.0, 8.0
"""Cells per shortest wavelength at the contact and far from it. The static compliance there is within 0.1 %."""

GROWTH = 0.15
"""Increase of the size of cells per distance from the contact."""

SAME_STIFFNESS = 1e-6
"""Relative difference of bending stiffness above which neighbours are expected to have different curvatures."""


@dataclass(frozen=True)
class Morley:
    """Kirchhoff's theory on triangles, for plates of any shape: an `Element`."""

    name: ClassVar[str] = "Kirchhoff"
    thin: ClassVar[bool] = True
    patch_radius: ClassVar[float] = 0.0
    unknowns: ClassVar[float] = 4.6
    """Two for each triangle, of which 2.3 make a square of the coarsest side."""

    def described(self) -> dict[str, Any]:
        """Return the parameters of its own, for results."""
        return {}

    def wavelength(self, section: Section, rigidity: float, frequency: float) -> float:
        """Return 2π (D/m)^¼ / √ω, m.

        In the form of the thick plate's: gmsh's meshes depend on the last digit, and so keep those of earlier versions.
        """
        return thick_wavelength(section.mass, rigidity, frequency)

    def cells(self, wavelength: float, additions: Sequence[Addition]) -> Cells:
        """Return the triangles of an eighth of the shortest wave, and a third of that at the contact."""
        return Cells(wavelength / FINEST, GROWTH, wavelength / COARSEST)

    def objection(self, addition: Addition) -> str:
        """Stiffeners and delaminations are refused."""
        if isinstance(addition, Stiffener):
            return "Morley's triangles are not continuous along lines and carry no stiffeners; see mindlin_panel"
        return ""

    def assemble(
        self, mesh: PlateMesh, section: Section, supports: Supported, additions: Sequence[Addition]
    ) -> Assembled:
        """Return the plate on a mesh of triangles; raise a ValueError for quadrilaterals."""
        if mesh.mesh.t.shape[0] != 3:
            raise ValueError("mesh: has quadrilaterals; Morley's elements are triangles, mindlin_panel takes both")
        return on_mesh(MorleyFunctions(mesh.mesh, section), mesh, section, supports, additions)

    def flexibility(self, wall: Section) -> float:
        """Return 0 m/N: in Kirchhoff's theory the indentation is Hertz's."""
        return 0.0


class MorleyFunctions:
    """Morley's w of one section on a mesh of triangles."""

    def __init__(self, mesh: Any, section: Section) -> None:
        self.mesh, self.section = mesh, section
        self.size = mesh.nvertices + mesh.nfacets
        self.cell_dofs = np.concatenate([mesh.t, mesh.nvertices + mesh.t2f]).T
        corners = mesh.p[:, mesh.t].transpose(2, 1, 0)  # cells × corners × 2
        self.middle = corners.mean(axis=1)
        self.extent = np.ptp(corners, axis=1).max(axis=1)
        sides = mesh.p[:, mesh.facets].mean(axis=1).T
        across = tangents(mesh, np.arange(mesh.nfacets)) @ QUARTER_TURN
        values = self._powers(corners)[0]
        slopes = np.einsum("kcfm,cfk->cfm", self._powers(sides[mesh.t2f.T])[1], across[mesh.t2f.T])
        # cells × powers × functions
        self.functions = np.linalg.inv(np.concatenate([values, slopes], axis=1))

    def _powers(self, points: Vector, cells: Any = slice(None)) -> tuple[Vector, Vector]:
        """Return 1, x, y, x²/2, y²/2, xy of coordinates in units of the cell, from its middle; and their slopes, 2 × …

        points: cells × points × 2, m.
        """
        extent = self.extent[cells][:, None]
        x, y = ((points - self.middle[cells][:, None]) / extent[:, :, None]).transpose(2, 0, 1)
        zero, unit = np.zeros_like(x), np.ones_like(x)
        values = np.stack([unit, x, y, x**2 / 2.0, y**2 / 2.0, x * y], axis=-1)
        along_x = np.stack([zero, unit, zero, x, zero, y], axis=-1)
        along_y = np.stack([zero, zero, unit, zero, y, x], axis=-1)
        return values, np.stack([along_x, along_y]) / extent[:, :, None]

    def _curvatures(self) -> Vector:
        """Return w_xx, w_yy, 2 w_xy of the functions, cells × 3 × functions."""
        twice = np.array([1.0, 1.0, 2.0])[:, None]
        curved: Vector = twice * self.functions[:, 3:] / self.extent[:, None, None] ** 2
        return curved

    def _inside(self) -> tuple[Vector, Vector]:
        """Return the points in all cells, cells × points × 2, m, and their weights, m²."""
        places, weights = get_quadrature(RefTri, 4)
        corners = self.mesh.p[:, self.mesh.t].transpose(2, 1, 0)
        shares = np.stack([1.0 - places.sum(axis=0), *places])
        points = np.einsum("cij,iq->cqj", corners, shares)
        right, left = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        return points, np.abs(right[:, :1] * left[:, 1:] - right[:, 1:] * left[:, :1]) * weights

    def tension(self, forces: Vector) -> Matrix:
        """Return the stiffness of constant forces in the plane, N/m."""
        points, weight = self._inside()
        slopes = self._powers(points)[1] @ self.functions
        blocks = np.einsum("ij,icqm,cq,jcqn->cmn", forces, slopes, weight, slopes, optimize=True)
        return self._assembled(self.cell_dofs, blocks)

    def matrices(self, weakening: Callable[[Vector], Vector] | None = None) -> tuple[Matrix, Matrix]:
        """Return M and K, size × size. weakening: of points 2 × …, m, the factor of the bending stiffness there.

        K holds Morley's energy, ½ ∫ κᵀ D κ, and JUMPS ½ Σ [κ]ᵀ D [κ] w over the sides between triangles of equal
        stiffness, with [κ] the difference of their curvatures. w is such that the sum is the energy of the variation of
        κ within the triangles where κ is linear: of each triangle Σ w d² = ∫ |x − middle|² with d the distances to the
        middles of its neighbours. It vanishes with h² as the triangles shrink, and takes most of the error of order 2.
        """
        points, weight = self._inside()
        values = self._powers(points)[0] @ self.functions
        mass = self.section.mass * values.swapaxes(1, 2) @ (weight[:, :, None] * values)
        soft = weight if weakening is None else weight * weakening(points.transpose(2, 0, 1))
        curved = self._curvatures()
        stiffness = soft.sum(axis=1)[:, None, None] * (curved.swapaxes(1, 2) @ self.section.bending @ curved)
        plain = self._assembled(self.cell_dofs, stiffness)
        factors = soft.sum(axis=1) / weight.sum(axis=1)
        return self._assembled(self.cell_dofs, mass), plain + self._jumps(curved, weight.sum(axis=1), factors)

    def _jumps(self, curved: Vector, area: Vector, factors: Vector) -> Matrix:
        """Return the stiffness of the curvature's jumps; see `matrices`. area, m², and factor of the stiffness of each
        cell."""
        cell, neighbour = self.mesh.f2t[:, self.mesh.f2t[1] >= 0]
        equal = np.abs(factors[cell] - factors[neighbour]) <= SAME_STIFFNESS * factors[cell]
        cell, neighbour = cell[equal], neighbour[equal]
        squares = ((self.middle[cell] - self.middle[neighbour]) ** 2).sum(axis=1)
        around = np.bincount(np.append(cell, neighbour), np.append(squares, squares), self.mesh.nelements)
        away = self.mesh.p[:, self.mesh.t].transpose(2, 1, 0) - self.middle[:, None]
        # ∫ |x − middle|² over a triangle is its area/12 times the sum of its corners' squared distances.
        spread = factors * area * (away**2).sum(axis=(1, 2)) / 12.0
        share = np.divide(spread, around, out=np.zeros_like(around), where=around > 0.0)
        jump = np.concatenate([curved[cell], -curved[neighbour]], axis=2)
        weights = JUMPS * (share[cell] + share[neighbour])
        blocks = weights[:, None, None] * (jump.swapaxes(1, 2) @ self.section.bending @ jump)
        return self._assembled(np.concatenate([self.cell_dofs[cell], self.cell_dofs[neighbour]], axis=1), blocks)

    def _assembled(self, dofs: Numbers, blocks: Vector) -> Matrix:
        return sum_of_cells(dofs, blocks, self.size)

    def springs(self, facets: Numbers, edge: ElasticEdge) -> Matrix:
        """Return the stiffness of springs along facets: ½ ∫ translation w² + rotation w_n² over their length."""
        cells = self.mesh.f2t[0, facets]
        part, weights = np.polynomial.legendre.leggauss(3)
        ends = self.mesh.p[:, self.mesh.facets[:, facets]].transpose(2, 1, 0)
        step = ends[:, 1] - ends[:, 0]
        points = ends.mean(axis=1)[:, None] + 0.5 * part[:, None] * step[:, None]
        weight = 0.5 * weights * np.linalg.norm(step, axis=1)[:, None]
        values, slopes = (powers @ self.functions[cells] for powers in self._powers(points, cells))
        across = np.einsum("kcqs,ck->cqs", slopes, tangents(self.mesh, facets) @ QUARTER_TURN)
        blocks = edge.translation * values.swapaxes(1, 2) @ (weight[:, :, None] * values)
        blocks = blocks + edge.rotation * across.swapaxes(1, 2) @ (weight[:, :, None] * across)
        return self._assembled(self.cell_dofs[cells], blocks)

    def kept(self, edges: Mapping[Tag, Numbers], supports: Mapping[Tag, Support]) -> Matrix:
        """Return the size × n: the motions that the supports leave.

        On simple edges that are polygons of curves, w vanishes on the curve: at a vertex it is −(the curve's distance)
        times the mean slope across the two facets there.
        """
        held = np.zeros(self.size, dtype=bool)
        rows, columns, entries = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
        for name, support in supports.items():
            if isinstance(support, ElasticEdge):
                continue
            corners, sides = self.mesh.facets[:, edges[name]], self.mesh.nvertices + edges[name]
            if support in ("clamped", "simple", "soft simple"):
                held[corners] = True
            if support in ("clamped", "symmetry"):
                held[sides] = True
            if support in ("simple", "soft simple"):
                bend = curve(self.mesh, edges[name], np.array([0.0, 1.0]))
                across = tangents(self.mesh, edges[name]) @ QUARTER_TURN
                outward = np.sign((bend.outward.mean(axis=1) * across).sum(axis=1, keepdims=True))
                rows.append(corners.T.ravel())
                columns.append(np.repeat(sides, 2))
                entries.append((-0.5 * bend.beyond * outward).ravel())
        places = np.concatenate(rows), np.concatenate(columns)
        follows = sparse.csr_array(sparse.coo_array((np.concatenate(entries), places), shape=(self.size, self.size)))
        return sparse.csr_array((sparse.eye_array(self.size, format="csr") + follows)[:, ~held])

    def deflection(self, points: Vector) -> Matrix:
        """Return what reads w at points, p × 2, from the degrees of freedom; a ValueError where one lies outside."""
        cells = find_cells(self.mesh, points)
        values = (self._powers(points[:, None], cells)[0] @ self.functions[cells])[:, 0]
        return self._reading(cells, values[:, None])

    def sampled(self, places: Vector) -> tuple[Matrix, Matrix]:
        """Return what reads w, and the curvatures in three rows, at places of the reference cell, 2 × places, in each
        cell."""
        count, cells = places.shape[1], np.arange(self.mesh.nelements)
        shares = np.stack([1.0 - places.sum(axis=0), *places])
        points = np.einsum("jic,iq->cqj", self.mesh.p[:, self.mesh.t], shares)
        values = self._powers(points)[0] @ self.functions
        curved = np.broadcast_to(self._curvatures()[:, None], (cells.size, count, 3, 6)).reshape(cells.size, -1, 6)
        return self._reading(cells, values), self._reading(cells, curved)

    def _reading(self, cells: Numbers, functions: Vector) -> Matrix:
        """Return the matrix of rows for each point, points × rows × functions of its cell."""
        count = functions.shape[0] * functions.shape[1]
        rows = np.broadcast_to(np.arange(count).reshape(functions.shape[:2])[:, :, None], functions.shape)
        columns = np.broadcast_to(self.cell_dofs[cells][:, None], functions.shape)
        entries = functions.ravel(), (rows.ravel(), columns.ravel())
        return sparse.csr_array(sparse.coo_array(entries, shape=(count, self.size)))
