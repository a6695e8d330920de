"""Agreement of chains and structures on mean forces of a window: Newton's method, for one contact or for several."""

from typing import Any, NamedTuple

import numpy as np

from coupling.kernels.records import REMEMBERED
from particles.kernels.motion import advance, reach
from structures.kernels.arrays import copy, solve
from structures.kernels.compiling import inner
from structures.kernels.pieces import by_type, for_each
from structures.structure import Vector


@inner()
def surfaces(compliance: Vector, trial: Any) -> None:
    """Put the surfaces at the end of a window under the forces of a trial into it."""
    for k in range(trial.contact.size):
        place = trial.contact[k].at_rest
        for j in range(trial.contact.size):
            place += compliance[k, j] * trial.contact[j].force
        trial.contact[k].surface = place


@by_type
def agree(contacts: Any, run: Any, chains: Any, search: Any, t: float, window: float, trial: Any) -> tuple[int, float]:
    """Find the mean forces of a window from time t on which chains and structure agree.

    Returns the number of trials, and the residual (N).
    """
    raise NotImplementedError


@inner()
def predict(run: Any, t: float, window: float, trial: Any) -> None:
    """Put into a trial the forces of a window from time t on, by the parabola through the last three, or what fewer
    give."""
    count, windows = run.totals[0].remembered, run.window
    if count == REMEMBERED and windows[0].length == window == windows[1].length == windows[2].length:
        # The parabola through values at equal distances needs no quotients, which are slow.
        for k in range(trial.contact.size):
            trial.contact[k].force = 3.0 * (run.node[0, k].force - run.node[1, k].force) + run.node[2, k].force
        return
    at = t + window / 2.0
    for k in range(trial.contact.size):
        trial.contact[k].force = 0.0
    for i in range(count):
        above, below, place = 1.0, 1.0, windows[i].middle
        for j in range(count):
            if j != i:
                above *= at - windows[j].middle
                below *= place - windows[j].middle
        for k in range(trial.contact.size):
            trial.contact[k].force += above / below * run.node[i, k].force


class OneContact(NamedTuple):
    """One chain on one contact point."""

    static: Vector
    """The static force, N."""
    compliance: Vector
    """1 × 1: displacement for 1 N of mean force, m/N."""
    steps: Vector
    """Steps of the chain in a window, an array of one."""

    @staticmethod
    def agree(
        contacts: Any, run: Any, chains: Any, search: Any, t: float, window: float, trial: Any
    ) -> tuple[int, float]:
        """Find the force F by the secant method, from the parabola through those of the last three windows.

        The residual falls at least as fast as F rises, so its slope is −1 or steeper: nothing is divided by zero, an
        open contact included. Where a loss makes the force jump as the contact opens there may be no root: the window
        is halved then, in which less happens.
        """
        chain, static, compliance, steps = chains[0], contacts.static[0], contacts.compliance, contacts.steps[0]
        y, v, first, slope = trial.y, trial.v, 0, run.contact[0].slope
        predict(run, t, window, trial)
        contact, before = trial.contact[0], run.contact[0].surface
        tried = contact.force + static if contact.force + static > 0.0 else 0.0
        last_tried, last_residual, residual, count = 0.0, 0.0, np.inf, 0
        while count < search.most:
            count += 1
            if first == 0:
                copy(run.y, y)
                copy(run.v, v)
            contact.force = tried - static
            surfaces(compliance, trial)
            force, _, lost, driven = advance(chain, y, v, trial.work, t, window, before, contact.surface, steps, first)
            trial.chain[0].lost = lost
            if first == 0:
                trial.chain[0].driven = driven
            first = reach(chain, y, steps)
            residual = force - tried
            if not abs(residual) > search.tolerance or compliance[0, 0] == 0.0:
                break
            # Equal trials where the tolerance is below rounding.
            if count > 1 and tried != last_tried:
                slope = (residual - last_residual) / (tried - last_tried)
            slope = slope if slope < -1.0 else -1.0
            last_tried, last_residual = tried, residual
            tried -= residual / slope
        if not abs(residual) > search.tolerance:
            run.contact[0].slope = slope
        # The chain moved against the surface where the force before its last answer would have brought it.
        contact.answer = force - static
        contact.work = contact.answer * (contact.surface - before)
        # The structure feels the answer, which is nearer to the root than what was tried.
        contact.force = contact.answer
        surfaces(compliance, trial)
        return count, 0.0 if compliance[0, 0] == 0.0 else residual


