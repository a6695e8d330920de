"""Hollow spheres under pressure: series of Legendre polynomials along the meridian, polynomials through the wall.

Nothing is shared with hertzlink. For each degree n the displacement is u_R = U(ρ) P_n(cos φ), u_φ = V(ρ) dP_n/dφ, with
polynomials U and V (Rayleigh and Ritz). The quadratic forms follow from the displacement gradient in spherical
coordinates.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.special import eval_legendre


@dataclass(frozen=True)
class Ball:
    """A free hollow sphere, SI units. pressure: inside less outside. bulk: of the gas inside, Pa."""

    radius: float
    thickness: float
    youngs_modulus: float
    poisson_ratio: float
    density: float
    pressure: float = 0.0
    bulk: float = 0.0
    degree: int = 14

    @property
    def inner(self) -> float:
        return self.radius - self.thickness

    def matrices(self, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass, stiffness without stress, and stiffness of the pressure, for the coefficients of U and then of V."""
        a, b, p = self.inner, self.radius, self.pressure
        x, weight = legendre.leggauss(2 * self.degree + 4)
        rho = 0.5 * (a + b) + 0.5 * (b - a) * x
        weight = weight * 0.5 * (b - a)
        values = legendre.legvander(x, self.degree)
        slopes = np.stack([legendre.legval(x, legendre.legder(row)) for row in np.eye(self.degree + 1)], 1)
        slopes = slopes * 2.0 / (b - a)
        none = np.zeros_like(values)
        u, v = np.hstack([values, none]), np.hstack([none, values])
        du, dv = np.hstack([slopes, none]), np.hstack([none, slopes])
        # Means over the sphere, times 4π: of P², P′², and of what P″ and cot φ P′ add to them.
        lam = n * (n + 1.0)
        of_p = 4.0 * np.pi / (2.0 * n + 1.0)
        of_slope = lam * of_p

        def product(one: np.ndarray, other: np.ndarray, factor: np.ndarray | float) -> np.ndarray:
            return one.T @ (other * (weight * rho**2 * factor)[:, None])

        def squares(one: np.ndarray, factor: np.ndarray | float) -> np.ndarray:
            return product(one, one, factor)

        shear = self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))
        lame = 2.0 * shear * self.poisson_ratio / (1.0 - 2.0 * self.poisson_ratio)
        r = rho[:, None]
        # φφ and θθ: (U P + V P″)/ρ and (U P + V cot φ P′)/ρ. Their sum is (2U − λV) P/ρ, and the mean of the sum of
        # their squares is (2U² − 2λUV + λ(λ − 1)V²)/ρ² that of P².
        sum_of_hoops = (2.0 * u - lam * v) / r

        def squared_hoops(factor: np.ndarray | float) -> np.ndarray:
            cross = product(u, v, factor / rho**2)
            return (
                2.0 * squares(u, factor / rho**2) - lam * (cross + cross.T)
                + lam * (lam - 1.0) * squares(v, factor / rho**2)
            )  # fmt: skip

        elastic = of_p * (
            squares(du + sum_of_hoops, lame) + 2.0 * shear * (squares(du, 1.0) + squared_hoops(1.0))
        ) + of_slope * squares(u / r + dv - v / r, shear)
        level = p * a**3 / (b**3 - a**3)
        radial, hoop = level * (1.0 - (b / rho) ** 3), level * (1.0 + 0.5 * (b / rho) ** 3)
        stressed = of_p * (squares(du, radial) + squared_hoops(hoop))
        stressed += of_slope * (squares(dv, radial) + squares((u - v) / r, hoop))
        # −p times the second derivative of the volume inside, ½ ∮ (div u) u·n − n·(∇u)u dS.
        inside = legendre.legvander(np.array([-1.0]), self.degree)[0]
        at_u, at_v = np.concatenate([inside, 0.0 * inside]), np.concatenate([0.0 * inside, inside])
        cross = np.outer(at_u, at_v)
        bent = 2.0 * np.outer(at_u, at_u) - lam * (cross + cross.T) + lam * np.outer(at_v, at_v)
        stressed -= p * a * of_p * bent
        if n == 0:
            volume, area = 4.0 / 3.0 * np.pi * a**3, 4.0 * np.pi * a**2
            elastic = elastic + self.bulk * area**2 / volume * np.outer(at_u, at_u)
        mass = self.density * (of_p * squares(u, 1.0) + of_slope * squares(v, 1.0))
        if n == 0:  # V has no meaning there
            size = self.degree + 1
            mass, elastic, stressed = (one[:size, :size] for one in (mass, elastic, stressed))
        return mass, elastic, stressed

    def frequencies(self, n: int, count: int) -> np.ndarray:
        """The lowest squared angular frequencies of degree n, 1/s²."""
        from scipy.linalg import eigh

        mass, elastic, stressed = self.matrices(n)
        return np.asarray(eigh(elastic + stressed, mass, eigvals_only=True)[:count])

    def buckling_factor(self, degrees: range) -> float:
        """The least positive factor of the pressure at which the wall buckles."""
        from scipy.linalg import eigh

        found = []
        for n in degrees:
            _, elastic, stressed = self.matrices(n)
            found.append(1.0 / eigh(-stressed, elastic, eigvals_only=True)[-1])
        return float(min(one for one in found if one > 0.0))

    def receptance(self, patch: float, rate: float, terms: int) -> float:
        """Laplace transform at `rate`, 1/s, of the displacement after a unit impulse, m/N.

        The impulse is a pressure on a cap of arc length `patch`, with a resultant of one along the axis. The
        displacement is what does work with this pressure.
        """
        angle = patch / self.radius
        total = 0.0
        outer = legendre.legvander(np.array([1.0]), self.degree)[0]
        for n in range(terms):
            mass, elastic, stressed = self.matrices(n)
            below = eval_legendre(n - 1, np.cos(angle)) if n else 1.0
            share = 2.0 * (below - eval_legendre(n + 1, np.cos(angle))) / ((2.0 * n + 1.0) * np.sin(angle) ** 2)
            load = np.zeros(len(mass))
            load[: outer.size] = share * outer
            total += load @ np.linalg.solve(elastic + stressed + rate**2 * mass, load)
        return float(total)
