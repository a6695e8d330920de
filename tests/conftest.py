"""Hypothesis draws the same examples each time: everything random has a seed."""

import os

import pytest
from hypothesis import settings

# Tests run in one process for each core; threads of linear algebra would wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

settings.register_profile("seeded", derandomize=True, deadline=None)
settings.load_profile("seeded")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A test is thorough where a fixture that it uses takes long: its module names such fixtures in
    THOROUGH_FIXTURES."""
    for one in items:
        slow = getattr(getattr(one, "module", None), "THOROUGH_FIXTURES", ())
        if set(slow) & set(getattr(one, "fixturenames", ())):
            one.add_marker(pytest.mark.thorough)
