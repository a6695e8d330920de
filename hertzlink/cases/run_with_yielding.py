"""Yielding in a case with elastic contacts: the case runs once more, with Jackson and Green's law."""

from collections.abc import Iterable, Iterator, Sequence
from math import isnan

import xarray as xr

from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import findings_of, with_warnings
from coupling.sweeps.progress import labelled
from coupling.yield_check import is_of_yield
from hertzlink.cases.faults import YIELDING
from hertzlink.cases.running import Task, of_chain, points, run_task, task_of
from structures.caution import caution, collected

WITH_YIELDING = "with_yielding"
"""The attribute of a result that says what yielding changes, for its table and its report."""

MOST = 4
"""Critical distances of one finding."""


def run_both(task: Task, jobs: int | None = None) -> tuple[xr.Dataset, xr.Dataset | None]:
    """Run a task; where contacts are beyond yield, once more with a law of yielding, and the findings say what changes.

    The second result is that with the law, where there is one. A sweep is not repeated: its findings hold estimates.
    """
    yielded = None
    with collected() as said:
        data = run_task(task, jobs)
        if task.kind != "sweep" and any(map(is_of_yield, (*findings_of(data), *said))):
            yielded = _yielded(task, jobs)
            words = "" if yielded is None else _changes(task, data, yielded)
            said[:] = dict.fromkeys(_with(said, words))
            told = words and f"These are of elastic contacts. On a fresh spot the metal yields: {words}."
            data = with_warnings(data, _with(findings_of(data), words)).assign_attrs({WITH_YIELDING: told})
    for message in said:
        caution(message)
    return data, yielded


def _with(findings: Iterable[str], words: str) -> list[str]:
    """Return the findings, with computed changes in the place of estimated ones."""
    return [f"{finding.split('; ')[0]}; {words}" if words and is_of_yield(finding) else finding for finding in findings]


def _yielded(task: Task, jobs: int | None) -> xr.Dataset | None:
    """Return the result with the law; none where the case with the law cannot run."""
    many = task.case.model.chain
    paths = [f"chain[{i}].law" for i in range(len(many))] if isinstance(many, list) else ["chain.law"]
    law = {"kind": "jackson_green"}
    changes = {**dict.fromkeys(paths, law), "measure.numerical_error": False, "sensitivities": None}
    # The user was warned of the same in the first run.
    with collected(), labelled("contacts that yield"):
        try:
            return run_task(task_of(task.case.changed(changes)), jobs)
        except ValueError:
            return None


def _changes(task: Task, data: xr.Dataset, yielded: xr.Dataset) -> str:
    """Return what the law changes, in words."""
    with collected():
        read = _waves if task.along is None else _distances
        return f"with {YIELDING}, {', '.join(read(task, data, yielded))}"


def _waves(task: Task, data: xr.Dataset, yielded: xr.Dataset) -> Iterator[str]:
    for sensor in task.sensors:
        chain = task.case.model.measure.chain
        runs = [of_chain(result, chain) for result in (yielded, data)]
        ratios, flights = ([float(read(run, sensor)) for run in runs] for read in (amplitude_ratio, time_of_flight))
        yield f"AR at bead {sensor} is {_instead(ratios, '.3f')}"
        yield f"TOF {_instead([1e6 * flight for flight in flights], '.1f')} µs"


def _distances(task: Task, data: xr.Dataset, yielded: xr.Dataset) -> Iterator[str]:
    assert task.along is not None
    both = zip(points(task.others, yielded), points(task.others, data), strict=True)
    for number, ((new, _, texts), (old, *_)) in enumerate(both):
        if number == MOST:
            yield "and so on"
            return
        where = [f"{axis.head} {text}" for axis, text in zip(task.others, texts, strict=True)]
        distances = [float(result.critical_distance) / task.along.size for result in (new, old)]
        words = f"the critical distance is {_instead(distances, '.4g')} {task.along.unit}".strip()
        yield f"{words} ({', '.join(where)})" if where else words


def _instead(values: Sequence[float], digits: str) -> str:
    new, old = ("none" if isnan(value) else f"{value:{digits}}" for value in values)
    return f"{new} instead of {old}"
