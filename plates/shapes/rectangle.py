"""Rectangles: cells in rows and columns, fine at the contacts; only one half where both are equal."""

from dataclasses import dataclass
from functools import cached_property
from math import isclose, pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from skfem import MeshQuad

from plates.shapes.grading import graded
from plates.shapes.shape import MIRROR, Cells, PlateMesh
from structures.meshes.mesh_reading import Tag
from structures.structure import Vector

SIDES = ("left", "right", "bottom", "top")
"""Names of the edges of a rectangle."""


@dataclass(frozen=True)
class Rectangle:
    """Length along x and width along y, m; x runs from left to right, y from bottom to top, from the corner (0, 0).

    cells: numbers along x and y of a uniform mesh that all contacts share; None for a mesh graded towards the contacts.
    """

    length: float
    width: float
    cells: tuple[int, int] | None = None

    kind, names = "plate", SIDES

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least and greatest x, least and greatest y, m."""
        return 0.0, self.length, 0.0, self.width

    @property
    def area(self) -> float:
        """m²."""
        return self.length * self.width

    @property
    def fixed(self) -> bool:
        """True if one mesh serves all contacts."""
        return self.cells is not None

    def directions(self, name: Tag) -> Vector:
        """Return the angle of a side from the x axis, rad."""
        return np.array([pi / 2.0 if name in ("left", "right") else 0.0])

    def mesh(self, x: ArrayLike, y: ArrayLike, cells: Cells) -> PlateMesh:
        """Return the mesh of the plate, or of its half or quarter where the contacts lie on lines of symmetry.

        Raises ValueError for a contact outside.
        """
        sides = (self.length, self.width)
        at: list[list[float]] = [np.atleast_1d(np.asarray(values, dtype=float)).tolist() for values in (x, y)]
        for axis, side, places in zip("xy", sides, at, strict=True):
            for i, place in enumerate(places):
                if not 0.0 <= place <= side:
                    name = axis if len(places) == 1 else f"{axis}[{i}]"
                    raise ValueError(f"{name} = {place!r}: must lie on the plate, between 0 and {side} m")
        if self.cells is not None:
            return self._uniform
        halves = [cells.halved[i] and all(isclose(position, sides[i] / 2.0) for position in at[i]) for i in (0, 1)]
        ends = [at[i][0] if halves[i] else sides[i] for i in (0, 1)]
        positions = [[ends[i]] if halves[i] else at[i] for i in (0, 1)]
        return _meshed([graded(ends[i], positions[i], cells, cells.lines[i]) for i in (0, 1)], halves)

    @cached_property
    def _uniform(self) -> PlateMesh:
        counts = self.cells or (1, 1)
        sides = zip((self.length, self.width), counts, strict=True)
        return _meshed([np.linspace(0.0, side, count + 1) for side, count in sides], [False, False])

    def described(self) -> dict[str, Any]:
        """Return the rectangle as plain data."""
        return {"length": self.length, "width": self.width, "cells": self.cells}

    def summary(self) -> str:
        """Return the size, and mesh where it is fixed, in a few words."""
        mesh = "" if self.cells is None else f", {self.cells[0]} × {self.cells[1]} cells"
        return f"{self.length:.4g} × {self.width:.4g} m{mesh}"


def _meshed(nodes: list[Vector], halves: list[bool]) -> PlateMesh:
    """Return the cells between nodes along x and along y; where only half is meshed, its end is MIRROR."""
    mesh = MeshQuad.init_tensor(*nodes)
    x, y = mesh.p[:, mesh.facets].mean(axis=1)
    right, top = x == nodes[0][-1], y == nodes[1][-1]
    edges: dict[Tag, Any] = {"left": x == 0.0, "right": right & (not halves[0]), "bottom": y == 0.0}
    edges |= {"top": top & (not halves[1]), MIRROR: (right & halves[0]) | (top & halves[1])}
    return PlateMesh(mesh, {name: np.flatnonzero(on) for name, on in edges.items()})
