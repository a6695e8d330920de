"""Intervals and verdicts at the best fit, and whether the model explains the signal."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from scipy.signal import fftconvolve
from scipy.stats import chi2, t

from coupling.inference.disturbances import NEIGHBOURS, outliers
from coupling.inference.features import Features
from coupling.inference.identification import (
    AT_END,
    NOT_TRUSTED,
    NUISANCE,
    Identification,
    Unknown,
    is_at_end,
    verdict_of,
)
from coupling.inference.misfit import (
    GAIN,
    LONGEST_TIME_CONSTANT,
    OFFSET,
    SHORTEST_TIME_CONSTANT,
    TIME_CONSTANT,
    TIME_ZERO,
    Point,
)
from coupling.inference.posterior import sampled
from coupling.inference.prediction import NUMERICAL
from coupling.inference.search import BESIDE, SAME, GlobalSearch, Solution, inverse
from coupling.results.findings import findings_of
from structures.caution import caution, collected
from structures.checks import count_of
from structures.structure import Vector

YIELD = "yield: "
"""The first word of a run's finding on contacts beyond yield."""

WITHIN = 6.0
"""Another minimum is a mode of its own if χ² there is within this number of the least: a likelihood of 5 %."""

FOLLOWED = 10.0
"""Minima within this many times WITHIN are solved again where outliers are left out."""

REACH = 3.841458820694124
"""χ² of one unknown with probability 95 %."""

DOUBTFUL = 0.1
"""Intervals wider than this part of a range come from the profile of the likelihood, not from its curvature."""

LEAST_RISE, LARGEST_RISE = 0.8, 1.25
"""So do those at whose ends χ² rises by less or more than these parts of what its curvature predicts. Within them its
root is nearly straight, which moves the ends.
"""

INDEPENDENT, MOST_TAKEN = 0.1, 0.5
"""Samples are independent where their correlation is below this; the largest part of them that a fit takes."""

CORRELATED = 0.25
"""Standard deviation of the Gaussian by which a discrepancy is correlated in time, in contact times."""

SHORT, LONG = 1e-3, 0.1
"""Shortest and longest first step of a profile, in parts of the range."""

BEYOND = 1.05
"""By so much longer steps than those that a straight rise of χ predicts, a profile encloses the end of an interval."""

EXPLAINED = 0.9999
"""Probability of a χ² of features beyond which the model does not explain them."""

WIDENED = 1.1
"""Variances that exceed those of white noise by more than this factor are looked at beyond two standard deviations."""

LARGEST_CORRELATION = 0.98
"""So do those of unknowns that are more correlated than this."""

PARTS, NEAR = "mµn", 1.5
"""Prefixes of units 10³, 10⁶ and 10⁹ times smaller; a gain within this factor of these numbers is remarked."""

UNITS = {TIME_ZERO: ("µs", 1e-6), TIME_CONSTANT: ("ms", 1e-3), OFFSET: ("N", 1.0)}
"""Units in which the sensors' nuisances are shown, and their sizes."""


