"""One time window of a linear structure under its mean force: implicit midpoint, or oscillators in closed form.

A structure is linear. So its state at the end of a window is the state without force plus the mean force times a vector
known in advance. A strong coupling therefore needs one structural solve in each window, for any contact law.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, eigh

from structures.linear_algebra.factor import factorise
from structures.structure import Structure, Vector, oscillators

# The largest number of degrees of freedom for which a structure moves in its modes. It takes 0.1 s to find 600 modes,
# and the time grows with the third power. Without modes a run of 1 ms takes 0.5 s or more.
LARGEST_SIZE = 600

# 1/s². Modes are found from 1/(ω² + SHIFT), so that the slow ones are accurate: steel beads excite 35 kHz or less.
SHIFT = (2.0 * np.pi * 35e3) ** 2


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
    >>> moving = hl.stepping.MovingStructure(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)], elements=4))
    >>> moving.start().displacement.size == moving.structure.size
    True
    """

    displacement: Vector
    velocity: Vector


class ImplicitMidpoint:
    """M (v₁ − v₀)/H = F̄ b − K (u₀ + u₁)/2 − C (v₀ + v₁)/2, u₁ = u₀ + H (v₀ + v₁)/2; it conserves energy exactly.

    structure: a Structure, or an object with dense matrices. response: the states after 1 N from rest at each of the K
    contacts, n × K.
    """

    def __init__(self, structure: Any, window: float) -> None:
        matrix = structure.mass + window**2 / 4.0 * structure.stiffness
        if structure.damping is not None:
            matrix = matrix + window / 2.0 * structure.damping
        self.structure, self.window, self.solve = structure, window, factorise(matrix)
        unit = np.column_stack([self.solve(column) for column in np.ascontiguousarray(structure.contact_vectors.T)])
        self.response = StructureState(window**2 / 2.0 * unit, window * unit)

    def free(self, state: StructureState) -> StructureState:
        """Return the state at the end of the window without force."""
        u, v = state
        middle = self.solve(self.structure.mass @ v - self.window / 2.0 * (self.structure.stiffness @ u))
        return StructureState(u + self.window * middle, 2.0 * middle - v)


class OscillatorStep:
    """A structure with M = I and diagonal K and C: one oscillator for each degree of freedom.

    Slow oscillators, ω H ≤ 1, move exactly if `exact`. Fast ones use the implicit midpoint, because their exact motion,
    sampled once a window, would appear as a slow one (aliasing). Both conserve energy: the work F̄ (w₁ − w₀) equals the
    energy that the structure gains plus the energy that C dissipates. rows: 4 × n, the propagator of each oscillator,
    u₁ = r₀ u + r₁ v and v₁ = r₂ u + r₃ v.
    """

    def __init__(self, structure: Structure, window: float, exact: bool = True) -> None:
        square = structure.stiffness.diagonal()
        rate = np.zeros_like(square) if structure.damping is None else structure.damping.diagonal()
        self.square = square
        phase, drag = window**2 * square, window / 2.0 * rate
        fast = phase > (1.0 if exact else -1.0)
        lag, push, left = np.empty_like(phase), np.empty_like(phase), np.empty_like(phase)
        lag[~fast], push[~fast], left[~fast] = _exact(phase[~fast], drag[~fast])
        # The implicit midpoint is stable for any ωH and conserves the energy of undamped oscillators.
        push[fast] = 1.0 / (1.0 + drag[fast] + phase[fast] / 4.0)
        lag[fast], left[fast] = push[fast] / 2.0, 2.0 * push[fast] - 1.0
        # The midpoint keeps equal fractions of u and v without damping; the form 1 − phase · lag would lose digits.
        decay = np.where(fast, left + 2.0 * drag * push, 1.0 - phase * lag)
        self.rows = np.array([decay, window * push, -window * square * push, left])
        vectors = structure.contact_vectors
        self.response = StructureState((window**2 * lag)[:, None] * vectors, (window * push)[:, None] * vectors)

    def free(self, state: StructureState) -> StructureState:
        """Return the state at the end of the window without force."""
        u, v = state
        return StructureState(self.rows[0] * u + self.rows[1] * v, self.rows[2] * u + self.rows[3] * v)


