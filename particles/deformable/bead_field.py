"""Displacement and stress inside a bead that is pushed at its poles, by the mode acceleration method.

The bead deforms as if its instantaneous forces accelerated it uniformly. Its modes add only the difference from that
deformation (Williams, Aeronaut. Q. 1 (1949) 123). So the stress at the contacts does not depend on the number of modes.
"""

from math import ceil
from typing import Any, NamedTuple

import numpy as np
from skfem import ElementQuad2

from particles.deformable.vibration import halves, hung, lowest_modes, mode_spacing, vibration
from particles.laws.axisymmetric_mesh import INTEGRATION_ORDER, WIDEST_CONTACT, body_of, cells, graded
from structures.bodies.elastic_field import ElasticSampler
from structures.field import Grid
from structures.linear_algebra.factor import factorise
from structures.structure import Vector

CELLS, BEYOND = 8, 1.25  # cells per radius of the widest contact, and extent of uniform cells in such radii
SHEAR = 5  # index of the stress xz, which is odd about the mid-plane


class Push(NamedTuple):
    """A contact's force on a pole, N, and the radius of the circle of its Hertzian pressure, m."""

    force: float
    radius: float


class BeadField:
    """The fields of one bead in the half-plane (r, 0, z): the struck pole is on top, z > 0. modes: number of elastic
    modes, as in `vibration`. widest: radius of the widest contact, m. grid: points relative to the centre, m, and
    cells.
    """

    def __init__(self, bead: Any, modes: int, widest: float) -> None:
        body: Any = body_of(bead, 1.0, "bead")
        if widest > WIDEST_CONTACT * body.radius:
            raise ValueError(f"widest = {widest!r}: must be at most {WIDEST_CONTACT * body.radius:.3g} m")
        # Uniform cells at the contact; beyond it they grow to the size for the modes. A contact is never a point.
        coarsest = mode_spacing(body, modes)
        finest = min(max(widest, 1e-4 * body.radius) / CELLS, coarsest)
        even = np.linspace(0.0, BEYOND * widest, ceil(BEYOND * widest / finest) + 1)
        width, height = body.extents
        across = np.append(even[:-1], even[-1] + graded(width - even[-1], finest, largest=coarsest))
        down = graded(height, finest, largest=coarsest)
        mesh, along, depth = cells(across, down, lambda along, depth: body.place(along, depth) * [[1.0], [-1.0]])
        # Both kinds of halves.
        opposite, together, axial = halves(mesh, along, depth / body.half, body.material, bead.mass)
        self.halves, self.solves = (opposite, together), (factorise(opposite.stiffness), hung(together))
        surface = np.flatnonzero((depth == 0.0) & (along <= BEYOND * WIDEST_CONTACT * body.radius))
        surface = surface[np.argsort(along[surface])]
        surface = surface[: surface.size - 1 + surface.size % 2]
        self.radii, self.pressed = along[surface], axial[surface]

        # The modes of each half.
        self.vibration = vibration(bead, modes)
        symmetric = np.signbit(self.vibration.far)
        count = int(np.count_nonzero(symmetric))
        alike = lowest_modes(opposite, count, body)[1], lowest_modes(together, modes - count + 1, body)[1][:, 1:]
        self.modes = ((symmetric, alike[0]), (~symmetric, alike[1]))

        # The struck half and its mirror image, whose cells are reordered so that none is inside out.
        unmoved, parts = np.arange(2 * along.size), np.zeros(mesh.nelements, int)
        self.sampler = ElasticSampler(mesh, ElementQuad2, INTEGRATION_ORDER, unmoved, [body.material], parts)
        self.middle = along == along.max()
        grid, far = self.sampler.grid, np.flatnonzero(~self.middle)
        image = np.arange(len(grid.points))
        image[far] = len(grid.points) + np.arange(far.size)
        points = np.concatenate([grid.points, grid.points[far] * [1.0, 1.0, -1.0]])
        turned = image[grid.cells[:, [0, 3, 2, 1, 7, 6, 5, 4, 8]]]
        self.grid = Grid(points, np.concatenate([grid.cells, turned]), grid.kind, np.tile(grid.part, 2), True)

    def at(self, struck: Push, far: Push, amplitude: Vector) -> tuple[Vector, Vector]:
        """Return the displacement relative to the centre of mass, p × 3, m, and the stress xx, yy, zz, xy, yz, xz, Pa.
        struck, far: the pushes on the poles. amplitude: amplitudes of the modes, √kg·m. x is r, and y is the hoop.
        """
        static = self.at_rest(struck, far)
        loads = self._load(struck), self._load(far)
        parts = 0.5 * (loads[0] + loads[1]), 0.5 * (loads[0] - loads[1])
        moved, stressed = [], []
        for half, solve, load, (which, shapes) in zip(self.halves, self.solves, parts, self.modes, strict=True):
            u = half.spread @ (solve(half.spread.T @ load) + shapes @ (amplitude - static)[which])
            moved.append(self.sampler.displacement(u))
            stressed.append(self.sampler.stress(u))
        # A node of the mid-plane has cells of one half only. In the mean of both halves the odd part vanishes.
        stressed[0][self.middle, SHEAR] = 0.0
        stressed[1][self.middle, :SHEAR] = 0.0
        whole = []
        for (opposite, together), mirror in ((moved, [1.0, 1.0, -1.0]), (stressed, [1.0, 1.0, 1.0, 1.0, -1.0, -1.0])):
            whole.append(np.concatenate([opposite + together, ((opposite - together) * mirror)[~self.middle]]))
        return whole[0], whole[1]

    def at_rest(self, struck: Push, far: Push) -> Vector:
        """Return the amplitudes of the modes in a bead that these forces accelerate uniformly, √kg·m."""
        modes = self.vibration
        return np.asarray((modes.struck * struck.force - modes.far * far.force) / modes.frequencies**2)

    def _load(self, push: Push) -> Vector:
        """Return the nodal forces on the struck half, N, for Hertz's pressure, proportional to √(1 − r²/a²)."""
        # With r = a sin φ the integrand is smooth up to the edge: the fraction 3 sin φ cos² φ dφ lies within dφ.
        corners = self.radii[::2]
        edges = np.arcsin(np.minimum(corners / max(push.radius, 1e-12), 1.0))
        half, middle = 0.5 * np.diff(edges)[:, None], 0.5 * (edges[1:] + edges[:-1])[:, None]
        places, weights = np.polynomial.legendre.leggauss(10)
        angle = middle + half * places
        force = push.force * half * weights * 3.0 * np.sin(angle) * np.cos(angle) ** 2
        x = (push.radius * np.sin(angle) - corners[:-1, None]) / np.diff(corners)[:, None]
        shares = np.stack([(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)])
        nodes = np.zeros(self.radii.size)
        for place, part in zip((slice(0, -2, 2), slice(1, None, 2), slice(2, None, 2)), shares, strict=True):
            nodes[place] += (force * part).sum(axis=1)
        load = np.zeros(self.halves[0].spread.shape[0])
        load[self.pressed] = nodes
        return load
