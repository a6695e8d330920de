"""Rectangular plates in Mindlin's theory."""

from collections.abc import Sequence

import numpy as np

from plates.additions import Addition
from plates.laminate import Laminate
from plates.panel import Panel, patch_of, wall
from plates.panel_additions import known_additions, lines
from plates.plate import HIGHEST_FREQUENCY
from plates.section import SHEAR_CORRECTION, Section
from plates.shapes.rectangle import MIRROR, NAMES, Rectangle
from plates.support import Support, Supports
from structures.checks import instance, positive, whole
from structures.material import Material
from structures.mesh_source import Tag
from structures.plausible import likely


def mindlin_plate(
    length: float,
    width: float,
    thickness: float | None,
    material: Material | Laminate | Section,
    supports: Supports,
    shear_correction: float = SHEAR_CORRECTION,
    patch_radius: float | None = None,
    highest_frequency: float = HIGHEST_FREQUENCY,
    cells: tuple[int, int] | None = None,
    additions: Sequence[Addition] = (),
) -> Panel:
    """A rectangular plate in Mindlin's theory: shear and rotary inertia, quadrilaterals of order 4; sizes in m.

    material: one for all the thickness; or a Laminate or a Section, which bring their own thickness.
    shear_correction: of the shear stiffness; 5/6 is Reissner's, π²/12 Mindlin's.
    patch_radius a, m: the force is spread evenly over a disc, by default of half the thickness, since a point force
    would sink without end. What Mindlin's plate and Hertz's half-space both hold of the indentation is taken out by
    `flexibility`, so that the contact gives way as that of a plate of three dimensions does
    (plates/elements/indentation.py);
    then the radius is indifferent: halved and doubled it moves amplitude ratios by −0.03 and +0.12 % (beads of 4.76
    and 9.53 mm on aluminium of 2.29 and 4.83 mm; without, by 1 %). There the amplitude ratio is 1 to 2 % below that of
    `kirchhoff_plate`. The patch must not reach beyond an edge: strike an edge with `kirchhoff_plate`.
    highest_frequency, Hz: the mesh resolves flexural waves up to it; the default suits steel beads of 4 to 20 mm. It
    is finest at the contact; twice as fine, it moves amplitude ratios by less than 0.01 %.
    cells: a uniform mesh of (along x, along y) cells instead, which all contact points share; they should be no larger
    than twice the thickness.
    additions: PointMass; Stiffener along any straight line; Weakened. Cells end where regions do.
    Where the contact lies on a line of symmetry, the structure holds the motions that a force there can excite.
    """
    length, width = positive("length", length, "m"), positive("width", width, "m")
    section = wall(thickness, material, shear_correction)
    if section.thickness > min(length, width):
        raise ValueError(f"thickness = {thickness!r}: exceeds the plate's shorter side, {min(length, width)} m")
    instance("supports", supports, Supports, "Supports(left=, right=, bottom=, top=)")
    if cells is not None:
        if np.shape(cells) != (2,):
            raise ValueError(f"cells = {cells!r}: must be two whole numbers, along x and along y")
        cells = (whole("cells[0]", cells[0]), whole("cells[1]", cells[1]))
    patch = patch_of(section, patch_radius)
    added = known_additions(additions)
    skewed = section.bending[2, :2].any() or section.bending[:2, 2].any() or section.shear[0, 1] != 0.0
    alike = not added and not skewed
    halved = alike and supports.left == supports.right, alike and supports.bottom == supports.top
    shape = Rectangle(length, width, cells, halved, lines(added))
    held: dict[Tag, Support] = {MIRROR: "symmetry"}
    held.update((name, getattr(supports, name)) for name in NAMES)
    frequency = positive("highest_frequency", highest_frequency, "Hz")
    likely("side", "mindlin_plate", "length", length)
    likely("side", "mindlin_plate", "width", width)
    likely("frequency", "mindlin_plate", "highest_frequency", frequency)
    return Panel("Mindlin plate", shape, section, held, patch, frequency, added, material)
