"""Hypothesis draws the same examples each time: everything random has a seed. And the conformance suite's option."""

import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

settings.register_profile("seeded", derandomize=True, deadline=None)
settings.load_profile("seeded")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--participant", metavar="MODULE:FUNCTION", help="makes what tests/conformance checks")


def pytest_configure(config: pytest.Config) -> None:
    named = config.getoption("participant")
    if named:
        config.option.participant = (named, _named(named))
        config.option.markexpr = ""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Of a user's participant its own checks alone. A test is thorough where a fixture that it uses takes long: its
    module names such fixtures in THOROUGH_FIXTURES."""
    for one in items:
        slow = getattr(getattr(one, "module", None), "THOROUGH_FIXTURES", ())
        if set(slow) & set(getattr(one, "fixturenames", ())):
            one.add_marker(pytest.mark.thorough)
    if config.getoption("participant"):
        own = [
            one
            for one in items
            if one.path.name == "test_conformance.py" and "make" in getattr(one, "fixturenames", ())
        ]
        config.hook.pytest_deselected(items=[one for one in items if one not in own])
        items[:] = own


def _named(name: str) -> Callable[[], Any]:
    module, _, function = name.partition(":")
    if not module or not function:
        raise pytest.UsageError(f"--participant {name}: must be module:function")
    sys.path.insert(0, str(Path.cwd()))
    try:
        found = getattr(import_module(module), function, None)
    except ImportError as error:
        raise pytest.UsageError(f"--participant {name}: cannot import {module} from this folder: {error}") from error
    if not callable(found):
        raise pytest.UsageError(f"--participant {name}: {module} has no function {function}")
    return found
