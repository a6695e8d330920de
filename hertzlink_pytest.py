"""pytest's side of hertzlink: `--update-references`, the fixture `same_waves`, and `--participant`.

Every pytest in an environment with hertzlink loads this module. It therefore imports nothing but pytest; hertzlink is
imported by the tests that use it.
"""

import os
import re
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

UPDATE = "HERTZLINK_UPDATE_REFERENCES"
"""The environment variable that hertzlink.testing reads. A test may also start programs that compare waves."""

FOLDER = "references"
"""The folder beside a test module that holds the references of the fixture."""

PARTICIPANT = pytest.StashKey[tuple[str, Callable[[], Any]]]()

PUSHED = pytest.StashKey[str]()
"""How the participant moves where it is pushed, in words."""

BEFORE = pytest.StashKey["str | None"]()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("hertzlink")
    group.addoption(
        "--update-references", action="store_true", help="write the references of hertzlink.testing, compare nothing"
    )
    group.addoption("--participant", metavar="MODULE:FUNCTION", help="makes what hertzlink.conformance checks")
    group.addoption("--mass", type=float, metavar="KG", help="of the participant at its contact, to a factor of three")
    group.addoption("--stiffness", type=float, metavar="N/M", help="of it there, static, to a factor of three")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("update_references"):
        config.stash[BEFORE] = os.environ.get(UPDATE)
        os.environ[UPDATE] = "1"
    named = config.getoption("participant")
    if named:
        config.stash[PARTICIPANT] = (named, _named(named))
    for what in ("mass", "stiffness"):
        value = config.getoption(what)
        if value is not None and not (named and 0.0 < value < float("inf")):
            raise pytest.UsageError(f"--{what} {value}: must be a positive number, and needs --participant")


def pytest_unconfigure(config: pytest.Config) -> None:
    if BEFORE in config.stash:
        before = config.stash[BEFORE]
        if before is None:
            os.environ.pop(UPDATE, None)
        else:
            os.environ[UPDATE] = before


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """A run that compared nothing must not look like one that did."""
    if config.getoption("update_references"):
        terminalreporter.write_line("hertzlink: references were written, and nothing was compared with them")
    if PUSHED in config.stash:
        terminalreporter.write_line(f"hertzlink: {config.stash[PARTICIPANT][0]} {config.stash[PUSHED]}")


@pytest.fixture
def same_waves(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Compares a result with the reference of this test: `same_waves(run, name="", **options)`.

    The reference lies beside the test, in references/MODULE/TEST.nc, or TEST-NAME.nc for one of several. The options
    are those of hertzlink.testing.assert_same_waves.
    """
    path, used = request.path, set[str]()
    test = request.node.nodeid.partition("::")[2]

    def compare(run: Any, name: str = "", **options: Any) -> None:
        # A failure shows the table of differences, not our code.
        __tracebackhide__ = True
        from hertzlink.testing import assert_same_waves

        file = "-".join(re.sub(r"[^\w.]+", "-", one).strip("-") for one in (test, name) if one) + ".nc"
        if file in used:
            raise ValueError(f"name = {name!r}: this test has used it already; give each result a name of its own")
        used.add(file)
        assert_same_waves(run, path.parent / FOLDER / path.stem / file, **options)

    return compare


def _named(name: str) -> Callable[[], Any]:
    module, _, function = name.partition(":")
    if not module or not function:
        raise pytest.UsageError(f"--participant {name}: must be module:function")
    sys.path.insert(0, str(Path.cwd()))
    try:
        found: Any = getattr(import_module(module), function, None)
    except ImportError as error:
        raise pytest.UsageError(f"--participant {name}: cannot import {module} from this folder: {error}") from error
    if not callable(found):
        raise pytest.UsageError(f"--participant {name}: {module} has no function {function}")
    make: Callable[[], Any] = found
    return make
