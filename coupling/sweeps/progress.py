"""Progress of a sweep with an estimate of the remaining time: a bar on a terminal, otherwise occasional lines in the
log.
"""

import logging
import time
from collections.abc import Callable
from types import TracebackType

from tqdm import tqdm

LOG_INTERVAL = 10.0
"""Shortest time between two lines of the log, s."""

log = logging.getLogger("hertzlink.sweep")


class Progress:
    """Counts the points of a sweep. Points from earlier runs (`done`) count, but do not enter the estimate of the
    speed.

    clock: returns the time, s.
    """

    def __init__(self, total: int, done: int = 0, failed: int = 0, clock: Callable[[], float] = time.monotonic) -> None:
        self.total, self.done, self.failed, self._before, self._clock = total, done, failed, done, clock
        self._begin = self._told = clock()
        self._bar = tqdm(total=total, initial=done, unit="run", disable=None, leave=False)

    def __enter__(self) -> "Progress":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.close()

    def advance(self, failed: bool = False) -> None:
        """Count one more point."""
        self.done += 1
        self.failed += failed
        self._bar.update()
        if self._bar.disable and self._clock() - self._told >= LOG_INTERVAL:
            self._told = self._clock()
            left = tqdm.format_interval(self.left())
            log.info("%d of %d points, %d failed, about %s left", self.done, self.total, self.failed, left)

    def left(self) -> float:
        """Estimate of the remaining time, s; NaN before the first point."""
        run = self.done - self._before
        return (self._clock() - self._begin) * (self.total - self.done) / run if run else float("nan")
