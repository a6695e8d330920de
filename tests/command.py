"""Cases, and the command line, in the process of a test."""

import signal
import tomllib
import warnings

import pytest

from hertzlink.cases.case import Case
from hertzlink.cli import main


def case_of(text: str) -> Case:
    """Return the case of a text."""
    return Case(tomllib.loads(text))


def ended(*words: str) -> int:
    """Run the command and return its exit code. Its handler of signals and its form of warnings end with it."""
    handler, form = signal.getsignal(signal.SIGTERM), warnings.formatwarning
    try:
        with warnings.catch_warnings(), pytest.raises(SystemExit) as end:
            main(words)
    finally:
        signal.signal(signal.SIGTERM, handler)
        warnings.formatwarning = form
    return int(end.value.code or 0)
