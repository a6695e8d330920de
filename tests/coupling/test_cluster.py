"""Sweeps on a cluster of two worker processes, of which some are killed."""

import logging
import os
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import CancelledError
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from coupling.sweeps import cluster
from coupling.sweeps.store import Store

distributed = pytest.importorskip("distributed")
psutil = pytest.importorskip("psutil")

UNTIL = 1e-4


def build(folder: str, radius: float, material: str = "PTFE") -> hl.CoSimulation:
    """9 mm always kill their worker; points of a material wait while a file in the folder holds it."""
    with (Path(folder) / "runs").open("a") as file:
        file.write(f"{material} {radius}\n")
    time.sleep(0.05)
    while (Path(folder) / f"hold {material}").exists():
        time.sleep(0.01)
    if radius == 9e-3:
        os.kill(os.getpid(), signal.SIGKILL)
    bead = hl.Sphere(radius, hl.STEEL_440C)
    return hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.3), hl.half_space(hl.MATERIALS[material]))


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """No test depends on how soon a busy machine starts a worker that was killed."""
    monkeypatch.setattr(cluster, "LONGEST_WITHOUT_WORKERS", 600.0)


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    import dask

    # A worker that is killed, and again some seconds later, has been away too long for a LocalCluster, which ends it.
    settings = {"distributed.scheduler.allowed-failures": 1, "distributed.deploy.lost-worker-timeout": "1h"}
    with (
        dask.config.set(settings),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client


@pytest.mark.thorough
def test_a_cluster_changes_nothing(client: Any, tmp_path: Path) -> None:
    """Given as a Client, by its address, or as itself; what a script defines travels too."""
    axes = {"folder": [str(tmp_path)], "radius": [2e-3, 3e-3]}

    def here(folder: str, radius: float) -> hl.CoSimulation:
        return build(folder, radius)

    plain = hl.sweep(build, UNTIL, jobs=1, **axes)
    assert hl.sweep(here, UNTIL, cluster=client, **axes).identical(plain)
    address = client.scheduler.address
    assert hl.sweep(build, UNTIL, cluster=address, store=tmp_path / "store", **axes).identical(plain)
    assert len(list((tmp_path / "store").glob("*.point"))) == 2
    assert hl.sweep(build, UNTIL, cluster=client.cluster, **axes).identical(plain)


@pytest.mark.thorough
def test_a_store_does_not_mind_the_default_client(client: Any, tmp_path: Path) -> None:
    """As users open one: it then computes whatever Dask is asked for in this process."""
    axes = {"folder": [str(tmp_path)], "radius": [2e-3, 3e-3]}
    plain = hl.sweep(build, UNTIL, jobs=1, **axes)
    with distributed.Client(client.scheduler.address) as default:
        assert hl.sweep(build, UNTIL, cluster=default, store=tmp_path / "s", **axes).identical(plain)
        assert hl.sweep(build, UNTIL, jobs=1, store=tmp_path / "t", **axes).identical(plain)
        assert hl.sweep(build, UNTIL, jobs=2, store=tmp_path / "u", **axes).identical(plain)
        assert hl.sweep(build, UNTIL, jobs=1, store=tmp_path / "s", **axes).identical(plain)


@pytest.mark.thorough
def test_a_cluster_of_this_machine_listens_to_this_machine_alone(client: Any) -> None:
    """As the docs start one: with its dashboard's address."""
    processes = [psutil.Process(), *psutil.Process().children(recursive=True)]
    found = [one.laddr.ip for process in processes for one in process.net_connections() if one.status == "LISTEN"]
    assert len(found) >= 3
    assert set(found) <= {"127.0.0.1", "::1"}


@pytest.mark.thorough
def test_errors_on_a_cluster(client: Any, tmp_path: Path) -> None:
    """Without a store the first ends the sweep, with one it is recorded."""
    axes = {"folder": [str(tmp_path)], "radius": [-1.0, 2e-3]}
    with pytest.raises(ValueError, match=r"radius = -1\.0") as caught:
        hl.sweep(build, UNTIL, cluster=client, **axes)
    assert "radius" in caught.value.__notes__[0]
    runs = hl.sweep(build, UNTIL, cluster=client, store=tmp_path / "store", **axes).squeeze()
    assert runs.error.values[0].startswith("ValueError: radius = -1.0")
    assert runs.error.values[1] == ""


@pytest.mark.thorough
def test_a_worker_that_is_killed_loses_nothing(client: Any, tmp_path: Path) -> None:
    """Finished points are not run again; the one that was running is."""
    store = tmp_path / "store"
    axes = {
        "folder": [str(tmp_path)],
        "material": ["PTFE", "nylon"],
        "radius": [i * 1e-3 for i in range(1, 9)],
    }
    victim = next(iter(client.run(os.getpid).values()))
    then: list[int] = []
    (hold := tmp_path / "hold nylon").touch()

    def kill() -> None:
        while len(list(store.glob("*.point"))) < 5:
            time.sleep(0.01)
        os.kill(victim, signal.SIGKILL)
        then.append(len(list(store.glob("*.point"))))
        hold.unlink()

    killer = threading.Thread(target=kill)
    killer.start()
    runs = hl.sweep(build, UNTIL, cluster=client, store=store, **axes)
    killer.join()
    assert 5 <= then[0] < 16
    counts = Counter((tmp_path / "runs").read_text().splitlines())
    assert len(counts) == 16
    # One was running; one more may have been run, and not yet fetched.
    assert sum(counts.values()) <= 16 + 2
    assert runs.identical(hl.sweep(build, UNTIL, jobs=1, **axes))


@pytest.mark.thorough
@pytest.mark.parametrize("ends", ["finished", "killed"])
def test_a_point_that_another_sweep_runs_is_awaited(client: Any, tmp_path: Path, ends: str) -> None:
    """The others are run first; where the other sweep was killed, the point is run here."""
    axes = {"folder": [str(tmp_path)], "radius": [2e-3, 3e-3, 4e-3]}
    straight = hl.sweep(build, UNTIL, jobs=1, store=tmp_path / "other", **axes)
    hl.sweep(build, UNTIL, jobs=1, store=tmp_path / "store", folder=axes["folder"], radius=[1e-3])
    store, point = Store(tmp_path / "store"), {"folder": str(tmp_path), "radius": 3e-3}
    claim = store.claim(point)
    assert claim is not None

    def end() -> None:
        while len(list(store.folder.glob("*.point"))) < 3:
            time.sleep(0.01)
        if ends == "finished":
            store.keep(point, Store(tmp_path / "other").load(point))  # type: ignore[arg-type]
        claim.release()

    (tmp_path / "runs").unlink()
    (other := threading.Thread(target=end)).start()
    runs = hl.sweep(build, UNTIL, cluster=client, store=store.folder, **axes)
    other.join()
    assert runs.identical(straight)
    expected = ["PTFE 0.002", "PTFE 0.004"] + ["PTFE 0.003"] * (ends == "killed")
    assert sorted((tmp_path / "runs").read_text().splitlines()[:2]) + ["PTFE 0.003"] * (ends == "killed") == expected
    assert len((tmp_path / "runs").read_text().splitlines()) == len(expected)
    assert not list(store.folder.glob(".*"))


@pytest.mark.thorough
def test_a_point_that_kills_its_workers_fails_alone(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a cluster that gives a point up with the first worker; each that dies has to start anew."""
    monkeypatch.setattr(client.cluster.scheduler, "allowed_failures", 0)
    axes = {"folder": [str(tmp_path)], "radius": [1e-3, 9e-3, 2e-3, 3e-3]}
    runs = hl.sweep(build, UNTIL, cluster=client, store=tmp_path / "store", **axes).squeeze()
    assert runs.error.values[1].startswith("KilledWorker: the workers that ran it died")
    assert runs.error.values[[0, 2, 3]].tolist() == ["", "", ""]
    assert np.isfinite(runs.contact_force.isel(radius=[0, 2, 3])).all()
    counts = Counter((tmp_path / "runs").read_text().splitlines())
    assert counts["PTFE 0.009"] == 2
    with pytest.raises(RuntimeError, match=r"the workers that ran the sweep's point .*9 mm"):
        hl.sweep(build, UNTIL, cluster=client, folder=[str(tmp_path)], radius=[9e-3])


def test_bad_clusters(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    axes = {"folder": ["."], "radius": [1e-3]}
    with pytest.raises(ValueError, match="jobs = 2: must be None with a cluster"):
        hl.sweep(build, UNTIL, jobs=2, cluster=client, **axes)
    with pytest.raises(ValueError, match=r"cluster = 3: must be a distributed\.Client"):
        hl.sweep(build, UNTIL, cluster=3, **axes)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="cluster = 'nowhere': must be the address of a scheduler"):
        hl.sweep(build, UNTIL, cluster="nowhere", **axes)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"pip install hertzlink\[cluster\]"):
        hl.sweep(build, UNTIL, cluster="tcp://127.0.0.1:8786", **axes)


class Asked:
    """What answers in the place of a client: workers, and what each has."""

    def __init__(self, answer: Any) -> None:
        self.answer, self.asked = answer, []

    def nthreads(self) -> dict[str, int]:
        return {"tcp://worker:1": 1}

    def run(self, function: Any, *arguments: Any, workers: list[str], on_error: str) -> dict[str, Any]:
        self.asked += workers
        assert isinstance(function(*arguments), str)
        if isinstance(self.answer, Exception) and on_error != "return":
            raise self.answer
        return dict.fromkeys(workers, self.answer)


@pytest.mark.parametrize(
    ("answer", "said"),
    [("0.0.9", "hertzlink 0.0.9"), ("99.0", "hertzlink 99.0"), (PackageNotFoundError("hertzlink"), "no hertzlink")],
)
def test_a_worker_with_another_hertzlink_is_refused(answer: Any, said: str) -> None:
    message = f"cluster: the worker tcp://worker:1 has {said}, this process {version('hertzlink')}; install the same"
    with pytest.raises(ValueError, match=message):
        cluster._Workers(Asked(answer)).threads()


def test_a_worker_is_asked_once_unless_it_was_gone() -> None:
    for answer, count in ((version("hertzlink"), 1), (OSError("gone"), 2)):
        workers = cluster._Workers(asked := Asked(answer))
        assert [workers.threads(), workers.threads()] == [1, 1]
        assert len(asked.asked) == count


def test_a_scheduler_that_is_gone_is_a_connection_error() -> None:
    class Lost(Asked):
        def nthreads(self) -> dict[str, int]:
            raise distributed.comm.core.CommClosedError("in <TCP>")

    with pytest.raises(ConnectionError, match="the scheduler was lost"):
        cluster._Workers(Lost(None)).threads()


@pytest.mark.thorough
def test_a_worker_of_another_version_runs_no_point_that_counts(
    client: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """This process is the other one: to the workers it makes no difference."""
    monkeypatch.setattr(cluster, "version_of", lambda _: "99.0")
    with pytest.raises(ValueError, match=r"cluster: the worker .* has hertzlink .*, this process 99\.0"):
        hl.sweep(build, UNTIL, cluster=client, store=tmp_path / "s", folder=[str(tmp_path)], radius=[2e-3])
    assert not list((tmp_path / "s").glob("*.point"))


def test_a_closed_client_is_refused(client: Any) -> None:
    with distributed.Client(client.scheduler.address, set_as_default=False) as closed:
        pass
    with pytest.raises(ValueError, match=r"cluster = .*: is closed"):
        hl.sweep(build, UNTIL, cluster=closed, folder=["."], radius=[1e-3])


def test_a_cluster_without_workers_is_told(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """One warning, then an error."""
    monkeypatch.setattr("coupling.sweeps.cluster.QUERY_INTERVAL", 0.1)
    monkeypatch.setattr("coupling.sweeps.cluster.LONGEST_WITHOUT_WORKERS", 0.5)
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as cluster,
        distributed.Client(cluster, set_as_default=False) as empty,
        caplog.at_level(logging.WARNING, "hertzlink.sweep"),
        pytest.raises(ConnectionError, match="cluster: has had no workers"),
    ):
        hl.sweep(build, UNTIL, cluster=empty, folder=["."], radius=[1e-3])
    assert caplog.text.count("the cluster has no workers; waiting for some") == 1


def test_a_scheduler_may_go_before_an_outcome_is_fetched() -> None:
    class Finished:
        released = False

        def result(self) -> None:
            raise CancelledError

        def release(self) -> None:
            self.released = True

    future = Finished()
    with pytest.raises(ConnectionError, match="the scheduler was lost"):
        cluster._fetched(distributed, future)
    assert future.released


@pytest.mark.thorough
def test_a_scheduler_that_goes_is_told(tmp_path: Path) -> None:
    """What was finished is kept. More points than any machine runs while a scheduler closes."""
    store = tmp_path / "store"
    axes = {"folder": [str(tmp_path)], "radius": [i * 1e-4 for i in range(10, 1000)]}
    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0")

    def close() -> None:
        while len(list(store.glob("*.point"))) < 3:
            time.sleep(0.01)
        cluster.close()

    closer = threading.Thread(target=close)
    closer.start()
    with cluster, pytest.raises(ConnectionError, match="the scheduler was lost"):
        hl.sweep(build, UNTIL, cluster=cluster.scheduler_address, store=store, **axes)
    closer.join()
    assert len(list(store.glob("*.point"))) >= 3
