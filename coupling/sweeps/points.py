"""The runs of many points: in this process, in several processes, or on the cluster that joblib is configured for."""

import os
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from typing import Any

import joblib
import numpy as np
import xarray as xr
from tqdm.auto import tqdm

from coupling.cosimulation import CoSimulation
from coupling.results.findings import findings_of, with_warnings
from coupling.sweeps.store import ERROR_VARIABLE, Failure, Point, Store, own_sources
from structures.caution import collected
from structures.checks import instance, short
from structures.kernels import compiling
from structures.units import readable

POINT_ERRORS = (ArithmeticError, LookupError, RuntimeError, ValueError)
"""Errors that concern one point alone: its values, its numbers or its convergence. All other errors, such as a full
disk, a missing package or a call with wrong arguments, concern every point."""

Outcome = xr.Dataset | Failure


class Stopped(SystemExit, KeyboardInterrupt):
    """Ctrl-C in a sweep with a store. A script that does not catch it ends with its message, on one line."""


@dataclass(frozen=True)
class Task:
    """The work at every point: run `build(**point)` up to `until` (s), measure, and keep the outcome in a store."""

    build: Callable[..., CoSimulation]
    until: float
    measure: Callable[[xr.Dataset], xr.Dataset] | None = None
    store: Store | None = None
    sources: str = field(default_factory=own_sources)

    goes_on = False
    """Whether other points go on without a store if one fails because of its values."""

    def run(self, point: Point) -> xr.Dataset:
        """Return what is kept of a point's run, with all warnings in its attributes. Errors name the point."""
        with collected() as messages:
            try:
                simulation = self.build(**point)
                instance("build(...)", simulation, CoSimulation, "a CoSimulation")
                run = measured = simulation.run(self.until)
                if self.measure is not None:
                    measured = instance("measure(run)", self.measure(run), xr.Dataset, "a Dataset")
            except (*POINT_ERRORS, OSError, TypeError) as error:
                error.add_note(f"in the sweep's point {shown(point, self.build)}")
                for message in messages:
                    error.add_note(f"warning before it: {message}")
                raise
        if self.store is not None and ERROR_VARIABLE in measured.variables:
            raise ValueError(f"measure: must not return {ERROR_VARIABLE!r}, in which a sweep reports failed points")
        return with_warnings(measured.assign_attrs(run.attrs), [*findings_of(run), *messages])

    def outcome(self, point: Point) -> Outcome:
        """Return the result of a point. If others go on, an error that concerns this point alone becomes a Failure; a
        store keeps the outcome."""
        outcome: Outcome
        try:
            outcome = self.run(point)
        except POINT_ERRORS as error:
            if self.store is None and not self.goes_on:
                raise
            outcome = Failure(type(error).__name__, str(error))
        if self.store is not None:
            try:
                self.store.keep(point, outcome)
            except ValueError as error:
                outcome = Failure("ValueError", str(error))
                self.store.keep(point, outcome)
        return outcome

    def outcomes(self, points: Sequence[Point]) -> list[Outcome]:
        """Return the outcomes of points, which run one after the other in this process."""
        if self.sources != own_sources():
            raise RuntimeError("cluster: a worker has other sources of hertzlink; install the same on all machines")
        return [self.outcome(point) for point in points]


def run_points(
    task: Task, points: Sequence[Point], jobs: int | None = None, together: int = 1, label: str = "sweep"
) -> list[Outcome]:
    """Return the outcomes of points in their order. jobs: the number of processes; by default one for each core, or as
    `joblib.parallel_config` says. together: the number of neighbouring points that run in one process, one after the
    other. Raises RuntimeError if a process dies."""
    groups = [points[begin : begin + together] for begin in range(0, len(points), together)]
    ends: Iterable[list[Outcome]] = map(task.outcomes, groups)
    outcomes: list[Outcome] = []
    try:
        if jobs != 1 and len(groups) > 1:
            compiling.announce()
            parallel = joblib.Parallel(
                jobs or -1, return_as="generator", batch_size=1, initializer=_begin, initargs=(os.getpid(),)
            )
            ends = parallel(joblib.delayed(task.outcomes)(group) for group in groups)
        with progress(len(points), label) as bar:
            for group in ends:
                outcomes += group
                bar.update(len(group))
    except BrokenProcessPool as error:
        raise RuntimeError(
            "a process ended before its work was done: perhaps memory ran out, or it cannot load the function; jobs=1 "
            "shows more, and with store= finished points stay"
        ) from error
    return outcomes


def _begin(owner: int) -> None:
    """Prepare a process of a sweep: it ends soon after its owner was killed, as joblib would wait for work for ever."""
    compiling.EMPTY = False  # the owner has announced the compilation of kernels

    def watch() -> None:
        while os.getppid() == owner:
            time.sleep(1.0)
        os._exit(1)

    if os.getppid() == owner:  # not so in a worker of a cluster
        threading.Thread(target=watch, daemon=True).start()


def progress(total: int, label: str, unit: str = "point") -> Any:
    """Return a progress bar of tqdm, which terminals and notebooks show until it is closed."""
    return tqdm(total=total, desc=label, unit=unit, leave=False, disable=None, dynamic_ncols=True)


def shown(point: Point, build: Callable[..., Any], **units: str) -> str:
    """Return a point for messages: "thickness = 3 mm". Numbers have the units (SI) that are given here, or that the
    builder has in its attribute `units`; others have none."""
    texts, units = [], units | getattr(build, "units", {})
    for name, value in point.items():
        number = isinstance(value, float | int | np.number) and not isinstance(value, bool)
        text = readable(float(value), units.get(name, ""), 6) if number else short(getattr(value, "name", value))
        texts.append(f"{name} = {text}")
    return ", ".join(texts)
