"""The misfit of predicted and measured traces. Gain, offset and time zero of the sensors follow from the traces of a
run and are projected out of the residual, so that a search varies the builder's unknowns alone."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.interpolate import CubicSpline
from scipy.linalg import block_diag
from scipy.signal import fftconvolve

from coupling.inference.measured import Measured
from coupling.inference.prediction import NUMERICAL, Prediction
from structures.structure import Vector

GAIN, OFFSET, TIME_ZERO = "gain", "offset", "time_zero"

OF_SENSORS = (GAIN, OFFSET, TIME_ZERO)  # Nuisances that belong to the sensors, not to the builder.
FAILED = 1e6  # The residual of a run that failed; it makes a search turn back.


class Fit(NamedTuple):
    """A run at some places of the unknowns, fitted to the signal. The lists are empty if the run failed."""

    places: Vector
    time_zero: float  # s
    residual: Vector  # whitened, over the noise, sensor by sensor
    slope: Vector  # derivative of the residual by the time zero in contact times
    gains: Vector  # one for each sensor
    white: list[Vector]  # the traces, whitened like the residual
    fitted: list[Vector]  # the traces times their gains, N, without baseline

    @property
    def works(self) -> bool:
        """Whether the run succeeded."""
        return bool(self.fitted)

    @property
    def misfit(self) -> float:
        """The sum of squares of the residual, χ²."""
        return float(self.residual @ self.residual)

    @property
    def gain_columns(self) -> Vector:
        """The derivatives of the residual by the gains."""
        return np.asarray(block_diag(*[-white[:, None] for white in self.white]))


class Point(NamedTuple):
    """A fit with its derivatives."""

    fit: Fit
    columns: Vector
    """Derivatives of the residual by the unknowns, with the sensors' parameters refitted, and by these alone."""
    carried: Vector
    """Derivatives of all parameters, in rows, by the parameters of `columns`, in columns."""


