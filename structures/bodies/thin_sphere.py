"""Thin spherical shells in closed form: the stiffness under a force, and the pressure that buckles them."""

from dataclasses import dataclass
from math import acos, atanh, pi, sqrt

from structures.checks import finite, instance, positive
from structures.material import Material

THINNEST = 1e-3
"""Thickness over radius. Below it, meshes of cells that are not too flat have too many of them."""

MOST = 1e6
"""Pressures beyond this part of the buckling pressure are most likely in another unit."""

LARGEST_RADIUS = 5.0
"""m. A radius given in millimetres is mostly above this value."""


@dataclass(frozen=True)
class ThinSphere:
    """A thin spherical shell in closed form: the stiffness under a force, and the pressure that buckles it.

    Parameters
    ----------
    radius : float
        Outer radius, m. The formulas take that of the middle surface, R = radius − thickness/2.
    thickness : float
        Thickness t, m.
    material : Material
        The material of the wall.

    Raises
    ------
    ValueError
        If an argument is out of its range.

    References
    ----------
    Zoelly (1915); Timoshenko, Gere, Theory of Elastic Stability, 2nd ed. (1961), section 11.13; Reissner, J. Math.
    Phys. 25 (1946) 279; Vella et al., J. R. Soc. Interface 9 (2012) 448.

    Examples
    --------
    >>> import hertzlink as hl
    >>> shell = hl.theory.ThinSphere(0.1, 1e-3, hl.STEEL_316)
    >>> round(shell.buckling_pressure / 1e6, 1)  # MPa
    23.6
    >>> [round(shell.point_stiffness(pressure) / 1e6, 2) for pressure in (-1e6, 0.0, 1e6)]  # kN/mm
    [4.57, 4.7, 4.82]
    """

    radius: float
    thickness: float
    material: Material

    def __post_init__(self) -> None:
        instance("material", self.material, Material, "a Material; MATERIALS[name] gives one by name")
        radius, thickness = sizes(self.radius, self.thickness)
        object.__setattr__(self, "radius", radius)
        object.__setattr__(self, "thickness", thickness)

    @property
    def _middle(self) -> float:
        """Radius of the middle surface, m."""
        return self.radius - 0.5 * self.thickness

    @property
    def _stiffness(self) -> float:
        """√(D E t), N, with D = E t³/12(1 − ν²)."""
        stretching = self.material.youngs_modulus * self.thickness
        return stretching * self.thickness / sqrt(12.0 * (1.0 - self.material.poisson_ratio**2))

    @property
    def buckling_pressure(self) -> float:
        """Pressure difference, outside minus inside, at which a perfect shell buckles: 2 E t²/R² √(3(1 − ν²)), Pa.

        Real shells buckle at a fifth to a half of it. In thick walls shear lowers it, by 16 % for t/R = 0.11.
        """
        return 4.0 * self._stiffness / self._middle**2

    def point_stiffness(self, pressure: float = 0.0) -> float:
        """Return the stiffness under a force at one point, in the theory of shallow shells.

        Parameters
        ----------
        pressure : float
            Pressure difference p, inside minus outside, Pa: above −`buckling_pressure`, at most 1e6 times that
            pressure.

        Returns
        -------
        float
            k = 8 √(D E t)/R · (π/2) √(1 − τ²)/arccos τ, N/m, with D = E t³/12(1 − ν²) and τ = p R²/4 √(D E t). Above
            τ = 1 the last factor is √(τ² − 1)/artanh √(1 − τ⁻²). Without pressure both factors together are 1.

        Raises
        ------
        ValueError
            If the wall buckles under the pressure, or it is out of its range.
        """
        pressure, least = finite("pressure", pressure, "Pa"), -self.buckling_pressure
        if not least < pressure <= -MOST * least:
            raise ValueError(
                f"pressure = {pressure!r}: must be above {least:.4g} Pa, at which the wall buckles, and at most "
                f"{-MOST * least:.4g} Pa"
            )
        tau = -pressure / least
        # artanh(√(1 − τ⁻²))/√(τ² − 1) is arccos(τ)/√(1 − τ²) below 1; both are smooth there.
        if abs(tau - 1.0) < 1e-6:
            integral = 1.0 - (tau - 1.0) / 3.0
        elif tau > 1.0:
            integral = atanh(sqrt(1.0 - tau**-2)) / sqrt(tau**2 - 1.0)
        else:
            integral = acos(tau) / sqrt(1.0 - tau**2)
        return 4.0 * pi * self._stiffness / self._middle / integral


def sizes(radius: float, thickness: float) -> tuple[float, float]:
    """Return the outer radius and thickness, m, in their ranges."""
    radius, thickness = positive("radius", radius, "m"), positive("thickness", thickness, "m")
    if radius > LARGEST_RADIUS:
        raise ValueError(f"radius = {radius!r}: must be at most {LARGEST_RADIUS:g} m; is it in millimetres?")
    if not THINNEST * radius <= thickness <= 0.9 * radius:
        raise ValueError(
            f"thickness = {thickness!r}: must lie between {THINNEST:g} and 0.9 of the radius, "
            f"{THINNEST * radius:.4g} and {0.9 * radius:.4g} m"
        )
    return radius, thickness
