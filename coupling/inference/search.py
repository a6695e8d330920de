"""Minima of a misfit: a scan of all ranges, least squares from its best points, and scans along each range."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from coupling.inference.misfit import Misfit, Point
from coupling.inference.surrogate import interpolated
from structures.structure import Vector

FIRST_STEP = 1e-3
"""Half the distance of runs for a derivative, as a part of the range, before the error of the unknown is known."""

STEP_OF_ERROR, SHORTEST_STEP, LONGEST_STEP = 0.3, 1e-5, 2e-2
"""Then it is this part of its standard deviation, within these limits. Much shorter steps would show how traces scatter
where a mesh changes with an unknown: that looks like information, and made intervals too short."""

ON_LINE = 64
"""Points of a scan along one range, the other unknowns at their best: echoes make minima as narrow as 1/40 of a range
of the factor 60, which a scan of all unknowns at once would miss."""

FROM_LINES, MOST_ROUNDS = 8, 4
"""Starts of least squares from the scans along all ranges, which are repeated while they find a better fit."""

FLAT, FEWEST_FLAT, FINER = 0.1, 4, 5
"""Where χ² of FEWEST_FLAT points of a line exceeds the least by the part FLAT, a faint echo may hide between: there the
line is FINER times finer."""

SAME = 1e-2
"""Solutions that differ by less than this part of each range, or by three standard deviations, are one."""

APART = 0.05
"""Starts of least squares differ at least by this part of a range in some unknown."""

PRECISION = 1e-5
"""Least squares end where χ², or every unknown, changes by less than this part: for 1 000 samples by 0.01."""

ROUGH, ROUGH_TRIES, WORSE = 1e-2, 10, 1.5
"""The same of rough searches, the points at which they try, and how much worse than the best one may be to go on."""

CANDIDATES = 8
"""Points of a scan between runs, for each run."""

EXCLUDED = 100.0
"""By so much more than the least χ², of unit noise, another fit is no choice where one explains the signal."""

FEWEST_LIKELY, FAR_WORSE = 3, 10.0
"""Minima between runs that are looked at, whatever the number of starts; how much worse than the best one they may seem
where no run is near."""

OF_SCALES = 0.7
"""Over many ranges, scales of the interpolation serve until the runs of which they were chosen are a smaller part."""

NEW = 1e-3
"""A run is made where none is within this part of each range."""

HELPS, MOST_IDLE, MORE_IDLE, WIDEST_SCAN = 0.99, 1, 4, 8
"""A run helps if χ² is less than this part of the least. After more rounds without such a run than this number, and
than the next one where a fit explains the signal already, the scan doubles, up to this multiple."""

MANY, STARTS_OF_MANY = 5, 8
"""Unknowns, and more, of which least squares on runs come first, as an interpolation between so few runs is coarse; and
the most starts of these. Of eight unknowns one start in eight to one in three led to the truth."""

WELL_SCANNED, RUNS_OF_LINE = 2, 16
"""A scan over more ranges than this number is followed by RUNS_OF_LINE runs along each range, through the best fit."""

MOST_FALL, LEAST_FALL, MOST_STEPS = 1.0, 0.1, 4
"""Of χ² over a last step, on which derivatives hardly change: a standard deviation; of a profile. The most steps."""

ROUGH_STARTS, MORE_STARTS = 3, 3
"""While no fit explains the signal: rough searches for each full one; and those that follow as the scan doubles."""

BESIDE = 2.0 * 1.5 ** np.arange(11)
"""Distances from the best fit at which others are looked for, in its standard deviations. Beads that rattle make minima
that are closer to each other than the points of any scan: a plate's edge at 37 mm was found at 36.8."""

NEARLY = 7
"""After a search between runs, which has looked at those farther away, it is this many of these distances."""

CHECKED, AS_EXPECTED = 3, 0.3
"""Every third of these distances is run; those beside it only where χ² does not rise as expected, to this part, and to
one: as between runs or, after a guess, as a parabola."""

RUNS_NEARBY = 20
"""Runs of a typical fit with a guess, for each unknown: half of them by least squares, half beside its minimum. One of
eight unknowns, which are correlated, took 30 to 40 for each."""


class Solution(NamedTuple):
    """A local minimum: p, χ², and whether least squares ended before its limit."""

    p: Vector
    misfit: float
    converged: bool


