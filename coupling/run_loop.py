"""What does a run: the compiled engine, or the loop in Python for all that it cannot take."""

from typing import NamedTuple

from numba import NumbaError

from coupling.black_box import Condensed, Scheme, run_windows
from coupling.compiled_run import Engine, StructureWindows
from coupling.interface import Interface
from coupling.plan import Adaptive, Plan
from coupling.recording.frames import Frames
from structures.kernels.pieces import check_compiled

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
            if is_compiled(self.interface, self.scheme):
                run_compiled(self)
            else:
                run_windows(self.interface, self.scheme, self.frames, self.plan.length, self.plan.stride)
        except NumbaError:
            check_compiled(self.interface.model.law, ("force", "slope", "energy"), 1)
            check_compiled(self.interface.model.loss, ("with_loss",), 4)
            raise


def is_compiled(interface: Interface, scheme: Scheme) -> bool:
    """Return whether the compiled loop can run them: Newton's method, on linear structures."""
    if type(scheme) is not Condensed or interface.black_boxes:
        return False
    return all(structure.compact for structure in interface.structures)


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
