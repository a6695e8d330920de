"""Theory of the impact of a bead, or of a chain, on a plate: point impedance, Zener's impact in SI units, and the
distance within which an edge of the plate matters.

The last bead of the chain stands for the whole chain. It meets an infinite thin plate at the speed `impact_speed`, m/s
(Khatri's thesis, section 6.2). In that section the thesis mixes three speeds and two densities. Therefore every
function takes its speeds as arguments, and THESIS_IMPACT holds the values of the thesis.

Functions take a number, or an array where the type says so, and return the same kind. Every function raises a
ValueError that names the argument if a number is not finite or out of its range.
"""

from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from plates.plate import Plate
from plates.section import point_rigidity
from plates.theory import zener
from structures.bodies.layers import BEAD_TRANSIT
from structures.bodies.layers import contact_time as contact_time_half_space
from structures.caution import caution
from structures.checks import each, instance, not_negative, positive, several
from structures.material import Material
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness

Number = TypeVar("Number", float, Vector)

A0_OVER_BAR_SPEED = 0.2
"""Ratio of the speed of the A0 Lamb wave to √(E/ρ) that the thesis assumes for its plates (section 6.2.2)."""

RAYLEIGH_OVER_BAR_SPEED = 0.57
"""Ratio of the speed of the Rayleigh wave to √(E/ρ) in the thesis (section 6.2.2)."""


class ThesisImpact(NamedTuple):
    """Material of the beads, and speeds in m/s, from which the numbers printed in section 6.2.1 of the thesis follow.

    bead_speed belongs to the printed λ (equation 6.37), striker_speed to the printed T_c (equation 6.38).
    """

    material: Material
    bead_speed: float
    striker_speed: float


THESIS_IMPACT = ThesisImpact(Material(200.0e9, 0.28, 8000.0, "steel 440C as heavy as 316"), 0.682 * 0.63, 0.31)
"""The values that reproduce the printed numbers of section 6.2.1, on aluminium 6061. The text does not state them.

T_c0 = 27.7, 55.6 and 111.44 µs require E and ν of steel 440C, the density of steel 316, and the striker's 0.31 m/s.
With these and a speed of 0.43 m/s, λ equals the printed values: 0.32, 0.166, 0.072; 1.28, 0.288 (printed "0.2"); 5.15,
1.16. The speed 0.43 m/s may be 0.682 times 0.63 m/s, the striker's speed of section 3.3. Table 2.1 and 0.31 m/s would
give 0.295, 0.153 and 0.0663 for D = 4.76 mm. T_c = 87.81, 59.1, 1435.17 and 164.38 µs follow from equation 6.38 with λ
at 0.43 m/s and v = 0.31 m/s, within 0.2 %.
"""


class Bead(Protocol):
    """The properties of a bead that the theory needs."""

    @property
    def mass(self) -> float:
        """Mass, kg."""
        ...

    @property
    def size(self) -> float:
        """Extent along the chain, m."""
        ...

    @property
    def surface(self) -> Surface:
        """Surface at the contact, for Hertz's law."""
        ...


def point_impedance(plate: Plate) -> float:
    """Return the point impedance of an infinite thin plate: force over velocity, 8 √(D ρ t).

    The impedance is real. An impulse I moves the point by I / (8 √(D ρ t)), and the point stays there until an echo
    returns.

    Parameters
    ----------
    plate : Plate
        A plate from `kirchhoff_plate`, `mindlin_plate`, `kirchhoff_panel` or `mindlin_panel`. Only its wall matters. A
        laminate has the rigidity D of the isotropic plate with the same point impedance.

    Returns
    -------
    float
        Impedance, N s/m.

    Raises
    ------
    ValueError
        If `plate` is not a Plate.

    References
    ----------
    Cremer, Heckl, Petersson, Structure-Borne Sound, 3rd ed., table 5.1.

    Examples
    --------
    >>> import hertzlink as hl
    >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> round(hl.theory.plate_point_impedance(plate), 2)
    174.76
    """
    instance("plate", plate, Plate, "a Plate, as kirchhoff_plate or mindlin_plate make")
    if plate.additions:
        names = ", ".join(dict.fromkeys(type(addition).__name__ for addition in plate.additions))
        caution(
            f"additions: laws of a plain plate leave out {names}; runs include them, and critical_distance_search "
            "searches with them"
        )
    return float(8.0 * (point_rigidity(plate.section) * plate.mass_per_area) ** 0.5)


