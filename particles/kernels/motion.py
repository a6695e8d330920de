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
from particles.kernels.laws import (
    NOT_NEGATIVE,
    copy_limits,
    elastic_overlap,
    force_of_step,
    lost_to_yielding,
    move_bodies,
    overlap_on_spring,
    with_memory,
)
from particles.kernels.losses import lose_on_bodies
from particles.kernels.vibrations import (
    accelerate_modes,
    energies_between,
    force_and_loss,
    forces_between,
    forces_of_some,
)
from structures.kernels.duals import value_of, where_dual
from structures.kernels.kernel_cache import entry, inner
from structures.kernels.pieces import by_type
from structures.structure import Vector

WORK_ROWS = 9
"""Rows of work space, each as long as the coordinates."""


class ChainModel(NamedTuple):
    """All of a chain that does not change during a run. Its first five fields are pieces."""

    scheme: Any
    """Verlet, DampedVerlet or RungeKutta."""
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
    last window with 0 left them after its first half-kick, and the body behind `first` follows its positions in that
    window. The work space holds both."""
    free: int
    """How many bodies touch nothing: they stay where they are."""


def integrate(
    scheme: Any, chain: Any, y: Vector, v: Vector, work: Vector, span: Any
) -> tuple[float, float, float, float]:
    """Move a chain on over a Span; return the impulses on structure and body 0, the loss and the drive's work."""
    raise NotImplementedError


integrate_inside, integrate_apart = by_type(integrate), by_type(integrate, small=False)


def integrate_span(
    scheme: Any, chain: Any, y: Vector, v: Vector, work: Vector, span: Any
) -> tuple[float, float, float, float]:
    """Integrate: as a part of the caller, for a call passes 44 numbers; dual numbers apart, which is faster there."""
    return integrate_inside(scheme, chain, y, v, work, span)


where_dual(integrate_span, lambda scheme, chain, y, v, work, span: integrate_apart(scheme, chain, y, v, work, span), 2)


@by_type
def bodies_per_step(scheme: Any) -> int:
    """Return by how many bodies a step passes on the motion of the surface; 0 where it reaches all at once."""
    return 0


def reach(chain: Any, y: Vector, steps: int) -> int:
    """Return the first body that the motion of the surface can reach within a window; 0 for all.

    All trials begin with the surface at the same place, which the last body feels at the second of the steps + 1 kicks.
    Contacts that yield remember what a trial did to them, so that all are moved again, and a drive moves the first two
    bodies together. Dual numbers have one trial.
    """
    bodies, passed = chain.inverse_mass.size, bodies_per_step(chain.scheme) * steps
    first, least = bodies - passed, 2 if drives(chain.drive) else 1
    return first if passed > 0 and first >= least and bodies == y.size else 0


where_dual(reach, lambda chain, y, steps: 0, 1)


