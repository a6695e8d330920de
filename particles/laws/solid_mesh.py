"""An eighth of a bead in three dimensions: quadratic tetrahedra, graded to the pole where the bead is touched.

The planes of symmetry are x = 0, y = 0 and the mid-plane z = 0; the chain runs along z, a cylinder lies along y.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, pi, sqrt
from typing import Any

import numpy as np
from scipy import sparse
from skfem import Basis, BilinearForm, Dofs, ElementTetP2, ElementVector, MeshHex, MeshTet2
from skfem.helpers import dot

from particles.bead import Bead, Cylinder, Sphere
from particles.laws.axisymmetric_mesh import Whole, graded
from structures.bodies.elasticity import Cells, part_stiffnesses
from structures.checks import short
from structures.structure import Vector

ELEMENT = ElementVector(ElementTetP2())

INTEGRATION_ORDER = 5
"""Exact for products of two quadratic shape functions on straight tetrahedra."""
"""The lowest beyond two whose weights are all positive."""

GROWTH_INSIDE, GROWTH_OUTSIDE = 0.2, 0.7
"""Cells grow by this part of their distance from the pole, where the bead may touch and elsewhere."""

CELLS_ALONG = 4
"""Over half the length of a cylinder; the last of them are the shortest."""

MOST_CELLS = 4000
"""Of six tetrahedra: some 100 000 degrees of freedom, two minutes and 5 GB."""

CORNER = 1.0 / sqrt(2.0)
"""Where the edge of the box that becomes the bead meets the arc, over the radius: at 45° from the pole."""

MIDPLANES = ("symmetric", "antisymmetric")


@dataclass(frozen=True)
class Eighth:
    """An eighth of a bead, and its nodes in the box that it was mapped from, 3 × n, m.

    box: the distances from the pole across and along, which near it are x and y, and the depth.
    """

    bead: Cylinder | Sphere
    mesh: Any
    box: Vector

    @property
    def basis(self) -> Any:
        """The shape functions at all integration points, which take too much memory to be kept."""
        return Basis(self.mesh, ELEMENT, intorder=INTEGRATION_ORDER)

    @cached_property
    def motions(self) -> Whole:
        """3 × nodes: which of all degrees of freedom are their motions along x, y and z."""
        dofs = Dofs(self.mesh, ELEMENT)
        return np.stack([np.concatenate([dofs.nodal_dofs[i], dofs.edge_dofs[i]]) for i in range(3)])

    @cached_property
    def stiffness(self) -> sparse.csr_array:
        """The stiffness of all degrees of freedom, N/m."""
        return part_stiffnesses(self.basis, [self.bead.material], np.zeros(self.mesh.nelements, dtype=np.int64))[0]

    @cached_property
    def mass(self) -> sparse.csr_array:
        """The mass of all degrees of freedom, kg. Contacts and pressed circles do without."""
        even = Cells(self.basis, ring=False).mass(np.ones(self.mesh.nelements))
        along = self.motions[2]
        # Curved edges are parabolas, which lack a little of the arc's mass.
        return even * (0.125 * self.bead.mass / even[along][:, along].sum())

    def touching(self, reach: float) -> Whole:
        """Numbers of the surface's nodes up to `reach`, m, from the pole or, of a cylinder, from its highest line."""
        away = self.box[0] if isinstance(self.bead, Cylinder) else np.hypot(self.box[0], self.box[1])
        nodes: Whole = np.flatnonzero((self.box[2] == 0.0) & (away <= reach * (1.0 + 1e-9)))
        return nodes

    def drop(self, nodes: Whole) -> Vector:
        """Return how far the surface falls away there from the plane that touches it at its pole, m: the arc."""
        x, y, z = self.mesh.doflocs[:, nodes]
        square = x**2 if isinstance(self.bead, Cylinder) else x**2 + y**2
        fall: Vector = square / (self.bead.radius + z)
        return fall


def solid_body(name: str, bead: Bead) -> Cylinder | Sphere:
    """Return `bead`, or raise a ValueError where it is none whose eighth is meshed here."""
    if not isinstance(bead, Cylinder | Sphere):
        raise ValueError(f"{name} = {short(bead)}: must be a Cylinder or a Sphere")
    return bead


def eighth(bead: Cylinder | Sphere, across: Vector, along: Vector, depth: Vector) -> Eighth:
    """Return the mesh between nodes across (to R/√2), along (to L/2, of a sphere to R/√2) and of the depth (to R), m.

    Each cell of the box is six tetrahedra about the diagonal that ends in the corner on the arc, so that none is flat
    where two sides of the box become one smooth surface. All nodes on the surface lie on the arc, mid-side ones too.
    """
    cells = (across.size - 1) * (along.size - 1) * (depth.size - 1)
    if cells > MOST_CELLS:
        raise ValueError(f"spacing: needs {cells} cells; at most {MOST_CELLS} fit, so it must be larger")
    # Of the four diagonals of a cell scikit-fem takes the one that is wanted where the second axis runs backwards.
    flat = MeshTet2.from_mesh(MeshHex.init_tensor(across, -along[::-1], depth).to_meshtet())
    box = np.abs(flat.doflocs)
    return Eighth(bead, replace(flat, doflocs=_placed(bead, *box)), box)


