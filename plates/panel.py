"""Plates of any shape: a Panel holds shape, wall and supports; `panel.at(x, y)` is the structure struck there."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from math import pi
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from plates.additions import Addition
from plates.contact_place import Mirror, cell_size, check_place, disc, mirrors
from plates.contacts import Contact, Places, alike, contacts_at, one_or_all, told
from plates.elements.field import panel_sampler
from plates.elements.indentation import bending_by_poisson, remaining_flexibility
from plates.elements.mindlin import Mindlin
from plates.elements.morley import Morley
from plates.laminate import Laminate, section_of, struck
from plates.panel_additions import Matrix, Theory, check_regions, known_additions, weakening, weakest, with_additions
from plates.plate import HIGHEST_FREQUENCY
from plates.section import SHEAR_CORRECTION, Section, all_around
from plates.shapes.flat_mesh import FlatMesh
from plates.shapes.mesh import PanelMesh, Shape, Sizes, check_straight
from plates.shapes.outline import Outline
from plates.support import ElasticEdge, Support, check_support
from structures.caution import caution
from structures.checks import instance, positive
from structures.factor import Matrices
from structures.field import Field
from structures.material import Material
from structures.mesh_source import Tag, known
from structures.plausible import likely
from structures.structure import Structure, Vector
from structures.surface import Surface

log = logging.getLogger("hertzlink.plates")

DEGREE = 4
"""Of the polynomials in Mindlin's theory: free of locking in practice down to a thickness of 0.0025 of the side."""

PATCH = 0.5
"""The default patch's radius over the thickness."""

PATCHES = 5.0
"""Cells at the contact may be larger than the patch's radius by this: four times cost 0.2 % of the compliance, eight
times 3 %."""

WIDEST = 2.0
"""Thicknesses that a patch's radius may have: there AR is some 0.5 % off, at three 3 %."""

MOST = 2_000_000
"""Degrees of freedom that may be assembled."""

MANY = 200_000
"""Degrees of freedom. 100 000 reduce in some 15 s."""


class _OnMesh(NamedTuple):
    """A theory on a mesh; the motions that the supports leave; M and K of these."""

    theory: Theory
    kept: Matrix
    matrices: Matrices