class GlobalSearch:
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
        self._known_lines = dict[tuple[bytes, int, bytes], Vector]()
        self._runs = list[tuple[Vector, Vector]]()
        """Places and traces of the scan."""
        self._interpolated: GlobalSearch | None = None
        self._scales: tuple[int, Any] = 0, None
        """Runs from which the scales of the interpolation were chosen, and these."""
        self.rises = dict[int, tuple[float, float]]()
        """Of χ² at BESIDE[0] standard deviations to both sides of the best fit, by the number of the unknown."""

    def solutions(self) -> list[Solution]:
        """Return the local minima from the best points of the scan, the least first; with a guess only the nearest."""
        if self.guess is not None:
            return [self._from_guess()]
        sobol, number = qmc.Sobol(len(self.ranges), seed=self.seed), int(np.ceil(np.log2(self.count)))
        scanned = self._scanned(sobol.random_base2(number))
        self._prepare(scanned)
        solutions, explained = list[Solution](), False
        for start in self._apart(scanned, [], STARTS_OF_MANY if len(self.ranges) >= MANY else 0):
            end = self.solved(start, ROUGH_TRIES, ROUGH)
            near = end.misfit < WORSE * self.misfit.samples
            solutions = _sorted([*solutions, self.solved(end.p) if near else end])
            if explained := self.misfit.explains(solutions[0].misfit, solutions[0].p):
                break
        if not explained and self.misfit.of_traces_alone:
            solutions = _sorted([*solutions, *self._between_runs(sobol)])
            explained = bool(solutions) and self.misfit.explains(solutions[0].misfit, solutions[0].p)
        # A residual that is not white may be an echo which is too faint for χ².
        if explained and self.misfit.is_white(self.misfit.residual(solutions[0].p)):
            return solutions
        self._interpolated = None  # what is faint, or what the model lacks, shows in runs alone
        if not explained:
            solutions = self._solved_from(self._apart(scanned, [], self.starts))
            if not self.misfit.explains(solutions[0].misfit, solutions[0].p):
                solutions = self._solved_from(
                    self._apart(scanned, [], ROUGH_STARTS * self.starts)[self.starts :], solutions
                )
        for _ in range(MOST_ROUNDS):
            least = solutions[0].misfit
            starts = self._along_lines(solutions)
            if not (explained := self.misfit.explains(least, solutions[0].p)):
                scanned = sorted([*scanned, *self._scanned(sobol.random(len(scanned)))], key=lambda pair: pair[0])
                starts += self._apart(
                    scanned, [*(solution.p for solution in solutions), *starts], MORE_STARTS * self.starts
                )
            solutions = self._solved_from(starts, solutions)
            if explained and solutions[0].misfit > least - 1.0:
                break
        return solutions

    def _from_guess(self) -> Solution:
        """Return the local minimum nearest to the guess."""
        assert self.guess is not None
        scanned = self._scanned(self.guess[None])
        self._prepare(scanned)
        return self.solved(scanned[0][1])

    def _between_runs(self, sobol: qmc.Sobol) -> list[Solution]:
        """Return the minima of traces that are interpolated between runs, the least first; none where too few succeed.

        A run at each minimum shows whether it is one, and makes the interpolation better there. Where such runs no
        longer help, the scan doubles, until a fit explains the signal.
        """
        size, count, widest = len(self.ranges), len(self._runs), WIDEST_SCAN * len(self._runs)
        best, idle, candidates = list[Solution](), 0, self._candidates(count)
        lines = list(self.lines) if size > WELL_SCANNED else []
        while inner := self._interpolate():
            minima, candidates = inner.minima(candidates)
            least = best[0].misfit if best else np.inf
            explained = bool(best) and self.misfit.explains(least, best[0].p)
            likely = self._likely(minima, [solution.p for solution in best], explained)
            places = np.array([place for place, _ in self._runs])
            away = [float(abs(p[:size] - places).max(axis=1).min()) for p in likely]
            if idle > (MORE_IDLE if explained else MOST_IDLE) or (explained and max(away) < SAME):
                idle = 0
                if lines:
                    self._scanned(np.concatenate([self._line_through(best[0].p, k) for k in lines]))
                    lines = []
                elif explained or 2 * count > widest:
                    return self._solved_from(likely, explained=explained)
                else:
                    self._scanned(sobol.random(count))
                    count, candidates = 2 * count, self._candidates(2 * count)
                continue
            starts = [p for p, distance in zip(likely, away, strict=True) if distance > NEW]
            for p in starts:
                trace = self.misfit.prediction.trace(p[:size])
                best.append(Solution(p, self.misfit.of_traces(p, trace), True))
                self._runs += [(p[:size], trace)] if np.isfinite(trace).all() else []
            best = _sorted(best)
            idle = 0 if starts and best[0].misfit < HELPS * least else idle + 1
        return []

    def _line_through(self, p: Vector, k: int) -> Vector:
        """Return places on the line along a range through a point."""
        places = np.tile(p[: len(self.ranges)], (RUNS_OF_LINE, 1))
        places[:, k] = (np.arange(RUNS_OF_LINE) + 0.5) / RUNS_OF_LINE
        return places

    def _candidates(self, count: int) -> Vector:
        """Return the points of a scan between `count` runs."""
        sobol, number = qmc.Sobol(len(self.ranges), seed=self.seed + 1), int(np.ceil(np.log2(CANDIDATES * count)))
        return np.asarray(sobol.random_base2(number))

    def _interpolate(self) -> "GlobalSearch | None":
        """Return the search between all runs of the scan; None where there are too few."""
        places, traces = (np.array(column) for column in zip(*self._runs, strict=True))
        of, scales = self._scales
        anew = len(self.ranges) <= WELL_SCANNED or of < OF_SCALES * len(places)
        surrogate = interpolated(self.misfit.prediction, places, traces, None if anew else scales)
        if surrogate is not None:
            self._scales = len(places) if anew else of, surrogate.scales
            misfit = self.misfit.on(surrogate)
            self._interpolated = GlobalSearch(misfit, self.starts, 0, self.seed, None, self.lines)
        return None if surrogate is None else self._interpolated

    def _worse(self, explained: bool) -> float:
        """Return by which factor χ² of a fit may exceed the least for it to be looked at."""
        return min(WORSE, 1.0 + EXCLUDED / self.misfit.samples) if explained else WORSE

    def _likely(self, solutions: Sequence[Solution], runs: Sequence[Vector], explained: bool) -> list[Vector]:
        """Return those apart from each other that are hardly worse than the first one; also worse ones far from runs,
        where an interpolation is not exact."""
        size, least = len(self.ranges), solutions[0].misfit
        likely = [
            (misfit, p)
            for p, misfit, _ in solutions
            if misfit < self._worse(explained) * least
            or (misfit < FAR_WORSE * least and all(abs(p[:size] - run[:size]).max() > APART for run in runs))
        ]
        return self._apart(likely, [], max(self.starts, FEWEST_LIKELY))

    def minima(self, candidates: Vector) -> tuple[list[Solution], Vector]:
        """Return minima of a scan of candidates and of lines, where traces cost no runs; and candidates that are nearer
        to minima once more runs are known."""
        scanned = self._scanned(candidates)
        rough = self._rough(self._apart(scanned, [], ROUGH_STARTS * self.starts))
        rough += self._rough(self._along_lines(rough))
        ends = [(misfit, p) for p, misfit, _ in _sorted(rough)]
        worth = [end for end in ends if end[0] < FAR_WORSE * ends[0][0]]
        solved = map(self.solved, self._apart(worth, [], self.starts + 1))
        return _sorted(solved), np.array([p[: len(self.ranges)] for _, p in ends])

    def _rough(self, starts: Sequence[Vector]) -> list[Solution]:
        """Return the ends of rough least squares, the least first."""
        return _sorted(self.solved(p, ROUGH_TRIES, ROUGH) for p in starts)

    def _scanned(self, places: Vector) -> list[tuple[float, Vector]]:
        """Return χ² and p at places that can be run, the best first."""
        traces = self.misfit.prediction.traces(list(places))
        pairs = [(place, trace) for place, trace in zip(places, traces, strict=True) if np.isfinite(trace).all()]
        self._runs += pairs
        scanned = [self.misfit.start(place, trace)[::-1] for place, trace in pairs]
        return sorted(scanned, key=lambda pair: pair[0])

    def _prepare(self, scanned: list[tuple[float, Vector]]) -> None:
        """Choose the samples that count from the best point of the scan."""
        if not scanned:
            raise ValueError(f"build: all runs of the scan fail; the first with {self.misfit.prediction.reason}")
        self.misfit.keep_window(self.misfit.time_zero(scanned[0][1]))
        self.misfit.refresh(scanned[0][1], final=False)

    def _apart(self, scanned: Sequence[tuple[float, Vector]], starts: Sequence[Vector], count: int) -> list[Vector]:
        """Return the best points that are apart from each other and from `starts`."""
        size, near, chosen = len(self.ranges), list(starts), list[Vector]()
        for _, p in scanned:
            if len(chosen) < count and all(abs(p[:size] - other[:size]).max() > APART for other in near):
                near.append(p)
                chosen.append(p)
        return chosen

    def _solved_from(
        self, starts: Sequence[Vector], others: Sequence[Solution] = (), explained: bool = False
    ) -> list[Solution]:
        """Return other solutions and those of rough least squares from each start, full ones from the best of these.

        explained: by a fit near the first start, which is refined later.
        """
        size, full, rest = len(self.ranges), list[Solution](), list[Solution]()
        roughs = self._rough(starts)
        least = min((solution.misfit for solution in (*others, *roughs[:1])), default=np.inf)
        full += roughs[:explained]
        for rough in roughs[explained:]:
            better = len(full) < self.starts and rough.misfit < self._worse(explained) * least
            # One valley is searched to its ground once.
            if better and all(abs(rough.p[:size] - other.p[:size]).max() > SAME for other in (*others, *full)):
                full.append(self.solved(rough.p))
            else:
                rest.append(rough)
        return _sorted([*others, *full, *rest])

    def _along_lines(self, solutions: Sequence[Solution]) -> list[Vector]:
        """Return best minima on the lines along each range through the best solution, away from the solutions known."""
        best, candidates = solutions[0].p, list[tuple[float, Vector]]()
        size = len(self.ranges)
        grid = (np.arange(ON_LINE) + 0.5) / ON_LINE
        for k in self.lines:
            places, values = grid, self._on_line(best, k, grid)
            flat = np.flatnonzero(values < (1.0 + FLAT) * solutions[0].misfit)
            if flat.size >= FEWEST_FLAT:
                between = (flat[:, None] + (np.arange(1, FINER) / FINER - 0.5)).ravel() + 0.5
                finer = np.unique(np.clip(between / ON_LINE, 0.0, 1.0))
                places, values = np.append(grid, finer), np.append(values, self._on_line(best, k, finer))
                order = np.argsort(places)
                places, values = places[order], values[order]
            padded = np.concatenate([[np.inf], values, [np.inf]])
            minima = np.flatnonzero((padded[1:-1] <= padded[:-2]) & (padded[1:-1] <= padded[2:]))
            for i in minima[np.isfinite(values[minima])]:
                p = best.copy()
                p[k] = places[i]
                candidates.append((float(values[i]), p))
        candidates.sort(key=lambda pair: pair[0])
        solved, chosen = [(solution.misfit, solution.p) for solution in solutions], list[Vector]()
        for value, p in candidates:
            # A point that fits better than a solution nearby is not in its valley.
            if all(abs(p[:size] - other[:size]).max() > APART or value < fit for fit, other in solved):
                solved.append((value, p))
                chosen.append(p)
        return chosen[:FROM_LINES]

    def _on_line(self, best: Vector, k: int, places: Vector) -> Vector:
        """Return χ² where one unknown has these places, and the others are the best ones.

        The next round asks for the same lines where the one before found nothing better.
        """
        key = best.tobytes(), k, places.tobytes()
        if key not in self._known_lines:
            line = np.tile(best, (places.size, 1))
            line[:, k] = places
            traces = self.misfit.prediction.traces(list(line[:, : len(self.ranges)]))
            values = [self.misfit.of_traces(p, trace) for p, trace in zip(line, traces, strict=True)]
            self._known_lines[key] = np.array(values)
        return self._known_lines[key]

    def solved(
        self, start: Vector, tries: int = 30, precision: float = PRECISION, fixed: int | None = None
    ) -> Solution:
        """Least squares from a start; fixed: the number of an unknown that keeps its place.

        An error of the derivatives leaves as large a part of the standard deviation. Those of a secant may lack a
        direction in which χ² still falls: where least squares end with them, they go on with new ones.
        """
        solution = self._least_squares(start, tries, precision, fixed)
        while self.misfit.reused and fixed is None and precision == PRECISION:
            self.misfit.forget_slopes()
            before, solution = solution, self._least_squares(solution.p, tries, precision, fixed)
            if solution.misfit > before.misfit - MOST_FALL:
                break
        return solution

    def _least_squares(self, start: Vector, tries: int, precision: float, fixed: int | None) -> Solution:
        """Return where they end."""
        low, high = self.misfit.bounds()
        free = np.array([k for k in range(start.size) if k != fixed])
        p = np.clip(start, low, high)

        def full(x: Vector) -> Vector:
            full_point = p.copy()
            full_point[free] = x
            return full_point

        def slope(x: Vector) -> Vector:
            of = self.between if len(self.ranges) <= WELL_SCANNED else self
            jacobian: Vector = of.misfit.at(full(x), self.steps, rough=True).projected[:, free]
            return jacobian

        if not free.size:
            residual = self.misfit.residual(p)
            return Solution(p, float(residual @ residual), True)
        inner = np.clip(p[free], low[free] + 1e-9, high[free] - 1e-9)
        done = least_squares(
            lambda x: self.misfit.residual(full(x)), inner, slope, bounds=(low[free], high[free]), x_scale="jac",
            xtol=precision, ftol=precision, gtol=1e-12, max_nfev=tries,
        )  # fmt: skip
        return Solution(full(done.x), 2.0 * float(done.cost), bool(done.status > 0))

    def count_other_samples(self, time_zero: float) -> None:
        """Count the samples that the signal has now, also between runs; time_zero: s."""
        self.misfit.keep_window(time_zero)
        if self._interpolated:
            self._interpolated.misfit = self.misfit.on(self._interpolated.misfit.prediction)

    def settled(self, solution: Solution) -> tuple[Solution, Point, list[Solution]]:
        """Return the solution refined, or a better minimum beside it; all of the misfit there; minima beside it."""
        (best, point), minima = self.refined(solution), list[Solution]()
        for _ in range(MOST_ROUNDS):
            ends = self._rough(self._beside(best, point))
            worst = self._worse(self.misfit.explains(best.misfit, best.p)) * best.misfit
            minima += (self.solved(end.p) for end in ends if end.misfit < worst)
            least = min(minima, key=lambda other: other.misfit, default=best)
            if least.misfit > best.misfit - 1.0:
                break
            best, point = self.refined(least)
            self.rises = {}
        return best, point, minima

    def _beside(self, best: Solution, point: Point) -> list[Vector]:
        """Return minima a few standard deviations away, where each unknown moves and the others as it correlates."""
        covariance, minima = inverse(point.columns)[: best.p.size], list[Vector]()
        (low, high), self.rises = self.misfit.bounds(), {}
        distances = BESIDE[:NEARLY] if self._interpolated else BESIDE
        for k in self.lines:
            deviation, sides = covariance[:, k] / np.sqrt(covariance[k, k]), list[list[tuple[float, Vector]]]()
            for side in (-1.0, 1.0):
                moved = (best.p + side * away * deviation for away in distances)
                line = [np.clip(p, low, high) for p in moved if low[k] <= p[k] <= high[k]]
                sides.append(self._risen_along(line, distances, best))
            before, after = sides
            if before and after:
                self.rises[k] = before[0][0] - best.misfit, after[0][0] - best.misfit
            fits = [*before[::-1], (best.misfit, best.p), *after]
            values = np.array([np.inf, *(value for value, _ in fits), np.inf])
            lowest = np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] < values[2:]))
            minima += [fits[i][1] for i in lowest if i != len(before)]
        return minima

    def _risen_along(
        self, line: list[Vector], distances: Iterable[float], best: Solution
    ) -> list[tuple[float, Vector]]:
        """Return χ² and p at places ever farther from the best fit: of runs, or as expected where runs agree."""
        if not line:
            return []
        if self._interpolated:
            # Its small error at the best fit is not one of a rise.
            (here, _), *fits = self._interpolated.fits_at([best.p, *line], best)
            fits = [(fit - here + best.misfit, p) for fit, p in fits]
        else:
            fits = [(best.misfit + away**2, p) for p, away in zip(line, distances, strict=False)]
        surprising, known = set[int](), sorted({*range(0, len(line), CHECKED), len(line) - 1})
        for i, run in zip(known, self.fits_at([line[i] for i in known], best), strict=True):
            rise = run[0] - best.misfit
            if abs(fits[i][0] - run[0]) > 1.0 + AS_EXPECTED * abs(rise):
                surprising |= {*range(max(i - CHECKED, 0), i + CHECKED)} - {*known}
            fits[i] = run
        again = sorted(i for i in surprising if i < len(line))
        for i, run in zip(again, self.fits_at([line[i] for i in again], best), strict=True):
            fits[i] = run
        return fits

    @property
    def between(self) -> "GlobalSearch":
        """The search between runs, or this one where there is none."""
        return self._interpolated or self

    def fits_at(self, line: list[Vector], best: Solution) -> list[tuple[float, Vector]]:
        """Return χ² and p at places of a line through the best fit."""
        fits, size = list[tuple[float, Vector]](), len(self.ranges)
        places = [p[:size] for p in line]
        for p, trace in zip(line, self.misfit.prediction.known_traces(places), strict=True):
            # In another valley the sensors' nuisances need not follow their correlation in this one.
            choices = (p, np.append(p[:size], best.p[size:]))
            fits.append(min(((self.misfit.of_traces(q, trace), q) for q in choices), key=lambda fit: fit[0]))
        return fits

    def refined(self, solution: Solution) -> tuple[Solution, Point]:
        """Return the least squares again, with derivatives over steps that suit the errors."""
        self.misfit.refresh(solution.p)
        if self._interpolated:
            point = self._interpolated.misfit.at(solution.p, self.steps, rough=True)
        else:
            point = self.misfit.at(solution.p, self.steps, rough=True)
            solution = solution._replace(misfit=point.misfit)
        errors = np.sqrt(np.diag(inverse(point.columns)))[: len(self.ranges)]
        self.steps = np.clip(STEP_OF_ERROR * errors, SHORTEST_STEP, LONGEST_STEP)
        if self.misfit.of_traces_alone:
            near = self._few_steps(self.misfit.at(solution.p, self.steps), MOST_FALL)
            if near is not None:
                point = self.misfit.beside(near.p)
                return near._replace(misfit=point.misfit), point
        again = self.solved(solution.p, tries=10)
        best = again if again.misfit <= solution.misfit else solution
        return best, self.misfit.at(best.p, self.steps)

    def nearest_to(self, start: Vector, fixed: int) -> Solution:
        """Return the least squares from a start near the best fit."""
        if self.misfit.of_traces_alone:
            near = self._few_steps(self.misfit.at(start, self.steps, rough=True), LEAST_FALL, fixed)
            if near is not None:
                return near
        return self.solved(start, tries=8, fixed=fixed)

    def _few_steps(self, point: Point, fall_of_last: float, fixed: int | None = None) -> Solution | None:
        """Return the end of few steps of least squares; None where χ² is not what these predict."""
        free = np.arange(point.p.size) != fixed
        for _ in range(MOST_STEPS):
            step = np.zeros(point.p.size)
            step[free] = -np.linalg.lstsq(point.projected[:, free], point.residual, rcond=None)[0]
            fall = point.misfit - float(((point.residual + point.projected @ step) ** 2).sum())
            p = np.clip(point.p + step, *self.misfit.bounds())
            residual = self.misfit.residual(p)
            after = float(residual @ residual)
            if fall <= fall_of_last and abs(point.misfit - fall - after) <= PRECISION * after:
                return Solution(p, after, True)
            if after > point.misfit:
                return None
            point = self.misfit.at(p, self.steps, rough=True)
        return None


def _sorted(solutions: Iterable[Solution]) -> list[Solution]:
    """Return solutions, the least misfit first."""
    return sorted(solutions, key=lambda solution: solution.misfit)


def inverse(columns: Vector) -> Vector:
    """Return the covariance for unit noise; directions that change nothing get an error that is large, not infinite."""
    size = np.sqrt((columns**2).sum(axis=0))
    size = np.where(size > 0.0, size, 1.0)
    information = (columns / size).T @ (columns / size) + 1e-14 * np.eye(columns.shape[1])
    covariance: Vector = np.linalg.inv(information) / np.outer(size, size)
    return covariance
