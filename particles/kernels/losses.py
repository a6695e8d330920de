"""Losses as pieces: forces of closed contacts beside the elastic one, and forces on single bodies."""

from math import sqrt
from typing import Any, NamedTuple

from particles.kernels.laws import (
    NEGLIGIBLE,
    NOT_NEGATIVE,
    elastic_overlap,
    force,
    force_of_step,
    overlap_on_spring,
    slope,
)
from structures.kernels.compiling import inner
from structures.kernels.pieces import by_type
from structures.structure import Vector


class Bodies(NamedTuple):
    """The bodies of a chain in a window."""

    y: Vector
    """m."""
    v: Vector
    """Half a step behind `y`, but at the ends of the window, m/s."""
    ahead: Vector
    """What losses see: velocities predicted for the time of `y`, m/s. Without losses it is not filled."""
    lost: Vector
    """The energy lost in the contact ahead of each body, and by its drag, J; likewise."""


class Pace(NamedTuple):
    """A step, and by how much of it velocities and positions move on: less at the ends of a window."""

    dt: float
    kick: float
    drift: float


class Approach(NamedTuple):
    """The approach of a contact's bodies."""

    now: float
    """m."""
    rate: float
    """As losses see it, m/s."""


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


@by_type
def drag(loss: Any, i: int, speed: float, inverse_mass: float) -> tuple[float, float]:
    """Return the deceleration of body i by a drag, m/s², and the power that it takes, W."""
    return 0.0, 0.0


@by_type
def loses(loss: Any) -> bool:
    """Return whether anything loses energy but by yielding."""
    return True


@by_type
def flying(loss: Any, chain: Any, bodies: Any, window: float) -> int:
    """Return how many bodies, from the first on, keep their velocities over a window: their contacts stay open."""
    last = chain.inverse_mass.size - 1
    for i in range(last):
        approach, change = bodies.y[i] - bodies.y[i + 1], window * (bodies.v[i] - bodies.v[i + 1])
        if chain.gravity[i] != 0.0 or approach >= 0.0 or approach + change >= 0.0:
            return i
    return last


@by_type
def begin_losses(loss: Any, bodies: Any, first: int, last: int) -> None:
    """Let bodies have lost nothing in a window, and have the velocities that losses see."""
    for i in range(first & NOT_NEGATIVE, (last + 1) & NOT_NEGATIVE):
        bodies.ahead[i], bodies.lost[i] = bodies.v[i], 0.0


@by_type
def energy_lost(loss: Any, bodies: Any, last: int) -> float:
    """Return the energy that bodies have lost in a window, J."""
    lost = 0.0
    for i in range(last + 1):
        lost += bodies.lost[i]
    return lost


@by_type
def press(loss: Any, law: Any, i: int, approach: Any, spring: float, lost: Vector, kick: float) -> float:
    """Return the force of contact i at an Approach that it really has, N, and remember this; add what it loses.

    spring: the flexibility of a massless spring at the contact, m/N.
    """
    overlap = overlap_at(law, i, approach.now, spring)
    total, power = force_and_loss(law, loss, i, overlap, approach.rate, spring)
    force_of_step(law, i, overlap)
    lost[i] += kick * power
    return total


@by_type
def move_body(loss: Any, chain: Any, bodies: Any, i: int, force: float, pace: Any) -> None:
    """Move a body on by the sum of its contact forces."""
    slowing, power = drag(loss, i, bodies.ahead[i], chain.inverse_mass[i])
    acceleration = chain.inverse_mass[i] * force + chain.gravity[i] - slowing
    speed = bodies.v[i] + pace.kick * acceleration
    bodies.v[i], bodies.ahead[i] = speed, speed + 0.5 * pace.dt * acceleration
    bodies.y[i] += pace.drift * speed
    bodies.lost[i] += pace.kick * power


