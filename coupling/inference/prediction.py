"""Predictions of a builder of co-simulations for the sensors of a measured signal, at many values of the unknowns."""

from collections.abc import Callable, Sequence
from math import inf, log
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from coupling.cosimulation import CoSimulation
from coupling.engine import is_compiled
from coupling.plan import valid_until
from coupling.recording.frames import kept_at
from coupling.results.ar_and_tof import reflections
from coupling.results.findings import kind
from coupling.results.waves import ReflectedWave
from coupling.signals.signals import as_signal
from coupling.sweeps.batch import records
from coupling.sweeps.progress import Progress
from coupling.sweeps.sweep import built_at, check_build
from structures.caution import caution, collected
from structures.checks import finite, instance, short
from structures.structure import Vector
from structures.units import readable

SAVED_PER_CONTACT = 48.0
"""Saved times in the shortest contact: cubic splines between them are exact to 1e-5 of a pulse."""

WIDE = 10.0
"""A range whose ends differ by more than this factor is searched by its logarithm."""

ACCURACY = "screening"
"""Of the runs: traces differ by 1e-4 of their peak from runs with the default accuracy."""

MOST_SAMPLES = 1e6
"""Of the trace of a sensor: a record of a second."""

REMEMBERED = 1e6
"""Samples of the latest runs that are kept, as searches start at points of a scan, and at ends of other searches."""

NUMERICAL = 1e-4
"""That difference; noise below it is not believed."""

EARLY = 0.8
"""A wave comes back after this part of the time that theory gives: in compressed chains after 0.86 or more."""

FROM_IMPACT = 4.0
"""Length of the prediction by default, in times that a wave takes through the chain: later ones depend on chance."""

SHORT = 0.75
"""A structure made for less than this part of that length is warned of; a record may hold so long a lead."""


class Range(NamedTuple):
    """An unknown between two values; `place` is 0 at the low one and 1 at the high one."""

    name: str
    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """True if equal places are equal factors."""
        return self.low > 0.0 and self.high > WIDE * self.low

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

    def slope(self, place: float) -> float:
        """Change of the value with the place."""
        return self.value(place) * log(self.high / self.low) if self.logarithmic else self.high - self.low


def range_of(name: str, ends: Any) -> Range:
    """Return a Range from (low, high), or raise a ValueError."""
    what = "must be the lowest and the highest value, such as (1e-3, 6e-3)"
    if not isinstance(ends, tuple | list) or len(ends) != 2:
        raise ValueError(f"{name} = {short(ends)}: {what}")
    low, high = (finite(name, end) for end in ends)
    if not low < high:
        raise ValueError(f"{name} = {short(ends)}: has no width; {what}")
    return Range(name, low, high)


def check_samples(name: str, value: float, samples: float) -> None:
    """Refuse records that no memory holds, and that no one compares."""
    if samples > MOST_SAMPLES:
        raise ValueError(
            f"{name} = {value!r} s: traces would have {samples:.2g} samples; at most {MOST_SAMPLES:.0e} are compared"
        )


def usual_length(build: Callable[..., CoSimulation], ranges: Sequence[Range], record: float = inf) -> float:
    """Return the length of the prediction where the user gives none, s: four times what a wave takes through the chain,
    but not longer than a record, s, or than the structure was reduced for."""
    check_build(build, {unknown.name: None for unknown in ranges}, "build", "unknowns")
    middle = {unknown.name: unknown.value(0.5) for unknown in ranges}
    simulation = instance("build(...)", built_at(build, middle), CoSimulation, "a CoSimulation")
    wanted = min(record, FROM_IMPACT * simulation.chain.transit_time)
    valid = min((valid_until(structure) for structure in simulation.interface.structures), default=inf)
    if valid < SHORT * wanted:
        caution(
            f"until: the structure was made for runs of {readable(valid, 's', 4)}, so that later samples do not count; "
            f"make it for {readable(wanted, 's', 4)}"
        )
    return min(wanted, valid)


