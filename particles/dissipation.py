"""How a chain loses energy: one law for all contacts, or a drag on all bodies. Every law takes energy only.

A loss between two bodies pushes both alike, so momentum is kept; elastic force and loss together never pull. The drag
and the thesis's form of the power law act on single bodies, and momentum goes with them.
"""

from dataclasses import dataclass
from math import cos, cosh

import numpy as np
from scipy.optimize import brentq

from particles import kernels
from structures.checks import not_negative, one_of, within
from structures.plausible import likely
from structures.structure import Vector

FORMS = ("pairwise", "thesis")


class Dissipation:
    """A loss. kind and exponent are what the kernel calls `loss` and `exponent`."""

    kind: int

    @property
    def exponent(self) -> float:
        """Power of the approach rate."""
        return 1.0

    def coefficients(self, mass: Vector) -> Vector:
        """The kernel's coefficient at each contact, from the reduced masses (kg) of the colliding bodies."""
        raise NotImplementedError


@dataclass(frozen=True)
class LinearDashpot(Dissipation):
    """A force γ dδ/dt beside the contact's own while beads touch (thesis, section 6.1, equation 6.1).

    coefficient γ in N s/m. The thesis gives none; 4 to 6 reproduces its amplitude ratios on steel.
    """

    coefficient: float
    kind = kernels.DASHPOT

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", not_negative("coefficient", self.coefficient, "N s/m"))

    def coefficients(self, mass: Vector) -> Vector:
        """γ at each contact."""
        return np.full_like(mass, self.coefficient)


@dataclass(frozen=True)
class PowerDashpot(Dissipation):
    """A viscous force that grows as a power of a rate (thesis, section 4.2, equation 4.1).

    coefficient γ in N (s/m)^α, exponent α from 1 to 5. form "pairwise": between touching beads, γ |dδ/dt|^α against the
    approach rate. It keeps momentum, and for α = 1 it is LinearDashpot.

    form "thesis": equation 4.1, a force γ s|δ̇ₙ − δ̇ₙ₊₁|^α on bead n with s the sign of that difference of the approach
    rates behind and ahead. As printed, with γ < 0, it would feed energy: here γ > 0 takes it. It has no reaction, so
    momentum is lost unless α = 1. The thesis states no unit: as a force (steel: α = 1.81, γ = 5.58) it takes 72 % of
    the peak between its sensors 9 and 56, as an acceleration 0.1 %. It leaves the striker's contact out (δ₁ ≡ 0), here
    every contact counts. Where beads move on together the printed form may feed energy; at such instants it is left
    out.
    """

    coefficient: float
    exponent: float = 1.0
    form: str = "pairwise"

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", not_negative("coefficient", self.coefficient, "N (s/m)^α"))
        object.__setattr__(self, "exponent", within("exponent", self.exponent, 1.0, 5.0))
        one_of("form", self.form, FORMS)

    @property
    def kind(self) -> int:  # type: ignore[override]
        """Of the form."""
        return kernels.DASHPOT if self.form == "pairwise" else kernels.GLOBAL

    def coefficients(self, mass: Vector) -> Vector:
        """γ at each contact, or on each body."""
        return np.full_like(mass, self.coefficient)


@dataclass(frozen=True)
class MassProportional(Dissipation):
    """A drag −α₁ m v on every bead and the striker, Rayleigh's mass-proportional damping (thesis, equation 4.4).

    rate α₁ in 1/s; the thesis prints 6900 "N s/m" for a chain of steel spheres, but its unit is 1/s. Momentum is lost.
    """

    rate: float
    kind = kernels.DRAG

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate", not_negative("rate", self.rate, "1/s"))

    def coefficients(self, mass: Vector) -> Vector:
        """α₁ on each body."""
        return np.full_like(mass, self.rate)


@dataclass(frozen=True)
class KuwabaraKono(Dissipation):
    """Viscoelastic spheres: a force τ dF/dt beside the elastic F, so 3/2 k τ √δ dδ/dt for Hertz's contacts.

    time τ in s (Kuwabara and Kono, Jpn. J. Appl. Phys. 26 (1987) 1230).
    """

    time: float
    kind = kernels.TANGENT

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", not_negative("time", self.time, "s"))
        likely("time", "KuwabaraKono", "time", self.time)

    def coefficients(self, mass: Vector) -> Vector:
        """τ at each contact."""
        return np.full_like(mass, self.time)


@dataclass(frozen=True)
class Tsuji(Dissipation):
    """A force α √(m k) δ^¼ dδ/dt, m the reduced mass: a collision's restitution does not depend on its speed.

    coefficient α, dimensionless (Tsuji, Tanaka and Ishida, Powder Technol. 71 (1992) 239, equation 5). Other laws than
    Hertz's: δ^¼ √k becomes √[(dF/dδ + F/δ)/2.5], for the same property.
    """

    coefficient: float
    kind = kernels.SECANT

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", not_negative("coefficient", self.coefficient))

    def coefficients(self, mass: Vector) -> Vector:
        """α √(m/1.25) at each contact."""
        return self.coefficient * np.sqrt(mass / 1.25)


@dataclass(frozen=True)
class Restitution(Dissipation):
    """Tsuji's law with the coefficient that gives a binary collision this coefficient of restitution.

    coefficient e from 0.01 to 1: rebound over approach speed, at any speed. In ξ = δ^{5/4} the collision is a linear
    oscillator of damping ratio ζ = α/√5 (Antypov and Elliott, EPL 94 (2011) 50004); it ends where the force would begin
    to pull, so e = exp(−2θ/tan θ) with θ = arccos ζ. For ζ > 1, below e = exp(−2), θ is imaginary.
    """

    coefficient: float
    kind = kernels.SECANT

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficient", within("coefficient", self.coefficient, 0.01, 1.0))

    def coefficients(self, mass: Vector) -> Vector:
        """2ζ √m at each contact."""
        return 2.0 * self.damping_ratio * np.sqrt(mass)

    @property
    def damping_ratio(self) -> float:
        """ζ."""
        wanted = -np.log(self.coefficient) / 2.0
        if wanted == 0.0:
            return 0.0
        if wanted < 1.0:
            return cos(brentq(lambda angle: angle / np.tan(angle) - wanted, 1e-9, np.pi / 2.0, xtol=1e-15))
        if wanted == 1.0:
            return 1.0
        return cosh(brentq(lambda angle: angle / np.tanh(angle) - wanted, 1e-9, wanted + 1.0, xtol=1e-15))
