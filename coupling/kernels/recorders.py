"""The recorder: it keeps parts of a run at saved times."""

from typing import Any, NamedTuple

from coupling.kernels.records import Records, record_type
from particles.kernels.motion import contact_forces, energies
from structures.kernels.arrays import copy
from structures.kernels.compiling import entry, inner
from structures.kernels.linear import energies_of_structure
from structures.structure import Vector

CHAIN_FRAME = record_type("kinetic", "potential", "lost", "driven")
"""Energies of a chain, J."""

CONTACT_FRAME = record_type("surface", "work", "given", "impulse")
"""Displacement of a contact's surface, m; works, J, and impulse, N s, since the start."""

STRUCTURE_FRAME = record_type("kinetic", "elastic", "taken")
"""Energies of a structure, and the energy that its damping took, J; NaN if not known."""

TIME_FRAME = record_type("evaluations", "windows", "residual")
"""Number of trials and of windows, and greatest residual, N, since the last saved time."""


class Recorder(NamedTuple):
    """The frames that a run keeps: forces and velocities at all saved times, and the ledger at some of them."""

    contact: Vector  # the numbers of the contacts that are kept, counted from zero over all chains
    body: Vector  # the numbers of the velocities that are kept; modes follow the bodies
    force: Vector  # saved times × contacts, N
    velocity: Vector  # saved times × bodies, m/s
    deepest: Vector  # the greatest approach of each contact at a saved time so far, m
    surface: Vector
    """3 × K: displacements of the surfaces, m; their velocities; the greatest displacements so far, without sign."""
    every: int  # saved times from one row of the ledger to the next
    position: Vector  # rows × coordinates of all chains, one after the other
    chain: Records  # C × rows records CHAIN_FRAME
    work: Records  # K × rows records CONTACT_FRAME
    structure: Records  # S × rows records STRUCTURE_FRAME
    time: Records  # rows of records TIME_FRAME


@inner(forceinline=True)
def record(recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, work: Vector) -> None:
    """Save the state at time t, s, in a row. work: work space of the chains."""
    surface, rate, highest = recorder.surface
    for k in range(surface.size):
        surface[k], rate[k] = run.contact[k].surface, 0.0
        if run.totals[0].remembered > 0:
            rate[k] = (surface[k] - run.node[1, k].surface) / run.window[0].length
        highest[k] = max(highest[k], abs(surface[k]))
    contact_forces(chains, run.y, run.v, t, surface, rate, recorder.contact, recorder.force[row], work)
    for j in range(recorder.body.size):
        recorder.velocity[row, j] = run.v[recorder.body[j]]
    for i in range(recorder.deepest.size):
        k = chains.wall[i]
        approach = run.y[i] - (run.y[i + 1] if k < 0 else surface[k])
        recorder.deepest[i] = approach if approach > recorder.deepest[i] else recorder.deepest[i]
    if row % recorder.every > 0:
        return

    row = row // recorder.every
    copy(run.y, recorder.position[row])
    for c in range(recorder.chain.shape[0]):
        frame, wall = recorder.chain[c, row], surface[chains.wall[chains.ends[c].last]]
        frame.kinetic, frame.potential = energies(chains, c, run.y, run.v, wall, work)
        frame.lost, frame.driven = run.chain[c].lost, run.chain[c].driven
    for s in range(recorder.structure.shape[0]):
        body = recorder.structure[s, row]
        body.kinetic, body.elastic = energies_of_structure(structure, s, run.body)
    for k in range(surface.size):
        seen, contact = recorder.work[k, row], run.contact[k]
        seen.surface, seen.work = contact.surface, contact.work
        seen.given, seen.impulse = contact.given, contact.impulse
    totals, now = run.totals[0], recorder.time[row]
    now.evaluations, now.windows, now.residual = totals.tried, totals.windows, totals.residual
    totals.tried, totals.windows, totals.residual = 0, 0, 0.0


record_row = entry(record)
"""`record` for Python."""
