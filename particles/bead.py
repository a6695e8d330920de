"""The bodies of a chain: each has a mass, a size along the chain, and a surface where it touches its neighbours.

A new shape is a class like those below: `@described`, its dimensions as fields, and the three properties of a Bead. It
is drawn as an ellipse, `size` long.
"""

from dataclasses import fields, is_dataclass
from math import pi, sqrt
from typing import Annotated, Any, Protocol

import numpy as np

from structures.checks import instance, not_negative, positive, short
from structures.described import described
from structures.material import Material
from structures.quantities import Angle, Likely, OneOf
from structures.surface import Surface

STANDARD_GRAVITY = 9.81
"""m/s², as in the thesis."""

BeadLength = Annotated[float, Likely.BEAD]


class Bead(Protocol):
    """A body of a chain. Any object with these three attributes is one; no base class is needed.

    A body whose wall bends also has `shell_flexibility`, m/N, a linear compliance in series with Hertz's contact. A
    class that is a frozen dataclass is written to results field by field.

    Attributes
    ----------
    mass : float
        Mass, kg.
    size : float
        Extent along the chain, m.
    surface : Surface
        Material and curvatures at both of its contacts.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> ball = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> drilled = SimpleNamespace(mass=3e-3, size=ball.size, surface=ball.surface)
    >>> hl.Chain([drilled] * 10, striker=ball, impact_speed=0.4)
    Chain(10 SimpleNamespace, struck by Sphere at 0.4 m/s)
    """

    @property
    def mass(self) -> float: ...

    @property
    def size(self) -> float: ...

    @property
    def surface(self) -> Surface: ...


class _Ball(Bead):
    """What solid and hollow spheres share."""

    radius: float
    material: Material

    @property
    def size(self) -> float:
        return 2.0 * self.radius

    @property
    def surface(self) -> Surface:
        return Surface(self.material, 1.0 / self.radius)


@described
class Sphere(_Ball):
    """A solid sphere.

    Parameters
    ----------
    radius : float
        Radius, m.
    material : Material
        Elastic constants and density.

    Examples
    --------
    >>> round(hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C).mass * 1e3, 2)  # g
    3.52
    """

    radius: BeadLength
    material: Material

    @property
    def mass(self) -> float:
        return 4.0 / 3.0 * pi * self.radius**3 * self.material.density


@described
class HollowSphere(_Ball):
    """A spherical shell (Khatri's thesis, section 5.3.3; the wall: Reissner, J. Math. Phys. 25 (1946) 279).

    Parameters
    ----------
    radius, inner_radius : float
        Outer radius, m, and inner one, which is less.
    material : Material
        As in `Sphere`.

    Examples
    --------
    >>> shell = hl.HollowSphere(radius=9.525e-3, inner_radius=8.655e-3, material=hl.STEEL_316)
    >>> round(shell.mass * 1e3, 2), round(shell.shell_flexibility * 1e9, 1)  # g, nm/N
    (7.23, 25.6)
    """

    radius: BeadLength
    inner_radius: BeadLength
    material: Material

    def __post_init__(self) -> None:
        if self.inner_radius >= self.radius:
            raise ValueError(f"inner_radius = {self.inner_radius!r}: must be less than the radius, {self.radius!r} m")

    @property
    def mass(self) -> float:
        return 4.0 / 3.0 * pi * (self.radius**3 - self.inner_radius**3) * self.material.density

    @property
    def shell_flexibility(self) -> float:
        """Compliance of the wall to a point force, m/N, beside the contact's own: √(3(1 − ν²)) R/(4 E h²).

        h is the wall, R its mean radius. The value without a cavity is subtracted, so that the limit is a solid sphere.
        """
        wall, mean = self.radius - self.inner_radius, 0.5 * (self.radius + self.inner_radius)
        shape = mean / wall**2 - 0.5 / self.radius
        material = self.material
        return sqrt(3.0 * (1.0 - material.poisson_ratio**2)) / (4.0 * material.youngs_modulus) * shape


@described
class Ellipsoid(Bead):
    """A solid ellipsoid of revolution (Khatri's thesis, section 5.3.1).

    Parameters
    ----------
    radius, length : float
        Radius of its round section, and length of its axis of revolution, m.
    material : Material
        As in `Sphere`.
    axis : str
        Direction of its axis of revolution: "across" the chain or "along" it.
    angle : float
        Direction of an axis across the chain, rad, about the chain's axis.

    Examples
    --------
    >>> hl.Ellipsoid(radius=4.76e-3, length=15e-3, material=hl.STEEL_316, axis="along").size
    0.015
    """

    radius: BeadLength
    length: BeadLength
    material: Material
    axis: Annotated[str, OneOf("across", "along")] = "across"
    angle: Angle = 0.0

    @property
    def mass(self) -> float:
        return 2.0 / 3.0 * pi * self.radius**2 * self.length * self.material.density

    @property
    def size(self) -> float:
        return self.length if self.axis == "along" else 2.0 * self.radius

    @property
    def surface(self) -> Surface:
        """That of the pole if the axis lies along the chain, of the equator if across."""
        half = self.length / 2.0
        if self.axis == "along":
            return Surface(self.material, half / self.radius**2)
        return Surface(self.material, self.radius / half**2, 1.0 / self.radius, self.angle)


