"""Forces in the plane of a plate that stiffen or soften it."""

from dataclasses import replace
from math import inf
from typing import Annotated

import numpy as np

from structures.caution import collected
from structures.checks import finite, instance, positive, within
from structures.described import described
from structures.material import Material
from structures.quantities import Likely
from structures.structure import Vector

ForcePerLength = Annotated[float, replace(Likely.FORCE_PER_LENGTH, likely=(0.0, inf))]


@described
class Prestress:
    """Constant forces per length in the plane of a plate, in `additions` of a builder. Tension is positive.

    The forces act before the tap, stay constant during it, and add ½ ∫ N_ij w,i w,j to the energy (Timoshenko, Gere,
    Theory of Elastic Stability, 2nd ed., section 8.2). On a plate of thickness t the stress σ is the force σ t.

    Parameters
    ----------
    xx, yy : float
        Force per length along x and along y, N/m.
    xy : float
        Shear force per length, N/m.

    Raises
    ------
    ValueError
        Where a number is not finite. A plate that buckles under the forces is refused where it is struck.

    Examples
    --------
    >>> import hertzlink as hl
    >>> tension = hl.Prestress(xx=20e6 * 1e-3)  # 20 MPa in 1 mm
    >>> sides = hl.Supports("clamped", "clamped", "clamped", "clamped")
    >>> plate = hl.kirchhoff_plate(0.2, 0.2, 1e-3, hl.ALUMINIUM_6061, sides, additions=[tension])
    >>> len(plate.additions)
    1
    """

    xx: ForcePerLength = 0.0
    yy: ForcePerLength = 0.0
    xy: ForcePerLength = 0.0

    def __post_init__(self) -> None:
        name = max(("xx", "yy", "xy"), key=lambda component: abs(getattr(self, component)))
        Likely.FORCE_PER_LENGTH.warn("Prestress", name, round(getattr(self, name), 6))  # no rest of rounding

    @property
    def forces(self) -> Vector:
        """N_ij, 2 × 2, N/m."""
        return np.array([[self.xx, self.xy], [self.xy, self.yy]])


def thermal_prestress(rise: float, expansion: float, thickness: float, material: Material) -> Prestress:
    """Return the prestress of a plate that is held in its plane all around and becomes warmer than it was when it was
    fixed.

    Parameters
    ----------
    rise : float
        Rise of the temperature ΔT, uniform through the thickness, K; negative where it falls.
    expansion : float
        Coefficient of thermal expansion α, 1/K: 23.6e-6 for aluminium 6061, 11.5e-6 for rail steel.
    thickness : float
        Thickness t, m.
    material : Material
        Its E and ν.

    Returns
    -------
    Prestress
        N = −E α ΔT t/(1 − ν) along x and y.

    Raises
    ------
    ValueError
        Where a number is not finite or out of its range.

    References
    ----------
    Boley, Weiner, Theory of Thermal Stresses, Wiley (1960), section 12.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(hl.thermal_prestress(-1.0, 23.6e-6, 1e-3, hl.ALUMINIUM_6061).xx)
    2427
    """
    instance("material", material, Material, "a Material; MATERIALS[name] gives one by name")
    rise, expansion = finite("rise", rise, "K"), within("expansion", expansion, 1e-9, 1e-3, "1/K")
    Likely.PLY.warn("thermal_prestress", "thickness", positive("thickness", thickness, "m"))
    force = -material.youngs_modulus * thickness / (1.0 - material.poisson_ratio) * expansion * rise
    with collected():  # a small rise makes a small force
        return Prestress(force, force)
