"""The engine: it drives the compiled window loop and halves windows that fail, or calls the loop in Python."""

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numba import NumbaError

from coupling.black_box import MOST_HALVINGS, MOST_TRIALS, STILL, Condensed, NotConverged, Scheme, run_windows
from coupling.interface import Interface, check_finite
from coupling.kernels import loop
from coupling.kernels.adaptive import GROWS_BELOW, Adaptation, adapt, bend_of_last
from coupling.kernels.newton import Contacts
from coupling.kernels.records import CONTACT, NODE, REMEMBERED, TOTALS, WINDOW, Run, Search, Trial
from coupling.plan import Adaptive, Plan
from coupling.recording.frames import Frames
from particles.contacts import pace_of
from particles.kernels.motion import MOVED, TRIED, WORK_ROWS
from structures.kernels.linear import joined
from structures.kernels.pieces import check_compiled
from structures.structure import Structure

FINEST = 1024  # an adaptive window below the shortest contact over this number is not halved for its error
TAKEN_AS_ONE = 1.0 + 1e-9  # windows are equal if the ratio of their lengths is below this number
UNBROKEN = 3e7  # steps of beads, about a second, after which the compiled loop returns, so that Ctrl-C can end a run
MOST_WINDOWS = 16  # lengths of windows for which the matrices of a structure are kept

_WINDOWS = WeakKeyDictionary[Structure, dict[float, Any]]()


