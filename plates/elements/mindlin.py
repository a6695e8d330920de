"""Matrices of Mindlin–Reissner plates on any flat mesh, and how their edges are held.

The deflection w and the slope s = (s_x, s_y) of the fibres across the wall, which is ∇w where there is no shear, are
functions of one Space: energy ½ ∫ κᵀ B κ + (∇w − s)ᵀ S (∇w − s) with κ = (s_x,x, s_y,y, s_x,y + s_y,x), mass
½ ∫ m ẇ² + J |ṡ|², all integrated in full (Mindlin, J. Appl. Mech. 18 (1951) 31). The high order of the functions
prevents locking of thin plates. Degree of freedom 3 i is w of function i, 3 i + 1 and 3 i + 2 are s_x and s_y.
Laminates of stiff and soft plies are two such walls with one w: 5 i, and (s_x, s_y) of each.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from plates.additions import Addition, Stiffener, cell_lines
from plates.elements.indentation import bending_by_poisson, remaining_flexibility
from plates.elements.shape_functions import Space
from plates.elements.theory import Assembled, Supported, Touch, on_mesh, thick_wavelength
from plates.section import Section
from plates.shapes.mesh_geometry import QUARTER_TURN, cell_size, disc, tangents
from plates.shapes.shape import Cells, PlateMesh
from plates.support import ElasticEdge, Support
from structures.caution import caution
from structures.meshes.mesh_reading import Numbers, Tag
from structures.structure import Vector
from structures.units import readable

TWO_WAYS = 1e-6
"""s is held in two directions d where the smaller eigenvalue of the sum of d dᵀ exceeds this part of the larger one:
the directions then differ by a tenth of a degree or more."""

DEGREE = 4
"""Degree of the polynomials. Degree 4 does not lock in practice down to a thickness of 0.0025 of the side."""

COARSEST_PATCH = 5.0
"""The largest cell at the contact, in units of the patch's radius. Cells of 4 radii change the compliance by 0.2 %,
cells of 8 radii by 3 %."""

GROWTH = 0.6
"""Increase of the size of cells per distance from the contact."""

LONGEST = 1.6
"""The coarsest cells, in units of the shortest wavelength. Cells half as large change amplitude ratios by less than
0.01 %."""

LINE = np.polynomial.legendre.leggauss(5)
"""Points and weights on each part of a stiffener in one cell: exact for products of quartic functions."""

ROUNDING = 1e-9
"""Parts of a line, or of a side, that are below rounding."""

Matrix: TypeAlias = sparse.csr_array
Blocks: TypeAlias = dict[tuple[int, int], Vector]


@dataclass(frozen=True)
class Mindlin:
    """Mindlin's theory on triangles or quadrilaterals: an `Element`.

    patch_radius: of the disc on which the contact force acts, m. degree: of the polynomials.
    """

    patch_radius: float
    degree: int = DEGREE
    name: ClassVar[str] = "Mindlin"
    thin: ClassVar[bool] = False

    @property
    def unknowns(self) -> float:
        """Three for each of the degree² functions of a quadrilateral cell."""
        return 3.0 * self.degree**2

    def described(self) -> dict[str, Any]:
        """Return the parameters of its own, for results."""
        return {"degree": self.degree}

    def wavelength(self, section: Section, rigidity: float, frequency: float) -> float:
        """Return the wavelength of the softest direction in shear, m."""
        shear = float(np.linalg.eigvalsh(section.shear)[0])
        return thick_wavelength(section.mass, rigidity, frequency, section.rotary_inertia, shear)

    def cells(self, wavelength: float, additions: Sequence[Addition]) -> Cells:
        """Return cells as small as the patch at the contact, with lines where regions end and along stiffeners parallel
        to a side."""
        finest = min(self.patch_radius, wavelength)
        return Cells(finest, GROWTH, LONGEST * wavelength, lines=cell_lines(additions))

    def objection(self, addition: Addition) -> str:
        """Nothing is refused."""
        return ""

    def assemble(
        self, mesh: PlateMesh, section: Section, supports: Supported, additions: Sequence[Addition]
    ) -> Assembled:
        """Return the plate on a mesh of triangles or quadrilaterals."""
        functions = MindlinFunctions(mesh.mesh, section, self.degree)
        force = partial(self._patch_force, mesh, functions)
        return on_mesh(functions, mesh, section, supports, additions, force, functions.stiffener)

    def flexibility(self, wall: Section) -> float:
        """Return what bending and shear under the patch, and Hertz's half-space, leave out of the indentation, m/N."""
        return remaining_flexibility(wall, self.patch_radius)

    def _patch_force(self, mesh: PlateMesh, functions: "MindlinFunctions", expansion: Matrix, touch: Touch) -> Vector:
        """Return the force spread over the patch, and the displacement's mean over it."""
        if (size := cell_size(mesh, touch.place)) > COARSEST_PATCH * self.patch_radius:
            caution(
                f"mesh: cells of {readable(size, 'm')} at the contact are too large for a patch of "
                f"{readable(self.patch_radius, 'm')}; refine them to "
                f"{readable(COARSEST_PATCH * self.patch_radius, 'm')}"
            )
        points, weights = disc(touch.place, self.patch_radius, touch.mirrors)
        bend = bending_by_poisson(touch.wall)
        return np.asarray(functions.mean(points, weights, bend, -(self.patch_radius**2) / 8.0) @ expansion)


