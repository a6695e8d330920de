"""Rectangular plates: a Plate holds shape, material and supports; `plate.at(x, y)` is the structure struck there."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property, partial
from math import isclose, pi

import numpy as np
from scipy import sparse

from plates.additions import Addition, Weakened, check_additions, extent
from plates.contacts import Contact, Places, alike, contacts_at, one_or_all, told
from plates.elements.field import PlateSampler, product_sampler
from plates.elements.hermite import Beam, plate_matrices
from plates.laminate import Laminate, section_of, struck
from plates.section import Section, all_around, point_rigidity
from plates.shapes.grading import graded
from plates.support import ElasticEdge, Support, Supports
from structures.caution import caution
from structures.checks import instance, positive, whole
from structures.factor import Matrices
from structures.field import Field
from structures.material import Material
from structures.plausible import likely
from structures.structure import Structure, Vector
from structures.surface import Surface

HIGHEST_FREQUENCY = 40.0e3
"""Hz. The contact of steel beads of 4 to 20 mm lasts 25 to 110 µs and excites little above this."""

FINEST, COARSEST = 12.0, 1.7
"""Cells to a wavelength at the highest frequency: at the contact, and far from it, where only the slower waves matter.
On the thesis's plates amplitude ratios are within 0.4 % of those of 24 and 3 cells (benchmarks/plate_meshes.py)."""

MOST = 2_000_000
"""Degrees of freedom that may be assembled."""

NEAREST = 1e-6
"""A contact nearer than this part of a side to an edge lies on it."""

MOVING = ("free", "symmetry")
"""Kinds of edges that move; those on springs do too."""


