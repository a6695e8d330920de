"""Theory of waves in a chain of identical particles that touch by F = k δⁿ: closed forms, SI units.

Everything rests on Nesterenko's long-wave equation 1.7, in which the strain ξ changes little over a particle. For
Hertz's n = 3/2 the wave is only five particles long, and docstrings say how far a chain of point masses is from it
(measured with `Chain`). size, m, is the particle's extent along the chain, mass in kg, stiffness k in N/mⁿ, exponent n.
Functions take a number, or an array where the type says so, and give the same. All raise ValueError, naming the
argument, where one is not finite or out of its range.
"""

from math import pi, sqrt
from typing import TypeVar

import numpy as np
from scipy.special import betainc

from structures.checks import each, finite, not_negative, positive, restitution_coefficient
from structures.structure import Vector

Number = TypeVar("Number", float, Vector)

HERTZ = 1.5
"""Exponent of Hertz's law F = k δ^1.5."""

PARTICLE_TO_STRIKER_SPEED = 0.682
"""Greatest speed of a particle over the speed of a striker that is such a particle (thesis, equation 6.16; Chatterjee
1999): n = 3/2, no preload, no losses, ten particles or more from either end. `Chain` gives 0.6816."""

CONTACT_TO_CENTRE_FORCE = 1.414
"""β: greatest contact force over greatest bead-centre force, the mean of a bead's two contacts, as a sensor shows it.

(Thesis, equation 3.2; "F_{d,e}" beside it is a misprint.) Equal spheres, no preload: `Chain` gives 1.4138;
the profile 1.8 would give cos(1/√10)⁻⁶ = 1.357.
"""


def tangent_stiffness(stiffness: float, preload: Number, exponent: float = HERTZ) -> Number:
    """C = dF/dδ = n k^{1/n} F₀^{(n−1)/n}, N/m, of a contact under a preload F₀ ≥ 0, N; n ≥ 1."""
    k, n = positive("stiffness", stiffness, "N/m^n"), _at_least_linear(exponent)
    force = each(not_negative, "preload", preload, "N")
    return _like(preload, n * k ** (1.0 / n) * force ** ((n - 1.0) / n))


def angular_frequency(
    wave_number: Number, size: float, mass: float, stiffness: float, preload: float, exponent: float = HERTZ
) -> Number:
    """ω, rad/s, of a linear wave of a real wave number, rad/m, in a preloaded chain.

    ω² = (4C/m) sin²(kd/2) (thesis, equation 1.4, which prints ka and ≅: it is exact for small motions,
    F_d ≪ F₀). Periodic in k: waves longer than 2d, |k| ≤ π/d, are all there are.
    """
    waves, d = each(finite, "wave_number", wave_number, "rad/m"), positive("size", size, "m")
    highest = 2.0 * pi * cutoff_frequency(mass, stiffness, preload, exponent)
    return _like(wave_number, highest * np.abs(np.sin(waves * d / 2.0)))


def cutoff_frequency(mass: float, stiffness: float, preload: Number, exponent: float = HERTZ) -> Number:
    """√(C/m)/π, Hz: the highest frequency that a preloaded chain carries (thesis, equation 1.4; F_d ≪ F₀)."""
    m = positive("mass", mass, "kg")
    return _like(preload, np.sqrt(tangent_stiffness(stiffness, preload, exponent) / m) / pi)


def sound_speed(size: float, mass: float, stiffness: float, preload: Number, exponent: float = HERTZ) -> Number:
    """d √(C/m), m/s, of long linear waves in a preloaded chain (thesis, equation 1.4 for kd → 0; F_d ≪ F₀).

    Zero without preload for n > 1: the sonic vacuum.
    """
    d, m = positive("size", size, "m"), positive("mass", mass, "kg")
    return _like(preload, d * np.sqrt(tangent_stiffness(stiffness, preload, exponent) / m))