@inner()
def advance(
    chain: Any, y: Vector, v: Vector, work: Vector, t: float, window: float, wall: float, wall_end: float, steps: int,
    first: int = 0, free: int = 0,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Move y, v on by one window from time t in place, see `integrate`.

    Returns the mean forces on the structure and on body 0 where it is no striker (else zero), N, the energy lost and
    the drive's work, J.
    """
    span = Span(t, wall, (wall_end - wall) / window, window / steps, steps, first, free)
    ahead, behind, lost, driven = integrate_span(chain.scheme, chain, y, v, work, span)
    return ahead / window, behind / window if chain.inverse_mass[0] == 0.0 else 0.0, lost, driven


class Verlet(NamedTuple):
    """Velocity Verlet for forces that depend on positions only, its inner half-kicks joined; second order."""

    @staticmethod
    def bodies_per_step(scheme: Any) -> int:
        """Return one: neighbours act on each other."""
        return 1

    @staticmethod
    def integrate(
        scheme: Any, chain: Any, y: Vector, v: Vector, work: Vector, span: Any
    ) -> tuple[float, float, float, float]:
        """Move the bodies on in one pass a step, which the compiler turns into vector instructions."""
        t, wall, rate, dt, steps, first, free = span
        inverse_mass, gravity, drive, spring = chain.inverse_mass, chain.gravity, chain.drive, chain.springs[1]
        law, past, limits, kept_y, kept_v = with_memory(chain.law, y), work[0], work[1], work[2], work[3]
        last, reached, impulse = inverse_mass.size - 1, reach(chain, y, steps), 0.0
        if first == 0:
            copy_limits(law, limits)
        else:
            impulse = work[4, 0]
            for i in range(first & NOT_NEGATIVE, (last + 1) & NOT_NEGATIVE):
                y[i], v[i] = kept_y[i], kept_v[i]
        # The last body that a wave has reached; a surface that comes back presses the last body before.
        front, source = last, 0 if moves(drive) else 1
        quiet = chain.quiet and not (wall < 0.0 or wall + steps * dt * rate < 0.0)
        while quiet and front > 0 and v[front] == 0.0 and y[front] == 0.0:
            front -= 1
        impulse_behind, driven = 0.0, 0.0
        for step in range(1 if first > 0 else 0, steps + 1):
            kick, drift = dt if 0 < step < steps else 0.5 * dt, dt if step < steps else 0.0
            # Before the pass: after it, the scalar load would wait for the pass's vector stores.
            overlap = y[last] - (wall + step * dt * rate)
            if spring != 0.0:
                overlap = overlap_on_spring(law, last, overlap, spring)
            wall_force = force_of_step(law, last, overlap)
            impulse += kick * wall_force
            behind, begin, end = 0.0, max(first, free), front + 1 if front < last else last
            if first > 0:
                behind = force_of_step(law, first - 1, past[step] - y[first])
            elif reached > 0:
                past[step] = y[reached - 1]
            push, before = 0.0, 0.0
            if drives(drive) and first == 0:
                before = dt * v[source] if step > 0 else 0.0
                behind, push = move_first(drive, chain, law, y, v, t + step * dt, kick, drift)
                impulse_behind += kick * behind
                begin = 1
            behind = move_bodies(law, inverse_mass, gravity, y, v, behind, kick, drift, begin, end)
            speed = v[end] + kick * (inverse_mass[end] * (behind - wall_force) + gravity[end])
            v[end] = speed
            y[end] += drift * speed
            front = end if speed != 0.0 else front
            if step == 0 and reached > 0:
                work[4, 0] = impulse
                for i in range(reached & NOT_NEGATIVE, (last + 1) & NOT_NEGATIVE):
                    kept_y[i], kept_v[i] = y[i], v[i]
            if drives(drive):
                # It works on body 0 if that is moved, else on bead 1: its force times half the way before and after.
                driven += 0.5 * push * (before + drift * v[source])
        return impulse, impulse_behind, lost_to_yielding(law, limits), driven


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
        force_of_step(law, i, overlap_on_spring(law, i, overlap, spring) if spring != 0.0 else overlap)


def follow_closings(
    chain: Any, law: Any, y: Vector, v: Vector, half: Vector, ends: Any, begins: bool, a: Vector, forces: Vector
) -> None:
    """Let derivatives of forces and accelerations follow the times at which contacts close: plain numbers have none.

    half: velocities of the last step. ends: displacement and velocity of the wall, and the step. begins: whether this
    is where the steps of a window begin.
    """


def _follow_closings(
    chain: Any, law: Any, y: Vector, v: Vector, half: Vector, ends: Any, begins: bool, a: Vector, forces: Vector
) -> None:
    """Let a contact that closed on the way here have the slope of its mean force over a step.

    A dashpot's force jumps where its contact closes, and other losses rise there with an infinite slope, so the slope
    at a point is not that of the response. Over the way of a step, s, it is [F(δ + s/2) − 0] / s.
    """
    wall, rate, dt = ends
    last = forces.size - 1
    if begins:
        for i in range(last + 1):
            half[i] = v[i] - 0.5 * dt * a[i]
    for i in range(last + 1):
        ahead, speed, before = (wall, rate, rate) if i == last else (y[i + 1], v[i + 1], half[i + 1])
        approach, way = y[i] - ahead, dt * value_of(half[i] - before)
        if 0.0 <= value_of(elastic_overlap(law, i, approach)) < way:
            spring = chain.springs[1] if i == last else chain.springs[0] if i == 0 else 0.0
            middle = value_of(approach) + 0.5 * way + 0.0 * approach
            closed, _ = force_and_loss(law, chain.loss, i, middle, v[i] - speed, spring)
            change = value_of(closed) / way * (approach - value_of(approach))
            change += closed - value_of(closed) + value_of(forces[i]) - forces[i]
            forces[i] += change
            a[i] -= chain.inverse_mass[i] * change
            if i < last:
                a[i + 1] += chain.inverse_mass[i + 1] * change


where_dual(follow_closings, _follow_closings, 2)


class DampedVerlet(NamedTuple):
    """Velocity Verlet whose losses depend on the velocity predicted for the step's end: second order."""

    @staticmethod
    def integrate(
        scheme: Any, chain: Any, y: Vector, v: Vector, work: Vector, span: Any
    ) -> tuple[float, float, float, float]:
        t, wall, rate, dt, steps, _, _ = span
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
            follow_closings(chain, law, y, v, half, (wall_now, rate, dt), step == 0, a, forces)
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


class RungeKutta(NamedTuple):
    """The classical method of order four; impulse, loss and work are integrated with the same weights."""

    @staticmethod
    def integrate(
        scheme: Any, chain: Any, y: Vector, v: Vector, work: Vector, span: Any
    ) -> tuple[float, float, float, float]:
        t, wall, rate, dt, steps, _, _ = span
        drive, law, last = chain.drive, with_memory(chain.law, y), chain.inverse_mass.size - 1
        forces, a, limits = work[0], work[3], work[5]
        stage_y, stage_v, sum_v, sum_a = work[4], work[6], work[7], work[8]
        copy_limits(law, limits)
        on_striker, on_bead, push = 0.0, 0.0, 0.0
        impulse, impulse_behind, lost, driven = 0.0, 0.0, 0.0, 0.0
        for i in range(last + 1):
            forces[i] = 0.0
        for step in range(steps):
            place, impulse_before = y[0], impulse_behind
            for i in range(y.size):
                stage_y[i], stage_v[i], sum_v[i], sum_a[i] = y[i], v[i], 0.0, 0.0
            for stage in range(4):
                ahead = dt * (0.0 if stage == 0 else 1.0 if stage == 3 else 0.5)
                weight = dt / 6.0 * (2.0 if 0 < stage < 3 else 1.0)
                if stage > 0:
                    for i in range(y.size):
                        stage_y[i] = y[i] + ahead * stage_v[i]
                        stage_v[i] = v[i] + ahead * a[i]
                now = step * dt + ahead
                if drives(drive):
                    if moves(drive):
                        stage_y[0], stage_v[0] = place_and_speed(drive, t + now)
                    on_striker, on_bead, push = outer_forces(drive, stage_y[0], t + now)
                power = accelerations(
                    chain, law, stage_y, stage_v, wall + now * rate, rate, on_striker, on_bead, a, work
                )
                impulse += weight * forces[last]
                impulse_behind += weight * forces[0]
                lost += weight * power
                driven += weight * push * stage_v[1]
                for i in range(y.size):
                    sum_v[i] += weight * stage_v[i]
                    sum_a[i] += weight * a[i]
            for i in range(y.size):
                y[i] += sum_v[i]
                v[i] += sum_a[i]
            if moves(drive):
                y[0], v[0] = place_and_speed(drive, t + (step + 1) * dt)
                driven += (impulse_behind - impulse_before) / dt * (y[0] - place)
            remember(chain, law, y, wall + (step + 1) * dt * rate)
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


advance_chain, forces_of_chain, energies_of_chain = map(
    entry, (advance.py_func, contact_forces.py_func, energies.py_func)
)
"""The same for Python."""
