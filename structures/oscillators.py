"""Structures whose degrees of freedom are modes, as reduced ones are: each oscillator moves exactly, in closed form."""

import numpy as np
from scipy import sparse

from structures.stepping import StructureState, equal
from structures.structure import Structure, Vector

APART, TERMS = 0.5, 24
"""Overdamped oscillators whose two rates, times the window, differ by twice this are sums of two exponentials; of the
others, so many terms of a series are exact to rounding."""


def is_modal(structure: Structure) -> bool:
    """Whether the degrees of freedom are modes: M = I, K and C diagonal."""
    identity = sparse.eye_array(structure.size)
    others = [structure.stiffness] + ([] if structure.damping is None else [structure.damping])
    return equal(structure.mass, identity) and all(equal(m, sparse.diags_array(m.diagonal())) for m in others)


class Oscillators:
    """A structure with M = I and diagonal K and C, one oscillator for each degree of freedom.

    Slow ones, ω H ≤ 1, move exactly. Fast ones take the implicit midpoint: seen once a window, their exact motion
    would pose as a slow one, and one with a period of H would not be seen at all. Both keep the energy: the work
    F̄ (w₁ − w₀) is what the structure gains and C takes.
    rows: 4 × n, each oscillator's 2 × 2 propagator: u₁ = r₀ u + r₁ v, v₁ = r₂ u + r₃ v. No limit on the window.
    """

    def __init__(self, structure: Structure, window: float) -> None:
        square = structure.stiffness.diagonal()
        rate = np.zeros_like(square) if structure.damping is None else structure.damping.diagonal()
        phase, drag = window**2 * square, window / 2.0 * rate
        fast = phase > 1.0
        lag, push, left = np.empty_like(phase), np.empty_like(phase), np.empty_like(phase)
        lag[~fast], push[~fast], left[~fast] = _exact(phase[~fast], drag[~fast])
        push[fast] = 1.0 / (1.0 + drag[fast] + phase[fast] / 4.0)
        lag[fast], left[fast] = push[fast] / 2.0, 2.0 * push[fast] - 1.0
        # The midpoint leaves as large a part of u as of v but for the damping; 1 − phase · lag would cancel.
        kept = np.where(fast, left + 2.0 * drag * push, 1.0 - phase * lag)
        self.rows = np.array([kept, window * push, -window * square * push, left])
        self.window, self.square, self.rate, self.fast, self.push = window, square, rate, fast, window * push
        lag, push = (x if structure.contacts == 1 else x[:, None] for x in (lag, push))
        self.response = StructureState(window**2 * lag * structure.contact, window * push * structure.contact)

    def free(self, state: StructureState) -> StructureState:
        """The state at the window's end where no force acts."""
        u, v, _ = state
        return StructureState(self.rows[0] * u + self.rows[1] * v, self.rows[2] * u + self.rows[3] * v)

    def energies(self, state: StructureState, load: Vector) -> tuple[float, float]:
        """Kinetic and elastic, J."""
        u, v, _ = state
        return 0.5 * float(v @ v), 0.5 * float(u @ (self.square * u))

    def dissipated(self, before: StructureState, after: StructureState) -> float:
        """What damping took between two states a window apart, J, under forces that were steady in it.

        Of slow oscillators their force's work less their gain, of fast ones H c v̄²; exact, to rounding of the energy.
        """
        (u, v, _), (end_u, end_v, _) = before, after
        force = (end_v - self.rows[2] * u - self.rows[3] * v) / self.push
        gain = 0.5 * ((end_v - v) * (end_v + v) + self.square * (end_u - u) * (end_u + u))
        fast = 0.25 * self.window * self.rate * (v + end_v) ** 2
        taken = np.where(self.fast, fast, force * (end_u - u) - gain)
        return float(taken[self.rate > 0.0].sum())


def _exact(phase: Vector, drag: Vector) -> tuple[Vector, Vector, Vector]:
    """Of oscillators over a window H, with phase (ωH)² ≤ 1 and drag H/2 times the damping rate.

    Returns the displacement after a steady unit force in units of H², its rate in units of H, and what is left of an
    initial rate. In closed form: a matrix exponential of each is slower, and its threads wait for each other.
    """
    spread = np.sqrt(np.maximum(drag**2 - phase, 0.0))
    # With λ = −drag ± spread, Σ hₖ/(k + 1)! and Σ hₖ/(k + 2)!, hₖ = Σ λ₁ⁱ λ₂ᵏ⁻ⁱ: no cancellation near critical damping.
    lag, push = np.zeros_like(phase), np.zeros_like(phase)
    term, before, factorial = np.ones_like(phase), np.zeros_like(phase), 1.0
    near = np.where(spread <= APART, drag, 0.0)
    for k in range(TERMS):
        push += term / factorial
        factorial *= k + 2.0
        lag += term / factorial
        term, before = -2.0 * near * term - phase * before, term
    left = 1.0 - phase * lag - 2.0 * near * push
    if (spread > APART).any():
        apart, drag = spread > APART, drag[spread > APART]
        phase, spread = phase[apart], spread[apart]
        slow, fast = -phase / (drag + spread), -(drag + spread)
        push[apart] = np.exp(slow) * -np.expm1(-2.0 * spread) / (2.0 * spread)
        steady = np.divide(np.expm1(slow), slow, out=np.ones_like(slow), where=slow != 0.0)
        lag[apart] = (steady - np.expm1(fast) / fast) / (2.0 * spread)
        left[apart] = (slow * np.exp(slow) - fast * np.exp(fast)) / (2.0 * spread)
    return lag, push, left