def _exact(phase: Vector, drag: Vector) -> tuple[Vector, Vector, Vector]:
    """Return the displacement after a constant unit force, in H², its velocity, in H, and the decay of a velocity.

    phase: (ωH)² ≤ 1 of oscillators over a window H. drag: H/2 times their damping rates.
    """
    if not drag.any():
        half = 0.5 * np.sqrt(phase) / np.pi
        lag = 0.5 * np.sinc(half) ** 2
        return lag, np.sinc(2.0 * half), 1.0 - phase * lag
    spread = np.sqrt(np.maximum(drag**2 - phase, 0.0))
    # With λ = −drag ± spread, Σ hₖ/(k + 1)! and Σ hₖ/(k + 2)!, hₖ = Σ λ₁ⁱ λ₂ᵏ⁻ⁱ: no cancellation near critical damping.
    lag, push = np.zeros_like(phase), np.zeros_like(phase)
    term, before, factorial = np.ones_like(phase), np.zeros_like(phase), 1.0
    # If the two rates are far apart, the motion is a sum of two exponentials; otherwise 24 terms are exact.
    apart = spread > 0.5
    near = np.where(apart, 0.0, drag)
    for k in range(24):
        push += term / factorial
        factorial *= k + 2.0
        lag += term / factorial
        term, before = -2.0 * near * term - phase * before, term
    left = 1.0 - phase * lag - 2.0 * near * push
    if apart.any():
        phase, drag, spread = phase[apart], drag[apart], spread[apart]
        slow, fast = -phase / (drag + spread), -(drag + spread)
        push[apart] = np.exp(slow) * -np.expm1(-2.0 * spread) / (2.0 * spread)
        steady = np.divide(np.expm1(slow), slow, out=np.ones_like(slow), where=slow != 0.0)
        lag[apart] = (steady - np.expm1(fast) / fast) / (2.0 * spread)
        left[apart] = (slow * np.exp(slow) - fast * np.exp(fast)) / (2.0 * spread)
    return lag, push, left


def modes_of(structure: Structure) -> Structure | None:
    """Return the structure in the coordinates of its modes: M = I, K = diag(ω²), C = diag(α + β ω²).

    Return None if damping is not α M + β K, if a motion has no mass, or if there are too many degrees of freedom.
    """
    if not 0 < structure.size <= LARGEST_SIZE or not structure.mass.diagonal().all():
        return None
    rates = np.zeros(2)
    if structure.damping is not None:
        scale = 1.0 / np.sqrt(structure.stiffness.diagonal() + SHIFT * structure.mass.diagonal())
        found = rayleigh_rates(structure.damping, structure.mass, structure.stiffness, scale)
        if found is None:
            return None
        rates = found
    mass = structure.mass.toarray()
    try:
        inverse, vectors = eigh(mass, structure.stiffness.toarray() + SHIFT * mass)
    except LinAlgError:  # a motion has neither mass nor stiffness
        return None
    if inverse[0] <= 1e-12 * inverse[-1]:  # a mode without mass
        return None
    square = np.maximum(1.0 / inverse - SHIFT, 0.0)
    damping = rates[0] + rates[1] * square
    contact = (vectors / np.sqrt(inverse)).T @ structure.contact
    rest = structure.flexibility, structure.surface, structure.origin, structure.valid_until
    return oscillators(square, damping if damping.any() else None, contact, *rest)


def rayleigh_rates(damping: Any, mass: Any, stiffness: Any, scale: Vector) -> Vector | None:
    """Return α ≥ 0 (1/s) and β ≥ 0 (s) of C = α M + β K, or None if C is not such a sum.

    scale: a scale for each degree of freedom, because displacements and rotations have different units.
    """
    # Matrices or linear operators are compared by their products with three random vectors.
    by = scale[:, None]
    probe = by * np.random.default_rng(0).normal(size=(scale.size, 3))
    units = np.column_stack([(by * (matrix @ probe)).ravel() for matrix in (mass, stiffness)])
    image = (by * (damping @ probe)).ravel()
    sizes = np.maximum(np.linalg.norm(units, axis=0), np.finfo(float).tiny)
    rates: Vector = np.maximum(np.linalg.lstsq(units / sizes, image, rcond=None)[0], 0.0) / sizes
    off = np.linalg.norm(units @ rates - image)
    return rates if off <= 1e-11 * np.linalg.norm(image) else None
