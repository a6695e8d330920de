"""Linear structures: how they move over a window of one length."""

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from structures.kernels.arrays import dot, weighted
from structures.kernels.compiling import inner
from structures.structure import Vector

# The rest of an old motion that damping leaves would end in subnormal numbers, which are slow: it becomes zero
SMALLEST = 1e-180


@inner(forceinline=True)
def without_small(number: float) -> float:
    """Return a number, or zero where it is so small that it becomes a subnormal one, which is slow."""
    return number if abs(number) >= SMALLEST else 0.0


@inner(forceinline=True)
def add(row: Vector, force: float, state: Vector) -> None:
    """Add a response to a state; what is negligible becomes zero.

    Sums are not contracted: `follow` gives the same bits, so that what is saved does not change a run.
    """
    for i in range(row.size):
        state[i] = without_small(state[i] + force * row[i])


class Linear(NamedTuple):
    """Structures over a window of one length: all are oscillators, or else each has dense matrices.

    The state of oscillators is n displacements, then n velocities. That of other structures is for each its
    displacements, then the velocities of those that have mass; each matrix has a block for each structure.
    """

    contact: Vector  # K × the entries of a state that a contact can see
    response: Vector  # K × the state after 1 N at each contact from rest
    begin: Vector  # S + 1: where each structure begins, among oscillators or in the state
    rows: Vector  # 4 × n: oscillators end a window at u = r₀ u + r₁ v, v = r₂ u + r₃ v where no force acts
    squares: Vector  # n, squares of their angular frequencies, 1/s²
    transition: Vector = np.zeros((0, 0))  # the end of a window over its begin where no force acts
    mass: Vector = np.zeros((0, 0))  # zero for displacements: the kinetic energy is ½ xᵀ M x of the state x
    stiffness: Vector = np.zeros((0, 0))  # zero for velocities


def dense(contact: Vector, response: Vector, begin: Vector, *matrices: Vector) -> Linear:
    """Return structures that have a transition, a mass and a stiffness."""
    # One layout in memory is one type, for which the loop is compiled once.
    seen, given, *kept = map(np.ascontiguousarray, (contact, response, *matrices))
    return Linear(seen, given, begin, np.zeros((4, 0)), np.zeros(0), *kept)


@inner(forceinline=True)
def read(structure: Any, k: int, state: Vector) -> float:
    """Return the displacement of contact k, m."""
    return dot(structure.contact[k], state)


@inner()
def push(structure: Any, k: int, force: float, state: Vector) -> None:
    """Add what a mean force on contact k, N, adds to the state within a window."""
    add(structure.response[k], force, state)


@inner(forceinline=True)
def follow(structure: Any, contact: Any, state: Vector, free: Vector) -> None:
    """Put the state at the end of a window in which no force acts into `free`.

    contact: records of the contacts, with the pending forces of the window before. Oscillators take one pass, which
    the compiler turns into vector instructions; the force of contact 0 stays pending: a window that fails begins again.
    """
    rows, response, n = structure.rows, structure.response, structure.squares.size
    for k in range(1 if n > 0 else 0, contact.size):
        push(structure, k, contact[k].pending, state)
        contact[k].pending = 0.0
    force = contact[0].pending
    for i in range(n):
        u = without_small(state[i] + force * response[0, i])
        v = without_small(state[n + i] + force * response[0, n + i])
        free[i] = rows[0, i] * u + rows[1, i] * v
        free[n + i] = rows[2, i] * u + rows[3, i] * v
    for s in range(structure.begin.size - 1 if n == 0 else 0):
        first, last = structure.begin[s], structure.begin[s + 1]
        for i in range(first, last):
            free[i] = dot(structure.transition[i, first:last], state[first:last])


@inner(forceinline=True)
def energies_of_structure(structure: Any, s: int, state: Vector) -> tuple[float, float]:
    """Return the kinetic and the elastic energy of structure s, J."""
    n, first, last = structure.squares.size, structure.begin[s], structure.begin[s + 1]
    kinetic, elastic = 0.0, 0.0
    if n > 0:
        speed = state[n + first : n + last]
        return 0.5 * dot(speed, speed), 0.5 * weighted(structure.squares[first:last], state[first:last])
    for i in range(first, last):
        kinetic += 0.5 * state[i] * dot(structure.mass[i, first:last], state[first:last])
        elastic += 0.5 * state[i] * dot(structure.stiffness[i, first:last], state[first:last])
    return kinetic, elastic


def joined(parts: list[Linear], rows: list[Any], contacts: int) -> Linear:
    """Return the structures of a run as one.

    parts: a window of each. rows: for each the contacts of the run at its contact points, −1 where nothing touches.
    """
    alike = not any(part.transition.size for part in parts)  # a half-space has neither
    if not alike:
        parts = [part if part.transition.size else _as_dense(part) for part in parts]
    if len(parts) == 1 and [*rows[0]] == [*range(contacts)]:
        return parts[0]
    begin = np.cumsum([0, *(part.contact.shape[1] for part in parts)])
    # Displacements and velocities of oscillators are apart.
    halves = 2 if alike else 1
    response, contact = np.zeros((contacts, halves, begin[-1])), np.zeros((contacts, begin[-1]))
    for part, first, last, seats in zip(parts, begin[:-1], begin[1:], map(np.asarray, rows), strict=True):
        used = seats >= 0
        contact[seats[used], first:last] = part.contact[used]
        response[seats[used], :, first:last] = part.response.reshape(seats.size, halves, last - first)[used]
    response = response.reshape(contacts, -1)
    if alike:
        rows_of_all = np.concatenate([part.rows for part in parts], axis=1)
        return Linear(contact, response, begin, rows_of_all, np.concatenate([part.squares for part in parts]))
    names = "transition", "mass", "stiffness"
    return dense(contact, response, begin, *(block_diag(*(getattr(part, name) for part in parts)) for name in names))


def _as_dense(part: Linear) -> Linear:
    """Return oscillators as structures with matrices."""
    none = np.zeros((part.squares.size, part.squares.size))
    transition = np.block([[np.diag(row) for row in part.rows[i : i + 2]] for i in (0, 2)])
    contact = np.hstack([part.contact, np.zeros_like(part.contact)])
    mass, stiffness = block_diag(none, np.eye(len(none))), block_diag(np.diag(part.squares), none)
    return dense(contact, part.response, 2 * part.begin, transition, mass, stiffness)
