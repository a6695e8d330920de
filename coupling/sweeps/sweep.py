"""Many runs over any axes, in processes or on a cluster, into one Dataset; finished points may be kept in a store."""

import inspect
import logging
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from itertools import groupby, product
from typing import TYPE_CHECKING, Any

import joblib
import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.results.findings import findings_of, gathered, warn, with_warnings
from coupling.results.schema import OF_RUNS
from coupling.sweeps.cluster import check_cluster, on_cluster
from coupling.sweeps.processes import Batch, Outcome, Work, in_processes
from coupling.sweeps.progress import Progress
from coupling.sweeps.store import ERROR, Failure, Point, Store, describe_point, open_store
from structures.caution import caution
from structures.checks import instance, listed, positive, short, whole
from structures.structure import Vector

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger("hertzlink.sweep")


def sweep(
    build: Callable[..., CoSimulation],
    until: float,
    jobs: int | None = None,
    measure: Callable[[xr.Dataset], xr.Dataset] | None = None,
    store: str | os.PathLike[str] | None = None,
    cluster: "Client | str | None" = None,
    retry: bool = False,
    **axes: Iterable[Any],
) -> xr.Dataset:
    """Run `build(**point)` up to `until` (s) at every combination of the axes' values.

    jobs: processes, by default one for each core. measure: what to keep of each run, by default all of it.
    The Dataset has a dimension for each axis (named values, such as materials, become their names) and the
    attributes of the first run. Its attribute `warnings` has the first finding of each kind, with the number of points
    that have one; after the sweep each is one Python warning. All runs share the sampling of the coarsest, and have
    NaN for modes of deformable beads that others have more of. Points that share all but the last axis run in one
    process, one after the other, so that `build` may cache what they have in common.
    Raises ValueError for an axis that is empty or names two values alike, a name that every run has, and axes that
    build does not take. An error in one point ends the sweep, with a note that names the point (RuntimeError where its
    process dies, or for an error that no pickle can hold).

    store: a folder that keeps each point as soon as it is finished, as netCDF. The same sweep again, after it was
    killed or with longer axes, runs the points that are not there, and gives what one straight sweep would. Axes are
    then numbers, texts, or dataclasses of these, such as materials. The store knows build and measure by their names
    alone: give another folder where their code has changed, or what they take from around them. A point that fails
    (any Exception of build, the run or measure, or its process dies, alone too) is recorded there, and the others go
    on, unless it is a failure of the environment: ImportError (a package is missing), MemoryError, or OSError (the disk
    is full, a file or a connection is lost) ends the sweep, and the point is run again by the next. For a point that is
    recorded the Dataset has NaN, and the error as text in the variable `error`, which is empty where all is well. It is
    not run again but with `retry`. With jobs=1 points run in this process, and one that kills it ends the sweep.
    Sweeps may share a store; at once they might run a point twice, which does no harm.
    cluster: a `distributed.Client`, or the address of its scheduler, instead of processes. The
    workers need hertzlink; this process alone writes the store. Where a worker dies, others run what it was running; a
    point that several died of fails as above. ConnectionError where the scheduler is lost, or for a minute no worker is
    there.
    Raises ValueError for a store of another sweep, or with damaged or foreign files, which are left alone; RuntimeError
    where all points fail.
    """
    until = positive("until", until, "s")
    if measure is not None and not callable(measure):
        raise ValueError(f"measure = {short(measure)}: must be a function of a run's Dataset")
    if instance("retry", retry, bool, "True or False") and store is None:
        raise ValueError("retry = True: needs the store that tells which points failed")
    if cluster is not None:
        check_cluster(cluster)
        if jobs is not None:
            raise ValueError(f"jobs = {jobs!r}: must be None with a cluster, whose workers tell how many run at once")
    most = joblib.cpu_count() if jobs is None else whole("jobs", jobs)
    values = axis_values(axes, OF_RUNS if store is None else OF_RUNS | {ERROR})
    check_build(build, values)
    points: list[Point] = [dict(zip(values, point, strict=True)) for point in product(*values.values())]
    # Checked before a folder is made.
    texts = [str(i) if store is None else describe_point(point) for i, point in enumerate(points)]
    work = Work(build, until, measure, None if store is None else open_store(store, build, until, measure))
    together = len(values[list(values)[-1]]) if len(values) > 1 else 1

    def run(batches: list[Batch]) -> Iterator[tuple[int, Outcome]]:
        return in_processes(work, batches, most) if cluster is None else on_cluster(work, batches, cluster)

    found = {} if work.store is None else _found(work.store, points, retry)
    outcomes = _finished(found, points, texts, together, run)
    if work.store is not None:
        outcomes.update((i, work.store.load(point)) for i, point in enumerate(points) if outcomes.get(i) is None)
        _tell_failures(work.store, outcomes)
    data = _combined([outcomes[i] for i in range(len(points))], values)
    warn(findings_of(data))
    return data


