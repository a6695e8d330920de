"""One time window of a linear structure by the implicit midpoint, driven by the mean force over the window.

A structure is linear, so its state at the end of a window is the state without force plus the mean force times a vector
that is known in advance. A strong coupling therefore needs one structural solve in each window, for any contact law.
"""

from typing import NamedTuple

import numpy as np

from structures.linear_algebra.factor import factorise
from structures.structure import Structure, Vector

SHORTEST_WINDOW, LONGEST_WINDOW = 1e-18, 1e6
"""s. Squares of windows beyond these, times a stiffness, leave the range of floating point."""


class StructureState(NamedTuple):
    """The state of a structure, measured from static equilibrium.

    Parameters
    ----------
    displacement : ndarray
        The n degrees of freedom, m.
    velocity : ndarray
        Their n velocities, m/s.

    Examples
    --------
    >>> import hertzlink as hl
    >>> moving = hl.stepping.MovingStructure(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)], elements=4))
    >>> moving.start().displacement.size == moving.structure.size
    True
    """

    displacement: Vector
    velocity: Vector


def energies(structure: Structure, state: StructureState) -> tuple[float, float]:
    """Return the kinetic and elastic energy ½ vᵀM v and ½ uᵀK u above static equilibrium, J."""
    u, v = state
    return 0.5 * float(v @ (structure.mass @ v)), 0.5 * float(u @ (structure.stiffness @ u))


class DenseMatrices(NamedTuple):
    """The matrices of a small structure, as dense ones."""

    mass: Vector
    stiffness: Vector
    damping: Vector | None
    contact_vectors: Vector


class ImplicitMidpoint:
    """M (v₁ − v₀)/H = F̄ b − K (u₀ + u₁)/2 − C (v₀ + v₁)/2, u₁ = u₀ + H (v₀ + v₁)/2; one factorisation.

    Second order. It conserves energy exactly: the work F̄ (w₁ − w₀) equals the energy that the structure gains plus the
    energy that C dissipates. response: the states after 1 N from rest at each of the K contacts, n × K.
    """

    def __init__(self, structure: Structure | DenseMatrices, window: float) -> None:
        matrix = structure.mass + window**2 / 4.0 * structure.stiffness
        if structure.damping is not None:
            matrix = matrix + window / 2.0 * structure.damping
        self.structure, self.window, self.solve = structure, window, factorise(matrix)
        unit = np.column_stack([self.solve(column) for column in np.ascontiguousarray(structure.contact_vectors.T)])
        self.response = StructureState(window**2 / 2.0 * unit, window * unit)

    def free(self, state: StructureState) -> StructureState:
        """The state at the window's end where no force acts."""
        u, v = state
        middle = self.solve(self.structure.mass @ v - self.window / 2.0 * (self.structure.stiffness @ u))
        return StructureState(u + self.window * middle, 2.0 * middle - v)
