"""Warnings about improbable input, and about results that may mislead."""

import contextlib
import functools
import sys
import warnings
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
OWN_CODE = tuple(str(HOME / room) for room in ("structures/", "particles/", "plates/", "coupling/", "hertzlink/"))

# A warning names the line of the user's code that caused it. So it skips the frames of hertzlink's own files, of
# decorators, and of an __init__ that a dataclass generates.
SKIPPED = (*OWN_CODE, contextlib.__file__, functools.__file__, "<string>")

_COLLECTED: ContextVar[list[str] | None] = ContextVar("collected", default=None)


class HertzlinkWarning(UserWarning):
    """Input that is improbable, such as a length in mm where metres are expected, or a result that may mislead.

    One filter acts on all such warnings: warnings.simplefilter("error", hertzlink.HertzlinkWarning).
    """


def caution(message: str) -> None:
    """Warn with this message at the line of the user's code that called hertzlink, or collect it (see `collected`)."""
    messages = _COLLECTED.get()
    if messages is not None:
        messages.append(message)
        return
    frame, level = sys._getframe(1), 1
    while frame.f_code.co_filename.startswith(SKIPPED) and frame.f_back is not None:
        frame, level = frame.f_back, level + 1
    warnings.warn(message, HertzlinkWarning, stacklevel=level + 1)


@contextlib.contextmanager
def collected() -> Iterator[list[str]]:
    """Collect warnings in the list that this context yields, so that a sweep reports those of many runs together."""
    messages: list[str] = []
    token = _COLLECTED.set(messages)
    try:
        yield messages
    finally:
        _COLLECTED.reset(token)
