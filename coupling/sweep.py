"""Many runs over any axes, in processes, into one Dataset."""

from collections.abc import Callable, Iterable, Sequence
from itertools import product
from typing import Any

import joblib
import numpy as np
import xarray as xr
from tqdm import tqdm

from coupling.cosimulation import CoSimulation
from structures.checks import positive, whole


def sweep(
    build: Callable[..., CoSimulation],
    until: float,
    jobs: int | None = None,
    keep: Sequence[str] | None = None,
    **axes: Iterable[Any],
) -> xr.Dataset:
    """Run `build(**point)` up to `until` (s) at every combination of the axes' values.

    jobs: processes, by default one for each core. keep: the variables to keep, by default all.
    The Dataset has a dimension for each axis (named values, such as materials, become their names) and the
    attributes of the first run. All runs share the sampling of the coarsest. Points that share all but the last
    axis run in one process, one after the other, so that `build` may cache what they have in common.
    Raises ValueError for an empty axis; an error in one point ends the sweep.
    """
    positive("until", until, "s")
    values = {name: list(axis) for name, axis in axes.items()}
    if not values or not all(values.values()):
        raise ValueError(f"axes = {list(values)!r}: name at least one, each with at least one value")
    names = list(values)
    points = [dict(zip(names, point, strict=True)) for point in product(*values.values())]
    together = len(values[names[-1]]) if len(names) > 1 else 1
    batches = [points[i : i + together] for i in range(0, len(points), together)]
    workers = min(joblib.cpu_count() if jobs is None else whole("jobs", jobs), len(batches))

    runs: list[xr.Dataset] = []
    work = (joblib.delayed(_run_batch)(build, until, keep, batch) for batch in batches)
    with tqdm(total=len(points), unit="run", disable=None, leave=False) as bar:
        for done in joblib.Parallel(n_jobs=workers, return_as="generator", batch_size=1)(work):
            runs.extend(done)
            bar.update(len(done))
    return _combined(runs, values)


def _run_batch(
    build: Callable[..., CoSimulation], until: float, keep: Sequence[str] | None, points: list[dict[str, Any]]
) -> list[xr.Dataset]:
    runs = [build(**point).run(until) for point in points]
    return runs if keep is None else [run[list(keep)].assign_attrs(run.attrs) for run in runs]


def _combined(runs: list[xr.Dataset], values: dict[str, list[Any]]) -> xr.Dataset:
    """One Dataset over the axes, on the times that all runs share."""
    coarsest = min(runs, key=lambda run: run.sizes["time"])
    frames = coarsest.sizes["time"] - 1
    aligned = [run.isel(time=slice(None, None, (run.sizes["time"] - 1) // frames)) for run in runs]
    shape = tuple(len(axis) for axis in values.values())
    coordinates = {name: (name, _labels(axis)) for name, axis in values.items()}
    combined = xr.Dataset(coords={**coarsest.coords, **coordinates}, attrs=runs[0].attrs)
    for name, first in aligned[0].data_vars.items():
        stacked = np.stack([run[name].values for run in aligned]).reshape(*shape, *first.shape)
        combined[name] = ((*values, *first.dims), stacked, first.attrs)
    for name in ("static_force", "centre"):
        first = aligned[0][name]
        if any(not np.array_equal(run[name].values, first.values) for run in aligned):
            stacked = np.stack([run[name].values for run in aligned]).reshape(*shape, *first.shape)
            combined = combined.assign_coords({name: ((*values, *first.dims), stacked, first.attrs)})
    return combined


def _labels(axis: list[Any]) -> list[Any]:
    """Numbers and strings as they are; other objects by their name, or as text."""
    return [v if isinstance(v, str | int | float | np.number) else getattr(v, "name", None) or str(v) for v in axis]
