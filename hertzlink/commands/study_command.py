"""`hertzlink study NAME` and `hertzlink draw FILE`: the studies and their options."""

from pathlib import Path
from time import perf_counter

import click

from coupling.results.findings import one_of_each, warn, with_warnings
from coupling.results.provenance import provenance
from hertzlink.cli import FORCE, FORMATS, JOBS, output_option
from hertzlink.output import check_output, deliver
from hertzlink.studies import STUDIES, study
from hertzlink.studies.writing import QUICK, Written, read_study
from structures.caution import collected
from structures.checks import nearest

FIGURES = click.option(
    "--figures", "form", type=click.Choice(FORMATS), default="png", help="Format of the figures; by default png."
)


class StudyCommand(click.Command):
    """The command, whose help lists the studies with what they show, without loading them."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the studies."""
        with formatter.section("Studies"):
            formatter.write_dl(list(STUDIES.items()))


def begun(context: click.Context, parameter: click.Parameter, part: str) -> list[str]:
    """Return the studies whose names begin so, for shells that complete what is typed."""
    return [name for name in STUDIES if name.startswith(part)]


@click.command("study", cls=StudyCommand, short_help="Run a study of the thesis, or one beyond it.")
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