def wave_speed_from_force(
    size: float, mass: float, stiffness: float, force: Number, preload: float = 0.0, exponent: float = HERTZ
) -> Number:
    """Speed, m/s, of a solitary wave whose contact force peaks `force` = F_d above the preload F₀, both in N.

    With q = (F₀/F_m)^{1/n} and the total peak F_m = F₀ + F_d,
    V = D √(2/(n+1)) √(k^{1/n}/m) F_m^{(n−1)/(2n)} √[1 + n q^{n+1} − (n+1) qⁿ] / (1 − q).
    For n = 3/2 this is 5.10 (and for spheres 1.9, whose f_r must be F_m/F₀, not F_d/F₀ as printed). F₀ = 0: 5.12, where
    the root of k^{1/n}/m is missing in print; n = 3/2: 5.11, for spheres 1.10. F_d → 0: `sound_speed`, to all digits.
    Long waves, identical particles, n > 1. A Hertzian chain is 1.2 % faster without preload, 0.3 % for
    F_d = 5 F₀. A sensor shows the bead-centre force: without preload, multiply it by CONTACT_TO_CENTRE_FORCE.
    """
    d, m, k = _particle(size, mass, stiffness)
    n, rest = _steeper_than_linear(exponent), not_negative("preload", preload, "N")
    dynamic = each(not_negative, "force", force, "N")
    total = dynamic + rest
    some = np.where(total > 0.0, total, 1.0)
    # 1 − q, from whichever of the two forces keeps its digits.
    weak = -np.expm1(np.log1p(-np.minimum(dynamic / some, 0.5)) / n)
    gap = np.where(dynamic < rest, weak, 1.0 - (rest / some) ** (1.0 / n))
    # The bracket is the incomplete beta function I₁₋q(2, n), free of the cancellation that eats it as q → 1.
    safe = np.where(gap < 1e-8, 1.0, gap)
    near = n * (n + 1.0) / 2.0 * (1.0 - 2.0 / 3.0 * (n - 1.0) * gap)
    bracket = np.where(gap < 1e-8, near, betainc(2.0, n, safe) / safe**2)
    overlap = (total / k) ** (1.0 / n)
    return _like(force, d * np.sqrt(2.0 / (n + 1.0) * k / m * overlap ** (n - 1.0) * bracket))


def wave_speed_from_particle_speed(
    size: float, mass: float, stiffness: float, particle_speed: Number, exponent: float = HERTZ
) -> Number:
    """Speed V, m/s, of a solitary wave whose particles reach particle_speed v_p, m/s; no preload, n > 1.

    V = D [2 k v_p^{n−1} / ((n+1) m)]^{1/(n+1)}, from v_p = V ξ_max. For n = 3/2: (16/25)^{1/5} 2R (v_p k²/m²)^{1/5} =
    1.829 R (…)^{1/5} (thesis, equations 6.12 and 6.13, right as printed; A there is k, while in 1.5 it is k/m).
    Long waves, identical particles. A Hertzian chain is 0.8 % slower.
    """
    d, m, k = _particle(size, mass, stiffness)
    n, v = _steeper_than_linear(exponent), each(positive, "particle_speed", particle_speed, "m/s")
    return _like(particle_speed, d * (2.0 * k / ((n + 1.0) * m) * v ** (n - 1.0)) ** (1.0 / (n + 1.0)))


def peak_force_from_particle_speed(
    mass: float, stiffness: float, particle_speed: Number, exponent: float = HERTZ
) -> Number:
    """Peak contact force, N, of a solitary wave whose particles reach particle_speed, m/s; no preload, n > 1.

    F_m = k [(n+1) m v_p²/(2k)]^{n/(n+1)}: what makes 5.12 (corrected) and 6.12 the same speed. From a striker like the
    particles, v_p = PARTICLE_TO_STRIKER_SPEED times its speed. Of use for n close to 1 only: it takes the peak strain
    for the mean strain over a particle, which is what a contact feels. A Hertzian chain has 0.886 of this force,
    n = 1.222 has 0.946.
    """
    m, k = positive("mass", mass, "kg"), positive("stiffness", stiffness, "N/m^n")
    n, v = _steeper_than_linear(exponent), each(positive, "particle_speed", particle_speed, "m/s")
    return _like(particle_speed, k * ((n + 1.0) * m * v**2 / (2.0 * k)) ** (n / (n + 1.0)))


def width(size: float, exponent: float = HERTZ) -> float:
    """Length, m, of a solitary wave without preload, from zero to zero of the strain, at any amplitude; n > 1.

    L = πD/(n−1) √(n(n+1)/6) (thesis, equation 5.13): 4.967 D for n = 3/2. Long waves: the more apt the nearer n to 1.
    """
    n = _steeper_than_linear(exponent)
    return pi * positive("size", size, "m") / (n - 1.0) * sqrt(n * (n + 1.0) / 6.0)


