"""The bodies of a chain: each has a mass, a size along the chain, and a surface where it touches its neighbours."""

from dataclasses import fields, is_dataclass
from functools import cached_property
from math import pi, sqrt
from typing import Annotated, Any, Protocol

import numpy as np

from structures.checks import instance, listed, not_negative, positive, short
from structures.described import described
from structures.material import Material
from structures.quantities import Angle, Likely, OneOf
from structures.structure import Structure
from structures.surface import Surface
from structures.units import readable

STANDARD_GRAVITY = 9.81
"""m/s², as in the thesis."""

BeadLength = Annotated[float, Likely.BEAD]


class Bead(Protocol):
    """A body of a chain. Any object with these three attributes is one; no base class is needed.

    Two more attributes are read where a body has them. `shell_flexibility`, m/N, is the linear compliance of a wall,
    in series with Hertz's contact. A class that is a frozen dataclass is written to results field by field.

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
    A drilled ball has the surface of a ball, and less mass:

    >>> import hertzlink as hl
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class DrilledBall:
    ...     ball: hl.Sphere
    ...     drilled: float  # kg
    ...
    ...     @property
    ...     def mass(self):
    ...         return self.ball.mass - self.drilled
    ...
    ...     @property
    ...     def size(self):
    ...         return self.ball.size
    ...
    ...     @property
    ...     def surface(self):
    ...         return self.ball.surface
    >>> ball = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([DrilledBall(ball, 0.5e-3)] * 10, striker=ball, impact_speed=0.4)
    >>> hl.contact_law(chain.beads[0], ball).name
    'Hertz, round contact'
    """

    @property
    def mass(self) -> float:
        """Mass, kg."""

    @property
    def size(self) -> float:
        """Extent along the chain, m."""

    @property
    def surface(self) -> Surface:
        """Material and curvatures at its contacts."""


class _Round(Bead, Protocol):
    """A body that is round about an axis across the chain."""

    radius: float

    @property
    def size(self) -> float:
        """Extent along the chain, m."""
        return 2.0 * self.radius


@described
class Sphere(_Round):
    """A solid sphere.

    Parameters
    ----------
    radius : float
        Radius, m.
    material : Material
        Elastic constants and density.

    Raises
    ------
    ValueError
        For a radius that is not positive, or a material that is no Material.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C).mass * 1e3, 2)  # g
    3.52
    """

    radius: BeadLength
    material: Material

    @property
    def mass(self) -> float:
        """4/3 π R³ ρ, kg."""
        return 4.0 / 3.0 * pi * self.radius**3 * self.material.density

    @property
    def surface(self) -> Surface:
        """Material and curvature 1/R."""
        return Surface(self.material, 1.0 / self.radius)


@described
class HollowSphere(_Round):
    """A spherical shell.

    Parameters
    ----------
    radius : float
        Outer radius, m.
    inner_radius : float
        Inner radius, m, less than the outer one.
    material : Material
        Elastic constants and density.

    Raises
    ------
    ValueError
        For radii that are not positive, or an inner radius that is not less than the outer one.

    References
    ----------
    Khatri's thesis, section 5.3.3.

    Examples
    --------
    >>> import hertzlink as hl
    >>> shell = hl.HollowSphere(radius=9.525e-3, inner_radius=8.655e-3, material=hl.STEEL_316)
    >>> round(shell.mass * 1e3, 2), round(shell.shell_flexibility * 1e9, 1)  # g, nm/N
    (7.23, 25.6)
    """

    radius: BeadLength
    inner_radius: BeadLength
    material: Material

    def __post_init__(self) -> None:
        if self.inner_radius >= self.radius:
            outer = readable(self.radius, "m", 6)
            raise ValueError(f"inner_radius = {self.inner_radius!r}: must be less than the radius, {outer}")

    @property
    def mass(self) -> float:
        """4/3 π (R³ − Rᵢ³) ρ, kg."""
        return 4.0 / 3.0 * pi * (self.radius**3 - self.inner_radius**3) * self.material.density

    @property
    def surface(self) -> Surface:
        """Material and curvature 1/R; `contact_law` adds the compliance of the shell."""
        return Surface(self.material, 1.0 / self.radius)

    @property
    def shell_flexibility(self) -> float:
        """Compliance of the wall to a point force, m/N, in addition to the contact's own.

        √(3(1 − ν²)) R/(4 E h²) with the wall h and its mean radius R (Reissner, J. Math. Phys. 25 (1946) 279, for thin
        shells), less its value without a cavity, so that the limit is a solid sphere. With it F(δ) agrees with the
        thesis's Table 5.1 to 5 % from 1 to 20 µm, for all four walls.
        """
        wall, mean = self.radius - self.inner_radius, 0.5 * (self.radius + self.inner_radius)
        shape = mean / wall**2 - 0.5 / self.radius
        material = self.material
        return sqrt(3.0 * (1.0 - material.poisson_ratio**2)) / (4.0 * material.youngs_modulus) * shape


