"""Guided waves of a free plate of any thickness: Rayleigh and Lamb's equations, and the Rayleigh wave of its faces.

Modes of an infinite, isotropic, elastic plate of thickness t = 2h in plane strain, faces free (Lamb, Proc. R. Soc. A 93
(1917) 114; Graff, Wave Motion in Elastic Solids, chapter 8). "S0", "S1" … move the faces apart and together
(symmetric), "A0", "A1" … up and down together (antisymmetric). Numbers count frequencies upwards at a fixed wave
number, so a mode may run backwards near its cut-off (S1 of most metals): its phase and group speeds are then those of
the forward wave. Real wave numbers only. Functions take a number, or an array where the type says so, and give the
same. All raise ValueError, naming the argument, where one is not finite or out of its range.

With Ω = ωh/c_s, κ = kh, η = (c_s/c_p)², x = ηΩ² − κ², y = Ω² − κ², C(x) = cos √x and S(x) = sin √x / √x, which are
entire functions, the equations have neither poles nor roots of their own making:
(y − κ²)² C(u) S(v) + 4 κ² u S(u) C(v) = 0, symmetric with u, v = x, y, antisymmetric with u, v = y, x.
"""

import re
from collections.abc import Callable
from math import pi, sqrt
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from structures.checks import each, instance, not_negative, positive
from structures.elasticity import pressure_speed, shear_speed
from structures.material import Material
from structures.structure import Vector

Number = TypeVar("Number", float, Vector)

TRIALS = 257
"""Wave numbers tried at each frequency before a mode is said not to propagate, the more the longer the waves."""

LONG = 0.01
"""|x| and |y| below which A0, there the only antisymmetric wave, is found without the cancellation of its equation."""


def rayleigh_speed(material: Material) -> float:
    """Speed c_R, m/s, of waves along the face of a half-space.

    ξ = (c_R/c_s)² is the one root in (0, 1) of ξ³ − 8ξ² + (24 − 16η)ξ − 16(1 − η) = 0, η = (c_s/c_p)² (Achenbach, Wave
    Propagation in Elastic Solids, chapter 5). The thesis's 0.57 √(E/ρ) in section 6.2.2 is this for aluminium.
    """
    eta = _speed_ratio(material)

    def rayleigh(xi: float) -> float:
        return ((xi - 8.0) * xi + 24.0 - 16.0 * eta) * xi - 16.0 * (1.0 - eta)

    return shear_speed(material) * sqrt(brentq(rayleigh, 0.0, 1.0, xtol=1e-16))


def frequency(material: Material, thickness: float, wave_number: Number, mode: str = "A0") -> Number:
    """Frequency, Hz, of a mode at a real wave number ≥ 0, rad/m: its whole curve, backward waves too.

    thickness, m. To 1e-11 of itself.
    """
    waves = each(not_negative, "wave_number", wave_number, "rad/m") * positive("thickness", thickness, "m") / 2.0
    curve, waves = _curve(material, mode), waves.ravel()
    high = 1.0 + waves
    while (short := curve.below(waves, high) <= curve.number).any():
        high = np.where(short, 2.0 * high, high)
    pulse = _bisected(lambda middle: curve.below(waves, middle) > curve.number, np.zeros_like(high), high)
    return _like(wave_number, pulse * shear_speed(material) / (pi * thickness))


def phase_speed(material: Material, thickness: float, frequency: Number, mode: str = "A0") -> Number:
    """Phase speed ω/k, m/s, of a mode at a frequency, Hz, in a plate of a thickness, m.

    Long waves: A0 has Kirchhoff's √ω (D/ρt)^{1/4} times 1 − (17 − 7ν)/(240 (1 − ν)) (kt)², 1 % less where t is 1/19 of
    a wavelength in aluminium; S0 has √(E/ρ(1−ν²)). Short ones: both have `rayleigh_speed`, the others the shear speed.
    To 1e-11, but for the speeds near a cut-off, where a frequency does not fix them. ValueError where the mode does not
    propagate, or within 1e-5 of the lowest frequency of one that runs backwards.
    """
    waves, pulse = _forward(material, thickness, frequency, mode)
    return _like(frequency, shear_speed(material) * pulse / waves)


def group_speed(material: Material, thickness: float, frequency: Number, mode: str = "A0") -> Number:
    """Group speed dω/dk, m/s, of a mode at a frequency, Hz, in a plate of a thickness, m.

    From the derivatives of the equation itself, good to what `lamb.phase_speed` is; undefined where two modes cross (S0
    and S1 at kt = π for ν = 0). ValueError where the mode does not propagate.
    """
    waves, pulse = _forward(material, thickness, frequency, mode)
    slope = _curve(material, mode).slope(waves, pulse)
    return _like(frequency, shear_speed(material) * waves / pulse * slope)


