"""How chains and structures agree on the mean forces of a window: Newton's method, for one contact or for several."""

from typing import Any, NamedTuple

import numpy as np

from particles.kernels.chain import advance, reach
from structures.kernel_cache import inner
from structures.kernels.gaps import copy, solve
from structures.kernels.pieces import by_type, for_each
from structures.structure import Vector

PIECES = 4
"""Straight pieces that replace a parabola of the surface over a window."""

HALVED_FROM = 8
"""Trials after which an interval that holds the force is halved: where a loss makes the force jump, secants fail."""


class Run(NamedTuple):
    """The state of a run at the end of a window: arrays that the loop changes in place. K contacts, C chains."""

    y: Vector
    """Positions and velocities of all chains, one after the other."""
    v: Vector
    body: Vector
    """The states of all structures."""
    surface: Vector
    """K, m."""
    slope: Vector
    """K, the slopes that Newton's method starts from."""
    node_time: Vector
    """The last three windows, newest first: end (s), length (s), surfaces (m) and mean forces of the chains (N)."""
    node_length: Vector
    node_surface: Vector
    node_force: Vector
    lost: Vector
    """C, J; so is the next one."""
    driven: Vector
    work: Vector
    """K, J: work of the contact forces on structures, and by chains; and impulse, N s."""
    given: Vector
    impulse: Vector
    counts: Vector
    """Windows remembered, at most three; since the last saved time trials of windows, and windows."""
    residual: Vector
    """One number, N: the greatest since then."""
    pressed: Vector
    """G, N: the mean force across each gap over the last window, zero where it is open at its end."""
    taken: Vector
    """One number, J: what damping and the closing of gaps took from a structure with gaps."""


class Trial(NamedTuple):
    """Work space of a window, and what its last trial gave."""

    y: Vector
    v: Vector
    free: Vector
    """State of the structures at the window's end where no force acts."""
    after: Vector
    """State of a structure with gaps at the end, and the forces across these."""
    pressed: Vector
    at_rest: Vector
    """K, m: surfaces where no force acts."""
    force: Vector
    """K, N: mean forces above the static ones, on the structures; and those that the chains answer."""
    answer: Vector
    surface: Vector
    """K, m: at the end of the window."""
    work: Vector
    """K, J: of the answers."""
    lost: Vector
    """C, J; so is the next one."""
    driven: Vector
    chain: Vector
    """Rows of work space of chains."""
    contacts: Vector
    """Rows of K numbers of work space: 5 + 2 PIECES, then a matrix."""


class Search(NamedTuple):
    """The end of Newton's method."""

    tolerance: float
    """Of the force, N."""
    still: float
    """m: a way of a surface that gives no slope."""
    most: int
    """Trials, after which a window is halved."""


def _linear_surfaces(structure: Any, compliance: Vector, run: Any, trial: Any) -> float:
    for k in range(trial.force.size):
        trial.surface[k] = trial.at_rest[k]
        for j in range(trial.force.size):
            trial.surface[k] += compliance[k, j] * trial.force[j]
    return 0.0


@by_type(_linear_surfaces)
def surfaces(structure: Any, compliance: Vector, run: Any, trial: Any) -> float:
    """Put the surfaces at the end of a window under `trial.force` into `trial.surface`; return what gaps took, J."""
    raise NotImplementedError


@by_type()
def agree(
    contacts: Any, run: Any, chains: Any, structure: Any, search: Any, t: float, window: float, trial: Any
) -> tuple[int, float, float]:
    """Find the mean forces of a window from time t on which chains and structure agree.

    Returns the number of trials, the residual (N), and the energy that gaps and damping took (J).
    """
    raise NotImplementedError


@inner()
def predict(run: Any, at: float, out: Vector) -> None:
    """Put the parabola through the last three mean forces, or what fewer give, at another time into `out`."""
    count = min(max(run.counts[0], 0), 3)
    for k in range(out.size):
        out[k] = 0.0
    for i in range(count):
        weight, place = 1.0, run.node_time[i] - run.node_length[i] / 2.0
        for j in range(count):
            if j != i:
                other = run.node_time[j] - run.node_length[j] / 2.0
                weight *= (at - other) / (place - other)
        for k in range(out.size):
            out[k] += weight * run.node_force[i, k]


