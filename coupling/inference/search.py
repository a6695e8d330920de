"""Minima of a misfit: a scan of all ranges, least squares from its best points, and scans along each range."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import qmc

from coupling.inference.misfit import Misfit, Point, inverse
from coupling.inference.settings import SETTINGS
from structures.structure import Vector


class Solution(NamedTuple):
    """A local minimum: χ², p, and whether least squares ended before its limit."""

    misfit: float
    p: Vector
    converged: bool = True


class Search:
    """Finds the local minima of a misfit.

    starts: of least squares. count: points of the scan; None for as many as usual. guess: a place to start from without
    a scan. lines: the ranges that are scanned one by one.
    """

    def __init__(
        self, misfit: Misfit, starts: int, count: int | None, seed: int, guess: Vector | None, lines: Sequence[int]
    ) -> None:
        size = misfit.size
        usual = min(SETTINGS.smallest_scan * 2 ** max(size - 2, 0), SETTINGS.largest_scan)
        self.misfit, self.starts, self.count, self.seed = misfit, starts, count or usual, seed
        self.guess, self.lines, self.ranges = guess, lines, misfit.prediction.ranges
        self.steps = np.full(size, SETTINGS.first_step)
        self.places: NDArray[np.int64] | None = None

    def solutions(self) -> list[Solution]:
        """Return the local minima, the least first; with a guess only the nearest."""
        if self.guess is not None:
            return [self.solved(self._scanned(self.guess[None])[0])]
        sobol = qmc.Sobol(self.misfit.size, seed=self.seed)
        scanned = self._scanned(sobol.random_base2(int(np.ceil(np.log2(self.count)))))
        many = self.misfit.size >= SETTINGS.many_unknowns
        solutions = self._solved_from(self._apart(scanned, [], max(self.starts, many * SETTINGS.starts_of_many)))
        if many and self._explained(solutions):
            return solutions
        for _ in range(SETTINGS.rounds_of_lines):
            least, explained = solutions[0].misfit, self._explained(solutions)
            self.places = np.full(self.misfit.size, SETTINGS.most_places_of_line)
            if explained:
                curvature = (self.misfit.at(solutions[0].p, self.steps, False).projected ** 2).sum(axis=0)
                width = 2.0 * np.sqrt((SETTINGS.rival - 1.0) * least / np.maximum(curvature, 1e-300))
                places = SETTINGS.places_in_valley / np.maximum(width[: self.misfit.size], 1e-3)
                fewest, most = SETTINGS.fewest_places_of_line, SETTINGS.most_places_of_line
                self.places = np.clip(np.ceil(places), fewest, most).astype(int)
            starts = self._along_lines(solutions, SETTINGS.rival * least if explained else np.inf)
            if not explained:
                more = sorted(self._fits(sobol.random(self.count)), key=lambda fit: fit[0])
                starts += self._apart(
                    [p for value, p in more if np.isfinite(value)],
                    [*starts, *(one.p for one in solutions)],
                    self.starts,
                )
            solutions = sorted([*solutions, *self._solved_from(starts, solutions[0])], key=lambda one: one.misfit)
            if explained and solutions[0].misfit > least - 1.0:
                break
        return solutions

    def _explained(self, solutions: Sequence[Solution]) -> bool:
        return self.misfit.explains(solutions[0].misfit, solutions[0].p)

    def _fits(self, places: Vector) -> list[tuple[float, Vector]]:
        """Return χ² and p at places, each with the time zero that suits it; χ² of a run that fails is infinite."""
        pairs = zip(places, self.misfit.prediction.traces(list(places)), strict=True)
        return [self.misfit.start(x, trace) if np.isfinite(trace).all() else (np.inf, x) for x, trace in pairs]

    def _scanned(self, places: Vector) -> list[Vector]:
        """Return p of the places of the first scan that can be run; its best one chooses the samples that count."""
        fits = [fit for fit in self._fits(places) if np.isfinite(fit[0])]
        if not fits:
            raise ValueError(f"build: all runs of the scan fail; the first with {self.misfit.prediction.reason}")
        best = min(fits, key=lambda fit: fit[0])[1]
        self.misfit.count(self.misfit.measured, self.misfit.time_zero(best))
        return sorted((p for _, p in fits), key=lambda p: float((self.misfit.residual(p) ** 2).sum()))

    def _apart(self, scanned: Iterable[Vector], others: Sequence[Vector], count: int) -> list[Vector]:
        """Return the best points that are apart from each other and from some others."""
        size, near, chosen = self.misfit.size, list(others), list[Vector]()
        for p in scanned:
            away = min((float(abs(p[:size] - other[:size]).max()) for other in near), default=1.0)
            if len(chosen) < count and away > SETTINGS.starts_apart:
                near.append(p)
                chosen.append(p)
        return chosen

    def _solved_from(self, starts: Sequence[Vector], known: Solution | None = None) -> list[Solution]:
        """Return the ends of least squares from each start, the least first: rough ones, of which those that may be as
        good as the best are searched to their ground. Without a known solution the first that explains ends it."""
        solutions, size, others = list[Solution](), self.misfit.size, [known] if known else []
        for start in starts:
            end = self.solved(start, SETTINGS.rough_tries, SETTINGS.rough_precision)
            least = min((other.misfit for other in others), default=np.inf)
            # One valley is searched to its ground once.
            new = all(abs(end.p - other.p)[:size].max() > SETTINGS.solutions_apart for other in others)
            if end.misfit < least or (new and end.misfit < SETTINGS.hopeless * least):
                end = self.solved(end.p)
            solutions.append(end)
            others.append(end)
            if known is None and self.misfit.explains(end.misfit, end.p):
                break
        return sorted(solutions, key=lambda one: one.misfit)

    def _along_lines(self, solutions: Sequence[Solution], largest: float) -> list[Vector]:
        """Return the best minima on lines along each range through the best solution, away from the solutions known.

        largest: χ², where the other unknowns are not fitted anew.
        """
        assert self.places is not None
        best, size, found = solutions[0].p, self.misfit.size, list[tuple[float, Vector]]()
        for k in self.lines:
            places = int(self.places[k])
            line = np.tile(best[:size], (places, 1))
            line[:, k] = (np.arange(places) + 0.5) / places
            fits = self._fits(line)
            values = np.array([np.inf, *(value for value, _ in fits), np.inf])
            lowest = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:]))
            # A point that fits better than a solution nearby is not in its valley.
            found += [
                (value, p)
                for value, p in (fits[i] for i in lowest)
                if value < largest
                and all(abs(p - one.p)[:size].max() > 2.0 / places or value < one.misfit for one in solutions)
            ]
        found.sort(key=lambda fit: fit[0])
        return [p for _, p in found[: SETTINGS.starts_from_lines]]

    def solved(
        self, start: Vector, tries: int = SETTINGS.most_tries, precision: float = SETTINGS.precision,
        fixed: int | None = None, central: bool = False,
    ) -> Solution:  # fmt: skip
        """Least squares from a start; fixed: the number of an unknown that keeps its place."""
        low, high = self.misfit.bounds
        free, p = np.array([k for k in range(start.size) if k != fixed]), np.clip(start, low, high)
        if not free.size:
            return Solution(float((self.misfit.residual(p) ** 2).sum()), p)

        def full(x: Vector) -> Vector:
            point = p.copy()
            point[free] = x
            return point

        inner = np.clip(p[free], low[free] + 1e-9, high[free] - 1e-9)
        done = least_squares(
            lambda x: self.misfit.residual(full(x)), inner,
            lambda x: self.misfit.at(full(x), self.steps, central).projected[:, free],
            bounds=(low[free], high[free]), x_scale="jac", xtol=precision, ftol=precision, gtol=1e-12, max_nfev=tries,
        )  # fmt: skip
        return Solution(2.0 * float(done.cost), full(done.x), bool(done.status > 0))

    def settled(self, solution: Solution) -> tuple[Solution, Point, list[Solution]]:
        """Return the solution refined, or a better minimum beside it; all of the misfit there; minima beside it."""
        (best, point), minima = self.refined(solution), list[Solution]()
        for _ in range(SETTINGS.rounds_of_lines):
            minima += self._solved_from(self._beside(best, point), best)
            least = min(minima, key=lambda other: other.misfit, default=best)
            if least.misfit > best.misfit - 1.0:
                break
            minima.append(best)
            best, point = self.refined(least)
        return best, point, minima

    def refined(self, solution: Solution) -> tuple[Solution, Point]:
        """Return the least squares again, with derivatives over steps that suit the errors."""
        point = self.misfit.at(solution.p, self.steps)
        errors = np.sqrt(np.diag(inverse(point.columns)))[: self.misfit.size]
        self.steps = np.clip(SETTINGS.step_over_error * errors, SETTINGS.shortest_step, SETTINGS.longest_step)
        again = self.solved(solution.p, SETTINGS.rough_tries, central=True)
        best = again if again.misfit <= solution.misfit else solution
        return best, self.misfit.at(best.p, self.steps)

    def _beside(self, best: Solution, point: Point) -> list[Vector]:
        """Return minima some standard deviations away, where each unknown moves and the others as it correlates."""
        covariance, minima = inverse(point.columns)[: best.p.size], list[Vector]()
        (low, high), size = self.misfit.bounds, self.misfit.size
        for k in self.lines:
            deviation = covariance[:, k] / np.sqrt(covariance[k, k])
            distances = 2.0 * 1.5 ** np.arange(SETTINGS.steps_beside)
            if self.places is not None:  # beyond these, the places of the lines are nearer to each other
                distances = distances[: 1 + int((distances * deviation[k] < 2.0 / self.places[k]).sum())]
            aways = np.concatenate([-distances[::-1], distances])
            line = [p for away in aways if low[k] <= (p := best.p + away * deviation)[k] <= high[k]]
            if not line:
                continue
            line = [np.clip(p, low, high) for p in line]
            fits = self.fits_at(line, best)
            before = sum(p[k] < best.p[k] for p in line)
            fits.insert(before, (best.misfit, best.p))
            values = np.array([np.inf, *(value for value, _ in fits), np.inf])
            lowest = np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] < values[2:]))
            minima += [fits[i][1] for i in lowest if i != before and fits[i][0] < SETTINGS.hopeless * best.misfit]
        return [p for p in minima if (abs(p - best.p)[:size] > 0.0).any()]

    def fits_at(self, line: Sequence[Vector], best: Solution) -> list[tuple[float, Vector]]:
        """Return χ² and p at places near the best fit."""
        size, fits = self.misfit.size, list[tuple[float, Vector]]()
        for p, trace in zip(line, self.misfit.prediction.traces([p[:size] for p in line]), strict=True):
            # In another valley the sensors' nuisances need not follow their correlation in this one.
            choices = (p, np.append(p[:size], best.p[size:]))
            fits.append(min(((self.misfit.of_traces(q, trace), q) for q in choices), key=lambda fit: fit[0]))
        return fits
