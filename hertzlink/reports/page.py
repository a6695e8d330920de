"""The parts of a report, and the page that the template makes of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from coupling.results.provenance import stored, versions

if TYPE_CHECKING:
    from jinja2 import Environment

HERE, TEMPLATE, STYLE = "hertzlink.reports", "report.html.j2", "report.css"
"""The package that holds the template and the style sheet, and their names."""

MOST_OPEN = 12
"""Tables of more rows are folded."""


@dataclass(frozen=True)
class Picture:
    """A figure: SVG that may stand in a page, what it shows, and the same for those who cannot see it."""

    svg: str
    caption: str
    alternative: str
    width: float
    """Width at which its letters have their size, CSS pixels."""
    name: str = ""
    """That of a file of it."""
    figure: Any = None
    """The figure of matplotlib."""


@dataclass(frozen=True)
class Line:
    """A row of a table, and a note below it."""

    cells: tuple[str, ...]
    note: str = ""


@dataclass(frozen=True)
class Table:
    """A table: a caption, the names of its columns, and rows whose first cell names them. folded: opened by a click."""

    caption: str
    head: tuple[str, ...]
    rows: Sequence[Line]
    folded: bool = False


@dataclass(frozen=True)
class Section:
    """A part of the page under a title: sentences, warnings, pictures, tables, and long text that is folded."""

    title: str
    sentences: Sequence[str] = ()
    warnings: Sequence[str] = ()
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    folded: Sequence[tuple[str, str]] = ()
    """Title and text."""

    @property
    def empty(self) -> bool:
        """True if there is nothing to show."""
        return not (self.sentences or self.warnings or self.tables or self.pictures or self.folded)


@dataclass(frozen=True)
class Page:
    """A report."""

    title: str
    summary: Sequence[str]
    sections: Sequence[Section]
    facts: Sequence[tuple[str, str]] = field(default_factory=list)
    remark: str = ""
    """What stands in a box at the top, as for a quick run."""

    @property
    def pictures(self) -> list[Picture]:
        """All pictures."""
        return [picture for section in self.sections for picture in section.pictures]


def html(page: Page) -> str:
    """Return the page as HTML, with its style. Text is escaped; pictures are SVG of our own making."""
    from markupsafe import Markup

    sections = [section for section in page.sections if not section.empty]
    return (
        _environment()
        .get_template(TEMPLATE)
        .render(page=page, sections=sections, style=Markup(_text(STYLE)), safe=Markup)
    )


def usual_facts(took: float | None, attributes: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return when the report was made, the time the computation took (s), and versions: those in the attributes of a
    result, or of today."""
    numbers = stored(attributes.get("versions")) or versions()
    facts = [("report made", datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"))]
    if took is not None:
        facts.append(("time taken", f"{took:.1f} s" if took < 120.0 else f"{took / 60.0:.1f} min"))
    facts.append(("versions", ", ".join(f"{name} {number}" for name, number in numbers.items())))
    return facts


def table(caption: str, head: Sequence[str], rows: Sequence[Sequence[str]], folded: bool | None = None) -> Table:
    """Return a table of plain rows without notes; a long one is folded, unless it is said."""
    fold = len(rows) > MOST_OPEN if folded is None else folded
    return Table(caption, tuple(head), [Line(tuple(row)) for row in rows], fold)


@cache
def _environment() -> "Environment":
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    return Environment(
        loader=FunctionLoader(_text), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )


def _text(name: str) -> str:
    return (files(HERE) / name).read_text(encoding="utf-8")
