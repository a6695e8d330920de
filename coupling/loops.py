"""The loop over the windows of a run: in Python for any scheme, compiled for one linear structure at one contact."""

from typing import Any, NamedTuple

import numpy as np

from coupling.interface import Interface
from coupling.participant import BlackBox
from coupling.plan import Plan
from coupling.recording.checkpoint import Keeper
from coupling.recording.frames import Counts, Frames
from coupling.recording.trace import Trace
from coupling.schemes.condensed import Condensed
from coupling.schemes.scheme import Scheme
from coupling.schemes.windows import Adaptive, Windows
from coupling.state import CoupledState, NotConverged
from particles import kernels

LARGEST_GAIN = 0.01
"""Part of the impact energy that a passive participant may have given back beyond what it received."""

PROBE = 0.01
"""Part of the greatest force with which a user's participant is tested: whether it repeats a window."""

CHUNK = 4096
"""Windows after which the compiled loop looks whether a checkpoint is due; at least one saved interval."""

UNBROKEN = 3e7
"""Steps of beads after which the compiled loop returns, so that Ctrl-C ends a run: about a second, as each window is
tried a few times."""


class Work(NamedTuple):
    """A run to do: its two sides and scheme, the plan, what records it, and the clock of a trace."""

    interface: Interface
    scheme: Scheme
    window: float | Adaptive | None
    plan: Plan
    frames: Frames
    keeper: Keeper | None
    clock: Trace | None

    @property
    def compiled(self) -> bool:
        """Whether the compiled loop can do it."""
        one = self.interface.single and not self.interface.quadratic and not isinstance(self.window, Adaptive)
        return one and isinstance(self.scheme, Condensed) and bool(self.interface.structures[0].compact)

    def do(self) -> None:
        """Fill the frames. Raises NotConverged, FloatingPointError and ValueError."""
        (run_compiled if self.compiled else run_windows)(self)


