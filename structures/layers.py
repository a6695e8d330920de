"""Closed forms for impact on elastic bodies: a bead, or a chain, on a half-space, a rod, or two layers. SI units.

The chain's last bead stands for all of it (thesis, section 6.1.1): a bead of a mass m, kg, with Hertzian contacts k in
N/m^1.5; no losses, no gravity, no preload. Docstrings say how far a chain of point masses is from that (measured with
`Chain` in the thesis's setting: 20 steel beads of 9.52 mm, struck by another from 1 cm, read at bead 7).
Functions take a number, or an array where the type says so, and give the same; arrays broadcast. All raise ValueError,
naming the argument, where one is not finite or out of its range.
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
"""1.1803400: time in which the wave of a striker at v passes one bead like it, in units of (m²/k²v)^{1/5}.

From equations 6.12 and 6.16. The thesis prints 1.180 in 6.17 and 6.18, twice it as 2.361 in 6.19 and 6.20, and half
of that, rounded up, as 1.181 in 6.29 and 6.34.
"""


# One bead or one wave on a half-space or a rod (sections 6.1.1 and 6.1.2).


def contact_time(mass: Number | float, stiffness: Number | float, speed: float) -> Number:
    """Time in contact, s, of a mass (kg) that hits a Hertzian contact k (N/m^1.5) at a speed (m/s).

    T = 3.218 (m² / k² v)^{1/5} (Tillett 1954; thesis, section 6.1.1, equation 6.8, where V_s means the speed).
    Two free bodies: the reduced mass m₁m₂/(m₁ + m₂). For one bead: the last of a chain, pushed on by the others,
    stays 1.5 times as long on steel and 1.6 times on PTFE (force above 1 % of its peak).
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
    """TOF, s, of the primary wave from the sensor to a structure and back; a striker like the beads, m/s.

    TOF = [3.218 k_w^{−2/5} + 1.180 (1 + e^{−1/5}) N k_c^{−2/5}] (m²/v)^{1/5} (thesis, equation 6.18, right as printed;
    its second term alone, 6.17 and 6.19, has k_c^{+2/5} in print, and e = (V_ref/V_in)⁵ has −1/5 for the 5). e = 1
    gives 6.20; e of `layers.restitution` gives 6.29, whose V_s is the striker's speed. k_c between beads, k_w
    between bead and structure. N counts the beads from the sensor to the structure: 13 for sensor 7 of 20, not the 20
    as under 6.10. Sensor and structure five beads apart or more. On a half-space, e = 1, a chain is faster, by
    1.4 % (PTFE) to 3.0 % (steel); gravity makes it 2 % or 3 % faster still, a dashpot of 5 N s/m 3 % to 5 % slower.
    """
    number, m = positive("beads", beads), positive("mass", mass, "kg")
    chain, v = positive("chain_stiffness", chain_stiffness, "N/m^1.5"), positive("striker_speed", striker_speed, "m/s")
    wall = each(positive, "wall_stiffness", wall_stiffness, "N/m^1.5")
    transits = BEAD_TRANSIT * number * (1.0 + each(restitution_coefficient, "restitution", restitution) ** -0.2)
    return _plain((HERTZ_COLLISION * wall**-0.4 + transits * chain**-0.4) * m**0.4 / v**0.2)


def amplitude_ratio(restitution: Number) -> Number:
    """AR = e^{6/5} of the primary wave, from e = v_ref/v_in of bead speeds, in (0, 1].

    (Thesis, equations 6.23 and 6.24, right as printed.) AR = (V_ref/V_in)⁶ and V_ref/V_in = e^{1/5}: one solitary wave
    comes, and one goes. Where a secondary wave takes its share, e is not the structure's alone: on an elastic
    half-space, e = 1, a chain has AR 0.979 for steel and 0.915 for PTFE.
    """
    return _plain(each(restitution_coefficient, "restitution", restitution) ** 1.2)


def critical_modulus(material: Material, wall_poisson_ratio: float | None = None) -> float:
    """Young's modulus, Pa, below which a half-space sends a secondary wave back into a chain of a material.

    E/(2√2 − 1) (1 − ν_w²)/(1 − ν²) (thesis, equation 6.21, right as printed): bead and half-space touch as stiffly as
    bead and bead. With ν_w = ν, the default, 6.22: 0.547 E, 109.4 GPa for steel 440C (the thesis's "55 %", and its
    "≈ 100 GPa" but for 9 %). A guide, no threshold: at this modulus an undamped chain has no secondary wave of 1 %,
    where the thesis says 5 %; at 30 GPa it has one of 8 %.
    """
    instance("material", material, Material, "a Material; MATERIALS[name] gives one by name")
    nu = material.poisson_ratio if wall_poisson_ratio is None else finite("wall_poisson_ratio", wall_poisson_ratio)
    if not -1.0 < nu < 0.5:
        raise ValueError(f"wall_poisson_ratio = {wall_poisson_ratio!r}: must lie between -1 and 0.5, both excluded")
    return material.contact_modulus * (1.0 - nu**2) / (2.0 * sqrt(2.0) - 1.0)


