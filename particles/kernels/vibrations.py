"""Bodies that are rigid, or that vibrate in modes: their forces on each other, and their accelerations."""

from functools import partial
from typing import Any, NamedTuple

from particles.kernels.laws import energy, force, overlap_on_spring, slope
from particles.kernels.losses import drag, force_and_loss, overlap_at, with_loss
from structures.kernels.arrays import NOT_NEGATIVE
from structures.kernels.compiling import inner
from structures.kernels.pieces import by_type
from structures.structure import Vector


@partial(by_type, small=False)
def forces_between(
    vibrations: Any, chains: Any, law: Any, c: int, y: Vector, v: Vector, wall: float, rate: float, forces: Vector,
    work: Vector,
) -> float:  # fmt: skip
    """Put the forces of all contacts of chain c into `forces`, N, from those of the last call on; return the power that
    their losses take, W. work: two rows."""
    raise NotImplementedError


@partial(by_type, small=False)
def accelerate_modes(vibrations: Any, chains: Any, c: int, y: Vector, v: Vector, forces: Vector, a: Vector) -> float:
    """Fill the accelerations of the modes of chain c; return the power that their losses take, W."""
    return 0.0


@partial(by_type, small=False, fastmath={"contract", "reassoc"})
def energies_between(
    vibrations: Any, chains: Any, law: Any, c: int, y: Vector, v: Vector, wall: float, forces: Vector, work: Vector
) -> tuple[float, float]:
    """Return the kinetic energy of modes, and the energy of all contacts and modes, of chain c, J."""
    raise NotImplementedError


class Rigid(NamedTuple):
    """Bodies that do not vibrate."""

    @staticmethod
    def forces_between(
        vibrations: Any, chains: Any, law: Any, c: int, y: Vector, v: Vector, wall: float, rate: float, forces: Vector,
        work: Vector,
    ) -> float:  # fmt: skip
        last, power = chains.ends[c].last, 0.0
        for i in range(chains.ends[c].striker, last + 1):
            ahead, speed = (y[i + 1], v[i + 1]) if i < last else (wall, rate)
            overlap = overlap_at(law, i, y[i] - ahead, chains.spring[i])
            forces[i], taken = force_and_loss(law, chains.loss, i, overlap, v[i] - speed, chains.spring[i])
            power += taken
        return power

    @staticmethod
    def energies_between(
        vibrations: Any, chains: Any, law: Any, c: int, y: Vector, v: Vector, wall: float, forces: Vector, work: Vector
    ) -> tuple[float, float]:
        striker, last, potential = chains.ends[c].striker, chains.ends[c].last, 0.0
        for i in range((striker + 1) & NOT_NEGATIVE, last & NOT_NEGATIVE):
            potential += energy(law, i, y[i] - y[i + 1])
        for i in (striker, last):
            overlap, flexibility = y[i] - (y[i + 1] if i < last else wall), chains.spring[i]
            if flexibility != 0.0:
                overlap = overlap_on_spring(law, i, overlap, flexibility)
                push = force(law, i, overlap)
                potential += 0.5 * flexibility * push * push
            potential += energy(law, i, overlap)
        return 0.0, potential


