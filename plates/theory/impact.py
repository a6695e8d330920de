"""Theory of a bead, or a chain, on a plate: impedance, Zener's impact in SI units, how far away an edge matters.

The chain's last bead stands for all of it, and meets an infinite thin plate at an impact_speed, m/s (thesis, section
6.2). The thesis mixes three speeds and two densities there, so every function takes its speeds; THESIS_IMPACT holds
the thesis's. Functions take a number, or an array where the type says so, and give the same. All raise ValueError,
naming the argument, where one is not finite or out of its range.
"""

from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from plates.plate import Plate
from plates.section import point_rigidity
from plates.theory import zener
from structures.checks import each, instance, positive
from structures.layers import BEAD_TRANSIT
from structures.layers import contact_time as contact_time_half_space
from structures.material import Material
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness

Number = TypeVar("Number", float, Vector)

A0_LAMB = 0.2
"""Speed of the A0 Lamb wave over √(E/ρ) that the thesis takes for its plates (section 6.2.2)."""

RAYLEIGH = 0.57
"""Speed of the Rayleigh wave over √(E/ρ) (thesis, section 6.2.2)."""


class ThesisImpact(NamedTuple):
    """The beads' material, and the speeds, m/s, behind the numbers that section 6.2.1 of the thesis prints.

    bead_speed: that of the printed λ (equation 6.37). striker_speed: that of the printed T_c (equation 6.38).
    """

    material: Material
    bead_speed: float
    striker_speed: float


THESIS_IMPACT = ThesisImpact(Material(200.0e9, 0.28, 8000.0, "steel 440C as heavy as 316"), 0.682 * 0.63, 0.31)
"""What the printed numbers of section 6.2.1 follow from, on aluminium 6061; the text does not say so.

T_c0 = 27.7, 55.6, 111.44 µs need E and ν of steel 440C, the density of 316, and the striker's 0.31 m/s. With the speed
0.43 m/s besides, λ comes out as printed: 0.32, 0.166, 0.072; 1.28, 0.288 (printed "0.2"); 5.15, 1.16. This may be 0.682
of 0.63 m/s, the striker's speed of section 3.3. Table 2.1 and 0.31 m/s give 0.295, 0.153, 0.0663 for D = 4.76 mm.
T_c = 87.81, 59.1, 1435.17, 164.38 µs are 6.38 with λ of 0.43 m/s and v of 0.31 m/s, to 0.2 %.
"""


class Bead(Protocol):
    """What theory needs of a bead."""

    @property
    def mass(self) -> float:
        """kg."""
        ...

    @property
    def size(self) -> float:
        """Extent along the chain, m."""
        ...

    @property
    def surface(self) -> Surface:
        """What Hertz's law needs."""
        ...


def point_impedance(plate: Plate) -> float:
    """Force over velocity of an infinite thin plate at a point, 8 √(D ρ t), N s/m; see Plate.rigidity for laminates.

    (Cremer, Heckl, Petersson, Structure-Borne Sound, 3rd ed., table 5.1.) It is real: an impulse I moves the point by
    I / (8 √(D ρ t)), and there it stays until an echo returns.
    """
    instance("plate", plate, Plate, "a Plate, as kirchhoff_plate or mindlin_plate make")
    return float(8.0 * (point_rigidity(plate.section) * plate.mass_per_area) ** 0.5)


# A bead on an infinite thin plate (section 6.2.1).


def inelasticity_parameter(bead: Bead, plate: Plate, impact_speed: Number) -> Number:
    """λ = m^{3/5} k^{2/5} v^{1/5} / (8 √(D ρ t)): a bead's m over impedance and time of collision, (m²/k²v)^{1/5}.

    For a sphere this is equation 6.37, right as printed: π^{3/5}/(4√3) (D/t)² (ρ_s/ρ_p)^{3/5}
    [v² ρ_p (1−ν_p²)/E_p]^{1/10} [1 + E_p (1−ν_s²)/(E_s (1−ν_p²))]^{−2/5} (Zener 1941). Its v_in is "the maximum
    velocity of the Nth particle"; the printed λ follow from THESIS_IMPACT, and are 8 % above those of Table 2.1 and
    0.31 m/s.
    Holds where no echo comes back while the bead is in contact; where bending waves of the period 2T_c are long against
    t; and where the contact is small against t, so that Hertz's k is that of a half-space.
    """
    return _plain(_inelasticity(bead, plate, _collision_time(bead, plate, impact_speed)))


def contact_time(
    bead: Bead, plate: Plate, impact_speed: Number | float, inelasticity: Number | float | None = None
) -> Number:
    """T_c, s, of a bead on an infinite thin plate: τ_c(λ) m^{2/5} v^{−1/5} k^{−2/5} (thesis, equation 6.38, right).

    inelasticity λ: by default that of the same bead, plate and speed. The printed T_c mix speeds (THESIS_IMPACT): λ of
    one, v of another. For one bead: the last of a chain is pushed on by the others (see `layers.contact_time`).
    """
    time = _collision_time(bead, plate, impact_speed)
    parameter = _inelasticity(bead, plate, time) if inelasticity is None else np.asarray(inelasticity)
    return _plain(time * zener.contact_time(parameter))


