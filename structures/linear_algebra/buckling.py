"""The load at which a structure buckles: where its stiffness and that of a prestress are singular together."""

from math import inf
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigsh, splu

from structures.caution import caution
from structures.linear_algebra.symmetric import has_positive_pivots

LEAST, MOST = 1e-6, 1e6
"""Range in which a factor is sought by halving; a larger one counts as infinite."""

PRECISION = 1e-6
"""Relative error of a factor that is found by halving."""

RESOLVED = 1e-10
"""Part of the strongest eigenvalue, of tension, below which rounding leaves fewer than six digits of another one."""

RIGID = 1e-13
"""Energy of a motion over that of its parts, below which nothing bends: rounding leaves 6e-16 or less, and a beam of
240 elements that buckles has 1e-10."""


NEAR = 1.05
"""Below this factor deflections are 20 times those without prestress, and depend on errors of it by as much."""


def check_buckling(factor: float, what: str, refused: str) -> None:
    """Raise a ValueError, refused, for a factor up to 1, and warn where the structure is near to buckling."""
    if factor <= 1.0:
        raise ValueError(refused)
    if factor < NEAR:
        caution(f"{what}: buckles at {factor:.5g} times this; small errors of the load change results much")


def buckling_factor(mass: Any, stiffness: Any, more: Any, ground: float) -> float:
    """Return the least positive factor λ at which K + λ G is singular, inf where there is none.

    stiffness: K without prestress, more: G, the stiffness of the prestress. ground: a frequency squared, 1/s², far
    below all others; ground · M makes K regular.
    """
    base = sparse.csc_array(stiffness + ground * mass)
    # Deflections and slopes differ by units of length; unit diagonals keep the digits.
    scale = sparse.diags_array(1.0 / np.sqrt(base.diagonal()))
    base, opposite = sparse.csc_array(scale @ base @ scale), sparse.csc_array(scale @ -more @ scale)
    solve = LinearOperator(base.shape, matvec=splu(base).solve, dtype=float)
    start = np.random.default_rng(0).normal(size=base.shape[0])
    try:
        values, modes = eigsh(opposite, 1, M=base, Minv=solve, which="LA", v0=start)
        strongest = eigsh(opposite, 1, M=base, Minv=solve, which="LM", v0=start, tol=0.01, return_eigenvectors=False)
    except ArpackNoConvergence:
        # Tension in one direction stiffens by orders more than the little compression in another one softens.
        return _by_pivots(base, opposite)
    except ArpackError:
        # Earlier versions of ARPACK fail where one motion is softer than all others by ten orders: one that only the
        # weak ground holds.
        return 0.0
    rounding = RESOLVED * abs(float(strongest[0]))
    if values[0] < rounding and rounding > 1.0 / MOST:
        return _by_pivots(base, opposite)
    if values[0] <= 0.0:
        return inf
    mode = modes[:, 0]
    # All springs of the scaled matrix are one: a motion that bends none has nothing but their rounding.
    rigid = float(mode @ (base @ mode)) < RIGID * float(mode @ mode)
    return 0.0 if rigid else 1.0 / float(values[0])


def _by_pivots(base: Any, opposite: Any) -> float:
    """Return the least load λ at which base − λ · opposite is not positive definite, by halving: it is at all smaller
    ones."""
    if has_positive_pivots(base - MOST * opposite):
        return inf
    low, high = LEAST, MOST
    while high > (1.0 + PRECISION) * low:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if has_positive_pivots(base - middle * opposite) else (low, middle)
    return high
