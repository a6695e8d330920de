"""Closed forms for impact on elastic bodies: one bead, or a chain, on a half-space, a rod, or two layers. SI units.

The last bead stands for the whole chain (Khatri's thesis, section 6.1): its mass is m, kg, the stiffness of its
Hertzian contacts k, N/m^1.5; no loss, gravity or preload. docs/theory.md says how far chains differ. Functions take a
number, or an array where the type says so, and return the same kind; arrays broadcast.
"""

from math import gamma, pi, sqrt
from typing import TypeVar

import numpy as np

from structures.checks import each, finite, instance, not_negative, positive, restitution_coefficient
from structures.material import Material
from structures.structure import Vector

Number = TypeVar("Number", float, Vector)

HERTZ_COLLISION = 2.0 * 1.25**0.4 * sqrt(pi) * gamma(1.4) / gamma(0.9)
"""3.2180655: duration of Hertz's collision in units of (m²/k²v)^{1/5}; the thesis prints 3.218."""

BEAD_TRANSIT = (25.0 / 16.0 / 0.682) ** 0.2
"""1.1803400: time in which the wave passes one bead, in the same units for a striker of speed v that equals the beads
(equations 6.12 and 6.16). The thesis prints 1.180, twice this value as 2.361, and half of 2.361 as 1.181."""


def contact_time(mass: Number | float, stiffness: Number | float, speed: float) -> Number:
    """Time in contact T = 3.218 (m²/k²v)^{1/5} of a mass that hits a Hertzian contact (Tillett; equation 6.8).

    Parameters
    ----------
    mass : float or ndarray
        Mass m, kg; of two free bodies the reduced mass m₁m₂/(m₁ + m₂).
    stiffness : float or ndarray
        Stiffness k of Hertz's law F = k δ^1.5, N/m^1.5.
    speed : float
        Approach speed v, m/s.

    Returns
    -------
    float or ndarray
        T, s.

    Examples
    --------
    A steel bead of 9.52 mm falls 1 cm onto a steel half-space: 39.6 µs.

    >>> import hertzlink as hl
    >>> bead, wall = hl.Sphere(4.76e-3, hl.STEEL_440C), hl.Surface(hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, wall)
    >>> round(hl.theory.hertz_contact_time(bead.mass, stiffness, hl.drop_speed(0.01)) * 1e6, 1)
    39.6
    """
    m, k = each(positive, "mass", mass, "kg"), each(positive, "stiffness", stiffness, "N/m^1.5")
    return _plain(HERTZ_COLLISION * (m / k) ** 0.4 / positive("speed", speed, "m/s") ** 0.2)


def time_of_flight(
    beads: float,
    mass: float,
    chain_stiffness: float,
    wall_stiffness: Number | float,
    striker_speed: float,
    restitution: Number | float = 1.0,
) -> Number:
    """Time of flight of the primary wave from the sensor to a structure and back.

    TOF = [3.218 k_w^{−2/5} + 1.180 (1 + e^{−1/5}) N k_c^{−2/5}] (m²/v)^{1/5} (equations 6.18, 6.20 and 6.29).

    Parameters
    ----------
    beads : float
        Number N of beads from the sensor to the structure, five or more: 13 for sensor 7 of 20 beads.
    mass : float
        Mass m of a bead, kg.
    chain_stiffness : float
        Stiffness k_c between two beads, N/m^1.5.
    wall_stiffness : float or ndarray
        Stiffness k_w between the last bead and the structure, N/m^1.5.
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
    A chain of 20 steel beads of 9.52 mm on a steel half-space, sensor 7: 473 µs.

    >>> import hertzlink as hl
    >>> bead, wall = hl.Sphere(4.76e-3, hl.STEEL_440C), hl.Surface(hl.STEEL_440C)
    >>> between, at_wall = (hl.theory.hertz_stiffness(bead.surface, other) for other in (bead.surface, wall))
    >>> flight = hl.theory.primary_time_of_flight(13, bead.mass, between, at_wall, striker_speed=hl.drop_speed(0.01))
    >>> round(flight * 1e6)
    473
    """
    number, m = positive("beads", beads), positive("mass", mass, "kg")
    chain, v = positive("chain_stiffness", chain_stiffness, "N/m^1.5"), positive("striker_speed", striker_speed, "m/s")
    wall = each(positive, "wall_stiffness", wall_stiffness, "N/m^1.5")
    transits = BEAD_TRANSIT * number * (1.0 + each(restitution_coefficient, "restitution", restitution) ** -0.2)
    return _plain((HERTZ_COLLISION * wall**-0.4 + transits * chain**-0.4) * m**0.4 / v**0.2)


def amplitude_ratio(restitution: Number) -> Number:
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
    >>> import hertzlink as hl
    >>> round(hl.theory.primary_amplitude_ratio(0.6), 3)
    0.542
    """
    return _plain(each(restitution_coefficient, "restitution", restitution) ** 1.2)


def critical_modulus(material: Material, wall_poisson_ratio: float | None = None) -> float:
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
    >>> import hertzlink as hl
    >>> round(hl.theory.critical_modulus(hl.STEEL_440C) * 1e-9, 1)
    109.4
    """
    instance("material", material, Material, "a Material; MATERIALS[name] gives one by name")
    nu = material.poisson_ratio if wall_poisson_ratio is None else finite("wall_poisson_ratio", wall_poisson_ratio)
    if not -1.0 < nu < 0.5:
        raise ValueError(f"wall_poisson_ratio = {wall_poisson_ratio!r}: must lie between -1 and 0.5, both excluded")
    return material.contact_modulus * (1.0 - nu**2) / (2.0 * sqrt(2.0) - 1.0)


