"""`hertzlink study NAME` and `hertzlink draw FILE`: the studies and their options."""

from pathlib import Path
from time import perf_counter

import click

from coupling.results.findings import one_of_each, warn, with_warnings
from coupling.results.provenance import provenance
from hertzlink.output_folder import check_output, write_folder
from hertzlink.studies import STUDIES, study
from hertzlink.studies.writing import FORMATS, QUICK, Written, read_study
from hertzlink.terminal import show, written
from structures.caution import collected
from structures.checks import did_you_mean


def folder_options(default: str) -> tuple[click.Parameter, ...]:
    """Return where a study's results go, and in which format its figures. default: the folder, in words."""
    words = f"Folder for the results; by default {default}."
    formats = click.Choice(list(FORMATS))
    return (
        click.Option(["--output"], metavar="FOLDER", type=click.Path(path_type=Path), help=words),
        click.Option(["--force"], is_flag=True, help="Replace the output folder if it holds an earlier study."),
        click.Option(["--figures", "form"], type=formats, default="png", help="Format of the figures; by default png."),
    )


def study_options() -> list[click.Parameter]:
    """Return the name of a study and the options of every study."""
    output, force, form = folder_options("named as the study")
    quick = click.Option(["--quick"], is_flag=True, help="A coarse version that runs in seconds.")
    words = "Number of processes; by default a suitable number."
    jobs = click.Option(["--jobs"], metavar="NUMBER", type=click.IntRange(min=1), help=words)
    return [click.Argument(["name"], type=StudyName(), metavar="NAME"), quick, output, force, jobs, form]


class StudyName(click.Choice[str]):
    """The name of a study; a wrong one leads to a message with the nearest names."""

    def __init__(self) -> None:
        super().__init__(list(STUDIES))

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name."""
        if value not in STUDIES:
            meant = did_you_mean(value, STUDIES, str) or f"there are {', '.join(STUDIES)}"
            raise click.UsageError(f"study {value!r} is not one of the studies; {meant}")
        return value


class StudyCommand(click.Command):
    """The command, whose help lists the studies with what they show, without loading them."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the studies."""
        with formatter.section("Studies"):
            formatter.write_dl(list(STUDIES.items()))


@click.command(
    "study", cls=StudyCommand, short_help="Run a study of the thesis, or one beyond it.", params=study_options()
)
def run_study(name: str, quick: bool, output: Path | None, force: bool, jobs: int | None, form: str) -> None:
    """Run a study of the thesis, or one beyond it: netCDF, figures, a table and a report."""
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
    write_folder(folder, lambda into: found.write(into, data), force)
    show(found.shown)
    written(folder)


STORE = click.Argument(["store"], metavar="FILE", type=click.Path(path_type=Path))


@click.command(
    "draw", short_help="Draw a study again from its netCDF file.", params=[STORE, *folder_options("STUDY-drawn")]
)
def draw_study(store: Path, output: Path | None, force: bool, form: str) -> None:
    """Draw a study again, without a run: figures, table and report, from the netCDF FILE that the study wrote."""
    name, data = read_study(store)
    folder = output or Path(f"{name}-drawn")
    check_output(folder, force)
    found = Written(name, study(name), data, form)
    write_folder(folder, found.write, force)
    show(found.shown)
    written(folder)
