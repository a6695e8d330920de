"""The loop over the windows of a run."""

from typing import Any

from coupling.kernels.newton import agree
from coupling.kernels.recorders import reads_structure, record
from coupling.kernels.records import REMEMBERED
from structures.kernels.arrays import copy
from structures.kernels.compiling import entry, inner
from structures.kernels.linear import follow, push, read
from structures.structure import Vector

OK, NON_FINITE, NOT_CONVERGED = 0, 1, 2
"""How a loop ended."""


@inner()
def move_on(
    run: Any, chains: Any, structure: Any, contacts: Any, search: Any, recorder: Any, trial: Any, window: float,
    windows: tuple[int, int, int, int],
) -> tuple[int, int, float]:  # fmt: skip
    """Move a run on over windows, in place.

    windows: the first one and the last one, counted from 1; how many make a saved time, 0 saves nothing; and the row
    where the state is saved first, or −1.

    A window that fails leaves the run as it began. Returns how the loop ended; the window; and the residual, N.
    """
    # The state of structures moves to and fro between two arrays.
    state, free = run.body, trial.free
    touched, problem, residual = False, OK, 0.0
    for i in range(run.body.size):
        touched = touched or run.body[i] != 0.0
        trial.free[i] = 0.0
    for k in range(trial.force.size):
        trial.at_rest[k] = 0.0
    for done in range(windows[0] - 1, windows[1] + 1):
        row = windows[3]
        if done >= windows[0]:
            row = done // windows[2] if windows[2] > 0 and done % windows[2] == 0 else -1
            moved = touched
            if moved:
                follow(structure, run.contact, state, free)
                for k in range(trial.force.size):
                    trial.at_rest[k] = read(structure, k, free)
            tried, residual = agree(contacts, run, chains, search, (done - 1) * window, window, trial)
            run.totals[0].tried += tried
            if not finite(trial):
                return NON_FINITE, done, 0.0
            if abs(residual) > search.tolerance:
                problem = NOT_CONVERGED
                break
            copy(trial.y, run.y)
            copy(trial.v, run.v)
            for k in range(trial.force.size):
                touched = touched or trial.force[k] != 0.0
                run.contact[k].pending = trial.force[k]
            if moved:
                state, free = free, state
            keep_ledger(run, trial, done * window, window, residual)
        if row >= 0:
            if reads_structure(recorder, row):
                settle(structure, run, state)
                state, free = run.body, trial.free
            record(recorder, row, done * window, run, chains, structure, trial.work)
    settle(structure, run, state)
    return problem, done, residual


run_windows = entry(move_on)
"""`move_on` for Python. A kernel around it would take as long to compile as the loop: Numba unpacks each array."""


@inner()
def settle(structure: Any, run: Any, state: Vector) -> None:
    """Put the state of the structures into the run, with the response to forces that are pending."""
    for i in range(state.size):
        run.body[i] = state[i]
    for k in range(run.contact.size):
        if run.contact[k].pending != 0.0:
            push(structure, k, run.contact[k].pending, run.body)
            run.contact[k].pending = 0.0


@inner(fastmath={"reassoc"}, forceinline=True)
def finite(trial: Any) -> bool:
    """Return whether all numbers of a trial are finite."""
    total = 0.0
    for i in range(trial.y.size):
        total += 0.0 * trial.y[i] + 0.0 * trial.v[i]
    for k in range(trial.surface.size):
        total += 0.0 * trial.surface[k]
    return total == 0.0


@inner(forceinline=True)
def keep_ledger(run: Any, trial: Any, time: float, window: float, residual: float) -> None:
    """Count works, impulses and losses of a window that ended, and remember its surfaces and forces."""
    totals = run.totals[0]
    for c in range(run.chain.size):
        run.chain[c].lost += trial.lost[c]
        run.chain[c].driven += trial.driven[c]
    for i in range(REMEMBERED - 1, 0, -1):
        run.window[i].middle, run.window[i].length = run.window[i - 1].middle, run.window[i - 1].length
        for k in range(trial.force.size):
            run.node[i, k].surface, run.node[i, k].force = run.node[i - 1, k].surface, run.node[i - 1, k].force
    run.window[0].middle, run.window[0].length = time - window / 2.0, window
    for k in range(trial.force.size):
        contact, way = run.contact[k], trial.surface[k] - run.contact[k].surface
        run.node[0, k].surface, run.node[0, k].force = trial.surface[k], trial.answer[k]
        contact.work += trial.force[k] * way
        contact.given += trial.work_given[k]
        contact.impulse += trial.force[k] * window
        contact.surface = trial.surface[k]
    totals.windows += 1
    if totals.remembered < REMEMBERED:
        totals.remembered += 1
    if abs(residual) > totals.residual:
        totals.residual = abs(residual)
