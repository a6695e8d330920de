"""Compiled kernels need a folder of their own where the user has none."""

import atexit
import errno
import gc
import importlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
import pytest
from numba import typeof
from numba.core import event
from numba.core.caching import IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary

from structures.kernels import kernel_cache
from structures.kernels.kernel_key import key_of
from structures.kernels.kernel_linking import Linked


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
from structures.kernels.kernel_cache import njit

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


class Marks(event.Listener):  # type: ignore[misc]
    """Lists when Numba begins and ends to compile, among other phases."""

    def __init__(self, phases: list[str]) -> None:
        self.phases = phases

    def on_start(self, event: Any) -> None:
        self.phases.append("compile")

    def on_end(self, event: Any) -> None:
        self.phases.append("compiled")


@pytest.mark.parametrize("collects", [True, False])
def test_garbage_is_not_collected_while_a_kernel_is_compiled(fresh: Callable[[], Any], collects: bool) -> None:
    """Afterwards it is, or not, as the user has set it."""
    kernel, before, phases = fresh(), gc.isenabled(), list[str]()
    (gc.enable if collects else gc.disable)()
    gc.callbacks.append(lambda phase, info: phases.append(phase))
    try:
        with event.install_listener("numba:compile", Marks(phases)):
            kernel(4)
        assert gc.isenabled() == collects
        assert phases[phases.index("compile") + 1] == "compiled"
    finally:
        gc.callbacks.pop()
        (gc.enable if before else gc.disable)()


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


def test_a_kernel_of_other_sources_counts_as_not_there(tmp_path: Path, fresh: Callable[[], Any]) -> None:
    """As where another version of the project wrote it after its index was written."""
    (tmp_path / "made.py").write_text(TWICE.replace("2 * x", "30 * x"))
    kernel_cache.stamp.cache_clear()
    other = fresh()
    assert (other(4), other(1.5)) == (120, 45.0)
    theirs = {path: path.read_bytes() for path in (tmp_path / "kept").rglob("*.nbc")}
    (tmp_path / "made.py").write_text(TWICE)
    kernel_cache.stamp.cache_clear()
    assert [found(fresh()) for _ in range(2)] == [0, 2]
    for path, content in theirs.items():
        path.write_bytes(content)
    assert found(fresh()) == 0


KERNELS = """
from structures.kernels.kernel_cache import entry, inner, njit
from structures.kernels.pieces import by_type

@by_type
def force(law, i, overlap):
    raise NotImplementedError

@inner()
def pressed(law, overlap):
    return force(law, 0, overlap)

@njit(cache=True)
def both(law, overlap):
    return pressed(law, overlap), force(law, 0, 2.0 * overlap)

@entry
def alone(law, overlap):
    return pressed(law, overlap)
"""

PIECE = """
from typing import NamedTuple
import numpy as np
from helper import halved
FACTOR = 2.0

class Own(NamedTuple):
    stiffness: np.ndarray

    @staticmethod
    def force(law, i, overlap):
        return FACTOR * halved(law.stiffness[i]) * overlap
"""

HELPER = """
from numba import njit

@njit
def halved(x):
    return 0.5 * x
"""

MAIN = """
import sys
from own import Own, np
from kernels import alone, both, pressed
law = Own(np.array([4.0]))
print(*map(float, (*both(law, 3.0), alone(law, 3.0))), sum(both.stats.cache_hits.values()))
"""


@pytest.fixture
def printed(tmp_path: Path) -> Callable[..., list[float]]:
    """What a process prints that runs these sources, some of them edited; their kernels are kept in one folder."""
    settings = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kept"), "PYTHONDONTWRITEBYTECODE": "1"}
    sources = {"kernels": KERNELS, "own": PIECE, "helper": HELPER, "main": MAIN}

    def run(**edited: str) -> list[float]:
        for name, text in {**sources, **edited}.items():
            (tmp_path / f"{name}.py").write_text(text)
        done = subprocess.run(
            [sys.executable, tmp_path / "main.py"], env=settings, capture_output=True, text=True, check=True
        )
        return [float(one) for one in done.stdout.split()]

    return run


@pytest.mark.thorough
def test_an_edited_piece_of_a_user_is_compiled_anew(printed: Callable[..., list[float]]) -> None:
    """Numba keeps a kernel by its types, in which the piece's functions have no part.

    The process that finds its kernels also finds the one that Python calls.
    """
    assert printed() == [12.0, 24.0, 12.0, 0.0]
    assert printed() == [12.0, 24.0, 12.0, 1.0]
    assert printed(own=PIECE.replace("* overlap", "* overlap**2")) == [36.0, 144.0, 36.0, 0.0]
    assert printed(helper=HELPER.replace("0.5", "0.25")) == [6.0, 12.0, 6.0, 0.0]
    assert printed() == [12.0, 24.0, 12.0, 1.0]


@pytest.mark.thorough
def test_a_piece_of_the_main_script_is_compiled_in_each_process(printed: Callable[..., list[float]]) -> None:
    """Another process does not find its class by a name."""
    main = MAIN.replace("from own import Own, np", PIECE)
    assert printed(main=main) == printed(main=main) == [12.0, 24.0, 12.0, 0.0]