@dataclass(frozen=True)
class Plate:
    """A thin rectangular plate in Kirchhoff's theory; make one with `kirchhoff_plate`."""

    length: float
    width: float
    thickness: float
    material: Material | Laminate
    supports: Supports
    cells: tuple[int, int] | None
    highest_frequency: float
    additions: tuple[Addition, ...] = ()

    @cached_property
    def section(self) -> Section:
        """Bending stiffness and mass of the wall."""
        return section_of(self.thickness, self.material)

    @property
    def rigidity(self) -> float:
        """Bending rigidity D = E t³ / 12(1 − ν²), N m; of a laminate, D of the plate with the same point impedance."""
        return point_rigidity(self.section)

    @property
    def mass_per_area(self) -> float:
        """ρ t, kg/m²."""
        return self.section.mass

    @property
    def shortest_wavelength(self) -> float:
        """Length of flexural waves at the highest frequency, 2π (D/ρt)^¼ / √ω, m, where and whither D is least."""
        circular = 2.0 * pi * self.highest_frequency
        weakest = min([one.factor for one in self.additions if isinstance(one, Weakened)], default=1.0)
        rigidity = weakest * float(all_around(self.section).min())
        return float(2.0 * pi * (rigidity / self.mass_per_area) ** 0.25 / circular**0.5)

    def at(self, x: float | Places, y: float | Places, face: str | Sequence[str] = "front") -> Structure:
        """The plate struck at (x, y), m from the left bottom corner; or at several points, of which x and y are lists.

        Without `cells` the mesh is graded towards these points, which are nodes of it: a point force converges
        slowly on a uniform mesh. Where all lie on a line of symmetry, the structure holds the motions that
        forces there can excite, and no others. On a "symmetry" edge the whole plate, of which this is a half, is
        struck once; beside such an edge, its mirror image is struck too.
        face: "front" or "back", one for all or one for each. A contact's displacement is positive away from its chain.
        Raises ValueError outside the plate, on an edge that cannot move, where two contacts are one, and where some lie
        on a "symmetry" edge and others beside it.
        """
        contacts = contacts_at(x, y, face)
        copies = alike(contacts, [self._parts(one) for one in contacts])
        self._check_size()
        (along_x, more_x), (along_y, more_y) = self._beams(contacts)
        copies *= more_x * more_y
        columns = [one.sign * np.outer(along_x.at(one.x), along_y.at(one.y)).ravel() for one in contacts]
        contact = np.column_stack(columns)
        if contact.size == 0:
            raise ValueError(f"cells = {self.cells!r}: too few, the supports hold every node; use more")
        if self.cells is not None:
            matrices = self._counted(copies)
        else:
            matrices = Matrices(*(copies * one for one in self._matrices(along_x, along_y)))
        mass, stiffness = matrices.mass, matrices.stiffness
        origin = {"kind": "Kirchhoff plate", **asdict(self), **told(contacts)}
        sampler = partial(_sampler, along_x, along_y, (more_x == 2, more_y == 2), self.section, stiffness)
        surfaces = [Surface(struck(self.section, self.material, one.face)) for one in contacts]
        surface, field = one_or_all(surfaces), Field(sampler, len(contact))
        return Structure(mass, stiffness, None, contact, 0.0, surface, origin, field=field, matrices=matrices)

    def _beams(self, contacts: Sequence[Contact]) -> list[tuple[Beam, int]]:
        """The beams along x and along y that the contacts want, and how often each is to be counted."""
        if self.cells is not None:
            return [(beam, 1) for beam in self._uniform]
        edges, (lines_x, lines_y) = self.supports, self._lines
        xs, ys = [one.x for one in contacts], [one.y for one in contacts]
        return [
            self._graded_beam(self.length, xs, edges.left, edges.right, lines_x),
            self._graded_beam(self.width, ys, edges.bottom, edges.top, lines_y),
        ]

    def _check_size(self) -> None:
        """A ValueError before a mesh is made that would not fit in memory."""
        count = 4.0 * self.length * self.width * (COARSEST / self.shortest_wavelength) ** 2
        if self.cells is None and count > MOST:
            raise ValueError(
                f"highest_frequency = {self.highest_frequency!r}: wants some {count:.2g} degrees of freedom on "
                f"{self.length} × {self.width} m of plate, more than {MOST:.0e}; is the plate in millimetres?"
            )

    @cached_property
    def _uniform(self) -> tuple[Beam, Beam]:
        """The beams of the uniform mesh that all contact points share."""
        across, along = self.cells or (1, 1)
        edges = self.supports
        return (
            Beam(np.linspace(0.0, self.length, across + 1), edges.left, edges.right),
            Beam(np.linspace(0.0, self.width, along + 1), edges.bottom, edges.top),
        )

    def _counted(self, copies: int) -> Matrices:
        """The matrices of the uniform mesh, as often as the plate goes on beyond its edges; made once."""
        if copies not in self._kept:
            one = self._matrices(*self._uniform)
            self._kept[copies] = Matrices(*(copies * matrix for matrix in one))
        return self._kept[copies]

    @cached_property
    def _kept(self) -> dict[int, Matrices]:
        return {}

    def _matrices(self, x: Beam, y: Beam) -> tuple[sparse.csr_array, sparse.csr_array]:
        mass, stiffness = plate_matrices(x, y, self.section, self.additions)
        return mass, stiffness

    @property
    def _lines(self) -> tuple[Vector, Vector]:
        """Where along x and along y additions make the curvature jump: mesh lines."""
        places = [extent(one) for one in self.additions]
        xs, ys = (np.array([place for both in places for place in both[axis]]) for axis in (0, 1))
        return xs, ys

    def _graded_beam(
        self, side: float, positions: list[float], start: Support, end: Support, lines: Vector
    ) -> tuple[Beam, int]:
        """A beam graded towards the positions; half of it, to be counted twice, where the plate is symmetric."""
        finest, coarsest = self.shortest_wavelength / FINEST, self.shortest_wavelength / COARSEST
        if start == end and all(isclose(position, side / 2.0) for position in positions) and self._mirrors:
            middle = positions[0]
            return Beam(graded(middle, [middle], finest, coarsest, lines), start, "symmetry"), 2
        return Beam(graded(side, positions, finest, coarsest, lines), start, end), 1

    @property
    def _mirrors(self) -> bool:
        """Whether nothing but the supports could tell a half of the plate from the other."""
        return not self.additions and not _twists(self.section)

    def _parts(self, one: Contact) -> int:
        """Of how many like parts the plate consists that is struck there; a ValueError where it cannot be struck."""
        edges = self.supports
        along_x = self._halves(f"x{one.number}", one.x, self.length, edges.left, edges.right)
        return along_x * self._halves(f"y{one.number}", one.y, self.width, edges.bottom, edges.top)

    @staticmethod
    def _halves(name: str, at: float, side: float, start: Support, end: Support) -> int:
        """2 on a symmetry edge, otherwise 1; a ValueError outside the plate and on edges that cannot move."""
        if not 0.0 <= at <= side:
            raise ValueError(f"{name} = {at!r}: must lie on the plate, between 0 and {side} m")
        edge = start if at < NEAREST * side else end if at > (1.0 - NEAREST) * side else "free"
        if not isinstance(edge, ElasticEdge) and edge not in MOVING:
            raise ValueError(f"{name} = {at!r}: lies on a {edge} edge, which cannot move; strike inside")
        return 2 if edge == "symmetry" else 1


