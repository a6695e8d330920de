"""The protocol of a plate's shape: named edges, and a mesh for each set of contact points."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

from numpy.typing import ArrayLike

from structures.fineness import fineness
from structures.meshes.mesh_reading import Groups, Tag
from structures.structure import Vector

MIRROR = "middle"
"""Name of the edges where a mesh ends because the other half of the plate is its mirror image."""

Lines = tuple[tuple[float, ...], tuple[float, ...]]
"""Places along x and along y, m."""


class PlateMesh(NamedTuple):
    """A mesh of scikit-fem in m, and the facets of its edges by name."""

    mesh: Any
    edges: Groups


@dataclass(frozen=True)
class Cells:
    """The properties of a mesh that a plate asks for.

    finest, coarsest: sizes of cells at the contacts and far away, m. growth: increase of the size per distance from the
    contacts. geometric: each cell is exactly 1 + growth times its neighbour nearer to the contact (nodes of beams).
    lines: places where cells should end. halved: whether the left and right half, and the bottom and top half, of a
    rectangle are equal, so that one of them may be meshed. Shapes without rows of cells ignore the last three.
    """

    finest: float
    growth: float
    coarsest: float
    geometric: bool = False
    lines: Lines = ((), ())
    halved: tuple[bool, bool] = (False, False)

    def finer(self) -> "Cells":
        """Return cells that are smaller by the fineness of the context, all by the same factor."""
        parts = fineness().cells
        growth = (1.0 + self.growth) ** (1.0 / parts) - 1.0 if self.geometric else self.growth / parts
        return replace(self, finest=self.finest / parts, growth=growth, coarsest=self.coarsest / parts)


class Shape(Protocol):
    """A shape that a plate may have: it has named edges, and a mesh for each set of contact points."""

    @property
    def kind(self) -> str:
        """ "plate" for rectangles, "panel" for other shapes: the last word of a plate's kind in results."""
        ...

    @property
    def names(self) -> Sequence[Tag]:
        """The names of its edges."""
        ...

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least and greatest x, least and greatest y, m."""
        ...

    @property
    def area(self) -> float:
        """m²."""
        ...

    @property
    def fixed(self) -> bool:
        """True if one mesh serves all contacts."""
        ...

    def directions(self, name: Tag) -> Vector:
        """Return the angles of the sides of an edge, from the x axis, rad."""
        ...

    def mesh(self, x: ArrayLike, y: ArrayLike, cells: Cells) -> PlateMesh:
        """Return its mesh for a contact at (x, y), m, or for several; raise a ValueError for a contact outside."""
        ...

    def described(self) -> dict[str, Any]:
        """Return how it was made, as plain data."""
        ...

    def summary(self) -> str:
        """Return the size, and mesh where it is fixed, in a few words."""
        ...
