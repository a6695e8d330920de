"""Where the time of a run goes: seconds in each part, for those who ask."""

import json
from collections.abc import Callable
from copy import copy
from time import perf_counter
from typing import Any

from coupling.interface import Interface

CHAINS, STRUCTURES = ("advance", "advance_condensed"), ("advance", "free", "pushed", "dissipated", "energies")


class Trace:
    """A clock for each part of a run; what is left of the total is the scheme's, and the saving of frames."""

    def __init__(self) -> None:
        self.seconds = {"chains": 0.0, "structures": 0.0}
        self.calls = {"chains": 0, "structures": 0}
        self.begin = perf_counter()

    def watch(self, interface: Interface) -> Interface:
        """An interface that does the same, and tells this clock."""
        watched = copy(interface)
        watched.chains = tuple(_Watched(chain, CHAINS, self._timed("chains")) for chain in interface.chains)  # type: ignore[misc]
        watched.structures = [_Watched(one, STRUCTURES, self._timed("structures")) for one in interface.structures]
        return watched

    def compiled(self) -> None:
        """The run so far was the compiled loop, which does both sides."""
        self.seconds = {"compiled loop": perf_counter() - self.begin}
        self.calls = {"compiled loop": 1}

    def told(self) -> str:
        """Seconds and calls of each part, as JSON."""
        total = perf_counter() - self.begin
        rest = total - sum(self.seconds.values())
        return json.dumps({"seconds": {**self.seconds, "rest": rest, "total": total}, "calls": self.calls})

    def _timed(self, part: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
        def wrap(work: Callable[..., Any]) -> Callable[..., Any]:
            def timed(*given: Any) -> Any:
                begin = perf_counter()
                try:
                    return work(*given)
                finally:
                    self.seconds[part] += perf_counter() - begin
                    self.calls[part] += 1

            return timed

        return wrap


class _Watched:
    """Another object, some of whose methods are timed."""

    def __init__(self, one: Any, methods: tuple[str, ...], timed: Callable[[Any], Any]) -> None:
        self._one = one
        for name in methods:
            if hasattr(one, name):
                setattr(self, name, timed(getattr(one, name)))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._one, name)
