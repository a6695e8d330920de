"""Linear structures as pieces: how they move over a window of one length."""

from typing import Any, NamedTuple

import numpy as np

from structures.kernels.arrays import dot, weighted
from structures.kernels.compiling import inner
from structures.kernels.pieces import by_type
from structures.structure import Vector

SMALLEST = 1e-180
"""The rest of an old motion that damping leaves would end in subnormal numbers, which are slow: it becomes zero."""


@by_type
def follow(structure: Any, contact: Any, state: Vector, free: Vector) -> None:
    """Put the state at the end of a window in which no force acts into `free`.

    contact: records of the contacts. Their pending forces are those of the window before; the state without the
    response to them may stay so.
    """
    raise NotImplementedError


@by_type
def read(structure: Any, k: int, state: Vector) -> float:
    """Return the displacement of contact k, m."""
    raise NotImplementedError


@by_type
def push(structure: Any, k: int, force: float, state: Vector) -> None:
    """Add what a mean force on contact k, N, adds to the state within a window."""
    raise NotImplementedError


@by_type
def energies_of_structure(structure: Any, s: int, state: Vector) -> tuple[float, float]:
    """Return the kinetic and the elastic energy of structure s, J."""
    raise NotImplementedError


@inner(forceinline=True)
def without_small(number: float) -> float:
    """Return a number, or zero where it is so small that it becomes a subnormal one, which is slow."""
    return number if abs(number) >= SMALLEST else 0.0


@inner()
def quadratic_form(matrix: Vector, x: Vector) -> float:
    """Return ½ xᵀ M x of a flattened matrix."""
    total, n = 0.0, x.size
    for i in range(n):
        total += x[i] * dot(matrix[i * n : (i + 1) * n], x)
    return 0.5 * total


@inner(forceinline=True)
def add(row: Vector, force: float, state: Vector) -> None:
    """Add a response to a state; what is negligible becomes zero.

    Sums are not contracted: `Oscillators.follow` gives the same bits, so that what is saved does not change a run.
    """
    for i in range(row.size):
        state[i] = without_small(state[i] + force * row[i])


class Oscillators(NamedTuple):
    """Structures whose degrees of freedom are oscillators. The state is n displacements, then n velocities."""

    rows: Vector
    """4 × n: the end of a window is u = r₀ u + r₁ v, v = r₂ u + r₃ v where no force acts."""
    response: Vector
    """K × 2n: the state after 1 N at each contact from rest."""
    contact: Vector
    """K × n."""
    squares: Vector
    """n, squares of the angular frequencies, 1/s²."""
    begin: Vector
    """S + 1: where the oscillators of each structure begin."""

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
    def read(structure: Any, k: int, state: Vector) -> float:
        return dot(structure.contact[k], state)

    @staticmethod
    def push(structure: Any, k: int, force: float, state: Vector) -> None:
        add(structure.response[k], force, state)

    @staticmethod
    def energies_of_structure(structure: Any, s: int, state: Vector) -> tuple[float, float]:
        n, first, last = structure.squares.size, structure.begin[s], structure.begin[s + 1]
        speed = state[n + first : n + last]
        return 0.5 * dot(speed, speed), 0.5 * weighted(structure.squares[first:last], state[first:last])


class Coupled(NamedTuple):
    """Structures whose degrees of freedom act on each other: each has a dense matrix.

    The state of a structure is its displacements, then the velocities of those that have mass; that of all structures
    lies one after the other. Matrices are flattened in the same way.
    """

    transition: Vector
    """The end of a window over its begin where no force acts."""
    response: Vector
    """K × state: the state after 1 N at each contact from rest."""
    contact: Vector
    """K × state, zero for velocities."""
    stiffness: Vector
    mass: Vector
    """Of the displacements that have mass."""
    layout: Vector
    """S + 1 rows: where the state, the transition, the stiffness and the mass of each structure begin."""
    sizes: Vector
    """S: the number of displacements."""

    @staticmethod
    def follow(structure: Any, contact: Any, state: Vector, free: Vector) -> None:
        for k in range(contact.size):
            push(structure, k, contact[k].pending, state)
            contact[k].pending = 0.0
        for s in range(structure.sizes.size):
            first, last, matrix = structure.layout[s, 0], structure.layout[s + 1, 0], structure.layout[s, 1]
            size = last - first
            for i in range(size):
                begin = matrix + i * size
                free[first + i] = dot(structure.transition[begin : begin + size], state[first:last])

    @staticmethod
    def read(structure: Any, k: int, state: Vector) -> float:
        return dot(structure.contact[k], state)

    @staticmethod
    def push(structure: Any, k: int, force: float, state: Vector) -> None:
        add(structure.response[k], force, state)

    @staticmethod
    def energies_of_structure(structure: Any, s: int, state: Vector) -> tuple[float, float]:
        now, then = structure.layout[s], structure.layout[s + 1]
        middle = now[0] + structure.sizes[s]
        kinetic = quadratic_form(structure.mass[now[3] : then[3]], state[middle : then[0]])
        return kinetic, quadratic_form(structure.stiffness[now[2] : then[2]], state[now[0] : middle])


