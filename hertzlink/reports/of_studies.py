"""Reports of studies: the table with reasons, its figures, the set-up of its first run."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import xarray as xr

from coupling.results.findings import findings_of, one_of_each
from hertzlink.reports.page import Page, Picture, Table, html, usual_facts
from hertzlink.reports.report import sketch_and_input
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
    table = Table("Numbers of the thesis, of theory and of hertzlink", head, cells, [row.reason for row in rows])
    pictures = [Picture(figure, caption(name, key), key) for key, figure in figures.items()]
    sketch, texts = sketch_and_input(data)
    took = data.attrs.get("time_taken")
    page = Page(f"Study {name}", [STUDIES[name].about, *footnotes(rows)], [*pictures, *sketch], [table])
    page.warnings, page.texts, page.remark = one_of_each(findings_of(data)), texts, remark
    page.facts = usual_facts(None if took is None else float(took), data.attrs)
    return html(page)


def caption(study: str, figure: str) -> str:
    """Return what a figure shows; its name in words where there is no caption."""
    captions = STUDIES[study].figures
    names = [name for name in captions if figure == name or figure.startswith(f"{name}_")]
    return captions[max(names, key=len)] if names else figure.replace("_", " ")
