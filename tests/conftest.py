"""Hypothesis draws the same examples each time: everything random has a seed. And the conformance suite's option."""

import pytest
from hypothesis import settings

settings.register_profile("seeded", derandomize=True, deadline=None)
settings.load_profile("seeded")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--participant", metavar="MODULE:FUNCTION", help="makes what tests/conformance shall check")
