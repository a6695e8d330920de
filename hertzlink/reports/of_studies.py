"""Reports of studies: the table with reasons, its figures, the set-up of its first run."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import xarray as xr

from coupling.results.findings import findings_of, one_of_each
from hertzlink.reports.page import Line, Page, Section, Table, html, usual_facts
from hertzlink.reports.report import with_setup
from hertzlink.reports.svg import picture
from hertzlink.studies import STUDIES
from hertzlink.studies.table import Row, footnotes, head_and_cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def study_report(
    name: str, data: xr.Dataset, rows: Sequence[Row], figures: Mapping[str, "Figure"], remark: str = ""
) -> str:
    """Return the report of a study as HTML. remark: what stands in a box at the top.

    The time that it took, s, is the attribute `time_taken` of the data.
    """
    head, cells = head_and_cells(rows)
    lines = [Line(tuple(line), row.reason) for line, row in zip(cells, rows, strict=True)]
    comparison = Table("Numbers of the thesis, of theory and of hertzlink", tuple(head), lines)
    took = data.attrs.get("time_taken")
    results = [
        Section("Figures", pictures=[picture(figure, key, caption(name, key)) for key, figure in figures.items()]),
        Section("Comparison", footnotes(rows), tables=[comparison]),
    ]
    sections = with_setup(results, data, None, one_of_each(findings_of(data)), first=False)
    facts = usual_facts(None if took is None else float(took), data.attrs)
    return html(Page(f"Study {name}", [STUDIES[name].about], sections, facts, remark))


def caption(study: str, figure: str) -> str:
    """Return what a figure shows; its name in words where there is no caption."""
    captions = STUDIES[study].figures
    names = [name for name in captions if figure == name or figure.startswith(f"{name}_")]
    return captions[max(names, key=len)] if names else figure.replace("_", " ")
