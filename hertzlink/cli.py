"""The command line: the commands that take a case file, and errors as one line and an exit code.

Commands import the modules that read cases when they run, so that the other commands stay fast.
"""

import errno
import logging
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import wraps
from importlib import import_module
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from coupling.black_box import NotConverged
from coupling.results.provenance import versions
from hertzlink.output import REMARKS, WRONG_INPUT, check_output, complain, delivered, format_warning, printable, say
from structures.caution import HertzlinkWarning

if TYPE_CHECKING:
    from hertzlink.cases.case import Case
    from hertzlink.cases.tables import Answer

FAILED, STOPPED = 1, 130
"""Exit codes of a computation that failed, and after Ctrl-C. A command may return one of its own."""

LATER = {
    "explore": "commands.explore_case",
    "precice": "commands.precice_case",
    "signal": "commands.show_signal",
    "study": "studies.command.run_study",
    "draw": "studies.command.draw_study",
}
"""Commands of modules that are loaded when they are named."""

CHANGES = click.option(
    "--set", "changes", metavar="ENTRY=VALUE", multiple=True,
    help='Change an entry of the case, such as structure.thickness="1 mm". May be repeated.',
)  # fmt: skip
WITH = click.option(
    "--with", "parts", metavar="FILE.py", multiple=True, type=click.Path(path_type=Path),
    help="A Python file with parts of your own (@hl.described) that the case uses; its code is run. May be repeated.",
)  # fmt: skip
FORCE = click.option("--force", is_flag=True, help="Replace the output folder if it holds earlier results.")
FIGURES = click.option(
    "--figures", "form", type=click.Choice([*REMARKS]), help="Also write the figures of the report as files."
)
JOBS = click.option(
    "--jobs", metavar="NUMBER", type=click.IntRange(min=1), help="Number of processes; by default one for each core."
)


class Commands(click.Group):
    """Commands, some of which are loaded when they are named."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return sorted({*self.commands, *LATER})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command; None for an unknown name."""
        if cmd_name in LATER:
            module, _, name = LATER[cmd_name].rpartition(".")
            self.add_command(getattr(import_module(f"hertzlink.{module}"), name))
        return super().get_command(ctx, cmd_name)


class Listing(click.Command):
    """A command whose help lists what its argument may be, from a function that is called then."""

    def __init__(self, *given: Any, title: str, rows: Callable[[], Iterable[tuple[str, str]]], **settings: Any) -> None:
        super().__init__(*given, **settings)
        self.title, self.rows = title, rows

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the rows under their title."""
        with formatter.section(self.title):
            formatter.write_dl([*self.rows()])


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(versions()["hertzlink"], prog_name="hertzlink")
def cli() -> None:
    """Solitary waves in chains of beads that touch a structure, and their reflections.

    Begin with `hertzlink new plate`, which writes plate.toml, then `hertzlink run plate.toml`.
    """


def output_option(default: str) -> Callable[[Any], Any]:
    """Return the option --output. default: the folder without it, in words."""
    words = f"Folder for the results; by default {default}."
    return click.option("--output", metavar="FOLDER", type=click.Path(path_type=Path), help=words)


def of_case(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a command that takes a case file: the function gets the file's name, the Case and further options."""

    @wraps(function)
    def command(case: str, changes: tuple[str, ...], parts: tuple[Path, ...], **others: Any) -> Any:
        from hertzlink.cases import Fault
        from hertzlink.cases.case import read

        full_case, source = read(case, changes, parts)
        try:
            return function(case, full_case, **others)
        except Fault as fault:  # gets the file and line of its entry
            raise source.error(fault) from None

    return click.argument("case", metavar="CASE.toml", type=click.Path())(CHANGES(WITH(command)))


