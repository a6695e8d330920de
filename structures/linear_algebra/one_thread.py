"""Linear algebra on one thread, for matrices that are too small to share."""

import sys
from contextlib import ContextDecorator
from threading import Lock
from typing import Any

import threadpoolctl


def _take_control() -> None:
    """Let this thread set the limit: newer threadpoolctl obeys only the thread that set a limit first."""
    clear = getattr(getattr(threadpoolctl, "OpenBLASController", None), "clear_controlling_thread", None)
    if clear is not None:
        clear(force=True)


class _OneThread(ContextDecorator):
    """Dense linear algebra (BLAS) of this process uses one thread in a block or in a decorated function.

    On a busy machine BLAS threads wait for each other, and a reduction takes several times as long. Blocks of several
    threads may overlap: the last one to end restores the setting before the first.
    """

    def __init__(self) -> None:
        self._lock, self._inside = Lock(), 0
        self._limit: Any = None
        self._libraries: tuple[int, Any] = 0, None

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                _take_control()
                # A search for libraries takes longer than a small run. Only new modules can load new libraries.
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
