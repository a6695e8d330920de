"""Additions to a plate: masses, stiffeners, weak regions, prestress. Data for any theory."""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, inf
from typing import Annotated

import numpy as np

from structures.caution import collected
from structures.checks import finite, instance, positive, several, short, within
from structures.described import described
from structures.material import Material
from structures.quantities import Asks, Coordinate, Likely, Quantity
from structures.structure import Vector

Place = tuple[Coordinate, Coordinate]
Sides = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate], Asks("left, right, bottom and top of the region")
]
Stiffness = Annotated[float, replace(Likely.BENDING, or_zero=True)]

ForcePerLength = Annotated[float, replace(Likely.FORCE_PER_LENGTH, likely=(0.0, inf))]


SAME = 1e-12
"""Regions that differ by this part of the plate's size are equal: rounding."""

ROUNDING = 1e-6
"""An addition may lie outside of the plate by this part of the plate's size."""


@described
class PointMass:
    """A small body fixed to a plate, without rotary inertia.

    Parameters
    ----------
    x, y : float
        Place on the plate, m.
    mass : float
        Mass, kg.

    Raises
    ------
    ValueError
        Where a number is not finite or the mass not positive.

    Examples
    --------
    >>> import hertzlink as hl
    >>> sensor = hl.PointMass(0.1, 0.05, mass=2e-3)
    >>> plate = hl.kirchhoff_plate(0.3, 0.2, 2e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"), additions=[sensor])
    >>> len(plate.additions)
    1
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
        Its two ends (x, y), m.
    bending_stiffness : float
        EI of bending out of the plate, about the plate's middle surface, N m².
    torsion_stiffness : float
        GJ, N m².
    mass_per_length : float
        Mass per length, kg/m; its rotary inertia is neglected.

    Raises
    ------
    ValueError
        Where the ends coincide, or a stiffness or the mass is negative.

    Examples
    --------
    >>> import hertzlink as hl
    >>> steel, height, breadth = hl.STEEL_316, 0.01, 0.003
    >>> rib = hl.Stiffener((0.0, 0.1), (0.3, 0.1), steel.youngs_modulus * breadth * height**3 / 3)
    >>> rib.length
    0.3
    """

    start: Place
    end: Place
    bending_stiffness: Stiffness
    torsion_stiffness: Stiffness = 0.0
    mass_per_length: Annotated[float, replace(Likely.MASS_PER_LENGTH, or_zero=True)] = 0.0

    def __post_init__(self) -> None:
        for name in ("start", "end"):
            object.__setattr__(self, name, _numbers(name, getattr(self, name), ("x", "y")))
        if self.length == 0.0:
            raise ValueError(f"end = {self.end!r}: must lie elsewhere than the start")

    @property
    def length(self) -> float:
        """m."""
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
        The part of the plate's bending stiffness that is left, 0 < factor ≤ 1. A delamination between parts of
        thickness a and b that slide on each other leaves (a³ + b³)/(a + b)³ of a homogeneous plate's.

    Raises
    ------
    ValueError
        Where the sides are not ascending, or the factor is out of its range.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.Weakened((0.10, 0.12, 0.05, 0.07), factor=0.25)
    Weakened(region=(0.1, 0.12, 0.05, 0.07), factor=0.25)
    """

    region: Sides
    factor: Annotated[float, Quantity()]

    def __post_init__(self) -> None:
        region = left, right, bottom, top = _numbers("region", self.region, ("left", "right", "bottom", "top"))
        if left >= right or bottom >= top:
            raise ValueError(f"region = {self.region!r}: must be (left, right, bottom, top), ascending, in m")
        object.__setattr__(self, "region", region)
        if self.factor > 1.0:
            raise ValueError(f"factor = {self.factor!r}: must be at most 1, what is left of the bending stiffness")


@described
class Prestress:
    """Constant forces per length in the plane of a plate, in `additions` of a builder. Tension is positive.

    The forces act before the tap, stay constant during it, and add ½ ∫ N_ij w,i w,j to the energy (Timoshenko, Gere,
    Theory of Elastic Stability, 2nd ed., section 8.2). On a plate of thickness t the stress σ is the force σ t.

    Parameters
    ----------
    xx, yy : float
        Force per length along x and along y, N/m.
    xy : float
        Shear force per length, N/m.

    Raises
    ------
    ValueError
        Where a number is not finite. A plate that buckles under the forces is refused where it is struck.

    Examples
    --------
    >>> import hertzlink as hl
    >>> tension = hl.Prestress(xx=20e6 * 1e-3)  # 20 MPa in 1 mm
    >>> sides = hl.Supports("clamped", "clamped", "clamped", "clamped")
    >>> plate = hl.kirchhoff_plate(0.2, 0.2, 1e-3, hl.ALUMINIUM_6061, sides, additions=[tension])
    >>> len(plate.additions)
    1
    """

    xx: ForcePerLength = 0.0
    yy: ForcePerLength = 0.0
    xy: ForcePerLength = 0.0

    def __post_init__(self) -> None:
        name = max(("xx", "yy", "xy"), key=lambda component: abs(getattr(self, component)))
        Likely.FORCE_PER_LENGTH.warn("Prestress", name, round(getattr(self, name), 6))  # no rest of rounding

    @property
    def forces(self) -> Vector:
        """N_ij, 2 × 2, N/m."""
        return np.array([[self.xx, self.xy], [self.xy, self.yy]])


Addition = PointMass | Stiffener | Weakened | Prestress


def check_additions(additions: object, box: tuple[float, float, float, float]) -> tuple[Addition, ...]:
    """Return the additions to a plate within a box (least and greatest x, then y, m) as a tuple; a ValueError names the
    one that does not fit."""
    if not isinstance(additions, Sequence) or isinstance(additions, str):
        raise ValueError(f"additions = {additions!r}: must be a list of PointMass, Stiffener, Weakened and Prestress")
    left, right, bottom, top = box
    spare = ROUNDING * max(right - left, top - bottom)
    for i, addition in enumerate(additions):
        name = f"additions[{i}] = {addition!r}"
        if not isinstance(addition, Addition):
            raise ValueError(f"{name}: must be a PointMass, a Stiffener, a Weakened or a Prestress")
        if isinstance(addition, Prestress):
            continue  # everywhere
        xs, ys = extent(addition)
        across = left - spare <= min(xs) and max(xs) <= right + spare
        if not (across and bottom - spare <= min(ys) and max(ys) <= top + spare):
            raise ValueError(
                f"{name}: must lie on the plate, between x = {left:.4g} and {right:.4g}, y = {bottom:.4g} and "
                f"{top:.4g} m"
            )
        for other in additions[:i]:
            if isinstance(addition, Weakened) and isinstance(other, Weakened):
                (l1, r1, b1, t1), (l2, r2, b2, t2) = addition.region, other.region
                if max(l1, l2) < min(r1, r2) and max(b1, b2) < min(t1, t2):
                    raise ValueError(
                        f"{name}: overlaps an earlier one; give regions side by side, each with its factor"
                    )
    return tuple(additions)


def weakest(additions: Sequence[Addition]) -> float:
    """Return the least factor of the bending stiffness anywhere."""
    return min((float(addition.factor) for addition in additions if isinstance(addition, Weakened)), default=1.0)


def forces_in_plane(additions: Sequence[Addition]) -> Vector:
    """Return the sum of all prestress, N_ij, 2 × 2, N/m."""
    return sum((addition.forces for addition in additions if isinstance(addition, Prestress)), start=np.zeros((2, 2)))


def halves_alike(additions: Sequence[Addition], sides: Sequence[float]) -> list[bool]:
    """Return whether additions are their own mirror images about the middles of a rectangle's sides, m: its left and
    right half, then its bottom and top half. Only weak regions and a prestress, which is everywhere, count as such."""
    weak = [(np.reshape(a.region, (2, 2)), a.factor) for a in additions if isinstance(a, Weakened)]
    known = all(isinstance(addition, Weakened | Prestress) for addition in additions)

    def has_image(region: Vector, factor: float, axis: int, side: float) -> bool:
        image = region.copy()
        image[axis] = side - region[axis, ::-1]
        return any(f == factor and abs(other - image).max() <= SAME * side for other, f in weak)

    return [known and all(has_image(*one, axis, side) for one in weak) for axis, side in enumerate(sides)]


def cell_lines(additions: Sequence[Addition]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return x and y, m, where regions end, and where stiffeners run that are parallel to an axis."""
    across: list[float] = []
    along: list[float] = []
    for addition in additions:
        if isinstance(addition, Weakened):
            across += addition.region[:2]
            along += addition.region[2:]
        elif isinstance(addition, Stiffener):
            across += [addition.start[0]] if addition.along_y else []
            along += [addition.start[1]] if addition.along_x else []
    return tuple(across), tuple(along)


