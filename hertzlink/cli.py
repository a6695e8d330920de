"""The command line: cases, `hertzlink study NAME`, `hertzlink draw FILE` and `hertzlink info`."""

import errno
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import click
import joblib

from coupling.black_box import NotConverged
from coupling.results.findings import one_of_each, warn, with_warnings
from coupling.results.provenance import provenance, versions
from coupling.sweeps.progress import one_bar
from hertzlink.cases.faults import CaseError
from hertzlink.commands.case_commands import COMMANDS
from hertzlink.commands.explore_command import explore_case
from hertzlink.commands.precice_command import precice_case
from hertzlink.commands.signal_command import show_signal
from hertzlink.commands.study_command import StudyCommand, folder_options, study_options
from hertzlink.output_folder import check_output, forget, write_folder
from hertzlink.studies import STUDIES, LongStudy, study
from hertzlink.studies.writing import QUICK, Written, read_study
from hertzlink.terminal import WRONG_INPUT, complain, set_up, show, written
from structures.caution import collected

FAILED, STOPPED = 1, 130
"""Exit codes: for a computation that failed, and after Ctrl-C. A command may return one
of its own, as `hertzlink identify` does."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line. Bad input leads to one line on standard error and exit code 2.

    `arguments` are the words after the name of the program, by default those of the process.
    """
    for name in ("SIGTERM", "SIGHUP"):
        # One that is ignored stays so, as after nohup.
        if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) is not signal.SIG_IGN:
            signal.signal(getattr(signal, name), signal.default_int_handler)
    set_up()
    try:
        code = cli.main(arguments, prog_name="hertzlink", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.ctx.get_help() if error.ctx else "", err=True)
        code = WRONG_INPUT
    except click.ClickException as error:
        complain(error.format_message())
        code = WRONG_INPUT
    except CaseError as error:
        # It begins with the line of a case file, where editors and terminals look for it.
        complain(str(error), "")
        code = WRONG_INPUT
    except OSError as error:
        complain(_in_words(error))
        code = WRONG_INPUT
    except ValueError as error:
        complain(str(error))
        code = WRONG_INPUT
    except (FloatingPointError, NotConverged) as error:
        complain(str(error))
        code = FAILED
    except (click.Abort, KeyboardInterrupt) as error:
        # click wraps an interrupt, which may say what was kept.
        complain(str(error.__cause__ or error) or "stopped; nothing was written")
        code = STOPPED
    sys.exit(code)


def _in_words(error: OSError) -> str:
    """Return what could not be used, and why, without the number of the error."""
    if error.strerror is None:
        return str(error)
    # What is printed has no name; a full disk under a file of results does, see `whole_folder`.
    of_print = error.errno == errno.ENOSPC and error.filename is None
    place = "standard output" if of_print else error.filename
    return error.strerror if place is None else f"{place}: {error.strerror}"


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(versions()["hertzlink"], prog_name="hertzlink")
def cli() -> None:
    """Solitary waves in chains of beads that touch a structure, and their reflections.

    Begin with `hertzlink new plate`, which writes plate.toml, then `hertzlink run plate.toml`.
    """


for _command in (*COMMANDS, explore_case, precice_case, show_signal):
    cli.add_command(_command)


@cli.command(
    "study", cls=StudyCommand, short_help="Run a study of the thesis, or one beyond it.", params=study_options()
)
def run_study(name: str, quick: bool, output: Path | None, force: bool, jobs: int | None, form: str) -> None:
    """Run a study of the thesis, or one beyond it: netCDF, figures, a table and a report."""
    folder = output or Path(name)
    check_output(folder, force)
    chosen = study(name)
    parts = folder.with_name(f"{folder.name}.parts")
    keep = {"keep": parts} if isinstance(chosen, LongStudy) else {}
    findings: list[str] = []
    try:
        with collected() as findings, one_bar(name, STUDIES[name].runs[not quick]):
            begin = perf_counter()
            data = chosen.run(quick, jobs, **keep)
            data = data.assign_attrs(quick=int(quick), time_taken=perf_counter() - begin)
            found = Written(name, chosen, data.assign_attrs({"comment": QUICK} if quick else {}), form)
    finally:
        warn(one_of_each(findings))
    inputs = {"study": name, "quick": quick, "first_run": data.attrs.get("input", "")}
    attributes = provenance(inputs)
    data = with_warnings(found.data.assign_attrs(attributes), findings)
    write_folder(folder, lambda into: found.write(into, data), force)
    if keep:
        forget(parts)
    show(found.shown)
    written(folder)


STORE = click.Argument(["store"], metavar="FILE", type=click.Path(path_type=Path))


@cli.command(
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


@cli.command()
def info() -> None:
    """Show the versions, threads and folders of this installation."""
    from numba import get_num_threads

    from structures.kernels.compiling import FOLDER

    for package, version in versions().items():
        click.echo(f"{package:14s} {version}")
    click.echo(f"{'processes':14s} {joblib.cpu_count()}")
    click.echo(f"{'threads':14s} {get_num_threads()} (numba)")
    click.echo(f"{'installed in':14s} {Path(__file__).resolve().parent.parent}")
    click.echo(f"{'kernel cache':14s} {FOLDER}")