def run_windows(work: Work) -> None:
    """Window by window, by the scheme."""
    _, scheme, window, plan, frames, keeper, clock = work
    interface = work.interface if clock is None else clock.watch_interface(work.interface)
    windows = Windows(interface, scheme, window.tolerance if isinstance(window, Adaptive) else None)
    state, done, counts = work.interface.start(scheme.start(work.interface)), 0, Counts()
    if scheme.repeats:
        for box in interface.boxes:
            box.check(PROBE * interface.force_scale, plan.length, PROBE * interface.indentation_scale)
    frames.record(work.interface, 0, state, counts, plan.length)
    if keeper is not None:
        state, done, counts = keeper.begin(frames, (state, done, counts))
    while done < plan.total:
        many = min(plan.substeps, plan.total - done) if scheme.whole_window else 1
        ends = _advanced(work, windows, state, done, many)
        if not scheme.repeats and done == 0:
            _check_rest(work.interface, ends[0])
        for state in ends:
            done, counts = done + 1, counts.after(state)
            if done % plan.stride == 0:
                frames.record(work.interface, done // plan.stride, state, counts, plan.length)
                counts = Counts()
        _check(work.interface, state)
        if keeper is not None:
            keeper.keep(frames, done // plan.stride, (state, done, counts), done == plan.total)


def _advanced(work: Work, windows: Windows, state: CoupledState, done: int, many: int) -> list[CoupledState]:
    """The next states; errors name the window."""
    try:
        return windows.advance(state, work.plan.length, many)
    except NotConverged as error:
        if work.scheme.repeats:
            _check_repeats(work.interface, state, work.plan.length)
        raise NotConverged(f"window {done // work.plan.substeps + 1}, {error}") from error
    except FloatingPointError as error:
        raise FloatingPointError(f"window from t = {state.time:.6g} s: {error}") from error


def run_compiled(work: Work) -> None:
    """All windows in compiled code; for one chain and one linear structure with the scheme Condensed."""
    interface, scheme, _, plan, frames, keeper, clock = work
    loop: Any = kernels.run_condensed
    chain, structure = interface.chains[0], interface.structures[0]
    if clock is not None:
        loop, structure = clock.timed("compiled loop", loop), clock.watch(structure)
    length, linear = plan.length, structure.propagator(plan.length)
    static = float(chain.static_force[-1])
    tolerance = scheme.tolerance * chain.force_scale  # type: ignore[attr-defined]
    start = interface.start(scheme.start(interface))
    y, v = start.chains[0][:2]
    moved = y, v, np.zeros(linear.response.size), start.memory, kernels.Totals()
    row = 0
    frames.record(interface, 0, start, Counts(), plan.length)
    if keeper is not None:
        moved, row = keeper.begin(frames, (moved, row))
    steps = chain.steps(length)
    windows = min(UNBROKEN / (steps * start.chains[0].position.size), plan.total if keeper is None else CHUNK)
    rows = max(1, int(windows) // plan.stride)
    while row < plan.rows - 1:
        y, v, body, guess, totals = moved
        last = min(row + rows, plan.rows - 1)
        problem, done, detail, totals = loop(
            y, v, chain.constants, chain.method, steps, length, static, tolerance, plan.stride,
            linear, body, guess, totals, (row, last), frames.compiled(),
        )  # fmt: skip
        moved = y, v, body, guess, totals
        if problem == kernels.NON_FINITE:
            raise non_finite(interface, int(detail), done * plan.length)
        if problem == kernels.NOT_CONVERGED:
            raise NotConverged(f"window {done}, t = {done * plan.length:.4g} s: residual {detail:.3g} N")
        row = last
        if keeper is not None:
            keeper.keep(frames, row, (moved, row), row == plan.rows - 1)
    frames.substeps[1:] = plan.stride
    if not interface.structures[0].conservative:
        # The identity of the midpoint rule: damping took the part of the work that is not in the energy.
        frames.damped[:] = frames.work - frames.kinetic - frames.elastic


def _check_repeats(interface: Interface, state: CoupledState, length: float) -> None:
    """A ValueError for participants that cannot repeat under the load at which a scheme gave up, or twice that load."""
    for place, box in enumerate(interface.structures):
        if isinstance(box, BlackBox):
            for forces in (box.last_forces, 2.0 * box.last_forces):
                box.check_repeats(state.structures[place], forces, length)


def _check_rest(interface: Interface, first: CoupledState) -> None:
    """A ValueError for participants that move in the first substep, in which no force acts."""
    for place, box in enumerate(interface.structures):
        if isinstance(box, BlackBox):
            moved = first.surface[interface.touched_by(place)]
            box.check_rest(moved, PROBE * interface.indentation_scale)


def _check(interface: Interface, state: CoupledState) -> None:
    """FloatingPointError for a state that is no longer finite, ValueError for participants that create energy."""
    for number, chain in enumerate(state.chains):
        bad = kernels.first_bad(chain.position, chain.velocity, state.surface[interface.of_chain[number][0]])
        if bad >= 0:
            raise non_finite(interface, bad, state.time, number)
    for place, box in enumerate(interface.structures if interface.boxes else ()):
        if isinstance(box, BlackBox) and box.passive:
            work = float(state.ledger.work[interface.touched_by(place)].sum())
            if work < -LARGEST_GAIN * interface.impact_energy:
                raise ValueError(
                    f"{box.name}.advance gives back more energy than it received, {-work:.3g} J up to t = "
                    f"{state.time:.6g} s; check the displacement's sign and unit, or set passive = False"
                )


def non_finite(interface: Interface, bead: int, time: float, number: int = 0) -> FloatingPointError:
    """The error that names the body whose state is no longer finite."""
    chain = interface.chains[number].chain
    first = "the striker (bead 0)" if chain.body else "what moves the first bead (bead 0)"
    what = first if bead == 0 else f"bead {bead}" if bead <= len(chain.beads) else "the structure's surface"
    of = f" of chain {number}" if len(interface.chains) > 1 else ""
    return FloatingPointError(f"{what}{of} is no longer finite at t = {time:.6g} s; check dt and the structure")
