"""Structures in time: state in, state out, driven by the mean force over a window.

Because a structure is linear, the state at a window's end is the state without force plus the mean force times a
vector known beforehand. So a strong coupling needs one structural solve a window, whatever the contact does.
"""

from typing import NamedTuple, Protocol

import numpy as np
from scipy import sparse
from scipy.linalg import expm

from structures.checks import positive
from structures.factor import factorise
from structures.structure import Structure, Vector
from structures.surface import Surface


class StructureState(NamedTuple):
    """Degrees of freedom u and their rates, measured from static equilibrium."""

    displacement: Vector
    velocity: Vector


class Step(Protocol):
    """One window of a linear structure: end state = free(state) + mean force · response."""

    response: StructureState

    def free(self, state: StructureState) -> StructureState:
        """The state at the window's end where no force acts."""
        ...


class ImplicitMidpoint:
    """M (v₁ − v₀)/H = F̄ b − K (u₀ + u₁)/2 − C (v₀ + v₁)/2, u₁ = u₀ + H (v₀ + v₁)/2; one factorisation.

    Second order, and keeps the energy exactly: the work F̄ (w₁ − w₀) is what the structure gains and C takes.
    """

    def __init__(self, structure: Structure, window: float) -> None:
        matrix = structure.mass + window**2 / 4.0 * structure.stiffness
        if structure.damping is not None:
            matrix = matrix + window / 2.0 * structure.damping
        self.structure, self.window, self.solve = structure, window, factorise(matrix)
        unit = self.solve(structure.contact)
        self.response = StructureState(window**2 / 2.0 * unit, window * unit)

    def free(self, state: StructureState) -> StructureState:
        """The state at the window's end where no force acts."""
        u, v = state
        middle = self.solve(self.structure.mass @ v - self.window / 2.0 * (self.structure.stiffness @ u))
        return StructureState(u + self.window * middle, 2.0 * middle - v)


class Oscillators:
    """A structure with M = I and diagonal K and C, one oscillator for each degree of freedom.

    Slow ones, ω H ≤ 1, move exactly. Fast ones take the implicit midpoint: seen once a window, their exact motion
    would pose as a slow one, and one with a period of H would not be seen at all. Both keep the energy.
    rows: 4 × n, each oscillator's 2 × 2 propagator: u₁ = r₀ u + r₁ v, v₁ = r₂ u + r₃ v. No limit on the window.
    """

    def __init__(self, structure: Structure, window: float) -> None:
        square = structure.stiffness.diagonal()
        rate = np.zeros_like(square) if structure.damping is None else structure.damping.diagonal()
        generator = np.zeros((structure.size, 3, 3))
        generator[:, 0, 1] = window
        generator[:, 1, 0] = -window * square
        generator[:, 1, 1] = -window * rate
        generator[:, 1, 2] = window * structure.contact
        fast = square * window**2 > 1.0
        whole = np.empty_like(generator)
        whole[~fast] = expm(generator[~fast])
        half, identity = generator[fast] / 2.0, np.eye(3)
        whole[fast] = np.linalg.solve(identity - half, identity + half)
        self.rows = np.ascontiguousarray(whole[:, :2, :2].reshape(-1, 4).T)
        self.response = StructureState(whole[:, 0, 2].copy(), whole[:, 1, 2].copy())

    def free(self, state: StructureState) -> StructureState:
        """The state at the window's end where no force acts."""
        u, v = state
        return StructureState(self.rows[0] * u + self.rows[1] * v, self.rows[2] * u + self.rows[3] * v)


class MovingStructure:
    """A Structure as a participant: advance(state, mean force, window) → (state, displacement of the contact)."""

    def __init__(self, structure: Structure) -> None:
        self.structure = structure
        self._steps: dict[float, Step] = {}

    @property
    def surface(self) -> Surface:
        """What Hertz's law needs to know of the contact point."""
        return self.structure.surface

    @property
    def conservative(self) -> bool:
        """Whether the structure keeps all the energy that it is given."""
        return self.structure.damping is None

    def start(self) -> StructureState:
        """At rest in static equilibrium."""
        return StructureState(np.zeros(self.structure.size), np.zeros(self.structure.size))

    def advance(self, state: StructureState, force: float, window: float) -> tuple[StructureState, float]:
        """Move on by one window (s) under the mean force (N) above the static one."""
        end = self.pushed(self.free(state, window), force, window)
        return end, self.read(end)

    def pushed(self, free: StructureState, force: float, window: float) -> StructureState:
        """The state at the window's end from that without force, and the mean force."""
        if not self.structure.size:
            return free
        response = self.step(window).response
        return StructureState(
            free.displacement + force * response.displacement, free.velocity + force * response.velocity
        )

    def free(self, state: StructureState, window: float) -> StructureState:
        """The state at the window's end where no force acts."""
        return self.step(window).free(state) if self.structure.size else state

    def read(self, state: StructureState) -> float:
        """Displacement bᵀu of the contact point, m."""
        return float(self.structure.contact @ state.displacement)

    def compliance(self, window: float) -> float:
        """What 1 N of mean force adds to the contact's displacement at the window's end, m/N."""
        return self.read(self.step(window).response) if self.structure.size else 0.0

    def energy(self, state: StructureState) -> float:
        """Kinetic and elastic energy above static equilibrium, J."""
        u, v = state
        return 0.5 * float(v @ (self.structure.mass @ v) + u @ (self.structure.stiffness @ u))

    def step(self, window: float) -> Step:
        """The stepper for this window, made once."""
        if window not in self._steps:
            positive("window", window, "s")
            make = Oscillators if is_modal(self.structure) else ImplicitMidpoint
            self._steps[window] = make(self.structure, window)
        return self._steps[window]


def is_modal(structure: Structure) -> bool:
    """Whether the degrees of freedom are modes: M = I, K and C diagonal."""
    identity = sparse.eye_array(structure.size)
    others = [structure.stiffness] + ([] if structure.damping is None else [structure.damping])
    return _equal(structure.mass, identity) and all(_equal(m, sparse.diags_array(m.diagonal())) for m in others)


def _equal(first: sparse.sparray, second: sparse.sparray) -> bool:
    difference = abs(first - second)
    return bool(difference.nnz == 0 or difference.max() == 0.0)