@pytest.fixture
def key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str | None]:
    """The key of a kernel for PIECE as a process finds it that begins, after an edit of the piece or of its helper."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def of(piece: str = PIECE, helper: str = HELPER, name: str = "own") -> str | None:
        for module, text in (("helper", helper), ("own", piece)):
            (tmp_path / f"{module}.py").write_text(text)
            monkeypatch.delitem(sys.modules, module, raising=False)
            importlib.invalidate_caches()
        own = importlib.import_module("own").Own
        own.__module__ = name
        chain = typeof((own(np.ones(2)),)), typeof(1.0)
        return key_of(chain)

    return of


EDITS: dict[str, dict[str, str]] = {
    "code": {"piece": PIECE.replace("* overlap", "/ overlap")},
    "constant in the code": {"piece": PIECE.replace("* overlap", "* 1.0 * overlap")},
    "constant of the module": {"piece": PIECE.replace("FACTOR = 2.0", "FACTOR = 2.5")},
    "array of the module": {"piece": PIECE.replace("FACTOR = 2.0", "FACTOR = np.ones(3)")},
    "default": {"piece": PIECE.replace("overlap):", "overlap, power=2):")},
    "name of a field": {"piece": PIECE.replace("stiffness", "hardness")},
    "what it calls": {"helper": HELPER.replace("0.5", "0.25")},
    "what it calls in a module": {
        "piece": PIECE.replace("from helper import halved", "import helper").replace("halved(", "helper.halved("),
        "helper": HELPER.replace("0.5", "0.25"),
    },
}


@pytest.mark.parametrize("edit", EDITS)
def test_the_key_of_a_kernel_holds_the_code_of_a_users_piece(edit: str, key: Callable[..., str | None]) -> None:
    before = key(**{**EDITS[edit], "helper": HELPER})
    assert None is not before == key(**{**EDITS[edit], "helper": HELPER})
    assert None is not key(**EDITS[edit]) != key()
    if "helper" in EDITS[edit]:
        assert key(**EDITS[edit]) != before


@pytest.mark.parametrize("name", ["__main__", "nowhere"])
def test_what_cannot_be_imported_is_kept_nowhere(name: str, key: Callable[..., str | None]) -> None:
    assert key(name=name) is None


def test_a_kernel_that_kernels_call_runs_in_python_too(fresh: Callable[[], Any]) -> None:
    """Compiled, it would end the process: it has no code that takes arguments from Python."""
    twice = kernel_cache.inner()(fresh().py_func)
    assert twice(4) == 8
    assert not twice.signatures


LINKED = """
from structures.kernels.kernel_cache import entry, inner

@inner()
def twice(x):
    return 2 * x

@entry
def once(x):
    return twice(x) / 2

@entry
def four_times(x):
    return 2 * twice(x)
"""


def test_a_kernel_that_kernels_call_is_linked_into_each(tmp_path: Path, fresh: Callable[[], Any]) -> None:
    """It has no machine code, also where a file kept it."""
    (tmp_path / "made.py").write_text(LINKED)
    for hits, name, result in ((0, "once", 3.0), (1, "four_times", 12.0)):
        twice = fresh()
        assert twice.py_func.__globals__[name](3.0) == result
        assert [type(one.library) for one in twice.overloads.values()] == [Linked]
        assert sum(twice.stats.cache_hits.values()) == hits


def test_other_compiled_functions_are_as_before() -> None:
    """A user's functions that call each other, without the code that Python calls, among them."""

    @numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True)
    def even(n: int) -> bool:
        return n == 0 or not even(n - 1)

    @numba.njit
    def odd(n: int) -> bool:
        return not even(n)

    assert [odd(n) for n in range(4)] == [False, True, False, True]
    assert {type(one.library) for one in (*odd.overloads.values(), *even.overloads.values())} == {JITCodeLibrary}


def test_a_users_class_of_numba_is_no_kernel_of_ours() -> None:
    """The function that makes its objects belongs to no module."""
    anonymous = SimpleNamespace(py_func=SimpleNamespace(__module__=None))
    kernel_cache.Announcement().on_start(SimpleNamespace(data={"dispatcher": anonymous}))


COMPILES = """
import hertzlink as hl
from particles.kernels import motion
bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
simulation = hl.CoSimulation(hl.Chain([bead] * 2, bead, 0.3), hl.half_space(hl.STEEL_440C))
for _ in range(2):
    simulation.run(2e-5, save_every=1e-6)
names = "accelerations remember advance contact_forces".split()
print([name for name in names if getattr(motion, name).signatures])
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
    assert processes[0].stdout.splitlines() == ["['advance', 'contact_forces']"]


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("NUMBA_DISABLE_JIT", "1", "NUMBA_DISABLE_JIT forbids it: unset it"),
        ("NUMBA_NUM_THREADS", "0", "Numba does not start with "),
        ("NUMBA_NUM_THREADS", "two", "NUMBA_NUM_THREADS=two"),
    ],
)
def test_an_environment_in_which_numba_does_not_start(name: str, value: str, said: str) -> None:
    """Variables of Numba give one sentence, at the command line nothing else; they ended in errors of Numba's."""
    for command in (["-c", "import particles.kernels.motion"], ["-m", "hertzlink", "info"]):
        done = subprocess.run(
            [sys.executable, *command], env={**os.environ, name: value}, capture_output=True, text=True, check=False
        )
        *before, last = done.stderr.splitlines()
        assert said in last
    assert not before
    assert done.returncode == 2
