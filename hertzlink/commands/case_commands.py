"""The commands that take a case file: run, check, identify, map; and new and schema, which help to write one.

What reads cases is loaded by the commands themselves, so that the others stay fast.
"""

from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from hertzlink.studies.writing import FORMATS
from hertzlink.terminal import complain, printable, say, show, written

if TYPE_CHECKING:
    from hertzlink.cases.case import Case
    from hertzlink.cases.tables import Answer

CASE = click.argument("case", metavar="CASE.toml", type=click.Path())
CHANGES = click.option(
    "--set", "changes", metavar="ENTRY=VALUE", multiple=True,
    help='Change an entry of the case, such as structure.thickness="1 mm". May be repeated.',
)  # fmt: skip
WITH = click.option(
    "--with", "parts", metavar="FILE.py", multiple=True, type=click.Path(path_type=Path),
    help="A file of Python with parts of your own (@hl.described) that the case uses; its code runs. May be repeated.",
)  # fmt: skip
FORCE = click.option("--force", is_flag=True, help="Replace the output folder if it holds earlier results.")
FIGURES = click.option(
    "--figures", "form", type=click.Choice(list(FORMATS)), help="Also write the figures of the report as files."
)
JOBS = click.option(
    "--jobs", metavar="NUMBER", type=click.IntRange(min=1), help="Number of processes; by default one for each core."
)


def output_option(default: str) -> Callable[[Any], Any]:
    """Return --output, with the name that a folder gets otherwise."""
    words = f"Folder for the results; by default {default}, for CASE.toml."
    return click.option("--output", metavar="FOLDER", type=click.Path(path_type=Path), help=words)