@dataclass(frozen=True, eq=False)
class Panel:
    """A plate of any shape; `kirchhoff_panel`, `mindlin_panel` and `mindlin_plate` make one.

    kind: as results tell it. patch_radius, m: of the disc that the force is spread over in Mindlin's theory; None in
    Kirchhoff's, where it acts at a point. material: what the section was made of; a Laminate's faces may differ.
    """

    kind: str
    shape: Shape
    section: Section
    supports: Mapping[Tag, Support]
    patch_radius: float | None
    highest_frequency: float
    additions: tuple[Addition, ...] = ()
    material: Material | Laminate | Section | None = None
    _kept: dict[int, tuple[PanelMesh, _OnMesh]] = field(default_factory=dict, init=False, repr=False)

    @property
    def mass_per_area(self) -> float:
        """kg/m²."""
        return self.section.mass

    @property
    def shortest_wavelength(self) -> float:
        """Length of flexural waves at the highest frequency, m, where and whither the plate is softest."""
        softest, circular = (
            weakest(self.additions) * float(all_around(self.section).min()),
            2.0 * pi * self.highest_frequency,
        )
        mass, turning, shear = self.section.mass, 0.0, np.inf
        if self.patch_radius is not None:
            turning, shear = self.section.rotary_inertia, float(np.linalg.eigvalsh(self.section.shear)[0])
        # D k⁴ − (J + m D/S) ω² k² − m ω² (1 − J ω²/S) = 0: its larger root.
        linear = (turning + mass * softest / shear) * circular**2
        constant = mass * circular**2 * (1.0 - turning * circular**2 / shear)
        square = (linear + np.sqrt(linear**2 + 4.0 * softest * constant)) / (2.0 * softest)
        return float(2.0 * pi / np.sqrt(square))

    def at(self, x: float | Places, y: float | Places, face: str | Sequence[str] = "front") -> Structure:
        """The plate struck at (x, y), m; or at several points, of which x and y are lists.

        An outline or a rectangle is meshed for each contact, or each set of them, finest there; a mesh from a file
        serves all. On a "symmetry" edge the whole plate, of which this is a part, is struck once.
        face: "front" or "back", one for all or one for each. A contact's displacement is positive away from its chain.
        In Mindlin's theory `flexibility` is each contact's own: what one does to another is told by bending and shear
        alone. From the front to the back of one place that lacks 0.04 F/Et with the default patch, up to 1.3 F/Et with
        others.
        Raises ValueError outside the plate, on an edge that cannot move, where the patch reaches beyond an edge, where
        two contacts are one, and where some lie on a "symmetry" edge and others beside it.
        """
        contacts = contacts_at(x, y, face)
        self._check_size()
        panel = self.shape.mesh([one.x for one in contacts], [one.y for one in contacts], self._sizes)
        across = []
        for one in contacts:
            check_place(panel, self.supports, np.array([one.x, one.y]), self.patch_radius)
            across.append(mirrors(panel, self.supports, np.array([one.x, one.y])))
        theory, kept, matrices = self._matrices(panel, alike(contacts, [2 ** len(lines) for lines in across]))
        columns = [self._contact(panel, theory, *pair) @ kept for pair in zip(contacts, across, strict=True)]
        contact = np.column_stack(columns)
        if len(contact) > MANY:
            log.warning("%d degrees of freedom take minutes and gigabytes to reduce", len(contact))
        walls, patch = [self._wall(one) for one in contacts], self.patch_radius
        flexibility = one_or_all([0.0 if patch is None else remaining_flexibility(wall, patch) for wall in walls])
        surface = one_or_all([Surface(wall.struck) for wall in walls])
        mass, stiffness = matrices.mass, matrices.stiffness
        fields, origin = (
            Field(partial(panel_sampler, panel.mesh, theory, kept, self.section, stiffness), len(contact)),
            self._origin(contacts),
        )
        return Structure(mass, stiffness, None, contact, flexibility, surface, origin, field=fields, matrices=matrices)

    def _contact(self, panel: PanelMesh, theory: Theory, contact: Contact, across: list[Mirror]) -> Vector:
        """What spreads the force of a contact, which lies on lines of symmetry or on none."""
        place = np.array([contact.x, contact.y])
        if not isinstance(theory, Mindlin) or self.patch_radius is None:
            return np.asarray(contact.sign * theory.deflection(place[None]).toarray()[0])
        if (size := cell_size(panel, place)) > PATCHES * self.patch_radius:
            caution(
                f"mesh: cells of {size:.3g} m at the contact are too large for a patch of {self.patch_radius:.3g} m; "
                f"refine them to {PATCHES * self.patch_radius:.3g} m"
            )
        points, weights = disc(place, self.patch_radius, across)
        bend = bending_by_poisson(self._wall(contact), self.patch_radius)
        return np.asarray(contact.sign * theory.mean(points, weights, bend))

    def _wall(self, contact: Contact) -> Section:
        """The section with the material that the contact sees."""
        return replace(self.section, struck=struck(self.section, self.material, contact.face))

    def _check_size(self) -> None:
        """A ValueError before a mesh is made that would not fit in memory."""
        coarsest, each = self._sizes.coarsest, 1 if self.patch_radius is None else 3 * DEGREE**2
        count = each * self.shape.area / coarsest**2
        if count > MOST:
            raise ValueError(
                f"highest_frequency = {self.highest_frequency!r}: wants some {count:.2g} degrees of freedom on "
                f"{self.shape.area:.3g} m² of plate, more than {MOST:.0e}; is the plate in millimetres?"
            )

    @property
    def _sizes(self) -> Sizes:
        wave = self.shortest_wavelength
        if self.patch_radius is None:
            return Sizes(wave / 24.0, 0.15, wave / 8.0)
        return Sizes(min(self.patch_radius, wave), 0.6, 1.6 * wave)

    def _matrices(self, panel: PanelMesh, copies: int) -> _OnMesh:
        """Of a mesh, as often as the plate goes on beyond its edges; those of the last mesh are kept."""
        if not self._kept or next(iter(self._kept.values()))[0] is not panel:
            self._kept.clear()
            self._kept[1] = panel, self._assembled(panel)
        if copies not in self._kept:
            one = self._kept[1][1]
            many = Matrices(copies * one.matrices.mass, copies * one.matrices.stiffness)
            self._kept[copies] = panel, one._replace(matrices=many)
        return self._kept[copies][1]

    def _assembled(self, panel: PanelMesh) -> _OnMesh:
        check_regions(panel.mesh, self.additions)
        thin = self.patch_radius is None
        theory: Theory = Morley(panel.mesh, self.section) if thin else Mindlin(panel.mesh, self.section, DEGREE)
        mass, stiffness = theory.matrices(weakening(self.additions))
        supports = {name: support for name, support in self.supports.items() if panel.edges[name].size}
        for name, support in supports.items():
            if support in ("simple", "soft simple") and panel.mesh.t.shape[0] == 4:
                check_straight(panel.mesh, panel.edges[name], name)
            if isinstance(support, ElasticEdge):
                stiffness = stiffness + theory.springs(panel.edges[name], support)
        mass, stiffness = with_additions(theory, mass, stiffness, self.additions)
        kept = theory.kept(panel.edges, supports)
        if kept.shape[1] == 0:
            raise ValueError("mesh: the supports hold every degree of freedom; use smaller cells")
        mass, stiffness = (sparse.csr_array(kept.T @ one @ kept) for one in (mass, stiffness))
        return _OnMesh(theory, kept, Matrices(mass, stiffness))

    def _origin(self, contacts: Sequence[Contact]) -> dict[str, Any]:
        section = asdict(self.section)
        section |= {name: section[name].tolist() for name in ("bending", "shear")}
        return {
            "kind": self.kind,
            **self.shape.described(),
            "section": section,
            "supports": {name: asdict(s) if isinstance(s, ElasticEdge) else s for name, s in self.supports.items()},
            "patch_radius": self.patch_radius,
            "highest_frequency": self.highest_frequency,
            "additions": [asdict(one) for one in self.additions],
            **told(contacts),
        }


