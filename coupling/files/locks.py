"""Locks between processes, also on machines that share a folder. They end with their process, also by kill -9."""

import os
import socket
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

INTERVAL = 0.1
"""Seconds between two looks at a lock that another process holds."""

FOREVER = 1e9
"""Seconds that are waited for a lock."""

LONGEST_OWNER = 300
"""Bytes of a lock file that are read: the process and its host."""


class Lock:
    """A lock file that says who holds it. It is deleted when it is released.

    The operating system holds the lock, not the file: a file that a killed process left does no harm.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = FileLock(path, thread_local=False, poll_interval=INTERVAL)

    def take(self, wait: bool = False) -> bool:
        """Take the lock, or report that another process has it. Raises OSError where no file can be made."""
        # filelock takes a folder that cannot be written for a lock that another process holds.
        os.close(os.open(self.path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666))
        try:
            self._lock.acquire(timeout=FOREVER if wait else 0.0)
        except Timeout:
            return False
        with suppress(OSError):
            handle = os.open(self.path, os.O_WRONLY | os.O_TRUNC | getattr(os, "O_NOFOLLOW", 0))
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(f"process {os.getpid()} on {socket.gethostname()}")
        return True

    def owner(self) -> str:
        """Who holds the lock, in words."""
        text = ""
        with suppress(OSError):
            handle = os.open(self.path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
            with os.fdopen(handle, "rb") as file:
                text = file.read(LONGEST_OWNER).decode("utf-8", "replace")
        return text if text.isprintable() and text else "another process"

    def release(self) -> None:
        """Release the lock, and delete its file while it is still held: who waits for it takes a new one."""
        with suppress(OSError):
            self.path.unlink()
        self._lock.release()
