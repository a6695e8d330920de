"""Reports: the answer of a result in a sentence, the set-up, figures, tables, warnings and the input, in one page."""

import base64
import json
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field
from datetime import datetime
from functools import cache
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from coupling.inference.identification import Identification
from coupling.plots import setup as sketches
from coupling.plots.canvas import own_axes
from coupling.results.findings import findings_of, one_of_each
from coupling.results.provenance import folded, stored, versions
from coupling.results.schema import BATCH, RUN, SIGNAL, SWEEP, kind_of
from hertzlink.output import write_file
from structures.caution import collected
from structures.checks import short

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
    """A table of texts; the first cell of a row names it. notes: the text below each row, "" for none."""

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


def report(
    result: Any, path: str | Path, title: str | None = None, sensors: int | Iterable[int] | None = None,
    setup: Any = None,
) -> Path:  # fmt: skip
    """Write a report of a result: one HTML page with its answer, figures, tables, warnings, input and versions.

    The page loads nothing, runs no scripts, and suits screens from 400 pixels on, light and dark.

    Parameters
    ----------
    result : Dataset or Identification
        A run, a sweep, a batch, a measured signal, the result of `identify`, or a map of `map_taps`.
    path : path
        The file; an existing one is replaced, completely or not at all.
    title : str, optional
        By default the kind of the result.
    sensors : int or sequence of int, optional
        Beads, 1 to N from the struck end; by default the middle bead, or all sensors of a signal.
    setup : CoSimulation, optional
        The set-up to sketch, for a signal or an identification, which do not hold it.

    Returns
    -------
    Path
        The file.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.3), hl.half_space(hl.PTFE)).run(until=8e-4)
    >>> hl.plots.report(run, "tap.html", title="Tap on PTFE").name
    'tap.html'
    """
    named = isinstance(path, str | Path) and str(path)
    if not named or Path(path).is_dir() or not Path(path).parent.is_dir():
        raise ValueError(f"path = {repr(str(path)) if named else short(path)}: must be a file in a folder that exists")
    if title is not None and not isinstance(title, str):
        raise ValueError(f"title = {short(title)}: must be text")
    write_file(Path(path), html(page_of(result, title, sensors, setup)).encode("utf-8", "replace"))
    return Path(path)


def page_of(
    result: Any, title: str | None = None, sensors: Any = None, setup: Any = None, took: float | None = None,
    yielded: xr.Dataset | None = None,
) -> Page:  # fmt: skip
    """Return the page of a result. took: the time of its computation, s. yielded: the same with contacts that yield."""
    # Imported here, because this module imports the present one.
    from hertzlink.reports.results import critical_page, identification_page, map_page, run_page, sweep_page

    data = result.to_dataset() if isinstance(result, Identification) else result
    if not isinstance(data, xr.Dataset):
        data = xr.Dataset()  # which is refused below
    # Warnings of measures are collected, because the result or its page states them too.
    with collected() as said:
        if "taps" in data:
            page = map_page(data)
        elif "verdict" in data:
            page = identification_page(data)
        elif "bracket" in data:
            page = critical_page(data, yielded)
        elif "amplitude_ratio" in data or kind_of(data) in (SWEEP, BATCH):
            page = sweep_page(data, sensors)
        elif kind_of(data) in (RUN, SIGNAL):
            page = run_page(data, sensors, yielded)
        else:
            has_cure = hasattr(result, "noted_in")  # a budget, which a run can hold
            what = f"of type {type(result).__name__}" if has_cure else f"= {short(result)}"
            cure = "the run with the budget, budget.noted_in(run, ...)" if has_cure else "a run, a sweep, a signal"
            raise ValueError(f"result {what}: must be {cure}, or the result of identify or map_taps")
        # A map may continue an earlier one.
        sketch, page.texts, page.facts = origin_of(data, None if "taps" in data else took, setup)
    page.title = title or page.title
    page.pictures[:0] = sketch
    # With a second result the warnings of both were gathered when their tables were made, and name their spot.
    page.warnings = one_of_each([*findings_of(data), *(said if yielded is None else ())])
    return page


def html(page: Page) -> str:
    """Return the page as HTML. Text is escaped; the page loads nothing and runs no scripts."""
    return environment().get_template("reports/report.html.j2").render(page=page)


@cache
def environment() -> "Environment":
    """Return the environment that fills the templates of reports and of the explorer."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("hertzlink", "."), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip


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


def origin_of(
    data: xr.Dataset, took: float | None, setup: Any = None
) -> tuple[list[Picture], list[tuple[str, str]], list[tuple[str, str]]]:
    """Return where a result comes from: a sketch of the set-up, if it is known; the input, as texts with titles; facts.

    took: the time of the computation, s.
    """
    pictures, source = list[Picture](), data if setup is None else setup
    if setup is not None:
        sketches.described_input(setup, "setup")  # refuses what cannot be drawn
    with suppress(ValueError):  # of data that do not hold it
        pictures = [drawn("setup", "The set-up to scale.", lambda ax: sketches.setup(source, ax))]
    texts = [("The case", str(data.attrs["case"]))] if "case" in data.attrs else []
    if inputs := stored(data.attrs.get("input")):
        texts.append(("The whole input, in SI units", json.dumps(folded(inputs), indent=1, ensure_ascii=False)))

    facts = [("report made", datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"))]
    if took is not None:
        facts.append(("time taken", f"{took:.1f} s" if took < 120.0 else f"{took / 60.0:.1f} min"))
    numbers = stored(data.attrs.get("versions")) or versions()
    facts.append(("versions", ", ".join(f"{name} {number}" for name, number in numbers.items())))
    return pictures, texts, facts
