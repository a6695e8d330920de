"""Losses as pieces: forces of closed contacts beside the elastic one, and forces on single bodies."""

from math import sqrt
from typing import Any, NamedTuple

from particles.kernels.laws import NEGLIGIBLE
from structures.kernels.kernel_cache import inner
from structures.kernels.pieces import by_type
from structures.structure import Vector


@by_type
def force_with_loss(loss: Any, i: int, elastic: float, slope: float, overlap: float, rate: float) -> float:
    """Return the force of closed contact i with its loss, N.

    elastic, slope, overlap: its force, the slope of this force, and the part of its overlap that it gives back. rate:
    of approach, m/s.
    """
    return elastic


@by_type
def lose_on_bodies(loss: Any, y: Vector, v: Vector, wall: float, rate: float, inverse_mass: Vector, a: Vector) -> float:
    """Add to the accelerations the losses that act on single bodies. Return the power that they take, W."""
    return 0.0


@by_type
def drag_rate(loss: Any, i: int) -> float:
    """Return the rate c of a drag −c m v on body i and its modes, 1/s."""
    return 0.0


@inner(forceinline=True)
def power_of_rate(rate: float, exponent: float) -> float:
    """Return sign(δ̇) |δ̇|^α."""
    if exponent == 1.0:
        return rate
    size = abs(rate) ** exponent
    return size if rate > 0.0 else -size


class NoLoss(NamedTuple):
    """An elastic chain."""


DASHPOT, TANGENT, SECANT = range(3)
"""With what a ContactLoss grows: with nothing, with the slope of the elastic force, or with a mean of two slopes."""


class ContactLoss(NamedTuple):
    """A force c g δ̇^α. One piece has the three forms of g: each combination of pieces compiles for seconds."""

    coefficient: Vector
    """c of each contact; zero where nothing is."""
    exponent: float
    form: int
    """DASHPOT: g is 1; TANGENT: F′; SECANT: √[(F′ + F/δ)/2]."""

    @staticmethod
    def force_with_loss(loss: Any, i: int, elastic: float, slope: float, overlap: float, rate: float) -> float:
        grown = 1.0
        if loss.form == TANGENT:
            grown = slope
        elif loss.form == SECANT:
            grown = sqrt(0.5 * (slope + elastic / overlap)) if overlap > NEGLIGIBLE else 0.0
        return max(elastic + loss.coefficient[i] * grown * power_of_rate(rate, loss.exponent), 0.0)


class Drag(NamedTuple):
    """A force −c m v on each body and its modes."""

    coefficient: Vector
    """c of each body, 1/s."""

    @staticmethod
    def drag_rate(loss: Any, i: int) -> float:
        return float(loss.coefficient[i])

    @staticmethod
    def lose_on_bodies(
        loss: Any, y: Vector, v: Vector, wall: float, rate: float, inverse_mass: Vector, a: Vector
    ) -> float:
        power, bodies = 0.0, inverse_mass.size
        for i in range(bodies):
            if inverse_mass[i] > 0.0:
                a[i] -= loss.coefficient[i] * v[i]
                power += loss.coefficient[i] * v[i] * v[i] / inverse_mass[i]
        return power


class BodyLoss(NamedTuple):
    """Equation 4.1 of Khatri's thesis: a force on each body by the difference of the approach rates at its contacts."""

    coefficient: Vector
    exponent: float
    present: Vector
    """One where there is a contact, else zero."""

    @staticmethod
    def lose_on_bodies(
        loss: Any, y: Vector, v: Vector, wall: float, rate: float, inverse_mass: Vector, a: Vector
    ) -> float:
        """Add the loss where it takes energy; return the power that it takes, W."""
        power, bodies = 0.0, inverse_mass.size
        for i in range(bodies):
            power -= body_loss(loss, i, y, v, wall, rate, inverse_mass) * v[i]
        # In a chain that moves as a whole this law could feed energy; then it is left out.
        if power <= 0.0:
            return 0.0
        for i in range(bodies):
            a[i] += inverse_mass[i] * body_loss(loss, i, y, v, wall, rate, inverse_mass)
        return power


@inner(forceinline=True)
def body_loss(loss: Any, i: int, y: Vector, v: Vector, wall: float, rate: float, inverse_mass: Vector) -> float:
    """Return the force of equation 4.1 on body i, N."""
    last, difference = inverse_mass.size - 1, 0.0
    if i > 0 and y[i - 1] >= y[i]:
        difference += loss.present[i - 1] * (v[i - 1] - v[i])
    beyond, beyond_rate = (y[i + 1], v[i + 1]) if i < last else (wall, rate)
    if y[i] >= beyond:
        difference -= loss.present[i] * (v[i] - beyond_rate)
    if inverse_mass[i] == 0.0 or difference == 0.0:
        return 0.0
    return loss.coefficient[i] * power_of_rate(difference, loss.exponent)
