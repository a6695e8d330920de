"""Contacts between bodies that may vibrate."""

from typing import Any, NamedTuple

from particles.kernels.laws import energy, force
from particles.kernels.losses import force_and_loss, overlap_at
from structures.kernels.compiling import inner
from structures.structure import Vector

MOST_SWEEPS = 200  # over contacts that are coupled through their bodies


class Vibrations(NamedTuple):
    """The modes of bodies (see particles.deformable.vibration): a row for each of the B bodies, a column for each mode.

    There are no columns if all bodies are rigid. In addition to the modes, a force on one pole moves the other pole at
    once and presses its contact. So `settle` finds all forces together.
    """

    stiffness: Vector  # squares of the angular frequencies, 1/s²
    struck: Vector  # motion of the struck pole, 1/√kg
    far: Vector  # motion of the other pole, 1/√kg
    rate: Vector  # c of the loss c q′, 1/s
    cross: Vector  # B: the immediate motion of one pole due to a force on the other, m/N


@inner(forceinline=True)
def between_poles(chains: Any, y: Vector, i: int, last: int, wall: float) -> float:
    """Return the approach of contact i between the poles of its bodies, m; from velocities, its rate."""
    struck, far = chains.vibrations.struck, chains.vibrations.far
    bodies, modes = struck.shape
    distance, ahead = y[i], wall
    for k in range(modes):
        distance += far[i, k] * y[bodies + i * modes + k]
    if i < last:
        ahead = y[i + 1]
        for k in range(modes):
            ahead += struck[i + 1, k] * y[bodies + (i + 1) * modes + k]
    return distance - ahead


@inner()
def settle(chains: Any, law: Any, c: int, y: Vector, wall: float, forces: Vector, work: Vector) -> None:
    """Find the elastic forces of all contacts of chain c, N, by Gauss–Seidel sweeps that start at the last forces.
    work: two rows, for the approaches between poles and the overlaps, m.
    """
    striker, last, cross = chains.ends[c].striker, chains.ends[c].last, chains.vibrations.cross
    approach, overlaps, rigid = work[0], work[1], chains.vibrations.struck.shape[1] == 0
    for i in range(striker, last + 1):
        approach[i] = between_poles(chains, y, i, last, wall)
        if rigid:
            overlaps[i] = overlap_at(law, i, approach[i], chains.spring[i])
            forces[i] = force(law, i, overlaps[i])
    for _ in range(0 if rigid else MOST_SWEEPS):
        change, largest = 0.0, 0.0
        for i in range(striker, last + 1):
            shared = approach[i]
            if i > striker:
                shared += cross[i] * forces[i - 1]
            if i < last:
                shared += cross[i + 1] * forces[i + 1]
            shared = overlap_at(law, i, shared, chains.spring[i])
            push = force(law, i, shared)
            change, largest = max(change, abs(push - forces[i])), max(largest, push)
            overlaps[i], forces[i] = shared, push
        if not change > 1e-13 * largest:
            break


@inner()
def forces_between(
    chains: Any, law: Any, c: int, y: Vector, v: Vector, wall: float, rate: float, forces: Vector, work: Vector
) -> float:
    """Write the forces of all contacts of chain c to `forces`, N; return the power of their losses, W. Losses depend on
    the rate of approach of the poles. forces, work: as in `settle`.
    """
    last, power = chains.ends[c].last, 0.0
    settle(chains, law, c, y, wall, forces, work)
    for i in range(chains.ends[c].striker, last + 1):
        closing, flexibility = between_poles(chains, v, i, last, rate), chains.spring[i]
        forces[i], taken = force_and_loss(law, chains.loss, i, work[0, i], work[1, i], forces[i], closing, flexibility)
        power += taken
    return power


@inner(fastmath={"contract", "reassoc"})
def energies_between(
    chains: Any, law: Any, c: int, y: Vector, v: Vector, wall: float, forces: Vector, work: Vector
) -> tuple[float, float]:
    """Return the kinetic energy of the modes of chain c, and the elastic energy of its contacts and modes, J."""
    vibrations, striker = chains.vibrations, chains.ends[c].striker
    bodies, modes = vibrations.struck.shape
    kinetic, potential = 0.0, 0.0
    settle(chains, law, c, y, wall, forces, work)
    for i in range(striker, chains.ends[c].last + 1):
        potential += energy(law, i, work[1, i]) + 0.5 * chains.spring[i] * forces[i] * forces[i]
        if i > striker:
            potential -= vibrations.cross[i] * forces[i - 1] * forces[i]
        for k in range(modes):
            q = bodies + i * modes + k
            kinetic += 0.5 * v[q] * v[q]
            potential += 0.5 * vibrations.stiffness[i, k] * y[q] * y[q]
    return kinetic, potential
