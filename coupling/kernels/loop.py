"""The loop over the windows of a run."""

from typing import Any

from coupling.kernels.newton import agree
from coupling.kernels.recorders import record
from coupling.kernels.records import REMEMBERED, Records
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
    """Advance a run by windows, in place. windows: the numbers of the first window and of the last, counted from 1; the
    number of windows in a saved interval, 0 to save nothing; and the row in which the state is saved before the first
    window, or −1. A window that fails leaves the run as it was before. Returns how the loop ended; the number of the
    window that was last tried; and the residual, N."""
    # The state of the structures alternates between two arrays.
    state, free, contact = run.body, trial.free, trial.contact
    touched, problem, residual = False, OK, 0.0
    for i in range(run.body.size):
        touched = touched or run.body[i] != 0.0
        trial.free[i] = 0.0
    for k in range(contact.size):
        contact[k].at_rest = 0.0
    for done in range(windows[0] - 1, windows[1] + 1):
        row = windows[3]
        if done >= windows[0]:
            row = done // windows[2] if windows[2] > 0 and done % windows[2] == 0 else -1
            moved = touched
            if moved:
                follow(structure, run.contact, state, free)
                for k in range(contact.size):
                    contact[k].at_rest = read(structure, k, free)
            tried, residual = agree(contacts, run, chains, search, (done - 1) * window, window, trial)
            run.totals[0].tried += tried
            if not finite(trial.y, trial.v, contact):
                return NON_FINITE, done, 0.0
            if abs(residual) > search.tolerance:
                problem = NOT_CONVERGED
                break
            copy(trial.y, run.y)
            copy(trial.v, run.v)
            for k in range(contact.size):
                touched = touched or contact[k].force != 0.0
                run.contact[k].pending = contact[k].force
            if moved:
                state, free = free, state
            for c in range(run.chain.size):
                run.chain[c].lost += trial.chain[c].lost
                run.chain[c].driven += trial.chain[c].driven
            keep_ledger(run.contact, run.node, run.window, run.totals, contact, done * window, window, residual)
        if row >= 0:
            if row % recorder.every == 0:
                settle(structure, run.body, run.contact, state)
                state, free = run.body, trial.free
            record(recorder, row, done * window, run, chains, structure, trial.work)
    settle(structure, run.body, run.contact, state)
    return problem, done, residual


run_windows = entry(move_on)
"""`move_on` for Python. A kernel that calls it would take as long to compile as the loop: Numba unpacks each array."""


@inner(forceinline=True)
def settle(structure: Any, body: Vector, contact: Records, state: Vector) -> None:
    """Copy the state of the structures into the run, and add the response to pending forces."""
    for i in range(state.size):
        body[i] = state[i]
    for k in range(contact.size):
        if contact[k].pending != 0.0:
            push(structure, k, contact[k].pending, body)
            contact[k].pending = 0.0


@inner(fastmath={"reassoc"}, forceinline=True)
def finite(y: Vector, v: Vector, contact: Records) -> bool:
    """Return whether all numbers of a trial are finite."""
    total = 0.0
    for i in range(y.size):
        total += 0.0 * y[i] + 0.0 * v[i]
    for k in range(contact.size):
        total += 0.0 * contact[k].surface
    return total == 0.0


@inner(forceinline=True)
def keep_ledger(
    kept: Records, node: Records, windows: Records, totals: Records, contact: Records, time: float, window: float,
    residual: float,
) -> None:  # fmt: skip
    """Add the works and impulses of a window that has ended, and remember its surfaces and forces."""
    for i in range(REMEMBERED - 1, 0, -1):
        windows[i].middle, windows[i].length = windows[i - 1].middle, windows[i - 1].length
        for k in range(contact.size):
            node[i, k].surface, node[i, k].force = node[i - 1, k].surface, node[i - 1, k].force
    windows[0].middle, windows[0].length = time - window / 2.0, window
    for k in range(contact.size):
        node[0, k].surface, node[0, k].force = contact[k].surface, contact[k].answer
        kept[k].work += contact[k].force * (contact[k].surface - kept[k].surface)
        kept[k].given += contact[k].work
        kept[k].impulse += contact[k].force * window
        kept[k].surface = contact[k].surface
    totals[0].windows += 1
    totals[0].remembered = min(totals[0].remembered + 1, REMEMBERED)
    totals[0].residual = max(totals[0].residual, abs(residual))
