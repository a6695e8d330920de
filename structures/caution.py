"""Warnings for the user: about improbable input, and about results that may mislead."""

import contextlib
import functools
import sys
import warnings
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
# Where the frames of hertzlink's own code begin: a warning must name the line of the user's code that caused it
OWN_CODE = tuple(str(HOME / place) for place in ("structures/", "particles/", "plates/", "coupling/", "hertzlink/"))

_COLLECTED: ContextVar[list[str] | None] = ContextVar("collected", default=None)

# Files of frames that no user wrote: also of decorators, and of an __init__ that dataclasses generate
BETWEEN = (*OWN_CODE, contextlib.__file__, functools.__file__, "<string>")


class HertzlinkWarning(UserWarning):
    """Input that is improbable, such as a length in mm where metres are expected, or a result that may mislead.

    One filter acts on all of them: warnings.simplefilter("error", hertzlink.HertzlinkWarning).
    """


def caution(message: str) -> None:
    """Warn with this message at the line of the user's code that called hertzlink, or collect it (see `collected`)."""
    messages = _COLLECTED.get()
    if messages is not None:
        messages.append(message)
        return
    frame, level = sys._getframe(1), 1
    while frame.f_code.co_filename.startswith(BETWEEN) and frame.f_back is not None:
        frame, level = frame.f_back, level + 1
    warnings.warn(message, HertzlinkWarning, stacklevel=level + 1)


@contextlib.contextmanager
def collected() -> Iterator[list[str]]:
    """Collect warnings in the list that this context yields; a sweep then reports those of many runs together."""
    messages: list[str] = []
    token = _COLLECTED.set(messages)
    try:
        yield messages
    finally:
        _COLLECTED.reset(token)
