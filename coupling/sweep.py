"""Many runs over any axes, in processes, into one Dataset."""

from collections.abc import Callable, Iterable
from itertools import product
from typing import Any

import joblib
import numpy as np
import xarray as xr
from tqdm import tqdm

from coupling.cosimulation import CoSimulation
from coupling.result import DESCRIPTIONS
from structures.checks import instance, listed, positive, whole
from structures.structure import Vector

IDLE = 30
"""Seconds after which a process without work ends, as those of a sweep that was killed."""

TAKEN = {"time", "bead", "contact", "centre", "static_force", "impact_energy", *DESCRIPTIONS}
"""Names of every run's own dimensions, coordinates and variables."""


def sweep(
    build: Callable[..., CoSimulation],
    until: float,
    jobs: int | None = None,
    measure: Callable[[xr.Dataset], xr.Dataset] | None = None,
    **axes: Iterable[Any],
) -> xr.Dataset:
    """Run `build(**point)` up to `until` (s) at every combination of the axes' values.

    jobs: processes, by default one for each core. measure: what to keep of each run, by default all of it.
    The Dataset has a dimension for each axis (named values, such as materials, become their names) and the
    attributes of the first run. All runs share the sampling of the coarsest. Points that share all but the last
    axis run in one process, one after the other, so that `build` may cache what they have in common.
    Raises ValueError for an empty axis or a name that every run has; an error in one point ends the sweep.
    """
    positive("until", until, "s")
    if not callable(build):
        raise ValueError(f"build = {build!r}: must be a function that returns a CoSimulation")
    if measure is not None and not callable(measure):
        raise ValueError(f"measure = {measure!r}: must be a function of a run's Dataset")
    if not axes:
        raise ValueError("axes: name at least one, such as distance=[0.01, 0.02]")
    values = {name: listed(name, axis, object, "one value or more") for name, axis in axes.items()}
    names = list(values)
    if taken := sorted(TAKEN & set(names)):
        raise ValueError(f"axes = {names!r}: {', '.join(taken)} is a name that every run uses")
    points = [dict(zip(names, point, strict=True)) for point in product(*values.values())]
    together = len(values[names[-1]]) if len(names) > 1 else 1
    batches = [points[i : i + together] for i in range(0, len(points), together)]
    workers = min(joblib.cpu_count() if jobs is None else whole("jobs", jobs), len(batches))

    runs: list[xr.Dataset] = []
    work = (joblib.delayed(_run_batch)(build, until, measure, batch) for batch in batches)
    with tqdm(total=len(points), unit="run", disable=None, leave=False) as bar:
        parallel = joblib.Parallel(workers, return_as="generator", batch_size=1, idle_worker_timeout=IDLE)
        for done in parallel(work):
            runs.extend(done)
            bar.update(len(done))
    return _combined(runs, values)


def _run_batch(
    build: Callable[..., CoSimulation],
    until: float,
    measure: Callable[[xr.Dataset], xr.Dataset] | None,
    points: list[dict[str, Any]],
) -> list[xr.Dataset]:
    runs = [_run_point(build, until, point) for point in points]
    return runs if measure is None else [_measured(measure, run) for run in runs]


def _measured(measure: Callable[[xr.Dataset], xr.Dataset], run: xr.Dataset) -> xr.Dataset:
    kept = measure(run)
    instance("measure", kept, xr.Dataset, "a function that returns a Dataset")
    return kept.assign_attrs(run.attrs)


def _run_point(build: Callable[..., CoSimulation], until: float, point: dict[str, Any]) -> xr.Dataset:
    try:
        simulation = build(**point)
        instance("build", simulation, CoSimulation, "a function that returns a CoSimulation")
        return simulation.run(until)
    except (ValueError, TypeError, LookupError, RuntimeError, ArithmeticError) as error:
        error.add_note(f"in the sweep's point {point!r}")
        raise


def _combined(runs: list[xr.Dataset], values: dict[str, list[Any]]) -> xr.Dataset:
    """One Dataset over the axes, on the times that all runs share; coordinates that differ get the axes too."""
    aligned = runs
    if "time" in runs[0].sizes:
        frames = min(run.sizes["time"] for run in runs) - 1
        aligned = [run.isel(time=slice(None, None, max(1, (run.sizes["time"] - 1) // frames))) for run in runs]
        if any(
            not np.allclose(run.time, aligned[0].time, rtol=1e-9) for run in aligned if run.sizes == aligned[0].sizes
        ):
            raise ValueError("window: the runs' times do not fit together; leave the windows to be chosen")
    if any(run.sizes != aligned[0].sizes for run in aligned):
        raise ValueError("build: runs differ in beads or times; use measure= to keep what they have in common")
    shape = tuple(len(axis) for axis in values.values())
    first = aligned[0]

    def stacked(name: str) -> tuple[tuple[str, ...], Vector, dict[str, Any]]:
        data = np.stack([run[name].values for run in aligned]).reshape(*shape, *first[name].shape)
        return (*values, *map(str, first[name].dims)), data, first[name].attrs

    coordinates: dict[str, Any] = {name: (name, _labels(axis)) for name, axis in values.items()}
    for name, coordinate in first.coords.items():
        same = all(np.array_equal(run[name].values, coordinate.values) for run in aligned)
        coordinates[str(name)] = coordinate if same else stacked(str(name))
    variables = {str(name): stacked(str(name)) for name in first.data_vars}
    return xr.Dataset(variables, coordinates, runs[0].attrs)


def _labels(axis: list[Any]) -> list[Any]:
    """Numbers and strings as they are; other objects by their name, or as text."""
    return [
        v if isinstance(v, str | int | float | np.number | np.bool_) else getattr(v, "name", None) or str(v)
        for v in axis
    ]
