"""The command line in the process of a test."""

import signal
import warnings

import pytest

from hertzlink.cli import main


def ended(*words: str) -> int:
    """Run it, and return the exit code. Its handler of signals and its form of warnings do not outlive it."""
    handler, form = signal.getsignal(signal.SIGTERM), warnings.formatwarning
    try:
        with warnings.catch_warnings(), pytest.raises(SystemExit) as end:
            main(words)
    finally:
        signal.signal(signal.SIGTERM, handler)
        warnings.formatwarning = form
    return int(end.value.code or 0)