def amplitude_ratio(inelasticity: Number) -> Number:
    """AR = e^{6/5} of the primary wave off an infinite thin plate, with e = zener.restitution(λ).

    (Thesis, equation 6.24 and figure 6.18, right as printed; the text says AR "decreases with the decrease in aspect
    ratio" D/t: it increases.) `layers.amplitude_ratio` takes an e of any origin. A bead for a chain: without losses,
    secondary waves, gravity.
    """
    return _plain(np.asarray(zener.restitution(inelasticity)) ** 1.2)


def normalised_time_of_flight(
    beads: float, bead: Bead, plate: Plate, striker_speed: Number | float, impact_speed: Number | float | None = None
) -> Number:
    """TOF/D, s/m, of the primary wave from the sensor to an infinite thin plate and back, per size D of a bead.

    TOF = 1.180 (1 + e^{−1/5}) N (m²/k_c² v)^{1/5} + τ_c (m²/k_w² v_in)^{1/5}: the thesis's equation 6.18 with τ_c(λ)
    for 3.218, for spheres 6.39, which prints e^{+1/5} for e^{−1/5}. N `beads` from the sensor to the plate (13 for
    sensor 7 of 20); striker_speed v, m/s, of a striker like the beads. impact_speed v_in, m/s, enters λ, e, τ_c and the
    contact's time: by default v, with which 6.39 has 0.790 for its printed 0.853; that one holds with 0.682 v, the
    greatest speed of a bead in the wave (6.16). A function of D/t alone, materials and speeds given.
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
    """The thesis's two estimates of the critical distance, m: by the A0 Lamb wave, and by the Rayleigh wave.

    L = c T/2 with T the Hertzian contact time of the bead on a half-space of the plate's material (equations 6.41
    and 6.42, section 6.2.2) and c = 0.2 or 0.57 √(E/ρ). impact_speed, m/s, is the striker's; the printed factor 1.37 of
    equation 6.42 follows from 0.682 times it, the speed of the wave's beads; with the striker's it is 1.272.
    wave_speeds: two others, m/s, such as lamb_group_speed(material, t, frequency, "A0") and rayleigh_speed(material).
    The printed 0.57 is the Rayleigh speed of aluminium; 0.2, 1000 m/s, the group speed of A0 at 12 kHz in 2.29 mm of
    it, at 6 kHz in 4.83 mm. T knows nothing of t, though the text says that thin plates have longer L;
    `impact.contact_time` grows for them.
    """
    stiffness = wall_stiffness(bead, plate)
    duration = contact_time_half_space(bead.mass, stiffness, positive("impact_speed", impact_speed, "m/s"))
    if wave_speeds is None:
        if not isinstance(plate.material, Material):
            raise ValueError(f"plate.material = {plate.material!r}: must be a Material, with one speed √(E/ρ)")
        wave_speeds = A0_LAMB * plate.material.bar_speed, RAYLEIGH * plate.material.bar_speed
    if np.shape(wave_speeds) != (2,):
        raise ValueError(f"wave_speeds = {wave_speeds!r}: must be two speeds, m/s")
    slow, fast = (positive("wave_speeds", speed, "m/s") for speed in wave_speeds)
    return slow * duration / 2.0, fast * duration / 2.0


def wall_stiffness(bead: Bead, plate: Plate) -> float:
    """k, N/m^1.5, of Hertz's contact of a bead with a plate."""
    if not instance("plate", plate, Plate, "a Plate, as kirchhoff_plate or kirchhoff_panel make").thin:
        raise ValueError(f"plate = {plate!r}: must be thin, as kirchhoff_plate or kirchhoff_panel make")
    if not all(hasattr(bead, name) for name in ("mass", "size", "surface")):
        raise ValueError(f"bead = {bead!r}: must be a bead, with mass, size and surface")
    return hertz_stiffness(bead.surface, Surface(plate.section.struck))


def _collision_time(bead: Bead, plate: Plate, impact_speed: float | Vector) -> Vector:
    """(m²/k²v)^{1/5}, s, the unit of time of Hertz's collision."""
    stiffness, speed = wall_stiffness(bead, plate), each(positive, "impact_speed", impact_speed, "m/s")
    time: Vector = (bead.mass**2 / (stiffness**2 * speed)) ** 0.2
    return time


def _inelasticity(bead: Bead, plate: Plate, collision_time: Vector) -> Vector:
    """λ, from (m²/k²v)^{1/5} in s."""
    return np.asarray(bead.mass / (point_impedance(plate) * collision_time))


def _plain(result: Vector) -> Number:  # type: ignore[type-var]
    return float(result) if np.ndim(result) == 0 else result  # type: ignore[return-value]
