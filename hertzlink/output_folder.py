"""The folder that a command writes: checked before the work, replaced only where it holds unchanged results."""

import hashlib
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from coupling.files.writing import check_place, whole_folder

LISTING = "files.txt"
"""The file that lists all others in a folder of results with their SHA-256, as the program sha256sum does.

Only a folder that holds nothing but these files, unchanged, may be replaced.
"""

LISTED = re.compile(r"([0-9a-f]{64})  (.+)")
"""A line of the listing."""


def check_output(folder: Path, force: bool) -> None:
    """Raise a ValueError if the folder cannot be written, before any computation.

    With --force only a folder that holds the listed files of an earlier study, unchanged, and no others, is replaced.
    """
    try:
        with suppress(FileNotFoundError, NotADirectoryError):
            folder.stat()  # fails on a link that leads to itself, which newer Pythons resolve without an error
        path = folder.resolve()
        _check_place(folder, path, force)
        check_place(path)
    except OSError as error:
        raise ValueError(
            f"--output {folder}: cannot be written ({error.strerror or error}); give another folder"
        ) from error


def _check_place(folder: Path, full_path: Path, force: bool) -> None:
    """Raise a ValueError if the folder, whose `full_path` is resolved, holds something else or has no parent."""
    if full_path.exists() and not full_path.is_dir():
        raise ValueError(f"--output {folder}: is a file; give a folder")
    if full_path == Path.cwd() or full_path in Path.cwd().parents:
        raise ValueError(f"--output {folder}: contains the current folder; give another one")
    if full_path.exists() and not force:
        raise ValueError(f"--output {folder}: exists already; give another folder, or use --force to replace it")
    if full_path.exists():
        is_ours = _own_files(full_path)
        foreign = sorted(path.name for path in full_path.iterdir() if not is_ours(path))
        if foreign or not (full_path / LISTING).is_file():
            raise ValueError(
                f"--output {folder}: contains {', '.join(foreign[:1]) or 'nothing'}, which no earlier command wrote, "
                "or which was changed since; move it away, or give another folder"
            )
    if not full_path.parent.is_dir():
        raise ValueError(f"--output {folder}: its parent folder does not exist")


def _own_files(folder: Path) -> Callable[[Path], bool]:
    """Return whether an earlier study wrote a file of the folder, and nobody changed it since."""
    sums: dict[str, str] = {}
    if (folder / LISTING).is_file() and not (folder / LISTING).is_symlink():
        lines = (folder / LISTING).read_text(encoding="utf-8", errors="replace").splitlines()
        matches = [LISTED.fullmatch(line) for line in lines]
        if lines and all(matches):
            sums = {match[2]: match[1] for match in matches if match}

    def own(path: Path) -> bool:
        if path.is_symlink() or not path.is_file() or not sums:
            return False
        return path.name == LISTING or _sum_of(path) == sums.get(path.name)

    return own


def _sum_of(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_folder(folder: Path, write: Callable[[Path], None], force: bool) -> None:
    """Write all files into a temporary folder, then rename it. The folder thus appears complete, or not at all.

    The folder was checked before the work. Where something has come to lie there since, it gets another name: an
    OSError says so.
    """
    folder = folder.resolve()
    with whole_folder(folder, _own_files(folder) if force else lambda path: False) as temporary:
        write(temporary)
        lines = [f"{_sum_of(path)}  {path.name}\n" for path in sorted(temporary.iterdir())]
        (temporary / LISTING).write_text("".join(lines), encoding="utf-8")


def forget(parts: Path) -> None:
    """Remove the parts of a result that a store kept, and its folder if nothing else lies in it."""
    for file in [*parts.glob("*.point"), *parts.glob(".*.lock")]:
        file.unlink()
    if parts.is_dir() and not any(parts.iterdir()):
        parts.rmdir()