def kirchhoff_panel(
    shape: Any,
    thickness: float | None,
    material: Material | Laminate | Section,
    supports: Mapping[Tag, Support] | None = None,
    highest_frequency: float = HIGHEST_FREQUENCY,
    additions: Sequence[Addition] = (),
    scale: float | None = None,
) -> Panel:
    """A thin plate of any shape in Kirchhoff's theory, on Morley's triangles; arguments as in `mindlin_panel`.

    The force acts at a point. The triangles are an eighth of the shortest flexural wave, a third of that at the
    contact, and of order 2, with most of the error of that order taken out (`plates.elements.morley`):
    by default the static
    compliance at the contact is within 0.1 % of closed forms, and AR within 0.001 of the incident wave where echoes of
    the edges shape it. `mindlin_panel` needs a tenth of the degrees of freedom, in thin plates too; this is the check
    on it. A mesh from a file may be coarser: its error grows with the square of the size of its cells.
    additions: PointMass and Weakened. Raises ValueError for meshes of quadrilaterals.
    """
    section = wall(thickness, material, SHEAR_CORRECTION)
    found, held = _shape(shape, section, supports, scale)
    if isinstance(found, FlatMesh) and found.quadrilateral:
        raise ValueError("mesh: has quadrilaterals; Morley's elements are triangles, mindlin_panel takes both")
    frequency = positive("highest_frequency", highest_frequency, "Hz")
    likely("frequency", "kirchhoff_panel", "highest_frequency", frequency)
    return Panel("Kirchhoff panel", found, section, held, None, frequency, known_additions(additions), material)


