"""Minima of a misfit: a scan of all ranges, least squares from its best points, and scans along each range."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from coupling.inference.misfit import Misfit, Point, inverse
from structures.structure import Vector


@dataclass(frozen=True)
class Settings:
    """Of the search for minima. Lengths are parts of a range, if nothing else is said.

    Echoes make minima as narrow as 1/40 of a range of the factor 60: lines of 128 places find them, 48 missed one.
    Derivatives over much less than a standard deviation would show how traces scatter where a mesh changes with an
    unknown: that looks like information, and made intervals too short.
    """

    smallest_scan: int = 32
    """Points of the scan for one or two unknowns; twice as many for each further one, up to largest_scan."""
    largest_scan: int = 128
    places_of_line: int = 128
    starts_from_lines: int = 6
    rounds_of_lines: int = 3
    rival: float = 4.0
    """Where a fit explains the signal, a minimum on a line may be a rival of it if χ² is not larger by this factor."""
    many_unknowns: int = 5
    """So many and more begin at starts_of_many points, and have lines only where no fit explains the signal."""
    starts_of_many: int = 8
    starts_apart: float = 0.05
    solutions_apart: float = 1e-2
    first_step: float = 1e-3
    """Half the distance of runs for a derivative, before the error of the unknown is known."""
    step_over_error: float = 0.3
    shortest_step: float = 1e-5
    longest_step: float = 2e-2
    precision: float = 1e-5
    """Least squares end where χ², or every unknown, changes by less than this part."""
    rough_precision: float = 1e-2
    rough_tries: int = 10
    hopeless: float = 1.5
    """A rough fit whose χ² is larger by more than this factor is searched no further."""
    steps_beside: int = 11
    """Distances from the best fit at which others are looked for: 2, 3, 4.5, … standard deviations. Beads that rattle
    make minima that are closer than the places of a line: a plate's edge at 37 mm was found at 36.8."""


SETTINGS = Settings()


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
        self.has_lines = False

    def solutions(self) -> list[Solution]:
        """Return the local minima, the least first; with a guess only the nearest."""
        if self.guess is not None:
            self._prepare(self._scanned(self.guess[None]))
            return [self.solved(self.misfit.start(self.guess, self.misfit.prediction.trace(self.guess))[1])]
        sobol = qmc.Sobol(self.misfit.size, seed=self.seed)
        scanned = self._scanned(sobol.random_base2(int(np.ceil(np.log2(self.count)))))
        self._prepare(scanned)
        # χ² of the samples that count now.
        scanned = sorted(((self._misfit_at(p), p) for _, p in scanned), key=lambda pair: pair[0])
        many = self.misfit.size >= SETTINGS.many_unknowns
        solutions = self._solved_from(self._apart(scanned, [], max(self.starts, many * SETTINGS.starts_of_many)))
        if many and self._explained(solutions):
            return solutions
        self.has_lines = True
        for _ in range(SETTINGS.rounds_of_lines):
            least, explained = solutions[0].misfit, self._explained(solutions)
            starts = self._along_lines(solutions, SETTINGS.rival * least if explained else np.inf)
            if not explained:
                more = self._scanned(sobol.random(self.count))
                starts += self._apart(more, [*starts, *(one.p for one in solutions)], self.starts)
            solutions = sorted([*solutions, *self._solved_from(starts, solutions[0])], key=lambda one: one.misfit)
            if explained and solutions[0].misfit > least - 1.0:
                break
        return solutions

    def _explained(self, solutions: Sequence[Solution]) -> bool:
        return self.misfit.explains(solutions[0].misfit, solutions[0].p)

    def _misfit_at(self, p: Vector) -> float:
        residual = self.misfit.residual(p)
        return float(residual @ residual)

    def _scanned(self, places: Vector) -> list[tuple[float, Vector]]:
        """Return χ² and p at places that can be run, the best first."""
        traces = self.misfit.prediction.traces(list(places))
        pairs = zip(places, traces, strict=True)
        scanned = [self.misfit.start(place, trace) for place, trace in pairs if np.isfinite(trace).all()]
        return sorted(scanned, key=lambda pair: pair[0])

    def _prepare(self, scanned: list[tuple[float, Vector]]) -> None:
        """Choose the samples that count from the best point of the scan."""
        if not scanned:
            raise ValueError(f"build: all runs of the scan fail; the first with {self.misfit.prediction.reason}")
        self.misfit.count(self.misfit.measured, self.misfit.time_zero(scanned[0][1]))

    def _apart(self, scanned: Iterable[tuple[float, Vector]], others: Sequence[Vector], count: int) -> list[Vector]:
        """Return the best points that are apart from each other and from some others."""
        size, near, chosen = self.misfit.size, list(others), list[Vector]()
        for _, p in scanned:
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
        best, candidates, places = solutions[0].p, list[tuple[float, Vector]](), SETTINGS.places_of_line
        for k in self.lines:
            line = np.tile(best[: self.misfit.size], (places, 1))
            line[:, k] = (np.arange(places) + 0.5) / places
            fits = [
                self.misfit.start(place, trace) if np.isfinite(trace).all() else (np.inf, place)
                for place, trace in zip(line, self.misfit.prediction.traces(list(line)), strict=True)
            ]
            values = np.array([np.inf, *(value for value, _ in fits), np.inf])
            lowest = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] <= values[2:]))
            candidates += [fits[i] for i in lowest if fits[i][0] < largest]
        candidates.sort(key=lambda fit: fit[0])
        # A point that fits better than a solution nearby is not in its valley.
        solved, size = [(solution.misfit, solution.p) for solution in solutions], self.misfit.size
        new = [
            (value, p)
            for value, p in candidates
            if all(abs(p[:size] - q[:size]).max() > 2.0 / places or value < fit for fit, q in solved)
        ]
        return [p for _, p in new[: SETTINGS.starts_from_lines]]

    def solved(
        self, start: Vector, tries: int = 30, precision: float = SETTINGS.precision, fixed: int | None = None,
        central: bool = False,
    ) -> Solution:  # fmt: skip
        """Least squares from a start; fixed: the number of an unknown that keeps its place."""
        low, high = self.misfit.bounds
        free, p = np.array([k for k in range(start.size) if k != fixed]), np.clip(start, low, high)
        if not free.size:
            return Solution(self._misfit_at(p), p)

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
            if self.has_lines:  # beyond these, the places of the lines are nearer to each other
                distances = distances[: 1 + int((distances * deviation[k] < 2.0 / SETTINGS.places_of_line).sum())]
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