def kirchhoff_plate(
    length: float,
    width: float,
    thickness: float | None,
    material: Material | Laminate,
    supports: Supports,
    cells: tuple[int, int] | None = None,
    highest_frequency: float = HIGHEST_FREQUENCY,
    additions: Sequence[Addition] = (),
) -> Plate:
    """A rectangular plate in Kirchhoff's theory with Bogner–Fox–Schmit elements; sizes in m.

    material: one for all the thickness, or a Laminate; its thickness is its own, so give that or None.
    highest_frequency, Hz: the mesh resolves flexural waves up to it; the default suits steel beads of 4 to 20 mm.
    cells: a uniform mesh of (along x, along y) cells instead, which all contact points share.
    additions: PointMass, Stiffener (parallel to a side) and Weakened, anywhere on the plate. Their lines are lines of
    a graded mesh; in a uniform one they may cross cells, and are still integrated exactly. On a "symmetry" edge give
    what belongs to this side of it; the mirror image adds as much.
    """
    length, width = positive("length", length, "m"), positive("width", width, "m")
    section = section_of(thickness, material)
    instance("supports", supports, Supports, "Supports(left=, right=, bottom=, top=)")
    if "symmetry" in (supports.left, supports.right, supports.bottom, supports.top) and _twists(section):
        raise ValueError(
            f"supports = {supports!r}: a laminate with D₁₆ or D₂₆ is no mirror image of itself; mesh the whole plate"
        )
    if cells is not None:
        if np.shape(cells) != (2,):
            raise ValueError(f"cells = {cells!r}: must be two whole numbers, along x and along y")
        cells = (whole("cells[0]", cells[0]), whole("cells[1]", cells[1]))
    if section.thickness > min(length, width):
        raise ValueError(f"thickness = {section.thickness!r}: exceeds the plate's shorter side, {min(length, width)} m")
    if section.thickness > min(length, width) / 10.0:
        caution(
            f"thickness = {section.thickness:g} m: exceeds a tenth of the plate's shorter side; Kirchhoff's theory is "
            "for thin plates, mindlin_plate for thicker ones"
        )
    frequency = positive("highest_frequency", highest_frequency, "Hz")
    likely("side", "kirchhoff_plate", "length", length)
    likely("side", "kirchhoff_plate", "width", width)
    likely("frequency", "kirchhoff_plate", "highest_frequency", frequency)
    added = check_additions(additions, length, width)
    return Plate(length, width, section.thickness, material, supports, cells, frequency, added)


def _sampler(
    x: Beam, y: Beam, mirrored: tuple[bool, bool], section: Section, stiffness: sparse.csr_array
) -> PlateSampler:
    """The fields of the whole plate."""
    (xs, along), (ys, across) = (beam.reading(other) for beam, other in zip((x, y), mirrored, strict=True))
    return product_sampler(xs, ys, along, across, section, stiffness)


def _twists(section: Section) -> bool:
    """Whether bending along a side also twists the plate: D₁₆ or D₂₆, above rounding."""
    bending = section.bending
    return bool(abs(bending[:2, 2]).max() > 1e-9 * abs(bending).max())
