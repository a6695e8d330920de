"""Losses as pieces: forces of closed contacts added to the elastic ones, and forces on single bodies."""

from math import sqrt
from typing import Any, NamedTuple

from particles.kernels.laws import NEGLIGIBLE, elastic_overlap, force, force_of_step, overlap_on_spring, slope
from structures.kernels.compiling import inner
from structures.kernels.pieces import by_type
from structures.structure import Vector


@by_type
def with_loss(loss: Any, i: int, elastic: float, slope: float, overlap: float, rate: float) -> float:
    """Return the force of closed contact i with its loss, N. elastic, slope: the elastic force and its slope. overlap:
    its elastic part, m. rate: of approach, m/s.
    """
    return elastic


@by_type
def loses(loss: Any) -> bool:
    """Return whether energy is lost other than by yielding."""
    return True


@by_type
def drag(loss: Any, i: int) -> float:
    """Return the rate c of a drag −c m v on body i and its modes, 1/s."""
    return 0.0


@by_type
def force_on_body(loss: Any, i: int, behind: float, ahead: float) -> float:
    """Return the force on body i, N, due to the difference of the approach rates of its contacts, m/s; 0 if open."""
    return 0.0


@inner(forceinline=True)
def overlap_at(law: Any, i: int, approach: float, flexibility: float) -> float:
    """Return the contact's own part of an approach, m; the rest is that of a massless spring of a flexibility, m/N."""
    return approach if flexibility == 0.0 else overlap_on_spring(law, i, approach, flexibility)


@inner(forceinline=True)
def force_and_loss(
    law: Any, loss: Any, i: int, approach: float, overlap: float, elastic: float, rate: float, flexibility: float
) -> tuple[float, float]:
    """Return the force of a contact, N, and the power of its loss, W, from its elastic force, N. overlap: the contact's
    own part of the approach, m. The loss depends on that part of the rate, m/s. To first order, the deformation of a
    massless spring (m/N) is included.
    """
    # A striker that just touches has a loss at once. A dent that is no longer touched has none.
    if elastic_overlap(law, i, approach) < 0.0:
        return elastic, 0.0
    released, tangent = elastic_overlap(law, i, overlap), slope(law, i, overlap)
    if flexibility == 0.0:
        total = with_loss(loss, i, elastic, tangent, released, rate)
    else:
        share = 1.0 / (1.0 + flexibility * tangent)
        lossy = with_loss(loss, i, elastic, tangent, released, share * rate)
        total = elastic + share * (lossy - elastic)
        total = 0.0 if total < 0.0 else total
    return total, (total - elastic) * rate


@inner(forceinline=True)
def press(
    loss: Any, law: Any, i: int, approach: float, rate: float, flexibility: float, kick: float, lost: Vector
) -> float:
    """Return the force of contact i at the approach at the end of a step, N, and add its loss in the time `kick`, J."""
    overlap = overlap_at(law, i, approach, flexibility)
    if not loses(loss):
        return force_of_step(law, i, overlap)
    total, power = force_and_loss(law, loss, i, approach, overlap, force(law, i, overlap), rate, flexibility)
    force_of_step(law, i, overlap)
    lost[i] += kick * power
    return total


@inner(forceinline=True)
def move_body(
    loss: Any, chains: Any, i: int, y: Vector, v: Vector, ahead: Vector, lost: Vector, force: float, dt: float,
    kick: float, drift: float,
) -> None:  # fmt: skip
    """Move a body by the sum of its contact forces: the velocity for the time `kick`, the position for `drift`."""
    acceleration = chains.inverse_mass[i] * force + chains.gravity[i]
    if loses(loss) and chains.inverse_mass[i] > 0.0:
        slowing = drag(loss, i) * ahead[i]
        acceleration -= slowing
        lost[i] += kick * slowing * ahead[i] / chains.inverse_mass[i]
    v[i] += kick * acceleration
    if loses(loss):
        ahead[i] = v[i] + 0.5 * dt * acceleration
    y[i] += drift * v[i]


class NoLoss(NamedTuple):
    """No loss: elastic chains."""

    @staticmethod
    def loses(loss: Any) -> bool:
        return False


# The factor g of the loss of a contact: 1, F′, or √[(F′ + F/δ)/2].
DASHPOT, TANGENT, SECANT = range(3)


class Losses(NamedTuple):
    """A force c g δ̇^α of each contact, and forces on each body.

    One piece has all forms, because each combination of pieces takes seconds to compile. Coefficients are zero without
    a contact, and for a body with a prescribed motion.
    """

    coefficient: Vector  # c of each contact
    exponent: Vector  # α of each contact and body
    form: Vector  # g: DASHPOT, TANGENT or SECANT
    drag_rate: Vector  # c of the drag on each body, 1/s
    on_body: Vector  # c of a force by the difference of the approach rates at a body's contacts (thesis, equation 4.1)

    @staticmethod
    def with_loss(loss: Any, i: int, elastic: float, slope: float, overlap: float, rate: float) -> float:
        grown = 1.0
        if loss.form[i] == TANGENT:
            grown = slope
        elif loss.form[i] == SECANT:
            grown = sqrt(0.5 * (slope + elastic / overlap)) if overlap > NEGLIGIBLE else 0.0
        return max(elastic + loss.coefficient[i] * grown * power_of_rate(rate, loss.exponent[i]), 0.0)

    @staticmethod
    def drag(loss: Any, i: int) -> float:
        return float(loss.drag_rate[i])

    @staticmethod
    def force_on_body(loss: Any, i: int, behind: float, ahead: float) -> float:
        return float(loss.on_body[i] * power_of_rate(behind - ahead, loss.exponent[i]))


@inner(forceinline=True)
def power_of_rate(rate: float, exponent: float) -> float:
    """Return sign(δ̇) |δ̇|^α."""
    if exponent == 1.0:
        return rate
    size = abs(rate) ** exponent
    return size if rate > 0.0 else -size
