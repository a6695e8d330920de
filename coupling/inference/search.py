"""Minima of a misfit: a scan of all ranges, least squares from its best points, and scans along each range. Intervals
follow from the curvature of χ², or from its profile."""

from collections.abc import Iterable, Sequence
from typing import TypeAlias

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from coupling.inference.identification import DEVIATIONS
from coupling.inference.misfit import Fit, Misfit, Point, steps_for, unit_covariance
from structures.structure import Vector

# With this many unknowns or more a search starts at more points, scans lines only if no fit explains the signal, and
# tries half as many places beside a fit.
MANY = 5
RIVAL = 4.0  # If a fit explains the signal, a minimum on a line may be a rival if its χ² is at most this many times it.
HOPELESS = 1.5  # A rough fit is not refined if its χ² is larger than the least by more than this factor.
UNLIKELY = 6.0  # Another minimum is a mode if its χ² exceeds the least by less than this: a likelihood of 5 %.
# Least first step of a profile. Beads that rattle make χ² rough; with smaller steps intervals were too short.
FINEST_PROFILE = 1e-3

Line: TypeAlias = tuple[list[Fit], float]  # Fits along a line; a minimum closer than this to a known fit belongs to it.


class Search:
    """The search for the local minima of a misfit. guess: a place to start from without a scan. lines: numbers of the
    unknowns whose ranges are scanned one by one. steps: the steps of differences; spacing: the distances of places on
    lines; both are parts of the ranges."""

    def __init__(self, misfit: Misfit, seed: int, guess: Vector | None, lines: Sequence[int]) -> None:
        self.misfit, self.ranges, self.guess, self.lines = misfit, misfit.prediction.ranges, guess, lines
        self.size = len(self.ranges)
        self.count = min(32 * 2 ** max(self.size - 2, 0), 128)
        self.sobol = qmc.Sobol(self.size, seed=seed)
        self.steps, self.spacing = np.full(self.size, 1e-3), np.zeros(self.size)

    def minima(self) -> list[Fit]:
        """Return the local minima, the least first; with a guess only the minimum nearest to it."""
        points = self.sobol.random(self.count) if self.guess is None else self.guess[None]
        scanned = self._scanned(points)
        if not scanned:
            raise ValueError(f"build: all runs of the scan fail; the first with {self.misfit.prediction.reason}")
        # The time zero of the best point determines the samples that count.
        self.misfit.count(self.misfit.measured, scanned[0].time_zero)
        scanned = self._scanned(points)
        if self.guess is not None:
            return [self.solved(self.guess)]
        many = self.size >= MANY
        minima = self._solved_from(_apart(scanned, [], 8 if many else 3))
        if many and self.misfit.explains(minima[0]):
            return minima

        # The scan misses narrow minima. Lines through the best fit find them, until a fit explains the signal and its
        # lines show no better one.
        for _ in range(3):
            best, explained = minima[0], self.misfit.explains(minima[0])
            lines = self._lines(best, explained)
            starts = self._minima_on(lines, minima, RIVAL * best.misfit if explained else np.inf)
            if not explained:
                known = [*starts, *(fit.places for fit in minima)]
                starts += _apart(self._scanned(self.sobol.random(self.count)), known, 3)
            minima = sorted([*minima, *self._solved_from(starts, best)], key=lambda one: one.misfit)
            if explained and minima[0].misfit > best.misfit - 1.0:
                break
        return minima

    def _lines(self, best: Fit, explained: bool) -> list[Line]:
        """Return the line through the best fit along each range. explained: whether this fit explains the signal."""
        # Echoes make minima as narrow as 1/40 of a range from 1 to 60: lines of 128 places find them, 48 missed one.
        places = np.full(self.size, 128)
        if explained:
            # The places are so close that four lie in a valley as narrow as that of the fit.
            curvature = (self.misfit.at(best.places, self.steps, False).columns[:, : self.size] ** 2).sum(axis=0)
            width = 2.0 * np.sqrt((RIVAL - 1.0) * best.misfit / np.maximum(curvature, 1e-300))
            places = np.clip(np.ceil(4 / np.maximum(width, 1e-3)).astype(int), 16, 128)
        self.spacing, lines = 1.0 / places, list[Line]()
        for k in self.lines:
            fits = self._along(best, k, (np.arange(places[k]) + 0.5) / places[k])
            if explained:
                # Valleys of an unknown that hardly matters are narrower than this: 128 places where a fit may hide.
                likely = np.array([fit.misfit < best.misfit + 10.0 * UNLIKELY for fit in fits])
                hiding = np.flatnonzero(likely[1:] | likely[:-1])[:, None] + 0.5
                parts = int(np.ceil(128 / places[k]))
                fits += self._along(best, k, (hiding + np.arange(1, parts) / parts).ravel() / places[k])
            room = 2.0 / (places[k] if len(fits) == places[k] else 128)
            lines.append((sorted(fits, key=lambda fit: fit.places[k]), room))
        return lines

    def settled(self, fit: Fit) -> tuple[Fit, Point, list[Fit]]:
        """Return the refined fit, or a better minimum near it; its derivatives; and the minima near it. Beads that
        rattle make minima that are closer than the places of a line. A plate's edge at 37 mm was found at 36.8 mm,
        among valleys a few hundredths of a millimetre apart; the search leaves them one after the other."""
        minima = list[Fit]()
        for _ in range(6 if self.size < MANY else 3):
            # Least squares again, with derivatives over steps that suit the errors.
            errors = np.sqrt(np.diag(unit_covariance(self.misfit.at(fit.places, self.steps).columns)))
            self.steps = steps_for(errors[: self.size])
            best = min(fit, self.solved(fit.places, 10, central=True), key=lambda one: one.misfit)
            point = self.misfit.at(best.places, self.steps)

            minima += self._solved_from(self._minima_on(self._ridges(point), [best], HOPELESS * best.misfit), best)
            fit = min(minima, key=lambda one: one.misfit, default=best)
            if fit.misfit > best.misfit - 1.0:
                break
            minima.append(best)
        return best, point, minima

    def _ridges(self, point: Point) -> list[Line]:
        """Return the fits along each ridge of the likelihood through a point: an unknown moves by 2, 2.5, 3.1, … of its
        standard deviations to either side, and the others as they correlate with it."""
        covariance = unit_covariance(point.columns)[: self.size, : self.size]
        ridges, factors = list[Line](), (2.0 * 1.25 ** np.arange(19))[:: 1 if self.size < MANY else 2]
        for k in self.lines:
            ridge, sides = covariance[:, k] / np.sqrt(covariance[k, k]), factors
            if self.spacing[k]:
                # The scan of the range has seen what is farther away than two of its places.
                sides = factors[: 1 + int((factors * ridge[k] < 2.0 * self.spacing[k]).sum())]
            places = point.fit.places + np.concatenate([-sides[::-1], [0.0], sides])[:, None] * ridge
            inside = (places[:, k] >= 0.0) & (places[:, k] <= 1.0)
            ridges.append((self.misfit.fits(list(np.clip(places[inside], 0.0, 1.0))), 0.0))
        return ridges

    def solved(
        self, start: Vector, tries: int = 30, precision: float = 1e-5, fixed: int | None = None, central: bool = False
    ) -> Fit:
        """Return the fit where least squares from a start end. fixed: the number of an unknown that keeps its place."""
        free, first = np.arange(self.size) != fixed, self.misfit.fits([start])[0]
        if not (free.any() and first.works):
            return first

        def full(x: Vector) -> Vector:
            places = start.copy()
            places[free] = x
            return places

        done = least_squares(
            lambda x: self.misfit.fits([full(x)])[0].residual, np.clip(start[free], 1e-9, 1.0 - 1e-9),
            lambda x: self.misfit.at(full(x), self.steps, central).columns[:, : self.size][:, free],
            bounds=(0.0, 1.0), x_scale="jac", xtol=precision, ftol=precision, gtol=1e-12, max_nfev=tries,
        )  # fmt: skip
        return self.misfit.fits([full(done.x)])[0]

    def interval(self, best: Fit, k: int, covariance: Vector, inflation: float) -> tuple[float, float]:
        """Return the 95 % interval around the best fit, as places. inflation: variances over those of unit noise."""
        place, covariance = float(best.places[k]), covariance[: self.size, : self.size]
        deviations, ridge = np.sqrt(np.diag(covariance)), covariance[k] / covariance[k, k]
        half, correlated = DEVIATIONS * float(deviations[k]), abs(covariance[k] / (deviations * deviations[k]))
        if half < min(0.1, place, 1.0 - place) and np.delete(correlated, k).max(initial=0.0) < 0.98:
            ends = [np.clip(best.places + side * half * ridge, 0.0, 1.0) for side in (-1.0, 1.0)]
            below, above = ((fit.misfit - best.misfit) / (inflation * DEVIATIONS**2) for fit in self.misfit.fits(ends))
            # If χ² rises about as its curvature predicts, its root is nearly straight, and the rise corrects the ends.
            # In fits of eight unknowns these ends agree with those of the profile within 1/20 of the half-width if χ²
            # rises more than predicted; if it rises less, they lie up to 1/5 outside.
            if 1.0 / 3.0 < below < 1.5 and 1.0 / 3.0 < above < 1.5:
                return place - half / below**0.5, place + half / above**0.5
        low, high = (self._profile_end(best, k, half, inflation, limit, ridge) for limit in (0.0, 1.0))
        return low, high

    def _profile_end(self, best: Fit, k: int, half: float, inflation: float, limit: float, ridge: Vector) -> float:
        """Return the place, from the best one towards a limit, at which χ² with the other unknowns refitted reaches its
        95 % level; else the limit. half, ridge, by the curvature: half of the interval, the motion of the others."""
        latest, inside = best.places, float(best.places[k])
        below, side = -DEVIATIONS, np.sign(limit - inside)
        step = min(max(1.05 * half, FINEST_PROFILE), 0.1)
        while abs(limit - inside) > 0.6 * FINEST_PROFILE:
            place = inside + side * min(step, abs(limit - inside))
            # The others start on the ridge, so that few steps of least squares suffice.
            start = np.clip(latest + (place - latest[k]) * ridge, 0.0, 1.0)
            start[k] = place
            fit = self.solved(start, 8, 1e-3, fixed=k)
            latest = fit.places
            # The root of the rise of χ², less its level.
            above = float(np.sqrt(max(fit.misfit - best.misfit, 0.0) / inflation)) - DEVIATIONS
            if above <= 0.0:
                inside, below, step = place, above, 1.6 * step
            elif above < DEVIATIONS:  # so near the level that the root is nearly straight
                return float(inside - below / (above - below) * (place - inside))
            else:
                limit, step = place, 0.5 * abs(place - inside)
        return limit

    def _scanned(self, points: Vector) -> list[Fit]:
        """Return the fits at points, the best first, without failed runs."""
        return sorted((fit for fit in self.misfit.fits(list(points)) if fit.works), key=lambda fit: fit.misfit)

    def _solved_from(self, starts: Sequence[Vector], known: Fit | None = None) -> list[Fit]:
        """Return the ends of least squares from each start, the least first. Ends that may be as good as the best are
        refined; the others are rough. Without a known fit, the first one that explains the signal ends the search."""
        others = [known] if known else []
        for start in starts:
            end = self.solved(start, 10, 1e-2)
            least = min((other.misfit for other in others), default=np.inf)
            # Each valley is refined only once.
            new = all(abs(end.places - other.places).max() > 1e-2 for other in others)
            if end.misfit < least or (new and end.misfit < HOPELESS * least):
                end = self.solved(end.places)
            others.append(end)
            if known is None and self.misfit.explains(end):
                break
        return sorted(others[known is not None :], key=lambda one: one.misfit)

    def _along(self, fit: Fit, k: int, places: Vector) -> list[Fit]:
        """Return fits with unknown k at these places, and the others as in a given fit."""
        line = np.tile(fit.places, (places.size, 1))
        line[:, k] = places
        return self.misfit.fits(list(line))

    def _minima_on(self, lines: Sequence[Line], known: Sequence[Fit], largest: float) -> list[Vector]:
        """Return the places of the best minima of χ² on lines, below `largest` and away from known fits."""
        found = list[Fit]()
        for fits, room in lines:
            values = np.array([np.inf, *(fit.misfit for fit in fits), np.inf])
            lowest = (values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:]) & (values[1:-1] < largest)
            # A point near a known fit counts only if it fits better.
            found += [
                fit for fit, is_low in zip(fits, lowest, strict=True)
                if is_low and all(abs(fit.places - o.places).max() > room or fit.misfit < o.misfit for o in known)
            ]  # fmt: skip
        return [fit.places for fit in sorted(found, key=lambda fit: fit.misfit)[:6]]


def _apart(scanned: Iterable[Fit], others: Sequence[Vector], count: int) -> list[Vector]:
    """Return at most `count` places of the best fits that are apart from each other and from some others."""
    chosen = list[Vector]()
    for fit in scanned:
        away = min((float(abs(fit.places - other).max()) for other in [*others, *chosen]), default=1.0)
        if len(chosen) < count and away > 0.05:
            chosen.append(fit.places)
    return chosen
