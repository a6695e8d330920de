"""Structures whose degrees of freedom are modes, as after a reduction: each oscillator moves in closed form."""

import numpy as np

from structures.stepping import StructureState
from structures.structure import Structure, Vector


class OscillatorStep:
    """A structure with M = I and diagonal K and C, one oscillator for each degree of freedom.

    Slow oscillators, ω H ≤ 1, move exactly if `exact`. Fast ones use the implicit midpoint: sampled once a window,
    their exact motion would appear as a slow one (aliasing). Both conserve energy: the work F̄ (w₁ − w₀) equals the
    energy that the structure gains plus the energy that C dissipates. rows: 4 × n, the propagator of each oscillator:
    u₁ = r₀ u + r₁ v, v₁ = r₂ u + r₃ v.
    """

    def __init__(self, structure: Structure, window: float, exact: bool = True) -> None:
        square = structure.stiffness.diagonal()
        rate = np.zeros_like(square) if structure.damping is None else structure.damping.diagonal()
        self.square = square
        phase, drag = window**2 * square, window / 2.0 * rate
        fast = phase > (1.0 if exact else -1.0)
        lag, push, left = np.empty_like(phase), np.empty_like(phase), np.empty_like(phase)
        lag[~fast], push[~fast], left[~fast] = _exact(phase[~fast], drag[~fast])
        # The implicit midpoint is stable for any ωH and conserves the energy of undamped oscillators, which no window
        # resolves.
        push[fast] = 1.0 / (1.0 + drag[fast] + phase[fast] / 4.0)
        lag[fast], left[fast] = push[fast] / 2.0, 2.0 * push[fast] - 1.0
        # Without damping the midpoint keeps equal fractions of u and v; the form 1 − phase · lag would lose digits.
        decay = np.where(fast, left + 2.0 * drag * push, 1.0 - phase * lag)
        self.rows = np.array([decay, window * push, -window * square * push, left])
        vectors = structure.contact_vectors
        self.response = StructureState((window**2 * lag)[:, None] * vectors, (window * push)[:, None] * vectors)

    def free(self, state: StructureState) -> StructureState:
        """The state at the end of the window if no force acts."""
        u, v = state
        return StructureState(self.rows[0] * u + self.rows[1] * v, self.rows[2] * u + self.rows[3] * v)


def _exact(phase: Vector, drag: Vector) -> tuple[Vector, Vector, Vector]:
    """Return the displacement after a constant unit force, in H², its velocity, in H, and what remains of a velocity.

    phase: (ωH)² ≤ 1 of oscillators over a window H. drag: H/2 times their rates.
    """
    if not drag.any():
        half = 0.5 * np.sqrt(phase) / np.pi
        lag = 0.5 * np.sinc(half) ** 2
        return lag, np.sinc(2.0 * half), 1.0 - phase * lag
    spread = np.sqrt(np.maximum(drag**2 - phase, 0.0))
    # With λ = −drag ± spread, Σ hₖ/(k + 1)! and Σ hₖ/(k + 2)!, hₖ = Σ λ₁ⁱ λ₂ᵏ⁻ⁱ: no cancellation near critical damping.
    lag, push = np.zeros_like(phase), np.zeros_like(phase)
    term, before, factorial = np.ones_like(phase), np.zeros_like(phase), 1.0
    # Where the two rates are far apart the motion is a sum of two exponentials; elsewhere 24 terms are exact.
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
