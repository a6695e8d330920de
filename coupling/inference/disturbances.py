"""What a sensor reads besides waves and white noise: hum, drift and correlated noise, as its quiet lead shows them.

A fit carries them as a part of the noise's covariance (generalised least squares). The lead alone says which there are,
and how large they can be: what a model lacks shows only where there are waves, and no disturbance may explain it.
"""

from itertools import product
from math import pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander
from numpy.typing import NDArray
from scipy.ndimage import label, median_filter
from scipy.signal import lfilter
from scipy.stats import fisher_exact

from coupling.signals.conditioning import HARMONICS
from structures.structure import Vector

STRONG = 6.0
"""A disturbance is in a lead if Bayes's information criterion is lower by this much than of white noise alone: strong
evidence (Kass and Raftery, 1995)."""

ORDERS, DEGREES = 4, 3
"""Most steps back that noise remembers, and the degree of the polynomial that is looked for in a lead."""

FEWEST = 32
"""Samples of a lead that shows them."""

MAINS = (50.0, 60.0)
"""Hz; a hum has their harmonics, too."""

MARGIN = 3.0
"""The standard deviation of a disturbance, in parts of what the lead shows: a hum may be near its zero there."""

LEAST = 1e-2
"""Shapes of a disturbance whose standard deviation is below this part of the noise are left out."""

OF_MEDIAN = sqrt(pi / 2.0)
"""Standard error of a median over that of a mean, of Gaussian noise. A lead of 200 samples gives the zero of the force
to 0.09 times the noise, which thousands of samples after it see."""

OUTLYING, NEIGHBOURS, MOST_ADJACENT = 5.0, 7, 2
"""An outlier is OUTLYING standard deviations off the median of its NEIGHBOURS, in a group of MOST_ADJACENT at most."""

CHANCE = 0.01
"""Outliers whose shares of the lead and of the waves differ as by this chance are errors of the model."""


class Disturbance(NamedTuple):
    """What a sensor reads besides waves and white noise.

    memory: coefficients of noise that remembers its last samples; step: standard deviation of what is new in each, N;
    slow: times × shapes of hum and drift, N, each of its standard deviation; size: of these in the lead, N.
    """

    memory: Vector
    step: float
    slow: Vector
    size: float


class Whitener(NamedTuple):
    """The square root of the inverse of the noise's covariance, at the samples that count.

    shapes: samples × orthonormal shapes of hum and drift; sizes: their standard deviations; every: all times × shapes.
    """

    memory: Vector
    step: float
    shapes: Vector
    sizes: Vector
    every: Vector

    def __call__(self, values: Vector) -> Vector:
        """Return values, or columns of values, such that their noise is white."""
        values = _without_memory(values, self.memory, self.step)
        if self.sizes.size:
            values = values - (self.shapes * (1.0 - 1.0 / np.hypot(1.0, self.sizes))) @ (self.shapes.T @ values)
        return values

    def slow(self, residual: Vector) -> Vector:
        """Return the likeliest hum and drift at all times, for what a fit leaves before it is whitened."""
        residual = _without_memory(residual, self.memory, self.step)
        likeliest: Vector = self.every @ (self.sizes**2 / (1.0 + self.sizes**2) * (self.shapes.T @ residual))
        return likeliest


def whitener(disturbance: Disturbance | None, noise: float, used: Vector, lead: int) -> Whitener:
    """Return the whitener of a sensor; noise: standard deviation of a sample, N; used: which samples count.

    lead: the samples whose median is the zero of the force, which they give with an error; 0 if it has none.
    """
    memory, step, slow = np.zeros(0), 1.0, np.zeros((used.size, 0))
    if disturbance is not None:
        memory, step, slow = disturbance.memory, disturbance.step / noise, disturbance.slow / noise
    if not slow.size and not lead:
        return Whitener(memory, step, slow[used], np.zeros(0), slow)
    shown = slow
    if not slow.size:
        error = OF_MEDIAN * step / max(1.0 - float(memory.sum()), 1.0 / lead) / sqrt(lead)
        slow, shown = np.full((used.size, 1), error), np.zeros((used.size, 1))
    shapes, sizes, turned = np.linalg.svd(_without_memory(slow[used], memory, step), full_matrices=False)
    large = sizes > LEAST
    return Whitener(memory, step, shapes[:, large], sizes[large], shown @ turned[large].T / sizes[large])


