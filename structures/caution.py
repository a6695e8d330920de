"""Warnings that a user sees: of input that is unlikely, and of results that may mislead."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
OURS = tuple(str(HOME / place) for place in ("structures/", "particles/", "plates/", "coupling/", "hertzlink/"))
"""Where the frames of our own code begin: a warning names the line of the user's code that led to it."""

_COLLECTED: ContextVar[list[str] | None] = ContextVar("collected", default=None)

GENERATED = "<string>"
"""The file of an __init__ that dataclasses write."""


class HertzlinkWarning(UserWarning):
    """Input that is unlikely, such as a length in mm where metres are meant, or a result that may mislead.

    A filter acts on all of them: warnings.simplefilter("error", hertzlink.HertzlinkWarning).
    """


def caution(message: str) -> None:
    """Warn of the message, at the line of the user's code that called hertzlink; or see `collected`."""
    messages = _COLLECTED.get()
    if messages is not None:
        messages.append(message)
        return
    warnings.warn(message, HertzlinkWarning, stacklevel=_depth())


@contextmanager
def collected() -> Iterator[list[str]]:
    """Within it, cautions go into the list that it gives, for a sweep to report those of many runs together."""
    messages: list[str] = []
    token = _COLLECTED.set(messages)
    try:
        yield messages
    finally:
        _COLLECTED.reset(token)


def _depth() -> int:
    """The stack level, for warnings.warn in `caution`, of the innermost frame that is not our own code."""
    frame, level = sys._getframe(2), 2
    while frame.f_code.co_filename.startswith((*OURS, GENERATED)) and frame.f_back is not None:
        frame, level = frame.f_back, level + 1
    return level
