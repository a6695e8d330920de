"""The covariance at the best fit, and 95 % intervals: from the curvature of χ², or from its profile."""

from collections.abc import Sequence

import numpy as np
from scipy.signal import fftconvolve

from coupling.inference.identification import DEVIATIONS
from coupling.inference.misfit import Fit, Misfit, Point, inverse
from coupling.inference.prediction import NUMERICAL
from coupling.inference.search import Search
from structures.structure import Vector

UNLIKELY = 6.0
"""Another minimum is a mode of its own if χ² there is within this number of the least: a likelihood of 5 %."""

FINEST_PROFILE = 1e-3
"""The first step of a profile at least: smaller ones end in the roughness that beads which rattle give χ²; intervals
were too short."""


def covariance_of(misfit: Misfit, point: Point, discrepancy: float) -> tuple[Vector, float, bool]:
    """Return the covariance of all parameters, residual over noise, and whether the residual is noise."""
    measured, numerical = misfit.measured, misfit.is_numerical(point.fit)
    ratio, explained = point.fit.misfit / misfit.degrees, misfit.explains(point.fit)
    # The size of the noise is that of the residual, if it was not given.
    known = measured.given and not any(sensor.memory.size for sensor in measured.sensors)
    factor = 1.0 if numerical or (known and explained) else max(ratio, float(known))

    # What the model lacks, and what runs are inexact by, is a part of each peak that is correlated in time over a
    # quarter of a contact.
    lacking, information = max(discrepancy, NUMERICAL * numerical), np.zeros((point.columns.shape[1],) * 2)
    width = 0.25 * misfit.unit / measured.step
    kernel = np.exp(-0.5 * (np.arange(-int(4.0 * width), int(4.0 * width) + 1) / width) ** 2)[:, None]
    parts = zip(misfit.by_sensor(point.columns), point.fit.fitted, measured.sensors, strict=True)
    for columns, fitted, sensor in parts:
        size = lacking * float(abs(fitted).max()) / sensor.noise
        information += size**2 * columns.T @ fftconvolve(columns, kernel, mode="same", axes=0)
    white = inverse(point.columns)
    covariance = point.carried @ (factor * white + white @ information @ white) @ point.carried.T
    return covariance, float(np.sqrt(ratio)), explained


def interval_of(
    search: Search, modes: Sequence[Fit], k: int, covariance: Vector, inflation: float
) -> tuple[float, float]:
    """Return the 95 % interval of an unknown, as places. modes: all fits that are as good, the best first; inflation:
    of variances, over those of noise of unit size."""
    best, place = modes[0], float(modes[0].places[k])
    covariance = covariance[: search.size, : search.size]
    half, root = DEVIATIONS * float(np.sqrt(covariance[k, k])), np.sqrt(np.diag(covariance))
    correlated = abs(covariance[k] / (root * root[k]))
    correlated[k] = 0.0
    ridge = covariance[k] / covariance[k, k]
    # Where χ² rises much as its curvature predicts, its root is nearly straight, and the rise moves the ends. In fits
    # of eight unknowns these ends are those of the profile within a twentieth of the half-width where χ² rises more
    # than predicted; where it rises less, they lie up to a fifth outside.
    rises = []
    if half < min(0.1, place, 1.0 - place) and correlated.max() < 0.98:
        line = [np.clip(best.places + side * half * ridge, 0.0, 1.0) for side in (-1.0, 1.0)]
        rises = [(fit.misfit - best.misfit) / (inflation * DEVIATIONS**2) for fit in search.misfit.fits(line)]
    if rises and all(1.0 / 3.0 < rise < 1.5 for rise in rises):
        low, high = place - half / rises[0] ** 0.5, place + half / rises[1] ** 0.5
    else:
        low, high = (_risen(search, best, k, half, inflation, limit, ridge) for limit in (0.0, 1.0))
    # Fits that are as good lie within the interval, wherever they are, with intervals of their own.
    for mode in modes[1:]:
        room = half * float(np.sqrt(max(1.0 - (mode.misfit - best.misfit) / (UNLIKELY * inflation), 0.0)))
        low, high = min(low, max(mode.places[k] - room, 0.0)), max(high, min(mode.places[k] + room, 1.0))
    return low, high


def _risen(search: Search, best: Fit, k: int, half: float, inflation: float, limit: float, ridge: Vector) -> float:
    """Return the place between the best one and a limit where χ², with all others fitted anew, has risen by that of
    95 %; the limit where it has not.

    half: what the curvature predicts; ridge: by how much the others change with this unknown, at the best fit.
    """
    latest, inner = best.places, float(best.places[k])
    before, side = -DEVIATIONS, np.sign(limit - inner)
    step = min(max(1.05 * half, FINEST_PROFILE), 0.1)
    while abs(limit - inner) > 0.6 * FINEST_PROFILE:
        outer = inner + side * min(step, abs(limit - inner))
        # The others move on along the ridge, else few tries would not bring them there.
        start = np.clip(latest + (outer - latest[k]) * ridge, 0.0, 1.0)
        start[k] = outer
        fit = search.solved(start, 8, 1e-3, fixed=k)
        latest = fit.places
        after = float(np.sqrt(max(fit.misfit - best.misfit, 0.0) / inflation)) - DEVIATIONS
        if 0.0 < after < DEVIATIONS:
            # The root of χ² is nearly straight.
            return float(inner - before / (after - before) * (outer - inner))
        if after <= 0.0:
            inner, before, step = outer, after, 1.6 * step
        else:
            limit, step = outer, 0.5 * abs(outer - inner)
    return limit
