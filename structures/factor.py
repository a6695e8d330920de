"""One sparse symmetric factorisation, scaled, kept as long as the matrix that it belongs to."""

import weakref
from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from structures.structure import Structure, Vector

Solve = Callable[[Vector], Vector]


def factorise(matrix: sparse.sparray) -> Solve:
    """A function that solves matrix · x = y, for a symmetric positive definite matrix.

    Rows and columns are scaled by 1/√diagonal first, since Hermite degrees of freedom mix units.
    """
    scale = 1.0 / np.sqrt(matrix.diagonal())
    scaled = sparse.csc_array(sparse.diags_array(scale) @ matrix @ sparse.diags_array(scale))
    factor = splu(scaled, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def solve(right: Vector) -> Vector:
        solution: Vector = scale * factor.solve(scale * right)
        return solution

    return solve


def shifted_solve(structure: Structure, shift: float) -> Solve:
    """Solves (K + shift² M) x = y, shift in 1/s; structures that share a mesh share the factorisation.

    The factorisation is kept while the stiffness matrix lives.
    """
    key = (id(structure.stiffness), id(structure.mass), shift)
    if key not in _kept:
        _kept[key] = factorise(structure.stiffness + shift**2 * structure.mass)
        weakref.finalize(structure.stiffness, _kept.pop, key, None)
    return _kept[key]


_kept: dict[tuple[int, int, float], Solve] = {}
