"""Steps from window to window: a window that fails, or whose error is too large, is halved and repeated."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from coupling.interface import Interface
from coupling.kernels.adaptive import GROWS_BELOW, bend_of_last
from coupling.kernels.records import Run
from coupling.schemes.scheme import Scheme
from coupling.state import Counts, CoupledState, NotConverged, as_run
from structures.described import described
from structures.quantities import Quantity

MOST_HALVINGS = 12
"""Halvings of a substep that fails, before the run stops."""

FINEST = 1024
"""Parts of the shortest contact below which an adaptive window is not halved for its error."""

TAKEN_AS_ONE = 1.0 + 1e-9
"""Windows whose ratio is below this number are equal."""


@described
class Adaptive:
    """Windows as long as their error allows: each is the saved interval over a power of two.

    Parameters
    ----------
    tolerance : float
        Of the error of a window. Amplitude ratios are then within about three tolerances of those with very short
        windows, within fifteen on light plates (tests).

    Notes
    -----
    In a window the surface moves along a straight line. The error is the distance of this line from the parabola
    through its two ends and the node before, in units of the greatest approach of a contact. Where nothing touches, a
    tenth of it counts.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 3, striker=bead, impact_speed=0.44)
    >>> rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=1e-4)
    >>> run = hl.CoSimulation(chain, rod, window=hl.Adaptive(1e-4)).run(until=1e-4)
    >>> print(f"{1e6 * float(run.surface_displacement.max()):.2f} µm")
    0.62 µm
    """

    tolerance: Annotated[float, Quantity()] = 1e-5


@dataclass(frozen=True)
class Windows:
    """Moves a coupled state on by a scheme. tolerance: of adaptive windows, None where all are equal."""

    interface: Interface
    scheme: Scheme
    tolerance: float | None = None

    def advance(self, state: CoupledState, length: float, substeps: int) -> list[CoupledState]:
        """The states at the ends of `substeps` substeps of `length` s. Raises NotConverged.

        Those inside a substep that had to be halved are not among them; its last one counts all evaluations.
        """
        if self.tolerance is not None:
            return [self._adapted(state, length, self.tolerance)]
        return self._halved(state, length, substeps, MOST_HALVINGS)

    def _halved(self, state: CoupledState, length: float, substeps: int, left: int) -> list[CoupledState]:
        """Solve in pieces of as many substeps as converged last; a substep alone is cut in two at most `left` times.

        A window after one that came in pieces begins with pieces of twice their length.
        """
        ends: list[CoupledState] = []
        piece, failed = min(substeps, 2 * state.piece) if state.piece else substeps, 0
        while len(ends) < substeps:
            many = min(piece, substeps - len(ends))
            try:
                halves = self.scheme.step(self.interface, state, length, many)
            except NotConverged as error:
                failed += error.evaluations
                if many > 1:
                    piece = many // 2
                    continue
                if left == 0:
                    raise NotConverged(f"t = {state.time:.6g} s, {length:.3g} s long: {error}") from error
                middle = self._halved(state, length / 2.0, 1, left - 1)[-1]
                halves = [_after(middle, self._halved(middle, length / 2.0, 1, left - 1)[-1])]
            if failed:
                halves[0] = halves[0]._replace(counts=halves[0].counts.plus(Counts(failed)))
            ends += halves
            state, failed = ends[-1], 0
        if piece < substeps:
            ends[-1] = state._replace(piece=piece)
        return ends

    def _adapted(self, state: CoupledState, length: float, tolerance: float) -> CoupledState:
        finest, failed = self.interface.contact_time / FINEST, 0
        # The longest window worth trying follows from the last ones and their error.
        longest = next_length(state.past[-1].length, self.error(state), tolerance) if state.past else np.inf
        if length <= longest * TAKEN_AS_ONE or length <= finest:
            try:
                end = self.scheme.step(self.interface, state, length, 1)[-1]
            except NotConverged as error:
                if length <= finest:
                    return self._halved(state, length, 1, MOST_HALVINGS)[-1]
                failed = error.evaluations
            else:
                if length <= finest or self.error(end) <= tolerance:
                    return end
                failed = end.counts.evaluations
        middle = self._adapted(state, length / 2.0, tolerance)
        return _after(middle, self._adapted(middle, length / 2.0, tolerance), failed)

    def error(self, state: CoupledState) -> float:
        """Return the error of the last substep; see `error_of`."""
        return error_of(as_run(state, Counts()), self.interface)


def error_of(run: Run, interface: Interface) -> float:
    """Return the distance of a parabola from the straight motion of the last window, in greatest approaches."""
    moved: float = bend_of_last(run.node, run.window, run.totals, interface.static)
    return moved / interface.indentation_scale


def next_length(last: float, error: float, tolerance: float) -> float:
    """Return the longest window worth trying, s, after one of this length and error."""
    return 2.0 * last if error < GROWS_BELOW * tolerance else last


def _after(first: CoupledState, second: CoupledState, failed: int = 0) -> CoupledState:
    """Return the second of two halves, with the counts of both, and the evaluations of attempts that failed."""
    return second._replace(counts=Counts(failed).plus(first.counts).plus(second.counts))
