"""Rectangular plates: a Plate holds shape, material and supports; `plate.at(x, y)` is the structure struck there."""

import logging
from dataclasses import asdict, dataclass
from functools import cached_property
from math import ceil, isclose, pi
from typing import Any, TypeAlias

import numpy as np
from scipy import sparse

from plates.kirchhoff import Beam, beam, plate_matrices
from plates.support import Supports
from structures.checks import finite, instance, positive, whole
from structures.material import Material
from structures.structure import Structure, Vector
from structures.surface import Surface

Matrix: TypeAlias = sparse.csr_array

HIGHEST_FREQUENCY = 40.0e3
"""Hz. The contact of steel beads of 4 to 20 mm lasts 25 to 110 µs and excites little above this."""

GROWTH = 1.3

NEAREST = 1e-6
"""A contact nearer than this part of a side to a held edge lies on it."""

log = logging.getLogger("hertzlink.plates")


@dataclass(frozen=True)
class Plate:
    """A thin rectangular plate in Kirchhoff's theory; make one with `kirchhoff_plate`."""

    length: float
    width: float
    thickness: float
    material: Material
    supports: Supports
    cells: tuple[int, int] | None
    highest_frequency: float

    @property
    def rigidity(self) -> float:
        """Bending rigidity D = E t³ / 12(1 − ν²), N m."""
        return self.material.contact_modulus * self.thickness**3 / 12.0

    @property
    def mass_per_area(self) -> float:
        """ρ t, kg/m²."""
        return self.material.density * self.thickness

    @property
    def shortest_wavelength(self) -> float:
        """Length of flexural waves at the highest frequency, 2π (D/ρt)^¼ / √ω, m."""
        circular = 2.0 * pi * self.highest_frequency
        return float(2.0 * pi * (self.rigidity / self.mass_per_area) ** 0.25 / circular**0.5)

    def at(self, x: float, y: float) -> Structure:
        """The plate struck at (x, y), m from the left bottom corner.

        Without `cells` the mesh is graded towards this point, which is a node of it: a point force converges
        slowly on a uniform mesh. Where the point lies on a line of symmetry, the structure holds the motions that
        a force there can excite, and no others. Raises ValueError outside the plate or on an edge that cannot move.
        """
        x = self._inside("x", x, self.length, self.supports.left, self.supports.right)
        y = self._inside("y", y, self.width, self.supports.bottom, self.supports.top)
        origin = {"kind": "Kirchhoff plate", **asdict(self), "at": [x, y]}
        if self._shared is not None:
            along_x, along_y, mass, stiffness = self._shared
            return self._structure(mass, stiffness, _product(along_x.at(x), along_y.at(y)), origin)
        edges = self.supports
        along_x, copies_x = self._graded_beam(self.length, x, edges.left, edges.right)
        along_y, copies_y = self._graded_beam(self.width, y, edges.bottom, edges.top)
        mass, stiffness = self._matrices(along_x, along_y)
        copies = copies_x * copies_y
        return self._structure(copies * mass, copies * stiffness, _product(along_x.at(x), along_y.at(y)), origin)

    def _structure(self, mass: Matrix, stiffness: Matrix, contact: Vector, origin: dict[str, Any]) -> Structure:
        if contact.size == 0:
            raise ValueError(f"cells = {self.cells!r}: too few, the supports hold every node; use more")
        return Structure(mass, stiffness, None, contact, 0.0, Surface(self.material), origin)

    @cached_property
    def _shared(self) -> tuple[Beam, Beam, Matrix, Matrix] | None:
        """Beams and matrices of the uniform mesh that all contact points share."""
        if self.cells is None:
            return None
        edges = self.supports
        along_x = beam(np.linspace(0.0, self.length, self.cells[0] + 1), edges.left, edges.right)
        along_y = beam(np.linspace(0.0, self.width, self.cells[1] + 1), edges.bottom, edges.top)
        return along_x, along_y, *self._matrices(along_x, along_y)

    def _matrices(self, x: Beam, y: Beam) -> tuple[Matrix, Matrix]:
        return plate_matrices(x, y, self.rigidity, self.material.poisson_ratio, self.mass_per_area)

    def _graded_beam(self, side: float, position: float, start: str, end: str) -> tuple[Beam, int]:
        """A beam graded towards the position; half of it, to be counted twice, where the plate is symmetric."""
        if start == end and isclose(position, side / 2.0):
            return beam(self._graded(position, position), start, "mirror"), 2
        return beam(self._graded(side, position), start, end), 1

    def _graded(self, side: float, position: float) -> Vector:
        """Nodes from 0 to `side`: λ/12 at the position, each cell 1.3 times the last, λ/2 far away."""
        finest, coarsest = self.shortest_wavelength / 12.0, self.shortest_wavelength / 2.0
        before = position - _cells_over(position, finest, coarsest)[::-1]
        after = position + _cells_over(side - position, finest, coarsest)
        nodes: Vector = np.concatenate([before, [position], after])
        nodes[0], nodes[-1] = 0.0, side
        return nodes

    @staticmethod
    def _inside(name: str, value: float, side: float, start: str, end: str) -> float:
        at = finite(name, value, "m")
        if not 0.0 <= at <= side:
            raise ValueError(f"{name} = {value!r}: must lie on the plate, between 0 and {side} m")
        edge = start if at < NEAREST * side else end if at > (1.0 - NEAREST) * side else "free"
        if edge != "free":
            raise ValueError(f"{name} = {value!r}: lies on a {edge} edge, which cannot move; strike inside")
        return at


