"""Mindlin–Reissner plates on any flat mesh: mass, stiffness, and supports of edges.

The deflection w and the slope s = (s_x, s_y) of the fibres across the wall are sums of the same functions; s is ∇w if
there is no shear. The elastic energy is ½ ∫ κᵀ B κ + (∇w − s)ᵀ S (∇w − s) with κ = (s_x,x, s_y,y, s_x,y + s_y,x), the
kinetic energy ½ ∫ m ẇ² + J |ṡ|² (Mindlin, J. Appl. Mech. 18 (1951) 31). All integrals are full. The high order of the
functions prevents locking of thin plates. Degree of freedom 3 i is w of function i, 3 i + 1 and 3 i + 2 are s_x and
s_y. Laminates of stiff and soft plies are two such walls with the same w: 5 i is w, and (s_x, s_y) of each wall follow.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from math import pi
from typing import Any, ClassVar, TypeAlias

import numpy as np
from scipy import sparse

from plates.additions import Addition, PointMass, Prestress, Stiffener, Weakened
from plates.elements.assembled import Assembled, Touch, mesh_sampler
from plates.elements.functions import DEGREE, Functions
from plates.elements.indentation import bending_by_poisson, remaining_flexibility
from plates.section import Section
from plates.shapes.mesh_geometry import QUARTER_TURN, check_straight, find_cells, tangents
from plates.shapes.shape import Cells, PlateMesh
from plates.support import ElasticEdge, Support
from structures.caution import caution
from structures.meshes.mesh_reading import Numbers, Tag
from structures.structure import Vector
from structures.units import readable

# s is held in two directions d if the smaller eigenvalue of the sum of d dᵀ exceeds this fraction of the larger one,
# for directions that differ by a tenth of a degree or more.
TWO_WAYS = 1e-6
# The largest cell at the contact, in units of the patch's radius. Cells of 4 radii change the compliance by 0.2 %,
# cells of 8 radii by 3 %.
COARSEST_PATCH = 5.0
GROWTH = 0.6  # Increase of the size of cells per distance from the contact
# The coarsest cells, in units of the shortest wavelength. Half of that changes amplitude ratios by less than 0.01 %.
LONGEST = 1.6
# Points and weights on a line in a cell, exact for products of two functions
LINE = np.polynomial.legendre.leggauss(DEGREE + 1)
# Numbers of points along the radius and around the disc of the contact; the error of the mean is 1e-6.
RINGS, SPOKES = 10, 40
ROUNDING = 1e-9  # Points that are closer than this fraction of a line, or of a side, coincide
Matrix: TypeAlias = sparse.csr_array


@dataclass(frozen=True)
class Mindlin:
    """Mindlin's theory on triangles or quadrilaterals; the contact force acts on a disc of radius patch_radius, m."""

    patch_radius: float
    name: ClassVar[str] = "Mindlin"
    thin: ClassVar[bool] = False
    unknowns: ClassVar[float] = 3.0 * DEGREE**2

    def cells(self, wavelength: float, additions: Sequence[Addition]) -> Cells:
        """Return cells as small as the patch at the contact, with lines at the ends of regions and along stiffeners."""
        regions = [addition.region for addition in additions if isinstance(addition, Weakened)]
        ribs = [addition for addition in additions if isinstance(addition, Stiffener)]
        xs = [x for region in regions for x in region[:2]] + [rib.start[0] for rib in ribs if rib.along_y]
        ys = [y for region in regions for y in region[2:]] + [rib.start[1] for rib in ribs if rib.along_x]
        finest = min(self.patch_radius, wavelength)
        return Cells(finest, GROWTH, LONGEST * wavelength, lines=(tuple(xs), tuple(ys)))

    def assemble(
        self, mesh: PlateMesh, section: Section, supports: Mapping[Tag, Support], additions: Sequence[Addition]
    ) -> Assembled:
        space = MindlinSpace(mesh.mesh, section)
        mass, stiffness = space.matrices(additions)
        for name, support in supports.items():
            if support in ("simple", "soft simple") and mesh.mesh.t.shape[0] == 4:
                check_straight(mesh.mesh, mesh.edges[name], name)
            if isinstance(support, ElasticEdge):
                stiffness = stiffness + space.springs(mesh.edges[name], support)
        for i, addition in enumerate(additions):
            try:
                if isinstance(addition, PointMass):
                    reading = space.deflection(np.array([[addition.x, addition.y]]))
                    mass = mass + addition.mass * (reading.T @ reading)
                elif isinstance(addition, Stiffener):
                    more, stiffer = space.stiffener(addition)
                    mass, stiffness = mass + more, stiffness + stiffer
            except ValueError as error:
                raise ValueError(f"additions[{i}] = {addition!r}: {error}") from error
        motions = space.motions(mesh, supports)
        mass, stiffness = (sparse.csr_array(motions.T @ sparse.csr_array(m) @ motions) for m in (mass, stiffness))
        sampler = partial(mesh_sampler, mesh.mesh, space, motions, section)
        return Assembled(mass, stiffness, partial(space.contact, self.patch_radius, motions), sampler)


