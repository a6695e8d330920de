"""Windows as long as their error allows, and the error of a window."""

from typing import Any, NamedTuple

from coupling.kernels.loop import OK, move_on
from coupling.kernels.recorders import record
from coupling.kernels.records import Records, Run
from structures.kernels.compiling import entry, inner
from structures.structure import Vector

TOO_LONG = 3
"""How a window ended whose error is too large, next to the ends of the loop."""

GROWS_BELOW = 0.125
"""A window is tried twice as long after one whose error was below this part of the tolerance."""

UNTOUCHED = 0.1
"""Weight of the error where nothing touches. No chain follows that surface, but its curvature measures the error of the
structure's own stepping, which is smaller by about the ratio of the window to the time scale of the motion."""


class Adaptation(NamedTuple):
    """The settings that choose the length of the next window."""

    before: Run  # work space: the run before a window that may be too long
    static: Vector  # K static forces, N
    indentation_scale: float  # the unit of errors, m
    tolerance: float  # of the error of a window
    finest: bool  # whether the windows are so short that their error does not count
    whole: int  # windows that make a window of the plan, a power of two


def bend(node: Records, window: Records, totals: Records, static: Vector) -> float:
    """Return the distance of a parabola from the straight motion of the surfaces in the last window of a run, m."""
    remembered, now, greatest = totals[0].remembered, window[0].length, 0.0
    before = window[1].length if remembered > 1 else now
    for k in range(node.shape[1]):
        start = node[1, k].surface if remembered > 1 else 0.0
        earlier = node[2, k].surface if remembered > 2 else 0.0
        change = abs((node[0, k].surface - start) / now - (start - earlier) / before)
        greatest = max(greatest, change if node[0, k].force > -static[k] else UNTOUCHED * change)
    # The surface's acceleration is the change of mean velocity over (h₁ + h₂)/2; a parabola leaves its chord by
    # that times h²/8.
    return 2.0 * greatest / (now + before) * now**2 / 8.0


bend_of_last = entry(bend)
"""`bend` for Python."""

bend_in_loop = inner()(bend)
"""`bend` for kernels."""


@inner()
def copy_run(source: Run, target: Run) -> None:
    """Copy the state of a run."""
    for i in range(source.y.size):
        target.y[i], target.v[i] = source.y[i], source.v[i]
    for i in range(source.body.size):
        target.body[i] = source.body[i]
    for k in range(source.contact.size):
        target.contact[k] = source.contact[k]
    for c in range(source.chain.size):
        target.chain[c] = source.chain[c]
    for i in range(source.window.size):
        target.window[i] = source.window[i]
        for k in range(source.contact.size):
            target.node[i, k] = source.node[i, k]
    target.totals[0] = source.totals[0]


@entry
def adapt(
    run: Any, chains: Any, structure: Any, contacts: Any, search: Any, recorder: Any, trial: Any,
    adaptation: Adaptation, windows: tuple[int, int, int, float, float],
) -> tuple[int, int, float]:  # fmt: skip
    """Move a run on over windows of one length, in place, until another length suits better.

    windows: how many are behind the run and how many shall be, counted in windows of this length; how many windows of
    the plan make a saved time; their length, s; and the error of the last window.

    Returns how the loop ended: OK where the end is reached or a window of twice the length is to be tried; how many
    windows are behind the run; and the error of the last one.
    """
    done, last, stride, window, error = windows
    whole = adaptation.whole
    while done < last:
        copy_run(run, adaptation.before)
        problem, _, _ = move_on(
            run, chains, structure, contacts, search, recorder, trial, window, (done + 1, done + 1, 0, -1)
        )
        bent = bend_in_loop(run.node, run.window, run.totals, adaptation.static) / adaptation.indentation_scale
        if problem == OK and not adaptation.finest and bent > adaptation.tolerance:
            problem = TOO_LONG
        if problem != OK:
            # The windows tried count the failed one, too; all else goes back to the start of it.
            tried = run.totals[0].tried
            copy_run(adaptation.before, run)
            run.totals[0].tried = tried
            return problem, done, error
        done, error = done + 1, bent
        if done % (whole * stride) == 0:
            record(recorder, done // (whole * stride), done * window, run, chains, structure, trial.work)
        # Windows double in pairs only, so that saved times stay ends of windows.
        if whole > 1 and done % 2 == 0 and error < GROWS_BELOW * adaptation.tolerance:
            break
    return OK, done, error
