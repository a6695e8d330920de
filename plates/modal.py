"""A rectangular Kirchhoff plate as modes that serve every place, thickness and material; see docs/theory.md."""

from dataclasses import asdict
from functools import lru_cache
from itertools import product
from math import ceil, pi
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np
from scipy.linalg import eigh, eigh_tridiagonal

from plates.contacts import Contact
from plates.elements.hermite import Beam
from plates.half_plane import QUASI_STATIC, HalfPlane, Until
from plates.plate import Plate
from plates.section import homogeneous_section
from plates.shapes.rectangle import SIDES, Rectangle
from plates.support import Supports
from structures.checks import finite
from structures.described import described_as
from structures.fineness import fineness
from structures.kernels.quadrature import LANES, tridiagonal
from structures.linear_algebra.one_thread import one_thread
from structures.material import Material
from structures.structure import Structure, Vector, oscillators
from structures.surface import Surface

# Supports for which there are modes; in Kirchhoff's theory two of them are equal.
HELD = {"clamped": "clamped", "simple": "simple", "soft simple": "simple", "free": "free"}
# The range of the largest wavenumber of products of beam modes, in units of the cut-off, and the number of products in
# a part that determines it. With 1.15 the error of AR is 4e-4 near a free edge and near the ends of strips.
MARGIN, PRODUCTS = (1.15, 1.5), 1200
CELL = 0.9  # Length of a cell of the beams times the largest wavenumber
# Modes fade out, and the half-plane fades in, above this fraction of the cut-off. A sharp cut causes errors of ± 2e-3.
FADED = 0.5
# The range of the number of modes of a whole plate. The minimum is for small plates: near a corner the second edge
# matters above 40 kHz too. More than the maximum take minutes; for large thin plates the half-plane represents higher
# modes.
MODES = (800, 5000)
# Number of oscillators per √(until · highest frequency): the error of traces is below 1e-4.
OSCILLATORS = 15.0
BASES = 16  # Number of parts of plates that are kept, of a few megabytes each


Ends: TypeAlias = tuple[str, str]
Value = TypeVar("Value")
Pair: TypeAlias = tuple[Value, Value]


class _Part(NamedTuple):
    """Modes of one symmetry in x and y: k⁴, and φ = Σ V (X ⊗ Y) with ∫φ² = 1 over the part of the plate.

    X, Y: beams along and across, with the vectors of their modes. of: the mode Y of each product. axes: along, across.
    """

    fourth: Vector
    vectors: Vector
    along: tuple[Beam, Vector]
    across: tuple[Beam, Vector]
    of: Vector
    axes: tuple[int, int]

    def at(self, place: tuple[float, float]) -> Vector:
        """Return the φ of all modes at a place, 1/m."""
        values = []
        for (beam, modes), axis in zip((self.along, self.across), self.axes, strict=True):
            functions = beam.at(place[axis])
            there = np.flatnonzero(functions)  # at most four
            values.append(functions[there] @ modes[there])
        along, across = values
        return np.asarray((along * across[self.of]) @ self.vectors)


@lru_cache(BASES)
@one_thread
def _part(sides: Pair[float], ends: Pair[Ends], poisson_ratio: float, highest: float) -> _Part:
    """Return the modes with wavenumbers below `highest`, 1/m, of a rectangle of these sides, m.

    ends: supports of the beams along x and along y. At the middle of a plate they are "symmetry" for even motions, and
    "simple" for odd ones.
    """
    # Sines do not couple. So the solution is exact (Levy) if the modes across are sines.
    axes = (1, 0) if set(ends[0]) <= {"simple", "symmetry"} else (0, 1)
    modes = sides[0] * sides[1] * highest**2 / (4.0 * pi)
    most = highest * float(np.clip((PRODUCTS / modes) ** 0.5, *MARGIN))
    along, across = (Beam(np.linspace(0.0, sides[i], int(np.ceil(sides[i] * most / CELL)) + 2), *ends[i]) for i in axes)
    fourth_y, modes_y, twist_y, bend_y = _beam_modes(across, most)
    fourth_x, modes_x, twist_x, bend_x = _beam_modes(along, np.inf)
    nu, shapes, of = poisson_ratio, [], []
    # Modes of a strip with the motion Y across it, so that the evanescent wave at an edge decays as in the plate.
    for j, fourth in enumerate(fourth_y):
        strip = np.diag(fourth_x + fourth) + nu * bend_y[j, j] * (bend_x + bend_x.T)
        strip += 2.0 * (1.0 - nu) * twist_y[j, j] * twist_x
        _, vectors = eigh(strip, subset_by_value=(-np.inf, most**4))
        shapes.append(vectors)
        of += [j] * vectors.shape[1]
    strips, pairs = np.hstack(shapes), np.ix_(of, of)
    mixed = (strips.T @ bend_x @ strips) * bend_y.T[pairs]
    plate = (strips.T * fourth_x) @ strips * np.equal.outer(of, of) + np.diag(fourth_y[of])
    plate += nu * (mixed + mixed.T) + 2.0 * (1.0 - nu) * (strips.T @ twist_x @ strips) * twist_y[pairs]
    squares, vectors = eigh(plate, subset_by_value=(-np.inf, highest**4), overwrite_a=True, check_finite=False)
    return _Part(np.maximum(squares, 0.0), vectors, (along, modes_x @ strips), (across, modes_y), np.array(of), axes)