class Judgement:
    """The conclusions from the minima that a search found.

    discrepancy: of the model, as a part of each peak; nuisances: names of what is of no interest.
    """

    def __init__(self, search: GlobalSearch, discrepancy: float, nuisances: Sequence[str]) -> None:
        self.search, self.discrepancy, self.nuisances = search, discrepancy, nuisances
        self.misfit, self.ranges = search.misfit, search.ranges

    def result(self, inputs: dict[str, Any]) -> Identification:
        """Scan, solve, and judge."""
        prediction = self.misfit.prediction
        prediction.stage("search")
        solutions = self.search.solutions()
        prediction.stage("intervals")
        best, point, beside = self.search.settled(solutions[0])
        if left_out := self._without_outliers(best, point):
            near = [solution.p for solution in solutions if solution.misfit < best.misfit + FOLLOWED * WITHIN]
            solutions = [self.search.solved(p) for p in near]
            best, point, beside = self.search.settled(self.search.solved(best.p))
        covariance, misfit, explained, reach = self._covariance(point)
        size_known = self.misfit.measured.size_known or not explained or self.misfit.is_numerical(point.residual)
        scale = max(misfit**2, 1.0) if size_known else misfit**2
        modes = self._modes(best, solutions, beside, covariance, scale)
        unknowns = self._unknowns(best, point, covariance, reach, scale, modes, explained)
        said = self._said(best)
        notes = [*said]
        if not explained:
            notes.append(
                f"the residual is {misfit:.3g} times the noise: the model lacks something, and values may be biased by "
                "more than their intervals"
            )
        notes += [
            f"{unknown.name}: {AT_END}; widen it"
            for unknown in unknowns.values()
            if unknown.range is not None and is_at_end(unknown.value, unknown.range)
        ]
        notes += [
            f"{unknown.name} is negative: this sensor's sign is reversed; give it a negative calibration, or turn "
            "its wires"
            for unknown in unknowns.values()
            if unknown.name.startswith(f"{GAIN} ") and unknown.interval[1] < 0.0
        ]
        notes += left_out + self._disturbances(point) + self._other_units(point)
        if explained and isinstance(self.misfit, Features) and self.misfit.samples <= len(self.ranges):
            notes.append(
                f"{self.misfit.samples} values of AR and TOF determine as many unknowns: a wrong model goes unnoticed"
            )
        if len(modes) > 1:
            notes.append(f"{len(modes)} different fits are as good; the intervals contain all of them")
        if failed := self.misfit.prediction.failed:
            notes.append(f"{failed} of {self.misfit.prediction.runs} runs failed, and were left out")
        for note in notes[len(said) :]:
            caution(note)
        return Identification(
            unknowns, self._correlation(covariance), self.misfit.data(point), misfit, explained,
            [self.misfit.prediction.values(mode.p[: len(self.ranges)]) for mode in modes], best.converged,
            self.misfit.prediction.runs, notes,
            inputs, partial(sampled, self.search, best.p, self._flatness(point, covariance)),
        )  # fmt: skip

    def _said(self, best: Solution) -> list[str]:
        """Return what the runs of the search warned of; of yield, only what the best run does."""
        prediction = self.misfit.prediction
        said = [warning for warning in prediction.warnings if not warning.startswith(YIELD)]
        if len(said) < len(prediction.warnings):
            with collected():
                run = prediction.made(**prediction.values(best.p[: len(self.ranges)])).run(prediction.until)
            said += (finding for finding in findings_of(run) if finding.startswith(YIELD))
        return said

    def _without_outliers(self, best: Solution, point: Point) -> list[str]:
        """Leave out samples that lie far off their neighbours in what the best fit leaves; return that in words."""
        misfit, measured = self.misfit, self.misfit.measured
        # What a model lacks changes in a contact time: it looks like no outlier of fine samples.
        coarse = misfit.unit < 2.0 * NEIGHBOURS * measured.step
        if coarse or isinstance(misfit, Features) or misfit.is_numerical(point.residual):
            return []
        far = np.stack([outliers(misfit.of_record(point, row), lead) for row, lead in enumerate(measured.leads)])
        if not far.any():
            return []
        misfit.measured = measured._replace(force=np.where(far, np.nan, measured.force))
        self.search.count_other_samples(misfit.time_zero(best.p))
        words = count_of(int(far.sum()), "sample is an outlier and was", "samples are outliers and were")
        return [f"{words} left out"]

    def _disturbances(self, point: Point) -> list[str]:
        """Return what was fitted as hum, drift and correlated noise, in words."""
        said = list[str]()
        if isinstance(self.misfit, Features):
            return said
        for row, sensor in enumerate(self.misfit.measured.sensors):
            shown = self.misfit.measured.disturbance(row)
            if shown is None:
                continue
            peak = float(abs(point.fitted[row]).max())
            if shown.slow.size:
                most = float(abs(self.misfit.slow(point, row)).max())
                said.append(
                    f"sensor {sensor}: hum, drift or an offset of {100.0 * shown.size / peak:.2g} % of the peak in the "
                    f"quiet lead was fitted, up to {100.0 * most / peak:.2g} % over the record"
                )
            if shown.memory.size:
                said.append(
                    f"sensor {sensor}: its noise is correlated from sample to sample, as the quiet lead shows, and was "
                    f"fitted with a memory of {count_of(shown.memory.size, 'sample')}"
                )
        return said

    def _other_units(self, point: Point) -> list[str]:
        """Return the sensors whose force is about 10³, 10⁶, 10⁻³ … times what the model expects, as in another unit."""
        if isinstance(self.misfit, Features):  # these do not depend on gains
            return []
        said = []
        for row, (sensor, used) in enumerate(zip(self.misfit.measured.sensors, self.misfit.used, strict=True)):
            heights = float(np.ptp(self.misfit.measured.force[row][used])), float(np.ptp(point.fitted[row]))
            gain = abs(float(point.gains[row])) if GAIN in self.misfit.free else heights[0] / (heights[1] or np.inf)
            thousands = round(np.log10(gain or 1.0) / 3.0)
            size = 1e3**thousands
            if not 1 <= abs(thousands) <= len(PARTS) or not 1.0 / NEAR < gain / size < NEAR:
                continue
            units = "V or N", " or ".join(PARTS[abs(thousands) - 1] + unit for unit in "VN")
            read, true = units if thousands > 0 else units[::-1]
            said.append(
                f"sensor {sensor}: its force is {gain:.4g} times what the model expects, near {size:g}: "
                f"was it measured in {true}, and read in {read}? Check unit and calibration"
            )
        return said

    def _flatness(self, point: Point, covariance: Vector) -> float:
        """Return the factor by which variances exceed those of white noise of the size that is known."""
        return float((np.diag(covariance) / np.diag(inverse(point.columns)))[: len(self.ranges)].max())

    def _covariance(self, point: Point) -> tuple[Vector, float, bool, float]:
        """Return the covariance of all parameters; residual over noise; whether it is noise; and standard deviations of
        a 95 % interval."""
        white, degrees = inverse(point.columns), point.residual.size - point.columns.shape[1]
        if isinstance(self.misfit, Features):
            return self._of_features(self.misfit, white, point, degrees)
        ratio = point.misfit / degrees
        numerical = self.misfit.is_numerical(point.residual)
        # What runs are inexact by is correlated, as all that a model lacks.
        lacking = white @ self._lacking(point, max(self.discrepancy, NUMERICAL * numerical)) @ white
        level = 1.0 if self.misfit.measured.size_known else ratio
        enough = ratio < (1.0 + 4.0 * np.sqrt(2.0 / degrees)) * level
        white_noise = bool(enough and self.misfit.is_white(point.residual))
        if white_noise and not self.misfit.drifts(point.residual):
            return level * white + lacking, float(np.sqrt(ratio)), True, 1.959964
        if numerical:
            return white + lacking, float(np.sqrt(ratio)), True, 1.959964
        spread, independent = self._correlated(point, white)
        left = max(independent - point.columns.shape[1], 3.0)
        larger = np.maximum(np.diag(white @ spread @ white), ratio * np.diag(white)) + np.diag(lacking)
        scale = np.sqrt(larger / np.diag(white))
        return scale[:, None] * white * scale, float(np.sqrt(ratio)), white_noise, float(t.ppf(0.975, left))

    def _correlated(self, point: Point, white: Vector) -> tuple[Vector, float]:
        """Return the covariance of columnsᵀ · residual for noise correlated in time, and the number of independent
        samples.

        The correlation is that of the whole record: where the columns are large, the fit has suppressed it.
        """
        spread, independent, begin = np.zeros_like(white), 0.0, 0
        for row, used in enumerate(self.misfit.used):
            residual = self.misfit.of_record(point, row)
            columns = np.zeros((residual.size, len(white)))
            columns[used] = point.columns[begin : begin + int(used.sum())]
            begin += int(used.sum())
            covariance, count = correlation_of(residual)
            lags = np.concatenate([covariance[:0:-1], covariance])
            part = columns.T @ fftconvolve(columns, lags[:, None], mode="same", axes=0)
            # What the fit took from the residual is missing in its correlation.
            taken = min(float(np.trace(white @ part)) / covariance[0], MOST_TAKEN * count)
            spread += part * count / (count - taken)
            independent += independent_samples(covariance, count)
        return spread, independent

    def _of_features(
        self, misfit: Features, white: Vector, point: Point, degrees: int
    ) -> tuple[Vector, float, bool, float]:
        """Return these for AR and TOF, whose scatter is known. As many values as unknowns can always be explained."""
        ratio = point.misfit / degrees if degrees else 1.0
        explained = bool(point.misfit < chi2.ppf(EXPLAINED, degrees)) if degrees else True
        size = (self.discrepancy * point.fitted[0] / misfit.spread)[:, None]
        lacking = white @ ((size * point.columns).T @ (size * point.columns)) @ white
        return (1.0 if explained else ratio) * white + lacking, float(np.sqrt(ratio)), explained, 1.959964

    def _lacking(self, point: Point, discrepancy: float) -> Vector:
        """Return the covariance of columnsᵀ · residual by what the model lacks: a part of each peak, of unit noise."""
        information = np.zeros((point.columns.shape[1],) * 2)
        if discrepancy == 0.0:
            return information
        measured, begin = self.misfit.measured, 0
        width = CORRELATED * self.misfit.unit / measured.step
        lags = np.arange(-int(4.0 * width), int(4.0 * width) + 1)
        kernel = np.exp(-0.5 * (lags / width) ** 2)[:, None]
        for used, fitted, noise in zip(self.misfit.used, point.fitted, measured.noise, strict=True):
            columns = point.columns[begin : begin + int(used.sum())]
            begin += len(columns)
            size = discrepancy * float(abs(fitted).max()) / noise
            information += size**2 * columns.T @ fftconvolve(columns, kernel, mode="same", axes=0)
        return information

    def _unknowns(
        self, best: Solution, point: Point, covariance: Vector, reach: float, scale: float,
        modes: list[Solution], explained: bool,
    ) -> dict[str, Unknown]:  # fmt: skip
        errors = reach * np.sqrt(np.diag(covariance))
        correlated = abs(covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance))) - np.eye(len(errors)))
        unknowns = {}
        for k, unknown in enumerate(self.ranges):
            value, half = unknown.value(best.p[k]), errors[k]
            inflation = max(scale, float(covariance[k, k] / max(inverse(point.columns)[k, k], 1e-300)))
            doubtful = half > min(DOUBTFUL, best.p[k], 1.0 - best.p[k])
            doubtful = doubtful or correlated[k, : len(self.ranges)].max() > LARGEST_CORRELATION
            rises = None if doubtful else self._rises(best, point, k, covariance, reach, inflation)
            if rises is not None and all(LEAST_RISE < rise < LARGEST_RISE for rise in rises):
                below, above = (half / rise**0.5 for rise in rises)
                ends = best.p[k] - below, best.p[k] + above
            else:
                ridge = covariance[: best.p.size, k] / covariance[k, k]
                ends = self._profile(best, k, half, inflation * (reach / 1.959964) ** 2, ridge)
            # Fits that are as good lie within the interval, wherever they are, with intervals of their own.
            for mode in modes[1:]:
                room = half * np.sqrt(1.0 - (mode.misfit - best.misfit) / (WITHIN * scale))
                ends = min(ends[0], max(mode.p[k] - room, 0.0)), max(ends[1], min(mode.p[k] + room, 1.0))
            low, high = (unknown.value(end) for end in ends)
            bounds = unknown.low, unknown.high
            verdict = verdict_of(value, (low, high), bounds) if explained else NOT_TRUSTED
            verdict = NUISANCE if unknown.name in self.nuisances else verdict
            unknowns[unknown.name] = Unknown(unknown.name, value, (low, high), verdict, bounds)
        return unknowns | self._of_sensors(best, point, errors)

    def _rises(
        self, best: Solution, point: Point, k: int, covariance: Vector, reach: float, inflation: float
    ) -> tuple[float, float]:
        """Return how much χ² rises at both ends of an interval, in parts of what its curvature predicts."""
        # The others move along, as the correlations say.
        step = reach * covariance[: best.p.size, k] / np.sqrt(covariance[k, k])
        rises, wanted = self.search.rises.get(k), BESIDE[0] ** 2
        if rises is None or covariance[k, k] > WIDENED * inverse(point.columns)[k, k]:
            low, high = self.misfit.bounds()
            ends = [np.clip(best.p + side * step, low, high) for side in (-1.0, 1.0)]
            (below, _), (above, _) = self.search.fits_at(ends, best)
            rises, wanted = (below - best.misfit, above - best.misfit), inflation * reach**2
        return rises[0] / wanted, rises[1] / wanted

    def _of_sensors(self, best: Solution, point: Point, errors: Vector) -> dict[str, Unknown]:
        """Return the nuisances of the sensors."""
        names, values = self.misfit.names[len(self.ranges) :], list[float]()
        for name in names:
            kind, _, sensor = name.partition(" ")
            row = self.misfit.measured.sensors.index(int(sensor)) if sensor else 0
            if kind == TIME_ZERO:
                values.append(self.misfit.time_zero(best.p))
            elif kind == TIME_CONSTANT:
                values.append(float(self.misfit.time_constant(best.p) or np.nan))
            else:
                values.append(float((point.gains if kind == GAIN else point.offsets)[row]))
        unknowns = {}
        for name, value, error in zip(names, values, errors[len(self.ranges) :], strict=True):
            half = error * self.misfit.unit if name == TIME_ZERO else float(error)
            ends = (value - half, value + half)
            if name == TIME_CONSTANT:
                wide = float(np.exp(min(half, 50.0)))
                ends = max(value / wide, SHORTEST_TIME_CONSTANT), min(value * wide, LONGEST_TIME_CONSTANT)
            unit, size = UNITS.get(name.partition(" ")[0], ("", 1.0))
            unknowns[name] = Unknown(name, value, ends, NUISANCE, unit=unit, unit_size=size)
        return unknowns

    def _profile(self, best: Solution, k: int, half: float, inflation: float, ridge: Vector) -> tuple[float, float]:
        """Return where χ², with all others fitted anew, has risen by that of 95 %; the ends of the range where it has
        not.

        ridge: by how much the others change with this unknown, at the best fit.
        """
        low, high = (self._risen(best, k, half, inflation, limit, ridge) for limit in (0.0, 1.0))
        return low, high

    def _risen(self, best: Solution, k: int, half: float, inflation: float, limit: float, ridge: Vector) -> float:
        """Return the place between the best one and a limit."""
        bounds = self.misfit.bounds()
        inner, rise, p, side = float(best.p[k]), 0.0, best.p, 1.0 if limit > best.p[k] else -1.0
        # The end that the curvature predicts, and a little more, to enclose it.
        step, outer, wanted = min(max(BEYOND * half, SHORT), LONG), limit, np.sqrt(REACH)
        while abs(outer - inner) > SHORT / 2.0:
            trial = inner + side * min(step, abs(outer - inner))
            # The others move on along the ridge, else few tries would not bring them there.
            start = np.clip(p + (trial - p[k]) * ridge, *bounds)
            start[k] = trial
            solution = self.search.nearest_to(start, fixed=k)
            new = float(np.sqrt(max(solution.misfit - best.misfit, 0.0) / inflation))
            if wanted <= new < 2.0 * wanted:
                # Its root is nearly straight.
                return float(inner + (wanted - rise) / (new - rise) * (trial - inner))
            if new < wanted:
                ridge = (solution.p - p) / (trial - p[k])
                slope = (new - rise) / abs(trial - inner)
                inner, rise, p = trial, new, solution.p
                step = min(BEYOND * (wanted - new) / slope, 1.6 * step) if slope > 0.0 else 1.6 * step
            else:
                outer, step = trial, 0.5 * abs(trial - inner)
        return outer if outer == limit else 0.5 * (inner + outer)

    def _modes(
        self, best: Solution, solutions: Sequence[Solution], beside: Sequence[Solution], covariance: Vector,
        scale: float,
    ) -> list[Solution]:  # fmt: skip
        """Return the solutions that the noise does not exclude, the best first."""
        count = len(self.ranges)
        modes, deviations = [best], 3.0 * np.sqrt(np.diag(covariance))[:count]
        # Those of a search end roughly, those beside the best fit do not.
        for near, others in ((np.maximum(deviations, SAME), solutions), (deviations, beside)):
            for solution in others:
                fits = solution.misfit - best.misfit < WITHIN * scale
                if fits and all((abs(solution.p - mode.p)[:count] > near).any() for mode in modes):
                    modes.append(solution)
        return modes

    def _correlation(self, covariance: Vector) -> xr.DataArray:
        root = np.sqrt(np.diag(covariance))
        names = self.misfit.names
        return xr.DataArray(
            covariance / np.outer(root, root), dims=("unknown", "other"), coords={"unknown": names, "other": names}
        )


def correlation_of(residual: Vector) -> tuple[Vector, int]:
    """Return the mean product of samples by the steps between them, and the number of samples; NaN is left out."""
    there = np.isfinite(residual)
    values = np.where(there, residual, 0.0)
    size = 2 * residual.size
    sums, pairs = (np.fft.irfft(abs(np.fft.rfft(part, size)) ** 2, size)[: residual.size] for part in (values, there))
    return sums / np.maximum(pairs, 1.0), int(there.sum())


def independent_samples(covariance: Vector, count: int) -> float:
    """Return how many independent samples scatter as much in their mean as `count` with this autocovariance."""
    along = covariance / covariance[0]
    below = np.flatnonzero(along < INDEPENDENT)
    width = int(below[0]) if below.size else along.size
    return count / (1.0 + 2.0 * float(along[1:width].sum()))
