"""Figures of matplotlib as SVG inside a page: no metadata, no comments, and names that no other figure has."""

import re
from collections.abc import Callable
from html import escape
from io import StringIO
from typing import TYPE_CHECKING, Any

from coupling.plots.canvas import own_axes
from hertzlink.reports.page import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PIXELS_PER_INCH = 96.0

STRIPPED = (
    re.compile(r"<!--.*?-->", re.DOTALL),
    re.compile(r"<metadata>.*?</metadata>", re.DOTALL),
    re.compile(r"<style type=\"text/css\">.*?</style>", re.DOTALL),
)
"""What a page does not need: its own style sheet holds the one rule of these styles."""

NAMED = re.compile(r'\bid="([^"]+)"')
USED = re.compile(r'(url\(#|href="#)([^")]+)')

WIDTH, HEIGHT = 5.2, 3.3
"""Size of a figure of a report, inches: its letters can be read on a telephone."""

COLOUR_BAR = "<colorbar>"
"""The label by which matplotlib marks the axes of a colour bar."""


def picture(figure: "Figure", name: str, caption: str) -> Picture:
    """Return a figure for a page; name: unique there."""
    from matplotlib import rc_context

    text = StringIO()
    with rc_context({"svg.fonttype": "path", "svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    for pattern in STRIPPED:
        svg = pattern.sub("", svg)
    prefix = re.sub(r"\W+", "-", name)
    svg = NAMED.sub(rf'id="{prefix}-\1"', svg)
    svg = USED.sub(rf"\1{prefix}-\2", svg)
    head, rest = svg.split(">", 1)
    head = re.sub(r'\s(width|height)="[^"]*"', "", head)
    words = in_words(figure)
    title = f'<title id="{prefix}-words">{escape(words)}</title>'
    svg = f'{head} role="img" aria-labelledby="{prefix}-words">{title}{rest}'
    return Picture(svg.strip(), caption, words, figure.get_figwidth() * PIXELS_PER_INCH, prefix, figure)


def in_words(figure: "Figure") -> str:
    """Return what a figure shows: of each of its axes the quantities and the names of its curves."""
    return "; ".join(words for axes in figure.axes if axes.get_label() != COLOUR_BAR and (words := _of_axes(axes)))


def _of_axes(axes: Any) -> str:
    across, up = axes.get_xlabel(), axes.get_ylabel()
    what = f"{up} over {across}" if across and up else across or up or "a drawing to scale"
    legend = axes.get_legend() or (axes.figure.legends[0] if axes.figure.legends else None)
    names = [" ".join(text.get_text().split()) for text in legend.get_texts()] if legend else []
    title = axes.get_title()
    return f"{title + ': ' if title else ''}{what}{' (' + ', '.join(filter(None, names)) + ')' if names else ''}"


def drawn(name: str, caption: str, draw: Callable[[Any], Any], height: float = HEIGHT) -> Picture:
    """Return a figure of one of the plots."""
    ax = own_axes(WIDTH, height)
    draw(ax)
    return picture(ax.get_figure(), name, caption)  # type: ignore[arg-type]