def characteristic_length(bar_speed: Number | float, contact_time: Number | float) -> Number:
    """Length c T/2 of a rod whose far end sends its echo back just as the bead leaves (section 6.1.2).

    Parameters
    ----------
    bar_speed : float or ndarray
        Speed c = √(E/ρ) of longitudinal waves in the rod, m/s (`Material.bar_speed`).
    contact_time : float or ndarray
        Time in contact T, s, such as `theory.hertz_contact_time`.

    Returns
    -------
    float or ndarray
        Length, m.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.characteristic_length(hl.STEEL_440C.bar_speed, 39.6e-6) * 1e3)
    100
    """
    speed, time = each(positive, "bar_speed", bar_speed, "m/s"), each(positive, "contact_time", contact_time, "s")
    return _plain(speed * time / 2.0)


# A stiff upper layer on a soft lower layer (section 6.1.3). While the wave is at the structure, the upper layer moves
# as a free rigid mass. The lower layer is a spring.


def restitution(mass: float, upper_mass: Number) -> Number:
    """Restitution e = (M_u − m)/(M_u + m) of a bead that hits a heavier free mass (equations 6.25 and 6.26).

    Parameters
    ----------
    mass : float
        Mass m of the bead, kg.
    upper_mass : float or ndarray
        Free mass M_u, kg, greater than m: the upper layer of a structure of two layers.

    Returns
    -------
    float or ndarray
        e, for `theory.primary_amplitude_ratio` and `theory.primary_time_of_flight`.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.theory.layer_restitution(mass=0.01, upper_mass=0.04)
    0.6
    """
    m, upper = positive("mass", mass, "kg"), each(positive, "upper_mass", upper_mass, "kg")
    if upper.size and upper.min() <= m:
        raise ValueError(
            f"upper_mass = {float(upper.min())!r}: must be greater than mass = {m!r} kg, or the bead does not come back"
        )
    return _plain((upper - m) / (upper + m))


def upper_speed(mass: float, upper_mass: Number, incident_speed: float) -> Number:
    """Speed V_u = 2 m v_in/(m + M_u) of a free mass after a bead has hit it (equation 6.30).

    Parameters
    ----------
    mass : float
        Mass m of the bead, kg.
    upper_mass : float or ndarray
        Free mass M_u, kg.
    incident_speed : float
        Speed v_in of the bead, m/s; in a chain 0.682 times that of the striker (equation 6.16).

    Returns
    -------
    float or ndarray
        V_u, m/s.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.layer_speed(mass=0.01, upper_mass=0.04, incident_speed=0.3), 3)
    0.12
    """
    m, upper = positive("mass", mass, "kg"), each(positive, "upper_mass", upper_mass, "kg")
    return _plain(2.0 * m * positive("incident_speed", incident_speed, "m/s") / (m + upper))


def axial_stiffness(youngs_modulus: float, area: float, length: Number) -> Number:
    """Static axial stiffness k_d = E A/L of a layer that is free to widen.

    Parameters
    ----------
    youngs_modulus : float
        Young's modulus E, Pa.
    area : float
        Area A of the cross-section, m².
    length : float or ndarray
        Length L, m.

    Returns
    -------
    float or ndarray
        k_d, N/m.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.layer_stiffness(youngs_modulus=1.5e9, area=285e-6, length=25.4e-3) * 1e-6, 2)
    16.83
    """
    modulus, section = positive("youngs_modulus", youngs_modulus, "Pa"), positive("area", area, "m²")
    return _plain(modulus * section / each(positive, "length", length, "m"))


def secondary_delay(upper_mass: Number | float, lower_mass: Number | float, lower_stiffness: Number | float) -> Number:
    """Time T_l = π √((M_u + M_l/3)/k_d) by which the secondary wave of two layers follows the primary one.

    Half a period of the upper layer on the lower one; the thesis leaves M_l out (equations 6.32 to 6.34).

    Parameters
    ----------
    upper_mass : float or ndarray
        Mass M_u of the upper layer, kg.
    lower_mass : float or ndarray
        Mass M_l of the lower layer, kg, zero or more.
    lower_stiffness : float or ndarray
        Stiffness k_d of the lower layer, N/m, such as `theory.layer_stiffness`.

    Returns
    -------
    float or ndarray
        T_l, s.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.secondary_delay(upper_mass=14e-3, lower_mass=16e-3, lower_stiffness=17e6) * 1e6, 1)
    105.9
    """
    upper, lower = each(positive, "upper_mass", upper_mass, "kg"), each(not_negative, "lower_mass", lower_mass, "kg")
    spring = each(positive, "lower_stiffness", lower_stiffness, "N/m")
    return _plain(pi * np.sqrt((upper + lower / 3.0) / spring))


def _plain(result: Vector) -> Number:  # type: ignore[type-var]
    return float(result) if np.ndim(result) == 0 else result  # type: ignore[return-value]