class MindlinSpace:
    """w and s of a section on a mesh: `size` degrees of freedom, `each` for every function."""

    def __init__(self, mesh: Any, section: Section) -> None:
        self.functions, self.section, self.walls = Functions(mesh), section, section.walls
        self.each = 1 + 2 * len(self.walls)
        self.size = self.each * self.functions.size
        # Matrices that select w, and s of each wall, from the degrees of freedom of a function.
        self._w = np.eye(1, self.each)
        self._s = [np.eye(self.each)[1 + 2 * i : 3 + 2 * i] for i in range(len(self.walls))]

    def matrices(self, additions: Sequence[Addition] = ()) -> tuple[Matrix, Matrix]:
        """Return M and K of the wall, its weakened regions and its prestress."""
        values, slopes, weight, (x, y) = self.functions.inside()
        soft = weight.copy()
        for addition in additions:
            if isinstance(addition, Weakened):
                left, right, bottom, top = addition.region
                soft[(x > left) & (x < right) & (y > bottom) & (y < top)] *= addition.factor
        integral, pairs = self.functions.integral, list(product((0, 1), repeat=2))
        plain = integral(weight, values, values)
        sloped = [integral(weight, slopes[a], values) for a in (0, 1)]
        gradients = {(a, b): integral(weight, slopes[a], slopes[b]) for a, b in pairs}
        bent = {(a, b): integral(soft, slopes[a], slopes[b]) for a, b in pairs}

        # ∇w = Σ ∂_a G_a, and κ = Σ ∂_a κ_a of each wall.
        w, gradient = self._w, [np.eye(2)[:, [a]] * self._w for a in (0, 1)]
        inertia, elastic = [(plain, self.section.mass * w.T @ w)], []
        for (bending, shear, part), s in zip(self.walls, self._s, strict=True):
            inertia.append((plain, part * self.section.rotary_inertia * s.T @ s))
            elastic.append((plain, s.T @ shear @ s))
            curvature = _curvature(s)
            for a in (0, 1):
                mixed = gradient[a].T @ shear @ s
                elastic += [(-sloped[a], mixed), (-integral(weight, values, slopes[a]), mixed.T)]
            for a, b in pairs:
                elastic.append((gradients[a, b], gradient[a].T @ shear @ gradient[b]))
                elastic.append((bent[a, b], curvature[a].T @ bending @ curvature[b]))
        for addition in additions:
            if isinstance(addition, Prestress):
                elastic += [(gradients[a, b], addition.forces[a, b] * w.T @ w) for a, b in pairs]
        return self.functions.matrix(inertia), self.functions.matrix(elastic)

    def springs(self, facets: Numbers, edge: ElasticEdge) -> Matrix:
        """Return the stiffness of springs along facets: ½ ∫ translation w² + rotation (s·n)² over their length."""
        mesh = self.functions.mesh
        start, end = mesh.p[:, mesh.facets[:, facets]].transpose(1, 2, 0)
        place, weights = LINE
        points = start[:, None] + 0.5 * (1.0 + place[:, None]) * (end - start)[:, None]
        reading = self.functions.at(points.reshape(-1, 2), np.repeat(mesh.f2t[0, facets], place.size))
        weight = sparse.diags_array((0.5 * weights * np.linalg.norm(end - start, axis=1)[:, None]).ravel())
        normal = np.repeat(tangents(mesh, facets) @ QUARTER_TURN, place.size, axis=0)
        value = sparse.kron(reading.value, self._w)
        total = edge.translation * (value.T @ weight @ value)
        for (_, _, part), s in zip(self.walls, self._s, strict=True):
            turned = sum(sparse.diags_array(normal[:, i]) @ sparse.kron(reading.value, s[i : i + 1]) for i in (0, 1))
            total = total + part * edge.rotation * (turned.T @ weight @ turned)
        return sparse.csr_array(total)

    def motions(self, mesh: PlateMesh, supports: Mapping[Tag, Support]) -> Matrix:
        """Return the motions that supports leave free, size × n; at held edges, s has components along and across.

        On a simple edge whose polygon represents a curve, w vanishes on the curve: w = −(its distance) s·n on facets.
        """
        count = self.functions.size
        still = np.zeros(count, dtype=bool)
        held = np.zeros((count, 2, 2))  # the sums of d dᵀ over the directions d in which s is held
        follows = np.zeros((count, 2))  # w over s_x and s_y, if w is not free
        for name, support in supports.items():
            if isinstance(support, ElasticEdge) or support == "free":
                continue
            numbers, bend = self.functions.on(mesh.edges[name])
            if support in ("simple", "soft simple"):
                follows[numbers] = -bend.beyond[:, :, None] * bend.outward
            if support != "symmetry":
                still[numbers] = True
            ways = {"clamped": (bend.along, bend.outward), "simple": (bend.along,), "symmetry": (bend.outward,)}
            for direction in ways.get(support, ()):
                np.add.at(held, numbers, direction[..., :, None] * direction[..., None, :])

        strength, axes = np.linalg.eigh(held)
        free = np.stack([strength[:, 0] <= TWO_WAYS * strength[:, 1], strength[:, 1] == 0.0], axis=1)
        axes[free.all(axis=1)] = np.eye(2)
        moves, each = np.flatnonzero(~still), self.each
        rows, columns, entries = [each * moves], [each * moves], [np.ones(moves.size)]
        for s, axis in product(range(1, each, 2), (0, 1)):
            turns = np.flatnonzero(free[:, axis])
            into = axes[turns, :, axis]
            # If w depends on a slope, it depends on that of the last wall.
            after = np.where(still[turns] & (s == each - 2), (follows[turns] * into).sum(axis=1), 0.0)
            rows += [each * turns + s, each * turns + s + 1, each * turns]
            columns += [each * turns + s + axis] * 3
            entries += [into[:, 0], into[:, 1], after]
        remaining, column = np.unique(np.concatenate(columns), return_inverse=True)
        places, shape = (np.concatenate(rows), column), (self.size, remaining.size)
        matrix = sparse.csr_array(sparse.coo_array((np.concatenate(entries), places), shape))
        matrix.eliminate_zeros()
        return matrix

    def deflection(self, points: Vector) -> Matrix:
        """Return the matrix that evaluates w at points, p × 2; a point outside raises a ValueError."""
        return sparse.csr_array(sparse.kron(self.functions.at(points).value, self._w))

    def stiffener(self, stiffener: Stiffener) -> tuple[Matrix, Matrix]:
        """Return M and K of a beam on the last wall: ½ ∫ EI (s·t)'² + GJ (s·n)'² + m ẇ² along it."""
        start, end = np.array(stiffener.start, dtype=float), np.array(stiffener.end, dtype=float)
        step, length = end - start, stiffener.length

        # The integrals run from cell to cell: the parts of the step, from 0 to 1, at which it crosses a side.
        first_ends, last_ends = self.functions.mesh.p[:, self.functions.mesh.facets].transpose(1, 2, 0)
        side, away = last_ends - first_ends, first_ends - start
        turn = step[0] * side[:, 1] - step[1] * side[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            on_way = (away[:, 0] * side[:, 1] - away[:, 1] * side[:, 0]) / turn
            on_side = (away[:, 0] * step[1] - away[:, 1] * step[0]) / turn
        met = (on_way > 0.0) & (on_way < 1.0) & (on_side > -ROUNDING) & (on_side < 1.0 + ROUNDING)
        stops = np.unique(np.concatenate([[0.0, 1.0], on_way[met]]))
        stops = stops[np.append(True, np.diff(stops) > ROUNDING)]
        stops[-1] = 1.0

        place, weights = LINE
        size = np.diff(stops)[:, None]
        part = (stops[:-1, None] + 0.5 * (1.0 + place) * size).ravel()
        weight = sparse.diags_array((0.5 * weights * size * length).ravel())
        reading = self.functions.at(start + part[:, None] * step)
        (x, y), (s_x, s_y) = step / length, self._s[-1][:, None]
        slope = x * reading.slope_x + y * reading.slope_y
        value, bent = sparse.kron(reading.value, self._w), sparse.kron(slope, x * s_x + y * s_y)
        twisted = sparse.kron(slope, x * s_y - y * s_x)
        stiffness = stiffener.bending_stiffness * (bent.T @ weight @ bent)
        stiffness = stiffness + stiffener.torsion_stiffness * (twisted.T @ weight @ twisted)
        return sparse.csr_array(stiffener.mass_per_length * (value.T @ weight @ value)), sparse.csr_array(stiffness)

    def contact(self, radius: float, motions: Matrix, touch: Touch) -> tuple[Vector, float]:
        """Return the vector that spreads a force over a disc of this radius, m, and reads the displacement there, and
        the flexibility that remains, m/N.

        The displacement is the mean of w + e ∇·s₁ − a²/8 ∇·s₂ with the slopes of the first and the last wall. The last
        wall hardly shears, so s₂ is the slope of w, which the mean over the disc needs.
        """
        mesh = self.functions.mesh
        corners = mesh.p[:, mesh.t[:, find_cells(mesh, touch.place[None])[0]]]
        size = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=0).max())
        if size > (good := COARSEST_PATCH * radius):
            caution(
                f"mesh: cells of {readable(size, 'm')} at the contact are too large; use at most {readable(good, 'm')}"
            )

        # Points on rings around the contact
        part, weights = np.polynomial.legendre.leggauss(RINGS)
        reach = radius * np.sqrt((part + 1.0) / 2.0)
        angle = 2.0 * pi * (np.arange(SPOKES) + 0.5) / SPOKES
        away = (reach[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)).reshape(-1, 2)
        for inward in touch.mirrors:  # points beyond a line of symmetry are mirrored
            away = away - 2.0 * np.minimum(away @ inward, 0.0)[:, None] * inward
        reading, weights = self.functions.at(touch.place + away), np.repeat(weights / (2.0 * SPOKES), SPOKES)
        mean = np.outer(weights @ reading.value, self._w)
        for s, bend in ((self._s[0], bending_by_poisson(touch.wall)), (self._s[-1], -(radius**2) / 8.0)):
            mean += bend * (np.outer(weights @ reading.slope_x, s[0]) + np.outer(weights @ reading.slope_y, s[1]))
        return np.asarray(mean.ravel() @ motions), remaining_flexibility(touch.wall, radius)

    def sampled(self, places: Vector) -> tuple[Matrix, Matrix]:
        """Return matrices that evaluate w and κ (three rows) at places of the reference cell, 2 × places, by cell."""
        reading = self.functions.reading(places, np.arange(self.functions.mesh.nelements))
        # Moments are those of all walls together, so curvatures are weighted by the parts of the bending stiffness.
        parts = [[part * k for k in _curvature(s)] for (_, _, part), s in zip(self.walls, self._s, strict=True)]
        x, y = np.sum(parts, axis=0)
        bent = sparse.kron(reading.slope_x, x) + sparse.kron(reading.slope_y, y)
        return sparse.csr_array(sparse.kron(reading.value, self._w)), sparse.csr_array(bent)


def _curvature(s: Vector) -> tuple[Vector, Vector]:
    """Return κ_x and κ_y in κ = ∂x κ_x + ∂y κ_y: (s_x, 0, s_y) and (0, s_y, s_x)."""
    none = np.zeros_like(s[0])
    return np.stack([s[0], none, s[1]]), np.stack([none, s[1], s[0]])
