"""Linear structures as pieces: how they move over a window of one length."""

from typing import Any, NamedTuple, cast

import numpy as np
from scipy.linalg import block_diag

from structures.kernels.arrays import dot, weighted
from structures.kernels.compiling import inner
from structures.kernels.pieces import by_type
from structures.structure import Vector

# The rest of an old motion that damping leaves would end in subnormal numbers, which are slow: it becomes zero
SMALLEST = 1e-180


@by_type
def follow(structure: Any, contact: Any, state: Vector, free: Vector) -> None:
    """Put the state at the end of a window in which no force acts into `free`.

    contact: records of the contacts, with the pending forces of the window before.
    """
    raise NotImplementedError


@inner(forceinline=True)
def without_small(number: float) -> float:
    """Return a number, or zero where it is so small that it becomes a subnormal one, which is slow."""
    return number if abs(number) >= SMALLEST else 0.0


@inner(forceinline=True)
def add(row: Vector, force: float, state: Vector) -> None:
    """Add a response to a state; what is negligible becomes zero.

    Sums are not contracted: `Oscillators.follow` gives the same bits, so that what is saved does not change a run.
    """
    for i in range(row.size):
        state[i] = without_small(state[i] + force * row[i])


@by_type
def read(structure: Any, k: int, state: Vector) -> float:
    """Return the displacement of contact k, m."""
    return dot(structure.contact[k], state)


@by_type
def push(structure: Any, k: int, force: float, state: Vector) -> None:
    """Add what a mean force on contact k, N, adds to the state within a window."""
    add(structure.response[k], force, state)


@by_type
def energies_of_structure(structure: Any, s: int, state: Vector) -> tuple[float, float]:
    """Return the kinetic and the elastic energy of structure s, J."""
    raise NotImplementedError


class Oscillators(NamedTuple):
    """Structures whose degrees of freedom are oscillators. The state is n displacements, then n velocities."""

    rows: Vector  # 4 × n: the end of a window is u = r₀ u + r₁ v, v = r₂ u + r₃ v where no force acts
    response: Vector  # K × 2n: the state after 1 N at each contact from rest
    contact: Vector  # K × n
    squares: Vector  # n, squares of the angular frequencies, 1/s²
    begin: Vector  # S + 1: where the oscillators of each structure begin

    @staticmethod
    def follow(structure: Any, contact: Any, state: Vector, free: Vector) -> None:
        """Do it in one pass, which the compiler turns into vector instructions.

        The force of contact 0 stays pending: a window that fails begins again.
        """
        rows, response, n, force = structure.rows, structure.response, structure.squares.size, contact[0].pending
        for k in range(1, contact.size):
            push(structure, k, contact[k].pending, state)
            contact[k].pending = 0.0
        for i in range(n):
            u = without_small(state[i] + force * response[0, i])
            v = without_small(state[n + i] + force * response[0, n + i])
            free[i] = rows[0, i] * u + rows[1, i] * v
            free[n + i] = rows[2, i] * u + rows[3, i] * v

    @staticmethod
    def energies_of_structure(structure: Any, s: int, state: Vector) -> tuple[float, float]:
        n, first, last = structure.squares.size, structure.begin[s], structure.begin[s + 1]
        speed = state[n + first : n + last]
        return 0.5 * dot(speed, speed), 0.5 * weighted(structure.squares[first:last], state[first:last])


class Coupled(NamedTuple):
    """Structures whose degrees of freedom act on each other, so that each has dense matrices.

    The state of a structure is its displacements, then the velocities of those that have mass; the states of all
    structures, n numbers, lie one after the other, and each n × n matrix has a block for each structure.
    """

    transition: Vector  # The end of a window over its begin where no force acts
    response: Vector  # K × n: the state after 1 N at each contact from rest
    contact: Vector  # K × n, zero for velocities
    mass: Vector  # Zero for displacements: the kinetic energy is ½ xᵀ M x of the state x
    stiffness: Vector  # Zero for velocities
    begin: Vector  # S + 1: where the state of each structure begins

    @staticmethod
    def follow(structure: Any, contact: Any, state: Vector, free: Vector) -> None:
        for k in range(contact.size):
            push(structure, k, contact[k].pending, state)
            contact[k].pending = 0.0
        for s in range(structure.begin.size - 1):
            first, last = structure.begin[s], structure.begin[s + 1]
            for i in range(first, last):
                free[i] = dot(structure.transition[i, first:last], state[first:last])

    @staticmethod
    def energies_of_structure(structure: Any, s: int, state: Vector) -> tuple[float, float]:
        first, last, kinetic, elastic = structure.begin[s], structure.begin[s + 1], 0.0, 0.0
        for i in range(first, last):
            kinetic += 0.5 * state[i] * dot(structure.mass[i, first:last], state[first:last])
            elastic += 0.5 * state[i] * dot(structure.stiffness[i, first:last], state[first:last])
        return kinetic, elastic


def joined(parts: list[Any], rows: list[Any], contacts: int) -> Oscillators | Coupled:
    """Return the structures of a run as one piece.

    parts: a window of each. rows: for each the contacts of the run at its contact points, −1 where nothing touches.
    """
    alike = all(isinstance(part, Oscillators) for part in parts)
    if not alike:
        parts = [_as_coupled(part) if isinstance(part, Oscillators) else part for part in parts]
    if len(parts) == 1 and [*rows[0]] == [*range(contacts)]:
        return cast(Oscillators | Coupled, parts[0])
    begin = np.cumsum([0, *(part.contact.shape[1] for part in parts)])
    # Displacements and velocities of oscillators are apart.
    halves = 2 if alike else 1
    response, contact = np.zeros((contacts, halves, begin[-1])), np.zeros((contacts, begin[-1]))
    for part, first, last, seats in zip(parts, begin[:-1], begin[1:], map(np.asarray, rows), strict=True):
        used = seats >= 0
        contact[seats[used], first:last] = part.contact[used]
        response[seats[used], :, first:last] = part.response.reshape(seats.size, halves, last - first)[used]
    both = response.reshape(contacts, -1), contact
    if alike:
        return Oscillators(
            np.concatenate([part.rows for part in parts], axis=1), *both,
            np.concatenate([part.squares for part in parts]), begin,
        )  # fmt: skip
    transition, mass, stiffness = (
        block_diag(*(getattr(part, name) for part in parts)) for name in ("transition", "mass", "stiffness")
    )
    return Coupled(transition, *both, mass, stiffness, begin)


def _as_coupled(part: Oscillators) -> Coupled:
    """Return oscillators as a coupled structure."""
    none = np.zeros((part.squares.size, part.squares.size))
    transition = np.block([[np.diag(row) for row in part.rows[i : i + 2]] for i in (0, 2)])
    mass, stiffness = block_diag(none, np.eye(len(none))), block_diag(np.diag(part.squares), none)
    contact = np.hstack([part.contact, np.zeros_like(part.contact)])
    return Coupled(transition, part.response, contact, mass, stiffness, 2 * part.begin)