def cutoff_frequency(material: Material, thickness: float, mode: str = "A1") -> float:
    """Frequency, Hz, of a mode at infinite wavelength, in a plate of a thickness, m; 0 for A0 and S0.

    Resonances through the thickness, sorted: t f = c_s m and c_p (m − ½) for S modes, c_p m and c_s (m − ½) for A
    modes, m = 1, 2 … A mode that runs backwards there has its forward wave from a lower frequency on (S1 of steel: 6 %
    lower).
    """
    curve = _curve(material, mode)
    size = positive("thickness", thickness, "m")
    if curve.number == 0:
        return 0.0
    shear, pressure = shear_speed(material), pressure_speed(material)
    whole, half = (shear, pressure) if curve.symmetric else (pressure, shear)
    counts = np.arange(1, curve.number + 1)
    resonances = np.sort(np.concatenate([whole * counts, half * (counts - 0.5)]))
    return float(resonances[curve.number - 1] / size)


class _Curve(NamedTuple):
    """One mode: which family, how many of it lie below, and η = (c_s/c_p)²."""

    symmetric: bool
    number: int
    eta: float

    def below(self, waves: Vector, pulse: Vector) -> Vector:
        """How many frequencies of the family lie below Ω at κ: exact, so that no root is missed or taken for another.

        Hold the faces' normal motion: pressure and shear waves part, with frequencies at √x = πm, √y = π(m + 1) or, in
        antisymmetric motion, √x and √y = π(m + ½), m = 0, 1 … Let go of it, one constraint: one frequency more lies
        below Ω if the faces are of negative stiffness there, and no other (Wittrick and Williams, Q. J. Mech. Appl.
        Math. 24 (1971) 263).
        """
        x, y = self.eta * pulse**2 - waves**2, pulse**2 - waves**2
        pressure, shear = np.sqrt(np.maximum(x, 0.0)) / pi, np.sqrt(np.maximum(y, 0.0)) / pi
        if self.symmetric:
            held = np.ceil(pressure) + np.maximum(np.ceil(shear) - 1.0, 0.0)
        else:
            held = np.floor(pressure + 0.5) + np.floor(shear + 0.5)
        u, v = (x, y) if self.symmetric else (y, x)
        (cos_u, sin_u), (cos_v, sin_v) = _waves(u), _waves(v)
        value = (y - waves**2) ** 2 * cos_u * sin_v + 4.0 * waves**2 * u * sin_u * cos_v
        count: Vector = held + (np.where(held % 2.0 == 0.0, value, -value) > 0.0)
        if (long := self._long(x, y)).any():
            waves, pulse = np.broadcast_arrays(waves, pulse)
            count[long] = _long_bending(waves[long] ** 2, self.eta)[0] < pulse[long] ** 2
        return count

    def slope(self, waves: Vector, pulse: Vector) -> Vector:
        """dΩ²/dκ² along the curve: minus the ratio of the equation's two derivatives."""
        square = waves**2
        x, y = self.eta * pulse**2 - square, pulse**2 - square
        u, v, a, b = (x, y, self.eta, 1.0) if self.symmetric else (y, x, 1.0, self.eta)
        (cos_u, sin_u), (cos_v, sin_v) = _waves(u), _waves(v)
        gap = y - square
        by_u = -(gap**2) * sin_u / 2.0 * sin_v + 2.0 * square * (cos_u + sin_u) * cos_v
        by_v = gap**2 * cos_u * _sine_slope(v, cos_v, sin_v) - 2.0 * square * u * sin_u * sin_v
        by_gap = 2.0 * gap * cos_u * sin_v
        by_square = 4.0 * u * sin_u * cos_v - 2.0 * by_gap - by_u - by_v
        slope: Vector = -by_square / (by_gap + a * by_u + b * by_v)
        if (long := self._long(x, y)).any():
            slope[long] = _long_bending(square[long], self.eta)[1]
        return slope

    def _long(self, x: Vector, y: Vector) -> NDArray[np.bool_]:
        return (not self.symmetric) & (np.maximum(np.abs(x), np.abs(y)) < LONG)


