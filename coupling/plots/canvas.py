"""The canvas that all plots of results share: axes to draw on, colours, legends below."""

from collections.abc import Iterable
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from coupling.results.missing_waves import UNTIL
from structures.checks import instance

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""The colours of Okabe and Ito, which colour-blind readers can distinguish."""

INK, PALE = "#222222", "#8a8a8a"

WIDTH, HEIGHT = 6.4, 4.0
"""Size of a figure, inches."""

SMALL = 8.5
"""Size of letters of legends and notes, points."""

LETTERS_PER_INCH = 12.2
"""Letters of a legend in an inch."""

ROW = 0.19
"""Height of a line of a legend, inches."""

UNDER = 0.48
"""Height of the numbers and the label below axes, inches."""

MARK = "hertzlink"
"""The name of figures that the plots made, and may resize."""


def axes_for(ax: Any, width: float = WIDTH, height: float = HEIGHT) -> "Axes":
    """Return the axes that were given, or those of a new figure of a size, inches. A ValueError for anything else."""
    from matplotlib.axes import Axes

    if ax is not None:
        return instance("ax", ax, Axes, "Axes of matplotlib, or None for a new figure")
    from matplotlib import pyplot

    return _only_axes(pyplot.figure(figsize=(width, height), layout="constrained"))


def own_axes(width: float = WIDTH, height: float = HEIGHT) -> "Axes":
    """Return the axes of a new figure that only the caller knows, for a file."""
    from matplotlib.figure import Figure

    return _only_axes(Figure(figsize=(width, height), layout="constrained"))


def _only_axes(figure: Any) -> "Axes":
    """Return the axes of a new figure of ours."""
    figure.set_gid(MARK)
    axes: Axes = figure.add_subplot()
    return axes


def resized(ax: "Axes", height: float) -> bool:
    """Return whether the figure is one of ours, which then gets this height, inches; a user's keeps its own."""
    figure: Any = ax.get_figure(root=True)
    if figure is None or figure.get_gid() != MARK:
        return False
    figure.set_figheight(height)
    return True


def width_of(ax: "Axes") -> float:
    """Return the width of the figure, inches."""
    figure: Any = ax.get_figure(root=True)
    return float(figure.get_figwidth())


def styled(ax: "Axes", xlabel: str, ylabel: str) -> None:
    """Set labels and a pale grid."""
    ax.set(xlabel=xlabel, ylabel=ylabel)
    ax.grid(alpha=0.25, linewidth=0.5)
    ax.set_axisbelow(True)


def from_zero(ax: "Axes") -> None:
    """Start the vertical axis at zero, with room for the highest markers."""
    ax.set_ylim(0.0, 1.08 * max(ax.dataLim.y1, 0.01))


def mark_missing(ax: "Axes", x: Any, number: int, **look: Any) -> None:
    """Draw a cross at the bottom for each place of a curve without a value, which no point drawn as 0 could say."""
    height = np.full(len(x), 0.03 + 0.05 * number)
    look = dict[str, Any](color=COLOURS[number], markersize=6.0, linestyle="none") | look
    ax.plot(x, height, marker="x", transform=ax.get_xaxis_transform(), **look)


def legend_below(ax: "Axes", title: str = "") -> None:
    """Put the legend below the axes and their label, where it covers nothing; long entries are wrapped.

    A figure of ours grows by the legend, so that the axes keep their height, inches.
    """
    from matplotlib.transforms import ScaledTranslation

    figure: Any = ax.get_figure(root=True)
    below = ax.transAxes + ScaledTranslation(0.0, -UNDER, figure.dpi_scale_trans)
    handles, labels = ax.get_legend_handles_labels()
    texts, rows = legend_texts(ax, labels)
    resized(ax, HEIGHT / WIDTH * width_of(ax) + ROW * max(0, rows + bool(title) - 2))
    ax.legend(
        handles, texts, title=title or None, title_fontsize=SMALL, alignment="left", loc="upper left",
        bbox_to_anchor=(0.0, 0.0), bbox_transform=below, frameon=False, fontsize=SMALL, borderaxespad=0.0,
    )  # fmt: skip


def legend_texts(ax: "Axes", labels: Iterable[str]) -> tuple[list[str], int]:
    """Return the entries of a legend that is as wide as the figure, with their number of lines."""
    texts = [
        fill(plain(UNTIL.sub(r"until = \1", label)), max(20, int(LETTERS_PER_INCH * width_of(ax)))) for label in labels
    ]
    return texts, sum(text.count("\n") + 1 for text in texts)


def in_words(name: str) -> str:
    """Return the name of an argument or a parameter as a text has it: Young's modulus for youngs_modulus."""
    return name.replace("_", " ").replace("youngs ", "Young's ").replace("poisson ratio", "Poisson's ratio")


def plain(text: str) -> str:
    """Return the text of a user that matplotlib must not read as a formula."""
    return text.replace("$", r"\$")
