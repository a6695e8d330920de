"""All chains of a run in the form for the compiled loops, and their steps in time."""

from typing import Any, NamedTuple

import numpy as np

from particles.kernels import drives as kinds
from particles.kernels.drives import Drives, energy_of_loads, history, outer_forces
from particles.kernels.laws import force_of_step, lost_to_yielding, with_memory
from particles.kernels.losses import drag, force_on_body, loses, move_body, overlap_at, press
from particles.kernels.vibrations import Vibrations, energies_between, forces_between
from structures.kernels.arrays import NOT_NEGATIVE
from structures.kernels.compiling import entry, inner
from structures.kernels.pieces import by_type
from structures.structure import Vector

WORK_ROWS = 5  # number of rows of the work space, each as long as the coordinates
# The ends of a chain: body 0, the last bead, and the surface that takes the place of body 0, or −1; the static position
# of body 0, m; whether bodies ahead of a wave are at rest at zero, because there is no static load; whether the first
# bead has a contact behind it; whether the last bead faces a surface.
ENDS = np.dtype(
    [(name, np.int64) for name in ("striker", "last", "behind")]
    + [("rest", float)]
    + [(name, np.bool_) for name in ("quiet", "touched", "faces")]
)
# A chain in a window: its steps, and the first body that the motion of the surface can reach; body 0 means all.
PACE = np.dtype([("steps", np.int64), ("reached", np.int64)])
# The energy lost by a chain in a window, and the work of its drive, J.
MOVED = np.dtype([("lost", float), ("driven", float)])
# A contact in a window. The surface at the end without force, and at the start, m; the mean force on the structure, and
# the mean force with which the chain answers, N; the surface at the end, m; the work of the answer, J.
TRIED = np.dtype([(name, float) for name in ("at_rest", "start", "force", "answer", "surface", "work")])


class Chains(NamedTuple):
    """The constant data of the chains of a run; the first three fields are pieces. The B bodies of all chains follow
    one another. Contact i is the contact ahead of body i.
    """

    stepper: Any  # Verlet or DampedVerlet
    law: Any
    loss: Any
    drive: Drives
    vibrations: Vibrations
    inverse_mass: Vector  # B, 1/kg; zero for a body with a prescribed motion
    gravity: Vector  # B, along the chain, m/s²; zero for a body with a prescribed motion
    wall: Vector  # B: the surface that a body faces, or −1 if it faces the next body
    spring: Vector  # B: flexibility of a massless spring at each contact, m/N, zero between beads
    ends: Any  # C records ENDS


