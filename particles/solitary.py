# mypy: disable-error-code="no-any-return"
"""Closed forms of Nesterenko's long-wave theory of a uniform chain; docs/theory.md discusses them.

Equation numbers are those of Khatri's thesis. The docstrings state the differences from a chain of point masses.
"""

from functools import partial
from math import pi, sqrt
from typing import Annotated, Any, TypeVar

import numpy as np
from scipy.special import betainc

from structures.checks import each, not_negative, within
from structures.described import described
from structures.quantities import Quantity
from structures.structure import Vector

Number = TypeVar("Number", float, Vector)
_given: Any = partial(each, not_negative)
PARTICLE_TO_STRIKER_SPEED = 0.682
"""Ratio of a particle's greatest speed to the speed of an equal striker, for Hertz's law (6.16; Chatterjee 1999)."""

CONTACT_TO_CENTRE_FORCE = 1.414
"""β: ratio of the greatest contact force to the greatest force at a bead's centre, where sensors are (3.2)."""


@described
class UniformChain:
    """A long chain of identical particles whose contacts obey F = k δⁿ; solitary waves need n > 1.

    Parameters
    ----------
    size, mass : float
        Extent D of a particle along the chain, m, and its mass m, kg.
    stiffness, exponent : float
        k, N/mⁿ, and n ≥ 1 of the contacts; Hertz's law has n = 3/2.

    Examples
    --------
    >>> print(f"{hl.theory.UniformChain(9.52e-3, 3.5e-3, 1e10).wave_speed_from_force(20.0):.1f}")  # m/s
    510.9
    """

    # For sizes outside the range, or for greater exponents, powers of the size leave the range of floating point.
    size: Annotated[float, Quantity("m", "a length", "9.53 mm", 1e-12, 1e12)]
    mass: Annotated[float, Quantity("kg", "a mass", "2 g")]
    stiffness: Annotated[float, Quantity("N/m^n", "a stiffness", "1e10")]
    exponent: Annotated[float, Quantity(low=1.0, high=10.0)] = 1.5

    def tangent_stiffness(self, preload: Number) -> Number:
        """Return the tangent stiffness C = n k^{1/n} F₀^{(n−1)/n} of a contact, N/m, under a preload F₀, N."""
        n = self.exponent
        return n * self.stiffness ** (1.0 / n) * _given("preload", preload, "N") ** ((n - 1.0) / n)

    def angular_frequency(self, wave_number: Number, preload: float) -> Number:
        """Return ω of a linear wave, rad/s, for a wave number k, rad/m: ω² = (4C/m) sin²(kD/2) (equation 1.4)."""
        highest = 2.0 * np.sqrt(self.tangent_stiffness(preload) / self.mass)
        return highest * np.abs(np.sin(wave_number * self.size / 2.0))

    def sound_speed(self, preload: Number) -> Number:
        """Return the speed D √(C/m) of long linear waves, m/s, under a preload, N; zero without preload."""
        return self.size * np.sqrt(self.tangent_stiffness(preload) / self.mass)

    def wave_speed_from_force(self, force: Number, preload: float = 0.0) -> Number:
        """Return the speed V of a solitary wave, m/s, from the peak F_d of its contact force above the preload F₀, N.

        V = D √(2/(n+1)) √(k^{1/n}/m) F_m^{(n−1)/(2n)} √[1 + n q^{n+1} − (n+1) qⁿ] / (1 − q), with the total peak
        F_m = F₀ + F_d and q = (F₀/F_m)^{1/n} (equations 1.9, 5.10 and 5.12, corrected). In a Hertzian chain waves are
        1.2 % faster without preload, and 0.3 % faster for F_d = 5 F₀.
        """
        n, force, preload = self._steep, _given("force", force, "N"), _given("preload", preload, "N")
        total = np.asarray(force + preload)
        # 1 − q, without cancellation for weak waves.
        gap = -np.expm1(-np.log1p(force / preload) / n) if preload > 0.0 else np.ones_like(total)
        # The bracket is the incomplete beta function I₁₋q(2, n), which has no cancellation as q → 1.
        safe = np.where(gap < 1e-8, 1.0, gap)
        near = n * (n + 1.0) / 2.0 * (1.0 - 2.0 / 3.0 * (n - 1.0) * gap)
        bracket = np.where(gap < 1e-8, near, betainc(2.0, n, safe) / safe**2)
        overlap = (total / self.stiffness) ** (1.0 / n)
        square: Any = 2.0 / (n + 1.0) * self.stiffness / self.mass * overlap ** (n - 1.0) * bracket
        return (self.size * np.sqrt(square))[()]

    def wave_speed_from_particle_speed(self, particle_speed: Number) -> Number:
        """Return the speed V of a solitary wave without preload, m/s, from the greatest particle speed v_p, m/s.

        V = D [2 k v_p^{n−1} / ((n+1) m)]^{1/(n+1)} (equations 6.12, 6.13). In a Hertzian chain waves are 0.8 % slower.
        """
        n, v = self._steep, _given("particle_speed", particle_speed, "m/s")
        growth = 2.0 * self.stiffness / ((n + 1.0) * self.mass) * v ** (n - 1.0)
        return self.size * growth ** (1.0 / (n + 1.0))

    @property
    def width(self) -> float:
        """Length L = πD/(n−1) √(n(n+1)/6) of a solitary wave without preload, m; 4.967 D for n = 3/2 (5.13)."""
        n = self._steep
        return pi * self.size / (n - 1.0) * sqrt(n * (n + 1.0) / 6.0)

    def strain(self, position: Number, time: float, speed: float) -> Number:
        """Return the strain of a solitary wave of speed V, m/s, without preload, at a position, m, and a time, s.

        ξ = [(n+1) V²/(2c²)]^{1/(n−1)} cos^{2/(n−1)}(π (x − Vt)/L) with c² = k D^{n+1}/m, at distances up to half the
        width L from the crest (equation 1.8).
        """
        n = self._steep
        phase = np.minimum(np.abs(pi * (position - speed * time) / self.width), pi / 2.0)
        crest = (n + 1.0) * speed**2 * self.mass / (2.0 * self.stiffness * self.size ** (n + 1.0))
        return (crest * np.where(phase < pi / 2.0, np.cos(phase), 0.0) ** 2) ** (1.0 / (n - 1.0))

    def transit_time(self, beads: float, striker_speed: Number, restitution: float = 1.0) -> Number:
        """Return the travel time of a solitary wave over N beads to a structure and back, s, from the striker's speed.

        T = 1.180 (1 + e^{−1/5}) N m^{2/5} v_striker^{−1/5} k^{−2/5} for n = 3/2 and an equal striker (equations 6.17
        and 6.19, corrected), without the contact time. restitution: ratio e of particle speeds at the structure.
        """
        e = within("restitution", restitution, 0.0, 1.0)
        v = _given("striker_speed", striker_speed, "m/s")
        return beads * self.size / self.wave_speed_from_particle_speed(PARTICLE_TO_STRIKER_SPEED * v) * (1.0 + e**-0.2)

    @property
    def _steep(self) -> float:
        if self.exponent <= 1.0:
            raise ValueError(f"exponent = {self.exponent!r}: must be greater than 1 for a solitary wave")
        return self.exponent
