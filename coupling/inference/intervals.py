"""Intervals and verdicts at the best fit, and whether the model explains the signal."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.signal import fftconvolve

from coupling.inference.identification import (
    AT_END,
    BLIND,
    HALF,
    IDENTIFIED,
    NOT_TRUSTED,
    NUISANCE,
    Identification,
    Unknown,
)  # fmt: skip
from coupling.inference.measured import remembered
from coupling.inference.misfit import GAIN, TIME_ZERO, Point, inverse
from coupling.inference.prediction import NUMERICAL
from coupling.inference.search import Search, Solution
from coupling.inference.settings import SETTINGS
from coupling.results.findings import findings_of
from structures.caution import caution, collected
from structures.checks import count_of
from structures.structure import Vector

YIELD = "yield: "
"""The first word of a run's finding on contacts beyond yield."""


def judged(search: Search, discrepancy: float, nuisances: Sequence[str], inputs: dict[str, Any]) -> Identification:
    """Scan, solve, and judge. discrepancy: of the model, as a part of each peak; nuisances: what is of no interest."""
    misfit, prediction = search.misfit, search.misfit.prediction
    solutions = search.solutions()
    best, point, beside = search.settled(solutions[0])
    if any(sensor.memory.size for sensor in misfit.measured.sensors):
        rows = misfit.data(point).residual.transpose("sensor", "time").values
        sensors = [
            remembered(sensor, row) if sensor.memory.size else sensor
            for sensor, row in zip(misfit.measured.sensors, rows, strict=True)
        ]
        misfit.count(misfit.measured._replace(sensors=sensors), misfit.time_zero(best.p))
        solutions = [search.solved(one.p) for one in solutions if one.misfit < best.misfit + 10.0 * SETTINGS.unlikely]
        best, point, beside = search.settled(search.solved(best.p))
    covariance, size, explained = _covariance(search, point, discrepancy)
    inflation = np.maximum(np.diag(covariance) / np.diag(inverse(point.columns)), 1e-6)
    modes = _modes(search, best, [*solutions, *beside], covariance, float(inflation[: misfit.size].max()))
    unknowns = dict[str, Unknown]()
    for k, unknown in enumerate(search.ranges):
        ends = _interval(search, best, modes, k, covariance, float(inflation[k]))
        value, low, high = (unknown.value(place) for place in (best.p[k], *ends))
        verdict = _verdict(value, (low, high), unknown.low, unknown.high) if explained else NOT_TRUSTED
        verdict = NUISANCE if unknown.name in nuisances else verdict
        unknowns[unknown.name] = Unknown(unknown.name, value, (low, high), verdict, (unknown.low, unknown.high))
    unknowns |= _of_sensors(search, point, SETTINGS.deviations * np.sqrt(np.diag(covariance)))

    # What runs warned of; of yield, only what the best run does.
    said, notes = [warning for warning in prediction.warnings if not warning.startswith(YIELD)], list[str]()
    if len(said) < len(prediction.warnings):
        with collected():
            run = prediction.made(**prediction.values(best.p[: misfit.size])).run(prediction.until)
        notes = [finding for finding in findings_of(run) if finding.startswith(YIELD)]
    if not explained:
        notes.append(
            f"the residual is {size:.3g} times the noise: the model lacks something, and values may be biased by more "
            "than their intervals"
        )
    for name, unknown_found in unknowns.items():
        if unknown_found.range is not None and _is_at_end(unknown_found.value, *unknown_found.range):
            notes.append(f"{name}: {AT_END}; widen it")
        if name.startswith(f"{GAIN} ") and unknown_found.interval[1] < 0.0:
            notes.append(
                f"{name} is negative: this sensor's sign is reversed; give it a negative calibration, or turn its wires"
            )
    notes += _disturbances(search, point)
    if len(modes) > 1:
        notes.append(f"{len(modes)} different fits are as good; the intervals contain all of them")
    if prediction.failed:
        notes.append(f"{prediction.failed} of {prediction.runs} runs failed, and were left out")
    if explained and search.guess is None and misfit.size >= SETTINGS.many_unknowns:
        notes.append(
            f"identify: without a guess a fit of {SETTINGS.many_unknowns} unknowns or more may end at a wrong minimum "
            "that explains the signal; fit again with another seed and compare"
        )
    for note in notes:
        caution(note)
    root = np.sqrt(np.diag(covariance))
    axes = {"unknown": misfit.names, "other": misfit.names}
    return Identification(
        unknowns, xr.DataArray(covariance / np.outer(root, root), axes), misfit.data(point), size, explained,
        [prediction.values(mode.p[: misfit.size]) for mode in modes], best.converged, prediction.runs, [*said, *notes],
        inputs,
    )  # fmt: skip


