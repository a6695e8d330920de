"""Bodies that are rigid, or that vibrate in modes: their forces on each other, and their accelerations."""

from functools import partial
from typing import Any, NamedTuple

from particles.kernels.laws import energy, force, overlap_on_spring, slope, with_memory
from particles.kernels.losses import drag_rate, force_and_loss, force_with_loss, overlap_at
from structures.kernels.compiling import inner
from structures.kernels.pieces import by_type
from structures.structure import Vector

SETTLED = 1e-13
"""Of the greatest contact force, how far forces that beads pass on to each other may still change."""

MOST_SWEEPS = 200


@partial(by_type, small=False)
def forces_between(
    vibrations: Any, law: Any, loss: Any, springs: Any, y: Vector, v: Vector, wall: float, rate: float, forces: Vector,
    work: Vector,
) -> float:  # fmt: skip
    """Put the forces of all contacts into `forces`, N; return the power that their losses take, W.

    springs: flexibility of the structure behind the chain and of that at its end, m/N. Vibrating bodies begin to settle
    with what is in `forces`. work: two rows of N + 1 numbers.
    """
    raise NotImplementedError


@by_type
def forces_of_some(
    vibrations: Any, chain: Any, y: Vector, v: Vector, wall: float, rate: float, contacts: Vector, forces: Vector,
    work: Vector,
) -> None:  # fmt: skip
    """Put the forces of the contacts with these numbers into `forces`, N."""
    every = work[0, : chain.inverse_mass.size]
    for i in range(every.size):
        every[i] = 0.0
    law = with_memory(chain.law, y)
    forces_between(vibrations, law, chain.loss, chain.springs, y, v, wall, rate, every, work[1:])
    for j in range(contacts.size):
        forces[j] = every[contacts[j]]


@partial(by_type, small=False)
def accelerate_modes(vibrations: Any, y: Vector, v: Vector, loss: Any, forces: Vector, a: Vector) -> float:
    """Put the accelerations of modes behind those of the bodies; return the power that their losses take, W."""
    raise NotImplementedError


@partial(by_type, small=False)
def energies_between(
    vibrations: Any, law: Any, springs: Any, y: Vector, v: Vector, wall: float, forces: Vector, work: Vector
) -> tuple[float, float]:
    """Return the kinetic energy of modes, and the energy of all contacts and modes, J."""
    raise NotImplementedError


class Rigid(NamedTuple):
    """Bodies that do not vibrate."""

    @staticmethod
    def forces_between(
        vibrations: Any, law: Any, loss: Any, springs: Any, y: Vector, v: Vector, wall: float, rate: float,
        forces: Vector, work: Vector,
    ) -> float:  # fmt: skip
        last, power = forces.size - 1, 0.0
        for i in range(1, last):
            forces[i], taken = force_and_loss(law, loss, i, y[i] - y[i + 1], v[i] - v[i + 1], 0.0)
            power += taken
        for end in range(2):
            i, ahead, speed = (0, y[1], v[1]) if end == 0 else (last, wall, rate)
            overlap = overlap_at(law, i, y[i] - ahead, springs[end])
            forces[i], taken = force_and_loss(law, loss, i, overlap, v[i] - speed, springs[end])
            power += taken
        return power

    @staticmethod
    def forces_of_some(
        vibrations: Any, chain: Any, y: Vector, v: Vector, wall: float, rate: float, contacts: Vector, forces: Vector,
        work: Vector,
    ) -> None:  # fmt: skip
        law, last = with_memory(chain.law, y), chain.inverse_mass.size - 1
        for j in range(contacts.size):
            i = contacts[j]
            ahead, speed = (wall, rate) if i == last else (y[i + 1], v[i + 1])
            spring = chain.springs[1] if i == last else chain.springs[0] if i == 0 else 0.0
            overlap = overlap_at(law, i, y[i] - ahead, spring)
            forces[j], _ = force_and_loss(law, chain.loss, i, overlap, v[i] - speed, spring)

    @staticmethod
    def accelerate_modes(vibrations: Any, y: Vector, v: Vector, loss: Any, forces: Vector, a: Vector) -> float:
        """Return zero: there are no modes, and the memory of contacts that yield does not move."""
        for i in range(forces.size, a.size):
            a[i] = 0.0
        return 0.0

    @staticmethod
    def energies_between(
        vibrations: Any, law: Any, springs: Any, y: Vector, v: Vector, wall: float, forces: Vector, work: Vector
    ) -> tuple[float, float]:
        last, potential = forces.size - 1, 0.0
        for i in range(last + 1):
            overlap = y[i] - (y[i + 1] if i < last else wall)
            flexibility, push = springs[1] if i == last else springs[0] if i == 0 else 0.0, 0.0
            if flexibility != 0.0:
                overlap = overlap_on_spring(law, i, overlap, flexibility)
                push = force(law, i, overlap)
            potential += energy(law, i, overlap) + 0.5 * flexibility * push * push
        return 0.0, potential


