"""Minima of a misfit: a scan of all ranges, least squares from its best points, and scans along each range. Intervals
follow from the curvature of χ², or from its profile."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from coupling.inference.identification import DEVIATIONS
from coupling.inference.misfit import Fit, Misfit, Point, inverse, steps_for
from structures.structure import Vector

# So many unknowns and more start at more points, have lines only where no fit explains the signal, and only half of the
# places beside a fit.
MANY = 5
RIVAL = 4.0  # Where a fit explains the signal, a minimum on a line may be a rival if χ² is not larger by this factor.
HOPELESS = 1.5  # A rough fit whose χ² is larger by more than this factor is searched no further.
UNLIKELY = 6.0  # Another minimum is a mode of its own if χ² is within this of the least: a likelihood of 5 %.
# The first step of a profile at least: smaller ones end in the roughness that beads which rattle give χ², and make
# intervals too short.
FINEST_PROFILE = 1e-3


class Search:
    """Finds the local minima of a misfit.

    guess: a place to start from without a scan. lines: numbers of the unknowns whose ranges are scanned one by one.
    steps: half the distance of runs for a derivative; spacing: of the places on lines; both as parts of the ranges.
    """

    def __init__(self, misfit: Misfit, seed: int, guess: Vector | None, lines: Sequence[int]) -> None:
        self.misfit, self.ranges, self.guess, self.lines = misfit, misfit.prediction.ranges, guess, lines
        self.size = len(self.ranges)
        self.count = min(32 * 2 ** max(self.size - 2, 0), 128)
        self.sobol = qmc.Sobol(self.size, seed=seed)
        self.steps, self.spacing = np.full(self.size, 1e-3), np.zeros(self.size)

    def minima(self) -> list[Fit]:
        """Return the local minima, the least first; with a guess only the nearest."""
        points = self.sobol.random(self.count) if self.guess is None else self.guess[None]
        scanned = self._scanned(points)
        if not scanned:
            raise ValueError(f"build: all runs of the scan fail; the first with {self.misfit.prediction.reason}")
        # The best one chooses the samples that count.
        self.misfit.count(self.misfit.measured, scanned[0].time_zero)
        scanned = self._scanned(points)
        if self.guess is not None:
            return [self.solved(self.guess)]
        many = self.size >= MANY
        minima = self._solved_from(_apart(scanned, [], 8 if many else 3))
        if many and self.misfit.explains(minima[0]):
            return minima

        # Echoes make minima as narrow as 1/40 of a range of the factor 60: lines of 128 places find them, 48 missed
        # one. Where a fit explains the signal, four places lie in a valley like its own, below a rival.
        for _ in range(3):
            best, explained = minima[0], self.misfit.explains(minima[0])
            places = np.full(self.size, 128)
            if explained:
                curvature = (self.misfit.at(best.places, self.steps, False).columns[:, : self.size] ** 2).sum(axis=0)
                width = 2.0 * np.sqrt((RIVAL - 1.0) * best.misfit / np.maximum(curvature, 1e-300))
                places = np.clip(np.ceil(4 / np.maximum(width, 1e-3)).astype(int), 16, 128)
            self.spacing, lines = 1.0 / places, list[Vector]()
            for k in self.lines:
                line = np.tile(best.places, (places[k], 1))
                line[:, k] = (np.arange(places[k]) + 0.5) / places[k]
                lines.append(line)
            starts = self._minima_on(lines, minima, RIVAL * best.misfit if explained else np.inf)
            if not explained:
                known = [*starts, *(one.places for one in minima)]
                starts += _apart(self._scanned(self.sobol.random(self.count)), known, 3)
            minima = sorted([*minima, *self._solved_from(starts, best)], key=lambda one: one.misfit)
            if explained and minima[0].misfit > best.misfit - 1.0:
                break
        return minima

    def settled(self, fit: Fit) -> tuple[Fit, Point, list[Fit]]:
        """Return the fit refined, or a better minimum beside it; its derivatives; minima beside it.

        Beads that rattle make minima that are closer than the places of a line: a plate's edge at 37 mm was found at
        36.8, and valleys some hundredths of a millimetre apart beside it, which the search leaves one after the other.
        """
        minima, few = list[Fit](), self.size < MANY
        for _ in range(6 if few else 3):
            # Least squares again, with derivatives over steps that suit the errors.
            errors = np.sqrt(np.diag(inverse(self.misfit.at(fit.places, self.steps).columns)))
            self.steps = steps_for(errors[: self.size])
            best = min(fit, self.solved(fit.places, 10, central=True), key=lambda one: one.misfit)
            point = self.misfit.at(best.places, self.steps)

            # 2, 2.5, 3.1, … standard deviations away: each unknown moves, and the others as they correlate with it.
            covariance, lines = inverse(point.columns)[: self.size, : self.size], list[Vector]()
            for k in self.lines:
                deviation = covariance[:, k] / np.sqrt(covariance[k, k])
                distances = (2.0 * 1.25 ** np.arange(19))[:: 1 if few else 2]
                if self.spacing[k]:
                    distances = distances[: 1 + int((distances * deviation[k] < 2.0 * self.spacing[k]).sum())]
                line = best.places + np.concatenate([-distances[::-1], [0.0], distances])[:, None] * deviation
                lines.append(np.clip(line[(line[:, k] >= 0.0) & (line[:, k] <= 1.0)], 0.0, 1.0))
            minima += self._solved_from(self._minima_on(lines, [best], HOPELESS * best.misfit, near=True), best)
            fit = min(minima, key=lambda other: other.misfit, default=best)
            if fit.misfit > best.misfit - 1.0:
                break
            minima.append(best)
        return best, point, minima

    def solved(
        self, start: Vector, tries: int = 30, precision: float = 1e-5, fixed: int | None = None, central: bool = False
    ) -> Fit:
        """Return the end of least squares from a start; fixed: the number of an unknown that keeps its place."""
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

    def interval(self, modes: Sequence[Fit], k: int, covariance: Vector, inflation: float) -> tuple[float, float]:
        """Return the 95 % interval of an unknown, as places. modes: all fits that are as good, the best first;
        inflation: of variances, over those of noise of unit size."""
        best, place = modes[0], float(modes[0].places[k])
        covariance = covariance[: self.size, : self.size]
        half, root = DEVIATIONS * float(np.sqrt(covariance[k, k])), np.sqrt(np.diag(covariance))
        correlated = np.delete(abs(covariance[k] / (root * root[k])), k)
        ridge = covariance[k] / covariance[k, k]
        # Where χ² rises much as its curvature predicts, its root is nearly straight, and the rise moves the ends. In
        # fits of eight unknowns these ends are those of the profile within a twentieth of the half-width where χ² rises
        # more than predicted; where it rises less, they lie up to a fifth outside.
        rises = []
        if half < min(0.1, place, 1.0 - place) and correlated.max(initial=0.0) < 0.98:
            line = [np.clip(best.places + side * half * ridge, 0.0, 1.0) for side in (-1.0, 1.0)]
            rises = [(fit.misfit - best.misfit) / (inflation * DEVIATIONS**2) for fit in self.misfit.fits(line)]
        if rises and all(1.0 / 3.0 < rise < 1.5 for rise in rises):
            low, high = place - half / rises[0] ** 0.5, place + half / rises[1] ** 0.5
        else:
            low, high = (self._risen(best, k, half, inflation, limit, ridge) for limit in (0.0, 1.0))
        # Fits that are as good lie within the interval, wherever they are, with intervals of their own.
        for mode in modes[1:]:
            room = half * float(np.sqrt(max(1.0 - (mode.misfit - best.misfit) / (UNLIKELY * inflation), 0.0)))
            low, high = min(low, max(mode.places[k] - room, 0.0)), max(high, min(mode.places[k] + room, 1.0))
        return low, high

    def _risen(self, best: Fit, k: int, half: float, inflation: float, limit: float, ridge: Vector) -> float:
        """Return the place between the best one and a limit where χ², with all others fitted anew, has risen by that of
        95 %; the limit where it has not. half, ridge: of the interval and of the others, as the curvature predicts."""
        latest, inner = best.places, float(best.places[k])
        before, side = -DEVIATIONS, np.sign(limit - inner)
        step = min(max(1.05 * half, FINEST_PROFILE), 0.1)
        while abs(limit - inner) > 0.6 * FINEST_PROFILE:
            outer = inner + side * min(step, abs(limit - inner))
            # The others move on along the ridge, else few tries would not bring them there.
            start = np.clip(latest + (outer - latest[k]) * ridge, 0.0, 1.0)
            start[k] = outer
            fit = self.solved(start, 8, 1e-3, fixed=k)
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

    def _scanned(self, points: Vector) -> list[Fit]:
        """Return the fits at points, the best first, without runs that fail."""
        return sorted((fit for fit in self.misfit.fits(list(points)) if fit.works), key=lambda fit: fit.misfit)

    def _solved_from(self, starts: Sequence[Vector], known: Fit | None = None) -> list[Fit]:
        """Return the ends of least squares from each start, the least first: rough ones, of which those that may be as
        good as the best are searched to their ground. Without a known fit the first that explains ends it."""
        others = [known] if known else []
        for start in starts:
            end = self.solved(start, 10, 1e-2)
            least = min((other.misfit for other in others), default=np.inf)
            # One valley is searched to its ground once.
            new = all(abs(end.places - other.places).max() > 1e-2 for other in others)
            if end.misfit < least or (new and end.misfit < HOPELESS * least):
                end = self.solved(end.places)
            others.append(end)
            if known is None and self.misfit.explains(end):
                break
        return sorted(others[known is not None :], key=lambda one: one.misfit)

    def _minima_on(
        self, lines: Sequence[Vector], known: Sequence[Fit], largest: float, near: bool = False
    ) -> list[Vector]:
        """Return the places of the best minima of χ² on lines, below the largest and away from known fits; near: on
        lines through the fit a minimum at any distance is another one."""
        found = list[Fit]()
        for k, line in zip(self.lines, lines, strict=True):
            fits = self.misfit.fits(list(line))
            values = np.array([np.inf, *(fit.misfit for fit in fits), np.inf])
            lowest = (values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:]) & (values[1:-1] < largest)
            # A point that fits better than a known fit nearby is not in its valley.
            apart = 0.0 if near else 2.0 * self.spacing[k]
            found += [
                fit for fit, is_low in zip(fits, lowest, strict=True)
                if is_low and all(abs(fit.places - o.places).max() > apart or fit.misfit < o.misfit for o in known)
            ]  # fmt: skip
        return [fit.places for fit in sorted(found, key=lambda fit: fit.misfit)[:6]]


def _apart(scanned: Iterable[Fit], others: Sequence[Vector], count: int) -> list[Vector]:
    """Return the best places that are apart from each other and from some others."""
    chosen = list[Vector]()
    for fit in scanned:
        away = min((float(abs(fit.places - other).max()) for other in [*others, *chosen]), default=1.0)
        if len(chosen) < count and away > 0.05:
            chosen.append(fit.places)
    return chosen
