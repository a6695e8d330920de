"""Beads of revolution in finite elements for explicit steps: mesh, stiffness, lumped masses, stable step.

A bead is two halves that mirror each other at its mid-plane. Solid halves are meshed by Möbius' map, under which a
quarter of the unit disc becomes the half-plane of half a ball, its corner the pole: cells grow with their distance from
the pole and none is thinner than those at the contact, which would shorten the stable step.
"""

from dataclasses import dataclass
from math import ceil, log, pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import eigsh
from skfem import Basis, ElementQuad2, MeshQuad, MeshQuad2

from particles.bead import Bead
from particles.deformable.explicit_kernels import TOGETHER
from particles.laws.axisymmetric_mesh import GROWTH, MOST_CELLS, MOST_TOUCHING, Spheroid, Whole, body_of, half_plane
from particles.laws.compliance import INTEGRATION_ORDER, motions
from structures.bodies.elasticity import part_stiffnesses
from structures.checks import instance
from structures.material import Material
from structures.structure import Vector

EIGENVALUE = 1e-6
"""Relative accuracy of the largest eigenvalue."""

JOINED = 1e-8
"""Difference, in the rings' plane, below which a node is on a ring or on a side of the patch."""


@dataclass(frozen=True, eq=False)
class ExplicitBead:
    """One bead of n nodes, as the compiled loops take it.

    starts, columns, blocks: its stiffness in rows of 2 × 2 blocks, N/m; a node's motions are across (r) and along (z)
    the chain. mass: of the nodes, n numbers, kg; held: those on the axis, which do not move across. struck, facing:
    nodes that may touch, from the pole on, of the side towards the striker and of the other; drop: how far these lie
    behind the plane that touches the pole, m. near: the part of each node that belongs to the struck half.
    """

    starts: NDArray[np.int32]
    columns: NDArray[np.int32]
    blocks: Vector
    mass: Vector
    held: NDArray[np.bool_]
    struck: Whole
    facing: Whole
    drop: Vector
    near: Vector
    cells: int
    stable_step: float


def explicit_bead(bead: Bead, reach: float, spacing: float) -> ExplicitBead:
    """Return a bead in quadratic elements, touched up to `reach` (m) from its poles by cells of the size `spacing` (m).

    Masses are lumped by Hinton, Rock and Zienkiewicz's rule and scaled to the bead's own mass. Raises ValueError for
    bodies that are none of revolution about the chain's axis, and for meshes too fine.
    """
    body = instance("beads", body_of(bead, reach, "beads"), Spheroid, "bodies of revolution")
    mesh, surface, middle = half_bead(body, reach, spacing)
    stiffness, right, left = _with_mirror_image(_stiffness(mesh, body.material), middle)
    weight, count = lumped_weights(mesh), stiffness.shape[0] // 2
    mass, radius, near = np.zeros(count), np.empty(count), np.zeros(count)
    np.add.at(mass, right, weight)
    np.add.at(mass, left, weight)
    mass *= bead.mass / mass.sum()
    radius[right] = radius[left] = mesh.doflocs[0]
    near[left] = np.where(middle, 0.5, 1.0)
    held = radius == 0.0
    # Nodes that lie together should be together in memory.
    nodes = sparse.csr_array(abs(stiffness[::2, ::2]) + abs(stiffness[1::2, 1::2]))
    place = np.asarray(reverse_cuthill_mckee(nodes, symmetric_mode=True))
    rank = np.argsort(place)
    dofs = np.column_stack([2 * place, 2 * place + 1]).ravel()
    return ExplicitBead(
        *_in_threes(sparse.bsr_array(stiffness[dofs][:, dofs], blocksize=(2, 2))),
        mass[place],
        held[place],
        rank[left[surface]],
        rank[right[surface]],
        body.drop(mesh.doflocs[0][surface]),
        near[place],
        2 * mesh.nelements,
        stable_step(stiffness, mass, held),
    )


