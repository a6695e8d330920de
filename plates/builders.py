"""Builders of plates: a rectangle, an outline, or a mesh from a file, in Kirchhoff's or Mindlin's theory."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

from plates.additions import Addition
from plates.elements.hermite import Hermite
from plates.elements.mindlin import Mindlin
from plates.laminate import Laminate, section_of
from plates.plate import Plate
from plates.section import SHEAR_CORRECTION, Section, ShearCorrection
from plates.shapes.mesh_from_file import FlatMesh
from plates.shapes.outline import Outline
from plates.shapes.rectangle import Rectangle
from plates.support import Edge, Supports
from structures.checks import instance, one_of, several, short, whole, within
from structures.described import described_as
from structures.fineness import fineness
from structures.material import Material
from structures.meshes.mesh_reading import Tag
from structures.quantities import Asks, Frequency, Length, Scale, Several, Side, WallThickness

if TYPE_CHECKING:
    import meshio

Wall: TypeAlias = Material | Laminate  # one material, or plies with a material each
# An outline, or a flat mesh: the path of a file, or a meshio.Mesh.
PanelShape: TypeAlias = "Outline | str | Path | meshio.Mesh"
HELD = Asks('a table such as { left = "clamped" }')
TAGS = Asks("the data of the mesh that number its sides")
MOST_CELLS = 200_000  # The most cells of a uniform mesh: about 5 GB in Mindlin's theory
# Default and largest radius of a patch, in thicknesses. With 2 the error of AR is about 0.5 %, with 3 about 3 %.
PATCH, WIDEST = 0.5, 2.0


@described_as(called="Kirchhoff plate")
def kirchhoff_plate(
    length: Side,
    width: Side,
    thickness: WallThickness | None,
    material: Wall,
    supports: Annotated[Supports, HELD],
    cells: tuple[Several, Several] | None = None,
    highest_frequency: Frequency | None = None,
    additions: Sequence[Addition] = (),
) -> Plate:
    """A rectangular plate in Kirchhoff's theory, with Bogner–Fox–Schmit elements.

    Parameters
    ----------
    length, width, thickness, material, supports, cells, highest_frequency, additions
        As in `mindlin_plate`, but stiffeners must be parallel to a side. For additions on a "symmetry" edge, give the
        half on this side of the edge; the mirror image adds the other half.

    Returns
    -------
    Plate
        The plate; `plate.at(x, y)` is the structure struck at a point.

    References
    ----------
    Bogner, Fox, Schmit, Proc. Conf. Matrix Methods Struct. Mech., Dayton (1965) 397.

    Examples
    --------
    >>> clamped = hl.Supports("clamped", "clamped", "clamped", "clamped")
    >>> plate = hl.kirchhoff_plate(0.3, 0.2, 2.29e-3, hl.ALUMINIUM_6061, clamped)
    >>> hl.reduce(plate.at(0.1, 0.1), until=1e-3).size < 200
    True
    """
    shape, wall = Rectangle(length, width, _cells(cells)), section_of(thickness, material)
    return Plate(shape, wall, supports, Hermite(), material, highest_frequency, additions)


@described_as(called="Mindlin plate")
def mindlin_plate(
    length: Side,
    width: Side,
    thickness: WallThickness | None,
    material: Wall,
    supports: Annotated[Supports, HELD],
    shear_correction: ShearCorrection = SHEAR_CORRECTION,
    patch_radius: Length | None = None,
    highest_frequency: Frequency | None = None,
    cells: tuple[Several, Several] | None = None,
    additions: Sequence[Addition] = (),
) -> Plate:
    """A rectangular plate in Mindlin's theory, with shear and rotary inertia, on quadrilaterals of order 4.

    Parameters
    ----------
    length, width : float
        Sides along x and along y, m.
    thickness : float or None
        Thickness, m. For a Laminate, None or its own thickness.
    material : Material or Laminate
        One material, or plies.
    supports : Supports
        The supports of the four edges.
    shear_correction : float
        Factor of the transverse shear stiffness G t of one material: 5/6 (Reissner) or π²/12 (Mindlin).
    patch_radius : float, optional
        Radius a of the disc over which the contact force is spread, m; by default half the thickness, at most twice the
        thickness (see Notes).
    highest_frequency : float, optional
        The mesh resolves flexural waves up to this frequency, Hz; by default 40 kHz, and more for contacts below 10 µs.
    cells : (int, int), optional
        Numbers of cells along x and y of a uniform mesh that all contacts share; in Mindlin's theory they must be no
        larger than twice the thickness. By default the mesh is graded towards the contacts.
    additions : sequence of PointMass, Stiffener, Weakened and Prestress
        Additions anywhere on the plate; stiffeners may follow any straight line.

    Returns
    -------
    Plate
        The plate; `plate.at(x, y)` is the structure struck at a point. It refuses contacts whose patch extends beyond
        an edge; use `kirchhoff_plate` to strike an edge.

    Notes
    -----
    Under a point force the deflection of Mindlin's plate is infinite. Therefore the force is spread over a disc, and
    `flexibility` corrects the compliance of the contact to that of a plate in three dimensions. Half and twice the
    radius change amplitude ratios by −0.03 and +0.12 %. The ratios are 1 to 2 % below those of `kirchhoff_plate`.

    References
    ----------
    Mindlin, J. Appl. Mech. 18 (1951) 31; Reissner, J. Appl. Mech. 12 (1945) 69.

    Examples
    --------
    >>> plate = hl.mindlin_plate(0.1, 0.1, 4e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"), cells=(8, 8))
    >>> plate.at(0.05, 0.05).size
    3168
    """
    shape, wall = Rectangle(length, width, _cells(cells)), section_of(thickness, material, shear_correction)
    return Plate(shape, wall, supports, _mindlin(wall, patch_radius), material, highest_frequency, additions)


@described_as(called="Mindlin panel")
def mindlin_panel(
    shape: PanelShape,
    thickness: WallThickness | None,
    material: Wall,
    supports: Mapping[Tag, Edge] | None = None,
    shear_correction: ShearCorrection = SHEAR_CORRECTION,
    patch_radius: Length | None = None,
    highest_frequency: Frequency | None = None,
    additions: Sequence[Addition] = (),
    scale: Scale | None = None,
    tags: Annotated[str, TAGS] | None = None,
) -> Plate:
    """A plate of any shape in Mindlin's theory, on triangles or quadrilaterals of order 4.

    Parameters
    ----------
    shape : Outline, path or meshio.Mesh
        An Outline, meshed with triangles that are finest at the contact (requires `pip install hertzlink[mesh]`), or a
        flat mesh of triangles or quadrilaterals: a file (.msh, .vtu, ...; see `solid`) or a meshio.Mesh.
    thickness, material, shear_correction, patch_radius, highest_frequency, additions
        As in `mindlin_plate`.
    supports : Mapping, optional
        Supports of edges by name: {"rim": "clamped"}; other edges are free. Names are those of the outline, or tags of
        the mesh: names and numbers of gmsh's physical groups of lines, or sets of points. Sides that meet at less than
        30° represent a curve, and supports act on that curve: a simple circle of 96 corners is accurate to 0.1 %.
    scale, tags
        As in `solid`.

    Returns
    -------
    Plate
        The plate; `plate.at(x, y)` is the structure struck at a point.

    Examples
    --------
    >>> disc = hl.Outline(hl.circle(0.1), edges="rim")
    >>> hl.mindlin_panel(disc, 2e-3, hl.ALUMINIUM_6061, {"rim": "simple"}).thickness
    0.002
    """
    held = instance("supports", supports or {}, Mapping, 'a dictionary such as {"rim": "clamped"}, by name of edge')
    wall = section_of(thickness, material, shear_correction)
    if isinstance(shape, Outline):
        if (scale, tags) != (None, None):
            raise ValueError(f"scale, tags = {scale!r}, {tags!r}: must be None for an Outline; they are for meshes")
        for edge in held:
            one_of("supports", edge, shape.names)
    elif isinstance(shape, tuple | list):
        raise ValueError(f"shape = {short(shape)}: must be an Outline(corners), the path of a mesh, or a meshio.Mesh")
    else:
        shape = FlatMesh(shape, wall.thickness, scale, tags)
        for edge in held:
            shape.tags.of("supports", edge)  # warns of sides that are left out
    return Plate(shape, wall, held, _mindlin(wall, patch_radius), material, highest_frequency, additions)


def _cells(cells: tuple[int, int] | None) -> tuple[int, int] | None:
    if cells is None:
        return None
    numbers = [whole(f"cells[{i}]", count) for i, count in enumerate(cells)] if several(cells) else []
    if len(numbers) != 2 or numbers[0] * numbers[1] > MOST_CELLS:
        must = f"must be two whole numbers, along x and along y, with at most {MOST_CELLS} cells in all"
        raise ValueError(f"cells = {short(cells)}: {must}")
    return fineness().cells * numbers[0], fineness().cells * numbers[1]


def _mindlin(wall: Section, radius: float | None) -> Mindlin:
    """Return Mindlin's theory; raise a ValueError if the patch is large compared with the thickness."""
    if radius is None:
        return Mindlin(PATCH * wall.thickness)
    return Mindlin(within("patch_radius", radius, 0.0, WIDEST * wall.thickness, "m"))
