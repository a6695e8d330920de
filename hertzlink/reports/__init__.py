"""Reports: the parts of one, and the page that the template makes of them, a file that needs no network."""

import base64
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field
from datetime import datetime
from functools import cache
from io import StringIO
from typing import TYPE_CHECKING, Any

import xarray as xr

from coupling.plots import setup as sketches
from coupling.plots.canvas import own_axes
from coupling.results.provenance import folded, stored, versions

if TYPE_CHECKING:
    from jinja2 import Environment
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 5.2, 3.3  # Size of a figure, inches: its letters can be read on a telephone.


@dataclass(frozen=True)
class Picture:
    """A figure of matplotlib, what it shows, and the name of its file. folded: opened by a click."""

    figure: "Figure"
    caption: str
    name: str
    folded: bool = False

    @property
    def address(self) -> str:
        """The figure itself, as an address inside the page."""
        return "data:image/svg+xml;base64," + base64.b64encode(svg(self.figure).encode()).decode()

    @property
    def words(self) -> str:
        """What it shows, for those who cannot see it: the quantities, and the names of the curves."""
        said = [self.caption]
        for axes in self.figure.axes:
            said.append(" over ".join(filter(None, (axes.get_ylabel(), axes.get_xlabel()))))
            legend = axes.get_legend() or next(iter(self.figure.legends), None)
            said += [" ".join(text.get_text().split()) for text in legend.get_texts()] if legend else []
        return "; ".join(dict.fromkeys(filter(None, said)))


@dataclass(frozen=True)
class Table:
    """A table of texts; the first cell of a row names it. notes: of each row, what stands below it, "" for nothing."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()


@dataclass
class Page:
    """A report. The first sentence is the answer; texts: titles and long texts that are folded; remark: in a box."""

    title: str
    sentences: list[str] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    warnings: Sequence[str] = ()
    texts: Sequence[tuple[str, str]] = ()
    facts: Sequence[tuple[str, str]] = ()
    remark: str = ""


def html(page: Page) -> str:
    """Return the page as HTML. Text is escaped; the page loads nothing and runs no scripts."""
    return environment().get_template("reports/report.html.j2").render(page=page)


@cache
def environment() -> "Environment":
    """Return what fills the templates of reports and of the explorer."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("hertzlink", "."), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip


def usual_facts(took: float | None, attributes: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return when the report was made, how long the computation took (s), and the versions that a result holds."""
    numbers = stored(attributes.get("versions")) or versions()
    facts = [("report made", datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"))]
    if took is not None:
        facts.append(("time taken", f"{took:.1f} s" if took < 120.0 else f"{took / 60.0:.1f} min"))
    return [*facts, ("versions", ", ".join(f"{name} {number}" for name, number in numbers.items()))]


def default_style() -> AbstractContextManager[None]:
    """Draw with matplotlib's default settings: a user's matplotlibrc may need programs that are not installed."""
    from matplotlib import style

    return style.context("default")


def drawn(name: str, caption: str, draw: Callable[..., Any], height: float = HEIGHT, folded: bool = False) -> Picture:
    """Return a figure of one of the plots, which takes the axes as `ax`."""
    with default_style():
        ax = own_axes(WIDTH, height)
        draw(ax=ax)
    return Picture(ax.get_figure(), caption, name, folded)  # type: ignore[arg-type]


def svg(figure: "Figure") -> str:
    """Return a figure as SVG; the same figure gives the same text."""
    from matplotlib import rcParams

    text = StringIO()
    with default_style():
        rcParams["svg.hashsalt"] = "hertzlink"
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def sketch_and_input(data: xr.Dataset, setup: Any = None) -> tuple[list[Picture], list[tuple[str, str]]]:
    """Return a sketch of the set-up, if it is known, and the input that a result holds as texts with titles."""
    pictures, source = list[Picture](), data if setup is None else setup
    if setup is not None:
        sketches.described_input(setup, "setup")  # refuses what cannot be drawn
    with suppress(ValueError):  # of data that do not hold it
        pictures = [drawn("setup", "The set-up to scale.", lambda ax: sketches.setup(source, ax))]
    texts = [("The case", str(data.attrs["case"]))] if "case" in data.attrs else []
    if inputs := stored(data.attrs.get("input")):
        texts.append(("The whole input, in SI units", json.dumps(folded(inputs), indent=1, ensure_ascii=False)))
    return pictures, texts