# A bead on an infinite thin plate (section 6.2.1).


def inelasticity_parameter(bead: Bead, plate: Plate, impact_speed: Number) -> Number:
    """Return Zener's inelasticity parameter λ of a bead that hits an infinite thin plate.

    λ = m^{3/5} k^{2/5} v^{1/5} / (8 √(D ρ t)): the mass m of the bead over the product of the plate's impedance and the
    time (m²/k²v)^{1/5} of Hertz's collision.

    Parameters
    ----------
    bead : Bead
        The bead that hits the plate; any object with `mass`, `size` and `surface`.
    plate : Plate
        A thin plate, from `kirchhoff_plate` or `kirchhoff_panel`.
    impact_speed : float or ndarray
        Speed v of the bead at impact, m/s, positive.

    Returns
    -------
    float or ndarray
        λ, a pure number, with the shape of `impact_speed`.

    Raises
    ------
    ValueError
        If the plate is not a thin Plate, if `bead` is not a bead, or if a speed is not positive.

    Notes
    -----
    For a sphere this is equation 6.37 of the thesis, which is right as printed: π^{3/5}/(4√3) (D/t)² (ρ_s/ρ_p)^{3/5}
    [v² ρ_p (1−ν_p²)/E_p]^{1/10} [1 + E_p (1−ν_s²)/(E_s (1−ν_p²))]^{−2/5}. Its v_in is "the maximum velocity of the Nth
    particle". The printed λ follow from THESIS_IMPACT; they are 8 % above those of Table 2.1 and 0.31 m/s.

    λ is valid under three conditions. No echo returns while the bead is in contact. Bending waves of the period 2T_c
    are long compared with t. The contact is small compared with t, so that Hertz's k is that of a half-space.

    References
    ----------
    Khatri's thesis, section 6.2.1, equation 6.37; Zener, Phys. Rev. 59 (1941) 669.

    Examples
    --------
    The thesis prints 1.28 for a bead of 9.53 mm on aluminium of 2.29 mm.

    >>> import hertzlink as hl
    >>> from plates.theory.impact import THESIS_IMPACT
    >>> material, speed, _ = THESIS_IMPACT
    >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> round(hl.theory.plate_inelasticity(hl.Sphere(4.765e-3, material), plate, speed), 2)
    1.28
    """
    return _plain(_inelasticity(bead, plate, _collision_time(bead, plate, impact_speed)))


def contact_time(
    bead: Bead, plate: Plate, impact_speed: Number | float, inelasticity: Number | float | None = None
) -> Number:
    """Return the time in contact T_c of one bead with an infinite thin plate.

    T_c = τ_c(λ) m^{2/5} v^{−1/5} k^{−2/5}, where τ_c is `theory.zener_contact_time`.

    Parameters
    ----------
    bead : Bead
        The bead that hits the plate; any object with `mass`, `size` and `surface`.
    plate : Plate
        A thin plate, from `kirchhoff_plate` or `kirchhoff_panel`.
    impact_speed : float or ndarray
        Speed v of the bead at impact, m/s, positive.
    inelasticity : float or ndarray, optional
        λ ≥ 0; by default `inelasticity_parameter` of the same bead, plate and speed.

    Returns
    -------
    float or ndarray
        T_c, s; `impact_speed` and `inelasticity` broadcast.

    Raises
    ------
    ValueError
        If the plate is not a thin Plate, if `bead` is not a bead, if a speed is not positive, or if λ is negative.

    Notes
    -----
    Equation 6.38 is right as printed. The printed T_c mix speeds (see THESIS_IMPACT): λ belongs to one speed, and v is
    another one. The formula holds for one bead. The other beads push on the last bead of a chain (see
    `theory.hertz_contact_time`).

    References
    ----------
    Khatri's thesis, section 6.2.1, equation 6.38.

    Examples
    --------
    The thesis prints 87.81 µs for a bead of 9.53 mm on aluminium of 2.29 mm.

    >>> import hertzlink as hl
    >>> from plates.theory.impact import THESIS_IMPACT
    >>> bead = hl.Sphere(4.765e-3, THESIS_IMPACT.material)
    >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> round(hl.theory.plate_contact_time(bead, plate, 0.31, inelasticity=1.28) * 1e6, 1)
    87.8
    """
    time = _collision_time(bead, plate, impact_speed)
    parameter = (
        _inelasticity(bead, plate, time) if inelasticity is None else each(not_negative, "inelasticity", inelasticity)
    )
    return _plain(time * zener.contact_time(parameter))


