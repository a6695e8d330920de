"""The work at each point of a sweep, and the processes of this machine that do it."""

import logging
import os
import pickle
import signal
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from multiprocessing import current_process, resource_tracker
from typing import Any, TypeVar

import joblib
import numpy as np
import xarray as xr
from joblib.externals.loky.backend import resource_tracker as tracker_of_loky
from joblib.externals.loky.backend.reduction import dumps
from joblib.externals.loky.process_executor import TerminatedWorkerError

from coupling.cosimulation import CoSimulation
from coupling.results.findings import findings_of, with_warnings
from coupling.results.schema import unit_of
from coupling.sweeps.store import Failure, Point, Store
from structures.caution import collected
from structures.checks import instance, short
from structures.kernels import compiling
from structures.units import readable

IDLE_TIME = 30
"""A process without work ends after this time, s."""

WATCH_INTERVAL = 0.5
"""Seconds between two looks of a process whether the one that started it still lives."""

ENVIRONMENT_ERRORS = (ImportError, MemoryError, OSError)
"""Errors that the point did not cause: a package is missing, memory or disk is full, a file or a connection is lost.
Later, or on another machine, the same point may well run.
"""

NOT_RECORDED = "this is a failure of the environment, so the point is not recorded as failed; run the sweep again"

BUSY = "busy"
"""In place of an outcome: another sweep is running the point."""

Outcome = xr.Dataset | Failure | str | None
"""A run, or why there is none; None for a run that its process has already written to the store; BUSY."""

Batch = Mapping[int, Point]
"""Points, by their place in the sweep, that one process runs one after the other."""

log = logging.getLogger("hertzlink.sweep")

Result = TypeVar("Result")


def shown(point: Point) -> str:
    """Return a point for messages, numbers with the units that their names imply: "thickness = 3 mm"."""
    return ", ".join(f"{name} = {_value(name, value)}" for name, value in point.items())


def _value(name: str, value: Any) -> str:
    if isinstance(value, float | int | np.number) and not isinstance(value, bool):
        return readable(float(value), unit_of(name), 6)
    return short(getattr(value, "name", value))


@dataclass(frozen=True)
class Work:
    """The work at every point: run `build(**point)` up to `until` (s), measure, and write to the store, if there is
    one.
    """

    build: Callable[..., CoSimulation]
    until: float
    measure: Callable[[xr.Dataset], xr.Dataset] | None = None
    store: Store | None = None

    def run(self, point: Point) -> xr.Dataset:
        """Return the kept part of the point's run, with all warnings in its attributes; errors name the point."""
        with collected() as messages:
            try:
                simulation = self.build(**point)
                instance("build(...)", simulation, CoSimulation, "a CoSimulation")
                run = measured = simulation.run(self.until)
                if self.measure is not None:
                    measured = instance("measure(run)", self.measure(run), xr.Dataset, "a Dataset")
            except Exception as error:
                error.add_note(f"in the sweep's point {shown(point)}")
                for message in dict.fromkeys(messages):
                    error.add_note(f"warning before it: {message}")
                raise
        return with_warnings(measured.assign_attrs(run.attrs), [*findings_of(run), *messages])

    def run_elsewhere(self, point: Point) -> xr.Dataset:
        """Return `run` in another process. An error that cannot be pickled becomes a RuntimeError with its text."""
        return _with_portable_errors(self.run, point)

    def attempt(self, point: Point, elsewhere: bool = False) -> xr.Dataset | Failure:
        """Run as `run`, but return the point's own errors; those of the environment are raised.

        elsewhere: in a process that reports to another.
        """
        if elsewhere:
            return _with_portable_errors(self.attempt, point)
        try:
            return self.run(point)
        except ENVIRONMENT_ERRORS as error:
            error.add_note(NOT_RECORDED)
            raise
        # The user's own code may raise any error, and no error may lose the results of other points. Errors that the
        # point did not cause (KeyboardInterrupt, SystemExit, ENVIRONMENT_ERRORS, an unwritable store) still end
        # the sweep.
        except Exception as error:  # noqa: BLE001 - see above
            return Failure(type(error).__name__, str(error))

    def finish(self, point: Point, elsewhere: bool, wait: bool = False) -> Outcome:
        """Run without a store as `run`; with one, store a new outcome as soon as it is known, and return failures.

        A point that another sweep is running is BUSY, or with `wait` it is awaited.
        """
        if self.store is None:
            return self.run_elsewhere(point) if elsewhere else self.run(point)
        if self.store.holds(point):
            return self.store.failure(point)
        claim = self.store.claim(point, wait)
        if claim is None:
            return BUSY
        try:
            if self.store.holds(point):
                return self.store.failure(point)
            return self.keep(point, self.attempt(point, elsewhere))
        finally:
            claim.release()

    def keep(self, point: Point, outcome: xr.Dataset | Failure) -> Outcome:
        """Put an outcome into the store, if there is one; a run that the store cannot hold is a failure."""
        if self.store is None:
            return outcome
        try:
            self.store.keep(point, outcome)
        except ValueError as error:
            outcome = Failure(type(error).__name__, str(error))
            self.store.keep(point, outcome)
        return outcome if isinstance(outcome, Failure) else None


