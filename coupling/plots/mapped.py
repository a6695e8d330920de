"""Maps of taps: an unknown, and half of its 95 % interval, over the points of a grid."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from coupling.plots.canvas import INK, PALE, SMALL, axes_for, in_words, plain, styled
from structures.checks import instance, one_of
from structures.units import readable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = {"value": ("viridis", None), "error": ("magma_r", 0.0)}  # colours, and their lower end
MARKS = {"failed": "x", "not trusted": "o", "blind": "s", "at the end of its range": "^"}  # of doubtful verdicts
MOST_NUMBERS = 49  # a map of at most this many points also shows the numbers


def mapped(taps: xr.Dataset, unknown: str | None = None, show: str = "value", ax: "Axes | None" = None) -> "Axes":
    """Draw one unknown of a map of taps over x and y.

    Parameters
    ----------
    taps : Dataset
        The result of `map_taps`.
    unknown : str, optional
        The name of an unknown; by default the first.
    show : {"value", "error"}
        The value, or half of its 95 % interval.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        A cell for each point with a value, with numbers if there are at most 49 points. Markers show verdicts.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(0.0, 6e-4, 1e-6)
    >>> def read(file):
    ...     pulse = lambda at: 50.0 * np.exp(-(((time - at) / 1.5e-5) ** 2))
    ...     return hl.as_signal(time, {7: pulse(2e-4) + 0.5 * pulse(4e-4)})
    >>> _ = open("tap", "w").write("")
    >>> taps = hl.map_taps([{"x": 0.0, "y": 0.1, "files": ["tap"]}], read, jobs=1)
    >>> hl.plots.mapped(taps).get_xlabel()
    'x (m)'
    """
    if "taps" not in instance("taps", taps, xr.Dataset, "the result of map_taps").data_vars:
        raise ValueError("taps: must be the result of map_taps")
    names = [str(name) for name in taps.unknown.values]
    name = names[0] if unknown is None else one_of("unknown", unknown, names)
    colours, least = SHOWN[one_of("show", show, SHOWN)]
    one = taps.sel(unknown=name)
    size, unit = float(one.unit_size), str(one.unit.item())
    verdicts = np.array([str(verdict).partition(":")[0] for verdict in one.verdict.values])
    half = (one.high - one.low).values / 2.0
    value = (np.where(verdicts == "blind", np.nan, one.value) if show == "value" else half) / size
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle
    from matplotlib.patheffects import withStroke

    ax = axes_for(ax, 5.6, 4.6)
    x, y = (taps[along].values / taps[along].attrs["size"] for along in "xy")
    (left, right), (low, high) = _edges(x, y), _edges(y, x)
    known = np.flatnonzero(np.isfinite(value))
    cells = [Rectangle((left[k], low[k]), right[k] - left[k], high[k] - low[k]) for k in known]
    squares = PatchCollection(cells, cmap=colours, edgecolor="white")
    squares.set_array(value[known])
    squares.set_clim(least)
    ax.add_collection(squares)
    words = "half of the 95 % interval of\n" * (show == "error") + plain(in_words(name.rpartition(".")[2]))
    ax.get_figure().colorbar(squares, ax=ax, label=words + f" ({unit})" * bool(unit), shrink=0.8)  # type: ignore[union-attr]
    for place in known if len(value) <= MOST_NUMBERS else ():
        ink = "white" if np.dot(squares.to_rgba(value[place])[:3], (0.3, 0.6, 0.1)) < 0.5 else INK
        text = f"{value[place]:#.4g}" if show == "value" else readable(value[place], "", 1)
        level = y[place] - 0.64 * (y[place] - low[place]) * (verdicts[place] in MARKS)  # below its marker
        ax.text(x[place], level, text, color=ink, fontsize=SMALL - 1.5, ha="center", va="center")

    for verdict, marker in MARKS.items():
        here = verdicts == verdict
        if here.any():
            ink = PALE if verdict == "failed" else INK
            ax.scatter(
                x[here], y[here], 60.0, marker=marker, color=ink, facecolor=ink if marker == "x" else "none",
                label=verdict, zorder=3, path_effects=[withStroke(linewidth=3.0, foreground="white")],
            )  # fmt: skip
    styled(ax, *(f"{along} ({taps[along].attrs['unit']})" for along in "xy"))
    ax.grid(visible=False)
    ax.set(aspect="equal", xlim=(left.min(), right.max()), ylim=(low.min(), high.max()))
    if ax.get_legend_handles_labels()[1]:
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, fontsize=SMALL, ncols=2)
    return ax


def _edges(along: Any, across: Any) -> tuple[Any, Any]:
    """Return the two ends of each point's cell along an axis. Cells of points in line are as long as wide."""
    places, others = (np.unique(np.round(values, 9)) for values in (along, across))
    steps = next((np.diff(one) for one in (places, others) if len(one) > 1), np.ones(1))
    middles = 0.5 * (places[:-1] + places[1:])
    edges = np.array([places[0] - 0.5 * steps[0], *middles, places[-1] + 0.5 * steps[-1]])
    number = np.searchsorted(middles, along)
    return edges[number], edges[number + 1]