class OneContact(NamedTuple):
    """One chain on one contact point, whose surface moves straight in a window."""

    static: Vector
    """The static force, N."""
    compliance: Vector
    """1 × 1: displacement for 1 N of mean force, m/N."""
    steps: Vector
    """C × 2: steps of the chain in a window, and in one of its PIECES."""

    @staticmethod
    def agree(
        contacts: Any, run: Any, chains: Any, structure: Any, search: Any, t: float, window: float, trial: Any
    ) -> tuple[int, float, float]:
        """Find the force F by the secant method, from the parabola through those of the last three windows.

        The residual falls at least as fast as F rises, so its slope is −1 or steeper: nothing is divided by zero, an
        open contact included, and it stays so where gaps close, which only stiffens the structure. Where a loss makes
        the force jump as the contact opens there may be no root: the interval that holds the jump is halved.
        """
        chain, static, compliance, steps = chains[0], contacts.static[0], contacts.compliance, contacts.steps[0, 0]
        y, v, first, slope = trial.y, trial.v, 0, min(run.slope[0], -1.0)
        predict(run, t + window / 2.0, trial.force)
        tried = max(trial.force[0] + static, 0.0)
        last_tried, last_residual, residual, taken = 0.0, 0.0, np.inf, 0.0
        low, high, halved, count = -np.inf, np.inf, False, 0
        while count < search.most:
            count += 1
            for i in range(first, y.size):
                y[i], v[i] = run.y[i], run.v[i]
            trial.force[0] = tried - static
            taken = surfaces(structure, compliance, run, trial)
            force, _, lost, driven = advance(
                chain, y, v, trial.chain, t, window, run.surface[0], trial.surface[0], steps, first
            )
            if first == 0:
                trial.lost[0], trial.driven[0] = lost, driven
            first = reach(chain, y.size, steps)
            residual = force - tried
            if not abs(residual) > search.tolerance or compliance[0, 0] == 0.0:
                break
            if residual > 0.0:
                low = max(low, tried)
            else:
                high = min(high, tried)
            # A loss that jumps as the contact opens leaves no root, but a jump over zero.
            if high - low <= search.tolerance:
                residual = 0.0
                break
            # Equal trials where the tolerance is below rounding.
            if count > 1 and not halved and tried != last_tried:
                slope = min((residual - last_residual) / (tried - last_tried), -1.0)
            last_tried, last_residual = tried, residual
            tried -= residual / slope
            halved = count > HALVED_FROM and high < np.inf and low > -np.inf
            if halved:
                tried = 0.5 * (low + high)
        run.slope[0] = slope
        before = run.surface[0]
        # The chain moved against the surface where the force before its last answer would have brought it.
        trial.answer[0] = force - static
        trial.work[0] = trial.answer[0] * (trial.surface[0] - before)
        if trial.pressed.size == 0:
            # A linear structure feels the answer, which is nearer to the root than what was tried.
            trial.force[0] = trial.answer[0]
            surfaces(structure, compliance, run, trial)
        return count, 0.0 if compliance[0, 0] == 0.0 else residual, taken


