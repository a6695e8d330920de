"""Guided waves of a free plate of any thickness: the Rayleigh-Lamb equations, and the Rayleigh wave of its faces.

The modes are those of an infinite, isotropic, elastic plate of thickness t = 2h in plane strain with free faces (Lamb,
Proc. R. Soc. A 93 (1917) 114; Graff, Wave Motion in Elastic Solids, chapter 8). "S0", "S1" … are symmetric: the faces
move in opposite directions. "A0", "A1" … are antisymmetric: the faces move up and down together. The number of a mode
counts the frequencies upwards at a fixed wave number. A mode may therefore be a backward wave near its cut-off (S1 of
most metals); its phase and group speeds are then those of its forward wave. Wave numbers are real.

Methods take a number, or an array where the type says so, and return the same kind. A ValueError names the argument if
a number is not finite or out of its range.

With Ω = ωh/c_s, κ = kh, η = (c_s/c_p)², x = ηΩ² − κ², y = Ω² − κ² and the entire functions C(x) = cos √x and
S(x) = sin √x / √x, the equations have no poles and no spurious roots:
(y − κ²)² C(u) S(v) + 4 κ² u S(u) C(v) = 0, symmetric with u, v = x, y, antisymmetric with u, v = y, x.
"""

import re
from collections.abc import Callable
from math import pi, sqrt
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from structures.bodies.elasticity import pressure_speed, shear_speed
from structures.checks import each, instance, not_negative, positive, short
from structures.described import described
from structures.material import Material
from structures.quantities import Length
from structures.structure import Vector

Number = TypeVar("Number", float, Vector)

SMALLEST_PULSE, LARGEST_PULSE = 1e-20, 1e8
"""Ω = π f t / c_T beyond which the search for a wave leaves the range of floating point."""

TRIAL_WAVE_NUMBERS = 257
"""Number of wave numbers that are tried at each frequency before a mode counts as not propagating. They are denser for
longer waves.
"""

LONG_BENDING = 0.01
"""If |x| and |y| are below this number, A0 is the only antisymmetric wave, and a series replaces its equation, which
would lose digits by cancellation.
"""


def rayleigh_speed(material: Material) -> float:
    """Return the speed c_R of Rayleigh waves along the face of a half-space.

    ξ = (c_R/c_s)² is the only root in (0, 1) of ξ³ − 8ξ² + (24 − 16η)ξ − 16(1 − η) = 0 with η = (c_s/c_p)².

    Parameters
    ----------
    material : Material
        The isotropic material of the half-space.

    Returns
    -------
    float
        c_R, m/s.

    Raises
    ------
    ValueError
        If `material` is not a Material.

    Notes
    -----
    For aluminium c_R is 0.57 √(E/ρ), as in section 6.2.2 of Khatri's thesis.

    References
    ----------
    Achenbach, Wave Propagation in Elastic Solids, chapter 5.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.theory.rayleigh_speed(hl.ALUMINIUM_6061), 1)
    2890.5
    """
    eta = _speed_ratio(material)

    def rayleigh(xi: float) -> float:
        return ((xi - 8.0) * xi + 24.0 - 16.0 * eta) * xi - 16.0 * (1.0 - eta)

    return shear_speed(material) * sqrt(brentq(rayleigh, 0.0, 1.0, xtol=1e-16))


