"""Displacement and stress inside a bead that is pushed at its poles: a static field, and what its modes add to that.

Mode acceleration (Williams, Aeronaut. Q. 1 (1949) 123): under the forces of the moment the whole bead, not its modes
alone, deforms as if it were accelerated evenly, and the modes carry only what their amplitudes differ by from those
of that state. So the stress at the contacts does not depend on the number of modes.
"""

from collections.abc import Callable
from dataclasses import replace
from math import ceil, log1p
from typing import Any, NamedTuple

import numpy as np
from skfem import ElementQuad2, MeshQuad, MeshQuad2

from particles.bead import Bead
from particles.deformable.vibration import Half, Section, lowest_modes, lowest_rate, mode_spacing, vibration
from particles.laws.axisymmetric_mesh import GROWTH, MOST_CELLS, Spheroid, body_of
from particles.laws.compliance import INTEGRATION_ORDER, WIDEST_CONTACT
from structures.bodies.elastic_field import ElasticSampler
from structures.field import Grid
from structures.linear_algebra.factor import factorise
from structures.structure import Vector

CELLS = 8
"""Over the radius of the widest contact."""

BEYOND = 1.25
"""How far the even cells at a contact go, over its radius."""

NARROWEST = 1e-4
"""Radius of a contact over that of the bead, below which cells do not follow it."""

POINTS = 10
"""At which Hertz's pressure is integrated over a cell."""

TINY = 1e-12
"""m; a contact of no radius is a point."""

SHEAR = 5
"""Where the stress in the half-plane that is odd in the mid-plane stands: xz of xx, yy, zz, xy, yz, xz."""


class Push(NamedTuple):
    """A contact's force on a pole, N, and the radius of the circle that it is spread over as Hertz's pressure, m."""

    force: float
    radius: float


class BeadField:
    """The fields of one bead about its axis, in the half-plane (r, 0, z): the pole that is struck is on top, z > 0.

    bead: Sphere, HollowSphere or Ellipsoid(axis="along"). modes: elastic ones, those of `vibration(bead, modes)`.
    widest, m: radius of its widest contact, which has CELLS cells.
    grid: points, p × 3, m, from the bead's centre, and cells. Raises ValueError for contacts as wide as half the bead.
    """

    def __init__(self, bead: Bead, modes: int, widest: float) -> None:
        body = body_of(bead, 1.0, "bead")
        assert isinstance(body, Spheroid)
        if widest > WIDEST_CONTACT * body.radius:
            raise ValueError(
                f"widest = {widest!r}: must be at most {WIDEST_CONTACT * body.radius:.3g} m, half the bead's radius; "
                "strains would not be small"
            )
        self.vibration = vibration(bead, modes)
        mesh, along, depth = _mesh(body, mode_spacing(body, modes), widest)
        section = Section(mesh, along, depth / body.half, body.material, bead.mass)
        surface = np.flatnonzero((depth == 0.0) & (along <= BEYOND * WIDEST_CONTACT * body.radius))
        surface = surface[np.argsort(along[surface])]
        surface = surface[: surface.size - 1 + surface.size % 2]
        self.radii, self.pressed = along[surface], section.along[surface]
        opposite, together = section.half(opposite=True), section.half(opposite=False)
        self.halves, self.solves = (opposite, together), (factorise(opposite.stiffness), _hung(together))
        symmetric = np.signbit(self.vibration.far)
        count, shift = int(np.count_nonzero(symmetric)), lowest_rate(body)
        shapes = (
            lowest_modes(opposite, count, shift)[1],
            lowest_modes(together, modes - count + 1, shift)[1][:, 1:],
        )
        self.modes = ((symmetric, shapes[0]), (~symmetric, shapes[1]))
        self.sampler = ElasticSampler(
            mesh,
            ElementQuad2,
            INTEGRATION_ORDER,
            np.arange(2 * along.size),
            [body.material],
            np.zeros(mesh.nelements, int),
        )
        self.middle = along == along.max()
        self.grid = self._whole_grid()

    def at(self, struck: Push, far: Push, amplitude: Vector) -> tuple[Vector, Vector]:
        """Return the displacement from the unloaded shape about the centre of mass, p × 3, m, and stress, p × 6, Pa.

        struck, far: what presses the two poles, on the struck side and on the other; inwards where positive.
        amplitude: of the modes, √kg·m; see `Vibration`. Stress: xx, yy, zz, xy, yz, xz, where x is r, and y the hoop.
        """
        static = self.at_rest(struck, far)
        loads = self._load(struck), self._load(far)
        parts = 0.5 * (loads[0] + loads[1]), 0.5 * (loads[0] - loads[1])
        moved, stressed = [], []
        for half, solve, load, (which, shapes) in zip(self.halves, self.solves, parts, self.modes, strict=True):
            u = half.spread @ (solve(half.spread.T @ load) + shapes @ (amplitude - static)[which])
            moved.append(self.sampler.displacement(u))
            stressed.append(self.sampler.stress(u))
        # Nodes of the mid-plane know the cells of one half only; the mean of both is without what is odd.
        stressed[0][self.middle, SHEAR] = 0.0
        stressed[1][self.middle, :SHEAR] = 0.0
        return self._whole(moved, [1.0, 1.0, -1.0]), self._whole(stressed, [1.0, 1.0, 1.0, 1.0, -1.0, -1.0])

    def at_rest(self, struck: Push, far: Push) -> Vector:
        """Return the amplitudes of the modes in a bead that these forces accelerate evenly, √kg·m."""
        modes = self.vibration
        amplitude: Vector = (modes.struck * struck.force - modes.far * far.force) / modes.frequencies**2
        return amplitude

    def _load(self, push: Push) -> Vector:
        """Return the forces on the nodes of the struck half, N, all along the chain, of Hertz's pressure √(1 − r²/a²).

        With r = a sin φ it is smooth up to its edge: 3 sin φ cos² φ dφ of the force lies between φ and φ + dφ.
        """
        corners = self.radii[::2]
        edges = np.arcsin(np.minimum(corners / max(push.radius, TINY), 1.0))
        half, middle = 0.5 * np.diff(edges)[:, None], 0.5 * (edges[1:] + edges[:-1])[:, None]
        places, weights = np.polynomial.legendre.leggauss(POINTS)
        angle = middle + half * places
        force = push.force * half * weights * 3.0 * np.sin(angle) * np.cos(angle) ** 2
        x = (push.radius * np.sin(angle) - corners[:-1, None]) / np.diff(corners)[:, None]
        shares = np.stack([(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)])
        of_cells = (force * shares).sum(axis=2)
        nodes = np.zeros(self.radii.size)
        for place, part in zip((slice(0, -2, 2), slice(1, None, 2), slice(2, None, 2)), of_cells, strict=True):
            nodes[place] += part
        load = np.zeros(self.halves[0].spread.shape[0])
        load[self.pressed] = nodes
        return load

    def _whole_grid(self) -> Grid:
        """Return the struck half, and its mirror image, whose cells are turned so that none is inside out."""
        grid = self.sampler.grid
        far = np.flatnonzero(~self.middle)
        image = np.arange(len(grid.points))
        image[far] = len(grid.points) + np.arange(far.size)
        points = np.concatenate([grid.points, grid.points[far] * [1.0, 1.0, -1.0]])
        turned = image[grid.cells[:, [0, 3, 2, 1, 7, 6, 5, 4, 8]]]
        return Grid(points, np.concatenate([grid.cells, turned]), grid.kind, np.tile(grid.part, 2), True)

    def _whole(self, parts: list[Vector], mirror: list[float]) -> Vector:
        """Return a field of both halves from that with opposite poles and that with poles that move together."""
        opposite, together = parts
        far: Vector = ((opposite - together) * mirror)[~self.middle]
        return np.concatenate([opposite + together, far])


