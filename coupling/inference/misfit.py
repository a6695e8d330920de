"""The misfit of predicted and measured traces, for any gain, offset, time zero and time constant of the sensors.

Gains and offsets enter linearly, so the best ones follow from the others, and are projected out of the residual
(variable projection, in Kaufman's approximation of the derivative).
"""

from collections.abc import Sequence
from copy import copy
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.fft import irfft, next_fast_len, rfft

from coupling.inference.disturbances import Disturbance, Whitener, whitener
from coupling.inference.prediction import NUMERICAL, Curves, Prediction, high_passed
from structures.structure import Vector

GAIN, OFFSET, TIME_ZERO, TIME_CONSTANT = "gain", "offset", "time_zero", "time_constant"

OF_SENSORS = (GAIN, OFFSET, TIME_ZERO, TIME_CONSTANT)
"""Nuisances that belong to the sensors, not to the builder."""

BASELINE = "baseline"
"""What is fitted as hum and drift, in the data of an identification."""

LONGEST_TIME_CONSTANT, SHORTEST_TIME_CONSTANT, USUAL_TIME_CONSTANT = 10.0, 1e-5, 1e-2
"""s; that of a search's start is the last one."""

UNDERESTIMATED = 1.5
"""χ² over its expectation that may come from noise that was estimated too low."""

NEAR, CLOSE = 0.2, 0.3
"""The last derivatives serve as far as this part of each range, where they predict the change to within this part."""

INVISIBLE = 1.0
"""χ² of what the last derivatives lack to the traces here, below which they serve as they are."""

FAILED = 1e6
"""The residual of a run that failed, so that a search turns back."""


_Slopes = tuple[Vector, Vector, Vector, Vector]
"""What was asked for, places, traces there, and their derivatives."""


