"""Locks between processes, also on machines that share a folder. They end with their process, also by kill -9."""

import os
import stat
import sys
import time
from contextlib import suppress
from pathlib import Path

INTERVAL = 0.1
"""Seconds between two looks at a lock that another process holds."""

NO_LINK = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0)
"""Flags of os.open: no link is followed, no pipe awaited, and no program that is started takes the handle along."""


class NoLocks(OSError):
    """A file system on which files cannot be locked."""


if sys.platform == "win32":
    import msvcrt

    def try_lock(handle: int) -> bool:
        """Lock an open file until it is closed; whether no other process had locked it. Raises OSError."""
        os.lseek(handle, 2**30, os.SEEK_SET)  # behind the text, which others must read
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        finally:
            os.lseek(handle, 0, os.SEEK_SET)
        return True
else:
    import fcntl

    def try_lock(handle: int) -> bool:
        """Lock an open file until it is closed; whether no other process had locked it. Raises NoLocks."""
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except (BlockingIOError, PermissionError):
            return False
        except OSError as error:
            reason = f"its file system cannot lock files ({error.strerror})"
            raise NoLocks(error.errno, reason) from error
        return True


class Lock:
    """A lock file. It is deleted when it is released.

    The operating system holds the lock, not the file: a file that a killed process left does no harm.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._handle = -1

    def take(self, wait: bool = False) -> bool:
        """Take the lock, or report that another process has it.

        Raises OSError where no file can be made, and NoLocks where files cannot be locked.
        """
        while True:
            handle = _opened(self.path)
            try:
                if not try_lock(handle):
                    if not wait:
                        return False
                    time.sleep(INTERVAL)
                elif _names(self.path, handle):
                    self._handle, handle = handle, -1
                    return True
            except NoLocks as error:
                raise NoLocks(error.errno, error.strerror, str(self.path.parent)) from None
            finally:
                if handle >= 0:
                    os.close(handle)

    def release(self) -> None:
        """Release the lock, and delete its file while it is still held: who waits for it takes a new one."""
        with suppress(OSError):
            self.path.unlink()
        handle, self._handle = self._handle, -1
        if handle >= 0:
            os.close(handle)

    def __del__(self) -> None:
        if self._handle >= 0:
            self.release()


def _opened(path: Path) -> int:
    """Return the lock file, made where there is none, for all who may write into its folder. Raises OSError."""
    while True:
        try:
            return os.open(path, os.O_RDWR | NO_LINK)
        except FileNotFoundError:
            with suppress(FileExistsError):
                handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | NO_LINK, 0o600)
                if hasattr(os, "fchmod"):
                    with suppress(OSError):
                        os.fchmod(handle, 0o600 | (stat.S_IMODE(path.parent.stat().st_mode) & 0o022) * 3)
                return handle
        except PermissionError:
            # Another user's, of an earlier version or from a folder that was his alone: it can be locked all the same.
            return os.open(path, os.O_RDONLY | NO_LINK)


def _names(path: Path, handle: int) -> bool:
    """Return whether the path still names the open file: who held it before may have deleted it."""
    with suppress(OSError):
        return os.path.samestat(path.lstat(), os.fstat(handle))
    return False
