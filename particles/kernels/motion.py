"""A chain as the compiled loops take it, and its steps in time."""

from typing import Any, NamedTuple

from particles.kernels.drives import (
    drives,
    energy_of_loads,
    move_first,
    moves,
    outer_forces,
    place_and_speed,
    replaces_contact,
)
from particles.kernels.laws import NOT_NEGATIVE, copy_limits, force_of_step, lost_to_yielding, with_memory
from particles.kernels.losses import (
    Approach,
    Bodies,
    Pace,
    begin_losses,
    energy_lost,
    flying,
    lose_on_bodies,
    loses,
    move_between,
    move_body,
    overlap_at,
    press,
)
from particles.kernels.vibrations import accelerate_modes, energies_between, forces_between, forces_of_some
from structures.kernels.compiling import entry, inner
from structures.kernels.pieces import by_type
from structures.structure import Vector

WORK_ROWS = 9
"""Rows of work space, each as long as the coordinates."""


class ChainModel(NamedTuple):
    """All of a chain that does not change during a run. Its first five fields are pieces."""

    scheme: Any
    """Verlet or DampedVerlet."""
    law: Any
    loss: Any
    drive: Any
    vibrations: Any
    inverse_mass: Vector
    """N + 1, 1/kg; zero for a body with a prescribed motion."""
    gravity: Vector
    """N + 1, along the chain, m/s²; zero for such a body."""
    springs: tuple[float, float]
    """Flexibility of the structure behind the chain and of that at its end, m/N: massless springs at the contacts."""
    rest: float
    """m, where body 0 is at rest."""
    quiet: bool
    """Whether bodies ahead of a wave are at rest at zero: the chain bears no static load."""


class Span(NamedTuple):
    """The steps of a window."""

    t: float
    """When it begins, s."""
    wall: float
    """Displacement of the surface then, m."""
    rate: float
    """Velocity of the surface, m/s."""
    dt: float
    """Length of a step, s."""
    steps: int
    first: int
    """0 moves all bodies. Else only body `first` and those ahead of it are moved, see `reach`: they begin where the
    last window with 0 began, and the body behind `first` follows its positions in that window. The work space holds
    both."""


@by_type
def integrate(
    scheme: Any, chain: Any, y: Vector, v: Vector, work: Vector, span: Any
) -> tuple[float, float, float, float]:
    """Move a chain on over a Span; return the impulses on structure and body 0, the loss and the drive's work.

    It becomes a part of its caller, for a call passes 44 numbers.
    """
    raise NotImplementedError


@by_type
def bodies_per_step(scheme: Any) -> int:
    """Return by how many bodies a step passes on the motion of the surface; 0 where it reaches all at once."""
    return 0


@inner(forceinline=True)
def reach(chain: Any, y: Vector, steps: int) -> int:
    """Return the first body that the motion of the surface can reach within a window; 0 for all.

    All trials begin with the surface at the same place, which the last body feels at the second of the steps + 1 kicks;
    its velocity, which losses feel, acts at the first. Contacts that yield remember what a trial did to them, so that
    all are moved again, and a drive moves the first two bodies together.
    """
    bodies, passed = chain.inverse_mass.size, bodies_per_step(chain.scheme) * (steps + loses(chain.loss))
    first, least = bodies - passed, 2 if drives(chain.drive) else 1
    return first if passed > 0 and first >= least and bodies == y.size else 0


