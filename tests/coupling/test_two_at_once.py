"""Two at once: sweeps share the points of a store, and no process is left."""

import errno
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

import hertzlink as hl
from coupling.files.locks import Lock
from coupling.sweeps import processes

SCRIPT = """
import os, sys, time
from pathlib import Path
import hertzlink as hl

def held():
    while Path("hold").exists():
        time.sleep(0.01)

def build(radius):
    with open("runs", "a") as file:
        file.write(f"{radius} {os.getpid()}\\n")
    held()
    time.sleep(0.02)
    bead = hl.Sphere(radius, hl.STEEL_440C)
    return hl.CoSimulation(hl.Chain([bead] * 2, bead, 0.3), hl.half_space(hl.PTFE))

def sweep(jobs, count=12):
    radii = [1e-3 * (1 + i) for i in range(count)]
    return hl.sweep(build, 2e-5, jobs=jobs, store="store", radius=radii)

"""

Start = Callable[[str], "subprocess.Popen[str]"]


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Starts a process with a line of Python; all are ended after the test."""
    (tmp_path / "two_script.py").write_text(SCRIPT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    sys.modules.pop("two_script", None)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    begun = []

    def begin(line: str) -> "subprocess.Popen[str]":
        command = [sys.executable, "-c", f"from two_script import *; {line}"]
        begun.append(subprocess.Popen(command, env=environment, text=True, stderr=subprocess.PIPE))
        return begun[-1]

    yield begin
    for process in begun:
        process.kill()
        process.wait()
        # Not read to its end: a process that outlives the killed one would hold it open.
        if process.stderr is not None:
            process.stderr.close()


def until(condition: Callable[[], bool], seconds: float = 60.0) -> bool:
    """Whether a condition became true in time."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def runs() -> Counter[str]:
    return (
        Counter(line.split()[0] for line in Path("runs").read_text().splitlines())
        if Path("runs").exists()
        else Counter()
    )


@pytest.mark.thorough
def test_two_sweeps_share_the_points_of_a_store(start: Start) -> None:
    """Each point is run once, by one of them, and both return all; this process joins another, which has two more."""
    import two_script  # type: ignore[import-not-found]

    Path("hold").touch()
    other = start("runs = sweep(2); assert runs.sizes['radius'] == 12 and 'error' not in runs")
    assert until(lambda: sum(runs().values()) == 2)

    def release() -> None:
        until(lambda: sum(runs().values()) == 3)
        Path("hold").unlink()

    (releasing := threading.Thread(target=release)).start()
    own = two_script.sweep(1)
    releasing.join()
    assert own.sizes["radius"] == 12
    assert "error" not in own
    _, said = other.communicate(timeout=120)
    assert other.returncode == 0, said
    workers = {line.split()[1] for line in Path("runs").read_text().splitlines()}
    assert str(os.getpid()) in workers
    assert len(workers) == 3
    assert set(runs().values()) == {1}
    assert len(runs()) == 12
    assert len(list(Path("store").glob("*.point"))) == 12
    assert not list(Path("store").glob(".*"))


@pytest.mark.thorough
def test_a_point_of_a_killed_sweep_is_run_by_the_one_that_waits(start: Start) -> None:
    Path("hold").touch()
    first = start("sweep(1, 1)")
    assert until(lambda: sum(runs().values()) == 1)
    second = start("import logging; logging.basicConfig(level=20); sweep(1, 1)")
    assert second.stderr is not None
    assert any("being run by other sweeps of this store; waiting" in line for line in iter(second.stderr.readline, ""))
    assert sum(runs().values()) == 1
    first.send_signal(signal.SIGKILL)
    assert until(lambda: sum(runs().values()) == 2)
    Path("hold").unlink()
    assert second.wait(60) == 0
    assert len(list(Path("store").glob("*.point"))) == 1


def test_a_lock_excludes_and_is_passed_on(tmp_path: Path) -> None:
    one, other = (Lock(tmp_path / ".lock") for _ in range(2))
    assert one.take()
    assert not other.take()
    one.release()
    assert not (tmp_path / ".lock").exists()
    assert other.take(wait=True)
    assert not one.take()
    other.release()
    (tmp_path / ".lock").symlink_to(tmp_path / "victim")
    with pytest.raises(OSError):
        one.take()
    assert not (tmp_path / "victim").exists()