def amplitude_ratio(inelasticity: Number) -> Number:
    """Return the amplitude ratio AR of the primary wave that an infinite thin plate reflects.

    AR = e^{6/5}, where e is `theory.zener_restitution` of λ.

    Parameters
    ----------
    inelasticity : float or ndarray
        λ ≥ 0, from `inelasticity_parameter`.

    Returns
    -------
    float or ndarray
        AR, with the shape of `inelasticity`.

    Raises
    ------
    ValueError
        If a λ is negative or not finite.

    Notes
    -----
    Equation 6.24 and figure 6.18 are right as printed. The text says that AR "decreases with the decrease in aspect
    ratio" D/t; in fact it increases. One bead stands for the chain: the formula has no losses, no secondary waves and
    no gravity. `theory.primary_amplitude_ratio` takes an e of any origin.

    References
    ----------
    Khatri's thesis, equation 6.24 and figure 6.18.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.plate_amplitude_ratio(0.32), 4)
    0.5271
    """
    return _plain(np.asarray(zener.restitution(inelasticity)) ** 1.2)


def normalised_time_of_flight(
    beads: float, bead: Bead, plate: Plate, striker_speed: Number | float, impact_speed: Number | float | None = None
) -> Number:
    """Return the time of flight per bead size, TOF/D, of the primary wave from the sensor to a plate and back.

    TOF = 1.180 (1 + e^{−1/5}) N (m²/k_c² v)^{1/5} + τ_c (m²/k_w² v_in)^{1/5}: the thesis's equation 6.18 with τ_c(λ)
    instead of 3.218. k_c is the stiffness between two beads, k_w that between bead and plate. For given materials and
    speeds TOF/D depends on D/t only. The plate is infinite and thin.

    Parameters
    ----------
    beads : float
        Number N of beads from the sensor to the plate: 13 for sensor 7 of 20 beads.
    bead : Bead
        One bead of the chain; any object with `mass`, `size` and `surface`.
    plate : Plate
        A thin plate, from `kirchhoff_plate` or `kirchhoff_panel`.
    striker_speed : float or ndarray
        Speed v, m/s, of a striker that equals the beads.
    impact_speed : float or ndarray, optional
        Speed v_in of the last bead at impact, m/s, by default `striker_speed`. It enters λ, e, τ_c and the time in
        contact.

    Returns
    -------
    float or ndarray
        TOF/D, s/m; `striker_speed` and `impact_speed` broadcast.

    Raises
    ------
    ValueError
        If the plate is not a thin Plate, if `bead` is not a bead, or if a number or a speed is not positive.

    Notes
    -----
    For spheres this is equation 6.39, which prints e^{+1/5} instead of e^{−1/5}. Its printed factor 0.853 requires
    v_in = 0.682 v, the greatest speed of a bead in the wave (equation 6.16). With the default v_in = v the factor is
    0.790.

    References
    ----------
    Khatri's thesis, equations 6.18 and 6.39.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> round(hl.theory.plate_normalised_time_of_flight(13, bead, plate, striker_speed=0.31), 5)
    0.06983
    """
    number, speed = positive("beads", beads), each(positive, "striker_speed", striker_speed, "m/s")
    time = _collision_time(bead, plate, speed if impact_speed is None else impact_speed)
    parameter = _inelasticity(bead, plate, time)
    between = hertz_stiffness(bead.surface, bead.surface)
    transit = BEAD_TRANSIT * number * (bead.mass**2 / (between**2 * speed)) ** 0.2
    flight = transit * (1.0 + zener.restitution(parameter) ** -0.2) + time * zener.contact_time(parameter)
    return _plain(flight / bead.size)


# The edge of the plate (section 6.2.2).


