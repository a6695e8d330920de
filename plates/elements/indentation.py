"""The contact force on a small disc of Mindlin's plate, and the indentation that plate and Hertz's law do not contain.

Hertz's law contains the indentation of a half-space. Under a pressure p cos kx on its face, a plate in three dimensions
deflects by p (1 − ν²)/Ek · B(kt) more than the half-space, with B = (ch + 1)/(sh − x) + (ch − 1)/(sh + x) − 2, x = kt
(Timoshenko and Goodier, Theory of Elasticity, section 24). This is 1/Dk⁴ + t²/5Dk² + … for long waves and zero for
short ones. Mindlin's plate deflects by 1/Dk⁴ + 1/Sk² with D/S = t²/5(1 − ν). Its second term is too large, and for
short waves it causes the logarithmic singularity under a point force. Two corrections make the result independent of
the disc's radius a. First, the transverse stress under the force bends the plate by Poisson's effect, e p̂ with
e = νt²/10(1 − ν) (Reissner, J. Appl. Mech. 12 (1945) 69); a²/8 is subtracted, because the mean over the disc has the
same effect. Second, the difference that remains is a constant, which is given as a flexibility.
"""

from math import log, pi

import numpy as np

from plates.section import Section, all_around

LAYER = -2.252968
"""∫ B(x) − 12/x³ − 2.4/x [x < 1] dx from 0 on."""

MEAN_OF_LOGARITHM = 0.3659315
"""∫ (4 J₁²(x)/x² − [x < 1]) dx/x = ln 2 − γ + 1/4."""

MEAN_OF_BENDING = -0.2373162
"""∫ (4 J₁²(x)/x² − 1 + x²/4 [x < 1]) dx/x³ = −(ln 2 − γ)/4 − 5/24."""


def bending_by_poisson(section: Section, radius: float) -> float:
    """Return e − a²/8, m²: the contact reads w + (e − a²/8) ∇·s, in the mean over a disc of radius a, m."""
    nu = section.struck.poisson_ratio
    return nu * section.thickness**2 / (10.0 * (1.0 - nu)) - radius**2 / 8.0


def remaining_flexibility(section: Section, radius: float) -> float:
    """Return the compliance of the layer in three dimensions, less those of the half-space and of Mindlin's plate under
    a disc of this radius, m; in m/N.

    2J₁(ka)/ka is the disc's mean. The stiffness of anisotropic walls is averaged over all directions.
    """
    # The harmonic mean of D over all directions governs the deflection under a point force.
    rigidity, shear = float(1.0 / (1.0 / all_around(section)).mean()), float(np.sqrt(np.linalg.det(section.shear)))
    bend, thickness = bending_by_poisson(section, radius), section.thickness
    ratio = log(thickness / radius)
    plate = radius**2 / rigidity * (MEAN_OF_BENDING - ratio / 4.0)
    plate += (1.0 / shear - 2.0 * bend / rigidity) * (ratio + MEAN_OF_LOGARITHM)
    plate += 2.0 * bend**2 / (rigidity * radius**2)
    return (LAYER * thickness**2 / (12.0 * rigidity) - plate) / (2.0 * pi)