@described
class LambWaves:
    """One mode of the guided waves in a free plate of any thickness.

    Parameters
    ----------
    material : Material
        The isotropic material of the plate.
    thickness : float
        Thickness t, m.
    mode : str
        "S" or "A" and a number: "A0", "S0", "A1" …

    Raises
    ------
    ValueError
        If the thickness is not positive, or if `mode` is not the name of a mode.

    References
    ----------
    Lamb, Proc. R. Soc. A 93 (1917) 114; Graff, Wave Motion in Elastic Solids, chapter 8.

    Examples
    --------
    Khatri's thesis takes a group speed of 1000 m/s (section 6.2.2): aluminium of 2.29 mm has it at 12 kHz.

    >>> import hertzlink as hl
    >>> round(hl.theory.LambWaves(hl.ALUMINIUM_6061, thickness=2.29e-3, mode="A0").group_speed(12e3))
    1003
    """

    material: Material
    thickness: Length
    mode: str = "A0"

    def __post_init__(self) -> None:
        if re.fullmatch(r"[AS]\d{1,4}", self.mode) is None:
            raise ValueError(f"mode = {self.mode!r}: must be 'A' or 'S' and a number, such as 'A0' or 'S1'")

    def frequency(self, wave_number: Number) -> Number:
        """Return the frequency at a given wave number: the whole curve of the mode, including backward waves.

        Parameters
        ----------
        wave_number : float or ndarray
            Real wave number k, rad/m, zero or more.

        Returns
        -------
        float or ndarray
            Frequency, Hz, with the shape of `wave_number` and a relative error of 1e-11.

        Raises
        ------
        ValueError
            If a number is out of its range.

        Examples
        --------
        >>> import hertzlink as hl
        >>> round(hl.theory.LambWaves(hl.ALUMINIUM_6061, thickness=2.29e-3).frequency(wave_number=70.0), 1)
        2749.6
        """
        with np.errstate(over="ignore"):
            waves = each(not_negative, "wave_number", wave_number, "rad/m") * self.thickness / 2.0
        if not np.isfinite(waves).all():
            thickness = f"thickness = {self.thickness:g}"
            raise ValueError(f"wave_number = {short(wave_number)}: times {thickness} must be finite")
        curve, waves = self._curve, waves.ravel()
        high = 1.0 + waves
        while (low := curve.below(waves, high) <= curve.number).any():
            high = np.where(low, 2.0 * high, high)
        pulse = _bisected(lambda middle: curve.below(waves, middle) > curve.number, np.zeros_like(high), high)
        return _like(wave_number, pulse * shear_speed(self.material) / (pi * self.thickness))

    def phase_speed(self, frequency: Number) -> Number:
        """Return the phase speed ω/k at a given frequency.

        Parameters
        ----------
        frequency : float or ndarray
            Frequency, Hz, positive.

        Returns
        -------
        float or ndarray
            Phase speed, m/s, with the shape of `frequency`. The relative error is 1e-11, except close to a cut-off,
            where the frequency does not determine the speed.

        Raises
        ------
        ValueError
            If the mode does not propagate at the frequency, or if the frequency is within 1e-5 of the lowest one of a
            mode with backward waves; also if a number is out of its range.

        Notes
        -----
        For long waves, A0 has Kirchhoff's √ω (D/ρt)^{1/4} times 1 − (17 − 7ν)/(240 (1 − ν)) (kt)². In aluminium this is
        1 % less where t is 1/19 of a wavelength. S0 has √(E/ρ(1−ν²)). For short waves, A0 and S0 have `rayleigh_speed`,
        and the other modes have the shear speed.

        Examples
        --------
        >>> import hertzlink as hl
        >>> round(hl.theory.LambWaves(hl.ALUMINIUM_6061, thickness=2.29e-3).phase_speed(frequency=12e3), 1)
        511.6
        """
        waves, pulse = self._forward(frequency)
        return _like(frequency, shear_speed(self.material) * pulse / waves)

    def group_speed(self, frequency: Number) -> Number:
        """Return the group speed dω/dk at a given frequency, from the derivatives of the Rayleigh-Lamb equation itself.

        Parameters
        ----------
        frequency : float or ndarray
            Frequency, Hz, positive.

        Returns
        -------
        float or ndarray
            Group speed, m/s, with the shape of `frequency` and the accuracy of `phase_speed`. It is undefined where two
            modes cross (S0 and S1 at kt = π for ν = 0).

        Raises
        ------
        ValueError
            As `phase_speed`.
        """
        waves, pulse = self._forward(frequency)
        return _like(frequency, shear_speed(self.material) * waves / pulse * self._curve.slope(waves, pulse))

    def cutoff_frequency(self) -> float:
        """Return the cut-off frequency, Hz: that at infinite wavelength; 0 for A0 and S0.

        The cut-offs are the resonances through the thickness, in ascending order: t f = c_s m and c_p (m − ½) for S
        modes, c_p m and c_s (m − ½) for A modes, with m = 1, 2 … A mode that is a backward wave at its cut-off has a
        forward wave already at lower frequencies: for S1 of steel from 6 % below its cut-off.

        Returns
        -------
        float
            Frequency, Hz.

        Examples
        --------
        >>> import hertzlink as hl
        >>> round(hl.theory.LambWaves(hl.ALUMINIUM_6061, thickness=2.29e-3, mode="A1").cutoff_frequency() * 1e-6, 3)
        0.677
        """
        curve = self._curve
        if curve.number == 0:
            return 0.0
        shear, pressure = shear_speed(self.material), pressure_speed(self.material)
        full, half = (shear, pressure) if curve.symmetric else (pressure, shear)
        counts = np.arange(1, curve.number + 1)
        resonances = np.sort(np.concatenate([full * counts, half * (counts - 0.5)]))
        return float(resonances[curve.number - 1] / self.thickness)

    @property
    def _curve(self) -> "_Curve":
        return _Curve(self.mode.startswith("S"), int(self.mode[1:]), _speed_ratio(self.material))

    def _forward(self, frequency: Number) -> tuple[Vector, Vector]:
        """Return κ of the forward wave, which is the largest κ of the mode, and Ω, in one row each."""
        frequencies, curve = each(positive, "frequency", frequency, "Hz").ravel(), self._curve
        unit = shear_speed(self.material) / (pi * self.thickness)
        pulse = pi * frequencies * self.thickness / shear_speed(self.material)
        if (pulse > LARGEST_PULSE).any():
            raise ValueError(f"frequency = {frequencies.max():g}: must be at most {LARGEST_PULSE * unit:.3g} Hz")
        if (pulse < SMALLEST_PULSE).any():
            raise ValueError(f"frequency = {frequencies.min():g}: must be at least {SMALLEST_PULSE * unit:.3g} Hz")
        top = pulse
        while (short := curve.below(top, pulse) > curve.number).any():
            top = np.where(short, 2.0 * top, top)
        trials = np.linspace(0.0, 1.0, TRIAL_WAVE_NUMBERS) ** 2 * top[:, None]
        there: NDArray[np.bool_] = curve.below(trials, pulse[:, None]) > curve.number
        if not there.any(axis=1).all():
            worst = float(frequencies[~there.any(axis=1)][0])
            cutoff = self.cutoff_frequency()
            raise ValueError(f"frequency = {worst!r}: must be above {cutoff:g} Hz, the cut-off of {self.mode}")
        last = TRIAL_WAVE_NUMBERS - 1 - np.argmax(there[:, ::-1], axis=1)
        rows = np.arange(pulse.size)
        beyond = _bisected(
            lambda middle: curve.below(middle, pulse) <= curve.number, trials[rows, last], trials[rows, last + 1]
        )
        return beyond, pulse


