"""Steppers: one time window of a linear structure, driven by the mean force over the window.

A structure is linear, so its state at the end of a window is the state without force plus the mean force times a vector
that is known in advance. A strong coupling therefore needs one structural solve in each window, for any contact law.
"""

from collections.abc import Callable
from dataclasses import replace
from math import ceil, sqrt
from typing import Annotated, NamedTuple, Protocol, TypeAlias

import numpy as np
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator, eigsh

from structures.checks import instance
from structures.described import described
from structures.linear_algebra.factor import Solve, factorise
from structures.quantities import Quantity, Several
from structures.structure import Structure, Vector

NO_MEMORY = np.zeros(0)

SHORTEST_WINDOW, LONGEST_WINDOW = 1e-18, 1e6
"""s. Squares of windows beyond these, times a stiffness, leave the range of floating point."""

Window = Annotated[float, Quantity("s", "a time", "1 us", SHORTEST_WINDOW, LONGEST_WINDOW)]

MOST_STEPS = 1_000_000
"""Explicit steps in one window: half a minute. Windows in use have one or two."""

DEFAULT_STABLE_FRACTION = 0.9
"""The fraction of the longest stable step that central differences take by default."""

FULL_SPECTRUM_SIZE = 50
"""Up to this number of degrees of freedom all frequencies are computed, even if only the highest is needed."""

STATIC_SHIFT = 1e-12
"""Shift of the inverse iteration for the slowest motion, in units of the largest ratio of stiffness to mass."""

INVERSE_ITERATIONS = 8
"""Each iteration reduces the share of the other motions by the squared ratio of the frequencies: eight are plenty."""


class StructureState(NamedTuple):
    """The state of a structure, measured from static equilibrium.

    Parameters
    ----------
    displacement : ndarray
        The n degrees of freedom, m.
    velocity : ndarray
        Their n velocities, m/s.
    memory : ndarray
        What generalised-α needs in addition, its accelerations and the last mean forces; empty for other steppers.

    Examples
    --------
    >>> import hertzlink as hl
    >>> moving = hl.stepping.MovingStructure(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)], elements=4))
    >>> moving.start().displacement.size == moving.structure.size
    True
    """

    displacement: Vector
    velocity: Vector
    memory: Vector = NO_MEMORY


class Step(Protocol):
    """One window of a linear structure: end state = free(state) + mean force · response.

    A stepper is a function (structure, window) → Step; `MovingStructure(structure, stepper)` takes it. A Step may also
    have energies(state, load): kinetic and elastic energy, J, in the form that the stepper conserves. Otherwise the
    energies of the structure are used.

    Attributes
    ----------
    response : StructureState
        The state after 1 N from rest at each of the K contacts, n × K; for one contact n numbers will do.

    Examples
    --------
    A stepper of one's own, the symplectic Euler method:

    >>> import hertzlink as hl
    >>> from scipy.sparse.linalg import splu
    >>> class SymplecticEuler:
    ...     def __init__(self, structure, window):
    ...         self.structure, self.window, self.solve = structure, window, splu(structure.mass.tocsc()).solve
    ...         push = self.solve(structure.contact)
    ...         self.response = hl.stepping.StructureState(window**2 * push, window * push)
    ...
    ...     def free(self, state):
    ...         v = state.velocity - self.window * self.solve(self.structure.stiffness @ state.displacement)
    ...         return hl.stepping.StructureState(state.displacement + self.window * v, v)
    >>> rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=1e-4)
    >>> moving = hl.stepping.MovingStructure(rod, stepper=SymplecticEuler)
    >>> state, place = moving.advance(moving.start(), 1.0, window=1e-8)
    >>> place > 0.0
    True
    """

    response: StructureState

    def free(self, state: StructureState) -> StructureState:
        """The state at the end of the window if no force acts."""
        ...


def energies(structure: Structure, state: StructureState) -> tuple[float, float]:
    """Return the kinetic and elastic energy ½ vᵀM v and ½ uᵀK u above static equilibrium, J."""
    u, v, _ = state
    return 0.5 * float(v @ (structure.mass @ v)), 0.5 * float(u @ (structure.stiffness @ u))


