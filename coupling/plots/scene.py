"""A motion in the plane of a picture: linear cells, a section mirrored at its axis, magnification, and viewing
direction.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from structures.structure import Vector

LINEAR_SUBCELLS = {
    "quad9": [(0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)],
    "tetra10": [
        (0, 4, 6, 7), (4, 1, 5, 8), (6, 5, 2, 9), (7, 8, 9, 3),
        (4, 5, 6, 8), (4, 6, 7, 8), (5, 9, 6, 8), (6, 9, 7, 8),
    ],
    "hexahedron27": [
        (0, 8, 24, 11, 16, 22, 26, 20), (8, 1, 9, 24, 22, 17, 21, 26), (24, 9, 2, 10, 26, 21, 18, 23),
        (11, 24, 10, 3, 20, 26, 23, 19), (16, 22, 26, 20, 4, 12, 25, 15), (22, 17, 21, 26, 12, 5, 13, 25),
        (26, 21, 18, 23, 25, 13, 6, 14), (20, 26, 23, 19, 15, 25, 14, 7),
    ],
}  # fmt: skip
"""Quadratic cells (meshio's types) as linear cells between their points, which are drawn."""

LINEAR_TYPES = {"quad9": "quad", "tetra10": "tetra", "hexahedron27": "hexahedron"}
"""The types of these linear cells."""

CORNER_NEIGHBOURS = {"quad9": (1, 3), "tetra10": (1, 2, 3), "hexahedron27": (1, 3, 4)}
"""Corners of the linear cells that share an edge with the first."""

LYING_RATIO = 2.5
"""A body longer than this multiple of its width is drawn horizontally."""

LARGEST_DRAWN_RATIO = 9.0
"""The radius of more slender sections is magnified until their length is this multiple of their width."""

DRAWN_DISPLACEMENT = 0.1
"""The largest drawn displacement, as a fraction of the shortest side of the body."""

MARGIN = 0.03
"""Around the body, as a fraction of its longest side."""

VIEW_DIRECTION = (-0.45, 0.75, -0.48)
"""Viewing direction on 3-D bodies, in a frame whose third axis points up."""


class Shape(NamedTuple):
    """A body as linear cells. point: the motion's number of each point; side: −1 for those mirrored at the axis.

    kind: "quad", of a section or of a plate, "tetra" or "hexahedron".
    """

    point: NDArray[np.int64]
    side: Vector
    cells: NDArray[np.int64]
    part: NDArray[np.int64]
    kind: str


def shape_of(motion: xr.Dataset) -> Shape:
    """Return the body's cells, those of a section mirrored at the axis."""
    split, kind = np.array(LINEAR_SUBCELLS[motion.attrs["cell_type"]]), LINEAR_TYPES[motion.attrs["cell_type"]]
    cells = motion.cells.values[:, split].reshape(-1, split.shape[1])
    part, count = np.repeat(motion.part.values, len(split)), motion.sizes["point"]
    if motion.attrs["shape"] != "revolution":
        return Shape(np.arange(count), np.ones(count), cells, part, kind)
    off_axis = np.flatnonzero(motion.position.values[:, 0] > 0.0)
    mirrored = np.arange(count)
    mirrored[off_axis] = count + np.arange(off_axis.size)
    return Shape(
        np.concatenate([np.arange(count), off_axis]),
        np.concatenate([np.ones(count), -np.ones(off_axis.size)]),
        np.concatenate([cells, mirrored[cells]]),
        np.concatenate([part, part]),
        kind,
    )


class Scene:
    """The body in the plane of the picture, its outlines and the interfaces of its materials.

    factor: of the drawn displacement; None for a suitable one. frame: rows x, y (in the picture) and z (towards the
    viewer). flat: a section. stretch: of the second axis of the picture. extent: left, right, bottom, top, m.
    """

    def __init__(self, motion: xr.Dataset, factor: float | None) -> None:
        self.motion, self.shape = motion, shape_of(motion)
        self.flat = motion.attrs["shape"] == "revolution"
        rest = self._in_space(motion.position.values)
        sides = np.ptp(rest, axis=0)
        greatest = float(np.linalg.norm(motion.displacement.values, axis=-1).max())
        usual = round_number(DRAWN_DISPLACEMENT * sides[sides > 0.0].min() / greatest) if greatest > 0.0 else 1.0
        self.factor = usual if factor is None else factor
        self.frame = (
            np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
            if self.flat
            else _oblique(np.array(motion.attrs["up"]))
        )
        width, height, _ = np.ptp(rest @ self.frame.T, axis=0)
        self.lying = bool(height > LYING_RATIO * width)
        if self.lying:
            self.frame = np.array([-self.frame[1], self.frame[0], self.frame[2]])
        ratio = max(width, height) / min(width, height) / LARGEST_DRAWN_RATIO
        self.stretch = round_number(ratio, up=True) if self.flat and ratio > 1.0 else 1.0
        places = [self.places(i) for i in range(motion.sizes["time"])] + [self.rest()]
        low, high = (np.array([least(place, axis=0) for place in places]) for least in (np.min, np.max))
        low, high = low.min(axis=0)[:2], high.max(axis=0)[:2]
        margin = MARGIN * (high - low).max()
        self.low, self.high = low - margin, high + margin

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom, top of the image, m of the body."""
        stretch = self.stretch
        return self.low[0], self.high[0], self.low[1] / stretch, self.high[1] / stretch

    @property
    def aspect(self) -> float:
        """Height over width of the image."""
        return float((self.high[1] - self.low[1]) / (self.high[0] - self.low[0]))

    def sizes(self) -> Vector:
        """Area of the cells at rest in the half-plane, or their volume, in one common unit."""
        kind = self.motion.attrs["cell_type"]
        parts = self.motion.cells.values[:, np.array(LINEAR_SUBCELLS[kind])]
        corner = self.motion.position.values[parts[..., [0, *CORNER_NEIGHBOURS[kind]]]]
        edges = corner[..., 1:, :] - corner[..., :1, :]
        return np.asarray(np.sqrt(abs(np.linalg.det(edges @ np.swapaxes(edges, -1, -2)))).sum(axis=1))

    def places(self, number: int) -> Vector:
        """Return the positions of the drawn points at the time of this number."""
        motion = self.motion
        return self._drawn(self._in_space(motion.position.values + self.factor * motion.displacement.values[number]))

    def rest(self) -> Vector:
        """Positions of the drawn points at rest."""
        return self._drawn(self._in_space(self.motion.position.values))

    def _in_space(self, vectors: Vector) -> Vector:
        vectors = vectors[self.shape.point]
        return np.column_stack([vectors[:, 0] * self.shape.side, vectors[:, 1:]])

    def _drawn(self, places: Vector) -> Vector:
        return np.asarray(places @ self.frame.T * [1.0, self.stretch, 1.0])


def _oblique(up: Vector) -> Vector:
    """Return the frame of an oblique view from above; up: a direction of space that is drawn upward."""
    up = up / np.linalg.norm(up)
    ahead = np.cross(up, np.eye(3)[np.argmin(abs(up))])
    ahead /= np.linalg.norm(ahead)
    aside = np.cross(ahead, up)
    sight = np.array(VIEW_DIRECTION) / np.linalg.norm(VIEW_DIRECTION) @ np.array([aside, ahead, up])
    right = np.cross(sight, up)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(right, sight), -sight])


def round_number(value: float, up: bool = False, ladder: Sequence[float] = (1.0, 2.0, 5.0)) -> float:
    """Return the next number of 1, 2, 5, 10, ... (or of another sequence within a decade) below, or above."""
    decades = 10.0 ** np.arange(np.floor(np.log10(value)) - 1.0, np.log10(value) + 2.0)
    steps = np.outer(decades, ladder).ravel()
    return float(steps[steps >= value].min() if up else steps[steps <= value].max())