class _Curve(NamedTuple):
    """One mode: its family, the number of modes of the family below it, and η = (c_s/c_p)²."""

    symmetric: bool
    number: int
    eta: float

    def below(self, waves: Vector, pulse: Vector) -> Vector:
        """Return the number of frequencies of the family below Ω at κ. The count is exact, so no root is missed or
        confused.

        If the normal motion of the faces is constrained, pressure and shear waves decouple. Their frequencies are at
        √x = πm and √y = π(m + 1) or, in antisymmetric motion, at √x and √y = π(m + ½), m = 0, 1 … Without this one
        constraint, one more frequency lies below Ω if the stiffness of the faces is negative there, and none otherwise
        (Wittrick and Williams, Q. J. Mech. Appl. Math. 24 (1971) 263).
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
        """Return the slope dΩ²/dκ² of the curve: minus the ratio of the two derivatives of the equation."""
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
        return (not self.symmetric) & (np.maximum(np.abs(x), np.abs(y)) < LONG_BENDING)


def _bisected(beyond: Callable[[Vector], NDArray[np.bool_]], low: Vector, high: Vector) -> Vector:
    """Return the places between `low` and `high` where `beyond` changes from False to True."""
    while (high - low > 4e-16 * high + 1e-30).any():
        middle = (low + high) / 2.0
        there = beyond(middle)
        low, high = np.where(there, low, middle), np.where(there, middle, high)
    return high


def _speed_ratio(material: Material) -> float:
    """Return η = (c_s/c_p)² = (1 − 2ν)/2(1 − ν)."""
    instance("material", material, Material, "a Material; MATERIALS[name] gives one by name")
    return (1.0 - 2.0 * material.poisson_ratio) / (2.0 * (1.0 - material.poisson_ratio))


def _waves(x: Vector) -> tuple[Vector, Vector]:
    """Return C(x) and S(x), both times exp(−√−x) for x < 0, which prevents overflow."""
    root = np.sqrt(np.abs(x))
    some = np.where(root > 0.0, root, 1.0)
    sine = np.where(x > 0.0, np.sin(root), -np.expm1(-2.0 * root) / 2.0) / some
    return np.where(x > 0.0, np.cos(root), (1.0 + np.exp(-2.0 * root)) / 2.0), np.where(root > 0.0, sine, 1.0)


def _long_bending(square: Vector, eta: float) -> tuple[Vector, Vector]:
    """Return Ω² of A0 at a small κ², and dΩ²/dκ² by a complex step.

    Divided by its factor Ω², the equation is Ω² S(x) C(y) + 4 κ² y (1 − η) D = 0, where
    D = (S(y) C(x) − S(x) C(y)) / (y − x) is a series in x + y and x y. It is solved for the first Ω² by fixed-point
    iteration, which reduces the error by a factor of the order of κ² in each step.
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
    """Return S′(x) = (C − S)/2x, or its series where the difference would lose digits by cancellation."""
    near = np.abs(x) < 1e-3
    series = -1.0 / 6.0 + x / 60.0 - x**2 / 1680.0
    scale = np.where(x < 0.0, np.exp(-np.sqrt(np.maximum(-x, 0.0))), 1.0)
    slope: Vector = np.where(near, series * scale, (cosine - sine) / (2.0 * np.where(near, 1.0, x)))
    return slope


def _like(value: Number, result: Vector) -> Number:
    return float(result[0]) if np.ndim(value) == 0 else result.reshape(np.shape(value))  # type: ignore[return-value]
