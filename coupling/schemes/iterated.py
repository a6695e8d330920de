"""Iterated coupling: both sides repeat a window until they agree on the forces of all its substeps."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, Protocol

import numpy as np

from coupling.interface import Interface
from coupling.schemes.condensed import trial_force
from coupling.schemes.scheme import Scheme, Tolerance
from coupling.state import CoupledState, Differences, NotConverged
from structures.described import described
from structures.quantities import Count, Quantity
from structures.structure import Vector

# From 2 on no fixed-point iteration converges, however stiff the structure.
Relaxation = Annotated[float, Quantity(high=2.0, ends=False)]
# Repetitions of a window, whose differences are all stored.
Repetitions = Annotated[int, Count(1, 100_000)]


@dataclass(frozen=True)
class Iteration(Scheme):
    """The loop of the iterated schemes, and its end.

    A window is repeated until two differences are small in all substeps and contacts: that between the mean forces that
    the chains answer and those that pushed the structures, at most `tolerance` of the greatest force that a contact
    could bear; and that between the surfaces and those of the repetition before, at most `tolerance` of the greatest
    approach. No step divides by a residual, which is zero as long as a gap is open.
    """

    tolerance: Tolerance = 1e-9
    relaxation: Relaxation = 0.5
    largest_count: Repetitions = 50
    whole_window = True

    def step(self, interface: Interface, state: CoupledState, length: float, substeps: int) -> list[CoupledState]:
        """The states at the ends of the substeps. Raises NotConverged."""
        enough, still = self.tolerance * interface.force_scale, self.tolerance * interface.indentation_scale
        force = np.tile(trial_force(interface, state, length), (substeps, 1))
        search = self.search(state.memory, length)
        before = None
        for count in range(1, self.largest_count + 1):
            ends = _window(interface, state, force, length)
            answer = np.array([end.past[-1].force for end in ends])
            surface = np.array([end.surface for end in ends])
            residual = answer - force
            largest = float(abs(residual).max())
            settled = before is None or not abs(surface - before).max() > still
            if settled and not largest > enough:
                memory = search.memory()
                return [end._replace(memory=memory, counts=end.counts._replace(evaluations=count)) for end in ends]
            force = force + search.step(residual.ravel(), answer.ravel()).reshape(force.shape)
            before = surface
        raise NotConverged(
            f"residual {largest:.3g} N after {count} iterations, tolerance {enough:.3g} N", evaluations=count * substeps
        )

    @abstractmethod
    def search(self, memory: Any, length: float) -> "Search":
        """Return what chooses the forces of the next repetition, in a window with substeps of `length` s."""


class Search(Protocol):
    """A search within one window: from residuals to changes of the forces."""

    def step(self, residual: Vector, answer: Vector) -> Vector:
        """Return the change of the forces (N) after an answer of the chains; residual: it less the forces tried."""
        ...

    def memory(self) -> Any:
        """Return what the next window starts from."""
        ...


def _window(interface: Interface, state: CoupledState, force: Vector, length: float) -> list[CoupledState]:
    """Return all substeps of a window under given mean forces (substeps × K)."""
    ends = []
    for push in force:
        pushed, surface = interface.push(state.structures, push, length)
        followed, answer, work = interface.follow(state.chains, state.past, surface, length)
        state = interface.next(state, length, followed, pushed, surface, push, (answer, work), None, 1)
        ends.append(state)
    return ends


@described
class Aitken(Iteration):
    """Fixed-point iteration with Aitken's relaxation, for structures that are black boxes.

    Parameters
    ----------
    tolerance : float
        Of the mean forces, in units of the greatest force that a contact could bear, and of the surfaces, in units of
        the greatest approach.
    relaxation : float
        The relaxation factor of the first repetition, between 0 and 2.
    largest_count : int
        Repetitions of a window, after which it is halved.

    References
    ----------
    Küttler and Wall, Comput. Mech. 43 (2008) 61, section 3.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 3, striker=bead, impact_speed=0.44)
    >>> rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=1e-4)
    >>> run = hl.CoSimulation(chain, rod, hl.Aitken()).run(until=1e-4)
    >>> print(f"{1e6 * float(run.surface_displacement.max()):.2f} µm")
    0.62 µm
    """

    def search(self, memory: Any, length: float) -> Search:
        """Return the search of one window."""
        return _Aitken(self.relaxation)


class _Aitken:
    def __init__(self, relaxation: float) -> None:
        self.factor = relaxation
        self.last: Vector | None = None

    def step(self, residual: Vector, answer: Vector) -> Vector:
        if self.last is not None:
            change = residual - self.last
            square = float(change @ change)
            if square > 0.0:
                self.factor *= -float(self.last @ change) / square
        self.last = residual
        return self.factor * residual

    def memory(self) -> None:
        return None


@described
class IQN_ILS(Iteration):
    """Interface quasi-Newton: an approximation of the inverse Jacobian by least squares.

    Parameters
    ----------
    tolerance : float
        Of the mean forces, in units of the greatest force that a contact could bear, and of the surfaces, in units of
        the greatest approach.
    relaxation : float
        The relaxation factor of the first repetition, as long as there are no differences; between 0 and 2.
    largest_count : int
        Repetitions of a window, after which it is halved.
    reuse : int
        Number of earlier windows whose differences are used, if their substeps have the same length.
    filtering : float
        A difference that adds less than this part of its length to the newer ones is dropped.

    References
    ----------
    Degroote, Bathe and Vierendeels, Comput. Struct. 87 (2009) 793; QR filtering: Haelterman et al., Comput. Struct. 171
    (2016) 9.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.IQN_ILS(reuse=0)
    IQN_ILS(tolerance=1e-09, relaxation=0.5, largest_count=50, reuse=0, filtering=0.001)
    """

    reuse: Annotated[int, Count(0)] = 2
    filtering: Annotated[float, Quantity()] = 1e-3

    def search(self, memory: Any, length: float) -> Search:
        """Return the search of one window."""
        return _LeastSquares(self, memory or (), length)


class _LeastSquares:
    def __init__(self, scheme: IQN_ILS, memory: tuple[Differences, ...], length: float) -> None:
        self.scheme, self.length = scheme, length
        self.old = tuple(differences for differences in memory if differences.length == length)
        self.residuals: list[Vector] = []
        self.answers: list[Vector] = []
        self.last: tuple[Vector, Vector] | None = None

    def step(self, residual: Vector, answer: Vector) -> Vector:
        if self.last is not None:
            self.residuals.insert(0, residual - self.last[0])
            self.answers.insert(0, answer - self.last[1])
        self.last = residual, answer
        earlier = (pair for old in self.old for pair in zip(old.residuals, old.answers, strict=True))
        pairs = [*zip(self.residuals, self.answers, strict=True), *(p for p in earlier if p[0].size == residual.size)]
        independent, factors = _independent([column for column, _ in pairs], self.scheme.filtering)
        if not independent:
            return self.scheme.relaxation * residual
        # Least squares of Σ cᵢ Δresidualᵢ = −residual, whose cᵢ give the change of the answers: IQN-ILS (Degroote,
        # Bathe and Vierendeels, Comput. Struct. 87 (2009) 793).
        coefficients = np.linalg.solve(factors[1], -(factors[0].T @ residual))
        change: Vector = np.array([pairs[i][1] for i in independent]).T @ coefficients + residual
        return change

    def memory(self) -> tuple[Differences, ...]:
        if not self.residuals:
            return self.old
        differences = Differences(self.length, np.array(self.residuals), np.array(self.answers))
        return (differences, *self.old)[: self.scheme.reuse]


def _independent(columns: list[Vector], filtering: float) -> tuple[list[int], tuple[Vector, Vector]]:
    """Return which columns add to those before them, and Q and R of these."""
    independent = list(range(len(columns)))
    while independent:
        matrix = np.array([columns[i] for i in independent]).T
        directions, upper = np.linalg.qr(matrix)
        added = np.zeros(len(independent))
        added[: len(upper)] = abs(np.diagonal(upper))
        little = np.flatnonzero(added <= filtering * np.linalg.norm(matrix, axis=0))
        if not little.size:
            return independent, (directions, upper)
        del independent[little[0]]
    return [], (np.zeros((0, 0)), np.zeros((0, 0)))
