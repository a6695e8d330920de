"""The loop over the windows of a run: in Python for any scheme, compiled for Newton's method on linear structures."""

from typing import NamedTuple

from numba import NumbaError

from coupling.compiled_run import Engine, StructureWindows, check_finite
from coupling.interface import Interface
from coupling.participant import CheckedParticipant
from coupling.plan import Plan
from coupling.recording.frames import Frames
from coupling.schemes.condensed import Condensed
from coupling.schemes.halving import Adaptive, Windows
from coupling.schemes.scheme import Scheme
from coupling.state import Counts, CoupledState, NotConverged
from structures.kernels.pieces import check_compiled

LARGEST_GAIN = 0.01
"""Part of the impact energy that a passive participant may have given back beyond what it received."""

PROBE = 0.01
"""Part of the greatest force with which a user's participant is tested: whether it repeats a window."""

UNBROKEN = 3e7
"""Steps of beads after which the compiled loop returns, so that Ctrl-C ends a run: about a second, as each window is
tried a few times."""


class Work(NamedTuple):
    """A run to do: its two sides, scheme and plan, what records it, and windows known already."""

    interface: Interface
    scheme: Scheme
    window: float | Adaptive | None
    plan: Plan
    frames: Frames
    known: StructureWindows | None = None

    def do(self) -> None:
        """Fill the frames. Raises NotConverged, FloatingPointError and ValueError."""
        try:
            (run_compiled if is_compiled(self.interface, self.scheme) else run_windows)(self)
        except NumbaError:
            for chain in self.interface.chains:
                check_compiled(chain.model.law, ("force", "slope", "energy"), 1)
                check_compiled(chain.model.loss, ("force_with_loss",), 4)
            raise


def is_compiled(interface: Interface, scheme: Scheme) -> bool:
    """Return whether the compiled loop can run them: Newton's method, on linear structures."""
    if type(scheme) is not Condensed or interface.black_boxes:
        return False
    return all(structure.compact for structure in interface.structures)


def run_windows(work: Work) -> None:
    """Run window by window, by the scheme."""
    interface, scheme, window, plan, frames, _ = work
    windows = Windows(interface, scheme, window.tolerance if isinstance(window, Adaptive) else None)
    state, done, counts = work.interface.start(scheme.start(work.interface)), 0, Counts()
    if scheme.repeats:
        for black_box in interface.black_boxes:
            black_box.check(PROBE * interface.force_scale, plan.length, PROBE * interface.indentation_scale)
    frames.record(work.interface, 0, state, counts)
    while done < plan.total:
        many = min(plan.substeps, plan.total - done) if scheme.whole_window else 1
        ends = _advanced(work, windows, state, done, many)
        for place, body in enumerate(interface.structures if not scheme.repeats and done == 0 else ()):
            if isinstance(body, CheckedParticipant):  # no force acts in the first substep
                body.check_rest(ends[0].surface[interface.touching[place]], PROBE * interface.indentation_scale)
        for state in ends:
            done, counts = done + 1, counts.plus(state.counts)
            if done % plan.stride == 0:
                frames.record(work.interface, done // plan.stride, state, counts)
                counts = Counts()
        _check(work.interface, state)


def _advanced(work: Work, windows: Windows, state: CoupledState, done: int, many: int) -> list[CoupledState]:
    """Return the next states; errors name the window."""
    try:
        return windows.advance(state, work.plan.length, many)
    except NotConverged as error:
        for place, body in enumerate(work.interface.structures if work.scheme.repeats else ()):
            if isinstance(body, CheckedParticipant):  # under the load at which the scheme gave up, and twice that load
                for forces in (body.last_forces, 2.0 * body.last_forces):
                    body.check_repeats(state.structures[place], forces, work.plan.length)
        raise NotConverged(f"window {done // work.plan.substeps + 1}, {error}") from error
    except FloatingPointError as error:
        raise FloatingPointError(f"window from t = {state.time:.6g} s: {error}") from error


def run_compiled(work: Work) -> None:
    """Run all windows in compiled code, for linear structures."""
    interface, scheme, window, plan, frames, known = work
    assert isinstance(scheme, Condensed)
    tolerance = window.tolerance if isinstance(window, Adaptive) else None
    engine = Engine(interface, scheme, plan, frames.saved, tolerance, known)
    run, row, end = engine.start(), 0, plan.rows - 1
    effort = sum(chain.steps(plan.length) * chain.rest.size for chain in interface.chains)
    rows = max(1, int(min(UNBROKEN / effort, plan.total)) // plan.stride)
    while row < end:
        last = min(row + rows, end)
        move = engine.advance if engine.adaptive is None else engine.adapt
        move(run, row * engine.stride, last * engine.stride)
        row = last
    frames.count_damping(interface)


def _check(interface: Interface, state: CoupledState) -> None:
    """Raise FloatingPointError for a state that is no longer finite, ValueError for participants that create energy."""
    check_finite(interface, [(chain.position, chain.velocity) for chain in state.chains], state.surface, state.time)
    for place, body in enumerate(interface.structures if interface.black_boxes else ()):
        if isinstance(body, CheckedParticipant) and body.passive:
            work = float(state.ledger.work[interface.touching[place]].sum())
            if work < -LARGEST_GAIN * interface.impact_energy:
                raise ValueError(
                    f"{body.name}.advance gives back more energy than it received, {-work:.3g} J up to t = "
                    f"{state.time:.6g} s; check the displacement's sign and unit, or set passive = False"
                )
