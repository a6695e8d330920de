"""A reduced plate: one basis for all contact positions in a range, and from it the oscillators of each position."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import ceil
from typing import Any

import numpy as np
from scipy import sparse

from plates.contacts import Contact, Places, contacts_at, one_or_all
from plates.elements.self_displacement import SelfDisplacement, patch, self_displacement
from plates.elements.theory import Touch
from plates.plate import Plate
from plates.scaling import scalable, scaled, wave_speed
from plates.section import homogeneous_section
from structures.caution import caution
from structures.checks import finite, instance, positive, several, short, whole, within
from structures.fineness import fineness
from structures.material import Material
from structures.quantities import Likely
from structures.reduction import DEFAULT_PULSE, PULSE_HALVINGS, PULSE_RANGE, Modes
from structures.shared_basis import SharedBasis, compressed, needed_size, shared_basis
from structures.structure import Structure, Vector
from structures.surface import Surface

MOST_VECTORS = 1500
"""Default limit of the basis: of some 10 000 degrees of freedom it fills 250 MB while it is made."""

MOST_PLACES = 1000
"""Positions from which the basis starts; more are refused."""

CHECKS = 3
"""Positions along a range at which the error is estimated, between those from which the basis starts."""

PER_STEP = 4
"""Loads from which the basis starts, for each step of the grid of two cells."""

INSIDE = 1e-9
"""Part of the plate's size by which a position may exceed the range: rounding."""

Range = float | tuple[float, float]
"""One number, or the least and the greatest, m."""


