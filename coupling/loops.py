"""The loop over the windows of a run: in Python for any scheme, compiled for our strong ones on linear structures."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupling.flat import FlatWindows, flat_chains, flat_gaps, flat_seats
from coupling.interface import Interface
from coupling.participant import BlackBox
from coupling.plan import Plan
from coupling.recording.checkpoint import Keeper
from coupling.recording.frames import Counts, Frames
from coupling.recording.trace import Trace
from coupling.schemes.condensed import MOST_TRIALS, Condensed
from coupling.schemes.iterated import IQN_ILS, Aitken, FixedPoint
from coupling.schemes.scheme import Scheme
from coupling.schemes.windows import FINEST, MOST_HALVINGS, TAKEN_AS_ONE, Adaptive, Windows, allowed, error
from coupling.state import CoupledState, Node, NotConverged
from particles import kernels

ITERATED = {FixedPoint: kernels.FIXED_POINT, Aitken: kernels.AITKEN, IQN_ILS: kernels.LEAST_SQUARES}
"""The schemes by which the compiled loop iterates."""

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
    """A run to do: its two sides, scheme and plan, what records it, the clock of a trace, and windows known already."""

    interface: Interface
    scheme: Scheme
    window: float | Adaptive | None
    plan: Plan
    frames: Frames
    keeper: Keeper | None
    clock: Trace | None
    known: FlatWindows | None = None

    @property
    def compiled(self) -> bool:
        """Whether the compiled loop can do it."""
        return is_compiled(self.interface, self.scheme, self.plan)

    def do(self) -> None:
        """Fill the frames. Raises NotConverged, FloatingPointError and ValueError."""
        (run_compiled if self.compiled else run_windows)(self)


def is_compiled(interface: Interface, scheme: Scheme, plan: Plan) -> bool:
    """Whether the compiled loop can run them: schemes of `ITERATED` in windows of one substep, and gaps of one body."""
    if type(scheme) not in (Condensed, *ITERATED) or (interface.boxes and len(interface.structures) > 1):
        return False
    return (plan.substeps == 1 or not scheme.whole_window) and all(one.compact for one in interface.structures)


def run_windows(work: Work) -> None:
    """Window by window, by the scheme."""
    _, scheme, window, plan, frames, keeper, clock, _ = work
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
    """All windows in compiled code, for linear structures with a scheme that iterates or condenses, and for gaps."""
    interface, _, window, plan, frames, keeper, *_ = work
    loop = Loop(work)
    run, row = loop.start(), 0
    loop.save(run, 0)
    if keeper is not None:
        run, row = keeper.begin(frames, (run, row))
    effort = sum(chain.steps(plan.length) * chain.rest.size for chain in interface.chains)
    windows = min(UNBROKEN / effort, plan.total if keeper is None else CHUNK)
    rows = max(1, int(windows) // plan.stride)
    while row < plan.rows - 1:
        last = min(row + rows, plan.rows - 1)
        move = loop.adapt if isinstance(window, Adaptive) else loop.advance
        move(run, row * loop.stride, last * loop.stride)
        row = last
        if keeper is not None:
            keeper.keep(frames, row, (run, row), row == plan.rows - 1)
    frames.count_damping(interface)


def run_thin(work: Work) -> Frames:
    """The same for thin frames, at once; returns all of the first and the last saved time."""
    ends, loop = Frames(work.interface, 2), Loop(work)
    run = loop.start()
    loop.save(run, 0)
    loop.save(run, 0, ends, 0)
    (loop.advance if loop.adaptive is None else loop.adapt)(run, 0, (work.plan.rows - 1) * loop.stride)
    loop.save(run, work.plan.rows - 1, ends, 1)
    ends.count_damping(work.interface)
    return ends


class Loop:
    """The compiled window loop of one run.

    A structure without degrees of freedom never moves. Windows against such structures may have any length: they are
    as long as a saved interval, and take the steps of the windows that it would hold.
    """

    def __init__(self, work: Work) -> None:
        interface, scheme, window, plan, frames, _, clock, known = work
        self.interface, self.plan, self.frames = interface, plan, frames
        self.search = _search(scheme, interface)
        self.memory = (getattr(scheme, "reuse", 0), 2, self.search.most, interface.size)
        self.adaptive = window.tolerance if isinstance(window, Adaptive) else None
        """The tolerance of adaptive windows."""
        rigid = self.adaptive is None and not any(one.structure.size for one in interface.structures)
        self.joined = plan.stride if rigid else 1
        """Windows of the plan that are one."""
        self.length, self.stride = plan.length * self.joined, plan.stride // self.joined
        bends, condensed = interface.quadratic and not rigid, isinstance(scheme, Condensed)
        self.quadratic = None if interface.size == 1 and condensed and not bends else bends
        self.chains, self.seats = flat_chains(interface), flat_seats(interface)
        self.structures = interface.structures if clock is None else [clock.watch(one) for one in interface.structures]
        self.finest = interface.contact_time / FINEST
        self.kernel: Any = kernels.run_coupled
        self.save_kernel: Any = kernels.save
        if clock is not None:
            self.kernel, self.save_kernel = (
                clock.timed("compiled loop", self.kernel),
                clock.timed("saving", kernels.save),
            )
        self.windows = known or FlatWindows()
        self.closing = interface.boxes[0].closing if interface.boxes else None
        self._lengths: dict[float, tuple[kernels.Structures, kernels.Gaps | None, NDArray[np.int64]]] = {}

    def start(self) -> kernels.Run:
        """The run at time zero, in static equilibrium."""
        starts = [chain.start() for chain in self.interface.chains]
        contacts, chains = self.interface.size, len(starts)
        states, *_ = self._of_length(self.length)
        return kernels.Run(
            np.concatenate([state.position for state in starts]),
            np.concatenate([state.velocity for state in starts]),
            np.zeros(int(states.layout[-1, 0])),
            np.zeros(contacts),
            np.array([0.0, -1.0, 0.0, 0.0]),
            np.zeros(contacts),
            *(np.zeros(3), np.zeros(3), np.zeros((3, contacts)), np.zeros((3, contacts))),
            *(np.zeros(chains), np.zeros(chains)),
            *(np.zeros(contacts), np.zeros(contacts), np.zeros(contacts)),
            np.zeros(3, dtype=np.int64),
            np.zeros(1),
            np.zeros(self.memory),
            np.zeros((self.memory[0], 2)),
            np.zeros(0) if self.closing is None else self.closing.start().pressed,
            np.zeros(1),
        )

    def advance(self, run: kernels.Run, first: int, last: int, halvings: int = 0) -> None:
        """Move the run on from the end of one window to that of another, in place.

        halvings: of the windows. They have been halved because a whole one failed, and save nothing.
        """
        stride = 0 if halvings else self.stride
        while first < last:
            failed = self._try(run, first, last, halvings, stride)
            if failed is None:
                return
            done, residual = failed
            if halvings == MOST_HALVINGS:
                length = self.length / 2**halvings
                what = f"residual {residual:.3g} N" if residual < np.inf else "surfaces that still move"
                raise NotConverged(
                    f"window {(done - 1) // 2**halvings + 1}, t = {(done - 1) * length:.6g} s, {length:.3g} s long: "
                    f"{what} after {self.search.most} iterations, tolerance {self.search.tolerance:.3g} N"
                )
            self.advance(run, 2 * (done - 1), 2 * done, halvings + 1)
            if stride and done % stride == 0:
                self.save(run, done)
            first = done

    def adapt(self, run: kernels.Run, first: int, last: int) -> None:
        """The same by windows whose error is within the tolerance; every whole window is saved."""
        for done in range(first + 1, last + 1):
            self._adapted(run, done, 0)
            if done % self.stride == 0:
                self.save(run, done)

    def _adapted(self, run: kernels.Run, done: int, halvings: int) -> None:
        """One window, or its halves, in place."""
        assert self.adaptive is not None
        length = self.length / 2**halvings
        finest = length <= self.finest
        if finest or length <= allowed(self.interface, past(run), self.adaptive) * TAKEN_AS_ONE:
            before = [part.copy() for part in run]
            failed = self._try(run, done - 1, done, halvings, 0)
            if failed is None and (finest or error(self.interface, past(run)) <= self.adaptive):
                return
            if finest:
                self.advance(run, 2 * (done - 1), 2 * done, halvings + 1)
                return
            tried = run.counts[1]
            for part, old in zip(run, before, strict=True):
                part[...] = old
            run.counts[1] = tried
        self._adapted(run, 2 * done - 1, halvings + 1)
        self._adapted(run, 2 * done, halvings + 1)

    def _try(self, run: kernels.Run, first: int, last: int, halvings: int, stride: int) -> tuple[int, float] | None:
        """Move the run on as far as it goes; the window that failed, and its residual (N)."""
        length = self.length / 2**halvings
        structures, gaps, steps = self._of_length(length)
        problem, done, detail, place = self.kernel(
            run, self.chains, structures, gaps, self.seats, steps, length, self.quadratic, self.search,
            (first + 1, last), stride, self.frames.saved,
        )  # fmt: skip
        if problem == kernels.NON_FINITE:
            raise non_finite(self.interface, place, done * length, int(detail))
        return None if problem == kernels.OK else (done, detail)

    def save(self, run: kernels.Run, done: int, frames: Frames | None = None, row: int | None = None) -> None:
        """Save the end of a whole window, in its own row of the frames or in another."""
        structures, gaps, _ = self._of_length(self.length)
        self.save_kernel(
            run, self.chains, structures, gaps, self.seats, done * self.length,
            done // self.stride if row is None else row, (frames or self.frames).saved,
        )  # fmt: skip

    def _of_length(self, length: float) -> tuple[kernels.Structures, kernels.Gaps | None, NDArray[np.int64]]:
        """The structures over a window of a length, s, their gaps, and each chain's steps in it and in a piece."""
        if length not in self._lengths:
            parts = length, length / kernels.PIECES
            steps = np.array(
                [[chain.steps(part / self.joined) * self.joined for part in parts] for chain in self.interface.chains]
            )
            gaps = None if self.closing is None else flat_gaps(self.closing, length)
            self._lengths[length] = self.windows.of(self.structures, length), gaps, steps
        return self._lengths[length]


def _search(scheme: Any, interface: Interface) -> kernels.Search:
    """What the compiled loop takes of a scheme."""
    tolerance = scheme.tolerance * interface.force_scale
    if isinstance(scheme, Condensed):
        still = kernels.STILL * interface.indentation_scale
        return kernels.Search(kernels.NEWTON, tolerance, still, MOST_TRIALS, 0.0, 0.0)
    still, filtering = scheme.tolerance * interface.indentation_scale, getattr(scheme, "filtering", 0.0)
    return kernels.Search(
        ITERATED[type(scheme)], tolerance, still, scheme.largest_count, scheme.relaxation, float(filtering)
    )


def past(run: kernels.Run) -> list[Node]:
    """The last nodes, newest last."""
    columns = run.node_time, run.node_length, run.node_surface, run.node_force
    return [Node(*(column[i] for column in columns)) for i in reversed(range(int(run.counts[0])))]


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
