"""Checkpoints: the complete state of a run in one file, written whole or not at all.

The file is a line that says what it is, the SHA-256 of all that follows, what run it belongs to (JSON), and plain data.
"""

import hashlib
import logging
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Any, BinaryIO

import numpy as np

from coupling.files import plain
from coupling.files.locks import Lock, NoLocks
from coupling.files.writing import companion, remove_left, whole_file
from coupling.interface import Interface
from coupling.kernels.records import REMEMBERED, Run
from coupling.participant import CheckedParticipant
from coupling.recording.frames import Frames
from coupling.results.provenance import as_text, differences, stored, versions
from coupling.state import Counts, CoupledState, Differences, Ledger, Node
from particles.moving import ChainState
from structures.stepping import StructureState

HEAD = b"hertzlink checkpoint 4\n"

SUM = 65
"""Length of the line with the sum, bytes."""

INTERVAL = 10.0
"""Seconds between checkpoints, or more, see PAUSE."""

PAUSE = 10.0
"""Between two checkpoints a run continues for at least this many times the duration of the last writing, which grows
with the number of saved times."""

PROBE = 0.01
"""Part of the greatest force with which structures are pushed: their response identifies them."""

OWN_TYPES = plain.own_types(CoupledState, ChainState, StructureState, Ledger, Node, Counts, Differences, Run)
"""Types that a checkpoint may hold besides those of the states of the run's own participants."""

TRUST = "then open only files of your own"

UNWRITABLE = "cannot be written ({}); name a file in a folder that you may write to, with room"

MISFIT = "does not fit this run; remove it to begin anew"

log = logging.getLogger("hertzlink.checkpoint")


