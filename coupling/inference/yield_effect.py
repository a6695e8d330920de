"""How far yielding would move what an elastic model found: the fit continued with Jackson and Green's law."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from coupling.cosimulation import CoSimulation
from coupling.inference.features import Features
from coupling.inference.misfit import Misfit
from coupling.inference.prediction import Prediction
from coupling.inference.search import RUNS_NEARBY, GlobalSearch, Solution
from coupling.results.findings import findings_of
from coupling.sweeps.progress import Progress
from coupling.yield_check import CURE
from particles.laws.yielding import JacksonGreen
from structures.caution import caution, collected
from structures.linear_algebra.one_thread import one_thread

YIELD = "yield: "
"""The first word of a run's finding on contacts beyond yield."""

LEAST = 1e-3
"""Part of a value that is not worth words."""


@dataclass(frozen=True)
class Dented:
    """A builder whose contacts yield."""

    build: Callable[..., CoSimulation]

    def __call__(self, **values: Any) -> CoSimulation:
        simulation = self.build(**values)
        return simulation.replace(chain=replace(simulation.chain.chain, law=JacksonGreen()))


def with_yielding(search: GlobalSearch, best: Solution, degrees: int) -> list[str]:
    """Return the warnings of the best run of contacts beyond yield, and how far they move the result.

    The user is warned of it.
    """
    elastic, said = search.misfit.prediction, list[str]()
    with collected():
        run = elastic.made(**elastic.values(best.p[: len(search.ranges)])).run(elastic.until)
    for finding in findings_of(run):
        if finding.startswith(YIELD):
            curable = CURE in finding and not isinstance(search.misfit, Features)
            moved = _moved(search, best, degrees) if curable else ""
            words = f"{finding.split('; ')[0]}; {moved}; {CURE}" if curable else finding
            caution(words)
            said.append(words)
    return said


def yielding_explains(search: GlobalSearch, best: Solution) -> bool:
    """Return whether contacts that yield, begun at the best fit of an elastic model, explain what that does not."""
    if not any(finding.startswith(YIELD) and CURE in finding for finding in search.misfit.prediction.warnings):
        return False
    elastic = search.misfit.prediction.build
    # That of a search between runs may not have reached its minimum.
    return [_explains(search, best, build) for build in (elastic, Dented(elastic))] == [False, True]


def _explains(search: GlobalSearch, best: Solution, build: Callable[..., CoSimulation]) -> bool:
    local = _near(search, best, build)
    nearest = local.nearest(alone=True)
    return local.misfit.explains(nearest.misfit, nearest.p)


def _near(search: GlobalSearch, best: Solution, build: Callable[..., CoSimulation]) -> GlobalSearch:
    """Return a search on runs of a builder from the best fit."""
    elastic, ranges = search.misfit.prediction, search.ranges
    prediction = Prediction(build, ranges, elastic.sensors, elastic.until)
    misfit = Misfit(prediction, search.misfit.measured, search.misfit.free, search.misfit.until)
    return GlobalSearch(misfit, 1, 0, search.seed, best.p[: len(ranges)], search.lines)


def _moved(search: GlobalSearch, best: Solution, degrees: int) -> str:
    """Return what a fit with the law, begun at the best one, finds; in words."""
    elastic, ranges = search.misfit.prediction, search.ranges
    local = _near(search, best, Dented(elastic.build))
    prediction = local.misfit.prediction
    with one_thread, Progress(RUNS_NEARBY * len(ranges), label="identify", likely=True) as prediction.progress:
        prediction.stage("yielding")
        nearest = local.nearest(search.misfit.explains(best.misfit, best.p))
    old, new = (elastic.values(solution.p[: len(ranges)]) for solution in (best, nearest))
    changes = {unknown.name: new[unknown.name] / old[unknown.name] - 1.0 for unknown in ranges if old[unknown.name]}
    moves = [f"{name} by {100.0 * change:+.2g} %" for name, change in changes.items() if abs(change) > LEAST]
    sizes = [(solution.misfit / degrees) ** 0.5 for solution in (best, nearest)]
    moved = f"moves {', '.join(moves)}" if moves else "moves nothing"
    return f"a model that yields {moved}, and its residual is {sizes[1]:.3g} times the noise instead of {sizes[0]:.3g}"
