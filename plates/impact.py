"""The impact of a bead, or of a chain's last bead, on an infinite thin plate, and bounds of the critical distance.

Under a force F the struck point moves at the speed F/(8√(Dρt)). In units of Hertz's collision the approach obeys
σ″ + (1 + λ d/dτ) σ^{3/2} = 0 with σ = 0 and σ′ = 1 at τ = 0 (Zener, Phys. Rev. 59 (1941) 669; Khatri's thesis,
equations 6.35 and 6.36). λ is the only parameter; see docs/theory.md.
"""

from dataclasses import dataclass, field
from functools import cache
from math import pi
from typing import Any

import numpy as np
import scipy
from numpy.polynomial import Chebyshev
from scipy.special import beta, betainc

from plates.plate import Plate
from structures.bodies.layers import BEAD_TRANSIT, contact_time
from structures.checks import each, instance, not_negative, plain, positive
from structures.material import Material
from structures.structure import Vector
from structures.surface import Surface, hertz_stiffness

# Up to this λ, e and τ_c are interpolated in λ. Above it asymptotic laws hold, to exp(−4.5 λ^{5/3}) = 2e-20.
LARGE = 4.0
LARGEST_SAMPLE = 12.0  # For large λ, τ_c/λ is interpolated in λ^{−5/3} through samples up to this λ
# The speeds of the A0 Lamb wave and of the Rayleigh wave over √(E/ρ) in the thesis (section 6.2.2)
A0_OVER_BAR_SPEED, RAYLEIGH_OVER_BAR_SPEED = 0.2, 0.57


def zener_restitution(inelasticity: Any) -> Any:
    """Return the coefficient of restitution e of a sphere that hits an infinite thin plate.

    Parameters
    ----------
    inelasticity : float or ndarray
        λ ≥ 0, as in `theory.PlateImpact`.

    Returns
    -------
    float or ndarray
        e, with an error of 1e-9: 1 − 1.7302 λ for small λ, 0.67930 λ⁻⁵ for λ > 4.

    Examples
    --------
    >>> round(hl.theory.zener_restitution(0.32), 4)
    0.5865
    """
    number = each(not_negative, "inelasticity", inelasticity)
    logarithm = _series()[0](np.minimum(number, LARGE))
    return plain(np.exp(logarithm) * (np.maximum(number, LARGE) / LARGE) ** -5.0)


def zener_contact_time(inelasticity: Any) -> Any:
    """Return the time in contact τ_c of a sphere, in the unit (m²/k²v)^{1/5} of a collision, with an error of 1e-9.

    It is 3.2180655 (1 + 0.17302 λ) for small λ, and λ (5 ln λ − 0.35937) + 3 λ^{−2/3} for large λ.
    """
    number = each(not_negative, "inelasticity", inelasticity)
    _, small, excess = _series()
    large = np.maximum(number, LARGE)
    tail = large * (5.0 * np.log(large) + excess(large ** (-5.0 / 3.0)))
    return plain(np.where(number > LARGE, tail, small(np.minimum(number, LARGE))))


@cache
def _series() -> tuple[Chebyshev, Chebyshev, Chebyshev]:
    """Return ln e and τ_c as functions of λ up to `LARGE`, and τ_c/λ − 5 ln λ above as a function of x = λ^{−5/3}.

    For large λ all motions approach one slow motion, σ^{3/2} ≈ q/λ. At the end they differ only by exp(−4.5/x).
    Therefore e λ⁵ is constant there, and the excess is a series in x.
    """
    logarithm = Chebyshev.interpolate(lambda number: _impact(number)[0], 48, domain=[0.0, LARGE])
    time = Chebyshev.interpolate(lambda number: _impact(number)[1], 48, domain=[0.0, LARGE])
    excess = Chebyshev.interpolate(
        lambda x: _impact(x**-0.6)[1] * x**0.6 + 3.0 * np.log(x), 10,
        domain=[LARGEST_SAMPLE ** (-5.0 / 3.0), LARGE ** (-5.0 / 3.0)],
    )  # fmt: skip
    return logarithm, time, excess


def _impact(inelasticity: Vector) -> Vector:
    """Return ln e and τ_c, 2 × n, for n parameters λ, by an integration over the phase φ of the motion from 0 to π."""
    # With q = σ′ + λσ^{3/2} = R cos φ, √(4/5) σ^{5/4} = R sin φ and g = (5/4)^{3/5} (R sin φ)^{1/5}, the motion is
    # d ln R/dφ = −λ g sin²φ / (1 − λ g sin φ cos φ) and dτ/dφ = 1 / (g (1 − λ g sin φ cos φ)); e = R at φ = π.
    # The variable s, with φ = π I_s(5, 5) and the incomplete beta function I, makes the fifth roots at the ends smooth.
    count = inelasticity.size

    def rates(s: float, state: Vector) -> Vector:
        sine = max(np.sin(pi * betainc(5.0, 5.0, min(s, 1.0 - s))), 1e-300)
        cosine = np.cos(pi * betainc(5.0, 5.0, s))
        pace = pi * (s * (1.0 - s)) ** 4 / beta(5.0, 5.0)
        g = 1.25**0.6 * (np.exp(state[:count]) * sine) ** 0.2
        advance = 1.0 - inelasticity * g * sine * cosine
        changes: Vector = np.concatenate([-inelasticity * g * sine**2, 1.0 / g]) * np.tile(pace / advance, 2)
        return changes

    path = scipy.integrate.solve_ivp(rates, (0.0, 1.0), np.zeros(2 * count), method="DOP853", rtol=1e-12, atol=1e-14)
    end: Vector = path.y[:, -1].reshape(2, count)
    return end


