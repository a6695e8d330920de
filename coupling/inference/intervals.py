"""Intervals and verdicts at the best fit, and whether the model explains the signal."""

from collections.abc import Mapping, Sequence
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
)
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
        rows = misfit.data(best.fit).residual.transpose("sensor", "time").values
        sensors = [
            remembered(sensor, row) if sensor.memory.size else sensor
            for sensor, row in zip(misfit.measured.sensors, rows, strict=True)
        ]
        rivals = [one.places for one in solutions if one.misfit < best.misfit + 10.0 * SETTINGS.unlikely]
        misfit.count(misfit.measured._replace(sensors=sensors), best.fit.time_zero)
        solutions = [search.solved(places) for places in rivals]
        best, point, beside = search.settled(search.solved(best.places))
    covariance, size, explained = _covariance(search, point, discrepancy)

    # Other solutions that the noise does not exclude, and that are apart.
    inflation = np.maximum(np.diag(covariance) / np.diag(inverse(point.columns)), 1e-6)[: search.size]
    modes, deviations = [best], 3.0 * np.sqrt(np.diag(covariance))[: search.size]
    for solution in sorted([*solutions, *beside], key=lambda one: one.misfit):
        as_good = solution.misfit - best.misfit < SETTINGS.unlikely * float(inflation.max())
        if as_good and all((abs(solution.places - mode.places) > deviations).any() for mode in modes):
            modes.append(solution)

    unknowns = dict[str, Unknown]()
    for k, unknown in enumerate(search.ranges):
        ends = _interval(search, modes, k, covariance, float(inflation[k]))
        value, low, high = (unknown.value(place) for place in (best.places[k], *ends))
        if unknown.name in nuisances:
            verdict = NUISANCE
        elif not explained:
            verdict = NOT_TRUSTED
        elif high - low > HALF * min(2.0 * abs(value), unknown.high - unknown.low):
            verdict = BLIND
        else:
            verdict = AT_END if _is_at_end(best.places[k]) else IDENTIFIED
        unknowns[unknown.name] = Unknown(unknown.name, value, (low, high), verdict)
    halves, gains = SETTINGS.deviations * np.sqrt(np.diag(covariance)), iter(best.fit.gains.tolist())
    for name, half in zip(misfit.names[search.size :], halves[search.size :].tolist(), strict=True):
        if name == TIME_ZERO:
            value, half = best.fit.time_zero, half * misfit.unit
            unknowns[name] = Unknown(name, value, (value - half, value + half), NUISANCE, "µs", 1e-6)
        else:
            value = next(gains)
            unknowns[name] = Unknown(name, value, (value - half, value + half), NUISANCE)

    said, notes = _notes(search, best, unknowns)
    if not explained:
        notes.insert(
            0,
            f"the residual is {size:.3g} times the noise: the model lacks something, and values may be biased by more "
            "than their intervals",
        )
    if len(modes) > 1:
        notes.append(f"{len(modes)} different fits are as good; the intervals contain all of them")
    if explained and search.guess is None and search.size >= SETTINGS.many_unknowns:
        notes.append(
            f"identify: without a guess a fit of {SETTINGS.many_unknowns} unknowns or more may end at a wrong minimum "
            "that explains the signal; fit again with another seed and compare"
        )
    for note in notes:
        caution(note)
    root = np.sqrt(np.diag(covariance))
    correlation = xr.DataArray(covariance / np.outer(root, root), {"unknown": misfit.names, "other": misfit.names})
    fits = [prediction.values(mode.places) for mode in modes]
    return Identification(
        unknowns, correlation, misfit.data(best.fit), size, explained, fits, prediction.runs,
        [*said, *notes], inputs,
    )  # fmt: skip


def _is_at_end(place: float) -> bool:
    return min(place, 1.0 - place) < 1e-6


def _notes(search: Search, best: Solution, unknowns: Mapping[str, Unknown]) -> tuple[list[str], list[str]]:
    """Return what runs warned of, and what the user must know of the fit."""
    misfit, prediction, notes = search.misfit, search.misfit.prediction, list[str]()
    said = [warning for warning in prediction.warnings.values() if not warning.startswith(YIELD)]
    if len(said) < len(prediction.warnings):
        # Of yield, only what the best run does.
        with collected():
            run = prediction.made(**prediction.values(best.places)).run(prediction.until)
        notes += [finding for finding in findings_of(run) if finding.startswith(YIELD)]
    at_end = [unknown.name for unknown, place in zip(search.ranges, best.places, strict=True) if _is_at_end(place)]
    notes += [f"{name}: {AT_END}; widen it" for name in at_end]
    notes += [
        f"{name} is negative: this sensor's sign is reversed; give it a negative calibration, or turn its wires"
        for name, one in unknowns.items()
        if name.startswith(f"{GAIN} ") and one.interval[1] < 0.0
    ]

    # What was fitted as hum, drift and correlated noise.
    data = misfit.data(best.fit)
    for row, sensor in enumerate(misfit.measured.sensors):
        if sensor.drifts:
            baseline, peak = data.baseline.values[row][misfit.used[row]], float(abs(best.fit.fitted[row]).max())
            notes.append(
                f"sensor {sensor.bead}: the quiet lead shows hum or drift; ± {50.0 * np.ptp(baseline) / peak:.2g} % of "
                "the peak was fitted"
            )
        if sensor.memory.size:
            notes.append(
                f"sensor {sensor.bead}: its noise is correlated from sample to sample, as the quiet lead shows, and "
                f"was fitted with a memory of {count_of(sensor.memory.size, 'sample')}"
            )
    if prediction.failed:
        notes.append(f"{prediction.failed} of {prediction.runs} runs failed, and were left out")
    return said, notes