Stepper: TypeAlias = Callable[[Structure, float], Step]
"""A function that makes the Step of a structure for a window, s."""


class DenseMatrices(NamedTuple):
    """The matrices of a small structure, as dense ones."""

    mass: Vector
    stiffness: Vector
    damping: Vector | None
    contact_vectors: Vector


class ImplicitMidpoint:
    """M (v₁ − v₀)/H = F̄ b − K (u₀ + u₁)/2 − C (v₀ + v₁)/2, u₁ = u₀ + H (v₀ + v₁)/2; one factorisation.

    Second order. It conserves energy exactly: the work F̄ (w₁ − w₀) equals the energy that the structure gains plus the
    energy that C dissipates.
    """

    def __init__(self, structure: Structure | DenseMatrices, window: float) -> None:
        matrix = structure.mass + window**2 / 4.0 * structure.stiffness
        if structure.damping is not None:
            matrix = matrix + window / 2.0 * structure.damping
        self.structure, self.window, self.solve = structure, window, factorise(matrix)
        unit = _of_each(self.solve, structure.contact_vectors)
        self.response = StructureState(window**2 / 2.0 * unit, window * unit)

    def free(self, state: StructureState) -> StructureState:
        """The state at the window's end where no force acts."""
        u, v, _ = state
        middle = self.solve(self.structure.mass @ v - self.window / 2.0 * (self.structure.stiffness @ u))
        return StructureState(u + self.window * middle, 2.0 * middle - v)


@described
class Newmark:
    """Newmark's method, driven by the mean force F̄ from the beginning to the end of the window.

    M a₀ = F̄ b − C v₀ − K u₀, and a₁ in the same way; u₁ = u₀ + H v₀ + H² [(½ − β) a₀ + β a₁], v₁ = v₀ + H [(1 − γ) a₀
    + γ a₁]. The order is two for γ = ½ and one for larger γ, which damps fast motions. β = ¼, γ = ½ (mean acceleration)
    is equivalent to the implicit midpoint, so it conserves the work as well; other constants do so to second or first
    order in H only. Without force and damping, γ = ½ conserves the energy of `energies`. With 2β < γ the method is
    stable for windows below 1/(ω √(γ/2 − β)), where ω is the highest frequency.

    Parameters
    ----------
    structure : Structure
        The structure to move.
    window : float
        Length H of the window, s.
    beta : float
        β, zero or more.
    gamma : float
        γ, ½ or more.

    Raises
    ------
    ValueError
        If γ < ½, the window exceeds the stability limit, or a mass is not positive, as in Maxwell arms.

    References
    ----------
    Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67.

    Examples
    --------
    >>> import hertzlink as hl
    >>> from functools import partial
    >>> bar = hl.rod([hl.Layer(hl.STEEL_440C, length=25.4e-3, radius=9.525e-3)])
    >>> moving = hl.stepping.MovingStructure(bar, stepper=partial(hl.stepping.Newmark, beta=0.25, gamma=0.5))
    >>> state, displacement = moving.advance(moving.start(), 10.0, 1e-6)
    >>> round(displacement * 1e9, 2)  # nm
    0.89
    """

    def __init__(
        self,
        structure: Structure,
        window: Window,
        beta: Annotated[float, Quantity(or_zero=True)] = 0.25,
        gamma: Annotated[float, Quantity(low=0.5)] = 0.5,
    ) -> None:
        instance("structure", structure, Structure, "a Structure")
        self.structure, self.window, self.beta, self.gamma = structure, window, beta, gamma
        _check_masses(structure, "newmark")
        if 2.0 * self.beta < self.gamma:
            longest = 1.0 / (_highest_frequency(structure) * sqrt(self.gamma / 2.0 - self.beta))
            if window > longest:
                raise ValueError(
                    f"window = {window!r}: must be at most {longest:.6g} s, or Newmark's method is not stable"
                )
        damped = structure.mass + self.beta * window**2 * structure.stiffness
        if structure.damping is not None:
            damped = damped + self.gamma * window * structure.damping
        self.solve_mass, self.solve = factorise(structure.mass), factorise(damped)
        self.response = _from_rest(self._end, structure.contact_vectors)

    def free(self, state: StructureState) -> StructureState:
        """The state at the end of the window if no force acts."""
        return self._end(state, np.zeros(self.structure.size))

    def energies(self, state: StructureState, load: Vector) -> tuple[float, float]:
        """Return kinetic and elastic energy, J; for γ = ½ the latter is ½ uᵀK u + ½ (β − ¼) H² rᵀM⁻¹r, r = load − K u.

        (Krenk, Comput. Methods Appl. Mech. Eng. 195 (2006) 6110.)
        """
        kinetic, elastic = energies(self.structure, state)
        if self.gamma == 0.5 and self.beta != 0.25:
            pull = load - self.structure.stiffness @ state.displacement
            elastic += 0.5 * (self.beta - 0.25) * self.window**2 * float(pull @ self.solve_mass(pull))
        return kinetic, elastic

    def _end(self, state: StructureState, force: Vector) -> StructureState:
        u, v, _ = state
        first = self.solve_mass(force - _resistance(self.structure, u, v))
        u = u + self.window * v + self.window**2 * (0.5 - self.beta) * first
        v = v + self.window * (1.0 - self.gamma) * first
        last = self.solve(force - _resistance(self.structure, u, v))
        return StructureState(u + self.window**2 * self.beta * last, v + self.window * self.gamma * last)


