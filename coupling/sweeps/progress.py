"""Progress of sweeps with an estimate of the remaining time: a bar on a terminal and in a notebook, otherwise a line
in the log now and then.
"""

import logging
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import AbstractContextManager, contextmanager
from types import TracebackType
from typing import Any, TypeVar

import numpy as np
from tqdm.auto import tqdm

from coupling.sweeps.points import Stopped as Stopped
from structures.checks import count_of

LOG_INTERVAL = 10.0
"""Shortest time between two lines of the log, s."""

FORMAT = "{desc} |{bar}| {elapsed}"
"""Of a bar: the text of the log, and what of the line is left."""

FEWEST = 3
"""Points after the first one from which a remaining time is estimated."""

Item = TypeVar("Item")

log = logging.getLogger("hertzlink.sweep")

_shared: list["Progress"] = []
"""The progress that all others join, while `one_bar` lasts."""

_labels: list[str] = []
"""What labels of progress say in addition, while `labelled` lasts."""

_silent: list[bool] = []
"""Not empty while `silent` lasts."""


class Progress:
    """Counts the points of a sweep. Points from earlier runs (`done`) count, but do not enter the estimate of the
    speed, nor does the first one, which loads or compiles code. Within `one_bar` all points count there.

    label: what is done; within `labelled` with more words. likely: whether the total is only that; then the points
    are runs of one task by itself, in stages. clock: returns the time, s. unit: what is counted.
    """

    def __init__(
        self,
        total: int,
        done: int = 0,
        failed: int = 0,
        clock: Callable[[], float] = time.monotonic,
        label: str = "sweep",
        likely: bool = False,
        unit: str = "point",
    ) -> None:
        self.total, self.done, self.failed, self._before, self._clock = total, done, failed, done, clock
        self._begin = clock()
        self._told = float("inf") if _silent else self._begin
        self._first = float("nan")
        self._whole = _shared[-1] if _shared and not likely else None
        self._unit = unit
        self._label, self._likely, self._stage = ", ".join([label, *_labels]), likely, ""
        if self._whole:
            self._whole._joined(total, done)
        else:
            self._bar = _bar(self._label, total, done)

    def __enter__(self) -> "Progress":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._whole:
            self._bar.close()

    def advance(self, failed: bool = False) -> None:
        """Count one more point."""
        self.done += 1
        self.failed += failed
        if self._whole:
            self._whole.advance(failed)
            return
        if self.done > self.total:
            self._bar.total = self.done
            self.total = self.total if self._likely else self.done
        now = self._clock()
        if np.isnan(self._first):
            self._first = now
        self._bar.set_description_str(self.text(), refresh=False)
        self._bar.update()
        if self._bar.disable and now - self._told >= LOG_INTERVAL:
            self._told = now
            log.info(self.text())

    def stage(self, name: str) -> None:
        """Say what the next runs are for."""
        self._stage = name
        self._bar.set_description_str(self.text())

    def text(self) -> str:
        """Return how far it is, and about how long it takes where that is known."""
        left = self.left()
        failed = f", {self.failed} failed" if self.failed else ""
        about = "" if np.isnan(left) else f", about {tqdm.format_interval(left)} left"
        if self._likely:
            of = f" of about {self.total}" if self.done < self.total else ""
            return f"{self._label}: {self._stage} {self.done}{of} runs{failed}{about}"
        return f"{self._label}: {self.done} of {count_of(self.total, self._unit)}{failed}{about}"

    def left(self) -> float:
        """Estimate of the remaining time, s; NaN until points come steadily, and at the end.

        Processes begin together, each with its first point, so that points count once as long again has passed.
        """
        later = self.done - self._before - 1
        spent = self._clock() - self._first
        if later < FEWEST or self.done >= self.total or not spent >= self._first - self._begin:
            return float("nan")
        return spent * (self.total - self.done) / later

    def _joined(self, total: int, done: int) -> None:
        """Another sweep counts here: more points than were expected make the total larger."""
        if self.done + total > self.total:
            self.total = self._bar.total = self.done + total
        self.done += done
        self._before += done
        self._bar.update(done)


@contextmanager
def _within(those: list[Item], entry: Item) -> Iterator[None]:
    """Hold an entry among those that last as long as a context."""
    those.append(entry)
    try:
        yield
    finally:
        those.remove(entry)


@contextmanager
def one_bar(label: str, expected: int) -> Iterator[None]:
    """Count all sweeps within on one labelled bar of about `expected` points."""
    with Progress(expected, label=label) as progress, _within(_shared, progress):
        yield


def labelled(words: str) -> AbstractContextManager[None]:
    """All progress within says these words, too."""
    return _within(_labels, words)


def silent() -> AbstractContextManager[None]:
    """No progress within is shown, as that of a part of what is counted already."""
    return _within(_silent, True)


def watched(items: Iterable[Item], total: int | None = None) -> Iterator[Item]:
    """Yield items, each of which counts once the next one is asked for. total: their number, where they have no len."""
    with Progress(len(items) if isinstance(items, Sized) else total or 0) as progress:
        for item in items:
            yield item
            progress.advance()


def _bar(label: str, total: int, done: int) -> Any:
    """Return a bar of tqdm, which shows on a terminal and in a notebook; a notebook's output is no terminal."""
    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell is not None else None
    elsewhere = running is None or "IPKernelApp" not in running.config
    disable = True if _silent else None if elsewhere else False
    return tqdm(total=total, initial=done, leave=False, desc=label, bar_format=FORMAT, disable=disable)
