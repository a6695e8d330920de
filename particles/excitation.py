"""What sets a chain in motion other than a free striker: a spring, a force history, a motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.interpolate import PchipInterpolator

from particles.bead import Bead
from structures.checks import finite, instance, positive
from structures.plausible import likely
from structures.structure import Vector
from structures.surface import Surface


@dataclass(frozen=True)
class SpringLoaded:
    """A striker that a compressed spring throws at the first bead (the actuator of the thesis's section 6.3).

    stiffness (N/m) and compression (m) of the spring when it is released; travel (m): the striker's way to the first
    bead, by default the compression. A longer way is free flight; after a shorter one the spring still pushes. It never
    pulls, and has no mass of its own; a striker that comes back meets it again. Time zero is the first contact.
    """

    striker: Bead
    stiffness: float
    compression: float
    travel: float | None = None

    def __post_init__(self) -> None:
        instance("striker", self.striker, Bead, "a bead, such as a Sphere")  # type: ignore[arg-type]
        object.__setattr__(self, "stiffness", positive("stiffness", self.stiffness, "N/m"))
        object.__setattr__(self, "compression", positive("compression", self.compression, "m"))
        travel = self.compression if self.travel is None else self.travel
        object.__setattr__(self, "travel", positive("travel", travel, "m"))
        likely("spring", "SpringLoaded", "stiffness", self.stiffness)
        likely("way", "SpringLoaded", "compression", self.compression)
        if self.travel != self.compression:
            likely("way", "SpringLoaded", "travel", self.travel or 0.0)

    @property
    def left(self) -> float:
        """What is left of the compression at the first contact, m."""
        return max(self.compression - float(self.travel or 0.0), 0.0)

    def speed(self, gravity: float) -> float:
        """The striker's speed at its first contact, m/s, from the energies of the spring and of gravity (m/s²)."""
        spring = self.stiffness * (self.compression**2 - self.left**2) / self.striker.mass
        square = spring + 2.0 * gravity * float(self.travel or 0.0)
        if square <= 0.0:
            raise ValueError(
                f"stiffness = {self.stiffness!r}: the spring is too weak for the striker to reach the chain"
            )
        return sqrt(square)


@dataclass(frozen=True)
class PushedBead:
    """A force history on the first bead in place of a striker.

    time (s, from zero, increasing) and force (N): monotone cubics run between the points, and the last force holds on.
    Contact 1 of the results is this force, or, with a structure behind the chain, the contact with that.
    """

    time: Sequence[float]
    force: Sequence[float]

    def __post_init__(self) -> None:
        _check_history(self, "force", "N")

    @property
    def history(self) -> tuple[Vector, Vector, Vector]:
        """Times, values and rates."""
        return _history(self.time, self.force)


@dataclass(frozen=True)
class Piston:
    """A rigid piston that moves as told and presses on the first bead; at rest it holds a preloaded chain in its place.

    time (s, from zero, increasing) and displacement (m, from zero, towards the chain): monotone cubics run between the
    points, and the last place is kept. surface: of the piston; by default a flat of the first bead's material.
    """

    time: Sequence[float] = (0.0, 1.0)
    displacement: Sequence[float] = (0.0, 0.0)
    surface: Surface | None = None

    def __post_init__(self) -> None:
        _check_history(self, "displacement", "m")
        if self.surface is not None:
            instance("surface", self.surface, Surface, "a Surface(material)")
        if self.displacement[0] != 0.0:
            raise ValueError(f"displacement: must start from 0 m, not {self.displacement[0]!r}")

    @property
    def history(self) -> tuple[Vector, Vector, Vector]:
        """Times, values and rates."""
        return _history(self.time, self.displacement)


Excitation = SpringLoaded | PushedBead | Piston


def _check_history(of: "PushedBead | Piston", name: str, unit: str) -> None:
    columns = {}
    for column, its_unit in (("time", "s"), (name, unit)):
        values = getattr(of, column)
        if not isinstance(values, Sequence | np.ndarray) or len(values) < 2:
            raise ValueError(f"{column}: must be a list of two numbers or more")
        columns[column] = tuple(finite(column, value, its_unit) for value in values)
        object.__setattr__(of, column, columns[column])
    if len(columns["time"]) != len(columns[name]):
        raise ValueError(f"{name}: {len(columns[name])} of them for {len(columns['time'])} times; must be as many")
    if columns["time"][0] != 0.0 or min(np.diff(columns["time"])) <= 0.0:
        raise ValueError("time: must increase from 0 s")
    likely("time", type(of).__name__, "time[-1]", columns["time"][-1])
    if unit == "m":
        likely("way", type(of).__name__, f"max |{name}|", max(map(abs, columns[name])))


def _history(time: Sequence[float], values: Sequence[float]) -> tuple[Vector, Vector, Vector]:
    curve = PchipInterpolator(time, values)
    return np.asarray(time, float), np.asarray(values, float), curve(time, 1)
