"""The protocol of contact laws, and the two that hold any curve: a power law, and a table.

Every law reaches the compiled loops as a stiffness times a shape: Hertz's δ√δ, or a table of cubics (`kernel_table`).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from copy import copy, deepcopy
from dataclasses import is_dataclass
from functools import cached_property, lru_cache
from inspect import getattr_static
from math import inf, log
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from particles.kernels import laws as kernels
from structures.checks import count_of, finite, listed, positive, short
from structures.described import described
from structures.html_table import html_table
from structures.quantities import Asks, Coordinate, Force, Length, Quantity
from structures.structure import Vector

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

DIFFERENCE = 1e-5
"""Relative step of a central difference: its error and that of rounding are both some 1e-10."""

SMALLEST_APPROACH, LARGEST_APPROACH = 1e-30, 1.0
"""m, between which the approach at a force or an energy is searched."""

PARTS, DIVISIONS = 16, 15
"""Parts of an interval of ln δ, of which one goes on, and how often: then nothing is left of it."""

UNDERFLOW = 1e-300
"""The smallest number that is divided by."""

CACHED = ("_table", "table_error")
"""What a law computes once; any change of an attribute removes it."""

PROBES = {
    "force": (1e-7, 1e-6, 1e-5),
    "tangent": (1e-7, 1e-6, 1e-5),
    "energy": (1e-7, 1e-6, 1e-5),
    "approach": (1e-2, 1.0, 100.0),
    "overlap": (1e-9, 1e-7, 1e-5),
}
"""The methods of a law, and three usual approaches (m), forces (N) or energies (J) that a check gives to each."""


PIECE = {"force": ("force", 1e-6), "slope": ("tangent", 1e-3), "energy": ("energy", 1e-3)}
"""The functions of a law's piece, the methods that give the same, and by how much they may differ."""


CAUTION = Asks("a text that each run repeats as a warning")


class ContactLaw(ABC):
    """The force between two bodies against their approach. Derive a class from it for a law of your own.

    A subclass defines `force`, which takes an array of approaches and returns as many forces; everything else follows
    from it. The compiled loops take any law as a table of cubics, 32 in each octave of the approach; a run warns where
    that table is more than 1e-4 off. The force must be finite and increase for approaches up to 0.125 m; its derivative
    is at least that of a linear spring. A simulation copies a law that is no frozen dataclass, so that a later change
    of the law acts on later simulations only.

    Attributes
    ----------
    name : str
        Name of the law in messages.
    largest : float
        Approach, m, up to which the law is trusted; beyond it a run warns. By default infinite.
    caution : str
        What a user of the law must know; the attribute `warnings` of each result lists it. By default empty.
    piece : type or None
        The law as compiled functions, which replace the table: a NamedTuple whose fields have the names of the law's
        numbers, with the static methods `force`, `slope` and `energy`, see docs/extending.md. By default None.

    Examples
    --------
    A contact that stiffens, as a frozen dataclass so that equal laws share a table:

    >>> import hertzlink as hl
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Stiffening(hl.ContactLaw):
    ...     hertz: float  # N/m^1.5
    ...     cubic: float  # N/m^3
    ...     name = "Hertz with a cubic term"
    ...
    ...     def force(self, approach):
    ...         return self.hertz * approach**1.5 + self.cubic * approach**3
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 10, bead, impact_speed=0.4, law=Stiffening(1e10, 1e17))
    >>> round(float(chain.law.tangent(1e-5)) * 1e-6, 2)  # N/µm
    77.43
    """

    name: str = "contact law"
    largest: float = inf
    caution: str = ""
    piece: type | None = None

    @abstractmethod
    def force(self, approach: Vector) -> Vector:
        """Return F(δ), N, at approaches of zero or more, m."""

    def tangent(self, approach: Vector) -> Vector:
        """Return dF/dδ, N/m: by central differences, if a subclass gives no formula."""
        middle = np.maximum(approach, SMALLEST_APPROACH)
        step = DIFFERENCE * middle
        slope: Vector = (np.asarray(self.force(middle + step)) - self.force(middle - step)) / (2.0 * step)
        return np.where(np.asarray(approach) > 0.0, slope, 0.0)

    @property
    def kernel(self) -> tuple[float, Vector | None]:
        """Stiffness and table for the kernel; None for Hertz's shape δ√δ."""
        return 1.0, self._table

    def energy(self, approach: Vector) -> Vector:
        """Return ∫F dδ, J."""
        work: Vector = kernels.table_energies(self._table, np.asarray(approach, float))
        return work

    def approach(self, force: Vector) -> Vector:
        """Return δ(F), m, the inverse of the law."""
        return inverse(self.force, np.asarray(force, float))

    def overlap(self, energy: Vector) -> Vector:
        """Return the approach, m, at which the contact holds this energy (J)."""
        return inverse(self.energy, np.asarray(energy, float))

    @cached_property
    def table_error(self) -> float:
        """Largest relative error of the table that the compiled loops take, in the middle of its cubics."""
        stiffness, table = self.kernel
        if table is None:
            return 0.0
        rows = table[1:-1]
        half = 0.5 * np.diff(table[1:, 0])
        cubics = rows[:, 1] + half * (rows[:, 2] + half * (rows[:, 3] + half * rows[:, 4]))
        exact = np.asarray(self.force(rows[:, 0] + half), float)
        return float((np.abs(stiffness * cubics / exact - 1.0)).max())

    @cached_property
    def _table(self) -> Vector:
        return kernel_table(self)

    def __setattr__(self, name: str, value: object) -> None:
        for cached in CACHED:
            vars(self).pop(cached, None)
        super().__setattr__(name, value)

    def _repr_html_(self) -> str:
        check_contact_law("law", self)
        shown = [*filter(lambda overlap: overlap < self.largest, SHOWN)] + [self.largest] * (self.largest < inf)
        forces = [
            (f"F({1e6 * approach:.4g} µm)", f"{force:.4g} N")
            for approach, force in zip(shown, self.force(np.array(shown)), strict=True)
        ]
        largest = "any approach" if self.largest == inf else f"approaches up to {1e6 * self.largest:.4g} µm"
        caution = [("caution", self.caution)] if self.caution else []
        return html_table(f"{type(self).__name__}: {self.name}", [*forces, ("trusted for", largest), *caution])


