"""Panels and curves that the figures of several studies share."""

from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from coupling.plots.canvas import COLOURS as COLOURS
from coupling.plots.canvas import mark_missing as mark_missing

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:
    # Studies name these types; a process that draws nothing does not load matplotlib.
    Axes = Figure = Any

Line = tuple[str, np.ndarray, np.ndarray, np.ndarray]  # Label, x, simulated values and those of a theory.
MARKERS = ("o", "s", "^", "D", "v", "P")
STYLE = {"lines.linewidth": 1.2, "lines.markersize": 4.0, "legend.frameon": False, "legend.fontsize": "small"}
SPEED_OVER_FORCE = ("peak contact force (N)", "wave speed (m/s)")
FORCE_OVER_APPROACH = ("approach (µm)", "contact force (N)")


def style() -> AbstractContextManager[None]:
    from matplotlib import rc_context

    return rc_context(STYLE)  # type: ignore[arg-type]


def panels(
    count: int = 1, width: float = 4.6, height: float = 3.6, sharey: bool = False,
    titles: Iterable[str] = (), ylabels: Iterable[str] = (), **labels: Any,
) -> tuple[Figure, list[Axes]]:  # fmt: skip
    """Return a row of panels. Curves take COLOURS and MARKERS in order; the style "-" has no marker.

    titles, ylabels: of the first panels; labels: of all, as of `Axes.set`.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width * count + 0.6, height), layout="constrained", dpi=200)
    axes = figure.subplots(1, count, sharey=sharey, squeeze=False).ravel().tolist()
    for axis in axes:
        axis.grid(alpha=0.25, linewidth=0.5)
        axis.set_prop_cycle(color=COLOURS, marker=MARKERS)
        axis.set(**labels)
    for name, texts in (("title", titles), ("ylabel", ylabels)):
        for axis, text in zip(axes, texts, strict=False):
            axis.set(**{name: text})
    return figure, axes


def each(
    data: xr.Dataset, name: str, title: Callable[[Any], str], sharey: bool = True, **how: Any
) -> tuple[Figure, list[tuple[Axes, xr.Dataset]]]:
    """Return a panel for each value of a coordinate, under a title, with the data there. how: as of `panels`."""
    values = data[name].values
    figure, axes = panels(len(values), titles=map(title, values), sharey=sharey, **how)
    return figure, [(axis, data.sel({name: value})) for axis, value in zip(axes, values, strict=True)]


def legend_above(figure: Figure, axis: Axes, columns: int) -> None:
    figure.legend(*axis.get_legend_handles_labels(), loc="outside upper center", ncols=columns)


def points(
    axis: Axes, x: np.ndarray, y: np.ndarray, number: int, label: str = "", hollow: bool = False, size: float = 4.0
) -> None:
    """Draw markers without a line, in the marker and colour of this number."""
    face = "white" if hollow else COLOURS[number]
    axis.plot(x, y, MARKERS[number], color=COLOURS[number], markerfacecolor=face, markersize=size, label=label)


def theory_line(axis: Axes, x: Any, y: Any, label: str, style: str = "-") -> None:
    axis.plot(x, y, style, color="black", linewidth=0.9, label=label)


def compared(
    curves: Iterable[Line], labels: tuple[str, str] = SPEED_OVER_FORCE, log: bool = False,
    theory: str = "theory of long waves", simulation: str = "simulation",
) -> Figure:  # fmt: skip
    """Return a figure with markers for simulations and lines for the theory, a power law between its points."""
    figure, (axis,) = panels(height=3.8, xlabel=labels[0], ylabel=labels[1])
    for i, (label, x, simulated, expected) in enumerate(curves):
        fine = np.geomspace(x[0], x[-1], 200)
        between = np.exp(np.interp(np.log(fine), np.log(x), np.log(expected)))
        axis.plot(fine, between, "-", color=COLOURS[i], linewidth=1.0)
        points(axis, x, simulated, i, label)
    axis.plot([], [], "-", color="grey", linewidth=1.0, label=theory)
    axis.plot([], [], "o", color="grey", label=simulation)
    if log:
        logarithmic(axis)
    else:
        axis.set_xlim(left=0.0)
        axis.set_ylim(bottom=0.0)
    axis.legend()
    return figure


def logarithmic(axis: Axes, which: str = "xy") -> None:
    """Make x, y or both logarithmic, with plain numbers at 1, 2 and 5 of each decade."""
    from matplotlib.ticker import LogLocator, NullFormatter

    for name in which:
        axis.set(**{f"{name}scale": "log"})
        ticks = getattr(axis, f"{name}axis")
        ticks.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ticks.set_major_formatter("{x:g}")
        ticks.set_minor_formatter(NullFormatter())
