"""Meshes of plates from files: what meshio reads, checked to be flat and whole, with its tags as names of edges."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from skfem import MeshQuad, MeshTri

from plates.shapes.mesh_geometry import tangents
from plates.shapes.shape import Cells, PlateMesh
from structures.caution import caution
from structures.checks import positive
from structures.mesh_reading import (
    Numbers,
    Tag,
    check_whole,
    joined,
    names,
    near,
    points_of,
    read_mesh,
    source_of,
    tagged_facets,
    used,
)
from structures.structure import Vector

LONGEST_SIDE, THINNEST = 10.0, 2e-4
"""A mesh longer than the first, m, or of a plate thinner than the second part of its length, is probably in
millimetres."""

OUT_OF_PLANE = 1e-6
"""Points may lie out of the plane by this part of the longest side."""

FOLDED = 1e-9
"""Cells with an angle at a corner below this, rad, or above half a turn, are flat or folded."""

TOO_LONG = 1.5
"""Sides of a mesh from a file may be longer than the coarsest cell that the waves require by this factor."""

CELLS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}
"""meshio's types of cells, and their numbers of corners."""

LINES = {"line": 2, "line3": 2}


class FlatMesh:
    """A flat mesh of triangles or quadrilaterals from a file or a meshio.Mesh, for a plate of a thickness in m.

    scale: m per unit of the mesh; None is 1, for meshes whose size is plausible in m. Raises ValueError for a mesh that
    cannot be a plate.
    """

    def __init__(self, source: Any, thickness: float, scale: float | None = None) -> None:
        self.scale = 1.0 if scale is None else positive("scale", scale, "m per unit of the mesh")
        self.source = source_of(source)
        read = read_mesh(source)
        kind, blocks = _faces(read)
        count = CELLS[kind]
        if kind not in ("triangle", "quad"):
            caution(f"mesh: midpoints of {kind} are dropped, so edges become straight between corners")
        cells = joined(read, blocks, kind)[:, :count]
        points, cells, number = used(self.scale * points_of(read), cells, count)
        _check_flat(points, thickness, scale)
        cells = _upright(points, cells)
        check_whole(cells)
        make = MeshTri if count == 3 else MeshQuad
        mesh = make(np.ascontiguousarray(points[:, :2].T), np.ascontiguousarray(cells.T))
        _check_sides(mesh)
        self._mesh = PlateMesh(mesh, tagged_facets(read, mesh, number, LINES))

    @property
    def quadrilateral(self) -> bool:
        """Whether its cells have four corners."""
        return bool(self._mesh.mesh.t.shape[0] == 4)

    @property
    def names(self) -> list[Tag]:
        """The names and numbers of the edges."""
        return list(self._mesh.edges)

    @property
    def kind(self) -> str:
        """The last word of a plate's kind in results."""
        return "panel"

    @property
    def fixed(self) -> bool:
        """Whether one mesh serves all contacts."""
        return True

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least and greatest x, least and greatest y, m."""
        (left, bottom), (right, top) = self._mesh.mesh.p.min(axis=1), self._mesh.mesh.p.max(axis=1)
        return float(left), float(right), float(bottom), float(top)

    @property
    def area(self) -> float:
        """m²."""
        x, y = self._mesh.mesh.p[:, self._mesh.mesh.t]
        return float((x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0)).sum() / 2.0)

    def directions(self, name: Tag) -> Vector:
        """Angles of the sides of an edge from the x axis, rad."""
        along = tangents(self._mesh.mesh, self._mesh.edges[name])
        return np.asarray(np.arctan2(along[:, 1], along[:, 0]))

    def mesh(self, x: ArrayLike, y: ArrayLike, cells: Cells) -> PlateMesh:
        """The same mesh for all contact points; a warning where it is coarser than the waves require."""
        mesh = self._mesh.mesh
        longest = float(np.linalg.norm(np.diff(mesh.p[:, mesh.facets], axis=1)[:, 0], axis=0).max())
        if longest > TOO_LONG * cells.coarsest:
            caution(
                f"mesh: edges of up to {longest:.3g} m are too long for the waves that beads excite; refine them to "
                f"{cells.coarsest:.3g} m"
            )
        return self._mesh

    def described(self) -> dict[str, Any]:
        """The source of the mesh, as plain data."""
        return {"mesh": self.source, "scale": self.scale, "cells": self._mesh.mesh.nelements}

    def summary(self) -> str:
        """Size and mesh in a few words."""
        left, right, bottom, top = self.box
        return f"{right - left:.4g} × {top - bottom:.4g} m, {self._mesh.mesh.nelements} cells"

    def __repr__(self) -> str:
        return f"<FlatMesh: {self.summary()}, from {self.source}>"


def _faces(source: Any) -> tuple[str, list[int]]:
    """The type of the cells that fill the plate, and their blocks."""
    kinds = {block.type for block in source.cells if block.type not in ("vertex", *LINES) and len(block.data)}
    solid = sorted(kinds - set(CELLS))
    if solid:
        raise ValueError(f"mesh: has cells of type {names(solid)}; a panel's mesh is flat, see solid(...) for bodies")
    if not kinds:
        raise ValueError("mesh: has neither triangles nor quadrilaterals; mesh the surface, and save it")
    if len(kinds) > 1:
        raise ValueError(f"mesh: mixes cells of type {names(sorted(kinds))}; must have one type")
    kind = kinds.pop()
    return kind, [i for i, block in enumerate(source.cells) if block.type == kind]


def _check_flat(points: Vector, thickness: float, scale: float | None) -> None:
    sides = np.ptp(points, axis=0)
    box = " × ".join(f"{side:.3g}" for side in sides)
    if sides[2] > OUT_OF_PLANE * sides.max():
        raise ValueError(f"mesh: is not flat, its box is {box} m; must lie in a plane of constant z")
    if scale is None and (sides.max() > LONGEST_SIDE or thickness < THINNEST * sides.max()):
        raise ValueError(
            f"mesh: its box is {box} m, with a thickness of {thickness:.3g} m: in millimetres? "
            "Give scale=1e-3, or scale=1.0 if it is in m"
        )


def _upright(points: Vector, cells: Numbers) -> Numbers:
    """The cells anticlockwise; a ValueError where some are flat, folded, or turned over."""
    at = points[cells][:, :, :2]
    back, ahead = np.roll(at, 1, axis=1) - at, np.roll(at, -1, axis=1) - at
    sine = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    sine = sine / np.maximum(np.linalg.norm(back, axis=2) * np.linalg.norm(ahead, axis=2), np.finfo(float).tiny)
    upright, inverted = (sine > FOLDED).all(axis=1), (sine < -FOLDED).all(axis=1)
    for bad, what in (
        (~upright & ~inverted, "flat or folded"),
        (inverted & upright.any(), "inverted (numbered clockwise)"),
    ):
        if bad.any():
            first = near(points[cells[np.flatnonzero(bad)[0]]])
            raise ValueError(f"mesh: {bad.sum()} of {len(at)} cells are {what}, the first near {first}")
    return cells[:, ::-1] if inverted.all() else cells


def _check_sides(mesh: Any) -> None:
    """A ValueError where more than two cells share a side, or overlap."""
    shared = np.bincount(mesh.t2f.ravel(), minlength=mesh.nfacets)
    if shared.max() > 2:
        place = near(mesh.p[:, mesh.facets[:, shared.argmax()]].T)
        raise ValueError(f"mesh: {shared.max()} cells share a side near {place}; cells must not lie on each other")
    inside = np.flatnonzero(mesh.f2t[1] >= 0)
    start, end = mesh.p[:, mesh.facets[:, inside]].transpose(1, 0, 2)
    middles = mesh.p[:, mesh.t].mean(axis=1)[:, mesh.f2t[:, inside]]
    (along, up), away = end - start, middles - start[:, None]
    offset = along * away[1] - up * away[0]
    if (offset[0] * offset[1] >= 0.0).any():
        place = near(mesh.p[:, mesh.facets[:, inside[(offset[0] * offset[1]).argmax()]]].T)
        raise ValueError(f"mesh: both cells of a side lie on the same side of it near {place}; it is folded there")
