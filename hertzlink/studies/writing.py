"""The files of a study: netCDF, table, figures and report, from a new run or drawn again from its netCDF file."""

from pathlib import Path

import xarray as xr

from coupling.results.findings import findings_of, one_of_each
from coupling.results.provenance import stored
from coupling.results.reading import read_netcdf
from hertzlink.studies import STUDIES, Study, captions, draw
from hertzlink.studies.compare import HEAD, compare, table

TABLE, REPORT = "table.txt", "report.html"
QUICK = "quick run (--quick), for a first look only"  # The remark on all files of such a run.
# Formats of figures, and the name under which their files hold a remark.
FORMATS = {"png": "Comment", "svg": "Description", "pdf": "Subject"}


class Written:
    """The table and the figures of a study's data, made once and then written. `shown` is for the terminal."""

    def __init__(self, name: str, of: Study, data: xr.Dataset, form: str = "png") -> None:
        self.name, self.data, self.form = name, data, form
        self.remark = str(data.attrs.get("comment", ""))
        # The study of the thesis has a table and a summary of its own.
        self.rows = of.table(data) if hasattr(of, "table") else compare(name, of.numbers(data))
        with draw.style():
            self.figures = of.figures(data)
        self.table = "\n\n".join(filter(None, (self.remark, table(self.rows))))
        self.shown = of.summary(data) if hasattr(of, "summary") else self.table

    def write(self, into: Path, data: xr.Dataset | None = None) -> None:
        """Write all files. data: the Dataset with its provenance and warnings; without it no netCDF file is written."""
        if data is not None:
            (into / f"{self.name}.nc").write_bytes(data.to_netcdf(engine="h5netcdf"))
        (into / TABLE).write_text(self.table + "\n", encoding="utf-8")
        for title, figure in self.figures.items():
            if self.remark:
                figure.supxlabel(self.remark, color="firebrick", fontsize="small")
            metadata = {FORMATS[self.form]: self.remark} if self.remark else None
            figure.savefig(into / f"{title}.{self.form}", metadata=metadata)
        (into / REPORT).write_text(self.report(self.data if data is None else data), encoding="utf-8")

    def report(self, data: xr.Dataset) -> str:
        """Return the report as HTML; the time that the study took, s, is the attribute `time_taken` of the data."""
        # Here: other commands need no report.
        from hertzlink.reports.page import Page, Picture, Table, html, usual_facts
        from hertzlink.reports.report import sketch_and_input

        words, took = captions(self.name), data.attrs.get("time_taken")
        sketch, texts = sketch_and_input(data)
        about = [STUDIES[self.name], "Equations, figures, tables and sections are those of the thesis."]
        pictures = [*(Picture(figure, words[name], name) for name, figure in self.figures.items()), *sketch]
        numbers = [row.cells for row in self.rows], [row.remark for row in self.rows]
        tables = [Table("Numbers of the thesis and of hertzlink", tuple(HEAD), *numbers)]
        facts = usual_facts(None if took is None else float(took), data.attrs)
        findings = one_of_each(findings_of(data))
        return html(Page(f"Study {self.name}", about, pictures, tables, findings, texts, facts, self.remark))


def read_study(file: Path) -> tuple[str, xr.Dataset]:
    """Return name and the data of a study from the netCDF file that it wrote; raise a ValueError for any other file."""
    data = read_netcdf(file)
    name = stored(data.attrs.get("input")).get("study")
    if name not in STUDIES:
        raise ValueError(f"{file}: was not written by a study; give the .nc file of `hertzlink study`")
    return str(name), data
