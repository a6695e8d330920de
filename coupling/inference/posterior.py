"""The posterior distribution of the unknowns, by an ensemble of walkers."""

from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.misfit import OF_SENSORS
from coupling.inference.search import GlobalSearch, inverse
from structures.caution import caution
from structures.checks import whole
from structures.structure import Vector

FEWEST_WALKERS, WALKERS = 16, 4
"""The number of walkers, and that for each parameter: an ensemble needs twice as many walkers as parameters."""

START = 0.3
"""The walkers start around the best fit, within this part of its standard deviations."""

LONG_ENOUGH = 50.0
"""A chain of this many autocorrelation times gives the interval to some 10 % (Goodman and Weare, 2010, section 4)."""


def sampled(search: GlobalSearch, best: Vector, flatness: float, runs: int, seed: int) -> xr.Dataset:
    """Draws of the unknowns. flatness: of the likelihood, 1 where residuals are noise of the known size."""
    try:
        import emcee
    except ImportError:
        raise ImportError('posterior: requires emcee; pip install "hertzlink[posterior]"') from None
    misfit, runs = search.misfit, whole("runs", runs)
    size, (low, high) = best.size, misfit.bounds()
    walkers = max(FEWEST_WALKERS, WALKERS * size)
    steps = runs // walkers
    if steps < 2:
        raise ValueError(f"runs = {runs}: must be at least {2 * walkers}, two for each of {walkers} walkers")

    def logarithm(points: Vector) -> Vector:
        inside = ((points >= low) & (points <= high)).all(axis=1)
        logarithms = np.full(len(points), -np.inf)
        if inside.any():
            points_inside = points[inside]
            traces = misfit.prediction.traces(list(points_inside[:, : len(search.ranges)]))
            values = [misfit.of_traces(p, trace) for p, trace in zip(points_inside, traces, strict=True)]
            logarithms[inside] = -0.5 * np.array(values) / flatness
        return logarithms

    random = np.random.default_rng(whole("seed", seed, 0))
    errors = np.sqrt(flatness * np.diag(inverse(misfit.at(best, search.steps).columns))[:size])
    # Within the bounds, and never all at one place.
    around = best + START * np.minimum(errors, 0.5 * (high - low)) * random.normal(size=(walkers, size))
    start = np.clip(around, low + 1e-9 * (high - low), high - 1e-9 * (high - low))
    sampler = emcee.EnsembleSampler(walkers, size, logarithm, vectorize=True)
    # emcee draws from numpy's older generator.
    sampler.random_state = np.random.RandomState(random.integers(2**31)).get_state()
    sampler.run_mcmc(start, steps)
    times = sampler.get_autocorr_time(tol=0)
    usual = float(np.nanmax(times)) if np.isfinite(times).any() else float(steps)
    burnt = min(int(3.0 * usual), steps // 2)
    chain = sampler.get_chain(discard=burnt, flat=True)
    notes = list[str]()
    if steps < LONG_ENOUGH * usual:
        notes.append(
            f"the chain has {steps / usual:.0f} autocorrelation times; with {LONG_ENOUGH:.0f}, some "
            f"{int(walkers * LONG_ENOUGH * usual * 1.2):.1g} runs, its intervals are exact to 10 %"
        )
        caution(f"posterior: {notes[0]}")
    return _dataset(search, chain, {"acceptance": float(np.mean(sampler.acceptance_fraction))}, usual, notes)


def _dataset(
    search: GlobalSearch, chain: Vector, attributes: dict[str, Any], usual: float, notes: list[str]
) -> xr.Dataset:
    misfit = search.misfit
    data: dict[str, Any] = {
        unknown.name: ("draw", np.array([unknown.value(place) for place in chain[:, k]]))
        for k, unknown in enumerate(search.ranges)
    }
    names = [name for name in OF_SENSORS if name in misfit.free]
    if "time_zero" in names:
        data["time_zero"] = "draw", np.array([misfit.time_zero(p) for p in chain]), {"units": "s"}
    if "time_constant" in names:
        data["time_constant"] = "draw", np.exp(chain[:, -1]), {"units": "s"}
    attributes |= {"autocorrelation_time": usual, "warnings": notes}
    return xr.Dataset(data, {"draw": np.arange(len(chain))}, attributes)
