"""Traces interpolated between runs, so that a search costs no runs of its own.

The wave of a chain keeps its shape while its speed and height change with the impact, the beads or their loss. So
traces are interpolated in units of the arrival and of the height of the first wave, in which they change slowly.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.distance import cdist

from coupling.inference.prediction import Curves, Prediction
from structures.structure import Vector

SCALES = (0.1, 0.3, 1.0)
"""Units of the ranges, of which those are taken that predict each run best from the others."""

FIRST_WAVE = 0.3
"""Part of the greatest force that the first wave exceeds."""

THINNED = 16
"""One time in this many tells in which units of the ranges runs predict each other best."""

PARTS = 8
"""Parts of the time after which some runs have ended, in units of their first wave."""


class _Radial:
    """Values interpolated between places by cubic radial functions and a linear trend.

    Each range has the unit in which the values at each place are best predicted from those at the others.
    """

    def __init__(self, places: Vector, values: Vector, scales: Vector | None) -> None:
        self.places, self.count = places, len(places)
        self.scales = np.ones(places.shape[1]) if scales is None else scales
        for k in [*range(self.scales.size)] * 2 if scales is None else []:
            others = self.scales.copy()
            choices = [np.where(np.arange(others.size) == k, scale, others) for scale in SCALES]
            self.scales = min(choices, key=lambda scales: self._left(scales, values))

    def _left(self, scales: Vector, values: Vector) -> float:
        """Return the sum of squares that predictions from the other places leave."""
        self.scales = scales
        weights = self.weights(np.arange(self.count))[: self.count]
        return float((((weights @ values) / np.diag(weights)[:, None]) ** 2).sum())

    def functions(self, places: Vector) -> Vector:
        """Return the radial functions, and the trend, at places."""
        radial = cdist(places * self.scales, self.places * self.scales) ** 3
        return np.column_stack([radial, np.ones(len(places)), places])

    def weights(self, rows: NDArray[np.intp]) -> Vector:
        """Return what makes weights of the functions from the values of some rows."""
        trend = self.places.shape[1] + 1
        chosen = np.append(rows, self.count + np.arange(trend))
        functions = self.functions(self.places[rows])[:, chosen]
        square = np.vstack([functions, np.hstack([functions[:, rows.size :].T, np.zeros((trend, trend))])])
        weights = np.zeros((self.count + trend, rows.size))
        weights[chosen] = np.linalg.inv(square)[:, : rows.size]
        return weights


class Lines(Curves):
    """Traces that are straight between their samples."""

    def __init__(self, traces: Vector, interval: float) -> None:
        self._traces, self._interval = traces, interval

    def at(self, moments: Vector) -> Vector:
        """Return the values at moments after the impact, s."""
        places = np.clip(moments / self._interval, 0.0, self._traces.shape[-1] - 1.001)
        index = places.astype(int)
        begin = self._traces[..., index]
        return np.asarray((begin + (places - index) * (self._traces[..., index + 1] - begin)) * (moments >= 0.0))

    def rates(self, moments: Vector) -> Vector:
        """Changes with time there."""
        return Lines(np.gradient(self._traces, self._interval, axis=-1), self._interval).at(moments)


class Surrogate(Prediction):
    """A prediction whose traces are interpolated between runs.

    places: of the runs, runs × unknowns; traces: runs × sensors × times; waves: arrival, in steps, and height of the
    first wave of each run; scales: those of an interpolation of most of these runs.
    """

    costs_runs = False

    def __init__(
        self, prediction: Prediction, places: Vector, traces: Vector, waves: Vector, scales: Sequence[Vector] | None
    ) -> None:
        vars(self).update(vars(prediction), _last={})
        arrivals, heights = waves.T
        self._steps = np.arange(0.0, prediction.time.size)
        lasting = self._steps[-1] / arrivals
        self._units = np.linspace(0.0, lasting.max(), int(self._steps.size * lasting.max() / lasting.min()))
        shapes = np.stack([
            _stretched(trace / height, arrival * self._units)
            for trace, arrival, height in zip(traces, arrivals, heights, strict=True)
        ])  # fmt: skip
        common, everyone = int(np.searchsorted(self._units, lasting.min())), np.arange(len(waves))
        of_waves, of_shapes = scales or (None, None)
        self._waves = _Radial(places, np.log(waves), of_waves)
        self._shapes = _Radial(places, shapes[:, 0, :common:THINNED], of_shapes)
        self.scales = self._waves.scales, self._shapes.scales
        self._of_waves = self._waves.weights(everyone) @ np.log(waves)
        self._of_shapes = np.zeros((len(self._of_waves), *shapes.shape[1:]))
        ends = np.linspace(common, self._units.size, PARTS + 1).astype(int)
        for begin, end in zip([0, *ends[:-1]], ends, strict=True):
            rows = everyone[lasting >= self._units[end - 1] * (1.0 - 1e-9)]
            if rows.size > places.shape[1] + 1:
                self._of_shapes[..., begin:end] = np.tensordot(
                    self._shapes.weights(rows), shapes[rows, :, begin:end], 1
                )

    def curves(self, traces: Vector) -> Curves:
        """Return traces that are straight between their samples, which takes a tenth of the time."""
        return Lines(traces, self.interval)

    def traces(self, places: Sequence[Vector]) -> Vector:
        """Return the interpolated forces at the sensors, N, places × sensors × times."""
        arrivals, heights = np.exp(self._waves.functions(np.array(places)) @ self._of_waves).T
        shapes = heights[:, None, None] * np.tensordot(self._shapes.functions(np.array(places)), self._of_shapes, 1)
        traces = np.array([
            [np.interp(self._steps / arrival, self._units, sensor) for sensor in shape]
            for arrival, shape in zip(arrivals, shapes, strict=True)
        ])  # fmt: skip
        self._last = {place.tobytes(): trace for place, trace in zip(places, traces, strict=True)}
        return traces


def interpolated(
    prediction: Prediction, places: Vector, traces: Vector, scales: Sequence[Vector] | None = None
) -> Surrogate | None:
    """Return what interpolates runs; None where too few have a first wave."""
    waves = np.array([_first_wave(trace[0]) for trace in traces])
    usable = waves.min(axis=1) > 0.0
    if usable.sum() < places.shape[1] + 2:
        return None
    return Surrogate(prediction, places[usable], traces[usable], waves[usable], scales)


def _first_wave(force: Vector) -> tuple[float, float]:
    """Return when the first wave of a trace has its peak, in steps, and its height; zeros where there is none."""
    greatest = float(force.max())
    if not greatest > 0.0:
        return 0.0, 0.0
    first = int(np.argmax(force > FIRST_WAVE * greatest))
    peak = first + int(np.argmax(np.append(np.diff(force[first:]) < 0.0, True)))
    if not 0 < peak < force.size - 1:
        return 0.0, 0.0
    left, here, right = force[peak - 1 : peak + 2]
    return peak + 0.5 * float(left - right) / float(left - 2.0 * here + right), float(here)


def _stretched(trace: Vector, steps: Vector) -> Vector:
    """Return a trace at numbers of steps; constant after its end."""
    curve = CubicSpline(np.arange(trace.shape[-1]), trace, axis=-1)
    return np.asarray(curve(np.minimum(steps, trace.shape[-1] - 1)))