class MindlinFunctions:
    """Mindlin's w and s of one section on a mesh, as polynomials of a degree."""

    def __init__(self, mesh: Any, section: Section, degree: int) -> None:
        self.space, self.section, self.walls = Space(mesh, degree), section, section.walls
        self.each = 1 + 2 * len(self.walls)
        self.size = self.each * self.space.size

    def matrices(self, weakening: Callable[[Vector], Vector] | None = None) -> tuple[Matrix, Matrix]:
        """Return M and K, size × size. weakening: of points 2 × …, m, the factor of the bending stiffness there."""
        values, (along_x, along_y), weight, points = self.space.inside()
        inertia = (weight[:, None] * values) @ values.swapaxes(1, 2)
        slopes = {"x": along_x, "y": along_y}

        def products(by: Vector) -> dict[str, Vector]:
            return {a + b: (by[:, None] * slopes[a]) @ slopes[b].swapaxes(1, 2) for a in "xy" for b in "xy"}

        stretched = products(weight)
        curved = stretched if weakening is None else products(weight * weakening(points))
        crossed = [(weight[:, None] * slopes[a]) @ values.swapaxes(1, 2) for a in "xy"]
        total: Vector = np.sum([shear for _, shear, _ in self.walls], axis=0)
        deflected = sum(total[i, j] * stretched["xy"[i] + "xy"[j]] for i in (0, 1) for j in (0, 1))
        mass, stiffness = {(0, 0): self.section.mass * inertia}, {(0, 0): np.asarray(deflected)}
        for wall, (bending, shear, part) in enumerate(self.walls):
            s = 1 + 2 * wall
            bent = _bending(bending, curved)
            for i in (0, 1):
                stiffness[0, s + i] = -(shear[0, i] * crossed[0] + shear[1, i] * crossed[1])
                stiffness[s + i, 0] = stiffness[0, s + i].swapaxes(1, 2)
                mass[s + i, s + i] = part * self.section.rotary_inertia * inertia
                for j in (0, 1):
                    stiffness[s + i, s + j] = bent[1 + i, 1 + j] + shear[i, j] * inertia
        return self._assembled(self.space.cell_dofs, mass), self._assembled(self.space.cell_dofs, stiffness)

    def tension(self, forces: Vector) -> Matrix:
        """Return the stiffness of constant forces in the plane, N/m: they act on ∇w."""
        _, slopes, weight, _ = self.space.inside()
        pairs = [(i, j) for i in (0, 1) for j in (0, 1)]
        block = sum((forces[i, j] * weight)[:, None] * slopes[i] @ slopes[j].swapaxes(1, 2) for i, j in pairs)
        return self._assembled(self.space.cell_dofs, {(0, 0): np.asarray(block)})

    def _assembled(self, dofs: Numbers, blocks: Blocks) -> Matrix:
        """Return the matrix of blocks for (row, column) of w, s_x and s_y, each cells × functions × functions."""
        rows, columns, entries = [], [], []
        for (i, j), block in blocks.items():
            row, column = np.broadcast_arrays(self.each * dofs[:, :, None] + i, self.each * dofs[:, None, :] + j)
            rows.append(row.ravel())
            columns.append(column.ravel())
            entries.append(block.ravel())
        places = np.concatenate(rows), np.concatenate(columns)
        matrix = sparse.csr_array(sparse.coo_array((np.concatenate(entries), places), shape=(self.size, self.size)))
        matrix.eliminate_zeros()
        return matrix

    def springs(self, facets: Numbers, edge: ElasticEdge) -> Matrix:
        """Return the stiffness of springs along facets: ½ ∫ translation w² + rotation (s·n)² over their length."""
        mesh = self.space.mesh
        samples = self.space.along(facets)
        normal = tangents(mesh, facets) @ QUARTER_TURN
        overlap = (samples.weight[:, None] * samples.values) @ samples.values.swapaxes(1, 2)
        blocks: Blocks = {(0, 0): edge.translation * overlap}
        for i in (0, 1):
            for j in (0, 1):
                turned = edge.rotation * (normal[:, i] * normal[:, j])[:, None, None] * overlap
                for s, (_, _, part) in enumerate(self.walls):
                    blocks[1 + 2 * s + i, 1 + 2 * s + j] = part * turned
        return self._assembled(self.space.cell_dofs[mesh.f2t[0, facets]], blocks)

    def kept(self, edges: Mapping[Tag, Numbers], supports: Mapping[Tag, Support]) -> Matrix:
        """Return the size × n: the motions that the supports leave; at held edges s has components along and across the
        edge.

        On simple edges that are polygons of curves, w vanishes on the curve: w = −(its distance) s·n on the facets.
        """
        space = self.space
        still = np.zeros(space.size, dtype=bool)
        held = np.zeros((space.size, 2, 2))  # the sum of d dᵀ over the directions d in which s is held
        follows = np.zeros((space.size, 2))  # w over s_x and s_y where it is not free
        for name, support in supports.items():
            if isinstance(support, ElasticEdge) or support == "free":
                continue
            dofs, bend = space.on(edges[name])
            if support in ("simple", "soft simple"):
                follows[dofs] = -bend.beyond[:, :, None] * bend.outward
            if support != "symmetry":
                still[dofs] = True
            ways = {"clamped": (bend.along, bend.outward), "simple": (bend.along,), "symmetry": (bend.outward,)}
            for direction in ways.get(support, ()):
                np.add.at(held, dofs, direction[..., :, None] * direction[..., None, :])
        return _remaining(still, held, follows, len(self.walls))

    def deflection(self, points: Vector) -> Matrix:
        """Return what reads w at points, p × 2, from the degrees of freedom; a ValueError where one lies outside."""
        return sparse.csr_array(sparse.kron(self.space.at(points).value, np.eye(1, self.each)))

    def stiffener(self, stiffener: Stiffener) -> tuple[Matrix, Matrix]:
        """Return M and K, size × size, of a beam on the last wall: ½ ∫ EI (s·t)'² + GJ (s·n)'² + m ẇ² along it."""
        start, end = np.array(stiffener.start, dtype=float), np.array(stiffener.end, dtype=float)
        step, length = end - start, stiffener.length
        (x, y), stops = step / length, _crossings(self.space.mesh, start, step)
        place, weights = LINE
        size = np.diff(stops)[:, None]
        part = (stops[:-1, None] + 0.5 * (1.0 + place) * size).ravel()
        weight = sparse.diags_array((0.5 * weights * size * length).ravel())
        reading = self.space.at(start + part[:, None] * step)
        slope = x * reading.slope_x + y * reading.slope_y
        bent, twisted = (sparse.kron(slope, [[*(self.each - 2) * [0.0], *into]]) for into in ((x, y), (-y, x)))
        value = sparse.kron(reading.value, np.eye(1, self.each))
        stiffness = stiffener.bending_stiffness * (bent.T @ weight @ bent)
        stiffness = stiffness + stiffener.torsion_stiffness * (twisted.T @ weight @ twisted)
        return sparse.csr_array(stiffener.mass_per_length * (value.T @ weight @ value)), sparse.csr_array(stiffness)

    def mean(self, points: Vector, weights: Vector, first: float, last: float) -> Vector:
        """Return the mean, with weights, of w + first ∇·s + last ∇·s at points, p × 2, m, with s of the first and the
        last wall: one number for each degree of freedom.

        The last wall hardly shears, so its s is the slope of w, which the disc's mean bends.
        """
        reading, mean = self.space.at(points), np.zeros(self.size)
        mean[0 :: self.each] = weights @ reading.value
        for place, bend in ((1, first), (self.each - 2, last)):
            mean[place :: self.each] += bend * (weights @ reading.slope_x)
            mean[place + 1 :: self.each] += bend * (weights @ reading.slope_y)
        return mean

    def sampled(self, places: Vector) -> tuple[Matrix, Matrix]:
        """Return what reads w, and κ in three rows, at places of the reference cell, 2 × places, cell by cell."""
        reading = self.space.sampled(places)
        # The moments are those of all walls, so their curvatures count by their parts of the bending stiffness.
        x, y = np.zeros((3, self.each)), np.zeros((3, self.each))
        for s, (_, _, part) in enumerate(self.walls):
            x[0, 1 + 2 * s] = x[2, 2 + 2 * s] = y[1, 2 + 2 * s] = y[2, 1 + 2 * s] = part
        along_x, along_y = sparse.kron(reading.slope_x, x), sparse.kron(reading.slope_y, y)
        deflection = sparse.kron(reading.value, np.eye(1, self.each), format="csr")
        return sparse.csr_array(deflection), sparse.csr_array(along_x + along_y)


