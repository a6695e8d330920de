"""The error of a window, by which adaptive windows choose the next one."""

from coupling.kernels.state import Records
from structures.kernel_cache import entry
from structures.structure import Vector

UNTOUCHED = 0.1
"""Weight of the error where nothing touches. No chain follows that surface, but its curvature measures the error of the
structure's own stepping, which is smaller by about the ratio of the window to the time scale of the motion."""


@entry
def bend_of_last(node: Records, window: Records, totals: Records, static: Vector) -> float:
    """Return the distance of a parabola from the straight motion of the surfaces in the last window of a run, m."""
    remembered, now, greatest = totals[0].remembered, window[0].length, 0.0
    before = window[1].length if remembered > 1 else now
    for k in range(node.shape[1]):
        start = node[1, k].surface if remembered > 1 else 0.0
        earlier = node[2, k].surface if remembered > 2 else 0.0
        change = abs((node[0, k].surface - start) / now - (start - earlier) / before)
        greatest = max(greatest, change if node[0, k].force > -static[k] else UNTOUCHED * change)
    return 2.0 * greatest / (now + before) * now**2 / 8.0
