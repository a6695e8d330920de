"""Contact laws by three-dimensional finite elements: parallel cylinders of finite length, and spheres to compare with.

Beside them, what a bead's mid-plane takes from the half-space's approach, and a sphere's modes. For a law, each body
is an eighth of a bead (`solid_mesh`), condensed to the nodes that may touch; both are pressed together without friction
(`active_set`). Linear elasticity, so strains must stay small.
"""

from dataclasses import replace
from functools import lru_cache
from math import log, pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh
from skfem import ElementTetP2, ElementVector, FacetBasis, LinearForm

from particles.bead import Bead, Cylinder, Sphere
from particles.deformable.vibration import Vibration, of_modes
from particles.laws.active_set import contact_forces, forces_of_steps
from particles.laws.computed import ComputedLaw, check_range, continued_to_zero
from particles.laws.formulas import SMALL_CONTACT, contact_law
from particles.laws.solid_mesh import (
    MIDPLANES,
    Eighth,
    SolidEighth,
    contact_eighth,
    even_eighth,
    patch_eighth,
    solid_body,
    supported,
    turning,
)
from structures.caution import caution
from structures.checks import instance, positive, short, whole
from structures.elasticity import shear_speed
from structures.factor import factorise
from structures.solid import PATCH_ORDER, patch_compliance
from structures.structure import Vector

ELEMENTS = {Cylinder: 20.0, Sphere: 6.0}
"""Half-width, or radius, of the widest contact over the size of the cells at the pole; those at its edge are larger."""

FEWEST = 2.0
"""The same for the narrowest contact that is computed."""

ORDER = 2.0
"""Of the convergence of F(δ), by which the error is estimated; that of the thesis's cylinders is a third of it."""

STEPS = 60
"""Approaches at which the force is computed, in even ratios."""

LARGE_ERROR = 0.025
"""Of the force, above which a law says so."""

MARGIN, WIDENING = 1.15, 1.4
"""How far the mesh lets bodies touch, over the contact that is expected; it widens where they touch beyond."""

LEAST_PART = 1e-6
"""The least approach over the relative radius: narrower contacts of spheres need too many cells."""

MOST_WORK = 10_000_000
"""Nodes that may touch times those of the mesh, which is solved for one after the other: a minute."""

TRIES = 8

CELLS = 5
"""Over the radius of a sphere that vibrates."""

CHANGED = 2.0
"""What a turn changes, `solid_mesh.turning`, halfway from nothing to the least that modes of another order have, 4."""

HIGHEST = 0.95
"""Of the highest frequency found, up to which all modes are."""

RIGID = 1e-3
"""ω², over the square of shear waves' rate across a radius, below which the motion is the rigid one."""

WIDEST_CONTACT = 0.5
"""Half-width of a contact over the radius of a bead, beyond which an eighth pressed along the chain says nothing."""

OUTERMOST = 0.9
"""Of the largest gap of the nodes that may touch: beyond it lie the last ones."""

QUARTERS = 4.0
"""Of the contact: an eighth of a bead bears one of them."""

EIGHTHS = 8.0
"""Of the bead."""

PATCH, PATCH_CELLS = 0.2, 0.33
"""Radius of the circle that is pressed for the mid-plane's correction over the bead's; its cells over its own."""

TYPICAL = 0.03
"""Radius of a contact over that of the bead: of the thesis's spheres at some 50 N."""

Rows = NDArray[np.float64]


def contact_law_solid(
    first: Bead,
    second: Bead | None = None,
    max_force: float | None = None,
    max_approach: float | None = None,
    spacing: float | None = None,
) -> ComputedLaw:
    """The law of two equal Cylinders side by side, or two equal Spheres, up to max_force (N) or max_approach (m).

    By three-dimensional finite elements: cylinders touch along a line as long as they are, with free ends. The approach
    is that of the mid-planes, which may slide sideways. Quadratic tetrahedra on the true arc, the gap that of the
    undeformed arcs, no friction, small strains; no node overlaps.
    spacing, m: size of the cells at the pole, from where they grow; by default a twentieth of the half-width of the
    widest contact, a sixth of its radius between spheres. Below a contact of two such cells the law goes on by that of
    `contact_law` in series with a spring. Ranges that leave small strains, and meshes too coarse for 2.5 %, get a
    caution.
    Raises ValueError for other bodies, for unequal ones, and where a contact has no two cells; ActiveSetNotConverged.
    """
    bead = solid_body("first", first)
    if second is not None and second != first:
        raise ValueError(f"second = {short(second)}: must be equal to the first, and lie side by side with it")
    pair = _Pair(bead)
    # The relative radius of two equal bodies is half their own.
    check_range(max_force, max_approach, pair.analytic, 0.5 * bead.radius, LEAST_PART)
    size = None if spacing is None else positive("spacing", spacing, "m")
    if max_approach is not None:
        return pair.law(float(max_approach), size)
    return pair.law_to_force(float(max_force), size)  # type: ignore[arg-type]


