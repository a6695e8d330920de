"""Rectangles as panels: quadrilaterals in rows and columns, fine at the contacts; halves where all is symmetric."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import ceil, isclose
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from skfem import MeshQuad

from plates.shapes.grading import nearest, stops
from plates.shapes.mesh import PanelMesh, Sizes
from structures.mesh_source import Tag
from structures.structure import Vector

NAMES = ("left", "right", "bottom", "top")

MIRROR = "middle"
"""Of edges on which a half goes on as its mirror image."""


@dataclass(frozen=True)
class Rectangle:
    """Length along x and width along y, m; x runs from left to right, y from bottom to top.

    cells: of a uniform mesh, along x and y. halved: whether the left and right half are alike, the bottom and top half.
    lines: x and y, m, where cells should end.
    """

    length: float
    width: float
    cells: tuple[int, int] | None = None
    halved: tuple[bool, bool] = (False, False)
    lines: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())

    @property
    def names(self) -> list[Tag]:
        """The edges, and the middle lines where only half is meshed."""
        return [*NAMES, MIRROR]

    @property
    def area(self) -> float:
        """m²; nothing where the cells are given."""
        return self.length * self.width if self.cells is None else 0.0

    def mesh(self, x: ArrayLike, y: ArrayLike, size: Sizes) -> PanelMesh:
        """Of the plate, or of its half or quarter where the contacts lie on lines of symmetry."""
        if self.cells is not None:
            return self._uniform
        sides = (self.length, self.width)
        at: list[list[float]] = [np.atleast_1d(np.asarray(given, dtype=float)).tolist() for given in (x, y)]
        halves = [self.halved[i] and all(isclose(one, sides[i] / 2.0) for one in at[i]) for i in (0, 1)]
        ends = [at[i][0] if halves[i] else sides[i] for i in (0, 1)]
        return _meshed([graded(ends[i], at[i], size, self.lines[i]) for i in (0, 1)], halves)

    @cached_property
    def _uniform(self) -> PanelMesh:
        cells = self.cells or (1, 1)
        sides = zip((self.length, self.width), cells, strict=True)
        return _meshed([np.linspace(0.0, side, count + 1) for side, count in sides], [False, False])

    def described(self) -> dict[str, Any]:
        """The rectangle as plain data."""
        return {"length": self.length, "width": self.width, "cells": self.cells}


def _meshed(nodes: list[Vector], halves: list[bool]) -> PanelMesh:
    """Cells between nodes along x and along y; where only half is meshed, its end is MIRROR."""
    mesh = MeshQuad.init_tensor(*nodes)
    x, y = mesh.p[:, mesh.facets].mean(axis=1)
    right, top = x == nodes[0][-1], y == nodes[1][-1]
    edges: dict[Tag, Any] = {"left": x == 0.0, "right": right & (not halves[0]), "bottom": y == 0.0}
    edges |= {"top": top & (not halves[1]), MIRROR: (right & halves[0]) | (top & halves[1])}
    return PanelMesh(mesh, {name: np.flatnonzero(on) for name, on in edges.items()})


def graded(side: float, positions: Sequence[float], size: Sizes, lines: tuple[float, ...] = ()) -> Vector:
    """Nodes from 0 to `side`, m: about a size apart that grows with the distance from the nearest position.

    One at each position, at the middles between them, and at the lines.
    """
    ends = stops(side, positions, size.finest, np.array(lines))
    parts = [_part(start, end, nearest(positions, start, end), size)[:-1] for start, end in pairwise(ends)]
    return np.append(np.concatenate(parts), side)


def _part(start: float, end: float, position: float, size: Sizes) -> Vector:
    """Nodes from start to end at equal steps of ∫ dx/size."""
    near, far = sorted((abs(start - position), abs(end - position)))

    def passed(distance: Vector) -> Vector:
        """∫ dx/size from the position on."""
        growing = min((size.coarsest - size.finest) / size.growth, far) if size.coarsest > size.finest else 0.0
        inner = np.log1p(np.minimum(distance, growing) * size.growth / size.finest) / size.growth
        return np.asarray(inner + np.maximum(distance - growing, 0.0) / max(size.coarsest, size.finest))

    count = max(ceil(float(passed(np.array(far)) - passed(np.array(near))) * (1.0 - 1e-9)), 1)
    fine = np.linspace(near, far, 200 * count + 1)
    steps = passed(fine)
    distance = np.interp(np.linspace(steps[0], steps[-1], count + 1), steps, fine)
    nodes = position + distance if start + end >= 2.0 * position else position - distance[::-1]
    nodes[0], nodes[-1] = start, end
    return np.asarray(nodes)
