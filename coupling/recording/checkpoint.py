"""Checkpoints: the complete state of a run in one file, written whole or not at all.

The file is a line that says what it is, the SHA-256 of all that follows, what run it belongs to (JSON), and a pickle.
"""

import hashlib
import json
import logging
import os
import pickle
from collections.abc import Iterable, Iterator, Mapping
from io import BufferedIOBase
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from coupling.interface import Interface
from coupling.recording.frames import Frames
from coupling.results.provenance import as_text, differences, versions
from structures.moving import MovingStructure

HEAD = b"hertzlink checkpoint 1\n"

SUM = 65
"""Length of the line with the sum, bytes."""

INTERVAL = 10.0
"""Seconds between checkpoints, or more, see PAUSE."""

PAUSE = 10.0
"""Between two checkpoints a run continues for at least so many times the duration of the last writing, which grows with
the number of saved times."""

PROBE = 0.01
"""Part of the greatest force with which structures are pushed: their response identifies them."""

NOT_TO_PICKLE = pickle.PicklingError, AttributeError, TypeError

NOT_TO_UNPICKLE = pickle.UnpicklingError, AttributeError, EOFError, ImportError, IndexError, TypeError

log = logging.getLogger("hertzlink.checkpoint")


class Keeper:
    """Keeps the checkpoint of one run.

    given: the run's input as plain data. length, s: of a substep. repeats: whether its scheme repeats windows.
    Raises ValueError where the file is no checkpoint, is damaged, or belongs to another run; it is left as it is.
    """

    def __init__(
        self, path: str | os.PathLike[str], given: Mapping[str, Any], interface: Interface, length: float, repeats: bool
    ) -> None:
        try:
            self.path = Path(os.path.realpath(path))
        except (TypeError, ValueError) as error:
            raise ValueError(f"checkpoint = {path!r}: must be the path of a file") from error
        self.name = f"checkpoint = {str(path)!r}"
        if interface.boxes and not repeats:
            raise ValueError(
                f"{self.name}: a participant that cannot repeat a window cannot continue from an old state either; "
                "leave it out, or give Explicit a tolerance where the participant can"
            )
        self.run = as_text({**given, "dt": interface.chains[0].dt, "versions": versions(), **_sums(interface, length)})
        self.last, self.pause = monotonic(), INTERVAL
        self.kept: dict[str, Any] | None = self._read()

    def begin(self, frames: Frames, progress: Any) -> Any:
        """The progress from which the run continues: that of the file, with its frames; else `progress`, then written.

        A state that cannot be pickled, or a file that cannot be written, is thus found before the run.
        """
        if self.kept is None:
            self._write(frames, 0, progress)
            return progress
        kept, self.kept = self.kept, None
        frames.restore(kept["frames"])
        log.info("%s: continues after saved time %d of %d", self.name, kept["row"], frames.rows - 1)
        return kept["progress"]

    def keep(self, frames: Frames, row: int, progress: Any, end: bool) -> None:
        """Write the frames up to a row and the progress, if it is time or the run ends."""
        if end or monotonic() - self.last >= self.pause:
            self._write(frames, row, progress)

    def _write(self, frames: Frames, row: int, progress: Any) -> None:
        begin = monotonic()
        try:
            self._replace({"row": row, "frames": frames.upto(row), "progress": progress})
        except OSError as error:
            raise ValueError(
                f"{self.name}: cannot be written ({error}); name a file in a folder that you may write to, with room"
            ) from error
        self.last = monotonic()
        self.pause = max(INTERVAL, PAUSE * (self.last - begin))

    def _replace(self, kept: dict[str, Any]) -> None:
        """Write a second file of a fixed name, which replaces the remains of a killed run; then rename it."""
        part = self.path.with_name(f".{self.path.name}.part")
        try:
            with part.open("w+b") as file:
                file.write(HEAD + bytes(SUM) + self.run.encode() + b"\n")
                self._pickle(kept, file)
                file.seek(len(HEAD) + SUM)
                found = _sum_of_rest(file)
                file.seek(len(HEAD))
                file.write(found)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, self.path)
        finally:
            part.unlink(missing_ok=True)
        _keep_name(self.path.parent)

    def _pickle(self, kept: dict[str, Any], file: BufferedIOBase) -> None:
        try:
            pickle.dump(kept, file, protocol=5)
        except NOT_TO_PICKLE as error:
            raise ValueError(
                f"{self.name}: the state of a participant must be something that pickle can write ({error})"
            ) from error

    def _read(self) -> dict[str, Any] | None:
        """What the file holds, None where there is none."""
        try:
            if not self.path.parent.is_dir():
                raise ValueError(f"{self.name}: its folder does not exist")
            if not os.path.lexists(self.path):
                return None
            if not self.path.is_file():
                raise ValueError(f"{self.name}: is no file; name another")
            with self.path.open("rb") as file:
                return self._read_from(file)
        except OSError as error:
            raise ValueError(f"{self.name}: cannot be read ({error}); name another file") from error

    def _read_from(self, file: BufferedIOBase) -> dict[str, Any]:
        if file.read(len(HEAD)) != HEAD:
            raise ValueError(f"{self.name}: is no checkpoint of this version of hertzlink; name another file")
        expected = file.read(SUM)
        if _sum_of_rest(file) != expected:
            raise ValueError(f"{self.name}: is damaged; remove it to begin anew")
        file.seek(len(HEAD) + SUM)
        stored = file.readline().decode().rstrip("\n")
        if stored != self.run:
            other = list(differences(json.loads(stored), json.loads(self.run)))
            named = ", ".join([text for text in other if not text.startswith("numbers")] or other)
            raise ValueError(
                f"{self.name}: belongs to another run: {named}; name another file, or remove it to begin anew"
            )
        try:
            kept: dict[str, Any] = pickle.load(file)
        except NOT_TO_UNPICKLE as error:
            raise ValueError(
                f"{self.name}: holds a participant's state that this program cannot read ({error}); run the program "
                "that wrote it, or remove it to begin anew"
            ) from error
        return kept


