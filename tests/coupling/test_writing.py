"""Writing: on a full disk, in a read-only folder, at a limit of size, or killed, the old file is whole."""

import errno
import os
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from coupling.files import writing
from coupling.files.writing import exchange, read_regular, whole_file, whole_file_by_name, whole_folder, write_whole

OLD, NEW = b"old" * 1000, b"new" * 100_000


def by_handle(target: Path) -> None:
    with whole_file(target) as file:
        for start in range(0, len(NEW), 1000):
            file.write(NEW[start : start + 1000])


def by_name(target: Path) -> None:
    with whole_file_by_name(target) as path, path.open("wb") as file:
        for start in range(0, len(NEW), 1000):
            file.write(NEW[start : start + 1000])


def by_folder(target: Path) -> None:
    with whole_folder(target, lambda path: path.name == "data") as folder:
        (folder / "data").write_bytes(NEW)


WAYS: dict[str, Callable[[Path], None]] = {"handle": by_handle, "name": by_name, "folder": by_folder}


def begin(way: str, tmp_path: Path) -> tuple[Path, Path]:
    """The target, with old content, and the file of it to read."""
    target = tmp_path / "kept"
    if way == "folder":
        target.mkdir()
        (target / "data").write_bytes(OLD)
        return target, target / "data"
    target.write_bytes(OLD)
    return target, target


@pytest.mark.parametrize("way", WAYS)
def test_a_file_is_replaced_and_nothing_else_stays(tmp_path: Path, way: str) -> None:
    target, data = begin(way, tmp_path)
    WAYS[way](target)
    assert data.read_bytes() == NEW
    assert os.listdir(tmp_path) == ["kept"]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("stage", ["fsync", "replace", "write"])
def test_a_full_disk_leaves_the_old_file(tmp_path: Path, way: str, stage: str, monkeypatch: Any) -> None:
    """Whether the disk is full at the first byte, when the data are synced, or when the name is changed."""

    def full(*_: object) -> Any:
        raise OSError(errno.ENOSPC, "No space left on device")

    target, data = begin(way, tmp_path)
    if stage == "write":
        monkeypatch.setattr(writing, "_sync", full)
        monkeypatch.setattr(writing, "_keep_rights", full)
    else:
        monkeypatch.setattr(os, stage, full)
        if stage == "replace":
            monkeypatch.setattr(writing, "exchange", full)
    with pytest.raises(OSError, match=r"No space left on device; nothing was changed: '.*kept'"):
        WAYS[way](target)
    assert data.read_bytes() == OLD
    assert os.listdir(tmp_path) == ["kept"]


SCRIPT = """
import os, resource, signal, sys
from pathlib import Path
from test_writing import NEW, WAYS

way, target, limit = sys.argv[1:]
if limit == "kill":
    # Killed in the midst of the data: the last call before it is one to write.
    import io
    count = 0
    def note(frame, event, argument):
        global count
        if event == "c_call" and getattr(argument, "__name__", "") in ("write", "replace", "rename", "fsync"):
            count += 1
            if count == int(os.environ["AT"]):
                os.kill(os.getpid(), signal.SIGKILL)
    sys.setprofile(note)
else:
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(limit), int(limit)))
WAYS[way](Path(target))
"""


def in_process(way: str, target: Path, limit: str, **settings: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path]), **settings}
    command = [sys.executable, "-c", SCRIPT, way, str(target), limit]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("way", WAYS)
def test_a_limit_of_size_leaves_the_old_file(tmp_path: Path, way: str) -> None:
    """Of the operating system, in a process of its own: the kernel refuses what is beyond."""
    target, data = begin(way, tmp_path)
    done = in_process(way, target, "20000")
    assert done.returncode == 1
    assert "File too large; nothing was changed: '" in done.stderr.splitlines()[-1]
    assert data.read_bytes() == OLD
    assert os.listdir(tmp_path) == ["kept"]


