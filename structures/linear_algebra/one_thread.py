"""Linear algebra by one thread, where matrices are too small to share."""

import sys
from contextlib import ContextDecorator
from threading import Lock
from typing import Any

import threadpoolctl


def _take_control() -> None:
    """Let this thread set the limit: newer threadpoolctl ignores the limits of all but the thread that set it first."""
    clear = getattr(getattr(threadpoolctl, "OpenBLASController", None), "clear_controlling_thread", None)
    if clear is not None:
        clear(force=True)


class _OneThread(ContextDecorator):
    """Dense linear algebra (BLAS) of this process takes one thread within the block, or within a decorated function.

    Beside other work threads wait for each other, and a reduction takes several times as long. Blocks of several
    threads may overlap: the setting before the first returns after the last.
    """

    def __init__(self) -> None:
        self._lock, self._inside = Lock(), 0
        self._limit: Any = None
        self._libraries: tuple[int, Any] = 0, None

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                _take_control()
                # To look for libraries takes longer than a small run; they come with modules.
                if (modules := len(sys.modules)) != self._libraries[0]:
                    self._libraries = modules, threadpoolctl.ThreadpoolController()
                self._limit = self._libraries[1].limit(limits=1, user_api="blas")
            self._inside += 1

    def __exit__(self, *_: Any) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0 and self._limit is not None:
                _take_control()
                self._limit.restore_original_limits()
                _take_control()


one_thread = _OneThread()
