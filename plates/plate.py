"""Plates: a Plate holds shape, wall, supports and element; `plate.at(x, y)` is the structure struck there."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from math import ceil, sqrt
from typing import Any

import numpy as np

from plates.additions import Addition, check_additions, forces_in_plane, halves_alike, weakest
from plates.contacts import Contact, Places, common_copies, contacts_at, contacts_data, one_or_all
from plates.elements.theory import Assembled, Element, Touch
from plates.laminate import Laminate
from plates.section import Section, all_around, check_thickness, mirrors_itself, point_rigidity, section_data
from plates.shapes.mesh_geometry import check_place, mirrors
from plates.shapes.rectangle import SIDES
from plates.shapes.shape import MIRROR, Cells, PlateMesh, Shape
from plates.support import ElasticEdge, Support, Supports, check_support, summary
from structures.caution import caution
from structures.checks import html_table, instance, positive, short
from structures.field import Field
from structures.fineness import default_frequency
from structures.linear_algebra.factor import Matrices, is_definite
from structures.material import Material, check_stress
from structures.meshes.mesh_reading import Tag, known
from structures.structure import Structure
from structures.surface import Surface
from structures.unmeshed import Unmeshed, is_unmeshed

MEMBERS = (
    "name", "thin", "patch_radius", "unknowns", "described", "wavelength", "cells", "objection", "assemble",
    "flexibility",
)  # fmt: skip
"""What an element must have, see plates.elements.theory.Element."""

MOST = 2_000_000
"""Degrees of freedom that may be assembled: they fill some 10 GB."""

MANY = 100_000
"""Degrees of freedom beyond which a warning announces minutes and gigabytes; 100 000 reduce in some 15 s."""

BYTES_PER_UNKNOWN = 1e4
"""Memory of a degree of freedom with its part of the factorised matrices."""

ROUNDING = 1e-9
"""Part of a force below which it counts as zero."""

BUCKLES = 8.0
"""Waves along the shorter side that the mesh for buckling resolves: the first mode has about half of one."""


@dataclass(frozen=True, eq=False, repr=False)
class Plate:
    """A plate of any shape in any theory; `kirchhoff_plate`, `mindlin_plate` and `mindlin_panel` make one.

    Parameters
    ----------
    shape : Rectangle, Outline or FlatMesh
        Anything that meets the protocol `plates.shapes.shape.Shape`.
    section : Section
        The wall.
    supports : Supports or Mapping
        How edges are held, by name; edges that are not named are free.
    element : Element
        Theory and finite elements: anything that meets the protocol `plates.elements.theory.Element`.
    highest_frequency : float, optional
        The mesh resolves flexural waves up to it, Hz. By default 40 kHz, and more for contacts below 10 µs.
    additions : sequence of PointMass, Stiffener, Weakened and Prestress
        What is fixed to the plate, where it is weak, and forces in its plane.
    material : Material, Laminate or None
        What the section was made of; the faces of a Laminate may differ. None takes the section's `struck` material.
    origin : Mapping
        The arguments of the function that made the plate, as plain data for results.

    Raises
    ------
    ValueError
        For edges that the shape does not have, additions that lie off the plate or that the element cannot carry, walls
        thicker than the plate is wide, and "symmetry" edges in which the wall is not its own mirror image.

    Examples
    --------
    >>> import hertzlink as hl
    >>> plate = hl.kirchhoff_plate(0.3, 0.2, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> plate
    <Kirchhoff plate, 0.3 × 0.2 m, 2.29 mm of aluminium 6061; left clamped>
    >>> plate.at(0.1, 0.1).contacts
    1
    """

    shape: Shape
    section: Section
    supports: Supports | Mapping[Tag, Support]
    element: Element
    highest_frequency: Any = None
    additions: Sequence[Addition] = ()
    material: Material | Laminate | None = None
    origin: Mapping[str, Any] = field(default_factory=dict)
    _kept: dict[int, tuple[Assembled, Matrices]] = field(default_factory=dict, init=False)
    _follows: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        for part, value, members, what in (
            ("element", self.element, MEMBERS, "an Element of plates.elements.theory"),
            (
                "shape",
                self.shape,
                ("box", "names", "area", "mesh"),
                "an Outline or another Shape of plates.shapes.shape",
            ),
        ):
            lacking = [member for member in members if not hasattr(value, member)]
            if lacking or isinstance(value, type):
                why = f"lacks {', '.join(lacking)}" if lacking else "is a class; give an instance"
                raise ValueError(f"{part} = {short(value)}: must be {what}; it {why}")
        instance("section", self.section, Section, "a Section such as homogeneous_section(thickness, material)")
        if not isinstance(self.material, Material | Laminate | None):
            raise ValueError(f"material = {short(self.material)}: must be a Material, a Laminate or None")
        box, section = self.shape.box, self.section
        if self.highest_frequency is None:
            object.__setattr__(self, "highest_frequency", default_frequency())
            object.__setattr__(self, "_follows", True)
        object.__setattr__(self, "highest_frequency", positive("highest_frequency", self.highest_frequency, "Hz"))
        if not isinstance(self.supports, Supports):
            supports = instance(
                "supports", self.supports, Mapping, 'Supports, or a dictionary such as {"rim": "clamped"}'
            )
            named = {known("supports", name, self.shape.names): support for name, support in supports.items()}
            object.__setattr__(self, "supports", named)
        for name, support in self._edges.items():
            check_support(f"supports[{name!r}]", support)
            if support == "symmetry" and self._shears_along(name):
                raise ValueError(
                    f"supports[{name!r}] = 'symmetry': a prestress with a shear force along this edge is not its own "
                    "mirror image; mesh the whole plate"
                )
            if support == "symmetry" and not all(mirrors_itself(section, a) for a in self.shape.directions(name)):
                raise ValueError(
                    f"supports[{name!r}] = 'symmetry': a wall with D₁₆ or D₂₆ along this edge is not its own mirror "
                    "image; mesh the whole plate"
                )
        check_thickness(section.thickness, min(self.length, self.width), self.element.thin)
        object.__setattr__(self, "additions", check_additions(self.additions, box))
        for i, addition in enumerate(self.additions):
            if objection := self.element.objection(addition):
                raise ValueError(f"additions[{i}] = {addition!r}: {objection}")
        means = "Prestress takes forces per length, N/m: stress × thickness"
        for material, stress in self._stresses():
            check_stress("additions", stress, material, means)

    def _stresses(self) -> list[tuple[Material, float]]:
        """Return the material of each isotropic layer, and von Mises's stress in it by the prestress, Pa."""
        (xx, xy), (_, yy) = forces_in_plane(self.additions)
        forces = np.array([xx, yy, xy])
        if isinstance(self.material, Laminate):
            layers = self.material.stresses(forces)
        else:
            layers = [(self.section.struck, forces / self.section.thickness)]
        return [(layer, sqrt(x**2 - x * y + y**2 + 3.0 * s**2)) for layer, (x, y, s) in layers]

    @property
    def kind(self) -> str:
        """Theory and shape, as results name them: "Kirchhoff plate"."""
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
    def point_impedance(self) -> float:
        """Force over velocity at a point of the infinite plain plate, 8 √(D ρ t), N s/m.

        It is real: an impulse I moves the point by I / (8 √(D ρ t)), where it stays until an echo returns (Cremer,
        Heckl, Petersson, Structure-Borne Sound, 3rd ed., table 5.1). A laminate has the rigidity D of the isotropic
        plate with the same impedance. Additions are left out, and the user is warned.
        """
        if self.additions:
            names = ", ".join(dict.fromkeys(type(addition).__name__ for addition in self.additions))
            caution(
                f"additions: laws of a plain plate leave out {names}; runs include them, and critical_distance_search "
                "searches with them"
            )
        return float(8.0 * (point_rigidity(self.section) * self.mass_per_area) ** 0.5)

    @property
    def thin(self) -> bool:
        """True if the theory is Kirchhoff's, without shear."""
        return self.element.thin

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
        """The shortest length of flexural waves at the highest frequency anywhere and in any direction, m."""
        softest = weakest(self.additions) * float(all_around(self.section).min())
        return self.element.wavelength(self.section, softest, self.highest_frequency)

    def at(self, x: float | Places, y: float | Places, face: str | Sequence[str] = "front") -> Structure:
        """Return the plate struck at (x, y), or at several points.

        Rectangles and outlines are meshed for each set of contacts and finest there, since a point force converges
        slowly on a uniform mesh; uniform meshes and those from files serve all contacts. Where all contacts lie on a
        line of symmetry of a rectangle, the structure holds only the motions that forces there can excite. On a
        "symmetry" edge the whole plate, of which this is a part, is struck once; inside, its image is struck too.

        Parameters
        ----------
        x, y : float or sequence of float
            Coordinates, m. Those of a rectangle start at its left bottom corner.
        face : str or sequence of str
            "front" or "back", one for all contacts or one for each. A contact's displacement is positive away from its
            chain.

        Returns
        -------
        Structure
            Mass, stiffness, contact vectors, and the field of displacement and stress. In Mindlin's theory
            `flexibility` belongs to each contact alone: one contact acts on another by bending and shear only. From the
            front to the back of one place this lacks 0.04 F/Et with the default patch, up to 1.3 F/Et with others.

        Raises
        ------
        ValueError
            Outside the plate; on an edge that cannot move; where a patch reaches beyond an edge; where two contacts
            coincide; where some contacts lie on a "symmetry" edge and others inside.
        """
        contacts = contacts_at(x, y, face)
        if is_unmeshed():
            surface = one_or_all([Surface(self.wall(contact.face).struck) for contact in contacts])
            make = partial(self.at, x, y, face)
            return Unmeshed(body=self, place=contacts, make=make, surface=surface, origin=self.data(contacts))
        _, assembled, matrices, touches = self.meshed(contacts)
        columns = [contact.sign * assembled.contact(touch) for contact, touch in zip(contacts, touches, strict=True)]
        contact = np.column_stack(columns)
        if self.shape.fixed and len(contact) > MANY:
            caution(f"mesh: its {len(contact)} degrees of freedom take minutes and gigabytes to reduce")
        flexibility = one_or_all([self.element.flexibility(touch.wall) for touch in touches])
        surface = one_or_all([Surface(touch.wall.struck) for touch in touches])
        mass, stiffness = matrices.mass, matrices.stiffness
        fields = Field(partial(assembled.sampler, stiffness), len(contact))
        origin = self.data(contacts)
        made = Structure(mass, stiffness, None, contact, flexibility, surface, origin, field=fields, matrices=matrices)
        return made if self.shape.fixed else made.made_by(partial(_struck_again, self, x, y, face))

    def meshed(self, contacts: Sequence[Contact]) -> tuple[PlateMesh, Assembled, Matrices, list[Touch]]:
        """Return the mesh for these contacts, the plate on it, its matrices, and the contacts on the mesh."""
        # Without its refinement at the contact, before it is made.
        self._check_size(self.element.unknowns * self.shape.area / self._cells.coarsest**2)
        self._check_buckling()
        mesh = self.shape.mesh([contact.x for contact in contacts], [contact.y for contact in contacts], self._cells)
        count = self.element.unknowns * mesh.mesh.nelements
        self._check_size(count)
        if count > MANY and not self.shape.fixed:
            caution(
                f"highest_frequency = {self.highest_frequency!r}: requires about {count:.2g} degrees of freedom, which "
                f"take minutes and some {ceil(1e-9 * BYTES_PER_UNKNOWN * count)} GB"
            )
        held = {name: support for name, support in {MIRROR: "symmetry", **self._edges}.items() if _has(mesh, name)}
        touches = []
        for contact in contacts:
            place = np.array([contact.x, contact.y])
            check_place(mesh, held, place, self.element.patch_radius)
            touches.append(Touch(place, mirrors(mesh, held, place), self.wall(contact.face)))
        copies = common_copies(contacts, [2 ** len(touch.mirrors) for touch in touches])
        return mesh, *self._assembled(mesh, held, copies), touches

    @property
    def _edges(self) -> dict[Tag, Support]:
        """The supports of the edges, the free ones left out."""
        stated = self.supports
        pairs = {name: getattr(stated, name) for name in SIDES} if isinstance(stated, Supports) else stated
        return {
            name: support for name, support in pairs.items() if not (isinstance(support, str) and support == "free")
        }

    def _check_buckling(self) -> None:
        """Raise a ValueError where the prestress buckles the whole plate, also in ways that no contact excites."""
        if np.linalg.eigvalsh(forces_in_plane(self.additions))[0] >= 0.0:
            return
        # Rounding hides a negative eigenvalue of a mesh that is much finer than the first mode.
        cells = self.element.cells(min(self.length, self.width) / BUCKLES, self.additions)
        mesh = self.shape.mesh([], [], replace(cells, finest=cells.coarsest, halved=(False, False)))
        held = {name: support for name, support in self._edges.items() if _has(mesh, name)}
        if not is_definite("stiffness", self.element.assemble(mesh, self.section, held, self.additions).stiffness):
            raise ValueError("additions: the plate buckles under this prestress; give less compression")

    def _shears_along(self, name: Tag) -> bool:
        """Return whether the prestress has a shear force along an edge."""
        forces, angles = forces_in_plane(self.additions), self.shape.directions(name)
        along = np.stack([np.cos(angles), np.sin(angles)])
        across = np.stack([-along[1], along[0]])
        sheared = np.einsum("ik,ij,jk->k", along, forces, across)
        return bool((np.abs(sheared) > ROUNDING * np.abs(forces).max()).any())

    @property
    def finest_cell(self) -> float:
        """Size of the cells at a contact, m."""
        return self._cells.finest

    @property
    def _cells(self) -> Cells:
        """The cells that the element requires; halves where only the contacts may differ between them."""
        left, right, bottom, top = (self._edges.get(name, "free") for name in SIDES)
        alike = halves_alike(self.additions, (self.length, self.width))
        equal = forces_in_plane(self.additions)[0, 1] == 0.0 and mirrors_itself(self.section, 0.0)
        cells = self.element.cells(self.shortest_wavelength, self.additions).finer()
        return replace(cells, halved=(equal and alike[0] and left == right, equal and alike[1] and bottom == top))

    def _check_size(self, count: float) -> None:
        """Raise a ValueError for more degrees of freedom than fit in memory."""
        if count > MOST and not self.shape.fixed:
            raise ValueError(
                f"highest_frequency = {self.highest_frequency!r}: requires about {count:.2g} degrees of freedom on "
                f"{self.shape.area:.3g} m² of plate, more than {MOST:.0e}; is the plate in millimetres?"
            )

    def wall(self, face: str) -> Section:
        """Return the wall with the material that is struck on a face."""
        return self.material.section("back") if face == "back" and isinstance(self.material, Laminate) else self.section

    def _assembled(self, mesh: PlateMesh, held: Mapping[Tag, Support], copies: int) -> tuple[Assembled, Matrices]:
        """Return the plate on a mesh, and its matrices as often as it continues beyond its edges; kept where one mesh
        serves all contacts."""
        if copies in self._kept:
            return self._kept[copies]
        if self._kept:
            assembled = next(iter(self._kept.values()))[0]
        else:
            assembled = self.element.assemble(mesh, self.section, held, self.additions)
        entry = assembled, Matrices(copies * assembled.mass, copies * assembled.stiffness)
        if self.shape.fixed:
            self._kept[copies] = entry
        return entry

    def data(self, contacts: Sequence[Contact]) -> dict[str, Any]:
        """Return how the plate was made and where it is struck, as plain data."""
        edges = asdict(self.supports) if isinstance(self.supports, Supports) else {
            name: asdict(edge) if isinstance(edge, ElasticEdge) else edge for name, edge in self._edges.items()
        }  # fmt: skip
        plain = {
            "kind": self.kind,
            **self.shape.described(),
            "thickness": self.thickness,
            "material": None if self.material is None else asdict(self.material),
            "section": section_data(self.section),
            "supports": edges,
            "patch_radius": self.element.patch_radius or None,
            **self.element.described(),
            "highest_frequency": None if self.shape.fixed else self.highest_frequency,
            "additions": [asdict(addition) for addition in self.additions],
        }
        rest = {name: value for name, value in self.origin.items() if name not in (*plain, "shape")}
        return {**plain, **rest, **contacts_data(contacts)}

    def _rows(self) -> list[tuple[str, str]]:
        """Return what the plate consists of, in words."""
        of = self.section.struck.name if self.material is None else self.material.name
        rows = [("size", self.shape.summary()), ("wall", f"{1e3 * self.thickness:.4g} mm of {of or 'a material'}")]
        rows.append(("supports", summary(self._edges) or "all edges free"))
        if self.additions:
            rows.append(("additions", f"{len(self.additions)} addition{'s' * (len(self.additions) > 1)}"))
        return rows

    def __repr__(self) -> str:
        rows = dict(self._rows())
        texts = [f"{self.kind}, {rows['size']}, {rows['wall']}", rows["supports"]]
        texts += [rows["additions"]] if "additions" in rows else []
        return f"<{'; '.join(texts)}>"

    def _repr_html_(self) -> str:
        return html_table(self.kind, self._rows())


def _struck_again(plate: Plate, *place: Any) -> Structure:
    """Return the plate struck at the place; a default mesh follows the contact."""
    return replace(plate, highest_frequency=None if plate._follows else plate.highest_frequency).at(*place)


def _has(mesh: PlateMesh, name: Tag) -> bool:
    return name in mesh.edges and mesh.edges[name].size > 0