def _sum_of_rest(file: BufferedIOBase) -> bytes:
    return hashlib.file_digest(file, "sha256").hexdigest().encode() + b"\n"


def _keep_name(folder: Path) -> None:
    """Make the new name of the file survive a loss of power, on systems that can open a folder."""
    if hasattr(os, "O_DIRECTORY"):
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _sums(interface: Interface, length: float) -> dict[str, str]:
    """Checksums of the numbers of both sides, which their descriptions need not contain.

    For a user's participant it is the response to a first push over a substep.
    """
    chains = [(c.constants, c.rest, c.static_force, c.method, c.impact_energy or 0.0) for c in interface.chains]
    one_by_one = [s.structure for s in interface.structures if isinstance(s, MovingStructure)]
    matrices = [m for s in one_by_one for m in (s.mass, s.stiffness, s.damping) if m is not None]
    arrays = [[m.data, m.indices, m.indptr] for m in matrices] + [[s.contact] for s in one_by_one]
    push = np.full(interface.size, PROBE * interface.force_scale)
    _, answer = interface.push([s.start() for s in interface.structures], push, length)
    sums = {"chains": _sum(chains), "structures": _sum(arrays), "the structures' first answer": _sum([answer])}
    return {f"numbers of {name}": value for name, value in sums.items()}


def _sum(numbers: Iterable[Any]) -> str:
    found = hashlib.sha256()
    for array in _flat(numbers):
        found.update(np.ascontiguousarray(array).data)
    return found.hexdigest()


def _flat(numbers: Iterable[Any]) -> Iterator[Any]:
    for one in numbers:
        if isinstance(one, tuple | list):
            yield from _flat(one)
        else:
            yield one