def test_a_process_whose_parent_ended_before_the_watch_ends_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker of a cluster, which is nobody's child here, goes on."""

    class Ended(Exception):
        pass

    def leave(code: int) -> None:
        raise Ended(code)

    monkeypatch.setattr(os, "_exit", leave)
    monkeypatch.setattr(processes.compiling.log, "level", 0)
    for name, ends in (("LokyProcess-2", True), ("MainProcess", False)):
        monkeypatch.setattr(processes, "current_process", lambda name=name: SimpleNamespace(name=name))
        with pytest.raises(Ended) if ends else nullcontext():
            processes.end_with(owner=2**30)


def test_what_another_user_left_of_a_lock_is_taken(tmp_path: Path) -> None:
    """A file that only its owner may write, as killed runs of earlier versions left."""
    left = tmp_path / ".lock"
    left.write_text("process 1 on another")
    left.chmod(0o444)
    lock, other = Lock(left), Lock(left)
    assert lock.take()
    assert not other.take()
    lock.release()
    assert not left.exists()


@pytest.mark.parametrize(("folder", "file"), [(0o755, 0o600), (0o775, 0o660), (0o1777, 0o666)])
def test_who_may_write_into_a_folder_may_lock_in_it(tmp_path: Path, folder: int, file: int) -> None:
    tmp_path.chmod(folder)
    lock = Lock(tmp_path / ".lock")
    assert lock.take()
    assert lock.path.stat().st_mode & 0o777 == file
    lock.release()


def test_a_lock_that_is_forgotten_is_released(tmp_path: Path) -> None:
    assert Lock(tmp_path / ".lock").take()
    assert Lock(tmp_path / ".lock").take()
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("cause", [errno.ENOSYS, errno.ENOLCK, errno.EIO])
def test_a_file_system_without_locks_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cause: int) -> None:
    """Also with a store that is there: nothing runs without a lock, nothing waits for ever."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    simulation = hl.CoSimulation(hl.Chain([bead] * 2, bead, 0.3), hl.half_space(hl.PTFE))

    def build(n: int) -> hl.CoSimulation:
        return simulation

    hl.sweep(build, 2e-5, jobs=1, store=tmp_path / "store", n=[1])

    def flock(*_: object) -> None:
        raise OSError(cause, os.strerror(cause))

    monkeypatch.setattr("fcntl.flock", flock)
    words = rf"its file system cannot lock files \({os.strerror(cause)}\), so two"
    for name in ("store", "new store"):
        with pytest.raises(ValueError, match=rf"store: {tmp_path}/{name}: {words} sweeps would run the same"):
            hl.sweep(build, 2e-5, jobs=1, store=tmp_path / name, n=[1, 2])


def gone(process: int) -> bool:
    """Whether a process has ended; one that nobody waits for stays as a zombie in some containers."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads Linux's list of processes")
@pytest.mark.thorough
@pytest.mark.parametrize("idle", [True, False])
def test_processes_of_a_killed_sweep_end_with_it(start: Start, idle: bool) -> None:
    """After kill -9, also those that never got a point, long before their time without work is over."""
    parent = start("from coupling.sweeps import processes; processes.IDLE_TIME = 600; sweep(4, 2); time.sleep(600)")
    if not idle:
        Path("hold").touch()
    assert until(lambda: sum(runs().values()) == 2)
    assert not idle or until(lambda: len(list(Path("store").glob("*.point"))) == 2)
    children = Path(f"/proc/{parent.pid}/task/{parent.pid}/children")
    workers = set(map(int, children.read_text().split()))
    workers |= {int(line.split()[1]) for line in Path("runs").read_text().splitlines()}
    assert len(workers) >= 2
    parent.send_signal(signal.SIGKILL)
    parent.wait(60)
    ended = until(lambda: all(map(gone, workers)), 15.0)
    for worker in workers:
        if not gone(worker):
            os.kill(worker, signal.SIGKILL)
    assert ended