def _without_memory(values: Vector, memory: Vector, step: float) -> Vector:
    """Return what is new in each sample, over its standard deviation; of the first ones all is new."""
    if not memory.size:
        return values
    new = lfilter(np.append(1.0, -memory), [1.0], values, axis=0) / step
    new[: memory.size] *= step
    return np.asarray(new)


def disturbance_of(time: Vector, force: Vector, lead: int, noise: float, has_offset: bool) -> Disturbance | None:
    """Return what a quiet lead shows, or None.

    lead: its samples; noise: standard deviation of a sample, N; has_offset: whether the fit has an offset, so that a
    constant is no disturbance.
    """
    if lead < FEWEST:
        return None
    quiet = force[:lead] / noise
    quiet = np.where(outlying(quiet, 1.0), np.nan, quiet)
    shapes = legvander(np.linspace(-1.0, 1.0, lead), DEGREES)
    before = np.stack([np.append(np.full(k, np.nan), quiet[: lead - k]) for k in range(1, ORDERS + 1)], axis=1)
    rows = np.isfinite(quiet) & np.isfinite(before).all(axis=1)
    if rows.sum() < FEWEST:
        return None
    fits = [
        _fit(quiet[rows], np.hstack([before[rows, :order], shapes[rows, :terms]]), order)
        for order, terms in product(range(ORDERS + 1), range(int(has_offset), DEGREES + 2))
    ]
    best = min(fits, key=lambda fit: fit.criterion)
    if best.criterion > fits[0].criterion - STRONG:
        return None
    return best.disturbance(time, shapes, noise, has_offset)


class _Fit(NamedTuple):
    """Autoregression and polynomial of a lead."""

    criterion: float
    memory: NDArray[Any]
    step: float
    terms: NDArray[Any]
    errors: NDArray[Any]

    def disturbance(self, time: Vector, shapes: NDArray[Any], noise: float, has_offset: bool) -> Disturbance:
        """Return what they say of the whole record."""
        lead = len(shapes)
        passed = max(1.0 - float(self.memory.sum()), 1.0 / lead)
        terms, errors = noise / passed * self.terms, noise / passed * self.errors
        base = shapes[:, : terms.size] @ terms
        size = float(np.sqrt(np.mean((base - has_offset * base.mean()) ** 2)))
        slow = np.zeros((time.size, 0))
        if terms.size > int(has_offset):
            # A polynomial of a lead says nothing of what follows it but by its size and its slope.
            slope = float(np.sqrt(np.mean(legval(np.linspace(-1.0, 1.0, lead), legder(terms)) ** 2)))
            slope = max(slope, float(errors[1]) if errors.size > 1 else 0.0) * 2.0 / (time[lead - 1] - time[0])
            orders = np.array([[1.0 / k**2, k * mains] for k in range(1, HARMONICS + 1) for mains in MAINS])
            phases = 2.0 * pi * np.outer(time - time[0], orders[:, 1])
            waves = np.hstack([np.cos(phases), np.sin(phases)]) * np.tile(size * orders[:, 0], 2)
            ramp = slope * (time - time[lead // 2])[:, None]
            slow = MARGIN * np.hstack([waves, ramp, np.full_like(ramp, size)])
        return Disturbance(self.memory, noise * self.step, slow, size)


def _fit(values: Vector, columns: Vector, order: int) -> _Fit:
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    left = values - columns @ found
    count, variance = values.size, float(left @ left) / values.size
    errors = np.sqrt(variance * np.diag(np.linalg.pinv(columns.T @ columns)))
    criterion = count * np.log(variance) + found.size * np.log(count)
    return _Fit(criterion, found[:order], sqrt(variance) if order else 1.0, found[order:], errors[order:])


def outlying(values: Vector, noise: float) -> NDArray[np.bool_]:
    """Return which samples lie far off their neighbours, alone or in pairs."""
    filled = np.where(np.isfinite(values), values, 0.0)
    far = np.abs(filled - median_filter(filled, NEIGHBOURS)) > OUTLYING * noise
    far &= np.isfinite(values)
    groups, count = label(far)
    few = np.bincount(groups.ravel(), minlength=count + 1) <= MOST_ADJACENT
    return np.asarray(far & few[groups])


def outliers(left: Vector, lead: int) -> NDArray[np.bool_]:
    """Return which samples are outliers in what a fit leaves of a record; none where the lead, of `lead` samples, has
    another share of them than the waves."""
    far, there = outlying(left, 1.0), np.isfinite(left)
    counts = [[int(far[part].sum()), int((there & ~far)[part].sum())] for part in (slice(lead), slice(lead, None))]
    return far if lead and fisher_exact(counts)[1] > CHANCE else np.zeros_like(far)