@inner()
def advance(
    chain: Any, y: Vector, v: Vector, work: Vector, t: float, window: float, wall: float, wall_end: float, steps: int,
    first: int = 0,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Move y, v on by one window from time t in place, see `integrate`.

    Returns the mean forces on the structure and on body 0 where it is no striker (else zero), N, the energy lost and
    the drive's work, J.
    """
    span = Span(t, wall, (wall_end - wall) / window, window / steps, steps, first)
    ahead, behind, lost, driven = integrate(chain.scheme, chain, y, v, work, span)
    return ahead / window, behind / window if chain.inverse_mass[0] == 0.0 else 0.0, lost, driven


class Verlet(NamedTuple):
    """Velocity Verlet for forces between neighbours, its inner half-kicks joined; second order.

    Losses depend on the velocities that the last accelerations predict for the end of a step.
    """

    @staticmethod
    def bodies_per_step(scheme: Any) -> int:
        """Return one: neighbours act on each other."""
        return 1

    @staticmethod
    def integrate(
        scheme: Any, chain: Any, y: Vector, v: Vector, work: Vector, span: Any
    ) -> tuple[float, float, float, float]:
        """Move the bodies on in one pass a step, which the compiler turns into vector instructions without losses."""
        t, wall, rate, dt, steps, first = span
        law, loss, drive, last = with_memory(chain.law, y), chain.loss, chain.drive, chain.inverse_mass.size - 1
        past, limits, kept_y, kept_v, past_ahead = work[0], work[1], work[2], work[3], work[6]
        bodies, reached = Bodies(y, v, work[4], work[5]), reach(chain, y, steps)
        if first > 0:
            for i in range(first & NOT_NEGATIVE, (last + 1) & NOT_NEGATIVE):
                y[i], v[i] = kept_y[i], kept_v[i]
        else:
            copy_limits(law, limits)
            for i in range(reached & NOT_NEGATIVE, (last + 1 if reached > 0 else 0) & NOT_NEGATIVE):
                kept_y[i], kept_v[i] = y[i], v[i]
        begin_losses(loss, bodies, first, last)
        if loses(loss) and moves(drive):
            bodies.ahead[0] = place_and_speed(drive, t)[1]
        # Bodies up to `rear` − 1 touch nothing and fly on until something touches them.
        if first == 0:
            work[7, 0] = 0 if drives(drive) else flying(loss, chain, bodies, steps * dt)
        rear = max(first, int(work[7, 0]))
        # The last body that a wave has reached; a surface that comes back presses the last body before.
        front, source = last, 0 if moves(drive) else 1
        quiet = chain.quiet and not (wall < 0.0 or wall + steps * dt * rate < 0.0)
        while quiet and front > 0 and v[front] == 0.0 and y[front] == 0.0:
            front -= 1
        impulse, impulse_behind, driven = 0.0, 0.0, 0.0
        for step in range(steps + 1):
            pace = Pace(dt, dt if 0 < step < steps else 0.5 * dt, dt if step < steps else 0.0)
            # Before the pass: after it, the scalar load would wait for the pass's vector stores.
            approach = Approach(y[last] - (wall + step * dt * rate), bodies.ahead[last] - rate)
            wall_force = press(loss, law, last, approach, chain.springs[1], bodies.lost, pace.kick)
            impulse += pace.kick * wall_force
            while rear > first and y[rear - 1] >= y[rear]:
                rear -= 1
            behind, begin, end = 0.0, rear, front + 1 if front < last else last
            if first > 0 and rear == first:
                approach = Approach(past[step] - y[first], past_ahead[step] - bodies.ahead[first])
                behind = press(loss, law, first - 1, approach, 0.0, work[8], 0.0)
            elif reached > 0 and first == 0:
                past[step] = y[reached - 1]
                if loses(loss):
                    past_ahead[step] = bodies.ahead[reached - 1]
            push, before = 0.0, 0.0
            if drives(drive) and first == 0:
                before = dt * v[source] if step > 0 else 0.0
                contact, on_bead, push = move_first(drive, law, chain, bodies, t + step * dt, pace)
                impulse_behind += pace.kick * contact
                behind, begin = contact + on_bead, 1
            for i in range(first & NOT_NEGATIVE, rear & NOT_NEGATIVE):
                y[i] += pace.drift * v[i]
            behind = move_between(loss, law, chain, bodies, behind, pace, begin, end)
            move_body(loss, chain, bodies, end, behind - wall_force, pace)
            front = end if v[end] != 0.0 else front
            if drives(drive):
                # It works on body 0 if that is moved, else on bead 1: its force times half the way before and after.
                driven += 0.5 * push * (before + pace.drift * v[source])
        return impulse, impulse_behind, energy_lost(loss, bodies, last) + lost_to_yielding(law, limits), driven


@inner()
def accelerations(
    chain: Any, law: Any, y: Vector, v: Vector, wall: float, rate: float, on_striker: float, on_bead: float, a: Vector,
    work: Vector,
) -> float:  # fmt: skip
    """Put accelerations into `a` and contact forces into the first row of `work`; return the power of losses, W.

    on_striker, on_bead: forces on body 0 and bead 1 from outside, N. work: three rows.
    """
    bodies = chain.inverse_mass.size
    forces = work[0, :bodies]
    power = forces_between(chain.vibrations, law, chain.loss, chain.springs, y, v, wall, rate, forces, work[1:])
    behind = 0.0
    for i in range(bodies):
        a[i] = chain.inverse_mass[i] * (behind - forces[i]) + chain.gravity[i]
        behind = forces[i]
    a[0] += chain.inverse_mass[0] * on_striker
    a[1] += chain.inverse_mass[1] * on_bead
    power += lose_on_bodies(chain.loss, y, v, wall, rate, chain.inverse_mass, a)
    return power + accelerate_modes(chain.vibrations, y, v, chain.loss, forces, a)


@inner()
def remember(chain: Any, law: Any, y: Vector, wall: float) -> None:
    """Let contacts that yield remember the overlaps that they have now."""
    last = chain.inverse_mass.size - 1
    for i in range(last + 1):
        overlap, spring = y[i] - (y[i + 1] if i < last else wall), 0.0
        if i == last or i == 0:
            spring = chain.springs[1 if i == last else 0]
        force_of_step(law, i, overlap_at(law, i, overlap, spring))


class DampedVerlet(NamedTuple):
    """The same for beads that vibrate, and for a loss that depends on both contacts of a body."""

    @staticmethod
    def integrate(
        scheme: Any, chain: Any, y: Vector, v: Vector, work: Vector, span: Any
    ) -> tuple[float, float, float, float]:
        t, wall, rate, dt, steps, _ = span
        drive, law, last = chain.drive, with_memory(chain.law, y), chain.inverse_mass.size - 1
        forces, a, half, limits = work[0], work[3], work[4], work[5]
        copy_limits(law, limits)
        on_striker, on_bead, push = 0.0, 0.0, 0.0
        impulse, impulse_behind, lost, driven = 0.0, 0.0, 0.0, 0.0
        for i in range(last + 1):
            forces[i] = 0.0
        for step in range(steps + 1):
            now, weight = t + step * dt, dt if 0 < step < steps else 0.5 * dt
            place, before = y[0], forces[0]
            if step > 0:
                for i in range(y.size):
                    half[i] = v[i] + 0.5 * dt * a[i]
                    v[i] = half[i] + 0.5 * dt * a[i]
                    y[i] += dt * half[i]
            if drives(drive):
                if moves(drive):
                    y[0], v[0] = place_and_speed(drive, now)
                    half[0] = v[0]
                on_striker, on_bead, push = outer_forces(drive, y[0], now)
            wall_now = wall + step * dt * rate
            lost += weight * accelerations(chain, law, y, v, wall_now, rate, on_striker, on_bead, a, work)
            remember(chain, law, y, wall_now)
            if step > 0:
                for i in range(y.size):
                    v[i] = half[i] + 0.5 * dt * a[i]
            impulse += weight * forces[last]
            impulse_behind += weight * forces[0]
            driven += weight * push * v[1]
            if moves(drive) and step > 0:
                # By its way, not its speed, which may jump at the history's ends.
                driven += 0.5 * (before + forces[0]) * (y[0] - place)
        return impulse, impulse_behind, lost + lost_to_yielding(law, limits), driven


@inner()
def contact_forces(
    chain: Any, y: Vector, v: Vector, t: float, wall: float, rate: float, contacts: Vector, forces: Vector, work: Vector
) -> None:
    """Put the forces of the contacts with these numbers into `forces`, N.

    A force history stands for contact 1 where there is none.
    """
    forces_of_some(chain.vibrations, chain, y, v, wall, rate, contacts, forces, work)
    if replaces_contact(chain.drive):
        for j in range(contacts.size):
            if contacts[j] == 0:
                forces[j] = outer_forces(chain.drive, y[0], t)[2]


@inner()
def deepen(y: Vector, wall: float, deepest: Vector) -> None:
    """Let the greatest approach of each contact so far, m, grow to the present one."""
    last = deepest.size - 1
    for i in range(last):
        approach = y[i] - y[i + 1]
        deepest[i] = approach if approach > deepest[i] else deepest[i]
    deepest[last] = max(deepest[last], y[last] - wall)


@inner()
def energies(chain: Any, y: Vector, v: Vector, wall: float, work: Vector) -> tuple[float, float]:
    """Return the kinetic energy, and the potential energy of contacts, gravity, dead load and spring, J."""
    bodies, law = chain.inverse_mass.size, with_memory(chain.law, y)
    forces = work[0, :bodies]
    for i in range(bodies):
        forces[i] = 0.0
    kinetic, potential = energies_between(chain.vibrations, law, chain.springs, y, v, wall, forces, work[1:])
    for i in range(bodies):
        if chain.inverse_mass[i] > 0.0:
            kinetic += 0.5 * v[i] * v[i] / chain.inverse_mass[i]
            potential -= chain.gravity[i] * y[i] / chain.inverse_mass[i]
    return kinetic, potential + energy_of_loads(chain.drive, y)


advance_chain, forces_of_chain, energies_of_chain = map(entry, (advance, contact_forces, energies))
"""The same for Python."""
