"""Half-planes (r, z) of bodies of revolution that are touched at a pole: quadratic cells, graded to the contact."""

from dataclasses import dataclass, replace
from math import ceil, cos, log1p, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import MeshQuad, MeshQuad2

from particles.bead import Bead, Ellipsoid, HollowSphere, Sphere
from structures.material import Material
from structures.structure import Vector
from structures.surface import Surface

Whole = NDArray[np.int64]

GROWTH = 0.2
"""Cells grow by this part of their distance from the contact."""

LARGE = 1e4
"""Extent of what stands for a half-space, over the reach of the contact; its far sides are held."""

MOST_TOUCHING = 400
"""Cells in a row that may touch, each two nodes to press one by one: a minute."""

MOST_CELLS = 40_000
"""Of one body: some 330 000 degrees of freedom."""

STEEPEST = 0.25 * pi
"""The angle from the pole up to which nodes lie at equal steps of r; beyond, at equal steps of the angle."""


@dataclass(frozen=True)
class Spheroid:
    """Upper half of a bead: radius and half its height, m; hollow: inner over outer radius, 0 where solid."""

    material: Material
    radius: float
    half: float
    hollow: float = 0.0

    @property
    def extents(self) -> tuple[float, float]:
        """The reach of the mesh along the surface, and along the axis, m."""
        return self.radius * (sin(STEEPEST) + (0.5 * pi - STEEPEST) * cos(STEEPEST)), self.half * (1.0 - self.hollow)

    def place(self, along: Vector, depth: Vector) -> Vector:
        """Return (r, z), m, of points on the surface, at `along` (m; r near the pole), and below it, at `depth`."""
        steps = along / self.radius
        steep = STEEPEST + (steps - sin(STEEPEST)) / cos(STEEPEST)
        angle = np.where(steps < sin(STEEPEST), np.arcsin(np.minimum(steps, 1.0)), steep)
        inwards = 1.0 - depth / self.half
        return np.stack([self.radius * inwards * np.sin(angle), self.half * inwards * np.cos(angle)])

    def drop(self, r: Vector) -> Vector:
        """Return how far the surface falls away from the plane that touches it at its pole, m: the arc, without
        expansion."""
        x = r / self.radius
        fall: Vector = self.half * x**2 / (1.0 + np.sqrt(1.0 - x**2))
        return fall


@dataclass(frozen=True)
class Block:
    """A block that stands for a half-space, whose surface may be an arc for the gap: extent in m, curvature in 1/m."""

    material: Material
    extent: float
    curvature: float

    @property
    def extents(self) -> tuple[float, float]:
        """The reach of the mesh along the surface, and along the axis, m."""
        return self.extent, self.extent

    def place(self, along: Vector, depth: Vector) -> Vector:
        """Return (r, z), m, of points at a radius and a depth, m."""
        return np.stack([along, -depth])

    def drop(self, r: Vector) -> Vector:
        """Return how far the surface falls away from the plane that touches it at its pole, m: the arc, without
        expansion."""
        fall: Vector = self.curvature * r**2 / (1.0 + np.sqrt(1.0 - (self.curvature * r) ** 2))
        return fall


Body = Spheroid | Block


@dataclass(frozen=True)
class HalfPlane:
    """A mesh in (r, z) of quadratic cells, and its nodes: `along` and `depth` as in `Body.place`, m, n each.

    reach, m: how far from the pole the body may touch.
    """

    mesh: Any
    along: Vector
    depth: Vector
    reach: float

    @property
    def surface(self) -> Whole:
        """Numbers of the nodes that may touch, from the pole on."""
        touching = np.flatnonzero((self.depth == 0.0) & (self.along <= self.reach * (1.0 + 1e-9)))
        nodes: Whole = touching[np.argsort(self.along[touching])]
        return nodes


def body_of(bead: Bead | Surface, widest: float, name: str) -> Body:
    """Return the body of revolution that a bead or a surface is, for contacts up to a radius `widest`, m.

    Raises ValueError, with the argument's name, for bodies that are none about the chain's axis.
    """
    if isinstance(bead, Sphere):
        return Spheroid(bead.material, bead.radius, bead.radius)
    if isinstance(bead, HollowSphere):
        return Spheroid(bead.material, bead.radius, bead.radius, bead.inner_radius / bead.radius)
    if isinstance(bead, Ellipsoid) and bead.axis == "along":
        return Spheroid(bead.material, bead.radius, 0.5 * bead.length)
    if isinstance(bead, Surface) and bead.second_curvature == bead.curvature:
        return Block(bead.material, LARGE * widest, bead.curvature)
    raise ValueError(
        f"{name} = {bead!r}: must be a body of revolution about the chain's axis: Sphere, HollowSphere, "
        "Ellipsoid(..., axis='along') or a Surface of one curvature"
    )


def half_plane(body: Body, reach: float, spacing: float, coarser: float = 1.0) -> HalfPlane:
    """Return a body's mesh: nodes at equal steps of r up to `reach`, m, from there and downwards growing by GROWTH.

    spacing, m: size of the cells that may touch. coarser: a factor on the size of all cells. The nodes up to `reach`
    are those of every body, whatever its size, so that those of two bodies face each other; all lie on the arc.
    """
    width, height = body.extents
    if reach > MOST_TOUCHING * spacing * coarser:
        raise ValueError(
            f"spacing = {spacing:.3g}: too small for bodies that may touch up to {reach:.3g} m from the pole; "
            f"must be {reach / MOST_TOUCHING:.3g} m or more"
        )
    even = np.linspace(0.0, reach, ceil(reach / spacing / coarser * (1.0 - 1e-9)) + 1)
    across = np.append(even[:-1], reach + graded(width - reach, spacing, coarser))
    down = graded(height, spacing, coarser)
    if across.size * down.size > MOST_CELLS:
        raise ValueError(f"spacing = {spacing:.3g}: needs {across.size * down.size} cells; at most {MOST_CELLS} fit")
    flat = MeshQuad2.from_mesh(MeshQuad.init_tensor(across, down))
    along, depth = flat.doflocs
    return HalfPlane(replace(flat, doflocs=body.place(along, depth)), along, depth, reach)


def graded(length: float, first: float, coarser: float) -> Vector:
    """Return the nodes from 0 to a length, m: cells of the size coarser · (first + GROWTH · distance)."""
    cells = log1p(GROWTH * length / first)
    count = max(ceil(cells / GROWTH / coarser), 2)
    nodes: Vector = first / GROWTH * np.expm1(cells * np.linspace(0.0, 1.0, count + 1))
    nodes[-1] = length
    return nodes
