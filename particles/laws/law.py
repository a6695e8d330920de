"""The base class of contact laws, a power law, and a law through tabulated points.

In the compiled loops every law is a stiffness times a shape: Hertz's δ√δ, or a table of cubics (`kernel_table`).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Sequence
from copy import deepcopy
from dataclasses import is_dataclass
from functools import cached_property, lru_cache
from math import inf, log
from typing import Annotated, Any

import numpy as np

from particles.kernels import laws as kernels
from structures.checks import each, finite, listed, short
from structures.described import described
from structures.quantities import Asks, Coordinate, Force, Length, Quantity
from structures.structure import Vector

SMALLEST_APPROACH, LARGEST_APPROACH = 1e-30, 1.0  # m, limits of the search for the approach at a force or an energy
Caution = Annotated[str, Asks("a text that each run repeats as a warning")]


class ContactLaw(ABC):
    """The force between two bodies as a function of their approach. docs/extending.md shows a law of your own.

    A subclass defines `force`, which is finite and increases up to 0.125 m. Everything else follows from it. The
    compiled loops use a table of cubics, 32 in each octave; a run warns if the table has an error of more than 1e-4.

    Examples
    --------
    >>> isinstance(hl.laws.PowerLaw(1e10), hl.laws.ContactLaw)
    True
    """

    name: str = "contact law"
    largest: float = inf  # m, the approach up to which the law is trusted; beyond it a run warns
    caution: str = ""  # a warning about the law, which the attribute `warnings` of each result contains
    piece: type | None = None  # the law as compiled functions, which replace the table

    @abstractmethod
    def force(self, approach: Vector) -> Vector:
        """Return the forces F(δ), N, at approaches of zero or more, m."""

    def tangent(self, approach: Vector) -> Vector:
        """Return dF/dδ, N/m, by central differences."""
        middle = np.maximum(approach, SMALLEST_APPROACH)
        step = 1e-5 * middle  # the errors of the difference and of rounding are both about 1e-10
        slope: Vector = (np.asarray(self.force(middle + step)) - self.force(middle - step)) / (2.0 * step)
        return np.where(np.asarray(approach) > 0.0, slope, 0.0)

    @property
    def kernel(self) -> tuple[float, Vector | None]:
        """Stiffness and table for the compiled loops; the table is None for Hertz's shape δ√δ."""
        return 1.0, self._table

    def energy(self, approach: Vector) -> Vector:
        """Return ∫F dδ, J."""
        overlap = np.asarray(approach, float)
        row = np.clip(np.searchsorted(kernels.EDGES, overlap, side="right") - 1, 0, kernels.EDGES.size - 2)
        return np.where(overlap > kernels.NEGLIGIBLE, kernels.cubic(self._table, row, overlap)[2], 0.0)

    def approach(self, force: Vector) -> Vector:
        """Return δ(F), m, the inverse of the law."""
        return inverse(self.force, np.asarray(force, float))

    def overlap(self, energy: Vector) -> Vector:
        """Return the approach, m, at which the contact has stored this energy, J."""
        return inverse(self.energy, np.asarray(energy, float))

    @property
    def table_error(self) -> float:
        """The largest relative error of the table in the middle of its cubics."""
        row = np.arange(1, len(self._table) - 1)
        middle = 0.5 * (self._table[row, 0] + self._table[row + 1, 0])
        return float(np.abs(kernels.cubic(self._table, row, middle)[0] / np.asarray(self.force(middle)) - 1.0).max())

    @cached_property
    def _table(self) -> Vector:
        return kernel_table(self)

    def __setattr__(self, name: str, value: object) -> None:
        vars(self).pop("_table", None)
        super().__setattr__(name, value)


def check_contact_law(name: str, law: Any, what: str) -> ContactLaw:
    """Return `law`; raise a ValueError if it is not a hashable law, or if its piece contradicts it."""
    if not isinstance(law, ContactLaw) or not isinstance(law, Hashable):
        raise ValueError(f"{name} = {short(law)}: must be {what}, and hashable, like a frozen dataclass")
    if law.piece is not None:
        piece: Any = law.piece
        alone, members = filled(piece, [law]), {"force": law.force, "slope": law.tangent, "energy": law.energy}
        for member, of_law in members.items():
            for approach in (1e-7, 1e-6, 1e-5, 0.0, -1e-6):
                expected = float(of_law(np.array([approach]))[0]) if approach > 0.0 else 0.0
                answer = getattr(piece, member)(alone, 0, approach)
                if not abs(answer - expected) <= (1e-6 if member == "force" else 1e-3) * abs(expected):
                    place = f"{name}: {piece.__name__}.{member} at {approach:.3g} m"
                    raise ValueError(f"{place} = {answer:.6g}: must be {expected:.6g}")
    return law


