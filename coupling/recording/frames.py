"""The arrays that a run fills, one row for each saved time."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from coupling.interface import Interface
from coupling.kernels.recorders import (
    CHAIN_FRAME,
    CONTACT_FRAME,
    STRUCTURE_FRAME,
    TIME_FRAME,
    Everything,
    Sensors,
    SensorsWithEnds,
)
from coupling.kernels.state import Records
from coupling.state import CoupledState
from particles.kernels import chain as kernels
from particles.moving import MovingChain
from structures.checks import listed, whole
from structures.moving import MovingStructure
from structures.structure import Vector


class Counts(NamedTuple):
    """Since the last saved time: chain windows tried, substeps, and the greatest residual (N)."""

    evaluations: int = 0
    substeps: int = 0
    residual: float = 0.0

    def after(self, state: CoupledState) -> "Counts":
        """With one more substep, or its parts, which ended in this state."""
        return Counts(
            self.evaluations + state.evaluations,
            self.substeps + state.substeps,
            max(self.residual, state.residual),
        )


class ChainFrames(NamedTuple):
    """The saved times of one chain.

    position (m) and velocity (m/s): saved times × coordinates, first those of the bodies; contact_force (N): saved
    times × bodies; energy: records CHAIN_FRAME.
    """

    position: Vector
    velocity: Vector
    contact_force: Vector
    energy: Records


BLOCK = 64
"""Saved times whose maximum is taken at once: five times faster than row by row."""


class Motion(NamedTuple):
    """What the checks after a run see of a chain.

    contacts: the numbers of some contacts, from zero; force: their forces at the saved times, N. velocity: of the bead
    in the middle, m/s, None where the beads take no law of contacts. peaks: the greatest force of each contact, N;
    deepest: its greatest approach, m.
    """

    contacts: Sequence[int]
    force: Vector
    velocity: Vector | None
    peaks: Vector
    deepest: Vector

    def at(self, contact: int) -> Vector:
        """The forces of a contact, N; a negative number counts from the last one."""
        force: Vector = self.force[:, self.contacts.index(contact % self.peaks.size)]
        return force


def middle_of(chain: MovingChain) -> int:
    """The number of the bead in the middle of a chain."""
    return (len(chain.chain.beads) + 1) // 2


def greatest(values: Vector) -> Vector:
    """The greatest value of each column; in blocks of rows, which is five times faster than rows one by one."""
    whole_blocks = len(values) // BLOCK * BLOCK
    rest: Vector = values[whole_blocks:].max(axis=0, initial=-np.inf)
    blocks = values[:whole_blocks].reshape(BLOCK, -1).max(axis=0, initial=-np.inf).reshape(-1, values.shape[1])
    result: Vector = np.maximum(rest, blocks.max(axis=0, initial=-np.inf))
    return result


class Frames:
    """Saved times from row 0, the start, on.

    saved: all arrays, as the compiled window loop fills them; energies of structures are NaN where not known. contact:
    its records of contacts. chains: the parts of each chain.
    """

    def __init__(self, interface: Interface, rows: int) -> None:
        self.rows = rows
        ends = np.cumsum([(0, 0)] + [(chain.rest.size, chain.mass.size) for chain in interface.chains], axis=0)
        coordinates, bodies = ends[-1]
        velocity, force = np.zeros((rows, coordinates)), np.zeros((rows, bodies))
        contacts, chains, structures = interface.size, len(interface.chains), len(interface.structures)
        self.saved = Everything(
            np.zeros((rows, coordinates)),
            velocity,
            force,
            np.zeros((chains, rows), CHAIN_FRAME),
            np.zeros((contacts, rows), CONTACT_FRAME),
            np.zeros((structures, rows), STRUCTURE_FRAME),
            np.zeros(rows, TIME_FRAME),
        )
        self.contact = self.saved.contact
        self.chains = [
            ChainFrames(
                self.saved.position[:, place:end],
                velocity[:, place:end],
                force[:, body:last],
                self.saved.chain[number],
            )
            for number, ((place, body), (end, last)) in enumerate(pairwise(ends))
        ]

    @property
    def ledger(self) -> "Frames":
        """The frames with the energies."""
        return self

    @property
    def highest(self) -> Vector:
        """The greatest displacement of each surface, m, without sign."""
        return np.asarray(abs(self.contact["surface"]).max(axis=1), float)

    def motions(self, interface: Interface) -> list["Motion"]:
        """What the checks see of each chain."""
        return [self._motion(interface, number) for number in range(len(self.chains))]

    def _motion(self, interface: Interface, number: int) -> "Motion":
        chain, own, seat = interface.chains[number], self.chains[number], interface.of_chain[number][0]
        place, peaks = own.position[:, : chain.mass.size], greatest(own.contact_force)
        last = float((place[:, -1] - self.contact["surface"][seat]).max())
        deepest = np.append(greatest(place[:, :-1] - place[:, 1:]), last - chain.flexibility * peaks[-1])
        return Motion(range(peaks.size), own.contact_force, own.velocity[:, middle_of(chain)], peaks, deepest)

    def record(self, interface: Interface, row: int, state: CoupledState, counts: Counts, length: float) -> None:
        """Put a state into a row. length, s: of a substep."""
        past = state.past
        for number, (chain, into) in enumerate(zip(interface.chains, self.chains, strict=True)):
            y, v, lost, time, driven = state.chains[number]
            seat = interface.of_chain[number][0]
            wall, rate = float(state.surface[seat]), 0.0
            if past:
                rate = (wall - float(past[-2].surface[seat] if len(past) > 1 else 0.0)) / past[-1].length
            work, forces = chain.work_space(), into.contact_force[row]
            kernels.forces_of_chain(chain.model, y, v, time, wall, rate, forces, work)
            into.energy[row] = *kernels.energies_of_chain(chain.model, y, v, wall, work), lost, driven
            into.position[row], into.velocity[row] = y, v
        saved = self.saved
        for number, structure in enumerate(interface.structures):
            now = state.structures[number]
            if isinstance(structure, MovingStructure):
                energies = structure.energies(now, length, interface.at(number, state.force))
                lost = state.ledger.damped[number]
            else:
                *energies, lost = structure.energies(now)
            saved.structure[number, row] = *energies, lost
        saved.contact[:, row] = list(zip(state.surface, *state.ledger[:3], strict=True))
        saved.time[row] = counts

    def count_damping(self, interface: Interface) -> None:
        """What the damping of linear structures took: the part of the work that is not in their energy.

        The midpoint rule keeps that identity.
        """
        for place in interface.damped:
            work, frames = self.contact["work"][interface.touched_by(place)].sum(axis=0), self.saved.structure[place]
            frames["taken"] = work - frames["kinetic"] - frames["elastic"]

    def upto(self, row: int) -> list[Vector]:
        """Everything up to a row, for a checkpoint: views, as copies of a long run may not fit in memory."""
        *tall, chain, contact, structure, time = self.saved
        return [*(one[: row + 1] for one in (*tall, time)), *(one[:, : row + 1] for one in (chain, contact, structure))]

    def restore(self, row: int, kept: list[Vector]) -> None:
        """Restore what `upto` returned for a row; a ValueError where it does not fit."""
        _restore(self.upto(row), kept)


def _restore(places: list[Vector], kept: list[Vector]) -> None:
    for place, values in zip(places, kept, strict=True):
        if not isinstance(values, np.ndarray) or values.shape != place.shape or values.dtype != place.dtype:
            raise ValueError("frames: have another shape")
        place[...] = values


class Kept(NamedTuple):
    """What is kept of each chain: the numbers of contacts and of bodies, both counted from zero."""

    contacts: list[int]
    bodies: list[int]


def kept_at(sensors: Iterable[int] | None, beads: int) -> Kept:
    """What is kept at sensors, None for all beads, of chains whose shortest has so many; a ValueError for others."""
    if sensors is None:
        return Kept([*range(beads + 1)], [*range(beads + 1)])
    numbers = sorted({whole("sensors", n) for n in listed("sensors", sensors, object, "one bead number or more")})
    if numbers[-1] > beads:
        raise ValueError(f"sensors = {numbers!r}: must be beads from 1 to {beads}, counted from the struck end")
    return Kept(sorted({n - 1 for n in numbers} | set(numbers)), numbers)


class SensorFrames:
    """Saved times of sensors alone; all of a run is saved at its begin and its end, in `ledger`.

    Of each chain first come the contacts and bodies that are kept, then those that the checks after the run need: the
    last contact, those of the bead in the middle, and its velocity; all contacts where losses, yield or vibrations
    prevent their peaks from being known by their deepest approach.
    """

    def __init__(self, interface: Interface, rows: int, kept: Kept) -> None:
        self.rows, self.kept, self.ledger = rows, kept, Frames(interface, 2)
        columns = [_columns(chain, kept) for chain in interface.chains]
        self.begin = np.cumsum([(0, 0), *((len(one.contacts), len(one.bodies)) for one in columns)], axis=0)
        contacts, bodies = self.begin[-1]
        self.sensors = Sensors(
            np.array([i for one in columns for i in one.contacts]),
            np.array([i for one in columns for i in one.bodies]),
            self.begin,
            np.zeros((rows, contacts)),
            np.zeros((rows, bodies)),
            np.full(sum(chain.mass.size for chain in interface.chains), -np.inf),
            np.zeros(interface.size),
        )
        self.saved = SensorsWithEnds(self.sensors, self.ledger.saved)

    def clear(self) -> "SensorFrames":
        """Forget an earlier run but for its rows, which the next one overwrites."""
        self.sensors.deepest[:], self.sensors.highest[:] = -np.inf, 0.0
        self.ledger.saved.structure["taken"] = 0.0
        return self

    @property
    def highest(self) -> Vector:
        """The greatest displacement of each surface, m, without sign."""
        return self.sensors.highest

    def of_chain(self, number: int) -> tuple[Vector, Vector]:
        """The forces (N) and velocities (m/s) that are kept of a chain, saved times × contacts or bodies."""
        (contact, body), (contacts, bodies) = self.begin[number], map(len, self.kept)
        return self.sensors.force[:, contact : contact + contacts], self.sensors.velocity[:, body : body + bodies]

    def motions(self, interface: Interface) -> list[Motion]:
        """What the checks see of each chain."""
        found, place = [], 0
        for number, chain in enumerate(interface.chains):
            (begin, body), (end, last) = self.begin[number], self.begin[number + 1]
            contacts, force = self.sensors.contact[begin:end].tolist(), self.sensors.force[:, begin:end]
            deepest = self.sensors.deepest[place : place + chain.mass.size].copy()
            peaks = chain.force(deepest)
            peaks[contacts] = greatest(force)
            deepest[-1] -= chain.flexibility * peaks[-1]
            bodies = self.sensors.body[body:last].tolist()
            velocity = self.sensors.velocity[:, body + bodies.index(middle_of(chain))]
            found.append(Motion(contacts, force, velocity, peaks, deepest))
            place += chain.mass.size
        return found

    def record(self, interface: Interface, row: int, state: CoupledState, counts: Counts, length: float) -> None:
        """Put a state into a row. length, s: of a substep."""
        last = row == self.rows - 1
        frames, at = (self.ledger, int(last)) if row == 0 or last else (Frames(interface, 1), 0)
        frames.record(interface, at, state, counts, length)
        saved, places = self.sensors, np.cumsum([0, *(chain.mass.size for chain in interface.chains)])
        for number, one in enumerate(frames.chains):
            (contact, body), (end, until) = self.begin[number], self.begin[number + 1]
            saved.force[row, contact:end] = one.contact_force[at, saved.contact[contact:end]]
            saved.velocity[row, body:until] = one.velocity[at, saved.body[body:until]]
            place, wall = one.position[at, : one.contact_force.shape[1]], state.surface[interface.of_chain[number][0]]
            deepest = saved.deepest[places[number] : places[number + 1]]
            np.maximum(deepest, place - np.append(place[1:], wall), out=deepest)
        np.maximum(saved.highest, abs(state.surface), out=saved.highest)

    def count_damping(self, interface: Interface) -> None:
        """What the damping of linear structures took, see `Frames`."""
        self.ledger.count_damping(interface)

    def upto(self, row: int) -> list[Vector]:
        """Everything up to a row, for a checkpoint, see `Frames`."""
        _, _, _, force, velocity, *greatest_so_far = self.sensors
        return [force[: row + 1], velocity[: row + 1], *greatest_so_far, *self.ledger.upto(1)]

    def restore(self, row: int, kept: list[Vector]) -> None:
        """Restore what `upto` returned for a row; a ValueError where it does not fit."""
        _restore(self.upto(row), kept)


def _columns(chain: MovingChain, kept: Kept) -> Kept:
    """The contacts and bodies of a chain that are recorded."""
    middle, last = middle_of(chain), chain.mass.size - 1
    contacts = [middle - 1, middle, last, *([0] if chain.behind is not None else [])]
    if not chain.force_by_approach:
        contacts = [*range(last + 1)]
    return Kept(
        [*kept.contacts, *sorted(set(contacts) - set(kept.contacts))],
        [*kept.bodies, *({middle} - set(kept.bodies))],
    )


def frames_of(interface: Interface, rows: int, kept: Kept | None) -> Frames | SensorFrames:
    """The frames of a run that keeps this of each chain, everything where None."""
    return Frames(interface, rows) if kept is None else SensorFrames(interface, rows, kept)
