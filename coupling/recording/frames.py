"""Frames: the arrays that a run fills at its saved times."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from coupling.interface import Interface
from coupling.kernels.recorders import CHAIN_FRAME, CONTACT_FRAME, STRUCTURE_FRAME, TIME_FRAME, Recorder
from coupling.kernels.records import Records
from structures.checks import listed, whole
from structures.structure import Vector


class Kept(NamedTuple):
    """The contacts and the bodies of each chain that are kept, by their numbers from zero."""

    contacts: list[int]
    bodies: list[int]


def kept_at(sensors: Iterable[int] | None, beads: int) -> Kept:
    """Return what is kept for sensors (None: all beads); raise a ValueError for a sensor that is not a bead of the
    shortest chain, which has `beads`. The last contact is kept, as it shows when a wave reaches the structure."""
    if sensors is None:
        return Kept([*range(beads + 1)], [*range(beads + 1)])
    numbers = sorted({whole("sensors", n) for n in listed("sensors", sensors, object, "one bead number or more")})
    if numbers[-1] > beads:
        raise ValueError(f"sensors = {numbers!r}: must be beads from 1 to {beads}, counted from the struck end")
    return Kept(sorted({n - 1 for n in numbers} | set(numbers) | {beads}), numbers)


class ChainFrames(NamedTuple):
    """The frames of one chain."""

    force: Vector  # saved times × contacts, N
    velocity: Vector  # saved times × bodies that are kept, m/s
    deepest: Vector  # the greatest approach of each contact, m
    position: Vector  # rows of the ledger × coordinates, m; the bodies come first
    energy: Records  # records CHAIN_FRAME of these rows


class Motion(NamedTuple):
    """The motion of a chain in a run, for the checks after the run."""

    force: Vector  # contacts × saved times, N
    deepest: Vector  # the greatest approach of each contact, m


class Frames:
    """Frames of a run at its saved times, from the start in row 0 on; the ledger at all of them, or at both ends. kept:
    what is kept of each chain; None for everything. The forces of all contacts are saved, because the checks after the
    run need them. saved: all arrays, which the compiled loop fills; unknown energies of structures are NaN."""

    def __init__(self, interface: Interface, rows: int, kept: Kept | None = None) -> None:
        self.rows, self.kept, self.places, self.contacts = rows, kept, interface.places, interface.bodies
        numbers = np.arange(interface.coordinates)
        bodies = [numbers[place] if kept is None else numbers[place][kept.bodies] for place in self.places]
        self.ends = np.cumsum([len(of_chain) for of_chain in bodies])
        every = 1 if kept is None else max(rows - 1, 1)
        count, entries, size = self.contacts[-1].stop, (rows - 1) // every + 1, interface.size
        self.saved = Recorder(
            np.arange(count),
            np.concatenate(bodies),
            np.zeros((rows, count)),
            np.zeros((rows, self.ends[-1])),
            np.full(count, -np.inf),
            np.zeros((3, size)),
            every,
            np.zeros((entries, interface.coordinates)),
            np.zeros((len(interface.chains), entries), CHAIN_FRAME),
            np.zeros((size, entries), CONTACT_FRAME),
            np.zeros((len(interface.structures), entries), STRUCTURE_FRAME),
            np.zeros(entries, TIME_FRAME),
        )

    @property
    def chains(self) -> list[ChainFrames]:
        """The frames of each chain."""
        saved = self.saved
        velocities = np.split(saved.velocity, self.ends[:-1], axis=1)
        return [
            ChainFrames(saved.force[:, own], velocity, saved.deepest[own], saved.position[:, place], energy)
            for own, velocity, place, energy in zip(self.contacts, velocities, self.places, saved.chain, strict=True)
        ]
