"""What sets a chain in motion: a free striker, a first bead with a speed, a spring, a force history, a motion.

A `Chain` turns each form of its `striker` into an Excitation, which answers all that the chain asks of it.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Annotated, NamedTuple

import numpy as np

from particles.bead import Bead, check_bead, likely_bead
from particles.kernels.drives import FREE, MOVED, PUSHED, STEADY
from structures.checks import finite, instance, not_negative, short
from structures.described import described
from structures.quantities import Coordinate, Force, Likely, Moment
from structures.structure import Vector
from structures.surface import Surface

STILL = 1e-2
"""m/s, the scale of speeds in a chain that is at rest."""

KINDS = {"FREE": FREE, "PUSHED": PUSHED, "MOVED": MOVED, "STEADY": STEADY}
"""What body 0 may be in the compiled loops."""


class Drive(NamedTuple):
    """An excitation as the compiled loops know it.

    kind: what body 0 is, one of FREE, PUSHED, MOVED and STEADY. history: 3 × n, times (s), values (N or m)
    and rates of the drive. spring (N/m) pushes body 0 until `left` (m) of its compression is gone.
    """

    kind: int
    history: Vector = np.zeros((3, 1))
    spring: float = 0.0
    left: float = 0.0


class Excitation(ABC):
    """What sets a chain in motion. Derive a class from it for an excitation of your own.

    A subclass defines `drive`, the form in which the compiled loops know it, and `energy`. The rest has defaults that
    fit a history of forces or motions.

    Attributes
    ----------
    body : Bead or None
        Body 0 of the results, a striker that moves freely; None where there is none.
    bears_preload : bool
        Whether the place of body 0 bears the chain's preload, which then needs no dead load.
    allows_structure_behind : bool
        Whether a structure may take the place of body 0.
    drive : Drive
        Kind of body 0, history and spring.
    duration : float
        Length of its history, s; zero where it has none.

    Examples
    --------
    A half-sine push on the first bead:

    >>> import hertzlink as hl
    >>> import numpy as np
    >>> class HalfSine(hl.PushedBead):
    ...     def __init__(self, peak, duration):
    ...         time = np.linspace(0.0, duration, 50)
    ...         super().__init__(time, peak * np.sin(np.pi * time / duration))
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 10, striker=HalfSine(50.0, 40e-6))
    >>> isinstance(chain.striker, hl.Excitation), round(chain.impact_energy * 1e6)  # µJ
    (True, 230)
    """

    body: Bead | None = None
    bears_preload: bool = False
    allows_structure_behind: bool = False
    duration: float = 0.0

    @property
    @abstractmethod
    def drive(self) -> Drive:
        """Its form in the compiled loops."""

    @abstractmethod
    def energy(self, mass: float, gravity: float) -> float:
        """Return the excitation's energy, J, from the first bead's mass (kg) and gravity along the chain (m/s²)."""

    def speed(self, gravity: float) -> float:
        """Return the speed at time zero, m/s, of the body, or of the first bead where there is none."""
        return 0.0

    def faces(self, bead: Bead) -> Surface | None:
        """Return what the first bead touches where there is no body; None where a force acts on it instead."""
        return None


@dataclass(frozen=True)
class FreeStriker(Excitation):
    """A bead that arrives at a speed, m/s."""

    striker: Bead
    impact_speed: float

    @property
    def body(self) -> Bead:  # type: ignore[override]
        """The striker."""
        return self.striker

    @property
    def drive(self) -> Drive:
        """A free body."""
        return Drive(FREE)

    def speed(self, gravity: float) -> float:
        """Return the impact speed, m/s."""
        return self.impact_speed

    def energy(self, mass: float, gravity: float) -> float:
        """Return its kinetic energy, J."""
        return 0.5 * self.striker.mass * self.impact_speed**2


@dataclass(frozen=True)
class FirstBeadMoves(Excitation):
    """No striker: the first bead starts at a speed, m/s, which may be zero."""

    impact_speed: float
    allows_structure_behind = True

    @property
    def drive(self) -> Drive:
        """None."""
        return Drive(STEADY)

    def speed(self, gravity: float) -> float:
        """Return the first bead's, m/s."""
        return self.impact_speed

    def energy(self, mass: float, gravity: float) -> float:
        """Return the first bead's kinetic energy, at rest ½ m (10 mm/s)², J."""
        return 0.5 * mass * (self.impact_speed or STILL) ** 2


