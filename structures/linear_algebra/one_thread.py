"""Linear algebra by one thread, where matrices are too small to share."""

import sys
from collections.abc import Callable
from functools import wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

import threadpoolctl

Given = ParamSpec("Given")
Result = TypeVar("Result")


def _take_control() -> None:
    """Let this thread set the limit, or any later one.

    Newer threadpoolctl passes OpenBLAS the limits of one Python thread alone, and ignores those of others without a
    word: reductions in a thread took several threads of linear algebra, and gave other last bits.
    """
    clear = getattr(getattr(threadpoolctl, "OpenBLASController", None), "clear_controlling_thread", None)
    if clear is not None:
        clear(force=True)


class _OneThread:
    """Dense linear algebra (BLAS) of this process takes one thread within the block, or within the function below.

    Threads gain nothing for matrices of some hundred rows. Beside other work they wait for each other, and a reduction
    takes several times as long (benchmarks/factorisation.py). Blocks of several threads may overlap: the setting before
    the first returns after the last.
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

    def __call__(self, function: Callable[Given, Result]) -> Callable[Given, Result]:
        # contextlib.ContextDecorator would do; but warnings would name its line, where they skip this module's.
        @wraps(function)
        def inside(*args: Given.args, **kwargs: Given.kwargs) -> Result:
            with self:
                return function(*args, **kwargs)

        return inside


one_thread = _OneThread()
