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

from structures.checks import each, not_negative, positive, restitution_coefficient
from structures.described import checked_call
from structures.material import Material
from structures.quantities import PoissonRatio
from structures.structure import Vector

Form = TypeVar("Form", bound=Callable[..., Any])
Number: TypeAlias = float | Vector

# 3.2180655: duration of Hertz's collision in units of (m²/k²v)^{1/5}; the thesis prints 3.218
HERTZ_COLLISION = 2.0 * 1.25**0.4 * sqrt(pi) * gamma(1.4) / gamma(0.9)

# 1.1803400: time in which the wave passes one bead, in the same units for a striker of speed v that equals the beads
# (equations 6.12 and 6.16). The thesis prints 1.180, twice this value as 2.361, and half of 2.361 as 1.181.
BEAD_TRANSIT = (25.0 / 16.0 / 0.682) ** 0.2

UNITS = {
    "mass": "kg", "upper_mass": "kg", "lower_mass": "kg", "speed": "m/s", "striker_speed": "m/s", "bar_speed": "m/s",
    "stiffness": "N/m^1.5", "chain_stiffness": "N/m^1.5", "wall_stiffness": "N/m^1.5",
    "lower_stiffness": "N/m", "contact_time": "s", "youngs_modulus": "Pa", "area": "m²", "length": "m",
}  # fmt: skip

# The checks of arguments that need not be positive, or have an upper limit
OTHER_RANGES = {"lower_mass": not_negative, "restitution": restitution_coefficient}


def closed_form(function: Form) -> Form:
    """Return a function that checks its arguments, and whose result is a float where all of them are numbers."""
    parameters = signature(function)

    @wraps(function)
    def of_numbers(*arguments: Any, **named: Any) -> Any:
        bound = parameters.bind(*arguments, **named)
        for name, value in bound.arguments.items():
            bound.arguments[name] = each(OTHER_RANGES.get(name, positive), name, value, UNITS.get(name, ""))
        try:
            np.broadcast_shapes(*map(np.shape, bound.arguments.values()))
        except ValueError as error:
            raise ValueError(f"{', '.join(bound.arguments)}: {error}") from None
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


@closed_form
def amplitude_ratio(restitution: Number) -> Any:
    """Amplitude ratio AR = e^{6/5} of the primary wave, as AR = (V_ref/V_in)⁶ (equations 6.23 and 6.24).

    Parameters
    ----------
    restitution : float or ndarray
        Restitution e = v_ref/v_in of the structure, the ratio of the bead speeds after and before impact, in (0, 1].

    Returns
    -------
    float or ndarray
        AR.

    Examples
    --------
    >>> round(hl.theory.primary_amplitude_ratio(0.6), 3)
    0.542
    """
    return restitution**1.2


@checked_call
def critical_modulus(material: Material, wall_poisson_ratio: PoissonRatio | None = None) -> float:
    """Young's modulus of the half-space whose contact with a bead is as stiff as that of two beads.

    E (1 − ν_w²)/[(2√2 − 1)(1 − ν²)]; a softer one sends a secondary wave back (equations 6.21 and 6.22).

    Parameters
    ----------
    material : Material
        The material of the beads, with E and ν.
    wall_poisson_ratio : float, optional
        Poisson's ratio ν_w of the half-space, by default that of `material`.

    Returns
    -------
    float
        Young's modulus of the half-space, Pa.

    Examples
    --------
    >>> round(hl.theory.critical_modulus(hl.STEEL_440C) * 1e-9, 1)
    109.4
    """
    nu = material.poisson_ratio if wall_poisson_ratio is None else wall_poisson_ratio
    return material.contact_modulus * (1.0 - nu**2) / (2.0 * sqrt(2.0) - 1.0)


@closed_form
def characteristic_length(bar_speed: Number, contact_time: Number) -> Any:
    """Length c T/2 of a rod whose far end sends its echo back just as the bead leaves (section 6.1.2).

    Parameters
    ----------
    bar_speed, contact_time : float or ndarray
        Speed c = √(E/ρ) in the rod, m/s (`Material.bar_speed`), and time T, s, such as `theory.hertz_contact_time`.

    Returns
    -------
    float or ndarray
        Length, m.

    Examples
    --------
    >>> round(hl.theory.characteristic_length(hl.STEEL_440C.bar_speed, 39.6e-6) * 1e3)
    100
    """
    return bar_speed * contact_time / 2.0


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
        e, for `theory.primary_amplitude_ratio` and `theory.primary_time_of_flight`.

    Examples
    --------
    >>> hl.theory.layer_restitution(mass=0.01, upper_mass=0.04)
    0.6
    """
    least = float(np.min(upper_mass - mass, initial=np.inf))
    if least <= 0.0:
        raise ValueError(
            f"upper_mass = {np.min(upper_mass)}: must be greater than mass = {mass}, or the bead does not come back"
        )
    return (upper_mass - mass) / (upper_mass + mass)


@closed_form
def axial_stiffness(youngs_modulus: float, area: float, length: Number) -> Any:
    """Static axial stiffness k_d = E A/L of a layer that is free to widen.

    Parameters
    ----------
    youngs_modulus, area, length : float or ndarray
        Young's modulus E, Pa, area A of the cross-section, m², and length L, m.

    Returns
    -------
    float or ndarray
        k_d, N/m.

    Examples
    --------
    >>> round(hl.theory.layer_stiffness(youngs_modulus=1.5e9, area=285e-6, length=25.4e-3) * 1e-6, 2)
    16.83
    """
    return youngs_modulus * area / length


@closed_form
def secondary_delay(upper_mass: Number, lower_mass: Number, lower_stiffness: Number) -> Any:
    """Time T_l = π √((M_u + M_l/3)/k_d) by which the secondary wave of two layers follows the primary one.

    Half a period of the upper layer on the lower one; the thesis leaves M_l out (equations 6.32 to 6.34).

    Parameters
    ----------
    upper_mass, lower_mass : float or ndarray
        Masses M_u and M_l of the layers, kg; M_l may be zero.
    lower_stiffness : float or ndarray
        k_d, N/m, as of `theory.layer_stiffness`.

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
