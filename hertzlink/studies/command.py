"""`hertzlink study NAME` and `hertzlink draw FILE`: netCDF, table, figures and report of a study."""

from pathlib import Path
from time import perf_counter

import click
import xarray as xr

from coupling.results.findings import findings_of, one_of_each, warn, with_warnings
from coupling.results.hdf5 import read_netcdf
from coupling.results.provenance import provenance, stored
from hertzlink.cli import FORCE, JOBS, Listing, output_option
from hertzlink.output import REMARKS, check_output, delivered
from hertzlink.studies import STUDIES, captions, draw, study
from hertzlink.studies.compare import HEAD, Row, answer, compare, table
from structures.caution import collected
from structures.checks import nearest

QUICK = "quick run (--quick), for a first look only"  # The remark on all files of such a run.
FIGURES = click.option(
    "--figures", "form", type=click.Choice([*REMARKS]), default="png", help="Format of the figures; by default png."
)

Found = tuple[list[Row], dict[str, draw.Figure]]


def found_in(name: str, data: xr.Dataset) -> Found:
    """Return the rows of the table of a study, and its figures by their titles."""
    of = study(name)
    with draw.style():
        return of.table(data) if hasattr(of, "table") else compare(name, of.numbers(data)), of.figures(data)


def write(
    name: str, data: xr.Dataset, found: Found, folder: Path, force: bool, form: str, with_data: bool = True
) -> None:
    """Write the files of a study, and show its table. with_data: whether the netCDF file is one of them.

    The comment of the data is a remark on all files; the time that the study took, s, is their attribute `time_taken`.
    """
    from hertzlink.reports import Page, Picture, Table, html, origin_of

    of, (rows, figures), remark = study(name), found, str(data.attrs.get("comment", ""))
    text, first = "\n\n".join(filter(None, (remark, table(rows)))), answer(rows)

    with delivered(folder, force, of.summary(data) if hasattr(of, "summary") else f"{first}\n\n{text}") as into:
        if with_data:
            (into / f"{name}.nc").write_bytes(data.to_netcdf(engine="h5netcdf"))
        (into / "table.txt").write_text(text + "\n", encoding="utf-8")
        for title, figure in figures.items():
            if remark:
                figure.supxlabel(remark, x=0.99, ha="right", color="firebrick", fontsize="small")
            figure.savefig(into / f"{title}.{form}", metadata={REMARKS[form]: remark} if remark else None)

        words, took = captions(name), data.attrs.get("time_taken")
        sketch, texts, facts = origin_of(data, None if took is None else float(took))
        about = [first, STUDIES[name], "Equations, figures, tables and sections are those of the thesis."]
        pictures = [*(Picture(figure, words[title], title) for title, figure in figures.items()), *sketch]
        numbers = [row.cells for row in rows], [row.remark for row in rows]
        tables = [Table("Numbers of the thesis and of hertzlink", tuple(HEAD), *numbers)]
        page = Page(f"Study {name}", about, pictures, tables, one_of_each(findings_of(data)), texts, facts, remark)
        (into / "report.html").write_text(html(page), encoding="utf-8")


@click.command(
    "study", cls=Listing, title="Studies", rows=STUDIES.items, short_help="Run a study of the thesis, or one beyond it."
)
@click.argument(
    "name", metavar="NAME",
    shell_complete=lambda context, parameter, part: [name for name in STUDIES if name.startswith(part)],
)  # fmt: skip
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
            data = study(name).run(quick, jobs)
            data = data.assign_attrs(quick=int(quick), time_taken=perf_counter() - begin)
            found = found_in(name, data)
    finally:
        warn(one_of_each(findings))
    inputs = {"study": name, "quick": quick, "first_run": data.attrs.get("input", "")}
    data = data.assign_attrs(provenance(inputs) | ({"comment": QUICK} if quick else {}))
    write(name, with_warnings(data, findings), found, folder, force, form)


@click.command("draw", short_help="Draw a study again from its netCDF file.")
@click.argument("store", metavar="FILE", type=click.Path(path_type=Path))
@output_option("STUDY-drawn")
@FORCE
@FIGURES
def draw_study(store: Path, output: Path | None, force: bool, form: str) -> None:
    """Draw a study again, without a run: figures, table and report, from the netCDF FILE that the study wrote."""
    data = read_netcdf(store)
    name = str(stored(data.attrs.get("input")).get("study"))
    if name not in STUDIES:
        raise ValueError(f"{store}: was not written by a study; give the .nc file of `hertzlink study`")
    folder = output or Path(f"{name}-drawn")
    check_output(folder, force)
    write(name, data, found_in(name, data), folder, force, form, with_data=False)
