"""The infinite plate without a mesh: at a point it is a dashpot."""

from dataclasses import asdict

import numpy as np
from scipy import sparse

from plates.laminate import Laminate, section_of
from plates.section import point_rigidity
from structures.material import Material
from structures.structure import Structure
from structures.surface import Surface


def infinite_plate(thickness: float | None, material: Material | Laminate) -> Structure:
    """A thin plate without edges: one degree of freedom without mass on a dashpot 8 √(D ρ t), N s/m.

    Exact in Kirchhoff's theory (Cremer, Heckl, Petersson, Structure-Borne Sound, 3rd ed., table 5.1): an impulse I
    moves the point by I / (8 √(D ρ t)), and there it stays. What the dashpot takes is carried away by waves.
    thickness in m; None of a Laminate, whose D is that of the mean of 1/√D(φ) over all directions
    (`plates.section.point_rigidity`). Below a wavelength of some six thicknesses no plate is thin.
    """
    section = section_of(thickness, material)
    impedance = 8.0 * (point_rigidity(section) * section.mass) ** 0.5
    none = sparse.csr_array((1, 1))
    origin = {
        "kind": "infinite plate", "thickness": section.thickness, "material": asdict(material), "impedance": impedance,
    }  # fmt: skip
    damping = sparse.csr_array([[impedance]])
    return Structure(none, none, damping, np.ones(1), 0.0, Surface(section.struck), origin)
