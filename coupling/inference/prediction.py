"""Predictions of a builder of co-simulations at the sensors of a measured signal, at many values of the unknowns."""

from collections.abc import Callable, Sequence
from math import inf, log
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from coupling.cosimulation import CoSimulation
from coupling.engine import is_compiled
from coupling.inference.settings import SETTINGS
from coupling.plan import valid_until
from coupling.recording.frames import kept_at
from coupling.results.findings import kind
from coupling.sweeps.batch import records
from coupling.sweeps.sweep import built_at, check_build
from structures.caution import caution, collected
from structures.checks import finite, instance, short
from structures.structure import Vector
from structures.units import readable

NUMERICAL = 1e-4
"""Part of the peak to which traces of runs are exact; lower noise is not believed."""

FROM_IMPACT = 4.0
"""Length of the prediction by default, in times that a wave takes through the chain: later waves depend on chance."""


class Range(NamedTuple):
    """An unknown between two values; `place` is 0 at the low one and 1 at the high one."""

    name: str
    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """True if equal places are equal factors: for ranges of more than a factor of ten."""
        return self.low > 0.0 and self.high > 10.0 * self.low

    def value(self, place: float) -> float:
        """Return the value at a place."""
        part = min(max(float(place), 0.0), 1.0)
        if self.logarithmic:
            return float(self.low * (self.high / self.low) ** part)
        return self.low + (self.high - self.low) * part

    def place(self, value: float) -> float:
        """Return the place of a value."""
        if self.logarithmic:
            return log(value / self.low) / log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


def range_of(name: str, ends: Any) -> Range:
    """Return a Range from (low, high)."""
    what = "must be the lowest and the highest value, such as (1e-3, 6e-3)"
    if not isinstance(ends, tuple | list) or len(ends) != 2:
        raise ValueError(f"{name} = {short(ends)}: {what}")
    low, high = (finite(name, end) for end in ends)
    if not low < high:
        raise ValueError(f"{name} = {short(ends)}: has no width; {what}")
    return Range(name, low, high)


def check_samples(name: str, value: float, samples: float) -> None:
    """Refuse records that no memory holds, and that no one compares."""
    if samples > SETTINGS.most_samples:
        raise ValueError(
            f"{name} = {value!r} s: traces would have {samples:.2g} samples; at most {SETTINGS.most_samples:.0e} are "
            "compared"
        )


def usual_length(build: Callable[..., CoSimulation], ranges: Sequence[Range], record: float = inf) -> float:
    """Return the length of the prediction where the user gives none, s: four times what a wave takes through the chain,
    but not longer than a record, s, or than the structure was reduced for."""
    check_build(build, {unknown.name: None for unknown in ranges}, "build", "unknowns")
    middle = {unknown.name: unknown.value(0.5) for unknown in ranges}
    simulation = instance("build(...)", built_at(build, middle), CoSimulation, "a CoSimulation")
    wanted = min(record, FROM_IMPACT * simulation.chain.transit_time)
    valid = min((valid_until(structure) for structure in simulation.interface.structures), default=inf)
    if valid < SETTINGS.shortest_part * wanted:
        caution(
            f"until: the structure was made for runs of {readable(valid, 's', 4)}, so that later samples do not count; "
            f"make it for {readable(wanted, 's', 4)}"
        )
    return min(wanted, valid)


