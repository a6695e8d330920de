"""Theory of waves in a chain of identical particles whose contacts obey F = k δⁿ: closed forms, SI units.

The basis is Nesterenko's long-wave equation 1.7 (equations and sections: Khatri's thesis). It assumes that the strain ξ
changes little over one particle. For Hertz's n = 3/2 the wave is only five particles long. The docstrings give the
difference from a chain of point masses (measured with `Chain`).

`size`, m, is the extent of a particle along the chain, `mass` is in kg, the stiffness k in N/mⁿ, and n is the exponent.
Functions take a number, or an array where the type says so, and return the same kind. Every function raises a
ValueError that names the argument if a number is not finite or out of its range.
"""

from math import pi, sqrt
from typing import TypeVar

import numpy as np
from scipy.special import betainc

from structures.checks import each, finite, not_negative, positive, restitution_coefficient, within
from structures.structure import Vector

Number = TypeVar("Number", float, Vector)

HERTZ = 1.5
"""Exponent of Hertz's law F = k δ^1.5."""

SMALLEST_SIZE, LARGEST_SIZE, LARGEST_EXPONENT = 1e-12, 1e12, 10.0
"""Powers of sizes (m, or of any unit) beyond these leave the range of floating point."""

PARTICLE_TO_STRIKER_SPEED = 0.682
"""Ratio of the greatest speed of a particle to the speed of a striker that equals the particles.

Thesis, equation 6.16; Chatterjee 1999. It holds for n = 3/2 without preload and losses, ten particles or more from
either end. `Chain` gives 0.6816.
"""

CONTACT_TO_CENTRE_FORCE = 1.414
"""β: ratio of the greatest contact force to the greatest bead-centre force.

The bead-centre force is the mean of the two contact forces of a bead. A sensor in the bead measures it.

Thesis, equation 3.2; the "F_{d,e}" printed next to it is a misprint. For equal spheres without preload `Chain` gives
1.4138. The wave profile of equation 1.8 would give cos(1/√10)⁻⁶ = 1.357.
"""


def tangent_stiffness(stiffness: float, preload: Number, exponent: float = HERTZ) -> Number:
    """Tangent stiffness C of a contact under a preload.

    C = dF/dδ = n k^{1/n} F₀^{(n−1)/n}.

    Parameters
    ----------
    stiffness : float
        Stiffness k of the contact, F = k δⁿ, N/mⁿ.
    preload : float or ndarray
        Static force F₀ in the contact, N, zero or more.
    exponent : float
        Exponent n ≥ 1 of the contact.

    Returns
    -------
    float or ndarray
        C, N/m, with the shape of `preload`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    References
    ----------
    Khatri's thesis, section 1.4, where C is the stiffness of linear springs.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    >>> round(hl.theory.tangent_stiffness(stiffness, preload=10.0) * 1e-6, 2)
    11.89
    """
    k, n = positive("stiffness", stiffness, "N/m^n"), _at_least_linear(exponent)
    force = each(not_negative, "preload", preload, "N")
    return _like(preload, n * k ** (1.0 / n) * force ** ((n - 1.0) / n))


def angular_frequency(
    wave_number: Number, size: float, mass: float, stiffness: float, preload: float, exponent: float = HERTZ
) -> Number:
    """Angular frequency ω of a linear wave in a preloaded chain: the dispersion relation.

    ω² = (4C/m) sin²(kd/2), where C is `tangent_stiffness` and k the wave number.

    Parameters
    ----------
    wave_number : float or ndarray
        Real wave number k, rad/m. ω is periodic in k: the waves with |k| ≤ π/d, which are longer than 2d, are all waves
        of the chain.
    size : float
        Extent d of a particle along the chain, m.
    mass : float
        Mass m of a particle, kg.
    stiffness : float
        Stiffness k of the contacts, F = k δⁿ, N/mⁿ.
    preload : float
        Static force F₀ in the contacts, N, zero or more.
    exponent : float
        Exponent n ≥ 1 of the contacts.

    Returns
    -------
    float or ndarray
        ω, rad/s, with the shape of `wave_number`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    Notes
    -----
    The thesis prints ka for kd, and ≅ for =. The relation is exact for small motions, F_d ≪ F₀.

    References
    ----------
    Khatri's thesis, equation 1.4.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    >>> shortest = 3.141592653589793 / bead.size
    >>> highest = hl.theory.chain_angular_frequency(shortest, bead.size, bead.mass, stiffness, preload=10.0)
    >>> round(highest / 6.283185307179586)
    18491
    """
    waves, d = each(finite, "wave_number", wave_number, "rad/m"), positive("size", size, "m")
    preload = not_negative("preload", preload, "N")
    highest = 2.0 * pi * cutoff_frequency(mass, stiffness, preload, exponent)
    return _like(wave_number, highest * np.abs(np.sin(waves * d / 2.0)))


