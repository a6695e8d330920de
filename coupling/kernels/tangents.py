"""Derivatives of a run: dual numbers that follow each window on which chains and structures agree.

A window's forces solve an equation, so their derivatives solve the linear equation that belongs to it. With F the mean
forces, w the surfaces at the end and answer(w, p) what the chains answer, F = answer(w_free(p) + C(p) F, p):

    (I − A C) dF = dA,   A = ∂answer/∂w,   dA = the answer's derivative where the forces are held.

The chains therefore carry some directions more than were asked for: the surface of each contact at the window's end.
These come first, all of them in the first group of directions.

References
----------
Griewank and Walther, Evaluating Derivatives, 2nd ed. (SIAM 2008), section 15.1: derivatives of implicit functions.
"""

from typing import Any, NamedTuple

from coupling.kernels.newton import PIECES
from coupling.kernels.recorders import reads_structure, record
from particles.kernels.motion import advance, contact_forces
from structures.kernels.arrays import solve
from structures.kernels.duals import Lanes, as_duals, with_value
from structures.kernels.families import of_run
from structures.kernels.kernel_cache import inner
from structures.kernels.linear import let_go, push, read, respond
from structures.kernels.pieces import for_each
from structures.structure import Vector


class Model(NamedTuple):
    """What a run is made of, in dual numbers; the structure and the compliance are those of windows of one length."""

    chains: Any
    """ChainModels."""
    structure: Any
    compliance: Lanes
    """K × K, m/N."""
    static: Lanes
    """K, N."""


class Moving(NamedTuple):
    """The state of a run in dual numbers, as plain numbers: groups × shape × entries."""

    y: Vector
    """Coordinates of all chains, m; and velocities, m/s."""
    v: Vector
    body: Vector
    """Two states of the structures: without the response to the pending forces, and work space."""
    now: Vector
    """Which of these is that of the run, in each group."""
    surface: Vector
    """Rows of K displacements, m: at the end of the last window, of the one before it, and of the one that is tried."""
    force: Vector
    """Two rows of K: mean forces of the last window, pending; and what the chains answer to the surfaces, N."""
    work: Vector
    """Work space of chains."""
    moved: Vector
    """Whether the structures of each group have moved."""
    begun: Vector
    """1: whether any derivative may differ from zero."""


class Duals(NamedTuple):
    """The arrays of `Moving` of one group, as dual numbers."""

    y: Any
    v: Any
    surface: Any
    force: Any
    work: Any


class Span(NamedTuple):
    """A window: when it begins, its length and that of the last one, s; and whether surfaces follow a parabola."""

    t: float
    window: float
    last: float
    bends: bool


class Tangents(NamedTuple):
    """A recorder that carries the derivatives along and keeps those of forces and velocities."""

    values: Any
    """The recorder of the run itself; and the Sensors in it."""
    sensors: Any
    plan: Any
    """Contacts: numbers of steps, and which contact is behind."""
    model: Any
    moving: Any
    matrix: Vector
    """K × K numbers: work space."""
    force: Vector
    """Groups × saved times × contacts × entries, N per unit of each parameter."""
    velocity: Vector
    """Groups × saved times × bodies × entries."""
    width: Any
    """Four, Eight or Sixteen entries."""
    begin: int
    """The body on whose motion the first derivatives wait; −1 where they begin with the run."""

    @staticmethod
    def reads_structure(recorder: Any, row: int) -> bool:
        return reads_structure(recorder.values, row)

    @staticmethod
    def watch(recorder: Any, run: Any, trial: Any, t: float, window: float) -> None:
        """Move the dual numbers on over a window that is agreed, before the run takes it over."""
        groups = recorder.force.shape[0]
        if not has_begun(recorder, run, trial):
            return
        for group in range(groups):
            move_group(recorder, group, run, trial, t, window)
        # The first group, which has what the others need, forgets it.
        for group in range(groups - 1, -1, -1):
            join_group(recorder, group, trial)

    @staticmethod
    def record(
        recorder: Any, row: int, t: float, run: Any, chains: Any, structure: Any, begin: Vector, work: Vector
    ) -> None:
        record(recorder.values, row, t, run, chains, structure, begin, work)
        for group in range(recorder.force.shape[0]):
            save_group(recorder, group, row, t, run, begin)