@cli.command(short_help="Run a case: one run, a sweep or a critical distance.")
@of_case
@output_option("CASE, for CASE.toml")
@FORCE
@JOBS
@FIGURES
def run(name: str, case: "Case", output: Path | None, force: bool, jobs: int | None, form: str | None) -> None:
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
    name: str, case: "Case", folder: Path, force: bool, work: Callable[[], "Answer"],
    sensors: Sequence[int] | None = None, form: str | None = None,
) -> int:  # fmt: skip
    """Do the work, write its Dataset, CSV files, table and report into a new folder; return the exit code."""
    from coupling.results.findings import findings_of, one_of_each, warn, with_warnings
    from hertzlink.cases.case import of_case
    from hertzlink.reports import default_style, html, page_of
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
        # Findings that the notes of the table already state are left out.
        said = " ".join(text.split())
        warn([finding for finding in one_of_each(list(map(of_case, findings))) if finding not in said])
    data = with_warnings(done.data, [of_case(finding) for finding in (*findings_of(done.data), *findings)])
    took = perf_counter() - began

    with delivered(folder, force, text) as into:
        (into / "results.nc").write_bytes(data.to_netcdf(engine="h5netcdf"))
        files = {"table.txt": printable(text) + "\n", "case.toml": case.to_toml(), **done.others}
        for file, content in (files | {table.file: table.csv() for table in done.tables}).items():
            (into / file).write_text(content, encoding="utf-8")
        try:
            page = page_of(data, case.title, sensors, done.sketched, took, done.yielded)
            stem = printable(Path(name).stem)
            # The name is added to the title unless the title holds it.
            if not case.title and stem.replace("-", " ") not in page.title.lower().replace(".", ": ").split(": "):
                page.title += f": {stem}"
            (into / "report.html").write_text(html(page), encoding="utf-8")
            with default_style():
                for picture in page.pictures if form else ():
                    picture.figure.savefig(into / f"{picture.name}.{form}")
        except (OSError, RuntimeError, ValueError) as error:
            # Fonts or programs that figures need may be missing; the numbers, which took long, are kept.
            complain(f"warning: the report is not complete: {error}")
    return done.code


@cli.command(short_help="Check a case without running it.")
@of_case
def check(name: str, case: "Case") -> None:
    """Check a case without running it. Prints what would be run, and warnings about its first structures."""
    from hertzlink.cases.check import outlook
    from hertzlink.cases.tasks import task_of

    say(outlook(task_of(case)))


@cli.command(short_help="Find unknowns of a case from a measured trace.")
@of_case
@click.argument("trace", metavar="TRACE", type=click.Path(path_type=Path))
@output_option("CASE-found, for CASE.toml")
@FORCE
@FIGURES
def identify(name: str, case: "Case", trace: Path, output: Path | None, force: bool, form: str | None) -> int:
    """Find the unknowns of a case from a measured trace, with 95 % intervals.

    The exit code is 3 if results are written, but not every unknown is identified: the model does not fit, the signal
    does not determine the unknown, or it is at the end of its range.

    TRACE is a file of an oscilloscope or recorder, text or binary, with the voltage or force of each sensor over time.
    A file without times needs --set identify.interval="0.5 us". The section [identify] of the case names the columns
    and the unknowns; `hertzlink new identify` writes an example of both files.
    """
    from hertzlink.cases.identification import answer_of, fit, question_of, signal_of

    task = question_of(case)
    signal = signal_of(task, trace)
    folder = output or Path(f"{Path(name).stem}-found")

    return write_results(name, case, folder, force, lambda: answer_of(task, fit(task, signal, trace)), form=form)


@cli.command("map", short_help="Identify, or read AR and TOF, at the points of a grid.")
@of_case
@click.argument("table", metavar="FOLDER", type=click.Path(path_type=Path))
@output_option("CASE-map, for CASE.toml")
@FORCE
@JOBS
@FIGURES
def map_of_case(
    name: str, case: "Case", table: Path, output: Path | None, force: bool, jobs: int | None, form: str | None
) -> int:
    """Map a structure: identify the unknowns of a case at each point of a grid, or read AR and TOF.

    \b
    FOLDER holds points.csv, and the files of a scope that it names, one for
    each tap. FOLDER may also be the table itself:
      x = structure.distance / mm, y / mm, file
      15, 0, tap-01.csv
    Lines with the same x and y are taps of one point. A column named after
    an entry of the case, here x, sets this entry at each point; it is
    optional.

    Without a section [identify], AR and TOF are read; columns 1, 2 and so on of a file are then the sensors of
    [measure]. The exit code is 3 if a point failed or is not identified. After Ctrl-C the finished points stay in
    CASE-map.parts, and the same command continues. They are removed when all points are identified, or read.
    """
    from hertzlink.cases.identification import grid_of, map_of

    folder = output or Path(f"{Path(name).stem}-map")
    parts = folder.with_name(f"{folder.name}.parts")
    grid = grid_of(case, table)
    try:
        code = write_results(name, case, folder, force, lambda: map_of(case, grid, parts, jobs), form=form or "png")
        for file in parts.glob("*.nc") if not code else ():
            file.unlink()
    finally:
        with suppress(OSError):  # of a folder that holds answers
            parts.rmdir()
    return code


