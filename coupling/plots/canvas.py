"""The common parts of all plots of results: axes, colours, the legend below, names in words."""

import re
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
WIDTH, HEIGHT = 6.4, 4.0  # of a figure, inches
SMALL = 8.5  # size of the letters of legends and notes, points
LETTERS_PER_INCH, ROW = 12.2, 0.18  # of a legend: letters in an inch, height of a line in inches
UNDER = 0.48  # height of the numbers and the label below axes, inches
TOGETHER = re.compile(r"(?<==) | (?=(?:=|[mµ]?[msN]|%)(?:\W|$))")  # spaces where no line breaks: AR = 0.3, 5 µs
MARK = "hertzlink"  # the name of figures that the plots have made and may resize


def axes_for(ax: Any, width: float = WIDTH, height: float = HEIGHT) -> "Axes":
    """Return the given axes, or for None those of a new figure of this size, inches; else raise a ValueError."""
    from matplotlib.axes import Axes

    if ax is not None:
        return instance("ax", ax, Axes, "Axes of matplotlib, or None for a new figure")
    from matplotlib import pyplot

    return own_axes(width, height, pyplot.figure)


def own_axes(width: float = WIDTH, height: float = HEIGHT, make: Any = None) -> "Axes":
    """Return the axes of a new figure, which may be resized. make: the function that makes it; by default a figure for
    a file, unknown to pyplot."""
    from matplotlib.figure import Figure

    figure = (make or Figure)(figsize=(width, height), layout="constrained")
    figure.set_gid(MARK)
    axes: Axes = figure.add_subplot()
    return axes


def styled(ax: "Axes", xlabel: str, ylabel: str) -> None:
    """Set labels and a pale grid."""
    ax.set(xlabel=xlabel, ylabel=ylabel)
    ax.grid(alpha=0.25, linewidth=0.5)
    ax.set_axisbelow(True)


def from_zero(ax: "Axes") -> None:
    """Start the vertical axis at zero, with room for the highest markers."""
    ax.set_ylim(0.0, 1.08 * max(ax.dataLim.y1, 0.01))


def mark_missing(ax: "Axes", x: Any, number: int, **look: Any) -> None:
    """Draw a cross at the bottom for each place where a curve has no value: a point at 0 would show a value."""
    look = dict[str, Any](color=COLOURS[number], markersize=6.0, linestyle="none") | look
    ax.plot(x, np.full(len(x), 0.03 + 0.05 * number), marker="x", transform=ax.get_xaxis_transform(), **look)


def legend_below(ax: "Axes", title: str = "", height: float | None = None, under: float = UNDER) -> None:
    """Put the legend below the axes, where it covers nothing, with each label once. Figures of the plots become higher.
    height: height of the figure without a legend, inches. under: distance of the legend below the axes, inches."""
    from matplotlib.transforms import ScaledTranslation

    figure: Any = ax.get_figure(root=True)
    width = float(figure.get_figwidth())
    handles = dict[str, Any]()
    for handle, words in zip(*ax.get_legend_handles_labels(), strict=True):
        words = TOGETHER.sub("\xa0", plain(UNTIL.sub(r"until = \1", words)))
        handles.setdefault(fill(words, max(20, int(LETTERS_PER_INCH * width))).replace("\xa0", " "), handle)
    if figure.get_gid() == MARK:
        rows = sum(text.count("\n") + 1 for text in handles) + bool(title)
        figure.set_figheight((HEIGHT / WIDTH * width - 2.0 * ROW if height is None else height) + ROW * max(2, rows))
    ax.legend(
        handles.values(), handles, title=title or None, title_fontsize=SMALL, alignment="left", loc="upper left",
        bbox_to_anchor=(0.0, 0.0), bbox_transform=ax.transAxes + ScaledTranslation(0.0, -under, figure.dpi_scale_trans),
        frameon=False, fontsize=SMALL, borderaxespad=0.0,
    )  # fmt: skip


def in_words(name: str) -> str:
    """Return the name of an argument or a parameter in words: Young's modulus for youngs_modulus."""
    return name.replace("_", " ").replace("youngs ", "Young's ").replace("poisson ratio", "Poisson's ratio")


def plain(text: str) -> str:
    """Return a user's text in a form that matplotlib does not read as a formula."""
    return text.replace("$", r"\$")


def round_number(value: float, up: bool = False) -> float:
    """Return the next number of the series 1, 2, 5, 10, ... below a positive value, or above it."""
    steps = np.outer(10.0 ** np.arange(np.floor(np.log10(value)) - 1.0, np.log10(value) + 2.0), (1.0, 2.0, 5.0)).ravel()
    return float(steps[steps >= value].min() if up else steps[steps <= value].max())
