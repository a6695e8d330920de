"""Zener's impact of a sphere on an infinite thin plate: rebound and time in contact, by the inelasticity parameter λ.

A sphere with a Hertzian contact meets a plate whose struck point moves at the speed F/(8√(Dρt)) under a force F. In
units of Hertz's collision the approach obeys σ″ + (1 + λ d/dτ) σ^{3/2} = 0 with σ = 0 and σ′ = 1 at τ = 0 (Zener, Phys.
Rev. 59 (1941) 669; Khatri's thesis, equations 6.35 and 6.36). λ is the only parameter of the impact. Bending waves
carry the lost energy away.
"""

from functools import cache
from math import pi
from typing import TypeVar

import numpy as np
import scipy
from numpy.polynomial import Chebyshev
from scipy.special import beta, betainc

from structures.checks import each, not_negative
from structures.structure import Vector

Number = TypeVar("Number", float, Vector)

LARGE_INELASTICITY = 4.0
"""Up to this λ, e and τ_c are interpolated in λ. Above it the laws of large λ hold, to exp(−4.5 λ^{5/3}) = 2e-20."""

LARGEST_SAMPLE = 12.0
"""τ_c/λ of large λ is interpolated in λ^{−5/3} through samples up to this λ."""


def restitution(inelasticity: Number) -> Number:
    """Return the coefficient of restitution e of a sphere that hits an infinite thin plate: −σ′ when σ is 0 again.

    Parameters
    ----------
    inelasticity : float or ndarray
        λ ≥ 0, as of `theory.PlateImpact`.

    Returns
    -------
    float or ndarray
        e in (0, 1], with a relative error of 1e-9: 1 − 1.7302 λ for small λ, 0.67930 λ⁻⁵ for λ > 4.

    Raises
    ------
    ValueError
        If a λ is negative or not finite.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.zener_restitution(0.32), 4)
    0.5865
    """
    number = each(not_negative, "inelasticity", inelasticity)
    beyond = np.maximum(number, LARGE_INELASTICITY) / LARGE_INELASTICITY
    return _like(inelasticity, np.exp(_small()[0](np.minimum(number, LARGE_INELASTICITY))) * beyond**-5.0)


def contact_time(inelasticity: Number) -> Number:
    """Return the time in contact τ_c of a sphere with an infinite thin plate, in units (m²/k²v)^{1/5} of a collision.

    Parameters
    ----------
    inelasticity : float or ndarray
        λ ≥ 0, as of `theory.PlateImpact`.

    Returns
    -------
    float or ndarray
        τ_c, with a relative error of 1e-9: 3.2180655 (1 + 0.17302 λ) for small λ, λ (5 ln λ − 0.35937) + 3 λ^{−2/3} for
        large λ.

    Raises
    ------
    ValueError
        If a λ is negative or not finite.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.zener_contact_time(0.0), 4)
    3.2181
    """
    number = each(not_negative, "inelasticity", inelasticity)
    large = np.maximum(number, LARGE_INELASTICITY)
    tail = large * (5.0 * np.log(large) + _large()(large ** (-5.0 / 3.0)))
    small = _small()[1](np.minimum(number, LARGE_INELASTICITY))
    return _like(inelasticity, np.where(number > LARGE_INELASTICITY, tail, small))


@cache
def _small() -> tuple[Chebyshev, Chebyshev]:
    """Return ln e and τ_c as functions of λ from 0 to 4."""
    domain = [0.0, LARGE_INELASTICITY]
    first = Chebyshev.interpolate(lambda number: _impact(number)[0], 48, domain=domain)
    second = Chebyshev.interpolate(lambda number: _impact(number)[1], 48, domain=domain)
    return first, second


@cache
def _large() -> Chebyshev:
    """Return τ_c/λ − 5 ln λ as a function of x = λ^{−5/3}, from 4^{−5/3} down to 0.

    S = λ⁴σ, Q = λ⁵q and T = τ/λ obey equations without λ, with S = 0 and Q = λ⁵ at the start. For large Q all motions
    approach one slow motion, σ^{3/2} ≈ q/λ, and differ at the end by exp(−4.5/x) only. Therefore e λ⁵ is a constant,
    and the present function is a series in x.
    """

    def excess(power: Vector) -> Vector:
        return np.asarray(_impact(power**-0.6)[1] * power**0.6 + 3.0 * np.log(power))

    domain = [LARGEST_SAMPLE ** (-5.0 / 3.0), LARGE_INELASTICITY ** (-5.0 / 3.0)]
    return Chebyshev.interpolate(excess, 10, domain=domain)


def _impact(inelasticity: Vector) -> Vector:
    """Return ln e and τ_c, of shape (2, n), of n parameters λ: one integration over the phase φ of the motion, from 0
    to π.

    With q = σ′ + λσ^{3/2} = R cos φ, √(4/5) σ^{5/4} = R sin φ and g = (5/4)^{3/5} (R sin φ)^{1/5}, the motion is
    d ln R/dφ = −λ g sin²φ / (1 − λ g sin φ cos φ) and dτ/dφ = 1 / (g (1 − λ g sin φ cos φ)); e = R at φ = π. The
    variable of integration is s, where φ = π I_s(5, 5) with the regularised incomplete beta function I. It makes the
    fifth roots at the ends smooth.
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

    path = scipy.integrate.solve_ivp(rates, (0.0, 1.0), np.zeros(2 * count), method="DOP853", rtol=1e-12, atol=1e-14)
    end: Vector = path.y[:, -1].reshape(2, count)
    return end


def _like(value: Number, result: Vector) -> Number:
    return float(result) if np.ndim(value) == 0 else result  # type: ignore[return-value]