@inner()
def has_begun(recorder: Any, run: Any, trial: Any) -> bool:
    """Return whether any derivative may differ from zero: before the wave is where a parameter acts, none does."""
    moving, begin = recorder.moving, recorder.begin
    if not moving.begun[0]:
        begun = begin < 0 or trial.y[begin] != 0.0 or trial.v[begin] != 0.0
        for k in range(trial.contact.size):
            begun = begun or trial.contact[k].force != 0.0
        moving.begun[0] = begun
        for i in range(run.y.size):
            moving.y[:, i, 0], moving.v[:, i, 0] = run.y[i], run.v[i]
    return bool(moving.begun[0])


@inner()
def duals_of(moving: Any, group: int, width: Any) -> Any:
    """Return the state of a group in dual numbers."""
    return Duals(
        as_duals(moving.y, group, width),
        as_duals(moving.v, group, width),
        as_duals(moving.surface, group, width),
        as_duals(moving.force, group, width),
        as_duals(moving.work, 0, width),
    )


@inner()
def move_group(recorder: Any, group: int, run: Any, trial: Any, t: float, window: float) -> None:
    """Move the dual numbers of a group on over a window whose forces are held, and its surfaces at the end."""
    moving, plan, width, count = recorder.moving, recorder.plan, recorder.width, trial.contact.size
    chains, structure, compliance, static = of_run(recorder.model, group)
    body, duals, now = as_duals(moving.body, group, width), duals_of(moving, group, width), moving.now[group]
    force, surface = duals.force, duals.surface
    for k in range(count):
        for entry in range(moving.force.shape[3]):
            moving.moved[group] = moving.moved[group] or moving.force[group, 0, k, entry] != 0.0
    if moving.moved[group]:
        if count == 1:
            respond(structure, force[0, 0], body[now], body[1 - now])
        else:
            for k in range(count):
                push(structure, k, force[0, k], body[now])
            let_go(structure, body[now], body[1 - now])
        now = 1 - now
        moving.now[group] = now
    for k in range(count):
        place = read(structure, k, body[now]) if moving.moved[group] else 0.0 * force[0, k]
        for j in range(count):
            place += compliance[k, j] * trial.contact[j].force
        surface[2, k] = place
        moving.surface[group, 2, k, 0] = trial.contact[k].surface
        moving.surface[group, 0, k, 0] = run.contact[k].surface
        if group == 0:
            moving.surface[0, 2, k, 1 + k] = 1.0
        force[1, k] = 0.0
    bends = plan.quadratic and run.totals[0].remembered > 0
    last = run.window[0].length if bends else window
    answer_chains(chains, 0, plan, Span(t, window, last, bends), static, duals, run, trial)


@inner()
def corner(surface: Any, k: int, part: float, span: Any) -> Any:
    """Return the displacement of a surface after a part of a window, along a straight line or a parabola."""
    before, end = surface[0, k], surface[2, k]
    place = before + part * (end - before)
    if span.bends and part < 1.0:
        window, last = span.window, span.last
        bend = 2.0 * ((end - before) / window - (before - surface[1, k]) / last) / (window + last)
        place += 0.5 * bend * window**2 * part * (part - 1.0)
    return place