class Contacts(NamedTuple):
    """Several contacts, ordered by chain."""

    static: Vector
    """K, static forces, N."""
    compliance: Vector
    """K × K, displacements for 1 N of mean force, m/N."""
    steps: Vector
    """C, steps of each chain in a window."""
    behind: Vector
    """K: whether it is the contact of the first bead."""
    begin: Vector
    """C + 1 rows: the first coordinate and the first contact of each chain."""
    rigid: bool
    """Whether the compliance is zero."""

    @staticmethod
    def agree(
        contacts: Any, run: Any, chains: Any, search: Any, t: float, window: float, trial: Any
    ) -> tuple[int, float]:
        """Find the forces by Newton's method with the compliance and a secant slope for each contact.

        The slopes of the chains' answers over their surfaces are negative.
        """
        count, work, compliance = trial.contact.size, trial.rows, contacts.compliance
        slope, gap, last_surface, last_answer = work[0], work[1], work[2], work[3]
        matrix = work[4:]
        predict(run, t, window, trial)
        for k in range(count):
            contact = trial.contact[k]
            # A contact cannot pull: the prediction, static force included, must not be negative.
            contact.force = max(contact.force, -contacts.static[k])
            last_surface[k], last_answer[k], slope[k] = contact.at_rest, contact.force, run.contact[k].slope
        residual, tried = np.inf, 0
        while tried < search.most:
            tried += 1
            surfaces(compliance, trial)
            copy(run.y, trial.y)
            copy(run.v, trial.v)
            follow_chains(chains, 0, contacts, run, t, window, trial)
            residual = 0.0
            for k in range(count):
                contact = trial.contact[k]
                if contacts.rigid:
                    contact.force = contact.answer
                gap[k] = contact.answer - contact.force
                residual = max(residual, abs(gap[k]))
            if not residual > search.tolerance:
                for k in range(count):
                    run.contact[k].slope = slope[k]
                break
            for k in range(count):
                step = trial.contact[k].surface - last_surface[k]
                # The secant of the last two trials; where the surface hardly moved, its quotient would be rounding.
                if tried > 1 and abs(step) > search.still:
                    slope[k] = min((trial.contact[k].answer - last_answer[k]) / step, 0.0)
                for j in range(count):
                    # Newton's equation (I − diag(slope) C) ΔF = answer(w_free + C F) − F.
                    matrix[k, j] = (1.0 if j == k else 0.0) - slope[k] * compliance[k, j]
            solve(matrix, gap, count)
            for k in range(count):
                last_surface[k], last_answer[k] = trial.contact[k].surface, trial.contact[k].answer
                trial.contact[k].force += gap[k]
        return tried, residual


@inner()
def follow_chain(chain: Any, c: int, contacts: Any, run: Any, t: float, window: float, trial: Any) -> None:
    """Move chain c against its surfaces, which move straight over a window; fill its answers, works and losses."""
    first, last = contacts.begin[c, 0], contacts.begin[c + 1, 0]
    ahead, end = contacts.begin[c, 1], contacts.begin[c + 1, 1]
    # A contact behind comes after that of the last bead.
    back = end - 1 if contacts.behind[end - 1] else -1
    y, v = trial.y[first:last], trial.v[first:last]
    if back >= 0:
        before, after = run.contact[back].surface, trial.contact[back].surface
        y[0], v[0] = chain.rest - before, (before - after) / window
    front, rear, lost, driven = advance(
        chain, y, v, trial.work[:, first:last], t, window, run.contact[ahead].surface, trial.contact[ahead].surface,
        contacts.steps[c], 0,
    )  # fmt: skip
    if back >= 0:
        y[0] = chain.rest - trial.contact[back].surface
    trial.chain[c].lost, trial.chain[c].driven = lost, driven
    for k in range(ahead, end):
        contact = trial.contact[k]
        contact.answer = (rear if k == back else front) - contacts.static[k]
        contact.work = contact.answer * (contact.surface - run.contact[k].surface)


follow_chains = for_each(follow_chain)
