"""Closed forms for impact on elastic bodies: one bead, or a chain, on a half-space, a rod, or two layers. SI units.

The last bead stands for the whole chain (Khatri's thesis, section 6.1), without loss, gravity or preload:
docs/theory.md says how far chains differ. Functions take numbers or arrays, which broadcast, and return the same kind.
"""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from math import gamma, pi, sqrt
from typing import Any, TypeAlias, TypeVar

import numpy as np

from structures.checks import each, not_negative, positive, within
from structures.structure import Vector

Form = TypeVar("Form", bound=Callable[..., Any])
Number: TypeAlias = float | Vector

# 3.2180655: duration of Hertz's collision in units of (m²/k²v)^{1/5}; the thesis prints 3.218
HERTZ_COLLISION = 2.0 * 1.25**0.4 * sqrt(pi) * gamma(1.4) / gamma(0.9)

# 1.1803400: time in which the wave passes one bead, in the same units for a striker of speed v that equals the beads
# (equations 6.12 and 6.16). The thesis prints 1.180, twice this value as 2.361, and half of 2.361 as 1.181.
BEAD_TRANSIT = (25.0 / 16.0 / 0.682) ** 0.2

UNITS = {
    "mass": "kg", "upper_mass": "kg", "lower_mass": "kg", "speed": "m/s", "striker_speed": "m/s",
    "stiffness": "N/m^1.5", "chain_stiffness": "N/m^1.5", "wall_stiffness": "N/m^1.5", "lower_stiffness": "N/m",
}  # fmt: skip

# The checks of arguments that need not be positive, or have an upper limit
OTHER_RANGES = {"lower_mass": not_negative, "restitution": lambda name, value, _: within(name, value, 0.0, 1.0)}


def closed_form(function: Form) -> Form:
    """Return a function that checks its arguments, and whose result is a float where all of them are numbers."""
    parameters = signature(function)

    @wraps(function)
    def of_numbers(*arguments: Any, **named: Any) -> Any:
        bound = parameters.bind(*arguments, **named)
        for name, value in bound.arguments.items():
            bound.arguments[name] = each(OTHER_RANGES.get(name, positive), name, value, UNITS.get(name, ""))
        result = function(*bound.args, **bound.kwargs)
        return float(result) if np.ndim(result) == 0 else result

    return of_numbers  # type: ignore[return-value]


@closed_form
def contact_time(mass: Number, stiffness: Number, speed: float) -> Any:
    """Time in contact T = 3.218 (m²/k²v)^{1/5} of a mass that hits a Hertzian contact (Tillett; equation 6.8).

    Parameters
    ----------
    mass, stiffness, speed : float or ndarray
        Mass m, kg (of two free bodies m₁m₂/(m₁ + m₂)); k of Hertz's law, N/m^1.5; approach speed v, m/s.

    Returns
    -------
    float or ndarray
        T, s.

    Examples
    --------
    >>> round(hl.theory.hertz_contact_time(mass=3.5e-3, stiffness=9.8e9, speed=0.44) * 1e6, 1)
    39.8
    """
    return HERTZ_COLLISION * (mass / stiffness) ** 0.4 / speed**0.2


@closed_form
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
        Speed v, m/s, of a striker that equals the beads.
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
    transits = BEAD_TRANSIT * beads * (1.0 + restitution**-0.2)
    flight = (HERTZ_COLLISION * wall_stiffness**-0.4 + transits * chain_stiffness**-0.4) * mass**0.4
    return flight / striker_speed**0.2


# A stiff upper layer on a soft lower layer (section 6.1.3). While the wave is at the structure, the upper layer moves
# as a free rigid mass. The lower layer is a spring.


@closed_form
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
    least = float(np.min(upper_mass - mass, initial=np.inf))
    if least <= 0.0:
        raise ValueError(f"upper_mass = {np.min(upper_mass)}: must be greater than mass = {mass}")
    return (upper_mass - mass) / (upper_mass + mass)


@closed_form
def secondary_delay(upper_mass: Number, lower_mass: Number, lower_stiffness: Number) -> Any:
    """Time T_l = π √((M_u + M_l/3)/k_d) by which the secondary wave of two layers follows the primary one.

    Half a period of the upper layer on the lower one; the thesis leaves M_l out (equations 6.32 to 6.34).

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
    return pi * np.sqrt((upper_mass + lower_mass / 3.0) / lower_stiffness)