class Keeper:
    """Keeps the checkpoint of one run.

    given: the run's input as plain data. length, s: of a substep. stride: substeps of a saved time. repeats:
    whether its scheme repeats windows. trust: whether a participant's state may be a pickle. Raises ValueError
    where the file is no checkpoint, is damaged, or belongs to another run; it is left as it is; and where a
    participant's state is no plain data without trust.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        inputs: Mapping[str, Any],
        interface: Interface,
        length: float,
        stride: int,
        repeats: bool,
        trust: bool = False,
    ) -> None:
        self.path, self.name, self.trust = _whole_path(path), f"checkpoint = {str(path)!r}", trust
        if interface.black_boxes and not repeats:
            raise ValueError(
                f"{self.name}: a participant that cannot repeat a window cannot continue from an old state either; "
                "leave it out, or give Explicit a tolerance where the participant can"
            )
        starts = [structure.start() for structure in interface.structures]
        push = np.full(interface.size, PROBE * interface.force_scale)
        ends, answer = interface.push(starts, push, length)
        self.types = {**plain.types_of(starts, list(ends)), **OWN_TYPES}
        self._check_states(interface, [*zip(starts, ends, strict=True)])
        sums = _sums(interface, answer)
        self.run = as_text({**inputs, "dt": interface.chains[0].dt, "versions": versions(), **sums})
        self.stride, self.last, self.pause = stride, monotonic(), INTERVAL
        self.kept: dict[str, Any] | None = self._read()

    def begin(self, frames: Frames, progress: Any) -> Any:
        """Return the progress from which the run continues: that of the file, with its frames; else `progress`, then
        written.

        A file that cannot be written is thus found before the run.
        """
        # The lock is held: what another run left is of one that was killed.
        remove_left(self.path, age=0.0)
        if self.kept is None:
            self._write(frames, 0, progress)
            return progress
        earlier, self.kept = self.kept, None
        try:
            row, (state, done, *_) = earlier["row"], earlier["progress"]
            ended = done if isinstance(state, Run) else done // self.stride
            if not 0 <= row == ended < frames.rows or not _fits(earlier["progress"], progress):
                raise ValueError
            frames.restore(row, earlier["frames"])
        except (AttributeError, LookupError, TypeError, ValueError):
            raise ValueError(f"{self.name}: {MISFIT}") from None
        log.info("%s: continues after saved time %d of %d", self.name, earlier["row"], frames.rows - 1)
        return earlier["progress"]

    def keep(self, frames: Frames, row: int, progress: Any, end: bool) -> None:
        """Write the frames up to a row and the progress, if it is time or the run ends."""
        if end or monotonic() - self.last >= self.pause:
            self._write(frames, row, progress)

    def _check_states(self, interface: Interface, states: Sequence[Any]) -> None:
        """Raise a ValueError for a state that is no plain data: of a participant's start, or of its next state."""
        for structure, two in zip(interface.structures, states, strict=True):
            name = structure.name if isinstance(structure, CheckedParticipant) else type(structure).__name__
            for state in () if self.trust else two:
                try:
                    plain.check(state, self.types)
                except plain.NotPlain as error:
                    raise ValueError(
                        f"{self.name}: the state of {name} {error}; make it {plain.WHAT}, named tuples and "
                        f"dataclasses, or say trust=True, and it is pickled: {TRUST}"
                    ) from None

    def _write(self, frames: Frames, row: int, progress: Any) -> None:
        begin = monotonic()
        try:
            self._replace({"row": row, "frames": frames.upto(row), "progress": progress})
        except OSError as error:
            raise ValueError(f"{self.name}: {UNWRITABLE.format(error)}") from error
        self.last = monotonic()
        self.pause = max(INTERVAL, PAUSE * (self.last - begin))

    def _replace(self, content: dict[str, Any]) -> None:
        with whole_file(self.path) as file:
            file.write(HEAD + bytes(SUM) + self.run.encode() + b"\n")
            try:
                plain.write(file, content, self.types, self.trust)
            except plain.NotPlain as error:
                hint = "make it plain data" if self.trust else f"say trust=True, and it is pickled: {TRUST}"
                raise ValueError(f"{self.name}: the state of this run {error}; {hint}") from error
            file.seek(len(HEAD) + SUM)
            digest = _sum_of_rest(file)
            file.seek(len(HEAD))
            file.write(digest)

    def _read(self) -> dict[str, Any] | None:
        """Return what the file holds, None where there is none."""
        try:
            if not self.path.parent.is_dir():
                raise ValueError(f"{self.name}: its folder does not exist")
            if not os.path.lexists(self.path):
                return None
            if not self.path.is_file():
                raise ValueError(f"{self.name}: is no regular file; name another")
            with self.path.open("rb") as file:
                return self._read_from(file)
        except OSError as error:
            raise ValueError(f"{self.name}: cannot be read ({error}); name another file") from error

    def _read_from(self, file: BinaryIO) -> dict[str, Any]:
        if file.read(len(HEAD)) != HEAD:
            raise ValueError(f"{self.name}: is no checkpoint of this version of hertzlink; name another file")
        expected = file.read(SUM)
        if _sum_of_rest(file) != expected:
            raise ValueError(f"{self.name}: is damaged; remove it to begin anew")
        file.seek(len(HEAD) + SUM)
        text = file.readline().decode(errors="replace").rstrip("\n")
        if text != self.run:
            if not (its_input := stored(text)):
                raise ValueError(f"{self.name}: is damaged; remove it to begin anew")
            other = list(differences(its_input, stored(self.run)))
            named = ", ".join([text for text in other if not text.startswith("numbers")] or other)
            raise ValueError(
                f"{self.name}: belongs to another run: {named}; name another file, or remove it to begin anew"
            )
        size = os.fstat(file.fileno()).st_size - file.tell()
        try:
            content = plain.read(file, size, self.types, self.trust)
        except plain.Untrusted as error:
            raise ValueError(f"{self.name}: {error}; if it is a file of your own, say trust=True") from None
        except (plain.Unreadable, *plain.NOT_TO_UNPICKLE) as error:
            raise ValueError(
                f"{self.name}: holds a participant's state that this program cannot read ({error}); run the program "
                "that wrote it, or remove it to begin anew"
            ) from error
        if not isinstance(content, dict):
            raise ValueError(f"{self.name}: {MISFIT}")
        return content


