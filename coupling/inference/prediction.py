"""Predictions of a builder of co-simulations at the sensors of a measured signal, for many values of the unknowns."""

from collections.abc import Callable, Sequence
from itertools import chain
from math import inf, log
from typing import Any, NamedTuple

import numpy as np

from coupling.cosimulation import CoSimulation
from coupling.recording.frames import kept_at
from coupling.results.findings import kind
from coupling.sweeps.batch import Records
from coupling.sweeps.points import shown
from coupling.sweeps.sweep import built_at, check_build
from structures.caution import caution, collected
from structures.checks import positive
from structures.structure import Vector
from structures.units import readable

NUMERICAL = 1e-4  # Numerical error of traces, as a part of the peak; lower noise is not believed.
# Default length of the prediction, in times of a wave through the chain. Later waves depend on chance.
FROM_IMPACT = 4.0
MOST_SAMPLES = 1e6  # Largest number of samples of a trace.


class Range(NamedTuple):
    """An unknown between two values. Its `place` is 0 at the low value and 1 at the high value."""

    name: str
    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """True for ranges of more than a factor of ten: equal steps of the place are then equal factors."""
        return self.low > 0.0 and self.high > 10.0 * self.low

    def value(self, place: float) -> float:
        """Return the value at a place."""
        part = min(max(float(place), 0.0), 1.0)
        linear = self.low + (self.high - self.low) * part
        return float(self.low * (self.high / self.low) ** part) if self.logarithmic else linear

    def place(self, value: float) -> float:
        """Return the place of a value."""
        linear = (value - self.low) / (self.high - self.low)
        return log(value / self.low) / log(self.high / self.low) if self.logarithmic else linear


def length_of(
    build: Callable[..., CoSimulation], ranges: Sequence[Range], until: float | None, example: str, record: float = inf
) -> float:
    """Return the length of the prediction, s: `until`; or if that is None, four times the time of a wave through the
    chain, but not longer than the record, s, or than the time for which the structure was reduced. example: of an
    unknown, for the message if there is none."""
    check_build(build, {unknown.name: None for unknown in ranges}, "unknowns", example)
    if until is not None:
        return positive("until", until, "s")
    middle = {unknown.name: unknown.value(0.5) for unknown in ranges}
    simulation = built_at(build, middle)
    wanted = min(record, FROM_IMPACT * simulation.chain.transit_time)
    valid = min(getattr(body.structure, "valid_until", inf) for body in simulation.interface.structures)
    if valid < 0.75 * wanted:
        caution(
            f"until: the structure was reduced for runs of {readable(valid, 's', 4)}, so that later samples do not "
            f"count; reduce it for {readable(wanted, 's', 4)}"
        )
    return min(wanted, valid)


class Prediction:
    """The dynamic forces at sensors, N, in runs of a builder: sensors × times, from the impact on. The class counts
    runs and failed runs, and keeps the first warning of each kind."""

    def __init__(
        self, build: Callable[..., CoSimulation], ranges: Sequence[Range], sensors: Sequence[int], until: float
    ) -> None:
        self.build, self.ranges, self.sensors, self.until = build, ranges, sensors, until
        self.runs, self.failed, self.reason, self.warnings = 0, 0, "", dict[str, str]()
        self.progress: Any = None
        self._known, self._quick = dict[bytes, Vector](), False
        self.first = self.made(**self.values(np.full(len(ranges), 0.5)))
        # If the builder chooses longer windows or a coarser accuracy, these remain.
        self._quick = self.first.longest_window < 0.999 * self.first.replace(accuracy="screening").longest_window
        self._beads = len(self.first.chain.chain.beads)
        self._kept = kept_at(sensors, self._beads)
        self.contact_time = self.first.interface.contact_time
        # Cubic splines between 48 saved times in the shortest contact have an error of 1e-5 of a pulse.
        self.interval = self.contact_time / 48.0
        if until / self.interval > MOST_SAMPLES:
            raise ValueError(f"until = {until!r} s: is longer than {MOST_SAMPLES:.0e} samples of a trace")
        self.time: Vector = np.asarray(self.interval * np.arange(int(until / self.interval * (1.0 + 1e-9)) + 1))

    def values(self, places: Vector) -> dict[str, float]:
        """Return the unknowns at places from 0 to 1."""
        return {unknown.name: unknown.value(place) for unknown, place in zip(self.ranges, places, strict=True)}

    def made(self, **values: Any) -> CoSimulation:
        """Return the co-simulation for some values of the unknowns."""
        simulation = built_at(self.build, values)
        if self.progress is not None:
            self.progress.update()
        return (simulation.replace(accuracy="screening") if self._quick else simulation).for_run(self.until)

    def trace(self, place: Vector) -> Vector:
        """Return the traces of a run, or raise a ValueError if it fails."""
        trace = self.traces([place])[0]
        if not np.isfinite(trace).all():
            raise ValueError(f"build: its run fails at {shown(self.values(place), self.build)}: {self.reason}")
        return trace

    def traces(self, places: Sequence[Vector]) -> list[Vector]:
        """Return the traces of many runs, NaN for a run that fails. The last 256 are kept and not run again."""
        keys = [place.tobytes() for place in places]
        new = {key: place for key, place in zip(keys, places, strict=True) if key not in self._known}
        if new:
            rows = [self.values(place) for place in new.values()]
            columns: dict[str, Any] = {unknown.name: [row[unknown.name] for row in rows] for unknown in self.ranges}
            with collected() as messages:
                runs = Records(self.made, columns, self.until, self.interval, self._kept, self._beads)
                runs.fill(1)
            force = (runs.force - runs.static[:, None, :]).swapaxes(1, 2)
            row_of = {index + 1: row for row, index in enumerate(self._kept.contacts)}
            # The force of a bead is the mean of those of its two contacts.
            traces = np.stack([0.5 * (force[:, row_of[n]] + force[:, row_of[n + 1]]) for n in self.sensors], axis=1)
            failures = [str(failure) for failure in runs.failures if failure]
            self.runs, self.failed = self.runs + len(rows), self.failed + len(failures)
            self.reason = self.reason or next(iter(failures), "")
            for message in [*messages, *chain.from_iterable(runs.findings)]:
                self.warnings.setdefault(kind(message), message)
            self._known |= dict(zip(new, traces, strict=True))
        found = [self._known[key] for key in keys]
        for old in list(self._known)[:-256]:
            del self._known[old]
        return found
