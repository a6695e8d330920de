"""Recorders as pieces: what of a run is kept at a saved time."""

from typing import Any, NamedTuple

from coupling.kernels.state import Records, record_type
from particles.kernels.chain import contact_forces, deepen, energies, some_forces
from structures.kernel_cache import inner
from structures.kernels.arrays import copy
from structures.kernels.linear import energies_of_structure
from structures.kernels.pieces import by_type, for_each
from structures.structure import Vector


@by_type()
def record(
    recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
) -> None:
    """Put the state at time t, s, into a row.

    begin: C + 1 rows, the first coordinate, the first contact and the first body of each chain. work: of chains.
    """
    raise NotImplementedError


def _reads(recorder: Any, row: int) -> bool:
    return True


@by_type(_reads)
def reads_structure(recorder: Any, row: int) -> bool:
    """Return whether a recorder reads the state of the structures for a row."""
    raise NotImplementedError


CHAIN_FRAME = record_type("kinetic", "potential", "lost", "driven")
"""Energies of a chain, J."""

CONTACT_FRAME = record_type("surface", "work", "given", "impulse")
"""Of a contact: displacement of the surface, m; works, J, and impulse, N s, since the start."""

STRUCTURE_FRAME = record_type("kinetic", "elastic", "taken")
"""Energies of a structure, J, and what its damping and the closing of its gaps took; NaN where not known."""

TIME_FRAME = record_type("evaluations", "substeps", "residual")
"""Since the last saved time: windows of the chains that were tried, windows, and the greatest residual, N."""


class Everything(NamedTuple):
    """All motion, forces and energies."""

    position: Vector
    """Saved times × coordinates of all chains, one after the other; so is the next one."""
    velocity: Vector
    contact_force: Vector
    """Saved times × contacts of all chains."""
    chain: Records
    """C × saved times records CHAIN_FRAME."""
    contact: Records
    """K × saved times records CONTACT_FRAME."""
    structure: Records
    """S × saved times records STRUCTURE_FRAME."""
    time: Records
    """Saved times records TIME_FRAME."""

    @staticmethod
    def record(
        recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
    ) -> None:
        """Fill a row of everything."""
        record_everything(recorder, row, t, run, chains, structure, begin, work)


@inner()
def record_chain(chain: Any, c: int, recorder: Any, row: int, t: float, run: Any, begin: Vector, work: Vector) -> None:
    """Fill forces and energies of chain c."""
    first, last, k = begin[c, 0], begin[c + 1, 0], begin[c, 1]
    y, v, wall, frame = run.y[first:last], run.v[first:last], run.contact[k].surface, recorder.chain[c, row]
    forces = recorder.contact_force[row, begin[c, 2] : begin[c + 1, 2]]
    contact_forces(chain, y, v, t, wall, rate_of(run, k), forces, work[:, first:last])
    frame.kinetic, frame.potential = energies(chain, y, v, wall, work[:, first:last])
    frame.lost, frame.driven = run.chain[c].lost, run.chain[c].driven


record_chains = for_each(record_chain)


@inner()
def record_everything(
    recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
) -> None:
    """Fill a row of everything."""
    copy(run.y, recorder.position[row])
    copy(run.v, recorder.velocity[row])
    record_chains(chains, 0, recorder, row, t, run, begin, work)
    for s in range(recorder.structure.shape[0]):
        frame = recorder.structure[s, row]
        frame.kinetic, frame.elastic = energies_of_structure(structure, s, run.body)
        if run.pressed.size > 0:
            frame.taken = run.totals[0].taken
    for k in range(run.contact.size):
        seen, contact = recorder.contact[k, row], run.contact[k]
        seen.surface, seen.work = contact.surface, contact.work
        seen.given, seen.impulse = contact.given, contact.impulse
    totals, now = run.totals[0], recorder.time[row]
    now.evaluations, now.substeps, now.residual = totals.tried, totals.windows, totals.residual
    totals.tried, totals.windows, totals.residual = 0, 0, 0.0


@inner()
def rate_of(run: Any, k: int) -> float:
    """Return the velocity of a surface over the last window, m/s."""
    if run.totals[0].remembered == 0:
        return 0.0
    return (run.contact[k].surface - run.node[1, k].surface) / run.window[0].length


class Sensors(NamedTuple):
    """The forces of some contacts and the velocities of some bodies, chain after chain."""

    contact: Vector
    """The numbers of the contacts in their chains, counted from zero."""
    body: Vector
    """The numbers of the bodies."""
    begin: Vector
    """C + 1 rows: where the contacts and the bodies of each chain begin among them."""
    force: Vector
    """Saved times × contacts, N."""
    velocity: Vector
    """Saved times × bodies, m/s."""
    deepest: Vector
    """The greatest approach of each contact of all chains at a saved time so far, m."""
    highest: Vector
    """K: the greatest displacement of each surface at a saved time so far, m, without sign."""

    @staticmethod
    def reads_structure(recorder: Any, row: int) -> bool:
        """Return False."""
        return False

    @staticmethod
    def record(
        recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
    ) -> None:
        """Fill a row."""
        record_sensors(chains, 0, recorder, row, t, run, begin, work)
        for k in range(run.contact.size):
            recorder.highest[k] = max(recorder.highest[k], abs(run.contact[k].surface))


@inner()
def record_sensors_of(
    chain: Any, c: int, recorder: Any, row: int, t: float, run: Any, begin: Vector, work: Vector
) -> None:
    """Fill forces and velocities of chain c."""
    first, last, k, own, end = begin[c, 0], begin[c + 1, 0], begin[c, 1], recorder.begin[c], recorder.begin[c + 1]
    y, v, wall = run.y[first:last], run.v[first:last], run.contact[k].surface
    contacts, forces = recorder.contact[own[0] : end[0]], recorder.force[row, own[0] : end[0]]
    some_forces(chain, y, v, t, wall, rate_of(run, k), contacts, forces, work[:, first:last])
    for j in range(own[1], end[1]):
        recorder.velocity[row, j] = v[recorder.body[j]]
    deepen(y, wall, recorder.deepest[begin[c, 2] : begin[c + 1, 2]])


record_sensors = for_each(record_sensors_of)


class SensorsWithEnds(NamedTuple):
    """Sensors at all saved times, and everything at the first and the last one."""

    sensors: Sensors
    ends: Everything

    @staticmethod
    def reads_structure(recorder: Any, row: int) -> bool:
        """Return whether the row is the first or the last one."""
        return row == 0 or row == recorder.sensors.force.shape[0] - 1

    @staticmethod
    def record(
        recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
    ) -> None:
        """Fill a row."""
        record(recorder.sensors, row, t, run, chains, structure, begin, work)
        if reads_structure(recorder, row):
            record_everything(recorder.ends, min(row, 1), t, run, chains, structure, begin, work)