class Measured(NamedTuple):
    """A signal: times (s), forces (sensors × times, N; NaN where left out), sensors, the noise of each (N),
    whether the noise was given, not estimated, the samples of each quiet lead, and what it shows besides white noise.
    """

    time: Vector
    force: Vector
    sensors: list[int]
    noise: Vector
    given: bool = False
    leads: Sequence[int] = ()
    disturbances: Sequence[Disturbance | None] = ()

    def disturbance(self, row: int) -> Disturbance | None:
        """Return the disturbance of a sensor."""
        return self.disturbances[row] if self.disturbances else None

    @property
    def size_known(self) -> bool:
        """True if the noise was given, and is white."""
        return self.given and not any(shown is not None and shown.memory.size for shown in self.disturbances)

    @property
    def step(self) -> float:
        """The time between samples, s."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)


class Point(NamedTuple):
    """The misfit at one point of a search.

    p: places of the unknowns, time zero in contact times, logarithm of the time constant, as far as they are free.
    residual: (measured − predicted)/noise, sensor by sensor; projected: derivatives of it, with gains and offsets
    projected out; columns: all derivatives of what is predicted, over noise; sizes: samples of each sensor.
    """

    p: Vector
    residual: Vector
    projected: Vector
    columns: Vector
    gains: Vector
    offsets: Vector
    fitted: list[Vector]

    @property
    def misfit(self) -> float:
        """χ²: the sum of squares."""
        return float(self.residual @ self.residual)


class Misfit:
    """Compares predictions with a measured signal, up to `until` s after the impact."""

    of_traces_alone = True
    """Whether all samples of traces are compared, so that small errors of a trace change it little."""

    def __init__(self, prediction: Prediction, measured: Measured, nuisances: Sequence[str], until: float) -> None:
        self.prediction, self.measured, self.until = prediction, measured, until
        self.free = [name for name in OF_SENSORS if name in nuisances]
        self.size = len(prediction.ranges)
        self.unit = prediction.contact_time
        self.used = [np.isfinite(force) for force in measured.force]
        """The samples of each sensor that count; `keep_window` leaves out those before and after the prediction."""
        self._whiteners = self._new_whiteners()
        self._last_slopes: _Slopes | None = None
        self._central_slopes: _Slopes | None = None
        self._spectrum: Any = None
        self.reused = False
        """Whether the derivatives asked for last are earlier ones with the secant."""

    def on(self, prediction: Prediction) -> "Misfit":
        """Return the same misfit of other predictions."""
        other = copy(self)
        other.prediction = prediction
        other.forget_slopes()
        return other

    def _new_whiteners(self) -> list[Whitener]:
        measured = self.measured
        leads = [0] * len(self.used) if OFFSET in self.free else measured.leads or [0] * len(self.used)
        return [
            whitener(measured.disturbance(row), float(measured.noise[row]), used, leads[row])
            for row, used in enumerate(self.used)
        ]

    @property
    def names(self) -> list[str]:
        """The names of the parameters in the order of `Point.columns`."""
        shared = [name for name in (TIME_ZERO, TIME_CONSTANT) if name in self.free]
        of_sensors = [f"{name} {n}" for n in self.measured.sensors for name in (GAIN, OFFSET) if name in self.free]
        return [*(unknown.name for unknown in self.prediction.ranges), *shared, *of_sensors]

    @property
    def samples(self) -> int:
        """The number of them that count."""
        return int(sum(used.sum() for used in self.used))

    def explains(self, misfit: float, p: Vector) -> bool:
        """Return whether the residual at p, of this χ², is that of noise, so that a search may end.

        The size of noise that was estimated is not known well enough for χ² alone to say no.
        """
        degrees = self.samples - self.size - len(self.names)
        if degrees < 1 or misfit < degrees + 4.0 * np.sqrt(2.0 * degrees):
            return True
        unknown = not self.measured.given and misfit < UNDERESTIMATED * degrees
        return unknown and self.is_white(self.residual(p))

    def is_numerical(self, residual: Vector) -> bool:
        """Return whether it is within what runs are exact to, at each sensor, as where a run is taken for a signal."""
        begin = 0
        for used, force, noise in zip(self.used, self.measured.force, self.measured.noise, strict=True):
            part = residual[begin : begin + int(used.sum())] * noise
            begin += part.size
            if np.sqrt((part**2).mean()) > NUMERICAL * np.nanmax(abs(force)):
                return False
        return True

    def is_white(self, residual: Vector) -> bool:
        """Return whether it is not correlated over a contact time: Ljung and Box's sum, four standard deviations."""
        correlations = self._correlations(residual)
        count = float(sum(along.size for _, along in correlations))
        total = float(sum(size * (along**2).sum() for size, along in correlations))
        return total < count + 4.0 * float(np.sqrt(2.0 * count))

    def drifts(self, residual: Vector) -> bool:
        """Return whether its correlations over a contact time are positive together, by four standard deviations.

        So are those of an offset, hum or drift of a sixth of the noise, which the sum of squares does not see.
        """
        correlations = self._correlations(residual)
        count = float(sum(along.size for _, along in correlations))
        return float(sum(np.sqrt(size) * along.sum() for size, along in correlations)) > 4.0 * float(np.sqrt(count))

    def _correlations(self, residual: Vector) -> list[tuple[int, Vector]]:
        """Return the samples of each sensor, and their correlations over the steps of a contact time."""
        correlations, begin = list[tuple[int, Vector]](), 0
        lags = max(2, int(self.unit / self.measured.step))
        for used in self.used:
            part = residual[begin : begin + int(used.sum())]
            begin += part.size
            correlations.append(
                (part.size, np.array([part[lag:] @ part[:-lag] for lag in range(1, lags + 1)]) / (part @ part))
            )
        return correlations

    def bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds of p."""
        low, high = [0.0] * self.size, [1.0] * self.size
        if TIME_ZERO in self.free:
            low.append((self.measured.time[0] - self.until) / self.unit)
            high.append(float(self.measured.time[-1]) / self.unit)
        if TIME_CONSTANT in self.free:
            low.append(np.log(SHORTEST_TIME_CONSTANT))
            high.append(np.log(LONGEST_TIME_CONSTANT))
        return np.array(low), np.array(high)

    def keep_window(self, time_zero: float) -> None:
        """Count only samples up to `until` after the impact; those before it show nothing but the offset, and what else
        disturbs a sensor."""
        moments = self.measured.time - time_zero
        self.used = [
            np.isfinite(force)
            & (moments <= self.until)
            & ((moments >= -self.unit) | (self.measured.disturbance(row) is not None))
            for row, force in enumerate(self.measured.force)
        ]
        self._whiteners = self._new_whiteners()
        if self.samples <= self.size + len(self.names):
            raise ValueError("signal: no samples after the impact; check the times, or name time_zero as a nuisance")

    def refresh(self, p: Vector, final: bool = True) -> None:
        """Adapt to noise near p; noise does not bias a waveform."""

    def start(self, places: Vector, traces: Vector) -> tuple[Vector, float]:
        """Return p with the time zero that suits these traces best, and its misfit."""
        p = list(places)
        if TIME_CONSTANT in self.free:
            traces = high_passed(traces, self.prediction.interval, USUAL_TIME_CONSTANT)
        curves = self.prediction.curves(traces)
        if TIME_ZERO in self.free:
            p.append(self._time_zero(curves) / self.unit)
        if TIME_CONSTANT in self.free:
            p.append(np.log(USUAL_TIME_CONSTANT))
        residual = np.concatenate(self._compared(np.array(p), curves))
        return np.array(p), float(residual @ residual)

    def start_at(self, places: Vector) -> Vector:
        """Return p for a signal whose time zero is the impact."""
        others = {TIME_ZERO: 0.0, TIME_CONSTANT: float(np.log(USUAL_TIME_CONSTANT))}
        return np.array([*places, *(others[name] for name in others if name in self.free)])

    def _time_zero(self, curves: Curves) -> float:
        """Return time zero by cross-correlation, to a sample, then to a part of it by a parabola."""
        step, total = self.measured.step, np.zeros(1)
        grid = np.arange(0.0, self.until, step)
        count = self.measured.time.size + grid.size - 1
        length = next_fast_len(count, real=True)
        if self._spectrum is None:
            self._spectrum = rfft(np.where(np.isfinite(self.measured.force), self.measured.force, 0.0), length)
        for force, noise, shape in zip(self._spectrum, self.measured.noise, curves.at(grid), strict=True):
            along, square = irfft(force * rfft(shape[::-1], length), length)[:count], float(shape @ shape)
            if square > 0.0:
                # A sensor whose wires are turned has a negative gain.
                gained = along**2 / square if GAIN in self.free else 2.0 * along - square
                total = total + gained / noise**2
        best = int(np.argmax(total))
        shift = 0.0
        if 0 < best < total.size - 1:
            left, here, right = total[best - 1 : best + 2]
            bend = left - 2.0 * here + right
            shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
        return float(self.measured.time[0] + step * (best - (grid.size - 1) + shift))

    def _compared(self, p: Vector, curves: Curves) -> list[Vector]:
        """Return the residuals of each sensor at p. curves: behind the high-pass."""
        shapes = curves.at(self.measured.time - self.time_zero(p))
        residuals = []
        for row, shape in enumerate(shapes):
            residuals.append(self._fitted(row, shape[self.used[row]])[0])
        return residuals

    def _fitted(self, row: int, shape: Vector) -> tuple[Vector, float, float, Vector]:
        """Return the white residual over noise, gain, offset, and an orthonormal basis of what they can change."""
        force, noise = self.measured.force[row][self.used[row]], float(self.measured.noise[row])
        columns, white = [], self._whiteners[row]
        if GAIN in self.free:
            columns.append(shape)
        if OFFSET in self.free:
            columns.append(np.ones_like(shape))
        rest = force if GAIN in self.free else force - shape
        if not columns or not shape @ shape > 0.0:  # squares of the last digits of a trace at rest are zero
            return white((force - shape) / noise), 1.0, 0.0, np.zeros((shape.size, 0))
        columns = [white(column) for column in columns]
        if len(columns) == 1:  # without the linear algebra, which takes longer than all else
            size = float(np.linalg.norm(columns[0]))
            basis, corner = columns[0][:, None] / size, np.array([[size]])
        else:
            basis, corner = np.linalg.qr(np.stack(columns, axis=1))
        along = basis.T @ white(rest)
        parts = along / corner[0] if len(columns) == 1 else np.linalg.lstsq(corner, along, rcond=None)[0]
        gain = float(parts[0]) if GAIN in self.free else 1.0
        offset = float(parts[-1]) if OFFSET in self.free else 0.0
        return white((force - gain * shape - offset) / noise), gain, offset, basis

    def time_zero(self, p: Vector) -> float:
        """Return s, in the signal's own time."""
        return float(p[self.size]) * self.unit if TIME_ZERO in self.free else 0.0

    def time_constant(self, p: Vector) -> float | None:
        """Return s."""
        return float(np.exp(p[-1])) if TIME_CONSTANT in self.free else None

    def _passed(self, traces: Vector, p: Vector, factor: float = 1.0) -> Vector:
        constant = self.time_constant(p)
        return traces if constant is None else high_passed(traces, self.prediction.interval, factor * constant)

    def _traces(self, p: Vector) -> Vector:
        """Return the traces of p, from one run, or from one that was done."""
        return self.prediction.trace(p[: self.size])

    def _slopes(self, p: Vector, traces: Vector, steps: Vector, rough: bool) -> Vector:
        """Return the derivatives of the traces by the places; where a search ends, what follows it asks for those that
        it had last. Rough ones are the last ones with the secant, where these nearly predict the traces."""
        places = p[: self.size]
        asked = np.concatenate([places, steps, [rough]])
        if self._last_slopes is None or not np.array_equal(self._last_slopes[0], asked):
            slopes = self._secant(places, traces) if rough and self.prediction.costs_runs else None
            self.reused = slopes is not None
            if slopes is None:
                slopes = self.prediction.slopes(places, traces, steps, rough)
            self._last_slopes = asked, places, traces, slopes
            if not rough:
                self._central_slopes = self._last_slopes
        return self._last_slopes[-1]

    def forget_slopes(self) -> None:
        """Compute the next derivatives anew."""
        self._last_slopes, self._central_slopes, self.reused = None, None, False

    def _secant(self, places: Vector, traces: Vector) -> Vector | None:
        """Return the last derivatives, changed as little as the traces here demand (Broyden); None where they fail."""
        for known in (self._last_slopes, self._central_slopes):
            if known is not None and (slopes := self._secant_from(known, places, traces)) is not None:
                return slopes
        return None

    def _secant_from(self, known: "_Slopes", places: Vector, traces: Vector) -> Vector | None:
        """Return some derivatives at other places, where those known nearly predict the traces."""
        _, before, there, slopes = known
        move, change = places - before, traces - there
        lacking = change - np.tensordot(move, slopes, 1)
        noise = self.measured.noise * abs(traces).max(axis=-1) / np.nanmax(abs(self.measured.force), axis=-1)
        if self.samples * ((lacking / noise[:, None]) ** 2).mean() < INVISIBLE:
            return slopes
        if not move.any() or abs(move).max() > NEAR or np.linalg.norm(lacking) > CLOSE * np.linalg.norm(change):
            return None
        return np.asarray(slopes + move[:, None, None] * lacking / (move @ move))

    def of_traces(self, p: Vector, traces: Vector) -> float:
        """Return χ² of traces at p; infinite for a run that failed."""
        if not np.isfinite(traces).all():
            return np.inf
        residual = np.concatenate(self._compared(p, self.prediction.curves(self._passed(traces, p))))
        return float(residual @ residual)

    def residual(self, p: Vector) -> Vector:
        """Return the residual at p, from one run."""
        traces = self._traces(p)
        if not np.isfinite(traces).all():
            return np.full(self.samples, FAILED)
        return np.concatenate(self._compared(p, self.prediction.curves(self._passed(traces, p))))

    def at(self, p: Vector, steps: Vector, rough: bool = False) -> Point:
        """Return all of the misfit at p; steps: of the places, for the derivatives; rough: these to first order."""
        traces = self._traces(p)
        slopes = self._slopes(p, traces, steps, rough)
        if not (np.isfinite(traces).all() and np.isfinite(slopes).all()):
            raise FloatingPointError("a run beside the solution failed")
        return self.point(p, traces, slopes)

    def beside(self, p: Vector) -> Point:
        """Return all of the misfit at p, which is so near to the point asked for last that its derivatives serve."""
        assert self._last_slopes is not None
        return self.point(p, self._traces(p), self._last_slopes[-1])

    def point(self, p: Vector, traces: Vector, slopes: Vector) -> Point:
        """Return all of the misfit from runs that are known. slopes: of the traces with the places."""
        sensors = len(self.measured.sensors)
        residuals, projected, full, gains, offsets, fitted = [], [], [], [], [], []
        moments = self.measured.time - self.time_zero(p)
        curves = self.prediction.curves(self._passed(traces, p))
        shapes, rates = curves.at(moments), curves.rates(moments)
        changes = [self.prediction.curves(self._passed(slopes, p)).at(moments)] if self.size else []
        if TIME_ZERO in self.free:
            changes.append(-self.unit * rates[None])
        if TIME_CONSTANT in self.free:
            later, earlier = (self._passed(traces, p, factor) for factor in (1.001, 0.999))
            changes.append(self.prediction.curves((later - earlier)[None] / 2e-3).at(moments))
        bent = np.concatenate(changes)
        nuisances = sum(name in self.free for name in (GAIN, OFFSET))
        for row, used in enumerate(self.used):
            noise, white = float(self.measured.noise[row]), self._whiteners[row]
            shape = shapes[row][used]
            residual, gain, offset, basis = self._fitted(row, shape)
            nonlinear = white(gain * bent[:, row, used].T / noise)
            linear = np.zeros((shape.size, nuisances * sensors))
            if GAIN in self.free:
                linear[:, nuisances * row] = white(shape / noise)
            if OFFSET in self.free:
                linear[:, nuisances * row + nuisances - 1] = white(np.full(shape.size, 1.0 / noise))
            residuals.append(residual)
            projected.append(-(nonlinear - basis @ (basis.T @ nonlinear)))
            full.append(np.hstack([nonlinear, linear]))
            gains.append(gain)
            offsets.append(offset)
            fitted.append(gain * shape + offset)
        return Point(
            p, np.concatenate(residuals), np.concatenate(projected), np.concatenate(full), np.array(gains),
            np.array(offsets), fitted,
        )  # fmt: skip

    def of_record(self, point: Point, row: int) -> Vector:
        """Return what the fit leaves of a sensor's record over noise, up to the last sample that counts: also of what
        comes before the impact; NaN elsewhere."""
        used, force = self.used[row], self.measured.force[row]
        left: Vector = (force - float(point.offsets[row])) / float(self.measured.noise[row])
        begin = sum(int(other.sum()) for other in self.used[:row])
        left[used] = point.residual[begin : begin + int(used.sum())]
        left[int(np.flatnonzero(used)[-1]) + 1 :] = np.nan
        return left

    def slow(self, point: Point, row: int) -> Vector:
        """Return the likeliest hum and drift of a sensor over all times, N."""
        noise, used = float(self.measured.noise[row]), self.used[row]
        return noise * self._whiteners[row].slow((self.measured.force[row][used] - point.fitted[row]) / noise)

    def data(self, point: Point) -> xr.Dataset:
        """Return what was measured and what is fitted, over sensor and time."""
        measured = self.measured
        fitted = np.full(measured.force.shape, np.nan)
        slow = np.stack([self.slow(point, row) for row in range(len(self.used))])
        for row, (used, values) in enumerate(zip(self.used, point.fitted, strict=True)):
            fitted[row, used] = values + slow[row, used]
        newton = {"units": "N"}
        return xr.Dataset(
            ({BASELINE: (("sensor", "time"), slow, newton)} if slow.any() else {})
            | {
                "measured": (("sensor", "time"), measured.force, newton),
                "fitted": (("sensor", "time"), fitted, newton),
                "residual": (("sensor", "time"), measured.force - fitted, newton),
                "noise": ("sensor", measured.noise, newton),
            },
            {"time": ("time", measured.time, {"units": "s"}), "sensor": measured.sensors},
        )