class _Pair:
    """Two equal beads that touch, and how wide their contact is by theory."""

    def __init__(self, bead: Cylinder | Sphere) -> None:
        self.bead, self.analytic = bead, contact_law(bead, bead)

    def width(self, approach: float) -> float:
        """Half-width, or radius, of the contact at an approach, m: Johnson's equations 4.43 and 4.22."""
        if isinstance(self.bead, Sphere):
            return sqrt(0.5 * approach * self.bead.radius)
        force = float(self.analytic.force(np.array(approach))) / self.bead.length
        return sqrt(4.0 * force * self.bead.radius / (pi * self.bead.material.contact_modulus))

    def approach(self, width: float) -> float:
        """The approach, m, at which the contact has a half-width, or radius, m."""
        if isinstance(self.bead, Sphere):
            return 2.0 * width**2 / self.bead.radius
        force = width**2 * pi * self.bead.material.contact_modulus / (4.0 * self.bead.radius) * self.bead.length
        return float(self.analytic.approach(np.array(force)))

    def law(self, approach: float, spacing: float | None) -> ComputedLaw:
        """The law up to an approach, m."""
        good = self.width(approach) / ELEMENTS[type(self.bead)]
        size = good if spacing is None else spacing
        if FEWEST * size >= self.width(approach):
            raise ValueError(
                f"spacing = {size:.3g} m: leaves the widest contact, {self.width(approach):.3g} m to its edge, fewer "
                f"than {FEWEST:g} cells; {good:.3g} m is a good one"
            )
        approaches = np.geomspace(self.approach(FEWEST * size), approach, STEPS)
        forces, coarse = (self.forces(approaches, size, coarser) for coarser in (1.0, 2.0))
        error = float(np.abs(coarse / forces - 1.0).max()) / (2.0**ORDER - 1.0)
        found = []
        if self.width(approach) > SMALL_CONTACT * 0.5 * self.bead.radius:
            found.append(f"a contact of {self.width(approach):.3g} m to its edge is too wide for small strains")
        if error > LARGE_ERROR:
            found.append(f"cells of {size:.3g} m leave the force off by some {100.0 * error:.2g} %")
        doubts = "; ".join(found)
        if doubts:
            caution(f"contact law: {doubts}")
        points = continued_to_zero((approaches, forces), self.analytic)
        return ComputedLaw(*points, "finite elements, 3-D", doubts, approach, float(approaches[0]), error)  # type: ignore[arg-type]

    def law_to_force(self, force: float, spacing: float | None) -> ComputedLaw:
        """The law up to a force, N, which may need a larger approach than theory says."""
        approach = float(self.analytic.approach(np.array(force)))
        for _ in range(TRIES):
            approach *= 1.2
            size = self.width(approach) / ELEMENTS[type(self.bead)]
            reached = self.forces(np.array([approach]), size, coarser=2.0)[0]
            if reached > 1.02 * force:
                law = self.law(approach, spacing)
                return replace(law, largest=float(law.approach(np.array(force))))
        raise ValueError(f"max_force = {force!r}: not reached at an approach of {approach:.3g} m; ask for less")

    def forces(self, approaches: Vector, size: float, coarser: float) -> Vector:
        """Force, N, at each of ascending approaches, m; size of the cells at the pole, m, times coarser."""
        last = float(approaches[-1])
        reach = MARGIN * self.width(last)
        for _ in range(TRIES):
            if reach > WIDEST_CONTACT * self.bead.radius:
                break
            compliance, gap = _condensed(self.bead, reach, size, coarser)
            touching = contact_forces(compliance, gap, last, gap < 0.5 * last)[1]
            if not touching[gap > OUTERMOST * gap[-1]].any():
                return QUARTERS * forces_of_steps(compliance, gap, approaches)
            reach *= WIDENING
        raise ValueError(
            f"max_force or max_approach: the contact is wider than {reach:.3g} m at {last:.3g} m; ask for less"
        )


