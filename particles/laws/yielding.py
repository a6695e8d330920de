"""Contacts that yield: a loading curve beyond Hertz's law, and a rule for unloading.

Unloading is Hertz's with another stiffness and from the dent on that is left: F = F* [(δ − δ_r)/(δ* − δ_r)]^1.5, with
the largest overlap δ* so far, the force F* there and the dent δ_r. A contact that is loaded again follows that way
back, and yields further beyond δ*. It remembers δ*, and nothing else.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import inf, pi
from typing import NamedTuple

import numpy as np

from particles.bead import Bead
from particles.kernels.laws import table_energies
from particles.laws.formulas import NEARLY_ROUND_CONTACT
from particles.laws.law import ContactLaw, PowerLaw, inverse, kernel_table
from structures.caution import collected
from structures.checks import short
from structures.described import described
from structures.material import Material
from structures.quantities import Strength
from structures.structure import Vector
from structures.surface import Surface, relative_curvatures, yield_pressure

HERTZ = 1.5
"""Exponent of the laws that can yield."""

DEEPEST_DENT = 0.99
"""Of the largest overlap: fits are not followed into dents that leave no elastic part."""

CHECKED = np.geomspace(1e-3, 1e3, 25)
"""x at which a dent is checked."""

ONSET = 1.9
"""Overlap over that of the first yield, from which Jackson and Green's force leaves Hertz's."""


class RoundContact(NamedTuple):
    """The properties of two bodies that a yielding law takes.

    radius: relative radius of curvature, m; modulus: contact modulus E*, 1/E* = Σ(1 − ν²)/E, Pa; material: the one that
    yields first, with its strength, Pa, and the pressure at which it begins, Pa.
    """

    radius: float
    modulus: float
    material: Material
    strength: float
    pressure: float


@described
class YieldingLaw(ABC):
    """A loading curve and a rule for unloading. Derive a frozen dataclass from it for a law of your own.

    Curves are functions of x = δ/δ_y − 1, how far an overlap is beyond the one at which the contact yields.

    Parameters
    ----------
    yield_strength : float, optional
        Yield strength of every contact, Pa; by default, of each contact, the material's that yields first.

    Examples
    --------
    A contact whose force stays a straight line, and whose dent is all of the overlap beyond yield:

    >>> import hertzlink as hl
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Straight(hl.laws.YieldingLaw):
    ...     def overlap(self, bodies):
    ...         return 9.87 / 4.0 * (bodies.pressure / bodies.modulus) ** 2 * bodies.radius
    ...
    ...     def loading(self, bodies, x):
    ...         return 1.5 * x
    ...
    ...     def dent(self, bodies, x):
    ...         return 0.5 * x**2 / (1.0 + x)
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 10, bead, impact_speed=0.4, law=Straight())
    >>> round(1e6 * chain.law.contact(bead, bead).overlap, 2)  # µm
    4.55
    """

    yield_strength: Strength | None = None

    @abstractmethod
    def overlap(self, bodies: RoundContact) -> float:
        """Return δ_y, m, at which a contact begins to yield."""

    @abstractmethod
    def loading(self, bodies: RoundContact, x: Vector) -> Vector:
        """Return (F − F_y)/F_y beyond yield; it rises with x."""

    @abstractmethod
    def dent(self, bodies: RoundContact, x: Vector) -> Vector:
        """Return δ_r/δ_y that is left after a largest overlap; less than 1 + x."""

    def contact(self, first: Bead, second: Bead | Surface) -> "YieldingContact | None":
        """Return how two bodies yield.

        Parameters
        ----------
        first : Bead
            One body.
        second : Bead or Surface
            The other one, or the surface of a structure.

        Returns
        -------
        YieldingContact or None
            None where neither material has a yield strength, and none is given.

        Raises
        ------
        ValueError
            For bodies that do not touch in a circle, and for hollow ones.
        """
        from particles.laws.formulas import contact_law

        return self.of_law(first, second, contact_law(first, second))

    def of_law(self, first: Bead, second: Bead | Surface, law: ContactLaw) -> "YieldingContact | None":
        """Return how two bodies yield whose elastic law is known."""
        surface, facing = (body if isinstance(body, Surface) else body.surface for body in (first, second))
        bodies = self._bodies(surface, facing)
        if bodies is None:
            return None
        flat, sharp = relative_curvatures(surface, facing)
        if not isinstance(law, PowerLaw) or law.exponent != HERTZ or sharp > NEARLY_ROUND_CONTACT * flat:
            raise ValueError(
                f"law = {short(self)}: needs solid bodies that touch in a circle; between {short(first)} and "
                f"{short(second)} the law is {law.name}"
            )
        return _yielding(self, bodies, law)

    def _bodies(self, surface: Surface, facing: Surface) -> RoundContact | None:
        """Return the properties of the pair; None where nothing is known of its strength."""
        material = min((surface.material, facing.material), key=yield_pressure)
        strength = self.yield_strength or material.yield_strength
        if strength is None:
            return None
        flat, sharp = relative_curvatures(surface, facing)
        if not flat > 0.0:
            raise ValueError(f"law = {short(self)}: needs bodies that touch in a circle, not along a line")
        modulus = 1.0 / (1.0 / surface.material.contact_modulus + 1.0 / facing.material.contact_modulus)
        elastic = material.youngs_modulus, material.poisson_ratio, material.density, material.name
        return RoundContact((flat * sharp) ** -0.5, modulus, material, strength, _onset(*elastic, strength))


@described
class Thornton(YieldingLaw):
    """A contact whose greatest pressure is that of the first yield; beyond it the force rises on a straight line.

    F = F_y + π p_y R (δ − δ_y) from δ_y = R (π p_y/2E*)² on. Unloading is Hertz's with the radius R_p = R F_e/F*, where
    F_e is Hertz's force at the largest overlap and F* the force there. p_y is `theory.yield_pressure`, 1.61 times the
    yield strength for ν = 0.3. Hardness tests find up to 2.8 times the yield strength: contacts of this law are soft.

    Parameters
    ----------
    yield_strength : float, optional
        Yield strength of every contact, Pa; by default, of each contact, the material's that yields first.

    Raises
    ------
    ValueError
        For a yield strength that is not positive.

    References
    ----------
    Thornton, J. Appl. Mech. 64 (1997) 383.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_316)
    >>> contact = hl.laws.Thornton().contact(bead, bead)
    >>> round(contact.yield_force, 2), round(1e6 * contact.overlap, 3)  # N, µm
    (0.09, 0.057)
    """

    def overlap(self, bodies: RoundContact) -> float:
        return bodies.radius * (pi * bodies.pressure / (2.0 * bodies.modulus)) ** 2

    def loading(self, bodies: RoundContact, x: Vector) -> Vector:
        return HERTZ * np.asarray(x)

    def dent(self, bodies: RoundContact, x: Vector) -> Vector:
        # δ* (1 − F*/F_e), without the difference of two equal numbers as it begins to yield.
        root = np.sqrt(1.0 + np.asarray(x))
        step = np.asarray(x) / (1.0 + root)
        dent: Vector = step**2 * (root + 0.5) / root
        return dent


@described
class JacksonGreen(YieldingLaw):
    """Jackson and Green's fits to finite elements of a sphere that is elastic and perfectly plastic.

    With δ_c = R (π C S/2E*)², C = 1.295 e^(0.736 ν), F_c Hertz's force there, y = δ/δ_c and the yield strength S:
    F/F_c = y^1.5 e^(−y^(5/12)/4) + (4 H/C S) y [1 − e^(−y^(5/9)/25)], H/S = 2.84 [1 − e^(−0.82 (a/R)^−0.7)],
    a/R = √(δ_c y/R) (y/1.9)^(B/2), B = 0.14 e^(23 S/E*), where that is less than Hertz's force, beyond y = 1.9; and
    the dent δ_r/δ* = 1.02 [1 − ((y* + 5.9)/6.9)^−0.54] from y* = 1 on.

    Parameters
    ----------
    yield_strength : float, optional
        Yield strength of every contact, Pa; by default, of each contact, the material's that yields first.

    Raises
    ------
    ValueError
        For a yield strength that is not positive.

    References
    ----------
    Jackson and Green, J. Tribol. 127 (2005) 343; the dent: Jackson, Green and Marghitu, Nonlinear Dyn. 60 (2010) 217.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_316)
    >>> contact = hl.laws.JacksonGreen().contact(bead, bead)
    >>> round(float(contact.force(5e-6)), 1)  # N
    37.5
    """

    def overlap(self, bodies: RoundContact) -> float:
        factor = 1.295 * np.exp(0.736 * bodies.material.poisson_ratio)
        return float(bodies.radius * (pi * factor * bodies.strength / (2.0 * bodies.modulus)) ** 2)

    def loading(self, bodies: RoundContact, x: Vector) -> Vector:
        x = np.asarray(x, float)
        hertz = np.expm1(HERTZ * np.log1p(x))
        # Where bodies are strong for their modulus, the fit begins below Hertz's force, and is raised to it.
        raised = max(1.0, ONSET**HERTZ / float(self._fit(bodies, np.array(ONSET))))
        fit = raised * self._fit(bodies, np.maximum(1.0 + x, ONSET))
        return np.where(1.0 + x < ONSET, hertz, np.minimum(hertz, fit - 1.0))

    def _fit(self, bodies: RoundContact, y: Vector) -> Vector:
        """Return F/F_c beyond y = 1.9."""
        factor = 1.295 * np.exp(0.736 * bodies.material.poisson_ratio)
        hardness = 2.84 * -np.expm1(-0.82 * self._radius(bodies, y) ** -0.7)
        elastic = y**HERTZ * np.exp(-0.25 * y ** (5.0 / 12.0))
        plastic = 4.0 * hardness / factor * y * -np.expm1(-(y ** (5.0 / 9.0)) / 25.0)
        force: Vector = elastic + plastic
        return force

    def dent(self, bodies: RoundContact, x: Vector) -> Vector:
        part = 1.02 * -np.expm1(-0.54 * np.log1p(np.asarray(x, float) / 6.9))
        return np.minimum(part, DEEPEST_DENT) * (1.0 + np.asarray(x))

    def _radius(self, bodies: RoundContact, y: Vector) -> Vector:
        """Return a/R of the contact."""
        widening = 0.14 * np.exp(23.0 * bodies.strength / bodies.modulus)
        radius: Vector = np.sqrt(self.overlap(bodies) / bodies.radius * y) * (y / ONSET) ** (0.5 * widening)
        return radius


@dataclass(frozen=True)
class YieldingContact:
    """Two bodies with a yielding law.

    Parameters
    ----------
    law : YieldingLaw
        Its curves.
    bodies : RoundContact
        The pair.
    elastic : PowerLaw
        Hertz's law of the pair.
    """

    law: YieldingLaw
    bodies: RoundContact
    elastic: PowerLaw

    @cached_property
    def overlap(self) -> float:
        """δ_y, m, at which it begins to yield; infinite where Hertz's law is not trusted so far."""
        begin = float(self.law.overlap(self.bodies))
        return begin if begin < self.elastic.largest else inf

    @cached_property
    def yield_force(self) -> float:
        """F_y, N."""
        return float(self.elastic.force(np.array(self.overlap)))

    def force(self, overlap: Vector, largest: Vector = 0.0) -> Vector:  # type: ignore[assignment]
        """Return the force, N, at overlaps, m, after the largest overlap before, m: on loading where there was none
        larger."""
        overlap = np.asarray(overlap, float)
        most = np.maximum(overlap, np.asarray(largest, float))
        elastic = np.maximum(overlap - self.dent(most), 0.0)
        deepest = np.maximum(most - self.dent(most), 1e-300)
        plastic = self._loading(most) * (elastic / deepest) ** HERTZ
        return np.where(most > self.overlap, plastic, self.elastic.force(elastic))

    def dent(self, largest: Vector) -> Vector:
        """Return the overlap δ_r, m, that is left after a largest overlap, m."""
        if self.overlap == inf:
            return np.zeros_like(largest, float)
        return np.asarray(self.overlap * self.law.dent(self.bodies, self._beyond(largest)))

    def dissipated(self, largest: Vector) -> Vector:
        """Return the energy, J, that the contact has lost after a largest overlap, m: the work of loading less that
        returned."""
        largest = np.asarray(largest, float)
        if self.overlap == inf:
            return np.zeros_like(largest)
        depth = np.maximum(largest - self.overlap, 0.0)
        work = self.elastic.energy(np.array(self.overlap)) + self.yield_force * depth
        work = work + table_energies(self.tables[0], depth)
        returned = 0.4 * self._loading(largest) * (largest - self.dent(largest))
        return np.where(depth > 0.0, work - returned, 0.0)

    def approach(self, force: Vector) -> Vector:
        """Return the overlap, m, at a force on loading, N."""
        force = np.asarray(force, float)
        elastic = self.elastic.approach(force)
        if self.overlap == inf or not np.any(force > self.yield_force):
            return elastic
        return np.where(force > self.yield_force, inverse(self._loading, force), elastic)

    @cached_property
    def tables(self) -> tuple[Vector, Vector]:
        """Rows of the force beyond F_y and of the dent over the overlap beyond δ_y, as the compiled loops take them."""
        far = np.asarray(self.law.dent(self.bodies, CHECKED), float)
        if not np.all(far < 1.0 + CHECKED):
            first = int(np.argmin(far < 1.0 + CHECKED))
            raise ValueError(
                f"law: {type(self.law).__name__}.dent = {far[first]:.3g} at x = {CHECKED[first]:.3g}: must be less "
                "than the overlap, 1 + x"
            )
        rise = _Curve(self.yield_force, self.overlap, lambda x: self.law.loading(self.bodies, x))
        dent = _Curve(self.overlap, self.overlap, lambda x: self.law.dent(self.bodies, x))
        return kernel_table(rise), kernel_table(dent)

    def _beyond(self, overlap: Vector) -> Vector:
        """Return x, zero before yield."""
        excess: Vector = np.maximum(np.asarray(overlap, float) / self.overlap - 1.0, 0.0)
        return excess

    def _loading(self, overlap: Vector) -> Vector:
        if self.overlap == inf:
            return self.elastic.force(overlap)
        return self.yield_force * (1.0 + self.law.loading(self.bodies, self._beyond(overlap)))


class _Curve(ContactLaw):
    """A curve over the overlap beyond yield, m, for `kernel_table`."""

    def __init__(self, scale: float, unit: float, of: object) -> None:
        self.scale, self.unit, self.of = scale, unit, of

    name = "loading curve or dent of a yielding law"

    def force(self, approach: Vector) -> Vector:
        force: Vector = self.scale * self.of(np.asarray(approach) / self.unit)  # type: ignore[operator]
        return force


@lru_cache(maxsize=256)
def _yielding(law: YieldingLaw, bodies: RoundContact, elastic: PowerLaw) -> YieldingContact:
    """Return the contact, which holds its tables: thousands of runs have the same beads."""
    return YieldingContact(law, bodies, elastic)


@lru_cache(maxsize=256)
def _onset(modulus: float, poisson: float, density: float, name: str, strength: float) -> float:
    """Return the pressure of the first yield for this strength, Pa; the user was warned of it if it is improbable."""
    with collected():
        return yield_pressure(Material(modulus, poisson, density, name, strength))
