"""Compilation of kernels by Numba, which caches the compiled entry points in files.

Numba watches only the file of a cached function. After an edit of a function that it calls, the old code would still
run. So only entry points are cached, in a folder named by a checksum of all kernels. A kernel that calls a user's piece
is not cached.
"""

import atexit
import gc
import logging
import os
import pickle
import shutil
import tempfile
from collections.abc import Callable
from functools import cache, wraps
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.extending import register_jitable

log = logging.getLogger("hertzlink.kernels")

ROOMS = "structures", "plates", "particles", "coupling"

if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
    raise ImportError("hertzlink's kernels must be compiled, but NUMBA_DISABLE_JIT forbids it: unset it")


def folder_of_kernels() -> Path:
    """Return a folder for kernels of these sources, in NUMBA_CACHE_DIR or else in the user's cache.

    It is a temporary folder if that one cannot be written.
    """
    root, digest = Path(__file__).parents[2], sha256(f"{numba.__version__} {np.__version__}".encode())
    for source in sorted(source for room in ROOMS for source in root.glob(f"{room}/kernels/*.py")):
        digest.update(source.read_bytes())
    name = f"kernels-{digest.hexdigest()[:16]}"
    try:
        # Not numba.config.CACHE_DIR: a file of settings in the current folder can set it, and kernels are unpickled.
        users = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache", "hertzlink")
        folder = Path(os.environ.get("NUMBA_CACHE_DIR") or users.expanduser()).absolute() / name
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder is known
        place = tempfile.mkdtemp(prefix="hertzlink-")
        atexit.register(shutil.rmtree, place, ignore_errors=True)
        log.warning("compiled kernels cannot be cached (%s), so each run compiles them: set NUMBA_CACHE_DIR", error)
        os.environ["NUMBA_CACHE_DIR"] = place  # for processes that this one starts
        return Path(place, name)
    return folder


FOLDER = folder_of_kernels()

EMPTY = not any(FOLDER.rglob("*.nbi"))

# Kernels make no arrays, so they need no reference counts, with which the loop on a plate takes 3.4 times as long
OPTIONS: Any = {"error_model": "numpy", "_nrt": False}


def inner(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator for functions that kernels call. If Python calls them, they run uncompiled."""
    return register_jitable(**OPTIONS, **options)  # type: ignore[no-any-return]


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that Python calls; use it as a decorator."""
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(FOLDER)  # type: ignore[attr-defined]
    cached = numba.njit(cache=True, nogil=True, **OPTIONS)(function)
    numba.config.CACHE_DIR = before  # type: ignore[attr-defined]
    not_cached = numba.njit(nogil=True, **OPTIONS)(function)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        nonlocal cached
        if any(map(has_own_piece, arguments)):
            say("compiling kernels for pieces that are not hertzlink's: up to a minute at each start")
            return not_cached(*arguments)
        announce()
        collects = gc.isenabled()
        gc.disable()  # saves a tenth of the time of compilation
        try:
            return cached(*arguments)
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            say(f"kernels in {FOLDER} cannot be read or written ({error}) and are compiled anew: delete that folder")
            cached = not_cached
            return cached(*arguments)
        finally:
            if collects:
                gc.enable()

    return call


def announce() -> None:
    """Log, once, that kernels are compiled, if none is cached."""
    if EMPTY:
        say("compiling kernels that this machine has not compiled yet: up to a minute, once")


@cache
def say(line: str) -> None:
    """Log a line once."""
    log.warning("%s", line)


def has_own_piece(value: Any) -> bool:
    """Return whether an argument contains a piece that is not hertzlink's."""
    if not isinstance(value, tuple):
        return False
    room, _, place = type(value).__module__.partition(".")
    is_ours = room == "builtins" or (room in ROOMS and place.startswith("kernels."))
    return not is_ours or any(map(has_own_piece, value))
