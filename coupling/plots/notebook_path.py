"""Paths of files that a notebook shows."""

from base64 import b64encode
from pathlib import Path
from typing import TYPE_CHECKING

KINDS = {".png": "image/png", ".gif": "image/gif", ".svg": "image/svg+xml", ".mp4": "video/mp4"}
"""Media types by suffix."""

if TYPE_CHECKING:
    System = Path
else:
    # Before Python 3.12 only the path of the system can have subclasses.
    System = type(Path())


class NotebookPath(System):
    """A path that shows its file where it is the last line of a notebook's cell."""

    def _repr_html_(self) -> str | None:
        kind = KINDS.get(self.suffix.lower())
        if kind is None or not self.is_file():
            return None
        source = f"data:{kind};base64,{b64encode(self.read_bytes()).decode()}"
        if kind.startswith("video"):
            return f'<video controls style="max-width:100%" src="{source}"></video>'
        return f'<img style="max-width:100%" alt="{self.stem}" src="{source}">'