@described
class Cylinder(Bead):
    """A solid cylinder that lies across the chain (Khatri's thesis, section 5.3.2).

    Parameters
    ----------
    radius, length : float
        Radius and length, m.
    material, angle : Material, float
        As in `Ellipsoid`.

    Examples
    --------
    >>> lying = hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316)
    >>> hl.contact_law(lying, lying).name
    'line contact of parallel cylinders'
    """

    radius: BeadLength
    length: BeadLength
    material: Material
    angle: Angle = 0.0

    @property
    def mass(self) -> float:
        return pi * self.radius**2 * self.length * self.material.density

    @property
    def size(self) -> float:
        return 2.0 * self.radius

    @property
    def surface(self) -> Surface:
        return Surface(self.material, 0.0, 1.0 / self.radius, self.angle)


SHAPES = (Sphere, HollowSphere, Ellipsoid, Cylinder)
"""The bodies defined here: frozen, hashable, and with checked dimensions."""

ATTRIBUTES = ("mass", "size", "surface")
"""What makes an object a bead."""


def check_bead(name: str, body: Any, what: str = "a bead, such as a Sphere") -> Bead:
    """Return `body`, or raise a ValueError that names what it lacks to be a Bead."""
    if isinstance(body, SHAPES):
        return body
    if isinstance(body, type) or not all(hasattr(body, attribute) for attribute in ATTRIBUTES):
        raise ValueError(f"{name} = {short(body)}: must be {what}, with {', '.join(ATTRIBUTES)}")
    positive(f"{name}: mass", body.mass, "kg")
    positive(f"{name}: size", body.size, "m")
    instance(f"{name}: surface", body.surface, Surface, "a Surface(material, curvature)")
    not_negative(f"{name}: shell_flexibility", getattr(body, "shell_flexibility", 0.0), "m/N")
    Likely.BEAD_SIZE.warn(type(body).__name__, "size", body.size)
    Likely.BULK.warn(type(body).__name__, "mass / size³", body.mass / body.size**3)
    return body  # type: ignore[no-any-return]


def surface_of(body: Bead | Surface) -> Surface:
    """Return the surface of a body; a Surface itself."""
    return body if isinstance(body, Surface) else body.surface


def contact_modulus(first: Surface, second: Surface) -> float:
    """Return E* of two surfaces, 1/E* = Σ(1 − ν²)/E, Pa."""
    return 1.0 / (1.0 / first.material.contact_modulus + 1.0 / second.material.contact_modulus)


def plain_data(thing: Any) -> Any:
    """Return what describes an object in a result: its class and fields, or variables; else the object itself."""
    kind: Any = type(thing)
    if isinstance(thing, np.ndarray | np.generic):
        return thing.tolist()
    is_bead = all(hasattr(thing, attribute) for attribute in ATTRIBUTES)
    if is_dataclass(thing) and not isinstance(thing, type):
        members = {field.name: plain_data(getattr(thing, field.name)) for field in fields(thing)}
    elif is_bead:
        members = {}
    elif (callable(thing) and kind.__repr__ is not object.__repr__) or not hasattr(thing, "__dict__"):
        return thing  # functions speak for themselves
    else:
        # The variables of a variable may lead back to the object.
        flat = {name: value for name, value in vars(thing).items() if name != "_table"}
        deep = np.ndarray | np.generic
        members = {k: plain_data(v) if is_dataclass(v) or isinstance(v, deep) else v for k, v in flat.items()}
    if is_bead and kind not in SHAPES:  # it is drawn by its size
        members |= {name: plain_data(getattr(thing, name)) for name in ATTRIBUTES}
    # Several losses, and several bodies, have fields of the same names.
    return members if isinstance(thing, Material | Surface) else {"class": kind.__qualname__} | members


@described
def drop_speed(height: Annotated[float, Likely.HEIGHT]) -> float:
    """Speed of a striker after a free fall, √(2gh) with g = 9.81 m/s².

    Parameters
    ----------
    height : float
        Height of the fall, m.

    Returns
    -------
    float
        Speed, m/s.

    Examples
    --------
    >>> round(hl.drop_speed(0.01), 3)
    0.443
    """
    return sqrt(2.0 * STANDARD_GRAVITY * height)
