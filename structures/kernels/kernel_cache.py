"""The cache of compiled kernels: what is damaged there is compiled anew, and where it cannot be kept, the run goes on.

Numba ends with an error where a file of its cache is empty or cut, where the disk is full, and where it has no folder,
as in a read-only installation of a user without a home folder. A line says when kernels are compiled.
"""

import atexit
import gc
import logging
import os
import shutil
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

try:
    with warnings.catch_warnings():
        # Of a value that Numba does not understand it warns, with a traceback, and goes on without.
        warnings.filterwarnings("error", "Environment variable", RuntimeWarning)
        import numba
        from numba.core import event
        from numba.core.caching import FunctionCache, IndexDataCacheFile
        from numba.core.compiler_lock import global_compiler_lock
        from numba.core.registry import CPUDispatcher
except (ValueError, RuntimeWarning) as error:
    switches = ", ".join(f"{name}={value}" for name, value in os.environ.items() if name.startswith("NUMBA_"))
    reason = str(error).partition("\n")[0]
    raise ImportError(f"Numba does not start with {switches or 'this environment'} ({reason}); unset it") from error

from structures.kernels.kernel_key import OURS, key_of
from structures.kernels.kernel_linking import link_kernels

log = logging.getLogger("hertzlink.kernels")

link_kernels()

SUM = 32
"""Bytes of the checksums at the end of each file: of the sources, and of all that comes before."""


def provide() -> None:
    """Make sure that Numba can cache kernels.

    Numba refuses to define a cached function where it can write neither next to the source, nor into the user's cache,
    nor into NUMBA_CACHE_DIR.
    """
    try:
        FunctionCache(provide)
    except RuntimeError:
        private_folder("No folder for compiled kernels can be written")


_private = list[str]()
"""The folder of this process, once it has one."""