def kinds() -> list[tuple[str, str]]:
    """Return the kinds of cases with the first line of each."""
    from hertzlink.cases.templates import KINDS, template

    return [(kind, template(kind).splitlines()[0].removeprefix("# ")) for kind in KINDS]


@cli.command(cls=Listing, title="Kinds", rows=kinds, short_help="Write a first case file, with comments.")
@click.argument("kind", metavar="KIND", default="")
@click.argument("path", metavar="[PATH]", type=click.Path(path_type=Path), required=False)
def new(kind: str, path: Path | None) -> None:
    """Write a first case file, with comments, that runs as it stands. PATH is by default KIND.toml."""
    from hertzlink.cases.templates import write_new

    say("\n".join(write_new(kind, path)))


@cli.command(short_help="Print the JSON schema of case files, for editors.")
@WITH
def schema(parts: tuple[Path, ...]) -> None:
    """Print the JSON schema of case files. With it, editors complete and check the entries of a case."""
    import json

    from hertzlink.cases.case import load
    from hertzlink.cases.schema import schema

    load(parts)
    click.echo(json.dumps(schema(), indent=2, ensure_ascii=False))


@cli.command()
def info() -> None:
    """Show the versions, threads and folders of this installation."""
    from joblib import cpu_count
    from numba import get_num_threads

    from structures.kernels.compiling import FOLDER

    facts: dict[str, Any] = versions() | {"processes": cpu_count(), "threads": f"{get_num_threads()} (numba)"}
    facts |= {"installed in": Path(__file__).resolve().parent.parent, "kernel cache": FOLDER}
    for name, value in facts.items():
        click.echo(f"{name:14s} {value}")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line. Bad input leads to one line on standard error and exit code 2."""
    for name in ("SIGTERM", "SIGHUP"):
        # A signal that is ignored stays so, as after nohup.
        if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) is not signal.SIG_IGN:
            signal.signal(getattr(signal, name), signal.default_int_handler)
    logging.basicConfig(format="%(name)s: %(message)s", level=logging.WARNING)
    # The progress of sweeps, where no bar is drawn because output is redirected.
    logging.getLogger("hertzlink.sweep").setLevel(logging.INFO)
    warnings.formatwarning = format_warning
    # Appended, so that the user's own filters come first.
    warnings.simplefilter("once", HertzlinkWarning, append=True)
    code, prefix = WRONG_INPUT, "hertzlink: "
    try:
        sys.exit(cli.main(arguments, prog_name="hertzlink", standalone_mode=False))
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        sys.exit(WRONG_INPUT)
    except click.ClickException as error:
        usage = error.ctx.get_usage() if isinstance(error, click.MissingParameter) and error.ctx else ""
        words = f"{error.format_message()} {usage}"
    except OSError as error:
        # On a full disk the error names the file of results; without a name, printing failed.
        place = error.filename or ("standard output" if error.errno == errno.ENOSPC else "")
        words = f"{place}: {error.strerror or error}".removeprefix(": ")
    except ValueError as error:
        from hertzlink.cases import CaseError

        # The message of a case begins with its file and line, where editors look for them.
        words, prefix = str(error), "" if isinstance(error, CaseError) else prefix
    except (FloatingPointError, NotConverged) as error:
        words, code = str(error), FAILED
    except (click.Abort, KeyboardInterrupt) as error:
        # click wraps an interrupt, whose message may say what was kept.
        words, code = str(error.__cause__ or error) or "stopped; nothing was written", STOPPED
    complain(words, prefix)
    sys.exit(code)