def _forward(material: Material, thickness: float, frequency: Number, mode: str) -> tuple[Vector, Vector]:
    """κ of the forward wave, the largest that the mode has, and Ω, in one row each."""
    frequencies, curve = each(positive, "frequency", frequency, "Hz").ravel(), _curve(material, mode)
    pulse = pi * frequencies * positive("thickness", thickness, "m") / shear_speed(material)
    top = pulse
    while (short := curve.below(top, pulse) > curve.number).any():
        top = np.where(short, 2.0 * top, top)
    trials = np.linspace(0.0, 1.0, TRIALS) ** 2 * top[:, None]
    there: NDArray[np.bool_] = curve.below(trials, pulse[:, None]) > curve.number
    if not there.any(axis=1).all():
        worst = float(frequencies[~there.any(axis=1)][0])
        cutoff = cutoff_frequency(material, thickness, mode)
        raise ValueError(f"frequency = {worst!r}: must be above {cutoff:g} Hz, the cut-off of {mode}")
    last = TRIALS - 1 - np.argmax(there[:, ::-1], axis=1)
    rows = np.arange(pulse.size)
    beyond = _bisected(
        lambda middle: curve.below(middle, pulse) <= curve.number, trials[rows, last], trials[rows, last + 1]
    )
    return beyond, pulse


def _bisected(beyond: Callable[[Vector], NDArray[np.bool_]], low: Vector, high: Vector) -> Vector:
    """Where, between `low` and `high`, it turns from False to True."""
    while (high - low > 4e-16 * high + 1e-30).any():
        middle = (low + high) / 2.0
        there = beyond(middle)
        low, high = np.where(there, low, middle), np.where(there, middle, high)
    return high


def _curve(material: Material, mode: str) -> _Curve:
    instance("material", material, Material, "a Material; MATERIALS[name] gives one by name")
    found = re.fullmatch(r"([AS])(\d{1,4})", mode) if isinstance(mode, str) else None
    if found is None:
        raise ValueError(f"mode = {mode!r}: must be 'A' or 'S' and a number, such as 'A0' or 'S1'")
    return _Curve(found[1] == "S", int(found[2]), _speed_ratio(material))


def _speed_ratio(material: Material) -> float:
    """η = (c_s/c_p)² = (1 − 2ν)/2(1 − ν)."""
    instance("material", material, Material, "a Material; MATERIALS[name] gives one by name")
    return (1.0 - 2.0 * material.poisson_ratio) / (2.0 * (1.0 - material.poisson_ratio))


def _waves(x: Vector) -> tuple[Vector, Vector]:
    """C(x) and S(x), both times exp(−√−x) where x < 0, lest they overflow."""
    root = np.sqrt(np.abs(x))
    some = np.where(root > 0.0, root, 1.0)
    sine = np.where(x > 0.0, np.sin(root), -np.expm1(-2.0 * root) / 2.0) / some
    return np.where(x > 0.0, np.cos(root), (1.0 + np.exp(-2.0 * root)) / 2.0), np.where(root > 0.0, sine, 1.0)


def _long_bending(square: Vector, eta: float) -> tuple[Vector, Vector]:
    """Ω² of A0 at a small κ², and dΩ²/dκ² by a complex step.

    The equation less its factor Ω² is Ω² S(x) C(y) + 4 κ² y (1 − η) D = 0, where D = (S(y) C(x) − S(x) C(y)) / (y − x)
    is a series in x + y and x y. Solved for the first Ω² it contracts, by κ² at each turn.
    """
    step = 1e-30
    z = square + 1j * step
    pulse = np.zeros_like(z)
    for _ in range(10):
        x, y = eta * pulse - z, pulse - z
        total, product = x + y, x * y
        series = 1.0 / 3.0 - total / 30.0 + (3.0 * total**2 + 4.0 * product) / 2520.0
        series -= total * (total**2 + 4.0 * product) / 45360.0
        root = np.sqrt(x)
        pulse = -4.0 * z * y * (1.0 - eta) * series * root / (np.sin(root) * np.cos(np.sqrt(y)))
    return pulse.real, pulse.imag / step


def _sine_slope(x: Vector, cosine: Vector, sine: Vector) -> Vector:
    """S′(x) = (C − S)/2x, by its series where that would cancel."""
    near = np.abs(x) < 1e-3
    series = -1.0 / 6.0 + x / 60.0 - x**2 / 1680.0
    scale = np.where(x < 0.0, np.exp(-np.sqrt(np.maximum(-x, 0.0))), 1.0)
    slope: Vector = np.where(near, series * scale, (cosine - sine) / (2.0 * np.where(near, 1.0, x)))
    return slope


def _like(value: Number, result: Vector) -> Number:
    return float(result[0]) if np.ndim(value) == 0 else result.reshape(np.shape(value))  # type: ignore[return-value]