def _disturbances(search: Search, point: Point) -> list[str]:
    """Return what was fitted as hum, drift and correlated noise, in words."""
    said, data = list[str](), search.misfit.data(point)
    for row, sensor in enumerate(search.misfit.measured.sensors):
        peak = float(abs(point.fitted[row]).max())
        if sensor.drifts:
            size = 50.0 * float(np.ptp(data.baseline.values[row][search.misfit.used[row]])) / peak
            said.append(
                f"sensor {sensor.bead}: the quiet lead shows hum or drift; ± {size:.2g} % of the peak was fitted"
            )
        if sensor.memory.size:
            said.append(
                f"sensor {sensor.bead}: its noise is correlated from sample to sample, as the quiet lead shows, and "
                f"was fitted with a memory of {count_of(sensor.memory.size, 'sample')}"
            )
    return said


def _covariance(search: Search, point: Point, discrepancy: float) -> tuple[Vector, float, bool]:
    """Return the covariance of all parameters, residual over noise, and whether the residual is noise."""
    misfit, white = search.misfit, inverse(point.columns)
    degrees = max(point.residual.size - point.columns.shape[1], 1)
    ratio, numerical = point.misfit / degrees, misfit.is_numerical(point.residual)
    level = 1.0 if misfit.measured.size_known else ratio
    explained = ratio < (1.0 + 4.0 * np.sqrt(2.0 / degrees)) * level and misfit.is_white(point.residual)
    # What runs are inexact by is correlated, as all that a model lacks.
    lacking = white @ _lacking(search, point, max(discrepancy, NUMERICAL * numerical)) @ white
    if numerical:
        return white + lacking, float(np.sqrt(ratio)), True
    factor = max(level, ratio) if not explained else level
    scale = np.sqrt(factor * _correlation_time(misfit.by_sensor(point.residual)))
    return scale**2 * white + lacking, float(np.sqrt(ratio)), bool(explained)