def _beam_modes(beam: Beam, most: float) -> tuple[Vector, Vector, Vector, Vector]:
    """Return k⁴ and vectors of a beam's modes with k below `most`, and ∫ v′u′ and ∫ v″u between these modes."""
    parts = beam.integrals()
    mass, twist, bend, elastic = (beam.matrix(parts[pair]).toarray() for pair in ((0, 0), (1, 1), (2, 0), (2, 2)))
    fourth, modes = eigh(elastic, mass, subset_by_value=(-np.inf, most**4))
    return np.maximum(fourth, 0.0), modes, modes.T @ twist @ modes, modes.T @ bend @ modes


@described_as(eq=False)
class ModalPlate:
    """A rectangular Kirchhoff plate as its modes, which serve every place, thickness and material of the same ν.

    The modes of a rectangle are computed once, in about a second. Then `ModalPlate.at` returns the oscillators for a
    place in a few milliseconds, as smooth functions of place, thickness and material. Above `plate.highest_frequency`
    the plate is represented, in closed form, by a plate with the nearest edge alone.

    Parameters
    ----------
    plate : Plate
        A `kirchhoff_plate` of one Material, with clamped, simple or free edges, without additions and `cells`. For
        other plates use ``hl.reduce(plate.at(x, y), until)``. Its `highest_frequency` is that of the modes, Hz. For
        several thicknesses, give the plate with the thinnest, which has the shortest waves.
    until : float
        Length of the longest run, s.

    Examples
    --------
    >>> plate = hl.kirchhoff_plate(0.2, 0.2, 4e-3, hl.ALUMINIUM_6061, hl.Supports("clamped", "clamped"))
    >>> modal = hl.ModalPlate(plate, until=0.5e-3)
    >>> near, thicker = modal.at(0.0234, 0.1), modal.at(0.03, 0.05, thickness=5e-3)
    >>> near.contacts, near.size < 200, near.valid_until
    (1, True, 0.0005)
    """

    plate: Plate
    until: Until

    def __post_init__(self) -> None:
        if not (isinstance(self.plate, Plate) and is_modal(self.plate)):
            raise ValueError(
                f"plate = {self.plate!r}: must be a kirchhoff_plate of one Material, clamped, simple or free at each "
                "edge, without additions and cells; for others use reduce(plate.at(x, y), until)"
            )

    @property
    def _cut_off(self) -> float:
        """Wavenumber of the highest mode, 1/m."""
        # There are A k²/4π modes below k (Weyl).
        least, most = ((4.0 * pi * modes / (self.plate.length * self.plate.width)) ** 0.5 for modes in MODES)
        return float(min(max(least, 2.0 * pi / self.plate.shortest_wavelength), most) * fineness().cells ** 0.5)

    def at(self, x: float, y: float, thickness: float | None = None, material: Material | None = None) -> Structure:
        """Return the oscillators of the plate struck at (x, y), with another thickness or material if they are given.

        Parameters
        ----------
        x, y, thickness : float
            Place and thickness, m. All frequencies are proportional to the thickness.
        material : Material, optional
            Another material. For another ν the modes are computed anew.

        Returns
        -------
        Structure
            The oscillators: M = I, K diagonal, no damping.
        """
        plate, place = self.plate, (finite("x", x, "m"), finite("y", y, "m"))
        left, right, bottom, top = (HELD[getattr(plate.supports, side)] for side in SIDES)
        sides, ends, edges = (plate.length, plate.width), ((left, right), (bottom, top)), list[tuple[str, float]]()
        for name, coordinate, side, kinds in zip("xy", place, sides, ends, strict=True):
            if not 0.0 <= coordinate <= side:
                raise ValueError(f"{name} = {coordinate!r}: must lie on the plate, between 0 and {side:g} m")
            edges += zip(kinds, (coordinate, side - coordinate), strict=True)
        # On a corner, an edge that is held precedes a free edge.
        edge, distance = min(edges, key=lambda one: (one[1], one[0] == "free"))
        if distance == 0.0 and edge != "free":
            raise ValueError(f"x, y = {place}: must not lie on an edge that is held")

        wall = plate.section.struck if material is None else material
        section = homogeneous_section(plate.thickness if thickness is None else thickness, wall)
        rigidity, mass, nu = float(section.bending[0, 0]), section.mass, wall.poisson_ratio
        one_edge, cut_off = HalfPlane(rigidity, mass, edge, distance, nu), self._cut_off
        a, (fourth, shape) = one_edge.diffusion, modes_at(sides, ends, place, nu, cut_off)
        modes, cut = a * np.sqrt(fourth), a * cut_off**2
        fading, fading_weight = one_edge.resolved(cut, self.until, FADED * cut)
        # The weight of modes: 1 up to FADED of the cut-off, 0 at the cut-off. The half-plane has the rest.
        steps = (np.clip((band / cut - FADED) / (1.0 - FADED), 0.0, 1.0) for band in (modes, fading))
        kept, gone = (np.cos(0.5 * pi * step) ** 2 for step in steps)
        bands = [
            (modes, shape**2 / mass * kept),
            (fading, fading_weight * (1.0 - gone)),
            one_edge.following(cut, QUASI_STATIC * cut),
        ]
        frequency, weight = (np.concatenate(both) for both in zip(*bands, strict=True))
        frequency, weight = _fewer(frequency, weight, plate.highest_frequency, self.until)
        above = one_edge.compliance_above(QUASI_STATIC * cut)
        origin = plate.data([Contact(*place, "front")])
        origin |= {"thickness": section.thickness, "material": asdict(wall), "section": section.data}
        return oscillators(frequency**2, None, np.sqrt(weight), above, Surface(wall), origin, self.until)


