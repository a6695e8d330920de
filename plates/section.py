"""The wall of a plate for its theory: bending stiffness, shear stiffness and mass, of one material or of layers."""

from dataclasses import asdict, dataclass
from typing import Annotated, Any

import numpy as np

from structures.bodies.elasticity import shear_modulus
from structures.material import Material
from structures.quantities import Quantity
from structures.structure import Vector

SHEAR_CORRECTION = 5.0 / 6.0  # Reissner's factor of the transverse shear stiffness of a homogeneous plate
# Directions over half a turn for the mean of D(φ), which is exact to rounding unless the stiffnesses differ extremely;
# the other half is the same.
DIRECTIONS = np.linspace(0.0, np.pi, 720, endpoint=False)
ROUNDING = 1e-9  # Fraction of a stiffness below which an entry counts as zero
ShearCorrection = Annotated[float, Quantity()]


@dataclass(frozen=True, eq=False)
class Section:
    """The wall of a plate, per unit of its middle surface."""

    bending: Vector  # 3 × 3, N m: moments (M_xx, M_yy, M_xy) over curvatures (w_xx, w_yy, 2 w_xy)
    shear: Vector  # 2 × 2, N/m: forces (Q_x, Q_y) over transverse shear strains, with the shear correction
    mass: float  # per area, kg/m²
    rotary_inertia: float  # per area, kg
    thickness: float  # m
    struck: Material  # the isotropic material whose E and ν enter Hertz's contact law

    @property
    def walls(self) -> list[tuple[Vector, Vector, float]]:
        """Bending stiffness, shear stiffness, and part of the rotary inertia of each wall in Mindlin's theory."""
        return [(self.bending, self.shear, 1.0)]

    @property
    def data(self) -> dict[str, Any]:
        """The section as plain data, for results."""
        numbers = {"bending": self.bending.tolist(), "shear": self.shear.tolist(), "mass": self.mass}
        more = {"rotary_inertia": self.rotary_inertia, "thickness": self.thickness, "struck": asdict(self.struck)}
        return numbers | more


def homogeneous_section(thickness: float, material: Material, shear_correction: float = SHEAR_CORRECTION) -> Section:
    """Return the section of a plate of one isotropic material: D = E t³/12(1 − ν²), ρ t, ρ t³/12; thickness t in m."""
    nu, rigidity = material.poisson_ratio, material.contact_modulus * thickness**3 / 12.0
    bending = rigidity * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, (1.0 - nu) / 2.0]])
    shear = shear_correction * shear_modulus(material) * thickness * np.eye(2)
    mass = material.density * thickness
    return Section(bending, shear, mass, mass * thickness**2 / 12.0, thickness, material)


def flexural_wavelength(
    mass: float, rigidity: float, frequency: float, rotary_inertia: float = 0.0, shear: float = np.inf
) -> float:
    """Return the flexural wavelength 2π/k, m, with the larger root k of
    D k⁴ − (J + m D/S) ω² k² − m ω² (1 − J ω²/S) = 0. J: rotary inertia, kg; S: shear stiffness, N/m. Kirchhoff's theory
    has neither."""
    circular = 2.0 * np.pi * frequency
    linear = (rotary_inertia + mass * rigidity / shear) * circular**2
    constant = mass * circular**2 * (1.0 - rotary_inertia * circular**2 / shear)
    square = (linear + np.sqrt(linear**2 + 4.0 * rigidity * constant)) / (2.0 * rigidity)
    return float(2.0 * np.pi / np.sqrt(square))


def stiffness_towards(section: Section, angle: Vector = DIRECTIONS) -> Vector:
    """Return the bending stiffness D(φ), N m, for flexural waves at angles φ from x towards y (rad), or all around.

    A wave along φ bends the plate by (c², s², 2cs), so D(φ) = D₁₁c⁴ + 2(D₁₂ + 2D₆₆)c²s² + D₂₂s⁴ + 4D₁₆c³s + 4D₂₆cs³.
    """
    curvature = np.array([np.cos(angle) ** 2, np.sin(angle) ** 2, np.sin(2.0 * angle)])
    towards: Vector = np.einsum("i...,ij,j...->...", curvature, section.bending, curvature)
    return towards


def mirrors_itself(section: Section, angle: float) -> bool:
    """Return whether the wall is symmetric about a line at an angle from x, rad.

    In axes along the line, bending then does not twist the wall (D₁₆ = D₂₆ = 0), and the shear stiffness is diagonal.
    """
    c, s = np.cos(angle), np.sin(angle)
    bend = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]])
    shear = np.array([[c, s], [-s, c]])
    # Stiffness transforms with the inverse transpose of the curvatures, which is the rotation by −angle.
    inverse = np.linalg.inv(bend)
    bending, transverse = inverse.T @ section.bending @ inverse, shear @ section.shear @ shear.T
    coupled = abs(bending[:2, 2]).max() > ROUNDING * abs(bending).max()
    return not coupled and bool(abs(transverse[0, 1]) <= ROUNDING * abs(transverse).max())


def point_impedance(rigidity: float, mass: float) -> float:
    """Return the force over the velocity at a point of an infinite plate, 8 √(D m), N s/m. mass: per area, kg/m²."""
    return float(8.0 * (rigidity * mass) ** 0.5)


def point_rigidity(section: Section) -> float:
    """Return D of the isotropic plate with the same point impedance, N m: 1/√D is the mean of 1/√D(φ)."""
    return float(np.mean(stiffness_towards(section) ** -0.5) ** -2)