def _stiffness(mesh: Any, material: Material) -> sparse.csr_array:
    """Return the stiffness of a half, 2n × 2n, N/m: a node's motions across and along the axis follow each other."""
    basis, across, along = motions(mesh)
    order = np.column_stack([across, along]).ravel()
    owner = np.zeros(mesh.nelements, dtype=np.int64)
    return sparse.csr_array(part_stiffnesses(basis, [material], owner)[0][order][:, order])


def _in_threes(rows: Any) -> tuple[NDArray[np.int32], NDArray[np.int32], Vector]:
    """Row starts, columns and blocks, with blocks of zeros that make each row's number a multiple of TOGETHER.

    Quadratic cells have rows of 9, 15 and 25 blocks.
    """
    counts = np.diff(rows.indptr)
    rounded = -(-counts // TOGETHER) * TOGETHER
    starts = np.concatenate([[0], np.cumsum(rounded)])
    columns, blocks = np.repeat(np.arange(counts.size), rounded), np.zeros((starts[-1], 2, 2))
    place = np.arange(rows.indices.size) + np.repeat(starts[:-1] - rows.indptr[:-1], counts)
    columns[place], blocks[place] = rows.indices, rows.data
    return starts.astype(np.int32), columns.astype(np.int32), blocks


def half_bead(body: Spheroid, reach: float, spacing: float) -> tuple[Any, Whole, NDArray[np.bool_]]:
    """Return the half of a bead that faces the structure, in quadratic cells in (r, z); which nodes may touch, from the
    pole on, and which lie on the mid-plane. Nodes are at equal steps of r up to `reach`, m, all on the true arc.
    """
    if body.hollow > 0.0:
        plane = half_plane(body, reach, spacing)
        return plane.mesh, plane.surface, plane.along == plane.along.max()
    wide = ceil(reach / spacing * (1.0 - 1e-9))
    deep = max(1, round(wide * body.half / body.radius))
    if max(wide, deep) > MOST_TOUCHING:
        raise ValueError(
            f"spacing = {spacing:.3g}: too small for bodies that may touch up to {reach:.3g} m from the pole; "
            f"must be {reach / MOST_TOUCHING:.3g} m or more"
        )
    # Cells grow by the angle that they take, seen from the pole: then they are about square.
    growth = max(GROWTH, 0.5 * pi / (wide + deep))
    rings = ceil(log(2.0 * body.radius / reach) / growth)
    if (wide * deep + rings * (wide + deep)) > MOST_CELLS:
        raise ValueError(f"spacing = {spacing:.3g}: needs more cells than the {MOST_CELLS} that fit")
    flat = _rings_plane(deep, wide, rings)
    inwards, outwards = flat.doflocs
    place = _in_half_ball(inwards, outwards, reach / body.radius, rings)
    middle = np.maximum(inwards, outwards) == 1.0 + rings
    place[1, middle] = 0.0
    mesh = MeshQuad2(np.array([[body.radius], [body.half]]) * place, flat.t)
    touching = np.flatnonzero((inwards == 0.0) & (outwards <= 1.0))
    return mesh, touching[np.argsort(outwards[touching])], middle


def _rings_plane(deep: int, wide: int, rings: int) -> Any:
    """Return the cells in the plane that `_in_half_ball` maps: the unit square, and rings about it."""
    down, up, out = np.linspace(0.0, 1.0, deep + 1), np.linspace(0.0, 1.0, wide + 1), np.arange(1.0, rings + 2.0)
    outer, above = MeshQuad.init_tensor(out, up), MeshQuad.init_tensor(down, out)
    outer = MeshQuad(np.stack([outer.p[0], outer.p[0] * outer.p[1]]), outer.t)
    above = MeshQuad(np.stack([above.p[0] * above.p[1], above.p[1]]), above.t)
    flat = MeshQuad2.from_mesh(MeshQuad.init_tensor(down, up) + outer + above)
    # scikit-fem rounds the corners of meshes that it joins.
    rounded = np.round(flat.doflocs)
    return MeshQuad2(np.where(abs(flat.doflocs - rounded) < JOINED, rounded, flat.doflocs), flat.t)


def _in_half_ball(inwards: Vector, outwards: Vector, reach: float, rings: int) -> Vector:
    """Return (r, z) in the half-plane of half a unit ball, of points in the rings' plane.

    There the unit square is the patch that may touch, and the ring k, on which max(inwards, outwards) is 1 + k, turns
    from the patch's square edge to the quarter of a circle that Möbius' map makes the mid-plane.
    """
    ring = np.maximum(np.maximum(inwards, outwards), 1.0)
    deep, wide = inwards / ring, outwards / ring
    part = (ring - 1.0) / rings
    corner = np.tan(0.5 * np.arcsin(reach))
    square = corner * deep + 1j * np.tan(0.5 * np.arcsin(reach * wide))
    circle = np.exp(0.25j * pi * (1.0 + wide - deep))
    quarter = corner**-part * ((1.0 - part) * square + part * corner * circle)
    ball = (1.0 - quarter) / (1.0 + quarter)
    return np.stack([np.abs(ball.imag), ball.real])


def lumped_weights(mesh: Any) -> Vector:
    """Return what each node has of the volume of a body of revolution, m³: each cell's, shared as its consistent mass's
    diagonal (Hinton, Rock and Zienkiewicz, Earthquake Eng. Struct. Dyn. 4 (1976) 245)."""
    basis = Basis(mesh, ElementQuad2(), intorder=INTEGRATION_ORDER)
    ring = 2.0 * pi * np.asarray(basis.global_coordinates())[0] * basis.dx
    diagonal = np.stack([(np.asarray(shape[0]) ** 2 * ring).sum(axis=1) for shape in basis.basis])
    share = diagonal / diagonal.sum(axis=0) * ring.sum(axis=1)
    weights = np.zeros(basis.N)
    np.add.at(weights, basis.element_dofs, share)
    return weights


def _with_mirror_image(half: Any, middle: NDArray[np.bool_]) -> tuple[sparse.csr_array, Whole, Whole]:
    """Return the stiffness of a half and its mirror image, and the numbers of the nodes of both, which share the
    mid-plane's."""
    right = np.arange(middle.size)
    left = np.where(middle, right, middle.size - 1 + np.cumsum(~middle))
    size = 2 * (middle.size + np.count_nonzero(~middle))
    entries = sparse.coo_array(half)
    sign = np.where(np.arange(2 * middle.size) % 2 == 0, 1.0, -1.0)
    mirrored = entries.data * sign[entries.row] * sign[entries.col]
    rows = [2 * nodes[entries.row // 2] + entries.row % 2 for nodes in (right, left)]
    columns = [2 * nodes[entries.col // 2] + entries.col % 2 for nodes in (right, left)]
    joined = (np.concatenate([entries.data, mirrored]), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_array(sparse.coo_array(joined, shape=(size, size))), right, left


def stable_step(stiffness: sparse.csr_array, mass: Vector, held: NDArray[np.bool_]) -> float:
    """Return the longest stable step, s, of central differences: 2/ω of the highest frequency.

    Nodes that touch are held together, which raises no frequency: the step is that of the free bead.
    """
    free = np.column_stack([~held, np.ones(held.size, dtype=bool)]).ravel()
    root = sparse.diags_array(1.0 / np.sqrt(np.repeat(mass, 2)[free]))
    scaled = root @ stiffness[free][:, free] @ root
    start = np.random.default_rng(0).normal(size=scaled.shape[0])
    square = eigsh(scaled, 1, which="LA", v0=start, tol=EIGENVALUE, return_eigenvectors=False)[0]
    return 2.0 / sqrt(float(square))
