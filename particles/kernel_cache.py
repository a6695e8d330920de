"""The cache of compiled kernels: a folder where Numba finds none, and a line that says when kernels are compiled.

Numba finds no folder in a read-only installation of a user without a home folder.
"""

import atexit
import logging
import shutil
from contextlib import suppress
from tempfile import mkdtemp
from typing import Any

import numba
from numba.core import event
from numba.core.caching import FunctionCache

log = logging.getLogger("hertzlink.kernels")


def provide() -> None:
    """Make sure that Numba can cache kernels.

    Numba refuses to define a cached function where it can write neither next to the source, nor into the user's cache,
    nor into NUMBA_CACHE_DIR. A private folder takes their place until the process ends. It must not be shared: Numba
    runs what it finds there.
    """
    try:
        FunctionCache(provide)  # type: ignore[no-untyped-call]
    except RuntimeError:
        folder = mkdtemp(prefix="hertzlink-kernels-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        numba.config.CACHE_DIR = folder  # type: ignore[attr-defined]
        log.warning(
            "No folder for compiled kernels can be written, so each process compiles them anew (about half a minute); "
            "set NUMBA_CACHE_DIR to a folder of your own"
        )


COMPILING = "compiling kernels that this machine has not compiled yet: up to a minute, once"


class Announcement(event.Listener):  # type: ignore[misc]
    """Says once that kernels are compiled, which takes long. A kernel from the cache is not compiled."""

    def on_start(self, event: Any) -> None:
        """Numba begins to compile."""
        kernel = event.data["dispatcher"].py_func
        if kernel.__module__.partition(".")[0] in ("particles", "structures", "coupling", "plates"):
            stop()
            log.warning(COMPILING)

    def on_end(self, event: Any) -> None:
        """Numba has compiled."""


_announcement = Announcement()


def announce() -> None:
    """Say when the first kernel of this process is compiled."""
    event.register("numba:compile", _announcement)  # type: ignore[no-untyped-call]


def stop() -> None:
    """Say no more, if not yet so."""
    with suppress(ValueError):
        event.unregister("numba:compile", _announcement)  # type: ignore[no-untyped-call]