SHOWN = (1e-6, 1e-5)
"""Approaches, m, whose forces a notebook shows."""


def check_contact_law(name: str, law: Any, what: str = "a contact law such as PowerLaw(k, n)") -> ContactLaw:
    """Return `law`, or a ValueError where it is none, has no hash to find equal laws by, or gives wrong answers."""
    if not isinstance(law, ContactLaw):
        raise ValueError(f"{name} = {short(law)}: must be {what}")
    try:
        hash(law)
    except TypeError:
        raise ValueError(
            f"{name} = {short(law)}: must be hashable; make {type(law).__name__} a frozen dataclass of numbers"
        ) from None
    if type(law) not in (PowerLaw, TabulatedLaw):
        _check_members(name, law)
    return law


def _check_members(name: str, law: ContactLaw) -> None:
    """Raise a ValueError where a method returns no array like that it takes, or an attribute is of a wrong kind."""
    owner = f"{name}: {type(law).__name__}"
    for attribute in ("name", "caution"):
        if not isinstance(getattr(law, attribute), str):
            raise ValueError(f"{owner}.{attribute} = {short(getattr(law, attribute))}: must be text")
    if law.largest != inf:
        positive(f"{owner}.largest", law.largest, "m")
    for method, values in PROBES.items():
        if method != "force" and getattr(type(law), method) is getattr(ContactLaw, method):
            continue
        _check_answer(f"{owner}.{method}", getattr(law, method), np.array(values))
    if law.piece is not None:
        _check_piece(owner, law)


def filled(piece: Any, laws: Sequence[ContactLaw | None]) -> Any:
    """Return a piece whose fields hold the laws' attributes of the same names, a number for each contact; zero without
    law."""
    return piece(*(np.array([getattr(law, name) if law else 0.0 for law in laws]) for name in piece._fields))


