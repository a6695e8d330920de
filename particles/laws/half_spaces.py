"""Contact laws by boundary elements: two half-spaces that touch at a point, such as crossed cylinders.

The gap between the bodies is that of their undeformed surfaces, quadratic; each body deforms as a half-space, under
even pressures on the rectangles of a grid (`influence`). No friction, small strains.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import exp, log, log2, pi, sqrt

import numpy as np
from scipy.fft import irfft2, rfft2
from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1

from particles.bead import Bead, Cylinder, Sphere, check_bead
from particles.laws.active_set import ContactNotConverged
from particles.laws.computed import ORDER, ComputedContact, ComputedLaw, Points
from particles.laws.formulas import MOST_ELONGATED, SMALL_CONTACT, sharpest_curvatures
from particles.laws.law import PowerLaw
from particles.laws.solid import midplane_correction
from structures.checks import finite, instance, short, whole
from structures.structure import Vector
from structures.surface import NEARLY_ROUND, Surface, hertz_stiffness, relative_curvatures
from structures.units import readable

CELLS = 64
"""Along each side of the grid: the force is right to 1.2e-4."""

FEWEST, MOST = 32, 512
"""Cells: a quarter of the fewest still shows the error; the most take minutes."""

MARGIN = 1.1
"""Half the grid's side over the semi-axis of the contact that Hertz expects."""

LOAD_STEPS = 20
"""From the first to the largest approach, in a geometric series; the law's table interpolates between them."""

LEAST_PART = 1e-3
"""The first load step's approach over the last one's."""

BEYOND = 1.02
"""The last load step's approach over that of Hertz's law for the largest force."""

TOLERANCE = 1e-9
"""Of overlaps, over the approach."""

MOST_ITERATIONS = 2000
"""Of the conjugate gradients at one load step; beyond them the pressures are reported as not settled."""

SOFTEST = 0.5
"""The share of the half-spaces' tangent compliance that a correction may take off."""


@dataclass(frozen=True)
class ContactPressures:
    """Pressures (Pa, n × n) between two bodies at an approach, m, on the rectangles of a grid.

    along, across: their middles from the point of contact, m, n numbers each: along the flattest direction, 1/R′, and
    across it.
    """

    approach: float
    along: Vector
    across: Vector
    pressures: Vector

    @property
    def force(self) -> float:
        """N."""
        return float(self.pressures.sum() * (self.along[1] - self.along[0]) * (self.across[1] - self.across[0]))


def contact_law_bem(
    first: Bead,
    second: Bead | Surface | None = None,
    max_force: float | None = None,
    max_approach: float | None = None,
    correction: float | Sequence[float] | None = None,
    midplane: bool = False,
    cells: int = CELLS,
) -> ComputedLaw:
    """Return the law of two bodies that touch at a point, by boundary elements on two half-spaces.

    The grid covers the contact that Hertz expects, in its shape; each load step has its own. The force converges by the
    square of the cells' side, but scatters with how the ellipse cuts cells, so the `order` of three grids means little.
    Contacts more elongated than those of cylinders that cross at 10°, longer than the cylinders, or too large for
    half-spaces get a caution.

    Polonsky and Keer, Wear 231 (1999) 206; Love, Phil. Trans. R. Soc. A 228 (1929) 377.
    """
    cells = _cells(cells)
    instance("midplane", midplane, bool, "True or False")
    pair = PointContact(first, first if second is None else second, cells, correction, midplane)
    return pair.law(max_force, max_approach)


def _cells(cells: int) -> int:
    """Return a whole number from FEWEST to MOST, or raise a ValueError."""
    if whole("cells", cells, FEWEST) > MOST:
        raise ValueError(f"cells = {cells!r}: must be at most {MOST}")
    return int(cells)