def of_case(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a command that takes a case file: the function gets the file's name, the Case and further options.

    Its Faults get the file and line of their entry.
    """

    @wraps(function)
    def command(case: str, changes: tuple[str, ...], parts: tuple[Path, ...], **others: Any) -> Any:
        from hertzlink.cases.case import read
        from hertzlink.cases.paths import Fault

        full_case, source = read(case, changes, parts)
        try:
            return function(case, full_case, **others)
        except Fault as fault:
            raise source.error(fault) from None

    return CASE(CHANGES(WITH(command)))


@click.command("run", short_help="Run a case: one run, a sweep or a critical distance.")
@of_case
@output_option("CASE")
@FORCE
@JOBS
@FIGURES
def run_case(name: str, case: "Case", output: Path | None, force: bool, jobs: int | None, form: str | None) -> None:
    """Run a case: one run, a sweep or a critical distance. Writes netCDF, CSV and a report, and prints a table.

    AR is the amplitude ratio of a reflected wave to the incident one, TOF the time of flight between them at the
    sensor.
    """
    from hertzlink.cases.tables import report
    from hertzlink.cases.tasks import run_both, task_of

    task = task_of(case)
    folder = output or Path(Path(name).stem)
    write_results(name, case, folder, force, lambda: report(task, *run_both(task, jobs)), task.sensors, form)


def write_results(
    name: str,
    case: "Case",
    folder: Path,
    force: bool,
    work: Callable[[], "Answer"],
    sensors: Sequence[int] | None = None,
    form: str | None = None,
) -> int:
    """Do the work, write its Dataset, CSV files, table and report into a new folder, and print the table.

    Returns the exit code. form: of the report's figures as files; None for no such files.
    """
    from coupling.results.findings import findings_of, one_of_each, warn, with_warnings
    from hertzlink.cases.paths import of_case
    from hertzlink.output_folder import check_output, write_folder
    from hertzlink.reports.page import default_style, html
    from hertzlink.reports.report import page_of
    from structures.caution import collected

    began = perf_counter()
    check_output(folder, force)
    findings: list[str] = []
    text = ""
    try:
        with collected() as findings:
            done = work()
        text = of_case(done.text)
    finally:
        # What the table's notes say is not said twice.
        said = " ".join(text.split())
        warn([finding for finding in one_of_each(list(map(of_case, findings))) if finding not in said])
    data = with_warnings(done.data, [of_case(finding) for finding in (*findings_of(done.data), *findings)])
    took = perf_counter() - began

    def write(into: Path) -> None:
        (into / "results.nc").write_bytes(data.to_netcdf(engine="h5netcdf"))
        for file, content in {"table.txt": printable(text) + "\n", "case.toml": case.to_toml(), **done.files}.items():
            (into / file).write_text(content, encoding="utf-8")
        try:
            page = page_of(data, case.title, sensors, done.sketched, took, done.yielded)
            page.title = case.title or f"{page.title}: {printable(Path(name).stem)}"
            (into / "report.html").write_text(html(page), encoding="utf-8")
            with default_style():
                for picture in page.pictures if form else ():
                    picture.figure.savefig(into / f"{picture.name}.{form}")
        except (OSError, RuntimeError, ValueError) as error:
            # The numbers have taken long. Fonts or programs that figures need may be missing.
            complain(f"warning: the report is not complete: {error}")

    write_folder(folder, write, force)
    show(text)
    written(folder)
    return done.code


@click.command("check", short_help="Check a case without running it; estimate its time.")
@of_case
def check_case(name: str, case: "Case") -> None:
    """Check a case without running it. Prints what would be run, and an estimate of the time that it takes."""
    from hertzlink.cases.check import outlook
    from hertzlink.cases.tasks import task_of

    say(outlook(task_of(case)))


@click.command("identify", short_help="Find unknowns of a case from a measured trace.")
@of_case
@click.argument("trace", metavar="TRACE", type=click.Path(path_type=Path))
@output_option("CASE-found")
@FORCE
@FIGURES
def identify_case(name: str, case: "Case", trace: Path, output: Path | None, force: bool, form: str | None) -> int:
    """Find the unknowns of a case from a measured trace, with 95 % intervals.

    The exit code is 3 where results are written, but an unknown is not identified: the model does not fit, the signal
    does not determine the unknown, or it is at the end of its range.

    TRACE is a file of an oscilloscope or recorder, text or binary, with the voltage or force of each sensor over time.
    A file without times needs --set identify.interval="0.5 us". The section [identify] of the case names the columns
    and the unknowns; `hertzlink new identify` writes an example of both files.
    """
    from hertzlink.cases.identification import answer_of, fit, question_of, signal_of

    question = question_of(case)
    signal = signal_of(question, trace)
    folder = output or Path(f"{Path(name).stem}-found")

    def work() -> "Answer":
        return answer_of(question, fit(question, signal, trace), trace)

    return write_results(name, case, folder, force, work, form=form)


@click.command("map", short_help="Identify, or read AR and TOF, at the points of a grid.")
@of_case
@click.argument("table", metavar="FOLDER", type=click.Path(path_type=Path))
@output_option("CASE-map")
@FORCE
@JOBS
@FIGURES
def map_case(
    name: str, case: "Case", table: Path, output: Path | None, force: bool, jobs: int | None, form: str | None
) -> int:
    """Map a structure: identify the unknowns of a case at each point of a grid, or read AR and TOF.

    \b
    FOLDER holds points.csv, and the files of a scope that it names, one for
    each tap. FOLDER may also be the table itself:
      x = structure.distance / mm, y / mm, file
      15, 0, tap-01.csv
    Lines with the same x and y are taps of one point. A column named by an
    entry of the case, here x, sets it at each point; that is optional.

    Without a section [identify] AR and TOF are read; columns 1, 2 and so on of a file are then the sensors of
    [measure]. The exit code is 3 where a point failed or is not identified. Ctrl-C keeps the answers in FOLDER.parts,
    from which the same command continues; answers of points that did not fail stay there until all points have one.
    """
    from hertzlink.cases.maps import grid_of, map_of
    from hertzlink.output_folder import forget

    folder = output or Path(f"{Path(name).stem}-map")
    parts = folder.with_name(f"{folder.name}.parts")
    grid = grid_of(case, table)
    code = write_results(name, case, folder, force, lambda: map_of(case, grid, parts, jobs), form=form or "png")
    if not code:
        forget(parts)
    return code


@click.command("new", short_help="Write a first case file, with comments.")
@click.argument("kind", metavar="KIND", default="")
@click.argument("path", metavar="[PATH]", type=click.Path(path_type=Path), required=False)
def new_case(kind: str, path: Path | None) -> None:
    """Write a first case file, with comments, that runs as it stands. PATH is by default KIND.toml.

    \b
    KIND is one of
      chain              different beads that face nothing
      deformable         beads that deform, vibrate and lose energy
      two-chains         chains on both faces of a plate
      rod, layered-rod   beads against a rod of one or two layers
      beam               beads against a beam that they bend
      cylinder           beads against a solid cylinder of a soft material
      wall               beads against a thick wall
      plate              beads against a thin rectangular plate
      thick-plate        beads against a rectangular plate with shear
      laminate           beads against a carbon laminate, weakened
      half-plane         beads against a thin plate with one edge, exact
      sweep              several rods
      critical-distance  how far from its edge a plate must be struck
      identify           a plate from a measured tap, and a simulated trace
    or a result such as results.nc, whose case becomes a file again.
    """
    from hertzlink.cases.templates import write_new

    say("\n".join(write_new(kind, path)))


@click.command("schema", short_help="Print the JSON schema of case files, for editors.")
@WITH
def print_schema(parts: tuple[Path, ...]) -> None:
    """Print the JSON schema of case files. With it, editors complete and check the entries of a case."""
    import json

    from hertzlink.cases.case import load
    from hertzlink.cases.schema import schema

    load(parts)
    click.echo(json.dumps(schema(), indent=2, ensure_ascii=False))


COMMANDS = (run_case, check_case, identify_case, map_case, new_case, print_schema)
