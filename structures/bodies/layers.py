"""Closed forms for impact on elastic bodies: one bead, or a chain, on a half-space, a rod, or two layers. SI units.

The last bead of the chain stands for the whole chain (Khatri's thesis, section 6.1.1): a bead of mass m, kg, whose
Hertzian contacts have the stiffness k, N/m^1.5. There are no losses, no gravity and no preload. The docstrings give the
difference from a chain of point masses. It was measured with `Chain` in the thesis's setting: 20 steel beads of
9.52 mm, a striker that equals them and falls 1 cm, and the sensor in bead 7.

Functions take a number, or an array where the type says so, and return the same kind; arrays broadcast. Every function
raises a ValueError that names the argument if a number is not finite or out of its range.
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
"""1.1803400: time in which the wave passes one bead, in units of (m²/k²v)^{1/5}, for a striker of speed v that equals
the beads.

The number follows from equations 6.12 and 6.16. The thesis prints 1.180 in 6.17 and 6.18, twice this value as 2.361 in
6.19 and 6.20, and half of 2.361, rounded up, as 1.181 in 6.29 and 6.34.
"""


# One bead or one wave on a half-space or a rod (sections 6.1.1 and 6.1.2).


def contact_time(mass: Number | float, stiffness: Number | float, speed: float) -> Number:
    """Return the time in contact T of a mass that hits a Hertzian contact.

    T = 3.218 (m² / k² v)^{1/5}.

    Parameters
    ----------
    mass : float or ndarray
        Mass m, kg, positive. For two free bodies: the reduced mass m₁m₂/(m₁ + m₂).
    stiffness : float or ndarray
        Stiffness k of Hertz's law F = k δ^1.5, N/m^1.5, positive.
    speed : float
        Approach speed v, m/s, positive.

    Returns
    -------
    float or ndarray
        T, s.

    Raises
    ------
    ValueError
        If a number is not positive and finite.

    Notes
    -----
    The formula holds for one bead. The last bead of a chain is pushed on by the other beads. It stays in contact
    1.5 times as long on steel and 1.6 times as long on PTFE (force above 1 % of its peak).

    References
    ----------
    Tillett (1954); Khatri's thesis, section 6.1.1, equation 6.8, where V_s means the speed.

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
    """Return the time of flight TOF of the primary wave from the sensor to a structure and back.

    TOF = [3.218 k_w^{−2/5} + 1.180 (1 + e^{−1/5}) N k_c^{−2/5}] (m²/v)^{1/5}.

    Parameters
    ----------
    beads : float
        Number N of beads from the sensor to the structure: 13 for sensor 7 of 20 beads. It is not the 20 given under
        equation 6.10. Sensor and structure must be five beads apart or more.
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

    Raises
    ------
    ValueError
        If a number is not positive and finite, or if `restitution` is greater than 1.

    Notes
    -----
    Equation 6.18 is right as printed. Its second term alone, in 6.17 and 6.19, is printed with k_c^{+2/5}, and e is
    printed with the exponent −1/5 instead of 5. e = 1 gives equation 6.20. e from `restitution` gives 6.29,
    where V_s is the speed of the striker.

    On a half-space (e = 1) a chain is faster than the formula, by 1.4 % (PTFE) to 3.0 % (steel). Gravity makes it
    another 2 % or 3 % faster. A dashpot of 5 N s/m makes it 3 % to 5 % slower.

    References
    ----------
    Khatri's thesis, section 6.1.1, equations 6.17 to 6.20, and section 6.1.3, equation 6.29.

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
    """Return the amplitude ratio AR = e^{6/5} of the primary wave, from the restitution e of the structure.

    AR = (V_ref/V_in)⁶ and V_ref/V_in = e^{1/5}, where V is a wave speed: one solitary wave arrives, and one leaves.

    Parameters
    ----------
    restitution : float or ndarray
        e = v_ref/v_in, the ratio of the bead speeds after and before the impact, in (0, 1].

    Returns
    -------
    float or ndarray
        AR, a pure number, with the shape of `restitution`.

    Raises
    ------
    ValueError
        If e is not in (0, 1].

    Notes
    -----
    Equations 6.23 and 6.24 are right as printed. Where a secondary wave takes part of the energy, e is not a property
    of the structure alone. On an elastic half-space, where e = 1, a chain has AR = 0.979 for steel and 0.915 for PTFE.

    References
    ----------
    Khatri's thesis, section 6.1.1, equations 6.23 and 6.24.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.primary_amplitude_ratio(0.6), 3)
    0.542
    """
    return _plain(each(restitution_coefficient, "restitution", restitution) ** 1.2)


def critical_modulus(material: Material, wall_poisson_ratio: float | None = None) -> float:
    """Return Young's modulus below which a half-space sends a secondary wave back into a chain of a material.

    E/(2√2 − 1) (1 − ν_w²)/(1 − ν²): with this modulus the contact between bead and half-space is as stiff as the
    contact between two beads.

    Parameters
    ----------
    material : Material
        The material of the beads, with E and ν.
    wall_poisson_ratio : float, optional
        Poisson's ratio ν_w of the half-space, between −1 and 0.5, by default that of `material`.

    Returns
    -------
    float
        Young's modulus of the half-space, Pa.

    Raises
    ------
    ValueError
        If `material` is not a Material, or if Poisson's ratio is out of its range.

    Notes
    -----
    Equation 6.21 is right as printed. With ν_w = ν it becomes 6.22: 0.547 E, or 109.4 GPa for steel 440C. The thesis
    prints "55 %", and "≈ 100 GPa", which is 9 % less.

    The modulus is a guide and not a threshold. At this modulus the secondary wave of an undamped chain is smaller than
    1 %, whereas the thesis reports 5 %. At 30 GPa it is 8 %.

    References
    ----------
    Khatri's thesis, section 6.1.1, equations 6.21 and 6.22.

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
    """Return the length of a rod whose far end sends its echo back just as the bead leaves: c T/2.

    A longer rod keeps the energy of the wave. A much shorter rod returns it to the bead.

    Parameters
    ----------
    bar_speed : float or ndarray
        Speed c of longitudinal waves in the rod, √(E/ρ), m/s (`Material.bar_speed`).
    contact_time : float or ndarray
        Time in contact T, s, such as `theory.hertz_contact_time`.

    Returns
    -------
    float or ndarray
        Length, m.

    Raises
    ------
    ValueError
        If a number is not positive and finite.

    Notes
    -----
    The formula is right as printed. The thesis gives 101 mm for steel 440C with T by equation 6.8. Table 2.1 gives
    100.2 mm, and a bead of 8000 kg/m³ gives 101.2 mm.

    The length is not a sharp bound. For steel rods of 19 mm diameter AR falls from 0.979 at 25 mm to 0.928 at 100 mm
    and to 0.925 at 150 mm.

    References
    ----------
    Khatri's thesis, section 6.1.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead, wall = hl.Sphere(4.76e-3, hl.STEEL_440C), hl.Surface(hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, wall)
    >>> time = hl.theory.hertz_contact_time(bead.mass, stiffness, hl.drop_speed(0.01))
    >>> round(hl.theory.characteristic_length(hl.STEEL_440C.bar_speed, time) * 1e3, 1)
    100.2
    """
    speed, time = each(positive, "bar_speed", bar_speed, "m/s"), each(positive, "contact_time", contact_time, "s")
    return _plain(speed * time / 2.0)


