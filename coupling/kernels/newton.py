"""Agreement of chains and structures on the mean forces of a window, by Newton's method."""

from typing import Any, NamedTuple

import numpy as np

from coupling.kernels.records import REMEMBERED
from particles.kernels.motion import advance
from structures.kernels.arrays import solve
from structures.kernels.compiling import inner
from structures.structure import Vector


class Contacts(NamedTuple):
    """The K contacts of chains with structures, over a window of one length."""

    static: Vector
    """K, static forces, N."""
    compliance: Vector
    """K × K, displacements for 1 N of mean force, m/N."""
    steps: Vector
    """C, steps of each chain in the window."""
    rigid: bool
    """Whether no surface moves."""


@inner()
def predict(run: Any, t: float, window: float, force: Vector) -> None:
    """Put the parabola through the last three mean forces, or what fewer give, at the window from time t on."""
    count, windows = run.totals[0].remembered, run.window
    if count == REMEMBERED and windows[0].length == window == windows[1].length == windows[2].length:
        # The parabola through values at equal distances needs no quotients, which are slow.
        for k in range(force.size):
            force[k] = 3.0 * (run.node[0, k].force - run.node[1, k].force) + run.node[2, k].force
        return
    at = t + window / 2.0
    for k in range(force.size):
        force[k] = 0.0
    for i in range(count):
        above, below, place = 1.0, 1.0, windows[i].middle
        for j in range(count):
            if j != i:
                above *= at - windows[j].middle
                below *= place - windows[j].middle
        for k in range(force.size):
            force[k] += above / below * run.node[i, k].force


@inner()
def surfaces(compliance: Vector, trial: Any) -> None:
    """Put the surfaces at the end of a window under the forces of a trial into it: w = w_free + C F."""
    for k in range(trial.force.size):
        place = trial.at_rest[k]
        for j in range(trial.force.size):
            place += compliance[k, j] * trial.force[j]
        trial.surface[k] = place


@inner()
def agree(contacts: Any, run: Any, chains: Any, search: Any, t: float, window: float, trial: Any) -> tuple[int, float]:
    """Find the mean forces F of a window from time t on with which the chains answer the surfaces w_free + C F.

    Newton's method on G(w_free + C F) − F, with the compliance C and a secant slope of each chain's answer G over its
    surface. Where a loss makes the force jump as a contact opens there may be no root: the window is halved then, in
    which less happens. Returns the number of trials, and the residual (N).
    """
    compliance, force, answer, surface = contacts.compliance, trial.force, trial.answer, trial.surface
    slope, gap, last_surface, last_answer, matrix = (
        trial.rows[0],
        trial.rows[1],
        trial.rows[2],
        trial.rows[3],
        trial.rows[4:],
    )
    predict(run, t, window, force)
    for k in range(force.size):
        # A contact cannot pull: the prediction, static force included, must not be negative.
        force[k] = max(force[k], -contacts.static[k])
        slope[k], trial.start[k] = run.contact[k].slope, run.contact[k].surface
        last_surface[k], last_answer[k] = 0.0, 0.0
    residual, tried = np.inf, 0
    while tried < search.most:
        surfaces(compliance, trial)
        advance(
            chains, run.y, run.v, trial.y, trial.v, trial.work, t, window, trial.start, surface, contacts.steps,
            tried > 0, answer, trial.lost, trial.driven,
        )  # fmt: skip
        tried, residual = tried + 1, 0.0
        for k in range(force.size):
            answer[k] -= contacts.static[k]
            gap[k] = answer[k] - force[k]
            residual = max(residual, abs(gap[k]))
        if not residual > search.tolerance or contacts.rigid:
            break
        for k in range(force.size):
            step = surface[k] - last_surface[k]
            # The secant of the last two trials; where the surface hardly moved, its quotient would be rounding.
            if tried > 1 and abs(step) > search.still:
                slope[k] = min((answer[k] - last_answer[k]) / step, 0.0)
            last_surface[k], last_answer[k] = surface[k], answer[k]
            for j in range(force.size):
                # Newton's equation (I − diag(slope) C) ΔF = G(w_free + C F) − F.
                matrix[k, j] = (1.0 if j == k else 0.0) - slope[k] * compliance[k, j]
        solve(matrix, gap, force.size)
        for k in range(force.size):
            force[k] += gap[k]
    for k in range(force.size):
        run.contact[k].slope = slope[k] if not residual > search.tolerance else run.contact[k].slope
        trial.work_given[k] = answer[k] * (surface[k] - trial.start[k])
        # The structure feels the answer, which is nearer to the root than what was tried.
        force[k] = answer[k]
    surfaces(compliance, trial)
    return tried, 0.0 if contacts.rigid else residual