@pytest.mark.thorough
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("at", [1, 2, 150, 301, 302])
def test_killed_while_writing(tmp_path: Path, way: str, at: int) -> None:
    """The file is old or new, never in between, and the next writer works."""
    target, data = begin(way, tmp_path)
    done = in_process(way, target, "kill", AT=str(at))
    assert done.returncode in (-signal.SIGKILL, 0)
    assert data.read_bytes() == (NEW if done.returncode == 0 else OLD)
    WAYS[way](target)
    assert data.read_bytes() == NEW


def in_the_way(target: Path, what: str) -> None:
    """What another process makes at the target, or in it."""
    if what == "file":
        target.write_bytes(OLD)
        return
    target.mkdir(exist_ok=True)
    (target / "foreign").write_bytes(OLD)


@pytest.mark.parametrize("what", ["file", "folder", "file in it"])
def test_what_comes_in_the_way_of_a_folder_stays_and_the_folder_is_named(tmp_path: Path, what: str) -> None:
    """The work is done by then: it is not thrown away."""
    target = tmp_path / "kept"
    if what == "file in it":
        target.mkdir()
        (target / "data").write_bytes(OLD)
    (tmp_path / "kept-2").mkdir()

    def work() -> None:
        with whole_folder(target, lambda path: path.name == "data") as folder:
            (folder / "data").write_bytes(NEW)
            in_the_way(target, what)

    with pytest.raises(OSError, match=r"nothing was changed; the new folder is .*kept-3: '.*kept'"):
        work()
    assert (tmp_path / "kept-3" / "data").read_bytes() == NEW
    assert (target if what == "file" else target / "foreign").read_bytes() == OLD
    assert sorted(os.listdir(tmp_path)) == ["kept", "kept-2", "kept-3"]


@pytest.mark.parametrize(("mask", "rights"), [(0o077, 0o700), (0o022, 0o755), (0o002, 0o775)])
def test_a_new_folder_has_the_rights_of_any_other(tmp_path: Path, mask: int, rights: int) -> None:
    before = os.umask(mask)
    try:
        by_folder(tmp_path / "kept")
        assert stat.S_IMODE((tmp_path / "kept").stat().st_mode) == rights
        (tmp_path / "kept").chmod(0o750)
        by_folder(tmp_path / "kept")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "kept").stat().st_mode) == 0o750


@pytest.mark.parametrize("way", WAYS)
def test_what_a_killed_process_left_is_deleted_but_not_what_one_writes(tmp_path: Path, way: str) -> None:
    """A minute after the kill; what a living process writes stays however long it takes."""
    target = tmp_path / "kept"
    left = tmp_path / ".kept.0123456789abcdef.part"
    left.mkdir() if way == "folder" else left.write_bytes(OLD)
    writers: dict[str, Callable[[], Any]] = {
        "handle": lambda: whole_file(target),
        "name": lambda: whole_file_by_name(target),
        "folder": lambda: whole_folder(target, lambda path: True),
    }
    with writers[way]() as written:
        if way == "name":
            written.write_bytes(NEW)
        for part in tmp_path.iterdir():
            os.utime(part, (0.0, 0.0))
        writing.remove_left(target)
        assert len(os.listdir(tmp_path)) == 1
        assert not left.exists()
    assert os.listdir(tmp_path) == ["kept"]


def test_without_locks_age_decides(tmp_path: Path, monkeypatch: Any) -> None:
    def flock(*_: object) -> None:
        raise OSError(errno.ENOSYS, "no locks here")

    monkeypatch.setattr("fcntl.flock", flock)
    for name, age in (("young", 60.0), ("old", 7200.0)):
        (tmp_path / f".kept.{name}.part").touch()
        os.utime(tmp_path / f".kept.{name}.part", 2 * (time.time() - age,))
    by_handle(tmp_path / "kept")
    writing.remove_left(tmp_path / "kept")
    assert sorted(os.listdir(tmp_path)) == [".kept.young.part", "kept"]