def _check_piece(owner: str, law: ContactLaw) -> None:
    """Raise a ValueError where the law's piece is none, or contradicts the law."""
    piece: Any = law.piece
    if not isinstance(piece, type) or not hasattr(piece, "_fields"):
        raise ValueError(f"{owner}.piece = {short(piece)}: must be a NamedTuple with static methods {', '.join(PIECE)}")
    for name in PIECE:
        if not isinstance(getattr_static(piece, name, None), staticmethod):
            raise ValueError(f"{owner}.piece = {piece.__name__}: has no static method {name}(law, i, overlap)")
    for name in piece._fields:
        finite(f"{owner}.{name}, a field of its piece {piece.__name__},", getattr(law, name, None))  # type: ignore[arg-type]
    alone = filled(piece, [law])
    for name, (method, tolerance) in PIECE.items():
        for approach in (*PROBES["force"], 0.0, -1e-6):
            expected = float(getattr(law, method)(np.array([approach]))[0]) if approach > 0.0 else 0.0
            answer = getattr(piece, name)(alone, 0, approach)
            if not abs(finite(f"{piece.__name__}.{name}", answer) - expected) <= tolerance * abs(expected):
                raise ValueError(
                    f"{owner}.piece: {piece.__name__}.{name} gives {answer:.6g} at an overlap of {approach:.3g} m, "
                    f"where {type(law).__name__}.{method} gives {expected:.6g}"
                )


def _check_answer(name: str, method: Callable[[Vector], Vector], values: Vector) -> None:
    argument = values.copy()
    try:
        answer = method(argument)
        array = np.asarray(answer)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"{name} fails for an array: {error}; use np.where in place of if, np.sqrt in place of math.sqrt"
        ) from error
    except Exception as error:
        error.add_note(f"raised by {name}({short(values)})")
        raise
    if array.dtype.kind not in "iuf" or array.shape != values.shape:
        raise ValueError(f"{name} returned {short(answer)} for an array of {values.size}: must return as many numbers")
    if not np.array_equal(argument, values):
        raise ValueError(f"{name} changes the array that it takes; must return a new one")


def unchanging(law: ContactLaw) -> ContactLaw:
    """Return a frozen dataclass itself; a copy of any other law, which a user may change later."""
    if is_dataclass(law) and type(law).__dataclass_params__.frozen:  # type: ignore[attr-defined]
        return law
    try:
        copied = deepcopy(law)
    except TypeError:  # of attributes such as open files
        copied = copy(law)
    for cached in CACHED:
        vars(copied).pop(cached, None)
    return copied


@described
class PowerLaw(ContactLaw):
    """The law F = k δⁿ; n = 3/2 is Hertz's.

    Parameters
    ----------
    stiffness : float
        k, N/mⁿ.
    exponent : float
        n, from 1 to 10.
    largest : float
        Approach, m, up to which the law is trusted; beyond it a run continues and warns.
    name : str
        Name of the law in messages.
    caution : str
        What a user of the law must know; the attribute `warnings` of each result lists it.

    Raises
    ------
    ValueError
        For a stiffness that is not positive, or an exponent out of range.

    References
    ----------
    Khatri's thesis, equation 5.9.

    Examples
    --------
    >>> import hertzlink as hl
    >>> law = hl.laws.PowerLaw(stiffness=1e10)
    >>> round(float(law.force(1e-5)), 1)  # N
    316.2
    """

    stiffness: Annotated[float, Quantity("N/m^n", written="")]
    exponent: Annotated[float, Quantity(low=1.0, high=10.0)] = 1.5
    largest: Length = inf
    name: str = "power law"
    caution: Annotated[str, CAUTION] = ""

    def force(self, approach: Vector) -> Vector:
        """Return F(δ), N."""
        return self.stiffness * np.maximum(approach, 0.0) ** self.exponent

    def tangent(self, approach: Vector) -> Vector:
        """Return dF/dδ, N/m."""
        return self.stiffness * self.exponent * np.maximum(approach, 0.0) ** (self.exponent - 1.0)

    @property
    def kernel(self) -> tuple[float, Vector | None]:
        """k, and the table of δⁿ; None for Hertz's shape δ√δ."""
        return self.stiffness, None if self.exponent == 1.5 else _shape_table(self.exponent)

    def energy(self, approach: Vector) -> Vector:
        """Return ∫F dδ, J."""
        return self.force(approach) * np.maximum(approach, 0.0) / (self.exponent + 1.0)

    def approach(self, force: Vector) -> Vector:
        """Return δ(F), m."""
        return (np.maximum(force, 0.0) / self.stiffness) ** (1.0 / self.exponent)

    def overlap(self, energy: Vector) -> Vector:
        """Return the approach, m, at which the contact holds this energy (J)."""
        n = self.exponent
        return ((n + 1.0) * np.asarray(energy) / self.stiffness) ** (1.0 / (n + 1.0))


