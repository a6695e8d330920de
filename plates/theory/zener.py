"""Zener's impact of a sphere on an infinite thin plate: rebound and time in contact, by the inelasticity parameter λ.

A sphere on a Hertzian spring meets a plate that yields at a speed of force over 8√(Dρt). In units of Hertz's collision
its approach obeys σ″ + (1 + λ d/dτ) σ^{3/2} = 0, σ = 0 and σ′ = 1 at τ = 0 (Zener, Phys. Rev. 59 (1941) 669; thesis,
equations 6.35 and 6.36), and λ is all that tells one impact from another. Bending waves carry the lost energy away.
"""

from functools import cache
from math import pi
from typing import TypeVar

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.integrate import solve_ivp
from scipy.special import beta, betainc

from structures.checks import each, not_negative
from structures.structure import Vector

Number = TypeVar("Number", float, Vector)

LAST, FARTHEST = 4.0, 12.0
"""λ up to which e and τ_c are interpolated in λ; and up to which the laws of large λ are fitted."""


def restitution(inelasticity: Number) -> Number:
    """e of a sphere on an infinite thin plate: rebound over approach speed, −σ′ at the return to σ = 0; any λ ≥ 0.

    (Thesis, section 6.2.1, which prints the condition as dσ/dτ → 0.) To 1e-9 of itself. Small λ: e = 1 − 1.7302 λ with
    (5/4)^{3/5} B(8/5, 1/2); λ > 4: e = 0.67930 λ⁻⁵, not exponentially small. λ comes from
    `impact.inelasticity_parameter`, which says what it holds for.
    """
    number = each(not_negative, "inelasticity", inelasticity)
    beyond = np.maximum(number, LAST) / LAST
    return _like(inelasticity, np.exp(_small()[0](np.minimum(number, LAST))) * beyond**-5.0)


def contact_time(inelasticity: Number) -> Number:
    """τ_c: time in contact of a sphere with an infinite thin plate, in units of (m²/k²v)^{1/5}; any λ ≥ 0.

    (Thesis, equation 6.38 and figure 6.17.) To 1e-9 of itself. Small λ: τ_c = 3.2180655 (1 + 0.17302 λ); large λ:
    τ_c = λ (5 ln λ − 0.35937) + 3 λ^{−2/3}. `impact.contact_time` gives it in seconds.
    """
    number = each(not_negative, "inelasticity", inelasticity)
    large = np.maximum(number, LAST)
    tail = large * (5.0 * np.log(large) + _large()(large ** (-5.0 / 3.0)))
    return _like(inelasticity, np.where(number > LAST, tail, _small()[1](np.minimum(number, LAST))))


@cache
def _small() -> tuple[Chebyshev, Chebyshev]:
    """ln e and τ_c over λ from 0 to 4."""
    return (
        Chebyshev.interpolate(lambda number: _impact(number)[0], 48, domain=[0.0, LAST]),
        Chebyshev.interpolate(lambda number: _impact(number)[1], 48, domain=[0.0, LAST]),
    )


@cache
def _large() -> Chebyshev:
    """τ_c/λ − 5 ln λ over x = λ^{−5/3}, from 4^{−5/3} down to 0.

    S = λ⁴σ, Q = λ⁵q and T = τ/λ obey equations without λ, from S = 0, Q = λ⁵. From far off all motions join one slow
    one, σ^{3/2} ≈ q/λ, and differ at the end by exp(−4.5/x) only. So e λ⁵ is a constant and this here a series in x.
    """

    def excess(power: Vector) -> Vector:
        number: Vector = power**-0.6
        shifted: Vector = _impact(number)[1] / number - 5.0 * np.log(number)
        return shifted

    return Chebyshev.interpolate(excess, 10, domain=[FARTHEST ** (-5.0 / 3.0), LAST ** (-5.0 / 3.0)])


def _impact(inelasticity: Vector) -> Vector:
    """ln e and τ_c, 2 × n, of n parameters λ, in one integration over the phase φ of the motion, from 0 to π.

    Where q = σ′ + λσ^{3/2} = R cos φ, √(4/5) σ^{5/4} = R sin φ, g = (5/4)^{3/5} (R sin φ)^{1/5}, the motion is
    d ln R/dφ = −λ g sin²φ / (1 − λ g sin φ cos φ), dτ/dφ = 1 / (g (1 − λ g sin φ cos φ)), and e = R at φ = π. Taken
    over s with φ = π I_s(5, 5), the regularised incomplete beta function, the fifth roots at the ends become smooth.
    """
    count = inelasticity.size

    def rates(s: float, state: Vector) -> Vector:
        sine = max(np.sin(pi * betainc(5.0, 5.0, min(s, 1.0 - s))), 1e-300)
        cosine = np.cos(pi * betainc(5.0, 5.0, s))
        pace = pi * (s * (1.0 - s)) ** 4 / beta(5.0, 5.0)
        g = 1.25**0.6 * (np.exp(state[:count]) * sine) ** 0.2
        advance = 1.0 - inelasticity * g * sine * cosine
        changes: Vector = np.concatenate([-inelasticity * g * sine**2, 1.0 / g]) * np.tile(pace / advance, 2)
        return changes

    path = solve_ivp(rates, (0.0, 1.0), np.zeros(2 * count), method="DOP853", rtol=1e-12, atol=1e-14)
    end: Vector = path.y[:, -1].reshape(2, count)
    return end


def _like(value: Number, result: Vector) -> Number:
    return float(result) if np.ndim(value) == 0 else result  # type: ignore[return-value]
