"""Minima of a misfit: a scan of all ranges, least squares from its best points, and scans along each range."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from coupling.identification.misfit import Misfit, Point
from structures.structure import Vector

FIRST_STEP = 1e-3
"""Half the distance of runs for a derivative, as a part of the range, before the error of the unknown is known."""

STEP_OF_ERROR, SHORTEST_STEP = 0.3, 1e-5
"""Then it is this part of its standard deviation, within these limits."""

ON_LINE = 64
"""Points of a scan along one range, the other unknowns at their best: echoes make minima as narrow as 1/40 of a range
of the factor 60, which a scan of all unknowns at once would miss."""

FROM_LINES, MOST_ROUNDS = 3, 4
"""Starts of least squares from the scans along all ranges, which are repeated while they find a better fit."""

APART = 0.05
"""Starts of least squares differ at least by this part of a range in some unknown."""

PRECISION = 1e-5
"""Least squares end where χ², or every unknown, changes by less than this part: for 1 000 samples by 0.01."""


class Solution(NamedTuple):
    """A local minimum: p, χ², and whether least squares ended before its limit."""

    p: Vector
    misfit: float
    converged: bool


class Search:
    """Finds the local minima of a misfit.

    starts: of least squares. count: points of the scan. guess: a place to start from without a scan. lines: the ranges
    that are scanned one by one.
    """

    def __init__(
        self, misfit: Misfit, starts: int, count: int, seed: int, guess: Vector | None, lines: Sequence[int]
    ) -> None:
        self.misfit, self.starts, self.count, self.seed = misfit, starts, count, seed
        self.guess, self.lines, self.ranges = guess, lines, misfit.prediction.ranges
        self.steps = np.full(len(self.ranges), FIRST_STEP)

    def solutions(self) -> list[Solution]:
        """The local minima from the best points of the scan, the least first; with a guess only the nearest."""
        if self.guess is None:
            places = qmc.Sobol(len(self.ranges), seed=self.seed).random_base2(int(np.ceil(np.log2(self.count))))
        else:
            places = self.guess[None]
        traces = self.misfit.prediction.traces(list(places))
        found = [
            (*self.misfit.start(place, trace), place)
            for place, trace in zip(places, traces, strict=True)
            if np.isfinite(trace).all()
        ]
        if not found:
            raise ValueError("build: all runs of the scan fail; try a point of the ranges by itself")
        found.sort(key=lambda one: one[1])
        self.misfit.keep_window(self.misfit.time_zero(found[0][0]))
        self.misfit.refresh(found[0][0], final=False)
        chosen: list[Vector] = []
        for p, _, place in found:
            if all(abs(place - other[: place.size]).max() > APART for other in chosen):
                chosen.append(p)
            if len(chosen) == self.starts:
                break
        solutions = sorted((self.solved(p) for p in chosen), key=lambda one: one.misfit)
        for _ in range(MOST_ROUNDS if self.guess is None else 0):
            least = solutions[0].misfit
            solutions += [self.solved(p) for p in self._along_lines(solutions)]
            solutions.sort(key=lambda one: one.misfit)
            if solutions[0].misfit > least - 1.0:
                break
        return solutions

    def _along_lines(self, solutions: Sequence[Solution]) -> list[Vector]:
        """The best minima on the lines along each range through the best solution, away from the solutions known."""
        best, found = solutions[0].p, list[tuple[float, Vector]]()
        size = len(self.ranges)
        grid = (np.arange(ON_LINE) + 0.5) / ON_LINE
        for k in self.lines:
            line = np.tile(best, (ON_LINE, 1))
            line[:, k] = grid
            traces = self.misfit.prediction.traces(list(line[:, :size]))
            values = [self.misfit.of_traces(p, trace) for p, trace in zip(line, traces, strict=True)]
            padded = np.concatenate([[np.inf], values, [np.inf]])
            minima = np.flatnonzero((padded[1:-1] <= padded[:-2]) & (padded[1:-1] <= padded[2:]))
            found += [(float(values[i]), line[i]) for i in minima if np.isfinite(values[i])]
        found.sort(key=lambda one: one[0])
        known, chosen = [one.p for one in solutions], list[Vector]()
        for _, p in found:
            if all(abs(p[:size] - other[:size]).max() > 1.0 / ON_LINE for other in known):
                known.append(p)
                chosen.append(p)
        return chosen[:FROM_LINES]

    def solved(self, start: Vector, fixed: int | None = None, tries: int = 30) -> Solution:
        """Least squares from a start; fixed: the number of an unknown that keeps its place."""
        low, high = self.misfit.bounds()
        free = np.array([k for k in range(start.size) if k != fixed])
        p = np.clip(start, low, high)

        def full(x: Vector) -> Vector:
            whole = p.copy()
            whole[free] = x
            return whole

        def slope(x: Vector) -> Vector:
            jacobian: Vector = self.misfit.at(full(x), self.steps).projected[:, free]
            return jacobian

        if not free.size:
            residual = self.misfit.residual(p)
            return Solution(p, float(residual @ residual), True)
        inner = np.clip(p[free], low[free] + 1e-9, high[free] - 1e-9)
        done = least_squares(
            lambda x: self.misfit.residual(full(x)), inner, slope, bounds=(low[free], high[free]), x_scale="jac",
            xtol=PRECISION, ftol=PRECISION, gtol=1e-12, max_nfev=tries,
        )  # fmt: skip
        return Solution(full(done.x), 2.0 * float(done.cost), bool(done.status > 0))

    def refined(self, solution: Solution) -> tuple[Solution, Point]:
        """Least squares again, with derivatives over steps that suit the errors."""
        self.misfit.refresh(solution.p)
        point = self.misfit.at(solution.p, self.steps)
        solution = solution._replace(misfit=point.misfit)
        errors = np.sqrt(np.diag(inverse(point.columns)))[: len(self.ranges)]
        self.steps = np.clip(STEP_OF_ERROR * errors, SHORTEST_STEP, FIRST_STEP)
        again = self.solved(solution.p, tries=10)
        best = again if again.misfit <= solution.misfit else solution
        return best, self.misfit.at(best.p, self.steps)


def inverse(columns: Vector) -> Vector:
    """The covariance for unit noise; directions that change nothing get an error that is large, not infinite."""
    size = np.sqrt((columns**2).sum(axis=0))
    size = np.where(size > 0.0, size, 1.0)
    information = (columns / size).T @ (columns / size) + 1e-14 * np.eye(columns.shape[1])
    found: Vector = np.linalg.inv(information) / np.outer(size, size)
    return found
