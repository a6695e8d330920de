"""Windows as long as their error allows, and the error of a window."""

from typing import Any, NamedTuple

from coupling.kernels.loop import OK, move_on
from coupling.kernels.recorders import record
from coupling.kernels.records import Records, Run
from structures.kernels.compiling import entry, inner
from structures.structure import Vector

TOO_LONG = 3
"""The end of a window whose error is too large; OK, NON_FINITE and NOT_CONVERGED are the other ends."""

GROWS_BELOW = 0.125
"""If the error of a window is below this part of the tolerance, the next window is tried twice as long."""

UNTOUCHED = 0.1
"""Weight of the error where nothing touches. No chain follows such a surface, but its curvature measures the error of
the structure's own stepping, which is smaller by about the ratio of the window to the time scale of the motion."""


class Adaptation(NamedTuple):
    """The settings that choose the length of the next window."""

    before: Run  # work space: the run before a window that may be too long
    static: Vector  # K static forces, N
    indentation_scale: float  # the unit of errors, m
    tolerance: float  # of the error of a window
    finest: bool  # whether the windows are so short that their error does not count
    whole: int  # windows in a window of the plan, a power of two


def bend(node: Records, window: Records, totals: Records, static: Vector) -> float:
    """Return the distance of the surfaces' straight motion in the last window of a run from a parabola, m."""
    remembered, now, greatest = totals[0].remembered, window[0].length, 0.0
    before = window[1].length if remembered > 1 else now
    for k in range(node.shape[1]):
        start = node[1, k].surface if remembered > 1 else 0.0
        earlier = node[2, k].surface if remembered > 2 else 0.0
        change = abs((node[0, k].surface - start) / now - (start - earlier) / before)
        greatest = max(greatest, change if node[0, k].force > -static[k] else UNTOUCHED * change)
    # The acceleration of a surface is the change of its mean velocity over (h₁ + h₂)/2. The greatest distance of a
    # parabola from its chord is the acceleration times h²/8.
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
    """Advance a run by windows of one length, in place, until another length suits better. windows: the number of
    windows done, and the number to reach, both counted in windows of this length; the number of windows of the plan in
    a saved interval; the length, s; and the error of the last window. Returns how the loop ended: OK if the end is
    reached, or if a window of twice the length is to be tried; the number of windows done; and the error of the last
    one."""
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
            # The number of windows tried includes the failed one; all else returns to the start of this window.
            tried = run.totals[0].tried
            copy_run(adaptation.before, run)
            run.totals[0].tried = tried
            return problem, done, error
        done, error = done + 1, bent
        if done % (whole * stride) == 0:
            record(recorder, done // (whole * stride), done * window, run, chains, structure, trial.work)
        # A window is doubled only after an even number of windows, so that saved times remain ends of windows.
        if whole > 1 and done % 2 == 0 and error < GROWS_BELOW * adaptation.tolerance:
            break
    return OK, done, error