@by_type
def move(
    stepper: Any, chains: Any, c: int, y: Vector, v: Vector, work: Vector, t: float, window: float, steps: int,
    start: float, end: float, reached: int, again: bool,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Move chain c in place by one window from time t, while the surface moves linearly from start to end, m.

    Return the mean forces on the structure and on body 0 if it is not a striker (else zero), N, the energy lost and the
    work of the drive, J. With `again`, only bodies from `reached` on start the window anew and move; the others have
    moved already. It is inlined in its caller, because a call would pass about a hundred numbers.
    """
    raise NotImplementedError


@inner(forceinline=True)
def flying(chains: Any, c: int, y: Vector, v: Vector, window: float) -> int:
    """Return the first body that may touch another in a window; those before keep their velocities."""
    loss, last = chains.loss, chains.ends[c].last
    for i in range(chains.ends[c].striker, last):
        approach, change = y[i] - y[i + 1], window * (v[i] - v[i + 1])
        if chains.gravity[i] != 0.0 or drag(loss, i) != 0.0 or approach >= 0.0 or approach + change >= 0.0:
            return i
    return int(last)


@inner(forceinline=True)
def move_driven_body(
    chains: Any, law: Any, c: int, y: Vector, v: Vector, ahead: Vector, lost: Vector, now: float, dt: float,
    kick: float, drift: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Move body 0; return the forces, N, of its contact, on bead 1 from outside, and of the drive on what it pushes."""
    loss, drive, i = chains.loss, chains.drive, chains.ends[c].striker
    contact = press(loss, law, i, y[i] - y[i + 1], ahead[i] - ahead[i + 1], chains.spring[i], kick, lost)
    on_body, on_bead, push = outer_forces(drive, c, y[i], now)
    if drive.kind[c] != kinds.MOVED:
        move_body(loss, chains, i, y, v, ahead, lost, on_body - contact, dt, kick, drift)
        return contact, on_bead, push
    # The mean rate of the history over the step; at the end there is no step.
    (begun, speed), (ended, ahead[i]) = history(drive, c, now), history(drive, c, now + drift)
    v[i] = (ended - begun) / drift if drift > 0.0 else speed
    y[i] += drift * v[i]
    return contact, on_bead, contact


class Verlet(NamedTuple):
    """Velocity Verlet for forces between neighbours; second order.

    A step is a kick, v += kick · a, and a drift, y += drift · v. The half-kicks that end a step and begin the next one
    are joined: kicks last dt, the first and the last dt/2, and no drift follows the last. One pass over the bodies does
    both, because a body may move as soon as the forces of its two contacts are known. Losses depend on `ahead`, the
    velocities at the end of a step that the last accelerations predict.
    """

    @staticmethod
    def move(
        stepper: Any, chains: Any, c: int, y: Vector, v: Vector, work: Vector, t: float, window: float, steps: int,
        start: float, end: float, reached: int, again: bool,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        """Move the bodies in one pass a step; without losses it becomes vector instructions."""
        law, loss, drive = with_memory(chains.law, y), chains.loss, chains.drive
        striker, last, dt, rate = chains.ends[c].striker, chains.ends[c].last, window / steps, (end - start) / window
        ahead, lost, flown = work[0], work[1], work[2]
        neighbour, neighbour_ahead = work[3], work[4]  # the motion, step by step, of the body behind `reached`
        first = reached if again else striker
        if loses(loss):
            for i in range(first & NOT_NEGATIVE, (last + 1) & NOT_NEGATIVE):
                ahead[i], lost[i] = v[i], 0.0
            if drive.kind[c] == kinds.MOVED:
                ahead[striker] = history(drive, c, t)[1]

        # Forces act from body `rear` to the wave's front. Bodies behind fly freely, and those ahead rest at zero.
        if first == striker:
            flown[striker] = striker if drive.acts[c] else flying(chains, c, y, v, window)
        rear = max(first, int(flown[striker]))
        # A surface that moves back presses the last body before a wave is there.
        front, quiet = last, chains.ends[c].quiet and not (start < 0.0 or end < 0.0)
        while quiet and front > striker and v[front] == 0.0 and y[front] == 0.0:
            front -= 1

        impulse, impulse_behind, driven = 0.0, 0.0, 0.0
        pushed = striker if drive.kind[c] == kinds.MOVED else striker + 1  # the body on which the drive does its work
        for step in range(steps + 1):
            kick, drift = dt if 0 < step < steps else 0.5 * dt, dt if step < steps else 0.0
            # Before the pass, because after it the scalar load would wait for the vector stores of the pass.
            approach = y[last] - (start + step * dt * rate)
            wall_force = press(loss, law, last, approach, ahead[last] - rate, chains.spring[last], kick, lost)
            impulse += kick * wall_force

            while rear > first and y[rear - 1] >= y[rear]:
                rear -= 1
            behind, begin, stop = 0.0, rear, front + 1 if front < last else last
            if first > striker and rear == first:
                # The body behind moves as in the first trial, which counted the loss of this contact.
                approach, closing = neighbour[striker + step] - y[first], neighbour_ahead[striker + step] - ahead[first]
                behind = press(loss, law, first - 1, approach, closing, 0.0, 0.0, lost)
            elif reached > striker and first == striker:
                neighbour[striker + step] = y[reached - 1]
                if loses(loss):
                    neighbour_ahead[striker + step] = ahead[reached - 1]

            push, before = 0.0, 0.0
            if drive.acts[c] and first == striker:
                before = dt * v[pushed] if step > 0 else 0.0
                contact, on_bead, push = move_driven_body(
                    chains, law, c, y, v, ahead, lost, t + step * dt, dt, kick, drift
                )
                impulse_behind += kick * contact
                behind, begin = contact + on_bead, striker + 1
            for i in range(first & NOT_NEGATIVE, rear & NOT_NEGATIVE):
                y[i] += drift * v[i]
            for i in range(begin & NOT_NEGATIVE, stop & NOT_NEGATIVE):
                contact = press(loss, law, i, y[i] - y[i + 1], ahead[i] - ahead[i + 1], 0.0, kick, lost)
                move_body(loss, chains, i, y, v, ahead, lost, behind - contact, dt, kick, drift)
                behind = contact
            move_body(loss, chains, stop, y, v, ahead, lost, behind - wall_force, dt, kick, drift)
            front = stop if v[stop] != 0.0 else front
            if drive.acts[c]:
                # The work on body 0 if it is MOVED, else on bead 1: force times half the distances before and after.
                driven += 0.5 * push * (before + drift * v[pushed])

        taken = 0.0
        if loses(loss):
            for i in range(striker, last + 1):
                taken += lost[i]
        return impulse / window, impulse_behind / window if chains.inverse_mass[striker] == 0.0 else 0.0, taken, driven


@inner()
def accelerations(
    chains: Any, law: Any, c: int, y: Vector, v: Vector, wall: float, rate: float, outer: tuple[float, float],
    a: Vector, work: Vector,
) -> float:  # fmt: skip
    """Write accelerations to `a` and contact forces to the first row of `work`; return the power of losses, W. outer:
    outer forces on body 0 and bead 1, N. work: three rows.
    """
    forces, alone, loss, vibrations = work[0], work[2], chains.loss, chains.vibrations
    striker, last, faces = chains.ends[c].striker, chains.ends[c].last, chains.ends[c].faces
    bodies, modes = vibrations.struck.shape
    power = forces_between(chains, law, c, y, v, wall, rate, forces, work[1:])
    behind, closing_behind, taken = 0.0, 0.0, 0.0
    for i in range(striker, last + 1):
        a[i] = chains.inverse_mass[i] * (behind - forces[i]) + chains.gravity[i]
        if chains.inverse_mass[i] > 0.0 and drag(loss, i) != 0.0:
            a[i] -= drag(loss, i) * v[i]
            power += drag(loss, i) * v[i] * v[i] / chains.inverse_mass[i]
        ahead, speed_ahead = (y[i + 1], v[i + 1]) if i < last else (wall, rate)
        there = (i > striker or chains.ends[c].touched) and (i < last or faces)
        closing = v[i] - speed_ahead if there and y[i] >= ahead else 0.0
        alone[i] = force_on_body(loss, i, closing_behind, closing)
        taken -= alone[i] * v[i]
        behind, closing_behind = forces[i], closing
    a[striker] += chains.inverse_mass[striker] * outer[0]
    a[striker + 1] += chains.inverse_mass[striker + 1] * outer[1]
    # In a chain that moves as a whole such a force could supply energy; then it is omitted.
    if taken > 0.0:
        power += taken
        for i in range(striker, last + 1):
            a[i] += chains.inverse_mass[i] * alone[i]
    in_modes = 0.0
    for i in range(striker, last + 1):
        behind = forces[i - 1] if i > striker else 0.0
        for k in range(modes):
            q, slowing = bodies + i * modes + k, drag(loss, i) + vibrations.rate[i, k]
            a[q] = vibrations.struck[i, k] * behind - vibrations.far[i, k] * forces[i]
            a[q] -= vibrations.stiffness[i, k] * y[q] + slowing * v[q]
            in_modes += slowing * v[q] * v[q]
    return power + in_modes


class DampedVerlet(NamedTuple):
    """Velocity Verlet for beads that vibrate, and for a loss that depends on both contacts of a body."""

    @staticmethod
    def move(
        stepper: Any, chains: Any, c: int, y: Vector, v: Vector, work: Vector, t: float, window: float, steps: int,
        start: float, end: float, reached: int, again: bool,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        drive, law = chains.drive, with_memory(chains.law, y)
        striker, last, dt, rate = chains.ends[c].striker, chains.ends[c].last, window / steps, (end - start) / window
        forces, a, half = work[0], work[3], work[4]
        (bodies, modes), outer, push = chains.vibrations.struck.shape, (0.0, 0.0), 0.0
        # The coordinates of the bodies, and those of their modes.
        parts = (striker, last + 1), (bodies + striker * modes, bodies + (last + 1) * modes)
        impulse, impulse_behind, lost, driven = 0.0, 0.0, 0.0, 0.0
        for i in range(striker, last + 1):
            forces[i] = 0.0
        for step in range(steps + 1):
            now, weight, wall = t + step * dt, dt if 0 < step < steps else 0.5 * dt, start + step * dt * rate
            place, before, bead, push_before = y[striker], forces[striker], y[striker + 1], push
            for begin, stop in parts:
                for i in range(begin, stop if step > 0 else begin):
                    half[i] = v[i] + 0.5 * dt * a[i]
                    v[i] = half[i] + 0.5 * dt * a[i]
                    y[i] += dt * half[i]
            if drive.acts[c]:
                if drive.kind[c] == kinds.MOVED:
                    y[striker], v[striker] = history(drive, c, now)
                    half[striker] = v[striker]
                on_striker, on_bead, push = outer_forces(drive, c, y[striker], now)
                outer = on_striker, on_bead
            lost += weight * accelerations(chains, law, c, y, v, wall, rate, outer, a, work)
            for i in range(striker, last + 1):
                approach = y[i] - (y[i + 1] if i < last else wall)
                force_of_step(law, i, overlap_at(law, i, approach, chains.spring[i]))
            for begin, stop in parts:
                for i in range(begin, stop if step > 0 else begin):
                    v[i] = half[i] + 0.5 * dt * a[i]
            impulse += weight * forces[last]
            impulse_behind += weight * forces[striker]
            if step > 0:
                # From distances, because speeds may jump at the ends of a history.
                driven += 0.5 * (push_before + push) * (y[striker + 1] - bead)
                if drive.kind[c] == kinds.MOVED:
                    driven += 0.5 * (before + forces[striker]) * (y[striker] - place)
        return impulse / window, impulse_behind / window if chains.inverse_mass[striker] == 0.0 else 0.0, lost, driven


@inner(forceinline=True)
def contact_forces(
    chains: Any, y: Vector, v: Vector, t: float, surface: Vector, rate: Vector, contacts: Vector, forces: Vector,
    work: Vector,
) -> None:  # fmt: skip
    """Write the forces of the contacts with these numbers to `forces`, N. surface, rate: displacements of the surfaces,
    m, and their velocities. If contact 1 does not exist, its entry is the force history.
    """
    law, every = with_memory(chains.law, y), work[0]
    for c in range(chains.ends.size):
        striker, last = chains.ends[c].striker, chains.ends[c].last
        for i in range(striker, last + 1):
            every[i] = 0.0
        k = chains.wall[last]
        forces_between(chains, law, c, y, v, surface[k], rate[k], every, work[1:])
        if chains.drive.kind[c] == kinds.PUSHED and not chains.ends[c].touched:
            every[striker] = outer_forces(chains.drive, c, y[striker], t)[2]
    for j in range(contacts.size):
        forces[j] = every[contacts[j]]


@inner(forceinline=True, fastmath={"contract", "reassoc"})
def energies(chains: Any, c: int, y: Vector, v: Vector, wall: float, work: Vector) -> tuple[float, float]:
    """Return the kinetic energy of chain c, and the potential energy of contacts, gravity, dead load and spring, J."""
    striker, last, law, forces = chains.ends[c].striker, chains.ends[c].last, with_memory(chains.law, y), work[0]
    for i in range(striker, last + 1):
        forces[i] = 0.0
    kinetic, potential = energies_between(chains, law, c, y, v, wall, forces, work[1:])
    for i in range(striker & NOT_NEGATIVE, (last + 1) & NOT_NEGATIVE):
        mass = 1.0 / chains.inverse_mass[i] if chains.inverse_mass[i] > 0.0 else 0.0
        kinetic += 0.5 * mass * v[i] * v[i]
        potential -= mass * chains.gravity[i] * y[i]
    return kinetic, potential + energy_of_loads(chains.drive, c, y[striker], y[striker + 1])


@inner(forceinline=True)
def advance(
    chains: Any, y0: Vector, v0: Vector, y: Vector, v: Vector, work: Vector, t: float, window: float, contact: Any,
    pace: Any, moved: Any, again: bool,
) -> None:  # fmt: skip
    """Write the end of a window that began with y0, v0 to y, v, while each surface moves linearly from start to end.
    contact: records TRIED, which get the mean forces of the chains. pace: records PACE. moved: records MOVED, to fill.
    again: whether the window differs from the last one only in the end of the surfaces. Then only bodies that the
    surfaces can reach are moved.
    """
    for i in range(chains.inverse_mass.size, y.size):
        y[i], v[i] = y0[i], v0[i]
    for c in range(chains.ends.size):
        striker, last, behind = chains.ends[c].striker, chains.ends[c].last, chains.ends[c].behind
        wall, first = chains.wall[last], pace[c].reached if again else striker
        for i in range(first, last + 1):
            y[i], v[i] = y0[i], v0[i]
        if behind >= 0:
            y[striker] = chains.ends[c].rest - contact[behind].start
            v[striker] = (contact[behind].start - contact[behind].surface) / window
        ahead, rear, lost, driven = move(
            chains.stepper, chains, c, y, v, work, t, window, pace[c].steps, contact[wall].start, contact[wall].surface,
            pace[c].reached, again,
        )  # fmt: skip
        yielded = lost_to_yielding(with_memory(chains.law, y), with_memory(chains.law, y0), striker, last)
        contact[wall].answer, moved[c].lost = ahead, lost + yielded
        if first == striker:
            moved[c].driven = driven
        if behind >= 0:
            y[striker], contact[behind].answer = chains.ends[c].rest - contact[behind].surface, rear


# The entry points for Python.
advance_chains, forces_of_chains, energies_of_chain = map(entry, (advance, contact_forces, energies))
