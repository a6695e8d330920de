"""Output of commands: lines that fit the terminal, and one line for each message where output is redirected."""

import logging
import sys
import warnings
from pathlib import Path
from shutil import get_terminal_size
from textwrap import fill
from typing import IO

import click

from structures.caution import HertzlinkWarning

WRONG_INPUT = 2
"""Exit code for input that cannot be used."""

format_of_python = warnings.formatwarning


def fitted(text: str, stream: IO[str]) -> str:
    """Return a message as lines that fit, if the stream is a terminal. No word is broken, so paths can be copied."""
    text = printable(text)
    if not stream.isatty():
        return text
    width = get_terminal_size().columns
    return "\n".join(
        fill(line, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
        for line in text.splitlines()
    )


def printable(text: str) -> str:
    """Return text with control characters as Python writes them: a terminal may take those of a file for commands."""
    return "".join(
        character if character.isprintable() or character in "\n\t" else character.encode("unicode_escape").decode()
        for character in text
    )


def say(text: str) -> None:
    """Print a message."""
    click.echo(fitted(text, sys.stdout))


def show(table: str) -> None:
    """Print lines that fit, such as a table."""
    click.echo(printable(table))


def complain(message: str, prefix: str = "hertzlink: ") -> None:
    """Print a message on standard error."""
    click.echo(fitted(prefix + " ".join(message.split()), sys.stderr), err=True)


def written(folder: Path) -> None:
    """Say where results are: the folder on one line, which can be copied, and its files on the next."""
    show(f"\nwritten to {folder.resolve()}:")
    say(", ".join(sorted(path.name for path in folder.iterdir())))


class LogFormat(logging.Formatter):
    """Lines of hertzlink look like its other messages; those of other packages carry their own name."""

    def format(self, record: logging.LogRecord) -> str:
        """Return one record."""
        package = record.name.partition(".")[0]
        name = package if package == "hertzlink" else record.name
        return fitted(f"{name}: {super().format(record)}", sys.stderr)


def set_up() -> None:
    """Give warnings and the log their form."""
    handler = logging.StreamHandler()
    handler.setFormatter(LogFormat())
    logging.basicConfig(handlers=[handler], level=logging.WARNING)
    # The progress of sweeps, where no bar is drawn because output is redirected.
    logging.getLogger("hertzlink.sweep").setLevel(logging.INFO)
    warnings.formatwarning = format_warning
    # Appended, so that the user's own filters come first.
    warnings.simplefilter("once", HertzlinkWarning, append=True)


def format_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None
) -> str:
    """Return a HertzlinkWarning without the line of code, which the user of a command did not write."""
    if issubclass(category, HertzlinkWarning):
        return fitted(f"hertzlink: warning: {' '.join(str(message).split())}", sys.stderr) + "\n"
    return format_of_python(message, category, filename, lineno, line)
