"""The command line: cases, `hertzlink study NAME`, `hertzlink draw FILE` and `hertzlink info`."""

import errno
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

import click
import joblib

from coupling.black_box import NotConverged
from coupling.results.provenance import versions
from hertzlink.cases.faults import CaseError
from hertzlink.commands.case_commands import COMMANDS
from hertzlink.commands.explore_command import explore_case
from hertzlink.commands.precice_command import precice_case
from hertzlink.commands.signal_command import show_signal
from hertzlink.commands.study_command import draw_study, run_study
from hertzlink.terminal import WRONG_INPUT, complain, set_up

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


for _command in (*COMMANDS, explore_case, precice_case, show_signal, run_study, draw_study):
    cli.add_command(_command)


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