def filled(piece: Any, laws: Sequence[ContactLaw | None]) -> Any:
    """Return a piece whose fields hold the laws' numbers, one for each contact; zero without a law."""
    return piece(*(np.array([getattr(law, name) if law else 0.0 for law in laws]) for name in piece._fields))


def unchanging(law: ContactLaw) -> ContactLaw:
    """Return a law that is a frozen dataclass, or a copy of any other law, which the user may change later."""
    if is_dataclass(law) and type(law).__dataclass_params__.frozen:  # type: ignore[attr-defined]
        return law
    copied = deepcopy(law)
    vars(copied).pop("_table", None)
    return copied


@described
class PowerLaw(ContactLaw):
    """The law F = k δⁿ; Hertz's law has n = 3/2 (Khatri's thesis, equation 5.9).

    Parameters
    ----------
    stiffness, exponent : float
        k, N/mⁿ, and n, from 1 to 10.
    largest, name, caution : float, str, str
        As in `ContactLaw`.

    Examples
    --------
    >>> round(float(hl.laws.PowerLaw(stiffness=1e10).force(1e-5)), 1)  # N
    316.2
    """

    stiffness: Annotated[float, Quantity("N/m^n", written="")]
    exponent: Annotated[float, Quantity(low=1.0, high=10.0)] = 1.5
    largest: Length = inf
    name: str = "power law"
    caution: Caution = ""

    def force(self, approach: Vector) -> Vector:
        return self.stiffness * np.maximum(approach, 0.0) ** self.exponent

    def tangent(self, approach: Vector) -> Vector:
        return self.stiffness * self.exponent * np.maximum(approach, 0.0) ** (self.exponent - 1.0)

    @property
    def kernel(self) -> tuple[float, Vector | None]:
        return self.stiffness, None if self.exponent == 1.5 else _unit_law(1.0, self.exponent)._table

    def energy(self, approach: Vector) -> Vector:
        return self.force(approach) * np.maximum(approach, 0.0) / (self.exponent + 1.0)

    def approach(self, force: Vector) -> Vector:
        return (np.maximum(force, 0.0) / self.stiffness) ** (1.0 / self.exponent)

    def overlap(self, energy: Vector) -> Vector:
        n = self.exponent
        return ((n + 1.0) * np.asarray(energy) / self.stiffness) ** (1.0 / (n + 1.0))


_unit_law = lru_cache(maxsize=256)(PowerLaw)  # keeps the table of each exponent