def axis_values(axes: dict[str, Iterable[Any]], taken: Set[str]) -> dict[str, list[Any]]:
    """The axes as lists, or a ValueError for one that is empty, names two values alike or has a name that is taken."""
    if not axes:
        raise ValueError("axes: name at least one, such as distance=[0.01, 0.02]")
    values = {name: listed(name, axis, object, "one value or more") for name, axis in axes.items()}
    if used := sorted(taken & set(values)):
        raise ValueError(f"axes = {list(values)!r}: {', '.join(used)} is a name that every run uses")
    for name, axis in values.items():
        labels = np.asarray(axis_labels(axis)).tolist()
        if twice := [label for label, count in Counter(labels).items() if count > 1]:
            raise ValueError(f"{name} = {short(axis)}: must not hold {short(twice[0])} twice")
    return values


def check_build(build: Callable[..., CoSimulation], values: Mapping[str, Any]) -> None:
    """Raises ValueError where build is no function, or does not take just what the axes give."""
    if not callable(build):
        raise ValueError(f"build = {short(build)}: must be a function that returns a CoSimulation")
    try:
        signature = inspect.signature(build)
    except (TypeError, ValueError):  # of some that are written in C
        return
    try:
        signature.bind(**values)
    except TypeError as error:
        raise ValueError(
            f"build = {short(build)}: takes {', '.join(signature.parameters) or 'nothing'}, but the axes are "
            f"{', '.join(values)} ({error})"
        ) from None


def _found(store: Store, points: list[Point], retry: bool) -> dict[int, Outcome]:
    """What the store holds of the points, by their place."""
    outcomes: dict[int, Outcome] = {}
    for i, point in enumerate(points):
        outcome = store.load(point)
        if retry and isinstance(outcome, Failure):
            store.forget(point)
        elif outcome is not None:
            outcomes[i] = outcome
    if outcomes:
        log.info("%d of %d points are in %s", len(outcomes), len(points), store.folder)
    return outcomes


