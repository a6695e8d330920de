"""What a command writes: a folder or a file that appears complete or not at all, and never replaces work of others."""

import errno
import hashlib
import os
import re
import shutil
import stat
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from secrets import token_hex

# The file in a folder of results that lists the others with their SHA-256, as the program sha256sum does.
LISTING, LISTED = "files.txt", re.compile(r"([0-9a-f]{64})  (.+)")


def check_output(folder: Path, force: bool) -> None:
    """Raise a ValueError if the folder cannot be written, before any computation.

    With --force a folder is replaced that holds the files of an earlier command, unchanged, and no others.
    """
    name = f"--output {folder}"
    try:
        with suppress(FileNotFoundError, NotADirectoryError):
            folder.stat()  # fails on a link that leads to itself
        path = folder.resolve()
        if path.exists() and not path.is_dir():
            raise ValueError(f"{name}: is a file; give a folder")
        if path == Path.cwd() or path in Path.cwd().parents:
            raise ValueError(f"{name}: contains the current folder; give another one")
        if path.exists() and not force:
            raise ValueError(f"{name}: exists already; give another folder, or use --force to replace it")
        if path.exists() and (foreign := foreign_files(path)):
            raise ValueError(
                f"{name}: contains {foreign[0]}, which no earlier command wrote, or which was changed since; move it "
                "away, or give another folder"
            )
        if not path.parent.is_dir():
            raise ValueError(f"{name}: its parent folder does not exist")
        # Only a trial shows whether a folder can be made here.
        trial = temporary_beside(path)
        trial.mkdir()
        trial.rmdir()
    except OSError as error:
        raise ValueError(f"{name}: cannot be written ({error.strerror or error}); give another folder") from error


def foreign_files(folder: Path) -> list[str]:
    """Return the names in a folder that no command wrote, or that were changed since."""
    listing, sums = folder / LISTING, dict[str, str]()
    if listing.is_file() and not listing.is_symlink():
        lines = listing.read_text(encoding="utf-8", errors="replace").splitlines()
        matches = [match for line in lines if (match := LISTED.fullmatch(line))]
        if len(matches) == len(lines):
            sums = {match[2]: match[1] for match in matches} | {LISTING: sum_of(listing)}
    return sorted(
        path.name
        for path in folder.iterdir()
        if path.is_symlink() or not path.is_file() or sums.get(path.name) != sum_of(path)
    )


def sum_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def temporary_beside(path: Path) -> Path:
    """Return a name beside a path that nothing has."""
    return path.with_name(f".{path.name[:40]}.{token_hex(8)}.part")


def write_folder(folder: Path, write: Callable[[Path], None], force: bool) -> None:
    """Write all files into a temporary folder, then rename it. The folder thus appears complete, or not at all.

    The folder was checked before the work. If something has come to lie there since, the results get another name, and
    an OSError says so.
    """
    folder = folder.resolve()
    new, old = temporary_beside(folder), temporary_beside(folder)
    new.mkdir()
    try:
        try:
            write(new)
            lines = [f"{sum_of(path)}  {path.name}\n" for path in sorted(new.iterdir())]
            (new / LISTING).write_text("".join(lines), encoding="utf-8")
        except OSError as error:
            raise OSError(error.errno, f"{error.strerror or error}; nothing was changed", str(folder)) from error

        foreign = list[str]()
        if folder.exists() and force:
            new.chmod(stat.S_IMODE(folder.stat().st_mode))
            folder.rename(old)  # nothing can come to lie in it now
            foreign = foreign_files(old)
            if foreign:
                old.rename(folder)
        elif folder.exists():
            foreign = ["the results of another command"]
        if foreign:
            place = next(path for i in range(2, 10**6) if not os.path.lexists(path := Path(f"{folder}-{i}")))
            new.rename(place)
            reason = f"holds {foreign[0]}, which would be deleted; nothing was changed; the new folder is {place}"
            raise FileExistsError(errno.EEXIST, reason, str(folder))
        new.rename(folder)
        shutil.rmtree(old, ignore_errors=True)
    finally:
        shutil.rmtree(new, ignore_errors=True)


def write_file(path: Path, content: bytes) -> None:
    """Write a file whole, or leave what was there."""
    new = temporary_beside(path)
    try:
        new.write_bytes(content)
        if path.exists():
            new.chmod(stat.S_IMODE(path.stat().st_mode))
        new.replace(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise OSError(error.errno, f"{reason}; nothing was changed", str(path)) from error
    finally:
        new.unlink(missing_ok=True)


def forget(parts: Path) -> None:
    """Remove the parts of a result that a store kept, and its folder if nothing else lies in it."""
    for file in parts.glob("*.nc"):
        file.unlink()
    if parts.is_dir() and not any(parts.iterdir()):
        parts.rmdir()
