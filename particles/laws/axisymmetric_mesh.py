"""Bodies of revolution with a contact at a pole: meshes of quadratic cells (r, z), and compliance of the surface."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, cos, inf, log1p, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementQuad2, ElementVector, MeshQuad, MeshQuad2

from particles.bead import Bead, Ellipsoid, HollowSphere, Sphere
from structures.bodies.elasticity import part_stiffnesses
from structures.linear_algebra.factor import compliance_at
from structures.material import Material
from structures.structure import Vector
from structures.surface import Surface

Whole = NDArray[np.int64]
GROWTH = 0.2  # growth of cells per distance from the contact
# The most cells in a row that may touch: the forces on their nodes take a minute. The most cells of one body: they have
# about 330 000 degrees of freedom.
MOST_TOUCHING, MOST_CELLS = 400, 40_000
# The angle from the pole up to which nodes are at equal steps of r; beyond, they are at equal steps of the angle.
STEEPEST = 0.25 * pi
INTEGRATION_ORDER = 5  # exact for the mass matrix of rectangular quadratic elements with the weight r
# Radius of a contact over that of the body, up to which half a bead pressed along its axis is a valid model.
WIDEST_CONTACT = 0.5


@dataclass(frozen=True)
class Spheroid:
    """The upper half of a spheroidal bead."""

    material: Material
    radius: float  # m
    half: float  # half the height, m
    hollow: float = 0.0  # inner over outer radius

    @property
    def extents(self) -> tuple[float, float]:
        """The extents of the mesh along the surface and along the axis, m."""
        return self.radius * (sin(STEEPEST) + (0.5 * pi - STEEPEST) * cos(STEEPEST)), self.half * (1.0 - self.hollow)

    def place(self, along: Vector, depth: Vector) -> Vector:
        """Return (r, z), m, of points at `along` (m; r near the pole) on the surface and at `depth` (m) below it."""
        steps = along / self.radius
        steep = STEEPEST + (steps - sin(STEEPEST)) / cos(STEEPEST)
        angle = np.where(steps < sin(STEEPEST), np.arcsin(np.minimum(steps, 1.0)), steep)
        inwards = 1.0 - depth / self.half
        return np.stack([self.radius * inwards * np.sin(angle), self.half * inwards * np.cos(angle)])

    def drop(self, r: Vector) -> Vector:
        """Return the distance of the surface from the plane that touches it at its pole, m."""
        x = r / self.radius
        return np.asarray(self.half * x**2 / (1.0 + np.sqrt(1.0 - x**2)))


@dataclass(frozen=True)
class Block:
    """A block that represents a half-space; its curvature (1/m) acts only on the gap. extent: m."""

    material: Material
    extent: float
    curvature: float

    @property
    def extents(self) -> tuple[float, float]:
        return self.extent, self.extent

    def place(self, along: Vector, depth: Vector) -> Vector:
        return np.stack([along, -depth])

    def drop(self, r: Vector) -> Vector:
        return np.asarray(self.curvature * r**2 / (1.0 + np.sqrt(1.0 - (self.curvature * r) ** 2)))


Body = Spheroid | Block


def body_of(bead: Bead | Surface, widest: float, name: str) -> Body:
    """Return the body of revolution of a bead or a surface, for contacts up to a radius `widest`, m."""
    if isinstance(bead, Sphere | HollowSphere):
        hollow = bead.inner_radius / bead.radius if isinstance(bead, HollowSphere) else 0.0
        return Spheroid(bead.material, bead.radius, bead.radius, hollow)
    if isinstance(bead, Ellipsoid) and bead.axis == "along":
        return Spheroid(bead.material, bead.radius, 0.5 * bead.length)
    if isinstance(bead, Surface) and bead.second_curvature == bead.curvature:
        return Block(bead.material, 1e4 * widest, bead.curvature)
    raise ValueError(f"{name} = {bead!r}: must be a Sphere, HollowSphere, Ellipsoid along the chain or round Surface")


def cells(across: Vector, down: Vector, place: Callable[[Vector, Vector], Vector]) -> tuple[Any, Vector, Vector]:
    """Return quadratic cells between places along the surface and depths below it, and both for each node."""
    if (count := across.size * down.size) > MOST_CELLS:
        raise ValueError(f"spacing: must be larger; it makes {count} cells, at most {MOST_CELLS} are possible")
    flat = MeshQuad2.from_mesh(MeshQuad.init_tensor(across, down))
    along, depth = flat.doflocs
    return replace(flat, doflocs=place(along, depth)), along, depth


def graded(length: float, first: float, coarser: float = 1.0, largest: float = inf) -> Vector:
    """Return nodes from 0 to a length, m, with cells of size coarser · (first + GROWTH · distance), up to `largest`."""
    far = min((largest - first) / GROWTH, length)
    near = log1p(GROWTH * far / first) / GROWTH
    count = near + (length - far) / largest
    steps = np.linspace(0.0, count, max(ceil(count / coarser), 2) + 1)
    growing = first / GROWTH * np.expm1(GROWTH * np.minimum(steps, near))
    nodes = growing if largest == inf else np.where(steps < near, growing, far + (steps - near) * largest)
    nodes[-1] = length
    return nodes


def motions(mesh: Any) -> tuple[Any, Whole, Whole]:
    """Return the basis of motions of quadratic cells, and the numbers of motions across and along the axis."""
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=INTEGRATION_ORDER)
    across, along = (np.concatenate([basis.nodal_dofs[i], basis.facet_dofs[i], basis.interior_dofs[i]]) for i in (0, 1))
    return basis, across, along


def surface_compliance(body: Body, reach: float, spacing: float, coarser: float = 1.0) -> tuple[Vector, Vector]:
    """Return the distances of nodes that may touch from the axis, m, and their motions for unit forces on rings, m/N.
    Up to `reach`, m, nodes are at equal steps of r, so that those of two bodies face each other; beyond, cells grow.
    The mid-plane slides sideways. The far sides of a half-space are held.
    """
    width, height = body.extents
    if reach > MOST_TOUCHING * spacing * coarser:
        raise ValueError(f"spacing = {spacing:.3g}: must be {reach / MOST_TOUCHING:.3g} m or more")
    even = np.linspace(0.0, reach, ceil(reach / spacing / coarser * (1.0 - 1e-9)) + 1)
    outwards = np.append(even[:-1], reach + graded(width - reach, spacing, coarser))
    mesh, place, depth = cells(outwards, graded(height, spacing, coarser), body.place)
    touching = np.flatnonzero((depth == 0.0) & (place <= reach * (1.0 + 1e-9)))
    touching = touching[np.argsort(place[touching])]

    # All nodes at the centre of a solid bead are at one place, which axis and mid-plane hold.
    basis, across, axial = motions(mesh)
    end, bottom = place == place.max(), depth == depth.max()
    held = [across[place == 0.0], axial[end]]
    held += [across[end]] if isinstance(body, Block) else []
    held += [across[bottom], axial[bottom]] if isinstance(body, Block) or body.hollow == 0.0 else []
    free = np.setdiff1d(np.arange(basis.N), np.concatenate(held))
    stiffness = part_stiffnesses(basis, [body.material], np.zeros(mesh.nelements, dtype=np.int64))[0]
    compliance = compliance_at(stiffness[free][:, free], np.searchsorted(free, axial[touching]))
    return place[touching], 0.5 * (compliance + compliance.T)
