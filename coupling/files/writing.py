"""Files and folders that appear whole: written under an unpredictable name next to their place, synced, renamed."""

import ctypes
import errno
import os
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from secrets import token_hex
from typing import BinaryIO

from coupling.files.locks import NO_LINK, try_lock

PART = ".part"
"""Ending of what is not complete; its name begins with a dot."""

LONGEST_NAME = 200
"""Bytes of a name to which a random part can be added: file systems allow 255."""

LEFT_OVER_AGE = 3600.0
"""What is incomplete and older than this, s, belongs to a process that was killed."""

MOMENT = 10.0
"""Seconds in which a process that has made an incomplete file has locked it."""

IN_THE_WAY = errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR
"""Errors where something else has come to lie at a target."""

NEW_FILE = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
"""Flags of os.open: a file that did not exist, never one behind a link that lies there."""

AT_FDCWD, RENAME_EXCHANGE = -100, 2
"""Arguments of Linux's renameat2: paths from the current folder on; both names are exchanged."""


@contextmanager
def whole_file(target: Path) -> Iterator[BinaryIO]:
    """Open a new file to write, which replaces the target at the end; after any error the target is as it was.

    It keeps the rights of the file that it replaces. Raises OSError that names the target and the cause.
    """
    with _naming(target):
        part = _part(target)
        try:
            with os.fdopen(os.open(part, NEW_FILE, 0o666), "w+b") as file:
                with suppress(OSError):
                    try_lock(file.fileno())
                _keep_rights(target, file.fileno())
                yield file
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, target)
        finally:
            part.unlink(missing_ok=True)
        sync_folder(target.parent)


def write_whole(target: Path, content: bytes) -> None:
    """Replace the target by a file with this content, or leave it as it was."""
    with whole_file(target) as file:
        file.write(content)


@contextmanager
def whole_file_by_name(target: Path) -> Iterator[Path]:
    """Offer a path to a library that writes by name; the file then replaces the target.

    It lies in a folder that only this user can enter, so nobody can put a link in its place.
    """
    remove_left(target)
    with _naming(target):
        folder = Path(tempfile.mkdtemp(prefix=f".{_stem(target)}.", suffix=PART, dir=target.parent))
        try:
            path = folder / target.name
            with _held(folder):
                yield path
                _sync(path)
                os.replace(path, target)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        sync_folder(target.parent)


@contextmanager
def whole_folder(target: Path, is_ours: Callable[[Path], bool]) -> Iterator[Path]:
    """Open a new folder to fill, which replaces the target at the end; after any error the target is as it was.

    is_ours: whether a path in the folder that is replaced may be deleted. If another is there at the end, or another
    target, the new folder gets another name. Raises OSError that names the target, the cause, and that name.
    It has the rights of the folder that it replaces.
    """
    remove_left(target)
    with _naming(target):
        folder = _part(target)
        os.mkdir(folder)
    complete = replaced = False
    try:
        with _naming(target), _held(folder):
            rights = stat.S_IMODE((target if target.is_dir() else folder).stat().st_mode)
            folder.chmod(stat.S_IRWXU)
            yield folder
            for path in folder.iterdir():
                _sync(path)
            sync_folder(folder)
            folder.chmod(rights)
            complete = True
            if target.exists():
                foreign = sorted(path.name for path in target.iterdir() if not is_ours(path))
                if foreign:
                    raise FileExistsError(errno.EEXIST, f"holds {foreign[0]}, which would be deleted")
                exchange(folder, target)
                replaced = True
            else:
                os.rename(folder, target)
            sync_folder(target.parent)
    except OSError as error:
        if complete and error.errno in IN_THE_WAY and (place := _put_aside(folder, target)):
            reason = f"{error.strerror}; the new folder is {place}"
            raise OSError(error.errno, reason, str(target)) from error
        raise
    finally:
        # What the folder holds now: what was replaced, or after an error what was written.
        _remove(folder, is_ours if replaced else lambda path: True)


def check_place(target: Path) -> None:
    """Raise an OSError where no folder can be made next to a target: only a trial shows it. Nothing stays."""
    remove_left(target)
    folder = _part(target)
    os.mkdir(folder)
    os.rmdir(folder)