def cutoff_frequency(mass: float, stiffness: float, preload: Number, exponent: float = HERTZ) -> Number:
    """Cut-off frequency √(C/m)/π: the highest frequency of linear waves in a preloaded chain.

    C is `tangent_stiffness`. The motion is small, F_d ≪ F₀.

    Parameters
    ----------
    mass : float
        Mass m of a particle, kg.
    stiffness : float
        Stiffness k of the contacts, F = k δⁿ, N/mⁿ.
    preload : float or ndarray
        Static force F₀ in the contacts, N, zero or more.
    exponent : float
        Exponent n ≥ 1 of the contacts.

    Returns
    -------
    float or ndarray
        Frequency, Hz, with the shape of `preload`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    References
    ----------
    Khatri's thesis, equation 1.4.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    >>> round(hl.theory.chain_cutoff_frequency(bead.mass, stiffness, preload=10.0))
    18491
    """
    m = positive("mass", mass, "kg")
    return _like(preload, np.sqrt(tangent_stiffness(stiffness, preload, exponent) / m) / pi)


def sound_speed(size: float, mass: float, stiffness: float, preload: Number, exponent: float = HERTZ) -> Number:
    """Speed d √(C/m) of long linear waves in a preloaded chain.

    C is `tangent_stiffness`. The motion is small, F_d ≪ F₀. Without preload the speed is zero for n > 1: the sonic
    vacuum.

    Parameters
    ----------
    size : float
        Extent d of a particle along the chain, m.
    mass : float
        Mass m of a particle, kg.
    stiffness : float
        Stiffness k of the contacts, F = k δⁿ, N/mⁿ.
    preload : float or ndarray
        Static force F₀ in the contacts, N, zero or more.
    exponent : float
        Exponent n ≥ 1 of the contacts.

    Returns
    -------
    float or ndarray
        Speed, m/s, with the shape of `preload`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    References
    ----------
    Khatri's thesis, equation 1.4 for kd → 0.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    >>> round(hl.theory.chain_sound_speed(bead.size, bead.mass, stiffness, preload=10.0), 1)
    553.0
    """
    d, m = positive("size", size, "m"), positive("mass", mass, "kg")
    return _like(preload, d * np.sqrt(tangent_stiffness(stiffness, preload, exponent) / m))


def wave_speed_from_force(
    size: float, mass: float, stiffness: float, force: Number, preload: float = 0.0, exponent: float = HERTZ
) -> Number:
    """Speed V of a solitary wave from the peak of its contact force, with or without preload.

    V = D √(2/(n+1)) √(k^{1/n}/m) F_m^{(n−1)/(2n)} √[1 + n q^{n+1} − (n+1) qⁿ] / (1 − q), with the total peak
    F_m = F₀ + F_d and q = (F₀/F_m)^{1/n}. It holds for long waves, identical particles and n > 1.

    Parameters
    ----------
    size : float
        Extent D of a particle along the chain, m.
    mass : float
        Mass m of a particle, kg.
    stiffness : float
        Stiffness k of the contacts, F = k δⁿ, N/mⁿ.
    force : float or ndarray
        Peak F_d of the contact force above the preload, N, zero or more.
    preload : float
        Static force F₀ in the contacts, N, zero or more.
    exponent : float
        Exponent n > 1 of the contacts.

    Returns
    -------
    float or ndarray
        V, m/s, with the shape of `force`. For F_d → 0 it equals `sound_speed` to all digits.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    Notes
    -----
    For n = 3/2 this is equation 5.10. For spheres it is 1.9, whose f_r must be F_m/F₀, and not F_d/F₀ as printed.
    Without preload it is 5.12, where the root of k^{1/n}/m is missing in print; for n = 3/2 it is 5.11, and for spheres
    1.10.

    A Hertzian chain is 1.2 % faster without preload, and 0.3 % faster for F_d = 5 F₀. A sensor measures the bead-centre
    force. Without preload, multiply it by `particles.solitary.CONTACT_TO_CENTRE_FORCE` = 1.414.

    References
    ----------
    Khatri's thesis, equations 1.9, 1.10 and 5.10 to 5.12.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    >>> round(hl.theory.solitary_speed_from_force(bead.size, bead.mass, stiffness, force=20.0), 1)
    453.3
    """
    d, m, k = _particle(size, mass, stiffness)
    n, rest = _steeper_than_linear(exponent), not_negative("preload", preload, "N")
    dynamic = each(not_negative, "force", force, "N")
    total = dynamic + rest
    some = np.where(total > 0.0, total, 1.0)
    # 1 − q, computed from the smaller of the two forces, which keeps its digits.
    weak = -np.expm1(np.log1p(-np.minimum(dynamic / some, 0.5)) / n)
    gap = np.where(dynamic < rest, weak, 1.0 - (rest / some) ** (1.0 / n))
    # The bracket is the incomplete beta function I₁₋q(2, n), which has no cancellation as q → 1.
    safe = np.where(gap < 1e-8, 1.0, gap)
    near = n * (n + 1.0) / 2.0 * (1.0 - 2.0 / 3.0 * (n - 1.0) * gap)
    bracket = np.where(gap < 1e-8, near, betainc(2.0, n, safe) / safe**2)
    overlap = (total / k) ** (1.0 / n)
    return _like(force, d * np.sqrt(2.0 / (n + 1.0) * k / m * overlap ** (n - 1.0) * bracket))


