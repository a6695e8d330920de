"""The co-simulation: a chain, a structure, and the window loop that couples them."""

import logging
from math import ceil, inf, log2
from typing import Any

import numpy as np
import xarray as xr

from coupling.participant import Participant
from coupling.result import Frames, dataset
from coupling.scheme import Condensed, CoupledState, NotConverged, Scheme
from particles import kernels
from particles.chain import Chain
from particles.moving import MovingChain
from structures.checks import instance, positive
from structures.moving import MovingStructure
from structures.structure import Structure, half_space
from structures.surface import Surface

WINDOWS_PER_CONTACT = 64

FEWEST_WINDOWS_PER_CONTACT = 8
"""Coarser windows or frames are warned of: on a PTFE rod AR is 0.2 % off at 3.5 windows a contact, 3 % at 1.7."""

MOST_SAVED = 2e8
"""Saved times × beads: 1.6 GB in each of the three large arrays."""

log = logging.getLogger("hertzlink.cosimulation")


class CoSimulation:
    """A chain that faces a structure through the Hertzian contact at its last bead.

    structure: a Structure, a MovingStructure where it shall have another stepper, any Participant, or None for a chain
    that nothing holds.
    scheme: how the two agree within a window; Condensed() for a Structure, Aitken() for a black box.
    window, s, is the time between exchanges and dt the chain's step; both are chosen from the shortest contact
    time unless given, and a window holds a whole number of steps.
    """

    def __init__(
        self,
        chain: Chain,
        structure: Structure | Participant | None,
        scheme: Scheme | None = None,
        window: float | None = None,
        dt: float | None = None,
    ) -> None:
        if not isinstance(chain, Chain):
            raise ValueError(f"chain = {chain!r}: must be a Chain")
        self.scheme: Scheme = Condensed() if scheme is None else scheme
        if structure is None:
            self.structure: Any = MovingStructure(half_space(chain.beads[-1].material))
        elif isinstance(structure, Structure):
            self.structure = MovingStructure(structure)
        elif isinstance(structure, Participant):
            self.structure = structure
        else:
            raise ValueError(
                f"structure = {type(structure).__name__}: must be a Structure (of a plate plate.at(x, y)), None, or an "
                "object with surface, start and advance"
            )
        if isinstance(self.scheme, type) or not hasattr(self.scheme, "step"):
            raise ValueError(f"scheme = {scheme!r}: must be a scheme such as Condensed() or Aitken()")
        if structure is not None:
            instance("structure.surface", self.structure.surface, Surface, "a Surface(material)")
        if isinstance(self.scheme, Condensed) and not isinstance(self.structure, MovingStructure):
            raise ValueError(f"scheme = {self.scheme!r}: needs a Structure; use Aitken() for a solver of your own")
        flexibility = self.structure.structure.flexibility if isinstance(self.structure, MovingStructure) else 0.0
        surface = None if structure is None else self.structure.surface
        self.chain = MovingChain(chain, surface, flexibility, None if dt is None else positive("dt", dt, "s"))
        self.window = None if window is None else positive("window", window, "s")
        if self.window is not None and self.chain.dt is not None and self.chain.dt > self.window:
            raise ValueError(f"dt = {dt!r}: must not be longer than the window, {window} s")

    def run(self, until: float, save_every: float | None = None) -> xr.Dataset:
        """Simulate up to `until` (s) and return what was saved every `save_every` s (by default every window).

        The last saved time is `until`, or the last whole window or interval before it.
        By default times are `until` divided by a power of two, so that runs of the same length share theirs.
        Raises ValueError for times that do not fit, NotConverged, and FloatingPointError where a bead's state
        is no longer finite.
        """
        until = positive("until", until, "s")
        window, stride, rows = self._times(until, save_every)
        self.chain.steps(until)
        self._warn_if_coarse(window, stride)
        frames = Frames(rows, self.chain.mass.size)
        fused = isinstance(self.scheme, Condensed) and self.structure.compact
        self._start_frames(frames)
        if fused:
            self._run_compiled(window, stride, frames)
        else:
            self._run_windows(window, stride, frames)
        if not (isinstance(self.structure, MovingStructure) and self.structure.conservative):
            frames.structure[:] = np.nan
        given = {**self.describe(), "until": until, "window": window, "steps_per_window": self.chain.steps(window)}
        return dataset(self.chain, frames, window * stride, given)

    def describe(self) -> dict[str, Any]:
        """The full input as plain data."""
        structure = self.structure
        known = isinstance(structure, MovingStructure)
        origin: Any = structure.describe() if known else type(structure).__qualname__
        if self.chain.surface is None:
            origin = None
        return {"chain": self.chain.chain.describe(), "structure": origin, "scheme": repr(self.scheme)}

    def start(self) -> CoupledState:
        """The state at time zero: the striker touches the first bead."""
        return CoupledState(
            self.chain.start(), self.structure.start(), 0.0, 0.0, 0, 0.0, np.array([0.0, -1.0, 0.0, 0.0])
        )

    def step(self, state: CoupledState, window: float) -> CoupledState:
        """One window on, by the scheme."""
        return self.scheme.step(self.chain, self.structure, state, window)

    def _times(self, until: float, save_every: float | None) -> tuple[float, int, int]:
        """Window, windows between saved frames, and frames."""
        valid = self.structure.structure.valid_until if isinstance(self.structure, MovingStructure) else inf
        if until > valid * (1.0 + 1e-9):
            raise ValueError(f"until = {until!r}: the structure was reduced for runs of at most {valid} s")
        longest = self.chain.contact_time / WINDOWS_PER_CONTACT
        if self.window is not None and self.window > until:
            raise ValueError(f"window = {self.window!r}: must not be longer than the run, until = {until!r} s")
        if save_every is None:
            if self.window is not None:
                return self.window, 1, self._rows(until / self.window)
            windows = 2 ** max(0, ceil(log2(until / longest)))
            return until / windows, 1, self._rows(windows)
        save_every = positive("save_every", save_every, "s")
        if save_every > until:
            raise ValueError(f"save_every = {save_every!r}: must not be longer than the run, until = {until!r} s")
        if self.window is not None and save_every < self.window * (1.0 - 1e-9):
            raise ValueError(f"save_every = {save_every!r}: must not be shorter than the window, {self.window} s")
        stride = ceil(save_every / (self.window or longest) * (1.0 - 1e-9))
        return save_every / stride, stride, self._rows(until / save_every)

    def _rows(self, intervals: float) -> int:
        """Frames over so many intervals, the start included; a ValueError where they would not fit in memory."""
        size = intervals * self.chain.mass.size
        if size > MOST_SAVED:
            raise ValueError(
                f"until: {intervals:.3g} saved times of {self.chain.mass.size} beads are too many; give save_every"
            )
        return int(intervals * (1.0 + 1e-9)) + 1

    def _warn_if_coarse(self, window: float, stride: int) -> None:
        coarse = self.chain.contact_time / FEWEST_WINDOWS_PER_CONTACT
        for name, interval in (("window", window), ("save_every", window * stride)):
            if interval > coarse * (1.0 + 1e-9):
                log.warning("%s = %.3g s is coarse beside a contact; take at most %.3g s", name, interval, coarse)
                return

    def _start_frames(self, frames: Frames) -> None:
        y, v = self.chain.start()[:2]
        frames.position[0], frames.velocity[0] = y, v
        kernels.contact_forces(y, v, self.chain.constants, 0.0, 0.0, 0.0, frames.contact_force[0])
        frames.kinetic[0], frames.potential[0] = kernels.energies(y, v, self.chain.constants, 0.0)

    def _run_compiled(self, window: float, stride: int, frames: Frames) -> None:
        tolerance = self.scheme.tolerance * self.chain.force_scale  # type: ignore[attr-defined]
        y, v = self.chain.start()[:2]
        static = float(self.chain.static_force[-1])
        problem, done, detail = kernels.run_condensed(
            y, v, self.chain.constants, self.chain.method, self.chain.steps(window), window, static, tolerance,
            stride, tuple(self.structure.propagator(window)), frames.arrays(),
        )  # fmt: skip
        if problem == kernels.NON_FINITE:
            raise self._non_finite(int(detail), done * window)
        if problem == kernels.NOT_CONVERGED:
            raise NotConverged(f"window {done}, t = {done * window:.4g} s: residual {detail:.3g} N")

    def _run_windows(self, window: float, stride: int, frames: Frames) -> None:
        state, work, evaluations = self.start(), 0.0, 0
        for done in range(1, (frames.surface.size - 1) * stride + 1):
            before = state.surface
            try:
                state = self.step(state, window)
            except NotConverged as error:
                raise NotConverged(f"window {done}, t = {done * window:.4g} s: {error}") from error
            y, v, lost, time, driven = state.chain
            bad = kernels.first_bad(y, v, state.surface)
            if bad >= 0:
                raise self._non_finite(bad, done * window)
            work += state.force * (state.surface - before)
            evaluations += state.evaluations
            if done % stride == 0:
                row = done // stride
                frames.position[row], frames.velocity[row], frames.surface[row] = y, v, state.surface
                rate = (state.surface - before) / window
                constants = self.chain.constants
                kernels.contact_forces(y, v, constants, time, state.surface, rate, frames.contact_force[row])
                frames.kinetic[row], frames.potential[row] = kernels.energies(y, v, constants, state.surface)
                if isinstance(self.structure, MovingStructure):
                    frames.structure[row] = self.structure.energy(state.structure)
                frames.lost[row], frames.work[row], frames.driven[row] = lost, work, driven
                frames.evaluations[row] = evaluations
                evaluations = 0

    def _non_finite(self, bead: int, time: float) -> FloatingPointError:
        beads = len(self.chain.chain.beads)
        what = "the striker (bead 0)" if bead == 0 else f"bead {bead}" if bead <= beads else "the structure's surface"
        return FloatingPointError(f"{what} is no longer finite at t = {time:.6g} s; check dt and the structure")