def remove_left(target: Path, age: float = LEFT_OVER_AGE) -> None:
    """Delete what killed processes left of a target; where locks do not show that, what is older than `age` s."""
    pattern = re.compile(rf"\.{re.escape(_stem(target))}\.\w+{re.escape(PART)}")
    with suppress(OSError):
        for entry in os.scandir(target.parent):
            if pattern.fullmatch(entry.name):
                remove_if_old(Path(entry.path), age)


def remove_if_old(path: Path, age: float = LEFT_OVER_AGE) -> None:
    """Delete an incomplete file or folder that no process writes; where locks do not show that, one older than `age` s.

    age zero: delete it in any case.
    """
    with suppress(OSError):
        if age > 0.0:
            deserted = _deserted(path)
            limit = min(age, MOMENT) if deserted else age
            if deserted is False or time.time() - path.lstat().st_mtime < limit:
                return
        if stat.S_ISDIR(path.lstat().st_mode):
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def read_regular(path: Path) -> bytes:
    """Return the content of a file that lies there itself: not behind a link, no device, no pipe. Raises OSError."""
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    with os.fdopen(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "is no file", str(path))
        return file.read()


def sync_folder(folder: Path) -> None:
    """Make new names survive a loss of power, on systems that can open a folder."""
    if hasattr(os, "O_DIRECTORY"):
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def exchange(first: Path, second: Path) -> None:
    """Exchange the names of two folders: in one step on Linux. Elsewhere `second` has no name for a moment."""
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError, TypeError):
        rename = None
    if rename is not None:
        if rename(AT_FDCWD, os.fsencode(first), AT_FDCWD, os.fsencode(second), RENAME_EXCHANGE) == 0:
            return
        if ctypes.get_errno() not in (errno.ENOSYS, errno.EINVAL):
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), str(second))
    aside = _part(second)
    os.rename(second, aside)
    os.rename(first, second)
    os.rename(aside, first)


def _stem(target: Path) -> str:
    """Return what the temporary names of a target have in common."""
    name = os.fsencode(target.name)
    return target.name if len(name) <= LONGEST_NAME else sha256(name).hexdigest()[:32]


def _part(target: Path) -> Path:
    return target.with_name(f".{_stem(target)}.{token_hex(8)}{PART}")


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    """Show other processes that the folder is being written."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY) if hasattr(os, "O_DIRECTORY") else None
    try:
        if handle is not None:
            with suppress(OSError):
                try_lock(handle)
        yield
    finally:
        if handle is not None:
            os.close(handle)


def _deserted(part: Path) -> bool | None:
    """Return whether the process that made an incomplete file or folder has ended; None where locks do not show it."""
    try:
        handle = os.open(part, os.O_RDONLY | NO_LINK)
    except OSError:
        return None
    try:
        return try_lock(handle)
    except OSError:
        return None
    finally:
        os.close(handle)


def _put_aside(folder: Path, target: Path) -> Path | None:
    """Give a complete folder the first free name like that of the target; return it, None where it can get none."""
    for number in range(2, 1000):
        place = target.with_name(f"{_stem(target)}-{number}")
        if not os.path.lexists(place):
            with suppress(OSError):
                os.rename(folder, place)
                return place
    return None


def _keep_rights(target: Path, handle: int) -> None:
    """Keep a file unreadable to others that replaces one which they cannot read."""
    with suppress(FileNotFoundError, NotADirectoryError):
        if hasattr(os, "fchmod"):
            os.fchmod(handle, stat.S_IMODE(target.stat().st_mode))


def _sync(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _remove(folder: Path, is_ours: Callable[[Path], bool]) -> None:
    """Delete files one by one; a folder that holds anything else stays."""
    with suppress(OSError):
        for path in folder.iterdir():
            if is_ours(path):
                path.unlink(missing_ok=True)
        folder.rmdir()


@contextmanager
def _naming(target: Path) -> Iterator[None]:
    """Let an OSError name the target, not the temporary file, and say that the target is unharmed."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        reason = error.strerror or os.strerror(error.errno)
        raise OSError(error.errno, f"{reason}; nothing was changed", str(target)) from error
