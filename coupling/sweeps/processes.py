"""What a sweep does at each point, and the processes of this machine that do it."""

import logging
import os
import pickle
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import joblib
import xarray as xr
from joblib.externals.loky.backend.reduction import dumps
from joblib.externals.loky.process_executor import TerminatedWorkerError

from coupling.cosimulation import CoSimulation
from coupling.results.findings import findings_of, with_warnings
from coupling.sweeps.store import Failure, Point, Store
from structures.caution import collected
from structures.checks import instance, short

IDLE = 30
"""Seconds after which a process without work ends, as those of a sweep that was killed."""

ENVIRONMENT = (ImportError, MemoryError, OSError)
"""Errors that are not the point's: a package is missing, memory or disk is full, a file or a connection is lost. On
another day, or another machine, the same point may well run."""

NOT_RECORDED = "this is a failure of the environment, so the point is not recorded as failed; run the sweep again"

Outcome = xr.Dataset | Failure | None
"""A run, or why there is none; None for a run that its process has put into the store."""

Batch = Mapping[int, Point]
"""Points, by their place in the sweep, that one process runs one after the other."""

log = logging.getLogger("hertzlink.sweep")


def shown(point: Point) -> str:
    """A point as an error shows it, no value at length."""
    return "{" + ", ".join(f"{name!r}: {short(value)}" for name, value in point.items()) + "}"


@dataclass(frozen=True)
class Work:
    """What is done at every point: run `build(**point)` up to `until` (s), measure, and keep in the store if any."""

    build: Callable[..., CoSimulation]
    until: float
    measure: Callable[[xr.Dataset], xr.Dataset] | None = None
    store: Store | None = None

    def run(self, point: Point) -> xr.Dataset:
        """What is kept of the point's run, with all warnings on the way in its attributes; errors name the point."""
        with collected() as messages:
            try:
                simulation = self.build(**point)
                instance("build", simulation, CoSimulation, "a function that returns a CoSimulation")
                run = kept = simulation.run(self.until)
                if self.measure is not None:
                    kept = instance("measure", self.measure(run), xr.Dataset, "a function that returns a Dataset")
            except Exception as error:
                error.add_note(f"in the sweep's point {shown(point)}")
                for message in dict.fromkeys(messages):
                    error.add_note(f"warning before it: {message}")
                raise
        return with_warnings(kept.assign_attrs(run.attrs), [*findings_of(run), *messages])

    def run_elsewhere(self, point: Point) -> xr.Dataset:
        """`run` in a process that answers another: RuntimeError with the type and text of an error that cannot go."""
        try:
            return self.run(point)
        except Exception as error:
            if _travels(error):
                raise
            told = _told(error)
        # Not from within the handler: the error would go along as the context of what is told.
        raise told

    def attempt(self, point: Point, elsewhere: bool = False) -> xr.Dataset | Failure:
        """The same, with the point's own errors returned, and those of the environment raised.

        elsewhere: in a process that answers another.
        """
        try:
            return self.run(point)
        except ENVIRONMENT as error:
            error.add_note(NOT_RECORDED)
            if not elsewhere or _travels(error):
                raise
            told = _told(error)
        # The user's own code may raise any error, and none may cost the points that are well. What is not the point's
        # own (KeyboardInterrupt, SystemExit, ENVIRONMENT, a store that cannot be written) still ends the sweep.
        except Exception as error:  # noqa: BLE001 - see above
            return Failure(type(error).__name__, str(error))
        raise told

    def finish(self, point: Point, elsewhere: bool) -> Outcome:
        """Without a store `run`; with it what is new goes there as soon as it is known, and failures are told."""
        if self.store is None:
            return self.run_elsewhere(point) if elsewhere else self.run(point)
        if self.store.holds(point):
            return self.store.failure(point)
        return self.keep(point, self.attempt(point, elsewhere))

    def keep(self, point: Point, outcome: xr.Dataset | Failure) -> Outcome:
        """Put an outcome into the store, if any; a run that it cannot hold is a failure."""
        if self.store is None:
            return outcome
        try:
            self.store.keep(point, outcome)
        except ValueError as error:
            outcome = Failure(type(error).__name__, str(error))
            self.store.keep(point, outcome)
        return outcome if isinstance(outcome, Failure) else None


def in_processes(work: Work, batches: list[Batch], jobs: int) -> Iterator[tuple[int, Outcome]]:
    """Run batches in processes of this machine, and tell each point's place and outcome.

    Where a process is killed, a sweep without a store ends with a RuntimeError. With one the points that were running
    are tried again, each alone in a process: one that is the end of that too has failed, and the others go on.
    """
    while batches:
        told: set[int] = set()
        try:
            for outcomes in _parallel(work, batches, jobs):
                told.update(outcomes)
                yield from outcomes.items()
            return
        except TerminatedWorkerError as error:
            if work.store is None:
                first = next(point for batch in batches for i, point in batch.items() if i not in told)
                raise RuntimeError(
                    f"a process died at one of the sweep's points, {shown(first)} or a later one; perhaps for want of "
                    "memory; give store= to find out which, and to keep the others"
                ) from error
            log.warning("a process of the sweep was killed; the points that were running are tried again, one by one")
        batches = [left for batch in batches if (left := {i: batch[i] for i in batch if i not in told})]
        new = [[point for point in batch.values() if not work.store.holds(point)] for batch in batches]
        # Batches begin in their order and go from point to point.
        for point in [points[0] for points in new if points][:jobs]:
            _run_alone(work, work.store, point)


def _parallel(work: Work, batches: list[Batch], jobs: int) -> Iterator[dict[int, Outcome]]:
    # In a process of its own, even one batch cannot end the sweep.
    fewest = 1 if work.store is None else 2
    here: dict[str, Any] = {} if work.store is None else {"backend": "loky"}
    parallel = joblib.Parallel(
        min(jobs, max(fewest, len(batches))),
        return_as="generator",
        batch_size=1,
        idle_worker_timeout=IDLE,
        **here,
    )
    owner = os.getpid()
    outcomes: Iterator[dict[int, Outcome]] = parallel(joblib.delayed(_run_batch)(work, one, owner) for one in batches)
    return outcomes


def _run_batch(work: Work, batch: Batch, owner: int) -> dict[int, Outcome]:
    outcomes = {}
    for i, point in batch.items():
        # Where the sweep was killed, and perhaps resumed, what is left is no longer this process's to run.
        if work.store is not None and owner not in (os.getpid(), os.getppid()):
            break
        outcomes[i] = work.finish(point, elsewhere=owner != os.getpid())
    return outcomes


def _run_alone(work: Work, store: Store, point: Point) -> None:
    """Run a point, and nothing else beside it, in a process; one that is the end of the process has failed."""
    try:
        list(_parallel(work, [{0: point}], jobs=2))
    except TerminatedWorkerError as error:
        if not store.holds(point):
            said = "the process that ran it was killed or ended, alone too; perhaps it wants more memory than there is"
            store.keep(point, Failure(type(error).__name__, said))


def _told(error: Exception) -> RuntimeError:
    """An error that travels, with the type, text and notes of one that does not."""
    told = RuntimeError(f"{type(error).__name__}: {error}")
    for note in (*error.__notes__, "".join(traceback.format_tb(error.__traceback__))):
        told.add_note(note)
    return told


def _travels(error: Exception) -> bool:
    """Whether an error survives the way to another process."""
    try:
        pickle.loads(dumps(error))
    except Exception:  # noqa: BLE001 - the error's own code runs here, its constructor among it
        return False
    return True