@dataclass(frozen=True, eq=False)
class PlateImpact:
    """The impact of a bead on an infinite thin plate, by Zener's theory.

    One bead stands for the chain. The theory holds until an echo returns, for long bending waves and small contacts.

    Parameters
    ----------
    bead, plate
        The bead, which is any object with `mass`, `size` and `surface`, and a thin plate from `kirchhoff_plate`.
    impact_speed : float or ndarray
        Speed v of the bead at impact, m/s, positive.
    inelasticity : float or ndarray, optional
        Zener's parameter λ ≥ 0; by default m^{3/5} k^{2/5} v^{1/5} / (8 √(D ρ t)), equation 6.37 for spheres.

    Examples
    --------
    >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> impact = hl.theory.PlateImpact(hl.Sphere(4.76e-3, hl.STEEL_440C), plate, 0.31, inelasticity=1.28)
    >>> round(impact.contact_time * 1e6, 1)
    86.8
    """

    bead: Any
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
        object.__setattr__(self, "inelasticity", plain(parameter))

    @property
    def restitution(self) -> Any:
        """Coefficient of restitution e, in the shape of `inelasticity`; see `theory.zener_restitution`."""
        return zener_restitution(self.inelasticity)

    @property
    def amplitude_ratio(self) -> Any:
        """AR = e^{6/5} of the primary reflected wave (equation 6.24)."""
        return self.restitution**1.2

    @property
    def contact_time(self) -> Any:
        """Time in contact T_c = τ_c(λ) m^{2/5} v^{−1/5} k^{−2/5} of one bead, s (equation 6.38)."""
        return plain(self._collision_time * zener_contact_time(self.inelasticity))

    def time_of_flight(self, beads: float, striker_speed: Any = None) -> Any:
        """Return the time of flight of the primary wave from the sensor to the plate and back, s.

        TOF = 1.180 (1 + e^{−1/5}) N (m²/k_c² v)^{1/5} + T_c with the stiffness k_c between two beads (equation 6.18).

        Parameters
        ----------
        beads : float
            Number N of beads from the sensor to the plate: 13 for sensor 7 of 20 beads.
        striker_speed : float or ndarray, optional
            Speed v, m/s, of a striker that equals the beads; by default `impact_speed`.
        """
        number = positive("beads", beads)
        given = self.impact_speed if striker_speed is None else striker_speed
        speed = each(positive, "striker_speed", given, "m/s")
        between = hertz_stiffness(self.bead.surface, self.bead.surface)
        transit = BEAD_TRANSIT * number * (self.bead.mass**2 / (between**2 * speed)) ** 0.2
        return plain(transit * (1.0 + self.restitution**-0.2) + self.contact_time)


def critical_distance_bounds(bead: Any, plate: Plate, impact_speed: float) -> tuple[float, float]:
    """Return the thesis's two estimates of the critical distance: with the A0 Lamb wave and with the Rayleigh wave.

    They are L = c T/2 with the Hertzian contact time T of the bead on a half-space of the plate's material (equation
    6.41), and c = 0.2 √(E/ρ) or 0.57 √(E/ρ).

    Parameters
    ----------
    bead, plate
        As in `theory.PlateImpact`.
    impact_speed : float
        Speed of the striker, m/s. The factors in the thesis follow from 0.682 times this speed.

    Returns
    -------
    tuple of two floats
        L, m, for the slower and the faster wave.

    Examples
    --------
    >>> plate = hl.kirchhoff_plate(0.3, 0.3, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> slow, fast = hl.critical_distance_bounds(hl.Sphere(4.76e-3, hl.STEEL_440C), plate, impact_speed=0.31)
    >>> round(slow * 1e3, 1), round(fast * 1e3, 1)
    (27.8, 79.3)
    """
    stiffness = wall_stiffness(bead, plate)
    duration = contact_time(bead.mass, stiffness, positive("impact_speed", impact_speed, "m/s"))
    material: Material = instance("plate.material", plate.material, Material, "a Material, with one speed √(E/ρ)")
    length = material.bar_speed * duration / 2.0
    return A0_OVER_BAR_SPEED * length, RAYLEIGH_OVER_BAR_SPEED * length


def wall_stiffness(bead: Any, plate: Plate) -> float:
    """Return the stiffness k, N/m^1.5, of the Hertz contact between a bead and a thin plate."""
    if not (isinstance(plate, Plate) and plate.thin):
        raise ValueError(f"plate = {plate!r}: must be a Plate from kirchhoff_plate")
    if not all(hasattr(bead, name) for name in ("mass", "size", "surface")) or not isinstance(bead.mass, float):
        raise ValueError(f"bead = {bead!r}: must be a bead, with mass, size and surface")
    return hertz_stiffness(bead.surface, Surface(plate.section.struck))