class Prediction:
    """Runs of a builder, as dynamic forces at sensors, N: runs × sensors × times, from the impact on.

    It counts the runs and those that failed, and keeps the first warning of each kind.
    """

    def __init__(
        self, build: Callable[..., CoSimulation], ranges: Sequence[Range], sensors: Sequence[int], until: float
    ) -> None:
        check_build(build, {unknown.name: None for unknown in ranges}, "build", "unknowns")
        self.build, self.ranges, self.sensors, self.until = build, list(ranges), list(sensors), until
        self.runs, self.failed, self.reason, self._said = 0, 0, "", dict[str, str]()
        self.progress: Any = None
        self._known = dict[bytes, Vector]()
        self._quick = False
        self.first = self.made(**self.values(np.full(len(self.ranges), 0.5)))
        # A builder that chooses its windows, or a coarser accuracy, keeps them.
        quick = self.first.replace(accuracy=SETTINGS.accuracy)
        self._quick = self.first.longest_window < 0.999 * quick.longest_window and not self.first.interface.black_boxes
        beads = len(self.first.chain.chain.beads)
        if wrong := [n for n in self.sensors if not 1 <= n <= beads]:
            raise ValueError(f"sensors = {self.sensors!r}: bead {wrong[0]} is not in the chain, which has {beads}")
        self.contact_time = self.first.interface.contact_time
        self.interval = self.contact_time / SETTINGS.saved_per_contact
        check_samples("until", until, until / self.interval)
        self.time: Vector = np.asarray(self.interval * np.arange(int(until / self.interval * (1.0 + 1e-9)) + 1))
        self._compiled = is_compiled(self.first.interface, self.first.scheme)
        self._kept = kept_at(self.sensors, beads)

    @property
    def warnings(self) -> list[str]:
        """The first warning of each kind that runs gave."""
        return list(self._said.values())

    def values(self, places: Vector) -> dict[str, float]:
        """Return the unknowns at places from 0 to 1."""
        return {unknown.name: unknown.value(place) for unknown, place in zip(self.ranges, places, strict=True)}

    def made(self, **values: Any) -> CoSimulation:
        """Return the co-simulation at some values."""
        simulation = instance("build(...)", built_at(self.build, values), CoSimulation, "a CoSimulation")
        if self.progress is not None:
            self.progress.update()
        if len(simulation.interface.chains) > 1:
            raise ValueError("build(...): has several chains; must have one")
        return (simulation.replace(accuracy=SETTINGS.accuracy) if self._quick else simulation).for_run(self.until)

    def traces(self, places: Sequence[Vector]) -> Vector:
        """Return the traces of many runs; NaN for a run that fails."""
        rows = [self.values(place) for place in places]
        self.runs += len(rows)
        with collected() as messages:
            traces = self._together(rows) if self._compiled else np.stack([self._alone(row) for row in rows])
        self.failed += int(np.isnan(traces).all(axis=(1, 2)).sum())
        for message in messages:
            self._said.setdefault(kind(message), message)
        self._known |= {place.tobytes(): trace for place, trace in zip(places, traces, strict=True)}
        for old in list(self._known)[: -SETTINGS.remembered_traces]:
            del self._known[old]
        return traces

    def trace(self, place: Vector) -> Vector:
        """Return the trace of one run; those of the latest places are not run again."""
        known = self._known.get(place.tobytes())
        return self.traces([place])[0] if known is None else known

    def _together(self, rows: list[dict[str, float]]) -> Vector:
        """Return the traces of runs in the compiled loop."""
        columns: dict[str, Any] = {unknown.name: [row[unknown.name] for row in rows] for unknown in self.ranges}
        runs = records(self.made, self.until, self.interval, self._kept, len(self.first.chain.chain.beads), columns)
        for finding in runs.findings:
            caution(finding)
        self.reason = self.reason or next(iter(runs.failures), "")
        return self._forces(runs.force.swapaxes(1, 2), runs.static, [index + 1 for index in self._kept.contacts])

    def _alone(self, row: dict[str, float]) -> Vector:
        """Return the traces of a run that only its own scheme can do, such as one with a user's structure."""
        try:
            run = self.made(**row).run(self.until, save_every=self.interval)
        except (ArithmeticError, RuntimeError, ValueError) as error:
            caution(f"run: failed for {row}: {error}")
            self.reason = self.reason or str(error)
            return np.full((len(self.sensors), self.time.size), np.nan)
        force = run.contact_force.transpose("contact", "time").values
        return self._forces(force, run.static_force.values, run.contact.values.tolist())

    def _forces(self, force: Vector, static: Vector, contacts: list[int]) -> Vector:
        """Return the dynamic forces at the sensors, … × sensors × times, N, from those of contacts."""
        dynamic, places = force - static[..., None], {n: k for k, n in enumerate(contacts)}
        forces = [0.5 * (dynamic[..., places[n], :] + dynamic[..., places[n + 1], :]) for n in self.sensors]
        return np.stack(forces, axis=-2)

    def slopes(self, place: Vector, here: Vector, steps: Vector, central: bool = True) -> Vector:
        """Return the derivatives of the traces by the places, from one batch: unknowns × sensors × times.

        here: the traces at this place. Central differences, one-sided at an end of a range; else all are one-sided.
        """
        above, size = np.minimum(place + steps, 1.0), place.size
        below = np.maximum(place - steps, 0.0) if central else np.where(above > place, place, place - steps)
        ends = np.stack([below, above], axis=1)
        moved = [(k, i) for k in range(size) for i in range(2) if ends[k, i] != place[k]]
        runs = self.traces([np.where(np.arange(size) == k, ends[k, i], place) for k, i in moved])
        traces = np.tile(here, (size, 2, 1, 1))
        for (k, i), run in zip(moved, runs, strict=True):
            traces[k, i] = run
        slopes: Vector = (traces[:, 1] - traces[:, 0]) / (above - below)[:, None, None]
        return slopes


class Curves:
    """Traces between their samples, over the last axis; zero before the impact, and constant after their end."""

    def __init__(self, traces: Vector, interval: float) -> None:
        self._end = interval * (traces.shape[-1] - 1)
        self._spline = CubicSpline(interval * np.arange(traces.shape[-1]), traces, axis=-1)

    def at(self, moments: Vector) -> Vector:
        """Return the values at moments after the impact, s."""
        values: Vector = self._spline(np.clip(moments, 0.0, self._end)) * (moments >= 0.0)
        return values

    def rates(self, moments: Vector) -> Vector:
        """Changes with time there."""
        inside = (moments >= 0.0) & (moments <= self._end)
        rates: Vector = self._spline(np.clip(moments, 0.0, self._end), 1) * inside
        return rates
