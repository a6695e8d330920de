"""The bodies of a chain. A new shape is a class like those below, with the three properties of a Bead."""

from dataclasses import fields, is_dataclass
from math import pi, sqrt
from typing import Annotated, Any, Protocol

import numpy as np

from structures.checks import instance, not_negative, positive, short
from structures.described import described
from structures.material import Material
from structures.quantities import Angle, Likely, OneOf
from structures.surface import Surface

BeadLength = Annotated[float, Likely.BEAD]


class Bead(Protocol):
    """A body of a chain: any object with these three attributes. A shell also has `shell_flexibility`.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> bead = SimpleNamespace(mass=3e-3, size=9.5e-3, surface=hl.Surface(hl.STEEL_316, curvature=210.0))
    """

    @property
    def mass(self) -> float:
        """Mass, kg."""

    @property
    def size(self) -> float:
        """Extent along the chain, m."""

    @property
    def surface(self) -> Surface:
        """Material and curvatures at both contacts."""


class _Round(Bead):
    """The common properties of spheres and lying cylinders."""

    radius: float
    material: Material

    @property
    def size(self) -> float:
        return 2.0 * self.radius

    @property
    def surface(self) -> Surface:
        return Surface(self.material, 1.0 / self.radius)


@described
class Sphere(_Round):
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
class HollowSphere(_Round):
    """A spherical shell (Khatri's thesis, section 5.3.3; the wall: Reissner, J. Math. Phys. 25 (1946) 279).

    Parameters
    ----------
    radius, inner_radius : float
        Outer and inner radius, m.
    material : Material
        As in `Sphere`.

    Examples
    --------
    >>> round(hl.HollowSphere(9.525e-3, 8.655e-3, hl.STEEL_316).shell_flexibility * 1e9, 1)  # nm/N
    25.6
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
        """Compliance of the wall, m/N: √(3(1 − ν²)) R/(4 E h²), with the mean radius R and the wall thickness h. The
        same formula for a sphere without a cavity is subtracted.
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
        Radius of the circular cross-section, and length of the axis of revolution, m.
    material : Material
        As in `Sphere`.
    axis : str
        Direction of the axis of revolution: "across" the chain or "along" it.
    angle : float
        Angle of an axis across the chain, about the chain's axis, rad.

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
        """The surface at the pole if the axis lies along the chain, else at the equator."""
        half = self.length / 2.0
        if self.axis == "along":
            return Surface(self.material, half / self.radius**2)
        return Surface(self.material, self.radius / half**2, 1.0 / self.radius, self.angle)


@described
class Cylinder(_Round):
    """A solid cylinder that lies across the chain (Khatri's thesis, section 5.3.2).

    Parameters
    ----------
    radius, length : float
        Radius and length, m.
    material, angle : Material, float
        As in `Ellipsoid`.

    Examples
    --------
    >>> hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316).size
    0.00476
    """

    radius: BeadLength
    length: BeadLength
    material: Material
    angle: Angle = 0.0

    @property
    def mass(self) -> float:
        return pi * self.radius**2 * self.length * self.material.density

    @property
    def surface(self) -> Surface:
        return Surface(self.material, 0.0, 1.0 / self.radius, self.angle)


# The bodies defined here are frozen and hashable, and their dimensions are checked.
SHAPES = (Sphere, HollowSphere, Ellipsoid, Cylinder)
ATTRIBUTES = ("mass", "size", "surface")  # the attributes of a bead


def check_bead(name: str, body: Any, what: str = "a bead, such as a Sphere") -> Bead:
    """Return `body`; raise a ValueError if it is not a Bead."""
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
    """Return the surface of a body, or the given Surface."""
    return body if isinstance(body, Surface) else body.surface


def contact_modulus(first: Surface, second: Surface) -> float:
    """Return E* of two surfaces, Pa: 1/E* = Σ(1 − ν²)/E."""
    return 1.0 / (1.0 / first.material.contact_modulus + 1.0 / second.material.contact_modulus)


def plain_data(thing: Any) -> Any:
    """Return the description of an object in a result: its class with fields or variables, or the object itself."""
    kind: Any = type(thing)
    if isinstance(thing, np.ndarray | np.generic):
        return thing.tolist()
    is_bead = all(hasattr(thing, attribute) for attribute in ATTRIBUTES)
    if is_dataclass(thing) and not isinstance(thing, type):
        members = {field.name: plain_data(getattr(thing, field.name)) for field in fields(thing)}
    elif is_bead:
        members = {}
    elif (callable(thing) and kind.__repr__ is not object.__repr__) or not hasattr(thing, "__dict__"):
        return thing  # the repr() of a function describes it
    else:
        # Variables are not followed further, because they may lead back to the object.
        flat = {name: value for name, value in vars(thing).items() if name != "_table"}
        deep = np.ndarray | np.generic
        members = {k: plain_data(v) if is_dataclass(v) or isinstance(v, deep) else v for k, v in flat.items()}
    if is_bead and kind not in SHAPES:
        members |= {name: plain_data(getattr(thing, name)) for name in ATTRIBUTES}
    elif is_bead and thing.size != 2.0 * members.get("radius", 0.0):  # its size is needed to draw it
        members["size"] = thing.size
    # The class is needed, because different losses, and different bodies, have fields of the same names.
    return members if isinstance(thing, Material | Surface) else {"class": kind.__qualname__} | members


@described
def drop_speed(height: Annotated[float, Likely.HEIGHT]) -> float:
    """Speed of a striker after a free fall: √(2gh) with g = 9.81 m/s².

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
    >>> speed = hl.drop_speed(height=0.01)
    """
    return sqrt(2.0 * 9.81 * height)  # 9.81 m/s² as in the thesis
