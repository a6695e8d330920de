"""Newton's method for the mean forces of a window on which chains and structures agree."""

from typing import Any, NamedTuple

import numpy as np

from coupling.kernels.records import REMEMBERED, Records
from particles.kernels.motion import advance
from structures.kernels.arrays import solve
from structures.kernels.compiling import inner
from structures.structure import Vector


class Contacts(NamedTuple):
    """The K contacts of chains with structures, over a window of one length."""

    static: Vector  # K, static forces, N
    compliance: Vector  # K × K, displacements for 1 N of mean force, m/N
    pace: Records  # C records PACE
    rigid: bool  # whether no surface moves


@inner(forceinline=True)
def predict(node: Records, windows: Records, count: int, at: float, window: float, contact: Records) -> None:
    """Predict the forces at the middle of a window by the parabola through the last three, or a lower polynomial."""
    if count == REMEMBERED and windows[0].length == window == windows[1].length == windows[2].length:
        # With equal windows the parabola needs no division, which is slow.
        for k in range(contact.size):
            contact[k].force = 3.0 * (node[0, k].force - node[1, k].force) + node[2, k].force
        return
    for k in range(contact.size):
        contact[k].force = 0.0
    for i in range(count):
        above, below, place = 1.0, 1.0, windows[i].middle
        for j in range(count):
            if j != i:
                above *= at - windows[j].middle
                below *= place - windows[j].middle
        for k in range(contact.size):
            contact[k].force += above / below * node[i, k].force


@inner(forceinline=True)
def surfaces(compliance: Vector, contact: Records) -> None:
    """Compute the surfaces at the end of a window under mean forces, w = w_free + C F, in records TRIED."""
    for k in range(contact.size):
        place = contact[k].at_rest
        for j in range(contact.size):
            place += compliance[k, j] * contact[j].force
        contact[k].surface = place


@inner(forceinline=True)
def agree(contacts: Any, run: Any, chains: Any, search: Any, t: float, window: float, trial: Any) -> tuple[int, float]:
    """Find the mean forces F of a window from time t on: those with which the chains answer the surfaces w_free + C F.
    This is Newton's method on G(w_free + C F) − F, with the compliance C and a secant slope of each chain's answer G
    over its surface. If a loss makes the force jump as a contact opens, there may be no root; the window is then
    halved. Returns the number of trials, and the residual (N)."""
    compliance, contact, count = contacts.compliance, trial.contact, trial.contact.size
    slope, gap, last_surface, last_answer = trial.rows[0], trial.rows[1], trial.rows[2], trial.rows[3]
    matrix = trial.rows[4:]
    predict(run.node, run.window, run.totals[0].remembered, t + window / 2.0, window, contact)
    for k in range(count):
        # A contact cannot pull, so the predicted force must not be negative with the static force included.
        contact[k].force = max(contact[k].force, -contacts.static[k])
        slope[k], contact[k].start = run.contact[k].slope, run.contact[k].surface
        last_surface[k], last_answer[k] = 0.0, 0.0
    residual, tried = np.inf, 0
    while tried < search.most:
        surfaces(compliance, contact)
        advance(
            chains, run.y, run.v, trial.y, trial.v, trial.work, t, window, contact, contacts.pace, trial.chain,
            tried > 0,
        )  # fmt: skip
        tried, residual = tried + 1, 0.0
        for k in range(count):
            contact[k].answer -= contacts.static[k]
            gap[k] = contact[k].answer - contact[k].force
            residual = max(residual, abs(gap[k]))
        if not residual > search.tolerance or contacts.rigid:
            break
        for k in range(count):
            step = contact[k].surface - last_surface[k]
            # The secant of the last two trials; if the surface hardly moved, the quotient would be a rounding error.
            if tried > 1 and abs(step) > search.still:
                slope[k] = min((contact[k].answer - last_answer[k]) / step, 0.0)
            last_surface[k], last_answer[k] = contact[k].surface, contact[k].answer
            for j in range(count):
                # Newton's equation (I − diag(slope) C) ΔF = G(w_free + C F) − F.
                matrix[k, j] = (1.0 if j == k else 0.0) - slope[k] * compliance[k, j]
        solve(matrix, gap, count)
        for k in range(count):
            contact[k].force += gap[k]
    for k in range(count):
        run.contact[k].slope = slope[k] if not residual > search.tolerance else run.contact[k].slope
        contact[k].work = contact[k].answer * (contact[k].surface - contact[k].start)
        # The structure gets the answered force, which is nearer to the root than the force that was tried.
        contact[k].force = contact[k].answer
    surfaces(compliance, contact)
    return tried, 0.0 if contacts.rigid else residual