@pytest.mark.parametrize("way", WAYS)
def test_a_folder_that_cannot_be_written_is_named(way: str) -> None:
    """/proc refuses new files also to root, for whom permissions do not count."""
    with pytest.raises(OSError, match=r"nothing was changed: '/proc/kept'"):
        WAYS[way](Path("/proc/kept"))


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can mount")
@pytest.mark.thorough
def test_a_read_only_file_system_is_named(tmp_path: Path) -> None:
    script = f"mount -t tmpfs none {tmp_path} && echo old > {tmp_path}/kept && mount -o remount,ro {tmp_path} && "
    script += f"{sys.executable} -c 'from pathlib import Path; from test_writing import by_handle; "
    script += f'by_handle(Path("{tmp_path}/kept"))\'; cat {tmp_path}/kept'
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    command = ["unshare", "--mount", "sh", "-c", script]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if "unshare" in done.stderr or "mount:" in done.stderr:
        pytest.skip(f"no mounts here: {done.stderr.strip()}")
    assert "Read-only file system; nothing was changed: '" in done.stderr
    assert done.stdout == "old\n"


def test_names_cannot_be_guessed_and_links_are_not_followed(tmp_path: Path, monkeypatch: Any) -> None:
    names = {writing._part(tmp_path / "kept").name for _ in range(100)}
    assert len(names) == 100
    assert all(name.startswith(".kept.") and name.endswith(".part") for name in names)
    monkeypatch.setattr(writing, "token_hex", lambda _: "0" * 16)
    (tmp_path / ".kept.0000000000000000.part").symlink_to(tmp_path / "victim")
    with pytest.raises(FileExistsError):
        write_whole(tmp_path / "kept", NEW)
    assert not (tmp_path / "victim").exists()


def test_the_folder_for_a_library_is_closed_to_others(tmp_path: Path) -> None:
    with whole_file_by_name(tmp_path / "kept") as path:
        assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
        path.write_bytes(NEW)
    assert stat.S_IMODE((tmp_path / "kept").stat().st_mode) & 0o600 == 0o600


def test_a_private_file_stays_private(tmp_path: Path) -> None:
    (tmp_path / "kept").write_bytes(OLD)
    (tmp_path / "kept").chmod(0o600)
    write_whole(tmp_path / "kept", NEW)
    assert stat.S_IMODE((tmp_path / "kept").stat().st_mode) == 0o600


@pytest.mark.parametrize("name", ["k" * 255, "ä" * 127, "a [b]*?.nc"])
def test_names_of_any_kind(tmp_path: Path, name: str) -> None:
    left = tmp_path / f".{writing._stem(tmp_path / name)}.0123456789abcdef.part"
    left.write_bytes(b"half")
    write_whole(tmp_path / name, NEW)
    writing.remove_left(tmp_path / name, age=0.0)
    assert os.listdir(tmp_path) == [name]


@pytest.mark.parametrize("in_one_step", [True, False])
def test_folders_change_names(tmp_path: Path, in_one_step: bool, monkeypatch: Any) -> None:
    """In one step where the system can, else in two, with the same end."""
    if not in_one_step:
        monkeypatch.setattr("ctypes.CDLL", lambda *_, **__: None)
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        (tmp_path / name / f"in {name}").touch()
    exchange(tmp_path / "one", tmp_path / "other")
    assert os.listdir(tmp_path / "one") == ["in other"]
    assert os.listdir(tmp_path / "other") == ["in one"]
    assert sorted(os.listdir(tmp_path)) == ["one", "other"]


def test_what_is_no_file_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(OLD)
    (tmp_path / "link").symlink_to("file")
    os.mkfifo(tmp_path / "pipe")
    assert read_regular(tmp_path / "file") == OLD
    for name in ("link", "pipe", "none", "."):
        with pytest.raises(OSError):
            read_regular(tmp_path / name)