@described
class GeneralisedAlpha:
    """The generalised-α method: second order, and it damps motions that are too fast for the window.

    The force of the balance, at (1 − α_f) H into the window, is extrapolated from the mean forces of this window and
    the last one, F̄ + (½ − α_f)(F̄ − F̄₋₁); with F̄ alone the order is one. The method takes energy from fast motions
    and conserves the work of slow ones to second order in H. Its state holds u, v, and as memory a and F̄₋₁.

    Parameters
    ----------
    structure : Structure
        The structure to move.
    window : float
        Length H of the window, s.
    spectral_radius : float
        ρ, 0 to 1: the factor by which a window multiplies an infinitely fast motion. ρ = 1 keeps it, as the implicit
        midpoint does; ρ = 0 removes it.

    Raises
    ------
    ValueError
        If ρ lies outside 0 to 1.

    References
    ----------
    Chung and Hulbert, J. Appl. Mech. 60 (1993) 371.

    Examples
    --------
    >>> import hertzlink as hl
    >>> from functools import partial
    >>> bar = hl.rod([hl.Layer(hl.STEEL_440C, length=25.4e-3, radius=9.525e-3)])
    >>> moving = hl.stepping.MovingStructure(bar, stepper=partial(hl.stepping.GeneralisedAlpha, spectral_radius=0.5))
    >>> state, displacement = moving.advance(moving.start(), 10.0, 1e-6)
    >>> displacement > 0.0
    True
    """

    def __init__(
        self,
        structure: Structure,
        window: Window,
        spectral_radius: Annotated[float, Quantity(high=1.0, or_zero=True)] = 0.8,
    ) -> None:
        radius = spectral_radius
        instance("structure", structure, Structure, "a Structure")
        self.structure, self.window = structure, window
        self.inertial, self.late = (2.0 * radius - 1.0) / (radius + 1.0), radius / (radius + 1.0)
        self.gamma = 0.5 - self.inertial + self.late
        self.beta = 0.25 * (1.0 - self.inertial + self.late) ** 2
        part = 1.0 - self.late
        matrix = (1.0 - self.inertial) * structure.mass + part * self.beta * window**2 * structure.stiffness
        if structure.damping is not None:
            matrix = matrix + part * self.gamma * window * structure.damping
        self.solve = factorise(matrix)
        unit = (1.5 - self.late) * _of_each(self.solve, structure.contact_vectors)
        memory = np.concatenate([unit, np.eye(structure.contacts)])
        self.response = StructureState(window**2 * self.beta * unit, window * self.gamma * unit, memory)

    def free(self, state: StructureState) -> StructureState:
        """The state at the end of the window if no force acts."""
        u, v, memory = state
        size, count = self.structure.size, self.structure.contacts
        memory = memory if memory.size else np.zeros(size + count)
        acceleration, last_push = memory[:size], (self.late - 0.5) * memory[size:]
        ahead_u = u + self.window * v + self.window**2 * (0.5 - self.beta) * acceleration
        ahead_v = v + self.window * (1.0 - self.gamma) * acceleration
        middle = (1.0 - self.late) * ahead_u + self.late * u, (1.0 - self.late) * ahead_v + self.late * v
        push = self.structure.contact_vectors @ last_push - self.inertial * (self.structure.mass @ acceleration)
        last = self.solve(push - _resistance(self.structure, *middle))
        ahead_u, ahead_v = ahead_u + self.window**2 * self.beta * last, ahead_v + self.window * self.gamma * last
        return StructureState(ahead_u, ahead_v, np.append(last, np.zeros(count)))