@dataclass(frozen=True, eq=False, repr=False)
class ReducedPlate:
    """A rectangular Kirchhoff plate reduced once, for contacts anywhere in a range of positions.

    `plate.at(x, y)` makes a mesh for its position, and `reduce` computes a basis for that mesh, in some 0.1 to 0.9 s.
    Here mesh and basis serve all positions in the range: `ReducedPlate.at(x, y)` returns the oscillators of a position
    in 2 to 3 ms. The mesh is fine in all of the range. As mesh, basis and number of oscillators are the same for all
    positions, results are smooth functions of the position, and by `scaled` of thickness, E and density.

    A range of thicknesses has one basis, too, as their modes are the same: the mesh is that of the thinnest plate, with
    the shortest waves, and the basis that of the thickest, whose faster waves need the most vectors for a record.

    The basis is a block Krylov basis that starts from the nodes and the middles of the cells in the range. Directions
    in which these positions hardly differ are dropped. The oscillators of a position come from a second Krylov
    reduction, within the basis. What the mesh lacks of a force's own displacement between its nodes, compared with that
    at a node, is added to `flexibility`.

    Parameters
    ----------
    plate : Plate
        What `kirchhoff_plate` returns.
    until : float
        Length of the longest run, s.
    x, y : float or (float, float)
        The coordinate of all contacts, or its least and its greatest value, m.
    tolerance : float
        Relative error of a contact's displacement after a force pulse, as in `reduce`; the basis is estimated at
        positions between its starting points. The oscillators of one position may add as much again.
    pulse : float
        Length of the pulse, s: a contact time, as in `reduce`.
    largest : int
        Largest number of vectors in the basis. A warning is issued if they do not reach the tolerance.
    thickness : float or (float, float), optional
        The thickness, or the least and the greatest, m, for which runs up to `until` are valid and the error is
        estimated; by default that of the plate.

    Raises
    ------
    ValueError
        If an argument is out of its range, the range is too large, or the plate is not a rectangle of Kirchhoff's
        theory. For another thickness where the plate does not scale, for the reasons that `scaled` names.

    References
    ----------
    Golub, Underwood, The block Lanczos method for computing eigenvalues, in: Mathematical Software III (1977) 361.

    Examples
    --------
    >>> import hertzlink as hl
    >>> plate = hl.kirchhoff_plate(0.2, 0.2, 4e-3, hl.ALUMINIUM_6061, hl.Supports("clamped", "clamped"))
    >>> reduced = hl.ReducedPlate(plate, until=0.5e-3, x=(0.02, 0.04), y=0.1, tolerance=0.05)
    >>> near = reduced.at(0.0234, 0.1)
    >>> near.contacts, near.size < 100, near.valid_until
    (1, True, 0.0005)
    >>> both = hl.ReducedPlate(plate, 0.5e-3, x=0.03, y=0.1, tolerance=0.05, thickness=(4e-3, 5e-3))
    >>> [both.at(0.03, 0.1, thickness=one).valid_until for one in (4e-3, 5e-3)]
    [0.0005, 0.0005]
    """

    plate: Plate
    until: float
    x: Range
    y: Range
    tolerance: float = 1e-2
    pulse: float = DEFAULT_PULSE
    largest: int = MOST_VECTORS
    thickness: Range = None  # type: ignore[assignment]
    basis: SharedBasis = field(init=False)
    size: int = field(init=False)
    _read: Callable[[Touch], Vector] = field(init=False)
    _own: SelfDisplacement = field(init=False)
    _reference: Plate = field(init=False)
    _latest: dict[tuple[Contact, ...], Modes] = field(init=False, default_factory=dict, repr=False, compare=False)
    """Of the latest place, where most runs of a fit change the wall or the chain alone."""

    def __post_init__(self) -> None:
        plate = instance("plate", self.plate, Plate, "a Plate, such as kirchhoff_plate returns")
        if plate.kind != "Kirchhoff plate":
            raise ValueError(f"plate: is a {plate.kind}; must be a rectangle in Kirchhoff's theory, a kirchhoff_plate")
        for name, value in (
            ("until", positive("until", self.until, "s")),
            ("tolerance", fineness().tolerance * positive("tolerance", self.tolerance)),
            ("pulse", within("pulse", self.pulse, *PULSE_RANGE, "s")),
            ("largest", whole("largest", self.largest)),
        ):
            object.__setattr__(self, name, value)
        if fineness().tolerance < 1.0:
            object.__setattr__(self, "largest", max(self.largest, MOST_VECTORS))
        Likely.TIME.warn("ReducedPlate", "pulse", self.pulse)
        ranges = [_range(name, getattr(self, name)) for name in ("x", "y")]
        for name, (low, high), size in zip("xy", ranges, (plate.length, plate.width), strict=True):
            if not 0.0 <= low <= high <= size:
                raise ValueError(
                    f"{name} = {short(getattr(self, name))}: must lie on the plate, between 0 and {size:g} m"
                )
            object.__setattr__(self, name, low if low == high else (low, high))
        speeds = self._speeds()
        grid = [np.linspace(low, high, self._count(low, high)) for low, high in ranges]
        counts = [_in_cells(axis).size for axis in grid]
        if counts[0] * counts[1] > MOST_PLACES:
            raise ValueError(
                f"x, y: the basis would start from {counts[0]} × {counts[1]} positions, at most {MOST_PLACES} fit; "
                "take a smaller range, or a line"
            )
        basis = self._basis(speeds, *grid)
        size = basis.square.size
        if isinstance(self.x, tuple) or isinstance(self.y, tuple):  # one place needs all vectors of its basis
            checks = basis.contact(self._vectors(*(_between(axis, CHECKS) for axis in grid)))
            size, basis = needed_size(basis, checks, self.until, self.tolerance)
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "basis", basis)

    def _speeds(self) -> tuple[float, ...]:
        """Return the speeds of the waves for which the basis is, in units of those of the thickest plate, which is
        reduced."""
        plate, thickness = self.plate, self.plate.thickness if self.thickness is None else self.thickness
        thin, thick = _range("thickness", thickness)
        positive("thickness", thin, "m")
        if not thin == thick == plate.thickness:
            section = homogeneous_section(thick, scalable("plate", plate.data([]), False).struck)
            # A frequency that is higher by the ratio of the thicknesses has the same wavelength, and so the same mesh.
            plate = replace(plate, section=section, highest_frequency=thick / thin * plate.highest_frequency)
        object.__setattr__(self, "_reference", plate)
        object.__setattr__(self, "thickness", thin if thin == thick else (thin, thick))
        return (1.0,) if thin == thick else (1.0, self._speed(thin, None))

    def _speed(self, thickness: float, material: Material | None) -> float:
        """Return the speed of the waves with another wall, in units of those that the basis was computed for."""
        section = self._reference.section
        return wave_speed(section, homogeneous_section(thickness, material or section.struck))

    def _count(self, low: float, high: float) -> int:
        """Return how many positions lie two cells, or a little less, apart."""
        return 1 if low == high else ceil((high - low) / (2.0 * self._reference.finest_cell)) + 1

    def _basis(self, speeds: tuple[float, ...], xs: Vector, ys: Vector) -> SharedBasis:
        """Return the basis that starts from a grid of positions; a caution if it does not reach the tolerance."""
        contacts = [Contact(float(x), float(y), "front") for x, y in product(xs, ys)]
        mesh, assembled, matrices, _ = self._reference.meshed(contacts)
        object.__setattr__(self, "_read", assembled.contact)
        nodes = (patch(np.unique(mesh.mesh.p[i]), axis[0], axis[-1]) for i, axis in enumerate((xs, ys)))
        object.__setattr__(self, "_own", self_displacement(self._reference.section, *nodes))
        loads = self._vectors(*map(_in_cells, (xs, ys)))
        rows = np.flatnonzero((loads != 0.0).any(axis=1))
        checks = self._vectors(*(_between(axis, CHECKS) for axis in (xs, ys)))
        pulses = [self.pulse / 2.0**i for i in range(PULSE_HALVINGS + 1)]
        basis = shared_basis(matrices, loads, checks, rows, self.until, self.tolerance, pulses, self.largest, speeds)
        if basis.errors[0][1] > self.tolerance:
            caution(
                f"reduction: {basis.square.size} vectors leave an error of {basis.errors[0][1]:.1e}; raise largest or "
                "tolerance, or take a smaller range"
            )
        return basis

    def _vectors(self, xs: Vector, ys: Vector) -> Vector:
        """Return the contact vectors of a grid of positions, n × positions."""
        return np.column_stack([self._vector(float(x), float(y)) for x, y in product(xs, ys)])

    def _vector(self, x: float, y: float) -> Vector:
        """Return the contact vector of a position."""
        vector: Vector = self._read(Touch(np.array([x, y]), [], self._reference.section))
        return vector

    def at(
        self,
        x: float | Places,
        y: float | Places,
        face: str | Sequence[str] = "front",
        thickness: float | None = None,
        material: Material | None = None,
    ) -> Structure:
        """Return oscillators of the plate struck at (x, y), or at several points, as `reduce(plate.at(x, y))` returns.

        Parameters
        ----------
        x, y : float or sequence of float
            Coordinates, m, within the range.
        face : str or sequence of str
            "front" or "back", one for all contacts or one for each.
        thickness : float, optional
            Another thickness, m, as in `scaled`; by default that of the plate.
        material : Material, optional
            Another material of the same ν, as in `scaled`.

        Returns
        -------
        Structure
            M = I, K diagonal; as many oscillators for each contact at all positions.

        Raises
        ------
        ValueError
            For positions outside the range; for another thickness or material where the plate does not scale.
        """
        contacts = contacts_at(x, y, face)
        for contact in contacts:
            for name, value in (("x", contact.x), ("y", contact.y)):
                self._check_inside(name + contact.number, value, getattr(self, name))
        structure = self._at(contacts)
        faster, new = 1.0, self.plate.thickness if thickness is None else thickness
        if material is not None or new != self._reference.thickness:
            structure, speed = scaled(structure, new, material), self._speed(new, material)
            # Walls within the range have the record and the pulses of the basis; for others they scale.
            faster = speed / min(max(speed, min(self.basis.speeds)), 1.0)
        origin = {**structure.origin, "reduction": self._report(structure.size, faster)}
        return replace(structure, valid_until=self.until / faster, origin=origin)

    def _at(self, contacts: list[Contact]) -> Structure:
        """Return the oscillators of a place, of the wall that was reduced; those of the latest place are kept."""
        place = tuple(contacts)
        if (modes := self._latest.get(place)) is None:
            loads = np.column_stack([contact.sign * self._vector(contact.x, contact.y) for contact in contacts])
            modes = compressed(self.basis, self.basis.contact(loads), self.size * len(contacts))
            self._latest.clear()
            self._latest[place] = modes
        return Structure(
            sparse.csr_array(sparse.eye_array(modes.square.size)),
            sparse.csr_array(sparse.diags_array(modes.square)),
            None,
            modes.contact.copy(),
            one_or_all([self._own.missing(contact.x, contact.y) for contact in contacts]),
            one_or_all([Surface(self._reference.wall(contact.face).struck) for contact in contacts]),
            self._reference.data(contacts),
        )

    def _report(self, size: int, faster: float) -> dict[str, Any]:
        """Return what results hold of the reduction, for waves that are faster than the basis is for."""
        (pulse, error), *shorter = [(pulse / faster, error) for pulse, error in self.basis.errors]
        shared = {"x": self.x, "y": self.y, "thickness": self.thickness, "vectors": int(self.basis.square.size)}
        report = {"size": size, "tolerance": self.tolerance, "pulse": pulse, "error_estimate": error}
        return report | {"shorter_pulses": shorter, "shared": shared}

    def _check_inside(self, name: str, value: float, allowed: Range) -> None:
        low, high = allowed if isinstance(allowed, tuple) else (allowed, allowed)
        rounding = INSIDE * max(self.plate.length, self.plate.width)
        if not low - rounding <= value <= high + rounding:
            where = f"{low:g} m" if low == high else f"between {low:g} and {high:g} m"
            raise ValueError(f"{name} = {value!r}: the plate was reduced for contacts at {where}; must lie there")

    def __repr__(self) -> str:
        x, y = (f"{axis:g}" if isinstance(axis, float) else f"{axis[0]:g} to {axis[1]:g}" for axis in (self.x, self.y))
        return (
            f"<ReducedPlate for x = {x} m, y = {y} m and {self.until:g} s: {self.size} oscillators for a contact, of "
            f"{self.basis.square.size}; {self.plate!r}>"
        )