def private_folder(reason: str) -> str:
    """Return a folder for kernels that lasts as long as this process, also for processes that it starts; says why,
    once.

    It must not be shared with other users: Numba runs what it finds there.
    """
    if _private:
        return _private[0]
    folder = mkdtemp(prefix="hertzlink-kernels-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = folder
    numba.config.CACHE_DIR = folder  # type: ignore[attr-defined]
    log.warning(
        "%s, so each run compiles them anew (up to a minute); set NUMBA_CACHE_DIR to a folder of your own with room",
        reason,
    )
    _private.append(folder)
    return folder


@cache
def _say_once(message: str) -> None:
    log.warning("%s", message)


class CheckedFile(IndexDataCacheFile):  # type: ignore[misc]
    """The files of one kernel, each with a checksum at its end: what is cut or changed counts as not there."""

    def load(self, key: Any) -> Any:
        """Return what was kept under a key, or None. Two processes that begin at once may give two keys one name."""
        if (types := key_of(key[0])) is None:
            return None
        key = types, *key[1:]
        stored = super().load(key)
        return stored[1] if stored is not None and stored[0] == key else None

    def save(self, key: Any, data: Any) -> None:
        """Keep data under a key, in the private folder where this one is full; else go on without."""
        if (types := key_of(key[0])) is None:
            return
        key = types, *key[1:]
        try:
            super().save(key, (key, data))
        except OSError as error:
            reason = f"Compiled kernels cannot be kept in {self._cache_path} ({error.strerror})"
            with suppress(OSError):
                self._move(private_folder(reason))
                super().save(key, (key, data))

    def _move(self, folder: str) -> None:
        name = Path(self._index_path).name
        self._cache_path, self._index_path = folder, str(Path(folder, name))

    def _load_index(self) -> Any:
        return super()._load_index() if self._is_whole(self._index_path) else {}

    def _load_data(self, name: str) -> Any:
        if not self._is_whole(self._data_path(name)):
            raise FileNotFoundError(name)  # which Numba takes for a file that was deleted, and compiles
        return super()._load_data(name)

    def _is_whole(self, path: str) -> bool:
        try:
            content = Path(path).read_bytes()
        except FileNotFoundError:
            return False
        except OSError as error:
            _say_once(f"The kernel cache in {self._cache_path} cannot be read ({error.strerror}); kernels are compiled")
            return False
        complete = len(content) > 2 * SUM and sha256(content[:-SUM]).digest() == content[-SUM:]
        if not complete:
            _say_once(f"The kernel cache in {self._cache_path} is damaged; what is damaged is compiled anew")
        # Of other sources: their types may not even exist any more.
        return complete and content[-2 * SUM : -SUM] == self._stamp

    @contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[BytesIO]:
        content = BytesIO()
        yield content
        stamped = content.getvalue() + self._stamp
        with super()._open_for_write(filepath) as file:
            file.write(stamped + sha256(stamped).digest())

    @property
    def _stamp(self) -> bytes:
        return bytes.fromhex(self._source_stamp)


@cache
def stamp(file: str) -> str:
    """Return a checksum of the sources on which the kernels of a file depend: all folders `kernels`, and the file.

    Numba itself looks at the file of the kernel only, and would not notice that one changed which it calls.
    """
    root, digest = Path(__file__).parents[2], sha256(numba.__version__.encode())
    sources = sorted(path for room in OURS for path in root.glob(f"{room}/kernels/*.py"))
    for source in (*sources, Path(file)):
        digest.update(source.read_bytes())
    return digest.hexdigest()


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """A kernel that is compiled without Python's collection of garbage, which takes a tenth of the time."""

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, or read that from the cache."""
        with global_compiler_lock:
            collects = gc.isenabled()
            gc.disable()
            try:
                return super().compile(sig)
            finally:
                if collects:
                    gc.enable()


def njit(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return Numba's decorator, whose kernels are kept in files with a checksum."""

    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        raise ImportError("hertzlink's kernels must be compiled, and NUMBA_DISABLE_JIT forbids it: unset it")

    def compiled(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(**options)(function)
        file = kernel._cache._cache_file
        # Another name than Numba's own, whose files have no checksum; and one for kernels that Python may call: one
        # without the code that takes arguments from Python would end the process.
        kind = "inner" if options.get("no_cpython_wrapper") else "entry"
        name = f"{file._index_name.removesuffix('.nbi')}.{kind}.checked"
        kernel._cache._cache_file = CheckedFile(file._cache_path, name, stamp(function.__code__.co_filename))
        kernel.__class__ = Kernel
        return kernel

    return compiled


class Inner(Kernel):
    """A kernel that takes no arguments from Python: called from there, it runs uncompiled."""

    def __call__(self, *arguments: Any) -> Any:
        """Run the function in Python; the compiled one would end the process."""
        return self.py_func(*arguments)


def inner(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return Numba's decorator for a kernel that other kernels call; tests call it from Python, where it is slow.

    It allocates no memory and counts no references, so that small functions cost nothing; and it is compiled without
    the code that takes arguments from Python, which for groups of arrays is longer than the kernel.
    """
    compiled = njit(cache=True, _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options)

    def decorate(function: Callable[..., Any]) -> Any:
        kernel = compiled(function)
        kernel.__class__ = Inner
        return kernel

    return decorate


def entry(function: Callable[..., Any]) -> Any:
    """Return Numba's decorator for a kernel that Python calls, around one that kernels call, compiled once."""
    return njit(cache=True, _nrt=False, nogil=True, no_cfunc_wrapper=True)(function)


COMPILING = "compiling kernels that this machine has not compiled yet: up to a minute, once"

NOT_STORED = (
    "compiling kernels of a piece in a script or notebook, up to a minute at each start; define it in a module that "
    "you import"
)


class Announcement(event.Listener):  # type: ignore[misc]
    """Says once that kernels are compiled, which takes long. A kernel from the cache is not compiled."""

    def on_start(self, event: Any) -> None:
        """Numba begins to compile."""
        kernel = event.data["dispatcher"].py_func
        if str(kernel.__module__).partition(".")[0] in ("particles", "structures", "coupling", "plates"):
            stop()
            log.warning(COMPILING if key_of(event.data["args"]) else NOT_STORED)

    def on_end(self, event: Any) -> None:
        """Numba has compiled."""


_announcement = Announcement()


def announce() -> None:
    """Say when the first kernel of this process is compiled."""
    event.register("numba:compile", _announcement)


def stop() -> None:
    """Say no more, if not yet so."""
    with suppress(ValueError):
        event.unregister("numba:compile", _announcement)