@described
class CentralDifference:
    """Explicit central differences with a lumped mass, in as many equal steps h as the window needs.

    M (u₊ − 2u + u₋)/h² + C (u₊ − u₋)/2h + K u = F̄ b, written with velocities at whole steps. Second order. Stable for
    h ≤ 2/ω, where ω is the highest frequency of the lumped structure, with or without damping. The energy oscillates by
    a fraction (ωh)²/4 for each motion and does not drift; the energy of `energies` is constant. The work of the contact
    is conserved to second order in h.

    Parameters
    ----------
    structure : Structure
        The structure to move; its mass is lumped.
    window : float
        Length of the window, s.
    steps : int, optional
        Number of steps in a window. By default h is 0.9 of the longest stable step or less.

    Raises
    ------
    ValueError
        If the steps are too long, or a mass is not positive, as in Maxwell arms.

    References
    ----------
    Belytschko et al., Nonlinear Finite Elements, section 6.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bar = hl.rod([hl.Layer(hl.STEEL_440C, length=25.4e-3, radius=9.525e-3)])
    >>> step = hl.stepping.CentralDifference(bar, window=1e-6)
    >>> step.step <= step.stable_step
    True
    """

    def __init__(self, structure: Structure, window: Window, steps: Several | None = None) -> None:
        self.structure = lumped(structure)
        self.stable_step = 2.0 / max(_highest_frequency(self.structure), 1e-300)
        needed = max(1.0, window / (DEFAULT_STABLE_FRACTION * self.stable_step))
        count = ceil(needed) if steps is None else steps
        if count > MOST_STEPS:
            raise ValueError(f"window = {window!r}: takes {count:.3g} steps, must take at most {MOST_STEPS:.0e}")
        self.steps, self.step = count, window / count
        if self.step > self.stable_step:
            raise ValueError(
                f"steps = {steps!r}: one of {self.step:.6g} s is longer than the stable one, {self.stable_step:.6g} s"
            )
        self.mass = self.structure.mass.diagonal()
        self.solve: Solve = lambda right: right / self.mass
        damping = self.structure.damping
        if damping is not None:
            self.solve = factorise(self.structure.mass + self.step / 2.0 * damping)
        self.response = _from_rest(self._end, structure.contact_vectors)

    def free(self, state: StructureState) -> StructureState:
        """The state at the end of the window if no force acts."""
        return self._end(state, np.zeros(self.structure.size))

    def energies(self, state: StructureState, load: Vector) -> tuple[float, float]:
        """Return the kinetic and elastic energy, J, the latter ½ uᵀK u − h²/8 rᵀM⁻¹r, r = load − K u: their sum plus
        the work is conserved without damping."""
        u, v, _ = state
        pull = self.structure.stiffness @ u
        lacking = self.step**2 / 8.0 * float((load - pull) @ ((load - pull) / self.mass))
        return 0.5 * float(v @ (self.mass * v)), 0.5 * float(u @ pull) - lacking

    def _end(self, state: StructureState, force: Vector) -> StructureState:
        u, v, _ = state
        damping, half = self.structure.damping, self.step / 2.0
        pull = force - self.structure.stiffness @ u
        for _ in range(self.steps):
            v = v + half * (pull if damping is None else pull - damping @ v) / self.mass
            u = u + self.step * v
            pull = force - self.structure.stiffness @ u
            v = self.solve(self.mass * v + half * pull)
        return StructureState(u, v)