@described
class SpringLoaded(Excitation):
    """A striker that a compressed spring throws at the first bead.

    A way longer than the compression ends in free flight; after a shorter one the spring still pushes. The spring never
    pulls, and has no mass; a striker that rebounds meets it again. Time zero is the first contact.

    Parameters
    ----------
    striker : Bead
        The body that is thrown, body 0 of the results.
    stiffness : float
        Stiffness of the spring, N/m.
    compression : float
        Compression of the spring when it is released, m.
    travel : float, optional
        Way of the striker to the first bead, m; by default the compression.

    Raises
    ------
    ValueError
        For numbers that are not positive; from a chain, where the spring is too weak to reach it.

    References
    ----------
    Khatri's thesis, section 6.3.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 10, striker=hl.SpringLoaded(bead, stiffness=200.0, compression=2e-3))
    >>> round(chain.speed, 3)  # m/s
    0.476
    """

    striker: Bead
    stiffness: Annotated[float, Likely.SPRING]
    compression: Annotated[float, Likely.WAY]
    travel: Annotated[float, Likely.WAY] | None = None

    def __post_init__(self) -> None:
        likely_bead(check_bead("striker", self.striker))
        if self.travel is None:
            object.__setattr__(self, "travel", self.compression)
        if not isfinite(self.stiffness * self.compression * self.compression):
            raise ValueError(f"compression = {self.compression!r}: must be smaller; the spring's energy is not finite")

    @property
    def body(self) -> Bead:  # type: ignore[override]
        """The striker."""
        return self.striker

    @property
    def drive(self) -> Drive:
        """A free body, and the spring behind it."""
        return Drive(FREE, spring=self.stiffness, left=self.left)

    @property
    def left(self) -> float:
        """Compression that is left at the first contact, m."""
        return max(self.compression - float(self.travel or 0.0), 0.0)

    def speed(self, gravity: float) -> float:
        """Return the striker's speed at its first contact, m/s, by the energies of spring and gravity (m/s²)."""
        spring = self.stiffness * (self.compression**2 - self.left**2) / self.striker.mass
        square = spring + 2.0 * gravity * float(self.travel or 0.0)
        if square <= 0.0:
            raise ValueError(
                f"stiffness = {self.stiffness!r}: the spring is too weak for the striker to reach the chain"
            )
        return sqrt(square)

    def energy(self, mass: float, gravity: float) -> float:
        """Return the striker's kinetic energy at time zero, and what is left in the spring, J."""
        return 0.5 * self.striker.mass * self.speed(gravity) ** 2 + 0.5 * self.stiffness * self.left**2


class _History(Excitation):
    """An excitation by a curve through points over time. A subclass names what its values are, and their unit."""

    time: Sequence[float]
    kind: int
    values: str
    unit: str

    def __post_init__(self) -> None:
        columns = {}
        for column, unit in (("time", "s"), (self.values, self.unit)):
            numbers = getattr(self, column)
            if not isinstance(numbers, Sequence | np.ndarray) or getattr(numbers, "ndim", 1) != 1 or len(numbers) < 2:
                raise ValueError(f"{column}: must be a list of two numbers or more")
            columns[column] = tuple(finite(column, number, unit) for number in numbers)
            object.__setattr__(self, column, columns[column])
        times, values = columns["time"], columns[self.values]
        if len(times) != len(values):
            raise ValueError(f"{self.values}: {len(values)} values for {len(times)} times; must be as many")
        if times[0] != 0.0 or min(np.diff(times)) <= 0.0:
            raise ValueError("time: must increase from 0 s")
        Likely.TIME.warn(type(self).__name__, "time[-1]", times[-1])

    @property
    def history(self) -> tuple[Vector, Vector, Vector]:
        """Times, values and rates, of monotone cubics."""
        from scipy.interpolate import PchipInterpolator

        values = getattr(self, self.values)
        rates = PchipInterpolator(self.time, values)(self.time, 1)
        return np.asarray(self.time, float), np.asarray(values, float), rates

    @property
    def duration(self) -> float:  # type: ignore[override]
        """The length of the history, s."""
        return self.time[-1]

    @property
    def drive(self) -> Drive:
        """The history."""
        return Drive(self.kind, np.array(self.history))


@described
class PushedBead(_History):
    """A force history on the first bead in place of a striker.

    Monotone cubics run between the points, and the last force stays. Contact 1 of the results is this force, or, with a
    structure behind the chain, the contact with that.

    Parameters
    ----------
    time : sequence of float
        Times, s, increasing from zero.
    force : sequence of float
        Forces, N, as many as times.

    Raises
    ------
    ValueError
        For times that do not increase from zero, and sequences of different lengths.

    Examples
    --------
    >>> import hertzlink as hl
    >>> push = hl.PushedBead(time=[0.0, 20e-6, 40e-6], force=[0.0, 50.0, 0.0])
    >>> push.duration
    4e-05
    """

    time: Sequence[Moment]
    force: Sequence[Force]
    allows_structure_behind = True
    kind, values, unit = PUSHED, "force", "N"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isfinite(self.energy(1.0, 0.0)):
            raise ValueError(f"force = {short(self.force)}: must be smaller; its work is not finite")

    def __repr__(self) -> str:
        return f"PushedBead({len(self.time)} points up to {self.time[-1]:.4g} s, {max(map(abs, self.force)):.4g} N)"

    def energy(self, mass: float, gravity: float) -> float:
        """Return ½ J²/m of the history's impulse J, J."""
        times, values, _ = self.history
        impulse = float(np.sum(0.5 * np.abs(values[1:] + values[:-1]) * np.diff(times)))
        impulse = impulse or float(np.abs(values).max() * times[-1])
        return 0.5 * impulse * impulse / mass