def _finished(
    found: Mapping[int, Outcome],
    points: list[Point],
    texts: list[str],
    together: int,
    run: Callable[[list[Batch]], Iterator[tuple[int, Outcome]]],
) -> dict[int, Outcome]:
    """Outcomes by place, those found and those of the points that are left; what has the same text is run once."""
    left = {text: i for i, text in reversed(list(enumerate(texts))) if i not in found}
    groups = groupby(sorted(left.values()), lambda i: i // together)
    batches: list[Batch] = [{i: points[i] for i in group} for _, group in groups]
    outcomes = dict(found)
    failed = sum(isinstance(outcome, Failure) for outcome in found.values())
    with Progress(len(found) + len(left), len(found), failed) as progress:
        for i, outcome in run(batches) if batches else ():
            outcomes[i] = outcome
            progress.advance(isinstance(outcome, Failure))
    return outcomes


def _tell_failures(store: Store, outcomes: Mapping[int, Outcome]) -> None:
    """A warning where some points failed; RuntimeError where all did, or somebody took points away."""
    if any(outcome is None for outcome in outcomes.values()):
        raise RuntimeError(f"points were taken out of {store.folder} while the sweep ran; run it again")
    failures = [outcome for outcome in outcomes.values() if isinstance(outcome, Failure)]
    if len(failures) == len(outcomes):
        raise RuntimeError(
            f"all {len(failures)} points failed, as recorded in {store.folder}; one with {failures[0]}; "
            "retry=True runs them again"
        )
    if failures:
        caution(
            f"sweep: {len(failures)} of {len(outcomes)} points failed, see the variable error, and {store.folder}; "
            "retry=True runs them again"
        )


def _combined(outcomes: Sequence[Outcome], values: dict[str, list[Any]]) -> xr.Dataset:
    """One Dataset over the axes, on the times that all runs share; coordinates that differ get the axes too."""
    places, runs = zip(*((i, run) for i, run in enumerate(outcomes) if isinstance(run, xr.Dataset)), strict=True)
    aligned: Sequence[xr.Dataset] = runs
    if "time" in runs[0].sizes:
        frames = min(run.sizes["time"] for run in runs) - 1
        aligned = [run.isel(time=slice(None, None, max(1, (run.sizes["time"] - 1) // frames))) for run in runs]
        if any(
            not np.allclose(run.time, aligned[0].time, rtol=1e-9) for run in aligned if run.sizes == aligned[0].sizes
        ):
            raise ValueError("window: the runs' times do not fit together; leave the windows to be chosen")
    aligned = _with_all_modes(aligned)
    if any(run.sizes != aligned[0].sizes for run in aligned):
        raise ValueError("build: runs differ in beads or times; use measure= to keep what they have in common")
    shape = tuple(len(axis) for axis in values.values())
    first = aligned[0]

    def stacked(name: str) -> tuple[tuple[str, ...], Vector, dict[str, Any]]:
        data = _placed(np.stack([run[name].values for run in aligned]), places, len(outcomes))
        return (*values, *map(str, first[name].dims)), data.reshape(*shape, *first[name].shape), first[name].attrs

    coordinates: dict[str, Any] = {name: (name, axis_labels(axis)) for name, axis in values.items()}
    for name, coordinate in first.coords.items():
        same = all(np.array_equal(run[name].values, coordinate.values) for run in aligned)
        coordinates[str(name)] = coordinate if same else stacked(str(name))
    variables: dict[str, Any] = {str(name): stacked(str(name)) for name in first.data_vars}
    if len(runs) < len(outcomes):
        errors = np.array([str(one) if isinstance(one, Failure) else "" for one in outcomes]).reshape(shape)
        variables[ERROR] = (tuple(values), errors, {"long_name": "why the point failed, empty where it did not"})
    findings = {_named(values, i): findings_of(run) for i, run in zip(places, runs, strict=True) if findings_of(run)}
    return with_warnings(xr.Dataset(variables, coordinates, runs[0].attrs), gathered(findings, len(outcomes)))


def _named(values: dict[str, list[Any]], place: int) -> str:
    """A point by its place, in words."""
    where = np.unravel_index(place, [len(axis) for axis in values.values()])
    return named({name: axis[i] for (name, axis), i in zip(values.items(), where, strict=True)})


def named(point: Point) -> str:
    """A point in words."""
    return ", ".join(f"{name} = {_shown(axis_labels([value])[0])}" for name, value in point.items())


def _shown(label: Any) -> str:
    """A number with six digits, anything else in a few words."""
    plain = isinstance(label, float | int | np.number) and not isinstance(label, bool)
    return f"{label:.6g}" if plain else short(label)


def _with_all_modes(runs: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """Filled up with NaN to the most modes of any."""
    most = max(run.sizes.get("mode", 0) for run in runs)
    return [
        run.pad({"mode": (0, most - run.sizes["mode"])}, keep_attrs=True) if run.sizes.get("mode", most) < most else run
        for run in runs
    ]


def _placed(data: Vector, places: Sequence[int], count: int) -> Vector:
    """Rows of the points that were run among those of all; the others are NaN, texts empty."""
    if len(places) == count:
        return data
    if data.dtype.kind in "biu":
        data = data.astype(float)
    everywhere = np.full((count, *data.shape[1:]), "" if data.dtype.kind == "U" else np.nan, data.dtype)
    everywhere[list(places)] = data
    return everywhere


def axis_labels(axis: list[Any]) -> list[Any]:
    """Numbers and strings as they are; other objects by their name, or as text."""
    return [
        v if isinstance(v, str | int | float | np.number | np.bool_) else getattr(v, "name", None) or str(v)
        for v in axis
    ]