def _bending(bending: Vector, products: Mapping[str, Vector]) -> Blocks:
    """Return the blocks of ∫ κᵀ B κ: the strain of s_x is (∂x, 0, ∂y), that of s_y (0, ∂y, ∂x)."""
    strains = {1: ((0, "x"), (2, "y")), 2: ((1, "y"), (2, "x"))}
    return {
        (i, j): np.asarray(sum(bending[m, n] * products[a + b] for m, a in strains[i] for n, b in strains[j]))
        for i in (1, 2)
        for j in (1, 2)
    }


def _remaining(still: NDArray[np.bool_], held: Vector, follows: Vector, walls: int) -> Matrix:
    """Return motions that remain where w follows the last wall's s. held: the sum of d dᵀ over the directions d in
    which s is held."""
    strength, axes = np.linalg.eigh(held)
    free = np.stack([strength[:, 0] <= TWO_WAYS * strength[:, 1], strength[:, 1] == 0.0], axis=1)
    axes[free.all(axis=1)] = np.eye(2)
    moves = np.flatnonzero(~still)
    each = 1 + 2 * walls
    rows, columns, entries = [each * moves], [each * moves], [np.ones(moves.size)]
    for s, axis in product(range(1, each, 2), (0, 1)):
        turns = np.flatnonzero(free[:, axis])
        into = axes[turns, :, axis]
        after = np.where(still[turns] & (s == each - 2), (follows[turns] * into).sum(axis=1), 0.0)
        rows += [each * turns + s, each * turns + s + 1, each * turns]
        columns += [each * turns + s + axis] * 3
        entries += [into[:, 0], into[:, 1], after]
    remaining, column = np.unique(np.concatenate(columns), return_inverse=True)
    places = np.concatenate(rows), column
    matrix = sparse.csr_array(
        sparse.coo_array((np.concatenate(entries), places), shape=(each * still.size, remaining.size))
    )
    matrix.eliminate_zeros()
    return matrix


def _crossings(mesh: Any, start: Vector, step: Vector) -> Vector:
    """The parts of the way from start, ascending from 0 to 1, at which it passes from cell to cell."""
    first_ends, last_ends = mesh.p[:, mesh.facets].transpose(1, 2, 0)
    side = last_ends - first_ends
    turn = step[0] * side[:, 1] - step[1] * side[:, 0]
    away = first_ends - start
    with np.errstate(divide="ignore", invalid="ignore"):
        on_way = (away[:, 0] * side[:, 1] - away[:, 1] * side[:, 0]) / turn
        on_side = (away[:, 0] * step[1] - away[:, 1] * step[0]) / turn
    met = (on_way > 0.0) & (on_way < 1.0) & (on_side > -ROUNDING) & (on_side < 1.0 + ROUNDING)
    crossings = np.unique(np.concatenate([[0.0, 1.0], on_way[met]]))
    distinct: Vector = crossings[np.concatenate([[True], np.diff(crossings) > ROUNDING])]
    distinct[-1] = 1.0
    return distinct
