"""Compiled kernels need a folder of their own where the user has none."""

import atexit
import errno
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numba
import pytest
from numba.core.caching import IndexDataCacheFile

from particles import kernel_cache


def test_without_a_folder_kernels_get_a_private_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a read-only installation without a home folder."""

    def nowhere(function: Any) -> None:
        raise RuntimeError("cannot cache function: no locator available")

    ends: list[tuple[Any, ...]] = []
    monkeypatch.setattr(kernel_cache, "FunctionCache", nowhere)
    monkeypatch.setattr(atexit, "register", lambda *call, **keywords: ends.append(call))
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.setattr(kernel_cache, "_private", [])
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    kernel_cache.provide()
    folder = Path(numba.config.CACHE_DIR)
    assert folder.is_dir()
    assert folder.stat().st_mode & 0o077 == 0
    assert ends == [(shutil.rmtree, str(folder))]
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder)
    folder.rmdir()


def test_a_folder_that_works_stays(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    kernel_cache.provide()
    assert str(tmp_path) == numba.config.CACHE_DIR


TWICE = """
from particles.kernel_cache import njit

@njit(cache=True)
def twice(x):
    return 2 * x
"""


@pytest.fixture
def fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], Any]:
    """A kernel as a process finds it that begins, with its cache in tmp_path/kept."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "kept"))
    monkeypatch.setattr(kernel_cache, "_private", [])
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))  # from which Numba sets CACHE_DIR again
    kernel_cache._say_once.cache_clear()
    (tmp_path / "made.py").write_text(TWICE)

    def load() -> Any:
        spec = spec_from_file_location("made", tmp_path / "made.py")
        assert spec is not None
        assert spec.loader is not None
        made = module_from_spec(spec)
        spec.loader.exec_module(made)
        return made.twice

    return load


def found(kernel: Any) -> int:
    """Kernels that came from the cache, after two calls that are right."""
    assert (kernel(4), kernel(1.5)) == (8, 3.0)
    return int(sum(kernel.stats.cache_hits.values()))


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "cut": lambda content: content[: len(content) // 2],
    "longer": lambda content: content + b"x",
    "garbage": lambda content: bytes(range(256)) * (len(content) // 256 + 1),
    "one byte": lambda content: content[:100] + bytes([content[100] ^ 1]) + content[101:],
}


@pytest.mark.parametrize(
    ("ending", "damage"),
    [("nbi", "empty"), ("nbi", "garbage"), ("nbi", "cut"), ("nbc", "empty"), ("nbc", "longer"), ("nbc", "one byte")],
)
def test_what_is_damaged_is_compiled_anew(
    tmp_path: Path, fresh: Callable[[], Any], caplog: pytest.LogCaptureFixture, ending: str, damage: str
) -> None:
    """A line says which folder; the cache is whole again afterwards."""
    assert [found(fresh()) for _ in range(2)] == [0, 2]
    for path in (tmp_path / "kept").rglob(f"*.{ending}"):
        path.write_bytes(DAMAGES[damage](path.read_bytes()))
    caplog.clear()
    assert [found(fresh()) for _ in range(2)] == [0, 2]
    assert [one.getMessage() for one in caplog.records] == [
        f"The kernel cache in {next((tmp_path / 'kept').iterdir())} is damaged; what is damaged is compiled anew"
    ]


@pytest.mark.parametrize("cause", [errno.ENOSPC, errno.EROFS])
def test_on_a_full_disk_kernels_are_kept_in_a_private_folder(
    tmp_path: Path,
    fresh: Callable[[], Any],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    cause: int,
) -> None:
    """Processes that this one starts find them there."""
    begin = IndexDataCacheFile._open_for_write

    def full(self: Any, path: str) -> Any:
        if path.startswith(str(tmp_path)):
            raise OSError(cause, os.strerror(cause))
        return begin(self, path)

    monkeypatch.setattr(IndexDataCacheFile, "_open_for_write", full)
    assert found(fresh()) == 0
    assert [one.getMessage().partition(", so")[0] for one in caplog.records] == [
        f"Compiled kernels cannot be kept in {next((tmp_path / 'kept').iterdir())} ({os.strerror(cause)})"
    ]
    assert os.environ["NUMBA_CACHE_DIR"] == numba.config.CACHE_DIR == kernel_cache._private[0]
    assert len(list(Path(kernel_cache._private[0]).iterdir())) == 3
    shutil.rmtree(kernel_cache._private[0])


def test_a_name_that_two_kernels_got_gives_no_wrong_kernel(tmp_path: Path, fresh: Callable[[], Any]) -> None:
    """As where two processes began at once: the index of the one names what the other wrote."""
    found(fresh())
    whole, real = sorted((tmp_path / "kept").rglob("*.nbc"))
    real.write_bytes(whole.read_bytes())
    assert found(fresh()) == 1


COMPILES = """
import hertzlink as hl
from particles import kernels
bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
simulation = hl.CoSimulation(hl.Chain([bead] * 2, bead, 0.3), hl.half_space(hl.STEEL_440C))
for _ in range(2):
    simulation.run(2e-5, save_every=1e-6)
names = "_verlet _driven_verlet _viscous_verlet _lossy_verlet _rk4 _accelerate_vibrating _agree".split()
print([name for name in names if getattr(kernels, name).signatures])
"""


@pytest.fixture(scope="module")
def processes(tmp_path_factory: pytest.TempPathFactory) -> list[subprocess.CompletedProcess[str]]:
    """Two, one after the other, with a folder for kernels that is empty at first."""
    settings = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path_factory.mktemp("kernels"))}
    command = [sys.executable, "-W", "ignore", "-c", COMPILES]
    return [subprocess.run(command, env=settings, capture_output=True, text=True, check=True) for _ in range(2)]


@pytest.mark.thorough
def test_the_first_run_says_that_it_compiles(processes: list[subprocess.CompletedProcess[str]]) -> None:
    """One line, however many kernels; a second process finds them and says nothing."""
    assert [one.stderr for one in processes] == [f"{kernel_cache.COMPILING}\n", ""]


@pytest.mark.thorough
def test_a_plain_run_compiles_no_other_integrator(processes: list[subprocess.CompletedProcess[str]]) -> None:
    """Nor anything for beads that vibrate, or for several contacts."""
    assert processes[0].stdout.splitlines() == ["['_verlet']"]


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("NUMBA_DISABLE_JIT", "1", "NUMBA_DISABLE_JIT forbids it: unset it"),
        ("NUMBA_NUM_THREADS", "0", "Numba does not start with "),
    ],
)
def test_an_environment_in_which_numba_does_not_start(name: str, value: str, said: str) -> None:
    """Variables of Numba give one sentence, at the command line nothing else; they ended in errors of Numba's."""
    for command in (["-c", "import particles.kernels"], ["-m", "hertzlink", "info"]):
        done = subprocess.run(
            [sys.executable, *command], env={**os.environ, name: value}, capture_output=True, text=True, check=False
        )
        *before, last = done.stderr.splitlines()
        assert said in last
    assert not before
    assert done.returncode == 2