@described
class Piston(_History):
    """A rigid piston with a prescribed motion that presses on the first bead.

    At rest it holds a preloaded chain in its place. Monotone cubics run between the points, and the last place is kept.

    Parameters
    ----------
    time : sequence of float
        Times, s, increasing from zero.
    displacement : sequence of float
        Displacements towards the chain, m, from zero, as many as times.
    surface : Surface, optional
        Surface of the piston; by default a flat of the first bead's material.

    Raises
    ------
    ValueError
        For times that do not increase from zero, displacements that do not start at zero, and sequences of different
        lengths.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> hl.Chain([bead] * 10, striker=hl.Piston([0.0, 20e-6], [0.0, 5e-6])).speed
    0.0
    """

    time: Sequence[Moment] = (0.0, 1.0)
    displacement: Sequence[Coordinate] = (0.0, 0.0)
    surface: Surface | None = None
    bears_preload = True
    kind, values, unit = MOVED, "displacement", "m"

    def __post_init__(self) -> None:
        super().__post_init__()
        Likely.WAY.warn("Piston", "max |displacement|", max(map(abs, self.displacement)))
        if self.displacement[0] != 0.0:
            raise ValueError(f"displacement: must start from 0 m, not {self.displacement[0]!r}")

    def __repr__(self) -> str:
        stroke = f"{max(map(abs, self.displacement)):.4g} m"
        return f"Piston({len(self.time)} points up to {self.time[-1]:.4g} s, {stroke}, surface={self.surface!r})"

    def energy(self, mass: float, gravity: float) -> float:
        """Return that of the first bead at twice the greatest speed, J; for a piston at rest ½ m (10 mm/s)²."""
        times, values, rates = self.history
        fastest = float(max(np.abs(rates).max(), np.abs(np.diff(values) / np.diff(times)).max()))
        return 0.5 * mass * (2.0 * fastest if fastest > 0.0 else STILL) ** 2

    def faces(self, bead: Bead) -> Surface | None:
        """Return the piston's surface."""
        return self.surface or Surface(bead.surface.material)


def check_excitation(excitation: Excitation, bead: Bead, gravity: float) -> None:
    """Raise a ValueError where a member of a user's excitation of a chain is not as `Excitation` describes it."""
    if type(excitation) in (FreeStriker, FirstBeadMoves, SpringLoaded, PushedBead, Piston):
        return
    name = type(excitation).__name__
    if excitation.body is not None:
        check_bead(f"{name}.body", excitation.body, "a bead, or None")
    for flag in ("bears_preload", "allows_structure_behind"):
        instance(f"{name}.{flag}", getattr(excitation, flag), bool, "True or False")
    not_negative(f"{name}.duration", excitation.duration, "s")
    finite(f"{name}.speed(gravity)", excitation.speed(gravity), "m/s")
    not_negative(f"{name}.energy(mass, gravity)", excitation.energy(bead.mass, gravity), "J")
    faced = excitation.faces(bead)
    instance(f"{name}.faces(bead)", faced, Surface | None, "a Surface, or None")  # type: ignore[arg-type]
    drive = instance(f"{name}.drive", excitation.drive, Drive, "a Drive(kind, history)")
    _check_drive(f"{name}.drive", drive)
    if drive.kind == FREE and excitation.body is None:
        raise ValueError(f"{name}.body = None: must be a bead if the kind of drive is FREE")
    if drive.kind == MOVED and faced is None:
        raise ValueError(f"{name}.faces(bead) = None: must be a Surface, which the first bead touches, for MOVED")


def _check_drive(name: str, drive: Drive) -> None:
    if isinstance(drive.kind, bool) or drive.kind not in KINDS.values():
        raise ValueError(f"{name}.kind = {short(drive.kind)}: must be {', '.join(KINDS)} of particles.kernels.drives")
    history = np.asarray(drive.history)
    if history.dtype.kind not in "iuf" or history.ndim != 2 or len(history) != 3 or not history.size:
        raise ValueError(f"{name}.history = {short(drive.history)}: must be 3 × n numbers: times, values, rates")
    if not np.isfinite(history).all():
        raise ValueError(f"{name}.history = {short(drive.history)}: must hold finite numbers")
    if history[0, 0] != 0.0 or (np.diff(history[0]) <= 0.0).any():
        raise ValueError(f"{name}.history[0] = {short(history[0])}: must be times, s, that increase from 0")
    not_negative(f"{name}.spring", drive.spring, "N/m")
    not_negative(f"{name}.left", drive.left, "m")
