"""Excitations of a chain: a striker, a first bead with a speed, a spring, a force history, or a motion."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Annotated, Any

import numpy as np

from particles.bead import Bead, check_bead
from particles.kernels.drives import FREE, MOVED, PUSHED, STEADY
from structures.checks import finite, listed, short
from structures.described import described
from structures.quantities import Coordinate, Force, Likely, Moment
from structures.surface import Surface

STILL = 1e-2  # m/s, the scale of speeds in a chain at rest


@dataclass(frozen=True, eq=False)
class Drive:
    """An excitation in the form for the compiled loops."""

    kind: int  # FREE, PUSHED, MOVED or STEADY of `particles.kernels.drives`
    history: Any = ((0.0,),) * 3  # 3 × n: times from 0 s, values (N or m) and rates
    spring: float = 0.0  # N/m; the spring pushes body 0 until its compression `left`, m, is used up
    left: float = 0.0

    def __post_init__(self) -> None:
        history = np.array(self.history, dtype=float)
        right = history.ndim == 2 and len(history) == 3 and history.size > 0 and np.isfinite(history).all()
        rising = right and history[0, 0] == 0.0 and np.all(np.diff(history[0]) > 0.0)
        if self.kind not in (FREE, PUSHED, MOVED, STEADY) or not rising:
            given = f"Drive({self.kind!r}, {short(self.history)})"
            raise ValueError(f"{given}: must have a valid kind, and a history of 3 × n numbers")
        object.__setattr__(self, "history", history)


class Excitation(ABC):
    """The cause of a chain's motion. A subclass for an excitation of your own defines `drive` and `energy`.

    Examples
    --------
    >>> isinstance(hl.Piston(), hl.Excitation)
    True
    """

    body: Bead | None = None  # a striker that moves freely, body 0 of the results

    @property
    @abstractmethod
    def drive(self) -> Drive:
        """The excitation in the form for the compiled loops."""

    @abstractmethod
    def energy(self, mass: float, gravity: float) -> float:
        """Return the energy, J, from the first bead's mass (kg) and gravity along the chain (m/s²)."""

    def speed(self, gravity: float) -> float:
        """Return the speed of the striker, or else of the first bead, at time zero, m/s."""
        return 0.0

    def faces(self, bead: Bead) -> Surface | None:
        """Return the surface that the first bead touches without a striker; None if a force acts on it instead."""
        return None


@dataclass(frozen=True)
class Impact(Excitation):
    """A bead that arrives at a speed, m/s. Without a bead, the first bead starts at that speed, which may be zero."""

    body: Bead | None = None
    impact_speed: float = 0.0

    @property
    def drive(self) -> Drive:
        return Drive(STEADY if self.body is None else FREE)

    def speed(self, gravity: float) -> float:
        return self.impact_speed

    def energy(self, mass: float, gravity: float) -> float:
        return 0.5 * (self.body.mass if self.body else mass) * (self.impact_speed or STILL) ** 2


@described
class SpringLoaded(Excitation):
    """A striker that a massless spring shoots at the first bead (Khatri's thesis, section 6.3).

    Parameters
    ----------
    striker : Bead
        The striker, body 0 of the results. Time zero is its first contact.
    stiffness, compression : float
        The spring's stiffness, N/m, and its compression when it is released, m.
    travel : float, optional
        Distance from the striker to the first bead, m; by default the compression. If it is longer, the striker flies.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> round(hl.SpringLoaded(bead, stiffness=200.0, compression=2e-3).speed(gravity=0.0), 3)  # m/s
    0.476
    """

    striker: Bead
    stiffness: Annotated[float, Likely.SPRING]
    compression: Annotated[float, Likely.WAY]
    travel: Annotated[float, Likely.WAY] | None = None

    def __post_init__(self) -> None:
        check_bead("striker", self.striker)
        if self.travel is None:
            object.__setattr__(self, "travel", self.compression)

    @property
    def body(self) -> Bead:  # type: ignore[override]
        return self.striker

    @property
    def drive(self) -> Drive:
        return Drive(FREE, spring=self.stiffness, left=max(self.compression - float(self.travel or 0.0), 0.0))

    def speed(self, gravity: float) -> float:
        spring = self.stiffness * (self.compression**2 - self.drive.left**2) / self.striker.mass
        square = spring + 2.0 * gravity * float(self.travel or 0.0)
        if square <= 0.0:
            raise ValueError(f"stiffness = {self.stiffness!r}: must be larger, as the striker does not reach the chain")
        return sqrt(square)

    def energy(self, mass: float, gravity: float) -> float:
        return 0.5 * self.striker.mass * self.speed(gravity) ** 2 + 0.5 * self.stiffness * self.drive.left**2


