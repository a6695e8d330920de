"""A structure as a participant: state in, state out, driven by the mean force over a window."""

from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from structures.checks import instance, within
from structures.kernels import linear
from structures.linear_algebra.factor import SMALL_MATRIX, check_definite
from structures.stepping import ImplicitMidpoint, OscillatorStep, StructureState, modes_of
from structures.structure import Structure, Vector

# The largest number of degrees of freedom for which a structure coupled by damping uses the compiled loop. With more,
# the dense product of a window takes as long as a sparse solve.
LARGEST_DENSE_SIZE = 300

# s. Outside these limits the square of a window, times a stiffness, leaves the range of floating point.
SHORTEST_WINDOW, LONGEST_WINDOW = 1e-18, 1e6


class MovingStructure:
    """A Structure as a participant: advance(state, mean force, window) → (state, displacement of the contact).

    The implicit midpoint rule integrates the motion and conserves energy exactly. Slow oscillators (see `reduce`) move
    exactly.

    Parameters
    ----------
    structure : Structure
        The structure to move.

    Examples
    --------
    >>> bar = hl.rod([hl.Layer(hl.STEEL_440C, length=25.4e-3, radius=9.525e-3)])
    >>> moving = hl.stepping.MovingStructure(bar)
    >>> state, displacement = moving.advance(moving.start(), 10.0, 1e-6)  # 10 N for 1 µs
    >>> abs(moving.energy(state) / (10.0 * displacement) - 1.0) < 1e-9
    True
    """

    def __init__(self, structure: Structure) -> None:
        self.structure = instance("structure", structure, Structure, "a Structure")
        self.size = structure.size
        """The number of degrees of freedom."""
        self.surface = structure.surface
        """Material and curvature at the contact: a Surface, or a tuple of them for several contacts."""
        self.surfaces = structure.surfaces
        """Material and curvature at each of the K contacts."""
        self._vectors, self._contacts = structure.contact_vectors, structure.contacts
        self._steps: dict[float, OscillatorStep | ImplicitMidpoint] = {}

    def describe(self) -> dict[str, Any]:
        """Return how the structure was made, as plain data."""
        return dict(self.structure.origin)

    def __repr__(self) -> str:
        return f"MovingStructure({self.structure!r})"

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the factorisations for copies and pickles; the next window computes them anew."""
        return {**vars(self), "_steps": {}}

    def start(self) -> StructureState:
        """Return the state at rest in static equilibrium."""
        return StructureState(np.zeros(self.structure.size), np.zeros(self.structure.size))

    def advance(self, state: StructureState, force: Any, window: float) -> tuple[StructureState, Any]:
        """Advance by one window (s) under the mean force (N) relative to the static force; p numbers for p contacts."""
        if np.shape(force) != (() if self._contacts == 1 else (self._contacts,)):
            many = "a number" if self._contacts == 1 else f"{self._contacts} numbers"
            raise ValueError(f"force = {force!r}: must be {many} in N, one for each contact")
        end, places = self.move(state, np.array(force, dtype=float, ndmin=1), window)
        return end, float(places[0]) if self._contacts == 1 else places

    def move(self, state: StructureState, forces: Vector, window: float) -> tuple[StructureState, Vector]:
        """Advance by one window (s) under the mean forces (N) of the K contacts; also return their displacements, m."""
        end = self.pushed(self.free(state, window), forces, window)
        return end, self.read(end)

    def free(self, state: StructureState, window: float) -> StructureState:
        """Return the state at the end of the window without force."""
        return self.step(window).free(state) if self.structure.size else state

    def pushed(self, free: StructureState, forces: Vector, window: float) -> StructureState:
        """Return the state at the end of the window from that without force and the mean forces of the K contacts."""
        if not self.structure.size:
            return free
        pairs = zip(free, self.step(window).response, strict=True)
        return StructureState(*(end + unit @ forces for end, unit in pairs))

    def read(self, state: StructureState) -> Vector:
        """Return the displacements bᵀu of the K contact points, m."""
        places: Vector = self._vectors.T @ state.displacement
        return places

    def compliance(self, window: float) -> Vector:
        """Return the displacement of contact i at the window's end for 1 N of mean force on contact j, m/N, K × K."""
        if not self.structure.size:
            return np.zeros((self._contacts, self._contacts))
        return self.read(self.step(window).response)

    def energy(self, state: StructureState) -> float:
        """Return the kinetic plus elastic energy relative to static equilibrium, J."""
        return sum(self.energies(state))

    def energies(self, state: StructureState) -> tuple[float, float]:
        """Return the kinetic and elastic energy ½ vᵀM v and ½ uᵀK u relative to static equilibrium, J."""
        u, v = state
        return 0.5 * float(v @ (self.structure.mass @ v)), 0.5 * float(u @ (self.structure.stiffness @ u))

    def step(self, window: float) -> OscillatorStep | ImplicitMidpoint:
        """Return the propagator over this window; it is made once."""
        if not isinstance(window, float) or window not in self._steps:
            window = within("window", window, SHORTEST_WINDOW, LONGEST_WINDOW, "s")
        if window not in self._steps:
            if not self._steps:
                self._examine()
            make = OscillatorStep if self.structure.is_modal else ImplicitMidpoint
            self._steps[window] = make(self.structure, window)
        return self._steps[window]

    def _examine(self) -> None:
        """Raise a ValueError if a large matrix has a negative eigenvalue. Damping from `damped` has none."""
        structure = self.structure
        structure.matrices.examine()
        if structure.damping is not None and structure.size > SMALL_MATRIX and "damping" not in structure.origin:
            check_definite("damping", structure.damping)

    @cached_property
    def _modes(self) -> Structure | None:
        """The structure in its modes, if it is small enough and damping does not couple them; else None."""
        self._examine()
        return modes_of(self.structure)

    @property
    def compact(self) -> bool:
        """True if it suits the compiled loop: oscillators, or a few degrees of freedom that damping couples."""
        return self.structure.is_modal or self._modes is not None or 0 < self.structure.size <= LARGEST_DENSE_SIZE

    def window(self, length: float) -> linear.Linear:
        """Return a window of this length, s, in the form for the compiled loop."""
        structure, size = self.structure, self.structure.size
        body = structure if structure.is_modal else self._modes
        if body is not None:
            step: Any = self.step(length) if body is structure else OscillatorStep(body, length, exact=False)
            return linear.Linear(
                np.array(body.contact_vectors.T, order="C"),
                np.ascontiguousarray(np.concatenate(step.response).T),
                np.array([0, step.square.size]),
                np.ascontiguousarray(step.rows),
                step.square,
            )
        # For so few degrees of freedom, sparse matrices take several times as long as dense ones.
        mass, stiffness = structure.mass.toarray(), structure.stiffness.toarray()
        damping = None if structure.damping is None else structure.damping.toarray()
        dense = {"mass": mass, "stiffness": stiffness, "damping": damping, "contact_vectors": structure.contact_vectors}
        midpoint = ImplicitMidpoint(SimpleNamespace(**dense), length)
        # Nothing depends on the velocity of a massless degree of freedom, such as a Maxwell arm.
        moving = np.flatnonzero(mass.any(axis=0))
        unit, rest, none = np.eye(size), np.zeros((size, size)), np.zeros((moving.size, moving.size))
        starts = StructureState(np.hstack([unit, rest[:, moving]]), np.hstack([rest, unit[:, moving]]))
        (displacement, velocity), (pushed, sped) = midpoint.free(starts), midpoint.response
        return linear.dense(
            np.hstack([structure.contact_vectors.T, np.zeros((self._contacts, moving.size))]),
            np.concatenate([pushed, sped[moving]]).T,
            np.array([0, size + moving.size]),
            np.concatenate([displacement, velocity[moving]]),
            block_diag(rest, mass[np.ix_(moving, moving)]),
            block_diag(stiffness, none),
        )
