"""Outliers, hum and drift in a signal: what a fit leaves shows them, and they are taken off before it is repeated."""

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.ndimage import median_filter

from coupling.inference.misfit import OFFSET, Misfit, Point
from structures.structure import Vector

DEGREE = 3
"""Of the polynomial over a record that stands for hum and drift: a record of 1 ms is a small part of a hum's period."""

ROUNDS = 4
"""The baseline and the model are fitted in turn; each round reduces what is left of it by a factor of ten or so."""

SETTLED = 0.02
"""A baseline that changes by less than this part of the noise has settled."""

OUTLYING, NEIGHBOURS, MOST_OUTLIERS = 5.0, 7, 0.05
"""A sample is an outlier if it lies so many standard deviations off the median of its neighbours; no more than this
part of a record."""


def outliers(misfit: Misfit, point: Point) -> list[Vector]:
    """Return which samples of each sensor lie far off their neighbours in what the fit leaves."""
    far = []
    for row in range(len(misfit.used)):
        left = misfit.of_record(point, row)
        filled = np.where(np.isfinite(left), left, 0.0)
        off = np.abs(filled - median_filter(filled, NEIGHBOURS)) > OUTLYING
        far.append(off if off.mean() <= MOST_OUTLIERS else np.zeros_like(off))
    return far


def baselines(misfit: Misfit, point: Point) -> list[Vector]:
    """Return the polynomial through what the fit leaves of each record, its lead included, N over the whole record."""
    every = legvander(_places(misfit), DEGREE)
    smooth = []
    for row, noise in enumerate(misfit.measured.noise):
        left = misfit.of_record(point, row)
        counts = np.isfinite(left)
        parts = np.linalg.lstsq(every[counts], left[counts], rcond=None)[0]
        smooth.append(float(noise) * (every @ parts))
    return smooth


def with_baselines(misfit: Misfit, point: Point) -> Vector:
    """Return the columns of a point with those of a polynomial at each sensor; the lead adds rows, where nothing else
    acts."""
    every, sensors, begin = legvander(_places(misfit), DEGREE), len(misfit.used), 0
    first = 1 if OFFSET in misfit.free else 0
    blocks = []
    names = misfit.names
    for row, (used, number) in enumerate(zip(misfit.used, misfit.measured.sensors, strict=True)):
        counts = np.isfinite(misfit.of_record(point, row)) | used
        block = np.zeros((int(counts.sum()), point.columns.shape[1] + sensors * (DEGREE + 1 - first)))
        block[used[counts], : point.columns.shape[1]] = point.columns[begin : begin + int(used.sum())]
        begin += int(used.sum())
        if first:
            block[:, names.index(f"{OFFSET} {number}")] = 1.0 / misfit.measured.noise[row]
        at = point.columns.shape[1] + row * (DEGREE + 1 - first)
        block[:, at : at + DEGREE + 1 - first] = every[counts, first:] / misfit.measured.noise[row]
        blocks.append(block)
    return np.vstack(blocks)


def _places(misfit: Misfit) -> Vector:
    """Return the times of the record from -1 to 1."""
    time = misfit.measured.time
    return np.asarray(2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0)
