"""What commands print and write: one line for a message, and folders that appear complete or not at all."""

import errno
import hashlib
import os
import re
import shutil
import stat
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import Any

import click

from structures.caution import HertzlinkWarning

WRONG_INPUT = 2
"""Exit code for input that cannot be used."""

REMARKS = {"png": "Comment", "svg": "Description", "pdf": "Subject"}
"""Formats of figures, and the entry of their metadata that holds a remark."""

LISTING = "files.txt"
"""The file in a folder of results that lists the others with their SHA-256, as the program sha256sum does."""

format_of_python = warnings.formatwarning


def printable(text: str) -> str:
    """Return text with control characters as Python writes them: a terminal may take those of a file for commands."""
    return "".join(one if one.isprintable() or one in "\n\t" else one.encode("unicode_escape").decode() for one in text)


def say(text: str) -> None:
    """Print a text."""
    click.echo(printable(text))


def complain(message: str, prefix: str = "hertzlink: ") -> None:
    """Print a message on standard error, as one line."""
    click.echo(printable(prefix + " ".join(message.split())), err=True)


def format_warning(message: Warning | str, category: type[Warning], *where: Any, **line: Any) -> str:
    """Return a HertzlinkWarning without the line of code, which the user of a command did not write."""
    if issubclass(category, HertzlinkWarning):
        return printable(f"hertzlink: warning: {' '.join(str(message).split())}\n")
    return format_of_python(message, category, *where, **line)


def check_output(folder: Path, force: bool) -> None:
    """Raise a ValueError if the folder cannot be written, or holds files that no earlier command wrote."""
    name = f"--output {folder}"
    try:
        with suppress(FileNotFoundError, NotADirectoryError):
            folder.stat()  # fails on a link that leads to itself
        path = folder.resolve()
        reason = ""
        if path.exists() and not path.is_dir():
            reason = "is a file; give a folder"
        elif path == Path.cwd() or path in Path.cwd().parents:
            reason = "contains the current folder; give another one"
        elif path.exists() and (foreign := foreign_files(path)):
            reason = f"contains {foreign[0]}, which no earlier command wrote, or which was changed since"
            reason += "; move it away, or give another folder"
        elif path.exists() and not force:
            reason = "exists already; give another folder, or use --force to replace it"
        elif not path.parent.is_dir():
            reason = "its parent folder does not exist"
        if reason:
            raise ValueError(f"{name}: {reason}")
        # Only a trial shows whether a folder can be made here.
        trial = temporary_beside(path)
        trial.mkdir()
        trial.rmdir()
    except OSError as error:
        raise ValueError(f"{name}: cannot be written ({error.strerror or error}); give another folder") from error


def foreign_files(folder: Path) -> list[str]:
    """Return the names in a folder that no command wrote, or that were changed since."""
    listing, lines = folder / LISTING, list[str]()
    if listing.is_file() and not listing.is_symlink():
        lines = listing.read_text(encoding="utf-8", errors="replace").splitlines()
        if all(re.match("[0-9a-f]{64}  ", line) for line in lines):
            lines.append(listed(listing))
    return [path.name for path in sorted(folder.iterdir()) if listed(path) not in lines]


def listed(path: Path) -> str:
    """Return the line of a file in the listing of its folder; a link or a folder has no sum."""
    is_file = path.is_file() and not path.is_symlink()
    return f"{hashlib.sha256(path.read_bytes()).hexdigest() if is_file else ''}  {path.name}"


def temporary_beside(path: Path) -> Path:
    """Return an unused name beside a path."""
    return path.with_name(f".{path.name[:40]}.{token_hex(8)}.part")


@contextmanager
def delivered(folder: Path, force: bool, text: str) -> Iterator[Path]:
    """Give a temporary folder for all files, which is then renamed: the folder appears complete, or not at all.

    Then show a text, and say where the files are: the folder on one line, which can be copied.
    """
    folder = folder.resolve()
    new, old = temporary_beside(folder), temporary_beside(folder)
    new.mkdir()
    try:
        try:
            yield new
            lines = [f"{listed(path)}\n" for path in sorted(new.iterdir())]
            (new / LISTING).write_text("".join(lines), encoding="utf-8")
        except OSError as error:
            raise unchanged(error, folder) from error

        if folder.exists() and force:
            new.chmod(stat.S_IMODE(folder.stat().st_mode))
            folder.rename(old)  # from now on nobody can write into it
            if foreign_files(old):
                old.rename(folder)
        if folder.exists():  # another program has made it since the check
            place = next(path for i in range(2, 10**6) if not os.path.lexists(path := Path(f"{folder}-{i}")))
            new.rename(place)
            reason = f"now holds files that would be deleted; nothing was changed; the new folder is {place}"
            raise FileExistsError(errno.EEXIST, reason, str(folder))
        new.rename(folder)
        shutil.rmtree(old, ignore_errors=True)
    finally:
        shutil.rmtree(new, ignore_errors=True)
    say(f"{text}\n\nwritten to {folder}:")
    say(", ".join(sorted(path.name for path in folder.iterdir())))


def write_file(path: Path, content: bytes) -> None:
    """Write a file completely, or leave the earlier one unchanged."""
    new = temporary_beside(path)
    try:
        new.write_bytes(content)
        if path.exists():
            new.chmod(stat.S_IMODE(path.stat().st_mode))
        new.replace(path)
    except OSError as error:
        raise unchanged(error, path) from error
    finally:
        new.unlink(missing_ok=True)


def unchanged(error: OSError, path: Path) -> OSError:
    """Return the error of writing a file or folder, with the remark that nothing was changed."""
    reason = error.strerror or str(error) if path.parent.is_dir() else f"the folder {path.parent} does not exist"
    if reason == os.strerror(errno.ENOENT):
        reason = f"cannot be written in the folder {path.parent} ({reason}); give another folder"
    return OSError(error.errno, f"{reason}; nothing was changed", str(path))
