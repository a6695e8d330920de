"""All modes of a small structure: as many oscillators as degrees of freedom, for the compiled window loop."""

import numpy as np
from scipy import sparse
from scipy.linalg import LinAlgError, eigh

from structures.structure import Structure, Vector

LARGEST_SIZE = 600
"""Degrees of freedom up to which a structure moves in its modes. They take 0.1 s for 600 and grow with the third power;
window by window a run of 1 ms takes 0.5 s or more."""

SHIFT = (2.0 * np.pi * 35e3) ** 2
"""1/s². Modes are found from 1/(ω² + SHIFT), so that rounding spares the slow ones: steel beads excite 35 kHz or less.
"""

MASSLESS = 1e-12
"""A mode has no mass if its 1/(ω² + SHIFT) is below this part of the largest."""

PROPORTIONAL = 1e-12
"""The largest difference, as a part of the damping, between it and α M + β K."""


def modes_of(structure: Structure) -> Structure | None:
    """Return the structure in the coordinates of its modes: M = I, K = diag(ω²), C = diag(α + β ω²).

    None where damping is not α M + β K, where a motion has no mass, or where there are too many degrees of freedom.
    """
    if not 0 < structure.size <= LARGEST_SIZE or not structure.mass.diagonal().all():
        return None
    rates = _rates(structure)
    if rates is None:
        return None
    mass = structure.mass.toarray()
    try:
        inverse, vectors = eigh(mass, structure.stiffness.toarray() + SHIFT * mass)
    except LinAlgError:  # some motion has neither mass nor stiffness
        return None
    if inverse[0] <= MASSLESS * inverse[-1]:
        return None
    square = np.maximum(1.0 / inverse - SHIFT, 0.0)
    damping = rates[0] + rates[1] * square
    return Structure(
        sparse.csr_array(sparse.eye_array(square.size)),
        sparse.csr_array(sparse.diags_array(square)),
        sparse.csr_array(sparse.diags_array(damping)) if damping.any() else None,
        (vectors / np.sqrt(inverse)).T @ structure.contact,
        structure.flexibility,
        structure.surface,
        structure.origin,
        structure.valid_until,
    )


def _rates(structure: Structure) -> Vector | None:
    """Return α (1/s) and β (s) of C = α M + β K; None where C is no such sum."""
    if structure.damping is None:
        return np.zeros(2)
    # Rows and columns are scaled, because rotations and displacements have different units.
    scale = sparse.diags_array(1.0 / np.sqrt(structure.stiffness.diagonal() + SHIFT * structure.mass.diagonal()))
    mass, stiffness, damping = (
        scale @ matrix @ scale for matrix in (structure.mass, structure.stiffness, structure.damping)
    )
    sizes = np.array([max(sparse.linalg.norm(matrix), np.finfo(float).tiny) for matrix in (mass, stiffness)])
    pairs = [mass / sizes[0], stiffness / sizes[1]]
    products = np.array([[(left * right).sum() for right in pairs] for left in pairs])
    # Where damping falls with the frequency, β would be negative: such a sum is refused by what is left of it.
    rates = np.maximum(np.linalg.lstsq(products, [(left * damping).sum() for left in pairs], rcond=None)[0], 0.0)
    rest = damping - rates[0] * pairs[0] - rates[1] * pairs[1]
    if sparse.linalg.norm(rest) > PROPORTIONAL * sparse.linalg.norm(damping):
        return None
    result: Vector = rates / sizes
    return result