# A stiff upper layer on a soft lower layer (section 6.1.3). While the wave is at the structure, the upper layer moves
# as a free rigid mass. The lower layer is a spring.


def restitution(mass: float, upper_mass: Number) -> Number:
    """Return the coefficient of restitution e of a bead that hits a heavier free mass.

    e = (M_u − m)/(M_u + m) is the magnitude of v_ref/v_in, the ratio of the bead speeds after and before the impact.

    Parameters
    ----------
    mass : float
        Mass m of the bead, kg.
    upper_mass : float or ndarray
        Free mass M_u, kg, greater than m: the upper layer of a structure of two layers.

    Returns
    -------
    float or ndarray
        e in (0, 1), with the shape of `upper_mass`. It is an argument of `theory.primary_amplitude_ratio`, and of
        `theory.primary_time_of_flight` for equations 6.27 to 6.29.

    Raises
    ------
    ValueError
        If a mass is not positive, or if M_u is not greater than m.

    Notes
    -----
    Equation 6.25 has signed velocities, which make e negative there.

    The formula holds for one bead. On a free mass a chain has a smaller AR than e^{6/5}: 0.417 instead of 0.542 at
    M_u = 4m, and 0.929 instead of 0.963 at 64m. A lower layer of PTFE resists during the impact and changes this: 0.542
    at 4m, 0.693 (e^{6/5} = 0.740) at 8m, and 0.923 at 64m.

    References
    ----------
    Khatri's thesis, section 6.1.3, equations 6.25 and 6.26.

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
    """Speed V_u of a free mass after a bead has hit it.

    V_u = 2 m v_in/(m + M_u).

    Parameters
    ----------
    mass : float
        Mass m of the bead, kg.
    upper_mass : float or ndarray
        Free mass M_u, kg.
    incident_speed : float
        Speed v_in of the bead itself, m/s. In a chain it is 0.682 times the speed of the striker (equation 6.16).

    Returns
    -------
    float or ndarray
        V_u, m/s, with the shape of `upper_mass`.

    Raises
    ------
    ValueError
        If a number is not positive and finite.

    References
    ----------
    Khatri's thesis, section 6.1.3, equation 6.30, which is right as printed.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.layer_speed(mass=0.01, upper_mass=0.04, incident_speed=0.3), 3)
    0.12
    """
    m, upper = positive("mass", mass, "kg"), each(positive, "upper_mass", upper_mass, "kg")
    return _plain(2.0 * m * positive("incident_speed", incident_speed, "m/s") / (m + upper))


def axial_stiffness(youngs_modulus: float, area: float, length: Number) -> Number:
    """Return the axial stiffness k_d = E A/L of a layer.

    The stiffness is static, and the layer is free to widen. It holds for layers that are longer than wide.

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
        k_d, N/m, with the shape of `length`.

    Raises
    ------
    ValueError
        If a number is not positive and finite.

    References
    ----------
    Khatri's thesis, section 6.1.3, before equation 6.32.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.layer_stiffness(youngs_modulus=1.5e9, area=285e-6, length=25.4e-3) * 1e-6, 2)
    16.83
    """
    modulus, section = positive("youngs_modulus", youngs_modulus, "Pa"), positive("area", area, "m²")
    return _plain(modulus * section / each(positive, "length", length, "m"))


def secondary_delay(upper_mass: Number | float, lower_mass: Number | float, lower_stiffness: Number | float) -> Number:
    """Return the time T_l by which the secondary wave of two layers follows the primary wave: TOF_SSW = TOF_PSW + T_l.

    T_l = π √((M_u + M_l/3)/k_d): half a period of the upper layer on the lower one.

    Parameters
    ----------
    upper_mass : float or ndarray
        Mass M_u of the upper layer, kg, positive.
    lower_mass : float or ndarray
        Mass M_l of the lower layer, kg, zero or more. Zero gives T_l of the thesis.
    lower_stiffness : float or ndarray
        Stiffness k_d of the lower layer, N/m, such as `theory.layer_stiffness`.

    Returns
    -------
    float or ndarray
        T_l, s.

    Raises
    ------
    ValueError
        If a number is out of its range.

    Notes
    -----
    The thesis has no M_l, which is right for M_l/3 ≪ M_u only. Compared with a rod on a fixed base with M_u at its end,
    T_l with M_l/3 is 0.2 % short for M_l = 0.41 M_u, 0.8 % for 1.1 M_u, 4.8 % for 6.6 M_u, and never more than 9.3 %.

    Chains take longer. Over section 6.1.4, where M_u = 4m, T_l is 11 % to 21 % short (26 % to 50 % without M_l). A
    heavy upper layer makes a weak secondary wave, which returns more slowly. Equation 6.33 leaves this out: T_l is 38 %
    short for M_u = 16m.

    References
    ----------
    Khatri's thesis, section 6.1.3, equations 6.32 to 6.34.

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
