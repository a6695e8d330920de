"""Walls that a chain's last bead touches, from numpy and scipy alone: plates with one straight edge, and rods.

A wall is a dashpot of the impedance Z and an echo. A unit impulse moves the struck point by (1 + g(t))/Z, so that under
the force F the point is at w = (∫F dt + ∫F(τ) g(t − τ) dτ)/Z. The echo g begins at zero: waves that leave the contact
have to come back. Each wall gives the Laplace transform of g in closed form or under one integral; `second_integral`
inverts it. The force is linear between the points of a grid of interval h, and then the convolution is exact with the
second differences of ∫∫g over h.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Complex = NDArray[np.complex128]

HIGHEST_FREQUENCY = 0.5e6
"""Hz, above which echoes are left out: a wave of 9.5 mm beads at 0.3 m/s holds nothing above some 0.1 MHz."""

PERIODS, DECAY = 4.0, 30.0
"""An echo is inverted as a Fourier series of this many records, damped to e⁻³⁰ over its period. A wrapped echo is
damped; what the highest frequency cuts off is amplified, by e^{DECAY/PERIODS} at the end of the record."""

POINTS, PANELS = 10, 40
"""Gauss points in each of the intervals of the integral over the wavenumber along the edge."""

RAISED = 0.5
"""How far the path of that integral passes above its branch points and poles."""

CHUNK = 256
"""Frequencies at once; limits memory."""


@dataclass(frozen=True)
class Material:
    """Young's modulus, Pa; Poisson's ratio; density, kg/m³."""

    youngs_modulus: float
    poisson_ratio: float
    density: float

    @property
    def plane_strain(self) -> float:
        return self.youngs_modulus / (1.0 - self.poisson_ratio**2)


STEEL = Material(200e9, 0.28, 7800.0)
ALUMINIUM = Material(68.9e9, 0.33, 2693.0)


class Wall(Protocol):
    """Its surface's material, its impedance, N s/m, and the Laplace transform of its echo g at each s."""

    @property
    def material(self) -> Material: ...

    @property
    def impedance(self) -> float: ...

    def echo(self, s: Complex) -> Complex: ...


