"""The infinite plate without a mesh: at a point it is a dashpot."""

import numpy as np
from scipy import sparse

from plates.laminate import Laminate, section_of
from plates.section import Section, point_rigidity
from structures.described import described_as
from structures.material import Material
from structures.quantities import WallThickness
from structures.structure import Structure
from structures.surface import Surface


@described_as(called="infinite plate")
def infinite_plate(thickness: WallThickness | None, material: Material | Laminate) -> Structure:
    """A thin plate without edges: one degree of freedom without mass on a dashpot 8 √(D ρ t), N s/m.

    Parameters
    ----------
    thickness : float or None
        Thickness, m. A Laminate has its own: give that, or None.
    material : Material or Laminate
        Its material. D of a Laminate is that of the mean of 1/√D(φ) over all directions φ.

    Returns
    -------
    Structure
        An impulse I moves the point by I / (8 √(D ρ t)), where it stays. Waves carry away the energy that the dashpot
        absorbs.

    Raises
    ------
    ValueError
        For a thickness or a material of the wrong kind.

    Notes
    -----
    Exact in Kirchhoff's theory. No plate is thin for waves shorter than some six thicknesses.

    References
    ----------
    Cremer, Heckl, Petersson, Structure-Borne Sound, 3rd ed., table 5.1.

    Examples
    --------
    >>> import hertzlink as hl
    >>> plate = hl.infinite_plate(2.29e-3, hl.ALUMINIUM_6061)
    >>> print(f"{plate.damping.toarray().item():.0f} N s/m")
    175 N s/m
    """
    if isinstance(material, Section):
        raise ValueError("material: must be a Material or a Laminate")
    section = section_of(thickness, material)
    impedance = 8.0 * (point_rigidity(section) * section.mass) ** 0.5
    none = sparse.csr_array((1, 1))
    origin = {"thickness": section.thickness, "impedance": impedance}
    damping = sparse.csr_array([[impedance]])
    return Structure(none, none, damping, np.ones(1), 0.0, Surface(section.struck), origin)