class Vibrating(NamedTuple):
    """Bodies that vibrate, see particles.deformable.vibration: a row for each of the B bodies, a column for each mode.

    Beyond the modes a force also moves the other pole at once, whose contact it presses: contacts `settle` together.
    """

    stiffness: Vector  # squares of the angular frequencies, 1/s²
    struck: Vector  # motion of the pole on the struck side, 1/√kg
    far: Vector  # motion of the other one
    cross: Vector  # B numbers, m/N: what a force at one pole moves the other at once
    # c of the loss c q′, 1/s. No columns where no mode of the chain has a loss; so for the next two without arms.
    rate: Vector
    arm: Vector  # g ω² of an arm's force g ω² (q − z), 1/s²
    relaxation: Vector  # 1/τ in z′ = (q − z)/τ, 1/s

    @staticmethod
    def forces_between(
        vibrations: Any, chains: Any, law: Any, c: int, y: Vector, v: Vector, wall: float, rate: float, forces: Vector,
        work: Vector,
    ) -> float:  # fmt: skip
        """Losses see the rate at which the poles approach."""
        last, power, overlaps = chains.ends[c].last, 0.0, work[1]
        settle(vibrations, chains, law, c, y, wall, forces, work)
        for i in range(chains.ends[c].striker, last + 1):
            if between_poles(vibrations, y, i, last, wall) < 0.0:
                continue
            elastic, tangent = forces[i], slope(law, i, overlaps[i])
            approach_rate = between_poles(vibrations, v, i, last, rate)
            share = 1.0 / (1.0 + chains.spring[i] * tangent)
            lossy = with_loss(chains.loss, i, elastic, tangent, overlaps[i], share * approach_rate)
            forces[i] = max(elastic + share * (lossy - elastic), 0.0)
            power += (forces[i] - elastic) * approach_rate
        return power

    @staticmethod
    def accelerate_modes(
        vibrations: Any, chains: Any, c: int, y: Vector, v: Vector, forces: Vector, a: Vector
    ) -> float:
        """An arm has no mass: z′ = (q − z)/τ. Its derivative, z″ = (q′ − z′)/τ, is integrated like others."""
        bodies, modes = vibrations.struck.shape
        power, arms, striker = 0.0, bodies + bodies * modes, chains.ends[c].striker
        for i in range(striker, chains.ends[c].last + 1):
            behind, slowing = forces[i - 1] if i > striker else 0.0, drag(chains.loss, i)
            for k in range(modes):
                q = bodies + i * modes + k
                a[q] = vibrations.struck[i, k] * behind - vibrations.far[i, k] * forces[i]
                a[q] -= vibrations.stiffness[i, k] * y[q] + slowing * v[q]
                power += slowing * v[q] * v[q]
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
        vibrations: Any, chains: Any, law: Any, c: int, y: Vector, v: Vector, wall: float, forces: Vector, work: Vector
    ) -> tuple[float, float]:
        bodies, modes = vibrations.struck.shape
        kinetic, potential, arms, striker = 0.0, 0.0, bodies + bodies * modes, chains.ends[c].striker
        settle(vibrations, chains, law, c, y, wall, forces, work)
        for i in range(striker, chains.ends[c].last + 1):
            potential += energy(law, i, work[1, i]) + 0.5 * chains.spring[i] * forces[i] * forces[i]
            if i > striker:
                potential -= vibrations.cross[i] * forces[i - 1] * forces[i]
            for k in range(modes):
                q = bodies + i * modes + k
                kinetic += 0.5 * v[q] * v[q]
                potential += 0.5 * vibrations.stiffness[i, k] * y[q] * y[q]
                if vibrations.arm.size > 0:
                    potential += 0.5 * vibrations.arm[i, k] * (y[q] - y[arms + i * modes + k]) ** 2
        return kinetic, potential


@inner(forceinline=True)
def between_poles(vibrations: Any, y: Vector, i: int, last: int, wall: float) -> float:
    """Return the approach of contact i between the poles of its bodies, m; of velocities its rate."""
    bodies, modes = vibrations.struck.shape
    distance, ahead = y[i], wall
    for k in range(modes):
        distance += vibrations.far[i, k] * y[bodies + i * modes + k]
    if i < last:
        ahead = y[i + 1]
        for k in range(modes):
            ahead += vibrations.struck[i + 1, k] * y[bodies + (i + 1) * modes + k]
    return distance - ahead


@inner(forceinline=True)
def settle(
    vibrations: Any, chains: Any, law: Any, c: int, y: Vector, wall: float, forces: Vector, work: Vector
) -> None:
    """Find the elastic forces of all contacts, N, and in the second row their overlaps, by Gauss–Seidel sweeps."""
    striker, last = chains.ends[c].striker, chains.ends[c].last
    approach, overlaps, cross = work[0], work[1], vibrations.cross
    for i in range(striker, last + 1):
        approach[i] = between_poles(vibrations, y, i, last, wall)
    for _ in range(200):
        change, largest = 0.0, 0.0
        for i in range(striker, last + 1):
            shared = approach[i]
            if i > striker:
                shared += cross[i] * forces[i - 1]
            if i < last:
                shared += cross[i + 1] * forces[i + 1]
            if chains.spring[i] != 0.0:
                shared = overlap_on_spring(law, i, shared, chains.spring[i])
            push = force(law, i, shared)
            change, largest = max(change, abs(push - forces[i])), max(largest, push)
            overlaps[i], forces[i] = shared, push
        if not change > 1e-13 * largest:
            break
