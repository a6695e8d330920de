"""Linear structures: their motion over a window of fixed length."""

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from structures.kernels.arrays import dot, weighted
from structures.kernels.compiling import inner
from structures.structure import Vector

# A damped motion would decay to subnormal numbers, which are slow: smaller numbers become zero
SMALLEST = 1e-180


@inner(forceinline=True)
def without_small(number: float) -> float:
    """Return a number, or zero if it is negligible."""
    return number if abs(number) >= SMALLEST else 0.0


class Linear(NamedTuple):
    """Structures over a window of fixed length. Either all are oscillators, or all have dense matrices.

    The state of oscillators has n displacements, then n velocities. The state of other structures has, for each
    structure, its displacements and then the velocities of those that have mass. Each matrix has a block for each
    structure.
    """

    contact: Vector  # K × the entries of a state on which a contact's displacement depends
    response: Vector  # K × the state after 1 N at each contact from rest
    begin: Vector  # S + 1: where each structure begins, among oscillators or in the state
    rows: Vector  # 4 × n: without force, oscillators end a window at r₀ u + r₁ v, r₂ u + r₃ v
    squares: Vector  # n, squares of their angular frequencies, 1/s²
    transition: Vector = np.zeros((0, 0))  # from the state at the start of a window to its end, without force
    mass: Vector = np.zeros((0, 0))  # zero for displacements: the kinetic energy is ½ xᵀ M x of the state x
    stiffness: Vector = np.zeros((0, 0))  # zero for velocities


def dense(contact: Vector, response: Vector, begin: Vector, *matrices: Vector) -> Linear:
    """Return structures with dense matrices: transition, mass and stiffness."""
    # All arrays have the same memory layout, so that the loop is compiled once.
    seen, given, *kept = map(np.ascontiguousarray, (contact, response, *matrices))
    return Linear(seen, given, begin, np.zeros((4, 0)), np.zeros(0), *kept)


@inner(forceinline=True)
def read(structure: Any, k: int, state: Vector) -> float:
    """Return the displacement of contact k, m."""
    return dot(structure.contact[k], state)


@inner()
def push(structure: Any, k: int, force: float, state: Vector) -> None:
    """Add the response to a mean force on contact k, N, over a window to the state; negligible numbers become zero.

    Sums are not contracted. So `follow` gives the same bits, and what a run saves does not change its motion.
    """
    row = structure.response[k]
    for i in range(row.size):
        state[i] = without_small(state[i] + force * row[i])


@inner(forceinline=True)
def follow(structure: Any, contact: Any, state: Vector, free: Vector) -> None:
    """Write the state at the end of a window without force to `free`.

    contact: records of the contacts, with the pending forces of the window before. Oscillators take one pass, which
    becomes vector instructions. The force of contact 0 stays pending, because a window that fails begins again.
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
    """Join the structures of a run.

    parts: one for each structure. rows: for each, the run's contacts at its contact points, −1 where nothing touches.
    """
    alike = not any(part.transition.size for part in parts)  # half-spaces count as oscillators
    if not alike:
        parts = [part if part.transition.size else _as_dense(part) for part in parts]
    if len(parts) == 1 and [*rows[0]] == [*range(contacts)]:
        return parts[0]
    begin = np.cumsum([0, *(part.contact.shape[1] for part in parts)])
    halves = 2 if alike else 1  # all displacements of oscillators come before all velocities
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