def _condensed(bead: Cylinder | Sphere, reach: float, size: float, coarser: float) -> tuple[Vector, Vector]:
    """Compliance of two beads to forces on a quarter of their contact, m × m, m/N; and the gap, m, ascending."""
    part = contact_eighth(bead, reach, size, coarser)
    nodes = part.touching(reach)
    nodes = nodes[np.argsort(part.drop(nodes), kind="stable")]
    if nodes.size * part.box.shape[1] > MOST_WORK:
        raise ValueError(f"spacing = {size:.3g} m: {nodes.size} nodes may touch, which takes too long; must be larger")
    body = supported(part)
    solve, pressed = factorise(body.stiffness), body.motions[2, nodes]
    compliance = np.empty((pressed.size, pressed.size))
    unit = np.zeros(body.stiffness.shape[0])
    for column, place in enumerate(pressed):
        unit[place] = 1.0
        compliance[:, column] = solve(unit)[pressed]
        unit[place] = 0.0
    return compliance + compliance.T, 2.0 * part.drop(nodes)


@lru_cache(maxsize=256)
def midplane_correction(bead: Cylinder | Sphere) -> float:
    """How much less than a half-space a bead gives way between its pole and its mid-plane, m/N.

    Two such bodies under a force F approach by the half-space theory's δ less 2cF: c. The bead is pressed from both
    sides on a circle, and its mean displacement is taken from that of the half-space, `solid.patch_compliance`.
    On a curved surface c falls with the radius of what is pressed by its logarithm (`_by_curvature`), so c is given
    for contacts of TYPICAL radii, to some 5 %, which is some 1e-3 of the force. It differs by as much as 20 % for ones
    a third or three times as wide.
    Raises ValueError for other bodies, and for cylinders shorter than their radius.
    """
    bead = solid_body("bead", bead)
    if isinstance(bead, Cylinder) and bead.length < bead.radius:
        raise ValueError(f"length = {bead.length!r}: must be at least the radius, {bead.radius!r} m")
    wide = PATCH * bead.radius
    correction = patch_compliance(bead.material, wide) - _patch_displacement(bead, wide, PATCH_CELLS)
    return correction - _by_curvature(bead) * log(PATCH / TYPICAL)


def _by_curvature(bead: Cylinder | Sphere) -> float:
    """What c gains where the pressed circle is e times as wide, m/N: (1 − 2ν)² (1 + ν) H/(2πE), H the mean curvature.

    Boussinesq's half-space under a point force F pulls its surface along itself, by (1 − 2ν)F/(2πr²). A curved surface
    is free of what that pull has across it, H r times as large, which sinks the pole by Cerruti's (1 − 2ν)/(2μ) ∫ dr of
    it (Johnson, equations 3.20 and 3.75).
    """
    ratio, modulus = bead.material.poisson_ratio, bead.material.youngs_modulus
    mean = (0.5 if isinstance(bead, Cylinder) else 1.0) / bead.radius
    return (1.0 - 2.0 * ratio) ** 2 * (1.0 + ratio) * mean / (2.0 * pi * modulus)


def _patch_displacement(bead: Cylinder | Sphere, radius: float, cells: float) -> float:
    """Mean displacement, m/N, towards the mid-plane of a circle about the pole; pressure and weights 1 − r²/a².

    cells: size of those at the pole over the radius a, m.
    """
    part = patch_eighth(bead, radius, cells)
    body, element = supported(part), ElementVector(ElementTetP2())
    facets = part.mesh.boundary_facets()
    corners = part.box[:, part.mesh.facets[:, facets]]
    pressed = (corners[2] == 0.0).all(axis=0) & (corners[:2].min(axis=1).max(axis=0) < 1.5 * radius)
    faces = FacetBasis(part.mesh, element, facets=facets[pressed], intorder=PATCH_ORDER)
    pushed = _pressure.assemble(faces, radius=radius)[np.concatenate([faces.nodal_dofs[2], faces.edge_dofs[2]])]
    force, axial = np.zeros(body.stiffness.shape[0]), body.motions[2]
    force[axial[axial >= 0]] = pushed[axial >= 0] / pushed.sum()
    return float(force @ factorise(body.stiffness)(force)) / QUARTERS


@LinearForm
def _pressure(v: Any, w: Any) -> Any:
    """Of a circle, on the part of the surface that lies across the chain."""
    return v[2] * w.n[2] * np.maximum(1.0 - (w.x[0] ** 2 + w.x[1] ** 2) / w.radius**2, 0.0)


