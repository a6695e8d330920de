"""A sweep's points on a cluster of Dask distributed: an optional dependency, `pip install hertzlink[cluster]`."""

import gc
import logging
import pickle
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import lru_cache
from importlib.metadata import version
from types import ModuleType
from typing import Any

import xarray as xr

from coupling.files.locks import Lock
from coupling.results.provenance import version_of
from coupling.sweeps.processes import BUSY, Batch, Outcome, Work, shown
from coupling.sweeps.store import Failure, Point, Store
from structures.checks import short

QUERY_INTERVAL = 5.0
"""Seconds between two queries for the size of the cluster."""

LONGEST_WITHOUT_WORKERS = 60.0
"""A cluster without workers for this time, s, ends the sweep."""

STORED = "stored"
"""In place of an outcome: another sweep has run the point meanwhile."""

LOST = "cluster: the scheduler was lost, or took the sweep's points away"

log = logging.getLogger("hertzlink.sweep")


def on_cluster(work: Work, batches: list[Batch], cluster: Any) -> Iterator[tuple[int, Outcome]]:
    """Run batches on a cluster and yield the place and outcome of each point; only this process writes the store.

    The points of a batch run one after the other on whichever worker is free, usually the one that ran the last. If a
    worker dies, other workers run its points. A point that was running when several workers died (one more than
    distributed's `allowed-failures`) is run again with nothing else on the cluster. If workers die again, the point has
    failed; without a store, the first time already ends the sweep. Raises RuntimeError in that case, ConnectionError if
    the scheduler is lost or no worker is available for LONGEST_WITHOUT_WORKERS, and ValueError if a worker has another
    version of hertzlink.
    """
    distributed = import_distributed()
    killed: dict[int, Point] = {}
    task = _packed((replace(work, store=None), work.store is not None))
    busy: dict[int, Point] = {}
    with _connected(distributed, cluster) as client:
        for i, point, outcome in _spread(distributed, client, task, batches, work.store):
            if isinstance(outcome, str) and outcome == BUSY:
                busy[i] = point
            elif isinstance(outcome, str):
                yield i, work.store.failure(point) if work.store else None
            elif outcome is not None:
                yield i, work.keep(point, outcome)
            elif work.store is None:
                said = f"the workers that ran the sweep's point {shown(point)} died; perhaps memory ran out"
                raise RuntimeError(said)
            else:
                log.warning("the workers that ran the sweep's point %s died; it is tried again, alone", shown(point))
                killed[i] = point
        if busy:
            log.info("%d points are being run by other sweeps of this store; waiting for them", len(busy))
        for task_of in (*killed.items(), *busy.items()):
            for i, point, outcome in _spread(distributed, client, task, [dict([task_of])], work.store, wait=True):
                if isinstance(outcome, str):
                    yield i, work.store.failure(point) if work.store else None
                    continue
                said = "the workers that ran it died, alone too; perhaps it wants more memory than they have"
                yield i, work.keep(point, Failure("KilledWorker", said) if outcome is None else outcome)


def import_distributed() -> ModuleType:
    """Import distributed; raises ImportError that says what to install."""
    try:
        import distributed
    except ImportError as error:
        raise ImportError(f"a cluster needs Dask distributed ({error}): pip install hertzlink[cluster]") from error
    return distributed  # type: ignore[no-any-return]


def check_cluster(cluster: Any) -> None:
    """Raises ValueError if this is no Client, no cluster and no address; ImportError if distributed is missing."""
    distributed = import_distributed()
    if not isinstance(cluster, str | distributed.Client | distributed.deploy.Cluster) or getattr(
        cluster, "asynchronous", False
    ):
        raise ValueError(
            f"cluster = {short(cluster)}: must be a distributed.Client or a cluster of Dask, not asynchronous, or a "
            "scheduler's address, such as 'tcp://10.0.0.1:8786'"
        )
    status = getattr(cluster, "status", "running")
    if getattr(status, "name", status) in ("closing", "closed"):
        raise ValueError(f"cluster = {short(cluster)}: is closed; give one that is open")