def _covariance(search: Search, point: Point, discrepancy: float) -> tuple[Vector, float, bool]:
    """Return the covariance of all parameters, residual over noise, and whether the residual is noise."""
    misfit, measured, numerical = search.misfit, search.misfit.measured, search.misfit.is_numerical(point.fit)
    ratio = point.fit.misfit / max(misfit.samples - len(misfit.names), 1)
    explained = misfit.explains(point.fit)
    # The size of the noise is that of the residual, if it was not given.
    known = measured.given and not any(sensor.memory.size for sensor in measured.sensors)
    factor = 1.0 if numerical or (known and explained) else max(ratio, float(known))

    # What the model lacks, and what runs are inexact by, is a part of each peak that is correlated in time.
    lacking, information = max(discrepancy, NUMERICAL * numerical), np.zeros((point.columns.shape[1],) * 2)
    width = SETTINGS.correlated * misfit.unit / measured.step
    kernel = np.exp(-0.5 * (np.arange(-int(4.0 * width), int(4.0 * width) + 1) / width) ** 2)[:, None]
    parts = zip(misfit.by_sensor(point.columns), point.fit.fitted, measured.sensors, strict=True)
    for columns, fitted, sensor in parts:
        size = lacking * float(abs(fitted).max()) / sensor.noise
        information += size**2 * columns.T @ fftconvolve(columns, kernel, mode="same", axes=0)
    white = inverse(point.columns)
    covariance = point.carried @ (factor * white + white @ information @ white) @ point.carried.T
    return covariance, float(np.sqrt(ratio)), explained


def _interval(
    search: Search, modes: Sequence[Solution], k: int, covariance: Vector, inflation: float
) -> tuple[float, float]:
    """Return the 95 % interval of an unknown, as places. modes: all fits that are as good, the best first; inflation:
    of variances, over those of noise of unit size."""
    best, place = modes[0], float(modes[0].places[k])
    covariance = covariance[: search.size, : search.size]
    half, root = SETTINGS.deviations * float(np.sqrt(covariance[k, k])), np.sqrt(np.diag(covariance))
    correlated = abs(covariance[k] / (root * root[k]))
    correlated[k] = 0.0
    ridge = covariance[k] / covariance[k, k]
    # Where χ² is nearly a parabola, its root is straight, and what it rises by moves the ends a little.
    rises = []
    if half < min(SETTINGS.widest_curvature, place, 1.0 - place) and correlated.max() < SETTINGS.largest_correlation:
        line = [np.clip(best.places + side * half * ridge, 0.0, 1.0) for side in (-1.0, 1.0)]
        rises = [(fit.misfit - best.misfit) / (inflation * SETTINGS.deviations**2) for fit in search.misfit.fits(line)]
    if rises and all(SETTINGS.least_rise < rise < SETTINGS.largest_rise for rise in rises):
        low, high = place - half / rises[0] ** 0.5, place + half / rises[1] ** 0.5
    else:
        low, high = (_risen(search, best, k, half, inflation, limit, ridge) for limit in (0.0, 1.0))
    # Fits that are as good lie within the interval, wherever they are, with intervals of their own.
    for mode in modes[1:]:
        room = half * float(np.sqrt(max(1.0 - (mode.misfit - best.misfit) / (SETTINGS.unlikely * inflation), 0.0)))
        low, high = min(low, max(mode.places[k] - room, 0.0)), max(high, min(mode.places[k] + room, 1.0))
    return low, high


def _risen(search: Search, best: Solution, k: int, half: float, inflation: float, limit: float, ridge: Vector) -> float:
    """Return the place between the best one and a limit where χ², with all others fitted anew, has risen by that of
    95 %; the limit where it has not.

    half: what the curvature predicts; ridge: by how much the others change with this unknown, at the best fit.
    """
    latest, inner = best.places, float(best.places[k])
    before, side = -SETTINGS.deviations, np.sign(limit - inner)
    step = min(max(1.05 * half, SETTINGS.finest_profile), 0.1)
    while abs(limit - inner) > 0.6 * SETTINGS.finest_profile:
        outer = inner + side * min(step, abs(limit - inner))
        # The others move on along the ridge, else few tries would not bring them there.
        start = np.clip(latest + (outer - latest[k]) * ridge, 0.0, 1.0)
        start[k] = outer
        solution = search.solved(start, 8, 1e-3, fixed=k)
        latest = solution.places
        after = float(np.sqrt(max(solution.misfit - best.misfit, 0.0) / inflation)) - SETTINGS.deviations
        if 0.0 < after < SETTINGS.deviations:
            # The root of χ² is nearly straight.
            return float(inner - before / (after - before) * (outer - inner))
        if after <= 0.0:
            inner, before, step = outer, after, 1.6 * step
        else:
            limit, step = outer, 0.5 * abs(outer - inner)
    return limit
