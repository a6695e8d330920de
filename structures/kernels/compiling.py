"""How kernels are compiled: by Numba, which keeps the compiled entry points in files.

Numba watches the file of a kept function alone; after an edit of a function that this one calls, the old one would
run. So entry points alone are kept, in a folder named by a checksum of all kernels, and none that calls a user's piece.
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
    raise ImportError("hertzlink's kernels must be compiled, and NUMBA_DISABLE_JIT forbids it: unset it")


def users_folder() -> Path:
    """Return where this user keeps compiled kernels: NUMBA_CACHE_DIR, or else a folder of the cache."""
    # Not numba.config.CACHE_DIR, which a file of settings in the current folder sets: kernels are unpickled.
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen).absolute()
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache", "hertzlink").expanduser()


def folder_of_kernels() -> Path:
    """Return a folder for kernels of these sources; where the user's cannot be written, one for this process."""
    root, digest = Path(__file__).parents[2], sha256(f"{numba.__version__} {np.__version__}".encode())
    for source in sorted(source for room in ROOMS for source in root.glob(f"{room}/kernels/*.py")):
        digest.update(source.read_bytes())
    name = f"kernels-{digest.hexdigest()[:16]}"
    try:
        folder = users_folder() / name
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except (OSError, RuntimeError) as error:  # RuntimeError: no home folder is known
        place = tempfile.mkdtemp(prefix="hertzlink-")
        atexit.register(shutil.rmtree, place, ignore_errors=True)
        log.warning("compiled kernels cannot be kept (%s): each run compiles them; set NUMBA_CACHE_DIR", error)
        os.environ["NUMBA_CACHE_DIR"] = place  # for processes that this one starts
        return Path(place, name)
    return folder


FOLDER = folder_of_kernels()

EMPTY = not any(FOLDER.rglob("*.nbi"))

# Kernels make no arrays, so they count no references: the loop on a plate would take 3.4 times as long
OPTIONS: Any = {"error_model": "numpy", "_nrt": False}


def inner(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator of functions that kernels call; called from Python, they run uncompiled."""
    return register_jitable(**OPTIONS, **options)  # type: ignore[no-any-return]


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function for Python, compiled; as a decorator."""
    before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(FOLDER)  # type: ignore[attr-defined]
    kept = numba.njit(cache=True, nogil=True, **OPTIONS)(function)
    numba.config.CACHE_DIR = before  # type: ignore[attr-defined]
    not_kept = numba.njit(nogil=True, **OPTIONS)(function)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        nonlocal kept
        if any(map(has_own_piece, arguments)):
            say("compiling kernels of pieces that are not hertzlink's: up to a minute at each start")
            return not_kept(*arguments)
        announce()
        collects = gc.isenabled()
        gc.disable()  # a tenth of the time in which kernels are compiled
        try:
            return kept(*arguments)
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            say(f"kernels in {FOLDER} cannot be read or written ({error}), so they are compiled; delete that folder")
            kept = not_kept
            return kept(*arguments)
        finally:
            if collects:
                gc.enable()

    return call


def announce() -> None:
    """Say, once, that kernels are compiled, where none is kept."""
    if EMPTY:
        say("compiling kernels that this machine has not compiled yet: up to a minute, once")


@cache
def say(line: str) -> None:
    """Log a line, once."""
    log.warning("%s", line)


def has_own_piece(value: Any) -> bool:
    """Return whether a piece that is not hertzlink's is in an argument."""
    return isinstance(value, tuple) and (not is_ours(type(value)) or any(map(has_own_piece, value)))


@cache
def is_ours(kind: type) -> bool:
    """Return whether a class of pieces is hertzlink's, or Python's."""
    room, _, place = kind.__module__.partition(".")
    return room == "builtins" or (room in ROOMS and place.startswith("kernels."))