@described
class TabulatedLaw(ContactLaw):
    """A law through points: monotone cubics of ln F over ln δ between them, power laws outside.

    Parameters
    ----------
    approaches, forces : sequence of float
        Approaches, m, and as many forces, N; both increase.
    name, caution, largest : str, str, float
        As in `ContactLaw`; the default of `largest` is the last point.

    Examples
    --------
    >>> law = hl.laws.TabulatedLaw([1e-6, 1e-5, 2e-5], [10.0, 316.2, 894.0], name="measured")
    """

    approaches: Sequence[Coordinate]
    forces: Sequence[Force]
    name: str = "tabulated law"
    caution: Caution = ""
    largest: Length = inf

    def __post_init__(self) -> None:
        approaches, forces = (
            each(finite, name, np.array(listed(name, getattr(self, name), object, "numbers")), unit)
            for name, unit in (("approaches", "m"), ("forces", "N"))
        )
        if approaches[0] == forces[0] == 0.0:
            approaches, forces = approaches[1:], forces[1:]
        many = approaches.size == forces.size >= 2
        if not many or min(approaches[0], forces[0], *np.diff(approaches), *np.diff(forces)) <= 0.0:
            given = f"approaches = {short(self.approaches)}, forces"
            raise ValueError(f"{given}: must be equally many numbers that increase from zero")
        object.__setattr__(self, "approaches", tuple(approaches.tolist()))
        object.__setattr__(self, "forces", tuple(forces.tolist()))
        object.__setattr__(self, "largest", min(self.largest, self.approaches[-1]))

    def __repr__(self) -> str:
        extent = f"{len(self.approaches)} points up to {self.approaches[-1]:.4g} m and {self.forces[-1]:.4g} N"
        return f"{type(self).__name__}({self.name!r}, {extent})"

    def force(self, approach: Vector) -> Vector:
        return self._force_and_slope(approach)[0]

    def tangent(self, approach: Vector) -> Vector:
        force, slope = self._force_and_slope(approach)
        return force * slope / np.maximum(approach, 1e-300)

    def _force_and_slope(self, approach: Vector) -> tuple[Vector, Vector]:
        """Return the force and d ln F / d ln δ."""
        curve, (first, last), (below, above) = self._curve
        asked = np.log(np.maximum(approach, 1e-300))
        inside = np.clip(asked, first, last)
        slope = np.where(asked < first, below, np.where(asked > last, above, curve(inside, 1)))
        force = np.exp(curve(inside) + slope * (asked - inside))
        return np.where(np.asarray(approach) <= 0.0, 0.0, force), slope

    @cached_property
    def _curve(self) -> tuple[Any, tuple[float, float], tuple[float, float]]:
        """ln F over ln δ, its ends, and its slopes outside them; the slope before the first point is at least one."""
        from scipy.interpolate import PchipInterpolator

        x, y = np.log(self.approaches), np.log(self.forces)
        curve = PchipInterpolator(x, y)
        last = max(float(curve(x[-1], 1)), float((y[-1] - y[-2]) / (x[-1] - x[-2])))
        return curve, (x[0], x[-1]), (max(float(curve(x[0], 1)), 1.0), last)


def kernel_table(law: ContactLaw) -> Vector:
    """Return a law as rows (δ₀, F, F′, c₂, c₃, ∫F dδ) of Hermite cubics in δ − δ₀; the first is a line through 0."""
    from scipy.interpolate import CubicHermiteSpline

    edges = kernels.EDGES
    try:
        force, slope = (np.asarray(values, float) for values in (law.force(edges), law.tangent(edges)))
    except (TypeError, ValueError) as error:  # raised by math.sqrt or `if` with arrays
        raise ValueError(f"law: {type(law).__name__}.force: must take an array of approaches ({error})") from error
    rise = np.diff(force) / np.diff(edges) if force.shape == slope.shape == edges.shape else np.array([np.nan])
    if not isinstance(law, PowerLaw | TabulatedLaw):
        near = np.searchsorted(edges, 1e-6)  # a micrometre, where a law has a few newtons; at zero it has far less
        rises = np.isfinite(rise).all() and (rise > 0.0).all() and abs(force[0]) <= 1e-5 * abs(force[near])
        if not (rises and np.allclose(0.5 * (slope[1:] + slope[:-1]), rise, rtol=0.5)):
            name = type(law).__name__
            raise ValueError(f"law: {name}.force: must be finite and rise from zero; {name}.tangent must be its slope")
    curve = CubicHermiteSpline(edges[1:], force[1:], slope[1:])
    work = curve.antiderivative()(edges[1:-1]) + 0.5 * force[1] * edges[1]
    line = [0.0, 0.0, force[1] / edges[1], 0.0, 0.0, 0.0]
    rows = np.vstack([line, np.column_stack([edges[1:-1], *curve.c[::-1], work])])
    rows[-1, 3:5] = 0.0
    return rows


def inverse(increasing: Callable[[Vector], Vector], wanted: Vector) -> Vector:
    """Return the approaches at which an increasing function has these values, by dividing intervals of ln δ in 16."""
    if not (wanted > 0.0).any():
        return np.maximum(wanted, 0.0)  # NaN stays NaN
    asked, ends = wanted.reshape(-1), np.arange(1, 16)[:, None]
    low, part = np.full(asked.size, log(SMALLEST_APPROACH)), log(LARGEST_APPROACH / SMALLEST_APPROACH)
    for _ in range(15):
        part /= 16
        reached = np.reshape(increasing(np.exp(low + part * ends).reshape(-1)), (15, -1))
        low = low + part * (reached < asked).sum(axis=0)
    approach = np.exp(low + 0.5 * part).reshape(wanted.shape)
    return np.where(wanted > 0.0, approach, np.maximum(wanted, 0.0))