def _hung(half: Half) -> Callable[[Vector], Vector]:
    """Return the motion about the centre of mass under a load, in the frame of a bead that it accelerates evenly."""
    held = np.delete(np.arange(half.along.size), half.pole)
    solve, weight = factorise(half.stiffness[held][:, held]), half.weight
    mass = float(half.along @ weight)

    def motion(load: Vector) -> Vector:
        balanced, moved = load - weight * float(half.along @ load) / mass, np.zeros(half.along.size)
        moved[held] = solve(balanced[held])
        return moved - half.along * float(weight @ moved) / mass

    return motion


def _mesh(body: Spheroid, coarsest: float, widest: float) -> tuple[Any, Vector, Vector]:
    """Return the struck half, z into it and 0 at the mid-plane: quadratic cells, even at the contact, beyond it growing
    up to `coarsest`, m. And of each node where it is along the surface, and how deep below it, m; see
    `Spheroid.place`."""
    width, height = body.extents
    finest = min(max(widest, NARROWEST * body.radius) / CELLS, coarsest)
    even = np.linspace(0.0, BEYOND * widest, ceil(BEYOND * widest / finest) + 1)
    across = np.append(even[:-1], even[-1] + _growing(width - even[-1], finest, coarsest))
    down = _growing(height, finest, coarsest)
    if across.size * down.size > MOST_CELLS:
        raise ValueError(f"widest = {widest:.3g}: needs {across.size * down.size} cells; at most {MOST_CELLS} fit")
    flat = MeshQuad2.from_mesh(MeshQuad.init_tensor(across, down))
    along, depth = flat.doflocs
    return replace(flat, doflocs=body.place(along, depth) * [[1.0], [-1.0]]), along, depth


def _growing(length: float, first: float, last: float) -> Vector:
    """Return the nodes from 0 to a length, m: cells of the size first + GROWTH · distance, and of `last` at most."""
    far = min((last - first) / GROWTH, length)
    near = log1p(GROWTH * far / first) / GROWTH
    cells = near + (length - far) / last
    steps = np.linspace(0.0, cells, max(ceil(cells), 2) + 1)
    nodes: Vector = np.where(
        steps < near, first / GROWTH * np.expm1(GROWTH * np.minimum(steps, near)), far + (steps - near) * last
    )
    nodes[-1] = length
    return nodes