def kirchhoff_plate(
    length: float,
    width: float,
    thickness: float,
    material: Material,
    supports: Supports,
    cells: tuple[int, int] | None = None,
    highest_frequency: float = HIGHEST_FREQUENCY,
) -> Plate:
    """A rectangular plate in Kirchhoff's theory with Bogner–Fox–Schmit elements; sizes in m.

    highest_frequency, Hz: the mesh resolves flexural waves up to it; the default suits steel beads of 4 to 20 mm.
    cells: a uniform mesh of (along x, along y) cells instead, which all contact points share.
    """
    length, width = positive("length", length, "m"), positive("width", width, "m")
    thickness = positive("thickness", thickness, "m")
    instance("material", material, Material, "a Material; MATERIALS[name] gives one by name")
    instance("supports", supports, Supports, "Supports(left=, right=, bottom=, top=)")
    if cells is not None:
        if np.shape(cells) != (2,):
            raise ValueError(f"cells = {cells!r}: must be two whole numbers, along x and along y")
        cells = (whole("cells[0]", cells[0]), whole("cells[1]", cells[1]))
    if thickness > min(length, width) / 10.0:
        log.warning(
            "thickness %g m is over a tenth of the plate's sides: Kirchhoff's theory is for thin plates", thickness
        )
    frequency = positive("highest_frequency", highest_frequency, "Hz")
    return Plate(length, width, thickness, material, supports, cells, frequency)


def _product(along_x: Vector, along_y: Vector) -> Vector:
    return np.outer(along_x, along_y).ravel()


def _cells_over(span: float, finest: float, coarsest: float) -> Vector:
    """Ascending ends of cells that grow from `finest` to `coarsest` and together fill `span`."""
    if span <= 0.0:
        return np.zeros(0)
    growing = ceil(np.log(coarsest / finest) / np.log(GROWTH))
    sizes = np.minimum(finest * GROWTH ** np.arange(growing + ceil(span / coarsest) + 1), coarsest)
    ends = np.cumsum(sizes)
    count = int(np.searchsorted(ends, span * (1.0 - 1e-9))) + 1
    filled: Vector = ends[:count] * (span / ends[count - 1])
    return filled
