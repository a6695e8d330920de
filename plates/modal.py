"""A rectangular Kirchhoff plate as modes that serve every place, thickness and material: see docs/theory.md."""

from dataclasses import asdict
from functools import cached_property, lru_cache
from itertools import product
from math import ceil, pi
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
from scipy.linalg import eigh, eigh_tridiagonal

from plates.contacts import Contact, contacts_data
from plates.elements.hermite import Beam
from plates.half_plane import QUASI_STATIC, HalfPlane, Until
from plates.plate import Plate
from plates.section import Section, homogeneous_section
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

# Edges that the modes know; in Kirchhoff's theory two of them are one.
HELD = {"clamped": "clamped", "simple": "simple", "soft simple": "simple", "free": "free"}
# Wavenumber up to which products of beam modes make up the plate's modes, in units of the cut-off: as large as this
# many products in a part allow. With 1.15, AR is 4e-4 off near a free edge and near the ends of strips.
MARGIN, PRODUCTS = (1.15, 1.5), 1200
CELL = 0.9  # Length of a cell of the beams times the greatest wavenumber
# Modes fade out from this part of the cut-off on, as the half-plane fades in. A sharp cut leaves ± 2e-3 of AR.
FADED = 0.5
# Modes of a whole plate. At least: near a corner of a small plate the second edge counts above 40 kHz, too. At most:
# more take minutes, and of a large thin plate the half-plane answers above.
MODES = (800, 5000)
# Oscillators that a contact needs, in units of √(until · highest frequency): traces are within 1e-4 of all modes.
OSCILLATORS = 15.0
BASES = 16  # Parts of plates that are kept, of some megabytes each


Ends: TypeAlias = tuple[str, str]
Value = TypeVar("Value")
Pair: TypeAlias = tuple[Value, Value]


class _Part(NamedTuple):
    """Modes with one symmetry in x and y: k⁴, and φ = Σ V (X ⊗ Y), of unit ∫φ² over the part of the plate.

    X, Y: beams along and across, with the values of their modes; of: the mode Y of each product; axes: along, across.
    """

    fourth: Vector
    vectors: Vector
    along: tuple[Beam, Vector]
    across: tuple[Beam, Vector]
    of: Vector
    axes: tuple[int, int]

    def at(self, place: tuple[float, float]) -> Vector:
        """Return φ of all modes at a place, 1/m."""
        values = []
        for (beam, modes), axis in zip((self.along, self.across), self.axes, strict=True):
            functions = beam.at(place[axis])
            there = np.flatnonzero(functions)  # four at most
            values.append(functions[there] @ modes[there])
        along, across = values
        return np.asarray((along * across[self.of]) @ self.vectors)


@lru_cache(BASES)
@one_thread
def _part(sides: Pair[float], ends: Pair[Ends], poisson_ratio: float, highest: float) -> _Part:
    """Return the modes with wavenumbers below `highest`, 1/m, of a rectangle of these sides, m.

    ends: how the beams along x and along y are held, at the middle of a plate by "symmetry" or as "simple" for the
    even or odd motions.
    """
    # Sines do not couple: Levy's solution is exact where they are the modes across.
    axes = (1, 0) if set(ends[0]) <= {"simple", "symmetry"} else (0, 1)
    modes = sides[0] * sides[1] * highest**2 / (4.0 * pi)
    most = highest * float(np.clip((PRODUCTS / modes) ** 0.5, *MARGIN))
    along, across = (Beam(np.linspace(0.0, sides[i], int(np.ceil(sides[i] * most / CELL)) + 2), *ends[i]) for i in axes)
    fourth_y, modes_y, twist_y, bend_y = _beam_modes(across, most)
    fourth_x, modes_x, twist_x, bend_x = _beam_modes(along, np.inf)
    nu, shapes, of = poisson_ratio, [], []
    # Modes of the strip that moves as Y across: so the evanescent wave at an edge decays as in the plate.
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
    """Return k⁴ and the vectors of a beam's modes with k below `most`, ∫ v′u′ and ∫ v″u between them."""
    parts = beam.integrals()
    mass, twist, bend, elastic = (beam.matrix(parts[pair]).toarray() for pair in ((0, 0), (1, 1), (2, 0), (2, 2)))
    fourth, modes = eigh(elastic, mass, subset_by_value=(-np.inf, most**4))
    return np.maximum(fourth, 0.0), modes, modes.T @ twist @ modes, modes.T @ bend @ modes


