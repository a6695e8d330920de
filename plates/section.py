"""What a plate's theory knows of its wall: bending and shear stiffness, mass; of one material or of layers."""

from dataclasses import dataclass

import numpy as np

from structures.elasticity import shear_modulus
from structures.material import Material
from structures.structure import Vector

SHEAR_CORRECTION = 5.0 / 6.0
"""Reissner's factor of the transverse shear stiffness of a homogeneous plate."""


@dataclass(frozen=True, eq=False)
class Section:
    """A plate's wall per unit of its middle surface.

    bending: 3 × 3, N m: moments (M_xx, M_yy, M_xy) over curvatures (w_xx, w_yy, 2 w_xy). shear: 2 × 2, N/m, with the
    shear correction: forces (Q_x, Q_y) over shear strains. mass, kg/m²; rotary_inertia, kg. thickness, m.
    struck: the isotropic material whose E and ν Hertz's contact sees.
    """

    bending: Vector
    shear: Vector
    mass: float
    rotary_inertia: float
    thickness: float
    struck: Material


def homogeneous(thickness: float, material: Material, shear_correction: float = SHEAR_CORRECTION) -> Section:
    """The section of a plate of one isotropic material."""
    nu, rigidity = material.poisson_ratio, material.contact_modulus * thickness**3 / 12.0
    bending = rigidity * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, (1.0 - nu) / 2.0]])
    shear = shear_correction * shear_modulus(material) * thickness * np.eye(2)
    mass = material.density * thickness
    return Section(bending, shear, mass, mass * thickness**2 / 12.0, thickness, material)
