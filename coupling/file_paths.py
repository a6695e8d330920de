"""Paths that a user gives: ~ is the user's folder, and an error names the argument that cannot be a path."""

import os
from pathlib import Path
from typing import Any

from structures.checks import short


def path_of(name: str, path: Any, what: str) -> Path:
    """Return the path, absolute; raises ValueError for what is empty, holds a null byte, or is no path."""
    try:
        text = os.fspath(path)
        if not isinstance(text, str) or not text or "\0" in text:
            raise TypeError
        return Path(text).expanduser().absolute()
    except (TypeError, RuntimeError):  # RuntimeError: ~ of a user who is not there
        raise ValueError(f"{name} = {short(path)}: must be the {what}") from None