def wave_speed_from_particle_speed(
    size: float, mass: float, stiffness: float, particle_speed: Number, exponent: float = HERTZ
) -> Number:
    """Speed V of a solitary wave from the greatest speed v_p of its particles, without preload.

    V = D [2 k v_p^{n−1} / ((n+1) m)]^{1/(n+1)}, which follows from v_p = V ξ_max. It holds for long waves, identical
    particles and n > 1.

    Parameters
    ----------
    size : float
        Extent D of a particle along the chain, m.
    mass : float
        Mass m of a particle, kg.
    stiffness : float
        Stiffness k of the contacts, F = k δⁿ, N/mⁿ.
    particle_speed : float or ndarray
        Greatest speed v_p of the particles, m/s, positive.
    exponent : float
        Exponent n > 1 of the contacts.

    Returns
    -------
    float or ndarray
        V, m/s, with the shape of `particle_speed`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    Notes
    -----
    For n = 3/2 and particles of the radius R this is (16/25)^{1/5} 2R (v_p k²/m²)^{1/5} = 1.829 R (v_p k²/m²)^{1/5}:
    equations 6.12 and 6.13, which are right as printed. A is k in these equations, whereas A is k/m in equation 1.5.

    A Hertzian chain is 0.8 % slower.

    References
    ----------
    Khatri's thesis, equations 6.12 and 6.13.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    >>> round(hl.theory.solitary_speed_from_particle_speed(bead.size, bead.mass, stiffness, particle_speed=0.3), 1)
    570.1
    """
    d, m, k = _particle(size, mass, stiffness)
    n, v = _steeper_than_linear(exponent), each(positive, "particle_speed", particle_speed, "m/s")
    return _like(particle_speed, d * (2.0 * k / ((n + 1.0) * m) * v ** (n - 1.0)) ** (1.0 / (n + 1.0)))


def peak_force_from_particle_speed(
    mass: float, stiffness: float, particle_speed: Number, exponent: float = HERTZ
) -> Number:
    """Peak contact force F_m of a solitary wave from the greatest speed v_p of its particles, without preload.

    F_m = k [(n+1) m v_p²/(2k)]^{n/(n+1)}: the force for which equations 5.12 (corrected) and 6.12 give the same speed.

    Parameters
    ----------
    mass : float
        Mass m of a particle, kg.
    stiffness : float
        Stiffness k of the contacts, F = k δⁿ, N/mⁿ.
    particle_speed : float or ndarray
        Greatest speed v_p of the particles, m/s, positive. For a striker that equals the particles it is
        `particles.solitary.PARTICLE_TO_STRIKER_SPEED` = 0.682 times the speed of the striker.
    exponent : float
        Exponent n > 1 of the contacts.

    Returns
    -------
    float or ndarray
        F_m, N, with the shape of `particle_speed`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    Notes
    -----
    The formula is useful for n close to 1 only. It uses the peak strain, whereas a contact feels the mean strain over a
    particle. A Hertzian chain has 0.886 of this force. A chain with n = 1.222 has 0.946 of it.

    References
    ----------
    Khatri's thesis, equations 5.12 and 6.12.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    >>> force = hl.theory.solitary_force_from_particle_speed(bead.mass, stiffness, particle_speed=0.3)
    >>> round(force, 1)
    79.1
    >>> round(hl.theory.solitary_speed_from_force(bead.size, bead.mass, stiffness, force), 1)
    570.1
    """
    m, k = positive("mass", mass, "kg"), positive("stiffness", stiffness, "N/m^n")
    n, v = _steeper_than_linear(exponent), each(positive, "particle_speed", particle_speed, "m/s")
    return _like(particle_speed, k * ((n + 1.0) * m * v**2 / (2.0 * k)) ** (n / (n + 1.0)))


