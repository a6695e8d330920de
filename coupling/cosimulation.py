"""The co-simulation: chains, structures, and the loop over windows that couples them."""

import logging
from collections.abc import Iterable
from math import ceil, inf, log2
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.interface import Interface, for_each
from coupling.participant import BlackBox
from coupling.recording.checkpoint import Keeper
from coupling.recording.dataset import dataset, summary
from coupling.recording.frames import Counts, Frames
from coupling.recording.trace import Trace
from coupling.results.findings import warn
from coupling.run_checks import check_length, checked
from coupling.schemes.condensed import Condensed, Scheme
from coupling.schemes.windows import Adaptive, Windows
from coupling.state import CoupledState, NotConverged
from particles import kernels
from particles.chain import Chain
from particles.moving import MovingChain
from structures.checks import instance, listed, one_of, positive, short, whole
from structures.moving import MovingStructure

FEWEST_PER_CONTACT = 8
"""Coarser substeps or frames are warned of: on a PTFE rod AR is 0.2 % off at 3.5 of them a contact, 3 % at 1.7."""

SAVED_PER_CONTACT = 64
"""Saved times in the shortest contact by default, or up to twice as many."""

ADAPTIVE_PER_CONTACT = 16
"""Saved intervals in the shortest contact, which are the longest adaptive windows."""

MOST_SAVED = 2e8
"""Saved times × bodies: 1.6 GB in each of the three large arrays."""

GIVES_BACK = 0.01
"""Part of the impact energy that a passive participant may have given back beyond what it got."""

PROBE = 0.01
"""Part of the greatest force with which it is tried whether a user's participant repeats a window."""

LATE = 1e-9
"""Times that differ by this part are one."""

WAVEFORMS = ("linear", "quadratic")

TOTALS = 6
"""Running sums of the compiled loop."""

CHUNK = 4096
"""Windows between which the compiled loop looks whether a checkpoint is due; at least one saved interval."""

log = logging.getLogger("hertzlink.cosimulation")


class Plan(NamedTuple):
    """How a run is cut: length (s) of a substep, substeps in a window, substeps between saved times, saved times."""

    length: float
    substeps: int
    stride: int
    rows: int

    @property
    def total(self) -> int:
        """Substeps in the run."""
        return (self.rows - 1) * self.stride


