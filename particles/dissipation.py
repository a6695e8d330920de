"""Losses of energy in a chain: one law for all contacts, or a drag on all bodies. Each takes energy only.

A loss between two bodies acts on both with opposite forces, so momentum is kept; elastic force and loss together never
pull. The drag and the thesis's form of the power law act on single bodies and do not keep momentum.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import fields
from math import cos, cosh
from typing import Annotated, Any, cast

import numpy as np

from particles.kernels.losses import BodyLoss, Losses, MixedLoss, NoLoss
from structures.checks import short
from structures.described import described
from structures.quantities import OneOf, Quantity, Time
from structures.structure import Vector

CONTACT_PIECES = "dashpot", "tangent", "secant"
"""The forms of a loss at a contact, in the order of `particles.kernels.losses`."""

NEIGHBOURS = 4.0
"""Largest damping rate of equation 4.1 over that of one contact: a body has two, and each contact joins two bodies."""


class Dissipation(ABC):
    """A loss of energy. Derive a class from it for a loss of your own.

    A subclass gives the coefficients c, and names the form of the force. With the approach rate δ̇ and the elastic force
    F, a closed contact has the force c δ̇^α ("dashpot"), c F′ δ̇^α ("tangent") or c √((F′ + F/δ)/2) δ̇^α ("secant").
    "bodies" is the thesis's equation 4.1, and "drag" a force c m v on each body. A form of your own is a NamedTuple
    with the static method `with_loss`, see docs/extending.md. Its first field is `coefficient`; the others have
    the names of the loss's numbers.

    Attributes
    ----------
    piece : str or type
        Form of the force.
    exponent : float
        Power α of the rate; 1 unless a subclass defines it.

    Examples
    --------
    A viscoelastic loss whose relaxation time depends on the mass:

    >>> import hertzlink as hl
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class HeavierIsSlower(hl.Dissipation):
    ...     time_per_mass: float  # s/kg
    ...     piece = "tangent"
    ...
    ...     def coefficients(self, mass):
    ...         return self.time_per_mass * mass
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 10, bead, impact_speed=0.4, dissipation=HeavierIsSlower(1e-4))
    """

    piece: str | type

    @property
    def exponent(self) -> float:
        return 1.0

    @abstractmethod
    def coefficients(self, mass: Vector) -> Vector:
        """Return the coefficient c at each contact, from the reduced masses (kg) of the bodies that collide there."""

    def rates(self, mass: Vector, tangent: Vector, secant: Vector, speed: float) -> Vector:
        """Return how fast the loss would stop each contact, 1/s, which limits the step.

        mass, kg: reduced masses; speed, m/s: of the bodies; tangent, secant: F′ and F/δ, N/m, at the depth at which a
        contact holds all energy of the impact, plus that of the preload. The default is for the forms above, whose c is
        in N s/m where α is 1 (1/s for "drag"). For a piece of your own return the greatest derivative of its force by
        the rate, over the mass.
        """
        if self.piece == "tangent":
            grown = tangent
        elif self.piece == "secant":
            grown = np.sqrt(0.5 * (tangent + secant))
        else:
            grown = np.full_like(tangent, NEIGHBOURS if self.piece == "bodies" else 1.0)
        rates: Vector = coefficients_of(self, mass) * grown * speed ** (self.exponent - 1.0)
        return rates if self.piece == "drag" else rates / mass


def kernel_losses(losses: Sequence[tuple[Dissipation | None, Vector]], present: Vector, free: Vector) -> Any:
    """Return the losses of chains as a piece of the compiled loops.

    losses: that of each chain, with the reduced masses of its contacts. present, free: of all chains, whether there is
    a contact, and whether the body behind it moves freely.
    """
    if not any(loss for loss, _ in losses):
        return NoLoss()
    begin = np.cumsum([0, *(mass.size for _, mass in losses)])
    built_in = Losses(np.zeros(begin[-1]), np.ones(begin[-1]), np.zeros(begin[-1], np.int64), np.zeros(begin[-1]))
    owns = dict[Any, tuple[Vector, Vector]]()
    for (loss, mass), place in zip(losses, map(slice, begin[:-1], begin[1:]), strict=True):
        if loss is None:
            continue
        coefficients, piece = coefficients_of(loss, mass), cast(Any, loss.piece)
        at_contacts, on_bodies = np.where(present[place], coefficients, 0.0), np.where(free[place], coefficients, 0.0)
        if piece == "drag":
            built_in.rate[place] = on_bodies
        elif piece in CONTACT_PIECES:
            built_in.coefficient[place], built_in.exponent[place] = at_contacts, loss.exponent
            built_in.form[place] = CONTACT_PIECES.index(piece)
        else:
            more = loss.exponent if piece == "bodies" else tuple(getattr(loss, name) for name in piece._fields[1:])
            numbers, where = owns.setdefault((piece, more), (np.zeros(begin[-1]), np.zeros(begin[-1], bool)))
            numbers[place], where[place] = (on_bodies if piece == "bodies" else at_contacts), True
    joined: Any = built_in
    for (piece, more), (numbers, where) in owns.items():
        own = BodyLoss(numbers, np.full_like(numbers, more)) if piece == "bodies" else piece(numbers, *more)
        joined = own if where.all() else MixedLoss(own, joined, where)
    return joined


def coefficients_of(loss: Dissipation, mass: Vector) -> Vector:
    """Return the coefficients of a loss at contacts of these reduced masses, kg; a ValueError if they are not valid."""
    name, piece = type(loss).__name__, getattr(loss, "piece", None)
    if piece not in (*CONTACT_PIECES, "bodies", "drag") and getattr(piece, "_fields", ("",))[0] != "coefficient":
        raise ValueError(
            f"{name}.piece = {short(piece)}: must be dashpot, tangent, secant, bodies, drag, or a NamedTuple with the "
            "static method with_loss, whose first field is coefficient"
        )
    return _one_each(f"{name}.coefficients", loss.coefficients(mass.copy()), mass)


def fastest_rate(loss: Dissipation, mass: Vector, tangent: Vector, secant: Vector, speed: float) -> float:
    """Return the largest of a loss's rates, 1/s; a ValueError if they are not valid."""
    rates = loss.rates(mass, tangent, secant, speed)
    return float(_one_each(f"{type(loss).__name__}.rates", rates, mass).max())


