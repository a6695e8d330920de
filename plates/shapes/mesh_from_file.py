"""Meshes of plates from files, with checks that they are flat and whole. Tags are names of edges."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from skfem import MeshQuad, MeshTri

from plates.shapes.mesh_geometry import tangents
from plates.shapes.shape import Cells, PlateMesh
from structures.caution import caution
from structures.checks import count_of
from structures.meshes import mesh_reading as reading
from structures.meshes.mesh_files import read_mesh, source_of
from structures.meshes.mesh_reading import FLAT_CORNERS, Numbers, Tag, Tags, names, near
from structures.meshes.mesh_topology import QUADRILATERAL, TRIANGLE, check_joined, edge_lengths, without_duplicates
from structures.structure import Vector
from structures.units import readable

THINNEST = 2e-4  # A mesh whose thickness is a smaller fraction of its length is probably in millimetres
OUT_OF_PLANE = 1e-6  # Points may be out of the plane by this fraction of the longest side
FOLDED = 1e-9  # Cells with a corner angle below this, rad, or above half a turn, are flat or folded
TOO_LONG = 1.5  # Sides may exceed the coarsest cell that the waves require by this factor
LINES = {"line": 2, "line3": 2}


class FlatMesh:
    """A flat mesh of triangles or quadrilaterals from a file or a meshio.Mesh, for a plate of a thickness in m.

    scale, tags: as in `mindlin_panel`. The mesh lies in the plane of x and y. If it has triangles and quadrilaterals,
    all become triangles. A mesh that cannot be a plate raises a ValueError.
    """

    kind, fixed = "panel", True

    def __init__(self, source: Any, thickness: float, scale: float | None, tags: str | None) -> None:
        read, factor = read_mesh(source), 1.0 if scale is None else scale
        self._stated = {"mesh": source_of(source), "scale": factor} | ({} if tags is None else {"tags": tags})
        points, cells = factor * reading.points_of(read, flat=True), _faces(read)
        count = cells.shape[1]
        sides = TRIANGLE if count == 3 else QUADRILATERAL
        points, cells, number = reading.used(points, without_duplicates(cells, count)[0], count)
        thin = bool(thickness < THINNEST * np.ptp(points, axis=0).max())
        reading.check_scale(points, thin, f"with a thickness of {thickness:.3g} m", scale)
        if np.ptp(points[:, 2]) > OUT_OF_PLANE * np.ptp(points, axis=0).max():
            raise ValueError(f"mesh: its box is {reading.box_of(points)} m; must be flat, in the plane of x and y")
        cells = _upright(points, cells)
        check_joined(points, cells, sides, float(edge_lengths(points, cells, sides).min()))
        make = MeshTri if count == 3 else MeshQuad
        mesh = make(np.ascontiguousarray(points[:, :2].T), np.ascontiguousarray(cells.T))
        self.tags: Tags = reading.tagged_facets(read, mesh, number, LINES, tags)
        self._mesh = PlateMesh(mesh, self.tags.groups)

    @property
    def box(self) -> tuple[float, float, float, float]:
        (left, bottom), (right, top) = self._mesh.mesh.p.min(axis=1), self._mesh.mesh.p.max(axis=1)
        return float(left), float(right), float(bottom), float(top)

    @property
    def area(self) -> float:
        x, y = self._mesh.mesh.p[:, self._mesh.mesh.t]
        # scikit-fem sorts the corners of triangles, so that some are clockwise.
        return float(np.abs((x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0)).sum(axis=0)).sum() / 2.0)

    def directions(self, name: Tag) -> Vector:
        along = tangents(self._mesh.mesh, self._mesh.edges[name])
        return np.asarray(np.arctan2(along[:, 1], along[:, 0]))

    def mesh(self, x: ArrayLike, y: ArrayLike, cells: Cells) -> PlateMesh:
        """Return the same mesh for all contacts; warn if it is coarser than the waves require."""
        mesh = self._mesh.mesh
        longest = float(np.linalg.norm(np.diff(mesh.p[:, mesh.facets], axis=1)[:, 0], axis=0).max())
        if longest > TOO_LONG * cells.coarsest:
            caution(f"mesh: edges of up to {readable(longest, 'm')} are too long; use {readable(cells.coarsest, 'm')}")
        return self._mesh

    def described(self) -> dict[str, Any]:
        mesh, edges = self._mesh.mesh, {}
        for name, facets in self._mesh.edges.items():
            start, end = mesh.p[:, mesh.facets[:, facets]].transpose(1, 0, 2)
            length = np.linalg.norm(end - start, axis=0).sum()
            edges[str(name)] = f"{count_of(facets.size, 'side')}, {length:.4g} m"
        return {**self._stated, "cells": mesh.nelements, "edges": edges}

    def summary(self) -> str:
        left, right, bottom, top = self.box
        return f"{right - left:.4g} × {top - bottom:.4g} m, {count_of(self._mesh.mesh.nelements, 'cell')}"


def _faces(source: Any) -> Numbers:
    """Return the corners of the cells of the plate: only triangles if the file has both kinds."""
    kinds = {block.type for block in source.cells if block.type not in ("vertex", *LINES) and len(block.data)}
    solid = sorted(kinds - set(FLAT_CORNERS))
    if solid or not kinds:
        wrong = names(solid) or "only lines"
        raise ValueError(f"mesh: must have triangles or quadrilaterals, not {wrong}; see solid(...) for bodies")
    for kind in sorted(kinds - {"triangle", "quad"}):
        caution(f"mesh: midpoints of {kind} are dropped, so edges become straight between corners")
    faces: dict[int, list[Numbers]] = {3: [], 4: []}
    for i, block in enumerate(source.cells):
        if block.type in kinds:
            faces[FLAT_CORNERS[block.type]].append(reading.cells_of(source, i)[:, : FLAT_CORNERS[block.type]])
    if not (faces[3] and faces[4]):
        return np.concatenate(faces[3] or faces[4])
    quadrilaterals = np.concatenate(faces[4])
    caution(f"mesh: {len(quadrilaterals)} quadrilaterals are split, because the mesh has triangles as well")
    return np.concatenate([*faces[3], quadrilaterals[:, [0, 1, 2]], quadrilaterals[:, [0, 2, 3]]])


def _upright(points: Vector, cells: Numbers) -> Numbers:
    """Return the cells in anticlockwise order; raise a ValueError if some are flat or folded."""
    at = points[cells][:, :, :2]
    back, ahead = np.roll(at, 1, axis=1) - at, np.roll(at, -1, axis=1) - at
    sine = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    sine = sine / np.maximum(np.linalg.norm(back, axis=2) * np.linalg.norm(ahead, axis=2), np.finfo(float).tiny)
    upright, inverted = (sine > FOLDED).all(axis=1), (sine < -FOLDED).all(axis=1)
    bad = np.flatnonzero(~upright & ~inverted)
    if bad.size:
        raise ValueError(f"mesh: {bad.size} cells are flat or folded, the first near {near(points[cells[bad[0]]])}")
    if inverted.any() and upright.any():
        caution(f"mesh: {inverted.sum()} of {len(at)} cells are numbered clockwise and are turned over")
    return np.where(inverted[:, None], cells[:, ::-1], cells)
