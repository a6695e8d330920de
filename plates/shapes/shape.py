"""What shapes of plates share: a mesh with named edges, and the sizes of its cells.

A shape has `kind` ("plate" or "panel"), the `box` around it, its `area`, `directions(name)` of an
edge's sides, `mesh(x, y, cells)`, `described()` and `summary()`; `fixed` is true where one mesh serves all contacts.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from structures.fineness import fineness
from structures.meshes.mesh_reading import Groups

MIRROR = "middle"  # Name of the edges where a mesh ends because the other half of the plate is its mirror image


class PlateMesh(NamedTuple):
    """A mesh of scikit-fem in m, and the facets of its edges by name."""

    mesh: Any
    edges: Groups


@dataclass(frozen=True)
class Cells:
    """The properties of a mesh that a plate asks for.

    finest, coarsest: sizes of cells at the contacts and far away, m. growth: increase of the size per distance from the
    contacts. geometric: each cell is exactly 1 + growth times its neighbour nearer to the contact (nodes of beams).
    lines: places along x and along y, m, where cells should end. halved: whether the left and right half, and the
    bottom and top half, of a rectangle are equal, so that one of them may be meshed. Shapes without rows of cells
    ignore the last three.
    """

    finest: float
    growth: float
    coarsest: float
    geometric: bool = False
    lines: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    halved: tuple[bool, bool] = (False, False)

    def finer(self) -> "Cells":
        """Return cells that are smaller by the fineness of the context, all by the same factor."""
        parts = fineness().cells
        growth = (1.0 + self.growth) ** (1.0 / parts) - 1.0 if self.geometric else self.growth / parts
        return replace(self, finest=self.finest / parts, growth=growth, coarsest=self.coarsest / parts)