class _History(Excitation):
    """Values over time, interpolated by monotone cubics. A subclass names its values and their unit."""

    time: Sequence[float]
    kind: int
    values: str
    unit: str

    def __post_init__(self) -> None:
        for name, unit in (("time", "s"), (self.values, self.unit)):
            numbers = listed(name, getattr(self, name), object, "two numbers or more")
            object.__setattr__(self, name, tuple(finite(name, number, unit) for number in numbers))
        steps, values = np.diff(self.time), getattr(self, self.values)
        if not steps.size or self.time[0] != 0.0 or steps.min() <= 0.0 or len(values) != len(self.time):
            raise ValueError(f"time = {short(self.time)}: must increase from 0 s, with one time for each {self.values}")
        Likely.TIME.warn(type(self).__name__, "time[-1]", self.time[-1])

    def __repr__(self) -> str:
        largest = max(map(abs, getattr(self, self.values)))
        return f"{type(self).__name__}({len(self.time)} points up to {self.time[-1]:.4g} s, {largest:.4g} {self.unit})"

    @property
    def drive(self) -> Drive:
        from scipy.interpolate import PchipInterpolator

        values = getattr(self, self.values)
        return Drive(self.kind, (self.time, values, PchipInterpolator(self.time, values)(self.time, 1)))


@described
class PushedBead(_History):
    """A force history on the first bead instead of a striker; contact 1 of the results is this force.

    Parameters
    ----------
    time, force : sequence of float
        Times from zero, s, and as many forces, N. Monotone cubics interpolate them, and the last force remains.

    Examples
    --------
    >>> push = hl.PushedBead(time=[0.0, 20e-6, 40e-6], force=[0.0, 50.0, 0.0])
    """

    time: Sequence[Moment]
    force: Sequence[Force]
    kind, values, unit = PUSHED, "force", "N"

    def energy(self, mass: float, gravity: float) -> float:
        """Return the energy of the first bead with the impulse of the history."""
        times, values, _ = self.drive.history
        impulse = float(np.sum(0.5 * np.abs(values[1:] + values[:-1]) * np.diff(times)))
        impulse = impulse or float(np.abs(values).max() * times[-1])
        return 0.5 * impulse * impulse / mass


@described
class Piston(_History):
    """A rigid piston behind the first bead; at rest it holds a preloaded chain.

    Parameters
    ----------
    time, displacement : sequence of float
        Times, s, and displacements towards the chain, m, both from zero, as in `PushedBead`.
    surface : Surface, optional
        Surface of the piston; by default a plane of the first bead's material.

    Examples
    --------
    >>> piston = hl.Piston([0.0, 20e-6], [0.0, 5e-6])
    """

    time: Sequence[Moment] = (0.0, 1.0)
    displacement: Sequence[Coordinate] = (0.0, 0.0)
    surface: Surface | None = None
    kind, values, unit = MOVED, "displacement", "m"

    def __post_init__(self) -> None:
        super().__post_init__()
        Likely.WAY.warn("Piston", "max |displacement|", max(map(abs, self.displacement)))
        if self.displacement[0] != 0.0:
            raise ValueError(f"displacement[0] = {self.displacement[0]!r}: must be 0 m")

    def energy(self, mass: float, gravity: float) -> float:
        """Return the energy of the first bead at twice the greatest speed of the piston."""
        times, values, rates = self.drive.history
        fastest = float(max(np.abs(rates).max(), np.abs(np.diff(values) / np.diff(times)).max()))
        return 0.5 * mass * (2.0 * fastest if fastest > 0.0 else STILL) ** 2

    def faces(self, bead: Bead) -> Surface | None:
        return self.surface or Surface(bead.surface.material)