@described
class Ellipsoid(Bead):
    """A solid ellipsoid of revolution.

    Parameters
    ----------
    radius : float
        Radius of its round section, m.
    length : float
        Length of its axis of revolution, m.
    material : Material
        Elastic constants and density.
    axis : str
        Direction of its axis of revolution: "across" the chain or "along" it.
    angle : float
        Direction of an axis across the chain, rad, about the chain's axis.

    Raises
    ------
    ValueError
        For dimensions that are not positive, another axis, and angles of more than one turn.

    References
    ----------
    Khatri's thesis, section 5.3.1.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Ellipsoid(radius=4.76e-3, length=15e-3, material=hl.STEEL_316, axis="along")
    >>> bead.size
    0.015
    """

    radius: BeadLength
    length: BeadLength
    material: Material
    axis: Annotated[str, OneOf("across", "along")] = "across"
    angle: Angle = 0.0

    @property
    def mass(self) -> float:
        """4/3 π R² (L/2) ρ, kg."""
        return 2.0 / 3.0 * pi * self.radius**2 * self.length * self.material.density

    @property
    def size(self) -> float:
        """Extent along the chain, m."""
        return self.length if self.axis == "along" else 2.0 * self.radius

    @property
    def surface(self) -> Surface:
        """Material and curvatures at its contacts: of the pole if it lies along the chain, of the equator if across."""
        half = self.length / 2.0
        if self.axis == "along":
            return Surface(self.material, half / self.radius**2)
        return Surface(self.material, self.radius / half**2, 1.0 / self.radius, self.angle)


@described
class Cylinder(_Round):
    """A solid cylinder that lies across the chain.

    Parameters
    ----------
    radius : float
        Radius, m.
    length : float
        Length, m.
    material : Material
        Elastic constants and density.
    angle : float
        Direction of its axis, rad, about the chain's axis.

    Raises
    ------
    ValueError
        For dimensions that are not positive, and angles of more than one turn.

    References
    ----------
    Khatri's thesis, section 5.3.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> lying, crossing = (hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316, angle=angle) for angle in (0.0, 1.5))
    >>> hl.contact_law(lying, lying).name
    'line contact of parallel cylinders'
    >>> hl.contact_law(lying, crossing).name
    "Hertz, elliptic contact, R'/R'' = 1.152, b/a exact"
    """

    radius: BeadLength
    length: BeadLength
    material: Material
    angle: Angle = 0.0

    @property
    def mass(self) -> float:
        """π R² L ρ, kg."""
        return pi * self.radius**2 * self.length * self.material.density

    @property
    def surface(self) -> Surface:
        """Material and curvatures: none along its axis, 1/R across."""
        return Surface(self.material, 0.0, 1.0 / self.radius, self.angle)


Shape = Sphere | HollowSphere | Ellipsoid | Cylinder
"""The bodies defined here: frozen, hashable, and with checked dimensions."""

SHAPES = (Sphere, HollowSphere, Ellipsoid, Cylinder)

ATTRIBUTES = ("mass", "size", "surface")
"""What makes an object a bead."""