def contact_eighth(bead: Cylinder | Sphere, reach: float, spacing: float, coarser: float = 1.0) -> Eighth:
    """Return the mesh of a bead that may touch up to `reach`, m, from its pole or highest line; spacing, m: of the
    cells there.

    coarser: a factor on the size of all cells.
    """
    across = _from_the_pole(bead.radius * CORNER, reach, spacing, coarser)
    along = across
    if isinstance(bead, Cylinder):
        turns = np.linspace(0.0, 0.5 * pi, ceil(CELLS_ALONG / coarser) + 1)
        along = 0.5 * bead.length * np.sin(turns)
    return eighth(bead, across, along, graded(bead.radius, spacing, coarser, GROWTH_OUTSIDE, 1))


def even_eighth(bead: Sphere, spacing: float) -> Eighth:
    """Return the mesh of a sphere, of cells of about one size, spacing in m, down its axis."""
    cells = max(ceil(bead.radius / spacing * (1.0 - 1e-9)), 2)
    side = np.linspace(0.0, bead.radius, cells + 1)
    return eighth(bead, CORNER * side, CORNER * side, side)


def patch_eighth(bead: Cylinder | Sphere, radius: float, cells: float) -> Eighth:
    """Return the mesh of a bead that is pressed on a circle about its pole, radius in m; cells: their size over it."""
    size, coarser = 0.5 * radius, 2.0 * cells
    across = _from_the_pole(bead.radius * CORNER, radius, size, coarser)
    end = 0.5 * bead.length if isinstance(bead, Cylinder) else bead.radius * CORNER
    along = _from_the_pole(end, min(radius, 0.5 * end), size, coarser)
    return eighth(bead, across, along, graded(bead.radius, size, coarser, GROWTH_OUTSIDE, 1))


def _from_the_pole(length: float, reach: float, spacing: float, coarser: float) -> Vector:
    """Return the nodes from 0 to a length, m, by the growth inside up to the reach and by that outside beyond."""
    inside = graded(reach, spacing, coarser, GROWTH_INSIDE, 1)
    outside = graded(length - reach, spacing + GROWTH_INSIDE * reach, coarser, GROWTH_OUTSIDE, 1)
    return np.append(inside, reach + outside[1:])


def _placed(bead: Cylinder | Sphere, across: Vector, along: Vector, depth: Vector) -> Vector:
    """Return (x, y, z), m, of points of the box: a square becomes a quarter of a disc, a cube an eighth of a ball."""
    radius = bead.radius
    s, t = across / (CORNER * radius), 1.0 - depth / radius
    if isinstance(bead, Cylinder):
        return np.stack([radius * s * np.sqrt(1.0 - t**2 / 2.0), along, radius * t * np.sqrt(1.0 - s**2 / 2.0)])
    r = along / (CORNER * radius)

    def squeezed(x: Vector, y: Vector) -> Vector:
        shrunk: Vector = np.sqrt(1.0 - x**2 / 2.0 - y**2 / 2.0 + x**2 * y**2 / 3.0)
        return shrunk

    return radius * np.stack([s * squeezed(r, t), r * squeezed(t, s), t * squeezed(s, r)])


@dataclass(frozen=True)
class SolidEighth:
    """An eighth of a bead, and what its supports leave free of it.

    stiffness: n × n, N/m; motions: 3 × nodes, the places of their motions along x, y and z among the n, −1 where they
    are held; kept: n, where they are among all of the mesh's.
    """

    part: Eighth
    stiffness: sparse.csr_array
    motions: Whole
    kept: Whole

    @cached_property
    def mass(self) -> sparse.csr_array:
        """n × n, kg."""
        return self.part.mass[self.kept][:, self.kept]

    @cached_property
    def weight(self) -> Vector:
        """n, kg: momentum along the chain by unit rates."""
        # The mid-plane's nodes carry momentum of cells that move, held as they may be.
        weight: Vector = self.part.mass[:, self.part.motions[2]].sum(axis=1)[self.kept]
        return weight


def supported(part: Eighth, midplane: str = "symmetric") -> SolidEighth:
    """Return an eighth of a bead that is free but for its planes of symmetry.

    midplane: "symmetric", which may slide sideways only, or "antisymmetric", which may move along the chain only.
    """
    motions, middle = part.motions, part.box[2] == part.bead.radius
    held = [motions[0][part.box[0] == 0.0], motions[1][part.box[1] == 0.0]]
    held += [motions[2][middle]] if midplane == "symmetric" else [motions[0][middle], motions[1][middle]]
    free = np.setdiff1d(np.arange(motions.size), np.concatenate(held))
    places = np.full(motions.size, -1, dtype=np.int64)
    places[free] = np.arange(free.size)
    return SolidEighth(part, part.stiffness[free][:, free], places[motions], free)


def turning(part: Eighth) -> sparse.csr_array:
    """Return what a turn about the chain's axis changes of a motion u, kg: uᵀDu = ∫ρ |∂u/∂φ − ẑ × u|², of all of the
    mesh's.

    It is m² uᵀMu where u goes around the axis as cos mφ or sin mφ, so 0 for motions of a body of revolution.
    """
    return sparse.csr_array(part.bead.material.density * _turned.assemble(part.basis))


@BilinearForm
def _turned(u: Any, v: Any, w: Any) -> Any:
    forward, backward = (
        w.x[0] * field.grad[:, 1] - w.x[1] * field.grad[:, 0] - np.stack([-field[1], field[0], 0.0 * field[2]])
        for field in (u, v)
    )
    return dot(forward, backward)
