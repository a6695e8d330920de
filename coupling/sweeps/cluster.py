"""A sweep's points on a cluster of Dask distributed: an optional dependency, `pip install hertzlink[cluster]`."""

import gc
import logging
import pickle
import time
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from types import ModuleType
from typing import Any

import xarray as xr

from coupling.sweeps.processes import Batch, Outcome, Work, shown
from coupling.sweeps.store import Failure, Point
from structures.checks import short

POLL = 5.0
"""Seconds after which a cluster is asked again how large it is."""

PATIENCE = 60.0
"""Seconds after which a cluster without workers ends the sweep."""

LOST = "cluster: the scheduler was lost, or took the sweep's points away"

log = logging.getLogger("hertzlink.sweep")


def on_cluster(work: Work, batches: list[Batch], cluster: Any) -> Iterator[tuple[int, Outcome]]:
    """Run batches on a cluster, and tell each point's place and outcome; this process alone writes the store.

    The points of a batch go one after the other to whichever worker is free, most often the one that ran the last.
    Where a worker dies, what it was running goes to others. A point that was running when several died (distributed's
    `allowed-failures` and one more) is tried again with nothing else on the cluster, and has failed if they die again;
    without a store the first time ends the sweep.
    Raises RuntimeError then, and ConnectionError where the scheduler is lost, or no worker is there for PATIENCE.
    """
    distributed = import_distributed()
    killed: dict[int, Point] = {}
    task = _packed((replace(work, store=None), work.store is not None))
    with _connected(distributed, cluster) as client:
        for i, point, outcome in _spread(distributed, client, task, batches):
            if outcome is not None:
                yield i, work.keep(point, outcome)
            elif work.store is None:
                said = f"the workers that ran the sweep's point {shown(point)} died; perhaps for want of memory"
                raise RuntimeError(said)
            else:
                log.warning("the workers that ran the sweep's point %s died; it is tried again, alone", shown(point))
                killed[i] = point
        for one in killed.items():
            for i, point, outcome in _spread(distributed, client, task, [dict([one])]):
                said = "the workers that ran it died, alone too; perhaps it wants more memory than they have"
                yield i, work.keep(point, Failure("KilledWorker", said) if outcome is None else outcome)


def import_distributed() -> ModuleType:
    """Raises ImportError that tells what to install."""
    try:
        import distributed
    except ImportError as error:
        raise ImportError(f"a cluster needs Dask distributed ({error}): pip install hertzlink[cluster]") from error
    return distributed  # type: ignore[no-any-return]


def check_cluster(cluster: Any) -> None:
    """Raises ValueError for what is neither a Client nor an address; ImportError where distributed is missing."""
    known = import_distributed().Client
    if not isinstance(cluster, str | known) or getattr(cluster, "asynchronous", False):
        raise ValueError(
            f"cluster = {short(cluster)}: must be a distributed.Client that is not asynchronous, or a scheduler's "
            "address, such as 'tcp://10.0.0.1:8786'"
        )
    if getattr(cluster, "status", "running") in ("closing", "closed"):
        raise ValueError(f"cluster = {short(cluster)}: is closed; give a distributed.Client that is open")


@contextmanager
def _connected(distributed: ModuleType, cluster: Any) -> Iterator[Any]:
    if not isinstance(cluster, str):
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
    # The Client that could not connect closes itself when it is collected. Within the start of another Client that
    # would wait for ever, for a lock that its own thread holds; so it is collected now.
    gc.collect()
    raise ValueError(f"cluster = {short(cluster)}: must be the address of a scheduler; {reason}")


def _spread(
    distributed: ModuleType, client: Any, task: bytes, batches: Iterable[Batch]
) -> Iterator[tuple[int, Point, xr.Dataset | Failure | None]]:
    """As many batches at once as the workers have threads, of each one point at a time; None where workers died."""
    waiting = deque(deque(batch.items()) for batch in batches)
    running: dict[Any, tuple[int, Point, deque[tuple[int, Point]]]] = {}

    def begin(batch: deque[tuple[int, Point]]) -> None:
        i, point = batch.popleft()
        # Tied to a worker, however loosely, it would never run where all workers died and others came.
        running[client.submit(_run, task, _packed(point), pure=False)] = i, point, batch

    absence = _Absence()
    try:
        while waiting or running:
            threads = sum(client.nthreads().values())
            absence.tell(threads)
            while waiting and len(running) < max(1, threads):
                begin(waiting.popleft())
            # All that is finished is fetched before anything begins that might end its worker.
            done = _finished(distributed, client, running)
            finished = [(*running.pop(future), _fetched(distributed, future)) for future in done]
            for _, _, batch, _ in finished:
                if batch:
                    begin(batch)
            yield from ((i, point, outcome) for i, point, _, outcome in finished)
    finally:
        client.cancel(list(running))


class _Absence:
    """Tells of a cluster without workers: a warning, and at last a ConnectionError."""

    def __init__(self) -> None:
        self.seen, self.told = time.monotonic(), False

    def tell(self, threads: int) -> None:
        """threads: those that all workers have now."""
        absent = time.monotonic() - self.seen
        if threads:
            self.seen, self.told = time.monotonic(), False
            return
        if absent > 0.5 * POLL and not self.told:
            log.warning("the cluster has no workers; waiting for some")
            self.told = True
        if absent > PATIENCE:
            raise ConnectionError(
                f"cluster: has had no workers for {absent:.0f} s; start some before the sweep "
                "(client.wait_for_workers(1) waits for the first)"
            )


def _finished(distributed: ModuleType, client: Any, futures: Iterable[Any]) -> list[Any]:
    """Those that are finished, none where that takes long; what died with its worker is run again."""
    try:
        with client.as_current():
            done = distributed.wait(list(futures), timeout=POLL, return_when="FIRST_COMPLETED").done
    except TimeoutError:
        return []
    except CancelledError as error:
        raise ConnectionError(LOST) from error
    return [future for future in done if future.status in ("finished", "error")]


def _fetched(distributed: ModuleType, future: Any) -> xr.Dataset | Failure | None:
    """The outcome, None where workers died of it; released, so that it is not run again where its worker dies."""
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
    """On a worker."""
    work, guarded = _unpacked(task)
    return work.attempt(pickle.loads(point), elsewhere=True) if guarded else work.run_elsewhere(pickle.loads(point))


def _packed(value: object) -> bytes:
    """Pickled, what a script defines too; cloudpickle comes with distributed."""
    from cloudpickle import dumps

    packed: bytes = dumps(value)
    return packed


@lru_cache(maxsize=1)
def _unpacked(task: bytes) -> tuple[Work, bool]:
    """Once in a worker, so that `build` keeps what it caches."""
    unpacked: tuple[Work, bool] = pickle.loads(task)
    return unpacked