class Contacts(NamedTuple):
    """Several contacts, ordered by chain; or one whose surface moves along a parabola."""

    static: Vector
    """K, static forces, N."""
    compliance: Vector
    """K × K, displacements for 1 N of mean force, m/N."""
    steps: Vector
    """C × 2: steps of each chain in a window, and in one of its PIECES."""
    behind: Vector
    """K: whether it is the contact of the first bead."""
    begin: Vector
    """C + 1 rows: the first coordinate and the first contact of each chain."""
    quadratic: bool
    """Whether surfaces move along parabolas."""

    @staticmethod
    def agree(
        contacts: Any, run: Any, chains: Any, structure: Any, search: Any, t: float, window: float, trial: Any
    ) -> tuple[int, float, float]:
        """Find the forces by Newton's method with the compliance and a secant slope for each contact.

        The slopes of the chains' answers over their surfaces are negative. Gaps that close only stiffen the structure,
        so the compliance is then too large, and the method still converges: monotonically, for one contact.
        """
        count, work, compliance = trial.force.size, trial.contacts, contacts.compliance
        slope, gap, last_surface, last_answer = work[0], work[1], work[2], work[3]
        matrix, corners = work[5 + PIECES :], work[4 : 5 + PIECES]
        predict(run, t + window / 2.0, trial.force)
        for k in range(count):
            trial.force[k] = max(trial.force[k], -contacts.static[k])
            last_surface[k], last_answer[k], slope[k] = trial.at_rest[k], trial.force[k], run.slope[k]
        rigid, residual, taken = is_zero(compliance), np.inf, 0.0
        tried = 0
        while tried < search.most:
            tried += 1
            taken = surfaces(structure, compliance, run, trial)
            pieces = straight(contacts, run, trial.surface, window, corners)
            copy(run.y, trial.y)
            copy(run.v, trial.v)
            for k in range(count):
                trial.answer[k], trial.work[k] = 0.0, 0.0
            follow_chains(chains, 0, contacts, t, window, corners, pieces, trial)
            residual = 0.0
            for k in range(count):
                if rigid:
                    trial.force[k] = trial.answer[k]
                gap[k] = trial.answer[k] - trial.force[k]
                residual = max(residual, abs(gap[k]))
            if not residual > search.tolerance:
                copy(slope, run.slope)
                break
            for k in range(count):
                way = trial.surface[k] - last_surface[k]
                if tried > 1 and abs(way) > search.still:
                    slope[k] = min((trial.answer[k] - last_answer[k]) / way, 0.0)
                for j in range(count):
                    matrix[k, j] = (1.0 if j == k else 0.0) - slope[k] * compliance[k, j]
            solve(matrix, gap, count)
            for k in range(count):
                last_surface[k], last_answer[k] = trial.surface[k], trial.answer[k]
                trial.force[k] += gap[k]
        return tried, residual, taken


@inner()
def is_zero(matrix: Vector) -> bool:
    """Return whether all entries of a matrix are zero."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            if matrix[i, j] != 0.0:
                return False
    return True


@inner()
def straight(contacts: Any, run: Any, surface: Vector, window: float, corners: Vector) -> int:
    """Put the displacements between which surfaces move straight, at equal times, into rows; return the pieces.

    A parabola through the node before is replaced by PIECES straight pieces.
    """
    pieces = PIECES if contacts.quadratic and run.counts[0] > 0 else 1
    last = run.node_length[0]
    for k in range(surface.size):
        before, end, bend = run.surface[k], surface[k], 0.0
        if pieces > 1:
            earlier = run.node_surface[1, k] if run.counts[0] > 1 else 0.0
            bend = 2.0 * ((end - before) / window - (before - earlier) / last) / (window + last)
        for i in range(pieces + 1):
            part = i / pieces
            corners[i, k] = before + part * (end - before) + 0.5 * bend * window**2 * part * (part - 1.0)
        corners[pieces, k] = end
    return pieces


@inner()
def follow_chain(
    chain: Any, c: int, contacts: Any, t: float, window: float, corners: Vector, pieces: int, trial: Any
) -> None:
    """Move chain c against surfaces that move from corner to corner; add its answers, and fill works and losses."""
    part = window / pieces
    first, last = contacts.begin[c, 0], contacts.begin[c + 1, 0]
    ahead, end = contacts.begin[c, 1], contacts.begin[c + 1, 1]
    # A contact behind comes after that of the last bead.
    back = end - 1 if contacts.behind[end - 1] else -1
    y, v, steps = trial.y[first:last], trial.v[first:last], contacts.steps[c, 0 if pieces == 1 else 1]
    trial.lost[c], trial.driven[c] = 0.0, 0.0
    for p in range(pieces):
        if back >= 0:
            y[0] = chain.rest - corners[p, back]
            v[0] = (corners[p, back] - corners[p + 1, back]) / part
        front, rear, lost, driven = advance(
            chain, y, v, trial.chain[:, first:last], t + p * part, part, corners[p, ahead], corners[p + 1, ahead],
            steps, 0,
        )  # fmt: skip
        if back >= 0:
            y[0] = chain.rest - corners[p + 1, back]
        trial.lost[c] += lost
        trial.driven[c] += driven
        for k in range(ahead, end):
            force = (rear if k == back else front) - contacts.static[k]
            trial.answer[k] += force / pieces
            trial.work[k] += force * (corners[p + 1, k] - corners[p, k])


follow_chains = for_each(follow_chain)
