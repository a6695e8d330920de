"""Additions to a plate, as data for any theory: masses, stiffeners, weakened regions, prestress."""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, inf
from typing import Annotated

import numpy as np

from structures.checks import coordinates, short
from structures.described import described
from structures.quantities import Asks, Coordinate, Likely, Quantity
from structures.structure import Vector

Place = tuple[Coordinate, Coordinate]
Sides = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate], Asks("left, right, bottom and top of the region")
]
Stiffness = Annotated[float, replace(Likely.BENDING, or_zero=True)]
ForcePerLength = Annotated[float, replace(Likely.FORCE_PER_LENGTH, likely=(0.0, inf))]
ROUNDING = 1e-6  # An addition may extend beyond the plate by this fraction of the plate's size


@described
class PointMass:
    """A small body fixed to a plate, without rotary inertia.

    Parameters
    ----------
    x, y, mass : float
        Position on the plate, m, and mass, kg.

    Examples
    --------
    >>> hl.PointMass(0.1, 0.05, mass=2e-3)
    PointMass(x=0.1, y=0.05, mass=0.002)
    """

    x: Coordinate
    y: Coordinate
    mass: Annotated[float, Likely.MASS]


@described
class Stiffener:
    """A straight beam on a plate that bends and twists with it.

    Parameters
    ----------
    start, end : (float, float)
        The two ends (x, y), m.
    bending_stiffness, torsion_stiffness : float
        EI for bending out of the plate, about the plate's middle surface, and GJ, N m².
    mass_per_length : float
        Mass per length, kg/m. Rotary inertia is neglected.

    Examples
    --------
    >>> hl.Stiffener((0.0, 0.1), (0.3, 0.1), bending_stiffness=193.0).length
    0.3
    """

    start: Place
    end: Place
    bending_stiffness: Stiffness
    torsion_stiffness: Stiffness = 0.0
    mass_per_length: Annotated[float, replace(Likely.MASS_PER_LENGTH, or_zero=True)] = 0.0

    def __post_init__(self) -> None:
        for name in ("start", "end"):
            object.__setattr__(self, name, coordinates(name, getattr(self, name)))
        if self.length == 0.0:
            raise ValueError(f"end = {self.end!r}: must differ from the start")

    @property
    def length(self) -> float:
        """Length, m."""
        return hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])

    @property
    def along_x(self) -> bool:
        """True if it runs along x."""
        return self.start[1] == self.end[1]

    @property
    def along_y(self) -> bool:
        """True if it runs along y."""
        return self.start[0] == self.end[0]


@described
class Weakened:
    """A rectangle of a plate with a lower bending stiffness and the same mass, such as a delamination.

    Parameters
    ----------
    region : (float, float, float, float)
        Left, right, bottom and top, m.
    factor : float
        The remaining fraction of the plate's bending stiffness, 0 < factor ≤ 1. A delamination between parts of
        thickness a and b that slide on each other leaves (a³ + b³)/(a + b)³ in a homogeneous plate.

    Examples
    --------
    >>> hl.Weakened((0.10, 0.12, 0.05, 0.07), factor=0.25)
    Weakened(region=(0.1, 0.12, 0.05, 0.07), factor=0.25)
    """

    region: Sides
    factor: Annotated[float, Quantity(high=1.0)]

    def __post_init__(self) -> None:
        region = left, right, bottom, top = coordinates("region", self.region, ("left", "right", "bottom", "top"))
        if left >= right or bottom >= top:
            raise ValueError(f"region = {self.region!r}: must be (left, right, bottom, top), ascending, in m")
        object.__setattr__(self, "region", region)


@described
class Prestress:
    """Constant forces per length in the plane of a plate, for `additions` of a builder. Tension is positive.

    The forces act before the tap, stay constant during it, and add ½ ∫ N_ij w,i w,j to the energy (Timoshenko, Gere,
    Theory of Elastic Stability, 2nd ed., section 8.2). In a plate of thickness t, a stress σ has the force σ t.

    Parameters
    ----------
    xx, yy, xy : float
        Force per length along x and along y, and shear force per length, N/m.

    Examples
    --------
    >>> hl.Prestress(xx=20e6 * 1e-3)  # 20 MPa in 1 mm
    Prestress(xx=20000.0, yy=0.0, xy=0.0)
    """

    xx: ForcePerLength = 0.0
    yy: ForcePerLength = 0.0
    xy: ForcePerLength = 0.0

    def __post_init__(self) -> None:
        name = max(("xx", "yy", "xy"), key=lambda component: abs(getattr(self, component)))
        Likely.FORCE_PER_LENGTH.warn("Prestress", name, round(getattr(self, name), 6))  # without rounding errors

    @property
    def forces(self) -> Vector:
        """N_ij, 2 × 2, N/m."""
        return np.array([[self.xx, self.xy], [self.xy, self.yy]])


Addition = PointMass | Stiffener | Weakened | Prestress


def check_additions(additions: object, box: tuple[float, float, float, float], parallel: bool) -> tuple[Addition, ...]:
    """Return the additions to a plate as a tuple; a ValueError names the one that does not fit.

    box: least and greatest x, then y, of the plate, m. parallel: whether stiffeners must be parallel to a side.
    """
    if not isinstance(additions, Sequence) or not all(isinstance(addition, Addition) for addition in additions):
        kinds = "PointMass, Stiffener, Weakened and Prestress"
        raise ValueError(f"additions = {short(additions)}: must be a list of {kinds}")
    left, right, bottom, top = box
    spare = ROUNDING * max(right - left, top - bottom)
    for i, addition in enumerate(additions):
        name, (xs, ys) = f"additions[{i}] = {addition!r}", extent(addition)
        inside_x = all(left - spare <= x <= right + spare for x in xs)
        if not (inside_x and all(bottom - spare <= y <= top + spare for y in ys)):
            raise ValueError(
                f"{name}: must lie on the plate, x {left:.4g} to {right:.4g}, y {bottom:.4g} to {top:.4g} m"
            )
        if isinstance(addition, Stiffener) and parallel and not (addition.along_x or addition.along_y):
            raise ValueError(f"{name}: must be parallel to a side, or in a mindlin_plate")
        for other in additions[:i]:
            if isinstance(addition, Weakened) and isinstance(other, Weakened):
                (l1, r1, b1, t1), (l2, r2, b2, t2) = addition.region, other.region
                if max(l1, l2) < min(r1, r2) and max(b1, b2) < min(t1, t2):
                    raise ValueError(f"{name}: must not overlap an earlier region")
    return tuple(additions)


def forces_in_plane(additions: Sequence[Addition]) -> Vector:
    """Return the sum of all prestress, N_ij, 2 × 2, N/m."""
    return sum((addition.forces for addition in additions if isinstance(addition, Prestress)), start=np.zeros((2, 2)))


def extent(addition: Addition) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the x and the y, m, at which an addition begins and ends; nothing for a prestress."""
    if isinstance(addition, Prestress):
        return (), ()
    if isinstance(addition, PointMass):
        return (addition.x,), (addition.y,)
    if isinstance(addition, Stiffener):
        return (addition.start[0], addition.end[0]), (addition.start[1], addition.end[1])
    return addition.region[:2], addition.region[2:]