class Prediction:
    """Runs of a builder, as traces at sensors: runs × sensors × times, N, from the impact on.

    build: makes a CoSimulation of one chain from the unknowns. until: length of the traces, s. It counts the runs, and
    collects the warnings that they gave.
    """

    costs_runs = True

    def __init__(
        self, build: Callable[..., CoSimulation], ranges: Sequence[Range], sensors: Sequence[int], until: float
    ) -> None:
        check_build(build, {unknown.name: None for unknown in ranges}, "build", "unknowns")
        self.build, self.ranges, self.sensors, self.until = build, list(ranges), list(sensors), until
        self.runs, self.failed, self._said = 0, 0, dict[str, str]()
        self.reason = ""
        """Why the first run failed that did."""
        self.progress: Progress | None = None
        self._last = dict[bytes, Vector]()
        self._quick = False
        self.first = self.made(**self.values(np.full(len(self.ranges), 0.5)))
        # A builder that chooses its windows, or a coarser accuracy, keeps them.
        quick = self.first.replace(accuracy=ACCURACY)
        self._quick = self.first.longest_window < 0.999 * quick.longest_window and not self.first.interface.black_boxes
        beads = len(self.first.chain.chain.beads)
        if wrong := [n for n in self.sensors if not 1 <= n <= beads]:
            raise ValueError(f"sensors = {self.sensors!r}: bead {wrong[0]} is not in the chain, which has {beads}")
        self.contact_time = self.first.interface.contact_time
        self.interval = self.contact_time / SAVED_PER_CONTACT
        check_samples("until", until, until / self.interval)
        self.time = self.interval * np.arange(int(until / self.interval * (1.0 + 1e-9)) + 1)
        self._compiled = is_compiled(self.first.interface, self.first.scheme)
        self._kept = kept_at(self.sensors, beads)

    def waves(self, time: Vector, forces: Vector, sensors: Sequence[int]) -> Vector:
        """Return AR and TOF (s) of the primary, then of the secondary wave, sensor by sensor; NaN where a wave is
        missing.

        What comes before a wave can have run to the structure and back is the tail of the incident one.
        """
        moving = self.first.chain
        hop = moving.transit_time / (beads := len(moving.chain.beads))
        features = list[float]()
        with collected():
            signal = as_signal(time, dict(zip(sensors, forces, strict=True)))
            for n in sensors:
                waves = reflections(signal, n, earliest=EARLY * 2.0 * (beads - n) * hop)
                for wave in (waves.primary, waves.secondary):
                    features += (
                        [wave.amplitude_ratio, wave.time_of_flight] if isinstance(wave, ReflectedWave) else [np.nan] * 2
                    )
        return np.array(features)

    def primaries(self, time: Vector, forces: Vector, sensors: Sequence[int]) -> Vector:
        """Return the same of the primary waves alone."""
        primaries: Vector = self.waves(time, forces, sensors).reshape(-1, 2, 2)[:, 0].ravel()
        return primaries

    @property
    def warnings(self) -> list[str]:
        """The first warning of each kind that runs gave."""
        return list(self._said.values())

    def values(self, places: Vector) -> dict[str, float]:
        """Return the unknowns at places from 0 to 1."""
        return {unknown.name: unknown.value(place) for unknown, place in zip(self.ranges, places, strict=True)}

    def stage(self, name: str) -> None:
        """Show the user what the next runs are for."""
        if self.progress is not None:
            self.progress.stage(name)

    def made(self, **values: Any) -> CoSimulation:
        simulation = instance("build(...)", built_at(self.build, values), CoSimulation, "a CoSimulation")
        if self.progress is not None:
            self.progress.advance()
        if len(simulation.interface.chains) > 1:
            raise ValueError("build(...): has several chains; must have one")
        return (simulation.replace(accuracy=ACCURACY) if self._quick else simulation).for_run(self.until)

    def traces(self, places: Sequence[Vector]) -> Vector:
        """Return the forces at the sensors, N, runs × sensors × times; NaN for a run that fails."""
        rows = [self.values(place) for place in places]
        self.runs += len(rows)
        with collected() as messages:
            traces = self._together(rows) if self._compiled else np.stack([self._alone(row) for row in rows])
        self.failed += int(np.isnan(traces).all(axis=(1, 2)).sum())
        self._last |= {place.tobytes(): trace for place, trace in zip(places, traces, strict=True)}
        for old in list(self._last)[: -max(1, int(REMEMBERED / traces[0].size))]:
            del self._last[old]
        for message in messages:
            self._said.setdefault(kind(message), message)
        return traces

    def curves(self, traces: Vector) -> "Curves":
        """Return traces between their samples."""
        return Curves(traces, self.interval)

    def trace(self, places: Vector) -> Vector:
        """Return the forces of one run, N, sensors × times; of those done lately without another run."""
        return self.known_traces([places])[0]

    def known_traces(self, places: Sequence[Vector]) -> list[Vector]:
        """Return the traces of runs; those done lately are not run again."""
        known = {key: self._last[key] for place in places if (key := place.tobytes()) in self._last}
        if others := [place for place in places if place.tobytes() not in known]:
            known |= {place.tobytes(): trace for place, trace in zip(others, self.traces(others), strict=True)}
        return [known[place.tobytes()] for place in places]

    def _together(self, rows: list[dict[str, float]]) -> Vector:
        """Return the traces of many runs in the compiled loop."""
        # A function without unknowns is of no use, so there is at least one.
        columns: dict[str, Any] = {unknown.name: [row[unknown.name] for row in rows] for unknown in self.ranges}
        runs = records(self.made, self.until, self.interval, self._kept, len(self.first.chain.chain.beads), columns)
        for finding in runs.findings:
            caution(finding)
        self.reason = self.reason or next(iter(runs.failures), "")
        # Runs × times × contacts.
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

    def slopes(self, places: Vector, here: Vector, steps: Vector, rough: bool = False) -> Vector:
        """Changes of the traces with the place of each unknown: unknowns × sensors × times. here: the traces.

        By central differences over ± steps, all in one batch; at the end of a range by one-sided ones of second order.
        rough: by one-sided ones of first order, for half the runs.
        """
        size, points = places.size, list[Vector]()
        nodes: list[tuple[int, tuple[float, ...], tuple[float, ...]]] = []
        offsets: tuple[float, ...]
        weights: tuple[float, ...]
        for k in range(size):
            step = steps[k]
            if rough:
                shift = step if places[k] + step <= 1.0 else -step
                offsets, weights = (0.0, shift), (-step / shift, step / shift)
            elif places[k] - step < 0.0:
                # At an end of the range three points on one side, of second order as the central difference.
                offsets, weights = (0.0, step, 2.0 * step), (-1.5, 2.0, -0.5)
            elif places[k] + step > 1.0:
                offsets, weights = (0.0, -step, -2.0 * step), (1.5, -2.0, 0.5)
            else:
                offsets, weights = (-step, step), (-0.5, 0.5)
            nodes.append((len(points), offsets, weights))
            for offset in offsets:
                if offset != 0.0:
                    points.append(places + offset * np.eye(size)[k])
        traces = self.traces(points)
        slopes = np.zeros((size, *here.shape))
        for k, (first, offsets, weights) in enumerate(nodes):
            place = first
            for offset, weight in zip(offsets, weights, strict=True):
                slopes[k] += weight / steps[k] * (here if offset == 0.0 else traces[place])
                place += offset != 0.0
        return slopes


def high_passed(trace: Vector, interval: float, time_constant: float) -> Vector:
    """A trace behind an RC high-pass of a time constant, s; exact for a force that is straight between samples."""
    decay = np.exp(-interval / time_constant)
    # y′ + y/τ = x′, solved exactly with x′ constant between two samples.
    gain = (1.0 - decay) * time_constant / interval
    passed: Vector = lfilter([gain, -gain], [1.0, -decay], trace, axis=-1)
    return passed


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
