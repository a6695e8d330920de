"""Many runs over any axes, in processes or on a cluster, combined in one Dataset; a store keeps finished points."""

import inspect
import logging
import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.results.findings import findings_of, gathered, warn, with_warnings
from coupling.results.schema import OF_RUNS
from coupling.sweeps.points import Outcome, Stopped, Task, run_points, shown
from coupling.sweeps.store import ERROR_VARIABLE, Failure, Point, Store
from structures.checks import count_of, function, instance, listed, positive, short, whole
from structures.structure import Vector

log = logging.getLogger("hertzlink.sweep")

AGAIN = "the store holds why, and retry=True runs them again"


def sweep(
    build: Callable[..., CoSimulation],
    until: float,
    jobs: int | None = None,
    measure: Callable[[xr.Dataset], xr.Dataset] | None = None,
    store: str | os.PathLike[str] | None = None,
    retry: bool = False,
    **axes: Iterable[Any],
) -> xr.Dataset:
    """Run `build(**point)` at every combination of the values of the axes.

    Points that differ only in the last axis run in one process, one after the other, so that `build` may cache what
    they have in common.

    Parameters
    ----------
    build : callable
        Returns the CoSimulation of a point; its arguments are the axes.
    until : float
        Length of each record, s.
    jobs : int, optional
        Number of processes; by default one for each core. With jobs=1 points run in this process. Within
        ``joblib.parallel_config("dask")`` points run on the workers of a cluster.
    measure : callable, optional
        Takes the Dataset of a run and returns the Dataset to keep; by default the whole run.
    store : str or PathLike, optional
        A folder that keeps each point in a file of its own as soon as it is finished. All workers must have access to
        it.
    retry : bool
        Whether to run points again that are recorded in the store as failed.
    **axes : iterable
        The values of each axis, such as length=[0.02, 0.04] or material=[hl.PTFE, hl.ACRYLIC].

    Returns
    -------
    xarray.Dataset
        The kept Datasets, with a dimension for each axis and the attributes of the first run. Materials and other named
        values become their names. All runs have the sampling of the coarsest. Modes of deformable beads that only some
        runs have are NaN in the others. The attribute `warnings` holds the first finding of each kind with the number
        of points that have it; each is one Python warning after the sweep.

    Raises
    ------
    ValueError
        For an axis that is empty, has two values of the same name, or has a name that every run uses; for axes that
        build does not accept; and for a store that cannot be used.
    RuntimeError
        If a process dies, or all points fail (with a store).

    Notes
    -----
    Without a store, an error at one point ends the sweep, with a note that names the point.

    With a store, the same sweep can be repeated after it was stopped, or with longer axes; it then runs only the
    missing points. A point is run again if anything that determines its numbers has changed: the source code of build
    or measure, data that they use from outside, or hertzlink. If a point fails because of its values, its numbers or
    its convergence (ValueError, LookupError, ArithmeticError, RuntimeError), the others continue. The point is then
    NaN, and the variable `error`, empty for all other points, holds the reason. All other errors end the sweep.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 14, bead, impact_speed=0.1)
    >>> def against(material):
    ...     return hl.CoSimulation(chain, hl.half_space(material))
    >>> runs = hl.sweep(against, until=1.2e-3, jobs=1, material=[hl.STEEL_440C, hl.PTFE])
    >>> [round(ratio, 2) for ratio in hl.amplitude_ratio(runs, sensor=7).values.tolist()]
    [0.99, 0.92]
    """
    until = positive("until", until, "s")
    if measure is not None:
        function("measure", measure, 1, "a function of the Dataset of a run")
    if instance("retry", retry, bool, "True or False") and store is None:
        raise ValueError("retry = True: needs the store that records which points failed")
    if jobs is not None:
        whole("jobs", jobs)
    values = axis_values(axes, OF_RUNS if store is None else OF_RUNS | {ERROR_VARIABLE})
    check_build(build, values, "axes", "distance=[0.01, 0.02]")
    points: list[Point] = [dict(zip(values, point, strict=True)) for point in product(*values.values())]
    together = len(values[list(values)[-1]]) if len(values) > 1 else 1
    if store is None:
        outcomes = run_points(Task(build, until, measure), points, jobs, together)
    else:
        folder = Store(store, build, until, measure)
        outcomes = outcomes_kept(Task(build, until, measure, folder), folder, points, jobs, together, retry)
    data = combined(outcomes, values, [shown(point, build) for point in points])
    warn(findings_of(data))
    return data


def outcomes_kept(
    task: Task,
    store: Store,
    points: Sequence[Point],
    jobs: int | None,
    together: int = 1,
    retry: bool = False,
    label: str = "sweep",
) -> list[Outcome]:
    """Return the outcomes of points; only points that are missing in the store are run."""
    outcomes = [store.load(point) for point in points]
    missing = [i for i, outcome in enumerate(outcomes) if outcome is None or (retry and isinstance(outcome, Failure))]
    if len(missing) < len(points):
        log.info("%d of %d points are in %s", len(points) - len(missing), len(points), store.folder)
    try:
        new = run_points(task, [points[i] for i in missing], jobs, together, label) if missing else []
    except KeyboardInterrupt:
        held = sum(store.path(point).exists() for point in points)
        raise Stopped(f"{held} of {len(points)} points kept in {store.folder}; run again to continue") from None
    for i, outcome in zip(missing, new, strict=True):
        outcomes[i] = outcome
    return [outcome for outcome in outcomes if outcome is not None]


