"""Output of commands: lines that fit the terminal, and one line for each message where output is redirected."""

import logging
import os
import sys
import warnings
from contextlib import suppress
from pathlib import Path
from textwrap import fill
from typing import IO

import click

from structures.caution import HertzlinkWarning

NAME = "hertzlink"

USUAL_WIDTH = 80
"""Columns of a terminal that does not say how many it has."""

CONTINUED = "  "
"""Before the second and later lines of a message."""

JOINED = "\0"
"""In place of a blank at which no line may end."""

PLAIN_FORMAT = warnings.formatwarning
"""The format of warnings of other packages, which stays as it is."""


WRONG_INPUT = 2
"""Exit code for input that cannot be used."""


def wrapped(text: str, stream: IO[str]) -> str:
    """Return a message as lines that fit, if the stream is a terminal; paths of the command are not broken, so that
    they can be copied."""
    text, width = printable(text), _columns(stream) if stream.isatty() else 0
    if not width:
        return text
    for path in _paths():
        text = text.replace(path, path.replace(" ", JOINED))
    lines = [
        line if len(line) <= width else
        fill(line, width, subsequent_indent=CONTINUED, break_long_words=False, break_on_hyphens=False)
        for line in text.splitlines()
    ]  # fmt: skip
    return "\n".join(lines).replace(JOINED, " ")


def printable(text: str) -> str:
    """Return text with what is no letter as Python writes it: a file may hold what a terminal takes for a command."""
    return "".join(
        character if character.isprintable() or character in "\n\t" else character.encode("unicode_escape").decode()
        for character in text
    )


def _columns(stream: IO[str]) -> int:
    """Return the width of a terminal; COLUMNS, where it is set, comes first."""
    with suppress(ValueError):
        if (given := int(os.environ.get("COLUMNS", ""))) > 0:
            return given
    with suppress(OSError, ValueError):
        if (known := os.get_terminal_size(stream.fileno()).columns) > 0:
            return known
    return USUAL_WIDTH


def _paths() -> list[str]:
    """Return what may be a path with blanks in a message: the current folder, and the words of the command."""
    folders = [word for word in sys.argv[1:] if not word.startswith("-")]
    with suppress(OSError):
        folders.append(str(Path.cwd()))
    return sorted((word for word in folders if " " in word), key=len, reverse=True)


def say(text: str) -> None:
    """Print a message."""
    click.echo(wrapped(text, sys.stdout))


def show(table: str) -> None:
    """Print lines that fit, such as a table."""
    click.echo(printable(table))


def complain(message: str, prefix: str = f"{NAME}: ") -> None:
    """Print a message on standard error."""
    click.echo(wrapped(prefix + " ".join(message.split()), sys.stderr), err=True)


def written(folder: Path) -> None:
    """Say where results are."""
    say(f"\nwritten to {folder.resolve()}: " + ", ".join(sorted(path.name for path in folder.iterdir())))


class LogFormat(logging.Formatter):
    """hertzlink's own lines look like its other messages; those of other packages carry their own name."""

    def format(self, record: logging.LogRecord) -> str:
        """Return one record."""
        is_ours = record.name.partition(".")[0] == NAME
        return wrapped(f"{NAME if is_ours else record.name}: {super().format(record)}", sys.stderr)


def set_up() -> None:
    """Give warnings and the log their form."""
    handler = logging.StreamHandler()
    handler.setFormatter(LogFormat())
    logging.basicConfig(handlers=[handler], level=logging.WARNING)
    # Where no bar is drawn, as output is redirected.
    logging.getLogger("hertzlink.sweep").setLevel(logging.INFO)
    warnings.formatwarning = _format_warning
    # Appended, so that filters set by the user come first.
    warnings.simplefilter("once", HertzlinkWarning, append=True)


def _format_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None
) -> str:
    """Return a HertzlinkWarning without the line of code, which the user of a command did not write."""
    if issubclass(category, HertzlinkWarning):
        return wrapped(f"{NAME}: warning: {' '.join(str(message).split())}", sys.stderr) + "\n"
    return PLAIN_FORMAT(message, category, filename, lineno, line)