class PointContact(ComputedContact):
    """Two bodies that touch at a point, and what Hertz expects of them."""

    method = "boundary elements"

    def __init__(
        self,
        first: Bead,
        second: Bead | Surface,
        cells: int = CELLS,
        correction: float | Sequence[float] | None = None,
        midplane: bool = False,
    ) -> None:
        what = "a solid body, such as a Sphere, an Ellipsoid or a Cylinder"
        for name, body in (("first", first), ("second", second)):
            if name == "first" or not isinstance(body, Surface):
                check_bead(name, body, what if name == "first" else f"{what}, or a Surface")
            if hasattr(body, "shell_flexibility"):
                raise ValueError(f"{name} = {short(body)}: must be {what}")
        self.bodies, self.cells, self.correction, self.midplane = (first, second), cells, correction, midplane
        surface, facing = (body if isinstance(body, Surface) else body.surface for body in self.bodies)
        self.flat, self.sharp = relative_curvatures(surface, facing)
        if self.flat <= 1e-12 * self.sharp:
            raise ValueError(
                f"second = {second!r}: touches the first along a line; for parallel cylinders use plane strain"
            )
        self.theory = self.below = PowerLaw(hertz_stiffness(surface, facing))
        self.sharpest = sharpest_curvatures(surface, facing)
        self.radius = 1.0 / max(self.sharpest)
        self.modulus = 1.0 / (1.0 / surface.material.contact_modulus + 1.0 / facing.material.contact_modulus)

    def up_to(self, approach: float) -> ComputedLaw:
        """Return the law up to an approach, m."""
        return self._over(None, approach)

    def up_to_force(self, force: float) -> ComputedLaw:
        """Return a law that reaches this force, N."""
        return self._over(force, None)

    def _over(self, max_force: float | None, max_approach: float | None) -> ComputedLaw:
        softness = self.softness(self.correction, self.midplane)
        overlap = self.overlap(max_force, max_approach, softness)
        steps = BEYOND * overlap * np.geomspace(LEAST_PART, 1.0, LOAD_STEPS)
        fine, coarse, coarsest = (self.forces(steps, self.cells // coarser) for coarser in (1, 2, 4))
        near, far = (float(np.abs(force / finer - 1.0).max()) for force, finer in ((coarse, fine), (coarsest, coarse)))
        # Either difference may be small by chance.
        error = max(near, far / 2.0**ORDER)
        points: Points = (steps - softness * fine, fine)
        largest = float(points[0][-1]) if max_approach is None else max_approach
        return self.made(points, largest, error, log2(far / near), self.doubts(overlap))

    def softness(self, correction: float | Sequence[float] | None, midplane: bool) -> float:
        """Return what is taken off the approach for both bodies, m/N."""
        if midplane and correction is None:
            bodies = [body for body in self.bodies if not isinstance(body, Surface)]  # a Surface has no mid-plane
            for body in bodies:
                if not isinstance(body, Sphere | Cylinder):
                    raise ValueError(f"correction = None: must be given, in m/N, for the mid-plane of {short(body)}")
            return sum(map(midplane_correction, bodies), 0.0)  # type: ignore[arg-type]
        value = 0.0 if correction is None else correction
        numbers: Sequence[float] = (value,) * 2 if np.ndim(value) == 0 else value  # type: ignore[assignment]
        if len(numbers) != 2:
            raise ValueError(f"correction = {correction!r}: must be one number, or one for each body, in m/N")
        shares = [finite("correction", number, "m/N") for number in numbers]
        return sum(share for share, body in zip(shares, self.bodies, strict=True) if not isinstance(body, Surface))

    def overlap(self, max_force: float | None, max_approach: float | None, softness: float) -> float:
        """Return the approach of the half-spaces, m, that Hertz expects at the end of the law.

        Raises ValueError where softness, m/N, the correction of both bodies, takes off too much there.
        """
        if max_force is not None:
            overlap = bound = float(self.theory.approach(np.array(max_force, float)))
        else:
            overlap = bound = float(max_approach)  # type: ignore[arg-type]
            # As SOFTEST leaves two thirds of an approach or more.
            bound *= 1.5 if softness > 0.0 else 1.0
        if softness * float(self.theory.tangent(np.array(bound))) > SOFTEST:
            raise ValueError(
                f"correction: the bodies' together, {softness:.3g} m/N, takes off most of the half-spaces' approach"
            )
        if max_force is not None or softness == 0.0:
            return overlap

        def excess(overlap: float) -> float:
            return float(overlap - softness * self.theory.force(np.array(overlap)) - max_approach)  # type: ignore[operator]

        return float(brentq(excess, 0.0, bound, xtol=1e-12 * bound))

    def ellipse(self, approach: float) -> tuple[float, float]:
        """Return the semi-axes of Hertz's contact at an approach, m: along the flattest direction, and across (Johnson,
        4.2)."""
        ratio, square = self.sharp / self.flat, 1.0
        if ratio - 1.0 > NEARLY_ROUND:

            def excess(log_square: float) -> float:
                first, second = ellipkm1(exp(log_square)), ellipe(1.0 - exp(log_square))
                return float((second / exp(log_square) - first) / (first - second) / ratio - 1.0)

            square = exp(brentq(excess, -4.0 / 3.0 * log(ratio) - 20.0, -1e-9, xtol=1e-14))
        force = float(self.theory.force(np.array(approach)))
        along = 3.0 * force * float(ellipkm1(square)) / (2.0 * pi * self.modulus * approach)
        return along, sqrt(square) * along

    def pressed(self, approach: float, cells: int, begin: Vector | None = None) -> ContactPressures:
        """Return the pressures at an approach, m; begin: those to begin with, Pa."""
        numbers = (2.0 * np.arange(cells) + 1.0) / cells - 1.0
        along, across = (MARGIN * axis * numbers for axis in self.ellipse(approach))
        gap = 0.5 * (self.flat * along[:, None] ** 2 + self.sharp * across**2)
        coefficients = influence(cells, along[1] - along[0], across[1] - across[0]) / (pi * self.modulus)
        begin = np.full(gap.shape, 0.5 * self.modulus * self.sharp * across[-1]) if begin is None else begin
        return ContactPressures(approach, along, across, unilateral_pressures(coefficients, gap, approach, begin))

    def forces(self, steps: Vector, cells: int) -> Vector:
        """Return the force at each approach, N, m; each step begins with the pressures of the last one."""
        forces, begin = [], None
        for before, step in zip([steps[0], *steps], steps, strict=False):
            contact = self.pressed(float(step), cells, None if begin is None else begin * sqrt(step / before))
            begin = contact.pressures
            forces.append(contact.force)
        return np.array(forces)

    def doubts(self, approach: float) -> list[str]:
        """Return where bodies are no half-spaces."""
        doubts = []
        along, across = self.ellipse(approach)
        ratio = self.sharp / self.flat
        if ratio > MOST_ELONGATED:
            doubts.append(f"R'/R'' = {ratio:.4g}: as long as between cylinders below 10°, where half-space theory ends")
        for body in self.bodies:
            if isinstance(body, Cylinder) and along > 0.5 * body.length:
                doubts.append(
                    f"a contact {readable(2.0 * along, 'm')} long is longer than a cylinder, "
                    f"{readable(body.length, 'm')}"
                )
        for axis, sharpest in zip((along, across), self.sharpest, strict=True):
            if axis * sharpest > SMALL_CONTACT:
                doubts.append(f"a contact of {readable(axis, 'm')} half-width is too wide for small strains")
        return list(dict.fromkeys(doubts))


def influence(cells: int, along: float, across: float) -> Vector:
    """Return the displacement in the middle of each rectangle of a grid, m, by an even pressure of π E* on the first
    one, n × n.

    along, across: sides of a rectangle, m (Love, Phil. Trans. R. Soc. A 228 (1929) 377; Johnson, Contact Mechanics,
    equation 3.25).
    """
    x, y = ((np.arange(cells + 1)[:, None] - 0.5) * along, (np.arange(cells + 1) - 0.5) * across)
    corners = x * np.arcsinh(y / np.abs(x)) + y * np.arcsinh(x / np.abs(y))
    coefficients: Vector = corners[1:, 1:] - corners[:-1, 1:] - corners[1:, :-1] + corners[:-1, :-1]
    return coefficients


def displacements(coefficients: Vector) -> Callable[[Vector], Vector]:
    """Return a function that gives the displacement of each cell by pressures, n × n each; see `influence`.

    The convolution is exact: by fast Fourier transforms of twice as many cells, half of them empty.
    """
    cells = coefficients.shape[0]
    twice = (2 * cells, 2 * cells)
    apart = np.minimum(np.arange(2 * cells), 2 * cells - np.arange(2 * cells)) % cells
    spectrum = rfft2(coefficients[np.ix_(apart, apart)])

    def displaced(pressures: Vector) -> Vector:
        everywhere: Vector = irfft2(spectrum * rfft2(pressures, twice), twice)
        return everywhere[:cells, :cells]

    return displaced


def unilateral_pressures(coefficients: Vector, gap: Vector, approach: float, begin: Vector) -> Vector:
    """Return the pressures, n × n, Pa, at an approach, m: none pulls, no bodies overlap.

    coefficients: displacement of each cell by a unit pressure on the first, m/Pa; gap: between the undeformed
    surfaces, m; begin: pressures to begin with, Pa. Conjugate gradients, projected on pressures that do not pull
    (Polonsky and Keer, Wear 231 (1999) 206), at a given approach, so that no force need be balanced.
    Raises ContactNotConverged.
    """
    displaced = displacements(coefficients)
    pressures, direction = begin.copy(), np.zeros_like(begin)
    conjugacy, before = 0.0, 1.0
    for _ in range(MOST_ITERATIONS):
        opening = displaced(pressures) + gap - approach
        touching = pressures > 0.0
        overlap = np.where(touching, np.abs(opening), np.maximum(-opening, 0.0))
        if float(overlap.max()) < TOLERANCE * approach:
            return pressures
        square = float((opening[touching] ** 2).sum())
        direction = np.where(touching, opening + conjugacy * square / before * direction, 0.0)
        turned = displaced(direction)[touching]
        step = float(opening[touching] @ direction[touching]) / float(turned @ direction[touching])
        pressures = np.maximum(pressures - step * direction, 0.0)
        overlapping = (pressures == 0.0) & (opening < 0.0)
        pressures[overlapping] -= step * opening[overlapping]
        # Cells that come into contact belong to no former direction.
        conjugacy, before = 0.0 if overlapping.any() else 1.0, square
    raise ContactNotConverged(
        f"approach = {approach:.4g} m: pressures still changed after {MOST_ITERATIONS} iterations; try another number "
        "of cells",
        approach,
    )
