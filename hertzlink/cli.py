"""The command line: it collects the commands, and turns errors into one line and an exit code."""

import errno
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

import click
import joblib

from coupling.black_box import NotConverged
from coupling.results.provenance import versions
from hertzlink.cases.paths import CaseError
from hertzlink.commands.case_commands import COMMANDS
from hertzlink.commands.explore_command import explore_case
from hertzlink.commands.precice_command import precice_case
from hertzlink.commands.signal_command import show_signal
from hertzlink.commands.study_command import draw_study, run_study
from hertzlink.terminal import WRONG_INPUT, complain, set_up

FAILED, STOPPED = 1, 130
"""Exit codes of a computation that failed, and after Ctrl-C. A command may return one of its own."""


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(versions()["hertzlink"], prog_name="hertzlink")
def cli() -> None:
    """Solitary waves in chains of beads that touch a structure, and their reflections.

    Begin with `hertzlink new plate`, which writes plate.toml, then `hertzlink run plate.toml`.
    """


@cli.command()
def info() -> None:
    """Show the versions, threads and folders of this installation."""
    from numba import get_num_threads

    from structures.kernels.compiling import FOLDER

    facts = {
        **versions(),
        "processes": joblib.cpu_count(),
        "threads": f"{get_num_threads()} (numba)",
        "installed in": Path(__file__).resolve().parent.parent,
        "kernel cache": FOLDER,
    }
    for name, value in facts.items():
        click.echo(f"{name:14s} {value}")


for command in (*COMMANDS, explore_case, precice_case, show_signal, run_study, draw_study):
    cli.add_command(command)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line. Bad input leads to one line on standard error and exit code 2.

    `arguments` are the words after the name of the program, by default those of the process.
    """
    for name in ("SIGTERM", "SIGHUP"):
        # A signal that is ignored stays so, as after nohup.
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
    except OSError as error:
        # A full disk names the file of results; without a name it is what is printed.
        printing = error.errno == errno.ENOSPC and error.filename is None
        place = "standard output" if printing else error.filename
        words = error.strerror or str(error)
        complain(words if place is None else f"{place}: {words}")
        code = WRONG_INPUT
    except ValueError as error:
        # The message of a case begins with its file and line, where editors look for them.
        complain(str(error), "" if isinstance(error, CaseError) else "hertzlink: ")
        code = WRONG_INPUT
    except (FloatingPointError, NotConverged) as error:
        complain(str(error))
        code = FAILED
    except (click.Abort, KeyboardInterrupt) as error:
        # click wraps an interrupt, which may say what was kept.
        complain(str(error.__cause__ or error) or "stopped; nothing was written")
        code = STOPPED
    sys.exit(code)