class CoSimulation:
    """Chains that face structures through the Hertzian contacts at their ends.

    chain: a Chain, or a list of them. structure: what its last bead faces: a Structure, a MovingStructure where it
    shall have another stepper, any Participant, or None for nothing. Several chains take a list of as many, or one
    structure with as many contact points; one point of such a structure is a ContactPoint(structure, number).
    behind: what the first bead of the chain, or of each, faces with its struck side, alike.
    scheme: how the two sides agree within a window; Condensed() for Structures, Aitken() for black boxes.
    window, s: the time after which they have agreed, or an Adaptive(tolerance); by default what the scheme needs.
    dt, s: the chain's step; chosen from the shortest contact time unless given. substeps: of the structures in a
    window, by default what the scheme needs; each holds a whole number of the chain's steps. waveform: how a surface
    moves over a substep, "linear" or "quadratic".
    """

    def __init__(
        self,
        chain: Chain | Iterable[Chain],
        structure: Any,
        scheme: Scheme | None = None,
        window: float | Adaptive | None = None,
        dt: float | None = None,
        *,
        substeps: int | None = None,
        waveform: str = "linear",
        behind: Any = None,
    ) -> None:
        several = not isinstance(chain, Chain) and isinstance(chain, Iterable)
        if several:
            chains = listed("chain", chain, Chain, "one Chain or more")
        else:
            chains = [instance("chain", chain, Chain, "a Chain, or a list of them")]
        self.scheme: Scheme = Condensed() if scheme is None else scheme
        if isinstance(self.scheme, type) or not hasattr(self.scheme, "step"):
            raise ValueError(f"scheme = {short(scheme)}: must be a scheme such as Condensed() or Aitken()")
        one_of("waveform", waveform, WAVEFORMS)
        dt = None if dt is None else positive("dt", dt, "s")
        facing = for_each("structure", structure, len(chains), several)
        back = for_each("behind", behind, len(chains), several)
        self.interface = Interface(chains, facing, back, waveform == "quadratic", dt)
        self.scheme.start(self.interface)
        self.window = window if window is None or isinstance(window, Adaptive) else positive("window", window, "s")
        self.substeps = None if substeps is None else whole("substeps", substeps)
        if self.substeps is not None and not isinstance(self.window, float):
            raise ValueError(f"substeps = {substeps!r}: divide a window; give window, in s, as well")
        if dt is not None and isinstance(self.window, float) and dt > self.window:
            raise ValueError(f"dt = {dt!r}: must not be longer than the window, {window} s")

    @property
    def chain(self) -> MovingChain:
        """The chain, or the first of several."""
        return self.interface.chains[0]

    @property
    def structure(self) -> Any:
        """What it faces, as a participant."""
        return self.interface.structures[0]

    def run(
        self,
        until: float,
        save_every: float | None = None,
        checkpoint: str | Path | None = None,
        trace: bool = False,
    ) -> xr.Dataset:
        """Simulate up to `until` (s) and return what was saved every `save_every` s.

        By default that is every substep of a window that was given, else 64 times in the shortest contact or more.

        The last saved time is `until`, or the last whole interval before it.
        By default times are `until` divided by a power of two, so that runs of the same length share theirs.
        checkpoint: a file that keeps the complete state, written some seconds apart and at the end. Where it is there
        already the run goes on from it, and ends with the same bits as a run at one go; a finished one is read. Of a
        user's participant it holds the states, by pickle: they must be all that changes. One run at a time may write
        a file; open only your own. trace: whether to put the seconds that each part took into the attribute "trace".
        Raises ValueError for times that do not fit and for checkpoints of other runs, NotConverged, and
        FloatingPointError where a body's state is no longer finite.
        """
        until = positive("until", until, "s")
        findings = check_length(self.interface.chains, until)
        warn(findings)
        plan = self._plan(until, save_every)
        findings += self._warn_if_coarse(plan)
        for chain in self.interface.chains:
            chain.steps(until)
        given = {**self.describe(), "until": until, **self._told(plan)}
        clock = Trace() if instance("trace", trace, bool, "True or False") else None
        keeper = None
        if checkpoint is not None:
            keeper = Keeper(checkpoint, given, self.interface, plan.length, self.scheme.repeats)
        frames = Frames(self.interface, plan.rows)
        work = self._run_compiled if self._compact else self._run_windows
        if clock is None:
            work(plan, frames, keeper, None)
        else:
            work(plan, clock.watch(frames), clock.watch(keeper), clock)
        findings += checked(self.interface, frames, plan.length * plan.stride)
        run = dataset(self.interface, frames, plan.length * plan.stride, given, findings)
        if log.isEnabledFor(logging.INFO):
            log.info("%s", summary(run))
        return run if clock is None else run.assign_attrs(trace=clock.told())

    def describe(self) -> dict[str, Any]:
        """The full input as plain data."""
        return {**self.interface.describe(), "scheme": repr(self.scheme)}

    def start(self) -> CoupledState:
        """The state at time zero: strikers touch their first beads."""
        return self.interface.start(self.scheme.start(self.interface))

    def step(self, state: CoupledState, window: float) -> CoupledState:
        """One window on, by the scheme, in one substep. Raises NotConverged."""
        return self.scheme.step(self.interface, state, window, 1)[-1]

    def _plan(self, until: float, save_every: float | None) -> Plan:
        for structure in self.interface.structures:
            valid = structure.structure.valid_until if isinstance(structure, MovingStructure) else inf
            if until > valid * (1.0 + LATE):
                raise ValueError(f"until = {until!r}: the structure was reduced for runs of at most {valid} s")
        adaptive, window = isinstance(self.window, Adaptive), self.window
        per_contact = ADAPTIVE_PER_CONTACT if adaptive else self.scheme.substeps_per_contact
        longest = self.interface.contact_time / per_contact
        if isinstance(window, float):
            if window > until:
                raise ValueError(f"window = {window!r}: must not be longer than the run, until = {until!r} s")
            substeps = self.substeps or _power_of_two(window / longest)
            longest = window / substeps
        else:
            substeps = 1
        if save_every is None:
            if isinstance(window, float):
                return Plan(longest, substeps, 1, self._rows(until / longest))
            count = _power_of_two(until * min(SAVED_PER_CONTACT, per_contact) / self.interface.contact_time)
            stride = _power_of_two(until / count / longest)
            return Plan(until / count / stride, 1, stride, self._rows(count))
        save_every = positive("save_every", save_every, "s")
        if save_every > until:
            raise ValueError(f"save_every = {save_every!r}: must not be longer than the run, until = {until!r} s")
        if isinstance(window, float) and save_every < longest * (1.0 - LATE):
            raise ValueError(
                f"save_every = {save_every!r}: must not be shorter than a substep of the window, {longest:.6g} s"
            )
        stride = 1 if adaptive else ceil(save_every / longest * (1.0 - LATE))
        return Plan(save_every / stride, substeps, stride, self._rows(until / save_every, save_every))

    def _rows(self, intervals: float, save_every: float | None = None) -> int:
        """Saved times over so many intervals, the start included; a ValueError where they would not fit in memory."""
        bodies = sum(chain.rest.size for chain in self.interface.chains)
        if intervals * bodies > MOST_SAVED:
            name, advice = ("until", "give save_every") if save_every is None else ("save_every", "take a longer one")
            given = "" if save_every is None else f" = {save_every!r}"
            raise ValueError(f"{name}{given}: {intervals:.3g} saved times of {bodies} bodies are too many; {advice}")
        return int(intervals * (1.0 + LATE)) + 1

    def _warn_if_coarse(self, plan: Plan) -> list[str]:
        """A finding where windows or saved times are too few in a contact."""
        coarse = self.interface.contact_time / FEWEST_PER_CONTACT
        name = "window" if plan.substeps == 1 else "window / substeps"
        for what, interval in ((name, plan.length), ("save_every", plan.length * plan.stride)):
            if interval > coarse * (1.0 + LATE) and not (what == name and isinstance(self.window, Adaptive)):
                finding = f"{what} = {interval:.3g} s: is coarse compared with a contact; take at most {coarse:.3g} s"
                warn([finding])
                return [finding]
        return []

    def _told(self, plan: Plan) -> dict[str, Any]:
        """Of the plan, what belongs to the input."""
        told: dict[str, Any] = {"window": plan.substeps * plan.length, "substeps": plan.substeps}
        if isinstance(self.window, Adaptive):
            told = {"window": repr(self.window)}
        told["save_every"] = plan.length * plan.stride
        told["steps"] = [chain.steps(plan.length) for chain in self.interface.chains]
        return {**told, "waveform": WAVEFORMS[self.interface.quadratic]}

    @property
    def _compact(self) -> bool:
        """Whether the compiled loop can do it."""
        one = self.interface.single and not self.interface.quadratic and not isinstance(self.window, Adaptive)
        return one and isinstance(self.scheme, Condensed) and bool(self.structure.compact)

    def _run_windows(self, plan: Plan, frames: Frames, keeper: Keeper | None, clock: Trace | None) -> None:
        interface = self.interface if clock is None else clock.watch_interface(self.interface)
        adaptive = self.window.tolerance if isinstance(self.window, Adaptive) else None
        windows = Windows(interface, self.scheme, adaptive)
        state, done, counts = self.start(), 0, Counts()
        if self.scheme.repeats:
            for box in interface.boxes:
                box.check(PROBE * interface.force_scale, plan.length, PROBE * interface.indentation_scale)
        frames.record(self.interface, 0, state, counts, plan.length)
        if keeper is not None:
            state, done, counts = keeper.begin(frames, (state, done, counts))
        while done < plan.total:
            many = min(plan.substeps, plan.total - done) if self.scheme.whole_window else 1
            try:
                ends = windows.advance(state, plan.length, many)
            except NotConverged as error:
                self._check_repeats(state, plan.length)
                raise NotConverged(f"window {done // plan.substeps + 1}, {error}") from error
            except FloatingPointError as error:
                raise FloatingPointError(f"window from t = {state.time:.6g} s: {error}") from error
            if not self.scheme.repeats and done == 0:
                self._check_rest(ends[0])
            for state in ends:
                done, counts = done + 1, counts.after(state)
                if done % plan.stride == 0:
                    frames.record(self.interface, done // plan.stride, state, counts, plan.length)
                    counts = Counts()
            self._check(state)
            if keeper is not None:
                keeper.keep(frames, done // plan.stride, (state, done, counts), done == plan.total)

    def _run_compiled(self, plan: Plan, frames: Frames, keeper: Keeper | None, clock: Trace | None) -> None:
        loop: Any = kernels.run_condensed
        structure = self.structure
        if clock is not None:
            loop, structure = clock.timed("compiled loop", loop), clock.watch(structure)
        chain, length, linear = self.chain, plan.length, structure.propagator(plan.length)
        static = float(chain.static_force[-1])
        tolerance = self.scheme.tolerance * chain.force_scale  # type: ignore[attr-defined]
        start = self.start()
        y, v = start.chains[0][:2]
        moved = y, v, np.zeros(linear.response.size), start.memory, np.zeros(TOTALS)
        row = 0
        frames.record(self.interface, 0, start, Counts(), plan.length)
        if keeper is not None:
            moved, row = keeper.begin(frames, (moved, row))
        while row < plan.rows - 1:
            y, v, body, guess, totals = moved
            last = plan.rows - 1 if keeper is None else min(row + max(1, CHUNK // plan.stride), plan.rows - 1)
            problem, done, detail = loop(
                y, v, chain.constants, chain.method, chain.steps(length), length, static, tolerance, plan.stride,
                tuple(linear), body, guess, totals, (row, last), frames.compiled(),
            )  # fmt: skip
            if problem == kernels.NON_FINITE:
                raise self._non_finite(int(detail), done * plan.length)
            if problem == kernels.NOT_CONVERGED:
                raise NotConverged(f"window {done}, t = {done * plan.length:.4g} s: residual {detail:.3g} N")
            row = last
            if keeper is not None:
                keeper.keep(frames, row, (moved, row), row == plan.rows - 1)
        frames.substeps[1:] = plan.stride
        if not self.structure.conservative:
            # The midpoint's identity: what the work leaves beside the energy, damping took.
            frames.damped[:] = frames.work - frames.kinetic - frames.elastic

    def _check_repeats(self, state: CoupledState, length: float) -> None:
        """Raises ValueError for participants that cannot repeat under the load at which a scheme gave up, or twice."""
        for place, box in enumerate(self.interface.structures):
            if isinstance(box, BlackBox) and self.scheme.repeats:
                last = box.last_force
                for force in (last, 2.0 * last):
                    box.check_repeats(state.structures[place], force, length)

    def _check_rest(self, first: CoupledState) -> None:
        """Raises ValueError for participants that move in the first substep, which goes without force."""
        for place, box in enumerate(self.interface.structures):
            if isinstance(box, BlackBox):
                moved = first.surface[self.interface.touched_by(place)]
                box.check_rest(moved if box.contacts > 1 else float(moved[0]), PROBE * self.interface.indentation_scale)

    def _check(self, state: CoupledState) -> None:
        """Raises FloatingPointError for what is no longer finite, ValueError for participants that make energy."""
        interface = self.interface
        for number, chain in enumerate(state.chains):
            bad = kernels.first_bad(chain.position, chain.velocity, state.surface[interface.of_chain[number][0]])
            if bad >= 0:
                raise self._non_finite(bad, state.time, number)
        for place, box in enumerate(interface.structures if interface.boxes else ()):
            if isinstance(box, BlackBox) and box.passive:
                work = float(state.ledger.work[interface.touched_by(place)].sum())
                if work < -GIVES_BACK * interface.impact_energy:
                    raise ValueError(
                        f"{box.name}.advance gives back more energy than it got, {-work:.3g} J up to t = "
                        f"{state.time:.6g} s; check the displacement's sign (positive away from the chain) and "
                        "its unit (m), or say passive = False"
                    )

    def _non_finite(self, bead: int, time: float, number: int = 0) -> FloatingPointError:
        chain = self.interface.chains[number].chain
        first = "the striker (bead 0)" if chain.body else "what moves the first bead (bead 0)"
        what = first if bead == 0 else f"bead {bead}" if bead <= len(chain.beads) else "the structure's surface"
        of = f" of chain {number}" if len(self.interface.chains) > 1 else ""
        return FloatingPointError(f"{what}{of} is no longer finite at t = {time:.6g} s; check dt and the structure")


def _power_of_two(parts: float) -> int:
    """The least one that is not below, so that windows can be halved and runs of one length share their times."""
    return int(2 ** max(0, ceil(log2(parts * (1.0 - LATE)))))