@inner()
def answer_chain(chain: Any, c: int, plan: Any, span: Any, static: Any, duals: Any, run: Any, trial: Any) -> None:
    """Move chain c against its surfaces, and put its answers into the second row of `force`."""
    first, end, ahead, behind = plan.begin[c, 0], plan.begin[c + 1, 0], plan.begin[c, 1], plan.begin[c + 1, 1] - 1
    back = behind if plan.behind[behind] else -1
    pieces, steps = PIECES if span.bends else 1, plan.steps[c, 1 if span.bends else 0]
    y, v, surface, force, window = duals.y[first:end], duals.v[first:end], duals.surface, duals.force, span.window
    for p in range(pieces):
        begin = corner(surface, ahead, p / pieces, span)
        place, after = corner(surface, ahead, (p + 1) / pieces, span), begin
        if back >= 0:
            before = corner(surface, back, p / pieces, span)
            after = corner(surface, back, (p + 1) / pieces, span)
            y[0], v[0] = chain.rest - before, (before - after) * (pieces / window)
        t, part = span.t + p * window / pieces, window / pieces
        front, rear, _, _ = advance(chain, y, v, duals.work[:, first:end], t, part, begin, place, steps)
        force[1, ahead] += (front - static[ahead]) / pieces
        if back >= 0:
            y[0] = chain.rest - after
            force[1, back] += (rear - static[back]) / pieces


answer_chains = for_each(answer_chain)


@inner()
def join_group(recorder: Any, group: int, trial: Any) -> None:
    """Let the forces and the surfaces of a window agree in all directions of a group."""
    moving, matrix, width, count = recorder.moving, recorder.matrix, recorder.width, trial.contact.size
    y, v, surface, force, _ = duals_of(moving, group, width)
    compliance = recorder.model.compliance.values[0]
    for k in range(count):
        for j in range(count):
            matrix[k, j] = 1.0 if j == k else 0.0
            for i in range(count):
                matrix[k, j] -= moving.force[0, 1, k, 1 + i] * compliance[i, j, 0]
    for k in range(count):
        force[0, k] = force[1, k]
        for entry in range(count + 1 if group == 0 else 1):
            moving.force[group, 0, k, entry] = 0.0
    solve(matrix, force[0], count)
    for k in range(count):
        surface[1, k] = surface[0, k]
        surface[0, k] = 0.0 * force[0, k]
        for j in range(count):
            surface[0, k] += compliance[k, j, 0] * force[0, j]
        if group == 0:
            # The direction of the surface begins anew.
            moving.surface[0, 0, k, 1 + k] = -1.0
        way = surface[0, k]
        # The values become those of the run: else rounding would part them.
        for i in range(y.size):
            y[i] = with_value(y[i] + moving.y[0, i, 1 + k] * way, trial.y[i])
            v[i] = with_value(v[i] + moving.v[0, i, 1 + k] * way, trial.v[i])
        surface[0, k] += surface[2, k]
    for k in range(count):
        moving.force[group, 0, k, 0] = trial.contact[k].force


@inner()
def save_group(recorder: Any, group: int, row: int, t: float, run: Any, begin: Vector) -> None:
    """Keep the derivatives of forces and velocities at a saved time."""
    moving, sensors, width = recorder.moving, recorder.sensors, recorder.width
    chains, duals = of_run(recorder.model.chains, group), duals_of(moving, group, width)
    window = run.window[0].length if run.totals[0].remembered > 0 else 1.0
    velocity, forces = as_duals(recorder.velocity, group, width), as_duals(recorder.force, group, width)
    save_chains(chains, 0, sensors, t, window, duals, begin, forces[row])
    for c in range(begin.shape[0] - 1):
        for j in range(sensors.begin[c, 1], sensors.begin[c + 1, 1]):
            velocity[row, j] = duals.v[begin[c, 0] + sensors.body[j]]


@inner()
def save_chain(
    chain: Any, c: int, sensors: Any, t: float, window: float, duals: Any, begin: Vector, forces: Any
) -> None:
    """Put the forces of chain c at the contacts of sensors into `forces`."""
    first, end, k, now, after = begin[c, 0], begin[c + 1, 0], begin[c, 1], sensors.begin[c, 0], sensors.begin[c + 1, 0]
    surface = duals.surface
    rate = (surface[0, k] - surface[1, k]) / window
    contact_forces(
        chain, duals.y[first:end], duals.v[first:end], t, surface[0, k], rate, sensors.contact[now:after],
        forces[now:after], duals.work[:, first:end],
    )  # fmt: skip


save_chains = for_each(save_chain)
