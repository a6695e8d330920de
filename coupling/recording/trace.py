"""The time that each part of a run takes, s."""

import json
from collections.abc import Callable
from copy import copy
from time import perf_counter
from typing import Any

from coupling.interface import Interface
from coupling.participant import CheckedParticipant
from coupling.recording.frames import Frames
from particles.moving import MovingChain
from structures.moving import MovingStructure

PARTS: dict[type, tuple[str, tuple[str, ...]]] = {
    MovingChain: ("chains", ("advance",)),
    MovingStructure: ("structures", ("move", "free", "pushed", "dissipated", "window")),
    CheckedParticipant: ("structures", ("move",)),
    Frames: ("saving", ("record",)),
}
"""The part that each kind of object belongs to, and its methods that take time. None of them calls another one's."""


class Trace:
    """A clock for each part of a run. No part contains another; the rest of the total belongs mostly to the scheme."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.calls: dict[str, int] = {}
        self.begin = perf_counter()

    def watch_interface(self, interface: Interface) -> Interface:
        """Return the same interface, timed by this clock."""
        watched = copy(interface)
        watched.chains = tuple(map(self.watch, interface.chains))
        watched.structures = [self.watch(structure) for structure in interface.structures]
        return watched

    def watch(self, participant: Any) -> Any:
        """Return the same object, timed by this clock."""
        part, methods = next(PARTS[kind] for kind in type(participant).__mro__ if kind in PARTS)
        return _Watched(participant, {name: self.timed(part, getattr(participant, name)) for name in methods})

    def timed(self, part: str, work: Callable[..., Any]) -> Callable[..., Any]:
        """Return the same function, timed as a part of the run."""

        def timed(*arguments: Any) -> Any:
            begin = perf_counter()
            try:
                return work(*arguments)
            finally:
                self.seconds[part] = self.seconds.get(part, 0.0) + perf_counter() - begin
                self.calls[part] = self.calls.get(part, 0) + 1

        return timed

    def report(self) -> str:
        """Return the seconds and calls of each part, as JSON."""
        total = perf_counter() - self.begin
        rest = total - sum(self.seconds.values())
        return json.dumps({"seconds": {**self.seconds, "rest": rest, "total": total}, "calls": self.calls})


class _Watched:
    """Another object, some of whose methods are replaced."""

    def __init__(self, participant: Any, methods: dict[str, Callable[..., Any]]) -> None:
        self._one = participant
        vars(self).update(methods)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._one, name)
