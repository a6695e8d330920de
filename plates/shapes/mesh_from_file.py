"""Meshes of plates from files: what meshio reads, checked to be flat and whole, with its tags as names of edges."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from skfem import MeshQuad, MeshTri

from plates.shapes.mesh_geometry import tangents
from plates.shapes.shape import Cells, PlateMesh
from structures.caution import caution
from structures.checks import count_of, positive
from structures.meshes.mesh_files import read_mesh, source_of
from structures.meshes.mesh_reading import (
    FLAT_CORNERS,
    Numbers,
    Tag,
    Tags,
    box_of,
    cells_of,
    check_scale,
    names,
    near,
    points_of,
    tagged_facets,
    used,
)
from structures.meshes.mesh_topology import check_joined, merged, once
from structures.meshes.split_cells import QUADRILATERAL, TRIANGLE, edge_lengths, triangles
from structures.structure import Vector
from structures.units import readable

THINNEST = 2e-4
"""A plate thinner than this part of its length is probably in millimetres."""

OUT_OF_PLANE = 1e-6
"""Points may lie out of the plane by this part of the longest side."""

FOLDED = 1e-9
"""Cells with an angle at a corner below this, rad, or above half a turn, are flat or folded."""

STEEPEST = 0.9
"""Component of the normal along the x axis of the mesh above which the plate's x axis is the mesh's y axis."""

TOO_LONG = 1.5
"""Sides of a mesh from a file may be longer than the coarsest cell that the waves require by this factor."""

LINES = {"line": 2, "line3": 2}


class FlatMesh:
    """A flat mesh of triangles or quadrilaterals from a file or a meshio.Mesh, for a plate of a thickness in m.

    scale: m per unit of the mesh; None is 1, for meshes whose size is plausible in m. merge: distance, m, within which
    points become one. tags: name of the data that numbers the sides. A mesh in another plane than that of x and y is
    turned into it; triangles and quadrilaterals together become triangles. Raises ValueError for a mesh that cannot be
    a plate.
    """

    kind, fixed = "panel", True

    def __init__(
        self,
        source: Any,
        thickness: float,
        scale: float | None = None,
        merge: float | None = None,
        tags: str | None = None,
    ) -> None:
        self.scale = 1.0 if scale is None else positive("scale", scale, "m per unit of the mesh")
        self.merge, self.tags = merge, tags
        self.source = source_of(source)
        read = read_mesh(source)
        points = self.scale * points_of(read, flat=True)
        cells = _faces(read)
        count = cells.shape[1]
        sides = TRIANGLE if count == 3 else QUADRILATERAL
        alias = merged(points, np.unique(cells), float(edge_lengths(points, cells, sides).min()), merge)
        cells = once(alias[cells], count)[0]
        points, cells, number = used(points, cells, count, alias)
        thin = bool(thickness < THINNEST * np.ptp(points, axis=0).max())
        check_scale(points, thin, f"with a thickness of {thickness:.3g} m", scale)
        points = _in_its_plane(points)
        cells = _upright(points, cells)
        check_joined(points, cells, sides, float(edge_lengths(points, cells, sides).min()))
        make = MeshTri if count == 3 else MeshQuad
        mesh = make(np.ascontiguousarray(points[:, :2].T), np.ascontiguousarray(cells.T))
        self._tags: Tags = tagged_facets(read, mesh, number, LINES, tags)
        self._mesh = PlateMesh(mesh, self._tags.groups)

    def check_edge(self, name: Tag) -> None:
        """Raise a ValueError for an edge that does not exist or has no side; warn where it leaves sides out."""
        self._tags.of("supports", name)

    @property
    def names(self) -> list[Tag]:
        """The names and numbers of the edges."""
        return list(self._mesh.edges)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least and greatest x, least and greatest y, m."""
        (left, bottom), (right, top) = self._mesh.mesh.p.min(axis=1), self._mesh.mesh.p.max(axis=1)
        return float(left), float(right), float(bottom), float(top)

    @property
    def area(self) -> float:
        """m²."""
        x, y = self._mesh.mesh.p[:, self._mesh.mesh.t]
        # scikit-fem sorts the corners of triangles, so that some are clockwise.
        return float(np.abs((x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0)).sum(axis=0)).sum() / 2.0)

    def directions(self, name: Tag) -> Vector:
        """Return the angles of the sides of an edge from the x axis, rad."""
        along = tangents(self._mesh.mesh, self._mesh.edges[name])
        return np.asarray(np.arctan2(along[:, 1], along[:, 0]))

    def mesh(self, x: ArrayLike, y: ArrayLike, cells: Cells) -> PlateMesh:
        """Return the same mesh for all contact points; warn where it is coarser than the waves require."""
        mesh = self._mesh.mesh
        longest = float(np.linalg.norm(np.diff(mesh.p[:, mesh.facets], axis=1)[:, 0], axis=0).max())
        if longest > TOO_LONG * cells.coarsest:
            caution(
                f"mesh: edges of up to {readable(longest, 'm')} are too long for the waves that beads excite; "
                f"refine them to {readable(cells.coarsest, 'm')}"
            )
        return self._mesh

    def described(self) -> dict[str, Any]:
        """Return the source of the mesh, as plain data."""
        edges = {str(name): self._sides(name) for name in self._mesh.edges}
        said: dict[str, Any] = {
            "mesh": self.source, "scale": self.scale, "cells": self._mesh.mesh.nelements, "edges": edges,
        }  # fmt: skip
        return said | {name: value for name, value in (("merge", self.merge), ("tags", self.tags)) if value is not None}

    def _sides(self, name: Tag) -> str:
        """Return the number of sides of an edge, and their length."""
        ends = self._mesh.mesh.p[:, self._mesh.mesh.facets[:, self._mesh.edges[name]]]
        return f"{count_of(ends.shape[2], 'side')}, {np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0).sum():.4g} m"

    def summary(self) -> str:
        """Return the size and mesh in a few words."""
        left, right, bottom, top = self.box
        return f"{right - left:.4g} × {top - bottom:.4g} m, {count_of(self._mesh.mesh.nelements, 'cell')}"

    def __repr__(self) -> str:
        return f"<FlatMesh: {self.summary()}, from {self.source}>"


