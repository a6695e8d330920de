"""Closed forms for impact on elastic bodies."""

from math import gamma, pi, sqrt
from typing import TypeVar

from structures.structure import Vector

Number = TypeVar("Number", float, Vector)

HERTZ_COLLISION = 2.0 * 1.25**0.4 * sqrt(pi) * gamma(1.4) / gamma(0.9)
"""3.2180655: duration of Hertz's collision in units of (m²/k²v)^{1/5}; the thesis prints 3.218."""


def contact_time_half_space(mass: Number, stiffness: Number, speed: float) -> Number:
    """Time in contact, s, of a mass (kg) that hits a Hertzian contact k (N/m^1.5) at a speed (m/s).

    T = 3.218 (m² / k² v)^{1/5} (Tillett 1954; thesis, section 6.1.1, equation 6.8, where V_s means the speed).
    Two free bodies: the reduced mass m₁m₂/(m₁ + m₂).
    """
    return HERTZ_COLLISION * (mass / stiffness) ** 0.4 / speed**0.2  # type: ignore[no-any-return]