@described
class TabulatedLaw(ContactLaw):
    """A law through points.

    Monotone cubics (Fritsch–Carlson) run through ln F over ln δ, so that power laws are kept exactly. Outside the
    points the law continues as power laws: below the first point to zero, at least linearly; beyond the last one as
    steeply as there and as the last two points, and a run warns.

    Parameters
    ----------
    approaches : sequence of float
        Approaches, m, increasing. A first point (0, 0) is left out.
    forces : sequence of float
        Forces, N, increasing, as many as approaches.
    name : str
        Name of the law in messages.
    caution : str
        What a user of the law must know; the attribute `warnings` of each result lists it.
    largest : float
        Approach, m, up to which the law is trusted; by default that of the last point.

    Raises
    ------
    ValueError
        For points that do not increase, or fewer than two.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.laws.TabulatedLaw([1e-6, 1e-5, 2e-5], [10.0, 316.2, 894.0], name="measured")
    TabulatedLaw('measured', 3 points up to 2e-05 m and 894 N)
    """

    approaches: Sequence[Coordinate]
    forces: Sequence[Force]
    name: str = "tabulated law"
    caution: Annotated[str, CAUTION] = ""
    largest: Length = inf

    def __post_init__(self) -> None:
        approaches = listed("approaches", self.approaches, object, "numbers")
        forces = listed("forces", self.forces, object, "numbers")
        if len(approaches) != len(forces):
            of = count_of(len(approaches), "approach", "approaches")
            raise ValueError(f"forces: {count_of(len(forces), 'value')} for {of}; must be as many")
        rows = [
            (finite("approaches", d, "m"), finite("forces", f, "N")) for d, f in zip(approaches, forces, strict=True)
        ]
        if rows[0] == (0.0, 0.0):
            rows = rows[1:]
        if len(rows) < 2:
            raise ValueError(f"approaches: must hold two points or more in addition to (0, 0), not {len(rows)}")
        for before, after in zip([(0.0, 0.0), *rows], rows, strict=False):
            if not (after[0] > before[0] and after[1] > before[1]):
                raise ValueError(f"forces: must increase with the approaches from zero; {after} follows {before}")
        object.__setattr__(self, "approaches", tuple(row[0] for row in rows))
        object.__setattr__(self, "forces", tuple(row[1] for row in rows))
        object.__setattr__(self, "largest", min(self.largest, rows[-1][0]))

    def __repr__(self) -> str:
        extent = f"{len(self.approaches)} points up to {self.approaches[-1]:.4g} m and {self.forces[-1]:.4g} N"
        return f"{type(self).__name__}({self.name!r}, {extent})"

    def force(self, approach: Vector) -> Vector:
        """Return F(δ), N."""
        return self._force_and_slope(approach)[0]

    def tangent(self, approach: Vector) -> Vector:
        """Return dF/dδ, N/m."""
        force, slope = self._force_and_slope(approach)
        return force * slope / np.maximum(approach, UNDERFLOW)

    def _force_and_slope(self, approach: Vector) -> tuple[Vector, Vector]:
        """Return the force, and d ln F / d ln δ."""
        curve, (first, last), (below, above) = self._curve
        asked = np.log(np.maximum(approach, UNDERFLOW))
        inside = np.clip(asked, first, last)
        slope = np.where(asked < first, below, np.where(asked > last, above, curve(inside, 1)))
        force = np.exp(curve(inside) + slope * (asked - inside))
        return np.where(np.asarray(approach) <= 0.0, 0.0, force), slope

    @cached_property
    def _curve(self) -> "tuple[PchipInterpolator, tuple[float, float], tuple[float, float]]":
        """ln F over ln δ, its ends, and its slopes beyond them."""
        from scipy.interpolate import PchipInterpolator

        x, y = np.log(self.approaches), np.log(self.forces)
        curve = PchipInterpolator(x, y)
        beyond = (
            max(float(curve(x[0], 1)), 1.0),
            max(float(curve(x[-1], 1)), float((y[-1] - y[-2]) / (x[-1] - x[-2]))),
        )
        return curve, (x[0], x[-1]), beyond


