"""Closed forms for impact on elastic bodies: one bead, or a chain, on a half-space, a rod, or two layers. SI units.

The last bead stands for the whole chain (Khatri's thesis, section 6.1), without losses, gravity or preload;
docs/theory.md compares the forms with chains. Functions take numbers or arrays, which broadcast, and return the same.
"""

from math import gamma, pi, sqrt
from typing import Any, TypeAlias

import numpy as np

from structures.checks import each, not_negative, plain, positive, within
from structures.structure import Vector

Number: TypeAlias = float | Vector

# 3.2180655: duration of Hertz's collision in units of (m²/k²v)^{1/5}; the thesis prints 3.218
HERTZ_COLLISION = 2.0 * 1.25**0.4 * sqrt(pi) * gamma(1.4) / gamma(0.9)

# 1.1803400: time in which the wave passes one bead, in the same units for a striker of speed v that equals the beads
# (equations 6.12 and 6.16). The thesis prints 1.180, twice this value as 2.361, and half of 2.361 as 1.181.
BEAD_TRANSIT = (25.0 / 16.0 / 0.682) ** 0.2


def contact_time(mass: Number, stiffness: Number, speed: float) -> Any:
    """Time in contact T = 3.218 (m²/k²v)^{1/5} of a mass that hits a Hertzian contact (Tillett; equation 6.8).

    Parameters
    ----------
    mass, stiffness, speed : float or ndarray
        Mass m, kg (for two free bodies m₁m₂/(m₁ + m₂)); k of Hertz's law, N/m^1.5; approach speed v, m/s.

    Returns
    -------
    float or ndarray
        T, s.

    Examples
    --------
    >>> round(hl.theory.hertz_contact_time(mass=3.5e-3, stiffness=9.8e9, speed=0.44) * 1e6, 1)
    39.8
    """
    m, k = each(positive, "mass", mass, "kg"), each(positive, "stiffness", stiffness, "N/m^1.5")
    return plain(HERTZ_COLLISION * (m / k) ** 0.4 / each(positive, "speed", speed, "m/s") ** 0.2)


def time_of_flight(
    beads: float,
    mass: float,
    chain_stiffness: float,
    wall_stiffness: Number,
    striker_speed: float,
    restitution: Number = 1.0,
) -> Any:
    """Time of flight of the primary wave from the sensor to a structure and back.

    TOF = [3.218 k_w^{−2/5} + 1.180 (1 + e^{−1/5}) N k_c^{−2/5}] (m²/v)^{1/5} (equations 6.18, 6.20 and 6.29).

    Parameters
    ----------
    beads, mass : float
        Number N of beads from the sensor to the structure, five or more, and the mass m of one, kg.
    chain_stiffness, wall_stiffness : float or ndarray
        Stiffness of Hertz's law, N/m^1.5, between two beads (k_c), and between the last one and the structure (k_w).
    striker_speed : float
        Speed v of a striker that equals the beads, m/s.
    restitution : float or ndarray
        e = (V_ref/V_in)⁵ of the structure, in (0, 1], where V is a wave speed.

    Returns
    -------
    float or ndarray
        TOF, s.

    Examples
    --------
    >>> round(hl.theory.primary_time_of_flight(13, 3.5e-3, 7.06e9, 9.8e9, striker_speed=hl.drop_speed(0.01)) * 1e6)
    472
    """
    number, m = each(positive, "beads", beads), each(positive, "mass", mass, "kg")
    k_c = each(positive, "chain_stiffness", chain_stiffness, "N/m^1.5")
    k_w = each(positive, "wall_stiffness", wall_stiffness, "N/m^1.5")
    v = each(positive, "striker_speed", striker_speed, "m/s")
    e = each(lambda name, value, _: within(name, value, 0.0, 1.0), "restitution", restitution)
    transits = BEAD_TRANSIT * number * (1.0 + e**-0.2)
    return plain((HERTZ_COLLISION * k_w**-0.4 + transits * k_c**-0.4) * m**0.4 / v**0.2)


# A stiff upper layer on a soft lower layer (section 6.1.3). While the wave is at the structure, the upper layer moves
# as a free rigid mass. The lower layer acts as a spring.


def restitution(mass: float, upper_mass: Number) -> Any:
    """Restitution e = (M_u − m)/(M_u + m) of a bead that hits a heavier free mass (equations 6.25 and 6.26).

    Parameters
    ----------
    mass, upper_mass : float or ndarray
        Mass m of the bead, and the greater free mass M_u, kg: the upper layer of a structure of two layers.

    Returns
    -------
    float or ndarray
        e, for `theory.primary_time_of_flight`; AR of the primary wave is e^{6/5} (equations 6.23 and 6.24).

    Examples
    --------
    >>> hl.theory.layer_restitution(mass=0.01, upper_mass=0.04)
    0.6
    """
    m, upper = each(positive, "mass", mass, "kg"), each(positive, "upper_mass", upper_mass, "kg")
    if np.min(upper - m, initial=np.inf) <= 0.0:
        raise ValueError(f"upper_mass = {np.min(upper)}: must be greater than mass = {m}")
    return plain((upper - m) / (upper + m))


def secondary_delay(upper_mass: Number, lower_mass: Number, lower_stiffness: Number) -> Any:
    """Time T_l = π √((M_u + M_l/3)/k_d) by which the secondary wave of two layers follows the primary one.

    It is half a period of the upper layer on the lower one. The thesis neglects M_l (equations 6.32 to 6.34).

    Parameters
    ----------
    upper_mass, lower_mass : float or ndarray
        Masses M_u and M_l of the layers, kg; M_l may be zero.
    lower_stiffness : float or ndarray
        k_d = E A/L of the lower layer, N/m.

    Returns
    -------
    float or ndarray
        T_l, s.

    Examples
    --------
    >>> round(hl.theory.secondary_delay(upper_mass=14e-3, lower_mass=16e-3, lower_stiffness=17e6) * 1e6, 1)
    105.9
    """
    upper, lower = each(positive, "upper_mass", upper_mass, "kg"), each(not_negative, "lower_mass", lower_mass, "kg")
    return plain(pi * np.sqrt((upper + lower / 3.0) / each(positive, "lower_stiffness", lower_stiffness, "N/m")))