@dataclass(frozen=True)
class EdgedPlate:
    """A Kirchhoff plate that fills x > 0, struck at a distance, m, from its edge: "clamped", "simple", "free", "none".

    Fourier along the edge (wavenumber k), Laplace in time. With κ² = −is/a, a = √(D/m), k = κu, p = √(u² − 1) and
    e = √(u² + 1), a unit force at x = d makes the free field (e^{−pκ|x−d|}/p − e^{−eκ|x−d|}/e)/(4Dκ³). The edge sends
    back αe^{−pκx} + βe^{−eκx}. Both are integrated over u from 0 to ∞; the free field at the contact gives −iπ/2,
    which is the dashpot 8√(Dm). The path passes above u = 1 and the edge wave's pole, as the real k-axis does.
    """

    thickness: float
    distance: float
    edge: str = "clamped"
    material: Material = ALUMINIUM

    @property
    def rigidity(self) -> float:
        return self.material.plane_strain * self.thickness**3 / 12.0

    @property
    def mass(self) -> float:
        """kg/m²."""
        return self.material.density * self.thickness

    @property
    def impedance(self) -> float:
        return float(8.0 * np.sqrt(self.rigidity * self.mass))

    @property
    def diffusion(self) -> float:
        """a = √(D/m), m²/s."""
        return float(np.sqrt(self.rigidity / self.mass))

    def echo(self, s: Complex) -> Complex:
        if self.edge == "none":
            return np.zeros_like(s)
        away = self.distance * np.sqrt(-1j * s / self.diffusion)
        parts = [self._reflected(one) for one in np.array_split(away, 1 + away.size // CHUNK)]
        return 2j / np.pi * np.concatenate(parts) / s

    def _reflected(self, away: Complex) -> Complex:
        """∫ of what the edge sends back to the contact over u, for each κd."""
        u, width = _path(float(abs(away).min()), float(abs(away).max()))
        p, e = np.sqrt(u**2 - 1.0), np.sqrt(u**2 + 1.0)
        (fp, fe), (mp, me) = self._conditions(u, p, e), self._conditions(u, -p, -e)
        near, far = np.exp(-np.outer(away, p)), np.exp(-np.outer(away, e))
        first, second = (-(fp[i] / p * near - fe[i] / e * far) for i in (0, 1))
        determinant = mp[0] * me[1] - me[0] * mp[1]
        alpha = (first * me[1] - me[0] * second) / determinant
        beta = (mp[0] * second - first * mp[1]) / determinant
        return (alpha * near + beta * far) @ width

    def _conditions(self, u: Complex, p: Complex, e: Complex) -> list[tuple[Complex, Complex]]:
        """What must vanish at x = 0 of e^{pκx} and of e^{eκx}: two conditions each."""
        nu, one = self.material.poisson_ratio, np.ones_like(u)
        found = []
        for rate in (p, e):
            moment, shear = rate**2 - nu * u**2, rate**3 - (2.0 - nu) * u**2 * rate
            found.append({"clamped": (one, rate), "simple": (one, moment), "free": (moment, shear)}[self.edge])
        return found


def _path(least: float, largest: float) -> tuple[Complex, Complex]:
    """Gauss points u on a path above the real axis and their weights, for |κd| between these."""
    place, weight = np.polynomial.legendre.leggauss(POINTS)
    first, last = 0.05 / np.sqrt(1.0 + largest), 2.0 + 60.0 / least
    ends = np.append(0.0, np.geomspace(first, last, PANELS))
    half, middle = np.diff(ends)[:, None] / 2.0, (ends[1:] + ends[:-1])[:, None] / 2.0
    t = (middle + half * place).ravel()
    above = RAISED * (1.0 - t**2) / (1.0 + t**2) ** 2
    return t + 1j * RAISED * t / (1.0 + t**2), (half * weight).ravel() * (1.0 + 1j * above)


@dataclass(frozen=True)
class Rod:
    """Bonded layers (material, length, radius), the struck one first; "fixed" or "free" behind the last.

    d'Alembert: each layer carries one wave either way, at √(E/ρ), with the impedance ρcA. From the end forwards, a
    section's reflection of the velocity is (r + G)/(1 + rG), r that of the interface and G what comes back through the
    layer behind it. The struck face is free, so that the velocity of a unit impulse is (1 + G)/(1 − G)/Z.
    """

    layers: Sequence[tuple[Material, float, float]]
    end: str = "free"

    @property
    def material(self) -> Material:
        return self.layers[0][0]

    @property
    def impedance(self) -> float:
        return self._impedances()[0]

    def _impedances(self) -> list[float]:
        return [float(np.sqrt(one.youngs_modulus * one.density) * np.pi * radius**2) for one, _, radius in self.layers]

    def echo(self, s: Complex) -> Complex:
        there = self._impedances()
        back = np.full_like(s, {"fixed": -1.0, "free": 1.0}[self.end])
        for i in reversed(range(len(there))):
            material, length, _ = self.layers[i]
            back = back * np.exp(-2.0 * s * length / np.sqrt(material.youngs_modulus / material.density))
            if i:
                r = (there[i - 1] - there[i]) / (there[i - 1] + there[i])
                back = (r + back) / (1.0 + r * back)
        return 2.0 * back / (1.0 - back) / s


@dataclass(frozen=True)
class Rigid:
    """A half-space, which moves at the contact alone: the impedance is that of no finite thing."""

    material: Material = STEEL
    impedance: float = np.inf

    def echo(self, s: Complex) -> Complex:
        return np.zeros_like(s)


def second_integral(wall: Wall, interval: float, count: int) -> Numbers:
    """∫∫g dt dt at `count` times from zero on, s².

    ĝ/s² on a line parallel to the imaginary axis; a Fourier series of a period longer than the record replaces the
    inversion integral, and what it folds back is damped by e^{−DECAY} (Dubner and Abate, J. ACM 15 (1968) 115).
    """
    size = 1 << int(np.ceil(np.log2(PERIODS * count)))
    period = size * interval
    sigma = DECAY / period
    kept = min(size // 2, int(HIGHEST_FREQUENCY * period)) + 1
    s = sigma + 2j * np.pi * np.arange(kept) / period
    spectrum = np.zeros(size // 2 + 1, dtype=complex)
    spectrum[:kept] = wall.echo(s) / s**2
    times = interval * np.arange(count)
    return np.exp(sigma * times) * np.fft.irfft(spectrum, size)[:count] / interval