class Vibrating(NamedTuple):
    """Bodies that vibrate, see particles.deformable.vibration: N + 1 rows, a column for each of the m modes.

    What moves a pole at once, beyond a body's modes, is in its contacts' laws. But a force also moves the other pole,
    whose contact it presses. Contacts have no mass, so all of that settles at once: by Gauss–Seidel sweeps, which
    converge by the ratio of `cross` to the contacts' own flexibility.
    """

    stiffness: Vector
    """Squares of the angular frequencies, 1/s²."""
    struck: Vector
    """Motion of the pole on the struck side, 1/√kg."""
    far: Vector
    """Motion of the other one."""
    cross: Vector
    """N + 1 numbers, m/N: what a force at one pole moves the other at once."""
    rate: Vector
    """c of the loss c q′, 1/s. No rows where no mode of the chain has a loss; so for the next two without arms."""
    arm: Vector
    """g ω² of an arm's force g ω² (q − z), 1/s²."""
    relaxation: Vector
    """1/τ in z′ = (q − z)/τ, 1/s."""

    @staticmethod
    def forces_between(
        vibrations: Any, law: Any, loss: Any, springs: Any, y: Vector, v: Vector, wall: float, rate: float,
        forces: Vector, work: Vector,
    ) -> float:  # fmt: skip
        """Fill the forces, N; return the power of losses, W. Losses see the rate at which the poles approach."""
        last, power, overlaps = forces.size - 1, 0.0, work[1]
        settle(vibrations, law, springs, y, wall, forces, work)
        for i in range(last + 1):
            if between_poles(vibrations, y, i, wall) < 0.0:
                continue
            flexibility = springs[1] if i == last else springs[0] if i == 0 else 0.0
            elastic, tangent = forces[i], slope(law, i, overlaps[i])
            approach_rate = between_poles(vibrations, v, i, rate)
            share = 1.0 / (1.0 + flexibility * tangent)
            lossy = force_with_loss(loss, i, elastic, tangent, overlaps[i], share * approach_rate)
            forces[i] = max(elastic + share * (lossy - elastic), 0.0)
            power += (forces[i] - elastic) * approach_rate
        return power

    @staticmethod
    def accelerate_modes(vibrations: Any, y: Vector, v: Vector, loss: Any, forces: Vector, a: Vector) -> float:
        """Fill the accelerations of modes and arms; return the power that their losses take, W.

        An arm has no mass: z′ = (q − z)/τ. Its derivative, z″ = (q′ − z′)/τ, is integrated like all other motions.
        """
        bodies, modes = vibrations.struck.shape
        power, arms = 0.0, bodies + bodies * modes
        for i in range(bodies):
            behind, drag = forces[i - 1] if i > 0 else 0.0, drag_rate(loss, i)
            for k in range(modes):
                q = bodies + i * modes + k
                a[q] = vibrations.struck[i, k] * behind - vibrations.far[i, k] * forces[i]
                a[q] -= vibrations.stiffness[i, k] * y[q] + drag * v[q]
                power += drag * v[q] * v[q]
                if vibrations.rate.size > 0:
                    a[q] -= vibrations.rate[i, k] * v[q]
                    power += vibrations.rate[i, k] * v[q] * v[q]
                if vibrations.arm.size > 0:
                    z = arms + i * modes + k
                    pull = vibrations.arm[i, k] * (y[q] - y[z])
                    a[q] -= pull
                    a[z] = vibrations.relaxation[i, k] * (v[q] - v[z])
                    power += pull * v[z]
        return power

    @staticmethod
    def energies_between(
        vibrations: Any, law: Any, springs: Any, y: Vector, v: Vector, wall: float, forces: Vector, work: Vector
    ) -> tuple[float, float]:
        bodies, modes = vibrations.struck.shape
        kinetic, potential, arms = 0.0, 0.0, bodies + bodies * modes
        settle(vibrations, law, springs, y, wall, forces, work)
        for i in range(bodies):
            flexibility = springs[1] if i == bodies - 1 else springs[0] if i == 0 else 0.0
            potential += energy(law, i, work[1, i]) + 0.5 * flexibility * forces[i] * forces[i]
            if i > 0:
                potential -= vibrations.cross[i] * forces[i - 1] * forces[i]
            for k in range(modes):
                q = bodies + i * modes + k
                kinetic += 0.5 * v[q] * v[q]
                potential += 0.5 * vibrations.stiffness[i, k] * y[q] * y[q]
                if vibrations.arm.size > 0:
                    potential += 0.5 * vibrations.arm[i, k] * (y[q] - y[arms + i * modes + k]) ** 2
        return kinetic, potential


@inner(forceinline=True)
def between_poles(vibrations: Any, y: Vector, i: int, wall: float) -> float:
    """Return the approach of contact i between the poles of its bodies, m; of velocities its rate."""
    bodies, modes = vibrations.struck.shape
    distance, ahead = y[i], wall
    for k in range(modes):
        distance += vibrations.far[i, k] * y[bodies + i * modes + k]
    if i + 1 < bodies:
        ahead = y[i + 1]
        for k in range(modes):
            ahead += vibrations.struck[i + 1, k] * y[bodies + (i + 1) * modes + k]
    return distance - ahead


@inner(forceinline=True)
def settle(vibrations: Any, law: Any, springs: Any, y: Vector, wall: float, forces: Vector, work: Vector) -> None:
    """Find the elastic forces of all contacts, N, from those in `forces` on; their overlaps go into the second row."""
    last, approach, overlaps, cross = forces.size - 1, work[0], work[1], vibrations.cross
    for i in range(last + 1):
        approach[i] = between_poles(vibrations, y, i, wall)
    for _ in range(MOST_SWEEPS):
        change, largest = 0.0, 0.0
        for i in range(last + 1):
            shared = approach[i]
            if i > 0:
                shared += cross[i] * forces[i - 1]
            if i < last:
                shared += cross[i + 1] * forces[i + 1]
            flexibility = springs[1] if i == last else springs[0] if i == 0 else 0.0
            if flexibility != 0.0:
                shared = overlap_on_spring(law, i, shared, flexibility)
            push = force(law, i, shared)
            change, largest = max(change, abs(push - forces[i])), max(largest, push)
            overlaps[i], forces[i] = shared, push
        if not change > SETTLED * largest:
            break