def extent(addition: Addition) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the x and the y, m, at which an addition begins and ends; none for what is everywhere."""
    if isinstance(addition, Prestress):
        return (), ()
    if isinstance(addition, PointMass):
        return (addition.x,), (addition.y,)
    if isinstance(addition, Stiffener):
        return (addition.start[0], addition.end[0]), (addition.start[1], addition.end[1])
    return addition.region[:2], addition.region[2:]


def _numbers(name: str, values: object, names: Sequence[str]) -> tuple[float, ...]:
    """Return the values as a tuple of floats in m, as many as the names, or raise a ValueError."""
    items = list(values) if several(values) else []
    if len(items) != len(names):
        raise ValueError(f"{name} = {short(values)}: must be ({', '.join(names)}), in m")
    return tuple(finite(f"{name}[{i}]", value, "m") for i, value in enumerate(items))


def thermal_prestress(rise: float, expansion: float, thickness: float, material: Material) -> Prestress:
    """Return the prestress of a plate that is held in its plane all around and becomes warmer than it was when it was
    fixed.

    Parameters
    ----------
    rise : float
        Rise of the temperature ΔT, uniform through the thickness, K; negative where it falls.
    expansion : float
        Coefficient of thermal expansion α, 1/K: 23.6e-6 for aluminium 6061, 11.5e-6 for rail steel.
    thickness : float
        Thickness t, m.
    material : Material
        Its E and ν.

    Returns
    -------
    Prestress
        N = −E α ΔT t/(1 − ν) along x and y.

    Raises
    ------
    ValueError
        Where a number is not finite or out of its range.

    References
    ----------
    Boley, Weiner, Theory of Thermal Stresses, Wiley (1960), section 12.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.thermal_prestress(-1.0, 23.6e-6, 1e-3, hl.ALUMINIUM_6061).xx)
    2427
    """
    instance("material", material, Material, "a Material; MATERIALS[name] gives one by name")
    rise, expansion = finite("rise", rise, "K"), within("expansion", expansion, 1e-9, 1e-3, "1/K")
    Likely.PLY.warn("thermal_prestress", "thickness", positive("thickness", thickness, "m"))
    force = -material.youngs_modulus * thickness / (1.0 - material.poisson_ratio) * expansion * rise
    with collected():  # a small rise makes a small force
        return Prestress(force, force)
