"""The misfit of AR and TOF alone: as in tests that read two numbers of each sensor against a curve."""

import numpy as np
import xarray as xr
from scipy.signal import lfilter

from coupling.inference.misfit import Measured, Misfit, Point
from coupling.inference.prediction import Curves, Prediction
from coupling.results.sensor_trace import interpolated_over_gaps, noise_level
from structures.checks import count_of
from structures.structure import Vector

FEW_DRAWS, DRAWS, SEED = 20, 100, 20
"""Draws of noise, from which the scatter and the bias of AR and TOF follow: few before the search, more at its result,
where 100 give the scatter to 7 %."""

USUAL = 0.9
"""A wave is compared if it is found in this part of the draws."""

MISSING = 1e3
"""The residual of a wave that a run lacks, in standard deviations, so that a search turns back."""

KINDS = ("primary", "secondary")

NUMERICAL = 1e-4
"""Part of AR and TOF to which runs are exact; a scatter below it is not believed."""


class Features(Misfit):
    """Compares AR and TOF of the primary and of the secondary wave, where the signal has them.

    AR and TOF depend neither on gains nor on time zero, so these are no parameters.
    """

    of_traces_alone = False

    def __init__(self, prediction: Prediction, measured: Measured, until: float) -> None:
        super().__init__(prediction, measured, [], until)
        sensors = measured.sensors
        peaks = np.nanmax(abs(measured.force), axis=-1)
        self._noise = measured.noise / peaks
        self._seen = np.array([noise_level(interpolated_over_gaps(force)) for force in measured.force]) / peaks
        self._memory = np.zeros(len(peaks)) if measured.given else memory_of(self._seen / self._noise)
        here = prediction.waves(measured.time, measured.force, sensors)
        scattered = self._scattered(measured.time, measured.force, FEW_DRAWS)
        usual = np.isfinite(here) & (np.isfinite(scattered).mean(axis=0) > USUAL)
        # Waves that return after the end of the prediction are not compared.
        moving = prediction.first.chain
        arrivals = moving.transit_time / len(moving.chain.beads) * np.repeat(sensors, len(KINDS))
        usual[1::2] &= arrivals + here[1::2] < until - self.unit
        usual[0::2] &= usual[1::2]
        self.usable = usual
        names = [f"{kind} {what} at bead {n}" for n in sensors for kind in KINDS for what in ("AR", "TOF")]
        self.features = [name for name, use in zip(names, usual, strict=True) if use]
        if not self.features:
            raise ValueError(
                f"signal: no reflected wave at the sensors {sensors!r}; record longer, or compare the waveform"
            )
        if len(self.features) < self.size:
            raise ValueError(
                f"compare = 'features': {count_of(len(self.features), 'value')} ({', '.join(self.features)}) cannot "
                f"determine {count_of(self.size, 'unknown')}; name fewer, add a sensor, or compare the waveform"
            )
        self.known, self.bias = here[usual], np.zeros(int(usual.sum()))
        self.spread = self._spread(scattered)

    def _scattered(self, time: Vector, forces: Vector, number: int, seen: bool = False) -> Vector:
        """Return the waves of traces with the signal's noise, or with white noise as the reader sees it: draws ×
        values."""
        random = np.random.default_rng(SEED)
        noise, memory = (self._seen, np.zeros(len(forces))) if seen else (self._noise, self._memory)
        size = (noise * np.nanmax(abs(forces), axis=-1))[:, None]
        draws = [forces + size * correlated(random.normal(size=forces.shape), memory) for _ in range(number)]
        return np.array([self.prediction.waves(time, draw, self.measured.sensors) for draw in draws])

    def _spread(self, scattered: Vector) -> Vector:
        spread: Vector = np.hypot(np.nanstd(scattered[:, self.usable], axis=0), NUMERICAL * abs(self.known))
        return spread

    def refresh(self, p: Vector, final: bool = True) -> None:
        """Noise makes peaks too high on average, and the reader smooths what is noisy: by how much, near p.

        The reader smooths by the noise that it sees in the signal, so that is the noise of the bias, whatever was
        stated: a signal without noise is read without bias.
        """
        traces = self._traces(p)
        clean = self._clean(traces) if np.isfinite(traces).all() else np.array([np.nan])
        if not np.isfinite(clean).all():
            return
        seen, stated = (
            self._scattered(*self._sampled(traces), DRAWS if final else FEW_DRAWS, white) for white in (True, False)
        )
        if min(np.isfinite(draws[:, self.usable]).mean(axis=0).min() for draws in (seen, stated)) > USUAL:
            self.bias = np.nanmean(seen[:, self.usable], axis=0) - clean
            self.spread = self._spread(stated)

    def is_numerical(self, residual: Vector) -> bool:
        """The scatter of features is known, and never that small."""
        return False

    @property
    def samples(self) -> int:
        """The number of values that are compared."""
        return len(self.features)

    def keep_window(self, time_zero: float) -> None:
        """All of the signal counts."""

    def start(self, places: Vector, traces: Vector) -> tuple[Vector, float]:
        """Return the places, and their misfit."""
        return np.array(places), self.of_traces(places, traces)

    def _sampled(self, traces: Vector) -> tuple[Vector, Vector]:
        """Return a prediction at the sampling of the signal, so that peaks between samples are read in the same way."""
        moments = np.arange(0.0, self.prediction.time[-1], self.measured.step)
        return moments, Curves(traces, self.prediction.interval).at(moments)

    def _clean(self, traces: Vector) -> Vector:
        features: Vector = self.prediction.waves(*self._sampled(traces), self.measured.sensors)[self.usable]
        return features

    def _waves(self, traces: Vector) -> Vector:
        """Return AR and TOF of a prediction, as noise would bias them."""
        return self._clean(traces) + self.bias

    def _residual(self, traces: Vector) -> Vector:
        features = self._waves(traces)
        return np.where(np.isfinite(features), (self.known - features) / self.spread, MISSING)

    def of_traces(self, p: Vector, traces: Vector) -> float:
        """Return χ² of traces at p; infinite for a run that failed."""
        if not np.isfinite(traces).all():
            return np.inf
        residual = self._residual(traces)
        return float(residual @ residual)

    def residual(self, p: Vector) -> Vector:
        """Return the residual at p, from one run."""
        traces = self._traces(p)
        return self._residual(traces) if np.isfinite(traces).all() else np.full(self.samples, MISSING)

    def at(self, p: Vector, steps: Vector, rough: bool = False) -> Point:
        """Return all of the misfit at p; features are not linear in the traces, so they are differenced themselves."""
        places = p[: self.size]
        below = np.clip(places - steps, 0.0, 1.0)
        above = np.clip(places + steps, 0.0, 1.0)
        ends = [np.where(np.eye(self.size)[k] > 0.0, end, places) for k in range(self.size) for end in (below, above)]
        traces = self.prediction.traces(ends)
        if not np.isfinite(traces).all():
            raise FloatingPointError("a run beside the solution failed")
        residuals = [self._residual(trace) for trace in traces]
        slopes = [(residuals[2 * k + 1] - residuals[2 * k]) / (above[k] - below[k]) for k in range(self.size)]
        projected = np.stack(slopes, axis=1)
        features = self._waves(self._traces(p))
        none = np.zeros(0)
        return Point(p, self.residual(p), projected, -projected, none, none, [features])

    def data(self, point: Point) -> xr.Dataset:
        """Return what was measured and what is fitted, over the features."""
        fitted = point.fitted[0]
        return xr.Dataset(
            {
                "measured": ("feature", self.known),
                "fitted": ("feature", fitted),
                "residual": ("feature", self.known - fitted),
                "noise": ("feature", self.spread),
            },
            {"feature": self.features},
        )


def memory_of(seen: Vector) -> Vector:
    """Return the correlation of the noise from sample to sample, of first order.

    seen: of each sensor, the noise in third differences of the samples, as a part of that in the lead.
    """
    memory = np.linspace(0.0, 0.999, 1000)
    differences = 1.0 - 1.5 * memory + 0.6 * memory**2 - 0.1 * memory**3
    coefficients: Vector = np.interp(-(seen**2), -differences, memory)
    return coefficients


def correlated(white: Vector, memory: Vector) -> Vector:
    """Return the noise of the same size with such a memory, sensors × samples."""
    return np.stack([
        lfilter([1.0], [1.0, -coefficient], np.append(row[0], np.sqrt(1.0 - coefficient**2) * row[1:]))
        for row, coefficient in zip(white, memory, strict=True)
    ])  # fmt: skip
