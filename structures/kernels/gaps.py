"""Gaps of a structure that close, see structures.closing: a step in which each gap is open or presses."""

from math import sqrt
from typing import Any, NamedTuple

from structures.kernels.arrays import copy, dot, solve
from structures.kernels.kernel_cache import inner
from structures.kernels.linear import dissipated, energies_of_structure, let_go, push, read, read_rate
from structures.structure import Vector

SETTLED = 1e-13
"""Of the greatest closing speed, what is no motion."""


class Span(NamedTuple):
    """A window, or a part of one."""

    length: float
    structure: Any
    """Oscillators or Coupled, whose last G contacts are the gaps."""
    softness: Vector
    """G × G, m/(N s): the velocity of each gap at the end after 1 N across each from rest."""


class Gaps(NamedTuple):
    """A structure whose last G contacts are gaps that close."""

    window: Span
    part: Span
    parts: int
    """So many make a window in which a gap closes."""
    opening: Vector
    """G, m; and N."""
    preload: Vector
    work: Vector
    """4 + 2 G rows of G numbers: work space."""
    states: Vector
    """2 states: work space."""

    @staticmethod
    def follow(structure: Any, contact: Any, state: Vector, free: Vector) -> None:
        let_go(structure.window.structure, state, free)

    @staticmethod
    def read(structure: Any, k: int, state: Vector) -> float:
        return read(structure.window.structure, k, state)

    @staticmethod
    def push(structure: Any, k: int, force: float, state: Vector) -> None:
        push(structure.window.structure, k, force, state)

    @staticmethod
    def surfaces(structure: Any, compliance: Vector, run: Any, trial: Any) -> float:
        taken = close(structure, run.body, run.pressed, trial.free, trial.contact, trial.after, trial.pressed)
        for k in range(trial.contact.size):
            trial.contact[k].surface = read(structure.window.structure, k, trial.after)
        return taken

    @staticmethod
    def finish(structure: Any, run: Any, trial: Any) -> None:
        copy(trial.after, run.body)
        copy(trial.pressed, run.pressed)

    @staticmethod
    def energies_of_structure(structure: Any, s: int, state: Vector) -> tuple[float, float]:
        """Return kinetic and elastic energy, with that of the preload, J."""
        linear, count = structure.window.structure, structure.opening.size
        kinetic, elastic = energies_of_structure(linear, s, state)
        for g in range(count):
            elastic += structure.preload[g] * read(linear, linear.response.shape[0] - count + g, state)
        return kinetic, elastic


@inner()
def close(
    gaps: Any, state: Vector, before: Vector, free: Vector, contact: Any, after: Vector, pressed: Vector
) -> float:
    """Move the structure over a window, which is divided into parts if a gap closes in it.

    state, before: state and forces of the gaps at the beginning; after, pressed: at the end. free: the state at the end
    where no force acts. contact: records with the forces on the contacts before the gaps. Returns the energy that
    damping and gaps took, J.
    """
    taken = leap(gaps, gaps.window, state, before, free, contact, after, pressed)
    if not switched(gaps, before, after, pressed):
        return taken
    taken, now, alone, forces, mean = 0.0, gaps.states[0], gaps.states[1], gaps.work[0], gaps.work[1]
    copy(state, now)
    copy(before, forces)
    for g in range(mean.size):
        mean[g] = 0.0
    for _ in range(gaps.parts):
        let_go(gaps.part.structure, now, alone)
        taken += leap(gaps, gaps.part, now, forces, alone, contact, after, pressed)
        copy(after, now)
        copy(pressed, forces)
        for g in range(mean.size):
            mean[g] += pressed[g] / gaps.parts
    for g in range(mean.size):
        # What opened again is open: its faces move apart.
        pressed[g] = mean[g] if pressed[g] > 0.0 else 0.0
    return taken


