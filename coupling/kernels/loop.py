"""The loop over the windows of a run."""

from typing import Any

from coupling.kernels.agreement import agree
from coupling.kernels.recorders import reads_structure, record
from coupling.kernels.state import REMEMBERED
from particles.kernels.chain import first_bad
from structures.kernel_cache import entry, inner
from structures.kernels.arrays import copy
from structures.kernels.linear import follow, push, read
from structures.kernels.pieces import by_type
from structures.structure import Vector

OK, NON_FINITE, NOT_CONVERGED = 0, 1, 2
"""How a loop ended."""


def _pending(structure: Any, run: Any, trial: Any) -> None:
    for k in range(trial.contact.size):
        run.contact[k].pending = trial.contact[k].force


@by_type(_pending)
def finish(structure: Any, run: Any, trial: Any) -> None:
    """Let the structures take over the forces of a window that are agreed."""
    raise NotImplementedError


@inner()
def move_on(
    run: Any, chains: Any, structure: Any, contacts: Any, search: Any, recorder: Any, trial: Any, begin: Vector,
    window: float, windows: tuple[int, int, int, int],
) -> tuple[int, int, float, int]:  # fmt: skip
    """Move a run on over windows, in place.

    windows: the first one and the last one, counted from 1; how many make a saved time, 0 saves nothing; and the row
    where the state is saved first, or −1.

    A window that fails leaves the run as it began. Returns how the loop ended; the window; the chain, or the residual
    (N); and the body that is no longer finite.
    """
    if windows[3] >= 0:
        record(recorder, windows[3], (windows[0] - 1) * window, run, chains, structure, begin, trial.work)
    # The state of linear structures moves to and fro between two arrays.
    gaps, state, free = run.pressed.size > 0, run.body, trial.free
    touched = False
    for i in range(run.body.size):
        touched = touched or run.body[i] != 0.0
        trial.free[i] = 0.0
    for k in range(trial.contact.size):
        trial.contact[k].at_rest = 0.0
    for done in range(windows[0], windows[1] + 1):
        moved = touched or gaps
        if moved:
            follow(structure, run.contact, state, free)
            for k in range(trial.contact.size):
                trial.contact[k].at_rest = read(structure, k, free)
        tried, residual, taken = agree(contacts, run, chains, structure, search, (done - 1) * window, window, trial)
        run.totals[0].tried += tried
        if not finite(trial):
            chain, body = broken_chain(trial, begin)
            return NON_FINITE, done, float(chain), body
        if abs(residual) > search.tolerance:
            settle(structure, run, state)
            return NOT_CONVERGED, done, residual, 0
        copy(trial.y, run.y)
        copy(trial.v, run.v)
        for k in range(trial.contact.size):
            touched = touched or trial.contact[k].force != 0.0
        if touched or gaps:
            finish(structure, run, trial)
        if moved and not gaps:
            state, free = free, state
        run.totals[0].taken += taken
        keep_ledger(run, trial, done * window, window, residual)
        if windows[2] > 0 and done % windows[2] == 0:
            row = done // windows[2]
            if reads_structure(recorder, row):
                settle(structure, run, state)
                state, free = run.body, trial.free
            record(recorder, row, done * window, run, chains, structure, begin, trial.work)
    settle(structure, run, state)
    return OK, 0, 0.0, 0


run_windows = entry(move_on.py_func)
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
    for k in range(trial.contact.size):
        total += 0.0 * trial.contact[k].surface
    return total == 0.0


@inner()
def broken_chain(trial: Any, begin: Vector) -> tuple[int, int]:
    """Return the first chain that is no longer finite and the body; after all of its bodies comes the surface."""
    for c in range(begin.shape[0] - 1):
        first, last = begin[c, 0], begin[c + 1, 0]
        body = first_bad(trial.y[first:last], trial.v[first:last], trial.contact[begin[c, 1]].surface)
        if body >= 0:
            return c, body
    return -1, 0


@inner(forceinline=True)
def keep_ledger(run: Any, trial: Any, time: float, window: float, residual: float) -> None:
    """Count works, impulses and losses of a window that ended, and remember its surfaces and forces."""
    totals = run.totals[0]
    for c in range(run.chain.size):
        run.chain[c].lost += trial.chain[c].lost
        run.chain[c].driven += trial.chain[c].driven
    for i in range(REMEMBERED - 1, 0, -1):
        run.window[i].end, run.window[i].length = run.window[i - 1].end, run.window[i - 1].length
        for k in range(trial.contact.size):
            run.node[i, k].surface, run.node[i, k].force = run.node[i - 1, k].surface, run.node[i - 1, k].force
    run.window[0].end, run.window[0].length = time, window
    for k in range(trial.contact.size):
        contact, tried = run.contact[k], trial.contact[k]
        run.node[0, k].surface, run.node[0, k].force = tried.surface, tried.answer
        contact.work += tried.force * (tried.surface - contact.surface)
        contact.given += tried.work
        contact.impulse += tried.force * window
        contact.surface = tried.surface
    totals.remembered = min(totals.remembered + 1, REMEMBERED)
    totals.windows += 1
    totals.residual = max(totals.residual, abs(residual))