def _one_each(name: str, answer: Any, mass: Vector) -> Vector:
    numbers = np.asarray(answer)
    right = numbers.dtype.kind in "fiu" and numbers.shape == mass.shape
    if not right or not np.all((numbers >= 0.0) & (numbers < np.inf)):
        raise ValueError(
            f"{name} = {short(answer)}: must be {mass.size} finite numbers, one for each contact with that of striker "
            "and structure, and none negative"
        )
    return np.array(numbers, dtype=float)


class _Even(Dissipation):
    """A loss that has the same coefficient everywhere, its first number."""

    def coefficients(self, mass: Vector) -> Vector:
        return np.full_like(mass, getattr(self, fields(self)[0].name))  # type: ignore[arg-type]


@described
class LinearDashpot(_Even):
    """A force γ dδ/dt in addition to the elastic one while beads touch (Khatri's thesis, section 6.1, equation 6.1).

    Parameters
    ----------
    coefficient : float
        γ, N s/m. The thesis gives no value; 4 to 6 reproduces its amplitude ratios on steel.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 10, bead, impact_speed=0.4, dissipation=hl.LinearDashpot(5.0))
    >>> chain.dissipation
    LinearDashpot(coefficient=5.0)
    """

    coefficient: Annotated[float, Quantity("N s/m", "a coefficient", "5 N s/m", or_zero=True)]
    piece = "dashpot"


@described
class PowerDashpot(_Even):
    """A viscous force that grows as a power of a rate (Khatri's thesis, section 4.2, equation 4.1).

    "pairwise" acts between touching beads, γ |dδ/dt|^α against the approach rate. It keeps momentum. "thesis" is
    equation 4.1 with γ > 0, a force on each bead by the difference of the approach rates at its two contacts. It keeps
    momentum for α = 1 only (docs/theory.md).

    Parameters
    ----------
    coefficient : float
        γ, N (s/m)^α.
    exponent : float
        α, from 1 to 5.
    form : str
        "pairwise" or "thesis".

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.PowerDashpot(coefficient=5.58, exponent=1.81, form="thesis")
    PowerDashpot(coefficient=5.58, exponent=1.81, form='thesis')
    """

    coefficient: Annotated[float, Quantity("N (s/m)^α", or_zero=True, written="")]
    exponent: Annotated[float, Quantity(low=1.0, high=5.0)] = 1.0
    form: Annotated[str, OneOf("pairwise", "thesis")] = "pairwise"

    @property
    def piece(self) -> str:  # type: ignore[override]
        return "dashpot" if self.form == "pairwise" else "bodies"