def mindlin_panel(
    shape: Any,
    thickness: float | None,
    material: Material | Laminate | Section,
    supports: Mapping[Tag, Support] | None = None,
    shear_correction: float = SHEAR_CORRECTION,
    patch_radius: float | None = None,
    highest_frequency: float = HIGHEST_FREQUENCY,
    additions: Sequence[Addition] = (),
    scale: float | None = None,
) -> Panel:
    """A plate of any shape in Mindlin's theory, on triangles or quadrilaterals of order 4; sizes in m.

    shape: an Outline, meshed with triangles that are finest at the contact (needs `pip install hertzlink[mesh]`); or a
    flat mesh of triangles or quadrilaterals: a file that meshio reads (gmsh's .msh, .vtu, Abaqus' .inp) or a
    meshio.Mesh, which all contacts share and whose cells at the contact should be no larger than twice the thickness.
    Midpoints of curved cells are dropped.
    material: one for all the thickness; or a Laminate or a Section, which bring their own thickness.
    supports: how edges are held, by name: {"rim": "clamped"}; see Supports for the kinds, and ElasticEdge. Others are
    free. Names are the outline's, or the mesh's tags: names and numbers of physical groups of lines in gmsh, sets of
    points. Edges that are polygons of curves (sides that meet at less than 30°) are held on the curve: a simple circle
    of 96 corners is good to 0.1 %; on quadrilaterals they are refused.
    additions: PointMass; Stiffener along any straight line; Weakened, exact where cells end at the region's edges.
    scale: m per unit of the mesh. None is 1, and refuses panels that look like millimetres.
    shear_correction, patch_radius, highest_frequency: see `mindlin_plate`.
    Raises ValueError for what cannot be a panel: outlines that cross themselves, meshes that are folded or not flat,
    names of edges that are not there; `at` where the contact lies outside, in a hole, or on an edge that is held.
    """
    section = wall(thickness, material, shear_correction)
    found, held = _shape(shape, section, supports, scale)
    patch = patch_of(section, patch_radius)
    frequency = positive("highest_frequency", highest_frequency, "Hz")
    likely("frequency", "mindlin_panel", "highest_frequency", frequency)
    return Panel("Mindlin panel", found, section, held, patch, frequency, known_additions(additions), material)


def patch_of(section: Section, given: float | None) -> float:
    """The radius of the disc that is pushed, m; a ValueError where it is no spot beside the thickness."""
    if given is None:
        return PATCH * section.thickness
    patch, widest = positive("patch_radius", given, "m"), WIDEST * section.thickness
    if patch > widest:
        raise ValueError(f"patch_radius = {given!r}: must be at most {WIDEST:g} thicknesses, {widest:.4g} m")
    return patch


def wall(thickness: float | None, material: Material | Laminate | Section, shear_correction: float) -> Section:
    """The section of a plate of a thickness, m, and a material, or the one that is given instead of a material."""
    if isinstance(material, Section):
        own = material.thickness
        if thickness is not None and abs(positive("thickness", thickness, "m") - own) > 1e-6 * own:
            raise ValueError(f"thickness = {thickness!r}: must be None or the section's own, {own:.9g} m")
        return material
    return section_of(thickness, material, positive("shear_correction", shear_correction))


def _shape(
    given: Any, section: Section, supports: Mapping[Tag, Support] | None, scale: float | None
) -> tuple[Shape, dict[Tag, Support]]:
    """The shape, and how its edges are held, the free ones left out."""
    shape: Shape
    if isinstance(given, Outline):
        if scale is not None:
            raise ValueError(f"scale = {scale!r}: an Outline is in m; scale is for meshes")
        if section.thickness > given.size:
            raise ValueError(f"thickness = {section.thickness!r}: exceeds the panel's longer side, {given.size:.3g} m")
        shape = given
    else:
        shape = FlatMesh(given, section.thickness, scale)
    if supports is None:
        return shape, {}
    instance("supports", supports, Mapping, 'a dictionary such as {"rim": "clamped"}, by name of edge')
    for name, support in supports.items():
        known("supports", name, shape.names)
        check_support(f"supports[{name!r}]", support)
    return shape, {name: support for name, support in supports.items() if support != "free"}