@inner()
def leap(
    gaps: Any, span: Any, state: Vector, before: Vector, free: Vector, contact: Any, after: Vector, pressed: Vector
) -> float:
    """Take a step of the implicit midpoint rule in which each gap is open or presses; arguments as of `close`."""
    linear, count, rate, near = span.structure, gaps.opening.size, gaps.work[2], gaps.work[3]
    points, any_near = linear.response.shape[0] - count, False
    copy(free, after)
    for k in range(points):
        push(linear, k, contact[k].force, after)
    for g in range(count):
        if gaps.preload[g] != 0.0:
            push(linear, points + g, -gaps.preload[g], after)
        speed = read_rate(linear, points + g, state)
        middle = gaps.opening[g] + read(linear, points + g, state) + 0.5 * span.length * speed
        closes = before[g] > 0.0 or (middle <= 0.0 and speed <= 0.0)
        near[g], pressed[g] = 1.0 if closes else 0.0, 0.0
        any_near = any_near or closes
    if any_near:
        for g in range(count):
            rate[g] = read_rate(linear, points + g, after)
        separate(span.softness, rate, near, pressed, gaps.work[4:])
    taken = 0.0
    for g in range(count):
        if pressed[g] > 0.0:
            push(linear, points + g, pressed[g], after)
    for g in range(count):
        if pressed[g] > 0.0:
            taken -= pressed[g] * (read(linear, points + g, after) - read(linear, points + g, state))
    # The midpoint's mean velocity is the way over the time, also of what has no mass.
    return taken + dissipated(linear, state, after, span.length)


@inner()
def switched(gaps: Any, before: Vector, after: Vector, pressed: Vector) -> bool:
    """Return whether a gap closed on the way, or should have closed."""
    linear, count = gaps.window.structure, gaps.opening.size
    points = linear.response.shape[0] - count
    for g in range(count):
        if pressed[g] > 0.0:
            if before[g] == 0.0:
                return True
        elif gaps.opening[g] + read(linear, points + g, after) < 0.0 and read_rate(linear, points + g, after) < 0.0:
            return True
    return False


@inner()
def part_of_way(before: float, after: float) -> float:
    """Return the part of the way from one force to another on which it pushes."""
    if after > 0.0:
        return 1.0
    return before / (before - after) if before > 0.0 else 0.0


@inner()
def separate(softness: Vector, rate: Vector, near: Vector, pressed: Vector, work: Vector) -> None:
    """Find Λ ≥ 0 with rate + softness · Λ ≥ 0, and zero where Λ > 0; zero for gaps that are not near.

    Lawson and Hanson's active set. It starts with the gaps that would close, which mostly is the answer. work: active
    gaps, their forces, then a matrix of G rows.
    """
    size, scale, active, force, matrix = rate.size, 0.0, work[0], work[1], work[2:]
    for g in range(size):
        pressed[g] = 0.0
        active[g] = 1.0 if near[g] > 0.0 and rate[g] < 0.0 else 0.0
        if near[g] > 0.0:
            scale = max(scale, abs(rate[g]) / sqrt(softness[g, g]))
    for _ in range(3 * size):
        share = 0.0
        while share < 1.0:
            share = go_towards(softness, rate, pressed, active, force, matrix)
        worst, most = -1, SETTLED
        for g in range(size):
            if near[g] > 0.0 and active[g] == 0.0:
                closing = -(rate[g] + dot(softness[g], pressed)) / sqrt(softness[g, g])
                if closing > most * scale:
                    worst, most = g, closing / scale
        if worst < 0:
            return
        active[worst] = 1.0


@inner()
def go_towards(softness: Vector, rate: Vector, pressed: Vector, active: Vector, force: Vector, matrix: Vector) -> float:
    """Go towards the forces of the active gaps until the first vanishes, which opens; return the part of the way."""
    size, row, share = rate.size, 0, 1.0
    for g in range(size):
        if active[g] > 0.0:
            force[row], column = -rate[g], 0
            for h in range(size):
                if active[h] > 0.0:
                    matrix[row, column] = softness[g, h]
                    column += 1
            row += 1
    solve(matrix, force, row)
    row = 0
    for g in range(size):
        if active[g] > 0.0:
            share = min(share, part_of_way(pressed[g], force[row]))
            row += 1
    row = 0
    for g in range(size):
        if active[g] > 0.0:
            if force[row] <= 0.0 and part_of_way(pressed[g], force[row]) <= share:
                active[g], pressed[g] = 0.0, 0.0
            else:
                pressed[g] += share * (force[row] - pressed[g])
            row += 1
    return share