def as_coupled(part: Oscillators) -> Coupled:
    """Return oscillators as a coupled structure, so that it can be joined with one."""
    n = part.squares.size
    return Coupled(
        np.block([[np.diag(row) for row in part.rows[i : i + 2]] for i in (0, 2)]).ravel(), part.response,
        np.hstack([part.contact, np.zeros_like(part.contact)]), np.diag(part.squares).ravel(), np.eye(n).ravel(),
        np.array([(0, 0, 0, 0), (2 * n, 4 * n * n, n * n, n * n)]), np.array([n]),
    )  # fmt: skip


def joined_oscillators(parts: list[Oscillators], rows: list[Any], contacts: int) -> Oscillators:
    """Return several structures of oscillators as one piece; rows: the contact of each row of each part."""
    if len(parts) == 1 and [*rows[0]] == [*range(contacts)]:
        return parts[0]
    sizes = [part.squares.size for part in parts]
    begin = np.cumsum([0, *sizes])
    n = int(begin[-1])
    response, contact = np.zeros((contacts, 2 * n)), np.zeros((contacts, n))
    for part, first, size, seats in zip(parts, begin, sizes, map(np.asarray, rows), strict=False):
        used, place = seats >= 0, slice(first, first + size)
        contact[seats[used], place] = part.contact[used]
        response.reshape(contacts, 2, n)[seats[used], :, place] = part.response.reshape(seats.size, 2, size)[used]
    return Oscillators(
        np.concatenate([part.rows for part in parts], axis=1), response, contact,
        np.concatenate([part.squares for part in parts]), begin,
    )  # fmt: skip


def joined_coupled(parts: list[Coupled], rows: list[Any], contacts: int) -> Coupled:
    """Return several coupled structures as one piece; rows: the contact of each row of each part."""
    steps = np.array([part.layout[1] for part in parts])
    layout = np.concatenate([np.zeros((1, 4), dtype=np.int64), steps.cumsum(axis=0)])
    response, contact = (np.zeros((contacts, int(layout[-1, 0]))) for _ in range(2))
    for part, now, then, seats in zip(parts, layout[:-1], layout[1:], rows, strict=True):
        used = np.asarray(seats) >= 0
        for target, source in ((response, part.response), (contact, part.contact)):
            target[np.asarray(seats)[used], now[0] : then[0]] = source[used]
    transition, stiffness, mass = [
        np.concatenate([getattr(part, name) for part in parts]) for name in ("transition", "stiffness", "mass")
    ]
    sizes = np.concatenate([part.sizes for part in parts])
    return Coupled(transition, response, contact, stiffness, mass, layout, sizes)


def joined(parts: list[Any], rows: list[Any], contacts: int) -> Oscillators | Coupled:
    """Return the structures of a run as one piece.

    Parameters
    ----------
    parts : list of Oscillators or Coupled
        A window of each structure.
    rows : list of sequences of int
        For each structure the contacts of the run at its contact points; −1 where nothing touches.
    contacts : int
        The number of contacts of the run.

    Returns
    -------
    Oscillators or Coupled
        The piece.
    """
    if all(isinstance(part, Oscillators) for part in parts):
        return joined_oscillators(parts, rows, contacts)
    coupled = [as_coupled(part) if isinstance(part, Oscillators) else part for part in parts]
    return joined_coupled(coupled, rows, contacts)