@contextmanager
def _connected(distributed: ModuleType, cluster: Any) -> Iterator[Any]:
    if isinstance(cluster, distributed.Client):
        yield cluster
        return
    try:
        client = distributed.Client(cluster, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = str(error)
    else:
        with client:
            yield client
        return
    # A Client that could not connect closes itself when it is garbage-collected. If that happens while another Client
    # starts, it waits forever for a lock that its own thread holds. So it is collected now.
    gc.collect()
    raise ValueError(f"cluster = {short(cluster)}: must be the address of a scheduler; {reason}")


def _spread(
    distributed: ModuleType, client: Any, task: bytes, batches: Iterable[Batch], store: Store | None, wait: bool = False
) -> Iterator[tuple[int, Point, xr.Dataset | Failure | str | None]]:
    """Run as many batches at once as the workers have threads, one point of each at a time; None if workers died.

    With a store, this process holds the claim of a point until its outcome has been taken. A point that another sweep
    is running is BUSY, or with `wait` it is awaited; one that another has run meanwhile is STORED.
    """
    waiting = deque(deque(batch.items()) for batch in batches)
    running: dict[Any, tuple[int, Point, deque[tuple[int, Point]]]] = {}
    settled: list[tuple[int, Point, str]] = []
    claims: dict[int, Lock] = {}

    def begin(batch: deque[tuple[int, Point]]) -> None:
        while batch:
            i, point = batch.popleft()
            if store is not None:
                claim = store.claim(point, wait)
                if claim is None:
                    settled.append((i, point, BUSY))
                    continue
                claims[i] = claim
                if store.holds(point):
                    claims.pop(i).release()
                    settled.append((i, point, STORED))
                    continue
            # A preferred worker, even an optional one, would block the point forever if all workers are replaced.
            running[client.submit(_run, task, _packed(point), pure=False)] = i, point, batch
            return

    workers = _Workers(client)
    try:
        while waiting or running or settled:
            threads = workers.threads()
            while waiting and len(running) < max(1, threads):
                begin(waiting.popleft())
            # All finished outcomes are fetched before a new point starts, because that point might end their worker.
            done = _finished(distributed, client, running) if running else []
            # Before their outcomes count: one may have come and run a point meanwhile.
            workers.threads()
            finished = [(*running.pop(future), _fetched(distributed, future)) for future in done]
            for _, _, batch, _ in finished:
                if batch:
                    begin(batch)
            for i, point, _, outcome in finished:
                yield i, point, outcome
                if i in claims:
                    claims.pop(i).release()
            while settled:
                yield settled.pop()
    finally:
        with suppress(OSError):
            client.cancel(list(running))
        for claim in claims.values():
            claim.release()


class _Workers:
    """The workers of a cluster: a version that differs is refused; none for long is an error, after a warning."""

    def __init__(self, client: Any) -> None:
        self.client, self.checked = client, set[str]()
        self.seen, self.warned = time.monotonic(), False

    def threads(self) -> int:
        """Return how many all workers have now."""
        try:
            workers: Mapping[str, int] = self.client.nthreads()
            self._check(sorted(workers.keys() - self.checked))
        except (CancelledError, OSError) as error:
            raise ConnectionError(LOST) from error
        self._report(sum(workers.values()))
        return sum(workers.values())

    def _check(self, new: list[str]) -> None:
        here = version_of("hertzlink")
        # A function of Python itself: any worker has it, whatever else is installed there.
        versions = self.client.run(version, "hertzlink", workers=new, on_error="return") if new else {}
        for worker, there in versions.items():
            if isinstance(there, OSError):  # It has gone meanwhile.
                continue
            if there != here:
                said = f"hertzlink {there}" if isinstance(there, str) else "no hertzlink"
                raise ValueError(
                    f"cluster: the worker {worker} has {said}, this process {here}; install the same version on both"
                )
            self.checked.add(worker)

    def _report(self, threads: int) -> None:
        absent = time.monotonic() - self.seen
        if threads:
            self.seen, self.warned = time.monotonic(), False
            return
        if absent > 0.5 * QUERY_INTERVAL and not self.warned:
            log.warning("the cluster has no workers; waiting for some")
            self.warned = True
        if absent > LONGEST_WITHOUT_WORKERS:
            raise ConnectionError(
                f"cluster: has had no workers for {absent:.0f} s; start some before the sweep "
                "(client.wait_for_workers(1) waits for the first)"
            )


def _finished(distributed: ModuleType, client: Any, futures: Iterable[Any]) -> list[Any]:
    """Return the finished futures, none if this takes long; a point whose result died with its worker is run again."""
    try:
        with client.as_current():
            done = distributed.wait(list(futures), timeout=QUERY_INTERVAL, return_when="FIRST_COMPLETED").done
    except TimeoutError:
        return []
    except CancelledError as error:
        raise ConnectionError(LOST) from error
    return [future for future in done if future.status in ("finished", "error")]


def _fetched(distributed: ModuleType, future: Any) -> xr.Dataset | Failure | None:
    """Return the outcome, None if workers died of it. The future is released, so that it is not run again if its worker
    dies."""
    try:
        outcome: xr.Dataset | Failure = future.result()
        return outcome
    except distributed.KilledWorker:
        return None
    except CancelledError as error:  # The scheduler left after the point was finished and before its outcome came.
        raise ConnectionError(LOST) from error
    finally:
        future.release()


def _run(task: bytes, point: bytes) -> xr.Dataset | Failure:
    """Runs on a worker."""
    work, guarded = _unpacked(task)
    return work.attempt(pickle.loads(point), elsewhere=True) if guarded else work.run_elsewhere(pickle.loads(point))


def _packed(value: object) -> bytes:
    """Return the value pickled, including objects that a script defines; cloudpickle comes with distributed."""
    from cloudpickle import dumps

    packed: bytes = dumps(value)
    return packed


@lru_cache(maxsize=1)
def _unpacked(task: bytes) -> tuple[Work, bool]:
    """Return the task, unpacked once in each worker, so that `build` keeps its caches."""
    unpacked: tuple[Work, bool] = pickle.loads(task)
    return unpacked