def lumped(structure: Structure) -> Structure:
    """Return the structure with a diagonal mass: the diagonal of the consistent mass, scaled so that the mass is kept
    (HRZ).

    One factor serves the whole mesh. It keeps the kinetic energy of the slowest motion; in a free body this is the
    rigid motion, which contains the whole mass. In a mesh of equal elements the method is that of Hinton, Rock and
    Zienkiewicz (Earthquake Eng. Struct. Dyn. 4 (1976) 245), of order h⁴ in the frequencies of quadratic bars. A
    diagonal mass stays as it is. Raises ValueError for masses that are not positive, as in Maxwell arms.
    """
    instance("structure", structure, Structure, "a Structure")
    _check_masses(structure, "a lumped mass")
    diagonal = structure.mass.diagonal()
    if equal(structure.mass, sparse.diags_array(diagonal)):
        return structure
    slowest = structure.contact.reshape(structure.size, -1)[:, 0]
    shift = STATIC_SHIFT * float((structure.stiffness.diagonal() / diagonal).max())
    solve = factorise(structure.stiffness + shift * structure.mass)
    for _ in range(INVERSE_ITERATIONS):
        slowest = solve(structure.mass @ slowest)
        slowest = slowest / np.linalg.norm(slowest)
    factor = float(slowest @ (structure.mass @ slowest)) / float(slowest @ (diagonal * slowest))
    return replace(structure, mass=sparse.csr_array(sparse.diags_array(factor * diagonal)))


def stable_step(structure: Structure) -> float:
    """Return the longest stable step, s, of central differences with a lumped mass: 2/ω for the highest frequency ω."""
    return 2.0 / max(_highest_frequency(lumped(structure)), 1e-300)


def equal(first: sparse.sparray, second: sparse.sparray) -> bool:
    """Return whether two matrices hold the same numbers."""
    difference = abs(first - second)
    return bool(difference.nnz == 0 or difference.max() == 0.0)


def _of_each(solve: Solve, vectors: Vector) -> Vector:
    """Return the solutions for a unit force at each contact, one column for each."""
    return np.column_stack([solve(column) for column in np.ascontiguousarray(vectors.T)])


def _from_rest(end: Callable[[StructureState, Vector], StructureState], vectors: Vector) -> StructureState:
    """Return the states that a unit force at each contact causes from rest, one column for each."""
    rest = np.zeros(vectors.shape[0])
    each = [end(StructureState(rest, rest), column) for column in np.ascontiguousarray(vectors.T)]
    return StructureState(*(np.column_stack(parts) for parts in zip(*each, strict=True)))


def _resistance(structure: Structure, u: Vector, v: Vector) -> Vector:
    """Return K u + C v."""
    force: Vector = structure.stiffness @ u
    return force if structure.damping is None else force + structure.damping @ v


def _check_masses(structure: Structure, what: str) -> None:
    if not (structure.mass.diagonal() > 0.0).all():
        raise ValueError(f"structure: {what} needs positive masses; Maxwell arms have none, use the midpoint stepper")


def _highest_frequency(structure: Structure) -> float:
    """Return the largest ω of K u = ω² M u, rad/s, to 1e-6."""
    if structure.size <= FULL_SPECTRUM_SIZE:
        square = eigh(structure.stiffness.toarray(), structure.mass.toarray(), eigvals_only=True)[-1]
    else:
        solve = factorise(structure.mass)
        inverse = LinearOperator(structure.mass.shape, matvec=solve, dtype=float)
        start = np.random.default_rng(0).normal(size=structure.size)
        square = eigsh(
            structure.stiffness, 1, structure.mass, which="LM", v0=start, tol=1e-7, Minv=inverse,
            return_eigenvectors=False,
        )[0]  # fmt: skip
    return sqrt(max(float(square), 0.0))
