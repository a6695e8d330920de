"""Recorders as pieces: what of a run is kept at a saved time."""

from typing import Any, NamedTuple

from particles.kernels.chain import contact_forces, energies
from structures.kernel_cache import inner
from structures.kernels.gaps import copy
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


class Everything(NamedTuple):
    """All motion, forces and energies: a row for each saved time, or a column where arrays begin with a number."""

    position: Vector
    """Of all chains, one after the other; so are the next two."""
    velocity: Vector
    contact_force: Vector
    kinetic: Vector
    """C × saved times, energies of the chains, J; so are the next three."""
    potential: Vector
    lost: Vector
    driven: Vector
    surface: Vector
    """K × saved times, displacement of the surfaces, m."""
    work: Vector
    """Work on the structures, J."""
    given: Vector
    """Work of the chains, J."""
    impulse: Vector
    structure_kinetic: Vector
    """S × saved times, energies of the structures, J; so is the next one."""
    structure_elastic: Vector
    evaluations: Vector
    """Windows of the chains that were tried since the last saved time."""
    substeps: Vector
    residual: Vector
    """Greatest residual since then, N."""
    taken: Vector
    """S × saved times: what the damping of structures and the closing of their gaps took, J; NaN where not known."""

    @staticmethod
    def record(
        recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
    ) -> None:
        """Fill a row of everything."""
        copy(run.y, recorder.position[row])
        copy(run.v, recorder.velocity[row])
        record_chains(chains, 0, recorder, row, t, run, begin, work)
        for s in range(recorder.structure_kinetic.shape[0]):
            kinetic, elastic = energies_of_structure(structure, s, run.body)
            recorder.structure_kinetic[s, row], recorder.structure_elastic[s, row] = kinetic, elastic
        for k in range(run.work.size):
            recorder.surface[k, row], recorder.work[k, row] = run.surface[k], run.work[k]
            recorder.given[k, row], recorder.impulse[k, row] = run.given[k], run.impulse[k]
        if run.pressed.size > 0:
            recorder.taken[0, row] = run.taken[0]
        recorder.evaluations[row], recorder.substeps[row] = run.counts[1], run.counts[2]
        recorder.residual[row] = run.residual[0]
        run.counts[1], run.counts[2], run.residual[0] = 0, 0, 0.0


@inner()
def record_chain(chain: Any, c: int, recorder: Any, row: int, t: float, run: Any, begin: Vector, work: Vector) -> None:
    """Fill forces and energies of chain c."""
    first, last, k = begin[c, 0], begin[c + 1, 0], begin[c, 1]
    y, v, wall = run.y[first:last], run.v[first:last], run.surface[k]
    scratch = work[:, first:last]
    forces = recorder.contact_force[row, begin[c, 2] : begin[c + 1, 2]]
    contact_forces(chain, y, v, t, wall, rate_of(run, k), forces, scratch)
    recorder.kinetic[c, row], recorder.potential[c, row] = energies(chain, y, v, wall, scratch)
    recorder.lost[c, row], recorder.driven[c, row] = run.lost[c], run.driven[c]


record_chains = for_each(record_chain)


@inner()
def rate_of(run: Any, k: int) -> float:
    """Return the velocity of a surface over the last window, m/s."""
    return (run.surface[k] - run.node_surface[1, k]) / run.node_length[0] if run.counts[0] > 0 else 0.0


class Traces(NamedTuple):
    """Velocities, contact forces and surfaces of one chain: a row for each saved time, a column for surfaces."""

    velocity: Vector
    """m/s."""
    contact_force: Vector
    """N."""
    surface: Vector
    """m."""

    @staticmethod
    def record(
        recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
    ) -> None:
        """Fill a row of the traces."""
        copy(run.v, recorder.velocity[row])
        for k in range(run.surface.size):
            recorder.surface[k, row] = run.surface[k]
        forces = recorder.contact_force[row]
        contact_forces(chains[0], run.y, run.v, t, run.surface[0], rate_of(run, 0), forces, work)
