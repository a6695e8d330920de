"""Recorders as pieces: what of a run is kept at a saved time."""

from typing import Any, NamedTuple

from coupling.kernels.records import Records, record_type
from particles.kernels.motion import contact_forces, deepen, energies
from structures.kernels.arrays import copy
from structures.kernels.compiling import entry, inner
from structures.kernels.linear import energies_of_structure
from structures.kernels.pieces import by_type, for_each
from structures.structure import Vector


@by_type
def record(
    recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
) -> None:
    """Put the state at time t, s, into the row of a saved time.

    begin: C + 1 rows, the first coordinate, the first contact and the first body of each chain. work: of chains.
    """
    raise NotImplementedError


@by_type
def reads_structure(recorder: Any, row: int) -> bool:
    """Return whether a recorder reads the state of the structures for a row."""
    return True


CHAIN_FRAME = record_type("kinetic", "potential", "lost", "driven")
"""Energies of a chain, J."""

CONTACT_FRAME = record_type("surface", "work", "given", "impulse")
"""Of a contact: displacement of the surface, m; works, J, and impulse, N s, since the start."""

STRUCTURE_FRAME = record_type("kinetic", "elastic", "taken")
"""Energies of a structure, J, and what its damping took; NaN where not known."""

TIME_FRAME = record_type("evaluations", "windows", "residual")
"""Since the last saved time: windows of the chains that were tried, windows, and the greatest residual, N."""


class Sensors(NamedTuple):
    """The forces of some contacts and the velocities of some bodies, chain after chain."""

    contact: Vector
    """The numbers of the contacts in their chains, counted from zero."""
    body: Vector
    """The numbers of the bodies; behind those of all bodies come those of modes and arms."""
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
        return False

    @staticmethod
    def record(
        recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
    ) -> None:
        record_sensors(chains, 0, recorder, row, t, run, begin, work)
        for k in range(run.contact.size):
            if abs(run.contact[k].surface) > recorder.highest[k]:
                recorder.highest[k] = abs(run.contact[k].surface)


@inner()
def record_sensors_of(
    chain: Any, c: int, recorder: Any, row: int, t: float, run: Any, begin: Vector, work: Vector
) -> None:
    """Fill forces and velocities of chain c."""
    first, last, k, columns, end = begin[c, 0], begin[c + 1, 0], begin[c, 1], recorder.begin[c], recorder.begin[c + 1]
    y, v, surface, rate = run.y[first:last], run.v[first:last], run.contact[k].surface, 0.0
    if run.totals[0].remembered > 0:
        rate = (surface - run.node[1, k].surface) / run.window[0].length
    contacts, forces = recorder.contact[columns[0] : end[0]], recorder.force[row, columns[0] : end[0]]
    contact_forces(chain, y, v, t, surface, rate, contacts, forces, work[:, first:last])
    for j in range(columns[1], end[1]):
        recorder.velocity[row, j] = v[recorder.body[j]]
    deepen(y, surface, recorder.deepest[begin[c, 2] : begin[c + 1, 2]])


record_sensors = for_each(record_sensors_of)


class Ledger(NamedTuple):
    """Positions and energies."""

    every: int
    """Saved times from one row to the next."""
    position: Vector
    """Rows × coordinates of all chains, one after the other."""
    chain: Records
    """C × rows records CHAIN_FRAME."""
    contact: Records
    """K × rows records CONTACT_FRAME."""
    structure: Records
    """S × rows records STRUCTURE_FRAME."""
    time: Records
    """Rows of records TIME_FRAME."""


class SensorsAndLedger(NamedTuple):
    """The frames that a run keeps at all its saved times, and at some of them."""

    sensors: Sensors
    ledger: Ledger

    @staticmethod
    def reads_structure(recorder: Any, row: int) -> bool:
        return row % recorder.ledger.every == 0

    @staticmethod
    def record(
        recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
    ) -> None:
        record(recorder.sensors, row, t, run, chains, structure, begin, work)
        if reads_structure(recorder, row):
            enter(recorder.ledger, row // recorder.ledger.every, run, chains, structure, begin, work)


@inner()
def enter(ledger: Any, row: int, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector) -> None:
    """Fill a row of the ledger."""
    copy(run.y, ledger.position[row])
    enter_chains(chains, 0, ledger, row, run, begin, work)
    for s in range(ledger.structure.shape[0]):
        frame = ledger.structure[s, row]
        frame.kinetic, frame.elastic = energies_of_structure(structure, s, run.body)
    for k in range(run.contact.size):
        seen, contact = ledger.contact[k, row], run.contact[k]
        seen.surface, seen.work = contact.surface, contact.work
        seen.given, seen.impulse = contact.given, contact.impulse
    totals, now = run.totals[0], ledger.time[row]
    now.evaluations, now.windows, now.residual = totals.tried, totals.windows, totals.residual
    totals.tried, totals.windows, totals.residual = 0, 0, 0.0


@inner()
def enter_chain(chain: Any, c: int, ledger: Any, row: int, run: Any, begin: Vector, work: Vector) -> None:
    """Fill the energies of chain c."""
    first, last, frame = begin[c, 0], begin[c + 1, 0], ledger.chain[c, row]
    y, v, surface = run.y[first:last], run.v[first:last], run.contact[begin[c, 1]].surface
    frame.kinetic, frame.potential = energies(chain, y, v, surface, work[:, first:last])
    frame.lost, frame.driven = run.chain[c].lost, run.chain[c].driven


enter_chains = for_each(enter_chain)
record_row = entry(SensorsAndLedger.record)
"""`record` for Python."""


class Elsewhere(NamedTuple):
    """Structures that Python moves, and whose energies it enters."""

    @staticmethod
    def energies_of_structure(structure: Any, s: int, state: Vector) -> tuple[float, float]:
        return 0.0, 0.0
