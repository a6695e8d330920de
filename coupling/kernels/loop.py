"""The loop over the windows of a run."""

from typing import Any

from coupling.kernels.agreement import agree
from coupling.kernels.recorders import record
from particles.kernels.chain import first_bad
from structures.kernel_cache import inner, njit
from structures.kernels.gaps import copy
from structures.kernels.linear import let_go, push, read
from structures.kernels.pieces import by_type
from structures.structure import Vector

OK, NON_FINITE, NOT_CONVERGED = 0, 1, 2
"""How a loop ended."""


def _linear_end(structure: Any, run: Any, trial: Any) -> None:
    copy(trial.free, run.body)
    for k in range(trial.force.size):
        push(structure, k, trial.force[k], run.body)


@by_type(_linear_end)
def finish(structure: Any, run: Any, trial: Any) -> None:
    """Move the state of the structures on to the end of a window whose forces are agreed."""
    raise NotImplementedError


@njit(cache=True, nogil=True, _nrt=False)
def run_windows(
    run: Any, chains: Any, structure: Any, contacts: Any, search: Any, recorder: Any, trial: Any, begin: Vector,
    window: float, windows: tuple[int, int, int],
) -> tuple[int, int, float, int]:  # fmt: skip
    """Move a run on over windows, in place.

    windows: the first one and the last one, counted from 1, and how many make a saved time; 0 saves nothing.

    A window that fails leaves the run as it began. Returns how the loop ended; the window; the chain, or the residual
    (N); and the body that is no longer finite.
    """
    touched = False
    for i in range(run.body.size):
        touched = touched or run.body[i] != 0.0
        trial.free[i] = 0.0
    for k in range(trial.at_rest.size):
        trial.at_rest[k] = 0.0
    for done in range(windows[0], windows[1] + 1):
        if touched or run.pressed.size > 0:
            let_go(structure, run.body, trial.free)
            for k in range(trial.at_rest.size):
                trial.at_rest[k] = read(structure, k, trial.free)
        tried, residual, taken = agree(
            contacts, run, chains, structure, search, (done - 1) * window, window, trial
        )
        run.counts[1] += tried
        chain, body = not_finite(trial, begin)
        if chain >= 0:
            return NON_FINITE, done, float(chain), body
        if abs(residual) > search.tolerance:
            return NOT_CONVERGED, done, residual, 0
        copy(trial.y, run.y)
        copy(trial.v, run.v)
        for k in range(trial.force.size):
            touched = touched or trial.force[k] != 0.0
        if touched or run.pressed.size > 0:
            finish(structure, run, trial)
        run.taken[0] += taken
        keep_ledger(run, trial, done * window, window, residual)
        if windows[2] > 0 and done % windows[2] == 0:
            record(recorder, done // windows[2], done * window, run, chains, structure, begin, trial.chain)
    return OK, 0, 0.0, 0


@inner()
def not_finite(trial: Any, begin: Vector) -> tuple[int, int]:
    """Return the first chain that is no longer finite and the body; −1 where all are."""
    for c in range(begin.shape[0] - 1):
        first, last = begin[c, 0], begin[c + 1, 0]
        bad = first_bad(trial.y[first:last], trial.v[first:last], trial.surface[begin[c, 1]])
        if bad >= 0:
            return c, bad
    return -1, 0


@inner()
def keep_ledger(run: Any, trial: Any, time: float, window: float, residual: float) -> None:
    """Count works, impulses and losses of a window that ended, and remember its surfaces and forces."""
    for c in range(run.lost.size):
        run.lost[c] += trial.lost[c]
        run.driven[c] += trial.driven[c]
    for i in range(2, 0, -1):
        run.node_time[i], run.node_length[i] = run.node_time[i - 1], run.node_length[i - 1]
    run.node_time[0], run.node_length[0] = time, window
    for k in range(trial.force.size):
        for i in range(2, 0, -1):
            run.node_surface[i, k], run.node_force[i, k] = run.node_surface[i - 1, k], run.node_force[i - 1, k]
        run.node_surface[0, k], run.node_force[0, k] = trial.surface[k], trial.answer[k]
        run.work[k] += trial.force[k] * (trial.surface[k] - run.surface[k])
        run.given[k] += trial.work[k]
        run.impulse[k] += trial.force[k] * window
        run.surface[k] = trial.surface[k]
    run.counts[0] = min(run.counts[0] + 1, 3)
    run.counts[2] += 1
    run.residual[0] = max(run.residual[0], abs(residual))


@njit(cache=True, _nrt=False)
def save(
    recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
) -> None:
    """Put the state of a run at time t, s, into a row."""
    record(recorder, row, t, run, chains, structure, begin, work)
