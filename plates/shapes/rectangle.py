"""Rectangles: cells in rows and columns, fine at the contacts; only one half if both halves are equal."""

from dataclasses import dataclass
from math import isclose, pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from skfem import MeshQuad

from plates.shapes.shape import MIRROR, Cells, PlateMesh, graded
from structures.meshes.mesh_reading import Tag
from structures.structure import Vector

SIDES = ("left", "right", "bottom", "top")  # Names of the edges of a rectangle


@dataclass(frozen=True)
class Rectangle:
    """Length along x and width along y, m. x runs from left to right, y from bottom to top, from the corner (0, 0).

    cells: numbers along x and y of a uniform mesh that all contacts share; None for a mesh graded towards the contacts.
    """

    length: float
    width: float
    cells: tuple[int, int] | None = None

    kind = "plate"

    @property
    def box(self) -> tuple[float, float, float, float]:
        return 0.0, self.length, 0.0, self.width

    @property
    def area(self) -> float:
        return self.length * self.width

    @property
    def fixed(self) -> bool:
        return self.cells is not None

    def directions(self, name: Tag) -> Vector:
        return np.array([pi / 2.0 if name in ("left", "right") else 0.0])

    def mesh(self, x: ArrayLike, y: ArrayLike, cells: Cells) -> PlateMesh:
        """Return the mesh of the plate, or of a half or a quarter if the contacts lie on lines of symmetry.

        Raise a ValueError for a contact outside.
        """
        sides = (self.length, self.width)
        at: list[list[float]] = [np.atleast_1d(np.asarray(values, dtype=float)).tolist() for values in (x, y)]
        for axis, side, places in zip("xy", sides, at, strict=True):
            for i, place in enumerate(places):
                if not 0.0 <= place <= side:
                    name = axis if len(places) == 1 else f"{axis}[{i}]"
                    raise ValueError(f"{name} = {place!r}: must lie on the plate, between 0 and {side} m")
        if self.cells is None:
            halves = [cells.halved[i] and all(isclose(place, sides[i] / 2.0) for place in at[i]) for i in (0, 1)]
            ends = [at[i][0] if halves[i] else sides[i] for i in (0, 1)]
            contacts = [[ends[i]] if halves[i] else at[i] for i in (0, 1)]
            nodes = [graded(ends[i], contacts[i], cells, cells.lines[i]) for i in (0, 1)]
        else:
            halves = [False, False]
            nodes = [np.linspace(0.0, side, count + 1) for side, count in zip(sides, self.cells, strict=True)]
        mesh = MeshQuad.init_tensor(*nodes)
        middle_x, middle_y = mesh.p[:, mesh.facets].mean(axis=1)
        right, top = middle_x == nodes[0][-1], middle_y == nodes[1][-1]
        edges: dict[Tag, Any] = {"left": middle_x == 0.0, "right": right & (not halves[0]), "bottom": middle_y == 0.0}
        edges |= {"top": top & (not halves[1]), MIRROR: (right & halves[0]) | (top & halves[1])}
        return PlateMesh(mesh, {name: np.flatnonzero(on) for name, on in edges.items()})

    def described(self) -> dict[str, Any]:
        return {"length": self.length, "width": self.width, "cells": self.cells}

    def summary(self) -> str:
        mesh = "" if self.cells is None else f", {self.cells[0]} × {self.cells[1]} cells"
        return f"{self.length:.4g} × {self.width:.4g} m{mesh}"