def strain(
    position: Number, time: float, speed: float, size: float, mass: float, stiffness: float, exponent: float = HERTZ
) -> Number:
    """Strain ξ of the solitary wave of a speed V, m/s, whose crest is at x = 0 at time zero; x in m, t in s; n > 1.

    ξ = [(n+1) V²/(2c²)]^{1/(n−1)} cos^{2/(n−1)}(π (x − Vt)/L) within half the width L of the crest, zero beyond, with
    c² = k D^{n+1}/m. For n = 3/2: (5V²/4c²)² cos⁴(√10 (x − Vt)/(5D)), where for spheres c² = 2E/(πρ(1−ν²)) (thesis,
    equation 1.8: the one hump of the periodic solution that it prints). Solves 1.7, and for other n its like,
    V²ξ = c² [ξⁿ + nD²/(6(n+1)) ξ^{(n−1)/2} (ξ^{(n+1)/2})″]. Particles move at V ξ, contacts feel about k (D ξ)ⁿ.
    Long waves, no preload, identical particles. The speed of a bead in a Hertzian chain is a pulse as wide at 1 % of
    its height, 14 % slimmer at half of it, and never quite zero.
    """
    d, m, k = _particle(size, mass, stiffness)
    n, v = _steeper_than_linear(exponent), positive("speed", speed, "m/s")
    x = each(finite, "position", position, "m") - v * finite("time", time, "s")
    phase = np.minimum(np.abs(pi * x / width(d, n)), pi / 2.0)
    crest = (n + 1.0) * v**2 * m / (2.0 * k * d ** (n + 1.0))
    return _like(position, (crest * np.where(phase < pi / 2.0, np.cos(phase), 0.0) ** 2) ** (1.0 / (n - 1.0)))


def transit_time(distance: float, speed: Number, restitution: float = 1.0) -> Number:
    """Time, s, of a wave of a speed, m/s, over a distance, m, to a structure, and back as a slower wave.

    T = (d/V_in) (1 + e^{−1/5}) (thesis, equations 6.9 to 6.15), where e = v_ref/v_in = (V_ref/V_in)⁵ in (0, 1] compares
    particle speeds (before 6.19 the power is printed as −1/5). n = 3/2, no preload. Without the time in contact.
    """
    way, e = positive("distance", distance, "m"), restitution_coefficient("restitution", restitution)
    return _like(speed, way / each(positive, "speed", speed, "m/s") * (1.0 + e**-0.2))


def transit_time_from_striker(
    beads: float, mass: float, stiffness: float, striker_speed: Number, restitution: float = 1.0
) -> Number:
    """Time, s, of a wave over N `beads` to a structure and back, from the speed, m/s, of a striker like the beads.

    T = 1.180 (1 + e^{−1/5}) N m^{2/5} v_striker^{−1/5} k^{−2/5} (thesis, equation 6.17; it and 6.19 print k^{+2/5}).
    N counts the beads between sensor and structure, not the chain's as under 6.10. 2.361 in 6.19 and 6.20 is this for
    e = 1; 1.414 in 6.39 is (π/2)^{2/5} times 1.180, from m/k of a sphere, with e^{−1/5} where e^{1/5} is printed.
    n = 3/2, no preload. Without the time in contact (`layers.contact_time`).
    """
    number, v = positive("beads", beads), each(positive, "striker_speed", striker_speed, "m/s")
    speed = wave_speed_from_particle_speed(1.0, mass, stiffness, PARTICLE_TO_STRIKER_SPEED * v)
    return _like(striker_speed, transit_time(number, speed, restitution))


def _particle(size: float, mass: float, stiffness: float) -> tuple[float, float, float]:
    return positive("size", size, "m"), positive("mass", mass, "kg"), positive("stiffness", stiffness, "N/m^n")


def _at_least_linear(exponent: float) -> float:
    if finite("exponent", exponent) < 1.0:
        raise ValueError(f"exponent = {exponent!r}: must be 1 or more")
    return float(exponent)


def _steeper_than_linear(exponent: float) -> float:
    # Ji and Hong (1999): solitary waves exist for n > 1 only.
    if finite("exponent", exponent) <= 1.0:
        raise ValueError(f"exponent = {exponent!r}: must be greater than 1; softer contacts carry no solitary wave")
    return float(exponent)


def _like(value: Number, result: Vector) -> Number:
    return float(result) if np.ndim(value) == 0 else result  # type: ignore[return-value]