def in_processes(work: Work, batches: list[Batch], jobs: int) -> Iterator[tuple[int, Outcome]]:
    """Run batches in processes of this machine, and yield the place and outcome of each point.

    If a process is killed, a sweep without a store ends with a RuntimeError. With a store, the points that were running
    are tried again, each alone in a process. A point that kills this process as well has failed, and the others
    continue. Points that another sweep is running are awaited at the end; where that one dies, they are run.
    """
    busy: dict[int, Point] = {}
    waiting = False
    while batches or busy:
        if not batches:
            log.info("%d points are being run by other sweeps of this store; waiting for them", len(busy))
            batches, busy, waiting = [{i: point} for i, point in busy.items()], {}, True
        finished: set[int] = set()
        try:
            with closing(_parallel(work, batches, jobs, waiting)) as outcomes_of_batches:
                for batch, outcomes in zip(batches, outcomes_of_batches, strict=False):
                    finished.update(outcomes)
                    for i, outcome in outcomes.items():
                        if isinstance(outcome, str):
                            busy[i] = batch[i]
                        else:
                            yield i, outcome
            batches = []
            continue
        except TerminatedWorkerError as error:
            if work.store is None:
                first = next(point for batch in batches for i, point in batch.items() if i not in finished)
                raise RuntimeError(
                    f"a process died at one of the sweep's points, {shown(first)} or a later one; perhaps memory ran "
                    "out; use store= to find out which, and to keep the others"
                ) from error
            log.warning("a process of the sweep was killed; the points that were running are tried again, one by one")
        batches = [left for batch in batches if (left := {i: batch[i] for i in batch if i not in finished})]
        new = [[point for point in batch.values() if not work.store.holds(point)] for batch in batches]
        # Batches start in order, and each runs its points one after the other.
        for point in [points[0] for points in new if points][:jobs]:
            _run_alone(work, work.store, point)


def _parallel(
    work: Work, batches: list[Batch], jobs: int, wait: bool = False
) -> Generator[dict[int, Outcome], None, None]:
    # In a process of its own, even one batch cannot end the sweep.
    fewest = 1 if work.store is None else 2
    here: dict[str, Any] = {} if work.store is None else {"backend": "loky"}
    owner = os.getpid()
    tasks = (joblib.delayed(_run_batch)(work, batch, owner, wait) for batch in batches)
    return in_parallel(min(jobs, max(fewest, len(batches))), tasks, **here)


def in_parallel(jobs: int, tasks: Iterable[Any], **settings: Any) -> Generator[Any, None, None]:
    """Yield what joblib's tasks return, in their order, from `jobs` processes that end with this one."""
    parallel = joblib.Parallel(
        jobs, return_as="generator", batch_size=1, idle_worker_timeout=IDLE_TIME, initializer=end_with,
        initargs=(os.getpid(),), **settings,
    )  # fmt: skip
    with without_interrupts():
        results: Generator[Any, None, None] = parallel(tasks)
    try:
        for result in results:  # noqa: UP028 - a generator that is closed closes the inner one below
            yield result
    finally:
        with warnings.catch_warnings():
            # That tasks were given up is known to who gave them up.
            warnings.simplefilter("ignore", UserWarning)
            results.close()


@contextmanager
def without_interrupts() -> Iterator[None]:
    """Keep processes that start within this context from Ctrl-C, which a terminal sends to all processes of a command.

    Each of them would print where it was, as it loads modules or runs. The one that started them sees it when the
    context ends, and ends them.
    """
    if not hasattr(signal, "pthread_sigmask"):  # on Windows
        yield
        return
    # They start with the first process, and Python's own would end the blocking.
    for tracker in (resource_tracker, tracker_of_loky):
        tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with(owner: int) -> None:
    """End this process soon after the one that started it has ended, also if that one was killed.

    It would run on in vain, and hold the claims of its points. One whose parent ended before the watch begins ends at
    once. Where a process does not know its parent's end, as on Windows, an idle one ends after IDLE_TIME.
    """

    def watch() -> None:
        while os.getppid() == owner:
            time.sleep(WATCH_INTERVAL)
        os._exit(1)

    # A worker of a cluster is nobody's child here.
    if os.getpid() == owner or not current_process().name.startswith("LokyProcess"):
        return
    # They compile the same kernels at the same time; one of them says so.
    if not current_process().name.endswith("-1"):
        compiling.log.setLevel(logging.ERROR)
    if os.getppid() != owner:
        os._exit(1)
    threading.Thread(target=watch, name="hertzlink-end-with-parent", daemon=True).start()


def _run_batch(work: Work, batch: Batch, owner: int, wait: bool) -> dict[int, Outcome]:
    outcomes = {}
    for i, point in batch.items():
        # If the sweep was killed, and perhaps resumed, this process must not run the remaining points.
        if work.store is not None and owner not in (os.getpid(), os.getppid()):
            break
        outcomes[i] = work.finish(point, owner != os.getpid(), wait)
    return outcomes


def _run_alone(work: Work, store: Store, point: Point) -> None:
    """Run one point, and nothing else at the same time, in a process; a point that kills the process has failed."""
    try:
        list(_parallel(work, [{0: point}], jobs=2, wait=True))
    except TerminatedWorkerError as error:
        if not store.holds(point):
            said = "the process that ran it was killed or ended, alone too; perhaps it wants more memory than there is"
            store.keep(point, Failure(type(error).__name__, said))


def _with_portable_errors(run: Callable[[Point], Result], point: Point) -> Result:
    """Run a point; replace an error that cannot be sent to another process by one with its type, text and notes."""
    try:
        return run(point)
    except Exception as error:
        if _travels(error):
            raise
        portable = RuntimeError(f"{type(error).__name__}: {error}")
        for note in (*error.__notes__, "".join(traceback.format_tb(error.__traceback__))):
            portable.add_note(note)
    # Raised outside the handler: otherwise the original error would be attached as context and pickled, too.
    raise portable


def _travels(error: Exception) -> bool:
    """Return whether an error can be sent to another process."""
    try:
        pickle.loads(dumps(error))
    except Exception:  # noqa: BLE001 - the error's own code runs here, its constructor among it
        return False
    return True
