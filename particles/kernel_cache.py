"""A folder for compiled kernels where Numba finds none: a read-only installation, and a user without a home folder."""

import atexit
import logging
import shutil
from tempfile import mkdtemp

import numba
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