@described
class MassProportional(_Even):
    """A drag −α₁ m v on every bead and the striker, Rayleigh's mass-proportional damping. Momentum is lost.

    Parameters
    ----------
    rate : float
        α₁, 1/s. The thesis prints 6900 "N s/m" for a chain of steel spheres, but the unit is 1/s.

    References
    ----------
    Khatri's thesis, equation 4.4.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.MassProportional(rate=6900.0)
    MassProportional(rate=6900.0)
    """

    rate: Annotated[float, Quantity("1/s", "a rate", "6900 1/s", or_zero=True)]
    piece = "drag"


@described
class KuwabaraKono(_Even):
    """Viscoelastic spheres: a force τ dF/dt in addition to the elastic F, so 3/2 k τ √δ dδ/dt for Hertz's contacts.

    Parameters
    ----------
    time : float
        Relaxation time τ, s.

    References
    ----------
    Kuwabara and Kono, Jpn. J. Appl. Phys. 26 (1987) 1230.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.KuwabaraKono(time=1e-6)
    KuwabaraKono(time=1e-06)
    """

    time: Time
    piece = "tangent"


@described
class Tsuji(Dissipation):
    """A force α √(m k) δ^¼ dδ/dt, m the reduced mass: a collision's restitution does not depend on its speed.

    For laws other than Hertz's δ^¼ √k becomes √[(dF/dδ + F/δ)/2.5], which has the same property.

    Parameters
    ----------
    coefficient : float
        α, dimensionless.

    References
    ----------
    Tsuji, Tanaka and Ishida, Powder Technol. 71 (1992) 239, equation 5.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.Tsuji(coefficient=0.07)
    Tsuji(coefficient=0.07)
    """

    coefficient: Annotated[float, Quantity(or_zero=True)]
    piece = "secant"

    def coefficients(self, mass: Vector) -> Vector:
        return self.coefficient * np.sqrt(mass / 1.25)


@described
class Restitution(Dissipation):
    """Tsuji's law with the coefficient that gives a binary collision this coefficient of restitution.

    In ξ = δ^{5/4} the collision is a linear oscillator of damping ratio ζ = α/√5; it ends where the force would begin
    to pull, so e = exp(−2θ/tan θ) with θ = arccos ζ. For ζ > 1, below e = exp(−2), θ is imaginary.

    Parameters
    ----------
    coefficient : float
        e, rebound over approach speed, from 0.01 to 1, at any speed.

    References
    ----------
    Antypov and Elliott, EPL 94 (2011) 50004.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.Restitution(0.97).damping_ratio, 4)
    0.0098
    """

    coefficient: Annotated[float, Quantity(low=0.01, high=1.0)]
    piece = "secant"

    def coefficients(self, mass: Vector) -> Vector:
        return 2.0 * self.damping_ratio * np.sqrt(mass)

    @property
    def damping_ratio(self) -> float:
        """Damping ratio ζ of the oscillator."""
        from scipy.optimize import brentq

        wanted = -np.log(self.coefficient) / 2.0
        if wanted < 1e-5:
            # To second order: so near to π/2 the angle would lose most digits of its cosine.
            return float(2.0 / np.pi * wanted) * (1.0 + 4.0 / np.pi**2 * float(wanted))
        if wanted < 1.0:
            return cos(brentq(lambda angle: angle / np.tan(angle) - wanted, 1e-9, np.pi / 2.0, xtol=1e-15))
        if wanted == 1.0:
            return 1.0
        return cosh(brentq(lambda angle: angle / np.tanh(angle) - wanted, 1e-9, wanted + 1.0, xtol=1e-15))
