"""Theory of the impact of a bead, or of a chain, on a plate: point impedance, Zener's impact in SI units, and the
distance within which an edge of the plate matters.

The last bead of the chain stands for the whole chain. It meets an infinite thin plate at the speed `impact_speed`, m/s
(Khatri's thesis, section 6.2). In that section the thesis mixes three speeds and two densities. Therefore every
function takes its speeds as arguments, and THESIS_IMPACT holds the values of the thesis.

Functions take a number, or an array where the type says so, and return the same kind. Every function raises a
ValueError that names the argument if a number is not finite or out of its range.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from plates.plate import Plate
from plates.theory import zener
from structures.bodies.layers import BEAD_TRANSIT
from structures.bodies.layers import contact_time as contact_time_half_space
from structures.checks import each, instance, not_negative, positive, several
from structures.material import Material
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness

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


@dataclass(frozen=True, eq=False)
class PlateImpact:
    """The impact of a bead, or of a chain's last bead, on an infinite thin plate, by Zener's theory.

    Parameters
    ----------
    bead : Bead
        The bead that hits the plate; any object with `mass`, `size` and `surface`.
    plate : Plate
        A thin plate, from `kirchhoff_plate`.
    impact_speed : float or ndarray
        Speed v of the bead at impact, m/s, positive.
    inelasticity : float or ndarray, optional
        Zener's inelasticity parameter λ ≥ 0. By default m^{3/5} k^{2/5} v^{1/5} / (8 √(D ρ t)): the mass m of the bead
        over the product of the plate's impedance and the time (m²/k²v)^{1/5} of Hertz's collision.

    Raises
    ------
    ValueError
        If the plate is not a thin Plate, if `bead` is not a bead, if a speed is not positive, or if λ is negative.

    Notes
    -----
    For a sphere λ is equation 6.37 of the thesis, which is right as printed: π^{3/5}/(4√3) (D/t)² (ρ_s/ρ_p)^{3/5}
    [v² ρ_p (1−ν_p²)/E_p]^{1/10} [1 + E_p (1−ν_s²)/(E_s (1−ν_p²))]^{−2/5}. Its v_in is "the maximum velocity of the Nth
    particle". The printed λ follow from THESIS_IMPACT; they are 8 % above those of Table 2.1 and 0.31 m/s. The printed
    T_c mix speeds: λ belongs to one, and v is another one.

    λ is valid under three conditions. No echo returns while the bead is in contact. Bending waves of the period 2T_c
    are long compared with t. The contact is small compared with t, so that Hertz's k is that of a half-space.

    One bead stands for the chain: there are no losses, no secondary waves and no gravity, and the other beads, which
    push on the last one, lengthen its contact (see `theory.hertz_contact_time`).

    References
    ----------
    Khatri's thesis, section 6.2.1, equations 6.24, 6.37 to 6.39 and figure 6.18; Zener, Phys. Rev. 59 (1941) 669.

    Examples
    --------
    The thesis prints 1.28 for a bead of 9.53 mm on aluminium of 2.29 mm, and 87.81 µs in contact at another speed.

    >>> import hertzlink as hl
    >>> from plates.theory.impact import THESIS_IMPACT
    >>> bead = hl.Sphere(4.765e-3, THESIS_IMPACT.material)
    >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> round(hl.theory.PlateImpact(bead, plate, THESIS_IMPACT.bead_speed).inelasticity, 2)
    1.28
    >>> round(hl.theory.PlateImpact(bead, plate, 0.31, inelasticity=1.28).contact_time * 1e6, 1)
    87.8
    """

    bead: Bead
    plate: Plate
    impact_speed: Any
    inelasticity: Any = None
    _collision_time: Any = field(init=False, repr=False)
    """The unit of time of Hertz's collision, (m²/k²v)^{1/5}, s."""

    def __post_init__(self) -> None:
        stiffness = wall_stiffness(self.bead, self.plate)
        speed = each(positive, "impact_speed", self.impact_speed, "m/s")
        object.__setattr__(self, "_collision_time", (self.bead.mass**2 / (stiffness**2 * speed)) ** 0.2)
        if self.inelasticity is None:
            parameter = np.asarray(self.bead.mass / (self.plate.point_impedance * self._collision_time))
        else:
            parameter = each(not_negative, "inelasticity", self.inelasticity)
        object.__setattr__(self, "inelasticity", _plain(parameter))

    @property
    def restitution(self) -> Any:
        """Coefficient of restitution e, with the shape of `inelasticity`; see `theory.zener_restitution`."""
        return zener.restitution(self.inelasticity)

    @property
    def amplitude_ratio(self) -> Any:
        """AR = e^{6/5} of the primary wave that the plate reflects, as `theory.primary_amplitude_ratio` of e.

        Equation 6.24 and figure 6.18 are right as printed. The text says that AR "decreases with the decrease in aspect
        ratio" D/t; in fact it increases.
        """
        return self.restitution**1.2

    @property
    def contact_time(self) -> Any:
        """Time in contact T_c = τ_c(λ) m^{2/5} v^{−1/5} k^{−2/5} of one bead, s: equation 6.38, right as printed."""
        return _plain(self._collision_time * zener.contact_time(self.inelasticity))

    def time_of_flight(self, beads: float, striker_speed: Any = None) -> Any:
        """Return the time of flight TOF of the primary wave from the sensor to the plate and back.

        TOF = 1.180 (1 + e^{−1/5}) N (m²/k_c² v)^{1/5} + T_c: the thesis's equation 6.18 with τ_c(λ) instead of 3.218.
        k_c is the stiffness between two beads. For given materials and speeds TOF over the size of a bead depends on
        D/t only.

        Parameters
        ----------
        beads : float
            Number N of beads from the sensor to the plate: 13 for sensor 7 of 20 beads.
        striker_speed : float or ndarray, optional
            Speed v, m/s, of a striker that equals the beads; by default `impact_speed`.

        Returns
        -------
        float or ndarray
            TOF, s; speeds and λ broadcast.

        Notes
        -----
        For spheres TOF/D is equation 6.39, which prints e^{+1/5} instead of e^{−1/5}. Its printed factor 0.853 requires
        an `impact_speed` of 0.682 v, the greatest speed of a bead in the wave (equation 6.16). With the default it is
        0.790.

        Examples
        --------
        >>> import hertzlink as hl
        >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
        >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
        >>> round(hl.theory.PlateImpact(bead, plate, 0.31).time_of_flight(13) / bead.size, 5)  # s/m
        0.06983
        """
        number = positive("beads", beads)
        given = self.impact_speed if striker_speed is None else striker_speed
        speed = each(positive, "striker_speed", given, "m/s")
        between = hertz_stiffness(self.bead.surface, self.bead.surface)
        transit = BEAD_TRANSIT * number * (self.bead.mass**2 / (between**2 * speed)) ** 0.2
        return _plain(transit * (1.0 + self.restitution**-0.2) + self.contact_time)


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
        A thin plate, from `kirchhoff_plate`.
    impact_speed : float
        Speed, m/s, of the striker (see Notes).
    wave_speeds : tuple of two floats, optional
        Two other wave speeds, m/s, such as the group speed of A0 and the speed of Rayleigh waves. Plates of a Laminate
        need them.

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
    That of `theory.PlateImpact` is longer for thin plates.

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
    if not instance("plate", plate, Plate, "a Plate, as kirchhoff_plate makes").thin:
        raise ValueError(f"plate = {plate!r}: must be thin, as kirchhoff_plate makes")
    if not all(hasattr(bead, name) for name in ("mass", "size", "surface")) or not isinstance(bead.mass, float):
        raise ValueError(f"bead = {bead!r}: must be a bead, with mass, size and surface")
    return hertz_stiffness(bead.surface, Surface(plate.section.struck))


def _plain(result: Vector) -> Any:
    return float(result) if np.ndim(result) == 0 else result
