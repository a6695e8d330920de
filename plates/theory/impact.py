"""The impact of a bead, or of a chain's last bead, on an infinite thin plate, and the distance of an edge that matters.

Khatri's thesis, section 6.2; docs/theory.md says where its numbers hold.
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

A0_OVER_BAR_SPEED, RAYLEIGH_OVER_BAR_SPEED = 0.2, 0.57
"""Speeds of the A0 Lamb wave and of the Rayleigh wave over √(E/ρ) that the thesis assumes (section 6.2.2)."""


class ThesisImpact(NamedTuple):
    """Material of the beads, and speeds in m/s, from which the numbers printed in section 6.2.1 of the thesis follow.

    bead_speed belongs to the printed λ (equation 6.37), striker_speed to the printed T_c (equation 6.38).
    """

    material: Material
    bead_speed: float
    striker_speed: float


THESIS_IMPACT = ThesisImpact(Material(200.0e9, 0.28, 8000.0, "steel 440C as heavy as 316"), 0.682 * 0.63, 0.31)
"""The values that reproduce the printed numbers of section 6.2.1, on aluminium 6061; the text does not state them."""


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
    """The impact of a bead on an infinite thin plate, by Zener's theory.

    One bead stands for the chain. λ is valid while no echo returns, for bending waves of the period 2T_c that are long
    compared with t, and for a contact that is small compared with t.

    Parameters
    ----------
    bead : Bead
        The bead that hits the plate; any object with `mass`, `size` and `surface`.
    plate : Plate
        A thin plate, from `kirchhoff_plate`.
    impact_speed : float or ndarray
        Speed v of the bead at impact, m/s, positive.
    inelasticity : float or ndarray, optional
        Zener's parameter λ ≥ 0. By default m^{3/5} k^{2/5} v^{1/5} / (8 √(D ρ t)), equation 6.37 for spheres.

    Raises
    ------
    ValueError
        If the plate is not a thin Plate, if `bead` is not a bead, if a speed is not positive, or if λ is negative.

    References
    ----------
    Khatri's thesis, section 6.2.1, equations 6.24, 6.37 to 6.39; Zener, Phys. Rev. 59 (1941) 669.

    Examples
    --------
    >>> import hertzlink as hl
    >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> impact = hl.theory.PlateImpact(hl.Sphere(4.76e-3, hl.STEEL_440C), plate, 0.31, inelasticity=1.28)
    >>> round(impact.contact_time * 1e6, 1)
    86.8
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
        """AR = e^{6/5} of the primary wave that the plate reflects: equation 6.24."""
        return self.restitution**1.2

    @property
    def contact_time(self) -> Any:
        """Time in contact T_c = τ_c(λ) m^{2/5} v^{−1/5} k^{−2/5} of one bead, s: equation 6.38."""
        return _plain(self._collision_time * zener.contact_time(self.inelasticity))

    def time_of_flight(self, beads: float, striker_speed: Any = None) -> Any:
        """Return the time of flight of the primary wave from the sensor to the plate and back, s.

        TOF = 1.180 (1 + e^{−1/5}) N (m²/k_c² v)^{1/5} + T_c with the stiffness k_c between two beads (equation 6.18).

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


def critical_distance_bounds(
    bead: Bead, plate: Plate, impact_speed: float, wave_speeds: tuple[float, float] | None = None
) -> tuple[float, float]:
    """Return the two estimates of the critical distance in the thesis: with the A0 Lamb wave, with the Rayleigh wave.

    L = c T/2 with the Hertzian contact time T of the bead on a half-space of the plate's material (equation 6.41).

    Parameters
    ----------
    bead : Bead
        The last bead of the chain; any object with `mass`, `size` and `surface`.
    plate : Plate
        A thin plate, from `kirchhoff_plate`.
    impact_speed : float
        Speed of the striker, m/s; the printed factors follow from 0.682 times it.
    wave_speeds : tuple of two floats, optional
        Wave speeds c, m/s, by default 0.2 √(E/ρ) and 0.57 √(E/ρ). Plates of a Laminate need them.

    Returns
    -------
    tuple of two floats
        L, m, for the first and the second wave speed.

    Raises
    ------
    ValueError
        If the plate is not a thin Plate, if `bead` is not a bead, if a speed is not positive, or if a plate without a
        single Material has no `wave_speeds`.

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