@by_type
def move_between(loss: Any, law: Any, chain: Any, bodies: Any, behind: float, pace: Any, begin: int, end: int) -> float:
    """Move bodies on over a step, by the force behind the first and those of their contacts; return the last force."""
    y, ahead = bodies.y, bodies.ahead
    for i in range(begin & NOT_NEGATIVE, end & NOT_NEGATIVE):
        approach = Approach(y[i] - y[i + 1], ahead[i] - ahead[i + 1])
        contact = press(loss, law, i, approach, 0.0, bodies.lost, pace.kick)
        move_body(loss, chain, bodies, i, behind - contact, pace)
        behind = contact
    return behind


@inner(forceinline=True)
def overlap_at(law: Any, i: int, approach: float, flexibility: float) -> float:
    """Return the part of an approach, m, that is the contact's own; the rest is that of a massless spring."""
    return approach if flexibility == 0.0 else overlap_on_spring(law, i, approach, flexibility)


@inner(forceinline=True)
def force_and_loss(law: Any, loss: Any, i: int, overlap: float, rate: float, flexibility: float) -> tuple[float, float]:
    """Return the force of a contact, N, and the power that its loss takes, W.

    rate: of approach, m/s. The loss acts on the contact's own part of it, and a massless spring of this flexibility
    (m/N) yields to the loss: to first order.
    """
    elastic, released = force(law, i, overlap), elastic_overlap(law, i, overlap)
    # A striker that just touches pushes its dashpot at once. A dent that is not touched any more has no loss.
    if released < 0.0:
        return 0.0, 0.0
    tangent = slope(law, i, overlap)
    if flexibility == 0.0:
        total = force_with_loss(loss, i, elastic, tangent, released, rate)
    else:
        share = 1.0 / (1.0 + flexibility * tangent)
        lossy = force_with_loss(loss, i, elastic, tangent, released, share * rate)
        total = elastic + share * (lossy - elastic)
        total = 0.0 if total < 0.0 else total
    return total, (total - elastic) * rate


@inner(forceinline=True)
def power_of_rate(rate: float, exponent: float) -> float:
    """Return sign(δ̇) |δ̇|^α."""
    if exponent == 1.0:
        return rate
    size = abs(rate) ** exponent
    return size if rate > 0.0 else -size


class NoLoss(NamedTuple):
    """An elastic chain."""

    @staticmethod
    def loses(loss: Any) -> bool:
        return False

    @staticmethod
    def begin_losses(loss: Any, bodies: Any, first: int, last: int) -> None:
        return None

    @staticmethod
    def energy_lost(loss: Any, bodies: Any, last: int) -> float:
        return 0.0

    @staticmethod
    def press(loss: Any, law: Any, i: int, approach: Any, spring: float, lost: Vector, kick: float) -> float:
        return force_of_step(law, i, overlap_at(law, i, approach.now, spring))

    @staticmethod
    def move_body(loss: Any, chain: Any, bodies: Any, i: int, force: float, pace: Any) -> None:
        speed = bodies.v[i] + pace.kick * (chain.inverse_mass[i] * force + chain.gravity[i])
        bodies.v[i] = speed
        bodies.y[i] += pace.drift * speed

    @staticmethod
    def move_between(
        loss: Any, law: Any, chain: Any, bodies: Any, behind: float, pace: Any, begin: int, end: int
    ) -> float:
        y, v = bodies.y, bodies.v
        for i in range(begin & NOT_NEGATIVE, end & NOT_NEGATIVE):
            ahead = force_of_step(law, i, y[i] - y[i + 1])
            v[i] += pace.kick * (chain.inverse_mass[i] * (behind - ahead) + chain.gravity[i])
            y[i] += pace.drift * v[i]
            behind = ahead
        return behind


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
    def flying(loss: Any, chain: Any, bodies: Any, window: float) -> int:
        return 0

    @staticmethod
    def drag(loss: Any, i: int, speed: float, inverse_mass: float) -> tuple[float, float]:
        # Not of a body with a prescribed motion.
        slowing = loss.coefficient[i] * (speed if inverse_mass > 0.0 else 0.0 * speed)
        return slowing, slowing * speed / inverse_mass if inverse_mass > 0.0 else slowing

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