def _correlation_time(residuals: Sequence[Vector]) -> float:
    """Return by what a correlated residual increases the variance, at least 1: 1 + 2 Σ ρ, up to where ρ is below 0.1.

    Samples scatter in their mean as n over this number of independent ones (Bayley and Hammersley, 1946).
    """
    largest = 1.0
    for part in residuals:
        size = 2 * part.size
        covariance = np.fft.irfft(abs(np.fft.rfft(part, size)) ** 2, size)[: part.size // 2]
        along = covariance / covariance[0]
        below = np.flatnonzero(along < 0.1)
        largest = max(largest, 1.0 + 2.0 * float(along[1 : int(below[0]) if below.size else None].sum()))
    return largest


def _lacking(search: Search, point: Point, discrepancy: float) -> Vector:
    """Return the covariance of columnsᵀ · residual by what the model lacks: a part of each peak, of unit noise."""
    misfit, information = search.misfit, np.zeros((point.columns.shape[1],) * 2)
    width = SETTINGS.correlated * misfit.unit / misfit.measured.step
    kernel = np.exp(-0.5 * (np.arange(-int(4.0 * width), int(4.0 * width) + 1) / width) ** 2)[:, None]
    for columns, fitted, sensor in zip(
        misfit.by_sensor(point.columns), point.fitted, misfit.measured.sensors, strict=True
    ):
        size = discrepancy * float(abs(fitted).max()) / sensor.noise
        information += size**2 * columns.T @ fftconvolve(columns, kernel, mode="same", axes=0)
    return information


def _modes(
    search: Search, best: Solution, others: Sequence[Solution], covariance: Vector, inflation: float
) -> list[Solution]:
    """Return the solutions that the noise does not exclude, the best first."""
    size, modes = search.misfit.size, [best]
    deviations = 3.0 * np.sqrt(np.diag(covariance))[:size]
    for solution in sorted(others, key=lambda one: one.misfit):
        fits = solution.misfit - best.misfit < SETTINGS.unlikely * inflation
        if fits and all((abs(solution.p - mode.p)[:size] > deviations).any() for mode in modes):
            modes.append(solution)
    return modes


def _interval(
    search: Search, best: Solution, modes: Sequence[Solution], k: int, covariance: Vector, inflation: float
) -> tuple[float, float]:
    """Return the 95 % interval of an unknown, as places. inflation: of variances, over those of noise of unit size."""
    size, place = search.misfit.size, float(best.p[k])
    half, root = SETTINGS.deviations * float(np.sqrt(covariance[k, k])), np.sqrt(np.diag(covariance))
    correlated = abs(covariance[k] / (root * root[k]))[:size]
    correlated[k] = 0.0
    ridge = covariance[: best.p.size, k] / covariance[k, k]
    doubtful = (
        half > min(SETTINGS.widest_curvature, place, 1.0 - place) or correlated.max() > SETTINGS.largest_correlation
    )
    rises = []
    if not doubtful:
        low, high = search.misfit.bounds
        line = [np.clip(best.p + side * half * ridge, low, high) for side in (-1.0, 1.0)]
        rises = [(fit - best.misfit) / (inflation * SETTINGS.deviations**2) for fit, _ in search.fits_at(line, best)]
    if rises and all(SETTINGS.least_rise < rise < SETTINGS.largest_rise for rise in rises):
        ends = place - half / rises[0] ** 0.5, place + half / rises[1] ** 0.5
    else:
        below, above = (_risen(search, best, k, half, inflation, limit, ridge) for limit in (0.0, 1.0))
        ends = below, above
    # Fits that are as good lie within the interval, wherever they are, with intervals of their own.
    for mode in modes[1:]:
        room = half * float(np.sqrt(max(1.0 - (mode.misfit - best.misfit) / (SETTINGS.unlikely * inflation), 0.0)))
        ends = min(ends[0], max(mode.p[k] - room, 0.0)), max(ends[1], min(mode.p[k] + room, 1.0))
    return ends


def _risen(search: Search, best: Solution, k: int, half: float, inflation: float, limit: float, ridge: Vector) -> float:
    """Return the place between the best one and a limit where χ², with all others fitted anew, has risen by that of
    95 %; the limit where it has not.

    half: what the curvature predicts; ridge: by how much the others change with this unknown, at the best fit.
    """
    latest, inner, before, side = best.p, float(best.p[k]), -SETTINGS.deviations, np.sign(limit - best.p[k])
    step = min(max(1.05 * half, SETTINGS.finest_profile), 0.1)
    while abs(limit - inner) > 0.5 * SETTINGS.finest_profile:
        outer = inner + side * min(step, abs(limit - inner))
        # The others move on along the ridge, else few tries would not bring them there.
        start = np.clip(latest + (outer - latest[k]) * ridge, *search.misfit.bounds)
        start[k] = outer
        solution = search.solved(start, 8, 1e-3, fixed=k)
        latest = solution.p
        after = float(np.sqrt(max(solution.misfit - best.misfit, 0.0) / inflation)) - SETTINGS.deviations
        if 0.0 < after < SETTINGS.deviations:
            # The root of χ² is nearly straight.
            return float(inner - before / (after - before) * (outer - inner))
        if after <= 0.0:
            inner, before, step = outer, after, 1.6 * step
        else:
            limit, step = outer, 0.5 * abs(outer - inner)
    return limit


def _is_at_end(value: float, low: float, high: float) -> bool:
    return min(value - low, high - value) < 1e-6 * (high - low)


def _verdict(value: float, interval: tuple[float, float], low: float, high: float) -> str:
    """Return the verdict where the model explains the signal."""
    half = 0.5 * (interval[1] - interval[0])
    if half > HALF * abs(value) or 2.0 * half > HALF * (high - low):
        return BLIND
    return AT_END if _is_at_end(value, low, high) else IDENTIFIED


def _of_sensors(search: Search, point: Point, errors: Vector) -> dict[str, Unknown]:
    """Return time zero and gains."""
    misfit, unknowns, gains = search.misfit, dict[str, Unknown](), iter(point.gains.tolist())
    for name, error in zip(misfit.names[misfit.size :], errors[misfit.size :].tolist(), strict=True):
        if name == TIME_ZERO:
            value, half = misfit.time_zero(point.p), error * misfit.unit
            unknowns[name] = Unknown(name, value, (value - half, value + half), NUISANCE, None, "µs", 1e-6)
        else:
            value = next(gains)
            unknowns[name] = Unknown(name, value, (value - error, value + error), NUISANCE)
    return unknowns
