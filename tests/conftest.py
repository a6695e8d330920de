"""Hypothesis draws the same examples each time: everything random has a seed."""

import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from multiprocessing.pool import ThreadPool
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from numba.core import event

# Tests run in one process for each core; threads of linear algebra would wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# A sweep without `jobs` would start as many processes as there are cores, each of which imports all that it uses.
os.environ.setdefault("LOKY_MAX_CPU_COUNT", "1")

settings.register_profile("seeded", derandomize=True, deadline=None)
settings.load_profile("seeded")


@pytest.fixture
def cores(monkeypatch: pytest.MonkeyPatch) -> None:
    """All processors, of which a test takes more than one."""
    monkeypatch.delenv("LOKY_MAX_CPU_COUNT")


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """The command line in this process, in an empty folder; what it prints."""
    from command import ended

    monkeypatch.chdir(tmp_path)

    def run(*arguments: str, code: int = 0) -> str:
        found = ended(*arguments)
        out, err = capsys.readouterr()
        assert found == code, err
        return out

    return run


WHOLE = pytest.StashKey[list[pytest.Item]]()
"""The tests whose cases all run, whatever `--every` keeps."""


class NoFurtherLoop(event.Listener):  # type: ignore[misc]
    """Skips a test that would compile the loop of a run for further types, which takes some five seconds."""

    def on_start(self, event: Any) -> None:
        if event.data["dispatcher"].py_func.__name__ == "move_on":
            pytest.skip("needs a loop that no docstring's example compiles")

    def on_end(self, event: Any) -> None:
        pass


def pytest_configure(config: pytest.Config) -> None:
    """Here, not in pyproject.toml: pytest imports the classes of these lines, and numpy with them, before this file."""
    config.addinivalue_line("filterwarnings", "error::numpy.exceptions.VisibleDeprecationWarning")
    # Many tests run cases that a user is warned of; those that test a warning catch it.
    config.addinivalue_line("filterwarnings", "ignore::structures.caution.HertzlinkWarning")


RUNS = """
import hertzlink as hl
bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
for kind in {}, {}:
    hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.1, **kind), hl.half_space(hl.PTFE)).run(until=2e-5)
"""
KINDS = (
    ("dict()", "dict(dissipation=hl.LinearDashpot(1.0))"),
    ("dict(law=hl.laws.Thornton())", "dict(law=hl.laws.TabulatedLaw([1e-6, 1e-5, 2e-5], [10.0, 316.2, 894.0]))"),
)
"""The chains whose loops many tests run, two for each process that compiles them."""


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile loops before the workers start, as these would compile each of them several times, at the same time."""
    if session.config.getoption("numprocesses", None) and not hasattr(session.config, "workerinput"):
        with ThreadPool() as pool:
            pool.map(lambda two: subprocess.run([sys.executable, "-W", "ignore", "-c", RUNS.format(*two)]), KINDS)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--every", type=int, default=1, metavar="N", help="of each file the first test and every N-th after it"
    )


@pytest.hookimpl(hookwrapper=True, tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> Iterator[None]:
    """A test is thorough where a fixture that it uses takes long: its module names such fixtures in
    THOROUGH_FIXTURES. Of the chosen tests, `--every` keeps a part, but all cases of those that a module names in
    EVERY_CASE. These come first, and the others run with the loops that they compile."""
    for one in items:
        slow = getattr(getattr(one, "module", None), "THOROUGH_FIXTURES", ())
        if set(slow) & set(getattr(one, "fixturenames", ())):
            one.add_marker(pytest.mark.thorough)
    yield
    if config.getoption("every") == 1:
        return
    tests, left_out = Counter[str](), list[pytest.Item]()
    whole, part = config.stash.setdefault(WHOLE, []), list[pytest.Item]()
    for one in items:
        file, _, test = one.nodeid.partition("::")
        if test.partition("[")[0] in getattr(getattr(one, "module", None), "EVERY_CASE", ()):
            whole.append(one)
            continue
        (left_out if tests[file] % config.getoption("every") else part).append(one)
        tests[file] += 1
    config.hook.pytest_deselected(items=left_out)
    items[:] = whole + part


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Of the tests that `--every` keeps, only those whose cases all run compile loops."""
    if item.config.getoption("every") == 1 or item in item.config.stash[WHOLE]:
        return (yield)
    with event.install_listener("numba:compile", NoFurtherLoop()):
        return (yield)
