"""Losses of energy in a chain: at all contacts, where they conserve momentum, or on all bodies."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import fields
from math import acos, acosh, log, sqrt
from typing import Annotated, Any

import numpy as np

from particles.kernels.losses import Losses, NoLoss
from structures.checks import short
from structures.described import described
from structures.quantities import OneOf, Quantity, Time
from structures.structure import Vector

# The forms of a loss at a contact, in the order of `particles.kernels.losses`, and all forms with those on bodies.
CONTACT_PIECES = "dashpot", "tangent", "secant"
FORMS = *CONTACT_PIECES, "bodies", "drag"


class Dissipation(ABC):
    """A loss of energy. Derive a class from it for a loss of your own.

    A subclass defines the coefficients c and names the form of the force. With the approach rate δ̇ and the elastic
    force F, a closed contact has the force c δ̇^α ("dashpot"), c F′ δ̇^α ("tangent") or c √((F′ + F/δ)/2) δ̇^α ("secant").
    "bodies" is equation 4.1 of the thesis, and "drag" is a force c m v on each body. A form of your own is a NamedTuple
    with the static method `with_loss`; see docs/extending.md.

    Examples
    --------
    >>> isinstance(hl.LinearDashpot(5.0), hl.Dissipation)
    True
    """

    piece: str | type  # the form of the force
    exponent: float = 1.0  # power α of the rate

    @abstractmethod
    def coefficients(self, mass: Vector) -> Vector:
        """Return the coefficient c of each contact from the reduced masses of its bodies, kg."""

    def rates(self, mass: Vector, tangent: Vector, secant: Vector, speed: float) -> Vector:
        """Return the rate at which the loss would stop each contact, 1/s; it limits the step.

        mass: reduced masses, kg. tangent, secant: F′ and F/δ of contacts that hold all energy, N/m. speed: speed of the
        bodies, m/s. The default suits the forms above. For a piece of your own, return the derivative of its force with
        respect to the approach rate, divided by the mass.
        """
        # 4 for "bodies": a body has two contacts, and each contact joins two bodies.
        factor: dict[Any, Any] = {"tangent": tangent, "secant": np.sqrt(0.5 * (tangent + secant)), "bodies": 4.0}
        rates: Vector = coefficients_of(self, mass) * factor.get(self.piece, 1.0) * speed ** (self.exponent - 1.0)
        return rates if self.piece == "drag" else rates / mass


class _Uniform(Dissipation):
    """A loss with the same coefficient at every contact: its first field."""

    def coefficients(self, mass: Vector) -> Vector:
        return np.full_like(mass, getattr(self, fields(self)[0].name))  # type: ignore[arg-type]


@described
class LinearDashpot(_Uniform):
    """A force γ dδ/dt in addition to the elastic force while beads touch (Khatri's thesis, equation 6.1).

    Parameters
    ----------
    coefficient : float
        γ, N s/m. The thesis gives no value; 4 to 6 N s/m reproduces its amplitude ratios on steel.

    Examples
    --------
    >>> loss = hl.LinearDashpot(coefficient=5.0)
    """

    coefficient: Annotated[float, Quantity("N s/m", "a coefficient", "5 N s/m", or_zero=True)]
    piece = "dashpot"


@described
class PowerDashpot(_Uniform):
    """A viscous force proportional to a power of the rate (Khatri's thesis, equation 4.1; see docs/theory.md).

    Parameters
    ----------
    coefficient : float
        γ, N (s/m)^α.
    exponent : float
        α, from 1 to 5.
    form : str
        "pairwise": by the rate of each contact. "thesis": on each bead, by the difference of the rates at its contacts.

    Examples
    --------
    >>> loss = hl.PowerDashpot(coefficient=5.58, exponent=1.81, form="thesis")
    """

    coefficient: Annotated[float, Quantity("N (s/m)^α", or_zero=True, written="")]
    exponent: Annotated[float, Quantity(low=1.0, high=5.0)] = 1.0
    form: Annotated[str, OneOf("pairwise", "thesis")] = "pairwise"

    @property
    def piece(self) -> str:  # type: ignore[override]
        return "dashpot" if self.form == "pairwise" else "bodies"


@described
class MassProportional(_Uniform):
    """A drag −α₁ m v on every bead and the striker (Khatri's thesis, equation 4.4). Momentum is lost.

    Parameters
    ----------
    rate : float
        α₁, 1/s. The thesis prints 6900 "N s/m" for a chain of steel spheres, but the unit is 1/s.

    Examples
    --------
    >>> loss = hl.MassProportional(rate=6900.0)
    """

    rate: Annotated[float, Quantity("1/s", "a rate", "6900 1/s", or_zero=True)]
    piece = "drag"


@described
class KuwabaraKono(_Uniform):
    """A force τ dF/dt added to the elastic F: viscoelastic spheres (Kuwabara, Kono, Jpn J. Appl. Phys. 26 (1987) 1230).

    Parameters
    ----------
    time : float
        Relaxation time τ, s.

    Examples
    --------
    >>> loss = hl.KuwabaraKono(time=1e-6)
    """

    time: Time
    piece = "tangent"


@described
class Tsuji(Dissipation):
    """A force α √(m k) δ^¼ dδ/dt with the reduced mass m (Tsuji, Tanaka and Ishida, Powder Technol. 71 (1992) 239).

    The restitution of a collision does not depend on its speed. For laws that are not Hertz's, δ^¼ √k is replaced by
    √[(dF/dδ + F/δ)/2.5].

    Parameters
    ----------
    coefficient : float
        α, dimensionless.

    Examples
    --------
    >>> loss = hl.Tsuji(coefficient=0.07)
    """

    coefficient: Annotated[float, Quantity(or_zero=True)]
    piece = "secant"

    def coefficients(self, mass: Vector) -> Vector:
        return self.coefficient * np.sqrt(mass / 1.25)


@described
class Restitution(Dissipation):
    """Tsuji's loss for a coefficient of restitution (Antypov and Elliott, EPL 94 (2011) 50004).

    Parameters
    ----------
    coefficient : float
        e, the ratio of rebound speed to approach speed of two bodies, from 0.01 to 1.

    Examples
    --------
    >>> round(hl.Restitution(0.97).damping_ratio, 4)
    0.0098
    """

    coefficient: Annotated[float, Quantity(low=0.01, high=1.0)]
    piece = "secant"

    def coefficients(self, mass: Vector) -> Vector:
        return 2.0 * self.damping_ratio * np.sqrt(mass)

    @property
    def damping_ratio(self) -> float:
        """ζ from e = exp(−2θ/tan θ) with cos θ = ζ; θ is imaginary if ζ > 1."""
        from scipy.optimize import brentq

        def decay(ratio: float) -> float:
            sine = sqrt(abs((1.0 - ratio) * (1.0 + ratio)))
            angle = acos(ratio) if ratio < 1.0 else acosh(ratio)
            return ratio * angle / sine if sine > 0.0 else 1.0

        wanted = -0.5 * log(self.coefficient)
        return float(brentq(lambda ratio: decay(ratio) - wanted, 0.0, 10.0, xtol=1e-20, rtol=1e-15))


def coefficients_of(loss: Dissipation, mass: Vector) -> Vector:
    """Return the coefficients of a loss for these reduced masses, kg; raise a ValueError if they are not valid."""
    name, piece = type(loss).__name__, getattr(loss, "piece", None)
    if piece not in FORMS and getattr(piece, "_fields", ("",))[0] != "coefficient":
        raise ValueError(f"{name}.piece = {short(piece)}: must be {', '.join(FORMS)} or a NamedTuple with with_loss")
    answer = loss.coefficients(mass.copy())
    numbers = np.array(answer)
    right = numbers.dtype.kind in "fiu" and numbers.shape == mass.shape
    if not right or not np.all((numbers >= 0.0) & (numbers < np.inf)):
        raise ValueError(f"{name}.coefficients = {short(answer)}: must be {mass.size} finite numbers of zero or more")
    return numbers.astype(float)


def kernel_losses(losses: Sequence[tuple[Dissipation | None, Vector]], present: Vector, free: Vector) -> Any:
    """Return the losses of chains as a piece. losses: for each chain, its loss and its reduced masses, kg. present:
    whether there is a contact. free: whether the body behind it moves freely.
    """
    given = [loss for loss, _ in losses if loss is not None]
    if not given:
        return NoLoss()
    form: Any = np.zeros(present.size, np.int64)
    exponent = np.ones(present.size)
    coefficient, drag_rate, on_body = np.zeros((3, present.size))
    on_bodies: dict[Any, Any] = {"drag": (drag_rate, free), "bodies": (on_body, free)}
    begin = 0
    for loss, mass in losses:
        place, begin = slice(begin, begin + mass.size), begin + mass.size
        if loss is None:
            continue
        target, where = on_bodies.get(loss.piece, (coefficient, present))
        target[place], exponent[place] = np.where(where[place], coefficients_of(loss, mass), 0.0), loss.exponent
        if loss.piece in CONTACT_PIECES:
            form[place] = CONTACT_PIECES.index(loss.piece)

    # A user's own piece has one coefficient for each contact; its other numbers are the same for all contacts.
    piece: Any = next((loss.piece for loss in given if not isinstance(loss.piece, str)), None)
    if piece is None:
        return Losses(coefficient, exponent, form, drag_rate, on_body)
    alike = [loss for loss in given if loss.piece is piece]
    numbers = {tuple(getattr(loss, name) for name in piece._fields[1:]) for loss in alike}
    if len(numbers) > 1 or len(alike) < len(given):
        raise ValueError("dissipation: must be the same in all chains of a run if it has a piece of its own")
    return piece(coefficient, *numbers.pop())
