"""Checkpoints: the complete state of a run in one file, written whole or not at all."""

import hashlib
import json
import os
import pickle
import tempfile
from collections.abc import Mapping
from pathlib import Path
from time import monotonic
from typing import Any

from coupling.frames import Frames
from coupling.interface import Interface
from coupling.result import versions
from structures.moving import MovingStructure

HEAD = b"hertzlink checkpoint 1\n"

INTERVAL = 10.0
"""Seconds between checkpoints, or more: writing takes at most a tenth of the time."""

MOST_WRITING = 0.1


class Keeper:
    """Keeps the checkpoint of one run. found: whether the file holds one already.

    Raises ValueError where the file is no checkpoint, is damaged, or belongs to another run; it is left as it is.
    """

    def __init__(self, path: str | os.PathLike[str], given: Mapping[str, Any], interface: Interface) -> None:
        try:
            self.path = Path(path)
        except TypeError as error:
            raise ValueError(f"checkpoint = {path!r}: must be the path of a file") from error
        self.run = {"input": json.dumps(given, default=repr), "versions": versions(), "structures": digest(interface)}
        if not self.path.absolute().parent.is_dir():
            raise ValueError(f"checkpoint = {str(path)!r}: its folder does not exist")
        self.kept: dict[str, Any] = self._read() if self.path.exists() else {}
        self.found = bool(self.kept)
        self.last, self.pause = monotonic(), INTERVAL

    def due(self) -> bool:
        """Whether it is time for a checkpoint."""
        return monotonic() - self.last >= self.pause

    def write(self, frames: Frames, row: int, progress: Any) -> None:
        """Replace the file by what is known up to a row, and what the run goes on from."""
        begin = monotonic()
        body = pickle.dumps({"run": self.run, "frames": frames.upto(row), "progress": progress}, protocol=5)
        handle, beside = tempfile.mkstemp(prefix=f".{self.path.name}-", dir=self.path.absolute().parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(HEAD + _sum(body) + b"\n" + body)
                file.flush()
                os.fsync(file.fileno())
            os.replace(beside, self.path)
        finally:
            Path(beside).unlink(missing_ok=True)
        self.last = monotonic()
        self.pause = max(INTERVAL, (self.last - begin) / MOST_WRITING)

    def resume(self, frames: Frames) -> Any:
        """Fill the frames, and return what the run goes on from."""
        frames.restore(self.kept["frames"])
        return self.kept["progress"]

    def _read(self) -> dict[str, Any]:
        name = f"checkpoint = {str(self.path)!r}"
        if not self.path.is_file():
            raise ValueError(f"{name}: is no file; name another")
        data = self.path.read_bytes()
        if not data.startswith(HEAD):
            raise ValueError(f"{name}: is no checkpoint of this version of hertzlink; name another file")
        expected, _, body = data[len(HEAD) :].partition(b"\n")
        if _sum(body) != expected:
            raise ValueError(f"{name}: is damaged; remove it to begin anew")
        kept: dict[str, Any] = pickle.loads(body)
        for key, mine in self.run.items():
            if kept["run"][key] != mine:
                raise ValueError(
                    f"{name}: belongs to another run: its {_difference(key, kept['run'][key], mine)}; "
                    "name another file, or remove it to begin anew"
                )
        return kept


def digest(interface: Interface) -> list[str]:
    """A sum of the numbers of each Structure; of others the name."""
    sums = []
    for structure in interface.structures:
        if isinstance(structure, MovingStructure):
            one, found = structure.structure, hashlib.sha256()
            matrices = [one.mass, one.stiffness] + ([] if one.damping is None else [one.damping])
            for part in (*((m.data, m.indices, m.indptr) for m in matrices), (one.contact,)):
                for array in part:
                    found.update(array.tobytes())
            sums.append(found.hexdigest())
        else:
            sums.append(structure.name)
    return sums


def _sum(body: bytes) -> bytes:
    return hashlib.sha256(body).hexdigest().encode()


def _difference(key: str, theirs: Any, mine: Any) -> str:
    """What differs, in words."""
    if key == "structures":
        return "structures have other numbers"
    if key == "versions":
        other = [name for name in mine if theirs.get(name) != mine[name]]
        return f"versions of {', '.join(other)} are others"
    old, new = json.loads(theirs), json.loads(mine)
    other = [name for name in sorted(old.keys() | new.keys()) if old.get(name) != new.get(name)]
    return f"{', '.join(other)} differs"