def width(size: float, exponent: float = HERTZ) -> float:
    """Length L of a solitary wave without preload, from zero to zero of the strain.

    L = πD/(n−1) √(n(n+1)/6), which is 4.967 D for n = 3/2. It does not depend on the amplitude. The long-wave theory is
    more accurate for n closer to 1.

    Parameters
    ----------
    size : float
        Extent D of a particle along the chain, m.
    exponent : float
        Exponent n > 1 of the contacts.

    Returns
    -------
    float
        L, m.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    References
    ----------
    Khatri's thesis, equation 5.13.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.solitary_width(size=1.0), 3)
    4.967
    """
    n = _steeper_than_linear(exponent)
    return pi * _length(size) / (n - 1.0) * sqrt(n * (n + 1.0) / 6.0)


def strain(
    position: Number, time: float, speed: float, size: float, mass: float, stiffness: float, exponent: float = HERTZ
) -> Number:
    """Strain ξ of the solitary wave of a given speed V, without preload.

    ξ = [(n+1) V²/(2c²)]^{1/(n−1)} cos^{2/(n−1)}(π (x − Vt)/L) for x within half the width L of the crest, and zero
    elsewhere, with c² = k D^{n+1}/m. The crest is at x = 0 at time zero.

    Parameters
    ----------
    position : float or ndarray
        Position x along the chain, m.
    time : float
        Time t, s.
    speed : float
        Speed V of the wave, m/s, positive.
    size : float
        Extent D of a particle along the chain, m.
    mass : float
        Mass m of a particle, kg.
    stiffness : float
        Stiffness k of the contacts, F = k δⁿ, N/mⁿ.
    exponent : float
        Exponent n > 1 of the contacts.

    Returns
    -------
    float or ndarray
        ξ, a pure number, with the shape of `position`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    Notes
    -----
    For n = 3/2 this is (5V²/4c²)² cos⁴(√10 (x − Vt)/(5D)); for spheres c² = 2E/(πρ(1−ν²)). This is one hump of the
    periodic solution that the thesis prints as equation 1.8. It solves equation 1.7. For other n it solves the
    corresponding equation V²ξ = c² [ξⁿ + nD²/(6(n+1)) ξ^{(n−1)/2} (ξ^{(n+1)/2})″].

    The particles move at the speed V ξ, and the contact forces are about k (D ξ)ⁿ. The theory assumes long waves and
    identical particles. The speed of a bead in a Hertzian chain is a pulse that is equally wide at 1 % of its height,
    14 % narrower at half of it, and never exactly zero.

    References
    ----------
    Khatri's thesis, equations 1.7 and 1.8.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    >>> chain = (bead.size, bead.mass, stiffness)
    >>> speed = hl.theory.solitary_speed_from_particle_speed(*chain, particle_speed=0.3)
    >>> round(speed * hl.theory.solitary_strain(0.0, 0.0, speed, *chain), 6)
    0.3
    """
    d, m, k = _particle(size, mass, stiffness)
    n, v = _steeper_than_linear(exponent), positive("speed", speed, "m/s")
    x = each(finite, "position", position, "m") - v * finite("time", time, "s")
    phase = np.minimum(np.abs(pi * x / width(d, n)), pi / 2.0)
    crest = (n + 1.0) * v**2 * m / (2.0 * k * d ** (n + 1.0))
    return _like(position, (crest * np.where(phase < pi / 2.0, np.cos(phase), 0.0) ** 2) ** (1.0 / (n - 1.0)))