def covers(allowed: Range, value: float) -> bool:
    """Return whether a range includes a number, m."""
    low, high = allowed if isinstance(allowed, tuple) else (allowed, allowed)
    return low <= value <= high


def _range(name: str, values: Any) -> tuple[float, float]:
    """Return the least and the greatest number, m, or raise a ValueError."""
    ends = tuple(values) if several(values) else (values, values)
    if len(ends) != 2:
        raise ValueError(f"{name} = {short(values)}: must be one number, or the least and the greatest, m")
    low, high = (finite(name, end, "m") for end in ends)
    if low > high:
        raise ValueError(f"{name} = {short(values)}: the least number comes first")
    return low, high


def _in_cells(grid: Vector) -> Vector:
    """Return the nodes and the middles of the cells, two between neighbours of a grid: positions in between hardly add
    to the static responses of these."""
    if grid.size == 1:
        return grid
    return np.linspace(grid[0], grid[-1], PER_STEP * (grid.size - 1) + 1)


def _between(grid: Vector, count: int) -> Vector:
    """Return about `count` positions between those of a grid: 1/4 or 3/4 of the way from one to the next."""
    if grid.size == 1:
        return grid
    step = grid[1] - grid[0]
    first = np.unique(np.linspace(0, grid.size - 2, count).round().astype(int))
    quarter = np.where(np.arange(first.size) % 2 == 0, 0.25, 0.75)
    return np.asarray(grid[first] + quarter * step)