def axis_values(axes: dict[str, Iterable[Any]], taken: Set[str]) -> dict[str, list[Any]]:
    """Return the axes as lists; raise a ValueError for an axis that is empty, has two values of the same name, or has a
    name that is taken."""
    values = {name: listed(name, axis, object, "one value or more") for name, axis in axes.items()}
    if used := sorted(taken & set(values)):
        raise ValueError(f"axes = {list(values)!r}: {used[0]} is a name that every run uses; rename the axis")
    for name, axis in values.items():
        labels = np.asarray(axis_labels(axis)).tolist()
        if twice := [label for label, count in Counter(labels).items() if count > 1]:
            raise ValueError(f"{name} = {short(axis)}: must not hold {short(twice[0])} twice")
    return values


def check_build(build: Callable[..., Any], values: Mapping[str, Any], names: str, example: str = "") -> None:
    """Raise a ValueError if build is not a function of exactly these arguments, or if an example shows that there must
    be one. names: the arguments in words."""
    if not callable(build):
        raise ValueError(f"build = {short(build)}: must be a function that returns a CoSimulation")
    if example and not values:
        raise ValueError(f"{names}: name at least one argument of build, such as {example}")
    try:
        signature = inspect.signature(build)
    except (TypeError, ValueError):  # some functions in C have no signature
        return
    try:
        signature.bind(**values)
    except TypeError as error:
        raise ValueError(
            f"build = {short(build)}: takes {', '.join(signature.parameters) or 'nothing'}, but the {names} are "
            f"{', '.join(values)} ({error})"
        ) from None


def built_at(build: Callable[..., Any], values: Mapping[str, Any]) -> CoSimulation:
    """Return the CoSimulation of one chain that a builder makes of these values; raise a ValueError for another."""
    built = instance("build(...)", build(**values), CoSimulation, "a CoSimulation")
    if len(built.interface.chains) > 1:
        raise ValueError(f"build(...) = {built!r}: must be the CoSimulation of one chain")
    return built


def combined(outcomes: Sequence[Outcome], values: dict[str, list[Any]], names: Sequence[str]) -> xr.Dataset:
    """Return one Dataset over the axes, at the times that all runs share. Coordinates that differ also get the
    axes. names: the points in words, for findings."""
    failures = [outcome for outcome in outcomes if isinstance(outcome, Failure)]
    if len(failures) == len(outcomes):
        raise RuntimeError(f"all {count_of(len(failures), 'point')} failed; {AGAIN}; the first with {failures[0]}")
    places, runs = zip(*((i, run) for i, run in enumerate(outcomes) if isinstance(run, xr.Dataset)), strict=True)
    aligned: Sequence[xr.Dataset] = runs
    if "time" in runs[0].sizes:
        frames = min(run.sizes["time"] for run in runs) - 1
        aligned = [run.isel(time=slice(None, None, max(1, (run.sizes["time"] - 1) // frames))) for run in runs]
    most = max(run.sizes.get("mode", 0) for run in aligned)
    aligned = [
        run.pad({"mode": (0, most - run.sizes["mode"])}, keep_attrs=True) if run.sizes.get("mode", most) < most else run
        for run in aligned
    ]
    first, shape = aligned[0], tuple(len(axis) for axis in values.values())
    if any(
        run.sizes != first.sizes or ("time" in first.sizes and not np.allclose(run.time, first.time, rtol=1e-9))
        for run in aligned
    ):
        raise ValueError(
            "build: runs differ in beads or times; leave their windows to be chosen, or use measure= to keep what they "
            "have in common"
        )

    def stacked(name: str) -> tuple[tuple[str, ...], Vector, dict[str, Any]]:
        data = np.stack([run[name].values for run in aligned])
        if len(runs) < len(outcomes):  # points that failed are NaN, or empty text
            data = data.astype(float) if data.dtype.kind in "biu" else data
            every = np.full((len(outcomes), *data.shape[1:]), "" if data.dtype.kind == "U" else np.nan, data.dtype)
            every[list(places)] = data
            data = every
        return (*values, *map(str, first[name].dims)), data.reshape(*shape, *first[name].shape), first[name].attrs

    coordinates: dict[str, Any] = {name: (name, axis_labels(axis)) for name, axis in values.items()}
    for name, coordinate in first.coords.items():
        same = all(np.array_equal(run[name].values, coordinate.values) for run in aligned)
        coordinates[str(name)] = coordinate if same else stacked(str(name))
    variables: dict[str, Any] = {str(name): stacked(str(name)) for name in first.data_vars}
    if len(runs) < len(outcomes):
        errors = np.array([str(outcome) if isinstance(outcome, Failure) else "" for outcome in outcomes]).reshape(shape)
        variables[ERROR_VARIABLE] = tuple(values), errors, {"long_name": "why the point failed, empty where it did not"}
    said = {names[i]: findings_of(run) for i, run in zip(places, runs, strict=True) if findings_of(run)}
    findings = gathered(said, len(outcomes))
    if failures:
        failed = f"sweep: {len(failures)} of {len(outcomes)} points failed, see the variable error; {AGAIN}"
        findings = [failed, *findings]
    return with_warnings(xr.Dataset(variables, coordinates, runs[0].attrs), findings)


def axis_labels(axis: list[Any]) -> list[Any]:
    """Return the numbers and strings unchanged; other objects by their name, or as text."""
    return [
        v if isinstance(v, str | int | float | np.number | np.bool_) else getattr(v, "name", None) or str(v)
        for v in axis
    ]