@contextmanager
def locked(path: str | os.PathLike[str]) -> Iterator[None]:
    """Keep other runs from this checkpoint. Raises ValueError that names the process that uses it."""
    file = _whole_path(path)
    if not file.parent.is_dir() or (os.path.lexists(file) and not file.is_file()):
        yield  # no file can be there: reading it reports what is wrong
        return
    lock = Lock(companion(file, ".lock"))
    try:
        free = lock.take()
    except NoLocks as error:
        raise ValueError(
            f"checkpoint = {str(path)!r}: {error.filename}: {error.strerror}, so two runs could write it at once; name "
            "a file in another folder, such as one on a local disk"
        ) from error
    except OSError as error:
        if not os.path.lexists(file):
            raise ValueError(f"checkpoint = {str(path)!r}: {UNWRITABLE.format(error)}") from error
        yield  # in a folder that cannot be written a finished run can be read
        return
    if not free:
        raise ValueError(
            f"checkpoint = {str(path)!r}: is in use by {lock.owner()}; wait for its end, or name another file"
        )
    try:
        yield
    finally:
        lock.release()


def _whole_path(path: str | os.PathLike[str]) -> Path:
    try:
        return Path(os.path.realpath(path))
    except (TypeError, ValueError) as error:
        raise ValueError(f"checkpoint = {path!r}: must be the path of a file") from error


def _fits(progress: Any, like: Any) -> bool:
    """Return whether progress from a file can continue a run that starts from `like`: compiled loops check no bounds.

    The states of users' participants and the memories of schemes in Python, which no compiled loop takes, may have any
    form.
    """
    if not isinstance(like[0], CoupledState):
        if not plain.fits(progress, like):
            return False
        remembered, tried, windows, *_ = progress[0].totals[0].tolist()
        return bool(0 <= remembered <= REMEMBERED and min(tried, windows) >= 0)
    if not isinstance(progress[0], CoupledState):
        return False
    now, start = progress[0], like[0]
    if not isinstance(now.past, tuple) or len(now.past) > REMEMBERED:
        return False
    start = start._replace(past=(Node(0.0, 0.0, start.surface, start.force),) * len(now.past))
    both = [(s._replace(structures=(), memory=()), *rest) for s, *rest in ((now, *progress[1:]), (start, *like[1:]))]
    return type(now.structures) is tuple and len(now.structures) == len(start.structures) and plain.fits(*both)


def _sum_of_rest(file: Any) -> bytes:
    return hashlib.file_digest(file, "sha256").hexdigest().encode() + b"\n"


def _sums(interface: Interface, answer: Any) -> dict[str, str]:
    """Return the checksums of the numbers of both sides, which their descriptions need not contain.

    answer: of the structures to a first push over a substep, which stands for a user's participant.
    """
    chains = [(c.model, c.rest, c.static_force, c.impact_energy or 0.0) for c in interface.chains]
    one_by_one = [s.structure for s in interface.structures if s.structure is not None]
    matrices = [m for s in one_by_one for m in (s.mass, s.stiffness, s.damping) if m is not None]
    arrays = [[m.data, m.indices, m.indptr] for m in matrices] + [[s.contact] for s in one_by_one]
    sums = {"chains": _sum(chains), "structures": _sum(arrays), "the structures' first answer": _sum([answer])}
    return {f"numbers of {name}": value for name, value in sums.items()}


def _sum(numbers: Iterable[Any]) -> str:
    digest = hashlib.sha256()
    for array in _flat(numbers):
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def _flat(numbers: Iterable[Any]) -> Iterator[Any]:
    for number in numbers:
        if isinstance(number, tuple | list):
            yield from _flat(number)
        elif number is not None:
            yield number