def critical_distance_bounds(
    bead: Bead, plate: Plate, impact_speed: float, wave_speeds: tuple[float, float] | None = None
) -> tuple[float, float]:
    """Return thesis's two estimates of the critical distance: one with the A0 Lamb wave, one with the Rayleigh wave.

    L = c T/2, where T is the Hertzian contact time of the bead on a half-space of the plate's material, and where
    c = 0.2 √(E/ρ) or 0.57 √(E/ρ).

    Parameters
    ----------
    bead : Bead
        The last bead of the chain; any object with `mass`, `size` and `surface`.
    plate : Plate
        A thin plate, from `kirchhoff_plate` or `kirchhoff_panel`.
    impact_speed : float
        Speed, m/s, of the striker (see Notes).
    wave_speeds : tuple of two floats, optional
        Two other wave speeds, m/s, such as `theory.LambWaves(material, thickness).group_speed(frequency)` and
        `theory.rayleigh_speed(material)`. Plates of a Laminate need them.

    Returns
    -------
    tuple of two floats
        L, m, for the first and the second wave speed.

    Raises
    ------
    ValueError
        If the plate is not a thin Plate, if `bead` is not a bead, if a speed is not positive, or if a plate without a
        single Material has no `wave_speeds`.

    Notes
    -----
    The printed factor 1.37 of equation 6.42 follows from 0.682 times the striker's speed, which is the speed of the
    beads in the wave. With the striker's speed the factor is 1.272. The printed 0.57 is the Rayleigh speed of
    aluminium. The printed 0.2, or 1000 m/s, is the group speed of A0 at 12 kHz in aluminium of 2.29 mm, and at 6 kHz in
    aluminium of 4.83 mm.

    T does not depend on the thickness t, although the text says that L is longer for thin plates.
    `theory.plate_contact_time` is longer for thin plates.

    References
    ----------
    Khatri's thesis, section 6.2.2, equations 6.41 and 6.42.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> slow, fast = hl.critical_distance_bounds(bead, plate, impact_speed=0.31)
    >>> round(slow * 1e3, 1), round(fast * 1e3, 1)
    (27.8, 79.3)
    """
    stiffness = wall_stiffness(bead, plate)
    duration = contact_time_half_space(bead.mass, stiffness, positive("impact_speed", impact_speed, "m/s"))
    if wave_speeds is None:
        if not isinstance(plate.material, Material):
            raise ValueError(f"plate.material = {plate.material!r}: must be a Material, with one speed √(E/ρ)")
        wave_speeds = A0_OVER_BAR_SPEED * plate.material.bar_speed, RAYLEIGH_OVER_BAR_SPEED * plate.material.bar_speed
    if not several(wave_speeds) or len(wave_speeds) != 2:
        raise ValueError(f"wave_speeds = {wave_speeds!r}: must be two speeds, m/s")
    slow, fast = (positive("wave_speeds", speed, "m/s") for speed in wave_speeds)
    return slow * duration / 2.0, fast * duration / 2.0


def wall_stiffness(bead: Bead, plate: Plate) -> float:
    """Return the stiffness k, N/m^1.5, of the Hertz contact between a bead and a thin plate."""
    if not instance("plate", plate, Plate, "a Plate, as kirchhoff_plate or kirchhoff_panel make").thin:
        raise ValueError(f"plate = {plate!r}: must be thin, as kirchhoff_plate or kirchhoff_panel make")
    if not all(hasattr(bead, name) for name in ("mass", "size", "surface")) or not isinstance(bead.mass, float):
        raise ValueError(f"bead = {bead!r}: must be a bead, with mass, size and surface")
    return hertz_stiffness(bead.surface, Surface(plate.section.struck))


def _collision_time(bead: Bead, plate: Plate, impact_speed: float | Vector) -> Vector:
    """Return the unit of time of Hertz's collision, (m²/k²v)^{1/5}, in s."""
    stiffness, speed = wall_stiffness(bead, plate), each(positive, "impact_speed", impact_speed, "m/s")
    time: Vector = (bead.mass**2 / (stiffness**2 * speed)) ** 0.2
    return time


def _inelasticity(bead: Bead, plate: Plate, collision_time: Vector) -> Vector:
    """Return λ for a unit of time (m²/k²v)^{1/5} in s."""
    return np.asarray(bead.mass / (point_impedance(plate) * collision_time))


def _plain(result: Vector) -> Number:  # type: ignore[type-var]
    return float(result) if np.ndim(result) == 0 else result  # type: ignore[return-value]