def check_bead(name: str, body: Any, what: str = "a bead, such as a Sphere") -> Bead:
    """Return `body`, or raise a ValueError that names what it lacks to be a Bead."""
    if isinstance(body, SHAPES):
        return body
    missing = [attribute for attribute in ATTRIBUTES if not hasattr(body, attribute)]
    # A Structure has these attributes too, but its mass is a matrix.
    if missing == list(ATTRIBUTES) or isinstance(body, type | Structure):
        raise ValueError(f"{name} = {short(body)}: must be {what}")
    if missing:
        raise ValueError(f"{name} = {short(body)}: has no {' and no '.join(missing)}; must be {what}")
    positive(f"{name}: mass", body.mass, "kg")
    positive(f"{name}: size", body.size, "m")
    instance(f"{name}: surface", body.surface, Surface, "a Surface(material, curvature)")
    if hasattr(body, "shell_flexibility"):
        not_negative(f"{name}: shell_flexibility", body.shell_flexibility, "m/N")
    return body  # type: ignore[no-any-return]


def check_beads(name: str, bodies: Any) -> tuple[Bead, ...]:
    """Return `bodies` as a tuple of one Bead or more, or raise a ValueError that names the first which is none."""
    what = "a bead, such as a Sphere"
    beads = listed(name, bodies, object, "one bead, such as a Sphere, or more")
    # Chains repeat their beads, and a batch has thousands of chains: each is checked once.
    checked = set[int]()
    for place, bead in enumerate(beads):
        if isinstance(bead, SHAPES) or id(bead) in checked:
            continue
        likely_bead(check_bead(f"{name}[{place}]", bead, what))
        checked.add(id(bead))
    return tuple(beads)


def likely_bead(bead: Bead) -> None:
    """Warn of a user's body whose size or mass may be in another unit; those defined here warn when they are made."""
    if isinstance(bead, SHAPES):
        return
    Likely.BEAD_SIZE.warn(type(bead).__name__, "size", bead.size)
    Likely.BULK.warn(type(bead).__name__, "mass / size³", bead.mass / bead.size**3)


def check_body(name: str, body: Any) -> Bead | Surface:
    """Return `body`, or raise a ValueError where it is neither a Bead nor a Surface."""
    return body if isinstance(body, Surface) else check_bead(name, body, "a body or a Surface")


def plain_data(thing: Any) -> Any:
    """Return the plain data for the attributes of a result.

    Class and fields of a dataclass; of another body its attributes; of another object, as a user's law, its class and
    variables; anything else unchanged.
    """
    if isinstance(thing, np.ndarray | np.generic):
        return thing.tolist()
    if is_dataclass(thing) and not isinstance(thing, type):
        # Several losses, and several bodies, have fields of the same names.
        named = {} if isinstance(thing, Material | Surface) else {"class": type(thing).__qualname__}
        return named | {field.name: plain_data(getattr(thing, field.name)) for field in fields(thing)}
    if all(hasattr(thing, attribute) for attribute in ATTRIBUTES):
        return {"class": type(thing).__qualname__} | {name: plain_data(getattr(thing, name)) for name in ATTRIBUTES}
    kind: Any = type(thing)
    speaks = callable(thing) and kind.__repr__ is not object.__repr__  # as functions do
    if speaks or not hasattr(thing, "__dict__"):
        return thing
    cached = {
        name
        for kind in type(thing).__mro__
        for name, member in vars(kind).items()
        if isinstance(member, cached_property)
    }
    attributes = {name: value for name, value in vars(thing).items() if name not in cached}
    # The variables of a variable may lead back to the object.
    return {"class": type(thing).__qualname__} | {
        name: plain_data(value) if isinstance(value, np.ndarray | np.generic) or is_dataclass(value) else value
        for name, value in attributes.items()
    }


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

    Raises
    ------
    ValueError
        For a height that is not positive.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.drop_speed(0.01), 3)
    0.443
    """
    return sqrt(2.0 * STANDARD_GRAVITY * height)