def characteristic_length(bar_speed: Number | float, contact_time: Number | float) -> Number:
    """Length, m, of a rod whose far end answers just as the bead leaves: c T/2, from c in m/s and T in s.

    (Thesis, section 6.1.2, right as printed; 101 mm there for steel 440C with T by 6.8: 100.2 mm by Table 2.1, 101.2 mm
    for a bead of 8000 kg/m³.) A longer rod keeps the energy of the wave in it, a much shorter one gives it back. No
    sharp bound: for steel rods of 19 mm diameter AR falls from 0.979 at 25 mm to 0.928 at 100 and 0.925 at 150 mm.
    """
    speed, time = each(positive, "bar_speed", bar_speed, "m/s"), each(positive, "contact_time", contact_time, "s")
    return _plain(speed * time / 2.0)


# A stiff upper layer, a free rigid mass while the wave is there, on a soft lower one, a spring (section 6.1.3).


def restitution(mass: float, upper_mass: Number) -> Number:
    """e = v_ref/v_in, as a magnitude, of a bead that hits a free mass M_u, kg, greater than its own.

    e = (M_u − m)/(M_u + m) (thesis, equations 6.25, where the velocities' signs make it negative, and 6.26). Goes into
    `layers.amplitude_ratio`, and into `layers.time_of_flight` for 6.27 to 6.29. For one bead: on a free mass a chain
    has less AR than e^{6/5}, 0.417 for 0.542 at M_u = 4m and 0.929 for 0.963 at 64m. A lower layer of PTFE resists
    meanwhile, and makes it 0.542 at 4m, 0.693 for 0.740 at 8m, and 0.923 at 64m.
    """
    m, upper = positive("mass", mass, "kg"), each(positive, "upper_mass", upper_mass, "kg")
    if upper.size and upper.min() <= m:
        raise ValueError(
            f"upper_mass = {float(upper.min())!r}: must be greater than mass = {m!r} kg, or the bead does not come back"
        )
    return _plain((upper - m) / (upper + m))


def upper_speed(mass: float, upper_mass: Number, incident_speed: float) -> Number:
    """Speed, m/s, of a free mass M_u, kg, once a bead of mass m has hit it: V_u = 2 m v_in/(m + M_u).

    (Thesis, equation 6.30, right as printed.) v_in is the bead's own speed: in a chain 0.682 of the striker's, by 6.16.
    """
    m, upper = positive("mass", mass, "kg"), each(positive, "upper_mass", upper_mass, "kg")
    return _plain(2.0 * m * positive("incident_speed", incident_speed, "m/s") / (m + upper))


def axial_stiffness(youngs_modulus: float, area: float, length: Number) -> Number:
    """k_d = E A/L, N/m, of a layer of a modulus, Pa, area, m², and length, m (thesis, before equation 6.32).

    At rest, and free to widen: for layers longer than wide.
    """
    modulus, section = positive("youngs_modulus", youngs_modulus, "Pa"), positive("area", area, "m²")
    return _plain(modulus * section / each(positive, "length", length, "m"))


def secondary_delay(upper_mass: Number | float, lower_mass: Number | float, lower_stiffness: Number | float) -> Number:
    """T_l, s, by which the secondary wave of two layers follows the primary one: TOF_SSW = TOF_PSW + T_l.

    T_l = π √((M_u + M_l/3)/k_d), half a period of the upper layer on the lower one. The thesis (equations 6.32 to 6.34)
    has no M_l, which is right for M_l/3 ≪ M_u only; lower_mass = 0 is its T_l. Against a rod on a fixed base with M_u
    at its end, M_l/3 is 0.2 % short for M_l = 0.41 M_u, 0.8 % for 1.1, 4.8 % for 6.6, and never more than 9.3 %.
    Chains take longer: it is 11 % to 21 % short over section 6.1.4, where M_u = 4m (26 % to 50 % without M_l). A
    heavy upper layer makes a weak secondary wave, whose slower way back 6.33 leaves out: 38 % short for M_u = 16m.
    """
    upper, lower = each(positive, "upper_mass", upper_mass, "kg"), each(not_negative, "lower_mass", lower_mass, "kg")
    spring = each(positive, "lower_stiffness", lower_stiffness, "N/m")
    return _plain(pi * np.sqrt((upper + lower / 3.0) / spring))


def _plain(result: Vector) -> Number:  # type: ignore[type-var]
    return float(result) if np.ndim(result) == 0 else result  # type: ignore[return-value]
