"""Many runs that differ in numbers only, one after the other on a processor, or one in each thread of a GPU."""

from typing import Any, NamedTuple

from coupling.kernels.loop import move_on
from coupling.kernels.records import Run
from structures.kernels.families import of_run
from structures.kernels.kernel_cache import entry, inner
from structures.structure import Vector


class Family(NamedTuple):
    """The arguments of the loop for all runs, see `move_on`; what differs between runs lies in Rows or Columns."""

    run: Any
    chains: Any
    structure: Any
    contacts: Any
    search: Any
    recorder: Any
    trial: Any
    rest: Vector
    """Positions at time zero, m."""
    speed: Any
    """Speed of the body that moves then, m/s."""


@inner()
def start(run: Run, rest: Vector, speed: float, moving: int) -> None:
    """Put a run into its state at time zero: at rest but for one body."""
    for i in range(rest.size):
        run.y[i], run.v[i] = rest[i], 0.0
    run.v[moving] = speed
    for i in range(run.body.size):
        run.body[i] = 0.0
    for k in range(run.contact.size):
        contact = run.contact[k]
        contact.surface, contact.slope, contact.work, contact.given = 0.0, 0.0, 0.0, 0.0
        contact.impulse, contact.pending = 0.0, 0.0
        for i in range(run.node.shape[0]):
            run.node[i, k].surface, run.node[i, k].force = 0.0, 0.0
    for c in range(run.chain.size):
        run.chain[c].lost, run.chain[c].driven = 0.0, 0.0
    for i in range(run.window.size):
        run.window[i].middle, run.window[i].length = 0.0, 0.0
    totals = run.totals[0]
    totals.remembered, totals.tried, totals.windows, totals.residual, totals.taken = 0, 0, 0, 0.0, 0.0


@inner()
def do_run(
    family: Any, number: int, moving: int, begin: Vector, window: float, windows: tuple[int, int, int, int],
    ended: Vector,
) -> None:  # fmt: skip
    """Do one run of a family from time zero on, and put into `ended` how it ended, see `move_on`.

    moving: the body that moves at time zero.
    """
    task = of_run(family, number)
    start(task.run, task.rest, task.speed, moving)
    ended[number] = move_on(
        task.run, task.chains, task.structure, task.contacts, task.search, task.recorder, task.trial, begin, window,
        windows,
    )[0]  # fmt: skip


@entry
def do_runs(
    family: Any, first: int, last: int, moving: int, begin: Vector, window: float,
    windows: tuple[int, int, int, int], ended: Vector,
) -> None:  # fmt: skip
    """Do the runs of these numbers one after the other."""
    for number in range(first, last):
        do_run(family, number, moving, begin, window, windows, ended)