def is_modal(plate: Plate) -> bool:
    """Return whether a ModalPlate can represent a plate."""
    supports = plate.supports
    return (
        plate.thin
        and isinstance(plate.shape, Rectangle) and not plate.shape.fixed
        and isinstance(plate.material, Material)
        and not plate.additions
        and isinstance(supports, Supports)
        and all(isinstance(held, str) and held in HELD for held in (getattr(supports, side) for side in SIDES))
    )  # fmt: skip


def modes_at(sides: Pair[float], ends: Pair[Ends], place: Pair[float], nu: float, cut_off: float) -> Pair[Vector]:
    """Return k⁴ of the modes that move at a place, and their motion there, 1/m."""
    choices = []
    for coordinate, side, held in zip(place, sides, ends, strict=True):
        if held[0] != held[1]:
            choices.append([(side, held, coordinate, 1.0)])
            continue
        # Even and odd motions of one half; the other half contributes the same to ∫φ².
        near = min(coordinate, side - coordinate)
        middle = abs(coordinate - 0.5 * side) <= 1e-9 * side
        halves = ("symmetry",) if middle else ("symmetry", "simple")
        choices.append([(0.5 * side, (held[0], half), near, 0.5**0.5) for half in halves])
    found = []
    for (side_x, ends_x, x, share_x), (side_y, ends_y, y, share_y) in product(*choices):
        part = _part((side_x, side_y), (ends_x, ends_y), nu, cut_off)
        found.append((part.fourth, share_x * share_y * part.at((x, y))))
    fourth, shape = (np.concatenate(both) for both in zip(*found, strict=True))
    return fourth, shape


def _fewer(frequency: Vector, weight: Vector, highest: float, until: float) -> tuple[Vector, Vector]:
    """Return fewer oscillators with the same response to forces up to a frequency, Hz, for a time, s.

    They are Gauss's quadrature of the sum over 1/(1 + ω²/σ²), which Krylov vectors of (K + σ²M)⁻¹M also give. Their
    number is fixed, so that the result is a smooth function of the weights.
    """
    point = 2.0 * pi * highest
    places = 1.0 / (1.0 + (frequency / point) ** 2)
    count = ceil(OSCILLATORS * (until * highest / fineness().tolerance ** 0.25) ** 0.5)
    diagonal, squares = np.zeros((2, min(count, places.size)))
    tridiagonal(places, places * weight, np.empty((LANES, 5)), diagonal, squares)
    # The sum may have fewer points with a significant weight.
    rows = int(np.argmax(np.append(squares[1:] <= 1e-20 * squares[0], True))) + 1
    values, vectors = eigh_tridiagonal(diagonal[:rows], np.sqrt(squares[1:rows]), check_finite=False)
    return point * np.sqrt(np.maximum(1.0 / values - 1.0, 0.0)), vectors[0] ** 2 * squares[0] / values