class Engine:
    """The compiled window loop of one run. A structure without degrees of freedom never moves. If all structures are of
    this kind, one window spans a saved interval, with the steps of all windows that the plan has there."""

    def __init__(
        self, interface: Interface, scheme: Scheme, plan: Plan, recorder: Any, window: float | Adaptive | None = None
    ) -> None:
        self.interface, self.plan, self.recorder = interface, plan, recorder
        self.adaptive = window.tolerance if isinstance(window, Adaptive) else None
        """The tolerance of adaptive windows."""
        rigid = self.adaptive is None and not any(structure.size for structure in interface.structures)
        self.joined = plan.stride if rigid else 1
        """Number of windows of the plan that are joined to one."""
        self.length, self.stride = plan.length * self.joined, plan.stride // self.joined
        self.search = Search(scheme.tolerance * interface.force_scale, STILL * interface.indentation_scale, MOST_TRIALS)
        self.finest = interface.contact_time / FINEST
        self._lengths: dict[float, tuple[Any, Any]] = {}
        state, size = self.of_length(self.length)[0].response.shape[1], interface.size
        coordinates, chains = interface.coordinates, len(interface.chains)
        self.trial = Trial(
            np.zeros(coordinates), np.zeros(coordinates), np.zeros(state), np.zeros(size, TRIED),
            np.zeros(chains, MOVED), np.zeros((WORK_ROWS, coordinates)), np.zeros((4 + size, size)),
        )  # fmt: skip
        self.before = None if self.adaptive is None else self.start()

    def start(self) -> Run:
        """Return the run at time zero, in static equilibrium."""
        contacts, chains = self.interface.size, len(self.interface.chains)
        return Run(
            *self.interface.together([chain.start() for chain in self.interface.chains]),
            np.zeros(self.trial.free.size),
            np.zeros(contacts, CONTACT),
            np.zeros(chains, MOVED),
            np.zeros((REMEMBERED, contacts), NODE),
            np.zeros(REMEMBERED, WINDOW),
            np.zeros(1, TOTALS),
        )

    def advance(self, run: Run, first: int, last: int, halvings: int = 0) -> None:
        """Advance the run from the end of window `first` to the end of window `last`, in place. halvings: how often
        these windows were halved, because a whole one failed. Halved windows save nothing."""
        stride, length = 0 if halvings else self.stride, self.length / 2**halvings
        while first < last:
            # The start of a run is saved, too.
            windows = first + 1, last, stride, 0 if first == 0 and stride > 0 else -1
            problem, done, residual = self._move(run, length, windows)
            if problem == loop.OK:
                return
            if problem == loop.NON_FINITE:
                self._check_finite(done * length)
            if halvings == MOST_HALVINGS:
                raise NotConverged(
                    f"window {(done - 1) // 2**halvings + 1}, t = {(done - 1) * length:.6g} s, {length:.3g} s long: "
                    f"residual {residual:.3g} N after {self.search.most} iterations, tolerance "
                    f"{self.search.tolerance:.3g} N"
                )
            self.advance(run, 2 * (done - 1), 2 * done, halvings + 1)
            if stride and done % stride == 0:
                self.save(run, done)
            first = done

    def adapt(self, run: Run, first: int, last: int) -> None:
        """Advance the run by windows whose error is within the tolerance; save the end of each window of the plan."""
        assert self.before is not None
        assert self.adaptive is not None
        if first == 0:
            self.save(run, 0)
        interface, halvings, error = self.interface, 0, self._error(run) if first else 0.0
        while self._is_too_long(run, halvings, error):
            halvings += 1
        done = first * 2**halvings
        while done < last * 2**halvings:
            length, whole = self.length / 2**halvings, 2**halvings
            finest = length <= self.finest
            scale = interface.indentation_scale
            adaptation = Adaptation(self.before, interface.static, scale, self.adaptive, finest, whole)
            pieces = run, interface.model, *self.of_length(length), self.search, self.recorder, self.trial
            problem, done, error = adapt(*pieces, adaptation, (done, last * whole, self.stride, length, error))
            if problem == loop.NON_FINITE:
                self._check_finite(done * length)
            if problem == loop.NOT_CONVERGED and finest:
                self.advance(run, 2 * done, 2 * (done + 1), halvings + 1)
                problem, done, error = loop.OK, done + 1, self._error(run)
                if done % (whole * self.stride) == 0:
                    self.save(run, done // whole)
            if problem != loop.OK:
                done, halvings = 2 * done, halvings + 1
            elif halvings and done % 2 == 0 and not self._is_too_long(run, halvings - 1, error):
                done, halvings = done // 2, halvings - 1

    def _error(self, run: Run) -> float:
        """Return the distance of the last window's straight motion from a parabola, in greatest approaches."""
        moved: float = bend_of_last(run.node, run.window, run.totals, self.interface.static)
        return moved / self.interface.indentation_scale

    def _is_too_long(self, run: Run, halvings: int, error: float) -> bool:
        """Return whether a window is too long after the last one, which had this error, in greatest approaches."""
        last, length = float(run.window[0]["length"]), self.length / 2**halvings
        longest = np.inf
        if last > 0.0:
            longest = 2.0 * last if error < GROWS_BELOW * (self.adaptive or 0.0) else last
        return bool(length > max(longest * TAKEN_AS_ONE, self.finest))

    def _check_finite(self, time: float) -> None:
        """Raise a FloatingPointError that names what the last trial made infinite."""
        trial = self.trial
        chains = [(trial.y[place], trial.v[place]) for place in self.interface.places]
        check_finite(self.interface, chains, trial.contact["surface"], time)

    def save(self, run: Run, done: int) -> None:
        """Save the end of a whole window in its row."""
        self._move(run, self.length, (done + 1, done, 0, done // self.stride))

    def _move(self, run: Run, length: float, windows: tuple[int, int, int, int]) -> Any:
        pieces = run, self.interface.model, *self.of_length(length), self.search, self.recorder, self.trial
        return loop.run_windows(*pieces, length, windows)

    def of_length(self, length: float) -> tuple[Any, Any]:
        """Return the structures and contacts for windows of a length, s, as the compiled loop takes them."""
        if length not in self._lengths:
            interface = self.interface
            pieces = list[Any]()  # kept, because thousands of runs use the same structure with equal windows
            for body in interface.structures:
                known = _WINDOWS.setdefault(body.structure, {})
                if (piece := known.get(length)) is None:
                    if len(known) >= MOST_WINDOWS:
                        known.clear()
                    piece = known[length] = body.window(length)
                pieces.append(piece)
            structure = joined(pieces, list(interface.of_structure), interface.size)
            with np.errstate(over="ignore", invalid="ignore"):  # the loop reports numbers that are not finite
                compliance = structure.contact @ structure.response[:, : structure.contact.shape[1]].T
            steps = [chain.steps(length / self.joined) * self.joined for chain in interface.chains]
            pace = pace_of(interface.model, steps, interface.coordinates)
            self._lengths[length] = structure, Contacts(interface.static, compliance, pace, not compliance.any())
        return self._lengths[length]


def fill(frames: Frames, interface: Interface, scheme: Scheme, window: float | Adaptive | None, plan: Plan) -> None:
    """Run all windows and fill the frames. Raises NotConverged, FloatingPointError and ValueError."""
    try:
        if is_compiled(interface, scheme):
            engine = Engine(interface, scheme, plan, frames.saved, window)
            run, row, end = engine.start(), 0, plan.rows - 1
            effort = sum(chain.steps(plan.length) * chain.rest.size for chain in interface.chains)
            rows = max(1, int(min(UNBROKEN / effort, plan.total)) // plan.stride)
            move = engine.advance if engine.adaptive is None else engine.adapt
            while row < end:
                last = min(row + rows, end)
                move(run, row * engine.stride, last * engine.stride)
                row = last
        else:
            run_windows(interface, scheme, frames, plan.length, plan.stride)
    except NumbaError:
        check_compiled(interface.model.law, ("force", "slope", "energy"), 1)
        check_compiled(interface.model.loss, ("with_loss",), 4)
        raise

    # The damping of linear structures took their work minus their energy; the midpoint rule keeps this balance exactly.
    for place in interface.damped:
        structure = frames.saved.structure[place]
        work = frames.saved.work["work"][interface.touching[place]].sum(axis=0)
        structure["taken"] = work - structure["kinetic"] - structure["elastic"]


def is_compiled(interface: Interface, scheme: Scheme) -> bool:
    """Return whether the compiled loop can run this: it uses Newton's method, on compact linear structures."""
    linear = type(scheme) is Condensed and not interface.black_boxes
    return linear and all(structure.compact for structure in interface.structures)
