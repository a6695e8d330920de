"""The misfit of predicted and measured traces, for any gain, offset and time zero of the sensors.

Gains enter linearly, so the best ones follow from the others, and are projected out of the residual (variable
projection, in Kaufman's approximation of the derivative). So is what a sensor reads as offset, hum and drift.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.signal import lfilter

from coupling.inference.measured import Measured, Sensor
from coupling.inference.prediction import NUMERICAL, Curves, Prediction
from structures.structure import Vector

GAIN, OFFSET, TIME_ZERO = "gain", "offset", "time_zero"

OF_SENSORS = (GAIN, OFFSET, TIME_ZERO)
"""Nuisances that belong to the sensors, not to the builder."""

FAILED = 1e6
"""The residual of a run that failed, so that a search turns back."""


class Point(NamedTuple):
    """The misfit at one point of a search.

    p: places of the unknowns, and time zero in contact times, if it is free.
    residual: white, over the noise, sensor by sensor; projected: its derivatives with gains and offsets projected out;
    columns: the derivatives of what is predicted by all parameters, over the noise; fitted: N, of each sensor, without
    its baseline.
    """

    p: Vector
    residual: Vector
    projected: Vector
    columns: Vector
    gains: Vector
    fitted: list[Vector]

    @property
    def misfit(self) -> float:
        """χ²: the sum of squares."""
        return float(self.residual @ self.residual)


class Misfit:
    """Compares predictions with a measured signal, up to `until` s after the impact."""

    def __init__(self, prediction: Prediction, measured: Measured, nuisances: Sequence[str], until: float) -> None:
        self.prediction, self.measured, self.until = prediction, measured, until
        self.free = [name for name in OF_SENSORS if name in nuisances]
        self.size, self.unit = len(prediction.ranges), prediction.contact_time
        self.count(measured)

    def count(self, measured: Measured, time_zero: float | None = None) -> None:
        """Count the samples of a signal that are no NaN; those up to the end of the prediction after `time_zero`, s.

        Samples before the impact show the baseline, so they count where the lead is quiet.
        """
        self.measured, self.used = measured, list[NDArray[np.bool_]]()
        self._bases, self._forces, moments = list[Vector](), list[Vector](), measured.time - (time_zero or 0.0)
        for row, sensor in enumerate(measured.sensors):
            used = np.isfinite(sensor.force)
            if time_zero is not None:
                used &= (moments >= -(self.until if sensor.lead else self.unit)) & (moments <= self.until)
            self.used.append(used)
            self._bases.append(np.zeros((int(used.sum()), 0)))
            self._bases[row] = np.linalg.qr(self._clean(row, self._baseline(sensor)[used].T).T)[0]
            self._forces.append(self._clean(row, sensor.force[used]))
        if self.samples <= len(self.names):
            raise ValueError("signal: no samples after the impact; check the times, or name time_zero as a nuisance")

    def _baseline(self, sensor: Sensor) -> Vector:
        """Return the shapes of offset, hum and drift: times × polynomials."""
        time, terms = self.measured.time, max(sensor.baseline, int(OFFSET in self.free))
        return legvander(2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0, max(terms - 1, 0))[:, :terms]

    def _clean(self, row: int, values: Vector) -> Vector:
        """Return values over the samples of a sensor such that their noise is white and of size 1, without baseline."""
        sensor, basis = self.measured.sensors[row], self._bases[row]
        if sensor.memory.size:
            white = lfilter(np.append(1.0, -sensor.memory), [1.0], values, axis=-1) / sensor.step
            white[..., : sensor.memory.size] *= sensor.step / sensor.noise
        else:
            white = values / sensor.noise
        return np.asarray(white - (white @ basis) @ basis.T if basis.size else white)

    @property
    def names(self) -> list[str]:
        """The names of the parameters in the order of `Point.columns`."""
        shared = [TIME_ZERO] if TIME_ZERO in self.free else []
        gains = [f"{GAIN} {sensor.bead}" for sensor in self.measured.sensors if GAIN in self.free]
        return [*(unknown.name for unknown in self.prediction.ranges), *shared, *gains]

    @property
    def samples(self) -> int:
        """The number of them that count."""
        return int(sum(used.sum() for used in self.used))

    @property
    def bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds of p."""
        low, high = [0.0] * self.size, [1.0] * self.size
        if TIME_ZERO in self.free:
            low.append((self.measured.time[0] - self.until) / self.unit)
            high.append(float(self.measured.time[-1]) / self.unit)
        return np.array(low), np.array(high)

    def time_zero(self, p: Vector) -> float:
        """Return s, in the signal's own time."""
        return float(p[self.size]) * self.unit if TIME_ZERO in self.free else 0.0

    def start(self, places: Vector, traces: Vector) -> tuple[float, Vector]:
        """Return χ² and p with the time zero that suits these traces best."""
        curves = Curves(traces, self.prediction.interval)
        p = np.append(places, self._time_zero(curves) / self.unit) if TIME_ZERO in self.free else places
        residual = self._residual(p, curves)
        return float(residual @ residual), p

    def _time_zero(self, curves: Curves) -> float:
        """Return the time zero by cross-correlation, s, to a part of a sample."""
        step, grid = self.measured.step, np.arange(0.0, self.until, self.measured.step)
        count, total = self.measured.time.size + grid.size - 1, np.zeros(1)
        length = next_fast_len(count, real=True)
        for sensor, shape in zip(self.measured.sensors, curves.at(grid), strict=True):
            force = np.where(np.isfinite(sensor.force), sensor.force, 0.0)
            along = irfft(rfft(force, length) * rfft(shape[::-1], length), length)[:count]
            square = float(shape @ shape)
            if square > 0.0:
                # A sensor whose wires are turned has a negative gain.
                total = total + (along**2 / square if GAIN in self.free else 2.0 * along - square) / sensor.noise**2
        best, shift = int(np.argmax(total)), 0.0
        if 0 < best < total.size - 1:
            left, here, right = total[best - 1 : best + 2]
            shift = 0.5 * (left - right) / (left - 2.0 * here + right) if left + right < 2.0 * here else 0.0
        return float(self.measured.time[0] + step * (best - (grid.size - 1) + shift))

    def _gained(self, row: int, shape: Vector) -> tuple[Vector, Vector, float]:
        """Return the residual of a sensor, the direction in which a gain changes it, and the gain.

        shape: the predicted force at the samples that count, N.
        """
        force, white = self._forces[row], self._clean(row, shape)
        size = float(np.linalg.norm(white))
        if GAIN not in self.free or size == 0.0:
            return force - white, np.zeros_like(white), 1.0
        direction = white / size
        along = float(force @ direction)
        return force - along * direction, direction, along / size

    def of_traces(self, p: Vector, traces: Vector) -> float:
        """Return χ² of traces at p; infinite for a run that failed."""
        if not np.isfinite(traces).all():
            return np.inf
        residual = self._residual(p, Curves(traces, self.prediction.interval))
        return float(residual @ residual)

    def residual(self, p: Vector) -> Vector:
        """Return the residual at p, from one run."""
        traces = self.prediction.trace(p[: self.size])
        if not np.isfinite(traces).all():
            return np.full(self.samples, FAILED)
        return self._residual(p, Curves(traces, self.prediction.interval))

    def _residual(self, p: Vector, curves: Curves) -> Vector:
        shapes = curves.at(self.measured.time - self.time_zero(p))
        return np.concatenate([self._gained(row, shape[self.used[row]])[0] for row, shape in enumerate(shapes)])

    def at(self, p: Vector, steps: Vector, central: bool = True) -> Point:
        """Return all of the misfit at p; steps: of the places, for the derivatives."""
        traces = self.prediction.trace(p[: self.size])
        slopes = self.prediction.slopes(p[: self.size], traces, steps, central)
        if not (np.isfinite(traces).all() and np.isfinite(slopes).all()):
            raise FloatingPointError("a run beside the solution failed")
        return self.point(p, traces, slopes)

    def point(self, p: Vector, traces: Vector, slopes: Vector) -> Point:
        """Return all of the misfit from runs that are known. slopes: of the traces with the places."""
        interval, moments = self.prediction.interval, self.measured.time - self.time_zero(p)
        curves = Curves(traces, interval)
        shapes, changes = curves.at(moments), [Curves(slopes, interval).at(moments)]
        if TIME_ZERO in self.free:
            changes.append(-self.unit * curves.rates(moments)[None])
        bent, residuals, projected, full = np.concatenate(changes), list[Vector](), list[Vector](), list[Vector]()
        gains, fitted, free = list[float](), list[Vector](), int(GAIN in self.free)
        for row, used in enumerate(self.used):
            shape = shapes[row][used]
            residual, direction, gain = self._gained(row, shape)
            nonlinear = self._clean(row, gain * bent[:, row, used]).T
            linear = np.zeros((shape.size, free * len(self.used)))
            linear[:, row : row + free] = self._clean(row, shape)[:, None]
            residuals.append(residual)
            projected.append(np.outer(direction, direction @ nonlinear) - nonlinear)
            full.append(np.hstack([nonlinear, linear]))
            gains.append(gain)
            fitted.append(gain * shape)
        return Point(
            p, np.concatenate(residuals), np.concatenate(projected), np.concatenate(full), np.array(gains), fitted
        )

    def by_sensor(self, values: Vector) -> list[Vector]:
        """Return the parts of a residual, or of columns, that belong to each sensor."""
        return np.split(values, np.cumsum([used.sum() for used in self.used])[:-1])

    def explains(self, misfit: float, p: Vector) -> bool:
        """Return whether the residual at p, of this χ², is that of noise, so that a search may end.

        Noise that was estimated may be half as large again, where the residual is white.
        """
        degrees = max(self.samples - len(self.names), 1)
        if misfit < degrees + 4.0 * np.sqrt(2.0 * degrees):
            return True
        return not self.measured.given and misfit < 1.5 * degrees and self.is_white(self.residual(p))

    def is_numerical(self, residual: Vector) -> bool:
        """Return whether it is within what runs are exact to, at each sensor, as where a run is taken for a signal."""
        return all(
            float(np.sqrt((part**2).mean())) * sensor.noise <= NUMERICAL * float(np.nanmax(abs(sensor.force)))
            for sensor, part in zip(self.measured.sensors, self.by_sensor(residual), strict=True)
        )

    def is_white(self, residual: Vector) -> bool:
        """Return whether it is not correlated over a contact time: Ljung and Box's sum, four standard deviations.

        The memory of noise that a short lead shows has an error, which leaves a correlation of its own.
        """
        total, limit, lags = 0.0, 0.0, max(2, int(self.unit / self.measured.step))
        for sensor, part in zip(self.measured.sensors, self.by_sensor(residual), strict=True):
            along = np.array([part[lag:] @ part[:-lag] for lag in range(1, lags + 1)]) / (part @ part)
            total += part.size * float((along**2).sum())
            limit += lags
            if terms := sensor.memory.size:
                limit += part.size / sensor.lead * (terms + 4.0 * float(np.sqrt(2.0 * terms)))
        return total < limit + 4.0 * float(np.sqrt(2.0 * lags * len(self.used)))

    def data(self, point: Point) -> xr.Dataset:
        """Return what was measured and fitted, over sensor and time, and offset, hum and drift as `baseline`."""
        time, sensors = self.measured.time, self.measured.sensors
        force = np.stack([sensor.force for sensor in sensors])
        fitted, slow = np.full(force.shape, np.nan), np.zeros(force.shape)
        for row, (used, values, sensor) in enumerate(zip(self.used, point.fitted, sensors, strict=True)):
            shapes = self._baseline(sensor)
            slow[row] = shapes @ np.linalg.lstsq(shapes[used], force[row, used] - values, rcond=None)[0]
            fitted[row, used] = values + slow[row, used]
        newton = {"units": "N"}
        shown = {"measured": force, "fitted": fitted, "residual": force - fitted}
        if OFFSET in self.free or any(sensor.drifts for sensor in sensors):
            shown["baseline"] = slow
        return xr.Dataset(
            {name: (("sensor", "time"), values, newton) for name, values in shown.items()}
            | {"noise": ("sensor", [sensor.noise for sensor in sensors], newton)},
            {"time": ("time", time, {"units": "s"}), "sensor": [sensor.bead for sensor in sensors]},
        )


def inverse(columns: Vector) -> Vector:
    """Return the covariance for unit noise; directions that change nothing get an error that is large, not infinite."""
    size = np.sqrt((columns**2).sum(axis=0))
    size = np.where(size > 0.0, size, 1.0)
    information = (columns / size).T @ (columns / size) + 1e-14 * np.eye(columns.shape[1])
    covariance: Vector = np.linalg.inv(information) / np.outer(size, size)
    return covariance