def _faces(source: Any) -> Numbers:
    """Return the corners of the cells that fill the plate; triangles where the file has quadrilaterals as well."""
    kinds = {block.type for block in source.cells if block.type not in ("vertex", *LINES) and len(block.data)}
    solid = sorted(kinds - set(FLAT_CORNERS))
    if solid:
        raise ValueError(f"mesh: has cells of type {names(solid)}; a panel's mesh is flat, see solid(...) for bodies")
    if not kinds:
        raise ValueError("mesh: has neither triangles nor quadrilaterals; mesh the surface, and save it")
    for kind in sorted(kinds - {"triangle", "quad"}):
        caution(f"mesh: midpoints of {kind} are dropped, so edges become straight between corners")
    faces: dict[int, list[Numbers]] = {3: [], 4: []}
    for i, block in enumerate(source.cells):
        if block.type in kinds:
            faces[FLAT_CORNERS[block.type]].append(cells_of(source, i)[:, : FLAT_CORNERS[block.type]])
    if not (faces[3] and faces[4]):
        return np.concatenate(faces[3] or faces[4])
    quadrilaterals = np.concatenate(faces[4])
    caution(f"mesh: its quadrilaterals, {len(quadrilaterals)}, are split, as it has triangles as well")
    return np.concatenate([*faces[3], *triangles(quadrilaterals)])


def _in_its_plane(points: Vector) -> Vector:
    """Return the points with x and y in the plane of the mesh, m; raise a ValueError where they lie in none.

    The x axis of the plate is that of the mesh, seen along the normal of the plane, and its y axis points to larger
    coordinates. A plane that is almost normal to the mesh's x axis takes the y axis in its place.
    """
    sides = np.ptp(points, axis=0)
    if sides[2] <= OUT_OF_PLANE * sides.max():
        return points
    normal = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][2]
    if np.ptp(points @ normal) > OUT_OF_PLANE * sides.max():
        raise ValueError(f"mesh: is not flat, its box is {box_of(points)} m; must lie in a plane")
    # Axes of coordinates in the plane stay exact.
    normal = np.where(np.abs(normal) < OUT_OF_PLANE, 0.0, normal)
    normal = normal / np.linalg.norm(normal)
    along = np.eye(3)[0 if abs(normal[0]) < STEEPEST else 1]
    x = along - (along @ normal) * normal
    x = x / np.linalg.norm(x)
    y = np.cross(normal, x)
    y = y * np.sign(y[np.abs(y).argmax()])
    caution(
        f"mesh: lies in the plane through {near(points[:1])} with the normal {_direction(np.cross(x, y))}; the plate's "
        f"x axis is {_direction(x)} of the mesh, and its y axis {_direction(y)}"
    )
    return np.column_stack([points @ x, points @ y, np.zeros(len(points))])


def _direction(axis: Vector) -> str:
    return f"({', '.join(f'{part + 0.0:.3g}' for part in np.round(axis, 9))})"


def _upright(points: Vector, cells: Numbers) -> Numbers:
    """Return the cells anticlockwise; raise a ValueError where some are flat or folded."""
    at = points[cells][:, :, :2]
    back, ahead = np.roll(at, 1, axis=1) - at, np.roll(at, -1, axis=1) - at
    sine = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    sine = sine / np.maximum(np.linalg.norm(back, axis=2) * np.linalg.norm(ahead, axis=2), np.finfo(float).tiny)
    upright, inverted = (sine > FOLDED).all(axis=1), (sine < -FOLDED).all(axis=1)
    bad = np.flatnonzero(~upright & ~inverted)
    if bad.size:
        raise ValueError(
            f"mesh: {bad.size} of {len(at)} cells are flat or folded, the first near {near(points[cells[bad[0]]])}"
        )
    if inverted.any() and upright.any():
        caution(
            f"mesh: {inverted.sum()} of {len(at)} cells are numbered clockwise, the others not; they are turned over"
        )
    return np.where(inverted[:, None], cells[:, ::-1], cells)
