"""`hertzlink study NAME` and `hertzlink draw FILE`: netCDF, table, figures and report of a study."""

from pathlib import Path
from time import perf_counter
from types import ModuleType

import click
import xarray as xr

from coupling.results.findings import findings_of, one_of_each, warn, with_warnings
from coupling.results.provenance import provenance, stored
from coupling.results.reading import read_netcdf
from hertzlink.cli import FORCE, JOBS, Listing, output_option
from hertzlink.output import check_output, deliver
from hertzlink.studies import STUDIES, captions, draw, study
from hertzlink.studies.compare import HEAD, compare, table
from structures.caution import collected
from structures.checks import nearest

TABLE, REPORT = "table.txt", "report.html"
QUICK = "quick run (--quick), for a first look only"  # The remark on all files of such a run.
# Formats of figures, and the name under which their files hold a remark.
FORMATS = {"png": "Comment", "svg": "Description", "pdf": "Subject"}


class Written:
    """The table and the figures of a study's data, made once and then written. `shown` is for the terminal."""

    def __init__(self, name: str, of: ModuleType, data: xr.Dataset, form: str = "png") -> None:
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
                figure.supxlabel(self.remark, x=0.99, ha="right", color="firebrick", fontsize="small")
            metadata = {FORMATS[self.form]: self.remark} if self.remark else None
            figure.savefig(into / f"{title}.{self.form}", metadata=metadata)
        (into / REPORT).write_text(self.report(self.data if data is None else data), encoding="utf-8")

    def report(self, data: xr.Dataset) -> str:
        """Return the report as HTML; the time that the study took, s, is the attribute `time_taken` of the data."""
        from hertzlink.reports import Page, Picture, Table, html, sketch_and_input, usual_facts

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


FIGURES = click.option(
    "--figures", "form", type=click.Choice([*FORMATS]), default="png", help="Format of the figures; by default png."
)


def begun(context: click.Context, parameter: click.Parameter, part: str) -> list[str]:
    """Return the studies whose names begin so, for shells that complete what is typed."""
    return [name for name in STUDIES if name.startswith(part)]


@click.command(
    "study", cls=Listing, title="Studies", rows=STUDIES.items, short_help="Run a study of the thesis, or one beyond it."
)
@click.argument("name", metavar="NAME", shell_complete=begun)
@click.option("--quick", is_flag=True, help="A coarse version that runs in seconds.")
@output_option("named as the study")
@FORCE
@JOBS
@FIGURES
def run_study(name: str, quick: bool, output: Path | None, force: bool, jobs: int | None, form: str) -> None:
    """Run a study of the thesis, or one beyond it: netCDF, figures, a table and a report."""
    if name not in STUDIES:
        raise ValueError(f"study {name!r} is not one of the studies; {nearest(name, STUDIES, len(STUDIES))}")
    folder = output or Path(name)
    check_output(folder, force)
    findings: list[str] = []
    try:
        with collected() as findings:
            begin = perf_counter()
            chosen = study(name)
            data = chosen.run(quick, jobs)
            data = data.assign_attrs(quick=int(quick), time_taken=perf_counter() - begin)
            found = Written(name, chosen, data.assign_attrs({"comment": QUICK} if quick else {}), form)
    finally:
        warn(one_of_each(findings))
    inputs = {"study": name, "quick": quick, "first_run": data.attrs.get("input", "")}
    data = with_warnings(found.data.assign_attrs(provenance(inputs)), findings)
    deliver(folder, lambda into: found.write(into, data), force, found.shown)


@click.command("draw", short_help="Draw a study again from its netCDF file.")
@click.argument("store", metavar="FILE", type=click.Path(path_type=Path))
@output_option("STUDY-drawn")
@FORCE
@FIGURES
def draw_study(store: Path, output: Path | None, force: bool, form: str) -> None:
    """Draw a study again, without a run: figures, table and report, from the netCDF FILE that the study wrote."""
    name, data = read_study(store)
    folder = output or Path(f"{name}-drawn")
    check_output(folder, force)
    found = Written(name, study(name), data, form)
    deliver(folder, found.write, force, found.shown)