def kernel_table(law: ContactLaw) -> Vector:
    """Return a law as rows (δ₀, F, F′, c₂, c₃, ∫F dδ) of cubics in δ − δ₀, Hermite's between kernels.BUCKETS in each
    octave.

    F is continuous with its slope, and the error for a power law is 2e-9. The first row is a straight line through
    zero.
    """
    edges = kernels.table_edges()
    force, slope = (np.asarray(values, float) for values in (law.force(edges), law.tangent(edges)))
    step = np.diff(edges)
    rise = np.diff(force) / step
    if not isinstance(law, PowerLaw | TabulatedLaw):
        _check_curve(law, force, slope, rise)
    rows = np.empty((step.size, 6))
    rows[:, 0], rows[:, 1], rows[:, 2] = edges[:-1], force[:-1], slope[:-1]
    rows[:, 3] = (3.0 * rise - 2.0 * slope[:-1] - slope[1:]) / step
    rows[:, 4] = (slope[:-1] + slope[1:] - 2.0 * rise) / step**2
    rows[0] = [0.0, 0.0, force[1] / edges[1], 0.0, 0.0, 0.0]
    rows[-1, 3:5] = 0.0
    work = step * (rows[:, 1] + step * (rows[:, 2] / 2.0 + step * (rows[:, 3] / 3.0 + step * rows[:, 4] / 4.0)))
    work[0] = 0.5 * force[1] * edges[1]
    rows[:, 5] = np.concatenate([[0.0], np.cumsum(work[:-1])])
    return rows


def _check_curve(law: ContactLaw, force: Vector, slope: Vector, rise: Vector) -> None:
    """Raise a ValueError where a user's law is not finite, does not rise from zero, or contradicts its own slope."""
    faults = {
        "force is not finite": not np.isfinite(force).all(),
        "force is not zero at zero": force[0] > 1e-6 * force.max(),
        "force does not rise with the approach": not np.all(rise > 0.0),
        "tangent is not the slope of its force": not np.allclose(0.5 * (slope[1:] + slope[:-1]), rise, rtol=0.5),
    }
    for fault, wrong in faults.items():
        if wrong:
            low, *_, high = kernels.table_edges()
            raise ValueError(f"law: {type(law).__name__}.{fault} between {low:.1g} and {high:.3g} m")


@lru_cache(maxsize=256)
def _shape_table(exponent: float) -> Vector:
    return kernel_table(PowerLaw(1.0, exponent))


def inverse(increasing: Callable[[Vector], Vector], wanted: Vector) -> Vector:
    """Return where an increasing function of the approach has these values, by dividing an interval of ln δ.

    All ends of the parts are asked at once: a function takes hardly longer for many approaches than for one.
    """
    if not (wanted > 0.0).any():
        # What is not a number stays so.
        return np.maximum(wanted, 0.0)
    asked, ends = wanted.reshape(-1), np.arange(1, PARTS)[:, None]
    low, part = np.full(asked.size, log(SMALLEST_APPROACH)), log(LARGEST_APPROACH / SMALLEST_APPROACH)
    for _ in range(DIVISIONS):
        part /= PARTS
        overlaps = np.reshape(increasing(np.exp(low + part * ends).reshape(-1)), (PARTS - 1, -1))
        low = low + part * (overlaps < asked).sum(axis=0)
    approach = np.exp(low + 0.5 * part).reshape(wanted.shape)
    return np.where(wanted > 0.0, approach, np.maximum(wanted, 0.0))