@described_as(eq=False)
class ModalPlate:
    """A rectangular Kirchhoff plate as its modes, which serve every place, thickness and material of the same ν.

    The modes of a rectangle are computed once, in about a second, and `ModalPlate.at` returns the oscillators of a
    place in some milliseconds, smooth functions of place, thickness and material. Above `plate.highest_frequency` the
    plate answers as one with its nearest edge alone, in closed form.

    Parameters
    ----------
    plate : Plate
        A `kirchhoff_plate` of one Material, each edge clamped, simple or free, without additions and `cells`. Reduce
        others: ``hl.reduce(plate.at(x, y), until)``. Its `highest_frequency` is that of the modes, Hz; of several
        thicknesses give the thinnest, with the shortest waves.
    until : float
        The longest run, s.

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
                "edge, without additions and cells; reduce(plate.at(x, y), until) takes others"
            )

    @cached_property
    def _greatest(self) -> float:
        return 2.0 * pi / self.plate.shortest_wavelength

    @cached_property
    def _origin(self) -> dict[str, Any]:
        return self.plate.data([Contact(0.0, 0.0, "front")])

    @property
    def _cut_off(self) -> float:
        """Wavenumber of the highest mode, 1/m."""
        # There are A k²/4π modes below k (Weyl).
        least, most = ((4.0 * pi * modes / (self.plate.length * self.plate.width)) ** 0.5 for modes in MODES)
        return float(min(max(least, self._greatest), most) * fineness().cells ** 0.5)

    def at(self, x: float, y: float, thickness: float | None = None, material: Material | None = None) -> Structure:
        """Return the oscillators of the plate struck at (x, y), of another thickness or material where they are given.

        Parameters
        ----------
        x, y, thickness : float
            m. All frequencies are proportional to the thickness.
        material : Material, optional
            One of another ν has other modes, which are computed anew.

        Returns
        -------
        Structure
            M = I, K diagonal, no damping.
        """
        plate, place = self.plate, (finite("x", x, "m"), finite("y", y, "m"))
        sides, left, right, bottom, top = (
            (plate.length, plate.width),
            *(HELD[getattr(plate.supports, s)] for s in SIDES),
        )
        ends, edges = ((left, right), (bottom, top)), list[tuple[str, float]]()
        for name, coordinate, side, kinds in zip("xy", place, sides, ends, strict=True):
            if not 0.0 <= coordinate <= side:
                raise ValueError(f"{name} = {coordinate!r}: must lie on the plate, between 0 and {side:g} m")
            edges += zip(kinds, (coordinate, side - coordinate), strict=True)
        # On a corner, an edge that is held comes first.
        edge, distance = min(edges, key=lambda one: (one[1], one[0] == "free"))
        if distance == 0.0 and edge != "free":
            raise ValueError(f"x, y = {place}: must not lie on an edge that is held, which cannot move")

        section, wall = _wall(plate.thickness if thickness is None else thickness, material or plate.section.struck)
        rigidity, mass, nu = float(section.bending[0, 0]), section.mass, section.struck.poisson_ratio
        a, impedance = (rigidity / mass) ** 0.5, 8.0 * (rigidity * mass) ** 0.5
        cut, fourth, shape = a * self._cut_off**2, *modes_at(sides, ends, place, nu, self._cut_off)
        modes, one_edge = a * np.sqrt(fourth), HalfPlane(a, impedance, edge, distance, nu)
        fading, fading_weight = one_edge.resolved(cut, self.until, FADED * cut)
        bands = [
            (modes, shape**2 / mass * _kept(modes / cut)),
            (fading, fading_weight * (1.0 - _kept(fading / cut))),
            one_edge.following(cut, QUASI_STATIC * cut),
        ]
        frequency, weight = (np.concatenate(both) for both in zip(*bands, strict=True))
        frequency, weight = _fewer(frequency, weight, plate.highest_frequency, self.until)
        above, surface = one_edge.compliance_above(QUASI_STATIC * cut), Surface(section.struck)
        origin = self._origin | wall | contacts_data([Contact(*place, "front")])
        return oscillators(frequency**2, None, np.sqrt(weight), above, surface, origin, self.until)


@lru_cache(BASES)
def _wall(thickness: float, material: Material) -> tuple[Section, dict[str, Any]]:
    """Return a wall of one material, and what results say of it."""
    section = homogeneous_section(thickness, material)
    return section, {"thickness": section.thickness, "material": asdict(material), "section": section.data}


def is_modal(plate: Plate) -> bool:
    """Return whether the modes cover a plate."""
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
    """Return k⁴ of the modes that move a place, and their motion there, 1/m."""
    choices = []
    for coordinate, side, held in zip(place, sides, ends, strict=True):
        if held[0] != held[1]:
            choices.append([(side, held, coordinate, 1.0)])
            continue
        # Even and odd motions of one half; its image has as much of ∫φ².
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

    They are Gauss's quadrature of the sum over 1/(1 + ω²/σ²), as from Krylov vectors of (K + σ²M)⁻¹M. Their number is
    fixed, so the result is a smooth function of the weights.
    """
    point = 2.0 * pi * highest
    places = 1.0 / (1.0 + (frequency / point) ** 2)
    count = ceil(OSCILLATORS * (until * highest / fineness().tolerance ** 0.25) ** 0.5)
    diagonal, squares = np.zeros((2, min(count, places.size)))
    tridiagonal(places, places * weight, np.empty((LANES, 5)), diagonal, squares)
    # The sum may have fewer points that count.
    rows = int(np.argmax(np.append(squares[1:] <= 1e-20 * squares[0], True))) + 1
    values, vectors = eigh_tridiagonal(diagonal[:rows], np.sqrt(squares[1:rows]), check_finite=False)
    return point * np.sqrt(np.maximum(1.0 / values - 1.0, 0.0)), vectors[0] ** 2 * squares[0] / values


def _kept(part: Vector) -> Vector:
    """Return what is left of modes at a part of the cut-off: 1 up to FADED, 0 at 1."""
    return np.asarray(np.cos(0.5 * pi * np.clip((part - FADED) / (1.0 - FADED), 0.0, 1.0)) ** 2)