def transit_time(distance: float, speed: Number, restitution: float = 1.0) -> Number:
    """Time T of a solitary wave over a distance to a structure, and back as a slower wave.

    T = (d/V_in) (1 + e^{−1/5}), where e = v_ref/v_in = (V_ref/V_in)⁵ compares particle speeds v. It holds for n = 3/2
    without preload. The time in contact with the structure is not included.

    Parameters
    ----------
    distance : float
        Distance d from the sensor to the structure, m.
    speed : float or ndarray
        Speed V_in of the incident wave, m/s, positive.
    restitution : float
        e of the structure, in (0, 1].

    Returns
    -------
    float or ndarray
        T, s, with the shape of `speed`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    Notes
    -----
    Before equation 6.19 the thesis prints the power 5 in e = (V_ref/V_in)⁵ as −1/5.

    References
    ----------
    Khatri's thesis, equations 6.9 to 6.15.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.solitary_transit_time(distance=0.125, speed=500.0) * 1e6, 6)
    500.0
    """
    way, e = positive("distance", distance, "m"), restitution_coefficient("restitution", restitution)
    return _like(speed, way / each(positive, "speed", speed, "m/s") * (1.0 + e**-0.2))


def transit_time_from_striker(
    beads: float, mass: float, stiffness: float, striker_speed: Number, restitution: float = 1.0
) -> Number:
    """Time T of a solitary wave over N beads to a structure and back, from the speed of the striker.

    T = 1.180 (1 + e^{−1/5}) N m^{2/5} v_striker^{−1/5} k^{−2/5}. It holds for n = 3/2 without preload. The time in
    contact with the structure is not included (see `theory.hertz_contact_time`).

    Parameters
    ----------
    beads : float
        Number N of beads between sensor and structure. It is not the number of beads of the chain, as under equation
        6.10.
    mass : float
        Mass m of a bead, kg.
    stiffness : float
        Stiffness k of the contacts, F = k δ^1.5, N/m^1.5.
    striker_speed : float or ndarray
        Speed v_striker, m/s, of a striker that equals the beads.
    restitution : float
        e of the structure, in (0, 1].

    Returns
    -------
    float or ndarray
        T, s, with the shape of `striker_speed`.

    Raises
    ------
    ValueError
        If a number is not finite or out of its range.

    Notes
    -----
    Equations 6.17 and 6.19 print k^{+2/5}. The 2.361 in 6.19 and 6.20 is 1.180 (1 + e^{−1/5}) for e = 1. The 1.414 in
    6.39 is (π/2)^{2/5} times 1.180, which follows from m/k of a sphere; e^{1/5} is printed there for e^{−1/5}.

    References
    ----------
    Khatri's thesis, equations 6.17, 6.19, 6.20 and 6.39.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    >>> time = hl.theory.solitary_transit_time_from_striker(13, bead.mass, stiffness, striker_speed=0.3 / 0.682)
    >>> speed = hl.theory.solitary_speed_from_particle_speed(bead.size, bead.mass, stiffness, particle_speed=0.3)
    >>> round(time * 1e6, 1), round(hl.theory.solitary_transit_time(13 * bead.size, speed) * 1e6, 1)
    (434.2, 434.2)
    """
    number, v = positive("beads", beads), each(positive, "striker_speed", striker_speed, "m/s")
    speed = wave_speed_from_particle_speed(1.0, mass, stiffness, PARTICLE_TO_STRIKER_SPEED * v)
    return _like(striker_speed, transit_time(number, speed, restitution))


def _particle(size: float, mass: float, stiffness: float) -> tuple[float, float, float]:
    return _length(size), positive("mass", mass, "kg"), positive("stiffness", stiffness, "N/m^n")


def _length(size: float) -> float:
    return within("size", size, SMALLEST_SIZE, LARGEST_SIZE, "m")


def _at_least_linear(exponent: float) -> float:
    if finite("exponent", exponent) < 1.0:
        raise ValueError(f"exponent = {exponent!r}: must be 1 or more")
    return _exponent(exponent)


def _steeper_than_linear(exponent: float) -> float:
    # Ji and Hong (1999): solitary waves exist for n > 1 only.
    if finite("exponent", exponent) <= 1.0:
        raise ValueError(f"exponent = {exponent!r}: must be greater than 1; softer contacts carry no solitary wave")
    return _exponent(exponent)


def _exponent(exponent: float) -> float:
    if exponent > LARGEST_EXPONENT:
        raise ValueError(f"exponent = {exponent!r}: must be at most {LARGEST_EXPONENT:g}")
    return float(exponent)


def _like(value: Number, result: Vector) -> Number:
    if not np.isfinite(result).all():
        raise ValueError("size, mass, stiffness, speed, force, exponent: give a result beyond the range of numbers")
    return float(result) if np.ndim(value) == 0 else result  # type: ignore[return-value]