def vibration_of_solid(bead: Sphere, modes: int, spacing: float | None = None) -> Vibration:
    """The lowest elastic modes of a free sphere about the chain's axis, as `vibration` gives them, in three dimensions.

    spacing, m: size of the cells; by default a fifth of the radius, which leaves the six lowest frequencies of a steel
    sphere 0.4 % too high at most, and what moves the poles by 1 % off, but where two frequencies nearly meet.
    An eighth of a sphere has other modes too, at the same frequencies, and the mesh mixes them. So all the modes found
    are turned among themselves into those that a turn about the axis leaves alone and those that it changes
    (`solid_mesh.turning`), which are dropped.
    Raises ValueError for other beads, and where the mesh has fewer modes or too many cells.
    """
    bead = instance("bead", bead, Sphere, "a Sphere")
    modes, size = whole("modes", modes, 0), bead.radius / CELLS
    part = even_eighth(bead, size if spacing is None else positive("spacing", spacing, "m"))
    opposite, together = (supported(part, midplane) for midplane in MIDPLANES)
    pole = int(np.flatnonzero(part.box.max(axis=0) == 0.0)[0])
    between = 0.5 * (_drift(together, pole) - _squeeze(opposite, pole))
    return of_modes(_lowest_round(part, opposite, together, pole, modes), between)


def _lowest_round(part: Eighth, opposite: SolidEighth, together: SolidEighth, pole: int, modes: int) -> Rows:
    """The lowest modes about the axis, modes × 4: ω², motion of the pole, momentum of the half, and −1 or 1."""
    shift = (shear_speed(part.bead.material) / part.bead.radius) ** 2
    turned, count = turning(part), 4 * modes + 8
    while modes:
        if count > opposite.weight.size // 3:
            raise ValueError(f"modes = {modes}: too many for so large cells; must be fewer, or spacing smaller")
        found = [
            (*_round(half, turned, pole, count, shift), sign) for half, sign in ((opposite, -1.0), (together, 1.0))
        ]
        # Beyond the lesser of both highest, modes of the other half, or of the same frequency, may be missing.
        limit = HIGHEST**2 * min(highest for _, highest, _ in found)
        rows = np.concatenate([np.column_stack([half, np.full(len(half), sign)]) for half, _, sign in found])
        rows = rows[(rows[:, 0] < limit) & (rows[:, 0] > RIGID * shift)]
        if len(rows) >= modes:
            return rows[np.argsort(rows[:, 0])][:modes]
        count *= 2
    return np.empty((0, 4))


def _round(half: SolidEighth, turned: Any, pole: int, count: int, shift: float) -> tuple[Rows, float]:
    """ω², motion of the pole and momentum of the half of the modes about the axis among the lowest; and the highest ω².

    shift, 1/s²: taken off ω², so that the rigid motion does not stop the factorisation.
    """
    inverse = LinearOperator(half.mass.shape, matvec=factorise(half.stiffness + shift * half.mass), dtype=float)
    start = np.random.default_rng(0).normal(size=half.weight.size)
    squares, shapes = eigsh(half.stiffness, count, half.mass, sigma=-shift, OPinv=inverse, v0=start)
    changes, turns = np.linalg.eigh(shapes.T @ (turned[half.kept][:, half.kept] @ shapes))
    round_ones = turns[:, changes < CHANGED]
    own, mixture = np.linalg.eigh(round_ones.T @ (squares[:, None] * round_ones))
    # The whole bead has eight times the mass of the eighth that eigsh normalises.
    shapes = shapes @ round_ones @ mixture / sqrt(EIGHTHS)
    shapes *= np.where(shapes[half.motions[2, pole]] < 0.0, -1.0, 1.0)
    momenta = QUARTERS * (half.weight @ shapes)
    return np.stack([own, shapes[half.motions[2, pole]], momenta], axis=1), float(squares.max())


def _squeeze(half: SolidEighth, pole: int) -> float:
    """Motion of each pole inwards by unit forces on both against each other, m/N; it grows as the mesh is refined."""
    force, place = np.zeros(half.weight.size), half.motions[2, pole]
    force[place] = 1.0 / QUARTERS
    return float(factorise(half.stiffness)(force)[place])


def _drift(half: SolidEighth, pole: int) -> float:
    """Motion of each pole relative to the centre of mass by unit forces on both poles the same way, m/N.

    In the frame of the pole, the force on it does nothing, and the bead hangs in an even acceleration.
    """
    held = np.delete(np.arange(half.weight.size), half.motions[2, pole])
    sag = factorise(half.stiffness[held][:, held])(half.weight[held])
    return float(half.weight[held] @ sag) / float(half.weight.sum()) ** 2 / QUARTERS
