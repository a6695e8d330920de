"""Plates: a Plate has a shape, a wall, supports and an element; `plate.at(x, y)` is the structure struck there."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from math import sqrt
from typing import Any

import numpy as np

from plates.additions import Addition, Prestress, Weakened, check_additions, forces_in_plane
from plates.contacts import Contact, Places, contacts_at, contacts_data, one_or_all
from plates.elements.assembled import Assembled, Touch
from plates.elements.hermite import Hermite
from plates.elements.mindlin import Mindlin
from plates.laminate import Laminate
from plates.section import (
    Section,
    flexural_wavelength,
    mirrors_itself,
    point_impedance,
    point_rigidity,
    stiffness_towards,
)
from plates.shapes.mesh_from_file import FlatMesh
from plates.shapes.mesh_geometry import mirrors
from plates.shapes.outline import Outline
from plates.shapes.rectangle import SIDES, Rectangle
from plates.shapes.shape import MIRROR, Cells, PlateMesh
from plates.support import KINDS, ElasticEdge, Support, Supports
from structures.caution import caution
from structures.checks import count_of, one_of
from structures.field import Field
from structures.fineness import default_frequency
from structures.linear_algebra.factor import Matrices, is_definite
from structures.material import Material, check_stress
from structures.meshes.mesh_reading import Tag
from structures.structure import Structure
from structures.surface import Surface
from structures.units import readable

MOST = 2_000_000  # The most degrees of freedom of a mesh; they need about 10 GB
THICK = 0.1  # Thickness over the shorter side above which shear matters even in the lowest modes
ROUNDING = 1e-9  # Fraction of a force below which another counts as zero
BUCKLES = 8.0  # Waves along the shorter side that the mesh for buckling resolves; the first mode has about half a wave
SHOWN = 6  # Number of edges in the repr() of a plate

# A function that replaces the mesh of a struck plate, if there is one
_ANSWERS: ContextVar[Callable[["Plate", list[Contact]], Structure | None] | None] = ContextVar("answers", default=None)


@contextmanager
def answered_by(answer: Callable[["Plate", list[Contact]], Structure | None]) -> Iterator[None]:
    """Let `Plate.at` return `answer(plate, contacts)`; if that is None, use the mesh."""
    before = _ANSWERS.set(answer)
    try:
        yield
    finally:
        _ANSWERS.reset(before)


def are_meshed() -> bool:
    """Return whether struck plates make their own mesh at present."""
    return _ANSWERS.get() is None


@dataclass(frozen=True, eq=False, repr=False)
class Plate:
    """A plate of any shape in either theory; `kirchhoff_plate`, `mindlin_plate` and `mindlin_panel` make one.

    Parameters
    ----------
    shape, section, element
        The middle surface, the wall, and the theory with its finite elements.
    supports : Supports or Mapping
        Supports of edges by name; edges that are not named are free.
    highest_frequency, additions
        As in `mindlin_plate`.
    material : Material or Laminate
        The material of the wall; the faces of a Laminate may differ.
    origin : Mapping
        The arguments of the function that made the plate, as plain data for results.

    Examples
    --------
    >>> plate = hl.kirchhoff_plate(0.3, 0.2, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> plate
    <Kirchhoff plate, 0.3 × 0.2 m, 2.29 mm of aluminium 6061; left clamped>
    """

    shape: Rectangle | Outline | FlatMesh
    section: Section
    supports: Supports | Mapping[Tag, Support]
    element: Hermite | Mindlin
    material: Material | Laminate
    highest_frequency: Any = None
    additions: Sequence[Addition] = ()
    origin: Mapping[str, Any] = field(default_factory=dict)
    _kept: dict[int, tuple[Assembled, Matrices]] = field(default_factory=dict, init=False)
    _follows: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        section, shorter = self.section, min(self.length, self.width)
        if self.highest_frequency is None:
            object.__setattr__(self, "highest_frequency", default_frequency())
            object.__setattr__(self, "_follows", True)
        if self.thickness > shorter:
            raise ValueError(f"thickness = {self.thickness!r}: must not exceed the shorter side, {shorter:.6g} m")
        if self.thin and self.thickness > THICK * shorter:
            caution(
                f"thickness = {readable(self.thickness, 'm', 6)}: exceeds a tenth of the plate's shorter "
                "side; Kirchhoff's theory is for thin plates, mindlin_plate and mindlin_panel for thicker ones"
            )
        object.__setattr__(self, "additions", check_additions(self.additions, self.shape.box, self.thin))

        forces = forces_in_plane(self.additions)
        for name, support in self._edges.items():
            if not isinstance(support, ElasticEdge):
                one_of(f"supports[{name!r}]", support, KINDS)
            if support != "symmetry":
                continue
            angles = self.shape.directions(name)
            along, across = np.array([np.cos(angles), np.sin(angles)]), np.array([-np.sin(angles), np.cos(angles)])
            sheared = np.abs(np.einsum("ik,ij,jk->k", along, forces, across)) > ROUNDING * np.abs(forces).max()
            if sheared.any() or not all(mirrors_itself(section, angle) for angle in angles):
                must = "must have a wall without D₁₆ and D₂₆, and no prestress with shear"
                raise ValueError(f"supports[{name!r}] = 'symmetry': {must}")

        # The prestress may exceed the strength of an isotropic layer.
        load = forces[[0, 1, 0], [0, 1, 1]]
        layers = [(section.struck, load / section.thickness)]
        if isinstance(self.material, Laminate):
            layers = self.material.stresses(load)
        for material, (x, y, shear) in layers:
            stress = sqrt(x**2 - x * y + y**2 + 3.0 * shear**2)
            check_stress("additions", stress, material, "Prestress takes forces per length, N/m: stress × thickness")

    @property
    def kind(self) -> str:
        """Theory and shape, for results: "Kirchhoff plate"."""
        return f"{self.element.name} {self.shape.kind}"

    @property
    def length(self) -> float:
        """Extent along x, m."""
        return self.shape.box[1] - self.shape.box[0]

    @property
    def width(self) -> float:
        """Extent along y, m."""
        return self.shape.box[3] - self.shape.box[2]

    @property
    def thickness(self) -> float:
        """Thickness of the wall, m."""
        return self.section.thickness

    @property
    def thin(self) -> bool:
        """True if the theory is Kirchhoff's, without shear."""
        return self.element.thin

    @property
    def rigidity(self) -> float:
        """Bending rigidity D = E t³ / 12(1 − ν²), N m; for a laminate, D of a plate with the same point impedance."""
        return point_rigidity(self.section)

    @property
    def mass_per_area(self) -> float:
        """ρ t, kg/m²."""
        return self.section.mass

    @property
    def point_impedance(self) -> float:
        """Force over velocity at a point of the infinite plate without additions, 8 √(D ρ t), N s/m."""
        if self.additions:
            names = ", ".join(dict.fromkeys(type(addition).__name__ for addition in self.additions))
            caution(f"additions: laws of the infinite plate neglect {names}; runs include them")
        return point_impedance(self.rigidity, self.mass_per_area)

    @property
    def shortest_wavelength(self) -> float:
        """The shortest flexural wavelength at the highest frequency, anywhere and in any direction, m."""
        section, regions = self.section, [one for one in self.additions if isinstance(one, Weakened)]
        softest = min((region.factor for region in regions), default=1.0) * float(stiffness_towards(section).min())
        shear = () if self.thin else (section.rotary_inertia, float(np.linalg.eigvalsh(section.shear)[0]))
        return flexural_wavelength(section.mass, softest, self.highest_frequency, *shear)

    def at(self, x: float | Places, y: float | Places, face: str | Sequence[str] = "front") -> Structure:
        """Return the plate struck at (x, y), or at several points.

        Rectangles and outlines are meshed for each set of contacts, with the finest cells there. Uniform meshes and
        those from files serve all contacts. If all contacts lie on a line of symmetry of a rectangle, the structure has
        only the motions that forces there excite. On a "symmetry" edge the whole plate is struck once.

        Parameters
        ----------
        x, y : float or sequence of float
            Coordinates, m; for a rectangle they start at the left bottom corner.
        face : str or sequence of str
            "front" or "back", for all contacts or for each. A contact's displacement is positive away from its chain.

        Returns
        -------
        Structure
            Mass, stiffness, contact vectors, and the field of displacement and stress. In Mindlin's theory
            `flexibility` acts at each contact alone. Between front and back at the same place this neglects 0.04 F/Et
            with the default patch, and up to 1.3 F/Et with others.
        """
        contacts = contacts_at(x, y, face)
        origin = self.data(contacts)
        surface = one_or_all([Surface(self.wall(contact.face).struck) for contact in contacts])
        if (answer := _ANSWERS.get()) is not None and (structure := answer(self, contacts)) is not None:
            return structure

        # Before the mesh is made, the size without refinement is checked.
        self._check_size(self.element.unknowns * self.shape.area / self._cells.coarsest**2)
        if np.linalg.eigvalsh(forces_in_plane(self.additions))[0] < 0.0:
            # Compression may buckle the whole plate, also in modes that no contact excites. A mesh that is much finer
            # than the first mode would hide a negative eigenvalue by rounding.
            coarse = self.element.cells(min(self.length, self.width) / BUCKLES, self.additions)
            whole = self.shape.mesh([], [], replace(coarse, finest=coarse.coarsest, halved=(False, False)))
            pressed = self.element.assemble(whole, self.section, self._held(whole), self.additions).stiffness
            if not is_definite("stiffness", pressed):
                raise ValueError("additions: must have less compression, as the plate buckles under this prestress")
        mesh = self.shape.mesh([contact.x for contact in contacts], [contact.y for contact in contacts], self._cells)
        self._check_size(self.element.unknowns * mesh.mesh.nelements)
        held, touches = self._held(mesh), []
        for contact in contacts:
            place = np.array([contact.x, contact.y])
            lines = mirrors(mesh, held, place, self.element.patch_radius)
            touches.append(Touch(place, lines, self.wall(contact.face)))
        copies = 2 ** len(touches[0].mirrors)
        if any(2 ** len(touch.mirrors) != copies for touch in touches):
            raise ValueError(f"x, y = {origin['at']}: must all lie on a symmetry edge or all inside")

        # If one mesh serves all contacts, its matrices are kept, times the number of mirror images.
        kept = self._kept if self.shape.fixed else {}
        known = next((one for one, _ in kept.values()), None)
        assembled = known or self.element.assemble(mesh, self.section, held, self.additions)
        if assembled.mass.shape[0] == 0:
            raise ValueError("cells, mesh: must be finer, as the supports hold every degree of freedom")
        if copies not in kept:
            kept[copies] = assembled, Matrices(copies * assembled.mass, copies * assembled.stiffness)
        matrices = kept[copies][1]

        vectors, flexibilities = zip(*map(assembled.contact, touches), strict=True)
        # Displacements of the plate are positive away from the front, those of a contact away from its chain.
        signs = [1.0 if contact.face == "front" else -1.0 for contact in contacts]
        columns = np.column_stack([sign * vector for sign, vector in zip(signs, vectors, strict=True)])
        flexibility = one_or_all(list(flexibilities))
        mass, stiffness = matrices.mass, matrices.stiffness
        fields = Field(partial(assembled.sampler, stiffness), len(columns))
        made = Structure(mass, stiffness, None, columns, flexibility, surface, origin, field=fields, matrices=matrices)
        return made if self.shape.fixed else made.made_by(partial(_struck_again, self, x, y, face))

    @property
    def _edges(self) -> dict[Tag, Support]:
        """The supports of the edges that are not free."""
        stated = self.supports
        pairs = {name: getattr(stated, name) for name in SIDES} if isinstance(stated, Supports) else stated
        return {
            name: support for name, support in pairs.items() if isinstance(support, ElasticEdge) or support != "free"
        }

    def _held(self, mesh: PlateMesh) -> dict[Tag, Support]:
        """Return the supports of the edges of a mesh; the edge of a half plate has symmetry."""
        every: dict[Tag, Support] = {MIRROR: "symmetry", **self._edges}
        return {name: support for name, support in every.items() if name in mesh.edges and mesh.edges[name].size}

    @property
    def _cells(self) -> Cells:
        """The cells that the element requires, with halves allowed if the halves differ at most in the contacts."""
        left, right, bottom, top = (self._edges.get(name, "free") for name in SIDES)
        everywhere = all(isinstance(addition, Prestress) for addition in self.additions)
        unsheared = forces_in_plane(self.additions)[0, 1] == 0.0 and mirrors_itself(self.section, 0.0)
        equal = everywhere and unsheared
        cells = self.element.cells(self.shortest_wavelength, self.additions).finer()
        return replace(cells, halved=(equal and left == right, equal and bottom == top))

    def _check_size(self, count: float) -> None:
        """Raise a ValueError if there are more degrees of freedom than fit in memory."""
        if count > MOST and not self.shape.fixed:
            raise ValueError(f"highest_frequency: requires {count:.2g} unknowns; is the plate in millimetres?")

    def wall(self, face: str) -> Section:
        """Return the wall that is struck on a face."""
        return self.material.section("back") if face == "back" and isinstance(self.material, Laminate) else self.section

    def data(self, contacts: Sequence[Contact]) -> dict[str, Any]:
        """Return the arguments of the plate and its contacts, as plain data."""
        held = asdict(self.supports) if isinstance(self.supports, Supports) else {
            name: asdict(support) if isinstance(support, ElasticEdge) else support
            for name, support in self._edges.items()
        }  # fmt: skip
        return {
            **{name: value for name, value in self.origin.items() if name != "shape"},
            **self.shape.described(),
            "supports": held,
            "thickness": self.thickness,
            "section": self.section.data,
            "patch_radius": self.element.patch_radius or None,
            "highest_frequency": None if self.shape.fixed else self.highest_frequency,
            **contacts_data(contacts),
        }

    def __repr__(self) -> str:
        held = [
            f"{name} {'on springs' if isinstance(kind, ElasticEdge) else kind}" for name, kind in self._edges.items()
        ]
        more = f" and {len(held) - SHOWN} more" if len(held) > SHOWN else ""
        wall = f"{1e3 * self.thickness:.4g} mm of {self.material.name or 'a material'}"
        parts = [f"{self.kind}, {self.shape.summary()}, {wall}", ", ".join(held[:SHOWN]) + more or "all edges free"]
        parts += [count_of(len(self.additions), "addition")] * bool(self.additions)
        return f"<{'; '.join(parts)}>"


def _struck_again(plate: Plate, *place: Any) -> Structure:
    """Return the plate struck at the place; a default frequency depends on the contact time."""
    return replace(plate, highest_frequency=None if plate._follows else plate.highest_frequency).at(*place)
