"""Contacts that yield: a loading curve beyond Hertz's law, and a rule for unloading.

After its largest overlap δ* with the force F*, a contact unloads and reloads by F = F* [(δ − δ_r)/(δ* − δ_r)]^1.5 with
the permanent dent δ_r. Beyond δ* it yields further.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import exp, inf, pi
from typing import NamedTuple

import numpy as np

from particles.bead import Bead, contact_modulus, surface_of
from particles.laws.formulas import NEARLY_ROUND_CONTACT, contact_law
from particles.laws.law import ContactLaw, PowerLaw, inverse, kernel_table
from structures.caution import collected
from structures.checks import short
from structures.described import described
from structures.material import Material
from structures.quantities import Strength
from structures.structure import Vector
from structures.surface import Surface, relative_curvatures, yield_pressure

HERTZ = 1.5  # exponent of Hertz's law; only contacts with this law can yield
ONSET = 1.9  # ratio of overlap to yield overlap from which Jackson and Green's force differs from Hertz's


class RoundContact(NamedTuple):
    """The properties of two bodies on which a yielding law depends."""

    radius: float  # relative radius of curvature, m
    modulus: float  # contact modulus E*, Pa
    material: Material  # the material that yields first
    strength: float  # its yield strength, Pa
    pressure: float  # the peak pressure at which it begins to yield, Pa


@described
class YieldingLaw(ABC):
    """Loading curve and dent as functions of x = δ/δ_y − 1. Derive a frozen dataclass for a law of your own.

    Parameters
    ----------
    yield_strength : float, optional
        Yield strength of every contact, Pa; by default that of the material that yields first.

    Examples
    --------
    >>> isinstance(hl.laws.Thornton(yield_strength=1e9), hl.laws.YieldingLaw)
    True
    """

    yield_strength: Strength | None = None

    @abstractmethod
    def overlap(self, bodies: RoundContact) -> float:
        """Return the overlap δ_y at which a contact begins to yield, m."""

    @abstractmethod
    def loading(self, bodies: RoundContact, x: Vector) -> Vector:
        """Return (F − F_y)/F_y beyond yield; it increases with x."""

    @abstractmethod
    def dent(self, bodies: RoundContact, x: Vector) -> Vector:
        """Return the dent δ_r/δ_y after a largest overlap; less than 1 + x."""

    def contact(
        self, first: Bead, second: Bead | Surface, elastic: ContactLaw | None = None
    ) -> "YieldingContact | None":
        """Return the contact of two bodies with an elastic law, by default `contact_law`; None if neither yields."""
        law = contact_law(first, second) if elastic is None else elastic
        surface, facing = surface_of(first), surface_of(second)
        material = min((surface.material, facing.material), key=yield_pressure)
        strength = self.yield_strength or material.yield_strength
        if strength is None:
            return None
        flat, sharp = relative_curvatures(surface, facing)
        if not isinstance(law, PowerLaw) or law.exponent != HERTZ or sharp > NEARLY_ROUND_CONTACT * flat:
            raise ValueError(f"law = {short(self)}: must be for solid bodies with a round contact, not {law.name}")
        with collected():  # the user has been warned of an improbable strength
            pressure = yield_pressure(replace(material, yield_strength=strength))
        bodies = RoundContact((flat * sharp) ** -0.5, contact_modulus(surface, facing), material, strength, pressure)
        return _kept_contact(self, bodies, law)


@described
class Thornton(YieldingLaw):
    """A contact whose pressure is limited to that of the first yield (Thornton, J. Appl. Mech. 64 (1997) 383).

    Hardness tests find higher pressures, so these contacts are too soft. docs/beads.md has the formulas.

    Parameters
    ----------
    yield_strength : float, optional
        As in `YieldingLaw`.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_316)
    >>> force = hl.laws.Thornton().contact(bead, bead).yield_force
    """

    def overlap(self, bodies: RoundContact) -> float:
        return bodies.radius * (pi * bodies.pressure / (2.0 * bodies.modulus)) ** 2

    def loading(self, bodies: RoundContact, x: Vector) -> Vector:
        return HERTZ * np.asarray(x)

    def dent(self, bodies: RoundContact, x: Vector) -> Vector:
        # δ* (1 − F*/F_e), without cancellation at the beginning of yield.
        root = np.sqrt(1.0 + np.asarray(x))
        return np.asarray((np.asarray(x) / (1.0 + root)) ** 2 * (root + 0.5) / root)


@described
class JacksonGreen(YieldingLaw):
    """Fits to finite elements of an elastic-perfectly plastic sphere (Jackson and Green, J. Tribol. 127 (2005) 343).

    The dent is from Jackson, Green and Marghitu, Nonlinear Dyn. 60 (2010) 217. docs/beads.md has the formulas.

    Parameters
    ----------
    yield_strength : float, optional
        As in `YieldingLaw`.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_316)
    >>> law = hl.laws.JacksonGreen().contact(bead, bead)
    """

    def overlap(self, bodies: RoundContact) -> float:
        return float(bodies.radius * (pi * _onset_factor(bodies) * bodies.strength / (2.0 * bodies.modulus)) ** 2)

    def loading(self, bodies: RoundContact, x: Vector) -> Vector:
        x = np.asarray(x, float)
        hertz = np.expm1(HERTZ * np.log1p(x))
        # If the strength is high compared with the modulus, the fit begins below Hertz's force; it is raised to it.
        raised = max(1.0, ONSET**HERTZ / float(self._fit(bodies, np.array(ONSET))))
        fit = raised * self._fit(bodies, np.maximum(1.0 + x, ONSET))
        return np.where(1.0 + x < ONSET, hertz, np.minimum(hertz, fit - 1.0))

    def _fit(self, bodies: RoundContact, y: Vector) -> Vector:
        """Return F/F_c at y = δ/δ_c > 1.9."""
        widening = 0.14 * exp(23.0 * bodies.strength / bodies.modulus)
        radius = np.sqrt(self.overlap(bodies) / bodies.radius * y) * (y / ONSET) ** (0.5 * widening)  # a/R
        hardness = 2.84 * -np.expm1(-0.82 * radius**-0.7)
        elastic = y**HERTZ * np.exp(-0.25 * y ** (5.0 / 12.0))
        return np.asarray(elastic + 4.0 * hardness / _onset_factor(bodies) * y * -np.expm1(-(y ** (5.0 / 9.0)) / 25.0))

    def dent(self, bodies: RoundContact, x: Vector) -> Vector:
        part = 1.02 * -np.expm1(-0.54 * np.log1p(np.asarray(x, float) / 6.9))
        # The dent is limited, so that an elastic part of the overlap remains.
        return np.minimum(part, 0.99) * (1.0 + np.asarray(x))


def _onset_factor(bodies: RoundContact) -> float:
    """Return C of the critical overlap δ_c = R (π C S/2E*)²."""
    return 1.295 * exp(0.736 * bodies.material.poisson_ratio)


@dataclass(frozen=True)
class YieldingContact:
    """A contact of two bodies with a yielding law, and with Hertz's law before it yields."""

    law: YieldingLaw
    bodies: RoundContact
    elastic: PowerLaw

    @cached_property
    def overlap(self) -> float:
        """The overlap δ_y at which it begins to yield, m; infinite if Hertz's law is not trusted so far."""
        begin = float(self.law.overlap(self.bodies))
        return begin if begin < self.elastic.largest else inf

    @cached_property
    def yield_force(self) -> float:
        """The force F_y at which it begins to yield, N."""
        return float(self.elastic.force(np.array(self.overlap)))

    def loading(self, overlap: Vector) -> Vector:
        """Return the force, N, at overlaps beyond yield that are the largest so far, m."""
        beyond = np.maximum(np.asarray(overlap, float) / self.overlap - 1.0, 0.0)
        return self.yield_force * (1.0 + self.law.loading(self.bodies, beyond))

    def dent(self, largest: Vector) -> Vector:
        """Return the dent δ_r, m, after a largest overlap, m."""
        if self.overlap == inf:
            return np.zeros_like(largest, float)
        beyond = np.maximum(np.asarray(largest, float) / self.overlap - 1.0, 0.0)
        return np.asarray(self.overlap * self.law.dent(self.bodies, beyond))

    def force(self, overlap: Vector, largest: Vector = 0.0) -> Vector:  # type: ignore[assignment]
        """Return the force, N, at overlaps, m, after an earlier largest overlap, m."""
        overlap = np.asarray(overlap, float)
        if self.overlap == inf:
            return self.elastic.force(overlap)
        most = np.maximum(overlap, np.asarray(largest, float))
        elastic = np.maximum(overlap - self.dent(most), 0.0)
        plastic = self.loading(most) * (elastic / np.maximum(most - self.dent(most), 1e-300)) ** HERTZ
        return np.where(most > self.overlap, plastic, self.elastic.force(elastic))

    def approach(self, force: Vector) -> Vector:
        """Return the overlap, m, at a force on first loading, N."""
        force = np.asarray(force, float)
        elastic = self.elastic.approach(force)
        if not np.any(force > self.yield_force):
            return elastic
        return np.where(force > self.yield_force, inverse(self.loading, force), elastic)

    @cached_property
    def tables(self) -> tuple[Vector, Vector]:
        """Tables for the compiled loops: the force above F_y and the dent, as functions of the overlap above δ_y."""
        x = np.geomspace(1e-3, 1e3, 25)
        if not np.all(np.asarray(self.law.dent(self.bodies, x)) < 1.0 + x):
            raise ValueError(f"law: {type(self.law).__name__}.dent must be less than the overlap, 1 + x")
        loading = _Curve(lambda depth: self.yield_force * self.law.loading(self.bodies, depth / self.overlap))
        dent = _Curve(lambda depth: self.overlap * self.law.dent(self.bodies, depth / self.overlap))
        return kernel_table(loading), kernel_table(dent)


_kept_contact = lru_cache(maxsize=256)(YieldingContact)  # with its tables: thousands of runs have the same beads


@dataclass(frozen=True)
class _Curve(ContactLaw):
    """A function of the overlap beyond yield, m, in the form for `kernel_table`."""

    of: Callable[[Vector], Vector]

    def force(self, approach: Vector) -> Vector:
        return self.of(np.asarray(approach))