class Misfit:
    """The comparison of predictions with a signal. nuisances: the parameters of the sensors that are fitted too: of
    `OF_SENSORS`. The attribute `names` holds all parameters: the unknowns, the time zero, the gains."""

    def __init__(self, prediction: Prediction, measured: Measured, nuisances: Collection[str]) -> None:
        self.prediction, self.until, self.unit = prediction, prediction.until, prediction.contact_time
        self.free = [name for name in OF_SENSORS if name in nuisances]
        gains = [f"{GAIN} {sensor.bead}" for sensor in measured.sensors if GAIN in self.free]
        shared = [TIME_ZERO] if TIME_ZERO in self.free else []
        self.names = [*(unknown.name for unknown in prediction.ranges), *shared, *gains]
        self.count(measured)

    def count(self, measured: Measured, time_zero: float | None = None) -> None:
        """Choose the samples that count: those that are not NaN and, if `time_zero` is given, s, in the prediction."""
        self.measured, self.used = measured, list[NDArray[np.bool_]]()
        self._bases, self._forces, moments = list[Vector](), list[Vector](), measured.time - (time_zero or 0.0)
        self._grid = np.arange(0.0, self.until, measured.step)  # times of the trace for cross-correlation
        self._length = next_fast_len(measured.time.size + self._grid.size - 1, real=True)
        self._spectra = list[NDArray[np.complex128]]()
        for row, sensor in enumerate(measured.sensors):
            used = np.isfinite(sensor.force)
            self._spectra.append(rfft(np.where(used, sensor.force, 0.0), self._length))
            if time_zero is not None:
                # Samples before the impact show the baseline, so they count if there is a quiet lead.
                used &= (moments >= -(self.until if sensor.lead else self.unit)) & (moments <= self.until)
            self.used.append(used)
            shapes = sensor.baseline(measured.time, OFFSET in self.free)[used]
            self._bases.append(np.linalg.qr(sensor.whitened(shapes.T).T)[0])
            self._forces.append(self._clean(row, sensor.force[used]))
        self.samples = int(sum(used.sum() for used in self.used))
        self.degrees = max(self.samples - len(self.names), 1)
        if self.samples <= len(self.names):
            raise ValueError("signal: no samples after the impact; check the times, or name time_zero as a nuisance")

    def _clean(self, row: int, values: Vector) -> Vector:
        """Return values over the samples of a sensor, whitened, without the part that its baseline can explain."""
        white, basis = self.measured.sensors[row].whitened(values), self._bases[row]
        return np.asarray(white - (white @ basis) @ basis.T)

    def fits(self, places: Sequence[Vector], near: float | None = None) -> list[Fit]:
        """Return the fits at places, with the best time zero, or the best near a time, s; runs are done together."""
        return [self._fit(*both, near) for both in zip(places, self.prediction.traces(places), strict=True)]

    def _fit(self, places: Vector, traces: Vector, near: float | None) -> Fit:
        """Return the fit of traces with the best time zero, s; the search begins near a time, if it is given."""
        if not np.isfinite(traces).all():
            return Fit(places, 0.0, np.full(self.samples, FAILED), np.zeros(0), np.ones(len(self.used)), [], [])
        curve = CubicSpline(self.prediction.interval * np.arange(traces.shape[-1]), traces, axis=-1)
        if TIME_ZERO not in self.free:
            return self._fit_at(places, curve, 0.0)
        if near is None:
            # The time zero by cross-correlation is exact to one sample.
            step, grid, total = self.measured.step, self._grid, np.zeros(1)
            count, shapes = self.measured.time.size + grid.size - 1, curve(np.minimum(grid, curve.x[-1]))
            for sensor, spectrum, shape in zip(self.measured.sensors, self._spectra, shapes, strict=True):
                along = irfft(spectrum * rfft(shape[::-1], self._length), self._length)[:count]
                square = float(shape @ shape)
                if square > 0.0:
                    # The gain may be negative: the wires of a sensor may be swapped.
                    gained = along**2 / square if GAIN in self.free else 2.0 * along - square
                    total = total + gained / sensor.noise**2
            near = float(self.measured.time[0] + step * (int(np.argmax(total)) - (grid.size - 1)))
        best = self._fit_at(places, curve, near)
        for _ in range(8):
            step = -float(best.slope @ best.residual) / max(float(best.slope @ best.slope), 1e-300)
            if abs(step) < 1e-6:
                break
            other = self._fit_at(places, curve, best.time_zero + self.unit * min(max(step, -0.2), 0.2))
            if other.misfit >= best.misfit:
                break
            best = other
        return best

    def _fit_at(self, places: Vector, curve: CubicSpline, time_zero: float) -> Fit:
        """Return the fit of traces that begin at a time, s; they are zero before it, and constant after their end."""
        moments = self.measured.time - time_zero
        shapes, rates = np.zeros((2, len(self.used), moments.size))
        # A long lead has most of the samples; the curve is evaluated where it is not zero.
        first, end = np.searchsorted(moments, 0.0), np.searchsorted(moments, curve.x[-1], "right")
        shapes[:, first:end] = curve(moments[first:end])
        shapes[:, end:] = curve(curve.x[-1])[:, None]
        rates[:, first:end] = -self.unit * curve(moments[first:end], 1)
        residuals, slopes, whites, fitted = list[Vector](), list[Vector](), list[Vector](), list[Vector]()
        gains = np.ones(len(self.used))
        for row, used in enumerate(self.used):
            white, rate = self._clean(row, np.stack([shapes[row, used], rates[row, used]]))
            size = float(np.linalg.norm(white))
            if GAIN in self.free and size > 0.0:
                direction = white / size
                gains[row] = float(self._forces[row] @ direction) / size
                rate = rate - (rate @ direction) * direction
            residuals.append(self._forces[row] - gains[row] * white)
            slopes.append(-gains[row] * rate)
            whites.append(white)
            fitted.append(gains[row] * shapes[row, used])
        return Fit(places, time_zero, np.concatenate(residuals), np.concatenate(slopes), gains, whites, fitted)

    def at(self, places: Vector, steps: Vector, central: bool = True) -> Point:
        """Return the fit at places and its derivatives, by central differences with these steps, or one-sided. Central
        differences become one-sided at an end of a range and beside a run that fails."""
        here, size = self._fit(places, self.prediction.trace(places), None), places.size
        above = np.minimum(places + steps, 1.0)
        below = np.maximum(places - steps, 0.0) if central else np.where(above > places, places, places - steps)
        ends = [np.where(np.arange(size) == k, end, places) for end in (below, above) for k in range(size)]
        moved = [i for i, end in enumerate(ends) if (end != places).any()]
        fits = [here] * len(ends)  # which also stands for a run that fails
        for i, fit in zip(moved, self.fits([ends[i] for i in moved], here.time_zero), strict=True):
            fits[i] = fit if fit.works else here
        pairs = list(zip(range(size), fits[:size], fits[size:], strict=True))
        widths = np.array([(high.places - low.places)[k] or 1.0 for k, low, high in pairs])[:, None]
        by_unknown = np.stack([high.residual - low.residual for _, low, high in pairs]) / widths

        # The sensors' parameters follow the unknowns. The gains do not follow the time zero: it only shifts a trace.
        sensors = [[fit.time_zero / self.unit, *fit.gains] for fit in fits]
        following = (np.array(sensors[size:]) - np.array(sensors[:size])) / widths
        chosen = np.array([TIME_ZERO in self.free, *[GAIN in self.free] * len(self.used)])
        carried = np.eye(len(self.names))
        carried[size:, :size] = following.T[chosen]
        own = np.hstack([here.slope[:, None], here.gain_columns])[:, chosen]
        return Point(here, np.hstack([by_unknown.T, own]), carried)

    def by_sensor(self, values: Vector) -> list[Vector]:
        """Return the parts of a residual, or of columns, that belong to each sensor."""
        return np.split(values, np.cumsum([used.sum() for used in self.used])[:-1])

    def is_numerical(self, fit: Fit) -> bool:
        """Return whether the residual at each sensor is within the numerical error of runs: the signal is a run."""
        return all(
            float(np.sqrt((part**2).mean())) * sensor.noise <= NUMERICAL * float(np.nanmax(abs(sensor.force)))
            for part, sensor in zip(self.by_sensor(fit.residual), self.measured.sensors, strict=True)
        )

    def explains(self, fit: Fit) -> bool:
        """Return whether the residual is noise, or the numerical error of runs: not larger, and not correlated over a
        contact time by the sum of Ljung and Box, within four standard deviations."""
        if self.is_numerical(fit):
            return True
        # The variance of the noise may be half as large again if it was estimated.
        most = 1.0 + 4.0 * np.sqrt(2.0 / self.degrees) if self.measured.given else 1.5
        total, limit, lags = 0.0, 0.0, max(2, int(self.unit / self.measured.step))
        for sensor, part in zip(self.measured.sensors, self.by_sensor(fit.residual), strict=True):
            along = np.array([part[lag:] @ part[:-lag] for lag in range(1, lags + 1)]) / (part @ part)
            total += part.size * float((along**2).sum())
            limit += lags
            if terms := sensor.memory.size:
                # The memory from a short lead is inexact, which leaves some correlation.
                limit += part.size / sensor.lead * (terms + 4.0 * float(np.sqrt(2.0 * terms)))
        white = total < limit + 4.0 * float(np.sqrt(2.0 * lags * len(self.used)))
        return bool(fit.misfit < most * self.degrees and white)

    def covariance(self, point: Point, discrepancy: float) -> tuple[Vector, float, bool]:
        """Return the covariance of all parameters, the residual over the noise, and whether the residual is noise."""
        measured, numerical = self.measured, self.is_numerical(point.fit)
        ratio, explained = point.fit.misfit / self.degrees, self.explains(point.fit)
        # If the size of the noise is not known, the residual gives it.
        known = measured.given and not any(sensor.memory.size for sensor in measured.sensors)
        factor = 1.0 if numerical or (known and explained) else max(ratio, float(known))

        # The error of the model, and that of runs, is a part of each peak, correlated over a quarter of a contact.
        lacking, information = max(discrepancy, NUMERICAL * numerical), np.zeros((point.columns.shape[1],) * 2)
        width = 0.25 * self.unit / measured.step
        kernel = np.exp(-0.5 * (np.arange(-int(4.0 * width), int(4.0 * width) + 1) / width) ** 2)[:, None]
        parts = zip(self.by_sensor(point.columns), point.fit.fitted, measured.sensors, strict=True)
        for columns, fitted, sensor in parts:
            size = lacking * float(abs(fitted).max()) / sensor.noise
            information += size**2 * columns.T @ fftconvolve(columns, kernel, mode="same", axes=0)
        white = unit_covariance(point.columns)
        covariance = point.carried @ (factor * white + white @ information @ white) @ point.carried.T
        return covariance, float(np.sqrt(ratio)), explained

    def data(self, fit: Fit) -> xr.Dataset:
        """Return the measured and fitted forces over sensor and time; `baseline` has offset, hum and drift."""
        time, sensors = self.measured.time, self.measured.sensors
        force = np.stack([sensor.force for sensor in sensors])
        fitted, slow = np.full(force.shape, np.nan), np.zeros(force.shape)
        for row, (used, values, sensor) in enumerate(zip(self.used, fit.fitted, sensors, strict=True)):
            shapes = sensor.baseline(time, OFFSET in self.free)
            slow[row] = shapes @ np.linalg.lstsq(shapes[used], force[row, used] - values, rcond=None)[0]
            fitted[row, used] = values + slow[row, used]
        shown = {"measured": force, "fitted": fitted, "residual": force - fitted}
        if OFFSET in self.free or any(sensor.drifts for sensor in sensors):
            shown["baseline"] = slow
        newton = {"units": "N"}
        return xr.Dataset(
            {name: (("sensor", "time"), values, newton) for name, values in shown.items()}
            | {"noise": ("sensor", [sensor.noise for sensor in sensors], newton)},
            {"time": ("time", time, {"units": "s"}), "sensor": [sensor.bead for sensor in sensors]},
        )


def unit_covariance(columns: Vector) -> Vector:
    """Return the covariance for unit noise. Directions that change nothing get a large error, not an infinite one."""
    size = np.sqrt((columns**2).sum(axis=0))
    size = np.where(size > 0.0, size, 1.0)
    information = (columns / size).T @ (columns / size) + 1e-14 * np.eye(columns.shape[1])
    covariance: Vector = np.linalg.inv(information) / np.outer(size, size)
    return covariance


def steps_for(errors: Vector) -> Vector:
    """Return the steps of differences, as parts of the ranges: 0.3 standard deviations. With much shorter steps
    derivatives would show the scatter of traces whose mesh changes with an unknown. Scatter looks like information, and
    it made intervals too short."""
    steps: Vector = np.clip(0.3 * errors, 1e-5, 2e-2)
    return steps
