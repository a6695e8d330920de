"""Minima of a misfit: a scan of all ranges, least squares from its best points, and scans along each range."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from coupling.inference.misfit import Fit, Misfit, Point, inverse
from coupling.inference.settings import SETTINGS
from structures.structure import Vector


class Solution(NamedTuple):
    """A local minimum: its places and fit."""

    places: Vector
    fit: Fit

    @property
    def misfit(self) -> float:
        """χ²."""
        return self.fit.misfit


class Search:
    """Finds the local minima of a misfit.

    starts: of least squares. guess: a place to start from without a scan. lines: ranges that are scanned one by one.
    """

    def __init__(self, misfit: Misfit, starts: int, seed: int, guess: Vector | None, lines: Sequence[int]) -> None:
        self.misfit, self.ranges, self.starts = misfit, misfit.prediction.ranges, starts
        self.guess, self.lines = guess, lines
        self.size = len(self.ranges)
        self.count = min(SETTINGS.smallest_scan * 2 ** max(self.size - 2, 0), SETTINGS.largest_scan)
        self.sobol = qmc.Sobol(self.size, seed=seed)
        self.steps = np.full(self.size, SETTINGS.first_step)
        self.spacing = np.zeros(self.size)
        """Between the places of the lines, as a part of the range."""

    def solutions(self) -> list[Solution]:
        """Return the local minima, the least first; with a guess only the nearest."""
        points = self.sobol.random(self.count) if self.guess is None else self.guess[None]
        scanned = self._scanned(points)
        if not scanned:
            raise ValueError(f"build: all runs of the scan fail; the first with {self.misfit.prediction.reason}")
        # The best one chooses the samples that count.
        self.misfit.count(self.misfit.measured, scanned[0].fit.time_zero)
        scanned = self._scanned(points)
        if self.guess is not None:
            return [self.solved(self.guess)]
        many = self.size >= SETTINGS.many_unknowns
        starts = self._apart(scanned, [], max(self.starts, many * SETTINGS.starts_of_many))
        solutions = self._solved_from(starts)
        if many and self.misfit.explains(solutions[0].fit):
            return solutions

        for _ in range(SETTINGS.rounds_of_lines):
            best, explained = solutions[0], self.misfit.explains(solutions[0].fit)
            places = np.full(self.size, SETTINGS.most_places_of_line)
            if explained:
                curvature = (self.misfit.at(best.places, self.steps, False).columns[:, : self.size] ** 2).sum(axis=0)
                width = 2.0 * np.sqrt((SETTINGS.rival - 1.0) * best.misfit / np.maximum(curvature, 1e-300))
                wanted = np.ceil(SETTINGS.places_in_valley / np.maximum(width, 1e-3)).astype(int)
                places = np.clip(wanted, SETTINGS.fewest_places_of_line, SETTINGS.most_places_of_line)
            self.spacing, lines = 1.0 / places, list[Vector]()
            for k in self.lines:
                line = np.tile(best.places, (places[k], 1))
                line[:, k] = (np.arange(places[k]) + 0.5) / places[k]
                lines.append(line)
            starts = self._minima_on(lines, solutions, SETTINGS.rival * best.misfit if explained else np.inf)
            if not explained:
                known = [*starts, *(one.places for one in solutions)]
                starts += self._apart(self._scanned(self.sobol.random(self.count)), known, self.starts)
            solutions = sorted([*solutions, *self._solved_from(starts, best)], key=lambda one: one.misfit)
            if explained and solutions[0].misfit > best.misfit - 1.0:
                break
        return solutions

    def settled(self, solution: Solution) -> tuple[Solution, Point, list[Solution]]:
        """Return the solution refined, or a better minimum beside it; all of the misfit there; minima beside it."""
        minima, few = list[Solution](), self.size < SETTINGS.many_unknowns
        for _ in range(SETTINGS.rounds_beside if few else SETTINGS.rounds_of_lines):
            # Least squares again, with derivatives over steps that suit the errors.
            point = self.misfit.at(solution.places, self.steps)
            errors = np.sqrt(np.diag(inverse(point.columns)))[: self.size]
            self.steps = np.clip(SETTINGS.step_over_error * errors, SETTINGS.shortest_step, SETTINGS.longest_step)
            best = min(
                solution, self.solved(solution.places, SETTINGS.rough_tries, central=True), key=lambda s: s.misfit
            )
            point = self.misfit.at(best.places, self.steps)

            # Some standard deviations away: each unknown moves, and the others as they correlate with it.
            covariance, lines = inverse(point.columns)[: self.size, : self.size], list[Vector]()
            for k in self.lines:
                deviation = covariance[:, k] / np.sqrt(covariance[k, k])
                distances = 2.0 * SETTINGS.growth_beside ** np.arange(SETTINGS.steps_beside)
                distances = distances if few else distances[::2]
                if self.spacing[k]:
                    distances = distances[: 1 + int((distances * deviation[k] < 2.0 * self.spacing[k]).sum())]
                line = best.places + np.concatenate([-distances[::-1], [0.0], distances])[:, None] * deviation
                lines.append(np.clip(line[(line[:, k] >= 0.0) & (line[:, k] <= 1.0)], 0.0, 1.0))
            starts = self._minima_on(lines, [best], SETTINGS.hopeless * best.misfit, near=True)
            minima += self._solved_from(starts, best)
            solution = min(minima, key=lambda other: other.misfit, default=best)
            if solution.misfit > best.misfit - 1.0:
                break
            minima.append(best)
        return best, point, minima

    def solved(
        self, start: Vector, tries: int = SETTINGS.most_tries, precision: float = SETTINGS.precision,
        fixed: int | None = None, central: bool = False,
    ) -> Solution:  # fmt: skip
        """Least squares from a start; fixed: the number of an unknown that keeps its place."""
        free, first = np.arange(self.size) != fixed, self.misfit.fits([start])[0]
        if not (free.any() and first.works):
            return Solution(start, first)

        def full(x: Vector) -> Vector:
            places = start.copy()
            places[free] = x
            return places

        def slopes(x: Vector) -> Vector:
            return self.misfit.at(full(x), self.steps, central).columns[:, : self.size][:, free]

        done = least_squares(
            lambda x: self.misfit.fits([full(x)])[0].residual, np.clip(start[free], 1e-9, 1.0 - 1e-9), slopes,
            bounds=(0.0, 1.0), x_scale="jac", xtol=precision, ftol=precision, gtol=1e-12, max_nfev=tries,
        )  # fmt: skip
        places = full(done.x)
        return Solution(places, self.misfit.fits([places])[0])

    def _scanned(self, points: Vector) -> list[Solution]:
        """Return the fits at points, the best first, without runs that fail."""
        fits = zip(points, self.misfit.fits(list(points)), strict=True)
        return sorted((Solution(x, fit) for x, fit in fits if fit.works), key=lambda one: one.misfit)

    def _apart(self, scanned: Iterable[Solution], others: Sequence[Vector], count: int) -> list[Vector]:
        """Return the best points that are apart from each other and from some others."""
        chosen = list[Vector]()
        for one in scanned:
            away = min((float(abs(one.places - other).max()) for other in [*others, *chosen]), default=1.0)
            if len(chosen) < count and away > SETTINGS.starts_apart:
                chosen.append(one.places)
        return chosen

    def _solved_from(self, starts: Sequence[Vector], known: Solution | None = None) -> list[Solution]:
        """Return the ends of least squares from each start, the least first: rough ones, of which those that may be as
        good as the best are searched to their ground. Without a known solution the first that explains ends it."""
        solutions, others = list[Solution](), [known] if known else []
        for start in starts:
            end = self.solved(start, SETTINGS.rough_tries, SETTINGS.rough_precision)
            least = min((other.misfit for other in others), default=np.inf)
            # One valley is searched to its ground once.
            new = all(abs(end.places - other.places).max() > SETTINGS.solutions_apart for other in others)
            if end.misfit < least or (new and end.misfit < SETTINGS.hopeless * least):
                end = self.solved(end.places)
            solutions.append(end)
            others.append(end)
            if known is None and self.misfit.explains(end.fit):
                break
        return sorted(solutions, key=lambda one: one.misfit)

    def _minima_on(
        self, lines: Sequence[Vector], solutions: Sequence[Solution], largest: float, near: bool = False
    ) -> list[Vector]:
        """Return the best minima of χ² on lines, below the largest and away from known solutions.

        near: the lines go through the solution, so that a minimum at any distance is another one.
        """
        found = list[tuple[float, Vector]]()
        for k, line in zip(self.lines, lines, strict=True):
            fits = self.misfit.fits(list(line))
            values = np.array([np.inf, *(fit.misfit for fit in fits), np.inf])
            lowest = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:]))
            # A point that fits better than a solution nearby is not in its valley.
            apart = 0.0 if near else 2.0 * self.spacing[k]
            found += [
                (value, line[i])
                for i, value in zip(lowest, values[1 + lowest], strict=True)
                if value < largest
                and all(abs(line[i] - one.places).max() > apart or value < one.misfit for one in solutions)
            ]
        return [places for _, places in sorted(found, key=lambda fit: fit[0])[: SETTINGS.starts_from_lines]]
